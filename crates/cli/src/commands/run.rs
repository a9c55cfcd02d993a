//! `imu-stand run`.

use std::path::PathBuf;

use analysis::{AnalyzeOptions, DiagnoseOptions};
use clap::Args;
use imu_stand::capture::{ReadOptions, read_capture};
use imu_stand::report::Subject;
use imu_stand::stand::{Hidden, plan, run_native};
use imu_stand::{text, write_capture};
use indicatif::{ProgressBar, ProgressStyle};
use miette::Result;

/// What `run` takes.
#[derive(Args)]
pub struct Arguments {
    /// Run the firmware's logic on the host instead of its image on a simulated ATmega16
    #[arg(long)]
    native: bool,
    /// What to hide in the stand
    #[arg(long, value_enum, default_value_t = Hidden::Random)]
    hide: Hidden,
    /// Length, s
    #[arg(long, default_value_t = 600.0)]
    seconds: f64,
    /// Seed: the same seed gives the same run
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The capture to write, .csv or .csv.gz
    #[arg(long, default_value = "capture.csv")]
    out: PathBuf,
    /// Write the analysis as JSON
    #[arg(long, value_name = "FILE")]
    analysis: Option<PathBuf>,
    /// Write the diagnosis as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write a report, one self-contained HTML file
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Print nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    if !arguments.native {
        miette::bail!(
            help = "`imu-stand run --native` runs the firmware's own logic on the host, on the same simulated stand",
            "this build has no simulated ATmega16"
        );
    }
    if !(60.0..=86_400.0).contains(&arguments.seconds) {
        miette::bail!(
            help = "write `--seconds 600`",
            "--seconds: {} is not within 60 .. 86400",
            arguments.seconds
        );
    }
    let plan = plan(arguments.hide, arguments.seconds, arguments.seed);
    let bar = if arguments.quiet {
        ProgressBar::hidden()
    } else {
        ProgressBar::new(arguments.seconds as u64)
    };
    bar.set_style(
        ProgressStyle::with_template("stand {bar:40} {pos}/{len} s")
            .unwrap_or(ProgressStyle::default_bar()),
    );
    let (record, link) = run_native(&plan, |time| bar.set_position(time as u64));
    bar.finish_and_clear();
    write_capture(&arguments.out, &record)?;

    // The engine gets the capture as it was written, and nothing else.
    let read = read_capture(&arguments.out, &ReadOptions::default())?;
    let file = super::name(&arguments.out);
    let options = AnalyzeOptions {
        seed: arguments.seed,
        file: file.clone(),
        ..AnalyzeOptions::default()
    };
    let analysis = analysis::analyze(&read.record, &options).map_err(super::explain)?;
    super::write_json(arguments.analysis.as_ref(), &analysis)?;
    let hash = super::digest(&arguments.out)?;
    let options = DiagnoseOptions {
        seed: arguments.seed,
        file,
        hash: Some(hash.clone()),
    };
    let found = analysis::diagnose(&read.record, &options).map_err(super::explain)?;
    super::write_json(arguments.json.as_ref(), &found.diagnosis)?;
    if !arguments.quiet {
        say!(
            "{}: {} samples, {}",
            arguments.out.display(),
            record.len(),
            text::link(&link)
        );
        say!("{}", text::diagnosis(&found.diagnosis).trim_end());
        say!("\nhidden in the stand: {}", plan.hidden);
    }
    if let Some(page) = &arguments.report {
        let subject = Subject {
            record: &read.record,
            diagnosed: &found,
            rate_hz: None,
            command: &super::report::command(),
            seed: arguments.seed,
            hash: Some(&hash),
            hidden: Some(&plan.hidden),
        };
        super::report::write(page, &subject, arguments.quiet)?;
    }
    Ok(())
}
