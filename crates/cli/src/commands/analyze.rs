//! `imu-stand analyze`.

use std::path::PathBuf;

use analysis::AnalyzeOptions;
use analysis::analyze::{Analysis, ChannelAnalysis, NoiseParameters};
use clap::Args;
use imu_stand::report::plot::number;
use imu_stand::text;
use miette::Result;

use super::{Input, Outputs};

/// What `analyze` takes.
#[derive(Args)]
pub struct Arguments {
    /// The capture: .csv, .csv.gz, .npz, .npy, .parquet, .mat, .h5, .txt
    capture: PathBuf,
    #[command(flatten)]
    input: Input,
    /// Deviations to compute: oadev,mdev,...
    #[arg(long, value_delimiter = ',', default_value = "oadev")]
    deviations: Vec<String>,
    /// Cluster times: octave, decade, all or log:N
    #[arg(long, default_value = "octave")]
    taus: String,
    /// Only these channels: gyro_x,acc_z,...
    #[arg(long, value_delimiter = ',')]
    channels: Option<Vec<String>>,
    /// Seed of the replicates behind intervals
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Write the result as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    Outputs::beside([&arguments.capture]).result("--json", arguments.json.as_ref())?;
    let read = arguments.input.read(&arguments.capture)?;
    let deviations = arguments
        .deviations
        .iter()
        .map(|name| name.parse().map_err(super::explain));
    let options = AnalyzeOptions {
        deviations: deviations.collect::<Result<_>>()?,
        taus: arguments.taus.parse().map_err(super::explain)?,
        channels: arguments.channels.clone(),
        rate_hz: arguments.input.rate,
        seed: arguments.seed,
        file: super::name(&arguments.capture),
    };
    let analysis = analysis::analyze(&read.record, &options).map_err(super::explain)?;
    super::write_json(arguments.json.as_ref(), &analysis)?;
    if !arguments.input.quiet {
        print(&analysis);
    }
    Ok(())
}

fn print(analysis: &Analysis) {
    // Gyros first: they are what the stand is for.
    let gyros =
        |is: bool| move |(name, _): &(&String, &ChannelAnalysis)| name.starts_with("gyro") == is;
    let all = || analysis.channels.iter();
    let mut notes: Vec<(&str, Vec<&str>)> = Vec::new();
    for (name, channel) in all().filter(gyros(true)).chain(all().filter(gyros(false))) {
        say!("{name}");
        parameters(&channel.parameters);
        for warning in &channel.warnings {
            say!("{}", text::item("warning: ", warning));
        }
        say!("  by the paper's procedure");
        interval("angle random walk", &channel.paper.angle_random_walk);
        interval(
            "in-run bias stability",
            &channel.paper.in_run_bias_stability,
        );
        for note in &channel.paper.notes {
            match notes.iter_mut().find(|(known, _)| known == note) {
                Some((_, channels)) => channels.push(name),
                None => notes.push((note, vec![name])),
            }
        }
        if let Some(last) = channel.angle.as_ref().and_then(|a| a.points.last())
            && let Some(angle) = &channel.angle
        {
            say!(
                "  angle {} s after {} s of calibration: {} {}, expected {} +- {}",
                number(last.t_s, 4),
                number(angle.calibration_s, 3),
                number(last.angle, 3),
                angle.unit,
                number(last.expected, 3),
                number(last.sigma, 3)
            );
        }
        for (deviation, points) in &channel.deviations {
            let name = format!("{deviation:?}").to_lowercase();
            say!(
                "  {:<28} tau s   deviation  95 % interval",
                format!("{name}, {}", channel.unit)
            );
            for point in points {
                say!(
                    "    {:>29} {:>11} {:>11} .. {}",
                    number(point.tau_s, 4),
                    number(point.deviation, 4),
                    number(point.low, 4),
                    number(point.high, 4)
                );
            }
        }
    }
    if let Some(attitude) = &analysis.attitude
        && let Some(last) = attitude.points.last()
    {
        let [w, x, y, z] = last.quaternion;
        say!(
            "attitude of the three gyros after {} s: {} deg from the start, quaternion ({w:.6}, {x:.6}, {y:.6}, {z:.6})",
            number(last.t_s, 4),
            number(last.angle_deg, 3)
        );
    }
    if !notes.is_empty() {
        say!("\non the paper's procedure");
    }
    for (note, channels) in notes {
        say!(
            "{}",
            text::item(&format!("{}: ", channels.join(", ")), note)
        );
    }
}

/// N, B, K, R and Q, a line each.
pub fn parameters(p: &NoiseParameters) {
    interval("N angle random walk", &p.angle_random_walk);
    interval("B bias instability", &p.bias_instability);
    interval("K rate random walk", &p.rate_random_walk);
    interval("R rate ramp", &p.rate_ramp);
    interval("Q quantization noise", &p.quantization_noise);
}

fn interval(name: &str, interval: &analysis::analyze::Interval) {
    let shown = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| number(v, 4));
    match interval.value {
        Some(value) => say!(
            "  {name:<24} {:>10} [{} .. {}] {}",
            number(value, 4),
            shown(interval.low),
            shown(interval.high),
            interval.unit
        ),
        None => say!(
            "  {name:<24} not established; at most {} {}",
            shown(interval.high),
            interval.unit
        ),
    }
}
