//! Normal equations of weighted least squares, and their solution.

use std::sync::Arc;

use numerics::column::dot;
use numerics::wide;

/// Weighted least squares under one noise shape.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Profile log likelihood, nats, up to a constant of the length.
    pub log_likelihood: f64,
    /// White variance, maximum likelihood.
    pub white: f64,
    /// Residual sum of squares over g.
    pub rss: f64,
    /// Coefficients of the columns.
    pub beta: Vec<f64>,
    /// Inverse of the normal matrix (covariance of beta over the white variance).
    pub inverse: Vec<Vec<f64>>,
    /// ln det of the normal matrix.
    pub log_det_normal: f64,
    /// Sum of ln g.
    pub log_det_noise: f64,
}

/// Sums of products over the bins: of the data and the columns, each with itself and those behind it.
pub(super) struct Sums {
    pub(super) columns: usize,
    pub(super) pairs: Vec<Arc<Vec<f64>>>,
}

impl Sums {
    /// Under weights over the bins.
    pub(super) fn under(&self, weight: &[f64]) -> Normal {
        let mut all = dots(&self.pairs, weight).into_iter();
        let mut next = |count: usize| -> Vec<f64> { all.by_ref().take(count).collect() };
        let (total, right) = (next(1)[0], next(self.columns));
        let mut matrix = vec![vec![0.0; self.columns]; self.columns];
        for a in 0..self.columns {
            let beyond = next(self.columns - a);
            for (own, v) in matrix[a..].iter_mut().zip(&beyond) {
                own[a] = *v;
            }
            matrix[a][a..].copy_from_slice(&beyond);
        }
        Normal {
            matrix,
            right,
            total,
        }
    }
}

wide! {
    /// Sums of products with weights.
    fn dots[](all: &[Arc<Vec<f64>>], weight: &[f64]) -> Vec<f64> = dots_of
}

#[inline(always)]
fn dots_of(all: &[Arc<Vec<f64>>], weight: &[f64]) -> Vec<f64> {
    let mut sums = Vec::with_capacity(all.len());
    for of in all {
        sums.push(dot(of, weight));
    }
    sums
}

/// Sums of products over g that least squares need: of columns with each other, of the data with them and with themselves.
#[derive(Clone, Debug)]
pub(crate) struct Normal {
    pub(crate) matrix: Vec<Vec<f64>>,
    pub(crate) right: Vec<f64>,
    pub(crate) total: f64,
}

impl Normal {
    /// Least squares of `n` coefficients.
    pub(crate) fn solved(&self, n: f64, log_det_noise: f64) -> Solution {
        let Self { right, total, .. } = self;
        let (inverse, log_det_normal) = invert(&self.matrix);
        let beta: Vec<f64> = inverse
            .iter()
            .map(|row| row.iter().zip(right).map(|(a, b)| a * b).sum())
            .collect();
        let explained: f64 = beta.iter().zip(right).map(|(a, b)| a * b).sum();
        let rss = (total - explained).max(total * 1e-12);
        let white = rss / n;
        let log_likelihood = -0.5 * (n * white.ln() + log_det_noise);
        Solution {
            log_likelihood,
            white,
            rss,
            beta,
            inverse,
            log_det_normal,
            log_det_noise,
        }
    }
}

/// Inverse and ln det of a symmetric positive matrix; a direction without information gets no coefficient.
#[must_use]
pub fn invert(a: &[Vec<f64>]) -> (Vec<Vec<f64>>, f64) {
    let m = a.len();
    let scale: Vec<f64> = (0..m)
        .map(|i| if a[i][i] > 0.0 { a[i][i].sqrt() } else { 1.0 })
        .collect();
    let mut work: Vec<Vec<f64>> = (0..m)
        .map(|i| (0..m).map(|j| a[i][j] / (scale[i] * scale[j])).collect())
        .collect();
    let mut log_det = 0.0;
    // Gauss-Jordan by sweeps: a pivot below 1e-9 is a column that the others already span.
    let mut swept = vec![false; m];
    for k in 0..m {
        let pivot = work[k][k];
        if pivot < 1e-9 {
            continue;
        }
        swept[k] = true;
        log_det += pivot.ln() + 2.0 * scale[k].ln();
        let row: Vec<f64> = work[k].clone();
        for (_, other) in work.iter_mut().enumerate().filter(|(i, _)| *i != k) {
            let f = other[k] / pivot;
            for (j, v) in other.iter_mut().enumerate().filter(|(j, _)| *j != k) {
                *v -= f * row[j];
            }
            other[k] = f;
        }
        for j in 0..m {
            work[k][j] = if j == k { -1.0 / pivot } else { row[j] / pivot };
        }
    }
    let inverse = (0..m)
        .map(|i| {
            (0..m)
                .map(|j| {
                    if swept[i] && swept[j] {
                        -work[i][j] / (scale[i] * scale[j])
                    } else {
                        0.0
                    }
                })
                .collect()
        })
        .collect();
    (inverse, log_det)
}
