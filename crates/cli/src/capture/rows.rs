//! Rows of a text.

use super::CaptureError;
use super::cells::{Cells, is_missing};
use super::columns::{Column, Held, Role};
use super::error::brief;
use super::infinite::{Infinite, is_infinite};
use super::propose::date_of;
use super::several::Sensors;
use super::steps::LARGEST_COUNT;
use super::time::{Clock, is_date, is_of_day};

impl Role {
    /// Whether a column of this kind can have such a cell.
    pub fn takes(&self, v: f64) -> bool {
        // Beyond what an i64 holds none of these is taken; `fract` is a call for each cell.
        let is_whole = v as i64 as f64 == v;
        let whole = v >= 0.0 && is_whole;
        match self {
            Role::Seq | Role::Ticks => whole && v < 9e15,
            Role::Flags => whole && v <= 65_535.0,
            Role::Time { .. } => v.is_finite(),
            Role::Measured {
                held: Held::Counts, ..
            } => v.is_nan() || (is_whole && v.abs() < LARGEST_COUNT),
            Role::Measured { .. } => !v.is_infinite(),
        }
    }
}

/// What a row that has too many cells between commas may be.
const DECIMAL_COMMAS: &str =
    "if its numbers have decimal commas, write the table with `;` or tabs between the cells; ";

/// A time of day with the date that stands in a column of its own, where they make one.
fn dated(date: &str, time: &str) -> Option<String> {
    let both = is_of_day(time).then(|| format!("{date} {time}"))?;
    is_date(&both).then_some(both)
}

/// Reads the rows of a text.
pub(super) struct RowReader<'a> {
    columns: &'a [Column],
    width: usize,
    cells: Cells,
    clocks: Vec<Clock>,
    /// Where the dates of times of day stand.
    dates: Vec<Option<usize>>,
    /// Of the last row.
    pub values: Vec<f64>,
    /// All numbers of a plain row.
    numbers: Vec<f64>,
    /// Of columns that nobody asked for: line and text of the first cell that is no number.
    pub odd: Vec<Option<(u64, String)>>,
    /// Cells beyond all numbers.
    beyond: Infinite,
    /// Who the rows are of, where a column says so.
    pub sensors: Option<Sensors>,
}

impl<'a> RowReader<'a> {
    pub fn new(columns: &'a [Column], names: &[String], cells: Cells) -> Self {
        let clock = |column: &Column| match column.role {
            Role::Time { scale } => Clock::new(scale),
            _ => Clock::new(1.0),
        };
        let date = |column: &Column| match column.role {
            Role::Time { .. } => date_of(names, column.at),
            _ => None,
        };
        Self {
            dates: columns.iter().map(date).collect(),
            columns,
            width: names.len(),
            cells,
            clocks: columns.iter().map(clock).collect(),
            values: vec![0.0; columns.len()],
            numbers: Vec::new(),
            odd: vec![None; columns.len()],
            beyond: Infinite::default(),
            sensors: Sensors::of(names, columns),
        }
    }

    /// Says how numbers in groups are read, where there are any.
    pub fn grouped(&self) -> Option<String> {
        let first = self.cells.grouped.as_ref()?;
        Some(format!(
            "thousands are taken to be set off in groups: {first}"
        ))
    }

    /// Says how many cells are beyond all numbers, where there are any.
    pub fn infinite(&self) -> Option<String> {
        self.beyond.note()
    }

    /// Whether the times say their own unit, cell by cell.
    pub fn times_have_units(&self) -> bool {
        self.clocks.iter().any(|clock| clock.has_units)
    }

    /// Whether a line has the columns' names once more, as where files were put end to end.
    pub fn is_names(&self, text: &str, names: &[String]) -> bool {
        let cells = self.cells.cut(text);
        cells.len() == names.len()
            && cells
                .iter()
                .zip(names)
                .all(|(cell, name)| cell.trim() == name)
    }

    /// Reads a row of plain numbers, as most are; nothing where it is anything else.
    fn plain(&mut self, text: &str, line: u64) -> Option<()> {
        self.cells.plain(text, &mut self.numbers)?;
        if self.numbers.len() != self.width {
            return None;
        }
        for (k, column) in self.columns.iter().enumerate() {
            let number = *self.numbers.get(column.at)?;
            let value = match column.role {
                Role::Time { .. } => self.clocks[k].plain(number)?,
                _ => number,
            };
            if !column.role.takes(value) {
                return None;
            }
            self.values[k] = value;
        }
        if let Some(sensors) = &mut self.sensors {
            sensors.take_number(*self.numbers.get(sensors.at)?, line);
        }
        Some(())
    }

    pub fn read(&mut self, text: &str, line: u64) -> Result<(), CaptureError> {
        if self.plain(text, line).is_some() {
            return Ok(());
        }
        let bad = |column: &Column, found: &str, expected: String| CaptureError::BadRow {
            line,
            column: brief(&column.name),
            found: brief(found),
            expected,
        };
        let row = self.cells.cut(text);
        let ends_in_separator = row.len() == self.width + 1 && row[self.width].is_empty();
        if row.len() != self.width && !ends_in_separator {
            return Err(CaptureError::Cells {
                line,
                found: row.len(),
                expected: self.width,
                hint: match self.cells.separator() == ',' && row.len() > self.width {
                    true => DECIMAL_COMMAS,
                    false => "",
                },
            });
        }
        if let Some(sensors) = &mut self.sensors {
            sensors.take(row.get(sensors.at).map_or("", |cell| cell.as_ref()), line);
        }
        for (k, column) in self.columns.iter().enumerate() {
            let cell = row.get(column.at).map_or("", |cell| cell.as_ref());
            let is_measured = matches!(column.role, Role::Measured { .. });
            let read = match (cell, &column.role) {
                (cell, _) if is_measured && is_missing(cell) => Some(f64::NAN),
                (cell, _) if is_measured && is_infinite(cell) => {
                    self.beyond.take(line, &column.name, cell);
                    Some(f64::NAN)
                }
                (_, Role::Time { .. }) => {
                    let date = self.dates[k].and_then(|at| row.get(at));
                    let dated = date.and_then(|date| dated(date, cell));
                    let cell = dated.as_deref().unwrap_or(cell);
                    let cells = &mut self.cells;
                    self.clocks[k].seconds(cell, |cell| cells.number(cell))
                }
                _ => self.cells.number(cell),
            };
            if read.is_none() && !column.is_asked {
                self.odd[k].get_or_insert_with(|| (line, cell.to_owned()));
                self.values[k] = f64::NAN;
                continue;
            }
            let Some(value) = read else {
                if let Some(why) = self.cells.why_not(cell) {
                    return Err(CaptureError::Ambiguous {
                        line,
                        column: brief(&column.name),
                        found: brief(cell),
                        why,
                    });
                }
                if matches!(column.role, Role::Time { .. }) {
                    return Err(CaptureError::Time {
                        why: format!("line {line}, column `{}`: `{}` is no time", brief(&column.name), brief(cell)),
                        help: "a time is a number (`--units time=ms` says of what) or a date like 2026-11-21 19:02:59.78, 21.11.2026 \
                               19:02:59.78 or 11/21/2026 7:02:59.78 PM; where day and month can be either, write 2026-11-21; \
                               where others stand in the file, leave time out and say `--rate HZ`; `--skip-bad` leaves out \
                               single bad rows"
                            .to_owned(),
                    });
                }
                return Err(bad(column, cell, "not a finite number".to_owned()));
            };
            if !column.role.takes(value) {
                let what = "not a whole number of the range that this column has";
                return Err(bad(column, cell, what.to_owned()));
            }
            self.values[k] = value;
        }
        Ok(())
    }
}
