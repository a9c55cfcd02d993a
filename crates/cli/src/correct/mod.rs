//! The loop from a model back to the board: the correction written over a link, a record taken over it, and what the
//! correction is worth. Nothing here knows whether the board is a real one.

mod judge;
mod record;
mod write;

pub use judge::{Judged, Noise, Row, SPANS_S, Stage, States, judge};
pub use record::{Course, Taken, record};
pub use write::{Change, Proposed, in_use};
