//! `imu-stand run`.

mod asked;
mod correct;
mod pose;
mod times;

use std::path::PathBuf;
#[cfg(unix)]
use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use asked::{by_hand, length, longest};
use clap::Args;
use diagnosis::DiagnoseOptions;
use diagnosis::result::Diagnosis;
use imu_stand::capture::{ReadOptions, read_capture};
use imu_stand::report::Subject;
use imu_stand::stand::planted::{
    ACCELEROMETERS, Comparison, GYROS, ON_ITS_WAY_S, Planted, RULE, compare, planted,
};
use imu_stand::stand::{Board, Hidden, Plan, Seeds, Sizes, plan, plan_fitted, run_native};
use imu_stand::text;
use indicatif::{ProgressBar, ProgressStyle};
#[cfg(unix)]
use miette::IntoDiagnostic;
use miette::Result;
use model::record::Record;
use noise::AnalyzeOptions;
use serde::Serialize;
use times::{Held, Span, held, span};
use wire::LinkCounts;

use super::outputs::{self, Outputs};
use super::progress::{beside_bar, working};
use super::{Line, Replicates};

/// What `run` takes.
#[derive(Args)]
pub struct Arguments {
    /// Run the firmware's logic on the host instead of its image on a simulated ATmega16: some hundred times faster
    #[arg(long)]
    native: bool,
    /// The firmware's image, an ELF file
    #[arg(long, value_name = "FILE", default_value = IMAGE, conflicts_with = "native")]
    image: PathBuf,
    /// Show the simulated board as a serial device in real time, for `capture`, `board` and others to work on: nothing
    /// is captured or analyzed here. The stand is as --hide says, and nobody drives its motor
    #[arg(long, conflicts_with_all = ["out", "analysis", "json", "report"])]
    pty: bool,
    /// With --pty: how somebody turns the stand over, as times, s, and what points up: `40:+x,80:-x,120:0.1,0,1`. Each turn
    /// takes 2 s
    #[arg(long, value_name = "TIME:UP,...", value_parser = pose::parse)]
    pose: Option<pose::Poses>,
    /// With --pty: the belt is on, and the table makes so many turns for each turn of the motor; a real one some 0.004
    #[arg(long, value_name = "RATIO", default_value_t = 0.0)]
    belt: f64,
    /// With --pty: somebody holds the motor's stop pressed, FROM,TO in s; may be given again for a later time
    #[arg(long, value_name = "FROM,TO", value_parser = held)]
    stop: Vec<Held>,
    /// Write the traces of the board's pins as a value change dump, to lay beside a logic analyser; needs the image, not
    /// --native
    #[arg(long, value_name = "FILE", conflicts_with_all = ["native", "pty", "correct"])]
    vcd: Option<PathBuf>,
    /// Which part of the run is traced, s from power-on: FROM,TO
    #[arg(long, value_name = "FROM,TO", requires = "vcd", default_value = "0,2", value_parser = span)]
    vcd_span: Span,
    /// What to hide in the stand
    #[arg(long, value_enum, default_value_t = Hidden::Random)]
    hide: Hidden,
    /// Hide nothing, but give the parts the errors of this model file, as `diagnose --model-out` writes it: the
    /// firmware meets the sensors that were fitted
    #[arg(long, value_name = "FILE", conflicts_with = "hide")]
    model: Option<PathBuf>,
    /// Length, s: 60 to 86400; with --pty any
    #[arg(long, default_value_t = 600.0, allow_negative_numbers = true)]
    seconds: f64,
    /// Seed of all that is random: the same seed gives the same run
    #[arg(long, default_value_t = 1, value_parser = super::seed, allow_negative_numbers = true)]
    seed: u64,
    /// Seed of the stand alone, its parts and surroundings: the same one for many runs of one stand
    #[arg(long, value_name = "SEED", value_parser = super::seed, allow_negative_numbers = true)]
    stand_seed: Option<u64>,
    /// Seed of what is hidden, and of the course of the motor
    #[arg(long, value_name = "SEED", value_parser = super::seed, allow_negative_numbers = true)]
    fault_seed: Option<u64>,
    /// Seed of the noise: another one for each run of one stand
    #[arg(long, value_name = "SEED", value_parser = super::seed, allow_negative_numbers = true)]
    noise_seed: Option<u64>,
    /// Close the loop: correct the board by what was found, record the same stand again under another history, and compare.
    /// Beside run.csv it writes run-corrected.csv, the model as run.toml and, of a base that sways, run-sway.csv and
    /// run-corrected-sway.csv
    #[arg(long, conflicts_with_all = ["pty", "model", "analysis", "report", "details"])]
    correct: bool,
    /// Correct by this model file instead of what was found, to see what it is worth now
    #[arg(long, value_name = "FILE")]
    correct_by: Option<PathBuf>,
    /// With --correct: the first record is taken again where its correction would be too unsure, as long as that needs, up to
    /// this length, s; 12 times --seconds if not said
    #[arg(long, value_name = "SECONDS", value_parser = longest)]
    longest: Option<f64>,
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
    #[command(flatten)]
    replicates: Replicates,
    /// Print the details of the diagnosis too: gains, checks that fail, the smallest sizes
    #[arg(long)]
    details: bool,
    /// Print nothing but errors
    #[arg(long, short)]
    quiet: bool,
    // Last: clap gives the heading to all that follows.
    #[command(
        flatten,
        next_help_heading = "Close the loop on a real board, which stands still, with the belt off"
    )]
    line: Line,
}

/// Where `cargo xtask image` puts it.
pub const IMAGE: &str = "target/avr/avr-none/firmware/firmware.elf";

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    if arguments.line.is_named() && !arguments.correct {
        misused!(
            help = "`imu-stand capture --port` records a real board; `run --correct --port` closes the loop on it",
            "--port goes with --correct"
        );
    }
    if arguments.pty {
        let board = board(arguments)?;
        if arguments.seconds.is_nan() || arguments.seconds <= 0.0 {
            misused!(
                help = "say for how many seconds the board is served: `--seconds 600`",
                "--seconds: {} is no length",
                arguments.seconds
            );
        }
        #[cfg(unix)]
        return serve(board, arguments);
        #[cfg(not(unix))]
        miette::bail!("this system has no pseudo-terminals: --pty works on Linux and macOS");
    }
    by_hand(arguments)?;
    length(arguments.seconds)?;
    if arguments.out.as_os_str() == outputs::DASH {
        misused!(
            help = "write `--out run.csv`",
            "--out: the run is read again from its file, and standard output is none"
        );
    }
    if arguments.correct {
        return correct::run(arguments, progress(arguments));
    }
    let Span(_, traced) = arguments.vcd_span;
    if arguments.vcd.is_some() && traced > arguments.seconds {
        misused!(
            help = "trace a part of the run, or take a longer one by --seconds",
            "--vcd-span ends at {traced} s, and the run at {} s",
            arguments.seconds
        );
    }
    let board = board(arguments)?;
    Outputs::beside(&arguments.model)
        .simulated("--out", Some(&arguments.out))?
        .result("--analysis", arguments.analysis.as_ref())?
        .result("--json", arguments.json.as_ref())?
        .page("--report", arguments.report.as_ref())?
        .result("--vcd", arguments.vcd.as_ref())?;
    let plan = planned(arguments)?;
    let bar = progress(arguments);
    let say = || {
        let at = bar.position();
        format!("the stand is at {at} of {} s", arguments.seconds)
    };
    let (mut record, link) = beside_bar(arguments.quiet, say, || {
        sample(arguments, &board, &plan, |time| {
            bar.set_position(time as u64);
        })
    })?;
    bar.finish_and_clear();
    outputs::mark_simulated(&mut record, "run");
    outputs::write_record(&arguments.out, &record)?;

    let found = answered(arguments, &plan, &record)?;
    if arguments.quiet {
        return Ok(());
    }
    show(arguments, &record, &link, &found);
    Ok(())
}

/// What was recorded, found and planted.
fn show(arguments: &Arguments, record: &Record, link: &LinkCounts, found: &Answer) {
    say!(
        "{}: {} samples, {}",
        arguments.out.display(),
        record.len(),
        text::link(link)
    );
    say!("{}", found.screen.trim_end());
    match arguments.details {
        true => say!("{}", text::details(&found.diagnosis).trim_end()),
        false => say!("{}", text::MORE),
    }
    let lines = found.comparison.lines();
    say!("\nplanted and found\n{}", text::item("", RULE));
    // One line each, not wrapped.
    lines.iter().for_each(|line| say!("    {line}"));
    if let Some(page) = &arguments.report {
        say!("report: {}", page.display());
    }
    if let Some(traces) = &arguments.vcd {
        let Span(from, to) = arguments.vcd_span;
        say!(
            "traces of the pins from {from} to {to} s: {}",
            traces.display()
        );
    }
}

/// How far the stand is.
fn progress(arguments: &Arguments) -> ProgressBar {
    let bar = if arguments.quiet {
        ProgressBar::hidden()
    } else {
        ProgressBar::new(arguments.seconds as u64)
    };
    let style = ProgressStyle::with_template("stand {bar:40} {pos}/{len} s");
    bar.with_style(style.unwrap_or(ProgressStyle::default_bar()))
}

/// What the program says of a run, and what was planted in it: as `--json` writes it.
#[derive(Serialize)]
struct Answer {
    #[serde(flatten)]
    diagnosis: Diagnosis,
    #[serde(rename = "planted")]
    comparison: Comparison,
    /// What a terminal shows of it.
    #[serde(skip)]
    screen: String,
}

/// Analyzes and diagnoses the capture that was written, and writes what was asked for.
fn answered(arguments: &Arguments, plan: &Plan, record: &Record) -> Result<Answer> {
    // The engine gets the capture as it was written, and nothing else.
    let read = read_capture(&arguments.out, &ReadOptions::default())?;
    let file = super::name(&arguments.out);
    let options = AnalyzeOptions {
        seed: arguments.seed,
        file: file.clone(),
        ..AnalyzeOptions::default()
    };
    let say = || format!("analyzing {file}");
    let analysis = working(arguments.quiet, say, || {
        noise::analyze(&read.record, &options)
    });
    let analysis = analysis.map_err(super::explain)?;
    super::write_json(arguments.analysis.as_ref(), &analysis)?;
    let hash = super::digest(&arguments.out)?;
    let options = DiagnoseOptions {
        seed: arguments.seed,
        file,
        hash: Some(hash.clone()),
        no_evidence: arguments.report.is_none(),
        replicates: arguments.replicates.count(),
        matters: arguments.replicates.matters(),
    };
    let times = record.host_time_s.as_ref();
    let first_s = times.and_then(|times| times.first());
    let start_s = first_s.map_or(0.0, |t| t - ON_ITS_WAY_S);
    let hidden = planted(&plan.run, start_s);
    let say = || format!("diagnosing {}", options.file);
    let found = working(arguments.quiet, say, || {
        if felt_by_accelerometers(&hidden) {
            let all = GYROS.into_iter().chain(ACCELEROMETERS).map(str::to_owned);
            diagnosis::diagnose_channels(&read.record, &all.collect::<Vec<_>>(), &options)
        } else {
            diagnosis::diagnose(&read.record, &options)
        }
    });
    let found = found.map_err(super::explain)?;
    let comparison = compare(&hidden, &found.diagnosis);
    let answer = Answer {
        screen: text::diagnosis(&found, read.record.header.base),
        diagnosis: found.diagnosis.clone(),
        comparison,
    };
    super::write_json(arguments.json.as_ref(), &answer)?;
    if let Some(page) = &arguments.report {
        let hidden = format!("{}\n({RULE}.)", answer.comparison.lines().join("\n"));
        let subject = Subject {
            record: &read.record,
            diagnosed: &found,
            rate_hz: None,
            command: &super::report::command(),
            seed: arguments.seed,
            hash: Some(&hash),
            hidden: Some(&hidden),
        };
        super::report::write(page, &subject, true)?;
    }
    Ok(answer)
}

/// Whether what is planted shows in the accelerometers, which are diagnosed then.
fn felt_by_accelerometers(hidden: &[Planted]) -> bool {
    let felt = |p: &Planted| p.cause == "shock" || p.channels.iter().any(|c| c.starts_with("acc"));
    hidden.iter().any(felt)
}

fn seeds(arguments: &Arguments) -> Seeds {
    let or_all = |seed: Option<u64>| seed.unwrap_or(arguments.seed);
    Seeds {
        stand: or_all(arguments.stand_seed),
        fault: or_all(arguments.fault_seed),
        noise: or_all(arguments.noise_seed),
    }
}

/// What was asked for: a fault, or the parts of a model file.
fn planned(arguments: &Arguments) -> Result<Plan> {
    let seconds = arguments.seconds;
    let seeds = seeds(arguments);
    let Some(path) = &arguments.model else {
        return Ok(plan(arguments.hide, Sizes::Visible, seconds, seeds));
    };
    let model = super::read_model(path)?;
    let (plan, carried) = plan_fitted(&model, seconds, seeds).map_err(|error| {
        miette::miette!(
            help = "`imu-stand simulate --model` makes a capture of any model",
            "{}: {error}",
            path.display()
        )
    })?;
    for what in carried.not.iter().filter(|_| !arguments.quiet) {
        warn!("warning: not on the stand: {what}");
    }
    Ok(plan)
}

#[cfg(unix)]
fn serve(board: Board, arguments: &Arguments) -> Result<()> {
    use imu_stand::pty::{self, Line, PtyError};
    let mut plan = planned(arguments)?;
    // Whoever opens the port drives the motor.
    plan.run.requests.clear();
    let scenario = &mut plan.run.scenario;
    scenario.base.poses = arguments
        .pose
        .iter()
        .flat_map(|poses| poses.0.clone())
        .collect();
    scenario.motor.table_ratio = arguments.belt;
    scenario.stop_pressed = arguments.stop.iter().map(|held| held.0).collect();
    scenario.stop_pressed.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).into_diagnostic()?;
    let (line, name) = Line::open().into_diagnostic()?;
    say!(
        "the board is at {name} for {} s, in real time; Ctrl-C ends it",
        arguments.seconds
    );
    say!("  imu-stand capture --port {name} --out capture.csv");
    match pty::serve(line, &board, &plan.run, &stop) {
        #[cfg(feature = "simavr")]
        Err(PtyError::Image(error)) => Err(image_error(error)),
        other => other.map_err(|error: PtyError| miette::Report::msg(error)),
    }
}

#[cfg(feature = "simavr")]
fn board(arguments: &Arguments) -> Result<Board> {
    if arguments.native {
        return Ok(Board::Native);
    }
    let file = &arguments.image;
    let image = std::fs::read(file).map_err(|error| {
        miette::miette!(
            help = "`cargo xtask image` builds it; `--image FILE` takes another; `--native` runs without",
            "{}: {error}",
            file.display()
        )
    })?;
    Ok(Board::Image(image))
}

#[cfg(not(feature = "simavr"))]
fn board(arguments: &Arguments) -> Result<Board> {
    if !arguments.native {
        miette::bail!(
            help = "`cargo build --release -p imu-stand --features simavr` builds it in (`cargo xtask demo` does so); `imu-stand run --native` runs the firmware's own logic on the host, on the same simulated stand",
            "this build has no simulated ATmega16 to run {}",
            arguments.image.display()
        );
    }
    Ok(Board::Native)
}

fn sample(
    arguments: &Arguments,
    board: &Board,
    plan: &Plan,
    progress: impl FnMut(f64),
) -> Result<(Record, wire::LinkCounts)> {
    // Without the simulated ATmega16 there is no image, and clap has refused the two options that want one.
    let _ = arguments;
    match board {
        Board::Native => Ok(run_native(plan, progress)),
        #[cfg(feature = "simavr")]
        Board::Image(image) => match &arguments.vcd {
            None => imu_stand::stand::run_image(plan, image, progress).map_err(image_error),
            Some(path) => {
                let Span(from, to) = arguments.vcd_span;
                let traced = imu_stand::stand::run_image_traced(plan, image, [from, to], progress);
                let (record, link, text) = traced.map_err(image_error)?;
                super::write(path, &text)?;
                Ok((record, link))
            }
        },
    }
}

/// What to do about an image that does not load or stops.
#[cfg(feature = "simavr")]
pub fn image_error(error: bench::simavr::SimavrError) -> miette::Report {
    use bench::simavr::SimavrError;
    let help = match error {
        SimavrError::Image(_) => "`cargo xtask image` builds one: give the .elf, not the .hex",
        _ => {
            "the image is at fault, not the stand: `cargo xtask test` checks the one of this source"
        }
    };
    miette::miette!(help = help, "{error}")
}
