//! Calibration sequences: what a stand has to be put through so that a size can be told that no record at rest tells.
//!
//! A sequence works on a [`Link`](crate::link::Link) and by its clock, so it is the same on a board and on the simulated stand. It
//! refuses what it cannot use, says what it adds to what can be identified, and ends as terms of a model file, which
//! `export --to board` and `board correct` take.

mod blocks;
mod heater;
mod outcome;
mod six_position;
mod turns;

pub use heater::{Heater, heater};
pub use outcome::{Identified, Outcome, merged};
pub use six_position::{Side, SixPosition, six_position};
pub use turns::{Turns, turns};

use crate::link::LinkError;

/// What happens while a sequence runs, for whoever watches.
#[derive(Clone, Debug, PartialEq)]
pub enum Told {
    /// Something is to be done by a person.
    Do(String),
    /// Something was done, or is under way.
    Note(String),
    /// What was offered is not used, and why.
    Refused(String),
}

/// Why a sequence has no answer.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[non_exhaustive]
pub enum SequenceError {
    /// The line.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Link(#[from] LinkError),
    /// What was asked for did not happen.
    #[error("{what}")]
    #[diagnostic(code(calibrate::not_done), help("{help}"))]
    NotDone {
        /// What.
        what: String,
        /// What to do.
        help: String,
    },
}
