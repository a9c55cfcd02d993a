//! How far an envelope is from what its law makes: a fitted law is held against envelopes that it makes itself.
//!
//! The second moment of the squared envelope tells noise from a steady tone, and much else has the second moment of either: a tone
//! that is there half of the time has 2 as noise has, one that is keyed by its phase 1 as a steady one has. So the name that was
//! given is criticised by statistics of what such a thing has beside it, each against what simulations of the law give:
//!
//! * Sizes: second and third moment and geometric mean of the squared envelope, together (Mahalanobis' distance).
//! * Rhythms: the strongest line in the spectrum of the size and of the pitch over their neighbourhood (Fisher, 1929). A pitch that
//!   sways has one, a heart that beats, a size that swings.
//! * The carrier: the same of the squared envelope with its phase. Squared, a carrier that is turned over by half a turn is a steady
//!   one at twice the frequency, as in a receiver's squaring loop; neither noise nor a phase that wanders leaves a line there.
//! * Memory, of noise alone: Haar variances of size and pitch by octaves of time (Allan, 1966). Of Gaussian noise the covariance of
//!   the size is the square of that of the band (Isserlis, 1918), so both are told by its density; a tone whose pitch wanders may
//!   stay for as long as it likes.
//! * Jumps: the fourth moment of Haar differences of the envelope itself over the square of the second, by octaves of time. Noise and
//!   a phase that walks diffuse, and differences of noise are normal at every distance. What is switched, keyed or struck has the
//!   same spectrum by few large changes, the heavier tails of which show in the octaves about its dwell.
//!
//! The farthest of them, in standard errors, is held against the farthest of each simulation, whose law is that of a largest value
//! (Gumbel, 1958): statistics that hang together count once.

use std::f64::consts::PI;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::{OVERSAMPLED, TOLERATED};
use crate::fit::likelihood::invert;

/// Moments of the size.
const SIZES: usize = 3;
/// By how much a relative variance of the squared envelope beside chance, [`TOLERATED`], moves their logarithms: those of a
/// log-normal size.
const MOVES: [f64; SIZES] = [1.0, 3.0, -0.5];
/// Scatter of each logarithm by itself that real bands have beside that.
const UNEVEN: f64 = 0.03;
/// Least part of its mean that a squared envelope counts as.
const FLOOR: f64 = 1e-3;
/// Frequencies either side that are the neighbourhood of a line, without it and the next ones.
const BESIDE: usize = 24;
/// Fewest values of the shortest series by octave.
const LEAST: usize = 16;

/// A line in a spectrum: how far its chance is below that of the strongest of as many, nats, and its part of the energy.
#[derive(Clone, Copy, Debug, Default)]
struct Line {
    nats: f64,
    share: f64,
}

/// What an envelope is like.
#[derive(Clone, Debug)]
pub(super) struct Portrait {
    /// Logarithms: of the mean of the second and third power of the squared envelope over its mean, and of its geometric mean.
    pub(super) size: [f64; SIZES],
    /// In the spectrum of the size, of the pitch, and of the square.
    lines: [Line; 3],
    /// Cube roots of the Haar variances of size and pitch, by octave: nearly normal (Wilson and Hilferty, 1931).
    octaves: [Vec<f64>; 2],
    /// Logarithms of the fourth moment of the Haar differences over the square of the second, by octave.
    jumps: Vec<f64>,
}

/// The strongest line among the first `bins` frequencies of a series.
fn line(mut series: Vec<Complex<f64>>, bins: usize, planner: &mut FftPlanner<f64>) -> Line {
    let n = series.len();
    planner.plan_fft_forward(n).process(&mut series);
    let all: f64 = series.iter().map(Complex::norm_sqr).sum();
    let energies: Vec<f64> = series[..bins].iter().map(Complex::norm_sqr).collect();
    let mut sums = vec![0.0; bins + 1];
    for (k, e) in energies.iter().enumerate() {
        sums[k + 1] = sums[k] + e;
    }
    let of = |from: usize, to: usize| (sums[to] - sums[from], (to - from) as f64);
    let mut best = Line::default();
    for (k, e) in energies.iter().enumerate() {
        let below = of(k.saturating_sub(BESIDE), k.saturating_sub(1));
        let above = of((k + 2).min(bins), (k + BESIDE + 1).min(bins));
        let count = below.1 + above.1;
        let mean = ((below.0 + above.0) / count.max(1.0)).max(FLOOR * all / n as f64);
        // The chance of an exponential value over the mean of `count` others.
        let nats = count * (e / mean / count.max(1.0)).ln_1p() - (bins as f64).ln();
        if nats > best.nats {
            let share = e / all;
            best = Line { nats, share };
        }
    }
    best
}

/// Cube roots of the mean squared differences of neighbouring means, over more and more values.
fn octaves(series: &[f64]) -> Vec<f64> {
    let mean = |c: &[f64]| c.iter().sum::<f64>() / c.len() as f64;
    let mut means: Vec<f64> = series.chunks_exact(2 * OVERSAMPLED).map(mean).collect();
    let mut all = vec![];
    while means.len() >= LEAST {
        let steps = means.windows(2).map(|w| (w[1] - w[0]).powi(2));
        all.push((steps.sum::<f64>() / (means.len() - 1) as f64).cbrt());
        means = means.chunks_exact(2).map(mean).collect();
    }
    all
}

/// Logarithms of the fourth moment of the differences of neighbouring means over the square of the second, over more and more
/// values, of an envelope turned back by its mean pitch.
fn jumps(z: &[Complex<f64>]) -> Vec<f64> {
    let mut turn = Complex::new(1.0, 0.0);
    let back = turned_back(z);
    let still = z.iter().map(|z| {
        turn *= back;
        z * turn
    });
    let still: Vec<Complex<f64>> = still.collect();
    let mean = |c: &[Complex<f64>]| c.iter().sum::<Complex<f64>>() / c.len() as f64;
    let mut means: Vec<Complex<f64>> = still.chunks_exact(OVERSAMPLED / 2).map(mean).collect();
    let mut all = vec![];
    while means.len() >= 2 * LEAST {
        let squares = means.windows(2).map(|w| (w[1] - w[0]).norm_sqr());
        let (second, fourth) = squares.fold((0.0, 0.0), |(a, b), s| (a + s, b + s * s));
        let count = (means.len() - 1) as f64;
        all.push((count * fourth / (second * second).max(f64::MIN_POSITIVE)).ln());
        means = means.chunks_exact(2).map(mean).collect();
    }
    all
}

/// Squared change from value to value of an envelope that is turned back by its mean pitch.
pub(crate) fn changes(z: &[Complex<f64>]) -> Vec<f64> {
    let back = turned_back(z);
    let off = z.windows(2).map(|w| (w[1] * back - w[0]).norm_sqr());
    off.chain([0.0]).collect()
}

/// What turns an envelope back from value to value by its mean pitch.
fn turned_back(z: &[Complex<f64>]) -> Complex<f64> {
    let turn: Complex<f64> = z.windows(2).map(|w| w[1] * w[0].conj()).sum();
    turn.conj() / turn.norm().max(f64::MIN_POSITIVE)
}

/// Change of phase from value to value over that of all together, times the squared size: what the pitch is weighed by.
pub(crate) fn pitch(z: &[Complex<f64>]) -> Vec<f64> {
    let back = turned_back(z);
    let off = z.windows(2).map(|w| (w[1] * w[0].conj() * back).im);
    off.chain([0.0]).collect()
}

impl Portrait {
    /// Of an envelope.
    pub(super) fn of(z: &[Complex<f64>], planner: &mut FftPlanner<f64>) -> Self {
        let count = z.len() as f64;
        let mean = z.iter().map(Complex::norm_sqr).sum::<f64>() / count;
        let size: Vec<f64> = z.iter().map(|z| z.norm_sqr() / mean).collect();
        let power = |k| (size.iter().map(|v| v.powi(k)).sum::<f64>() / count).ln();
        let logs = size.iter().map(|v| v.max(FLOOR).ln()).sum::<f64>() / count;
        let pitch = pitch(z);
        let level = pitch.iter().sum::<f64>() / count;
        let pitch: Vec<f64> = pitch.iter().map(|p| (p - level) / mean).collect();
        // The band fills an eighth of what the values show, its square a quarter.
        let real = |values: &[f64], less: f64| -> Vec<Complex<f64>> {
            let kept = values.iter().step_by(OVERSAMPLED);
            kept.map(|v| Complex::new(v - less, 0.0)).collect()
        };
        let square: Vec<Complex<f64>> = z.iter().step_by(2).map(|z| z * z).collect();
        let (half, quarter) = (z.len() / (2 * OVERSAMPLED), z.len() / OVERSAMPLED);
        Self {
            size: [power(2), power(3), logs],
            lines: [
                line(real(&size, 1.0), half, planner),
                line(real(&pitch, 0.0), half, planner),
                line(square, quarter, planner),
            ],
            octaves: [octaves(&size), octaves(&pitch)],
            jumps: jumps(z),
        }
    }
}

/// Of the cube root of a chi-square of [`SIZES`] degrees of freedom (Wilson and Hilferty, 1931): 3^(1/3) (1 - 2/27), and
/// 3^(1/3) (2/27)^(1/2).
const DISTANCE: Spread = Spread {
    middle: 1.3354,
    spread: 0.3925,
};

/// Of the largest of six standard normal values, about as many as there are statistics (Harter, 1961): what is tolerated makes the
/// scores of simulations smaller.
const LARGEST: Spread = Spread {
    middle: 1.267,
    spread: 0.645,
};

/// Middle and spread.
#[derive(Clone, Copy, Debug)]
struct Spread {
    middle: f64,
    spread: f64,
}

impl Spread {
    fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let count = values.clone().count() as f64;
        let middle = values.clone().sum::<f64>() / count;
        let square = values.map(|v| (v - middle).powi(2)).sum::<f64>();
        Self {
            middle,
            spread: (square / (count - 1.0)).sqrt(),
        }
    }
}

/// What is farthest off, in words.
const OFF: [&str; 7] = [
    "its sizes are not those of its law",
    "its size has a rhythm",
    "its pitch has a rhythm",
    "its square is a steady line",
    "its size stays otherwise than its spectrum tells",
    "its pitch stays otherwise than its spectrum tells",
    "it jumps",
];

/// What simulations of a law give.
pub(super) struct Law {
    /// Middles of the logarithms of the size, and the inverse of their covariance with what is tolerated.
    middle: [f64; SIZES],
    inverse: Vec<Vec<f64>>,
    distance: Spread,
    lines: [Spread; 3],
    octaves: [Vec<Spread>; 2],
    jumps: Vec<Spread>,
    /// The same of the second moment alone.
    pub(super) second: (f64, f64),
    /// Place and scale of the largest score.
    largest: (f64, f64),
}

/// Euler's constant: where the mean of Gumbel's law lies.
const EULER: f64 = 0.577_215_664_901_532_9;

impl Law {
    /// Of simulations, whose statistics scatter `fewer` times as far as those of the record; of noise, which has a memory that its
    /// density tells.
    pub(super) fn of(runs: &[Portrait], fewer: f64, noise: bool) -> Self {
        let size = |i: usize| Spread::of(runs.iter().map(move |r| r.size[i]));
        let sizes: [Spread; SIZES] = std::array::from_fn(size);
        let middle = sizes.map(|s| s.middle);
        let covariance = |i: usize, j: usize| {
            let products = runs
                .iter()
                .map(|r| (r.size[i] - middle[i]) * (r.size[j] - middle[j]));
            let chance = products.sum::<f64>() / (runs.len() - 1) as f64 / (fewer * fewer);
            let alone = if i == j { UNEVEN * UNEVEN } else { 0.0 };
            chance + TOLERATED * TOLERATED * MOVES[i] * MOVES[j] + alone
        };
        let matrix: Vec<Vec<f64>> = (0..SIZES)
            .map(|i| (0..SIZES).map(|j| covariance(i, j)).collect())
            .collect();
        let inverse = invert(&matrix).0;
        let by_octave = |of: fn(&Portrait) -> &[f64]| -> Vec<Spread> {
            let values: Vec<&[f64]> = runs.iter().map(of).collect();
            let count = values.iter().map(|v| v.len()).min().unwrap_or(0);
            let each = (0..count).map(|i| Spread::of(values.iter().map(move |v| v[i])));
            each.collect()
        };
        let memory = |k: usize| match noise {
            true => by_octave(if k == 0 {
                |r| &r.octaves[0]
            } else {
                |r| &r.octaves[1]
            }),
            false => vec![],
        };
        let mut law = Self {
            middle,
            inverse,
            distance: Spread {
                middle: 0.0,
                spread: 1.0,
            },
            lines: std::array::from_fn(|k| Spread::of(runs.iter().map(move |r| r.lines[k].nats))),
            octaves: [memory(0), memory(1)],
            jumps: by_octave(|r| &r.jumps),
            second: (middle[0], sizes[0].spread / fewer),
            largest: (0.0, 1.0),
        };
        let distances: Vec<f64> = runs.iter().map(|r| law.distance(r, fewer)).collect();
        let own = Spread::of(distances.iter().copied());
        // What is tolerated is none of chance: simulations lie nearer together than what they may be off by.
        law.distance = Spread {
            middle: own.middle.max(DISTANCE.middle),
            spread: own.spread.max(DISTANCE.spread),
        };
        let highest: Vec<f64> = (runs.iter())
            .map(|r| law.farthest(r, fewer, fewer).0)
            .collect();
        let own = Spread::of(highest.iter().copied());
        let scale = own.spread.max(LARGEST.spread) * 6f64.sqrt() / PI;
        law.largest = (own.middle.max(LARGEST.middle) - EULER * scale, scale);
        law
    }

    /// Cube root of the squared distance of the sizes from their middle, those of a simulation drawn together.
    fn distance(&self, seen: &Portrait, fewer: f64) -> f64 {
        let off: [f64; SIZES] = std::array::from_fn(|i| (seen.size[i] - self.middle[i]) / fewer);
        let along = |(row, o): (&Vec<f64>, &f64)| o * numerics::column::dot(row, &off);
        self.inverse.iter().zip(&off).map(along).sum::<f64>().cbrt()
    }

    /// The largest score, and of what: an octave of a record scatters `fewer` times less than the simulations' does, and a
    /// simulation's own is `drawn` together as much.
    fn farthest(&self, seen: &Portrait, fewer: f64, drawn: f64) -> (f64, usize) {
        let sizes = (self.distance(seen, drawn) - self.distance.middle) / self.distance.spread;
        let mut all = vec![(sizes, 0)];
        for (k, (l, s)) in seen.lines.iter().zip(&self.lines).enumerate() {
            // Of a real series both sides of the spectrum; of the size that is in proportion to the mean.
            let held = match k {
                0 => 2.0 * l.share * (seen.size[0].exp() - 1.0),
                1 => 2.0 * l.share,
                _ => l.share,
            };
            if held > TOLERATED {
                all.push(((l.nats - s.middle) / s.spread.max(f64::MIN_POSITIVE), 1 + k));
            }
        }
        let mut by_octave = |own: &[f64], told: &[Spread], room: fn(&Spread) -> f64, of: usize| {
            for (v, s) in own.iter().zip(told) {
                let scale = (s.spread / fewer).hypot(room(s));
                all.push((((v - s.middle) / drawn / scale).abs(), of));
            }
        };
        // A third of that of the variance, which is off by twice what its root is.
        let of_root = |s: &Spread| 2.0 * TOLERATED / 3.0 * s.middle;
        for (k, (own, told)) in seen.octaves.iter().zip(&self.octaves).enumerate() {
            by_octave(own, told, of_root, 4 + k);
        }
        by_octave(&seen.jumps, &self.jumps, |_| TOLERATED, 6);
        let larger = |a: (f64, usize), b: (f64, usize)| if b.0 > a.0 { b } else { a };
        all.into_iter().fold((f64::NEG_INFINITY, 0), larger)
    }

    /// The largest score of an envelope, whose statistics are `drawn` times as scattered as those of the record.
    pub(super) fn score(&self, seen: &Portrait, fewer: f64, drawn: f64) -> f64 {
        self.farthest(seen, fewer, drawn).0
    }

    /// Chance that the law makes an envelope that is as far off, and where it is farthest, in words.
    pub(super) fn chance(&self, seen: &Portrait, fewer: f64) -> (f64, &'static str) {
        let (score, of) = self.farthest(seen, fewer, 1.0);
        let (place, scale) = self.largest;
        let p = -(-(-(score - place) / scale).exp()).exp_m1();
        (p, OFF[of])
    }
}
