//! The commands: arguments, files, and what is printed.

pub mod analyze;
pub mod board;
pub mod capture;
pub mod diagnose;
pub mod doctor;
pub mod export;
mod export_source;
pub mod flash;
mod many;
pub mod monitor;
pub mod outputs;
pub mod paper;
pub mod plan;
mod progress;
pub mod report;
pub mod representative;
pub mod run;
pub mod shell;
pub mod simulate;
pub mod terminal;
pub mod usage;

use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use clap::{Args, ValueEnum};
use imu_stand::capture::{Read, Span, corrected, joined, log_of, read_from, unpacked};
use imu_stand::link::{DEFAULT_BAUD, Link};
use imu_stand::{CaptureError, ColumnMapping, ReadOptions, read_capture};
use miette::{IntoDiagnostic, Result, WrapErr};
use model::record::Base;
use sha2::{Digest, Sha256};

pub use imu_stand::explain::explain;
pub use outputs::{Outputs, write, write_json};

/// How to read a file; the same for every command that takes captures.
#[derive(Args)]
pub struct Input {
    /// Which column of a foreign file is what: `time=time_s,gyro_x=gx_dps,...`
    #[arg(long, value_name = "OURS=THEIRS,...")]
    columns: Option<String>,
    /// Units of a foreign file: `gyro=deg/s,acc=m/s2`
    #[arg(long, value_name = "OURS=UNIT,...")]
    units: Option<String>,
    /// Sample rate, Hz, where the rows have no times; refused where these say another one
    #[arg(long, value_name = "HZ", value_parser = positive, allow_negative_numbers = true)]
    pub rate: Option<f64>,
    /// Take a part of the record alone, s from its first row: `60,600`, `60,` or `,600`
    #[arg(long, value_name = "FROM,TO", allow_hyphen_values = true)]
    span: Option<Span>,
    /// Leave out what stands in rows that cannot be read, and count them
    #[arg(long)]
    skip_bad: bool,
    /// Which topic of a log (MCAP, ROS bag, ULog) that has several IMUs
    #[arg(long, value_name = "NAME")]
    topic: Option<String>,
    /// What the base under the sensor did, where the file does not say or is wrong
    #[arg(long, value_enum)]
    base: Option<BaseName>,
    /// Take the rates that the board has corrected, in place of those that it read
    #[arg(long)]
    corrected: bool,
    /// Print nothing but errors
    #[arg(long, short)]
    pub quiet: bool,
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

impl From<BaseName> for Base {
    fn from(name: BaseName) -> Self {
        match name {
            BaseName::Static => Self::Static,
            BaseName::Moving => Self::Moving,
            BaseName::Turntable => Self::Turntable,
        }
    }
}

/// Simulations that the record is compared with; the same for every command that diagnoses.
#[derive(Args)]
pub struct Replicates {
    /// Simulations of the model before and after that the record is compared with: where they differ, the model is not
    /// called extended
    #[arg(long, value_name = "N", default_value_t = diagnosis::replicates::REPLICATES,
        value_parser = enough_replicates)]
    replicates: usize,
    /// Compare the record with no simulation
    #[arg(long, conflicts_with = "replicates")]
    no_replicates: bool,
    /// Change of an angle error or of a deviation, percent, from which on a cause, or what has no name, is material
    #[arg(long, value_name = "PERCENT", default_value_t = 100.0 * diagnosis::MATTERS, value_parser = positive,
        allow_negative_numbers = true)]
    matters: f64,
}

impl Replicates {
    /// Relative change that matters.
    pub fn matters(&self) -> f64 {
        self.matters / 100.0
    }

    /// How many.
    pub fn count(&self) -> usize {
        if self.no_replicates {
            0
        } else {
            self.replicates
        }
    }
}

/// As many as tell a chance of 5 %.
fn enough_replicates(text: &str) -> Result<usize, String> {
    const LEAST: usize = 19;
    match text.parse() {
        Ok(n) if n >= LEAST => Ok(n),
        _ => Err(format!(
            "takes a whole number, {LEAST} at least; --no-replicates for none"
        )),
    }
}

impl Input {
    /// Reads a capture by these options; says how many rows were left out.
    pub fn read(&self, path: &Path) -> Result<Read> {
        let mapping = ColumnMapping::parse(self.columns.as_deref(), self.units.as_deref())
            .map_err(|error| usage::misuse(&error))?;
        let options = ReadOptions {
            mapping,
            rate_hz: self.rate,
            skip_bad: self.skip_bad,
            topic: self.topic.clone(),
            span: self.span,
            base: self.base.map(Into::into),
        };
        let path = &log_of(path).map_err(|error| not_read(error, path))?;
        let say = || format!("reading {}", name(path));
        let read = progress::working(self.quiet, say, || read_by(path, &options))?;
        let read = read.and_then(|read| match self.corrected {
            true => Ok(Read {
                record: corrected(read.record)?,
                ..read
            }),
            false => Ok(read),
        });
        let read = read.map_err(|error| not_read(error, path))?;
        if read.record.len() == 1 && read.record.header.rate_hz.is_none() {
            miette::bail!(
                help = "was the file copied whole?",
                "{}: one row of data, and a sample rate needs two",
                name(path)
            );
        }
        if read.skipped > 0 && !self.quiet {
            warn!(
                "{}: rows that cannot be read and are left out: {}",
                path.display(),
                read.skipped
            );
        }
        Ok(read)
    }

    /// Says on standard error what was wrong with the rows of a capture, for commands whose results have no place for it.
    pub fn tell(&self, path: &Path, record: &model::record::Record) {
        for note in record.notes.iter().filter(|_| !self.quiet) {
            warn!("{}: {note}", path.display());
        }
    }
}

/// A file, the files of a folder, or standard input, read.
fn read_by(path: &Path, options: &ReadOptions) -> Result<std::result::Result<Read, CaptureError>> {
    Ok(if path.is_dir() {
        joined(path).and_then(|(text, _)| read_from(text, options))
    } else if path.as_os_str() == outputs::DASH {
        unpacked(stdin()?).map_or_else(
            |source| {
                let path = PathBuf::from(STDIN);
                Err(CaptureError::Io { path, source })
            },
            |text| read_from(text, options),
        )
    } else {
        read_capture(path, options)
    })
}

/// A capture that cannot be read, with its name where the error has none.
fn not_read(error: CaptureError, path: &Path) -> miette::Report {
    let error = match error {
        CaptureError::Io { path, source } => return unreadable(&path, &source),
        error => error,
    };
    let says_which = matches!(
        error,
        CaptureError::CutOff { .. }
            | CaptureError::Damaged { .. }
            | CaptureError::Table { .. }
            | CaptureError::Parts { .. }
    );
    let report = miette::Report::new(error);
    if says_which {
        return report;
    }
    let name = match path.as_os_str() == outputs::DASH {
        true => STDIN.into(),
        false => path.display().to_string(),
    };
    report.wrap_err(format!("cannot read {name}"))
}

/// A file that cannot be opened or read, and what to do.
fn unreadable(path: &Path, error: &std::io::Error) -> miette::Report {
    use std::io::ErrorKind as Kind;
    let help = match error.kind() {
        Kind::NotFound => "is the path right, seen from the folder in which you are?",
        Kind::IsADirectory => "it is a folder: name a file in it",
        Kind::PermissionDenied => "change its rights, or copy it to where you may read",
        _ => "is the disk, or the line to it, in order?",
    };
    miette::miette!(help = help, "cannot read {}: {error}", path.display())
}

/// Where the board is; the same for every command that talks to one.
#[derive(Args)]
pub struct Line {
    /// The serial port, /dev/ttyUSB0 or COM3; without it the environment's IMU_STAND_PORT
    #[arg(long, global = true, value_name = "PORT")]
    port: Option<String>,
    /// Speed of the line
    #[arg(long, global = true, default_value_t = DEFAULT_BAUD, value_parser = clap::value_parser!(u32).range(1..))]
    baud: u32,
}

impl Line {
    /// Name of the port. Ends the program with 2 where none was given.
    pub fn port(&self) -> String {
        let set = || std::env::var("IMU_STAND_PORT").ok();
        self.port.clone().or_else(set).unwrap_or_else(|| {
            clap::Error::raw(
                clap::error::ErrorKind::MissingRequiredArgument,
                "which board? name its serial port: `--port /dev/ttyUSB0` or `--port COM3`, or set IMU_STAND_PORT\n",
            )
            .exit()
        })
    }

    /// Whether a port was named on the command line.
    pub fn is_named(&self) -> bool {
        self.port.is_some()
    }

    /// Opens it.
    pub fn open(&self) -> Result<Link> {
        Ok(Link::open(&self.port(), self.baud)?)
    }
}

/// Prints a line, to standard error where a result goes to standard output. Where the reader has had enough, the rest is
/// not printed and the command goes on: its files are still asked for. Ends the program where it cannot be printed else.
pub fn say(line: std::fmt::Arguments<'_>) {
    use std::io::Write as _;
    let line = line.to_string();
    let line = terminal::harmless(&line);
    let said = if outputs::stdout_is_taken() {
        writeln!(std::io::stderr(), "{line}")
    } else {
        writeln!(std::io::stdout(), "{line}")
    };
    match said {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            let report = outputs::failed(Path::new("standard output"), &error);
            let _ = writeln!(std::io::stderr(), "Error: {report:?}");
            std::process::exit(1);
        }
        _ => {}
    }
}

/// Prints a line to standard error.
pub fn warn(line: std::fmt::Arguments<'_>) {
    eprintln!("{}", terminal::harmless(&line.to_string()));
}

/// Standard input in messages and reports.
const STDIN: &str = "standard input";

/// All of standard input; it is read once.
fn stdin() -> Result<&'static [u8]> {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    if let Some(bytes) = BYTES.get() {
        return Ok(bytes);
    }
    let mut bytes = Vec::new();
    std::io::stdin()
        .lock()
        .read_to_end(&mut bytes)
        .into_diagnostic()
        .wrap_err(STDIN)?;
    Ok(BYTES.get_or_init(|| bytes))
}

/// The file's name for reports.
pub fn name(path: &Path) -> String {
    if path.as_os_str() == outputs::DASH {
        return STDIN.to_owned();
    }
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

/// SHA-256 of a file, in hex.
pub fn digest(path: &Path) -> Result<String> {
    let mut hash = Sha256::new();
    if path.as_os_str() == outputs::DASH {
        hash.update(stdin()?);
        return Ok(format!("sha256:{:x}", hash.finalize()));
    }
    let path = log_of(path)?;
    let files = match path.is_dir() {
        true => joined(&path)?.1,
        false => vec![path],
    };
    for path in files {
        let mut file = std::fs::File::open(&path)
            .into_diagnostic()
            .wrap_err_with(|| format!("{}", path.display()))?;
        std::io::copy(&mut file, &mut hash).into_diagnostic()?;
    }
    Ok(format!("sha256:{:x}", hash.finalize()))
}

/// A number above 0, from an option's text.
pub fn positive(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok(number),
        _ => Err("it has to be a number above 0".to_owned()),
    }
}

/// A seed, from an option's text.
pub fn seed(text: &str) -> std::result::Result<u64, String> {
    (text.parse()).map_err(|_| format!("it has to be a whole number from 0 to {}", u64::MAX))
}

/// Reads a text file.
pub fn read_text(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).map_err(|error| {
        miette::miette!(
            help = "is the path right, and is it a text file?",
            "cannot read {}: {error}",
            path.display()
        )
    })
}

/// Reads a model file; what is none says how one is made.
pub fn read_model(path: &Path) -> Result<model::ModelFile> {
    export_source::has_model(path)?;
    model::ModelFile::parse(&read_text(path)?).map_err(|error| {
        miette::miette!(
            help = "docs/model-file.md lists keys, effects and units",
            "{}: {error}",
            path.display()
        )
    })
}
