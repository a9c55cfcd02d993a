//! What a foreign effect does to the readings of a finished run.

use std::cell::Cell;

use model::record::Record;

use crate::random::Draw;
use crate::stand::{GYROS, LSB, Stand};

/// What the three axes read, counts.
pub(super) type Counts = [Vec<i32>; 3];
/// New counts of an axis by those that the three have read.
type Making = dyn Fn(&Counts, &mut Draw) -> Vec<i32>;

/// What it does to a channel: adds a signal, or makes new noise out of old, or new counts.
pub(super) enum Change {
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
pub(super) fn counts(record: &Record) -> Counts {
    GYROS.map(|name| {
        let own = record.channels.iter().find(|c| c.name == name);
        own.and_then(|c| c.counts.clone()).unwrap_or_default()
    })
}

/// The code of a rate, counts, by a converter of these lower edges from a first code on. Beyond the edges that are known
/// the steps are even.
fn code(at: f64, first: i32, edges: &[f64]) -> i32 {
    match edges.partition_point(|e| *e <= at) as i32 {
        0 => at.round() as i32,
        k if k == edges.len() as i32 => at.round().max(f64::from(first + k - 1)) as i32,
        k => first + k - 1,
    }
}

impl Change {
    /// Counts of an axis that are made of those of all three.
    pub(super) fn made(new: impl Fn(&Counts, &mut Draw) -> Vec<i32> + 'static) -> Self {
        Self::Made(Box::new(new))
    }

    /// Whether it brings the white noise of its channel itself, so that the stand has to leave it out.
    pub(super) fn replaces_noise(&self) -> bool {
        matches!(self, Self::Scale(_) | Self::Noise(..))
    }

    /// Rms of what is added, deg/s.
    pub(super) fn rms(&self) -> f64 {
        match self {
            Self::Add(signal) => {
                let n = signal.len() as f64;
                let mean = signal.iter().sum::<f64>() / n;
                (signal.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
            }
            _ => 0.0,
        }
    }

    /// Act on the channel of an axis.
    pub(super) fn act(&self, record: &mut Record, stand: &Stand, axis: usize, draw: &mut Draw) {
        let (channel, sigma) = (GYROS[axis], stand.white(axis).sqrt());
        match self {
            Self::Add(signal) => add(record, channel, signal, draw),
            Self::Scale(factor) => {
                let noise: Vec<f64> = factor.iter().map(|f| f * sigma * draw.normal()).collect();
                add(record, channel, &noise, draw);
            }
            Self::Noise(noise, share) => {
                let (own, normal) = (share.sqrt() * sigma, (1.0 - share).sqrt() * sigma);
                let mixed: Vec<f64> = noise
                    .iter()
                    .map(|e| own * e + normal * draw.normal())
                    .collect();
                add(record, channel, &mixed, draw);
            }
            Self::Late {
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
            Self::Frames { axis, chance } => {
                let other = readings(record, *axis);
                let taken: Vec<bool> = other.iter().map(|_| draw.chance(*chance)).collect();
                let new = |i: usize, v: f64| if taken[i] { other[i] } else { v };
                change_readings(record, channel, draw, new);
            }
            Self::Made(new) => {
                let new = new(&counts(record), draw);
                if let Some(c) = record.channels.iter_mut().find(|c| c.name == channel) {
                    c.values = new.iter().map(|c| LSB * f64::from(*c)).collect();
                    c.counts = Some(new);
                }
            }
            _ => self.convert(record, channel, stand.bias[axis], draw),
        }
    }

    /// Act as a converter does, that knows each reading and at most the one before.
    fn convert(&self, record: &mut Record, channel: &str, middle: f64, draw: &mut Draw) {
        let last = Cell::new(f64::NAN);
        let new = |v: f64| match self {
            Self::DeadBand(band) if (v - middle).abs() < *band => middle,
            Self::Missing(every) => {
                let code = (v / LSB).round() as i32;
                let next = code.rem_euclid(*every) == 0;
                LSB * f64::from(code + i32::from(next))
            }
            Self::Edges(first, edges) => LSB * f64::from(code(v / LSB, *first, edges)),
            Self::Holds(beyond) => {
                let now = v / LSB;
                // The first reading is taken whatever it is.
                if last.get().is_nan() || (now - last.get()).abs() >= *beyond {
                    last.set(now.round());
                }
                LSB * last.get()
            }
            _ => v,
        };
        change_readings(record, channel, draw, |_, v| new(v));
    }
}
