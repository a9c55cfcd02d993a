//! Codes and steps from reading to reading against the library, for every set that has them.

use super::super::kept_back_fourth::codes::{law, long_run, of_steps};
use super::super::kept_back_ninth::codes::{Next, of_next, steps_of};
use super::super::kept_back_sixth::codes::refitted;
use super::super::kept_back_tenth::codes::Stage;
use super::*;

/// Correlation of neighbours is all that white noise and one pole, or any filter of the library, have of them; the longer
/// lags of a pole follow from it.
pub(super) fn by_neighbours(r: f64, n: usize, strength: f64) -> f64 {
    -(n as f64) * (-r * r).ln_1p() / strength.powi(2)
}

/// Correlation of neighbours among readings that step by these chances.
pub(super) fn of_neighbours(steps: &[Vec<f64>], shares: &[f64]) -> f64 {
    let mean: f64 = shares.iter().enumerate().map(|(i, p)| i as f64 * p).sum();
    let (mut own, mut next) = (0.0, 0.0);
    for (i, (p, row)) in shares.iter().zip(steps).enumerate() {
        let off = i as f64 - mean;
        let then = |(k, q): (usize, &f64)| q * (k as f64 - mean);
        own += p * off * off;
        next += p * off * row.iter().enumerate().map(then).sum::<f64>();
    }
    next / own
}

/// Steps of an axis 0 that are 25 strong, of codes from `first` on, against a pole, by the correlation of neighbours, and
/// against readings that come again at random.
pub(super) fn hold_steps(
    name: &str,
    stand: &Stand,
    first: i32,
    steps: &[Vec<f64>],
    shares: &[f64],
) {
    let normal = refitted(first, shares);
    let r = of_neighbours(steps, shares);
    hold(name, "low_pass", by_neighbours(r, stand.samples(), 25.0));
    let against = |stale: f64| {
        let law = |from: usize, to: usize| {
            stale * f64::from(u8::from(from == to)) + (1.0 - stale) * normal[to]
        };
        of_steps(steps, shares, &law, stand.samples()).powi(2)
    };
    let least = (1..400)
        .map(|k| against(f64::from(k) / 1000.0))
        .fold(f64::INFINITY, f64::min);
    hold(name, "stale_samples", 1.0 - least / against(0.0));
}

/// A law of codes against bits that stick and against a rail at either end, of noise with its mean and variance.
pub(super) fn hold_codes(name: &str, stand: &Stand, first: i32, read: &[f64]) {
    let even = refitted(first, read);
    let whole = of_law(read, &even, stand.samples()).powi(2);
    let share = |law: &[f64]| 1.0 - of_law(read, law, stand.samples()).powi(2) / whole;
    let mut best = f64::NEG_INFINITY;
    for bit in 0..6 {
        for percent in 1..=100 {
            let chance = f64::from(percent) / 100.0;
            for one in [false, true] {
                let mut law: Vec<f64> = even.iter().map(|p| (1.0 - chance) * p).collect();
                for (i, p) in even.iter().enumerate() {
                    let code = first + i as i32;
                    let set = if one {
                        code | 1 << bit
                    } else {
                        code & !(1 << bit)
                    };
                    if let Some(q) = law.get_mut((set - first) as usize) {
                        *q += chance * p;
                    }
                }
                best = best.max(share(&law));
            }
        }
    }
    hold(name, "stuck_bit", best);
    let mut best = f64::NEG_INFINITY;
    for low in 0..even.len() / 2 {
        for high in even.len() / 2..even.len() {
            let mut law = vec![0.0; even.len()];
            law[low..=high].copy_from_slice(&even[low..=high]);
            law[low] += even[..low].iter().sum::<f64>();
            law[high] += even[high + 1..].iter().sum::<f64>();
            best = best.max(share(&law));
        }
    }
    hold(name, "saturation", best);
}

/// A stage of an axis 0 that is 25 strong against bits and rails.
pub(super) fn hold_stage(name: &str, stand: &Stand, stage: &dyn Fn(f64) -> Stage) {
    let of = |size: f64| stage(size).strength(stand, 0);
    let size = crate::strength::size_for(25.0, &of);
    println!("{name}: {:?}", stage(size));
    let (first, read) = stage(size).law(stand, 0);
    hold_codes(name, stand, first, &read);
}

/// Readings of an axis 0 that `next` makes with a chance that is 25 strong, against a pole and stale samples: the first
/// code, the steps and the shares of the codes.
pub(super) fn hold_next(name: &str, stand: &Stand, next: &Next) -> (i32, Vec<Vec<f64>>, Vec<f64>) {
    let of = |chance: f64| of_next(stand, 0, chance.min(1.0), next);
    let chance = crate::strength::size_for(25.0, &of);
    println!("{name}: chance {chance:.2}");
    assert!(chance < 1.0, "{name}");
    let (first, even) = law(stand, 0);
    let steps = steps_of(stand, 0, chance, next);
    let shares = long_run(&steps, &even);
    hold_steps(name, stand, first, &steps, &shares);
    (first, steps, shares)
}

/// The same against some readings of a wider law, each on its own.
pub(super) fn hold_outliers(
    name: &str,
    stand: &Stand,
    first: i32,
    steps: &[Vec<f64>],
    shares: &[f64],
) {
    let (n, normal) = (stand.samples(), refitted(first, shares));
    let against = |law: &[f64]| of_steps(steps, shares, &|_, to| law[to], n).powi(2);
    let code = |i: usize| f64::from(first + i as i32);
    let mean: f64 = shares.iter().enumerate().map(|(i, p)| p * code(i)).sum();
    let off = |i: usize| code(i) - mean;
    let variance: f64 = shares
        .iter()
        .enumerate()
        .map(|(i, p)| p * off(i).powi(2))
        .sum();
    let edges: Vec<f64> = (0..=shares.len()).map(|i| code(i) - 0.5).collect();
    let of_sigma = |sigma: f64| kept_back::shares(&edges, mean, sigma);
    let mut best = f64::NEG_INFINITY;
    for percent in [
        0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0,
    ] {
        for wider in [1.3, 1.6, 2.0, 2.5, 3.0, 4.0, 6.0] {
            let chance = 0.01 * percent;
            // The variance of both together is that of the readings.
            let own = (variance / (1.0 + chance * (wider * wider - 1.0))).sqrt();
            let (near, far) = (of_sigma(own), of_sigma(wider * own));
            let both = near.iter().zip(&far);
            let law: Vec<f64> = both.map(|(n, f)| (1.0 - chance) * n + chance * f).collect();
            best = best.max(1.0 - against(&law) / against(&normal));
        }
    }
    hold(name, "outliers", best);
}
