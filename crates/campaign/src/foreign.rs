//! Effects that the library does not have. They act on the readings of a finished run; what they are is known here alone.

use std::cell::Cell;

use model::record::Record;

use crate::random::Draw;
use crate::stand::{GYROS, LSB, Needs, Stand};
use crate::strength::Meter;

mod first;
mod kept_back;
mod kept_back_eighth;
mod kept_back_eleventh;
mod kept_back_fifth;
mod kept_back_fourteenth;
mod kept_back_fourth;
mod kept_back_ninth;
mod kept_back_seventh;
mod kept_back_sixth;
mod kept_back_tenth;
mod kept_back_third;
mod kept_back_thirteenth;
mod kept_back_twelfth;
#[cfg(test)]
mod library_share;

/// A set of them: each file gives one.
struct Set {
    names: &'static [&'static str],
    /// Those that have a near twin in an earlier set, with the one that is nearest.
    twins: &'static [(&'static str, &'static str)],
    /// Beyond what every foreign effect gets.
    needs: fn(&str) -> Needs,
    /// Causes of the library that are a true part of one.
    parts: fn(&str) -> &'static [&'static str],
    /// The axis that one acts on, where it cannot be any.
    on_axis: fn(&str, usize) -> usize,
    /// One of them; `None` for a name of another set. The world of the stand may gain what drives it.
    one: fn(&mut Draw, &mut Stand, &'static str, usize, f64) -> Option<Foreign>,
}

/// What a set is where it does not say.
const PLAIN: Set = Set {
    names: &[],
    twins: &[],
    needs: |_| Needs {
        temperature: false,
        supply: false,
        motor: false,
        vibration: false,
    },
    parts: |_| &[],
    on_axis: |_, axis| axis,
    one: |_, _, _, _, _| None,
};

/// The sets, in the order in which they were written.
const SETS: &[Set] = &[
    first::SET,
    kept_back::SET,
    kept_back_third::SET,
    kept_back_fourth::SET,
    kept_back_fifth::SET,
    kept_back_sixth::SET,
    kept_back_seventh::SET,
    kept_back_eighth::SET,
    kept_back_ninth::SET,
    kept_back_tenth::SET,
    kept_back_eleventh::SET,
    kept_back_twelfth::SET,
    kept_back_thirteenth::SET,
    kept_back_fourteenth::SET,
];

/// The set that a name is of; the first for a name of none.
fn set_of(name: &str) -> &'static Set {
    let own = SETS.iter().find(|set| set.names.contains(&name));
    own.unwrap_or(&SETS[0])
}

/// How many names the first of the sets have together.
const fn names_in(sets: usize) -> usize {
    let (mut all, mut set) = (0, 0);
    while set < sets {
        all += SETS[set].names.len();
        set += 1;
    }
    all
}

/// What there is: first those that the engine was developed with or has been changed after, then those kept back.
pub const FOREIGN: [&str; names_in(SETS.len())] = {
    let mut all = [""; names_in(SETS.len())];
    let mut set = 0;
    while set < SETS.len() {
        let mut i = 0;
        while i < SETS[set].names.len() {
            all[names_in(set) + i] = SETS[set].names[i];
            i += 1;
        }
        set += 1;
    }
    all
};
/// How many of them, from the first, are no longer unseen: the engine was made with 14 of them, and has been changed
/// since it was graded on the next eight, and on the second to the thirteenth set kept back.
pub const SEEN: usize = names_in(SETS.len() - 1);

/// Whether one has a near twin in an earlier set, as its own set says: those from the tenth on do.
#[must_use]
pub fn has_twin(name: &str) -> bool {
    set_of(name).twins.iter().any(|(own, _)| *own == name)
}

/// The environment that they need.
#[must_use]
pub fn needs(name: &str) -> Needs {
    (set_of(name).needs)(name)
}

/// The axis that one acts on, where it cannot be any.
#[must_use]
pub fn on_axis(name: &str, axis: usize) -> usize {
    (set_of(name).on_axis)(name, axis)
}

/// Causes of the library that are a true part of one.
#[must_use]
pub fn parts(name: &str) -> &'static [&'static str] {
    (set_of(name).parts)(name)
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
    (set_of(name).one)(draw, stand, name, axis, wanted).expect("a set makes what it names")
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_twin_is_of_its_own_set_and_the_other_of_an_earlier_one() {
        for (place, set) in SETS.iter().enumerate() {
            for (own, other) in set.twins {
                let earlier = SETS[..place].iter().any(|s| s.names.contains(other));
                assert!(set.names.contains(own) && earlier, "{own}: {other}");
            }
        }
    }

    #[test]
    fn no_two_have_a_name_in_common() {
        for (i, name) in FOREIGN.iter().enumerate() {
            assert!(!FOREIGN[..i].contains(name), "{name}");
        }
    }
}
