//! `imu-stand board correct`.

use std::path::PathBuf;

use clap::{ArgGroup, Args};
use imu_stand::correct::{Change, Proposed, keep_what_is_more_than_its_error};
use miette::Result;
use serde::Serialize;
use wire::Command;

use super::Session;

/// What `correct` takes.
#[derive(Args)]
#[command(
    group = ArgGroup::new("what").args(["file", "model", "off", "on"]).required(true),
    group = ArgGroup::new("by").args(["file", "model"])
)]
pub struct Arguments {
    /// A model file (`diagnose --model-out`)
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    /// The same, by its name
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Say what would be written, old and new, and write nothing
    #[arg(long, requires = "by")]
    dry_run: bool,
    /// No corrected frames until the next reset
    #[arg(long)]
    off: bool,
    /// Apply the stored correction again, with the bias filter started anew
    #[arg(long)]
    on: bool,
}

impl Arguments {
    /// The model file, named in either way.
    pub(super) fn model(&self) -> Option<&PathBuf> {
        self.file.as_ref().or(self.model.as_ref())
    }
}

#[derive(Serialize)]
struct Answer {
    format: &'static str,
    correction: Option<u16>,
    written: bool,
    changed: Vec<Change>,
    notes: Vec<String>,
}

pub fn run(session: &mut Session, arguments: &Arguments) -> Result<()> {
    let Some(path) = arguments.model() else {
        let on = arguments.on;
        session.link.ask(Command::Correction { on })?;
        if on {
            // Which, and whether it is for the gyros as they are set.
            return session.show_info();
        }
        if !session.quiet {
            say!("the correction is off");
        }
        return Ok(());
    };
    let mut model = super::super::read_model(path)?;
    let refused = keep_what_is_more_than_its_error(&mut model);
    let mut proposed = Proposed::of(&mut session.link, &model)?.map_err(|error| {
        miette::miette!(
            help = "nothing was written; docs/wire-format.md lists what the board holds",
            "{}: {error}",
            path.display()
        )
    })?;
    proposed.board.notes.extend(refused);
    if !session.quiet {
        for change in &proposed.changed {
            let (axis, what, unit) = (change.axis, change.what, change.unit);
            let line = format!(
                "{axis} {what:<42} {:>14.9} -> {:>14.9} {unit}",
                change.before, change.after
            );
            say!("{}", line.trim_end());
        }
        for note in &proposed.board.notes {
            say!("{}", imu_stand::text::item("note: ", note));
        }
    }
    if !arguments.dry_run {
        proposed.write(&mut session.link)?;
    }
    if !session.quiet {
        if let Some(was) = proposed.was_for {
            let was = super::show::gyros_at(was);
            say!("the one in use is for gyros at {was}, and is not applied as they are set");
        } else if proposed.is_in_use {
            say!("the correction in use has these numbers already");
        }
        if arguments.dry_run {
            say!("nothing is written (--dry-run)");
        } else {
            say!(
                "correction {:#06x} is written, read back, and in use",
                proposed.board.correction.number
            );
        }
    }
    let answer = Answer {
        format: "imu-stand-correction/1",
        correction: Some(proposed.board.correction.number),
        written: !arguments.dry_run,
        changed: proposed.changed,
        notes: proposed.board.notes,
    };
    super::super::write_json(session.json.as_ref(), &answer)
}
