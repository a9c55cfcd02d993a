//! Files of others that hold arrays: NPZ and NPY, Parquet, MATLAB's .mat, HDF5. Each becomes named columns.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use super::CaptureError;
use super::error::brief;
use super::guard::guarded;
use super::table::Table;

mod hdf5;
mod mat;
mod numpy;
mod parquet_file;

use hdf5::hdf5;
use mat::mat;
use numpy::{npy, npz};
use parquet_file::parquet_file;

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
        guarded(|| read(path).and_then(Arrays::table)).map_err(|why| CaptureError::Table {
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

    /// No more than so many bytes are in the file.
    fn limit(&mut self, bytes: u64) {
        self.room = self.room.min(bytes);
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
                     file, or than the file can hold; write the columns that are needed, or a part of the rows, to a file of \
                     their own",
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
