//! `imu-stand representative`.

use std::path::PathBuf;

use clap::Args;
use imu_stand::report::plot::number;
use imu_stand::text;
use miette::Result;
use model::record::{Quantity, Record};
use noise::Representative;
use serde::Serialize;

use super::{Input, Outputs, many};

/// What `representative` takes.
#[derive(Args)]
pub struct Arguments {
    /// Captures of one stand, four at least, or folders of them: .csv, .csv.gz, .npz, .npy, .parquet, .mat, .h5, .mcap, .bag,
    /// .ulg, .txt
    #[arg(required = true)]
    captures: Vec<PathBuf>,
    #[command(flatten)]
    input: Input,
    /// Seed of whatever is random
    #[arg(long, default_value_t = 0, value_parser = super::seed, allow_negative_numbers = true)]
    seed: u64,
    /// Write the result as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// The answer with the names of the files, by whose index it speaks.
#[derive(Serialize)]
struct Answer<'a> {
    format: &'static str,
    files: Vec<String>,
    #[serde(flatten)]
    found: &'a Representative,
}

/// Runs of which one can be said to represent the others.
const LEAST_RUNS: usize = 4;

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    let captures = many::captures(&arguments.captures)?;
    if captures.len() < LEAST_RUNS && !arguments.captures.iter().any(|path| path.is_dir()) {
        misused!(
            help = "name 4 captures of the same stand at least",
            "a comparison of runs needs {} runs, and {} are named",
            LEAST_RUNS,
            captures.len()
        );
    }
    Outputs::beside(&captures).result("--json", arguments.json.as_ref())?;
    let records = captures
        .iter()
        .map(|path| {
            let record = arguments.input.read(path)?.record;
            arguments.input.tell(path, &record);
            Ok(record)
        })
        .collect::<Result<Vec<_>>>()?;
    for (i, record) in records.iter().enumerate() {
        // Equal to the bit: noise does not repeat itself.
        let same = |other: &Record| {
            record
                .channels
                .iter()
                .filter(|c| {
                    matches!(
                        c.quantity,
                        Quantity::Gyro | Quantity::Other | Quantity::Derived
                    )
                })
                .any(|c| {
                    c.values.len() > 10
                        && other.channel(&c.name).is_some_and(|o| o.values == c.values)
                })
        };
        if let Some(j) = (0..i).find(|j| same(&records[*j])) {
            miette::bail!(
                help = "give each run once; a channel that is copied or stuck has to be left out by --columns",
                "{} and {} have the same readings",
                captures[j].display(),
                captures[i].display()
            );
        }
    }
    let found = noise::representative(&records, arguments.seed).map_err(super::explain)?;
    let files: Vec<String> = captures.iter().map(|p| super::name(p)).collect();
    let answer = Answer {
        format: "imu-stand-representative/1",
        files,
        found: &found,
    };
    super::write_json(arguments.json.as_ref(), &answer)?;
    if !arguments.input.quiet {
        print(&answer.files, &found);
    }
    Ok(())
}

fn print(files: &[String], found: &Representative) {
    say!("representative  {}", files[found.run]);
    if found.odd.is_empty() {
        let limits = format!(
            "(limits: {:.1} spreads from the median, {:.1} from the others' mean)",
            found.limit, found.limit_alone
        );
        say!("{}", text::item("no run stands out ", &limits).trim_start());
    }
    for odd in &found.odd {
        let what = format!(
            "{} of {} is {:.1} spreads from the others (limit {:.1})",
            odd.figure.replace('_', " "),
            odd.channel,
            odd.z,
            odd.limit
        );
        say!(
            "{}",
            text::item(&format!("not {}: ", files[odd.run]), &what)
        );
    }
    over_runs(found);
    together(found);
}

/// Each figure over the runs, and from run to run.
fn over_runs(found: &Representative) {
    say!("over the runs that do not stand out (95 %):");
    for figure in &found.figures {
        let Some(pooled) = figure.over_runs else {
            continue;
        };
        // Sizes scatter in parts of themselves, biases in their unit.
        let (factor, unit) = if figure.figure == "bias" {
            (1.0, figure.unit.as_str())
        } else {
            (100.0, "%")
        };
        let lead = format!("{}, {}: ", figure.channel, figure.figure.replace('_', " "));
        let size = format!(
            "{} ({} .. {}) {}; from run to run {} ({} .. {}) {unit}{}",
            number(pooled.mean, 4),
            number(pooled.mean_low, 4),
            number(pooled.mean_high, 4),
            figure.unit,
            number(factor * pooled.run_to_run, 3),
            number(factor * pooled.run_to_run_low, 3),
            number(factor * pooled.run_to_run_high, 3),
            match figure.differ {
                Some(true) => ", the runs differ",
                Some(false) => ", no more than their errors",
                None => "",
            }
        );
        say!("{}", text::item(&lead, &size));
    }
}

/// Noise of the runs together.
fn together(found: &Representative) {
    if found.together.is_empty() {
        say!("the sample rates differ: no noise parameters of the runs together");
    }
    for together in &found.together {
        say!(
            "\n{}: noise of {} runs together",
            together.channel,
            together.runs
        );
        super::analyze::parameters(
            &together.parameters,
            together.parameters_hold_from_s.is_some(),
        );
        for warning in &together.warnings {
            say!("{}", text::item("warning: ", warning));
        }
    }
}
