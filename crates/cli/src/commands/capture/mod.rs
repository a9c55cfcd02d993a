//! `imu-stand capture`.

mod replay;

use std::fs::{File, OpenOptions};
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

use clap::{Args, ValueEnum};
use imu_stand::RecordBuilder;
use imu_stand::capture::{Calibration, Live, Restart};
use imu_stand::link::{self, Change, Feed, Link};
use miette::{IntoDiagnostic, Result, WrapErr};
use model::record::Base;
use serde::Serialize;
use wire::{Command, Corrected, Frame, Hello, Reply, Sample};

use super::Line;
use super::board::motor::{Drive, KEEP_ALIVE, RAMP_DOWN};

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
    /// What the base under the stand does; turntable where the motor is driven, else static
    #[arg(long, value_enum)]
    base: Option<BaseName>,
    #[command(flatten, next_help_heading = "Motor, driven while the capture runs")]
    drive: Drive,
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

/// What the base does, as people write it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BaseName {
    /// At rest, the table too
    Static,
    /// Moved by something else than our motor
    Moving,
    /// Our motor turns the table
    Turntable,
}

impl Arguments {
    /// What a board's hello frame says, what the base does, and whether the board corrects its rates.
    fn calibration(&self, hello: Option<&Hello>, corrected: bool) -> Calibration {
        let base = match self.base {
            Some(BaseName::Static) => Base::Static,
            Some(BaseName::Moving) => Base::Moving,
            Some(BaseName::Turntable) => Base::Turntable,
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
    frames_rejected: u32,
    restarts: u64,
    reconnections: u64,
}

/// What the capture does with the motor.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Motor {
    /// Nothing, or nothing any more.
    Off,
    /// It starts as soon as rows are written.
    Wanted(Command),
    /// A nonce was asked for under this number; when.
    Arming(Command, u16, Instant),
    /// The nonce has come.
    Armed(Command, u16),
    /// It was asked for under this number; when.
    Asked(Command, u16, Instant),
    /// It turns; when the last keep-alive went out.
    Alive(Instant),
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
    restarts: u64,
    reconnections: u64,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    if raw_path(&arguments.out) == arguments.out {
        miette::bail!(
            help = "write `--out run.csv` or `--out run.csv.gz`: run.raw is written beside it",
            "{} is where the raw bytes go",
            arguments.out.display()
        );
    }
    super::outputs::named_as_text("--out", &arguments.out)?;
    let own = [arguments.out.clone(), raw_path(&arguments.out)];
    super::Outputs::beside(own.iter().chain(&arguments.replay))
        .result("--json", arguments.json.as_ref())?;
    if arguments.out.exists() && !arguments.resume {
        return Err(imu_stand::CaptureError::Exists {
            path: arguments.out.clone(),
        }
        .into());
    }
    if let Some(raw) = &arguments.replay {
        return replay::replay(arguments, raw);
    }
    let mut feed = Feed::new(arguments.line.open()?);
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).into_diagnostic()?;
    let mut capture = Capture::start(arguments)?;
    let began = Instant::now();
    let is_over = |_: &Feed| {
        stop.load(Ordering::Relaxed)
            || arguments
                .seconds
                .is_some_and(|seconds| began.elapsed().as_secs_f64() >= seconds)
    };
    let listened = capture.listen(&mut feed, is_over);
    let listened = listened.and(capture.halt(&mut feed));
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
            motor: arguments.drive.command().map_or(Motor::Off, Motor::Wanted),
            waiting: Vec::new(),
            corrects: false,
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

    /// Starts the motor once the file is open, and keeps it alive. After a restart of the board, or a port that was gone,
    /// it stays off: nobody may be watching.
    fn drive(&mut self, feed: &mut Feed) -> Result<()> {
        match self.motor {
            Motor::Wanted(command) if self.live.is_some() && !feed.is_gone() => {
                let number = feed.link.send(Command::Arm { nonce: 0 })?;
                self.motor = Motor::Arming(command, number, Instant::now());
            }
            Motor::Armed(command, nonce) if !feed.is_gone() => {
                feed.link.send(Command::Arm { nonce })?;
                let number = feed.link.send(command)?;
                self.motor = Motor::Asked(command, number, Instant::now());
            }
            Motor::Arming(command, _, asked) | Motor::Asked(command, _, asked)
                if asked.elapsed() > ASK =>
            {
                self.motor = Motor::Wanted(command);
            }
            Motor::Alive(last) if last.elapsed() >= KEEP_ALIVE && !feed.is_gone() => {
                // A port that fails here is gone for the reader, too.
                let _ = feed.link.send(Command::KeepAlive);
                self.motor = Motor::Alive(Instant::now());
            }
            _ => {}
        }
        Ok(())
    }

    /// A reply: the nonce that arms the motor; to the motor's command it says whether it turns.
    fn replied(&mut self, reply: Reply) -> Result<()> {
        let asks = Command::GetCorrection {
            other: false,
            row: 0,
        };
        if reply.command == asks.code() && self.live.is_none() {
            self.corrects = reply.status == wire::Status::Ok && reply.value != 0;
        }
        if let Motor::Arming(command, number, _) = self.motor
            && reply.number == number
        {
            link::done(&Command::Arm { nonce: 0 }, reply)?;
            self.motor = Motor::Armed(command, reply.value as u16);
        }
        if let Motor::Asked(command, number, _) = self.motor
            && reply.number == number
            && reply.command == command.code()
        {
            link::done(&command, reply)?;
            self.motor = Motor::Alive(Instant::now());
            self.tell("the motor is driven")?;
        }
        Ok(())
    }

    fn motor_is_off(&mut self) -> Result<()> {
        if matches!(self.motor, Motor::Alive(_) | Motor::Asked(..)) {
            self.motor = Motor::Off;
            self.tell("the motor stays off from here on")?;
        }
        Ok(())
    }

    fn listen(&mut self, feed: &mut Feed, is_over: impl Fn(&Feed) -> bool) -> Result<()> {
        // A port that fails right here is gone for the loop below, which waits for it.
        let _ = feed.ask();
        let (mut heard, mut shown, mut asked) = (Instant::now(), Instant::now(), Instant::now());
        while !is_over(feed) {
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
                    Frame::Reply(reply) => self.replied(reply)?,
                    Frame::Corrected(corrected) => self.corrected(&corrected)?,
                    Frame::Health(_) => {}
                }
            }
            if self.live.is_none() && asked.elapsed() > ASK && !feed.is_gone() {
                asked = Instant::now();
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

    /// Lets the motor run down, at its ramp, and captures that, too.
    fn halt(&mut self, feed: &mut Feed) -> Result<()> {
        if !matches!(self.motor, Motor::Alive(_)) {
            return Ok(());
        }
        let began = Instant::now();
        let mut stood = None;
        // Asked again and again: a request may be lost. Two samples later than the first at 0 it stands.
        while began.elapsed() < RAMP_DOWN {
            feed.link.send(Command::MotorDuty { duty: 0 })?;
            let until = Instant::now() + Duration::from_millis(300);
            self.listen(feed, |_| Instant::now() >= until)?;
            let stands = feed.link.sample.is_some_and(|sample| sample.pwm == 0);
            if stands && stood.replace(()).is_some() {
                break;
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
            self.motor_is_off()?;
        }
        Ok(())
    }

    /// What the board made of a sample's rates. The file gets columns for it where the board said in time that it corrects.
    fn corrected(&mut self, corrected: &Corrected) -> Result<()> {
        self.corrects = true;
        let Some(live) = &mut self.live else {
            return Ok(());
        };
        if live.has_corrected() {
            live.corrected(corrected);
            return Ok(());
        }
        let calibration = Calibration {
            corrected: true,
            ..live.calibration().clone()
        };
        self.tell("the board corrects its rates from here on: another file goes on")?;
        self.close()?;
        self.open(&calibration, &[])
    }

    fn hello(&mut self, hello: &Hello) -> Result<()> {
        let calibration = self.arguments.calibration(Some(hello), self.corrects);
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
        self.open(&self.arguments.calibration(None, self.corrects), &[])?;
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
