//! The correction of a model, written to the board: old beside new, row by row, and read back before it is believed.

use std::path::PathBuf;

use clap::Args;
use imu_stand::export::board::{BoardCorrection, values};
use miette::Result;
use serde::Serialize;
use wire::correction::{self, NUMBERS, Numbers, ROWS};
use wire::{Command, Hello};

use super::Session;

/// What `correct` takes.
#[derive(Args)]
pub struct Arguments {
    /// A model file (`diagnose --model-out`)
    #[arg(long, value_name = "FILE", required_unless_present_any = ["off", "on"])]
    pub(super) model: Option<PathBuf>,
    /// Say what would be written, old and new, and write nothing
    #[arg(long, requires = "model")]
    dry_run: bool,
    /// No corrected frames until the next reset
    #[arg(long, conflicts_with_all = ["model", "on"])]
    off: bool,
    /// Apply the stored correction again, with the bias filter started anew
    #[arg(long, conflicts_with = "model")]
    on: bool,
}

#[derive(Serialize)]
struct Answer {
    format: &'static str,
    correction: Option<u16>,
    written: bool,
    changed: Vec<Change>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct Change {
    axis: char,
    what: &'static str,
    unit: &'static str,
    before: f64,
    after: f64,
}

/// The numbers of the copy in use; `None` where none is.
fn in_use(session: &mut Session) -> Result<Option<Numbers>> {
    let mut numbers = [0; NUMBERS];
    for (row, three) in (0u8..).zip(numbers.chunks_exact_mut(3)) {
        let reply = session
            .link
            .ask(Command::GetCorrection { other: false, row })?;
        if reply.value == 0 {
            return Ok(None);
        }
        for (number, detail) in three.iter_mut().zip(reply.detail) {
            *number = detail as i16;
        }
    }
    Ok(Some(numbers))
}

fn changes(before: &Numbers, after: &Numbers) -> Vec<Change> {
    let value = |numbers: &Numbers, place: usize| {
        values(numbers)
            .find(|(at, ..)| *at == place)
            .map_or(0.0, |(.., value)| value)
    };
    (6..NUMBERS)
        .filter(|place| before[*place] != after[*place])
        .map(|place| {
            let (axis, what, unit) = correction::name(place);
            Change {
                axis,
                what,
                unit,
                before: value(before, place),
                after: value(after, place),
            }
        })
        .collect()
}

/// SENS/AVG as the board has it.
fn sens_avg(hello: &Hello) -> u16 {
    u16::from_le_bytes([hello.gyro_filter, hello.gyro_range])
}

pub fn run(session: &mut Session, arguments: &Arguments) -> Result<()> {
    let Some(path) = &arguments.model else {
        let on = arguments.on;
        session.link.ask(Command::Correction { on })?;
        if !session.quiet {
            say!("the correction is {}", if on { "on" } else { "off" });
        }
        return Ok(());
    };
    let model = super::super::read_model(path)?;
    let hello = session.link.ask_hello()?;
    let board = BoardCorrection::of(&model, sens_avg(&hello)).map_err(|error| {
        miette::miette!(
            help = "nothing was written; docs/wire-format.md lists what the board holds",
            "{}: {error}",
            path.display()
        )
    })?;
    let before = in_use(session)?;
    let mut after = board.numbers;
    let generation = before.map_or(0, |old| old[0].to_le_bytes()[1].wrapping_add(1));
    after[0] = i16::from_le_bytes([correction::FORMAT, generation]);
    let changed = changes(&before.unwrap_or([0; NUMBERS]), &after);
    if !session.quiet {
        for change in &changed {
            say!(
                "{} {:<42} {:>14.9} -> {:>14.9} {}",
                change.axis,
                change.what,
                change.before,
                change.after,
                change.unit
            );
        }
        for note in &board.notes {
            say!("{}", imu_stand::text::item("note: ", note));
        }
    }
    if !arguments.dry_run {
        write(session, &after)?;
    }
    if !session.quiet {
        if arguments.dry_run {
            say!("nothing is written (--dry-run)");
        } else {
            say!(
                "correction {:#06x} is written, read back, and in use",
                board.correction.number
            );
        }
    }
    let answer = Answer {
        format: "imu-stand-correction/1",
        correction: Some(board.correction.number),
        written: !arguments.dry_run,
        changed,
        notes: board.notes,
    };
    super::super::write_json(session.json.as_ref(), &answer)
}

/// Writes the copy that is not in use, puts it in use by its CRC, and reads it back.
fn write(session: &mut Session, numbers: &Numbers) -> Result<()> {
    for (row, three) in (0u8..).zip(numbers.chunks_exact(3)) {
        let values = [three[0], three[1], three[2]];
        session.link.ask(Command::SetCorrection { row, values })?;
    }
    session.link.ask(Command::SetCorrection {
        row: ROWS as u8,
        values: correction::crc_row(numbers),
    })?;
    if in_use(session)? != Some(*numbers) {
        miette::bail!(
            help = "write it again; `board health --all` counts config_not_stored",
            "the board does not read back the correction that was written"
        );
    }
    Ok(())
}
