//! Logs of robots: MCAP and ROS 1 bags with `sensor_msgs/Imu`, PX4's ULog. They are recognised by how they begin, and their
//! units are those of their definitions, so that nothing need be said of them.

mod bag;
mod bytes;
mod imu;
mod mcap;
mod ulog;

use std::io::BufRead;

use super::CaptureError;
use super::table::Table;

pub(super) use bytes::Bytes;

/// Bytes of a chunk, unpacked, beyond which it is none; recorders make them of about a megabyte.
const LARGEST_CHUNK: u64 = 1 << 28;

/// A chunk of so many bytes, unpacked.
fn chunk_of(size: u64) -> Result<(), LogError> {
    if size > LARGEST_CHUNK {
        return Err(LogError::Damaged(format!("a chunk of {size} bytes")));
    }
    Ok(())
}

/// Chunks are packed by something other than what is `known`.
fn packed_by(other: &str, known: &str) -> LogError {
    LogError::Damaged(format!(
        "its chunks are packed by `{}`, and {known} are read",
        other.escape_debug()
    ))
}

/// The table of the topic that is asked for, and whether the file ends in the middle.
type Read = Result<(Table, bool), LogError>;

/// A kind of log: how it begins, what it is called, and who reads it.
struct Kind {
    magic: &'static [u8],
    name: &'static str,
    read: fn(&mut dyn BufRead, Option<&str>) -> Read,
}

const KINDS: [Kind; 3] = [
    Kind {
        magic: b"\x89MCAP0\r\n",
        name: "MCAP",
        read: mcap::read,
    },
    Kind {
        magic: b"#ROSBAG V2.0\n",
        name: "ROS 1 bag",
        read: bag::read,
    },
    Kind {
        magic: b"ULog\x01\x12\x35",
        name: "PX4 ULog",
        read: ulog::read,
    },
];

/// Why a log yields no columns.
#[derive(Debug, thiserror::Error)]
pub(super) enum LogError {
    /// The stream's own.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// Something in it cannot be.
    #[error("{0}")]
    Damaged(String),
    /// Nothing in it is an IMU; what there is.
    #[error("nothing in it is an IMU")]
    NoImu(Vec<String>),
    /// Several IMUs, or none of the name given; which there are.
    #[error("{why}")]
    Which {
        /// What is wrong.
        why: String,
        /// Topics that can be taken.
        topics: Vec<String>,
    },
}

/// Reads a log; `None` where the stream begins like none of them. `topic` says which of several IMUs.
pub(super) fn read_log(
    input: &mut dyn BufRead,
    topic: Option<&str>,
) -> Option<Result<Table, CaptureError>> {
    let start = match input.fill_buf() {
        Ok(start) => start,
        Err(error) => return Some(Err(super::stream::io(error))),
    };
    let kind = KINDS.iter().find(|kind| start.starts_with(kind.magic))?;
    input.consume(kind.magic.len());
    let read = (kind.read)(input, topic).map(|(mut table, is_cut)| {
        if is_cut {
            let note = "the file ends in the middle: it is read as far as it goes";
            table.notes.push(note.to_owned());
        }
        table
    });
    Some(read.map_err(|error| told(kind.name, error)))
}

/// Topics that a message lists.
const LISTED: usize = 20;

fn told(kind: &'static str, error: LogError) -> CaptureError {
    let list = |names: &[String]| {
        let mut shown: Vec<&str> = names.iter().take(LISTED).map(String::as_str).collect();
        if names.len() > LISTED {
            shown.push("...");
        }
        shown.join(", ")
    };
    let (why, help) = match error {
        LogError::Io(error) => return super::stream::io(error),
        LogError::Damaged(why) => (
            why,
            "was it copied whole? `mcap recover`, `rosbag reindex` or `ulog_info` say more".to_owned(),
        ),
        LogError::NoImu(topics) if topics.is_empty() => (
            "it holds no message".to_owned(),
            "was it copied whole, and was anything recorded?".to_owned(),
        ),
        LogError::NoImu(topics) => (
            format!("nothing in it is an IMU; it holds {}", list(&topics)),
            "read are sensor_msgs/Imu in ROS (encodings cdr and ros1), sensor_combined, vehicle_imu and sensor_gyro in ULog; save \
             anything else as CSV"
                .to_owned(),
        ),
        LogError::Which { why, topics } => {
            let first = topics.first().map_or("", String::as_str);
            (
                format!("{why}: {}", list(&topics)),
                format!(
                    "say which: `--topic {}`",
                    crate::text::shell_word(first.split(' ').next().unwrap_or(first))
                ),
            )
        }
    };
    CaptureError::Log { kind, why, help }
}

/// Values of a slow series at other times: the last one at or before each, none before the first. Both in one unit and order.
pub(super) fn held(times: &[i64], values: &[f64], at: &[i64]) -> Vec<f64> {
    at.iter()
        .map(|t| match times.partition_point(|time| time <= t) {
            0 => f64::NAN,
            next => values[next - 1],
        })
        .collect()
}

/// Nanoseconds or microseconds as seconds from the first on; whole numbers since 1970 have more digits than an f64.
pub(super) fn since_first(stamps: &[i64], unit_s: f64) -> Vec<f64> {
    let first = stamps.first().copied().unwrap_or(0);
    (stamps.iter())
        .map(|stamp| stamp.wrapping_sub(first) as f64 * unit_s)
        .collect()
}
