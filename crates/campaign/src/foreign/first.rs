//! The first foreign effects: 14 that the engine was developed with, then eight that were kept back until 2026-11-21.

use super::{Change, Foreign, PLAIN, Set, extremes, of_signal, swing};
use crate::random::Draw;
use crate::stand::{Needs, Stand};
use crate::strength::{of_variance, size_for};

/// Their names.
pub const NAMES: [&str; 22] = [
    "chirp",
    "square wave",
    "comb of harmonics",
    "bursts of ringing",
    "backlash in temperature",
    "rate of temperature",
    "duty times temperature",
    "sawtooth",
    "jumps at random",
    "swinging variance",
    "growing variance",
    "heavy tails",
    "skewed noise",
    "dead band",
    "creep",
    "line that changes its pitch",
    "line that comes and goes",
    "bursts of noise",
    "noise that follows temperature",
    "codes that are missing",
    "jumps that relax",
    "random walk for a while",
];

/// The set.
pub(super) const SET: Set = Set {
    names: &NAMES,
    needs: |_| Needs {
        temperature: true,
        motor: true,
        ..Needs::default()
    },
    parts,
    one: |draw, stand, name, axis, wanted| Some(one(draw, stand, name, axis, wanted)),
    ..PLAIN
};

/// Causes of the library that are a true part of it: a line where there is one, and the straight line through a loop.
fn parts(name: &str) -> &'static [&'static str] {
    match name {
        "line that comes and goes" => &["line"],
        "backlash in temperature" => &["temperature", "temperature_quadratic"],
        _ => &[],
    }
}

/// One of them, by its name.
fn one(draw: &mut Draw, stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let n = stand.samples();
    let t = |i: usize| i as f64 / stand.rate_hz;
    let tau = std::f64::consts::TAU;
    let temperature = &stand.world.temperature[axis];
    let mean = temperature.iter().sum::<f64>() / n as f64;
    let shape: Option<Vec<f64>> = match name {
        "chirp" => {
            let (from, to) = (draw.between(0.5, 3.0), draw.between(4.0, 9.0));
            Some(
                (0..n)
                    .map(|i| {
                        let f = from + (to - from) * t(i) / stand.seconds / 2.0;
                        (tau * f * t(i)).sin()
                    })
                    .collect(),
            )
        }
        "square wave" => {
            let period = draw.between(5.0, 40.0);
            Some(
                (0..n)
                    .map(|i| {
                        if (t(i) / period).fract() < 0.5 {
                            1.0
                        } else {
                            -1.0
                        }
                    })
                    .collect(),
            )
        }
        "comb of harmonics" => {
            let f = draw.between(0.4, 1.5);
            let phases: Vec<f64> = (0..6).map(|_| draw.between(0.0, tau)).collect();
            Some(
                (0..n)
                    .map(|i| {
                        let term =
                            |(k, p): (usize, &f64)| (tau * f * (k + 1) as f64 * t(i) + p).sin();
                        phases.iter().enumerate().map(term).sum()
                    })
                    .collect(),
            )
        }
        "bursts of ringing" => {
            let (f, decay) = (draw.between(0.8, 6.0), draw.between(0.5, 3.0));
            let mut y = vec![0.0; n];
            let mut at = 5.0;
            while at < stand.seconds {
                let first = (at * stand.rate_hz) as usize;
                for (i, v) in y.iter_mut().enumerate().skip(first) {
                    let s = t(i) - at;
                    *v += (-s / decay).exp() * (tau * f * s).sin();
                }
                at += 15.0 * draw.exponential() + 3.0;
            }
            Some(y)
        }
        "backlash in temperature" => {
            // What follows the temperature only after it has moved through the play.
            let play = 0.4 * swing(temperature);
            let mut held = temperature[0];
            Some(
                temperature
                    .iter()
                    .map(|v| {
                        held = held.clamp(v - play, v + play);
                        // Minus what a linear term takes.
                        held - 0.6 * v
                    })
                    .collect(),
            )
        }
        "rate of temperature" => {
            let w = (2.0 * stand.rate_hz) as usize;
            Some(
                (0..n)
                    .map(|i| temperature[(i + w).min(n - 1)] - temperature[i.saturating_sub(w)])
                    .collect(),
            )
        }
        "duty times temperature" => Some(
            (0..n)
                .map(|i| stand.world.duty[i] * (temperature[i] - mean))
                .collect(),
        ),
        "sawtooth" => {
            let period = draw.between(20.0, 90.0);
            Some((0..n).map(|i| (t(i) / period).fract() - 0.5).collect())
        }
        "jumps at random" => {
            let mut level = 0.0;
            let mut left = 0.0;
            Some(
                (0..n)
                    .map(|_| {
                        if left <= 0.0 {
                            level = draw.normal();
                            left = 25.0 * draw.exponential();
                        }
                        left -= 1.0 / stand.rate_hz;
                        level
                    })
                    .collect(),
            )
        }
        "creep" => {
            // After it was handled, a mount settles by the logarithm of time.
            let (at, first) = (
                stand.seconds * draw.between(0.0, 0.5),
                draw.by_ratio(0.5, 5.0),
            );
            let since = |i: usize| (t(i) - at).max(0.0);
            Some((0..n).map(|i| (1.0 + since(i) / first).ln()).collect())
        }
        "line that changes its pitch" => {
            let (f, period) = (draw.between(1.0, 8.0), draw.between(20.0, 120.0));
            let turns = draw.between(0.2, 0.8) * period / 2.0;
            let phase = |i: usize| tau * f * t(i) + turns * (tau * t(i) / period).sin();
            Some((0..n).map(|i| phase(i).sin()).collect())
        }
        "line that comes and goes" => {
            let f = draw.between(0.5, 8.0);
            let (mut on, mut left) = (draw.chance(0.5), 0.0);
            Some(
                (0..n)
                    .map(|i| {
                        if left <= 0.0 {
                            on = !on;
                            left = draw.between(10.0, 60.0);
                        }
                        left -= 1.0 / stand.rate_hz;
                        f64::from(u8::from(on)) * (tau * f * t(i)).sin()
                    })
                    .collect(),
            )
        }
        "jumps that relax" => {
            let decay = draw.between(3.0, 15.0);
            let (mut y, mut left) = (0.0, 5.0);
            Some(
                (0..n)
                    .map(|_| {
                        left -= 1.0 / stand.rate_hz;
                        y *= (-1.0 / (decay * stand.rate_hz)).exp();
                        if left <= 0.0 {
                            y += draw.sign() * draw.between(0.5, 1.5);
                            left = 10.0 + 30.0 * draw.exponential();
                        }
                        y
                    })
                    .collect(),
            )
        }
        "random walk for a while" => {
            let length = stand.seconds * draw.between(0.15, 0.4);
            let start = draw.between(0.05 * stand.seconds, 0.95 * stand.seconds - length);
            let mut y = 0.0;
            Some(
                (0..n)
                    .map(|i| {
                        if (start..start + length).contains(&t(i)) {
                            y += draw.normal();
                        }
                        y
                    })
                    .collect(),
            )
        }
        _ => None,
    };
    if let Some(unit) = shape {
        return of_signal(stand, name, axis, &unit, wanted);
    }
    match name {
        "swinging variance" | "growing variance" => {
            let period = draw.between(30.0, 150.0);
            let growing = name == "growing variance";
            let law = |depth: f64| -> Vec<f64> {
                (0..n)
                    .map(|i| {
                        if growing {
                            1.0 + depth * t(i) / stand.seconds
                        } else {
                            (1.0 + depth.min(0.999) * (tau * t(i) / period).sin()).max(1e-3)
                        }
                    })
                    .collect()
            };
            let depth = size_for(wanted, &|x| of_variance(&law(x)));
            let found = law(depth);
            let change = Change::Scale(found.iter().map(|v| v.sqrt()).collect());
            Foreign {
                name,
                strength: of_variance(&found),
                change,
            }
        }
        "bursts of noise" | "noise that follows temperature" => {
            let (low, high) = extremes(temperature);
            let (mut on, mut left) = (false, draw.between(5.0, 40.0));
            let shape: Vec<f64> = (0..n)
                .map(|i| {
                    if name != "bursts of noise" {
                        return (temperature[i] - low) / (high - low);
                    }
                    left -= 1.0 / stand.rate_hz;
                    if left <= 0.0 {
                        on = !on;
                        left = if on {
                            draw.between(2.0, 10.0)
                        } else {
                            draw.between(20.0, 60.0)
                        };
                    }
                    f64::from(u8::from(on))
                })
                .collect();
            let law = |size: f64| shape.iter().map(|s| 1.0 + size * s).collect::<Vec<f64>>();
            let found = law(size_for(wanted, &|x| of_variance(&law(x))));
            Foreign {
                name,
                strength: of_variance(&found),
                change: Change::Scale(found.iter().map(|v| v.sqrt()).collect()),
            }
        }
        "codes that are missing" => Foreign {
            name,
            strength: f64::NAN,
            change: Change::Missing([3, 5, 6, 7, 10][draw.of_many(5)]),
        },
        "heavy tails" => {
            // Laplace noise, mixed in so that the kurtosis shows.
            let noise = (0..n)
                .map(|_| draw.sign() * draw.exponential() / 2f64.sqrt())
                .collect();
            Foreign {
                name,
                strength: f64::NAN,
                change: Change::Noise(noise, 1.0),
            }
        }
        "skewed noise" => {
            let noise = (0..n).map(|_| draw.exponential() - 1.0).collect();
            Foreign {
                name,
                strength: f64::NAN,
                change: Change::Noise(noise, 0.7),
            }
        }
        _ => {
            let band = stand.white(axis).sqrt() * draw.between(0.5, 1.2);
            Foreign {
                name,
                strength: f64::NAN,
                change: Change::DeadBand(band),
            }
        }
    }
}
