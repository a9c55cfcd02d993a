//! Raw bytes, decoded again.

use std::path::{Path, PathBuf};

use imu_stand::capture::{Live, free_name, since};
use miette::{IntoDiagnostic, Result, WrapErr};
use wire::link::LinkStats;
use wire::{Decoder, Frame};

use super::{Answer, Arguments, Lost};

/// Makes a capture of raw bytes. They carry no time of arrival: host times are the device's, from the first sample on.
pub fn replay(arguments: &Arguments, path: &Path) -> Result<()> {
    let (frames, decoder, stats) = decoded(path)?;
    // Before a file is made: one without rows would stand in the way of the right bytes.
    if !frames.iter().any(|frame| matches!(frame, Frame::Sample(_))) {
        miette::bail!(
            help = "name the .raw file of a capture, which stands beside its .csv; nothing was written",
            "{} holds no sample: {}",
            path.display(),
            imu_stand::text::link(decoder.counts())
        );
    }
    let written = Written::of(arguments, path, &frames)?;
    let losses = stats.losses();
    let names = written.files.iter().map(|file| super::super::name(file));
    let answer = Answer {
        format: "imu-stand-captured/1",
        files: names.collect(),
        seconds: written.seconds,
        rows: written.rows,
        missing: written.missing,
        lost_by_board: losses.device,
        lost_by_line: losses.line,
        lost_unattributed: losses.unattributed,
        apart: Lost::default(),
        put_in_from_raw: 0,
        frames_rejected: decoder.counts().rejected(),
        restarts: losses.restarts,
        reconnections: 0,
    };
    if !arguments.quiet {
        say!(
            "{}: {} samples, {} missing, {}",
            answer.files.join(", "),
            answer.rows,
            answer.missing,
            imu_stand::text::link(decoder.counts())
        );
    }
    super::super::write_json(arguments.json.as_ref(), &answer)
}

/// The captures that frames became: one for each set-up of the board.
struct Written {
    files: Vec<PathBuf>,
    seconds: f64,
    rows: u64,
    missing: u64,
}

impl Written {
    fn of(arguments: &Arguments, path: &Path, frames: &[Frame]) -> Result<Self> {
        // The set-up of the first samples is that of the first hello, wherever it stands.
        let first = frames.iter().find_map(|frame| match frame {
            Frame::Hello(hello) => Some(*hello),
            _ => None,
        });
        let corrects = (frames.iter()).any(|frame| matches!(frame, Frame::Corrected(_)));
        let mut calibration = arguments.calibration(first.as_ref(), corrects);
        let about = [("replayed_from".to_owned(), super::super::name(path))];
        let mut live = Live::create(&arguments.out, &calibration, &about, None)?;
        if first.is_none() {
            live.note(
                0.0,
                "no hello frame: rate and ranges are assumed to be the built-in ones",
            )?;
        }
        let mut written = Self {
            files: vec![arguments.out.clone()],
            seconds: 0.0,
            rows: 0,
            missing: 0,
        };
        let (mut last, mut restarts) = (None, None);
        for frame in frames {
            match frame {
                Frame::Sample(sample) => {
                    let ticks = last.replace(sample.t_ticks);
                    written.seconds += since(ticks, sample.t_ticks, &calibration);
                    written.missing += live.push(sample, written.seconds)?.0.missing;
                    written.rows += 1;
                }
                Frame::Hello(hello) => {
                    live.hello(hello, restarts.replace(hello.restarts));
                    let now = arguments.calibration(Some(hello), corrects);
                    if !live.fits(&now) {
                        calibration = now;
                        let number = written.files.len() as u64 + 1;
                        let (next, _) = free_name(&arguments.out, number, 0);
                        let next_live = Live::create(&next, &calibration, &about, None)?;
                        std::mem::replace(&mut live, next_live).finish()?;
                        written.files.push(next);
                    }
                }
                Frame::Corrected(corrected) => live.corrected(corrected),
                Frame::Health(_) | Frame::Reply(_) => {}
            }
        }
        live.finish()?;
        Ok(written)
    }
}

/// The frames of a file, with what was wrong on the line and lost.
fn decoded(path: &Path) -> Result<(Vec<Frame>, Decoder, LinkStats)> {
    let bytes = std::fs::read(path)
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot read {}", path.display()))?;
    let (mut decoder, mut stats) = (Decoder::new(), LinkStats::new());
    let mut frames = Vec::new();
    for byte in bytes {
        if let Some(Ok(frame)) = decoder.push(byte) {
            stats.push(&frame);
            frames.push(frame);
        }
    }
    Ok((frames, decoder, stats))
}
