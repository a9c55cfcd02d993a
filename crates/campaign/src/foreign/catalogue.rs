//! The foreign effects, one row each, in a table for each kind beside what makes them.

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
pub(super) struct ForeignEffect {
    /// Number of its family, from [`FIRST_ID`] on: all draws hang on it, so it never changes.
    pub id: u16,
    /// The set that it was written in, from 1 on.
    pub set: usize,
    /// The row of the tables.
    pub name: &'static str,
    /// How it is drawn.
    pub make: Make,
    /// How strong it comes.
    #[cfg_attr(not(test), expect(dead_code, reason = "what the battery holds it to"))]
    pub strength: Strength,
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

/// A temperature that moves.
const T: Needs = Needs {
    temperature: true,
    ..Needs::NONE
};
/// Vibration.
const V: Needs = Needs {
    vibration: true,
    ..Needs::NONE
};
/// A temperature that moves and a motor that is switched.
const TM: Needs = Needs { motor: true, ..T };
/// The same with a supply whose load switches.
const TMS: Needs = Needs { supply: true, ..TM };
/// The same with vibration in its place.
const TMV: Needs = Needs {
    vibration: true,
    ..TM
};

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
    const fn needs(self, needs: Needs) -> Self {
        Self { needs, ..self }
    }

    const fn parts(self, true_parts: &'static [&'static str]) -> Self {
        Self { true_parts, ..self }
    }

    const fn later(self, cause: &'static str) -> Self {
        Self {
            later: Some(cause),
            ..self
        }
    }

    const fn twin(self, id: u16) -> Self {
        Self {
            twin: Some(id),
            ..self
        }
    }

    const fn level(self) -> Self {
        Self {
            level: true,
            ..self
        }
    }

    const fn strength(self, strength: Strength) -> Self {
        Self { strength, ..self }
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

/// Number of the first.
pub(super) const FIRST_ID: u16 = 300;

/// How many there are.
const COUNT: usize = {
    let (mut all, mut kind) = (0, 0);
    while kind < KINDS.len() {
        all += KINDS[kind].1.len();
        kind += 1;
    }
    all
};

/// All of them, by number. It does not compile where one is missing or comes twice.
pub(super) const EFFECTS: [&ForeignEffect; COUNT] = {
    let mut all: [Option<&ForeignEffect>; COUNT] = [None; COUNT];
    let mut kind = 0;
    while kind < KINDS.len() {
        let mut i = 0;
        while i < KINDS[kind].1.len() {
            let effect = &KINDS[kind].1[i];
            let place = (effect.id - FIRST_ID) as usize;
            assert!(all[place].is_none(), "two effects of one number");
            all[place] = Some(effect);
            i += 1;
        }
        kind += 1;
    }
    let mut effects = [&KINDS[0].1[0]; COUNT];
    let mut place = 0;
    while place < COUNT {
        effects[place] = all[place].expect("a number that no effect has");
        place += 1;
    }
    effects
};
