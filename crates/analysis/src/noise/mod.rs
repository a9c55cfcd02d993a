//! Allan family, noise fits and what a run says of the noise alone.

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
