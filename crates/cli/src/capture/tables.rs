//! Files of others that hold arrays: NPZ and NPY, Parquet, MATLAB's .mat, HDF5. Each becomes named columns.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Cursor, Read as _, Seek as _, SeekFrom};
use std::path::Path;

use parquet::basic::{LogicalType, TimeUnit, Type};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl, get_column_reader};
use parquet::data_type::DataType;
use parquet::file::reader::{FileReader, SerializedFileReader};

use super::CaptureError;
use super::error::brief;
use super::pages::{Pages, is_packed_otherwise};
use super::table::Table;

type Reader = fn(&Path) -> Result<Arrays, String>;

/// Who reads a file: by how it begins, else by its ending.
fn reader(path: &Path) -> Option<Reader> {
    let mut start = [0; 8];
    let whole = File::open(path).and_then(|mut file| file.read_exact(&mut start));
    let by_start: [(&[u8], Reader); 4] = [
        (b"PAR1", parquet_file),
        (b"\x89HDF\r\n\x1a\n", hdf5),
        (b"\x93NUMPY", npy),
        (b"MATLAB", mat),
    ];
    let known = by_start.iter().find(|(magic, _)| start.starts_with(magic));
    if let (Ok(()), Some((_, read))) = (whole, known) {
        return Some(*read);
    }
    let ending = path.extension()?.to_str()?.to_ascii_lowercase();
    Some(match ending.as_str() {
        "npz" => npz,
        "npy" => npy,
        "parquet" | "pq" => parquet_file,
        "mat" => mat,
        "h5" | "hdf5" => hdf5,
        _ => return None,
    })
}

/// Reads a file of arrays; `None` where it is none.
pub(crate) fn read_table(path: &Path) -> Option<Result<Table, CaptureError>> {
    let read = reader(path)?;
    Some(
        read(path)
            .and_then(Arrays::table)
            .map_err(|why| CaptureError::Table {
                path: path.to_owned(),
                why,
            }),
    )
}

/// Arrays as they stand in a file: name and columns; several of them are called `name[0]`, `name[1]`, ...
struct Arrays {
    columns: Vec<(String, Vec<f64>)>,
    about: Vec<(String, String)>,
    /// Bytes that its numbers may still take.
    room: u64,
}

/// Bytes that the numbers of a file may take beyond its own length: packed files can claim, and unpack to, any size.
const ROOM: u64 = 1 << 30;
/// Bytes of a number here.
const NUMBER: u64 = size_of::<f64>() as u64;

impl Arrays {
    /// Nothing yet of that file.
    fn of(file: &File) -> Result<Self, String> {
        let length = file.metadata().map_err(|error| error.to_string())?.len();
        Ok(Self {
            columns: Vec::new(),
            about: Vec::new(),
            room: ROOM.saturating_add(length),
        })
    }

    /// Takes room for an array before it is read; an error where there is none.
    fn reserve(&mut self, name: &str, shape: &[u64]) -> Result<(), String> {
        let size = (shape.iter()).try_fold(NUMBER, |size, n| size.checked_mul(*n));
        match size.and_then(|size| self.room.checked_sub(size)) {
            Some(left) => {
                self.room = left;
                Ok(())
            }
            None => {
                let shape: Vec<String> = shape.iter().map(u64::to_string).collect();
                Err(format!(
                    "array `{}` of {} numbers, and what is read before it, would take more than {} GiB beyond the length of the \
                     file; write the columns that are needed, or a part of the rows, to a file of their own",
                    brief(name),
                    shape.join(" x "),
                    ROOM >> 30
                ))
            }
        }
    }

    /// Takes an array of up to two dimensions; the longer one is time. `by_rows` says that the last index runs fastest.
    fn add(&mut self, name: &str, shape: &[usize], values: Vec<f64>, by_rows: bool) {
        let (rows, columns) = match *shape {
            [] | [1] | [1, 1] => {
                if let [value] = values[..] {
                    self.about.push((name.to_owned(), value.to_string()));
                }
                return;
            }
            [n] => (n, 1),
            [a, b] => (a, b),
            _ => return,
        };
        if rows == 1 || columns == 1 {
            self.columns.push((name.to_owned(), values));
            return;
        }
        let (time, count, time_runs_fastest) = if rows >= columns {
            (rows, columns, !by_rows)
        } else {
            (columns, rows, by_rows)
        };
        for k in 0..count {
            let column = (0..time).map(|i| {
                if time_runs_fastest {
                    values[k * time + i]
                } else {
                    values[i * count + k]
                }
            });
            self.columns
                .push((format!("{name}[{k}]"), column.collect()));
        }
    }

    /// The columns that have the length of most of the numbers.
    fn table(self) -> Result<Table, String> {
        let mut numbers: BTreeMap<usize, usize> = BTreeMap::new();
        for (_, column) in &self.columns {
            *numbers.entry(column.len()).or_default() += column.len();
        }
        let Some(length) = numbers
            .into_iter()
            .max_by_key(|(_, numbers)| *numbers)
            .map(|(length, _)| length)
            .filter(|length| *length > 0)
        else {
            return Err("it holds no array of numbers with one or two dimensions".to_owned());
        };
        let (names, columns) = self
            .columns
            .into_iter()
            .filter(|(_, column)| column.len() == length)
            .unzip();
        Ok(Table {
            names,
            columns,
            about: self.about,
            notes: Vec::new(),
        })
    }
}

fn open(path: &Path) -> Result<File, String> {
    File::open(path).map_err(|error| error.to_string())
}

fn npy(path: &Path) -> Result<Arrays, String> {
    let file = open(path)?;
    let mut out = Arrays::of(&file)?;
    npy_array(&mut out, "values", BufReader::new(file))?;
    Ok(out)
}

fn npz(path: &Path) -> Result<Arrays, String> {
    let bad = |error: zip::result::ZipError| format!("it is no NPZ: {error}");
    let file = open(path)?;
    let mut out = Arrays::of(&file)?;
    let mut archive = zip::ZipArchive::new(BufReader::new(file)).map_err(bad)?;
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).map_err(bad)?;
        let name = entry.name().map_err(bad)?.into_owned();
        if let Some(name) = name.strip_suffix(".npy") {
            npy_array(&mut out, name, &mut entry)
                .map_err(|why| format!("array `{name}`: {why}"))?;
        } else if name == "about.json" {
            let mut text = String::new();
            (entry.by_ref().take(LONGEST_TEXT).read_to_string(&mut text))
                .map_err(|error| format!("about.json: {error}"))?;
            let about: BTreeMap<String, String> =
                serde_json::from_str(&text).map_err(|error| format!("about.json: {error}"))?;
            out.about.extend(about);
        }
    }
    Ok(out)
}

/// Bytes of the text about a file, and of the header of an array, that are read at most.
const LONGEST_TEXT: u64 = 1 << 16;

/// The header of an array of NumPy as it stands, and the shape that it says. Magic, version of the format and length of the text
/// come before it, that in two bytes in version 1 and in four later. The shape is read here, since whoever multiplies it without
/// looking fails.
fn npy_header(mut input: impl std::io::Read) -> Result<(Vec<u8>, Vec<u64>), String> {
    let mut header = vec![0; 10];
    let mut fill = |bytes: &mut [u8]| input.read_exact(bytes).map_err(|error| error.to_string());
    fill(&mut header)?;
    let mut length = [header[8], header[9], 0, 0];
    if header[6] > 1 {
        fill(&mut length[2..])?;
        header.extend(&length[2..]);
    }
    let length = u32::from_le_bytes(length);
    if u64::from(length) > LONGEST_TEXT {
        return Err(format!("its header claims {length} bytes"));
    }
    let from = header.len();
    header.resize(from + length as usize, 0);
    fill(&mut header[from..])?;
    let text = String::from_utf8_lossy(&header[from..]);
    let said = text
        .split_once("shape")
        .and_then(|(_, rest)| rest.split_once('('));
    let said = said.and_then(|(_, rest)| rest.split_once(')'));
    let sizes = said
        .map_or("", |(sizes, _)| sizes)
        .split(',')
        .map(str::trim);
    let sizes = sizes.filter(|size| !size.is_empty()).map(str::parse);
    let shape: Result<Vec<u64>, _> = sizes.collect();
    let shape = shape.map_err(|_| format!("its shape is `{}`", brief(said.map_or("", |s| s.0))))?;
    Ok((header, shape))
}

/// Adds an array; one of text or objects is left out.
fn npy_array(out: &mut Arrays, name: &str, mut input: impl std::io::Read) -> Result<(), String> {
    fn cells<T: npyz::Deserialize>(
        file: npyz::NpyFile<impl std::io::Read>,
        number: fn(T) -> f64,
    ) -> Result<Vec<f64>, String> {
        let cells = file.into_vec::<T>().map_err(|error| error.to_string())?;
        Ok(cells.into_iter().map(number).collect())
    }
    let (header, shape) = npy_header(&mut input)?;
    out.reserve(name, &shape)?;
    let header = npyz::NpyHeader::from_reader(Cursor::new(header));
    let header = header.map_err(|error| {
        // A parser shows the text that it does not understand, however long.
        let why = error.to_string();
        brief(why.lines().next().unwrap_or_default())
    })?;
    let file = npyz::NpyFile::with_header(header, input);
    let shape: Vec<usize> = file.shape().iter().map(|n| *n as usize).collect();
    let by_rows = file.order() == npyz::Order::C;
    let npyz::DType::Plain(kind) = file.dtype() else {
        return Err("a structured array: save its fields as arrays of their own".to_owned());
    };
    let values = match &kind.to_string()[1..] {
        "f8" => cells::<f64>(file, |v| v)?,
        "f4" => cells::<f32>(file, f64::from)?,
        "i8" => cells::<i64>(file, |v| v as f64)?,
        "i4" => cells::<i32>(file, f64::from)?,
        "i2" => cells::<i16>(file, f64::from)?,
        "i1" => cells::<i8>(file, f64::from)?,
        "u8" => cells::<u64>(file, |v| v as f64)?,
        "u4" => cells::<u32>(file, f64::from)?,
        "u2" => cells::<u16>(file, f64::from)?,
        "u1" => cells::<u8>(file, f64::from)?,
        "b1" => cells::<bool>(file, |v| f64::from(u8::from(v)))?,
        _ => return Ok(()),
    };
    out.add(name, &shape, values, by_rows);
    Ok(())
}

fn mat(path: &Path) -> Result<Arrays, String> {
    let mut start = [0; 10];
    let mut file = open(path)?;
    let mut out = Arrays::of(&file)?;
    if file.read_exact(&mut start).is_ok() && &start == b"MATLAB 7.3" {
        return hdf5(path);
    }
    out.reserve("of all", &[unpacked_mat(&mut file)? / NUMBER])?;
    let file = matfile::MatFile::parse(Cursor::new(start).chain(file))
        .map_err(|error| format!("it is no .mat of version 5 to 7: {error}"))?;
    for array in file.arrays() {
        use matfile::NumericData as N;
        let values: Vec<f64> = match array.data() {
            N::Double { real, .. } => real.clone(),
            N::Single { real, .. } => real.iter().map(|v| f64::from(*v)).collect(),
            N::Int8 { real, .. } => real.iter().map(|v| f64::from(*v)).collect(),
            N::UInt8 { real, .. } => real.iter().map(|v| f64::from(*v)).collect(),
            N::Int16 { real, .. } => real.iter().map(|v| f64::from(*v)).collect(),
            N::UInt16 { real, .. } => real.iter().map(|v| f64::from(*v)).collect(),
            N::Int32 { real, .. } => real.iter().map(|v| f64::from(*v)).collect(),
            N::UInt32 { real, .. } => real.iter().map(|v| f64::from(*v)).collect(),
            N::Int64 { real, .. } => real.iter().map(|v| *v as f64).collect(),
            N::UInt64 { real, .. } => real.iter().map(|v| *v as f64).collect(),
        };
        out.add(array.name(), array.size(), values, false);
    }
    if out.columns.is_empty() {
        return Err(
            "it holds no array of numbers; the fields of a struct become arrays by `save(FILE, '-struct', 'NAME')`, or are read \
             as they are from version 7.3: `save(FILE, '-v7.3')`"
                .to_owned(),
        );
    }
    Ok(out)
}

/// Bytes that the packed elements of a .mat of version 5 to 7 unpack to, up to where they are too many; the file stands behind
/// its first ten bytes before and after. An element has its kind and length before it, 4 bytes each, and kind 15 is packed.
fn unpacked_mat(file: &mut File) -> Result<u64, String> {
    const PACKED: u32 = 15;
    let wrong = |error: std::io::Error| error.to_string();
    let mut bytes = BufReader::new(&mut *file);
    // The header, of 128 bytes, says the order of bytes in its last two.
    let mut header = [0; 118];
    let mut size = 0;
    if bytes.read_exact(&mut header).is_ok() {
        let is_little = header.ends_with(b"IM");
        let word = |b: [u8; 4]| match is_little {
            true => u32::from_le_bytes(b),
            false => u32::from_be_bytes(b),
        };
        let mut tag = [0; 8];
        while bytes.read_exact(&mut tag).is_ok() {
            let [a, b, c, d, e, f, g, h] = tag;
            let (kind, length) = (word([a, b, c, d]), word([e, f, g, h]));
            let mut element = bytes.by_ref().take(length.into());
            if kind == PACKED {
                let unpacked = flate2::read::ZlibDecoder::new(&mut element).take(ROOM);
                // Damage is for who reads it to tell.
                size += std::io::copy(&mut { unpacked }, &mut std::io::sink()).unwrap_or(0);
            }
            if size >= ROOM {
                size = u64::MAX;
                break;
            }
            std::io::copy(&mut element, &mut std::io::sink()).map_err(wrong)?;
        }
    }
    file.seek(SeekFrom::Start(10)).map_err(wrong)?;
    Ok(size)
}

/// HDF5, which MATLAB's .mat of version 7.3 is. An array of a group or struct is called `GROUP.ARRAY`.
fn hdf5(path: &Path) -> Result<Arrays, String> {
    let bad = |error: hdf5_pure::Error| {
        format!(
            "it cannot be read as HDF5: {error}. In MATLAB, `save(FILE, '-v7')` writes a version without HDF5"
        )
    };
    let mut out = Arrays::of(&open(path)?)?;
    let file = hdf5_pure::File::open_streaming(path).map_err(bad)?;
    let mut too_large = Ok(());
    hdf5_group(&file.root(), "", 0, &mut out, &mut too_large).map_err(bad)?;
    too_large.map(|()| out)
}

/// Groups within groups that are followed.
const DEEPEST: usize = 16;

fn hdf5_group(
    group: &hdf5_pure::Group,
    within: &str,
    depth: usize,
    out: &mut Arrays,
    too_large: &mut Result<(), String>,
) -> Result<(), hdf5_pure::Error> {
    use hdf5_pure::DType as D;
    for name in group.datasets()? {
        let array = group.dataset(&name)?;
        let attributes = array.attrs()?;
        // MATLAB keeps text as numbers and an empty array as its size.
        let class = attributes.get("MATLAB_class").map(|v| format!("{v:?}"));
        if class.is_some_and(|c| c.contains("char") || c.contains("cell"))
            || attributes.contains_key("MATLAB_empty")
        {
            continue;
        }
        let shape = array.shape()?;
        if let Err(why) = out.reserve(&format!("{within}{name}"), &shape) {
            *too_large = Err(why);
            return Ok(());
        }
        let values = match array.dtype()? {
            D::F64 | D::F32 | D::I8 | D::I16 | D::I32 | D::U8 | D::U16 | D::U32 => {
                array.read_f64()?
            }
            D::I64 => array.read_i64()?.into_iter().map(|v| v as f64).collect(),
            D::U64 => array.read_u64()?.into_iter().map(|v| v as f64).collect(),
            _ => continue,
        };
        let shape: Vec<usize> = shape.iter().map(|n| *n as usize).collect();
        out.add(&format!("{within}{name}"), &shape, values, true);
    }
    for name in group.groups()? {
        // What MATLAB keeps for itself begins so.
        if !name.starts_with('#') && depth < DEEPEST {
            hdf5_group(
                &group.group(&name)?,
                &format!("{within}{name}."),
                depth + 1,
                out,
                too_large,
            )?;
        }
    }
    Ok(())
}

fn parquet_file(path: &Path) -> Result<Arrays, String> {
    let bad = |error: parquet::errors::ParquetError| format!("it is no Parquet file: {error}");
    let reader = SerializedFileReader::new(open(path)?).map_err(bad)?;
    let mut file = open(path)?;
    let metadata = reader.metadata();
    let mut out = Arrays::of(&file)?;
    let rows = metadata.file_metadata().num_rows();
    let rows = u64::try_from(rows).map_err(|_| format!("it claims {rows} rows"))?;
    for entry in metadata
        .file_metadata()
        .key_value_metadata()
        .into_iter()
        .flatten()
    {
        // What libraries keep for themselves is nothing about the stand.
        if let Some(value) = &entry.value
            && !["pandas", "ARROW:schema"].contains(&entry.key.as_str())
        {
            out.about.push((entry.key.clone(), value.clone()));
        }
    }
    let schema = metadata.file_metadata().schema_descr();
    for (at, column) in schema.columns().iter().enumerate() {
        if column.max_rep_level() > 0 {
            continue;
        }
        let present = column.max_def_level();
        let scale = match column.logical_type_ref() {
            Some(LogicalType::Timestamp(stamp)) => match stamp.unit {
                TimeUnit::MILLIS => Some(1e-3),
                TimeUnit::MICROS => Some(1e-6),
                TimeUnit::NANOS => Some(1e-9),
            },
            _ => None,
        };
        if matches!(
            column.physical_type(),
            Type::BYTE_ARRAY | Type::FIXED_LEN_BYTE_ARRAY | Type::INT96
        ) {
            continue;
        }
        out.reserve(column.name(), &[rows])?;
        let mut cells: Vec<f64> = Vec::new();
        let mut first = None;
        let mut known = true;
        for group in 0..reader.num_row_groups() {
            let group = reader.get_row_group(group).map_err(bad)?;
            let rows = group.metadata().num_rows() as usize;
            let chunk = group.metadata().column(at);
            let column_reader = if is_packed_otherwise(chunk.compression()) {
                Pages::of(&mut file, chunk)
                    .map(|pages| get_column_reader(column.clone(), Box::new(pages)))
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
                ColumnReader::Int64ColumnReader(r) => match scale {
                    // From the first stamp on: nanoseconds since 1970 have more digits than an f64.
                    Some(scale) => numbers(r, rows, present, |v| {
                        let first = *first.get_or_insert(*v);
                        (*v - first) as f64 * scale
                    }),
                    None => numbers(r, rows, present, |v| *v as f64),
                },
                _ => {
                    known = false;
                    break;
                }
            };
            cells.extend(part.map_err(bad)?);
        }
        if known {
            if scale.is_some() {
                let unit = (format!("unit of {}", column.name()), "s".to_owned());
                out.about.push(unit);
            }
            out.columns.push((column.name().to_owned(), cells));
        }
    }
    Ok(out)
}

/// The cells of a column, NaN where there is nothing.
fn numbers<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    present: i16,
    mut number: impl FnMut(&T::T) -> f64,
) -> Result<Vec<f64>, parquet::errors::ParquetError> {
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
