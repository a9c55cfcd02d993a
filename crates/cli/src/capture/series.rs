//! The files of one capture: each whole in itself, together one record.
//!
//! They share `start_unix_s`, and have `part: N` in their headers, from the second on at least: numbers, ticks and host times
//! go on from one to the next where the board was not set anew between them.

use std::cmp::Ordering;
use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::{Path, PathBuf};

use super::ends::{START, number_of, value_of};
use super::live::io;
use super::stream::unpacked;
use super::{Calibration, CaptureError};

/// Key of the header: which file of the capture, from 1 on.
pub const PART: &str = "part";
/// Digits of a file's number where a capture is to have many.
pub const DIGITS: usize = 4;
/// A header is no longer.
const LONGEST_HEAD: u64 = 1 << 16;

/// The beginning of a file: its header, and its line of column names.
struct Head {
    path: PathBuf,
    text: String,
    names: String,
}

impl Head {
    fn of(path: &Path) -> std::io::Result<Self> {
        let mut lines = unpacked(BufReader::new(File::open(path)?))?.take(LONGEST_HEAD);
        let (mut text, mut names) = (String::new(), String::new());
        loop {
            names.clear();
            if lines.read_line(&mut names)? == 0 || !names.starts_with('#') {
                break;
            }
            text.push_str(&names);
        }
        Ok(Head {
            path: path.to_owned(),
            text,
            names: names.trim_end().to_owned(),
        })
    }

    /// When the capture began, as it is written: the same in all its files.
    fn start(&self) -> Option<&str> {
        value_of(&self.text, START)
    }

    fn part(&self) -> u64 {
        number_of(&self.text, PART).map_or(1, |part| part as u64)
    }

    fn set_up(&self) -> Option<Calibration> {
        super::ends::calibration_of(&self.text)
    }
}

/// Stem and ending: run and csv.gz of run.csv.gz.
fn split(name: &str) -> (&str, &str) {
    name.split_once('.').unwrap_or((name, "csv"))
}

/// run-2.csv for run.csv, or with `digits` of 4 run-0002.csv.
#[must_use]
pub fn part_name(out: &Path, number: u64, digits: usize) -> PathBuf {
    let name = out.file_name().unwrap_or_default().to_string_lossy();
    let (stem, ending) = split(&name);
    out.with_file_name(format!("{stem}-{number:0digits$}.{ending}"))
}

/// The first such name that is free, from `number` on, and its number.
#[must_use]
pub fn free_name(out: &Path, number: u64, digits: usize) -> (PathBuf, u64) {
    (number..)
        .map(|number| (part_name(out, number, digits), number))
        .find(|(path, _)| !path.exists())
        .unwrap_or_else(|| (out.to_owned(), number))
}

/// Whether a name is `out`'s, or that of a further file of it.
fn is_of(out: &str, name: &str) -> bool {
    let ((stem, ending), (other, other_ending)) = (split(out), split(name));
    let number = other.strip_prefix(stem);
    let is_number = |rest: &str| {
        let digits = rest.strip_prefix('-').unwrap_or_default();
        !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit())
    };
    ending == other_ending && number.is_some_and(|rest| rest.is_empty() || is_number(rest))
}

/// The last file of the capture that `--out` names, and which one it is; `None` where there is none.
///
/// # Errors
/// [`CaptureError::Io`].
pub fn last_part(out: &Path) -> Result<Option<(PathBuf, u64)>, CaptureError> {
    let named = out
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let folder = out.parent().filter(|f| !f.as_os_str().is_empty());
    let heads = heads(folder.unwrap_or(Path::new(".")), |name| is_of(&named, name))?;
    // A part of another capture may have a like name; the first file says which capture it is.
    let called = |name: &std::ffi::OsStr| heads.iter().find(|h| h.path.file_name() == Some(name));
    let rotated = part_name(out, 1, DIGITS);
    let first = called(named.as_ref()).or_else(|| called(rotated.file_name()?));
    let Some(first) = first else { return Ok(None) };
    let mut parts: Vec<&Head> = (heads.iter())
        .filter(|head| head.start() == first.start() && head.start().is_some())
        .collect();
    parts.sort_by(|a, b| by_part(a, b));
    let last = parts.last().map_or(first, |last| *last);
    Ok(Some((last.path.clone(), last.part())))
}

fn by_part(a: &Head, b: &Head) -> Ordering {
    a.part().cmp(&b.part()).then_with(|| a.path.cmp(&b.path))
}

/// Heads of the files of a folder whose names fit; those that cannot be read are left out.
fn heads(folder: &Path, fits: impl Fn(&str) -> bool) -> Result<Vec<Head>, CaptureError> {
    let entries = std::fs::read_dir(folder).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
    let entries = entries.map_err(io(folder))?;
    let files = entries
        .iter()
        .filter(|entry| fits(&entry.file_name().to_string_lossy()));
    Ok(files
        .filter_map(|entry| Head::of(&entry.path()).ok())
        .collect())
}

/// How the files of a rosbag2 end, which is a folder. One in SQLite is not read, and says so itself.
const LOGS: [&str; 4] = [".mcap", ".mcap.zstd", ".mcap.zst", ".db3"];

/// The file of a recording of rosbag2, whose folder is named; any other path as it is.
///
/// # Errors
/// [`CaptureError::Parts`] where the recording was split; [`CaptureError::Io`].
pub fn log_of(path: &Path) -> Result<PathBuf, CaptureError> {
    if !path.join("metadata.yaml").is_file() {
        return Ok(path.to_owned());
    }
    let entries = std::fs::read_dir(path).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
    let mut files: Vec<PathBuf> = entries
        .map_err(io(path))?
        .iter()
        .map(std::fs::DirEntry::path)
        .filter(|file| {
            let name = file.to_string_lossy();
            LOGS.iter().any(|ending| name.ends_with(ending))
        })
        .collect();
    files.sort();
    match files.as_slice() {
        [] => Ok(path.to_owned()),
        [only] => Ok(only.clone()),
        [first, ..] => Err(CaptureError::Parts {
            path: path.to_owned(),
            why: format!(
                "the recording was split into {} files, from {} on; `ros2 bag convert` makes one of them",
                files.len(),
                first.file_name().unwrap_or_default().display()
            ),
        }),
    }
}

/// The parts of one capture in a folder as one text, in their order.
///
/// # Errors
/// [`CaptureError::Parts`] where there are others, or the board was set anew between them; [`CaptureError::Io`].
pub fn joined(folder: &Path) -> Result<(impl BufRead + use<>, Vec<PathBuf>), CaptureError> {
    let is_capture = |name: &str| name.ends_with(".csv") || name.ends_with(".csv.gz");
    let mut parts = heads(folder, is_capture)?;
    parts.sort_by(by_part);
    let refuse = |why: String| CaptureError::Parts {
        path: folder.to_owned(),
        why,
    };
    let name = |head: &Head| {
        let name = head.path.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    };
    let Some(first) = parts.first() else {
        return Err(refuse(
            "no capture (.csv, .csv.gz) is in this folder".to_owned(),
        ));
    };
    for part in &parts[1..] {
        if part.start().is_none() || part.start() != first.start() {
            return Err(refuse(format!(
                "{} and {} are not of one capture (`{START}` in their headers)",
                name(first),
                name(part)
            )));
        }
        if part.set_up() != first.set_up() || part.names != first.names {
            return Err(refuse(format!(
                "the board was set anew between {} and {}",
                name(first),
                name(part)
            )));
        }
    }
    let paths: Vec<PathBuf> = parts.into_iter().map(|part| part.path).collect();
    let text = Joined {
        paths: paths.clone().into_iter(),
        is_first: true,
        text: None,
    };
    Ok((BufReader::new(text), paths))
}

/// One text after the other; the names of the columns of the first alone.
struct Joined {
    paths: std::vec::IntoIter<PathBuf>,
    is_first: bool,
    text: Option<Box<dyn BufRead>>,
}

impl Read for Joined {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        loop {
            if let Some(text) = &mut self.text {
                let count = text.read(buffer)?;
                if count > 0 || buffer.is_empty() {
                    return Ok(count);
                }
            }
            let Some(path) = self.paths.next() else {
                return Ok(0);
            };
            let mut text = unpacked(BufReader::new(File::open(path)?))?;
            let mut head = Vec::new();
            if !std::mem::take(&mut self.is_first) {
                // Without its head, which is the first one's.
                while text.fill_buf()?.first() == Some(&b'#') {
                    head.clear();
                    text.read_until(b'\n', &mut head)?;
                }
                text.read_until(b'\n', &mut head)?;
                // A part that was cut off in its last row ends without its line's end.
                head = vec![b'\n'];
            }
            self.text = Some(Box::new(Cursor::new(head).chain(text)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_further_files_are_known_by_their_number() {
        for (name, is) in [
            ("run.csv", true),
            ("run-2.csv", true),
            ("run-0012.csv", true),
            ("run-2.csv.gz", false),
            ("run-a.csv", false),
            ("run2.csv", false),
            ("other.csv", false),
            ("run-.csv", false),
        ] {
            assert_eq!(is_of("run.csv", name), is, "{name}");
        }
        let (path, number) = free_name(Path::new("no-such/run.csv.gz"), 2, 4);
        assert_eq!(path, Path::new("no-such/run-0002.csv.gz"));
        assert_eq!(number, 2);
        let (path, _) = free_name(Path::new("no-such/run.csv"), 2, 0);
        assert_eq!(path, Path::new("no-such/run-2.csv"));
    }
}
