//! The same of laws of variance, of codes, and of steps from reading to reading.

use model::effect::{Hypothesis, VarianceLaw};
use model::effects::EFFECTS;

use super::super::known::{of_law, of_steps, refitted};
use super::super::words::each_pair;
use super::library::{Kind, best_process, hypotheses};
use crate::stand::Stand;
use crate::strength::{Meter, of_variance};

/// Share of the gain of a law of variance of an axis that each law of the library describes.
pub(super) fn of_variance_laws(
    stand: &Stand,
    axis: usize,
    law: &[f64],
) -> Vec<(&'static str, f64)> {
    let whole = of_variance(law).powi(2);
    let n = law.len() as f64;
    let mean = law.iter().sum::<f64>() / n;
    // The level is refitted beside the shape.
    let gain = |shape: &dyn Fn(usize) -> f64| {
        let (mut sum, mut logs) = (0.0, 0.0);
        for (i, v) in law.iter().enumerate() {
            sum += v / shape(i);
            logs += shape(i).ln();
        }
        n * mean.ln() - n * (sum / n).ln() - logs
    };
    let best = |how: &VarianceLaw| match how {
        VarianceLaw::Shape { shape, .. } => (-9..20)
            .map(|k| {
                if k < 0 {
                    0.1 * f64::from(k)
                } else {
                    0.1 * 1.3f64.powi(k)
                }
            })
            .map(|a| gain(&|i| 1.0 + a * shape[i]))
            .fold(0.0, f64::max),
        VarianceLaw::Segment => of_segments(law, mean),
    };
    let mut all = vec![];
    for effect in EFFECTS {
        for h in hypotheses(*effect, stand, axis) {
            if let Hypothesis::Variance(how) = h {
                all.push((effect.id(), best(&how) / whole));
            }
        }
    }
    all
}

/// What the best stretch of another level gains of a law of variance of this mean.
fn of_segments(law: &[f64], mean: f64) -> f64 {
    const STEP: usize = 100;
    let n = law.len() as f64;
    let mut best = 0.0f64;
    for from in (0..law.len()).step_by(STEP) {
        let mut sum = 0.0;
        for to in (from + STEP..=law.len()).step_by(STEP) {
            sum += law[to - STEP..to].iter().sum::<f64>();
            let length = (to - from) as f64;
            let (inside, share) = (sum / length, length / n);
            let outside = (mean * n - sum) / (n - length).max(1.0);
            let left = share * inside.ln() + (1.0 - share) * outside.max(1e-9).ln();
            best = best.max(n * (mean.ln() - left));
        }
    }
    best
}

/// Share of `gain`, a d'^2, that the best process of the library describes of a white noise of which this is the change by
/// bin, as a share of it, and of a process of this density beside it.
pub(super) fn of_processes(
    stand: &Stand,
    axis: usize,
    by: &[f64],
    beside: &[f64],
    gain: f64,
) -> (&'static str, f64) {
    let (meter, white) = (Meter::new(stand, axis), stand.white(axis));
    let own = |b: usize| white * by.get(b).unwrap_or(&0.0) + beside.get(b).unwrap_or(&0.0);
    let density: Vec<f64> = (0..meter.counts().len()).map(own).collect();
    let added = each_pair(meter.counts(), &density, |m, d| m * d);
    let expected = each_pair(&meter.noise(), &added, |n, a| (n + a).max(1e-9 * n));
    let (id, share) = best_process(stand, axis, &expected, Kind::Noise);
    // Of what changes through the run a process has the mean spectrum alone.
    (id, share * meter.of_density(&density).powi(2) / gain)
}

/// Correlation of neighbours is all that white noise and one pole, or any filter of the library, have of them; the longer
/// lags of a pole follow from it.
pub(super) fn by_neighbours(r: f64, n: usize, strength: f64) -> f64 {
    -(n as f64) * (-r * r).ln_1p() / strength.powi(2)
}

/// Correlation of neighbours in a series.
pub(super) fn of_series(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    let square: f64 = x.iter().map(|v| (v - mean).powi(2)).sum();
    let products = x.windows(2).map(|w| (w[0] - mean) * (w[1] - mean));
    products.sum::<f64>() / square
}

/// Correlation of neighbours among readings that step by these chances.
fn of_neighbours(steps: &[Vec<f64>], shares: &[f64]) -> f64 {
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

/// Share of what readings that step by these chances gain that a pole has, by the correlation of neighbours, and readings
/// that come again at random.
pub(super) fn of_step_laws(
    stand: &Stand,
    first: i32,
    steps: &[Vec<f64>],
    shares: &[f64],
    strength: f64,
) -> [(&'static str, f64); 2] {
    let (normal, n) = (refitted(first, shares), stand.samples());
    let filtered = by_neighbours(of_neighbours(steps, shares), n, strength);
    let against = |stale: f64| {
        let law = |from: usize, to: usize| {
            stale * f64::from(u8::from(from == to)) + (1.0 - stale) * normal[to]
        };
        of_steps(steps, shares, &law, n).powi(2)
    };
    let least = (1..400)
        .map(|k| against(f64::from(k) / 1000.0))
        .fold(f64::INFINITY, f64::min);
    [
        ("low_pass", filtered),
        ("stale_samples", 1.0 - least / against(0.0)),
    ]
}

/// Codes of which this bit is `one`, or not, with a chance.
fn with_stuck_bit(even: &[f64], first: i32, bit: u32, one: bool, chance: f64) -> Vec<f64> {
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
    law
}

/// Share of what a law of codes gains that a bit that sticks has, and a rail at either end, of noise with its mean and
/// variance.
pub(super) fn of_code_laws(stand: &Stand, first: i32, read: &[f64]) -> [(&'static str, f64); 2] {
    let even = refitted(first, read);
    let whole = of_law(read, &even, stand.samples()).powi(2);
    let share = |law: &[f64]| 1.0 - of_law(read, law, stand.samples()).powi(2) / whole;
    let (mut stuck, mut rail) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    for bit in 0..6 {
        for percent in 1..=100 {
            for one in [false, true] {
                let law = with_stuck_bit(&even, first, bit, one, f64::from(percent) / 100.0);
                stuck = stuck.max(share(&law));
            }
        }
    }
    for low in 0..even.len() / 2 {
        for high in even.len() / 2..even.len() {
            let mut law = vec![0.0; even.len()];
            law[low..=high].copy_from_slice(&even[low..=high]);
            law[low] += even[..low].iter().sum::<f64>();
            law[high] += even[high + 1..].iter().sum::<f64>();
            rail = rail.max(share(&law));
        }
    }
    [("stuck_bit", stuck), ("saturation", rail)]
}
