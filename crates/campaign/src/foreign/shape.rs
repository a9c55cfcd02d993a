//! What a maker draws. How large it has to be is found here, once for all effects.

use std::rc::Rc;

use super::act::{Change, Counts};
use super::known::Known;
use super::words::within_step;
use crate::random::Draw;
use crate::series::{carry, each, each_pair};
use crate::stand::{LSB, Stand};
use crate::strength::{Meter, size_for};

/// What is known of an effect of a size, on a stand.
type Knows = dyn Fn(&Stand, f64) -> Known;
/// What an effect of a size does on a stand; it may draw.
type Does = dyn FnOnce(&Stand, &mut Draw, f64) -> Change;

/// A foreign effect as drawn, its size still open.
pub(super) enum Shape {
    /// What has a size, up to a largest one, by which its strength is known.
    Sized(f64, Box<Knows>, Box<Does>),
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
            Self::Sized(most, knows, does) => {
                let known = |size: f64| knows(stand, size.min(most));
                let size = size_for(wanted, &|size| known(size).strength(stand, axis)).min(most);
                (known(size), does(stand, draw, size))
            }
            Self::Fixed(known, change) => (known, change),
        }
    }
}

/// What has a size of at most `most`. Larger ones are not asked for.
pub(super) fn sized(
    most: f64,
    knows: impl Fn(&Stand, f64) -> Known + 'static,
    does: impl FnOnce(&Stand, &mut Draw, f64) -> Change + 'static,
) -> Shape {
    Shape::Sized(most, Box::new(knows), Box::new(does))
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
    let knows = move |_: &Stand, size: f64| Known::Energy(each(&energy, |e| e * size * size));
    sized(f64::INFINITY, knows, move |_, _, size| does(size))
}

/// A signal that may have any size.
pub(super) fn signal(stand: &Stand, axis: usize, unit: Vec<f64>) -> Shape {
    by_energy(Meter::new(stand, axis).energy(&unit), move |size| {
        Change::Add(each(&unit, |v| size * v))
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

/// Noise in which each reading brings something new of variance 1, the whole having this variance, by size: who knows the law
/// predicts the rest, d'^2 = samples x ln(variance). It is made to have variance 1.
pub(super) fn predicted(
    most: f64,
    variance: impl Fn(&Stand, f64) -> f64 + Copy + 'static,
    series: impl FnOnce(&Stand, &mut Draw, f64) -> Vec<f64> + 'static,
) -> Shape {
    noise(
        most,
        move |stand, size| Known::by_reading(stand, variance(stand, size).ln()),
        move |stand, draw, size| {
            let scale = variance(stand, size).sqrt();
            each(&series(stand, draw, size), |x| x / scale)
        },
    )
}

/// White noise of which the share that is the size gets this series in its place, of variance 1.
pub(super) fn share(
    most: f64,
    knows: impl Fn(&Stand, f64) -> Known + 'static,
    series: Vec<f64>,
) -> Shape {
    sized(most, knows, |_, _, share| Change::Noise(series, share))
}

/// White noise whose variance follows a law, by size, up to `most`.
pub(super) fn variance(most: f64, law: impl Fn(f64) -> Vec<f64> + 'static) -> Shape {
    let law = Rc::new(law);
    let known = Rc::clone(&law);
    sized(
        most,
        move |_, size| Known::Variance(known(size)),
        move |_, _, size| Change::Scale(each(&law(size), f64::sqrt)),
    )
}

/// White noise whose variance is 1, and more by a shape.
pub(super) fn more(shape: Vec<f64>) -> Shape {
    variance(f64::INFINITY, move |size| each(&shape, |s| 1.0 + size * s))
}

/// White noise whose variance is the exponential of so much of a shape.
pub(super) fn exponential(shape: Vec<f64>) -> Shape {
    variance(f64::INFINITY, move |size| {
        each(&shape, |s| (size * s).exp())
    })
}

/// A converter with these lower edges of its codes from the first on, counts, by size, up to `most`.
pub(super) fn edges(
    axis: usize,
    most: f64,
    at: impl Fn(&Stand, f64) -> (i32, Vec<f64>) + Copy + 'static,
) -> Shape {
    sized(
        most,
        move |stand, size| Known::edges(stand, axis, &at(stand, size)),
        move |stand, _, size| Change::edges(axis, at(stand, size)),
    )
}

/// Readings that go through a map of the codes, with the chance that is their size.
pub(super) fn map(axis: usize, map: impl Fn(i32) -> i32 + Copy + 'static) -> Shape {
    remade(
        1.0,
        move |stand, chance| Known::map(stand, axis, chance, map),
        move |counts, draw, chance| {
            each(&counts[axis], |code| draw.choose(chance, map(code), code))
        },
    )
}

/// Readings that are what `next` makes of the reading before and the code, with the chance that is their size.
pub(super) fn by_chance(axis: usize, next: impl Fn(i32, i32) -> i32 + Copy + 'static) -> Shape {
    remade(
        1.0,
        move |stand, chance| Known::next(stand, axis, chance, &next),
        move |counts, draw, chance| {
            let own = &counts[axis];
            carry(own[0], own, |before, code| {
                draw.choose(chance, next(before, code), code)
            })
        },
    )
}

/// What the run of other axes adds to this one, deg/s, a signal of this kind giving the strength; the converter rounds again.
pub(super) fn coupled(
    stand: &Stand,
    axis: usize,
    like: &[f64],
    of: impl Fn(&Counts) -> Vec<f64> + 'static,
) -> Shape {
    coupled_by(Meter::new(stand, axis).energy(like), axis, of)
}

/// The same, these energies by bin giving the strength.
pub(super) fn coupled_by(
    energy: Vec<f64>,
    axis: usize,
    of: impl Fn(&Counts) -> Vec<f64> + 'static,
) -> Shape {
    by_energy(energy, move |size| {
        Change::made(move |counts, draw| {
            each_pair(&counts[axis], &of(counts), |own, added| {
                (within_step(own, draw) + size * added / LSB).round() as i32
            })
        })
    })
}
