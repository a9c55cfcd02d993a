//! `imu-stand export`.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use imu_stand::correct::keep_what_is_more_than_its_error;
use imu_stand::export::board::BoardCorrection;
use imu_stand::export::data::{DataError, Table};
use imu_stand::export::noise::{Consumer, ImuNoise};
use imu_stand::export::px4::EKF2_RATE_HZ;
use miette::Result;
use noise::AnalyzeOptions;
use noise::analyze::Analysis;

use super::Input;
use super::export_source::{self, Source};
use super::outputs::{self, Outputs};
use super::progress::working;

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
    /// Of a model file: the correction that the board's firmware applies, number by number
    Board,
    /// Noise: parameters of PX4's EKF2, and the thermal calibration of its gyro
    Px4,
}

/// What `export` takes.
#[derive(Args)]
pub struct Arguments {
    /// A capture; for noise also a diagnosis (`diagnose --json`), a model (`--model-out`) or an analysis (`analyze --json`)
    file: PathBuf,
    /// Noise: a capture or analysis beside a diagnosis or model, for the accelerometers
    beside: Option<PathBuf>,
    /// Into what; without it by the ending of --out: .csv, .csv.gz, .npz, .parquet, .yaml (Kalibr), .m, .sdf, .py, .params
    /// (PX4)
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
    #[arg(long, default_value_t = 0, value_parser = super::seed, allow_negative_numbers = true)]
    seed: u64,
    #[command(flatten)]
    input: Input,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    let to = match (arguments.to, &arguments.out) {
        (Some(to), _) => to,
        (None, Some(out)) => by_ending(out)?,
        (None, None) => misused!(
            help = "write `imu-stand export run.csv --out run.parquet`, or `--to kalibr`",
            "into what?"
        ),
    };
    let consumer = match to {
        To::Csv | To::Npz | To::Parquet => return data(arguments, to),
        To::Board => return board(arguments),
        To::Kalibr => Consumer::Kalibr,
        To::Vins => Consumer::Vins,
        To::Matlab => Consumer::Matlab,
        To::Gz => Consumer::Gz,
        To::GnssInsSim => Consumer::GnssInsSim,
        To::Px4 => Consumer::Px4,
    };
    noise(arguments, consumer)
}

/// SENS/AVG of the firmware's built-in set-up: 320 deg/s, 2^2 taps; `board correct` takes that of the board.
const SENS_AVG: u16 = 0x0402;

fn board(arguments: &Arguments) -> Result<()> {
    Outputs::beside([&arguments.file]).result("--out", arguments.out.as_ref())?;
    let mut model = super::read_model(&arguments.file)?;
    let refused = keep_what_is_more_than_its_error(&mut model);
    let mut board = BoardCorrection::of(&model, SENS_AVG).map_err(|error| {
        miette::miette!(
            help = "docs/wire-format.md lists what the board holds",
            "{}: {error}",
            arguments.file.display()
        )
    })?;
    board.notes.extend(refused);
    match &arguments.out {
        Some(out) => super::write(out, &board.table()),
        None => {
            say!("{}", board.table().trim_end());
            Ok(())
        }
    }
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
        (".params", To::Px4),
    ];
    match endings.iter().find(|(ending, _)| name.ends_with(ending)) {
        Some((_, to)) => Ok(*to),
        None => misused!(
            help = "add `--to`, for example `--to kalibr`; `imu-stand export --help` lists them",
            "{name}: the ending does not say what to write"
        ),
    }
}

fn data(arguments: &Arguments, to: To) -> Result<()> {
    if let Some(beside) = &arguments.beside {
        misused!(
            help = "export them one by one",
            "data are of one capture: {} is a second file",
            beside.display()
        );
    }
    let Some(out) = &arguments.out else {
        misused!(help = "add `--out FILE`", "data are written to a file");
    };
    let is_dash = out.as_os_str() == outputs::DASH;
    if is_dash && to != To::Csv {
        misused!(
            help = "name a file, or take `--to csv`",
            "only text goes to standard output"
        );
    }
    Outputs::beside([&arguments.file]).data("--out", Some(out))?;
    let read = arguments.input.read(&arguments.file)?;
    arguments.input.tell(&arguments.file, &read.record);
    let table = Table::of(&read.record, arguments.raw);
    let written = match to {
        To::Npz => table.write_npz(out),
        To::Parquet => table.write_parquet(out),
        _ if is_dash => return outputs::to_stdout(|mut out| table.csv(&mut out)),
        _ => table.write_csv(out),
    };
    written.map_err(|error| match of_the_system(&error) {
        Some(error) => outputs::failed(out, error),
        None => miette::miette!("{}: {error}", out.display()),
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

/// What the system said, where a form of file failed by it.
fn of_the_system(error: &DataError) -> Option<&std::io::Error> {
    let mut next: Option<&(dyn std::error::Error + 'static)> = Some(error);
    while let Some(error) = next {
        if let Some(said) = error.downcast_ref() {
            return Some(said);
        }
        next = error.source();
    }
    None
}

fn noise(arguments: &Arguments, consumer: Consumer) -> Result<()> {
    let inputs = std::iter::once(&arguments.file).chain(&arguments.beside);
    Outputs::beside(inputs).result("--out", arguments.out.as_ref())?;
    let noise = imu_noise(arguments)?;
    if noise.gyro.is_empty() && noise.acc.is_empty() {
        miette::bail!(
            help = "map the columns and say the units: `--columns gyro_x=gx --units gyro=deg/s,acc=m/s2`",
            "{} has neither gyro nor accelerometer in units of one",
            arguments.file.display()
        );
    }
    let own = match consumer {
        // The filter's rate, which no record of a sensor knows.
        Consumer::Px4 => EKF2_RATE_HZ,
        _ => noise.rate_hz,
    };
    let rate = arguments.at_rate.unwrap_or(own);
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

/// What the files say: of its channels a diagnosis or model where there is one, of accelerometers that it lacks the capture or
/// analysis.
fn imu_noise(arguments: &Arguments) -> Result<ImuNoise> {
    let first = export_source::recognise(&arguments.file)?;
    let Some(beside) = &arguments.beside else {
        return of_one(arguments, &arguments.file, first, None);
    };
    let second = export_source::recognise(beside)?;
    let (after, rest) = match (first.is_after_causes(), second.is_after_causes()) {
        (true, false) => ((&arguments.file, first), (beside, second)),
        (false, true) => ((beside, second), (&arguments.file, first)),
        _ => miette::bail!(
            help = "name a diagnosis or model for the gyros, and a capture or analysis for the accelerometers",
            "{} and {}: two files of one kind",
            arguments.file.display(),
            beside.display()
        ),
    };
    let mut noise = of_one(arguments, after.0, after.1, None)?;
    // Those of a diagnosis are without its causes, so they count before those of an analysis.
    if !noise.acc.is_empty() {
        return Ok(noise);
    }
    let others = of_one(arguments, rest.0, rest.1, Some("acc"))?;
    noise.acc = others.acc;
    noise.remarks.extend(others.remarks);
    Ok(noise)
}

/// What one file says; with `only`, of the channels whose names begin so.
fn of_one(
    arguments: &Arguments,
    path: &Path,
    source: Source,
    only: Option<&str>,
) -> Result<ImuNoise> {
    let is_wanted = |name: &str| only.is_none_or(|start| name.starts_with(start));
    let mut analysis = match source {
        Source::Ready(noise) => return Ok(*noise),
        Source::Analysis(analysis) => *analysis,
        Source::Capture => analyzed(arguments, path, &is_wanted)?,
    };
    analysis.channels.retain(|name, _| is_wanted(name));
    Ok(ImuNoise::of(&analysis))
}

fn analyzed(
    arguments: &Arguments,
    path: &Path,
    is_wanted: &dyn Fn(&str) -> bool,
) -> Result<Analysis> {
    let mut read = arguments.input.read(path)?;
    arguments.input.tell(path, &read.record);
    read.record.channels.retain(|c| is_wanted(&c.name));
    let options = AnalyzeOptions {
        seed: arguments.seed,
        rate_hz: None,
        file: super::name(path),
        ..AnalyzeOptions::default()
    };
    let say = || format!("analyzing {}", options.file);
    let analysis = working(arguments.input.quiet, say, || {
        noise::analyze(&read.record, &options)
    });
    analysis.map_err(super::explain)
}
