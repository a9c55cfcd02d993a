//! A stream of text: unpacked, and in lines.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read as _, Result};
use std::path::Path;

use super::{CaptureError, unpack};

/// How gzip begins.
const GZIP: &[u8] = &[0x1f, 0x8b];
/// No row of numbers is longer.
pub(super) const LONGEST_LINE: u64 = 1 << 20;
/// Bytes without a row of numbers, empty lines and comments, after which there is none: packed, a gigabyte of them is small.
const NO_ROW: u64 = 1 << 24;

/// How Zstandard begins.
const ZSTANDARD: &[u8] = b"\x28\xb5\x2f\xfd";
/// How bzip2 begins.
const BZIP2: &[u8] = b"BZh";

/// What is in a stream of gzip, Zstandard or bzip2, or the stream where it is none of them.
///
/// # Errors
/// The stream's.
pub fn unpacked<'a>(mut input: impl BufRead + 'a) -> Result<Box<dyn BufRead + 'a>> {
    let start = input.fill_buf()?;
    if start.starts_with(GZIP) {
        let text = flate2::bufread::MultiGzDecoder::new(input);
        return Ok(Box::new(BufReader::new(text)));
    }
    if start.starts_with(ZSTANDARD) {
        return Ok(Box::new(BufReader::new(unpack::zstd(input)?)));
    }
    if start.starts_with(BZIP2) {
        let text = bzip2::bufread::MultiBzDecoder::new(input);
        return Ok(Box::new(BufReader::new(text)));
    }
    Ok(Box::new(input))
}

const FILE: &str = "name it as a file of its own: such a file is read from its end, and neither from a pipe nor packed";
const UNPACK: &str = "unpack it first; gzip, Zstandard and bzip2 are read as they are";
const UTF_8: &str = "save it as UTF-8 (in a spreadsheet: `CSV UTF-8`)";
const MAVLOGDUMP: &str = "make a CSV of it by pymavlink: `mavlogdump.py --types IMU --format csv LOG > imu.csv`; the file is then read as it is";
/// How files begin that are no text to be read, what they are, and what is to be done.
const NO_TEXT: [(&[u8], &str, &str); 14] = [
    (b"\xff\xfe\0\0", "UTF-32", UTF_8),
    (b"\0\0\xfe\xff", "UTF-32", UTF_8),
    (
        b"PK\x03\x04",
        "a ZIP archive, as spreadsheets and NPZ are",
        "save the sheet as CSV; an NPZ has the ending .npz",
    ),
    (b"PAR1", "Parquet", FILE),
    (b"\x89HDF", "HDF5", FILE),
    (b"\x93NUMPY", "a NumPy array", FILE),
    (b"MATLAB", "a .mat file", FILE),
    (b"\xfd7zXZ", "xz", UNPACK),
    (
        b"SQLite format 3",
        "SQLite, as a rosbag2 of the ending .db3 is",
        "make an MCAP of it, which is read: `mcap convert FILE.db3 FILE.mcap`, or `ros2 bag convert`",
    ),
    (b"\xa3\x95", "a log of ArduPilot", MAVLOGDUMP),
    (b"FMT, 128, 89,", "a log of ArduPilot, as text", MAVLOGDUMP),
    (
        b"H Product:Blackbox",
        "a Blackbox log of Betaflight or INAV",
        "make a CSV of it: `blackbox_decode LOG`",
    ),
    (
        b"ARROW1",
        "Arrow, as Feather is",
        "make a Parquet file of it: `pandas.read_feather(FILE).to_parquet(OTHER)`",
    ),
    (
        b"\xd0\xcf\x11\xe0",
        "an old spreadsheet",
        "save the sheet as CSV",
    ),
];

/// What a file is that is no text, by how it begins, and what to do.
fn no_text(start: &[u8]) -> Option<(&'static str, &'static str)> {
    if let Some((_, what, help)) = NO_TEXT.iter().find(|(magic, ..)| start.starts_with(magic)) {
        return Some((what, help));
    }
    const AS_CSV: &str = "save the readings as CSV, a line of column names and then a row for each sample; of an array of \
                          objects `jq -c '.[]' FILE > lines.json` makes lines, which are read";
    let known: [(&[u8], _); 4] = [
        (b"[{", "JSON"),
        (b"<?xml", "XML"),
        (b"<!DOCTYPE", "a web page"),
        (b"<html", "a web page"),
    ];
    let begins = start.trim_ascii_start();
    let model = b"format = \"imu-stand-model/";
    if start
        .split(|b| *b == b'\n')
        .any(|line| line.starts_with(model))
    {
        return Some((
            "a model file",
            "`imu-stand simulate --model FILE --out run.csv` makes a capture of it, `imu-stand export FILE --to kalibr` writes its \
             noise figures",
        ));
    }
    if let Some(object) = begins.strip_prefix(b"{").map(<[u8]>::trim_ascii_start) {
        if object.starts_with(b"\"format\": \"imu-stand-") {
            return Some((
                "a result of this program (JSON)",
                "name the capture that it was made of; `imu-stand export FILE --to kalibr` writes the noise figures of an analysis \
                 or a diagnosis",
            ));
        }
        if object.starts_with(b"\"") {
            return Some((
                "JSON, and not an object with the same keys in each line",
                AS_CSV,
            ));
        }
    }
    if let Some((_, what)) = known.iter().find(|(how, _)| begins.starts_with(how)) {
        return Some((what, AS_CSV));
    }
    start.contains(&0).then_some((
        "binary data",
        "is it the right file? Text, NPZ, NPY, Parquet, .mat, HDF5, MCAP, ROS 1 bags and ULog are read",
    ))
}

/// Whether it surrounds a line and is none of it. Not tabs: a cell at the end may be empty.
fn is_around(c: char) -> bool {
    matches!(c, ' ' | '\r' | '\n')
}

/// Lines of a text, numbered from 1 on.
pub(super) struct TextLines<R> {
    input: R,
    number: u64,
    bytes: Vec<u8>,
    /// Bytes since the last row.
    without_row: u64,
    /// Lines that were looked at already, the next one first.
    ahead: VecDeque<(u64, String)>,
    /// What lines end with: some old programs write a carriage return alone.
    end: u8,
}

impl<R: BufRead> TextLines<R> {
    /// Of a stream that begins like text.
    pub fn new(mut input: R) -> std::result::Result<Self, CaptureError> {
        let start = input.fill_buf().map_err(io)?;
        if let Some((what, help)) = no_text(start) {
            return Err(CaptureError::NoText {
                what: what.to_owned(),
                help: help.to_owned(),
            });
        }
        let has = |byte| start.contains(&byte);
        let end = if has(b'\r') && !has(b'\n') {
            b'\r'
        } else {
            b'\n'
        };
        Ok(Self {
            input,
            ahead: VecDeque::new(),
            end,
            number: 0,
            without_row: 0,
            bytes: Vec::new(),
        })
    }

    /// The next line and its number, without what surrounds it. What is not UTF-8 is taken as Latin-1: names and units
    /// of old programs; numbers are the same in both.
    pub fn next_line(&mut self) -> std::result::Result<Option<(u64, String)>, CaptureError> {
        let mut line = String::new();
        let number = self.next_line_into(&mut line)?;
        Ok(number.map(|number| (number, line)))
    }

    /// The same into a `line` that was used before, the number returned.
    pub fn next_line_into(
        &mut self,
        into: &mut String,
    ) -> std::result::Result<Option<u64>, CaptureError> {
        if let Some((number, line)) = self.ahead.pop_front() {
            *into = line;
            return Ok(Some(number));
        }
        self.bytes.clear();
        let mut line = self.input.by_ref().take(LONGEST_LINE);
        if line.read_until(self.end, &mut self.bytes).map_err(io)? == 0 {
            return Ok(None);
        }
        self.number += 1;
        if self.bytes.len() as u64 == LONGEST_LINE && self.bytes.last() != Some(&self.end) {
            return Err(self.no_table("is longer than 1 MiB"));
        }
        // Byte by byte: no character need be decoded for it.
        while self.bytes.pop_if(|b| is_around(char::from(*b))).is_some() {}
        let text: Cow<'_, str> = match std::str::from_utf8(&self.bytes) {
            Ok(text) => text.trim_start_matches('\u{feff}').into(),
            Err(_) => Cow::from(
                self.bytes
                    .iter()
                    .map(|b| char::from(*b))
                    .collect::<String>(),
            ),
        };
        into.clear();
        into.push_str(text.trim_start_matches(is_around));
        Ok(Some(self.number))
    }
}

impl<R> TextLines<R> {
    /// Counts a line that is no row; an error where nothing else comes.
    pub fn is_no_row(&mut self, line: &str) -> std::result::Result<(), CaptureError> {
        self.without_row += line.len() as u64 + 1;
        if self.without_row > NO_ROW {
            return Err(self.no_table("ends 16 MiB of empty lines and comments"));
        }
        Ok(())
    }

    /// A row came.
    pub fn is_row(&mut self) {
        self.without_row = 0;
    }

    fn no_table(&self, what: &str) -> CaptureError {
        CaptureError::NoText {
            what: format!("a text whose line {} {what}", self.number),
            help: "is it the right file? A table has a line of column names and then a row for each sample".to_owned(),
        }
    }

    /// Gives lines back, which come again in their order.
    pub fn put_back(&mut self, lines: impl DoubleEndedIterator<Item = (u64, String)>) {
        lines.rev().for_each(|line| self.ahead.push_front(line));
    }
}

/// An error of the stream, which does not know its name.
pub(super) fn io(source: std::io::Error) -> CaptureError {
    CaptureError::Io {
        path: "input".into(),
        source,
    }
}

/// The same with the name of the file.
pub(super) fn named(error: CaptureError, path: &Path) -> CaptureError {
    use std::io::ErrorKind as Kind;
    let CaptureError::Io { source, .. } = error else {
        return error;
    };
    let path = path.to_owned();
    match source.kind() {
        Kind::UnexpectedEof => CaptureError::CutOff { path },
        Kind::InvalidData | Kind::InvalidInput => CaptureError::Damaged {
            path,
            why: source.to_string(),
        },
        _ => CaptureError::Io { path, source },
    }
}
