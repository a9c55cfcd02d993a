//! Which names the record bears out, and what belongs together.

pub mod events;
pub mod masking;
pub mod merge;
pub mod withdraw;
