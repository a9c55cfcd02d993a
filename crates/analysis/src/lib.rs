//! Allan family, fits, checks and diagnosis of inertial sensor records.
//!
//! Data in, values out: nothing here opens a file, reads a clock or prints. The modules are layers, each of which may use
//! what stands before it: `cargo test -p xtask` reads their `use` lines.

pub mod numerics;
pub mod records;

pub mod noise;

pub mod result;
pub mod test_level;

mod fit;
mod ingest;

pub mod audit;

mod features;
mod search;

mod two_level;

mod joint;

mod criticise;

mod attribute;
mod report;

pub mod replicates;

mod pipeline;

pub use fit::{likelihood, scan, threshold};
pub use ingest::kalman;
pub use noise::{
    allan, analyze, attitude, discriminate as separate, edf, fit as noise_fit, paper_model, plan,
    synthetic,
};
pub use numerics::minimise as optimise;
pub use records::{error, rows, sampling};
pub use search::peak_of_white;
pub use two_level::compare as contest;

pub use error::AnalysisError;
pub use noise::analyze::{Analysis, AnalyzeOptions, analyze};
pub use noise::representative::{self, Representative, representative};
pub use pipeline::{DiagnoseOptions, diagnose, diagnose_owned};
