//! The commands: arguments, files, and what is printed.

pub mod analyze;
pub mod board;
pub mod capture;
pub mod diagnose;
pub mod export;
pub mod flash;
pub mod monitor;
pub mod paper;
pub mod plan;
pub mod report;
pub mod representative;
pub mod run;
pub mod simulate;
mod wish;

use std::path::{Path, PathBuf};

use clap::Args;
use imu_stand::capture::Read;
use imu_stand::link::{DEFAULT_BAUD, Link};
use imu_stand::{CaptureError, ColumnMapping, ReadOptions, read_capture};
use miette::{IntoDiagnostic, Result, WrapErr};
use serde::Serialize;
use sha2::{Digest, Sha256};

/// How to read a file; the same for every command that takes captures.
#[derive(Args)]
pub struct Input {
    /// Which column of a foreign file is what: `time=time_s,gyro_x=gx_dps,...`
    #[arg(long, value_name = "OURS=THEIRS,...")]
    columns: Option<String>,
    /// Units of a foreign file: `gyro=deg/s,acc=m/s2`
    #[arg(long, value_name = "OURS=UNIT,...")]
    units: Option<String>,
    /// Sample rate, Hz, where there is no time column
    #[arg(long, value_name = "HZ")]
    pub rate: Option<f64>,
    /// Leave out rows that cannot be read, and count them
    #[arg(long)]
    skip_bad: bool,
    /// Print nothing but errors
    #[arg(long, short)]
    pub quiet: bool,
}

impl Input {
    /// Reads a capture by these options; says how many rows were left out.
    pub fn read(&self, path: &Path) -> Result<Read> {
        if let Some(rate) = self.rate
            && !(rate > 0.0 && rate.is_finite())
        {
            miette::bail!(
                help = "write `--rate 20`",
                "--rate: {rate} is no sample rate"
            );
        }
        let mapping = ColumnMapping::parse(self.columns.as_deref(), self.units.as_deref())?;
        let options = ReadOptions {
            mapping,
            rate_hz: self.rate,
            skip_bad: self.skip_bad,
        };
        let read = read_capture(path, &options).map_err(|error| {
            let says_which = matches!(
                error,
                CaptureError::Io { .. } | CaptureError::CutOff { .. } | CaptureError::Table { .. }
            );
            let report = miette::Report::new(error);
            if says_which {
                report
            } else {
                report.wrap_err(format!("cannot read {}", path.display()))
            }
        })?;
        if read.skipped > 0 {
            eprintln!(
                "{}: rows that cannot be read and are left out: {}",
                path.display(),
                read.skipped
            );
        }
        Ok(read)
    }
}

/// Where the board is; the same for every command that talks to one.
#[derive(Args)]
pub struct Line {
    /// The serial port, /dev/ttyUSB0 or COM3; without it the environment's IMU_STAND_PORT
    #[arg(long, global = true, value_name = "PORT")]
    port: Option<String>,
    /// Speed of the line
    #[arg(long, global = true, default_value_t = DEFAULT_BAUD)]
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

/// Prints a line. Ends the program where the reader has gone: with success if it merely had enough, else with 1.
pub fn say(line: std::fmt::Arguments<'_>) {
    use std::io::Write as _;
    if let Err(error) = writeln!(std::io::stdout(), "{line}") {
        let enough = error.kind() == std::io::ErrorKind::BrokenPipe;
        std::process::exit(i32::from(!enough));
    }
}

/// The file's name for reports.
pub fn name(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

/// SHA-256 of a file, in hex.
pub fn digest(path: &Path) -> Result<String> {
    let mut file = std::fs::File::open(path)
        .into_diagnostic()
        .wrap_err_with(|| format!("{}", path.display()))?;
    let mut hash = Sha256::new();
    std::io::copy(&mut file, &mut hash).into_diagnostic()?;
    Ok(format!("sha256:{:x}", hash.finalize()))
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

/// Reads a model file.
pub fn read_model(path: &Path) -> Result<model::ModelFile> {
    model::ModelFile::parse(&read_text(path)?).map_err(|error| {
        miette::miette!(
            help = "docs/model-file.md lists keys, effects and units",
            "{}: {error}",
            path.display()
        )
    })
}

/// Writes a text file.
pub fn write(path: &Path, text: &str) -> Result<()> {
    std::fs::write(path, text).map_err(|error| {
        miette::miette!(
            help = "does its folder exist, and may you write there?",
            "cannot write {}: {error}",
            path.display()
        )
    })
}

/// Writes what a command found as JSON, where it was asked to.
pub fn write_json(path: Option<&PathBuf>, value: &impl Serialize) -> Result<()> {
    let Some(path) = path else { return Ok(()) };
    let mut text = serde_json::to_string_pretty(value).into_diagnostic()?;
    text.push('\n');
    write(path, &text)
}

/// Turns an analysis error into what the user is told, with what to do next.
pub fn explain(error: analysis::AnalysisError) -> miette::Report {
    let help = match &error {
        analysis::AnalysisError::Inconclusive {
            need, unit: "runs", ..
        } => format!("name {need} captures of the same stand at least"),
        analysis::AnalysisError::Inconclusive { need, unit, .. } => {
            format!("record for longer: {need} {unit} at least")
        }
        analysis::AnalysisError::NoRate => "add `--rate HZ`, or map a time column".to_owned(),
        analysis::AnalysisError::NoChannel { .. } => {
            "name one of the channels that are there".to_owned()
        }
        _ => "`--help` after the command lists its options, with an example".to_owned(),
    };
    miette::miette!(help = help, "{error}")
}
