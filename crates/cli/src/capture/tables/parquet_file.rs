//! Parquet.

use std::fs::File;
use std::path::Path;

use parquet::basic::{LogicalType, TimeUnit, Type};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl, get_column_reader};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::ColumnDescPtr;

use super::super::pages::{Pages, is_packed_otherwise};
use super::{Arrays, open};

fn bad(error: ParquetError) -> String {
    format!("it cannot be read as Parquet: {error}")
}

/// What is wrong with a file that has no end of a Parquet file, where its index stands.
fn without_end(error: ParquetError, path: &Path) -> String {
    let begins = || {
        let mut start = [0; 4];
        std::io::Read::read_exact(&mut open(path).ok()?, &mut start).ok()?;
        (&start == b"PAR1").then_some(())
    };
    match begins() {
        Some(()) => format!(
            "it begins as Parquet and does not end so: was it copied, or written, to its end? ({error})"
        ),
        None => bad(error),
    }
}

pub(super) fn parquet_file(path: &Path) -> Result<Arrays, String> {
    let reader =
        SerializedFileReader::new(open(path)?).map_err(|error| without_end(error, path))?;
    let mut file = open(path)?;
    let metadata = reader.metadata().file_metadata();
    let mut out = Arrays::of(&file)?;
    let rows = metadata.num_rows();
    let rows = u64::try_from(rows).map_err(|_| format!("it claims {rows} rows"))?;
    for entry in metadata.key_value_metadata().into_iter().flatten() {
        // What libraries keep for themselves is nothing about the stand.
        if let Some(value) = &entry.value
            && !["pandas", "ARROW:schema"].contains(&entry.key.as_str())
        {
            out.about.push((entry.key.clone(), value.clone()));
        }
    }
    for (at, column) in metadata.schema_descr().columns().iter().enumerate() {
        let is_of_numbers = !matches!(
            column.physical_type(),
            Type::BYTE_ARRAY | Type::FIXED_LEN_BYTE_ARRAY | Type::INT96
        );
        if column.max_rep_level() > 0 || !is_of_numbers {
            continue;
        }
        out.reserve(column.name(), &[rows])?;
        let tick_s = tick_of_time(column);
        if let Some(cells) = cells(&reader, &mut file, at, column, tick_s)? {
            if tick_s.is_some() {
                let unit = (format!("unit of {}", column.name()), "s".to_owned());
                out.about.push(unit);
            }
            out.columns.push((column.name().to_owned(), cells));
        }
    }
    Ok(out)
}

/// What a column of times counts, s; `None` for other columns.
fn tick_of_time(column: &ColumnDescPtr) -> Option<f64> {
    match column.logical_type_ref() {
        Some(LogicalType::Timestamp(stamp)) => Some(match stamp.unit {
            TimeUnit::MILLIS => 1e-3,
            TimeUnit::MICROS => 1e-6,
            TimeUnit::NANOS => 1e-9,
        }),
        _ => None,
    }
}

/// The cells of a column, group of rows by group; `None` where they are no numbers.
fn cells(
    reader: &SerializedFileReader<File>,
    file: &mut File,
    at: usize,
    column: &ColumnDescPtr,
    tick_s: Option<f64>,
) -> Result<Option<Vec<f64>>, String> {
    let present = column.max_def_level();
    let mut cells: Vec<f64> = Vec::new();
    let mut first = None;
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group).map_err(bad)?;
        let rows = group.metadata().num_rows() as usize;
        let chunk = group.metadata().column(at);
        let column_reader = if is_packed_otherwise(chunk.compression()) {
            Pages::of(file, chunk).map(|pages| get_column_reader(column.clone(), Box::new(pages)))
        } else {
            group.get_column_reader(at)
        };
        let part = match column_reader.map_err(bad)? {
            ColumnReader::DoubleColumnReader(r) => numbers(r, rows, present, |v| *v),
            ColumnReader::FloatColumnReader(r) => numbers(r, rows, present, |v| f64::from(*v)),
            ColumnReader::Int32ColumnReader(r) => numbers(r, rows, present, |v| f64::from(*v)),
            ColumnReader::BoolColumnReader(r) => {
                numbers(r, rows, present, |v| f64::from(u8::from(*v)))
            }
            ColumnReader::Int64ColumnReader(r) => match tick_s {
                // From the first stamp on: nanoseconds since 1970 have more digits than an f64.
                Some(tick_s) => numbers(r, rows, present, |v| {
                    let first = *first.get_or_insert(*v);
                    (*v - first) as f64 * tick_s
                }),
                None => numbers(r, rows, present, |v| *v as f64),
            },
            _ => return Ok(None),
        };
        cells.extend(part.map_err(bad)?);
    }
    Ok(Some(cells))
}

/// The cells of a column in a group of rows, NaN where there is nothing.
fn numbers<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    present: i16,
    mut number: impl FnMut(&T::T) -> f64,
) -> Result<Vec<f64>, ParquetError> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    let mut read = 0;
    while read < rows {
        let (records, _, _) =
            reader.read_records(rows - read, Some(&mut levels), None, &mut values)?;
        if records == 0 {
            break;
        }
        read += records;
    }
    if present == 0 {
        return Ok(values.iter().map(number).collect());
    }
    let mut values = values.iter();
    Ok(levels
        .iter()
        .map(|level| {
            if *level < present {
                return f64::NAN;
            }
            values.next().map_or(f64::NAN, &mut number)
        })
        .collect())
}
