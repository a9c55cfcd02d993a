//! `imu-stand paper`: the paper's figures again, and what does not fit in them.

mod criticism;
mod figures;

use std::path::PathBuf;

use clap::Args;
use imu_stand::text;
use miette::{IntoDiagnostic, Result, WrapErr};
use model::file::{ChannelModel, EffectModel, ModelFile};
use model::parameter::Parameter;
use model::record::{Quantity, Record};
use noise::analyze::{Analysis, ChannelAnalysis};
use noise::paper_model::{
    PaperStand, STATED_ARW_DEG_SQRT_H, STATED_FLAT_DEG_H, STATED_RATE_HZ, STATED_SECONDS, Slow,
};
use noise::{AnalyzeOptions, allan::TauGrid};
use serde::Serialize;

use super::{Input, Outputs};
use criticism::{Claim, Hypothesis, LooksAlike};

/// Resolution of the stand's gyro, deg/s.
const LSB_DPS: f64 = 0.07326;

/// What `paper` takes.
#[derive(Args)]
pub struct Arguments {
    /// A record of the stand at rest, in the place of the simulated one
    #[arg(long)]
    capture: Option<PathBuf>,
    /// The gyro that is shown
    #[arg(long, default_value = "gyro_z")]
    channel: String,
    #[command(flatten)]
    input: Input,
    /// Folder for paper.html, the figures as SVG and paper.json
    #[arg(long, default_value = "paper")]
    out: PathBuf,
    /// Simulated records behind each range
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(20..))]
    runs: u32,
    /// Simulated pairs behind the test of what looks alike
    #[arg(long, default_value_t = 40, value_parser = clap::value_parser!(u32).range(5..))]
    draws: u32,
    /// Seed of whatever is random
    #[arg(long, default_value_t = 2009, value_parser = super::seed, allow_negative_numbers = true)]
    seed: u64,
    /// Write the result as JSON to another place as well
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// What the paper states.
#[derive(Serialize)]
struct Stated {
    angle_random_walk_deg_sqrt_h: f64,
    in_run_bias_stability_deg_h: f64,
    rate_hz: f64,
    seconds: f64,
    gyro_lsb_dps: f64,
}

/// The answer, as `paper.json` has it.
#[derive(Serialize)]
struct Answer<'a> {
    format: &'static str,
    seed: u64,
    record: String,
    channel: &'a str,
    stated: Stated,
    two_numbers: &'a noise::analyze::Paper,
    parameters: &'a noise::analyze::NoiseParameters,
    deviations: &'a [noise::analyze::DeviationPoint],
    claims: &'a [Claim],
    hypotheses: &'a [Hypothesis],
    looks_alike: &'a LooksAlike,
}

/// A model file of one gyro with the noise of `stand`.
fn model_of(stand: &PaperStand, name: &str, lsb: Option<f64>) -> ModelFile {
    let walk = if stand.slow == Slow::RandomWalk {
        stand.size
    } else {
        0.0
    };
    let baseline = vec![
        ("bias".to_owned(), Parameter::exact(0.0, "deg/s")),
        (
            "angle_random_walk".to_owned(),
            Parameter::exact(60.0 * stand.angle_random_walk_n, "deg/sqrt(h)"),
        ),
        (
            "rate_random_walk".to_owned(),
            Parameter::exact(walk, "deg/s/sqrt(s)"),
        ),
    ];
    let mut effects = Vec::new();
    if stand.slow == Slow::Flicker {
        effects.push(EffectModel {
            cause: "flicker".to_owned(),
            channels: vec![name.to_owned()],
            parameters: [(
                "bias_instability".to_owned(),
                Parameter::exact(3600.0 * stand.size, "deg/h"),
            )]
            .into(),
        });
    }
    ModelFile {
        stand: "by the figures of Istomin and Belyaev, 2009".to_owned(),
        rate_hz: 1.0 / stand.tau0,
        channels: vec![ChannelModel {
            name: name.to_owned(),
            unit: "deg/s".to_owned(),
            lsb,
            baseline: baseline.into_iter().collect(),
        }],
        effects,
        ..ModelFile::default()
    }
}

fn simulate(model: &ModelFile, seconds: f64, seed: u64) -> Result<Record> {
    model::simulate(model, seconds, model.rate_hz, seed)
        .map_err(|error| miette::miette!(help = "try another --capture or --channel", "{error}"))
}

/// Readings that tell anything of the noise.
const LEAST_READINGS: usize = 64;

/// The record that the figures show, and the stand that its figure-1 model is simulated from.
struct Shown {
    record: Record,
    /// Where the record is from, for captions.
    from: String,
    measured: bool,
}

/// Channels that the paper's figures can be simulated for.
const GYROS: [&str; 3] = ["gyro_x", "gyro_y", "gyro_z"];

fn shown(arguments: &Arguments, stand: &PaperStand) -> Result<Shown> {
    let Some(path) = &arguments.capture else {
        if !GYROS.contains(&arguments.channel.as_str()) {
            misused!(
                help = "with --capture it is any gyro of the capture",
                "--channel: `{}` is none of {}",
                arguments.channel,
                GYROS.join(", ")
            );
        }
        return Ok(Shown {
            record: simulate(
                &model_of(stand, &arguments.channel, Some(LSB_DPS)),
                STATED_SECONDS,
                arguments.seed,
            )?,
            from: format!(
                "simulated from the paper's figures, seed {}",
                arguments.seed
            ),
            measured: false,
        });
    };
    let record = arguments.input.read(path)?.record;
    arguments.input.tell(path, &record);
    let Some(channel) = record.channel(&arguments.channel) else {
        let names: Vec<_> = record.channels.iter().map(|c| c.name.as_str()).collect();
        miette::bail!(
            help = "name one of them: --channel NAME",
            "{} has no channel {}; it has: {}",
            path.display(),
            arguments.channel,
            names.join(", ")
        );
    };
    if channel.quantity != Quantity::Gyro || channel.unit != "deg/s" {
        miette::bail!(
            help = "the paper's figures are about a gyro: --channel gyro_z, with --columns and --units for a foreign file",
            "{} is no gyro in deg/s",
            arguments.channel
        );
    }
    let readings = channel.values.iter().filter(|v| v.is_finite()).count();
    if readings < LEAST_READINGS {
        return Err(super::explain(model::record::AnalysisError::Inconclusive {
            what: format!("the paper's curve of {}", channel.name),
            have: readings as f64,
            need: LEAST_READINGS as f64,
            unit: "samples",
        }));
    }
    Ok(Shown {
        record,
        from: super::name(path),
        measured: true,
    })
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    Outputs::beside(&arguments.capture).result("--json", arguments.json.as_ref())?;
    let tau0 = 1.0 / STATED_RATE_HZ;
    let (n, level) = (STATED_ARW_DEG_SQRT_H / 60.0, STATED_FLAT_DEG_H / 3600.0);
    let stand = PaperStand::with_both(Slow::RandomWalk, n, level, tau0)
        .ok_or_else(|| miette::miette!("the paper's figures admit no random walk"))?;
    let shown = shown(arguments, &stand)?;
    let options = AnalyzeOptions {
        taus: TauGrid::Log(10),
        channels: Some(vec![arguments.channel.clone()]),
        rate_hz: arguments.input.rate,
        seed: arguments.seed,
        file: shown.from.clone(),
        ..AnalyzeOptions::default()
    };
    let analysis = noise::analyze(&shown.record, &options).map_err(super::explain)?;
    let found = &analysis.channels[&arguments.channel];
    let hypotheses = criticism::hypotheses(arguments.runs, arguments.seed, n, level, tau0)?;
    let alike = criticism::looks_alike(arguments.draws, arguments.seed, &stand)?;
    let claims = criticism::claims(&hypotheses, &analysis, found, &alike, (n, tau0));
    let answer = Answer {
        format: "imu-stand-paper/1",
        seed: arguments.seed,
        record: shown.from.clone(),
        channel: &arguments.channel,
        stated: Stated {
            angle_random_walk_deg_sqrt_h: STATED_ARW_DEG_SQRT_H,
            in_run_bias_stability_deg_h: STATED_FLAT_DEG_H,
            rate_hz: STATED_RATE_HZ,
            seconds: STATED_SECONDS,
            gyro_lsb_dps: LSB_DPS,
        },
        two_numbers: &found.paper,
        parameters: &found.parameters,
        deviations: found.deviations.values().next().map_or(&[], |d| d),
        claims: &claims,
        hypotheses: &hypotheses,
        looks_alike: &alike,
    };
    std::fs::create_dir_all(&arguments.out)
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot make the folder {}", arguments.out.display()))?;
    figures::write(&figures::Subject {
        arguments,
        shown: &shown,
        analysis: &analysis,
        found,
        stand: &stand,
        hypotheses: &hypotheses,
        claims: &claims,
        alike: &alike,
    })?;
    super::write_json(Some(&arguments.out.join("paper.json")), &answer)?;
    super::write_json(arguments.json.as_ref(), &answer)?;
    if !arguments.input.quiet {
        print(arguments, &analysis, found, &claims);
    }
    Ok(())
}

fn print(arguments: &Arguments, analysis: &Analysis, found: &ChannelAnalysis, claims: &[Claim]) {
    say!("{}: {}", analysis.input.file, arguments.channel);
    for (name, interval, stated) in [
        (
            "angle random walk",
            &found.paper.angle_random_walk,
            STATED_ARW_DEG_SQRT_H,
        ),
        (
            "in-run bias stability",
            &found.paper.in_run_bias_stability,
            STATED_FLAT_DEG_H,
        ),
    ] {
        say!(
            "  {name:<22} {} (the paper: {stated})",
            figures::interval_text(interval)
        );
    }
    say!("what does not fit");
    for claim in claims {
        say!(
            "{}",
            text::item("- ", &format!("{} {}", claim.stated, claim.found))
        );
    }
    say!("figures: {}", arguments.out.join("paper.html").display());
}
