//! Newton's way to the peak of a likelihood with a scale that has a closed form, and the errors there.

use crate::fit::likelihood::invert;

/// Steps of Newton, and halvings of one that leads down.
const STEPS: usize = 6;
const HALVINGS: usize = 5;
/// Longest step in a coordinate, all of which are logarithms.
const LONGEST: f64 = 1.5;
/// Part of a standard error that is near enough.
const NEAR: f64 = 0.02;
/// Information below which a coordinate is not known: a standard error of e^10.
const LEAST: f64 = 1e-2;

/// The peak.
#[derive(Clone, Debug)]
pub(super) struct Peak {
    /// Coordinates.
    pub x: Vec<f64>,
    /// ln of the scale there.
    pub log_scale: f64,
    /// Inverse information of the coordinates; 0 for those that are not known.
    inverse: Vec<Vec<f64>>,
    /// Slope of ln of the scale in each coordinate.
    slope: Vec<f64>,
}

impl Peak {
    /// Standard error of a coordinate.
    pub(super) fn error(&self, i: usize) -> f64 {
        let v = self.inverse[i][i];
        if v > 0.0 { v.sqrt() } else { f64::NAN }
    }

    /// Standard error of ln of the scale of `free` values, and of its sum with a coordinate: the scale at given coordinates is
    /// known to 2 / free, and moves with them.
    pub(super) fn scale_error(&self, free: f64, with: Option<usize>) -> f64 {
        let mut slope = self.slope.clone();
        if let Some(i) = with {
            slope[i] += 1.0;
            if self.error(i).is_nan() {
                return f64::NAN;
            }
        }
        let by = |row: &Vec<f64>| row.iter().zip(&slope).map(|(c, s)| c * s).sum::<f64>();
        let moved: f64 = self
            .inverse
            .iter()
            .zip(&slope)
            .map(|(row, s)| s * by(row))
            .sum();
        (2.0 / free + moved.max(0.0)).sqrt()
    }
}

/// Log likelihood and ln of the scale about a place.
struct Around {
    here: (f64, f64),
    gradient: Vec<f64>,
    information: Vec<Vec<f64>>,
    slope: Vec<f64>,
}

fn around(f: &dyn Fn(&[f64]) -> (f64, f64), x: &[f64], h: &[f64]) -> Around {
    let at = |moves: &[(usize, f64)]| {
        let mut x = x.to_vec();
        moves.iter().for_each(|(i, by)| x[*i] += by * h[*i]);
        f(&x)
    };
    let (m, here) = (x.len(), at(&[]));
    let up: Vec<_> = (0..m).map(|i| at(&[(i, 1.0)])).collect();
    let down: Vec<_> = (0..m).map(|i| at(&[(i, -1.0)])).collect();
    let gradient = (0..m).map(|i| (up[i].0 - down[i].0) / (2.0 * h[i]));
    let slope = (0..m).map(|i| (up[i].1 - down[i].1) / (2.0 * h[i]));
    let mut information = vec![vec![0.0; m]; m];
    for i in 0..m {
        information[i][i] = (2.0 * here.0 - up[i].0 - down[i].0) / (h[i] * h[i]);
        for j in 0..i {
            // Both ways, so that the third derivatives cancel.
            let both = at(&[(i, 1.0), (j, 1.0)]).0 + at(&[(i, -1.0), (j, -1.0)]).0;
            let alone = up[i].0 + down[i].0 + up[j].0 + down[j].0 - 2.0 * here.0;
            information[i][j] = (alone - both) / (2.0 * h[i] * h[j]);
            information[j][i] = information[i][j];
        }
    }
    Around {
        here,
        gradient: gradient.collect(),
        slope: slope.collect(),
        information,
    }
}

/// The inverse of the information of the coordinates that are known.
fn known(information: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let m = information.len();
    let told = |i: usize| information[i][i] > LEAST;
    let part = |i: usize, j: usize| {
        if told(i) && told(j) {
            information[i][j]
        } else {
            0.0
        }
    };
    let all: Vec<Vec<f64>> = (0..m)
        .map(|i| (0..m).map(|j| part(i, j)).collect())
        .collect();
    invert(&all).0
}

/// The highest place of `f`, which gives a log likelihood and ln of its scale, from `start`; `h` are the steps of derivatives.
pub(super) fn climb(
    f: &dyn Fn(&[f64]) -> (f64, f64),
    start: &[f64],
    h: &[f64],
    bounds: &[(f64, f64)],
) -> Peak {
    let mut x = start.to_vec();
    let mut at = around(f, &x, h);
    for _ in 0..STEPS {
        let inverse = known(&at.information);
        let step: Vec<f64> = (inverse.iter())
            .map(|row| {
                row.iter()
                    .zip(&at.gradient)
                    .map(|(c, g)| c * g)
                    .sum::<f64>()
            })
            .map(|v| v.clamp(-LONGEST, LONGEST))
            .collect();
        let near = |i: usize| step[i].abs() <= NEAR * inverse[i][i].max(0.0).sqrt();
        if (0..x.len()).all(near) {
            break;
        }
        let moved = |part: f64| -> Vec<f64> {
            let all = x.iter().zip(&step).zip(bounds);
            all.map(|((x, s), b)| (x + part * s).clamp(b.0, b.1))
                .collect()
        };
        let parts = (0..HALVINGS).map(|k| 0.5f64.powi(k as i32));
        let better = parts.map(moved).find(|y| f(y).0 > at.here.0);
        let Some(y) = better else { break };
        x = y;
        at = around(f, &x, h);
    }
    Peak {
        inverse: known(&at.information),
        x,
        log_scale: at.here.1,
        slope: at.slope,
    }
}
