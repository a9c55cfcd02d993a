//! Effects that the library does not have. They act on the readings of a finished run; what they are is known here alone.
//!
//! `catalogue` has one row for each, by kind, beside the makers that draw them; `sets` tells which were written when and by
//! whom. A maker draws a `Shape`. Its size, its strength, the largest size and what it does to the readings are found here.

use model::record::Record;

use crate::random::Draw;
use crate::stand::{Needs, Stand};

mod act;
#[cfg(test)]
mod battery;
mod catalogue;
mod known;
pub mod sets;
mod shape;
mod words;

use act::Change;
pub use act::add;
use catalogue::{EFFECTS, ForeignEffect, Make};
use known::Known;
use shape::{exponential, more, signal};

/// How many foreign effects there are.
const COUNT: usize = EFFECTS.len();

/// What there is, by number: first those that the engine was developed with or has been changed after, then those kept
/// back.
pub const FOREIGN: [&str; COUNT] = {
    let mut all = [""; COUNT];
    let mut i = 0;
    while i < COUNT {
        all[i] = EFFECTS[i].name;
        i += 1;
    }
    all
};

/// The number of the family of one, by its place in [`FOREIGN`].
#[must_use]
pub fn number(place: usize) -> u64 {
    u64::from(EFFECTS[place].id)
}

/// The set that one was written in, by its place in [`FOREIGN`].
#[must_use]
pub fn set(place: usize) -> usize {
    EFFECTS[place].set
}

/// Whether the engine has been changed after one was graded, or was developed with it, by its place in [`FOREIGN`].
#[must_use]
pub fn is_seen(place: usize) -> bool {
    sets::SETS[EFFECTS[place].set - 1].seen
}

/// Whether one has a near twin in an earlier set, by its place in [`FOREIGN`]: its own set says so, from the tenth on.
#[must_use]
pub fn has_twin(place: usize) -> bool {
    EFFECTS[place].twin.is_some()
}

/// Whether the library has got the cause of one since, by its place in [`FOREIGN`]: it is foreign no longer.
#[must_use]
pub fn is_known_since(place: usize) -> bool {
    EFFECTS[place].later.is_some()
}

/// The environment that one needs, by its place in [`FOREIGN`].
#[must_use]
pub fn needs(place: usize) -> Needs {
    EFFECTS[place].needs
}

/// The axis that one acts on where it was to act on `axis`, by its place in [`FOREIGN`].
#[must_use]
pub fn on_axis(place: usize, axis: usize) -> usize {
    if EFFECTS[place].level {
        axis.min(1)
    } else {
        axis
    }
}

/// Causes of the library that are a true part of one, by its place in [`FOREIGN`].
pub fn parts(place: usize) -> impl Iterator<Item = &'static str> {
    let effect = &EFFECTS[place];
    effect.true_parts.iter().copied().chain(effect.later)
}

/// One of them on an axis of a stand, as drawn.
pub struct Foreign {
    /// Its d' where that is defined, NaN elsewhere.
    pub strength: f64,
    known: Known,
    change: Change,
}

/// Largest rms of what is added, deg/s: a gyro that reads more below 1 Hz has been turned, whoever looks at it.
const LARGEST_RMS: f64 = 0.28;

/// One of them by its place in [`FOREIGN`], on an axis of a stand, at a strength of `wanted`; weaker where that would need
/// more than [`LARGEST_RMS`] however it is drawn. The world of the stand may gain what drives it.
#[must_use]
pub fn foreign(
    draw: &mut Draw,
    stand: &mut Stand,
    place: usize,
    axis: usize,
    wanted: f64,
) -> Foreign {
    const TRIES: usize = 12;
    let effect = EFFECTS[place];
    for _ in 0..TRIES {
        let f = drawn(draw, stand, effect, axis, wanted);
        if f.change.rms() <= LARGEST_RMS {
            return f;
        }
    }
    let mut f = drawn(draw, stand, effect, axis, wanted);
    let down = (LARGEST_RMS / f.change.rms()).min(1.0);
    if let Change::Add(signal) = &mut f.change {
        signal.iter_mut().for_each(|v| *v *= down);
        f.known = Known::signal(stand, axis, signal);
        f.strength = f.known.strength(stand, axis);
    }
    f
}

/// One draw, at the size that gives the strength.
fn drawn(
    draw: &mut Draw,
    stand: &mut Stand,
    effect: &ForeignEffect,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let shape = match effect.make {
        Make::Signal(of) => {
            let unit = of(draw, stand, axis);
            signal(stand, axis, unit)
        }
        Make::More(of) => more(of(draw, stand, axis)),
        Make::Exponential(of) => exponential(of(draw, stand, axis)),
        Make::Shaped(of) => of(draw, stand, axis, wanted),
    };
    let (known, change) = shape.sized(draw, stand, axis, wanted);
    Foreign {
        strength: known.strength(stand, axis),
        known,
        change,
    }
}

impl Foreign {
    /// Whether it brings the white noise of its channel itself, so that the stand has to leave it out.
    #[must_use]
    pub fn replaces_noise(&self) -> bool {
        self.change.replaces_noise()
    }

    /// Act on the channel of an axis of a run.
    pub fn act(&self, record: &mut Record, stand: &Stand, axis: usize, draw: &mut Draw) {
        self.change.act(record, stand, axis, draw);
    }
}
