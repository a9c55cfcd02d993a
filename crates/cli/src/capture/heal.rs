//! What the raw bytes of a capture have and its rows do not: put in behind the last row.
//!
//! A row is written within a second of its arrival, a raw byte at once. So a capture that was killed, or whose disk was full,
//! ends earlier than its raw bytes. Its last row is looked for among their samples, by number, ticks and all counts; what
//! comes after it is added. Raw bytes carry no time of arrival: host times of these rows go on by the board's clock.

use std::fs::File;
use std::io::{Read, Result, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use wire::{Decoder, Frame, Sample};

use super::ends::{Ends, LastRow, calibration_of, complete_lines, counts_of};
use super::live::{Live, io};
use super::write::write_rows;
use super::{Calibration, CaptureError, RecordBuilder};

/// Where the last row is looked for first: hours of the fastest line's bytes.
const NEAR_THE_END: u64 = 1 << 24;

/// What was put in.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Healed {
    /// Where the capture's raw bytes are.
    pub raw: PathBuf,
    /// Rows.
    pub rows: u64,
    /// Sample instants between them that have none.
    pub missing: u64,
    /// Samples that stay out: the board was set differently by then.
    pub left: u64,
    /// Whether the last row was found among the raw bytes; without it nothing is put in.
    pub found: bool,
}

/// Frames of the raw bytes.
struct Behind {
    frames: Vec<Frame>,
    /// The board's count of restarts in the last hello frame before them.
    restarts: Option<u16>,
}

/// Puts what arrived and was not written into a capture that was cut off. `raw` is where the raw bytes are if its header does
/// not say. Where no raw bytes are, nothing happens.
///
/// # Errors
/// [`CaptureError::Resume`] where the file is no capture of a board; [`CaptureError::Io`].
pub fn heal(path: &Path, raw: &Path) -> std::result::Result<Healed, CaptureError> {
    let (text, is_whole) = complete_lines(path).map_err(io(path))?;
    let Some(calibration) = calibration_of(&text) else {
        return Err(CaptureError::Resume {
            path: path.to_owned(),
            why: "its header is not that of a capture of a board".to_owned(),
        });
    };
    let ends = Ends::of(path, &text, &calibration)?;
    let (raw, from) = match &ends.raw {
        Some((name, from)) => (path.with_file_name(name), *from),
        None => (raw.to_owned(), 0),
    };
    let behind = behind(&raw, from, &ends, &calibration).map_err(io(&raw))?;
    let is_sample = |frame: &Frame| matches!(frame, Frame::Sample(_));
    let mut healed = Healed {
        raw: raw.clone(),
        found: behind.is_some(),
        ..Healed::default()
    };
    match behind.filter(|behind| behind.frames.iter().any(is_sample)) {
        Some(behind) => put_in(path, &raw, &calibration, &ends, behind, &mut healed)?,
        // Half a row, or half a packed block, is taken off all the same.
        None if !is_whole => Live::resume(path, &calibration)?.finish()?,
        None => {}
    }
    Ok(healed)
}

fn put_in(
    path: &Path,
    raw: &Path,
    calibration: &Calibration,
    ends: &Ends,
    behind: Behind,
    healed: &mut Healed,
) -> std::result::Result<(), CaptureError> {
    let mut live = Live::resume(path, calibration)?;
    let begun_s = ends.last.as_ref().map_or(0.0, |last| last.host_s);
    // Where the last row had come late, as on a busy computer, the board's clock runs ahead of the arrival of the next ones: none
    // came later than the last of the raw bytes was written.
    let written_s = raw_written(raw).map_or(f64::INFINITY, |at| at - ends.start_unix_s);
    let latest_s = written_s.max(begun_s);
    let mut host_s = begun_s;
    let mut ticks = ends.last.as_ref().map(|last| raw_ticks(last, ends));
    live.note(
        host_s,
        &format!(
            "the rows from here on were not written when they arrived; they are from {}, their host times by the board's clock",
            raw.file_name().unwrap_or_default().display()
        ),
    )?;
    let mut restarts = behind.restarts;
    let mut is_set_alike = true;
    for frame in &behind.frames {
        match frame {
            Frame::Sample(sample) if is_set_alike => {
                let since_s = since(ticks.replace(sample.t_ticks), sample.t_ticks, calibration);
                host_s = (host_s + since_s).min(latest_s);
                let (place, _) = live.push(sample, host_s)?;
                healed.rows += 1;
                healed.missing += place.missing;
            }
            Frame::Sample(_) => healed.left += 1,
            Frame::Hello(hello) => {
                live.hello(hello, restarts.replace(hello.restarts));
                let mut now = RecordBuilder::new(calibration.clone());
                now.hello(hello);
                is_set_alike = now.calibration() == calibration;
            }
            Frame::Corrected(corrected) => live.corrected(corrected),
            Frame::Health(_) | Frame::Reply(_) => {}
        }
    }
    live.finish()
}

/// When a file was written to last, s since 1970; `None` where the system does not say.
fn raw_written(path: &Path) -> Option<f64> {
    let at = path.metadata().and_then(|file| file.modified()).ok()?;
    let since = at.duration_since(std::time::UNIX_EPOCH).ok()?;
    Some(since.as_secs_f64())
}

/// Time from one sample to the next, s; where the ticks go back, that of a sample.
#[must_use]
pub fn since(last: Option<u32>, ticks: u32, calibration: &Calibration) -> f64 {
    let forward = last.map_or(0, |last| ticks.wrapping_sub(last));
    if forward > u32::MAX / 2 {
        1.0 / calibration.rate_hz
    } else {
        f64::from(forward) * calibration.tick_s
    }
}

/// A row's ticks as the board sent them.
fn raw_ticks(last: &LastRow, ends: &Ends) -> u32 {
    last.t_ticks.wrapping_sub(ends.offsets.1) as u32
}

/// The frames behind the last row; `None` where there are no raw bytes, or the row is not among them.
fn behind(
    path: &Path,
    from: u64,
    ends: &Ends,
    calibration: &Calibration,
) -> Result<Option<Behind>> {
    let mut raw = match File::open(path) {
        Ok(raw) => raw,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    let near = raw.metadata()?.len().saturating_sub(NEAR_THE_END).max(from);
    let mut restarts = None;
    let mut start = None;
    match &ends.last {
        // Before its first row it has all.
        None => start = Some(from),
        // The file before this one ended with it, and so did its raw bytes.
        Some(last) if last.counts.is_empty() => start = Some(from),
        Some(last) => {
            let raw_seq = last.seq.wrapping_sub(ends.offsets.0) as u16;
            let is_last = |sample: &Sample| {
                sample.seq == raw_seq
                    && sample.t_ticks == raw_ticks(last, ends)
                    && counts(sample, calibration) == last.counts
            };
            for begin in [near, from] {
                each(&mut raw, begin, |frame, end| match frame {
                    Frame::Sample(sample) if is_last(&sample) => start = Some(end),
                    Frame::Hello(hello) if start.is_none() => restarts = Some(hello.restarts),
                    _ => {}
                })?;
                if start.is_some() || near == from {
                    break;
                }
            }
        }
    }
    let Some(start) = start else { return Ok(None) };
    let mut frames = Vec::new();
    each(&mut raw, start, |frame, _| frames.push(frame))?;
    Ok(Some(Behind { frames, restarts }))
}

/// A sample's counts as a row has them.
fn counts(sample: &Sample, calibration: &Calibration) -> String {
    let mut builder = RecordBuilder::new(calibration.clone());
    builder.push(sample, 0.0);
    let mut row = Vec::new();
    // Into memory: it does not fail.
    let _ = write_rows(&mut row, &builder.build());
    let row = String::from_utf8_lossy(&row);
    let counts = row.trim_end().splitn(4, ',').nth(3).unwrap_or_default();
    counts_of(counts).to_owned()
}

/// Every frame from a place on, and where it ends.
fn each(raw: &mut File, from: u64, mut with: impl FnMut(Frame, u64)) -> Result<()> {
    raw.seek(SeekFrom::Start(from))?;
    let (mut decoder, mut at) = (Decoder::new(), from);
    let mut buffer = vec![0; 1 << 16];
    loop {
        let count = raw.read(&mut buffer)?;
        if count == 0 {
            return Ok(());
        }
        for byte in buffer.iter().take(count) {
            at += 1;
            if let Some(Ok(frame)) = decoder.push(*byte) {
                with(frame, at);
            }
        }
    }
}

/// The raw bytes' file: run.csv and run.csv.gz have run.raw.
#[must_use]
pub fn raw_path(out: &Path) -> PathBuf {
    let plain = if super::ends::is_gz(out) {
        out.with_extension("")
    } else {
        out.to_owned()
    };
    plain.with_extension("raw")
}
