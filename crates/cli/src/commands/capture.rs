//! `imu-stand capture`.

use std::fs::{File, OpenOptions};
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

use clap::Args;
use imu_stand::RecordBuilder;
use imu_stand::capture::{Calibration, Live, Restart};
use imu_stand::link::{Change, Feed, Link};
use miette::{IntoDiagnostic, Result, WrapErr};
use serde::Serialize;
use wire::link::LinkStats;
use wire::{Decoder, Frame, Hello, Sample};

use super::Line;

/// What `capture` takes.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    line: Line,
    /// The capture to write, .csv or .csv.gz; the raw bytes go beside it, with the ending .raw
    #[arg(long)]
    out: PathBuf,
    /// How long, s; without it until Ctrl-C
    #[arg(long)]
    seconds: Option<f64>,
    /// Go on with the file where it ends; the time between is a gap in it
    #[arg(long)]
    resume: bool,
    /// Decode the raw bytes of an earlier capture again, instead of a port
    #[arg(long, value_name = "RAW", conflicts_with_all = ["port", "baud", "seconds", "resume"])]
    replay: Option<PathBuf>,
    /// Write what was captured and lost as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Print nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

/// Silence after which the user is told.
const SILENCE: Duration = Duration::from_secs(3);
/// From one showing of the live figures to the next; the file is flushed then.
const SHOW: Duration = Duration::from_secs(1);
/// From one question for the board's set-up to the next, while it is not known.
const ASK: Duration = Duration::from_secs(2);
/// How long samples wait for the board to say how it is set.
const HELLO_WITHIN: Duration = Duration::from_secs(10);

#[derive(Serialize)]
struct Answer {
    format: &'static str,
    files: Vec<String>,
    seconds: f64,
    rows: u64,
    missing: u64,
    lost_by_board: u64,
    lost_by_line: u64,
    lost_unattributed: u64,
    frames_rejected: u32,
    restarts: u64,
    reconnections: u64,
}

/// A capture under way: files, clock, and what happened.
struct Capture<'a> {
    arguments: &'a Arguments,
    raw: File,
    is_terminal: bool,
    start: Instant,
    /// What `start` is in the file's host time, s.
    start_s: f64,
    start_unix_s: f64,
    live: Option<Live>,
    /// Samples that wait for the first hello.
    waiting: Vec<(Sample, f64)>,
    restarts_of_board: Option<u16>,
    files: Vec<String>,
    /// Rows of files that are finished.
    rows: u64,
    missing: u64,
    restarts: u64,
    reconnections: u64,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    if arguments.out.exists() && !arguments.resume {
        return Err(imu_stand::CaptureError::Exists {
            path: arguments.out.clone(),
        }
        .into());
    }
    if let Some(raw) = &arguments.replay {
        return replay(arguments, raw);
    }
    let mut feed = Feed::new(arguments.line.open()?);
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).into_diagnostic()?;
    let mut capture = Capture::start(arguments)?;
    let began = Instant::now();
    let is_over = || {
        stop.load(Ordering::Relaxed)
            || arguments
                .seconds
                .is_some_and(|seconds| began.elapsed().as_secs_f64() >= seconds)
    };
    let listened = capture.listen(&mut feed, is_over);
    // What has arrived is kept, whatever ended it.
    let finished = capture.finish(&feed.link);
    listened.and(finished)
}

/// Seconds since 1970.
fn unix_s() -> f64 {
    SystemTime::now()
        .duration_since(SystemTime::UNIX_EPOCH)
        .map_or(0.0, |since| since.as_secs_f64())
}

impl<'a> Capture<'a> {
    fn start(arguments: &'a Arguments) -> Result<Self> {
        let raw_path = raw_path(&arguments.out);
        let raw = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&raw_path)
            .into_diagnostic()
            .wrap_err_with(|| format!("cannot write {}", raw_path.display()))?;
        Ok(Self {
            arguments,
            raw,
            is_terminal: std::io::stderr().is_terminal(),
            start: Instant::now(),
            start_s: 0.0,
            start_unix_s: unix_s(),
            live: None,
            waiting: Vec::new(),
            restarts_of_board: None,
            files: Vec::new(),
            rows: 0,
            missing: 0,
            restarts: 0,
            reconnections: 0,
        })
    }

    /// Host time, s.
    fn now(&self) -> f64 {
        self.start_s + self.start.elapsed().as_secs_f64()
    }

    fn listen(&mut self, feed: &mut Feed, is_over: impl Fn() -> bool) -> Result<()> {
        // A port that fails right here is gone for the loop below, which waits for it.
        let _ = feed.ask();
        let (mut heard, mut shown, mut asked) = (Instant::now(), Instant::now(), Instant::now());
        while !is_over() {
            let mut written = Ok(());
            let raw = &mut self.raw;
            let change = feed.poll(|bytes| written = raw.write_all(bytes));
            written
                .into_diagnostic()
                .wrap_err("cannot write the raw bytes: is the disk full?")?;
            if let Some(change) = change {
                self.changed(&change)?;
            }
            while let Some(frame) = feed.link.next() {
                heard = Instant::now();
                match frame {
                    Frame::Sample(sample) => self.sample(&sample)?,
                    Frame::Hello(hello) => self.hello(&hello)?,
                    Frame::Health(_) | Frame::Reply(_) => {}
                }
            }
            if self.live.is_none() && asked.elapsed() > ASK && !feed.is_gone() {
                asked = Instant::now();
                let _ = feed.ask();
            }
            self.give_up_on_hello()?;
            if heard.elapsed() > SILENCE && !feed.is_gone() {
                heard = Instant::now();
                self.alert(&format!(
                    "no frame for {} s: {}",
                    SILENCE.as_secs(),
                    feed.link.heard().remedy(feed.link.baud())
                ));
            }
            if shown.elapsed() > SHOW {
                shown = Instant::now();
                if let Some(live) = &mut self.live {
                    live.flush()?;
                }
                if !self.arguments.quiet && self.is_terminal {
                    // One line that changes.
                    eprint!("\r{}\x1b[K", self.figures(&feed.link));
                } else if !self.arguments.quiet {
                    eprintln!("{}", self.figures(&feed.link));
                }
            }
        }
        Ok(())
    }

    fn figures(&self, link: &Link) -> String {
        let heard = link.heard();
        let rates = link.sample.map_or_else(String::new, |sample| {
            sample
                .rate
                .map(|rate| format!("{:8.3}", f64::from(rate) / 65_536.0))
                .join("")
        });
        let rows = self.rows + self.live.as_ref().map_or(0, Live::rows);
        format!(
            "{:>8.0} s {rows:>8} samples  {rates} deg/s  missing {} (board {}, line {}), {} frames rejected",
            self.now(),
            self.missing,
            heard.losses.device,
            heard.losses.line,
            heard.counts.rejected()
        )
    }

    /// Words to whoever watches, on a line of their own.
    fn alert(&self, what: &str) {
        let begin = if self.is_terminal { "\r\x1b[K" } else { "" };
        eprintln!("{begin}{what}");
    }

    fn tell(&mut self, what: &str) -> Result<()> {
        self.alert(what);
        let now = self.now();
        if let Some(live) = &mut self.live {
            live.note(now, what)?;
        }
        Ok(())
    }

    fn changed(&mut self, change: &Change) -> Result<()> {
        match change {
            Change::Gone { why } => self.tell(&format!(
                "the port is gone ({why}); waiting for it to come back"
            )),
            Change::Back { after } => {
                self.reconnections += 1;
                if let Some(live) = &mut self.live {
                    live.reconnected();
                }
                self.tell(&format!(
                    "the port is back after {:.1} s",
                    after.as_secs_f64()
                ))
            }
        }
    }

    fn sample(&mut self, sample: &Sample) -> Result<()> {
        let now = self.now();
        let Some(live) = &mut self.live else {
            self.waiting.push((*sample, now));
            return Ok(());
        };
        let (place, restart) = live.push(sample, now)?;
        self.missing += place.missing;
        if let Some(Restart { instants, .. }) = restart {
            self.restarts += 1;
            self.alert(&format!(
                "the board has started anew; {} sample instants are without data",
                instants - 1
            ));
        }
        Ok(())
    }

    fn hello(&mut self, hello: &Hello) -> Result<()> {
        let mut builder = RecordBuilder::new(Calibration::default());
        builder.hello(hello);
        let calibration = builder.calibration().clone();
        let before = self.restarts_of_board.replace(hello.restarts);
        let Some(live) = &mut self.live else {
            let [major, minor, patch] = hello.firmware;
            let about = [
                ("firmware".to_owned(), format!("{major}.{minor}.{patch}")),
                ("board_id".to_owned(), hello.board_id.to_string()),
            ];
            return self.open(&calibration, &about);
        };
        live.hello(hello, before);
        if live.fits(&calibration) {
            return Ok(());
        }
        self.tell("the board is set differently from here on: another file goes on")?;
        self.close()?;
        self.open(&calibration, &[])
    }

    /// Opens the file, or the next one, and puts in what has waited for it.
    fn open(&mut self, calibration: &Calibration, about: &[(String, String)]) -> Result<()> {
        let out = &self.arguments.out;
        let resumes = self.files.is_empty() && self.arguments.resume && out.exists();
        let path = if self.files.is_empty() {
            out.clone()
        } else {
            free_name(out, self.files.len() + 1)
        };
        let live = if resumes {
            let live = Live::resume(&path, calibration)?;
            let before = live.start_unix_s();
            self.start_s = self.start_unix_s - before;
            let waited = &mut self.waiting;
            waited
                .iter_mut()
                .for_each(|(_, time)| *time += self.start_s);
            (self.start_unix_s, self.rows) = (before, 0);
            live
        } else {
            Live::create(&path, calibration, about, Some(self.start_unix_s))?
        };
        self.live = Some(live);
        self.files.push(super::name(&path));
        if resumes {
            self.tell("the capture was resumed")?;
        }
        for (sample, time) in std::mem::take(&mut self.waiting) {
            if let Some(live) = &mut self.live {
                self.missing += live.push(&sample, time)?.0.missing;
            }
        }
        Ok(())
    }

    /// A board that cannot hear (one wire only) says how it is set at its start alone.
    fn give_up_on_hello(&mut self) -> Result<()> {
        let Some((_, first)) = self.waiting.first() else {
            return Ok(());
        };
        if self.live.is_some() || self.now() - first < HELLO_WITHIN.as_secs_f64() {
            return Ok(());
        }
        self.open(&Calibration::default(), &[])?;
        self.tell(
            "the board has not said how it is set: rate and ranges are assumed to be the built-in ones (20 Hz, 320 deg/s, \
             1.5 g)",
        )
    }

    /// Ends the file.
    fn close(&mut self) -> Result<()> {
        let Some(live) = self.live.take() else {
            return Ok(());
        };
        self.rows += live.rows();
        Ok(live.finish()?)
    }

    fn finish(&mut self, link: &Link) -> Result<()> {
        if self.live.is_none() && !self.waiting.is_empty() {
            // Ended while samples waited for the hello.
            self.waiting[0].1 -= HELLO_WITHIN.as_secs_f64() + 1.0;
            self.give_up_on_hello()?;
        }
        if self.is_terminal && !self.arguments.quiet {
            eprintln!();
        }
        let heard = link.heard();
        if self.live.is_none() && self.files.is_empty() {
            miette::bail!(
                help = heard.remedy(link.baud()),
                "no sample arrived on {}; the raw bytes are kept in {}; heard: {heard}",
                link.name(),
                raw_path(&self.arguments.out).display()
            );
        }
        let now = self.now();
        if let Some(live) = &mut self.live {
            let what = format!("the capture ends; {heard}");
            live.note(now, &what)?;
        }
        self.close()?;
        let answer = Answer {
            format: "imu-stand-captured/1",
            files: self.files.clone(),
            seconds: now,
            rows: self.rows,
            missing: self.missing,
            lost_by_board: heard.losses.device,
            lost_by_line: heard.losses.line,
            lost_unattributed: heard.losses.unattributed,
            frames_rejected: heard.counts.rejected(),
            restarts: self.restarts,
            reconnections: self.reconnections,
        };
        if !self.arguments.quiet {
            say!(
                "{}: {} samples, {} missing",
                answer.files.join(", "),
                answer.rows,
                answer.missing
            );
            say!("line: {heard}");
        }
        super::write_json(self.arguments.json.as_ref(), &answer)
    }
}

/// Makes a capture of raw bytes. They carry no time of arrival: host times are the device's, from the first sample on.
fn replay(arguments: &Arguments, path: &Path) -> Result<()> {
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
    // The set-up of the first samples is that of the first hello, wherever it stands.
    let first = frames.iter().find_map(|frame| match frame {
        Frame::Hello(hello) => Some(*hello),
        _ => None,
    });
    let mut builder = RecordBuilder::new(Calibration::default());
    if let Some(hello) = &first {
        builder.hello(hello);
    }
    let mut calibration = builder.calibration().clone();
    let about = [("replayed_from".to_owned(), super::name(path))];
    let mut files = vec![arguments.out.clone()];
    let mut live = Live::create(&arguments.out, &calibration, &about, None)?;
    if first.is_none() {
        live.note(
            0.0,
            "no hello frame: rate and ranges are assumed to be the built-in ones",
        )?;
    }
    let (mut time, mut last, mut restarts) = (0.0, None, None);
    let (mut rows, mut missing) = (0, 0);
    for frame in &frames {
        match frame {
            Frame::Sample(sample) => {
                let forward = last.map_or(0, |last| sample.t_ticks.wrapping_sub(last));
                time += if forward > u32::MAX / 2 {
                    1.0 / calibration.rate_hz
                } else {
                    f64::from(forward) * calibration.tick_s
                };
                last = Some(sample.t_ticks);
                missing += live.push(sample, time)?.0.missing;
                rows += 1;
            }
            Frame::Hello(hello) => {
                live.hello(hello, restarts.replace(hello.restarts));
                builder.hello(hello);
                if !live.fits(builder.calibration()) {
                    calibration = builder.calibration().clone();
                    let next = free_name(&arguments.out, files.len() + 1);
                    std::mem::replace(&mut live, Live::create(&next, &calibration, &about, None)?)
                        .finish()?;
                    files.push(next);
                }
            }
            Frame::Health(_) | Frame::Reply(_) => {}
        }
    }
    live.finish()?;
    if rows == 0 {
        miette::bail!(
            help = "is it the .raw file of a capture?",
            "{} holds no sample: {}",
            path.display(),
            imu_stand::text::link(decoder.counts())
        );
    }
    let losses = stats.losses();
    let answer = Answer {
        format: "imu-stand-captured/1",
        files: files.iter().map(|file| super::name(file)).collect(),
        seconds: time,
        rows,
        missing,
        lost_by_board: losses.device,
        lost_by_line: losses.line,
        lost_unattributed: losses.unattributed,
        frames_rejected: decoder.counts().rejected(),
        restarts: losses.restarts,
        reconnections: 0,
    };
    if !arguments.quiet {
        say!(
            "{}: {rows} samples, {missing} missing, {}",
            answer.files.join(", "),
            imu_stand::text::link(decoder.counts())
        );
    }
    super::write_json(arguments.json.as_ref(), &answer)
}

/// The raw bytes' file: run.csv and run.csv.gz have run.raw.
fn raw_path(out: &Path) -> PathBuf {
    let plain = if out.extension().is_some_and(|e| e == "gz") {
        out.with_extension("")
    } else {
        out.to_owned()
    };
    plain.with_extension("raw")
}

/// run-2.csv for run.csv.
fn free_name(out: &Path, number: usize) -> PathBuf {
    let name = super::name(out);
    let (stem, ending) = name.split_once('.').unwrap_or((&name, "csv"));
    (number..)
        .map(|number| out.with_file_name(format!("{stem}-{number}.{ending}")))
        .find(|path| !path.exists())
        .unwrap_or_else(|| out.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_go_with_the_capture() {
        assert_eq!(raw_path(Path::new("a/run.csv.gz")), Path::new("a/run.raw"));
        assert_eq!(raw_path(Path::new("run.csv")), Path::new("run.raw"));
        assert_eq!(
            free_name(Path::new("no-such/run.csv.gz"), 2),
            Path::new("no-such/run-2.csv.gz")
        );
    }
}
