//! What a record shows that its baseline does not say: what it is, how large, what it costs, and what was left over.
//!
//! Data in, values out: nothing here opens a file, reads a clock or prints. The modules are layers, each of which may use
//! what stands before it: `cargo test -p xtask` reads their `use` lines.

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

mod unnamed;

mod report;

pub mod replicates;

mod pipeline;

pub use fit::{likelihood, scan, threshold};
pub use ingest::kalman;
pub use search::peak_of_white;
pub use two_level::compare;

pub use pipeline::{DiagnoseOptions, MATTERS, diagnose, diagnose_channels, diagnose_owned};
