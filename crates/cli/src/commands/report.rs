//! `imu-stand report`, and `--report` of the commands that diagnose.

use std::path::{Path, PathBuf};

use analysis::DiagnoseOptions;
use clap::Args;
use imu_stand::report::{Subject, report};
use miette::Result;

use super::Input;

/// What `report` takes.
#[derive(Args)]
pub struct Arguments {
    /// The capture, .csv or .csv.gz
    capture: PathBuf,
    #[command(flatten)]
    input: Input,
    /// Seed of whatever is random
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// The report to write
    #[arg(long, default_value = "report.html")]
    out: PathBuf,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    let read = arguments.input.read(&arguments.capture)?;
    let hash = super::digest(&arguments.capture)?;
    let options = DiagnoseOptions {
        seed: arguments.seed,
        file: super::name(&arguments.capture),
        hash: Some(hash.clone()),
    };
    let diagnosed = analysis::diagnose(&read.record, &options).map_err(super::explain)?;
    let subject = Subject {
        record: &read.record,
        diagnosed: &diagnosed,
        rate_hz: arguments.input.rate,
        command: &command(),
        seed: arguments.seed,
        hash: Some(&hash),
        hidden: None,
    };
    write(&arguments.out, &subject, arguments.input.quiet)
}

/// Makes a report and writes it.
pub fn write(path: &Path, subject: &Subject<'_>, quiet: bool) -> Result<()> {
    let page = report(subject).map_err(|error| {
        miette::miette!(
            help = "`imu-stand diagnose` without a report gives the same answers as text and JSON",
            "no report: {error}"
        )
    })?;
    super::write(path, &page)?;
    if !quiet {
        say!("report: {}", path.display());
    }
    Ok(())
}

/// The command as it was typed; the program by its name.
pub fn command() -> String {
    let words = std::env::args().skip(1).map(|word| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+".contains(c);
        if !word.is_empty() && word.chars().all(plain) {
            word
        } else {
            format!("'{}'", word.replace('\'', r"'\''"))
        }
    });
    std::iter::once("imu-stand".to_owned())
        .chain(words)
        .collect::<Vec<_>>()
        .join(" ")
}
