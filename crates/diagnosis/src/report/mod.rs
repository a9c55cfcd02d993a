//! Findings, detection limits and figures.

pub mod detection_limits;
pub mod figures;
pub mod findings;
pub mod handover;
pub mod untested;
