//! The data themselves as NPZ, Parquet or plain CSV.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::Arc;

use model::record::Record;
use npyz::WriterBuilder as _;
use parquet::basic::{Compression, Repetition, Type as Physical};
use parquet::data_type::{DoubleType, Int64Type};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use crate::capture::steps::in_one_step;

/// Why data cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DataError {
    /// The file system says no.
    #[error("cannot write it: {0}")]
    Io(#[from] std::io::Error),
    /// The archive of an NPZ.
    #[error("cannot write the archive: {0}")]
    Zip(#[from] zip::result::ZipError),
    /// Parquet.
    #[error("cannot write the Parquet file: {0}")]
    Parquet(#[from] parquet::errors::ParquetError),
}

/// Cells of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Cells {
    /// Measured; NaN where there is nothing.
    Real(Vec<f64>),
    /// Counted.
    Whole(Vec<i64>),
}

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name.
    pub name: String,
    /// Unit; `1` for what is counted.
    pub unit: String,
    /// Cells.
    pub cells: Cells,
}

/// What is exported.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Columns of one length.
    pub columns: Vec<Column>,
    /// What else is known: the capture's header, and `unit of COLUMN`.
    pub about: Vec<(String, String)>,
}

impl Table {
    /// Of a record. `time_s` is the device's time from the first row on, where it has one; with `raw` channels are in
    /// counts where they have them, and keep the capture's header, else they are scaled.
    #[must_use]
    pub fn of(record: &Record, raw: bool) -> Self {
        let record = &*in_one_step(record);
        let mut columns = vec![Column {
            name: "time_s".to_owned(),
            unit: "s".to_owned(),
            cells: Cells::Real(times(record)),
        }];
        let mut whole = |name: &str, cells: Option<Vec<i64>>| {
            columns.extend(cells.map(|cells| Column {
                name: name.to_owned(),
                unit: "1".to_owned(),
                cells: Cells::Whole(cells),
            }));
        };
        let signed = |values: &Vec<u64>| values.iter().map(|v| *v as i64).collect();
        whole("seq", record.seq.as_ref().map(signed));
        whole("t_ticks", record.t_ticks.as_ref().map(signed));
        let flags = |values: &Vec<u16>| values.iter().map(|v| i64::from(*v)).collect();
        whole("flags", record.flags.as_ref().map(flags));
        if let (Some(host), true) = (&record.host_time_s, record.t_ticks.is_some()) {
            columns.push(Column {
                name: "host_time_s".to_owned(),
                unit: "s".to_owned(),
                cells: Cells::Real(host.clone()),
            });
        }
        for channel in &record.channels {
            let counts = channel
                .counts
                .as_ref()
                .filter(|_| raw && channel.values.iter().all(|v| v.is_finite()));
            let (unit, cells) = match counts {
                Some(counts) => (
                    "counts".to_owned(),
                    Cells::Whole(counts.iter().map(|c| i64::from(*c)).collect()),
                ),
                None => (channel.unit.clone(), Cells::Real(channel.values.clone())),
            };
            columns.push(Column {
                name: channel.name.clone(),
                unit,
                cells,
            });
        }
        let mut about = record.header.entries.clone();
        about.retain(|(key, _)| key != "format");
        about.extend(
            columns
                .iter()
                .map(|c| (format!("unit of {}", c.name), c.unit.clone())),
        );
        Self { columns, about }
    }

    /// Rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        match self.columns.first().map(|c| &c.cells) {
            Some(Cells::Real(cells)) => cells.len(),
            Some(Cells::Whole(cells)) => cells.len(),
            None => 0,
        }
    }

    /// An NPZ: one array for each column, and `about.json` with the header and the units, a text that is an array too, so that
    /// whoever goes over all arrays meets nothing else.
    ///
    /// # Errors
    /// [`DataError`].
    pub fn write_npz(&self, path: &Path) -> Result<(), DataError> {
        let mut archive = zip::ZipWriter::new(BufWriter::new(File::create(path)?));
        let options = zip::write::SimpleFileOptions::default()
            .compression_method(zip::CompressionMethod::Deflated)
            .large_file(self.rows() > 100_000_000);
        for column in &self.columns {
            archive.start_file(format!("{}.npy", column.name), options)?;
            match &column.cells {
                Cells::Real(cells) => write_npy(&mut archive, cells)?,
                Cells::Whole(cells) => write_npy(&mut archive, cells)?,
            }
        }
        let about: serde_json::Map<String, serde_json::Value> = self
            .about
            .iter()
            .map(|(key, value)| (key.clone(), value.clone().into()))
            .collect();
        archive.start_file("about.json.npy", options)?;
        let about = serde_json::to_string_pretty(&about).unwrap_or_default();
        archive.write_all(&npy_of_text(&about))?;
        archive.finish()?.flush()?;
        Ok(())
    }

    /// A Parquet file, Snappy-compressed; the header and the units are its key-value metadata.
    ///
    /// # Errors
    /// [`DataError`].
    pub fn write_parquet(&self, path: &Path) -> Result<(), DataError> {
        let fields = self.columns.iter().map(|column| {
            let physical = match column.cells {
                Cells::Real(_) => Physical::DOUBLE,
                Cells::Whole(_) => Physical::INT64,
            };
            Type::primitive_type_builder(&column.name, physical)
                .with_repetition(Repetition::REQUIRED)
                .build()
                .map(Arc::new)
        });
        let schema = Type::group_type_builder("capture")
            .with_fields(fields.collect::<Result<_, _>>()?)
            .build()?;
        let about = self
            .about
            .iter()
            .map(|(key, value)| KeyValue::new(key.clone(), value.clone()))
            .collect();
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_key_value_metadata(Some(about))
            .build();
        let file = BufWriter::new(File::create(path)?);
        let mut writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties))?;
        let mut group = writer.next_row_group()?;
        for column in &self.columns {
            let Some(mut out) = group.next_column()? else {
                break;
            };
            match &column.cells {
                Cells::Real(cells) => {
                    out.typed::<DoubleType>().write_batch(cells, None, None)?;
                }
                Cells::Whole(cells) => {
                    out.typed::<Int64Type>().write_batch(cells, None, None)?;
                }
            }
            out.close()?;
        }
        group.close()?;
        writer.close()?;
        Ok(())
    }

    /// A CSV with the header and the units as `#` lines; `.gz` compresses it.
    ///
    /// # Errors
    /// [`DataError`].
    pub fn write_csv(&self, path: &Path) -> Result<(), DataError> {
        let file = BufWriter::new(File::create(path)?);
        if path.extension().is_some_and(|e| e == "gz") {
            let mut out = flate2::write::GzEncoder::new(file, flate2::Compression::default());
            self.csv(&mut out)?;
            out.finish()?.flush()?;
        } else {
            let mut out = file;
            self.csv(&mut out)?;
            out.flush()?;
        }
        Ok(())
    }

    /// The same to a stream.
    ///
    /// # Errors
    /// The stream's.
    pub fn csv(&self, out: &mut impl Write) -> std::io::Result<()> {
        for (key, value) in &self.about {
            writeln!(out, "# {key}: {value}")?;
        }
        let names: Vec<&str> = self.columns.iter().map(|c| c.name.as_str()).collect();
        writeln!(out, "{}", names.join(","))?;
        for row in 0..self.rows() {
            for (k, column) in self.columns.iter().enumerate() {
                let comma = if k == 0 { "" } else { "," };
                match &column.cells {
                    Cells::Real(cells) if cells[row].is_nan() => write!(out, "{comma}")?,
                    Cells::Real(cells) => write!(out, "{comma}{}", cells[row])?,
                    Cells::Whole(cells) => write!(out, "{comma}{}", cells[row])?,
                }
            }
            writeln!(out)?;
        }
        Ok(())
    }
}

/// One NPY, with its type's own layout.
fn write_npy<T: npyz::AutoSerialize + Copy>(
    out: &mut impl Write,
    cells: &[T],
) -> std::io::Result<()> {
    let mut out = npyz::WriteOptions::new()
        .default_dtype()
        .shape(&[cells.len() as u64])
        .writer(out)
        .begin_nd()?;
    out.extend(cells.iter().copied())?;
    out.finish()
}

/// A text as NumPy writes one: an array without dimensions, of one string in UTF-32.
fn npy_of_text(text: &str) -> Vec<u8> {
    let descr = format!(
        "{{'descr': '<U{}', 'fortran_order': False, 'shape': (), }}",
        text.chars().count()
    );
    // Magic, version and length are 10 bytes; all of it is a multiple of 64, with a line's end.
    let length = (10 + descr.len() + 1).next_multiple_of(64) - 10;
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend((length as u16).to_le_bytes());
    out.extend(format!("{descr:<0$}\n", length - 1).into_bytes());
    out.extend(
        text.chars()
            .flat_map(|letter| u32::from(letter).to_le_bytes()),
    );
    out
}

/// Time of each row from the first one on, s: the device's, else the host's, else by the rate; NaN where all three lack.
fn times(record: &Record) -> Vec<f64> {
    if let (Some(ticks), Some(tick_s)) = (&record.t_ticks, record.header.tick_s) {
        let first = ticks.first().copied().unwrap_or(0);
        return ticks
            .iter()
            .map(|t| t.wrapping_sub(first) as i64 as f64 * tick_s)
            .collect();
    }
    if let Some(host) = &record.host_time_s {
        let first = host.first().copied().unwrap_or(0.0);
        return host.iter().map(|t| t - first).collect();
    }
    let period = record.header.rate_hz.map_or(f64::NAN, |rate| 1.0 / rate);
    (0..record.len()).map(|k| k as f64 * period).collect()
}
