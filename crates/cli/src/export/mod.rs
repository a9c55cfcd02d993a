//! What others read: noise figures in the units and conventions of filters and simulators, and the data themselves.

pub mod board;
pub mod causes;
pub mod data;
mod filters;
pub mod noise;
pub mod px4;
mod simulators;
