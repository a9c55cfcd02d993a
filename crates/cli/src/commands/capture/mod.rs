//! `imu-stand capture`.

mod files;
mod losses;
mod motor;
mod raw;
mod replay;
mod room;
mod rotate;

use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

use clap::Args;
use imu_stand::RecordBuilder;
use imu_stand::capture::{Calibration, DIGITS, Live, heal, last_part, part_name, raw_path};
use imu_stand::link::{Change, Feed, Link, Motor};
use miette::{IntoDiagnostic, Result};
use model::record::Base;
use serde::Serialize;
use wire::{Frame, Hello, Sample};

use super::board::motor::Drive;
use super::{BaseName, Line};
use losses::{Apart, Holes, Lost};
use raw::Raw;
use room::Room;
use rotate::Rotate;

/// What `capture` takes.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    line: Line,
    /// The capture to write, .csv or .csv.gz; the raw bytes go beside it, with the ending .raw
    #[arg(long)]
    out: PathBuf,
    /// How long, s; without it until Ctrl-C
    #[arg(long, value_parser = super::positive, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Go on with the file where it ends. First what had arrived and was not written is put in from the raw bytes; the time
    /// between is a gap
    #[arg(long)]
    resume: bool,
    /// Go on in another file (run-0001.csv, run-0002.csv, ... for run.csv, each with its header and its raw bytes) after a
    /// time or at a size: 24h, 7d, 100MB
    #[arg(long, value_name = "TIME|SIZE", value_parser = rotate::parse)]
    rotate: Option<Rotate>,
    /// What the base under the stand does; turntable where the motor is driven, else static
    #[arg(long, value_enum)]
    base: Option<BaseName>,
    #[command(flatten, next_help_heading = "Motor, driven while the capture runs")]
    drive: Drive,
    /// Decode the raw bytes of an earlier capture again, instead of a port
    #[arg(long, value_name = "RAW", conflicts_with_all = ["port", "baud", "seconds", "resume", "rotate"])]
    replay: Option<PathBuf>,
    /// Write what was captured and lost as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Print nothing but what is amiss
    #[arg(long, short)]
    quiet: bool,
}

impl Arguments {
    /// What a board's hello frame says, what the base does, and whether the board corrects its rates.
    fn calibration(&self, hello: Option<&Hello>, corrected: bool) -> Calibration {
        let base = match self.base {
            Some(base) => base.into(),
            None if self.drive.command().is_some() => Base::Turntable,
            None => Base::Static,
        };
        let mut builder = RecordBuilder::new(Calibration {
            base,
            corrected,
            ..Calibration::default()
        });
        if let Some(hello) = hello {
            builder.hello(hello);
        }
        builder.calibration().clone()
    }
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
    #[serde(flatten)]
    apart: Lost,
    /// Rows that had arrived before a resumption and were not written.
    put_in_from_raw: u64,
    frames_rejected: u32,
    restarts: u64,
    reconnections: u64,
}

/// A capture under way: files, clock, and what happened.
struct Capture<'a> {
    arguments: &'a Arguments,
    raw: Raw,
    room: Room,
    is_terminal: bool,
    start: Instant,
    /// What `start` is in the file's host time, s.
    start_s: f64,
    start_unix_s: f64,
    live: Option<Live>,
    /// The file to go on with, and which of its capture it is.
    resumes: Option<(PathBuf, u64)>,
    /// Which file of the capture is open.
    part: u64,
    /// When its last row came, s, and how long it was when that was last looked at.
    last_s: f64,
    size: u64,
    /// What the board says of itself, for headers.
    board: Vec<(String, String)>,
    /// Whether the board is to be asked for its set-up.
    asks: bool,
    motor: Motor,
    /// Samples that wait for the first hello.
    waiting: Vec<(Sample, f64)>,
    /// Whether the board corrects its rates.
    corrects: bool,
    restarts_of_board: Option<u16>,
    files: Vec<String>,
    /// Rows of files that are finished.
    rows: u64,
    missing: u64,
    holes: Holes,
    put_in: u64,
    restarts: u64,
    reconnections: u64,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    if raw_path(&arguments.out) == arguments.out {
        misused!(
            help = "write `--out run.csv` or `--out run.csv.gz`: run.raw is written beside it",
            "{} is where the raw bytes go",
            arguments.out.display()
        );
    }
    super::outputs::named_as_text("--out", &arguments.out)?;
    super::outputs::has_folder("--out", &arguments.out)?;
    let own = [arguments.out.clone(), raw_path(&arguments.out)];
    super::Outputs::beside(own.iter().chain(&arguments.replay))
        .result("--json", arguments.json.as_ref())?;
    let first = first_name(arguments);
    if first.exists() && !arguments.resume {
        return Err(imu_stand::CaptureError::Exists { path: first }.into());
    }
    if let Some(raw) = &arguments.replay {
        return replay::replay(arguments, raw);
    }
    // Before the port is opened: what is there is made whole, with a board or without.
    let resumed = match arguments.resume {
        true => healed(arguments)?,
        false => None,
    };
    let mut feed = Feed::new(arguments.line.open()?);
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).into_diagnostic()?;
    let mut capture = Capture::start(arguments, resumed)?;
    let began = Instant::now();
    let is_over = |_: &Feed| {
        stop.load(Ordering::Relaxed)
            || arguments
                .seconds
                .is_some_and(|seconds| began.elapsed().as_secs_f64() >= seconds)
    };
    // A port that fails right here is gone for the loop below, which waits for it.
    let _ = feed.ask();
    let listened = capture.listen(&mut feed, is_over);
    let listened = listened.and(capture.halt(&mut feed));
    // What has arrived is kept, whatever ended it.
    let finished = capture.finish(&feed.link);
    listened.and(finished)
}

/// The first file of a capture that begins.
fn first_name(arguments: &Arguments) -> PathBuf {
    match arguments.rotate {
        Some(_) if !arguments.out.exists() => part_name(&arguments.out, 1, DIGITS),
        _ => arguments.out.clone(),
    }
}

/// A capture that is gone on with.
struct Resumed {
    path: PathBuf,
    part: u64,
    /// Where its raw bytes are.
    raw: PathBuf,
    /// Rows that were put in.
    put_in: u64,
}

/// Makes the last file of the capture whole from its raw bytes; `None` where there is no file yet.
fn healed(arguments: &Arguments) -> Result<Option<Resumed>> {
    let Some((path, part)) = last_part(&arguments.out)? else {
        return Ok(None);
    };
    let healed = heal(&path, &raw_path(&arguments.out))?;
    let name = super::name(&path);
    if healed.rows > 0 && !arguments.quiet {
        eprintln!(
            "{name}: {} rows that had arrived were not written; they are put in from the raw bytes",
            healed.rows
        );
    }
    if healed.left > 0 {
        warn!(
            "{name}: {} samples of after the board was set anew are in its raw bytes alone: `capture --replay`",
            healed.left
        );
    }
    Ok(Some(Resumed {
        path,
        part,
        raw: healed.raw,
        put_in: healed.rows,
    }))
}

/// Seconds since 1970.
fn unix_s() -> f64 {
    SystemTime::now()
        .duration_since(SystemTime::UNIX_EPOCH)
        .map_or(0.0, |since| since.as_secs_f64())
}

impl<'a> Capture<'a> {
    fn start(arguments: &'a Arguments, resumed: Option<Resumed>) -> Result<Self> {
        let raw = match &resumed {
            Some(resumed) => resumed.raw.clone(),
            None => raw_path(&first_name(arguments)),
        };
        let raw = Raw::open(&raw)?;
        let put_in = resumed.as_ref().map_or(0, |resumed| resumed.put_in);
        Ok(Self {
            arguments,
            raw,
            room: Room::default(),
            is_terminal: std::io::stderr().is_terminal(),
            start: Instant::now(),
            start_s: 0.0,
            start_unix_s: unix_s(),
            live: None,
            resumes: resumed.map(|resumed| (resumed.path, resumed.part)),
            part: 1,
            last_s: 0.0,
            size: 0,
            board: Vec::new(),
            asks: false,
            motor: arguments.drive.command().map_or(Motor::Off, Motor::Wanted),
            waiting: Vec::new(),
            corrects: false,
            restarts_of_board: None,
            files: Vec::new(),
            rows: 0,
            missing: 0,
            holes: Holes::default(),
            put_in,
            restarts: 0,
            reconnections: 0,
        })
    }

    /// Host time, s.
    fn now(&self) -> f64 {
        self.start_s + self.start.elapsed().as_secs_f64()
    }

    fn listen(&mut self, feed: &mut Feed, is_over: impl Fn(&Feed) -> bool) -> Result<()> {
        let (mut heard, mut shown, mut asked) = (Instant::now(), Instant::now(), Instant::now());
        while !is_over(feed) {
            let mut written = Ok(());
            let raw = &mut self.raw;
            let change = feed.poll(|bytes| written = raw.write(bytes));
            if let Err(error) = written {
                self.short_of_room(&error);
            }
            if let Some(change) = change {
                self.changed(&change)?;
            }
            if self.take_frames(feed)? {
                heard = Instant::now();
            }
            let is_unknown = self.live.is_none() && asked.elapsed() > ASK;
            if (is_unknown || self.asks) && !feed.is_gone() {
                (asked, self.asks) = (Instant::now(), false);
                let _ = feed.ask();
            }
            self.give_up_on_hello()?;
            self.drive(feed)?;
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
                self.show(&feed.link)?;
            }
        }
        Ok(())
    }

    /// Takes the frames that have been read; whether there were any.
    fn take_frames(&mut self, feed: &mut Feed) -> Result<bool> {
        let mut any = false;
        while let Some(frame) = feed.link.next() {
            any = true;
            match frame {
                Frame::Sample(sample) => self.sample(&sample)?,
                Frame::Hello(hello) => self.hello(&hello)?,
                Frame::Reply(reply) => self.replied(reply)?,
                Frame::Corrected(corrected) => self.corrected(&corrected)?,
                Frame::Health(_) => {}
            }
            self.raw.taken(feed.link.taken());
        }
        Ok(any)
    }

    /// Writes what has come, and shows it.
    fn show(&mut self, link: &Link) -> Result<()> {
        self.flush()?;
        if let Some(live) = &self.live {
            self.size = live.path().metadata().map_or(0, |file| file.len());
        }
        if !self.arguments.quiet && self.is_terminal {
            // One line that changes.
            eprint!("\r{}\x1b[K", self.figures(link));
        } else if !self.arguments.quiet {
            eprintln!("{}", self.figures(link));
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

    /// What is amiss, said with `--quiet`, too, and kept in the file.
    fn tell(&mut self, what: &str) -> Result<()> {
        self.alert(what);
        self.keep(what)
    }

    /// What was asked for and has come about: nothing is amiss.
    fn remark(&mut self, what: &str) -> Result<()> {
        if !self.arguments.quiet {
            self.alert(what);
        }
        self.keep(what)
    }

    /// A note in the file.
    fn keep(&mut self, what: &str) -> Result<()> {
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
                    self.holes.next = Apart::PortGone;
                }
                self.tell(&format!(
                    "the port is back after {:.1} s",
                    after.as_secs_f64()
                ))
            }
        }
    }
}
