//! `imu-stand plan`.

use std::path::PathBuf;

use clap::{ArgGroup, Args};
use imu_stand::plan::{
    Noise, Plan, Request, SEQUENCES, Told, Z_95, lengths, of_model, of_record, plan,
};
use imu_stand::report::plot::{number, tidy};
use imu_stand::text;
use miette::Result;
use model::ModelFile;
use noise::discriminate::TOLD_APART;
use noise::plan::{Letter, expected};

use super::{Input, Outputs};

/// What `plan` takes.
#[derive(Args)]
#[command(group(ArgGroup::new("answer").required(true).multiple(true).args(["want", "separate"])))]
pub struct Arguments {
    /// A capture whose noise is the present knowledge; without it and without --model the paper's figures
    capture: Option<PathBuf>,
    /// A model file instead of a capture
    #[arg(long, value_name = "FILE", conflicts_with = "capture")]
    model: Option<PathBuf>,
    /// How well something is wanted, 95 %: `"K within 20 %"` (of N, B, K, Q, R) or `"angle within 2 deg after 600 s"`;
    /// several separated by commas
    #[arg(long, value_name = "TERM within X %", value_parser = want)]
    want: Option<String>,
    /// Two causes to be told apart: `temperature,rate_ramp`
    #[arg(long, value_name = "CAUSE,CAUSE", value_parser = separate)]
    separate: Option<String>,
    /// The gyro, where there are several
    #[arg(long, value_name = "NAME")]
    channel: Option<String>,
    /// Simulate so many records as long as planned, and count how many keep the promise of --want; without it 40 (400 of an
    /// angle) where that takes seconds; 0 for none
    #[arg(long, value_name = "RECORDS")]
    check: Option<usize>,
    /// Seed of the check
    #[arg(long, default_value_t = 0, value_parser = super::seed, allow_negative_numbers = true)]
    seed: u64,
    /// Write the plan as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    input: Input,
}

/// A wish that is understood.
fn want(text: &str) -> std::result::Result<String, String> {
    let want = Some(text);
    understood(
        text,
        &Request {
            want,
            ..Request::default()
        },
    )
}

/// Two causes that there are.
fn separate(text: &str) -> std::result::Result<String, String> {
    let separate = Some(text);
    understood(
        text,
        &Request {
            separate,
            ..Request::default()
        },
    )
}

fn understood(text: &str, request: &Request<'_>) -> std::result::Result<String, String> {
    match request.check_words() {
        Ok(()) => Ok(text.to_owned()),
        Err(error) => {
            // Which option it is, clap says.
            let what = error.to_string();
            let what = what
                .split_once(": ")
                .map_or(what.as_str(), |(_, what)| what);
            let help = error.help();
            let help = help.map_or_else(String::new, |help| format!("; {help}"));
            Err(format!("{what}{help}"))
        }
    }
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    Outputs::beside(arguments.capture.iter().chain(&arguments.model))
        .result("--json", arguments.json.as_ref())?;
    let request = Request {
        want: arguments.want.as_deref(),
        separate: arguments.separate.as_deref(),
        check: arguments.check,
        seed: arguments.seed,
    };
    request.check_any()?;
    let noise = noise(arguments)?;
    let quiet = arguments.input.quiet;
    let plan = plan(noise, &request)?;
    super::write_json(arguments.json.as_ref(), &plan)?;
    if !quiet {
        print_noise(&plan.noise);
        for angle in &plan.angle {
            say!("{}", angle.sentence());
        }
        if request.want.is_some() {
            print_want(&plan, arguments.check == Some(0));
        }
        if request.separate.is_some() {
            print_separate(&plan.separate);
        }
    }
    Ok(())
}

fn print_noise(noise: &Noise) {
    let or_none = |value: f64, text: String| {
        if value > 0.0 {
            text
        } else {
            "none known".to_owned()
        }
    };
    say!(
        "noise  N {} deg/sqrt(h), B {}, K {}, {} Hz, from {}",
        number(noise.n * 60.0, 4),
        or_none(noise.b, format!("{} deg/h", number(noise.b * 3600.0, 3))),
        or_none(noise.k, format!("{:.2e} deg/s/sqrt(s)", noise.k)),
        tidy(noise.rate_hz, 6),
        noise.from
    );
    for note in &noise.notes {
        say!("{}", text::item("", note));
    }
}

/// What is known of the noise: of a capture, a model file, or the paper's.
fn noise(arguments: &Arguments) -> Result<Noise> {
    let (channel, rate) = (arguments.channel.as_deref(), arguments.input.rate);
    if let Some(path) = &arguments.capture {
        let record = arguments.input.read(path)?.record;
        arguments.input.tell(path, &record);
        return of_record(&record, &super::name(path), channel, rate, arguments.seed);
    }
    match &arguments.model {
        Some(path) => of_model(&super::read_model(path)?, &super::name(path), channel, rate),
        None => of_model(&ModelFile::paper(), "the paper", channel, rate),
    }
}

/// A time for a person.
fn duration(seconds: f64) -> String {
    if seconds < 120.0 {
        format!("{seconds:.0} s")
    } else if seconds < 7200.0 {
        format!("{:.0} min", seconds / 60.0)
    } else if seconds < 48.0 * 3600.0 {
        format!("{:.1} h", seconds / 3600.0)
    } else {
        format!("{:.1} days", seconds / 86_400.0)
    }
}

fn print_want(plan: &Plan, is_unchecked: bool) {
    for w in &plan.want {
        let [slower, faster] = w.seconds_at;
        if let Some(limit) = w.if_as_large_as {
            say!(
                "{} is not established: were it as large as its limit, {limit:.2e} (deg, s), then",
                w.term
            );
        }
        say!(
            "{} within {} % (95 %)  record {} at {} Hz ({:.0} s); by the information alone {} at {} Hz, {} at {} Hz",
            w.term,
            w.within_percent,
            duration(w.seconds),
            tidy(plan.noise.rate_hz, 6),
            w.seconds.ceil(),
            duration(slower.1),
            tidy(slower.0, 6),
            duration(faster.1),
            tidy(faster.0, 6)
        );
        match w.checked_share {
            Some(share) => say!(
                "    checked: {:.1} % of simulated records of that length are within it{}",
                100.0 * share,
                w.fisher_share
                    .filter(|_| w.seconds > w.fisher_seconds)
                    .map_or_else(String::new, |first| format!(
                        "; of the {} that the Fisher information asks for {:.1} %, for a record has to tell which terms there \
                         are as well",
                        duration(w.fisher_seconds),
                        100.0 * first
                    ))
            ),
            None if is_unchecked => {}
            None => {
                say!(
                    "    not checked: so long a record takes its time to simulate; `--check 20` does"
                );
            }
        }
    }
    print_lengths(plan);
}

/// What records of some lengths tell.
fn print_lengths(plan: &Plan) {
    say!("half of the 95 % interval, by the length of the record:");
    let mut lengths = vec![600.0, 3600.0, 8.0 * 3600.0, 24.0 * 3600.0];
    lengths.extend(plan.want.iter().map(|w| w.seconds));
    lengths.sort_by(f64::total_cmp);
    for seconds in lengths {
        let e = expected(&plan.noise.known(), plan.noise.rate_hz, seconds);
        let parts = Letter::ALL.into_iter().filter_map(|letter| {
            let relative = e.of(letter)?;
            // Beyond this the symmetric interval means nothing: the term is not established.
            Some(if Z_95 * relative > 1.0 {
                format!("{} not established", letter.name())
            } else {
                format!("{} +- {:.2} %", letter.name(), 100.0 * Z_95 * relative)
            })
        });
        let line: String = parts.map(|part| format!("{part:<20}")).collect();
        say!("    {:>9}  {}", duration(seconds), line.trim_end());
    }
}

/// Prints them.
fn print_separate(separate: &[Told]) {
    for direction in separate.chunk_by(|a, b| a.cause == b.cause) {
        print_direction(direction);
    }
    let sequence = separate.iter().find_map(|told| {
        let name = told.sequence?;
        SEQUENCES.iter().find(|sequence| sequence.name == name)
    });
    if let Some(sequence) = sequence {
        say!(
            "{}",
            text::item(
                "    ",
                &format!(
                    "or `imu-stand board calibrate {}` ({}): it moves what the one of them follows and not what the other does",
                    sequence.name, sequence.what
                )
            )
        );
    }
    say!(
        "sizes are {TOLD_APART} standard errors; a random walk fitted beside it takes a part of that"
    );
}

/// What tells a cause from its rival, excitation by excitation.
fn print_direction(direction: &[Told]) {
    let (cause, rival) = (&direction[0].cause, &direction[0].rival);
    let Some(told) = direction.iter().find(|t| !t.sizes.is_empty()) else {
        let why = direction.iter().find_map(|t| t.why.as_deref());
        say!(
            "{cause} against {rival}: {}",
            why.unwrap_or("nothing moves")
        );
        return;
    };
    say!(
        "{cause} against {rival}: smallest {}, {}, by the length of the record",
        told.parameter,
        told.unit
    );
    row("", lengths().into_iter().map(duration));
    for told in direction {
        say!("  {}", told.excitation);
        if told.sizes.is_empty() {
            let why = told.why.as_deref().unwrap_or("nothing moves");
            say!("    {why}");
            continue;
        }
        let size = |size: f64| match size.is_finite() {
            true => format!("{size:.2e}"),
            false => "never".to_owned(),
        };
        row("is seen", told.sizes.iter().map(|(_, s, _)| size(*s)));
        let apart = format!("is no {rival}");
        row(&apart, told.sizes.iter().map(|(_, _, s)| size(*s)));
    }
    let first = |t: &&Told| t.sizes.first().map_or(f64::INFINITY, |s| s.2);
    if let Some(best) = direction
        .iter()
        .min_by(|a, b| first(a).total_cmp(&first(b)))
        .filter(|t| first(t).is_finite())
    {
        say!("  the best of these: {}", best.excitation);
    }
}

/// A row of a table of sizes, its name and a cell for each length of the record.
fn row(name: &str, cells: impl Iterator<Item = String>) {
    let cells: String = cells.map(|cell| format!("  {cell:>8}")).collect();
    say!("    {name:<24}{cells}");
}
