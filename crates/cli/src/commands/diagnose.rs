//! `imu-stand diagnose`.

use std::path::{Path, PathBuf};

use clap::Args;
use diagnosis::DiagnoseOptions;
use diagnosis::result::{Diagnosed, Diagnosis, Verdict};
use imu_stand::report::Subject;
use imu_stand::text;
use miette::Result;
use model::record::{Base, Record};
use serde::Serialize;

use super::progress::working;
use super::{Input, Outputs, Replicates, many};

/// What `diagnose` takes.
#[derive(Args)]
pub struct Arguments {
    /// Captures, or folders of them: .csv, .csv.gz, .npz, .npy, .parquet, .mat, .h5, .mcap, .bag, .ulg, .txt
    #[arg(required = true)]
    captures: Vec<PathBuf>,
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    replicates: Replicates,
    /// Seed of whatever is random
    #[arg(long, default_value_t = 0, value_parser = super::seed, allow_negative_numbers = true)]
    seed: u64,
    /// Only these channels, accelerometers at rest too: gyro_x,acc_z,...
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    channels: Option<Vec<String>>,
    /// Write the result as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the extended model
    #[arg(long, value_name = "FILE")]
    model_out: Option<PathBuf>,
    /// Write a report, one self-contained HTML file
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Print the details too: gains, checks that fail, why something was not tested, the smallest sizes
    #[arg(long)]
    details: bool,
}

/// Several captures, each diagnosed by itself.
#[derive(Serialize)]
struct Several {
    format: &'static str,
    runs: Vec<Diagnosis>,
    /// Those that cannot be read or diagnosed.
    failed: Vec<Failed>,
}

/// A capture of several that was not diagnosed.
#[derive(Serialize)]
struct Failed {
    file: String,
    why: String,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    let captures = many::captures(&arguments.captures)?;
    let one_only = [
        ("--model-out", arguments.model_out.is_some()),
        ("--report", arguments.report.is_some()),
    ];
    for (option, given) in one_only {
        if given && captures.len() > 1 {
            misused!(
                help = "diagnose them one by one",
                "{option} is for one capture"
            );
        }
    }
    Outputs::beside(&captures)
        .result("--json", arguments.json.as_ref())?
        .result("--model-out", arguments.model_out.as_ref())?
        .page("--report", arguments.report.as_ref())?;
    match captures.as_slice() {
        [one] => alone(arguments, one),
        all => several(arguments, all),
    }
}

/// A capture and what was found in it.
struct Found {
    record: Record,
    base: Option<Base>,
    hash: String,
    diagnosed: Diagnosed,
}

/// Diagnoses a capture; its record is kept only where it is needed again.
fn found(arguments: &Arguments, path: &Path, is_needed: bool) -> Result<Found> {
    let mut record = arguments.input.read(path)?.record;
    let base = record.header.base;
    let hash = super::digest(path)?;
    let options = DiagnoseOptions {
        seed: arguments.seed,
        file: super::name(path),
        hash: Some(hash.clone()),
        no_evidence: arguments.report.is_none(),
        replicates: arguments.replicates.count(),
        matters: arguments.replicates.matters(),
    };
    let say = || format!("diagnosing {}", options.file);
    let diagnosed = working(arguments.input.quiet, say, || {
        if let Some(channels) = &arguments.channels {
            diagnosis::diagnose_channels(&record, channels, &options)
        } else if is_needed {
            diagnosis::diagnose(&record, &options)
        } else {
            diagnosis::diagnose_owned(std::mem::take(&mut record), &options)
        }
    });
    Ok(Found {
        record,
        base,
        hash,
        diagnosed: diagnosed.map_err(super::explain)?,
    })
}

fn alone(arguments: &Arguments, path: &Path) -> Result<()> {
    let is_needed = arguments.model_out.is_some() || arguments.report.is_some();
    let Found {
        record,
        base,
        hash,
        diagnosed,
    } = found(arguments, path, is_needed)?;
    if let Some(path) = &arguments.model_out {
        let fitted = diagnosed.extended_model.clone().excited_like(&record);
        super::write(path, &fitted.to_toml())?;
    }
    super::write_json(arguments.json.as_ref(), &diagnosed.diagnosis)?;
    if !arguments.input.quiet {
        say!("{}", text::diagnosis(&diagnosed, base).trim_end());
        match arguments.details {
            true => say!("{}", text::details(&diagnosed.diagnosis).trim_end()),
            false => say!("{}", text::MORE),
        }
    }
    if let Some(page) = &arguments.report {
        let subject = Subject {
            record: &record,
            diagnosed: &diagnosed,
            rate_hz: None,
            command: &super::report::command(),
            seed: arguments.seed,
            hash: Some(&hash),
            hidden: None,
        };
        super::report::write(page, &subject, arguments.input.quiet)?;
    }
    Ok(())
}

/// What is left of one of several: what is said of it, and what is written.
struct Short {
    text: String,
    diagnosis: Diagnosis,
}

/// Diagnoses captures side by side. One that cannot be read keeps no other from its answer.
fn several(arguments: &Arguments, captures: &[PathBuf]) -> Result<()> {
    let all: Vec<Result<Short>> = many::in_parallel(captures, arguments.input.quiet, |path| {
        let Found {
            base, diagnosed, ..
        } = found(arguments, path, false)?;
        let mut text = String::new();
        if arguments.details {
            text = text::diagnosis(&diagnosed, base) + &text::details(&diagnosed.diagnosis);
        }
        let diagnosis = diagnosed.diagnosis;
        Ok(Short { text, diagnosis })
    });
    let mut several = Several {
        format: "imu-stand-diagnoses/1",
        runs: Vec::new(),
        failed: Vec::new(),
    };
    let mut rows = Vec::new();
    for (path, one) in captures.iter().zip(all) {
        let file = super::name(path);
        match one {
            Ok(short) => {
                if !short.text.is_empty() && !arguments.input.quiet {
                    say!("{}\n", short.text.trim_end());
                }
                rows.push(row(&file, &short.diagnosis));
                several.runs.push(short.diagnosis);
            }
            Err(error) => {
                let causes: Vec<String> = error.chain().map(ToString::to_string).collect();
                let why = causes.join(": ");
                rows.push([file.clone(), "no answer".to_owned(), why.clone()]);
                several.failed.push(Failed { file, why });
            }
        }
    }
    super::write_json(arguments.json.as_ref(), &several)?;
    if !arguments.input.quiet {
        table(&rows);
    }
    match several.failed.as_slice() {
        [] => Ok(()),
        [first, ..] => Err(miette::miette!(
            help = "`imu-stand diagnose` of one alone says what to do about it",
            "{} of {} captures could not be diagnosed, first {}",
            several.failed.len(),
            captures.len(),
            first.file
        )),
    }
}

/// A capture in the summary: its name, the verdict, and what was found.
fn row(file: &str, d: &Diagnosis) -> [String; 3] {
    let verdict = match d.verdict {
        Verdict::Adequate => "adequate",
        Verdict::Extended => "extended",
        Verdict::Unexplained => "unexplained",
    };
    let brief = |material: bool| {
        let own = d.findings.iter().filter(|f| f.material == material);
        own.map(text::answer::brief).collect::<Vec<_>>()
    };
    let (mut said, small) = (brief(true), brief(false));
    let mut left: Vec<&str> = d.unexplained.iter().map(|u| u.channel.as_str()).collect();
    left.dedup();
    if !left.is_empty() {
        said.push(format!("left over on {}", left.join(", ")));
    }
    if !small.is_empty() {
        said.push(format!("too small to matter: {}", small.join(", ")));
    }
    [file.to_owned(), verdict.to_owned(), said.join("; ")]
}

fn table(rows: &[[String; 3]]) {
    let heads = ["capture", "verdict", "found"];
    let width = |column: usize| {
        let cells = rows.iter().map(|row| row[column].chars().count());
        cells.max().unwrap_or(0).max(heads[column].len())
    };
    let (first, second) = (width(0), width(1));
    let line = |[a, b, c]: [&str; 3]| {
        let line = format!("{a:<first$}  {b:<second$}  {c}");
        say!("{}", line.trim_end());
    };
    line(heads);
    for [file, verdict, found] in rows {
        line([file, verdict, found]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_tells_causes_that_matter_from_those_that_do_not() {
        let finding = |cause: &str, material: bool| {
            serde_json::json!({
                "cause": cause, "channels": ["gyro_x"], "parameters": {}, "alternatives": [],
                "experiment": null, "gain": null, "material": material
            })
        };
        let d: Diagnosis = serde_json::from_value(serde_json::json!({
            "format": "", "input": {"file": "", "seconds": 1.0, "rate_hz": 1.0, "samples": 1, "channels": []},
            "baseline": {}, "checks": [], "unexplained": [], "not_tested": [], "verdict": "extended",
            "findings": [finding("motor_bias", true), finding("low_pass", false), finding("shock", false)]
        }))
        .expect("a diagnosis");
        let said = "motor_bias on gyro_x; too small to matter: low_pass on gyro_x, shock on gyro_x";
        assert_eq!(row("a.csv", &d), ["a.csv", "extended", said]);
    }
}
