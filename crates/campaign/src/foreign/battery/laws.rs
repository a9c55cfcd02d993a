//! The same of laws of variance, of codes, and of steps from reading to reading.

use model::effect::{Hypothesis, VarianceLaw};
use model::effects::EFFECTS;

use super::super::known::{Law, of_law, of_steps};
use super::library::{Kind, best_process, hypotheses};
use crate::series::{about_mean, each_pair, mean, one_if};
use crate::stand::Stand;
use crate::strength::{Meter, of_variance};

/// Share of the gain of a law of variance of an axis that each law of the library describes.
pub(super) fn of_variance_laws(
    stand: &Stand,
    axis: usize,
    law: &[f64],
) -> Vec<(&'static str, f64)> {
    let whole = of_variance(law).powi(2);
    let (n, mean) = (law.len() as f64, mean(law));
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
        VarianceLaw::Shape { shape, .. } => {
            let fewer = (1..10).map(|k| -0.1 * f64::from(k));
            let more = (0..20).map(|k| 0.1 * 1.3f64.powi(k));
            let gains = fewer.chain(more).map(|a| gain(&|i| 1.0 + a * shape[i]));
            gains.fold(0.0, f64::max)
        }
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

/// Share of `gain` that a pole has: correlation of neighbours is all that white noise and one pole, or any filter of the
/// library, have of them; the longer lags of a pole follow from it.
pub(super) fn by_neighbours(r: f64, n: usize, gain: f64) -> f64 {
    -(n as f64) * (-r * r).ln_1p() / gain
}

/// Correlation of neighbours in a series.
pub(super) fn of_series(x: &[f64]) -> f64 {
    let x = about_mean(x);
    let square: f64 = x.iter().map(|v| v * v).sum();
    x.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / square
}

/// Correlation of neighbours among readings that step by these chances.
fn of_neighbours(law: &Law, steps: &[Vec<f64>]) -> f64 {
    let mean: f64 = law.codes().map(|(code, p)| f64::from(code) * p).sum();
    let off = |code: i32| f64::from(code) - mean;
    let (mut own, mut next) = (0.0, 0.0);
    for ((code, p), row) in law.codes().zip(steps) {
        let then = (law.first..).zip(row).map(|(code, q)| q * off(code));
        own += p * off(code).powi(2);
        next += p * off(code) * then.sum::<f64>();
    }
    next / own
}

/// Share of what readings that step by these chances gain that a pole has, by the correlation of neighbours, and readings
/// that come again at random.
pub(super) fn of_step_laws(
    stand: &Stand,
    law: &Law,
    steps: &[Vec<f64>],
    gain: f64,
) -> [(&'static str, f64); 2] {
    let (normal, n) = (law.refitted(), stand.samples());
    let filtered = by_neighbours(of_neighbours(law, steps), n, gain);
    let against = |stale: f64| {
        let other = |from, to| stale * one_if(from == to) + (1.0 - stale) * normal[to];
        of_steps(steps, &law.shares, &other, n).powi(2)
    };
    let tried = (1..400).map(|k| against(f64::from(k) / 1000.0));
    let least = tried.fold(f64::INFINITY, f64::min);
    [
        ("low_pass", filtered),
        ("stale_samples", 1.0 - least / against(0.0)),
    ]
}

/// Share of what a law of codes gains that a bit that sticks has, and a rail at either end, of noise with its mean and
/// variance.
pub(super) fn of_code_laws(stand: &Stand, read: &Law) -> [(&'static str, f64); 2] {
    let even = read.with(read.refitted());
    let against = |law: &[f64]| of_law(&read.shares, law, stand.samples()).powi(2);
    let whole = against(&even.shares);
    let share = |law: &[f64]| 1.0 - against(law) / whole;
    let (mut stuck, mut rail) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    for bit in (0..6).map(|bit| 1 << bit) {
        for chance in (1..=100).map(|percent| f64::from(percent) / 100.0) {
            for law in [
                even.mapped(chance, |code| code | bit),
                even.mapped(chance, |code| code & !bit),
            ] {
                stuck = stuck.max(share(&law.shares));
            }
        }
    }
    let even = even.shares;
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
