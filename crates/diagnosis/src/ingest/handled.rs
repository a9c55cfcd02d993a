//! A base at rest that somebody handles for some seconds: picks up, puts down, turns this way and that.
//!
//! One smooth turn out and back has its own shape (`base_turns`). What is no such turn, and is no blow for it lasts longer, is told by
//! its size, which no bias has, by its smoothness, which neither noise nor levels have, and by the rest of the record, which is at rest.

use super::base_turns::{Excursion, LEAST_PEAK, LONGEST_S, SELDOM};
use super::brief::{Stretch, stretches};

/// Readings on either side that tell of the level, s.
const BESIDE_S: f64 = LONGEST_S;
/// Time without a far reading after which another one begins, s.
const APART_S: f64 = 1.0;
/// Shortest, s: what is over sooner is a blow.
const SHORTEST_S: f64 = 1.5;
/// Most of them in a record.
const MOST: usize = 3;
/// Readings within so long make one mean, s: turns of two hertz and less are in it.
const MEAN_S: f64 = 0.1;
/// Part of its energy that the means hold, and largest change from one mean to the next as a part of the whole range. A sine of two
/// hertz holds 0.87 and changes by 0.6 of the range; what jumps changes by all of it, and noise is not held.
const HELD: f64 = 0.8;
const CHANGE: f64 = 0.7;

/// The stretches in which the base was handled, by a gyro's readings in deg/s without gaps. None where there are more of them than a
/// base at rest has.
pub(super) fn handled(y: &[f64], rate_hz: f64) -> Vec<Excursion> {
    let of = |seconds: f64| ((seconds * rate_hz) as usize).max(1);
    let most = (SELDOM * y.len() as f64) as usize;
    let (all, sigma) = stretches(y, of(BESIDE_S), of(APART_S), most);
    let large = |s: &&Stretch| s.peak >= LEAST_PEAK && s.readings.len() >= of(SHORTEST_S);
    let all: Vec<&Stretch> = all.iter().filter(large).collect();
    let taken: usize = all.iter().map(|s| s.readings.len()).sum();
    let short = |s: &&Stretch| s.readings.len() <= of(LONGEST_S);
    if all.len() > MOST || taken > most || !all.iter().all(short) {
        return vec![];
    }
    let smooth = all
        .into_iter()
        .filter(|s| is_smooth(&y[s.readings.clone()], of(MEAN_S)));
    let margin = of(APART_S) / 2;
    smooth
        .map(|s| Excursion {
            samples: s.readings.start.saturating_sub(margin)
                ..(s.readings.end + margin).min(y.len()),
            peak: (s.peak, sigma),
            end_error: margin as f64,
        })
        .collect()
}

/// Whether means over `by` readings hold what these do, and none of them jumps.
fn is_smooth(y: &[f64], by: usize) -> bool {
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let level = mean(y);
    let means: Vec<f64> = y.chunks_exact(by).map(|c| mean(c) - level).collect();
    let energy = |of: &mut dyn Iterator<Item = f64>| of.map(|v| v * v).sum::<f64>();
    let held = by as f64 * energy(&mut means.iter().copied());
    let range = means.iter().copied().fold(f64::NEG_INFINITY, f64::max)
        - means.iter().copied().fold(f64::INFINITY, f64::min);
    let change = means
        .windows(2)
        .map(|w| (w[1] - w[0]).abs())
        .fold(0.0, f64::max);
    held > HELD * energy(&mut y.iter().map(|v| v - level)) && change < CHANGE * range
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn with(of: &dyn Fn(f64) -> f64) -> Vec<f64> {
        let noise = crate::fit::white(12_000, 3);
        let at = |(i, e): (usize, &f64)| 0.3 * e + of(i as f64 / 20.0);
        noise.iter().enumerate().map(at).collect()
    }

    #[test]
    fn a_wiggle_is_found_where_it_was() {
        let wiggle = |t: f64| match t {
            100.0..104.0 => 20.0 * (TAU * 1.3 * t).sin() + 8.0 * (TAU * 0.6 * t).cos(),
            _ => 0.0,
        };
        let found = handled(&with(&wiggle), 20.0);
        assert_eq!(found.len(), 1);
        let seconds = [found[0].samples.start, found[0].samples.end].map(|i| i as f64 / 20.0);
        assert!(
            (seconds[0] - 99.6).abs() < 0.4 && (seconds[1] - 104.4).abs() < 0.4,
            "{seconds:?}"
        );
        let first = |t: f64| {
            if t < 5.0 {
                10.0 * (TAU * 0.8 * t).sin()
            } else {
                0.0
            }
        };
        assert_eq!(handled(&with(&first), 20.0).len(), 1);
    }

    #[test]
    fn levels_a_buzz_a_sway_and_a_small_one_are_none() {
        let levels = |t: f64| {
            if (100.0..106.0).contains(&t) {
                10.0
            } else {
                0.0
            }
        };
        let step = |t: f64| if t < 300.0 { 0.0 } else { 10.0 };
        let buzz = |t: f64| match t {
            100.0..104.0 => 20.0 * (TAU * 7.3 * t).sin(),
            _ => 0.0,
        };
        let sway = |t: f64| 5.0 * (TAU * 0.4 * t).sin();
        let small = |t: f64| {
            if (100.0..104.0).contains(&t) {
                (TAU * t).sin()
            } else {
                0.0
            }
        };
        for other in [&levels as &dyn Fn(f64) -> f64, &step, &buzz, &sway, &small] {
            assert!(handled(&with(other), 20.0).is_empty());
        }
    }
}
