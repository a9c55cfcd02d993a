//! Effects that the library does not have. They act on the readings of a finished run; what they are is known here alone.
//!
//! `catalogue` has one row for each, by kind, beside the makers that draw them; `sets` tells which were written when and by
//! whom. A maker draws a `Shape`. Its size, its strength, the largest size and what it does to the readings are found here.

use model::record::Record;

use crate::random::Draw;
use crate::stand::Stand;

mod act;
#[cfg(test)]
mod battery;
mod catalogue;
mod known;
mod prelude;
pub mod sets;
mod shape;
pub(crate) mod words;

use act::Change;
pub use act::add;
pub(crate) use catalogue::EFFECTS;
use catalogue::Make;
use known::Known;
use shape::{exponential, more, signal};

/// One of them on an axis of a stand, as drawn.
pub struct Foreign {
    /// Its d' where that is defined, NaN elsewhere.
    pub strength: f64,
    known: Known,
    change: Change,
}

/// Largest rms of what is added, deg/s: a gyro that reads more below 1 Hz has been turned, whoever looks at it.
const LARGEST_RMS: f64 = 0.28;

/// One of them by its place in [`EFFECTS`], on an axis of a stand, at a strength of `wanted`; weaker where that would need
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
    let mut one = || {
        let shape = match EFFECTS[place].make {
            Make::Signal(of) => {
                let unit = of(draw, stand, axis);
                signal(stand, axis, unit)
            }
            Make::More(of) => more(of(draw, stand, axis)),
            Make::Exponential(of) => exponential(of(draw, stand, axis)),
            Make::Shaped(of) => of(draw, stand, axis, wanted),
        };
        // At the size that gives the strength.
        let (known, change) = shape.sized(draw, stand, axis, wanted);
        Foreign {
            strength: known.strength(stand, axis),
            known,
            change,
        }
    };
    let mut tried = (0..TRIES).map(|_| one());
    if let Some(f) = tried.find(|f| f.change.rms() <= LARGEST_RMS) {
        return f;
    }
    let mut f = one();
    let down = (LARGEST_RMS / f.change.rms()).min(1.0);
    if let Change::Add(signal) = &mut f.change {
        signal.iter_mut().for_each(|v| *v *= down);
        f.known = Known::signal(stand, axis, signal);
        f.strength = f.known.strength(stand, axis);
    }
    f
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
