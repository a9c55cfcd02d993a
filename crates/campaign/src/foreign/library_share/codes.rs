//! Codes and steps from reading to reading against the library, for every set that has them.

use super::super::kept_back_fourth::codes::of_steps;
use super::super::kept_back_sixth::codes::refitted;
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
