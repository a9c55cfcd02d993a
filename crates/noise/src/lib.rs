//! What a record says of its noise alone: the Allan family with intervals, noise fits, plans and the paper's model.
//!
//! Data in, values out: nothing here opens a file, reads a clock or prints. Causes are looked for in the crate `diagnosis`,
//! which stands beside this one: neither uses the other.
//!
//! ```
//! use noise::{AnalyzeOptions, analyze};
//!
//! // Ten minutes of the paper's stand: N is 5.27 deg/sqrt(h).
//! let record = model::simulate(&model::ModelFile::paper(), 600.0, 20.0, 1)?;
//! let analysis = analyze(&record, &AnalyzeOptions::default())?;
//! let n = &analysis.channels["gyro_z"].parameters.angle_random_walk;
//! assert_eq!(n.unit, "deg/sqrt(h)");
//! assert!((n.value.unwrap() - 5.27).abs() < 4.0 * n.std_error.unwrap());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
