//! `imu-stand export`.

use std::path::{Path, PathBuf};

use analysis::AnalyzeOptions;
use analysis::analyze::{ANALYSIS_FORMAT, Analysis};
use clap::{Args, ValueEnum};
use imu_stand::export::data::{DataError, Table};
use imu_stand::export::noise::{Consumer, ImuNoise};
use miette::Result;

use super::Input;
use super::outputs::{self, Outputs};

/// Into what.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum To {
    /// Data as CSV with units
    Csv,
    /// Data as NPZ, for numpy
    Npz,
    /// Data as Parquet, for pandas, polars, DuckDB
    Parquet,
    /// Noise: Kalibr's imu.yaml, read by OpenVINS and others too
    Kalibr,
    /// Noise: acc_n, gyr_n, acc_w, gyr_w of VINS-Mono and VINS-Fusion
    Vins,
    /// Noise: gyroparams and accelparams of MATLAB's imuSensor
    Matlab,
    /// Noise: the imu element of SDF, for Gazebo Sim and PX4 with it
    Gz,
    /// Noise: the dictionary of an IMU in gnss-ins-sim
    GnssInsSim,
}

/// What `export` takes.
#[derive(Args)]
pub struct Arguments {
    /// A capture; for noise also an analysis (`analyze --json`)
    file: PathBuf,
    /// Into what; without it by the ending of --out: .csv, .csv.gz, .npz, .parquet, .yaml (Kalibr), .m, .sdf, .py
    #[arg(long, value_enum)]
    to: Option<To>,
    /// The file to write; noise goes to standard output without it
    #[arg(long)]
    out: Option<PathBuf>,
    /// Data in counts, as the parts deliver them, not scaled
    #[arg(long)]
    raw: bool,
    /// Noise: the rate of the sensor where the numbers are used, Hz; the record's own without it
    #[arg(long, value_name = "HZ", value_parser = super::positive, allow_negative_numbers = true)]
    at_rate: Option<f64>,
    /// Noise: seed of the replicates behind intervals
    #[arg(long, default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    input: Input,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    let to = match (arguments.to, &arguments.out) {
        (Some(to), _) => to,
        (None, Some(out)) => by_ending(out)?,
        (None, None) => miette::bail!(
            help = "write `imu-stand export run.csv --out run.parquet`, or `--to kalibr`",
            "into what?"
        ),
    };
    let consumer = match to {
        To::Csv | To::Npz | To::Parquet => return data(arguments, to),
        To::Kalibr => Consumer::Kalibr,
        To::Vins => Consumer::Vins,
        To::Matlab => Consumer::Matlab,
        To::Gz => Consumer::Gz,
        To::GnssInsSim => Consumer::GnssInsSim,
    };
    noise(arguments, consumer)
}

fn by_ending(out: &Path) -> Result<To> {
    let name = super::name(out);
    let endings = [
        (".csv", To::Csv),
        (".csv.gz", To::Csv),
        (".npz", To::Npz),
        (".parquet", To::Parquet),
        (".yaml", To::Kalibr),
        (".yml", To::Kalibr),
        (".m", To::Matlab),
        (".sdf", To::Gz),
        (".py", To::GnssInsSim),
    ];
    match endings.iter().find(|(ending, _)| name.ends_with(ending)) {
        Some((_, to)) => Ok(*to),
        None => miette::bail!(
            help = "add `--to`, for example `--to kalibr`; `imu-stand export --help` lists them",
            "{name}: the ending does not say what to write"
        ),
    }
}

fn data(arguments: &Arguments, to: To) -> Result<()> {
    let Some(out) = &arguments.out else {
        miette::bail!(help = "add `--out FILE`", "data are written to a file");
    };
    let is_dash = out.as_os_str() == outputs::DASH;
    if is_dash && to != To::Csv {
        miette::bail!(
            help = "name a file, or take `--to csv`",
            "only text goes to standard output"
        );
    }
    Outputs::beside([&arguments.file]).data("--out", Some(out))?;
    let read = arguments.input.read(&arguments.file)?;
    super::tell(&arguments.file, &read.record);
    let table = Table::of(&read.record, arguments.raw);
    let written = match to {
        To::Npz => table.write_npz(out),
        To::Parquet => table.write_parquet(out),
        _ if is_dash => return outputs::to_stdout(|mut out| table.csv(&mut out)),
        _ => table.write_csv(out),
    };
    written.map_err(|error| match error {
        DataError::Io(error) => outputs::failed(out, &error),
        other => miette::miette!("{}: {other}", out.display()),
    })?;
    if !arguments.input.quiet {
        say!(
            "{}: {} rows of {} columns",
            out.display(),
            table.rows(),
            table.columns.len()
        );
    }
    Ok(())
}

fn noise(arguments: &Arguments, consumer: Consumer) -> Result<()> {
    Outputs::beside([&arguments.file]).result("--out", arguments.out.as_ref())?;
    let analysis = analysis(arguments)?;
    let noise = ImuNoise::of(&analysis);
    if noise.gyro.is_empty() && noise.acc.is_empty() {
        miette::bail!(
            help = "map the columns and say the units: `--columns gyro_x=gx --units gyro=deg/s,acc=m/s2`",
            "{} has neither gyro nor accelerometer in units of one",
            arguments.file.display()
        );
    }
    let rate = arguments.at_rate.unwrap_or(noise.rate_hz);
    if let Some((axis, term)) = noise.lacks(consumer) {
        miette::bail!(
            help = "record for longer: `imu-stand plan` says how long; `imu-stand analyze` says what this record shows",
            "this record of {:.3} s says nothing about the {term} of {axis}, and a 0 in its place would be believed",
            noise.seconds
        );
    }
    let text = noise.text(consumer, rate);
    match &arguments.out {
        Some(out) => {
            super::write(out, &text)?;
            if !arguments.input.quiet {
                say!("{}: written", out.display());
            }
        }
        None => say!("{}", text.trim_end()),
    }
    Ok(())
}

/// From a file of `analyze --json`, or made of a capture.
fn analysis(arguments: &Arguments) -> Result<Analysis> {
    if arguments.file.extension().is_some_and(|e| e == "json") {
        let text = super::read_text(&arguments.file)?;
        let analysis: Analysis = serde_json::from_str(&text).map_err(|error| {
            miette::miette!(
                help = "`imu-stand analyze C --json A` writes one",
                "{} is no analysis: {error}",
                arguments.file.display()
            )
        })?;
        if analysis.format != ANALYSIS_FORMAT {
            miette::bail!(
                help = "`imu-stand analyze C --json A` writes one",
                "{}: the format is `{}`, expected `{ANALYSIS_FORMAT}`",
                arguments.file.display(),
                analysis.format
            );
        }
        return Ok(analysis);
    }
    let read = arguments.input.read(&arguments.file)?;
    super::tell(&arguments.file, &read.record);
    let options = AnalyzeOptions {
        seed: arguments.seed,
        rate_hz: None,
        file: super::name(&arguments.file),
        ..AnalyzeOptions::default()
    };
    analysis::analyze(&read.record, &options).map_err(super::explain)
}
