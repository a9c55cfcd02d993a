//! What a maker draws. How large it has to be is found here, once for all effects.

use std::rc::Rc;

use super::act::{Change, Counts};
use super::known::{Known, Next};
use super::words::within_step;
use crate::random::Draw;
use crate::stand::{LSB, Stand};
use crate::strength::{Meter, size_for};

/// What is known of an effect of a size, on a stand.
type Knows = dyn Fn(&Stand, f64) -> Known;
/// What an effect of a size does on a stand; it may draw.
type Does = dyn FnOnce(&Stand, &mut Draw, f64) -> Change;

/// A foreign effect as drawn, its size still open.
pub(super) enum Shape {
    /// What has a size, up to a largest one, by which its strength is known.
    Sized {
        most: f64,
        knows: Box<Knows>,
        does: Box<Does>,
    },
    /// What comes in whole steps, or as it is: of the strength that it has.
    Fixed(Known, Change),
}

impl Shape {
    /// What is known of it at the size that is `wanted` strong, and what it does then.
    pub(super) fn sized(
        self,
        draw: &mut Draw,
        stand: &Stand,
        axis: usize,
        wanted: f64,
    ) -> (Known, Change) {
        match self {
            Self::Sized { most, knows, does } => {
                let strength = |size: f64| knows(stand, size).strength(stand, axis);
                let size = size_for(wanted, &strength).min(most);
                (knows(stand, size), does(stand, draw, size))
            }
            Self::Fixed(known, change) => (known, change),
        }
    }
}

/// What has a size of at most `most`.
pub(super) fn sized(
    most: f64,
    knows: impl Fn(&Stand, f64) -> Known + 'static,
    does: impl FnOnce(&Stand, &mut Draw, f64) -> Change + 'static,
) -> Shape {
    Shape::Sized {
        most,
        knows: Box::new(knows),
        does: Box::new(does),
    }
}

/// What has a size of at most `most`, by which it makes new counts of an axis of those of all three.
pub(super) fn remade(
    most: f64,
    knows: impl Fn(&Stand, f64) -> Known + 'static,
    new: impl Fn(&Counts, &mut Draw, f64) -> Vec<i32> + 'static,
) -> Shape {
    sized(most, knows, |_, _, size| {
        Change::made(move |counts, draw| new(counts, draw, size))
    })
}

/// What adds a series of these energies by bin, at size 1, to an axis.
pub(super) fn by_energy(energy: Vec<f64>, does: impl FnOnce(f64) -> Change + 'static) -> Shape {
    sized(
        f64::INFINITY,
        move |_, size| Known::Energy(energy.iter().map(|e| e * size * size).collect()),
        move |_, _, size| does(size),
    )
}

/// A signal that may have any size.
pub(super) fn signal(stand: &Stand, axis: usize, unit: Vec<f64>) -> Shape {
    by_energy(Meter::new(stand, axis).energy(&unit), move |size| {
        Change::Add(unit.iter().map(|v| size * v).collect())
    })
}

/// Noise of the channel's own variance, of another law or memory: the series of a size, made anew.
pub(super) fn noise(
    most: f64,
    knows: impl Fn(&Stand, f64) -> Known + 'static,
    series: impl FnOnce(&Stand, &mut Draw, f64) -> Vec<f64> + 'static,
) -> Shape {
    sized(most, knows, |stand, draw, size| {
        Change::Noise(series(stand, draw, size), 1.0)
    })
}

/// White noise of which the share that is the size gets this series in its place, of variance 1.
pub(super) fn share(
    most: f64,
    knows: impl Fn(&Stand, f64) -> Known + 'static,
    series: Vec<f64>,
) -> Shape {
    sized(most, knows, |_, _, share| Change::Noise(series, share))
}

/// White noise whose variance follows a law, by size.
pub(super) fn variance(law: impl Fn(f64) -> Vec<f64> + 'static) -> Shape {
    let law = Rc::new(law);
    let known = Rc::clone(&law);
    sized(
        f64::INFINITY,
        move |_, size| Known::Variance(known(size)),
        move |_, _, size| Change::Scale(law(size).iter().map(|v| v.sqrt()).collect()),
    )
}

/// White noise whose variance is 1, and more by a shape.
pub(super) fn more(shape: Vec<f64>) -> Shape {
    variance(move |size| shape.iter().map(|s| 1.0 + size * s).collect())
}

/// White noise whose variance is the exponential of so much of a shape.
pub(super) fn exponential(shape: Vec<f64>) -> Shape {
    variance(move |size| shape.iter().map(|s| (size * s).exp()).collect())
}

/// A converter with these lower edges of its codes from the first on, counts, by size.
pub(super) fn edges(axis: usize, at: impl Fn(&Stand, f64) -> (i32, Vec<f64>) + 'static) -> Shape {
    let at = Rc::new(at);
    let known = Rc::clone(&at);
    sized(
        f64::INFINITY,
        move |stand, size| Known::edges(stand, axis, &known(stand, size)),
        move |stand, _, size| {
            let (first, edges) = at(stand, size);
            Change::edges(axis, first, edges)
        },
    )
}

/// Readings that go through a map of the codes, with the chance that is their size.
pub(super) fn map(axis: usize, map: impl Fn(i32) -> i32 + 'static) -> Shape {
    let map = Rc::new(map);
    let known = Rc::clone(&map);
    remade(
        1.0,
        move |stand, chance| Known::map(stand, axis, chance.min(1.0), &*known),
        move |counts, draw, chance| {
            let read = |c: &i32| if draw.chance(chance) { map(*c) } else { *c };
            counts[axis].iter().map(read).collect()
        },
    )
}

/// Readings that are what `next` makes of the reading before and the code, with the chance that is their size.
pub(super) fn by_chance(axis: usize, next: impl Fn(i32, i32) -> i32 + 'static) -> Shape {
    let next: Rc<Next> = Rc::new(next);
    let known = Rc::clone(&next);
    remade(
        1.0,
        move |stand, chance| Known::next(stand, axis, chance.min(1.0), &*known),
        move |counts, draw, chance| {
            let own = &counts[axis];
            let mut reading = own[0];
            own.iter()
                .map(|code| {
                    reading = if draw.chance(chance) {
                        next(reading, *code)
                    } else {
                        *code
                    };
                    reading
                })
                .collect()
        },
    )
}

/// What the frames of other axes add to this one, deg/s, a signal of this kind giving the strength; the converter rounds
/// again.
pub(super) fn coupled(
    stand: &Stand,
    axis: usize,
    like: &[f64],
    of: impl Fn(&Counts, usize) -> f64 + 'static,
) -> Shape {
    coupled_series(stand, axis, like, move |counts| {
        (0..counts[axis].len()).map(|i| of(counts, i)).collect()
    })
}

/// The same of what the whole run of the other axes adds, deg/s.
pub(super) fn coupled_series(
    stand: &Stand,
    axis: usize,
    like: &[f64],
    of: impl Fn(&Counts) -> Vec<f64> + 'static,
) -> Shape {
    by_energy(Meter::new(stand, axis).energy(like), move |size| {
        Change::made(move |counts, draw| {
            counts[axis]
                .iter()
                .zip(of(counts))
                .map(|(own, added)| {
                    let rate = within_step(*own, draw);
                    (rate + size * added / LSB).round() as i32
                })
                .collect()
        })
    })
}
