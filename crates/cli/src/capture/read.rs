//! Reading.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use model::record::{Channel, Header, Quantity, Record};

use super::angle::difference_angles;
use super::columns::{Column, Columns, Role, Said, columns};
use super::error::brief;
use super::foreign::meaning;
use super::header::Lines;
use super::layout::{Cells, Layout, next_row_into};
use super::logs::read_log;
use super::order::{check_rate, check_times, check_varies, in_order, unwrap, unwrap_times};
use super::plausible::doubts;
use super::propose::proposed;
use super::propose::seen::{ROWS, Seen, first_rows};
use super::skipped::keep_places;
use super::span::Span;
use super::steady::{one_rate, unsteady};
use super::stream::{TextLines, io, named, unpacked};
use super::table::Table;
#[cfg(feature = "native")]
use super::tables::read_table;
use super::time::Clock;
use super::{CaptureError, ColumnMapping};

/// How to read.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// Which foreign column is what; empty for the stand's own captures.
    pub mapping: ColumnMapping,
    /// Sample rate where the rows have no times, Hz. Overrides the header; an error where times contradict it.
    pub rate_hz: Option<f64>,
    /// Leave out what stands in rows that cannot be read, and count them.
    pub skip_bad: bool,
    /// Which topic of a log that has several IMUs.
    pub topic: Option<String>,
    /// The part of the record that is taken; all of it without one.
    pub span: Option<Span>,
}

/// A record, and what was left out of it.
#[derive(Clone, Debug)]
pub struct Read {
    /// The record.
    pub record: Record,
    /// Rows that were left out by [`ReadOptions::skip_bad`]; where they were is a row without readings.
    pub skipped: usize,
}

/// Bytes of a file that are read at once.
const READ_AT_ONCE: usize = 1 << 16;

/// Reads a capture or any other table of numbers: by their endings files of arrays (`.npz`, `.npy`, `.parquet`, `.mat`,
/// `.h5`), everything else as text, gzip or not, with cells between commas, semicolons, tabs or blanks. A gyro given in
/// units of an angle is differenced into a rate.
///
/// # Errors
/// [`CaptureError`], which says what to do.
pub fn read_capture(path: &Path, options: &ReadOptions) -> Result<Read, CaptureError> {
    #[cfg(feature = "native")]
    if let Some(table) = read_table(path) {
        no_topics(options)?;
        return from_table(table?, options);
    }
    let open = || unpacked(BufReader::with_capacity(READ_AT_ONCE, File::open(path)?));
    // An error of the stream has no path yet.
    open()
        .map_err(io)
        .and_then(|text| read_from(text, options))
        .map_err(|error| named(error, path))
}

/// Refuses the name of a topic for a file that has none.
fn no_topics(options: &ReadOptions) -> Result<(), CaptureError> {
    if options.topic.is_none() {
        return Ok(());
    }
    Err(CaptureError::Option {
        option: "--topic",
        why: "this file has no topics".to_owned(),
        help: "it is for logs: MCAP, ROS 1 bags, ULog; of a table `--columns` says what is what"
            .to_owned(),
    })
}

/// Reads a capture from a stream of text, or of a log: MCAP, ROS 1 bag, ULog.
///
/// # Errors
/// [`CaptureError`].
pub fn read_from(mut input: impl BufRead, options: &ReadOptions) -> Result<Read, CaptureError> {
    if let Some(table) = read_log(&mut input, options.topic.as_deref()) {
        return from_table(table?, options);
    }
    no_topics(options)?;
    let mut text = TextLines::new(input)?;
    let mut layout = Layout::read(&mut text)?;
    let mut header = layout.lines.header()?;
    header.rate_hz = options.rate_hz.or(header.rate_hz);
    let said = Said {
        lines: &layout.lines,
        names: &layout.names,
        numbered: layout.numbered,
        units: &layout.units,
        is_scaled: false,
    };
    let mut found = match columns(&said, &options.mapping) {
        Err(error) => {
            let seen = first_rows(
                &mut text,
                layout.first.take(),
                &mut layout.cells,
                said.names.len(),
            )?;
            return Err(proposed(error, (said.names, said.numbered), &seen));
        }
        Ok(found) => found,
    };
    if let Some((first, last)) = layout.preamble {
        found.notes.push(format!(
            "the table begins in line {}: what stands before, from line {first} on, is not read",
            last + 1
        ));
    }
    let mut values: Vec<Vec<f64>> = found.columns.iter().map(|_| Vec::new()).collect();
    let mut reader = RowReader::new(&found.columns, layout.names.len(), layout.cells);
    let mut skipped = Vec::new();
    let (mut row, mut cells) = layout.first.take().unzip();
    let cells = cells.get_or_insert_default();
    while let Some(line) = row {
        match reader.read(cells, line) {
            Ok(()) => values
                .iter_mut()
                .zip(&reader.values)
                .for_each(|(column, &value)| column.push(value)),
            Err(_) if options.skip_bad => skipped.push(values.first().map_or(0, Vec::len)),
            Err(error) => return Err(error),
        }
        row = next_row_into(&mut text, cells)?;
    }
    let odd = std::mem::take(&mut reader.odd);
    finish(header, found, values, options, &skipped, &odd)
}

/// A record of named columns, as of a file of arrays: by the names and units of `table.about` (`rate_hz`, `unit of gyro_x`,
/// ...), or by a mapping.
///
/// # Errors
/// [`CaptureError`].
pub fn read_columns(table: Table, options: &ReadOptions) -> Result<Read, CaptureError> {
    no_topics(options)?;
    if (table.columns.windows(2)).any(|pair| pair[0].len() != pair[1].len()) {
        let lengths = table.names.iter().zip(&table.columns);
        let lengths = lengths.map(|(name, column)| format!("{} {}", brief(name), column.len()));
        let lengths: Vec<String> = lengths.collect();
        return Err(CaptureError::Lengths {
            lengths: lengths.join(", "),
        });
    }
    from_table(table, options)
}

/// From the columns of a file of arrays. Without a mapping, names of ours are taken as they are: in the units the file
/// states, in counts with the header's scales where it says `counts`, else in deg/s and m/s^2.
fn from_table(table: Table, options: &ReadOptions) -> Result<Read, CaptureError> {
    let mut lines = Lines::default();
    lines.entries.extend(
        (table.about.iter().enumerate())
            .map(|(i, (key, value))| (i + 1, key.clone(), value.clone())),
    );
    let mut header = lines.header()?;
    header.rate_hz = options.rate_hz.or(header.rate_hz);
    let stated = |name: &String| lines.unit_of(name).map(str::to_owned);
    let units: Vec<Option<String>> = table.names.iter().map(stated).collect();
    let said = Said {
        lines: &lines,
        names: &table.names,
        numbered: false,
        units: &units,
        is_scaled: true,
    };
    let mut found = columns(&said, &options.mapping).map_err(|error| {
        let part = |of: &Vec<f64>| of.iter().copied().take(ROWS).collect();
        let seen = Seen(table.columns.iter().map(part).collect());
        proposed(error, (said.names, said.numbered), &seen)
    })?;
    found.notes.splice(..0, table.notes);
    let mut cells = Vec::new();
    for column in &found.columns {
        let mut values = table.columns[column.at].clone();
        if !column.is_asked {
            (values.iter_mut().filter(|v| v.is_infinite())).for_each(|v| *v = f64::NAN);
        }
        if let Some(row) = values.iter().position(|v| !column.role.takes(*v)) {
            return Err(CaptureError::BadRow {
                line: row as u64 + 1,
                column: column.name.clone(),
                found: values[row].to_string(),
                expected: "not a number of the kind that this column has".to_owned(),
            });
        }
        if let Role::Time { scale } = column.role {
            values.iter_mut().for_each(|v| *v *= scale);
        }
        cells.push(values);
    }
    finish(header, found, cells, options, &[], &[])
}

impl Role {
    /// Whether a column of this kind can have such a cell.
    fn takes(&self, v: f64) -> bool {
        // Beyond what an i64 holds none of these is taken; `fract` is a call for each cell.
        let is_whole = v as i64 as f64 == v;
        let whole = v >= 0.0 && is_whole;
        match self {
            Role::Seq | Role::Ticks => whole && v < 9e15,
            Role::Flags => whole && v <= 65_535.0,
            Role::Time { .. } => v.is_finite(),
            Role::Measured { counts: true, .. } => v.is_nan() || (is_whole && v.abs() < 1e9),
            Role::Measured { .. } => !v.is_infinite(),
        }
    }
}

/// Reads the rows of a text.
struct RowReader<'a> {
    columns: &'a [Column],
    width: usize,
    cells: Cells,
    clocks: Vec<Clock>,
    /// Of the last row.
    values: Vec<f64>,
    /// All numbers of a plain row.
    numbers: Vec<f64>,
    /// Of columns that nobody asked for: line and text of the first cell that is no number.
    odd: Vec<Option<(u64, String)>>,
}

impl<'a> RowReader<'a> {
    fn new(columns: &'a [Column], width: usize, cells: Cells) -> Self {
        let clock = |column: &Column| match column.role {
            Role::Time { scale } => Clock::new(scale),
            _ => Clock::new(1.0),
        };
        Self {
            columns,
            width,
            cells,
            clocks: columns.iter().map(clock).collect(),
            values: vec![0.0; columns.len()],
            numbers: Vec::new(),
            odd: vec![None; columns.len()],
        }
    }

    /// Reads a row of plain numbers, as most are; nothing where it is anything else.
    fn plain(&mut self, text: &str) -> Option<()> {
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
        Some(())
    }

    fn read(&mut self, text: &str, line: u64) -> Result<(), CaptureError> {
        if self.plain(text).is_some() {
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
        if row.len() != self.width
            && !ends_in_separator
            && let Some(column) = self.columns.first()
        {
            let found = format!("{} cells", row.len());
            return Err(bad(
                column,
                &found,
                format!("not a row of {} cells", self.width),
            ));
        }
        for (k, column) in self.columns.iter().enumerate() {
            let cell = row.get(column.at).map_or("", |cell| cell.as_ref());
            let is_measured = matches!(column.role, Role::Measured { .. });
            let read = match (cell, &column.role) {
                ("" | "nan" | "NaN" | "NAN", _) if is_measured => Some(f64::NAN),
                (_, Role::Time { .. }) => {
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
                if matches!(column.role, Role::Time { .. }) {
                    return Err(CaptureError::Time {
                        why: format!("line {line}, column `{}`: `{}` is no time", brief(&column.name), brief(cell)),
                        help: "a time is a number (`--units time=ms` says of what) or a date like 2026-11-21 19:02:59.78 or 21.11.2026 \
                               19:02:59.78; where others stand in the file, leave time out and say `--rate HZ`; `--skip-bad` leaves \
                               out single bad rows"
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

fn finish(
    header: Header,
    mut found: Columns,
    mut cells: Vec<Vec<f64>>,
    options: &ReadOptions,
    skipped: &[usize],
    odd: &[Option<(u64, String)>],
) -> Result<Read, CaptureError> {
    if cells.first().is_none_or(Vec::is_empty) {
        return Err(CaptureError::Empty);
    }
    times_that_go_on(&mut found, &mut cells)?;
    let mut record = Record {
        header,
        notes: found.notes.clone(),
        ..Record::default()
    };
    for (k, (column, values)) in found.columns.into_iter().zip(cells).enumerate() {
        let why = unread(&column, &values, odd.get(k).and_then(Option::as_ref));
        match why {
            Some(why) => record.notes.push(format!(
                "column `{}` {why}, and nothing needs it: it is not read",
                brief(&column.name)
            )),
            None => place(&mut record, column, values),
        }
    }
    if !skipped.is_empty() {
        let kept = keep_places(&mut record, skipped);
        let note = format!(
            "rows that cannot be read and are left out (--skip-bad): {}; {kept} of them keep their places, without readings",
            skipped.len()
        );
        record.notes.push(note);
    }
    let stated = record.header.rate_hz;
    let mut record = in_order(record);
    if let Some(times) = &record.host_time_s {
        check_times(times, found.time_is_assumed)?;
    }
    if let Some(span) = options.span {
        span.cut(&mut record)?;
        // The rate that all rows gave is none of a part's.
        record.header.rate_hz = stated;
        record = in_order(record);
    }
    one_rate(&record)?;
    check_rate(&mut record, options.rate_hz)?;
    difference_angles(&mut record)?;
    share_thermometer(&mut record);
    let doubts = doubts(&record, found.gyro_is_assumed);
    record.notes.extend(doubts);
    let unsteady = unsteady(&record);
    record.notes.extend(unsteady);
    Ok(Read {
        record,
        skipped: skipped.len(),
    })
}

/// Times that a counter has begun again go on.
fn times_that_go_on(found: &mut Columns, cells: &mut [Vec<f64>]) -> Result<(), CaptureError> {
    for (column, times) in found.columns.iter().zip(cells) {
        let Role::Time { scale } = column.role else {
            continue;
        };
        let turns = unwrap_times(times, scale);
        if turns > 0 {
            found.notes.push(format!(
                "the time begins again ({turns} x), as a counter of 32 bits does: taken to go on"
            ));
        }
        check_varies(times)?;
    }
    Ok(())
}

/// Why a column that nothing needs is not read: it holds text, first in this line, or no number.
fn unread(column: &Column, values: &[f64], text: Option<&(u64, String)>) -> Option<String> {
    match text {
        Some((line, text)) => Some(format!("holds text (line {line}: `{}`)", brief(text))),
        None if !column.is_asked && values.iter().all(|v| v.is_nan()) => {
            Some("holds no number".to_owned())
        }
        None => None,
    }
}

/// One thermometer of others' data is that of all gyros, whichever axis its name has: a name of one axis would leave the
/// others without. The stand's own gyros have one each.
fn share_thermometer(record: &mut Record) {
    if record.header.entries.iter().any(|(key, _)| key == "format") {
        return;
    }
    let gyros: Vec<_> = record.all(Quantity::Gyro).map(|c| c.axis).collect();
    let mut all = (record.channels.iter_mut()).filter(|c| c.quantity == Quantity::Temp);
    if let (Some(only), None) = (all.next(), all.next())
        && only.axis.is_some()
        && gyros.iter().any(|axis| *axis != only.axis)
    {
        let note = format!(
            "{} is the only thermometer, and is taken for all gyros: here it is called temp",
            only.name
        );
        only.axis = None;
        only.name = "temp".to_owned();
        record.notes.push(note);
    }
}

fn whole(values: &[f64]) -> Vec<u64> {
    values.iter().map(|&value| value as u64).collect()
}

fn place(record: &mut Record, column: Column, values: Vec<f64>) {
    match column.role {
        Role::Seq => record.seq = Some(unwrap(&whole(&values), 1 << 16)),
        Role::Ticks => record.t_ticks = Some(unwrap(&whole(&values), 1 << 32)),
        Role::Time { .. } => record.host_time_s = Some(values),
        Role::Flags => record.flags = Some(values.iter().map(|&value| value as u16).collect()),
        Role::Measured {
            quantity,
            unit,
            zero,
            scale,
            counts,
        } => {
            let (_, axis) = meaning(&column.name);
            // Where a row has no value, its count means nothing.
            let whole = counts.then(|| {
                values
                    .iter()
                    .map(|&v| if v.is_nan() { 0 } else { v as i32 })
                    .collect()
            });
            record.channels.push(Channel {
                name: column.name,
                quantity,
                axis,
                unit,
                // In the memory of the cells.
                values: values
                    .into_iter()
                    .map(|cell| (cell - zero) * scale)
                    .collect(),
                counts: whole,
                lsb: counts.then_some(scale),
            });
        }
    }
}

#[cfg(test)]
mod tests;
