//! The narrow path back: bias and scale that a diagnosis or a model found, written to the board.

use std::path::{Path, PathBuf};

use clap::Args;
use diagnosis::result::{DIAGNOSIS_FORMAT, Diagnosis};
use imu_stand::link::LinkError;
use miette::{IntoDiagnostic, Result, WrapErr};
use model::Parameter;
use model::file::ModelFile;
use serde::Serialize;
use wire::{Axis, Command, Hello};

use super::Session;
use super::set::fixed;
use super::show::{Q16, Q24, gyro_range_dps};

/// What `calibrate` takes.
#[derive(Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Arguments {
    #[command(subcommand)]
    pub(super) sequence: Option<super::sequence::Sequence>,
    /// A diagnosis (`diagnose --json`) or a model file (`diagnose --model-out`)
    #[arg(required = true)]
    pub(super) file: Option<PathBuf>,
    /// Say what would be written, and write nothing; needs no board
    #[arg(long)]
    pub dry_run: bool,
    /// Keep it over resets
    #[arg(long)]
    store: bool,
    /// Write it although the bias is not established, or looks like a rotation
    #[arg(long)]
    force: bool,
}

impl Arguments {
    /// The file that is read.
    pub(super) fn reads(&self) -> Option<&PathBuf> {
        match &self.sequence {
            Some(sequence) => sequence.reads(),
            None => self.file.as_ref(),
        }
    }

    /// The file that is written to the board; without a sequence there is one.
    pub(super) fn file(&self) -> Result<&PathBuf> {
        self.file.as_ref().ok_or_else(|| {
            miette::miette!(
                code = super::super::usage::CODE,
                help = "write `board calibrate diagnosis.json`, or name a sequence: six-position, turns, heater",
                "no file to calibrate by"
            )
        })
    }
}

/// What a file says of one gyro.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
struct Of {
    #[serde(skip_serializing_if = "Option::is_none")]
    bias_dps: Option<Parameter>,
    /// Reading over truth, minus 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    scale_error: Option<Parameter>,
}

/// What a file says, by axis.
type Calibration = [Of; 3];

/// Largest bias that a gyro at rest has, deg/s; the board's own bias null draws the line there too.
const LARGEST_BIAS_DPS: f64 = 5.0;
const NAMES: [&str; 3] = ["gyro_x", "gyro_y", "gyro_z"];
const AXES: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

/// Causes that make a constant bias a fiction: it is one moment's value.
const MOVING_BIAS: [&str; 5] = [
    "temperature",
    "temperature_quadratic",
    "warm_up",
    "rate_ramp",
    "bias_step",
];

#[derive(Serialize)]
struct Answer<'a> {
    format: &'static str,
    from: String,
    calibration: &'a Calibration,
    notes: &'a [String],
    written: Vec<Written>,
    stored: bool,
}

#[derive(Serialize)]
struct Written {
    axis: &'static str,
    what: &'static str,
    before: f64,
    after: f64,
}

/// Reads a file of either kind.
fn load(path: &Path) -> Result<(Calibration, Vec<String>)> {
    let text = super::super::read_text(path)?;
    let calibration = if text.trim_start().starts_with('{') {
        from_json(&text, path)?
    } else {
        let model = ModelFile::parse(&text).map_err(|error| {
            miette::miette!(
                help = "give a diagnosis as JSON or a model file (docs/model-file.md)",
                "{}: {error}",
                path.display()
            )
        })?;
        from_model(&model)
    };
    if calibration.0.iter().all(|of| *of == Of::default()) {
        miette::bail!(
            help = "channels have to be named gyro_x, gyro_y, gyro_z, in deg/s",
            "{} holds neither bias nor scale of a gyro",
            path.display()
        );
    }
    Ok(calibration)
}

fn from_json(text: &str, path: &Path) -> Result<(Calibration, Vec<String>)> {
    let value: serde_json::Value = serde_json::from_str(text)
        .into_diagnostic()
        .wrap_err_with(|| format!("{} is no JSON", path.display()))?;
    match value.get("format").and_then(serde_json::Value::as_str) {
        Some(DIAGNOSIS_FORMAT) => {}
        Some(noise::analyze::ANALYSIS_FORMAT) => miette::bail!(
            help = "`imu-stand diagnose C --json D`, then `imu-stand board calibrate D`",
            "{} is an analysis: it describes noise, and holds no bias",
            path.display()
        ),
        other => miette::bail!(
            help = "`imu-stand diagnose C --json D` writes one",
            "{}: the format is `{}`, expected `{DIAGNOSIS_FORMAT}`",
            path.display(),
            other.unwrap_or("missing")
        ),
    }
    let diagnosis: Diagnosis = serde_json::from_value(value)
        .into_diagnostic()
        .wrap_err_with(|| format!("{} is no diagnosis", path.display()))?;
    let bias = |name: &str| diagnosis.baseline.get(name)?.get("bias").cloned();
    let effects = diagnosis.findings.iter().map(|f| {
        let of = |name: &str| {
            (f.per_channel.get(name).or(Some(&f.parameters)))
                .filter(|_| f.channels.iter().any(|c| c == name))
                .and_then(|parameters| parameters.get("relative").cloned())
        };
        (f.cause.as_str(), f.channels.clone(), NAMES.map(of))
    });
    Ok(assemble(bias, effects))
}

fn from_model(model: &ModelFile) -> (Calibration, Vec<String>) {
    let bias = |name: &str| {
        let channel = model.channels.iter().find(|c| c.name == name)?;
        channel.baseline.get("bias").cloned()
    };
    let effects = model.effects.iter().map(|e| {
        let channels = if e.channels.is_empty() {
            NAMES.map(str::to_owned).to_vec()
        } else {
            e.channels.clone()
        };
        let of = |name: &str| {
            (channels.iter().any(|c| c == name))
                .then(|| e.parameters.get("relative").cloned())
                .flatten()
        };
        let of = NAMES.map(of);
        (e.cause.as_str(), channels, of)
    });
    assemble(bias, effects)
}

fn assemble<'a>(
    bias: impl Fn(&str) -> Option<Parameter>,
    effects: impl Iterator<Item = (&'a str, Vec<String>, [Option<Parameter>; 3])>,
) -> (Calibration, Vec<String>) {
    let mut out = NAMES.map(|name| Of {
        bias_dps: bias(name).filter(|p| p.value.is_finite()),
        scale_error: None,
    });
    let mut notes = Vec::new();
    for (cause, channels, relative) in effects {
        if cause == "scale_error" {
            for (of, relative) in out.iter_mut().zip(relative) {
                of.scale_error = relative.or(of.scale_error.take());
            }
        } else if MOVING_BIAS.contains(&cause) {
            notes.push(format!(
                "{cause} moves the bias of {}: a constant bias holds for the conditions of that record alone",
                channels.join(", ")
            ));
        }
    }
    (out, notes)
}

/// Values that must not be written without a word.
fn doubts(calibration: &Calibration) -> Vec<String> {
    let mut out = Vec::new();
    for (of, name) in calibration.iter().zip(NAMES) {
        if let Some(bias) = &of.bias_dps {
            if bias.value.abs() > LARGEST_BIAS_DPS {
                out.push(format!(
                    "the bias of {name} is {:.3} deg/s: more than {LARGEST_BIAS_DPS} deg/s is a rotation",
                    bias.value
                ));
            }
            if bias
                .std_error
                .is_some_and(|e| e > bias.value.abs().max(0.05))
            {
                out.push(format!(
                    "the bias of {name} is {:.4} +- {:.4} deg/s: its error is larger than itself",
                    bias.value,
                    bias.std_error.unwrap_or_default()
                ));
            }
        }
        if let Some(scale) = of.scale_error.as_ref().filter(|s| s.value.abs() > 0.2) {
            out.push(format!(
                "the scale of {name} is said to be wrong by {:.1} %: that is a wrong range, not a tolerance",
                scale.value * 100.0
            ));
        }
    }
    out
}

fn describe(calibration: &Calibration, notes: &[String]) {
    let number = |p: &Option<Parameter>| {
        p.as_ref().map_or_else(
            || "-".to_owned(),
            |p| match p.std_error {
                Some(error) => format!("{:.5} +- {error:.5}", p.value),
                None => format!("{:.5}", p.value),
            },
        )
    };
    say!("         {:<24} scale error", "bias deg/s");
    for (of, name) in calibration.iter().zip(NAMES) {
        say!(
            "{name}   {:<24} {}",
            number(&of.bias_dps),
            number(&of.scale_error)
        );
    }
    for note in notes {
        say!("{}", imu_stand::text::item("note: ", note));
    }
}

/// Says what would be written; needs no board.
pub fn dry_run(arguments: &Arguments, quiet: bool, json: Option<&PathBuf>) -> Result<()> {
    let (calibration, mut notes) = load(arguments.file()?)?;
    notes.extend(doubts(&calibration));
    if !quiet {
        describe(&calibration, &notes);
        say!("nothing is written (--dry-run)");
    }
    let answer = Answer {
        format: "imu-stand-calibration/1",
        from: super::super::name(arguments.file()?),
        calibration: &calibration,
        notes: &notes,
        written: vec![],
        stored: false,
    };
    super::super::write_json(json, &answer)
}

/// The commands that write a calibration to a board that is set as `hello` says.
fn commands(calibration: &Calibration, hello: &Hello) -> Result<Vec<(usize, Command)>> {
    let mut out = Vec::new();
    let nominal = gyro_range_dps(hello.gyro_range).map(|range| {
        // 0.07326 deg/s for each count at 320 deg/s (data sheet).
        0.073_26 * range / 320.0
    });
    for (k, (of, axis)) in calibration.iter().zip(AXES).enumerate() {
        let relative = of.scale_error.as_ref().map_or(0.0, |s| s.value);
        if of.scale_error.is_some() {
            let Some(nominal) = nominal else {
                miette::bail!(
                    help = "`imu-stand board set gyro --range 320`",
                    "the board says a gyro range that the part does not have"
                );
            };
            out.push((
                k,
                Command::SetScale {
                    axis,
                    value: fixed(nominal / (1.0 + relative), Q24, "scale")?,
                },
            ));
        }
        if let Some(bias) = &of.bias_dps {
            // The record was scaled with the nominal factor; the board subtracts after its own.
            out.push((
                k,
                Command::SetBias {
                    axis,
                    value: fixed(bias.value / (1.0 + relative), Q16, "bias")?,
                },
            ));
        }
    }
    Ok(out)
}

pub fn run(session: &mut Session, arguments: &Arguments) -> Result<()> {
    let (calibration, notes) = load(arguments.file()?)?;
    let doubts = doubts(&calibration);
    if !doubts.is_empty() && !arguments.force && !arguments.dry_run {
        miette::bail!(
            help = "record at rest and for longer, or add `--force` if you know better",
            "not written: {}",
            doubts.join("; ")
        );
    }
    let before = session.link.ask_hello()?;
    let commands = commands(&calibration, &before)?;
    if !session.quiet {
        describe(&calibration, &notes);
    }
    let mut written = Vec::new();
    if !arguments.dry_run {
        for (_, command) in &commands {
            session.link.ask(*command)?;
        }
        let after = session.link.ask_hello()?;
        for (k, command) in &commands {
            written.push(verify(*k, *command, &before, &after)?);
        }
        if arguments.store {
            session.link.ask(Command::StoreConfig)?;
        }
    }
    if !session.quiet {
        for line in &written {
            say!(
                "{} {:<5} {:.7} -> {:.7}",
                line.axis,
                line.what,
                line.before,
                line.after
            );
        }
        say!(
            "{}",
            match (arguments.dry_run, arguments.store) {
                (true, _) => "nothing is written (--dry-run)",
                (false, true) => "written, read back and stored",
                (false, false) =>
                    "written and read back; until the next reset, `imu-stand board store` keeps it",
            }
        );
    }
    let answer = Answer {
        format: "imu-stand-calibration/1",
        from: super::super::name(arguments.file()?),
        calibration: &calibration,
        notes: &notes,
        written,
        stored: arguments.store && !arguments.dry_run,
    };
    super::super::write_json(session.json.as_ref(), &answer)
}

/// Holds what the board says now against what was written.
fn verify(k: usize, command: Command, before: &Hello, after: &Hello) -> Result<Written> {
    let (what, wanted, is, was, unit) = match command {
        Command::SetBias { value, .. } => ("bias", value, after.bias[k], before.bias[k], Q16),
        Command::SetScale { value, .. } => ("scale", value, after.scale[k], before.scale[k], Q24),
        _ => miette::bail!("only bias and scale are written"),
    };
    if wanted != is {
        return Err(LinkError::NotAsAsked {
            what: format!(
                "{} of {} reads {} after {} was written",
                what,
                NAMES[k],
                f64::from(is) / unit,
                f64::from(wanted) / unit
            ),
            help: "repeat the command; another program may be setting the board at the same time"
                .to_owned(),
        }
        .into());
    }
    Ok(Written {
        axis: NAMES[k],
        what,
        before: f64::from(was) / unit,
        after: f64::from(is) / unit,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_error_goes_into_scale_and_bias() {
        let mut calibration: Calibration = Default::default();
        calibration[1].bias_dps = Some(Parameter::exact(0.51, "deg/s"));
        calibration[1].scale_error = Some(Parameter::exact(0.02, "1"));
        let hello = Hello {
            gyro_range: 4,
            ..Hello::default()
        };
        let commands = commands(&calibration, &hello).unwrap();
        let scale = (0.073_26 / 1.02 * Q24).round() as i32;
        // 0.51 deg/s read with a scale that is 2 % too large are 0.5 deg/s.
        let bias = (0.5 * Q16).round() as i32;
        assert_eq!(
            commands,
            [
                (
                    1,
                    Command::SetScale {
                        axis: Axis::Y,
                        value: scale
                    }
                ),
                (
                    1,
                    Command::SetBias {
                        axis: Axis::Y,
                        value: bias
                    }
                )
            ]
        );
    }

    #[test]
    fn what_cannot_be_a_bias_is_doubted() {
        let mut calibration: Calibration = Default::default();
        calibration[0].bias_dps = Some(Parameter::exact(12.0, "deg/s"));
        assert!(doubts(&calibration)[0].contains("rotation"));
    }
}
