//! Reading.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use model::record::{Channel, Header, Quantity, Record};

use super::angle::difference_angles;
use super::foreign::{convert, example, meaning};
use super::header::Lines;
use super::tables::{Table, read_table};
use super::{CaptureError, ColumnMapping, STANDARD_GRAVITY};

/// How to read.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// Which foreign column is what; empty for the stand's own captures.
    pub mapping: ColumnMapping,
    /// Sample rate where the file has none, Hz. Overrides the header.
    pub rate_hz: Option<f64>,
    /// Leave rows out that cannot be read, and count them.
    pub skip_bad: bool,
}

/// A record, and what was left out of it.
#[derive(Clone, Debug)]
pub struct Read {
    /// The record.
    pub record: Record,
    /// Rows that were left out by [`ReadOptions::skip_bad`].
    pub skipped: usize,
}

/// Reads a capture, `.csv` or `.csv.gz`, or by their endings files of arrays: `.npz`, `.npy`, `.parquet`, `.mat`, and
/// columns of text in `.txt`, `.dat`, `.tsv`. A gyro given in units of an angle is differenced into a rate.
///
/// # Errors
/// [`CaptureError`], which says what to do.
pub fn read_capture(path: &Path, options: &ReadOptions) -> Result<Read, CaptureError> {
    let io = |source| CaptureError::Io {
        path: path.to_owned(),
        source,
    };
    if let Some(table) = read_table(path) {
        return from_table(table?, options);
    }
    let file = BufReader::new(File::open(path).map_err(io)?);
    let is_gz = path.extension().is_some_and(|e| e == "gz");
    let read = if is_gz {
        read_from(
            BufReader::new(flate2::bufread::MultiGzDecoder::new(file)),
            options,
        )
    } else {
        read_from(file, options)
    };
    // An error of the stream has no path yet.
    read.map_err(|error| match error {
        CaptureError::Io { source, .. }
            if is_gz && source.kind() == std::io::ErrorKind::UnexpectedEof =>
        {
            CaptureError::CutOff {
                path: path.to_owned(),
            }
        }
        CaptureError::Io { source, .. } => io(source),
        other => other,
    })
}

/// A column of the file: what it is here, and how its cells become values.
struct Column {
    at: usize,
    name: String,
    role: Role,
}

enum Role {
    Seq,
    Ticks,
    Time,
    Flags,
    /// value = (cell - zero) * scale; `lsb` where cells are counts.
    Measured {
        quantity: Quantity,
        unit: String,
        zero: f64,
        scale: f64,
        counts: bool,
    },
}

/// Reads a capture from a stream.
///
/// # Errors
/// [`CaptureError`].
pub fn read_from(mut input: impl BufRead, options: &ReadOptions) -> Result<Read, CaptureError> {
    let io = |source| CaptureError::Io {
        path: "input".into(),
        source,
    };
    let mut lines = Lines::default();
    let (mut number, mut names) = (0, Vec::new());
    let mut line = String::new();
    while names.is_empty() {
        line.clear();
        if input.read_line(&mut line).map_err(io)? == 0 {
            return Err(CaptureError::Empty);
        }
        number += 1;
        let text = line.trim_start_matches('\u{feff}').trim();
        if text.starts_with('#') {
            lines.take(number, text);
        } else if !text.is_empty() {
            names = text
                .split(',')
                .map(|name| name.trim().trim_matches('"').to_owned())
                .collect();
        }
    }
    let mut header = lines.header()?;
    header.rate_hz = options.rate_hz.or(header.rate_hz);
    let columns = if options.mapping.columns.is_empty() {
        own_columns(&names, &lines, &options.mapping)?
    } else {
        mapped_columns(&names, &options.mapping)?
    };
    let mut rows = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(input);
    let mut cells: Vec<Vec<f64>> = columns.iter().map(|_| Vec::new()).collect();
    let (mut skipped, mut row) = (0, csv::StringRecord::new());
    let mut values = vec![0.0; columns.len()];
    loop {
        let result = match rows.read_record(&mut row) {
            Ok(false) => break,
            Ok(true) => {
                let at = row.position().map_or(0, csv::Position::line) + number as u64;
                parse_row(&row, at, &columns, names.len(), &mut values)
            }
            Err(error) => {
                let line = error.position().map_or(0, csv::Position::line) + number as u64;
                let why = error.to_string();
                match error.into_kind() {
                    csv::ErrorKind::Io(source) => return Err(io(source)),
                    _ => Err(CaptureError::BadRow {
                        line,
                        column: names[0].clone(),
                        found: "?".to_owned(),
                        expected: format!("not text: {why}"),
                    }),
                }
            }
        };
        match result {
            Ok(()) => cells
                .iter_mut()
                .zip(&values)
                .for_each(|(column, &value)| column.push(value)),
            Err(_) if options.skip_bad => skipped += 1,
            Err(error) => return Err(error),
        }
    }
    finish(header, columns, cells, skipped)
}

fn finish(
    header: Header,
    columns: Vec<Column>,
    cells: Vec<Vec<f64>>,
    skipped: usize,
) -> Result<Read, CaptureError> {
    if cells.first().is_none_or(Vec::is_empty) {
        return Err(CaptureError::Empty);
    }
    let mut record = Record {
        header,
        ..Record::default()
    };
    for (column, values) in columns.into_iter().zip(cells) {
        place(&mut record, column, values);
    }
    if skipped > 0 {
        let note = format!("rows that cannot be read and are left out (--skip-bad): {skipped}");
        record.notes.push(note);
    }
    difference_angles(&mut record)?;
    let record = analysis::rows::in_order(&record).into_owned();
    Ok(Read { record, skipped })
}

/// From the columns of a file of arrays. Without a mapping, names of ours are taken as they are: in the units the file
/// states, in counts with the header's scales where it says `counts`, else in deg/s and m/s^2.
fn from_table(table: Table, options: &ReadOptions) -> Result<Read, CaptureError> {
    let mut lines = Lines::default();
    lines.entries.extend(
        table
            .about
            .iter()
            .enumerate()
            .map(|(i, (key, value))| (i + 1, key.clone(), value.clone())),
    );
    let mut header = lines.header()?;
    header.rate_hz = options.rate_hz.or(header.rate_hz);
    let unit_of = |name: &str| {
        let key = format!("unit of {name}");
        let found = table.about.iter().find(|(k, _)| *k == key);
        found.map(|(_, unit)| unit.as_str())
    };
    let columns = if !options.mapping.columns.is_empty() {
        mapped_columns(&table.names, &options.mapping)?
    } else if let [name] = &table.names[..] {
        // A single series needs no name.
        let (quantity, _) = meaning(name);
        let unit = options.mapping.unit(name, quantity).or(unit_of(name));
        vec![measured(0, name, quantity, unit)?]
    } else {
        let has = |name: &str| table.names.iter().any(|n| n == name);
        let (mut columns, mut counted) = (Vec::new(), Vec::new());
        for (at, name) in table.names.iter().enumerate() {
            let (quantity, _) = meaning(name);
            let unit = options.mapping.unit(name, quantity).or(unit_of(name));
            let role = match name.as_str() {
                "seq" => Role::Seq,
                "t_ticks" if lines.get("tick_s").is_some() => Role::Ticks,
                "flags" => Role::Flags,
                "host_time_s" => Role::Time,
                "time" | "time_s" if !has("host_time_s") => Role::Time,
                _ if quantity == Quantity::Other => continue,
                _ if unit == Some("counts") => {
                    counted.push((at, name.clone()));
                    continue;
                }
                _ => measured(at, name, quantity, unit)?.role,
            };
            columns.push(Column {
                at,
                name: name.clone(),
                role,
            });
        }
        if !counted.is_empty() {
            let names: Vec<String> = counted.iter().map(|(_, name)| name.clone()).collect();
            let own = own_columns(&names, &lines, &options.mapping)?;
            columns.extend(own.into_iter().map(|c| Column {
                at: counted[c.at].0,
                ..c
            }));
        }
        if !columns.iter().any(|c| {
            matches!(
                c.role,
                Role::Measured {
                    quantity: Quantity::Gyro | Quantity::Acc,
                    ..
                }
            )
        }) {
            return Err(CaptureError::Columns {
                why: "no array has a name of the stand's captures (gyro_x, acc_x, ...)".to_owned(),
                columns: table.names.clone(),
                example: example(&table.names),
            });
        }
        columns
    };
    let mut cells = Vec::new();
    for column in &columns {
        let values = table.columns[column.at].clone();
        let whole = |v: f64| v >= 0.0 && v.fract() == 0.0;
        let bad = values.iter().position(|v| match column.role {
            Role::Seq | Role::Ticks => !whole(*v),
            Role::Flags => !whole(*v) || *v > 65_535.0,
            Role::Time => !v.is_finite(),
            Role::Measured { counts, .. } => {
                v.is_infinite() || (counts && !v.is_nan() && v.fract() != 0.0)
            }
        });
        if let Some(row) = bad {
            return Err(CaptureError::BadRow {
                line: row as u64 + 1,
                column: column.name.clone(),
                found: values[row].to_string(),
                expected: "not a number of the kind that this column has".to_owned(),
            });
        }
        cells.push(values);
    }
    finish(header, columns, cells, 0)
}

fn measured(
    at: usize,
    name: &str,
    quantity: Quantity,
    unit: Option<&str>,
) -> Result<Column, CaptureError> {
    let (unit, scale) = convert(quantity, unit)?;
    Ok(Column {
        at,
        name: name.to_owned(),
        role: Role::Measured {
            quantity,
            unit,
            zero: 0.0,
            scale,
            counts: false,
        },
    })
}

/// The columns of the stand's own format.
fn own_columns(
    names: &[String],
    lines: &Lines,
    mapping: &ColumnMapping,
) -> Result<Vec<Column>, CaptureError> {
    let mut columns = Vec::new();
    for (at, name) in names.iter().enumerate() {
        let (quantity, _) = meaning(name);
        let scaled = |zero, scale, unit: &str| Role::Measured {
            quantity,
            unit: unit.to_owned(),
            zero,
            scale,
            counts: true,
        };
        let role = match (name.as_str(), quantity) {
            ("seq", _) => Role::Seq,
            ("t_ticks", _) => {
                lines.needed("tick_s", name)?;
                Role::Ticks
            }
            ("host_time_s", _) => Role::Time,
            ("flags", _) => Role::Flags,
            (_, Quantity::Gyro) => scaled(0.0, lines.scale("gyro_lsb_dps", name)?, "deg/s"),
            (_, Quantity::Temp) => {
                let lsb = lines.scale("temp_lsb_c", name)?;
                scaled(-lines.needed("temp_zero_c", name)? / lsb, lsb, "degC")
            }
            (_, Quantity::Supply) => scaled(0.0, lines.scale("supply_lsb_v", name)?, "V"),
            (_, Quantity::Acc) => {
                let per_g = lines.scale("acc_counts_per_g", name)?;
                scaled(
                    lines.needed("acc_zero_counts", name)?,
                    STANDARD_GRAVITY / per_g,
                    "m/s^2",
                )
            }
            (_, Quantity::Pwm) => scaled(0.0, 1.0, "1"),
            (_, Quantity::Other) => {
                // The format may grow: what is not known is kept as it is, where the file says that it is ours.
                if lines.get("format").is_none() {
                    continue;
                }
                let unit = mapping.unit(name, quantity).unwrap_or("1").to_owned();
                Role::Measured {
                    quantity,
                    unit,
                    zero: 0.0,
                    scale: 1.0,
                    counts: false,
                }
            }
        };
        columns.push(Column {
            at,
            name: name.clone(),
            role,
        });
    }
    if columns.iter().any(|c| {
        matches!(
            c.role,
            Role::Measured {
                quantity: Quantity::Gyro | Quantity::Acc,
                ..
            }
        )
    }) {
        return Ok(columns);
    }
    Err(CaptureError::Columns {
        why: "no column has a name of the stand's captures (gyro_x, acc_x, ...)".to_owned(),
        columns: names.to_vec(),
        example: example(names),
    })
}

fn mapped_columns(names: &[String], mapping: &ColumnMapping) -> Result<Vec<Column>, CaptureError> {
    let mut columns = Vec::new();
    for (ours, theirs) in &mapping.columns {
        let Some(at) = names.iter().position(|name| name == theirs) else {
            return Err(CaptureError::Columns {
                why: format!("there is no column `{theirs}`"),
                columns: names.to_vec(),
                example: example(names),
            });
        };
        let role = match ours.as_str() {
            "seq" => Role::Seq,
            "time" | "host_time_s" => Role::Time,
            "flags" => Role::Flags,
            name => {
                let (quantity, _) = meaning(name);
                let (unit, scale) = convert(quantity, mapping.unit(name, quantity))?;
                Role::Measured {
                    quantity,
                    unit,
                    zero: 0.0,
                    scale,
                    counts: false,
                }
            }
        };
        columns.push(Column {
            at,
            name: ours.clone(),
            role,
        });
    }
    Ok(columns)
}

fn parse_row(
    row: &csv::StringRecord,
    line: u64,
    columns: &[Column],
    width: usize,
    values: &mut [f64],
) -> Result<(), CaptureError> {
    let bad = |column: &Column, found: &str, expected: &str| CaptureError::BadRow {
        line,
        column: column.name.clone(),
        found: found.to_owned(),
        expected: expected.to_owned(),
    };
    if row.len() != width
        && let Some(column) = columns.first()
    {
        return Err(bad(
            column,
            &format!("{} cells", row.len()),
            &format!("not a row of {width} cells"),
        ));
    }
    for (column, value) in columns.iter().zip(values) {
        let cell = row.get(column.at).unwrap_or_default();
        let is_measured = matches!(column.role, Role::Measured { .. });
        *value = match cell {
            "" | "nan" | "NaN" | "NAN" if is_measured => f64::NAN,
            text => match text.parse::<f64>() {
                Ok(number) if number.is_finite() => number,
                _ => return Err(bad(column, text, "not a finite number")),
            },
        };
        let whole = match column.role {
            Role::Seq | Role::Ticks => *value >= 0.0 && *value < 9e15 && value.fract() == 0.0,
            Role::Flags => *value >= 0.0 && *value <= 65_535.0 && value.fract() == 0.0,
            Role::Measured { counts: true, .. } => {
                value.is_nan() || (value.fract() == 0.0 && value.abs() < 1e9)
            }
            _ => true,
        };
        if !whole {
            return Err(bad(
                column,
                cell,
                "not a whole number of the range that this column has",
            ));
        }
    }
    Ok(())
}

fn whole(values: &[f64]) -> impl Iterator<Item = u64> {
    values.iter().map(|&value| value as u64)
}

fn place(record: &mut Record, column: Column, values: Vec<f64>) {
    match column.role {
        Role::Seq => record.seq = Some(unwrap(whole(&values), 1 << 16)),
        Role::Ticks => record.t_ticks = Some(unwrap(whole(&values), 1 << 32)),
        Role::Time => record.host_time_s = Some(values),
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
                values: values.iter().map(|&cell| (cell - zero) * scale).collect(),
                counts: whole,
                lsb: counts.then_some(scale),
            });
        }
    }
}

/// Undoes the wrapping of a counter of `modulus` steps, if it is wrapped. What goes back by less than half a turn, over
/// a wrap or not, stays where it is: a repeated or reordered row.
pub(super) fn unwrap(values: impl Iterator<Item = u64>, modulus: u64) -> Vec<u64> {
    let (mut turns, mut last) = (0, 0);
    values
        .map(|now| {
            // A value of `modulus` or more was unwrapped by whoever wrote it.
            if now < modulus && last < modulus && last > now && last - now > modulus / 2 {
                turns += modulus;
            }
            if now < modulus
                && last < modulus
                && turns > 0
                && now > last
                && now - last > modulus / 2
            {
                return now + turns - modulus;
            }
            last = now;
            now + turns
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const OURS: &str = "# format: imu-stand-capture/1\n# rate_hz: 20\n# tick_s: 4e-6\n# gyro_lsb_dps: 0.07326\n\
        # base: static\nseq,t_ticks,gyro_z,flags\n65534,4294960000,14,7\n65535,4294962500,-2,7\n0,5204,,7\n";

    fn read(text: &str) -> Result<Read, CaptureError> {
        read_from(text.as_bytes(), &ReadOptions::default())
    }

    #[test]
    fn counters_are_unwrapped_and_counts_scaled() {
        let record = read(OURS).unwrap().record;
        assert_eq!(record.seq, Some(vec![65_534, 65_535, 65_536]));
        assert_eq!(record.t_ticks.unwrap()[2], 4_294_972_500);
        let gyro = &record.channels[0];
        assert!((gyro.values[0] - 14.0 * 0.07326).abs() < 1e-12);
        assert!(gyro.values[2].is_nan(), "an empty cell is no value");
    }

    #[test]
    fn a_missing_key_is_named() {
        let text = OURS.replace("# gyro_lsb_dps: 0.07326\n", "");
        let error = read(&text).unwrap_err().to_string();
        assert!(
            error.contains("gyro_lsb_dps") && error.contains("gyro_z"),
            "{error}"
        );
    }

    #[test]
    fn a_corrupt_row_is_named_by_line_or_left_out_and_counted() {
        let text = OURS.replace("65535,4294962500,-2,7", "65535,4294962500,-2x,7");
        let error = read(&text).unwrap_err().to_string();
        assert!(error.starts_with("line 8, column `gyro_z`"), "{error}");
        let options = ReadOptions {
            skip_bad: true,
            ..ReadOptions::default()
        };
        let read = read_from(text.as_bytes(), &options).unwrap();
        assert_eq!((read.skipped, read.record.len()), (1, 2));
    }

    #[test]
    fn a_foreign_file_without_mapping_is_told_how_to_map_it() {
        let text = "# a note: of theirs\ntime_s,gx_dps,gy_dps,gz_dps,ax_mps2\n0,1,2,3,4\n";
        let error = read(text).unwrap_err();
        let help = miette::Diagnostic::help(&error).unwrap().to_string();
        assert!(
            help.contains("time=time_s,gyro_x=gx_dps,gyro_y=gy_dps,gyro_z=gz_dps,acc_x=ax_mps2"),
            "{help}"
        );
        let mapping =
            ColumnMapping::parse(Some("time=time_s,gyro_x=gx_dps"), Some("gyro=rad/s")).unwrap();
        let read = read_from(
            text.as_bytes(),
            &ReadOptions {
                mapping,
                ..ReadOptions::default()
            },
        )
        .unwrap();
        assert!((read.record.channels[0].values[0] - 57.295_779_5).abs() < 1e-6);
    }
}
