//! The correction of a model, onto a board: old beside new, row by row, and read back before it is believed.

use model::ModelFile;
use serde::Serialize;
use wire::correction::{self, NUMBERS, Numbers, ROWS};
use wire::{Command, Hello};

use crate::export::board::{BoardCorrection, BoardError, values};
use crate::link::{Link, LinkError};

/// A number of the correction that changes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    /// x, y, z.
    pub axis: char,
    /// What it multiplies.
    pub what: &'static str,
    /// Of both values.
    pub unit: &'static str,
    /// On the board until now; 0 where there is no correction.
    pub before: f64,
    /// To be written.
    pub after: f64,
}

/// The correction of a model for one board, and what it would change there.
#[derive(Clone, Debug)]
pub struct Proposed {
    /// As the model asks for it.
    pub board: BoardCorrection,
    /// What differs from the one in use.
    pub changed: Vec<Change>,
    /// Whether the one in use is this one, its generation aside.
    pub is_in_use: bool,
    /// The SENS/AVG that the one in use is for, where that is another.
    pub was_for: Option<u16>,
    numbers: Numbers,
}

/// The numbers of the copy in use; `None` where none is.
///
/// # Errors
/// [`LinkError`].
pub fn in_use(link: &mut Link) -> Result<Option<Numbers>, LinkError> {
    let mut numbers = [0; NUMBERS];
    for (row, three) in (0u8..).zip(numbers.chunks_exact_mut(3)) {
        let reply = link.ask(Command::GetCorrection { other: false, row })?;
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
    // The first six numbers are the header's.
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

impl Proposed {
    /// Asks the board how it is set and what it has. Nothing is written.
    ///
    /// # Errors
    /// [`LinkError`]; in the value, what keeps the model from being a correction.
    pub fn of(link: &mut Link, model: &ModelFile) -> Result<Result<Self, BoardError>, LinkError> {
        let hello = link.ask_hello()?;
        let board = match BoardCorrection::of(model, sens_avg(&hello)) {
            Ok(board) => board,
            Err(error) => return Ok(Err(error)),
        };
        let before = in_use(link)?;
        let mut numbers = board.numbers;
        let generation = before.map_or(0, |old| old[0].to_le_bytes()[1].wrapping_add(1));
        numbers[0] = i16::from_le_bytes([correction::FORMAT, generation]);
        let changed = changes(&before.unwrap_or([0; NUMBERS]), &numbers);
        let is_in_use = before.is_some_and(|old| old[1..] == numbers[1..]);
        let was_for = before.map(|old| old[3] as u16);
        Ok(Ok(Self {
            board,
            changed,
            is_in_use,
            was_for: was_for.filter(|was| *was != numbers[3] as u16),
            numbers,
        }))
    }

    /// Writes the copy that is not in use, puts it in use by its CRC, and reads it back.
    ///
    /// # Errors
    /// [`LinkError`]; [`LinkError::NotAsAsked`] where the board reads back another one.
    pub fn write(&self, link: &mut Link) -> Result<(), LinkError> {
        for (row, three) in (0u8..).zip(self.numbers.chunks_exact(3)) {
            let values = [three[0], three[1], three[2]];
            link.ask(Command::SetCorrection { row, values })?;
        }
        let in_its_place = link.ask(Command::SetCorrection {
            row: ROWS as u8,
            values: correction::crc_row(&self.numbers),
        });
        match in_its_place {
            // Without a reply, what is read back says whether it arrived.
            Ok(_) | Err(LinkError::Unknown { .. }) => {}
            Err(error) => return Err(error),
        }
        if in_use(link)? != Some(self.numbers) {
            return Err(LinkError::NotAsAsked {
                what: "the board does not read back the correction that was written".to_owned(),
                help: "write it again; `board health --all` counts config_not_stored".to_owned(),
            });
        }
        Ok(())
    }
}
