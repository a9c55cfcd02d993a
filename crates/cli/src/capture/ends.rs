//! How a capture ends that is to go on: its last whole row, and what its header says of it.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use model::record::Base;

use super::{Calibration, CaptureError};

/// Key of the header: when the capture began, s since 1970 (UTC).
pub(super) const START: &str = "start_unix_s";
/// Key of the header: name of the file of the line's raw bytes.
pub const RAW: &str = "raw";
/// Key of the header: bytes of that file from before this one's first frame.
pub const RAW_FROM: &str = "raw_from";
/// Begins a line that says what was added to the board's own numbers and ticks from there on.
pub(super) const OFFSETS: &str = "# offsets: seq ";
/// Begins a line with number, ticks and host time of the last row of the file before this one.
pub(super) const BEFORE: &str = "# before: ";

/// Whether a file is packed.
pub(super) fn is_gz(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "gz")
}

/// The lines of a file up to where it was cut off, and whether it ends there.
pub(super) fn complete_lines(path: &Path) -> std::io::Result<(String, bool)> {
    let file = BufReader::new(File::open(path)?);
    let mut input: Box<dyn BufRead> = if is_gz(path) {
        Box::new(BufReader::new(flate2::bufread::MultiGzDecoder::new(file)))
    } else {
        Box::new(file)
    };
    let mut bytes = Vec::new();
    let is_whole = match input.read_to_end(&mut bytes) {
        Ok(_) => true,
        // A block that was not finished: what came before it is there.
        Err(error) if is_gz(path) && error.kind() == std::io::ErrorKind::UnexpectedEof => false,
        Err(error) => return Err(error),
    };
    let end = bytes.iter().rposition(|byte| *byte == b'\n');
    let length = end.map_or(0, |at| at + 1);
    let is_whole = is_whole && length == bytes.len();
    bytes.truncate(length);
    let text = String::from_utf8(bytes).map_err(std::io::Error::other)?;
    Ok((text, is_whole))
}

/// A row that the next one follows.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct LastRow {
    pub seq: u64,
    pub t_ticks: u64,
    pub host_s: f64,
    /// Its counts, as they are written; empty where they are not known.
    pub counts: String,
}

/// How a file ends.
pub(super) struct Ends {
    pub start_unix_s: f64,
    pub rows: u64,
    pub last: Option<LastRow>,
    /// What is added to the board's own numbers and ticks in the last row. A line of new ones behind it is that of a row
    /// which was not written.
    pub offsets: (u64, u64),
    /// Name of the file of raw bytes, and how many of them came before this capture; as its header says.
    pub raw: Option<(String, u64)>,
}

impl Ends {
    pub fn of(path: &Path, text: &str, now: &Calibration) -> Result<Self, CaptureError> {
        let refuse = |why: String| CaptureError::Resume {
            path: path.to_owned(),
            why,
        };
        let key = |key: &str| {
            number_of(text, key).ok_or_else(|| {
                refuse(format!(
                    "its header has no `{key}`: it is no capture of a board"
                ))
            })
        };
        let start_unix_s = key(START)?;
        is_set_alike(&key, now)?.map_or(Ok(()), |why| Err(refuse(why)))?;
        let mut ends = Ends {
            start_unix_s,
            rows: 0,
            last: None,
            offsets: (0, 0),
            raw: raw_of(text),
        };
        let (mut names, mut offsets) = (true, (0, 0));
        for line in text.lines() {
            if let Some(told) = line.strip_prefix(OFFSETS) {
                let (seq, ticks) = offsets_of(told)
                    .ok_or_else(|| refuse(format!("its line `{line}` cannot be read")))?;
                offsets = (seq as u64, ticks as u64);
            } else if let Some(before) = line.strip_prefix(BEFORE) {
                (ends.last, ends.offsets) = (row_of(before), offsets);
            } else if line.starts_with('#') || line.is_empty() {
            } else if std::mem::take(&mut names) {
                if !line.starts_with("seq,t_ticks,host_time_s,gyro_x,") {
                    return Err(refuse("its columns are not those of a capture".to_owned()));
                }
                if line.contains(",corrected_x,") != now.corrected {
                    let with = if now.corrected { "has no" } else { "has" };
                    return Err(refuse(format!(
                        "the correction on the board was switched since: the file {with} columns for corrected rates"
                    )));
                }
                if now.corrected && !line.contains(",attitude_w,") {
                    return Err(refuse(
                        "it is of an earlier version, which had no columns for the attitude"
                            .to_owned(),
                    ));
                }
            } else {
                let row = row_of(line);
                ends.last =
                    Some(row.ok_or_else(|| refuse(format!("its row `{line}` cannot be read")))?);
                ends.offsets = offsets;
                ends.rows += 1;
            }
        }
        if names {
            return Err(refuse("it ends before its column names".to_owned()));
        }
        Ok(ends)
    }
}

/// Why a file cannot go on with a board that is set so; `None` where it can.
fn is_set_alike(
    key: &dyn Fn(&str) -> Result<f64, CaptureError>,
    now: &Calibration,
) -> Result<Option<String>, CaptureError> {
    for (name, now) in [
        ("rate_hz", now.rate_hz),
        ("tick_s", now.tick_s),
        ("gyro_lsb_dps", now.gyro_lsb_dps),
        ("acc_counts_per_g", now.acc_counts_per_g),
    ] {
        let then = key(name)?;
        if (then / now - 1.0).abs() > 1e-9 {
            return Ok(Some(format!(
                "the board is set differently now: `{name}` is {now}, in the file {then}"
            )));
        }
    }
    Ok(None)
}

/// What a row says of where it stands, and its counts.
fn row_of(line: &str) -> Option<LastRow> {
    let mut cells = line.splitn(4, ',');
    Some(LastRow {
        seq: cells.next()?.parse().ok()?,
        t_ticks: cells.next()?.parse().ok()?,
        host_s: cells.next()?.parse().ok()?,
        counts: counts_of(cells.next().unwrap_or_default()).to_owned(),
    })
}

/// The counts of a row's cells behind its times: gyros, thermometers, supply, accelerometers, motor.
pub(super) fn counts_of(cells: &str) -> &str {
    const COUNTS: usize = 11;
    let end = cells.match_indices(',').nth(COUNTS - 1);
    end.map_or(cells, |(at, _)| &cells[..at])
}

/// What the header says under a key.
pub(super) fn value_of<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let mut head = text.lines().take_while(|line| line.starts_with('#'));
    head.find_map(|line| {
        line.strip_prefix("# ")?
            .strip_prefix(key)?
            .strip_prefix(": ")
    })
    .map(str::trim)
}

/// The same as a number.
pub(super) fn number_of(text: &str, key: &str) -> Option<f64> {
    value_of(text, key)?.parse().ok()
}

/// Where the raw bytes are.
fn raw_of(text: &str) -> Option<(String, u64)> {
    let from = value_of(text, RAW_FROM)?.parse().ok()?;
    Some((value_of(text, RAW)?.to_owned(), from))
}

/// What a file's counts mean, as its header says.
pub(super) fn calibration_of(text: &str) -> Option<Calibration> {
    let number = |key| number_of(text, key);
    let base = match value_of(text, "base")? {
        "turntable" => Base::Turntable,
        "moving" => Base::Moving,
        _ => Base::Static,
    };
    Some(Calibration {
        rate_hz: number("rate_hz")?,
        tick_s: number("tick_s")?,
        tick_tolerance_ppm: number("tick_tolerance_ppm")?,
        gyro_lsb_dps: number("gyro_lsb_dps")?,
        acc_zero_counts: number("acc_zero_counts")?,
        acc_counts_per_g: number("acc_counts_per_g")?,
        base,
        corrected: value_of(text, "corrected_lsb_dps").is_some(),
    })
}

/// Offsets of the numbers and of the ticks.
fn offsets_of(text: &str) -> Option<(i64, i64)> {
    let (seq, ticks) = text.split_once(" t_ticks ")?;
    Some((seq.parse().ok()?, ticks.parse().ok()?))
}
