//! Noise of a filter's correlations, drawn out of white noise.

use super::shapes::{FLOOR, inverse_spline, spline};

/// A mean of a sample and the one before, weights 1 : w, of the lag-1 correlation w / (1 + w^2) <= 1/2; sum of squares 1.
pub(super) fn two_samples(rho: f64) -> Vec<f64> {
    let w = if rho > 0.0 {
        (1.0 - (1.0 - 4.0 * rho * rho).sqrt()) / (2.0 * rho)
    } else {
        0.0
    };
    let norm = (1.0 + w * w).sqrt();
    vec![1.0 / norm, w / norm]
}

/// Taps of a noise that has the correlations of a triangular window of that lag-1 correlation, sum of squares 1: the factor
/// of its density without zeros outside the unit circle (Wilson's iteration, SIAM J. Numer. Anal. 6, 1969).
pub(super) fn window(rho: f64) -> Vec<f64> {
    let unit = inverse_spline(rho);
    let all = (0..)
        .map(|l| spline(f64::from(l) * unit))
        .take_while(|r| *r > 0.0);
    let mut r: Vec<f64> = all.collect();
    r[0] += FLOOR;
    let lags = r.len();
    let mut b = vec![0.0; lags];
    b[0] = r.iter().map(|v| v.abs()).sum::<f64>().sqrt();
    for _ in 0..FACTORING {
        // The next factor x of b solves sum_i (b_i x_{i+l} + x_i b_{i+l}) = r_l + (correlation of b at l).
        let mut a = vec![vec![0.0; lags]; lags];
        let mut right = r.clone();
        for (l, (row, right)) in a.iter_mut().zip(&mut right).enumerate() {
            for i in 0..lags - l {
                row[i + l] += b[i];
                row[i] += b[i + l];
                *right += b[i] * b[i + l];
            }
        }
        b = solved(a, right);
    }
    let norm = b.iter().map(|v| v * v).sum::<f64>().sqrt();
    b.iter_mut().for_each(|v| *v /= norm);
    b
}

/// Iterations of [`window`]: they converge quadratically but near a zero of the density, where each halves what is off.
const FACTORING: usize = 40;

/// The solution of a x = right, by elimination with pivots.
fn solved(mut a: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let m = right.len();
    for k in 0..m {
        let best = (k..m)
            .max_by(|i, j| a[*i][k].abs().total_cmp(&a[*j][k].abs()))
            .unwrap_or(k);
        a.swap(k, best);
        right.swap(k, best);
        for i in k + 1..m {
            let f = a[i][k] / a[k][k];
            let (above, below) = a.split_at_mut(i);
            below[0]
                .iter_mut()
                .zip(&above[k])
                .for_each(|(v, u)| *v -= f * u);
            right[i] -= f * right[k];
        }
    }
    for k in (0..m).rev() {
        let known: f64 = (k + 1..m).map(|j| a[k][j] * right[j]).sum();
        right[k] = (right[k] - known) / a[k][k];
    }
    right
}

/// A moving average in place; what lies before the first sample is the end, so that the first readings scatter as all do.
pub(super) fn averaged(noise: &mut [f64], taps: &[f64]) {
    let (before, given) = (taps.len().min(noise.len() + 1) - 1, noise.to_vec());
    let wrapped: Vec<f64> = [&given[given.len() - before..], &given].concat();
    let backwards: Vec<f64> = taps[..=before].iter().rev().copied().collect();
    for (v, all) in noise.iter_mut().zip(wrapped.windows(before + 1)) {
        *v = all.iter().zip(&backwards).map(|(a, t)| a * t).sum();
    }
}

/// One pole with the correlations rho and pole * rho at lags 1 and 2, in place, variance kept: x' = pole x + e' + theta e.
pub(super) fn behind_a_window(noise: &mut [f64], rho: f64, pole: f64) {
    let off = rho - pole;
    let own = 1.0 + pole * pole - 2.0 * pole * rho;
    let theta = 2.0 * off / (own + (own * own - 4.0 * off * off).max(0.0).sqrt());
    let step = ((1.0 - pole * pole) / (1.0 + 2.0 * pole * theta + theta * theta)).sqrt();
    let mut before = noise.first().copied().unwrap_or(0.0);
    let mut x = before;
    for v in noise.iter_mut().skip(1) {
        let drawn = *v;
        x = pole * x + step * (drawn + theta * before);
        (*v, before) = (x, drawn);
    }
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    #[test]
    fn a_pole_behind_a_window_has_its_two_correlations() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut noise: Vec<f64> = (0..200_000)
            .map(|_| StandardNormal.sample(&mut rng))
            .collect();
        behind_a_window(&mut noise, 0.65, 0.5);
        let at = |lag: usize| {
            let both = noise.iter().zip(&noise[lag..]).map(|(a, b)| a * b);
            both.sum::<f64>() / noise.len() as f64
        };
        for (lag, wanted) in [(0, 1.0), (1, 0.65), (2, 0.325), (3, 0.1625)] {
            // Four standard errors of 200 000 samples that are alike over three.
            assert!((at(lag) - wanted).abs() < 0.016, "{lag}: {}", at(lag));
        }
    }

    #[test]
    fn what_is_simulated_has_the_correlations_that_are_fitted() {
        for rho in [0.1, 0.25, 0.5, 0.8] {
            let unit = inverse_spline(rho);
            let taps = window(rho);
            for lag in 0..taps.len() {
                let found: f64 = taps.iter().zip(&taps[lag..]).map(|(a, b)| a * b).sum();
                let floor = if lag == 0 { FLOOR } else { 0.0 };
                let wanted = (spline(lag as f64 * unit) + floor) / (1.0 + FLOOR);
                assert!(
                    (found - wanted).abs() < 1e-3,
                    "{rho}, lag {lag}: {found} {wanted}"
                );
            }
        }
    }
}
