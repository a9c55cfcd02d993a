//! Writing.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use model::record::{Base, Record};

use super::CaptureError;
use super::steps::in_one_step;

/// Key of the header that says which command simulated a capture.
pub const SIMULATED: &str = "simulated";

/// Marks a record as simulated: what is written of it can be had again.
pub fn mark_simulated(record: &mut Record, command: &str) {
    let entries = &mut record.header.entries;
    entries.retain(|(key, _)| key != SIMULATED);
    entries.push((SIMULATED.to_owned(), format!("imu-stand {command}")));
}

/// Writes a record as a capture, `.csv` or `.csv.gz`.
///
/// # Errors
/// [`CaptureError::Io`].
pub fn write_capture(path: &Path, record: &Record) -> Result<(), CaptureError> {
    let io = |source| CaptureError::Io {
        path: path.to_owned(),
        source,
    };
    let file = BufWriter::new(File::create(path).map_err(io)?);
    if path.extension().is_some_and(|e| e == "gz") {
        let mut gz = flate2::write::GzEncoder::new(file, flate2::Compression::default());
        write_to(&mut gz, record).map_err(io)?;
        gz.finish().and_then(|mut file| file.flush()).map_err(io)
    } else {
        let mut file = file;
        write_to(&mut file, record)
            .and_then(|()| file.flush())
            .map_err(io)
    }
}

/// Writes a record as a capture. Channels with counts are written in counts.
///
/// # Errors
/// The stream's.
pub fn write_to(out: &mut impl Write, record: &Record) -> std::io::Result<()> {
    let record = in_one_step(record);
    write_head(out, &record)?;
    write_rows(out, &record)
}

/// The header and the names of the columns.
pub(super) fn write_head(out: &mut impl Write, record: &Record) -> std::io::Result<()> {
    let header = &record.header;
    if !header.entries.iter().any(|(key, _)| key == "format") {
        writeln!(out, "# format: imu-stand-capture/1")?;
    }
    for (key, value) in &header.entries {
        writeln!(out, "# {key}: {value}")?;
    }
    let missing = |key: &str| !header.entries.iter().any(|(k, _)| k == key);
    if let (Some(rate), true) = (header.rate_hz, missing("rate_hz")) {
        writeln!(out, "# rate_hz: {rate}")?;
    }
    if let (Some(tick), true) = (header.tick_s, missing("tick_s")) {
        writeln!(out, "# tick_s: {tick:e}")?;
    }
    if let (Some(base), true) = (header.base, missing("base")) {
        let base = match base {
            Base::Static => "static",
            Base::Moving => "moving",
            Base::Turntable => "turntable",
        };
        writeln!(out, "# base: {base}")?;
    }
    let mut names = Vec::new();
    let has = [
        record.seq.is_some(),
        record.t_ticks.is_some(),
        record.host_time_s.is_some(),
    ];
    names.extend(
        ["seq", "t_ticks", "host_time_s"]
            .iter()
            .zip(has)
            .filter(|(_, has)| *has)
            .map(|(name, _)| *name),
    );
    names.extend(record.channels.iter().map(|c| c.name.as_str()));
    if record.flags.is_some() {
        names.push("flags");
    }
    writeln!(out, "{}", names.join(","))
}

/// The rows.
pub(super) fn write_rows(out: &mut impl Write, record: &Record) -> std::io::Result<()> {
    let mut row = String::new();
    for k in 0..record.len() {
        use std::fmt::Write as _;
        row.clear();
        let _ = record.seq.as_ref().map(|seq| write!(row, "{},", seq[k]));
        let _ = record
            .t_ticks
            .as_ref()
            .map(|ticks| write!(row, "{},", ticks[k]));
        let _ = record
            .host_time_s
            .as_ref()
            .map(|time| write!(row, "{:.6},", time[k]));
        for channel in &record.channels {
            let _ = match &channel.counts {
                _ if channel.values[k].is_nan() => write!(row, ","),
                Some(counts) => write!(row, "{},", counts[k]),
                None => write!(row, "{},", channel.values[k]),
            };
        }
        let _ = record
            .flags
            .as_ref()
            .map(|flags| write!(row, "{},", flags[k]));
        row.pop();
        writeln!(out, "{row}")?;
    }
    Ok(())
}
