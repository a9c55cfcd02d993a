//! `imu-stand diagnose`.

use std::path::PathBuf;

use clap::Args;
use diagnosis::DiagnoseOptions;
use diagnosis::result::Diagnosis;
use imu_stand::report::Subject;
use imu_stand::text;
use miette::Result;
use serde::Serialize;

use super::{Input, Outputs, Replicates};

/// What `diagnose` takes.
#[derive(Args)]
pub struct Arguments {
    /// Captures: .csv, .csv.gz, .npz, .npy, .parquet, .mat, .h5, .mcap, .bag, .ulg, .txt
    #[arg(required = true)]
    captures: Vec<PathBuf>,
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    replicates: Replicates,
    /// Seed of whatever is random
    #[arg(long, default_value_t = 0)]
    seed: u64,
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
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    let one_only = [
        ("--model-out", arguments.model_out.is_some()),
        ("--report", arguments.report.is_some()),
    ];
    for (option, given) in one_only {
        if given && arguments.captures.len() > 1 {
            miette::bail!(
                help = "diagnose them one by one",
                "{option} is for one capture"
            );
        }
    }
    Outputs::beside(&arguments.captures)
        .result("--json", arguments.json.as_ref())?
        .result("--model-out", arguments.model_out.as_ref())?
        .result("--report", arguments.report.as_ref())?;
    let mut runs = Vec::new();
    for path in &arguments.captures {
        let mut read = arguments.input.read(path)?;
        let hash = super::digest(path)?;
        let options = DiagnoseOptions {
            seed: arguments.seed,
            file: super::name(path),
            hash: Some(hash.clone()),
            no_evidence: arguments.report.is_none(),
            replicates: arguments.replicates.count(),
        };
        let is_needed = arguments.model_out.is_some() || arguments.report.is_some();
        let found = if is_needed {
            diagnosis::diagnose(&read.record, &options)
        } else {
            diagnosis::diagnose_owned(std::mem::take(&mut read.record), &options)
        };
        let found = found.map_err(super::explain)?;
        if let Some(path) = &arguments.model_out {
            let fitted = found.extended_model.clone().excited_like(&read.record);
            super::write(path, &fitted.to_toml())?;
        }
        if !arguments.input.quiet {
            say!("{}", text::diagnosis(&found).trim_end());
            if arguments.details {
                say!("{}", text::details(&found.diagnosis).trim_end());
            }
        }
        if let Some(page) = &arguments.report {
            let subject = Subject {
                record: &read.record,
                diagnosed: &found,
                rate_hz: None,
                command: &super::report::command(),
                seed: arguments.seed,
                hash: Some(&hash),
                hidden: None,
            };
            super::report::write(page, &subject, arguments.input.quiet)?;
        }
        runs.push(found.diagnosis);
    }
    match runs.as_slice() {
        [one] => super::write_json(arguments.json.as_ref(), one),
        _ => super::write_json(
            arguments.json.as_ref(),
            &Several {
                format: "imu-stand-diagnoses/1",
                runs,
            },
        ),
    }
}
