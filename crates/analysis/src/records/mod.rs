//! Records as they are read: order of the rows, rate, sampling, what is missing.

pub mod error;
pub mod rows;
pub mod sampling;
