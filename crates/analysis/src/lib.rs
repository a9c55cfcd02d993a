//! Allan family, fits, checks and diagnosis of inertial sensor records.
//!
//! Data in, values out: nothing here opens a file, reads a clock or prints.

pub mod checks;
pub mod contest;
pub mod diagnosis;
pub mod error;
pub mod estimate;
mod evidence;
pub mod gain;
pub mod grid;
pub mod kalman;
pub mod likelihood;
pub mod optimise;
pub mod result;
pub mod scan;
pub mod search;
pub mod threshold;

pub use diagnosis::{DiagnoseOptions, diagnose};
pub use error::AnalysisError;
