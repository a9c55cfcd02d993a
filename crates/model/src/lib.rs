//! The error model of the stand's sensors: effects, model file, simulation.
//!
//! Data in, values out: nothing here opens a file, reads a clock or prints.

pub mod docs;
pub mod effect;
pub mod effects;
pub mod excitation;
pub mod file;
pub mod integral;
pub mod parameter;
mod range;
pub mod record;
pub mod simulate;
pub mod unnamed;

pub use file::ModelFile;
pub use parameter::Parameter;
pub use range::bounds;
pub use simulate::{Replicas, simulate, simulate_in_the_world_of};
