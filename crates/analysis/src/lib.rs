//! Allan family, fits, checks and diagnosis of inertial sensor records.
//!
//! Data in, values out: nothing here opens a file, reads a clock or prints.

pub mod diagnosis;
pub mod error;
pub mod result;

pub use diagnosis::{DiagnoseOptions, diagnose};
pub use error::AnalysisError;
