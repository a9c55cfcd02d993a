//! The error model of the stand's sensors: effects, model file, simulation.
//!
//! Data in, values out: nothing here opens a file, reads a clock or prints.
//!
//! ```
//! // The same seed gives the same run.
//! let model = model::ModelFile::paper();
//! let record = model::simulate(&model, 60.0, 20.0, 7)?;
//! assert_eq!(record.len(), 1200);
//! assert_eq!(record.channel("gyro_z").unwrap().unit, "deg/s");
//! assert_eq!(record, model::simulate(&model, 60.0, 20.0, 7)?);
//! # Ok::<(), model::simulate::SimulateError>(())
//! ```

pub mod docs;
pub mod effect;
pub mod effects;
pub mod excitation;
pub mod file;
pub mod integral;
pub mod nearest;
pub mod one_source;
pub mod parameter;
mod range;
pub mod record;
pub mod simulate;
pub mod tone;
pub mod unnamed;

pub use file::ModelFile;
pub use parameter::Parameter;
pub use range::bounds;
pub use simulate::{Replicas, simulate, simulate_in_the_world_of};
