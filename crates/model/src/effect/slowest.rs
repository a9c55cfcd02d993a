//! What is left of a white noise at the slowest frequencies, by which an angle grows, behind filters and behind what holds readings.

use std::f64::consts::PI;

use super::{Effect, Frequencies, Parameters};

/// Frames of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frames {
    /// How many.
    pub samples: usize,
    /// Their rate, Hz.
    pub rate_hz: f64,
}

/// Readings that stand for more frames than their own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// Mean square of the frames that a reading stands for, over their mean: by so much more a sum of independent readings
    /// varies than one of as many that are not held.
    pub gain: f64,
    /// Frames from a reading to those that it stands for in the place of their own.
    pub reach: usize,
    /// Frames from one reading to the next, where they come evenly.
    pub every: Option<f64>,
}

/// Least part that is left of the slowest: nothing that holds readings takes it away.
const LEAST: f64 = 0.5;
/// Frames beyond which no filter makes readings alike.
const FARTHEST: f64 = 200.0;
/// Frequencies at which a filter's density tells how alike neighbours are.
const PLACES: usize = 2048;

/// What the slowest of a white noise is, in variance over that of the readings, where it went through some effects; 1 behind none
/// that filters or holds it. A filter passes the slowest as it is, so that this is the noise before it. What holds readings gives
/// some of them the weight of others: so much is added as those differ from each other.
///
/// A sum of readings x that stand for W frames each, of mean 1, has the slow density sum over d of c(d) (1 + cov W(d)): S(0) of the
/// readings, and of W, whose sum is known, the variance `gain - 1` at d = 0 and as much less where it is taken. Readings that come evenly
/// are summed one by one.
pub fn slowest<'a>(
    effects: impl Iterator<Item = (&'a dyn Effect, &'a Parameters)> + Clone,
    frames: Frames,
) -> f64 {
    let all = effects.clone();
    let held: Vec<Held> = all.filter_map(|(e, p)| e.holds(p, frames)).collect();
    let at = |omega| {
        let at = Frequencies::at(omega);
        let mut density = vec![1.0; at.omega.len()];
        for of in effects.clone().filter_map(|(e, p)| e.passes(p, &at)) {
            density.iter_mut().zip(of).for_each(|(d, of)| *d *= of);
        }
        density
    };
    let slow = at(vec![0.0])[0];
    if held.is_empty() {
        return slow;
    }
    let omega = |k: usize| PI * (k as f64 + 0.5) / PLACES as f64;
    let density = at((0..PLACES).map(omega).collect());
    let whole: f64 = density.iter().sum();
    let alike = |lag: usize| {
        let parts = density.iter().enumerate();
        let sum: f64 = parts.map(|(k, d)| d * (omega(k) * lag as f64).cos()).sum();
        sum / whole
    };
    // Between whole frames a reading comes at either, as often as it is nearer.
    let between = |lag: f64| {
        let (below, part) = (lag.floor() as usize, lag.fract());
        (1.0 - part) * alike(below) + part * alike(below + 1)
    };
    let even = |held: &Held, every: f64| {
        let later = (1..=(FARTHEST / every) as usize).map(|j| between(j as f64 * every));
        let uneven = (held.gain - every).max(0.0) * (1.0 - between(every));
        every * (1.0 + 2.0 * later.sum::<f64>()) + uneven - slow
    };
    let differ = |held: &Held| {
        let reach = held.reach.clamp(1, PLACES / 8);
        1.0 - (1..=reach).map(alike).sum::<f64>() / reach as f64
    };
    let added = held.iter().map(|held| match held.every {
        Some(every) => even(held, every),
        None => (held.gain - 1.0) * differ(held),
    });
    (slow + added.sum::<f64>()).max(slow * LEAST)
}
