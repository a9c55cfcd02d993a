//! When a step came: the mean of its time and an interval about it, each place as likely as the readings about it make it.
//!
//! The likelihood of a change point is no parabola: each reading that is on the wrong side of it costs what it tells. With the
//! residual e whitened and divided by the laws of its variance, and d_i what a unit at reading i is in it, a step of height h that
//! came at reading t instead of s leaves e + h (d_s + ... + d_(t-1)), or e - h (d_t + ... + d_(s-1)). A scan at even noise does not
//! know the laws, so it is done here once more.
//!
//! What makes a bias step is often a blow, and a blow rings: for some readings behind the step nothing is known of the level. A
//! time counts with the readings behind it as they are, and with the first of them as loud as a blow makes them, for every length
//! that a blow has. Lost readings tell nothing.

use model::effects::shock::LONGEST_S;

use crate::fit::channel::{Form, by_model};
use crate::search::searched::Searched;
use numerics::tails::TWO_SIDED;

/// Readings to either side that are looked at, over the square of noise over height: a hundred times the spread of the place of a
/// change point in white noise is some 5 times that square.
const REACH: f64 = 100.0;
/// Fewest and most of them.
const LEAST_REACH: f64 = 16.0;
const MOST_REACH: f64 = 8192.0;
/// Readings to either side of one that whitening puts parts of it into: farther off they are nothing beside it.
const MEMORY: usize = 64;
/// Rings are that many times as loud as the noise, one as likely as the other: hardly seen, and far off.
const LOUD: [f64; 2] = [4.0, 16.0];
/// Chance that a step came with a blow: nothing is known of it.
const BLOWS: f64 = 0.5;
/// Instants between two readings that stand for all: 95 % of an even chance end in the middle of the outermost ones.
const INSTANTS: u32 = 20;
/// Part of the chances that is within 1.96 standard errors: a time that is told is told with an interval, and the chances have
/// longer tails than a normal law of their spread.
const HELD: f64 = 0.95;

/// What a place is told by.
struct Told<'a> {
    /// Residual, whitened, of variance 1; not a number where a reading is lost.
    e: &'a [f64],
    /// What a unit at one reading is in it, at places from `MEMORY` before to `MEMORY` behind that.
    unit: &'a [f64],
    /// Variance by the laws, 1 without one.
    law: &'a dyn Fn(usize) -> f64,
    /// Longest ring, readings.
    ring: usize,
}

impl Told<'_> {
    /// Nats that each place from `from` to `to` gains over `at`, where the residual has a step of `height`.
    fn gains(&self, at: usize, height: f64, (from, to): (usize, usize)) -> Vec<f64> {
        let mut gains = vec![0.0; to - from + 1];
        for forward in [true, false] {
            let (mut e, mut own, mut place) = (self.e.to_vec(), 0.0, at);
            gains[at - from] = self.with_a_ring(&e, at);
            while place != if forward { to } else { from } {
                let (moved, by) = match forward {
                    true => (place, height),
                    false => (place - 1, -height),
                };
                own += self.moved(&mut e, moved, by);
                place = if forward { place + 1 } else { place - 1 };
                gains[place - from] = own + self.with_a_ring(&e, place);
            }
        }
        gains
    }

    /// Puts a reading on the other side of the step; the nats that the residual gains.
    fn moved(&self, e: &mut [f64], reading: usize, by: f64) -> f64 {
        let mut gained = 0.0;
        for (k, unit) in self.unit.iter().enumerate() {
            let Some(i) = (reading + k).checked_sub(MEMORY).filter(|i| *i < e.len()) else {
                continue;
            };
            if e[i].is_finite() {
                let before = e[i];
                e[i] += by * unit / (self.law)(i).sqrt();
                gained += 0.5 * (before.powi(2) - e[i].powi(2));
            }
        }
        gained
    }

    /// Nats that a residual gains where it may ring from a place on.
    fn with_a_ring(&self, e: &[f64], place: usize) -> f64 {
        let loud = LOUD.map(|by| 1.0 + by * by);
        let mut sums = [0.0; LOUD.len()];
        let mut rings = 0.0;
        for e in e[place..].iter().take(self.ring) {
            for (sum, v) in sums.iter_mut().zip(loud) {
                if e.is_finite() {
                    *sum += 0.5 * (e * e * (1.0 - 1.0 / v) - v.ln());
                }
                rings += sum.exp();
            }
        }
        let each = BLOWS / (self.ring * LOUD.len()) as f64;
        (1.0 - BLOWS + each * rings).min(f64::MAX).ln()
    }

    /// Mean of the instant, in readings, and the standard error whose interval of 95 % about it has that part of the chances.
    fn place(&self, at: usize, height: f64, margin: usize) -> Option<(f64, f64)> {
        let size = height.abs() * self.unit[MEMORY] / (self.law)(at).sqrt();
        let reach = (REACH / size.powi(2)).clamp(LEAST_REACH, MOST_REACH) as usize + self.ring;
        let from = at.saturating_sub(reach).max(margin);
        let to = (at + reach).min(self.e.len().saturating_sub(margin));
        if !(from..=to).contains(&at) {
            return None;
        }
        let gains = self.gains(at, height, (from, to));
        let most = gains.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // A reading shows a step that came at any instant since the one before it.
        let instants = (from..).zip(&gains).flat_map(|(place, gain)| {
            let weight = (gain - most).exp();
            let before = (0..INSTANTS).map(|k| (f64::from(k) + 0.5) / f64::from(INSTANTS));
            before.map(move |before| (place as f64 - at as f64 - before, weight))
        });
        let instants: Vec<(f64, f64)> = instants.collect();
        let sum: f64 = instants.iter().map(|(_, w)| w).sum();
        let mean = instants.iter().map(|(off, w)| w * off).sum::<f64>() / sum;
        let mut off: Vec<(f64, f64)> = instants
            .into_iter()
            .map(|(t, w)| ((t - mean).abs(), w))
            .collect();
        off.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let mut within = 0.0;
        let far = off.iter().find(|(_, w)| {
            within += w;
            within >= HELD * sum
        });
        Some((at as f64 + mean, far.map_or(0.0, |f| f.0) / TWO_SIDED))
    }
}

/// The times of the steps of a channel, by its residual after everything else was found.
pub(crate) fn settle(s: &mut Searched<'_>) {
    let rate_hz = s.search.view.rate_hz;
    let margin = (0.5 * rate_hz).max(4.0) as usize;
    let (n, panel) = (s.e.len(), &s.search.panel);
    let steps = s.state.terms.iter().zip(&s.found).enumerate();
    let steps: Vec<(usize, usize, f64)> = steps
        .filter_map(|(k, (t, found))| match t.form {
            Form::Step(at, _) => Some((k, at.ceil() as usize, found.coefficients.first()?.0)),
            _ => None,
        })
        .collect();
    // What the noise is as a level that is known sample by sample leaves it has another whitening.
    if steps.is_empty() || s.state.level.is_some() {
        return;
    }
    let mut e = s.e.clone();
    let lost = s.target.lost.iter().filter(|i| **i < n);
    lost.for_each(|i| e[*i] = f64::NAN);
    let product = s.variance.product();
    let law = |i: usize| product.map_or(1.0, |law| law[i]);
    for (k, at, height) in steps {
        if at < margin || at + margin > n {
            continue;
        }
        let mut impulse = vec![0.0; n];
        impulse[at] = 1.0;
        let r = panel.dct.forward(&impulse);
        let (_, unit) = by_model(panel, &r, &s.state.noise, s.state.solution.white);
        let near = (at + n).saturating_sub(MEMORY)..=at + n + MEMORY;
        let unit: Vec<f64> = near
            .map(|i| {
                i.checked_sub(n)
                    .and_then(|i| unit.get(i))
                    .copied()
                    .unwrap_or(0.0)
            })
            .collect();
        let told = Told {
            e: &e,
            unit: &unit,
            law: &law,
            ring: ((LONGEST_S * rate_hz) as usize).max(1),
        };
        let Some((place, error)) = told.place(at, height, margin) else {
            continue;
        };
        if let Some(time) = s.found[k].location.first_mut() {
            *time = (place / rate_hz, error / rate_hz);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::white;

    /// Readings of a record, the place of the step in it, and the longest ring.
    const N: usize = 2000;
    const RING: usize = 20;
    /// Draws of each, and the least part that holds: 95 % less 3 standard deviations of so many.
    const DRAWS: u64 = 300;
    const LEAST: f64 = 0.912;

    /// Part of draws whose interval of 95 % has the instant in it: of a step of `height`, with a ring behind it, in noise of that
    /// variance.
    fn covered(height: f64, ring: &dyn Fn(u64, f64) -> f64, law: &dyn Fn(usize) -> f64) -> f64 {
        let mut unit = vec![0.0; 2 * MEMORY + 1];
        unit[MEMORY] = 1.0;
        let holds = |seed: &u64| {
            let noise = white(N, 100 + seed);
            // An instant between two readings, and the place where the likelihood of the readings alone is largest.
            let truth = 900.0 + (seed * 37 % 101) as f64 + (seed * 61 % 97) as f64 / 97.0;
            let first = truth.ceil() as usize;
            let y: Vec<f64> = (noise.iter().enumerate())
                .map(|(i, z)| {
                    let behind = i.checked_sub(first);
                    z * law(i).sqrt()
                        + behind.map_or(0.0, |_| height + ring(*seed, i as f64 - truth))
                })
                .collect();
            let mut gain = 0.0;
            let places = (first - 60..first + 60).map(|t| {
                gain += y[t] * height - 0.5 * height * height;
                (t + 1, gain)
            });
            let (at, _) = places
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap_or((first, 0.0));
            let e: Vec<f64> = (y.iter().enumerate())
                .map(|(i, y)| (y - if i >= at { height } else { 0.0 }) / law(i).sqrt())
                .collect();
            let told = Told {
                e: &e,
                unit: &unit,
                law,
                ring: RING,
            };
            let (place, error) = told.place(at, height, 4).expect("a place");
            (place - truth).abs() < TWO_SIDED * error
        };
        (0..DRAWS).filter(holds).count() as f64 / DRAWS as f64
    }

    #[test]
    fn intervals_hold_at_any_height() {
        for height in [0.8, 1.2, 2.0, 3.5, 6.0] {
            let part = covered(height, &|_, _| 0.0, &|_| 1.0);
            assert!(part >= LEAST, "{height}: {part}");
        }
    }

    #[test]
    fn a_ring_behind_it_and_a_loud_stretch_are_no_error() {
        // A blow of up to 11 times the noise rings at 18 Hz, and is read at 20 Hz.
        let ring = |seed: u64, behind: f64| {
            let size = 11.0 * (seed * 29 % 83) as f64 / 83.0;
            size * (std::f64::consts::TAU * 0.9 * behind).cos() * (-behind / 1.2).exp()
        };
        let part = covered(2.5, &ring, &|_| 1.0);
        // One against the step and about as large as that looks like none yet: not all of them can be told from a later step.
        assert!(part >= 0.75, "ring: {part}");
        // Noise of twice the size and more while a motor turns.
        let loud = |i: usize| if i / 300 % 2 == 1 { 4.0 } else { 0.5 };
        let part = covered(1.8, &|_, _| 0.0, &loud);
        assert!(part >= LEAST, "loud: {part}");
    }
}
