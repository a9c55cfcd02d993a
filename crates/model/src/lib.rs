//! The error model of the stand's sensors: effects, model file, simulation.
//!
//! Data in, values out: nothing here opens a file, reads a clock or prints.

pub mod file;
pub mod parameter;
pub mod record;

pub use parameter::Parameter;
