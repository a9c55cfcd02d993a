//! Allan family, fits, checks and diagnosis of inertial sensor records.
//!
//! Data in, values out: nothing here opens a file, reads a clock or prints.

mod adequacy;
pub mod allan;
pub mod analyze;
pub mod angles;
pub mod attitude;
pub mod audit;
pub mod beyond;
pub mod checks;
mod column;
mod common;
pub mod contest;
mod couplings;
mod curves;
mod dead;
pub mod diagnosis;
mod doubt;
pub mod edf;
pub mod error;
pub mod estimate;
mod evidence;
mod findings;
pub mod gain;
pub mod grid;
pub mod kalman;
mod law;
mod levels;
pub mod likelihood;
mod limits;
mod losses;
pub mod noise_fit;
pub mod noise_id;
pub mod optimise;
pub mod paper;
pub mod paper_model;
pub mod plan;
pub mod pooled;
mod refill;
pub mod representative;
pub mod result;
pub mod rows;
pub mod sampling;
pub mod scale;
pub mod scan;
pub mod search;
pub mod separate;
mod staircase;
pub mod synthetic;
pub mod threshold;
pub mod transform;
pub mod units;

pub use analyze::{Analysis, AnalyzeOptions, analyze};
pub use diagnosis::{DiagnoseOptions, diagnose};
pub use error::AnalysisError;
pub use representative::{Representative, representative};
