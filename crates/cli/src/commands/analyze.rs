//! `imu-stand analyze`.

use std::path::PathBuf;

use clap::Args;
use imu_stand::export::noise::may_have_causes;
use imu_stand::report::plot::{number, tidy};
use imu_stand::text;
use miette::Result;
use noise::AnalyzeOptions;
use noise::allan::{Deviation, TauGrid};
use noise::analyze::{Analysis, ChannelAnalysis, Interval, NoiseParameters};

use super::progress::working;
use super::{Input, Outputs};

/// What `analyze` takes.
#[derive(Args)]
pub struct Arguments {
    /// The capture: .csv, .csv.gz, .npz, .npy, .parquet, .mat, .h5, .mcap, .bag, .ulg, .txt
    capture: PathBuf,
    #[command(flatten)]
    input: Input,
    /// Deviations to compute: oadev,mdev,...
    #[arg(long, value_delimiter = ',', default_value = "oadev")]
    deviations: Vec<Deviation>,
    /// Cluster times: octave, decade, all or log:N
    #[arg(long, default_value = "octave")]
    taus: TauGrid,
    /// Only these channels: gyro_x,acc_z,...
    #[arg(long, value_delimiter = ',', value_parser = clap::builder::NonEmptyStringValueParser::new())]
    channels: Option<Vec<String>>,
    /// Print what is to be said against the paper's two figures, and against those that are read off the same way, too
    #[arg(long)]
    paper: bool,
    /// Seed of the replicates behind intervals
    #[arg(long, default_value_t = 0, value_parser = super::seed, allow_negative_numbers = true)]
    seed: u64,
    /// Write the result as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    Outputs::beside([&arguments.capture]).result("--json", arguments.json.as_ref())?;
    let read = arguments.input.read(&arguments.capture)?;
    let options = AnalyzeOptions {
        deviations: arguments.deviations.clone(),
        taus: arguments.taus,
        channels: arguments.channels.clone(),
        rate_hz: None,
        seed: arguments.seed,
        file: super::name(&arguments.capture),
    };
    let say = || format!("analyzing {}", options.file);
    let analysis = working(arguments.input.quiet, say, || {
        noise::analyze(&read.record, &options)
    });
    let analysis = analysis.map_err(super::explain)?;
    super::write_json(arguments.json.as_ref(), &analysis)?;
    if !arguments.input.quiet {
        print(&analysis, arguments.paper);
    }
    Ok(())
}

fn print(analysis: &Analysis, with_paper: bool) {
    head(analysis);
    // Gyros first: they are what the stand is for.
    let gyros =
        |is: bool| move |(name, _): &(&String, &ChannelAnalysis)| name.starts_with("gyro") == is;
    let all = || analysis.channels.iter();
    for note in &analysis.input.notes {
        say!("{}", text::item("note: ", note));
    }
    let mut notes: Vec<(&str, Vec<&str>)> = Vec::new();
    for (name, channel) in all().filter(gyros(true)).chain(all().filter(gyros(false))) {
        of_channel(name, channel, &analysis.input.notes);
        for note in &channel.paper.notes {
            match notes.iter_mut().find(|(known, _)| known == note) {
                Some((_, channels)) => channels.push(name),
                None => notes.push((note, vec![name])),
            }
        }
        deviations(channel);
    }
    point_to_diagnosis(analysis);
    attitude(analysis);
    let of = match all().any(|(_, channel)| is_rate(channel)) {
        true => "the paper's procedure",
        false => READ_OFF,
    };
    match (notes.len(), with_paper) {
        (0, _) => return,
        (count, false) => {
            say!("\n--paper: {count} notes on {of}");
            return;
        }
        (_, true) => say!("\non {of}"),
    }
    for (note, channels) in notes {
        say!(
            "{}",
            text::item(&format!("{}: ", channels.join(", ")), note)
        );
    }
}

/// The two figures of a channel that is no gyro: the line of slope -1/2 at 1 s, and the level of the flat part. The paper's
/// procedure is for gyros.
const READ_OFF: &str = "read off the deviations";

/// Whether it is a gyro's rate.
fn is_rate(channel: &ChannelAnalysis) -> bool {
    channel.unit == "deg/s"
}

/// What was analyzed, and how the figures are to be read.
fn head(analysis: &Analysis) {
    let input = &analysis.input;
    let losses = match (input.gaps, input.lost_samples) {
        (0, _) => "no gaps".to_owned(),
        (gaps, lost) => format!("{gaps} gaps, {lost} samples lost"),
    };
    say!(
        "{}: {} s at {} Hz, {} samples, {losses}",
        input.file,
        tidy(input.seconds, 6),
        tidy(input.rate_hz, 6),
        input.samples
    );
    say!("in brackets: 95 % intervals; edf: independent values behind a deviation");
}

/// Parameters, warnings and the paper's figures of a channel, and its angle. What is of the whole record stands above.
fn of_channel(name: &str, channel: &ChannelAnalysis, of_record: &[String]) {
    say!("{name}");
    let known = channel.parameters.angle_random_walk.high.is_some();
    parameters(
        &channel.parameters,
        channel.parameters_hold_from_s.is_some() || !known,
    );
    let is_told = |w: &&String| !of_record.contains(*w);
    for warning in channel.warnings.iter().filter(is_told) {
        say!("{}", text::item("warning: ", warning));
    }
    let rate = is_rate(channel);
    let of = if rate {
        "by the paper's procedure"
    } else {
        READ_OFF
    };
    say!("  {of}");
    interval(
        walk_of_the_integral(&channel.parameters),
        &channel.paper.angle_random_walk,
    );
    // A bias is an inertial sensor's.
    let flat = if rate || is_inertial(&channel.parameters) {
        "in-run bias stability"
    } else {
        "level of the flat part"
    };
    interval(flat, &channel.paper.in_run_bias_stability);
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
}

/// Tables of the deviations of a channel.
fn deviations(channel: &ChannelAnalysis) {
    for (deviation, points) in &channel.deviations {
        // A time deviation has the unit of the integral.
        let unit = if *deviation == Deviation::Tdev {
            channel.parameters.quantization_noise.unit.as_str()
        } else {
            channel.unit.as_str()
        };
        say!(
            "  {:<15}{:>6} {:>10}  {:<21} {:>6}  noise there",
            format!("{}, {unit}", deviation.name()),
            "tau, s",
            "deviation",
            "95 % interval",
            "edf"
        );
        for point in points {
            say!(
                "  {:>21} {:>10}  {:<21} {:>6}  {}",
                number(point.tau_s, 4),
                number(point.deviation, 4),
                format!("{} .. {}", number(point.low, 4), number(point.high, 4)),
                number(point.edf, 3),
                noise(point.noise_alpha)
            );
        }
    }
}

/// Where the three gyros together have turned to.
fn attitude(analysis: &Analysis) {
    if let Some(attitude) = &analysis.attitude
        && let Some(last) = attitude.points.last()
    {
        let [w, x, y, z] = last.quaternion;
        say!(
            "\nattitude of the three gyros after {} s: {} deg from the start{}\n  quaternion ({w:.6}, {x:.6}, {y:.6}, {z:.6})",
            number(last.t_s, 4),
            number(last.angle_deg, 3),
            last.predicted_deg.map_or_else(String::new, |p| format!(
                " (the fits predict {} rms of a stand at rest)",
                number(p, 3)
            ))
        );
    }
}

/// Where the terms stand for something else, or may: who finds out.
fn point_to_diagnosis(analysis: &Analysis) {
    let names = |is: &dyn Fn(&ChannelAnalysis) -> bool| {
        let channels = analysis.channels.iter().filter(|(_, c)| is(c));
        let names: Vec<&str> = channels.map(|(name, _)| name.as_str()).collect();
        names.join(", ")
    };
    let is_other = |c: &ChannelAnalysis| {
        c.parameters.angle_random_walk.high.is_some() && c.parameters_hold_from_s.is_none()
    };
    let others = names(&is_other);
    if !others.is_empty() {
        let what = "the terms do not describe the curve: `imu-stand diagnose` says what is in it";
        say!(
            "\n{}",
            text::item(&format!("{others}: "), what).trim_start()
        );
    }
    let rising = names(&|c| !is_other(c) && may_have_causes(c));
    if !rising.is_empty() {
        let what = "K or R is established, and a cause (temperature, supply, motor) may be behind it: `imu-stand diagnose` \
                    looks for one, and `export` takes its result";
        say!(
            "\n{}",
            text::item(&format!("{rising}: "), what).trim_start()
        );
    }
}

/// Noise by the exponent of its spectral density.
fn noise(alpha: i32) -> &'static str {
    match alpha {
        2.. => "quantization",
        1 => "flicker phase",
        0 => "white",
        -1 => "flicker",
        _ => "random walk",
    }
}

/// What N is called: a gyro's white noise makes the angle walk, an accelerometer's the velocity.
fn walk_of_the_integral(p: &NoiseParameters) -> &'static str {
    if p.angle_random_walk.unit.starts_with("deg") {
        "angle random walk"
    } else if p.angle_random_walk.unit.starts_with("m/s") {
        "velocity random walk"
    } else {
        "white noise"
    }
}

/// Whether it is a gyro or an accelerometer.
fn is_inertial(p: &NoiseParameters) -> bool {
    walk_of_the_integral(p) != "white noise"
}

/// N, B, K, R and Q, a line each, with a mark where the terms do not describe the record.
pub fn parameters(p: &NoiseParameters, hold: bool) {
    let n = walk_of_the_integral(p);
    let (k, r) = match n {
        "angle random walk" => ("K rate random walk", "R rate ramp"),
        "velocity random walk" => ("K accel. random walk", "R accel. ramp"),
        _ => ("K random walk", "R ramp"),
    };
    let mark = if hold { "" } else { "  ?" };
    let line = |name: &str, of: &Interval| marked(name, of, mark);
    line(&format!("N {n}"), &p.angle_random_walk);
    let b = match is_inertial(p) {
        true => "B bias instability",
        false => "B flicker noise",
    };
    line(b, &p.bias_instability);
    line(k, &p.rate_random_walk);
    line(r, &p.rate_ramp);
    line("Q quantization noise", &p.quantization_noise);
    if !hold {
        say!(
            "    ? the terms do not describe this record: no figure or limit with this mark is to be relied on"
        );
    }
}

fn interval(name: &str, interval: &Interval) {
    marked(name, interval, "");
}

fn marked(name: &str, interval: &Interval, mark: &str) {
    let shown = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| number(v, 4));
    match interval.value {
        Some(value) => say!(
            "  {name:<24} {:>10} [{} .. {}] {}{mark}",
            number(value, 4),
            shown(interval.low),
            shown(interval.high),
            interval.unit
        ),
        None => match interval.high {
            Some(high) => say!(
                "  {name:<24} not established; at most {} {}{mark}",
                number(high, 4),
                interval.unit
            ),
            None => say!("  {name:<24} nothing known"),
        },
    }
}
