//! Residuals without what sources make of others.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::{Acceleration, MOST, OneSource, transformed};
use crate::search::searched::Searched;

/// What is left of residuals x with correlations R at a frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    /// Of each axis what those before it do not foretell, L^-1 x with R = L L*: all independent of each other.
    Independent,
    /// Of each axis what all others do not foretell, R^-1 x: each independent of whatever is made of the others' readings.
    Alone,
}

/// What the residuals of an axis were.
#[derive(Default)]
pub(crate) struct Whole {
    e: Vec<f64>,
    u: Vec<f64>,
    told: Option<Vec<f64>>,
}

/// Leaves of the residuals what the sources do not make of axes before them; gives what they were.
pub(crate) fn taken_apart(searched: &mut [Searched<'_>], sources: &[OneSource]) -> Vec<Whole> {
    if sources.is_empty() {
        return vec![];
    }
    let times = |s: &Searched<'_>| s.told.as_ref().map(|told| s.search.panel.dct.inverse(told));
    let e: Vec<Vec<f64>> = searched.iter().map(|s| s.e.clone()).collect();
    let lost = searched.iter().any(|s| s.told.is_some());
    let told: Option<Vec<Vec<f64>>> = lost.then(|| {
        let each = searched.iter().zip(&e);
        let each = each.map(|(s, e)| times(s).unwrap_or_else(|| e.clone()));
        apart(each.collect(), sources, Way::Independent)
    });
    let e = apart(e, sources, Way::Independent);
    let mut whole = vec![];
    for (k, (s, e)) in searched.iter_mut().zip(e).enumerate() {
        let dct = &s.search.panel.dct;
        let u = dct.forward(&e);
        let own = told.as_ref().filter(|_| s.told.is_some());
        let own = own.map(|told| dct.forward(&told[k]));
        whole.push(Whole {
            e: std::mem::replace(&mut s.e, e),
            u: std::mem::replace(&mut s.u, u),
            told: std::mem::replace(&mut s.told, own),
        });
    }
    whole
}

/// The residual of each axis without what the sources make of all others, where there are some.
pub(crate) fn alone(searched: &[Searched<'_>], sources: &[OneSource]) -> Vec<Vec<f64>> {
    if sources.is_empty() {
        return vec![];
    }
    let all = searched.iter().map(|s| s.e.clone());
    apart(all.collect(), sources, Way::Alone)
}

/// Puts residuals back that were taken apart.
pub(crate) fn put_back(searched: &mut [Searched<'_>], whole: Vec<Whole>) {
    for (s, whole) in searched.iter_mut().zip(whole) {
        (s.e, s.u, s.told) = (whole.e, whole.u, whole.told);
    }
}

/// Residuals of all axes without what sources make of others.
fn apart(all: Vec<Vec<f64>>, sources: &[OneSource], way: Way) -> Vec<Vec<f64>> {
    let planner = &mut FftPlanner::new();
    let length = all.first().map_or(0, Vec::len);
    let mut spectra: Vec<Vec<Complex<f64>>> = all.iter().map(|e| transformed(e, planner)).collect();
    // The accelerometers come first: what they tell is known before any axis.
    let read: Vec<&Acceleration> = sources.iter().flat_map(|s| &s.accelerations).collect();
    let known = read.len();
    let axes = known + all.len();
    let mut shares = vec![vec![Complex::default(); axes]; sources.len()];
    for k in 1..length.div_ceil(2) {
        let mut places = 0..known;
        for (source, shares) in sources.iter().zip(&mut shares) {
            for m in &source.members {
                let size = m.coherence.0.min(MOST) * m.weights[k - 1];
                shares[known + m.band.axis] = Complex::from_polar(size, m.phase.0);
            }
            for (a, place) in source.accelerations.iter().zip(&mut places) {
                let size = a.coherence.0.min(MOST) * a.read.weights[k - 1];
                shares[place] = Complex::from_polar(size, -a.phase.0);
            }
        }
        let correlation = |i: usize, j: usize| -> Complex<f64> {
            if i == j {
                return Complex::new(1.0, 0.0);
            }
            shares.iter().map(|a| a[i] * a[j].conj()).sum()
        };
        let of_known = read.iter().map(|a| a.read.values[k]);
        let values = of_known.chain(spectra.iter().map(|z| z[k]));
        let values: Vec<Complex<f64>> = values.collect();
        let left = solved(&correlation, &values, way).into_iter().skip(known);
        for (z, value) in spectra.iter_mut().zip(left) {
            z[k] = value;
            z[length - k] = value.conj();
        }
    }
    let scale = (length as f64).sqrt().recip();
    let back = planner.plan_fft_inverse(length.max(1));
    spectra
        .into_iter()
        .map(|mut z| {
            back.process(&mut z);
            z.iter().map(|v| v.re * scale).collect()
        })
        .collect()
}

/// What is left of `x`, each of variance 1.
fn solved(
    correlation: &dyn Fn(usize, usize) -> Complex<f64>,
    x: &[Complex<f64>],
    way: Way,
) -> Vec<Complex<f64>> {
    let count = x.len();
    let mut lower = vec![vec![Complex::default(); count]; count];
    for i in 0..count {
        for j in 0..i {
            let sum: Complex<f64> = (0..j).map(|k| lower[i][k] * lower[j][k].conj()).sum();
            lower[i][j] = (correlation(i, j) - sum) / lower[j][j].re;
        }
        let rest = 1.0 - lower[i][..i].iter().map(Complex::norm_sqr).sum::<f64>();
        lower[i][i] = Complex::new(rest.max(1.0 - MOST).sqrt(), 0.0);
    }
    let forward = |x: &[Complex<f64>]| {
        let mut solved: Vec<Complex<f64>> = Vec::with_capacity(count);
        for (i, row) in lower.iter().enumerate() {
            let sum: Complex<f64> = row.iter().zip(&solved).map(|(l, s)| l * s).sum();
            solved.push((x[i] - sum) / row[i].re);
        }
        solved
    };
    let independent = forward(x);
    if way == Way::Independent {
        return independent;
    }
    // Row i of R^-1 is that of L^-1* L^-1; of variance 1 by its diagonal.
    let of_unit = |i: usize| {
        let mut unit = vec![Complex::default(); count];
        unit[i] = Complex::new(1.0, 0.0);
        let column = forward(&unit);
        let each = column.iter().zip(&independent);
        let sum: Complex<f64> = each.map(|(c, s)| c.conj() * s).sum();
        sum / column.iter().map(Complex::norm_sqr).sum::<f64>().sqrt()
    };
    (0..count).map(of_unit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_independent_and_of_variance_one() {
        let one = Complex::new(1.0, 0.0);
        let off = [
            Complex::from_polar(0.8, 1.0),
            Complex::from_polar(0.6, -2.0),
            Complex::from_polar(0.7, 0.3),
        ];
        // A source that makes these parts of three axes.
        let correlation = |i: usize, j: usize| if i == j { one } else { off[i] * off[j].conj() };
        for way in [Way::Independent, Way::Alone] {
            // Columns of the matrix that is applied.
            let columns: Vec<Vec<Complex<f64>>> = (0..3)
                .map(|k| {
                    let unit: Vec<_> = (0..3)
                        .map(|i| if i == k { one } else { Complex::default() })
                        .collect();
                    solved(&correlation, &unit, way)
                })
                .collect();
            let with = |i: usize, j: usize, of_second: &dyn Fn(usize, usize) -> Complex<f64>| {
                let mut sum = Complex::default();
                for (a, column) in columns.iter().enumerate() {
                    let each = (0..3).map(|b| correlation(a, b) * of_second(b, j).conj());
                    sum += column[i] * each.sum::<Complex<f64>>();
                }
                sum
            };
            for i in 0..3 {
                let variance = with(i, i, &|b, j| columns[b][j]);
                assert!((variance - 1.0).norm() < 1e-12, "{way:?}: {variance}");
                for j in (0..3).filter(|j| *j != i) {
                    let second = |b: usize, j: usize| match way {
                        Way::Independent => columns[b][j],
                        Way::Alone if b == j => one,
                        Way::Alone => Complex::default(),
                    };
                    let left = with(i, j, &second);
                    assert!(left.norm() < 1e-12, "{way:?} {i} {j}: {left}");
                }
            }
        }
    }
}
