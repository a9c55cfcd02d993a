//! The loop from a model back to the board: the correction written over a link, a record taken over it, and what the
//! correction is worth. Nothing here knows whether the board is a real one.

mod heater;
mod judge;
mod length;
mod noise;
mod record;
mod worth;
mod write;

pub use heater::HEATER_S;
pub use judge::{Judged, Row, SPANS_S, Stage, States, judge};
pub use length::{NEAR, Needed, needed, short};
pub use noise::{Noise, Uncertain};
pub use record::{Course, Taken, record};
pub use worth::{keep_what_is_more_than_its_error, keep_what_is_worth_it};
pub use write::{Change, Proposed, in_use};
