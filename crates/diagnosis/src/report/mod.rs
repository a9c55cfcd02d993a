//! Findings, detection limits and figures.

pub mod detection_limits;
pub(crate) mod entries;
mod epochs;
pub mod figures;
pub mod findings;
pub mod gain;
pub mod handover;
pub(crate) mod left_over;
mod levels;
pub(crate) mod shocks;
pub mod untested;
