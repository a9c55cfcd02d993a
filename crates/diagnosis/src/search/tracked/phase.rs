//! The phase of one tone, block by block, and the law of its pitch: the likeliest one by [`model::tone`].

use rustfft::num_complex::Complex;

use model::tone::{Law, Reading, Step, follow, smoothed};

use crate::fit::likelihood::invert;
use numerics::minimise::nelder_mead;

/// Coordinates of a law: ln of amplitude, ln of the pitch's standard deviation (rad per block), ln of its correlation time
/// (blocks), mean pitch (rad per block).
pub(super) type Coordinates = [f64; 4];

/// Standard deviations of the pitch that are tried first, rad per block, with correlation times, blocks.
const STARTS: [(f64, f64); 5] = [
    (0.1, 6.0),
    (0.03, 40.0),
    (0.2, 40.0),
    (0.05, 250.0),
    (0.2, 250.0),
];
/// Evaluations of a first look, and of the last one.
const LOOK: usize = 80;
const LAST: usize = 320;
/// First steps along each coordinate.
const STEPS: Coordinates = [0.1, 0.4, 0.7, 0.02];
/// Steps over which the curvature of the likelihood is told.
const CURVED_OVER: Coordinates = [0.01, 0.1, 0.1, 0.003];
/// Shortest correlation time, blocks, and that below which a pitch is hardly told from one that forgets itself at once.
const SHORTEST: f64 = 0.02;
pub(super) const FORGOTTEN: f64 = 2.0;

/// A tone whose phase is known.
pub(super) struct Tracked {
    pub at: Coordinates,
    /// Covariance of the coordinates.
    pub covariance: Vec<Vec<f64>>,
    /// How far it is ahead of no tone, nats.
    pub nats: f64,
    /// Variance of the noise in either part of a block.
    pub noise: f64,
    /// Variance by which the pitch turns the phase over a block beside what is foreseen, rad^2.
    pub turned: f64,
    /// Phase in the middle of each block, and its variance.
    pub phase: Vec<(f64, f64)>,
    /// Standard normal under the law: across the predicted phase, which the pitch moves, and along it, which the size does.
    pub surprises: [Vec<f64>; 2],
}

/// The law at some coordinates, over so many blocks.
fn law_at(x: &[f64], blocks: usize) -> Law {
    let time = x[2].exp().clamp(SHORTEST, blocks as f64);
    Law::new(x[0].exp(), x[1].exp(), time, x[3])
}

/// The likeliest law of blocks beside noise of that variance in either part, and what it says of every block; sought from a law on
/// that longer blocks told, where they did.
pub(super) fn tracked(
    blocks: &[Complex<f64>],
    variance: f64,
    before: Option<Coordinates>,
) -> Tracked {
    let parts: Vec<[f64; 2]> = blocks.iter().map(|z| [z.re, z.im]).collect();
    let reading = [Reading::of_tone(&parts, variance)];
    if let Some(before) = before {
        return likeliest(&reading, &[before]);
    }
    let count = blocks.len() as f64;
    let energy = blocks.iter().map(Complex::norm_sqr).sum::<f64>() / count;
    let amplitude = (energy - 2.0 * variance).max(variance).sqrt();
    let turn: Complex<f64> = blocks.windows(2).map(|w| w[1] * w[0].conj()).sum();
    let starts = STARTS.map(|(spread, time)| [amplitude.ln(), spread.ln(), time.ln(), turn.arg()]);
    likeliest(&reading, &starts)
}

/// The likeliest law of some readings of one phase, from some coordinates on.
pub(super) fn likeliest(readings: &[Reading<'_>], starts: &[Coordinates]) -> Tracked {
    let count = readings.first().map_or(0, |r| r.blocks.len());
    let below = |x: &[f64]| -follow(readings, &law_at(x, count), |_| {});
    let best = match starts {
        [one] => one.to_vec(),
        _ => {
            let looks = starts.iter().map(|s| nelder_mead(&below, s, &STEPS, LOOK));
            let best = looks.min_by(|a, b| below(a).total_cmp(&below(b)));
            best.unwrap_or_default()
        }
    };
    let best = nelder_mead(&below, &best, &STEPS, LAST);
    let mut at = [0.0; 4];
    at.iter_mut().zip(&best).for_each(|(a, b)| *a = *b);
    at[2] = at[2].clamp(SHORTEST.ln(), (count as f64).ln());
    let law = law_at(&at, count);
    at[1] = law.spread().ln();
    let mut steps: Vec<Step> = Vec::with_capacity(count);
    let nats = follow(readings, &law, |s| steps.push(*s));
    Tracked {
        at,
        covariance: covariance(&below, &at),
        nats,
        noise: readings.first().map_or(0.0, |r| r.variance),
        turned: law.unforeseen(),
        phase: smoothed(&steps, &law),
        surprises: [0, 1].map(|k| steps[1..].iter().map(|s| s.surprise[k]).collect()),
    }
}

/// Covariance of the coordinates out of the curvature at the lowest point.
fn covariance(below: &dyn Fn(&[f64]) -> f64, at: &Coordinates) -> Vec<Vec<f64>> {
    let moved = |i: usize, a: f64, j: usize, b: f64| {
        let mut x = *at;
        x[i] += a * CURVED_OVER[i];
        x[j] += b * CURVED_OVER[j];
        below(&x)
    };
    let second = |i: usize, j: usize| {
        let apart = moved(i, 1.0, j, 1.0) - moved(i, 1.0, j, -1.0) - moved(i, -1.0, j, 1.0)
            + moved(i, -1.0, j, -1.0);
        apart / (4.0 * CURVED_OVER[i] * CURVED_OVER[j])
    };
    let row = |i: usize| (0..4).map(|j| second(i, j)).collect();
    invert(&(0..4).map(row).collect::<Vec<_>>()).0
}
