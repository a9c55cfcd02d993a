//! The program `imu-stand` as a library: captures in and out, and what the commands share.

#[cfg(feature = "native")]
pub mod browser;
#[cfg(feature = "native")]
pub mod calibrate;
pub mod capture;
#[cfg(feature = "native")]
pub mod correct;
pub mod explain;
#[cfg(feature = "native")]
pub mod export;
#[cfg(feature = "native")]
pub mod link;
#[cfg(feature = "native")]
pub mod monitor;
pub mod plan;
#[cfg(all(unix, feature = "native"))]
pub mod pty;
pub mod report;
#[cfg(feature = "native")]
pub mod stand;
pub mod text;

pub use capture::{
    CaptureError, ColumnMapping, ReadOptions, RecordBuilder, read_capture, write_capture,
};
