//! What a foreign effect does to the readings of a finished run.

use model::record::Record;

use super::words::within_step;
use crate::random::Draw;
use crate::series::{each, spread};
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
    /// Noise in place of the white noise, of variance 1, as a share of it.
    Noise(Vec<f64>, f64),
    /// Counts of the axis, made of those of all three.
    Made(Box<Making>),
}

/// Add a signal to a channel, and let the converter round again.
pub fn add(record: &mut Record, channel: &str, signal: &[f64], draw: &mut Draw) {
    let Some(c) = record.channels.iter_mut().find(|c| c.name == channel) else {
        return;
    };
    // The step of readings without noise is next to nothing.
    let (Some(counts), Some(step)) = (&mut c.counts, c.lsb.replace(LSB)) else {
        return;
    };
    for (i, count) in counts.iter_mut().enumerate() {
        let v = step * within_step(*count, draw) + signal[i];
        *count = (v / LSB).round() as i32;
        c.values[i] = LSB * f64::from(*count);
    }
}

/// What the three axes read, counts.
pub(super) fn counts(record: &Record) -> Counts {
    GYROS.map(|name| {
        let own = record.channels.iter().find(|c| c.name == name);
        let step = own.and_then(|c| c.lsb).unwrap_or(LSB);
        let counts = own.and_then(|c| c.counts.clone()).unwrap_or_default();
        each(&counts, |n| (f64::from(n) * step / LSB).round() as i32)
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
    /// What a converter of these lower edges of its codes from the first on, counts, reads of an axis.
    pub(super) fn edges(axis: usize, (first, edges): (i32, Vec<f64>)) -> Self {
        Self::reread(axis, move |rate| code(rate, first, &edges))
    }

    /// What is read of an axis by the rate that it has read, counts.
    pub(super) fn reread(axis: usize, read: impl Fn(f64) -> i32 + 'static) -> Self {
        Self::made(move |counts, draw| each(&counts[axis], |own| read(within_step(own, draw))))
    }

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
            Self::Add(signal) => spread(signal).sqrt(),
            _ => 0.0,
        }
    }

    /// Act on the channel of an axis.
    pub(super) fn act(&self, record: &mut Record, stand: &Stand, axis: usize, draw: &mut Draw) {
        let (channel, sigma) = (GYROS[axis], stand.white_before_rounding(axis).sqrt());
        match self {
            Self::Add(signal) => add(record, channel, signal, draw),
            Self::Scale(factor) => {
                let noise = each(factor, |f| f * sigma * draw.normal());
                add(record, channel, &noise, draw);
            }
            Self::Noise(noise, share) => {
                let (own, normal) = (share.sqrt() * sigma, (1.0 - share).sqrt() * sigma);
                let mixed = each(noise, |e| own * e + normal * draw.normal());
                add(record, channel, &mixed, draw);
            }
            Self::Made(new) => {
                let new = new(&counts(record), draw);
                if let Some(c) = record.channels.iter_mut().find(|c| c.name == channel) {
                    c.values = each(&new, |c| LSB * f64::from(c));
                    c.counts = Some(new);
                }
            }
        }
    }
}
