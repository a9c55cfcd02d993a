//! Effects that the library does not have. They act on the readings of a finished run; what they are is known here alone.

use std::cell::Cell;

use model::record::Record;

use crate::random::Draw;
use crate::stand::{GYROS, LSB, Needs, Stand};
use crate::strength::{Meter, of_variance, size_for};

mod kept_back;
mod kept_back_fifth;
mod kept_back_fourth;
mod kept_back_seventh;
mod kept_back_sixth;
mod kept_back_third;
#[cfg(test)]
mod library_share;

/// What there is: first those that the engine was developed with or has been changed after, then those kept back.
pub const FOREIGN: [&str; SEEN + kept_back_seventh::NAMES.len()] = {
    let mut all = [""; SEEN + kept_back_seventh::NAMES.len()];
    let mut i = 0;
    while i < all.len() {
        all[i] = if i < FIRST.len() {
            FIRST[i]
        } else if i < SECOND {
            kept_back::NAMES[i - FIRST.len()]
        } else if i < THIRD {
            kept_back_third::NAMES[i - SECOND]
        } else if i < FOURTH {
            kept_back_fourth::NAMES[i - THIRD]
        } else if i < FIFTH {
            kept_back_fifth::NAMES[i - FOURTH]
        } else if i < SEEN {
            kept_back_sixth::NAMES[i - FIFTH]
        } else {
            kept_back_seventh::NAMES[i - SEEN]
        };
        i += 1;
    }
    all
};
/// How many of them, from the first, are no longer unseen: the engine was made with 14 of them, and has been changed
/// since it was graded on the next eight, and on the second to the sixth set kept back.
pub const SEEN: usize = FIFTH + kept_back_sixth::NAMES.len();

/// Where the second to the fifth set end.
const SECOND: usize = FIRST.len() + kept_back::NAMES.len();
const THIRD: usize = SECOND + kept_back_third::NAMES.len();
const FOURTH: usize = THIRD + kept_back_fourth::NAMES.len();
const FIFTH: usize = FOURTH + kept_back_fifth::NAMES.len();

const FIRST: [&str; 22] = [
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

/// The environment that they need.
#[must_use]
pub fn needs(name: &str) -> Needs {
    kept_back_seventh::needs(name)
        .or_else(|| kept_back_sixth::needs(name))
        .or_else(|| kept_back_fifth::needs(name))
        .or_else(|| kept_back_fourth::needs(name))
        .or_else(|| kept_back_third::needs(name))
        .unwrap_or_else(|| kept_back::needs(name))
}

/// Causes of the library that are a true part of one.
#[must_use]
pub fn parts(name: &str) -> Vec<&'static str> {
    [
        kept_back_fourth::parts(name),
        kept_back_fifth::parts(name),
        kept_back_sixth::parts(name),
        kept_back_seventh::parts(name),
    ]
    .concat()
}

/// What it does to a channel: adds a signal, or makes new noise out of old.
pub struct Foreign {
    /// Its name.
    pub name: &'static str,
    /// Its d' where that is defined.
    pub strength: f64,
    change: Change,
}

enum Change {
    Add(Vec<f64>),
    /// White noise of this size over the usual one.
    Scale(Vec<f64>),
    /// Every reading within this distance of the middle reads the middle, deg/s.
    DeadBand(f64),
    /// Every so many counts a code that never comes: its readings move up by one.
    Missing(i32),
    /// Noise in place of the white noise, of variance 1, as a share of it.
    Noise(Vec<f64>, f64),
    /// Lower edges of the codes from the first one on, counts.
    Edges(i32, Vec<f64>),
    /// A reading stands until the rate is this far from it, counts.
    Holds(f64),
    /// A share of another axis's reading, about its mean, so many frames before.
    Late {
        axis: usize,
        share: f64,
        frames: usize,
    },
    /// With this chance the reading is another axis's of the same frame.
    Frames {
        axis: usize,
        chance: f64,
    },
    /// Counts of the axis, made of those of all three.
    Made(Box<Making>),
}

/// New counts of an axis by those that the three have read.
type Making = dyn Fn(&[Vec<i32>; 3], &mut Draw) -> Vec<i32>;

/// Rms of what is added, deg/s.
fn rms(f: &Foreign) -> f64 {
    match &f.change {
        Change::Add(signal) => {
            let n = signal.len() as f64;
            let mean = signal.iter().sum::<f64>() / n;
            (signal.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
        }
        _ => 0.0,
    }
}

/// Largest rms of what is added, deg/s: a gyro that reads more below 1 Hz has been turned, whoever looks at it.
const LARGEST_RMS: f64 = 0.28;

/// One of them, on an axis of a stand, at a strength of `wanted`; weaker where that would need more than
/// [`LARGEST_RMS`] however it is drawn. The world of the stand may gain what drives it.
#[must_use]
pub fn foreign(
    draw: &mut Draw,
    stand: &mut Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    const TRIES: usize = 12;
    for _ in 0..TRIES {
        let f = any(draw, stand, name, axis, wanted);
        if rms(&f) <= LARGEST_RMS {
            return f;
        }
    }
    let mut f = any(draw, stand, name, axis, wanted);
    let down = (LARGEST_RMS / rms(&f)).min(1.0);
    if let Change::Add(signal) = &mut f.change {
        signal.iter_mut().for_each(|v| *v *= down);
        let meter = Meter::new(stand, axis);
        f.strength = meter.of_signal(&meter.energy(signal));
    }
    f
}

fn any(
    draw: &mut Draw,
    stand: &mut Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    kept_back::one(draw, stand, name, axis, wanted)
        .or_else(|| kept_back_third::one(draw, stand, name, axis, wanted))
        .or_else(|| kept_back_fourth::one(draw, stand, name, axis, wanted))
        .or_else(|| kept_back_fifth::one(draw, stand, name, axis, wanted))
        .or_else(|| kept_back_sixth::one(draw, stand, name, axis, wanted))
        .or_else(|| kept_back_seventh::one(draw, stand, name, axis, wanted))
        .unwrap_or_else(|| one(draw, stand, name, axis, wanted))
}

/// A signal of this shape, at the size that gives the strength.
fn of_signal(stand: &Stand, name: &'static str, axis: usize, unit: &[f64], wanted: f64) -> Foreign {
    let meter = Meter::new(stand, axis);
    let (size, strength) = meter.sized(&meter.energy(unit), wanted);
    Foreign {
        name,
        strength,
        change: Change::Add(unit.iter().map(|v| size * v).collect()),
    }
}

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

fn extremes(values: &[f64]) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| {
            (l.min(v), h.max(v))
        })
}

fn swing(values: &[f64]) -> f64 {
    let (low, high) = extremes(values);
    high - low
}

/// Add a signal to a channel, and let the converter round again.
pub fn add(record: &mut Record, channel: &str, signal: &[f64], draw: &mut Draw) {
    change_readings(record, channel, draw, |i, v| v + signal[i]);
}

fn change_readings(
    record: &mut Record,
    channel: &str,
    draw: &mut Draw,
    new: impl Fn(usize, f64) -> f64,
) {
    let Some(c) = record.channels.iter_mut().find(|c| c.name == channel) else {
        return;
    };
    let Some(counts) = &mut c.counts else { return };
    for (i, count) in counts.iter_mut().enumerate() {
        // Within its step the rate is anywhere.
        let inside = draw.between(-0.5, 0.5);
        let v = new(i, LSB * (f64::from(*count) + inside));
        *count = (v / LSB).round() as i32;
        c.values[i] = LSB * f64::from(*count);
    }
}

/// What an axis reads, deg/s.
fn readings(record: &Record, axis: usize) -> Vec<f64> {
    let own = record.channels.iter().find(|c| c.name == GYROS[axis]);
    own.map(|c| c.values.clone()).unwrap_or_default()
}

/// What the three axes read, counts.
fn counts(record: &Record) -> [Vec<i32>; 3] {
    GYROS.map(|name| {
        let own = record.channels.iter().find(|c| c.name == name);
        own.and_then(|c| c.counts.clone()).unwrap_or_default()
    })
}

impl Foreign {
    /// Whether it brings the white noise of its channel itself, so that the stand has to leave it out.
    #[must_use]
    pub fn replaces_noise(&self) -> bool {
        matches!(self.change, Change::Scale(_) | Change::Noise(..))
    }

    /// Act on a channel of a run.
    pub fn act(
        &self,
        record: &mut Record,
        channel: &str,
        stand: &Stand,
        axis: usize,
        draw: &mut Draw,
    ) {
        let sigma = stand.white(axis).sqrt();
        match &self.change {
            Change::Add(signal) => add(record, channel, signal, draw),
            Change::Scale(factor) => {
                let noise: Vec<f64> = factor.iter().map(|f| f * sigma * draw.normal()).collect();
                add(record, channel, &noise, draw);
            }
            Change::DeadBand(band) => {
                let middle = stand.bias[axis];
                change_readings(record, channel, draw, |_, v| {
                    if (v - middle).abs() < *band {
                        middle
                    } else {
                        v
                    }
                });
            }
            Change::Missing(every) => {
                change_readings(record, channel, draw, |_, v| {
                    let code = (v / LSB).round() as i32;
                    let next = code.rem_euclid(*every) == 0;
                    LSB * f64::from(code + i32::from(next))
                });
            }
            Change::Noise(noise, share) => {
                let (own, normal) = (share.sqrt() * sigma, (1.0 - share).sqrt() * sigma);
                let mixed: Vec<f64> = noise
                    .iter()
                    .map(|e| own * e + normal * draw.normal())
                    .collect();
                add(record, channel, &mixed, draw);
            }
            Change::Edges(first, edges) => {
                change_readings(record, channel, draw, |_, v| {
                    let at = v / LSB;
                    let above = edges.partition_point(|e| *e <= at) as i32;
                    // Beyond the edges that are known the steps are even.
                    let code = match above {
                        0 => at.round() as i32,
                        k if k == edges.len() as i32 => {
                            at.round().max(f64::from(first + k - 1)) as i32
                        }
                        k => first + k - 1,
                    };
                    LSB * f64::from(code)
                });
            }
            Change::Holds(beyond) => {
                let stands = Cell::new(f64::NAN);
                change_readings(record, channel, draw, |_, v| {
                    let now = v / LSB;
                    // The first reading is taken whatever it is.
                    if stands.get().is_nan() || (now - stands.get()).abs() >= *beyond {
                        stands.set(now.round());
                    }
                    LSB * stands.get()
                });
            }
            Change::Late {
                axis,
                share,
                frames,
            } => {
                let other = readings(record, *axis);
                let mean = other.iter().sum::<f64>() / other.len() as f64;
                let signal: Vec<f64> = (0..other.len())
                    .map(|i| share * (other[i.saturating_sub(*frames)] - mean))
                    .collect();
                add(record, channel, &signal, draw);
            }
            Change::Frames { axis, chance } => {
                let other = readings(record, *axis);
                let taken: Vec<bool> = other.iter().map(|_| draw.chance(*chance)).collect();
                change_readings(
                    record,
                    channel,
                    draw,
                    |i, v| {
                        if taken[i] { other[i] } else { v }
                    },
                );
            }
            Change::Made(new) => {
                let new = new(&counts(record), draw);
                if let Some(c) = record.channels.iter_mut().find(|c| c.name == channel) {
                    c.values = new.iter().map(|c| LSB * f64::from(*c)).collect();
                    c.counts = Some(new);
                }
            }
        }
    }
}
