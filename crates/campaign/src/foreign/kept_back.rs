//! Foreign effects kept back from the engine, second set (2026-11-21): written from the physics and mathematics named
//! here, by someone who had not read how the diagnosis decides. The tests of `library_share` hold that no effect of the
//! library describes them.

use std::f64::consts::TAU;

use super::{Change, Foreign, PLAIN, Set, extremes, of_signal};
use crate::random::Draw;
use crate::stand::{LSB, Needs, Stand};
use crate::strength::{Meter, of_variance, size_for};

/// Their names.
pub const NAMES: [&str; 14] = [
    "stick and slip",
    "temperature times supply",
    "vibration rectified",
    "ripple at the speed of the motor",
    "tone whose pitch follows temperature",
    "creaks while the temperature moves",
    "swing without a period",
    "noise with a resonance",
    "noise of a differenced angle",
    "echo of earlier samples",
    "noise whose size wanders",
    "every few samples noisier",
    "noise with a uniform part",
    "uneven steps of the converter",
];

/// The set.
pub(super) const SET: Set = Set {
    names: &NAMES,
    needs,
    one,
    ..PLAIN
};

/// Beyond what every foreign effect gets.
fn needs(name: &str) -> Needs {
    Needs {
        temperature: true,
        motor: true,
        supply: name == "temperature times supply",
        vibration: false,
    }
}

/// One of them; `None` for another name. The world of the stand may gain a vibration.
fn one(
    draw: &mut Draw,
    stand: &mut Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    let signal = match name {
        "stick and slip" => Some(stick_and_slip(draw, stand)),
        "temperature times supply" => Some(product(stand, axis)),
        "vibration rectified" => Some(rectified(draw, stand)),
        "ripple at the speed of the motor" => Some(ripple(draw, stand)),
        "tone whose pitch follows temperature" => Some(tone(draw, stand, axis)),
        "creaks while the temperature moves" => Some(creaks(draw, stand, axis)),
        "swing without a period" => Some(swing_without_period(draw, stand)),
        _ => None,
    };
    if let Some(unit) = signal {
        return Some(of_signal(stand, name, axis, &unit, wanted));
    }
    Some(match name {
        "noise with a resonance" => resonance(draw, stand, name, axis, wanted),
        "noise of a differenced angle" => differenced(draw, stand, name, axis, wanted),
        "echo of earlier samples" => echo(draw, stand, name, axis, wanted),
        "noise whose size wanders" => {
            let keep = (-1.0 / (draw.by_ratio(5.0, 40.0) * stand.rate_hz)).exp();
            let mut x = draw.normal();
            let log_size: Vec<f64> = (0..stand.samples())
                .map(|_| {
                    x = keep * x + (1.0 - keep * keep).sqrt() * draw.normal();
                    x
                })
                .collect();
            variance(name, wanted, &|size| {
                log_size.iter().map(|x| (size * x).exp()).collect()
            })
        }
        "every few samples noisier" => {
            // A read-out that serves something else in between, or converters that take turns.
            let every = 2 + draw.of_many(6);
            let phase = draw.of_many(every);
            variance(name, wanted, &|size| {
                let law = |i| 1.0 + size * f64::from(u8::from(i % every == phase));
                (0..stand.samples()).map(law).collect()
            })
        }
        "noise with a uniform part" => uniform_part(draw, stand, name, wanted),
        "uneven steps of the converter" => uneven_steps(draw, stand, name, axis, wanted),
        _ => return None,
    })
}

/// A part that is dragged by friction, holds until a stress that differs a little each time, and lets go.
fn stick_and_slip(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let rise = 1.0 / (draw.by_ratio(6.0, 30.0) * stand.rate_hz);
    let mut level = draw.between(0.0, 1.0);
    let mut holds = 1.0;
    (0..stand.samples())
        .map(|_| {
            level += rise;
            if level > holds {
                level = 0.0;
                holds = draw.between(0.6, 1.4);
            }
            level
        })
        .collect()
}

/// A reference whose drift with temperature is a share of the supply: the product of both about their means. A term in
/// one of them alone is not in it.
fn product(stand: &Stand, axis: usize) -> Vec<f64> {
    let about_mean = |v: &[f64]| -> Vec<f64> {
        let mean = v.iter().sum::<f64>() / v.len() as f64;
        v.iter().map(|x| x - mean).collect()
    };
    let temperature = about_mean(&stand.world.temperature[axis]);
    let supply = about_mean(&stand.world.supply);
    temperature
        .iter()
        .zip(&supply)
        .map(|(t, u)| t * u)
        .collect()
}

/// Vibration along a slant in spells: the anisoelastic error goes with the mean square over a sample, while the
/// accelerometers see single aliased values.
fn rectified(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (rms, slant) = (draw.between(0.05, 0.25), draw.between(0.3, 1.2));
    let gain = 1.0 - (-1.0 / (draw.between(0.2, 1.0) * stand.rate_hz)).exp();
    let (mut now, mut goal, mut left) = (0.0, 0.0, draw.between(0.0, 12.0));
    let size: Vec<f64> = (0..stand.samples())
        .map(|_| {
            left -= 1.0 / stand.rate_hz;
            if left <= 0.0 {
                goal = if goal == 0.0 {
                    draw.between(0.4, 1.0)
                } else {
                    0.0
                };
                left = draw.between(2.0, 12.0);
            }
            now += gain * (goal - now);
            now
        })
        .collect();
    for (i, s) in size.iter().enumerate() {
        let shake = rms * s * draw.normal();
        stand.world.acc[0][i] = shake * slant.cos();
        stand.world.acc[1][i] = shake * slant.sin();
    }
    size.iter().map(|s| s * s).collect()
}

/// A rotor's ripple: its pitch is the speed of the motor, which follows the duty behind a lag and under a load that
/// wanders.
fn ripple(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let top_hz = draw.by_ratio(1.5, 9.0);
    let gain = 1.0 - (-1.0 / (draw.between(0.3, 2.0) * stand.rate_hz)).exp();
    let keep = (-1.0 / (5.0 * stand.rate_hz)).exp();
    let (mut speed, mut load, mut phase) = (0.0, draw.normal(), draw.between(0.0, TAU));
    stand
        .world
        .duty
        .iter()
        .map(|duty| {
            load = keep * load + (1.0 - keep * keep).sqrt() * draw.normal();
            speed += gain * (duty - speed);
            phase += TAU * top_hz * speed * (1.0 + 0.1 * load) / stand.rate_hz;
            speed.abs() * phase.sin()
        })
        .collect()
}

/// An oscillator in the read-out that drifts with temperature and beats with the sampling.
fn tone(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    let temperature = &stand.world.temperature[axis];
    let (low, high) = extremes(temperature);
    let (from, span) = (draw.between(0.5, 6.0), draw.sign() * draw.between(0.4, 3.0));
    let mut phase = draw.between(0.0, TAU);
    temperature
        .iter()
        .map(|t| {
            let place = (t - low) / (high - low).max(1e-9);
            phase += TAU * (from + span * place) / stand.rate_hz;
            phase.sin()
        })
        .collect()
}

/// A mount that creeps in small jerks while it expands: each turns the part there and back.
fn creaks(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    let temperature = &stand.world.temperature[axis];
    // Without the flutter of the room.
    let half = (2.0 * stand.rate_hz) as usize;
    let n = stand.samples();
    let pace: Vec<f64> = (0..n)
        .map(|i| (temperature[(i + half).min(n - 1)] - temperature[i.saturating_sub(half)]).abs())
        .collect();
    let total: f64 = pace.iter().sum();
    let (jerks, width) = (draw.between(30.0, 90.0), draw.between(0.4, 1.5));
    let length = (width * stand.rate_hz) as usize;
    let mut signal = vec![0.0; n];
    for (i, p) in pace.iter().enumerate() {
        if draw.chance(jerks * p / total) {
            let size = draw.sign() * draw.between(0.6, 1.4);
            for (k, v) in signal.iter_mut().skip(i).take(length).enumerate() {
                *v += size * (TAU * (k as f64 + 0.5) / length as f64).sin();
            }
        }
    }
    signal
}

/// The first coordinate of the Lorenz system (1963) at its usual parameters: a swing about either of two places.
fn swing_without_period(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let slope = |[x, y, z]: [f64; 3]| [10.0 * (y - x), x * (28.0 - z) - y, x * y - 8.0 / 3.0 * z];
    let step = |s: [f64; 3], h: f64| {
        let along = |by: f64, k: [f64; 3]| std::array::from_fn(|i| s[i] + by * k[i]);
        let a = slope(s);
        let b = slope(along(h / 2.0, a));
        let c = slope(along(h / 2.0, b));
        let d = slope(along(h, c));
        std::array::from_fn(|i| s[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
    };
    // One swing takes 0.75 of its units of time.
    let pace = 0.75 / draw.by_ratio(0.6, 4.0) / stand.rate_hz;
    let parts = (pace / 0.005).ceil().max(1.0);
    let mut state = [draw.normal(), draw.normal(), 25.0 + draw.normal()];
    for _ in 0..4000 {
        state = step(state, 0.005);
    }
    (0..stand.samples())
        .map(|_| {
            for _ in 0..parts as usize {
                state = step(state, pace / parts);
            }
            state[0]
        })
        .collect()
}

/// A damped mode that something random drives: x[i] = first x[i-1] + second x[i-2] + sqrt(drive) e[i], of variance 1.
pub(super) struct Mode {
    first: f64,
    second: f64,
    drive: f64,
}

impl Mode {
    /// By frequency and half width, Hz.
    pub(super) fn new(f: f64, half_width: f64, rate_hz: f64) -> Self {
        let r = (-TAU * half_width / rate_hz).exp();
        let (first, second) = (2.0 * r * (TAU * f / rate_hz).cos(), -r * r);
        Self {
            first,
            second,
            // Yule and Walker.
            drive: (1.0 + second) * ((1.0 - second).powi(2) - first * first) / (1.0 - second),
        }
    }

    /// Its density at an angular frequency, rad per sample.
    pub(super) fn density(&self, w: f64) -> f64 {
        let re = 1.0 - self.first * w.cos() - self.second * (2.0 * w).cos();
        let im = self.first * w.sin() + self.second * (2.0 * w).sin();
        self.drive / (re * re + im * im)
    }
}

fn resonance(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let f = draw.by_ratio(0.6, 8.0);
    // A mode damped much more has no peak left.
    let half_width = draw.by_ratio(0.03, 0.3).min(f / 4.0);
    let mode = Mode::new(f, half_width, stand.rate_hz);
    let meter = Meter::new(stand, axis);
    let shape: Vec<f64> = meter.omega().iter().map(|w| mode.density(*w)).collect();
    let strength =
        |sigma: f64| meter.of_density(&shape.iter().map(|d| sigma * sigma * d).collect::<Vec<_>>());
    let sigma = size_for(wanted, &strength);
    let (mut now, mut before) = (0.0, 0.0);
    let mut next = || {
        let new = mode.first * now + mode.second * before + mode.drive.sqrt() * draw.normal();
        (now, before) = (new, now);
        sigma * new
    };
    for _ in 0..(5.0 * stand.rate_hz / half_width) as usize {
        next();
    }
    Foreign {
        name,
        strength: strength(sigma),
        change: Change::Add((0..stand.samples()).map(|_| next()).collect()),
    }
}

/// White noise whose spectrum is changed by `by` at an angular frequency, as a share of its variance.
pub(super) fn shaped(stand: &Stand, axis: usize, by: &dyn Fn(f64) -> f64) -> f64 {
    let meter = Meter::new(stand, axis);
    let white = stand.white(axis);
    let density: Vec<f64> = meter.omega().iter().map(|w| white * by(*w)).collect();
    meter.of_density(&density)
}

/// What a share of differenced noise changes, at an angular frequency.
pub(super) fn by_difference(share: f64, w: f64) -> f64 {
    -share.min(1.0) * w.cos()
}

/// What an echo of a share `g` after so many samples changes, at an angular frequency.
pub(super) fn by_echo(g: f64, after: usize, w: f64) -> f64 {
    2.0 * g / (1.0 + g * g) * (after as f64 * w).cos()
}

/// A rate that the part works out from angles: the noise of each angle enters two rates, once with either sign. This is
/// the Q of IEEE Std 952.
fn differenced(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let strength = |share: f64| shaped(stand, axis, &|w| by_difference(share, w));
    let share = size_for(wanted, &strength).min(1.0);
    let mut before = draw.normal();
    let noise = (0..stand.samples())
        .map(|_| {
            let angle = draw.normal();
            let rate = (angle - before) / 2f64.sqrt();
            before = angle;
            share.sqrt() * rate + (1.0 - share).sqrt() * draw.normal()
        })
        .collect();
    Foreign {
        name,
        strength: strength(share),
        change: Change::Noise(noise, 1.0),
    }
}

/// A share of the reading some samples ago comes again: a buffer or a capacitor that is not emptied.
fn echo(draw: &mut Draw, stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let (after, sign) = (3 + draw.of_many(23), draw.sign());
    let strength = |share: f64| shaped(stand, axis, &|w| by_echo(sign * share.min(1.0), after, w));
    let share = size_for(wanted, &strength).min(1.0);
    let white: Vec<f64> = (0..stand.samples() + after)
        .map(|_| draw.normal())
        .collect();
    let noise = (after..white.len())
        .map(|i| (white[i] + sign * share * white[i - after]) / (1.0 + share * share).sqrt())
        .collect();
    Foreign {
        name,
        strength: strength(share),
        change: Change::Noise(noise, 1.0),
    }
}

pub(super) fn variance(name: &'static str, wanted: f64, law: &dyn Fn(f64) -> Vec<f64>) -> Foreign {
    let size = size_for(wanted, &|x| of_variance(&law(x)));
    let law = law(size);
    Foreign {
        name,
        strength: of_variance(&law),
        change: Change::Scale(law.iter().map(|v| v.sqrt()).collect()),
    }
}

/// d' of `n` draws from a law (probabilities of equal cells) against the other law.
pub(super) fn of_law(truth: &[f64], other: &[f64], n: usize) -> f64 {
    let nats: f64 = truth
        .iter()
        .zip(other)
        .filter(|(p, _)| **p > 1e-300)
        .map(|(p, q)| p * (p / q.max(1e-300)).ln())
        .sum();
    (2.0 * n as f64 * nats).max(0.0).sqrt()
}

/// Shares of so many equal cells either way of 0, as far as `reach`, by a density.
pub(super) fn cells(count: i32, reach: f64, of: &dyn Fn(f64) -> f64) -> Vec<f64> {
    let at = |i: i32| reach * f64::from(i) / f64::from(count);
    let all: Vec<f64> = (-count..=count).map(|i| of(at(i))).collect();
    let sum: f64 = all.iter().sum();
    all.iter().map(|p| p / sum).collect()
}

/// Density of the sum of a uniform part, `share` of a variance of 1, and a normal rest, against the normal law.
fn of_uniform(share: f64, n: usize) -> f64 {
    let (half, rest) = ((3.0 * share).sqrt(), (1.0 - share).max(1e-6).sqrt());
    let below = |z: f64| 0.5 * statrs::function::erf::erfc(-z / 2f64.sqrt());
    let mixed = |x: f64| (below((x + half) / rest) - below((x - half) / rest)) / (2.0 * half);
    let normal = |x: f64| (-0.5 * x * x).exp() / TAU.sqrt();
    let law = |of: &dyn Fn(f64) -> f64| cells(1200, 6.0, of);
    of_law(&law(&mixed), &law(&normal), n)
}

/// A dither of even law, as converters add it, makes up a part of the noise.
fn uniform_part(draw: &mut Draw, stand: &Stand, name: &'static str, wanted: f64) -> Foreign {
    let n = stand.samples();
    let strength = |share: f64| of_uniform(share.min(0.999), n);
    let share = size_for(wanted, &strength).min(0.999);
    let half = 3f64.sqrt();
    Foreign {
        name,
        strength: strength(share),
        change: Change::Noise((0..n).map(|_| draw.between(-half, half)).collect(), share),
    }
}

/// Sigma either way of the bias within which the edges between codes are drawn.
const REACH: f64 = 7.0;

/// Shares of the codes between these edges, counts, for a normal law.
pub(super) fn shares(edges: &[f64], mean: f64, sigma: f64) -> Vec<f64> {
    let below = |e: &f64| 0.5 * statrs::function::erf::erfc((mean - e) / sigma / 2f64.sqrt());
    let below: Vec<f64> = edges.iter().map(below).collect();
    below.windows(2).map(|w| w[1] - w[0]).collect()
}

/// A converter whose steps are not of equal width: each edge between two codes lies off its place by its own amount.
fn uneven_steps(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let (bias, sigma) = (stand.bias[axis] / LSB, stand.white(axis).sqrt() / LSB);
    let first = (bias - REACH * sigma).floor();
    let last = (bias + REACH * sigma).ceil();
    let off: Vec<f64> = (first as i32..=last as i32)
        .map(|_| draw.between(-0.5, 0.5))
        .collect();
    let edges = |size: f64| -> Vec<f64> {
        let at = |(i, o): (usize, &f64)| first + i as f64 - 0.5 + size.min(0.98) * o;
        off.iter().enumerate().map(at).collect()
    };
    let even = shares(&edges(0.0), bias, sigma);
    let strength = |size: f64| of_law(&shares(&edges(size), bias, sigma), &even, stand.samples());
    let size = size_for(wanted, &strength).min(0.98);
    Foreign {
        name,
        strength: strength(size),
        change: Change::Edges(first as i32, edges(size)),
    }
}
