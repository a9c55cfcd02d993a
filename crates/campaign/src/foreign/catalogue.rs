//! The foreign effects, one row each, in a table for each kind beside what makes them.

use std::sync::LazyLock;

use super::shape::Shape;
use crate::random::Draw;
use crate::stand::{Needs, Stand};

mod codes;
mod couplings;
mod events;
mod follows;
mod noise;
mod time;

/// How one is drawn.
#[derive(Clone, Copy)]
pub(super) enum Make {
    /// A signal that may have any size.
    Signal(fn(&mut Draw, &mut Stand, usize) -> Vec<f64>),
    /// What white noise has more variance by.
    More(fn(&mut Draw, &mut Stand, usize) -> Vec<f64>),
    /// A logarithm of the variance of white noise.
    Exponential(fn(&mut Draw, &mut Stand, usize) -> Vec<f64>),
    /// Anything else; the strength that is wanted is told.
    Shaped(fn(&mut Draw, &mut Stand, usize, f64) -> Shape),
}

/// How strong one comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Strength {
    /// As strong as wanted.
    Wanted,
    /// In whole counts: at least as strong as wanted, or as it may be.
    Whole,
    /// As its own law has it.
    Own,
    /// No d' is defined: it counts as strong.
    None,
}

/// A foreign effect.
#[derive(Clone, Copy)]
pub(crate) struct ForeignEffect {
    /// Number of its family, from 300 on: all draws hang on it, so it never changes.
    pub id: u16,
    /// The set that it was written in, from 1 on.
    pub set: usize,
    /// The row of the tables.
    pub name: &'static str,
    /// How it is drawn.
    pub(super) make: Make,
    /// How strong it comes.
    pub(super) strength: Strength,
    /// The environment that it needs.
    pub needs: Needs,
    /// Causes of the library that are a true part of it: neither right nor wrong when they are named.
    pub true_parts: &'static [&'static str],
    /// The one of an earlier set that is a near twin: the same kind of signal or of law by the same kind of cause, sizes and
    /// pace apart. What is in doubt counts as one. Looked for from the tenth set on.
    pub twin: Option<u16>,
    /// Cause that describes it and that the library got only after its set was written: it keeps its row, for grades are
    /// compared with earlier ones, and that name is right.
    pub later: Option<&'static str>,
    /// Whether it acts on a level axis alone.
    pub level: bool,
}

const T: Needs = Needs::TEMPERATURE;
const V: Needs = Needs::VIBRATION;
/// Several of them, by their initials.
const TM: Needs = T.and(Needs::MOTOR);
const TMS: Needs = TM.and(Needs::SUPPLY);
const TMV: Needs = TM.and(V);

/// A row without what most do without.
const fn row(id: u16, set: usize, name: &'static str, make: Make) -> ForeignEffect {
    ForeignEffect {
        id,
        set,
        name,
        make,
        strength: Strength::Wanted,
        needs: Needs::NONE,
        true_parts: &[],
        twin: None,
        later: None,
        level: false,
    }
}

impl ForeignEffect {
    const fn needs(mut self, needs: Needs) -> Self {
        self.needs = needs;
        self
    }

    const fn parts(mut self, true_parts: &'static [&'static str]) -> Self {
        self.true_parts = true_parts;
        self
    }

    const fn later(mut self, cause: &'static str) -> Self {
        self.later = Some(cause);
        self
    }

    const fn twin(mut self, id: u16) -> Self {
        self.twin = Some(id);
        self
    }

    const fn level(mut self) -> Self {
        self.level = true;
        self
    }

    const fn strength(mut self, strength: Strength) -> Self {
        self.strength = strength;
        self
    }

    /// The axis that it acts on where it was to act on this one.
    pub fn axis(&self, axis: usize) -> usize {
        if self.level { axis.min(1) } else { axis }
    }

    /// Causes of the library that are a true part of it.
    pub fn true_causes(&self) -> impl Iterator<Item = &'static str> {
        self.true_parts.iter().copied().chain(self.later)
    }
}

/// The kinds, with what each has.
pub(super) const KINDS: [(&str, &[ForeignEffect]); 6] = [
    ("follows", follows::EFFECTS),
    ("time", time::EFFECTS),
    ("events", events::EFFECTS),
    ("noise", noise::EFFECTS),
    ("codes", codes::EFFECTS),
    ("couplings", couplings::EFFECTS),
];

/// All of them, by number.
pub(crate) static EFFECTS: LazyLock<Vec<&ForeignEffect>> = LazyLock::new(|| {
    let mut all: Vec<&ForeignEffect> = KINDS.iter().flat_map(|(_, kind)| *kind).collect();
    all.sort_by_key(|effect| effect.id);
    all
});
