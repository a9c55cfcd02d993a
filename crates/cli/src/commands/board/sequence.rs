//! `imu-stand board calibrate six-position`, `turns`, `heater`: prompts, and what comes of them.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use imu_stand::calibrate::{self, Outcome, Told, merged};
use imu_stand::text;
use miette::Result;
use serde::Serialize;

use super::Session;

/// A sequence.
#[derive(Subcommand)]
pub enum Sequence {
    /// The stand on each of its six sides: zero and scale of the accelerometers, g-sensitivity of the gyros
    ///
    /// A side is recorded as soon as the stand lies still on one that is new; nothing has to be typed.
    #[command(
        after_help = "Examples:\n  imu-stand board --port /dev/ttyUSB0 calibrate six-position\n  imu-stand board --port /dev/ttyUSB0 calibrate six-position --seconds 60 --model model.toml --out calibrated.toml"
    )]
    SixPosition(SixPosition),
    /// The table turned both ways by the motor: cross axis, and on a tilted stand the scale of the gyro about z
    #[command(
        after_help = "Examples:\n  imu-stand board --port /dev/ttyUSB0 calibrate turns --duty 80\n  imu-stand board --port /dev/ttyUSB0 calibrate turns --duty 120 --seconds 60 --model model.toml --out calibrated.toml"
    )]
    Turns(Turns),
    /// The board warmed and cooled at rest: bias over temperature
    #[command(
        after_help = "Example:\n  imu-stand board --port /dev/ttyUSB0 calibrate heater --seconds 1800 --model model.toml --out calibrated.toml"
    )]
    Heater(Heater),
}

/// What goes in and out, of every sequence.
#[derive(Args)]
pub struct Files {
    /// A model file whose noise and other causes are kept; without it one of the gyros alone is written
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// The model file to write, for `board correct` and `export --to board`
    #[arg(long, value_name = "FILE", default_value = "calibrated.toml")]
    out: PathBuf,
}

/// What `six-position` takes.
#[derive(Args)]
pub struct SixPosition {
    /// How long each side is recorded, s
    #[arg(long, default_value_t = 30.0, value_parser = super::super::positive)]
    seconds: f64,
    /// How long a side is waited for, s
    #[arg(long, default_value_t = 300.0, value_parser = super::super::positive)]
    within: f64,
    #[command(flatten)]
    files: Files,
}

/// What `turns` takes.
#[derive(Args)]
pub struct Turns {
    /// Command of the motor
    #[arg(long, default_value_t = 80, value_parser = clap::value_parser!(i16).range(1..=255))]
    duty: i16,
    /// How long each way, s
    #[arg(long, default_value_t = 60.0, value_parser = super::super::positive)]
    seconds: f64,
    #[command(flatten)]
    files: Files,
}

/// What `heater` takes.
#[derive(Args)]
pub struct Heater {
    /// How long in all, s; the heater is to be on for the first half
    #[arg(long, default_value_t = 1200.0, value_parser = super::super::positive)]
    seconds: f64,
    #[command(flatten)]
    files: Files,
}

impl Sequence {
    fn files(&self) -> &Files {
        match self {
            Sequence::SixPosition(of) => &of.files,
            Sequence::Turns(of) => &of.files,
            Sequence::Heater(of) => &of.files,
        }
    }

    /// The model file that is read.
    pub fn reads(&self) -> Option<&PathBuf> {
        self.files().model.as_ref()
    }

    /// The model file that is written.
    pub fn out(&self) -> &PathBuf {
        &self.files().out
    }
}

#[derive(Serialize)]
struct Answer<'a> {
    format: &'static str,
    #[serde(flatten)]
    outcome: &'a Outcome,
    model: String,
}

/// Runs it.
pub fn run(session: &mut Session, sequence: &Sequence) -> Result<()> {
    let files = sequence.files();
    let before = files
        .model
        .as_deref()
        .map(super::super::read_model)
        .transpose()?;
    let quiet = session.quiet;
    let link = &mut session.link;
    // What a person has to do is said in any case: without it nothing would come of it.
    let mut tell = |told: Told| match told {
        Told::Do(what) => eprintln!(">> {what}"),
        Told::Note(what) if !quiet => eprintln!("   {what}"),
        Told::Refused(why) => eprintln!("   {why}"),
        Told::Note(_) => {}
    };
    let outcome = match sequence {
        Sequence::SixPosition(of) => {
            let how = calibrate::SixPosition {
                seconds: of.seconds,
                within: of.within,
            };
            calibrate::six_position(link, how, &mut tell)?
        }
        Sequence::Turns(of) => {
            let how = calibrate::Turns {
                duty: of.duty,
                seconds: of.seconds,
            };
            calibrate::turns(link, how, &mut tell)?
        }
        Sequence::Heater(of) => {
            let how = calibrate::Heater {
                seconds: of.seconds,
            };
            calibrate::heater(link, how, &mut tell)?
        }
    };
    let model = merged(before, &outcome);
    super::super::write(&files.out, &model.to_toml())?;
    let answer = Answer {
        format: "imu-stand-sequence/1",
        outcome: &outcome,
        model: super::super::name(&files.out),
    };
    super::super::write_json(session.json.as_ref(), &answer)?;
    if !quiet {
        show(&outcome);
        let model = files.out.display();
        say!(
            "{model} is written; `imu-stand board correct --model {model} --dry-run` shows what the board would take off"
        );
    }
    Ok(())
}

fn show(outcome: &Outcome) {
    say!("what the sequence found, with 95 % intervals");
    for found in &outcome.identified {
        let size = text::answer::with_interval(&found.size).replace('\u{a0}', " ");
        say!("  {:<7} {:<28} {size}", found.channel, found.what);
    }
    say!("what this sequence cannot tell");
    for what in &outcome.not_identified {
        say!("{}", text::item("- ", what));
    }
}
