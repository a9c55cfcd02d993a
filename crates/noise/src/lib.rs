//! What a record says of its noise alone: the Allan family with intervals, noise fits, plans and the paper's model.
//!
//! Data in, values out: nothing here opens a file, reads a clock or prints. Causes are looked for in the crate `diagnosis`,
//! which stands beside this one: neither uses the other.

pub mod allan;
pub mod analyze;
pub mod angles;
pub mod attitude;
pub mod curves;
pub mod discriminate;
pub mod edf;
pub mod fit;
pub mod identify;
pub mod paper;
pub mod paper_model;
pub mod plan;
pub mod random_effects;
pub mod representative;
pub mod synthetic;
pub mod units;

pub use analyze::{Analysis, AnalyzeOptions, analyze};
pub use representative::{Representative, representative};
