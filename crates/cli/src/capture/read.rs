//! Reading.

use std::borrow::Cow;
use std::ffi::OsStr;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use model::record::{Base, Channel, Header, Quantity, Record, fills, sentinels};

use super::angle::difference_angles;
use super::columns::{Column, Columns, Held, Role, Said, columns};
use super::corrected::without_unapplied;
use super::error::brief;
use super::foreign::meaning;
use super::forms::as_table;
use super::header::Lines;
use super::infinite::Infinite;
use super::interleaved;
use super::layout::{Layout, next_row_into};
use super::logs::read_log;
use super::order::{check_rate, check_times, check_varies, in_order, unwrap, unwrap_times};
use super::phone;
use super::plausible::{doubts, in_range};
use super::preamble::{stated, stated_by};
use super::propose::proposed;
use super::propose::seen::{ROWS, Seen, first_rows};
use super::rows::RowReader;
use super::scales::Scales;
use super::several::Sensors;
use super::skipped::keep_places;
use super::span::Span;
use super::steady::{by_rounded_times, one_rate, unsteady};
use super::steps::{LARGEST_COUNT, own_steps};
use super::stream::{TextLines, io, named, unpacked};
use super::table::Table;
#[cfg(feature = "native")]
use super::tables::read_table;
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
    /// What the base did, whatever the header says of it.
    pub base: Option<Base>,
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
        return from_table(table?, options, Of::File);
    }
    let open = || unpacked(BufReader::with_capacity(READ_AT_ONCE, File::open(path)?));
    // An error of the stream has no path yet.
    open()
        .map_err(io)
        .and_then(|text| read_named(text, options, path.file_stem().and_then(OsStr::to_str)))
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
pub fn read_from(input: impl BufRead, options: &ReadOptions) -> Result<Read, CaptureError> {
    read_named(input, options, None)
}

/// The same of a file of this name, without its ending.
fn read_named(
    mut input: impl BufRead,
    options: &ReadOptions,
    file: Option<&str>,
) -> Result<Read, CaptureError> {
    if let Some(table) = read_log(&mut input, options.topic.as_deref()) {
        return from_table(table?, options, Of::File);
    }
    no_topics(options)?;
    let (input, forms) = as_table(input).map_err(io)?;
    let mut text = TextLines::new(input)?;
    let mut layout = Layout::read(&mut text)?;
    forms.take(&mut layout)?;
    let of_phone = phone::take(&mut layout, file, &options.mapping);
    if layout.first.is_none() {
        // Before anything is asked of its columns.
        return Err(CaptureError::Empty);
    }
    let mut header = layout.lines.header()?;
    let in_words = match header.rate_hz {
        Some(_) => Ok(None),
        None => stated(&layout.said),
    };
    header.rate_hz = options.rate_hz.or(header.rate_hz);
    let scales = Scales::take(&mut layout, &mut text)?;
    let said = Said {
        lines: &layout.lines,
        names: &layout.names,
        numbered: layout.numbered,
        units: &layout.units,
        knows_rate: header.rate_hz.is_some(),
        states_rate: matches!(in_words, Ok(Some(_))),
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
            let knows_rate = said.knows_rate || said.states_rate;
            let error = proposed(error, &said, &options.mapping, knows_rate, &seen);
            return Err(forms.mention(scales.mention(error)));
        }
        Ok(found) => found,
    };
    (found.ask()).map_err(|error| forms.mention(scales.mention(error)))?;
    found.notes.extend(of_phone);
    scales.state(&mut header, &found);
    found.notes.extend(scales.notes);
    if let Some((first, last)) = layout.preamble {
        found.notes.push(format!(
            "the table begins in line {}: what stands before, from line {first} on, is no part of it",
            last + 1
        ));
    }
    found.keep_rate(in_words, options.rate_hz);
    let mut values: Vec<Vec<f64>> = found.columns.iter().map(|_| Vec::new()).collect();
    let mut reader = RowReader::new(&found.columns, &layout.names, layout.cells);
    let (mut skipped, mut again) = (Vec::new(), Vec::new());
    let (mut row, mut cells) = layout.first.take().unzip();
    let cells = cells.get_or_insert_default();
    while let Some(line) = row {
        match reader.read(cells, line) {
            Ok(()) => values
                .iter_mut()
                .zip(&reader.values)
                .for_each(|(column, &value)| column.push(value)),
            Err(_) if reader.is_names(cells, said.names) => again.push(line),
            // Such rows are the large readings.
            Err(error @ CaptureError::Ambiguous { .. }) => return Err(error),
            Err(_) if options.skip_bad => skipped.push(values.first().map_or(0, Vec::len)),
            Err(error) => return Err(error),
        }
        row = next_row_into(&mut text, cells)?;
    }
    let odd = std::mem::take(&mut reader.odd);
    let grouped = reader.grouped();
    reader.sensors.take().map_or(Ok(()), Sensors::one)?;
    found.notes.extend(grouped);
    found.notes.extend(reader.infinite());
    found.time_is_assumed &= !reader.times_have_units();
    found.notes.extend(forms.notes());
    if let Some(first) = again.first() {
        found.notes.push(format!(
            "the names of the columns stand again {} x, first in line {first}, as where files were put end to end: the rows are read on",
            again.len()
        ));
    }
    finish(header, found, values, options, &skipped, &odd)
}

/// A record of a program's columns: by the names and units of `table.about` (`rate_hz`, `unit of gyro_x`, ...), or by a
/// mapping; in deg/s, m/s^2, degC and V where neither says a unit.
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
    from_table(table, options, Of::Caller)
}

/// Where named columns come from.
#[derive(Clone, Copy, PartialEq)]
enum Of {
    /// A file, whose gyros may be in deg/s or rad/s.
    File,
    /// A program, which was told that deg/s are meant where it says no unit.
    Caller,
}

/// From named columns. Without a mapping, names of ours are taken as they are: in the units stated, in counts with the
/// header's scales where they say `counts`, else in the usual ones, but for the gyros of a file.
fn from_table(table: Table, options: &ReadOptions, of: Of) -> Result<Read, CaptureError> {
    let mut lines = Lines::default();
    lines.entries.extend(
        (table.about.iter().enumerate())
            .map(|(i, (key, value))| (i + 1, key.clone(), value.clone())),
    );
    let mut header = lines.header()?;
    let in_words = match header.rate_hz {
        Some(_) => Ok(None),
        None => stated_by(&lines),
    };
    header.rate_hz = options.rate_hz.or(header.rate_hz);
    let stated = |name: &String| lines.unit_of(name).map(str::to_owned);
    let units: Vec<Option<String>> = table.names.iter().map(stated).collect();
    let said = Said {
        lines: &lines,
        names: &table.names,
        numbered: false,
        units: &units,
        knows_rate: header.rate_hz.is_some(),
        states_rate: matches!(in_words, Ok(Some(_))),
        is_scaled: true,
    };
    let mut found = columns(&said, &options.mapping).map_err(|error| {
        let part = |of: &Vec<f64>| of.iter().copied().take(ROWS).collect();
        let seen = Seen(table.columns.iter().map(part).collect());
        proposed(
            error,
            &said,
            &options.mapping,
            said.knows_rate || said.states_rate,
            &seen,
        )
    })?;
    if of == Of::File {
        found.ask()?;
    }
    found.notes.splice(..0, table.notes);
    found.keep_rate(in_words, options.rate_hz);
    let (mut cells, mut infinite) = (Vec::new(), Infinite::default());
    for column in &found.columns {
        let mut values = table.columns[column.at].clone();
        if matches!(column.role, Role::Measured { .. }) {
            infinite.leave_out(&mut values, &column.name);
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
    found.notes.extend(infinite.note());
    finish(header, found, cells, options, &[], &[])
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
    without_unapplied(&mut record);
    own_steps(&mut record);
    if !skipped.is_empty() {
        let kept = keep_places(&mut record, skipped);
        let note = format!(
            "rows that cannot be read and are left out (--skip-bad): {}; {kept} of them keep their places, without readings",
            skipped.len()
        );
        record.notes.push(note);
    }
    let in_words = found.stated_rate.take();
    let has_times = record.host_time_s.is_some() || record.t_ticks.is_some();
    if let (Some(in_words), false) = (&in_words, has_times) {
        in_words.take(&mut record, options.rate_hz);
    }
    if let (Some(in_words), Some(times)) = (&in_words, &mut record.host_time_s)
        && found.time_is_assumed
        && let Some((unit, s)) = in_words.unit_of(times)
    {
        times.iter_mut().for_each(|t| *t *= s);
        found.time_is_assumed = false;
        record.notes.push(in_words.gives(unit));
    }
    interleaved::take(&mut record);
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
    if options.rate_hz.is_none() && stated.is_none() {
        let note = by_rounded_times(&record)?;
        record.notes.extend(note);
    }
    check_rate(&mut record, options.rate_hz)?;
    if let (Some(in_words), true) = (&in_words, has_times) {
        in_words.hold_against(&mut record);
    }
    difference_angles(&mut record)?;
    share_thermometer(&mut record);
    if let Cow::Owned(kept) = fills::left_out(Cow::Borrowed(&record)) {
        in_range(&record, &kept)?;
        record = kept;
    }
    let mut record = sentinels::left_out(Cow::Owned(record)).into_owned();
    record.header.base = options.base.or(record.header.base);
    let doubts = doubts(&record, !found.assumed_gyros.is_empty());
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
        if let Some((turns, bits)) = unwrap_times(times, scale) {
            found.notes.push(format!(
                "the time begins again ({turns} x), as a counter of {bits} bits does: taken to go on"
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

/// Whether a cell may be a count.
fn is_count(v: &f64) -> bool {
    v.is_nan() || (v.fract() == 0.0 && v.abs() < LARGEST_COUNT)
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
            held,
        } => {
            let (_, axis) = meaning(&column.name);
            let counts = match held {
                Held::Values => false,
                Held::Counts => true,
                Held::Scaled => values.iter().all(is_count),
            };
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
