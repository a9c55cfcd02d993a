//! The phase of one tone, block by block, and the law of its pitch.
//!
//! A block of the record, turned back by the tone's mean frequency, is A e^(i phase) in white noise. The phase turns by the pitch,
//! whose departures d decay to their mean as those of a motor's speed or a mains frequency do: an Ornstein-Uhlenbeck process of
//! standard deviation s and correlation time T, that of R. Kubo, "Note on the stochastic theory of resonance absorption", J. Phys.
//! Soc. Japan 9 (1954) 935. An extended Kalman filter in the frame of the predicted phase gives the likelihood of (A, s, T, mean), its
//! smoother (Rauch, Tung and Striebel, 1965) the phase.

use rustfft::num_complex::Complex;

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
/// Ends of the pitch's standard deviation over a block, rad: beyond the upper one it leaves the blocks' band.
const PITCH: [f64; 2] = [1e-6, 0.7];
/// Shortest correlation time, blocks, and that below which a pitch is hardly told from one that forgets itself at once.
const SHORTEST: f64 = 0.02;
pub(super) const FORGOTTEN: f64 = 2.0;
/// Blocks to a correlation time below which the variances are those of a series: the exact ones cancel.
const SERIES: f64 = 0.02;

/// What a law says of the next block: the exact integral of an Ornstein-Uhlenbeck process (D. T. Gillespie, Phys. Rev. E 54 (1996)
/// 2084).
struct Law {
    amplitude: f64,
    keep: f64,
    /// By how much a departure of the pitch turns the phase until the next block.
    turn: f64,
    /// Covariance of what drives phase and pitch: of the phase, of both, of the pitch.
    drive: [f64; 3],
    spread: f64,
    mean: f64,
}

impl Law {
    fn new(x: &[f64], blocks: usize) -> Self {
        let time = x[2].exp().clamp(SHORTEST, blocks as f64);
        let (per, lost) = (time.recip(), -(-time.recip()).exp_m1());
        let keep = 1.0 - lost;
        let of_phase = if per < SERIES {
            per * (2.0 / 3.0 - 0.5 * per)
        } else {
            time * time * (2.0 * per - 2.0 * lost - lost * lost)
        };
        let most = PITCH[1] / (time * lost).sqrt();
        let spread = x[1].exp().clamp(PITCH[0], most);
        let square = spread * spread;
        Self {
            amplitude: x[0].exp(),
            keep,
            turn: time * lost,
            drive: [of_phase, time * lost * lost, lost * (1.0 + keep)].map(|v| v * square),
            spread,
            mean: x[3],
        }
    }
}

/// Phase and departure of the pitch, with their covariance (of the phase, of both, of the pitch).
#[derive(Clone, Copy)]
struct Belief {
    phase: f64,
    pitch: f64,
    covariance: [f64; 3],
}

impl Belief {
    fn next(&self, law: &Law) -> Self {
        let (by, [d, e, f]) = (law.turn, law.drive);
        let [a, b, c] = self.covariance;
        Self {
            phase: self.phase + law.mean + by * self.pitch,
            pitch: law.keep * self.pitch,
            covariance: [
                a + 2.0 * by * b + by * by * c + d,
                law.keep * (b + by * c) + e,
                law.keep * law.keep * c + f,
            ],
        }
    }
}

/// What one block told.
#[derive(Clone, Copy)]
struct Step {
    predicted: Belief,
    told: Belief,
    /// Across and along the predicted phase, over their standard deviations.
    surprise: [f64; 2],
}

/// A tone whose phase is known.
pub(super) struct Tracked {
    pub at: Coordinates,
    /// Covariance of the coordinates.
    pub covariance: Vec<Vec<f64>>,
    /// How far it is ahead of no tone, nats.
    pub nats: f64,
    /// Variance of the noise in either part of a block.
    pub noise: f64,
    /// Phase in the middle of each block, and its variance.
    pub phase: Vec<(f64, f64)>,
    /// Standard normal under the law: across the predicted phase, which the pitch moves, and along it, which the size does.
    pub surprises: [Vec<f64>; 2],
}

/// Nats by which a law is ahead of noise of that variance in either part of a block; each block is told to `seen`.
fn ahead(blocks: &[Complex<f64>], variance: f64, x: &[f64], mut seen: impl FnMut(&Step)) -> f64 {
    let law = Law::new(x, blocks.len());
    let a = law.amplitude;
    let Some(first) = blocks.first() else {
        return 0.0;
    };
    let mut now = Belief {
        phase: first.arg(),
        pitch: 0.0,
        covariance: [variance / (a * a), 0.0, law.spread * law.spread],
    };
    let start = Step {
        predicted: now,
        told: now,
        surprise: [0.0; 2],
    };
    seen(&start);
    let mut nats = 0.0;
    for z in &blocks[1..] {
        let predicted = now.next(&law);
        let turned = z * Complex::from_polar(1.0, -predicted.phase);
        let [p, q, r] = predicted.covariance;
        let across = a * a * p + variance;
        // A phase in doubt shortens what lies along it, by a variance of half the square of its own.
        let along = variance + 0.5 * (a * p).powi(2);
        let short = turned.re - a * (-0.5 * p).exp();
        nats += 0.5 * (z.norm_sqr() / variance);
        nats -= 0.5 * (turned.im.powi(2) / across + (across / variance).ln());
        nats -= 0.5 * (short * short / along + (along / variance).ln());
        let gain = [a * p / across, a * q / across];
        now = Belief {
            phase: predicted.phase + gain[0] * turned.im,
            pitch: predicted.pitch + gain[1] * turned.im,
            covariance: [
                p - gain[0] * a * p,
                q - gain[0] * a * q,
                r - gain[1] * a * q,
            ],
        };
        seen(&Step {
            predicted,
            told: now,
            surprise: [turned.im / across.sqrt(), short / along.sqrt()],
        });
    }
    if nats.is_finite() { nats } else { f64::MIN }
}

/// The likeliest law beside noise of that variance in either part of a block, and what it says of every block.
pub(super) fn tracked(blocks: &[Complex<f64>], variance: f64) -> Tracked {
    let count = blocks.len() as f64;
    let energy = blocks.iter().map(Complex::norm_sqr).sum::<f64>() / count;
    let amplitude = (energy - 2.0 * variance).max(variance).sqrt();
    let turn: Complex<f64> = blocks.windows(2).map(|w| w[1] * w[0].conj()).sum();
    let below = |x: &[f64]| -ahead(blocks, variance, x, |_| {});
    let from = |(spread, time): (f64, f64)| {
        let start = [amplitude.ln(), spread.ln(), time.ln(), turn.arg()];
        nelder_mead(&below, &start, &STEPS, LOOK)
    };
    let looks = STARTS.map(from).into_iter();
    let best = looks.min_by(|a, b| below(a).total_cmp(&below(b)));
    let best = nelder_mead(&below, &best.unwrap_or_default(), &STEPS, LAST);
    let mut at = [0.0; 4];
    at.iter_mut().zip(&best).for_each(|(a, b)| *a = *b);
    at[2] = at[2].clamp(SHORTEST.ln(), count.ln());
    at[1] = Law::new(&at, blocks.len()).spread.ln();
    let mut steps = Vec::with_capacity(blocks.len());
    let nats = ahead(blocks, variance, &at, |s| steps.push(*s));
    Tracked {
        at,
        covariance: covariance(&below, &at),
        nats,
        noise: variance,
        phase: smoothed(&steps, &Law::new(&at, blocks.len())),
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

/// Phase in every block by all of them, with its variance.
fn smoothed(steps: &[Step], law: &Law) -> Vec<(f64, f64)> {
    let mut all: Vec<(f64, f64)> = steps
        .iter()
        .map(|s| (s.told.phase, s.told.covariance[0]))
        .collect();
    let Some(last) = steps.last() else {
        return all;
    };
    let by = law.turn;
    let mut later = last.told;
    for (i, pair) in steps.windows(2).enumerate().rev() {
        let (now, next) = (&pair[0].told, &pair[1].predicted);
        let ([a, b, c], [p, q, r]) = (now.covariance, next.covariance);
        let whole = (p * r - q * q).max(f64::MIN_POSITIVE);
        // Covariance of now and next, times the inverse of that of next.
        let rows = [[a + by * b, law.keep * b], [b + by * c, law.keep * c]];
        let gain = rows.map(|[x, y]| [(x * r - y * q) / whole, (y * p - x * q) / whole]);
        let off = [later.phase - next.phase, later.pitch - next.pitch];
        let [l, m, n] = later.covariance;
        let less = [l - p, m - q, n - r];
        let moved = |g: &[f64; 2]| g[0] * off[0] + g[1] * off[1];
        let spread = |g: &[f64; 2], h: &[f64; 2]| {
            g[0] * (less[0] * h[0] + less[1] * h[1]) + g[1] * (less[1] * h[0] + less[2] * h[1])
        };
        later = Belief {
            phase: now.phase + moved(&gain[0]),
            pitch: now.pitch + moved(&gain[1]),
            covariance: [
                a + spread(&gain[0], &gain[0]),
                b + spread(&gain[0], &gain[1]),
                c + spread(&gain[1], &gain[1]),
            ],
        };
        all[i] = (later.phase, later.covariance[0]);
    }
    all
}
