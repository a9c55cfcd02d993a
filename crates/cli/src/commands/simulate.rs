//! `imu-stand simulate`.

use std::path::PathBuf;

use clap::Args;
use imu_stand::capture::write_to;
use imu_stand::report::plot::tidy;
use miette::Result;
use model::file::ModelFile;

use super::outputs::{self, Outputs};

/// What `simulate` takes.
#[derive(Args)]
pub struct Arguments {
    /// The model file; without it the paper's stand
    #[arg(long)]
    model: Option<PathBuf>,
    /// Length, s
    #[arg(long, default_value_t = 600.0, value_parser = super::positive, allow_negative_numbers = true)]
    seconds: f64,
    /// Sample rate, Hz; without it the model's
    #[arg(long, value_parser = super::positive, allow_negative_numbers = true)]
    rate: Option<f64>,
    /// Seed: the same seed gives the same capture
    #[arg(long, default_value_t = 1, value_parser = super::seed, allow_negative_numbers = true)]
    seed: u64,
    /// The capture to write, .csv or .csv.gz
    #[arg(long)]
    out: PathBuf,
    /// Print nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    Outputs::beside(&arguments.model).simulated("--out", Some(&arguments.out))?;
    let model = match &arguments.model {
        None => ModelFile::paper(),
        Some(path) => super::read_model(path)?,
    };
    if model.channels.is_empty() {
        let path = arguments.model.as_deref().unwrap_or_else(|| "".as_ref());
        miette::bail!(
            help = "each gyro or accelerometer is a [[channel]] of it (docs/model-file.md): was the file copied whole?",
            "{}: the model has no [[channel]], so there is nothing to simulate",
            path.display()
        );
    }
    let rate = arguments.rate.unwrap_or(model.rate_hz);
    let unexcited = model::excitation::unexcited(&model).into_iter();
    for (cause, settings) in unexcited.filter(|_| !arguments.quiet) {
        warn!(
            "warning: {cause} will not show: nothing excites it. help: under [excitation], set {}",
            settings.join(" or ")
        );
    }
    let mut record =
        model::simulate(&model, arguments.seconds, rate, arguments.seed).map_err(|error| {
            use model::simulate::SimulateError as E;
            let help = match &error {
                E::BadLength { .. } | E::BadRate { .. } => {
                    let help = "choose `--seconds` and `--rate` accordingly";
                    return miette::miette!(code = super::usage::CODE, help = help, "{error}");
                }
                _ => "docs/model-file.md lists channels and effects",
            };
            miette::miette!(help = help, "{error}")
        })?;
    outputs::mark_simulated(&mut record, "simulate");
    if arguments.out.as_os_str() == outputs::DASH {
        outputs::to_stdout(|mut out| write_to(&mut out, &record))?;
    } else {
        outputs::write_record(&arguments.out, &record)?;
    }
    if !arguments.quiet {
        say!(
            "{}: {} rows at {} Hz, seed {}",
            arguments.out.display(),
            record.len(),
            tidy(rate, 6),
            arguments.seed
        );
    }
    Ok(())
}
