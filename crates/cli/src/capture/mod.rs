//! Captures: the CSV of the stand, foreign CSV and files of arrays by mapping; all become a [`Record`](model::record::Record).

mod angle;
mod assumed;
mod build;
mod carried;
mod cells;
#[cfg(feature = "native")]
mod codecs;
mod columns;
mod continuity;
mod conventions;
mod corrected;
mod ends;
mod error;
mod foreign;
mod forms;
#[cfg(feature = "native")]
mod guard;
mod header;
mod heal;
mod held;
mod hexadecimal;
mod infinite;
mod interleaved;
mod layout;
mod live;
mod logs;
mod lvm;
mod made;
mod mapped;
mod names;
mod order;
mod own;
#[cfg(feature = "native")]
mod pages;
mod phone;
mod plausible;
mod preamble;
mod propose;
mod read;
mod rows;
mod scales;
mod series;
mod several;
mod skipped;
mod span;
mod steady;
pub(crate) mod steps;
mod stream;
mod table;
#[cfg(feature = "native")]
mod tables;
mod time;
mod units;
mod unpack;
mod utf16;
mod write;

pub use build::{Calibration, RecordBuilder, SUPPLY_LSB_V, TEMP};
pub use continuity::{Continuity, Place, Restart};
pub use corrected::corrected;
pub use ends::{RAW, RAW_FROM};
pub use error::CaptureError;
pub use foreign::ColumnMapping;
pub use heal::{Healed, heal, raw_path, since};
pub use held::Held;
pub use live::Live;
pub use read::{Read, ReadOptions, read_capture, read_columns, read_from};
pub use series::{DIGITS, PART, free_name, joined, last_part, log_of, part_name};
pub use span::Span;
pub use stream::unpacked;
pub use table::Table;
pub use write::{SIMULATED, mark_simulated, write_capture, write_to};

/// Standard gravity, m/s^2 (CGPM 1901): the unit `g` of accelerometers.
pub const STANDARD_GRAVITY: f64 = 9.806_65;
