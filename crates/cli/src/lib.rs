//! The program `imu-stand` as a library: captures in and out, and what the commands share.

pub mod browser;
pub mod capture;
pub mod correct;
pub mod export;
pub mod link;
pub mod monitor;
#[cfg(unix)]
pub mod pty;
pub mod report;
pub mod stand;
pub mod text;

pub use capture::{
    CaptureError, ColumnMapping, ReadOptions, RecordBuilder, read_capture, write_capture,
};
