//! The record among its replicates: would the model have given a record like this one?
//!
//! A model is simulated again and again in the world that the record saw. The same statistics are taken of the record and
//! of every replicate, and a global envelope test says how often a record of the model strays, anywhere, as far as the
//! measured one does (docs/replicates.md).

pub(crate) mod consequence;
mod envelope;
mod judge;
mod statistics;
mod verdict;
mod world;

pub(crate) use judge::Judge;
pub use judge::judge_record;

pub use crate::result::LEVEL;
pub(crate) use verdict::{Held, held, taken_up};

/// Replicates that tell such a chance to a tenth of it: the smallest chance is 1 / (199 + 1).
pub const REPLICATES: usize = 199;
