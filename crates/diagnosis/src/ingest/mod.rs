//! From a record to an even grid of readings that are believed.

pub mod base_turns;
pub(crate) mod blows;
mod brief;
pub mod conditional_draw;
pub mod dead;
pub mod dequantise;
pub mod fill;
pub mod grid;
mod handled;
pub(crate) mod jumps;
pub mod kalman;
pub mod lattice;
pub mod motion;
pub(crate) mod spikes;
pub mod types;
pub(crate) mod wild;
