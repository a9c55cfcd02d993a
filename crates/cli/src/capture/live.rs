//! A capture that is written while it runs, and can be resumed.

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use flate2::write::GzEncoder;
use wire::{Corrected, Hello, Sample};

use super::write::{write_head, write_rows};
use super::{Calibration, CaptureError, Continuity, Place, RecordBuilder, Restart};

/// Key of the header: when the capture began, s since 1970 (UTC).
const START: &str = "start_unix_s";
/// Begins a line that says what was added to the board's own numbers and ticks from there on.
const OFFSETS: &str = "# offsets: seq ";

enum Sink {
    Plain(BufWriter<File>),
    Gz(GzEncoder<BufWriter<File>>),
}

impl Sink {
    fn new(file: File, path: &Path) -> Self {
        let file = BufWriter::new(file);
        if is_gz(path) {
            Sink::Gz(GzEncoder::new(file, flate2::Compression::default()))
        } else {
            Sink::Plain(file)
        }
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        match self {
            Sink::Plain(out) => out.write(bytes),
            Sink::Gz(out) => out.write(bytes),
        }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        match self {
            Sink::Plain(out) => out.flush(),
            Sink::Gz(out) => out.flush().and_then(|()| out.get_mut().flush()),
        }
    }
}

fn is_gz(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "gz")
}

/// A capture under way. Rows are in the file as soon as [`flush`](Self::flush) has returned, but for the last one where what
/// the board makes of its rates may still come.
pub struct Live {
    path: PathBuf,
    sink: Sink,
    builder: RecordBuilder,
    places: Vec<Place>,
    follow: Continuity,
    start_unix_s: f64,
    rows: u64,
}

impl Live {
    /// Begins a file. `about` are further lines for its header; `start_unix_s` is the zero of the host times, where it is
    /// known: a file without it cannot be resumed.
    ///
    /// # Errors
    /// [`CaptureError::Exists`] where there is one, [`CaptureError::Io`].
    pub fn create(
        path: &Path,
        calibration: &Calibration,
        about: &[(String, String)],
        start_unix_s: Option<f64>,
    ) -> Result<Self, CaptureError> {
        let file = OpenOptions::new().write(true).create_new(true).open(path);
        let file = file.map_err(|source| match source.kind() {
            std::io::ErrorKind::AlreadyExists => CaptureError::Exists {
                path: path.to_owned(),
            },
            _ => io(path)(source),
        })?;
        let builder = RecordBuilder::new(calibration.clone());
        let mut head = builder.build();
        let start = start_unix_s.map(|start| (START.to_owned(), format!("{start:.3}")));
        head.header.entries.extend(start);
        head.header.entries.extend_from_slice(about);
        let mut sink = Sink::new(file, path);
        write_head(&mut sink, &head)
            .and_then(|()| sink.flush())
            .map_err(io(path))?;
        Ok(Self {
            path: path.to_owned(),
            sink,
            follow: follow(calibration),
            builder,
            places: Vec::new(),
            start_unix_s: start_unix_s.unwrap_or(0.0),
            rows: 0,
        })
    }

    /// Goes on with a file that [`create`](Self::create) began, wherever it was cut off.
    ///
    /// # Errors
    /// [`CaptureError::Resume`] where it is none, or where the board is set differently now; [`CaptureError::Io`].
    pub fn resume(path: &Path, calibration: &Calibration) -> Result<Self, CaptureError> {
        let complete = complete_lines(path).map_err(io(path))?;
        let ends = Ends::of(path, &complete, calibration)?;
        let sink = if is_gz(path) {
            // What was cut off in the middle of a compressed block cannot be appended to: it is written anew.
            let old = path.with_extension("gz.old");
            std::fs::rename(path, &old).map_err(io(&old))?;
            let mut sink = Sink::new(File::create(path).map_err(io(path))?, path);
            sink.write_all(complete.as_bytes())
                .and_then(|()| sink.flush())
                .map_err(io(path))?;
            std::fs::remove_file(&old).map_err(io(&old))?;
            sink
        } else {
            let file = OpenOptions::new()
                .append(true)
                .open(path)
                .map_err(io(path))?;
            file.set_len(complete.len() as u64).map_err(io(path))?;
            Sink::new(file, path)
        };
        let mut follow = follow(calibration);
        if let Some((seq, t_ticks, host_s)) = ends.last {
            follow = follow.after(seq, t_ticks, host_s, ends.offsets);
        }
        Ok(Self {
            path: path.to_owned(),
            sink,
            builder: RecordBuilder::new(calibration.clone()),
            places: Vec::new(),
            follow,
            start_unix_s: ends.start_unix_s,
            rows: ends.rows,
        })
    }

    /// The zero of the host times, s since 1970.
    #[must_use]
    pub fn start_unix_s(&self) -> f64 {
        self.start_unix_s
    }

    /// Rows, those of before a resumption included.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Whether a board that is set like this can go on in this file.
    #[must_use]
    pub fn fits(&self, calibration: &Calibration) -> bool {
        self.builder.calibration() == calibration
    }

    /// A hello frame: `before` is the count of restarts in the last one.
    pub fn hello(&mut self, hello: &Hello, before: Option<u16>) {
        self.follow.hello(hello, before);
    }

    /// The line was opened anew.
    pub fn reconnected(&mut self) {
        self.follow.fresh();
    }

    /// Adds a sample that arrived `host_s` after the start. What was missing before it, and whether the board had
    /// restarted, is returned; a restart is noted in the file.
    ///
    /// # Errors
    /// [`CaptureError::Io`].
    pub fn push(
        &mut self,
        sample: &Sample,
        host_s: f64,
    ) -> Result<(Place, Option<Restart>), CaptureError> {
        let (place, restart) = self.follow.place(sample, host_s);
        if let Some(restart) = restart {
            self.note(
                host_s,
                &format!(
                    "the board has started anew; {} sample instants without data. Device time goes on by this \
                     computer's clock, right to half a sample",
                    restart.instants - 1
                ),
            )?;
            let (seq, ticks) = (restart.seq_offset as i64, restart.t_offset as i64);
            writeln!(self.sink, "{OFFSETS}{seq} t_ticks {ticks}").map_err(io(&self.path))?;
        }
        self.builder.push(sample, host_s);
        self.places.push(place);
        self.rows += 1;
        Ok((place, restart))
    }

    /// Adds what the board made of the rates of a sample before. A file that was begun without columns for it leaves it out.
    pub fn corrected(&mut self, corrected: &Corrected) {
        if self.has_corrected() {
            self.builder.corrected(corrected);
        }
    }

    /// What the file's counts mean.
    #[must_use]
    pub fn calibration(&self) -> &Calibration {
        self.builder.calibration()
    }

    /// Whether the file has columns for corrected rates.
    #[must_use]
    pub fn has_corrected(&self) -> bool {
        self.builder.calibration().corrected
    }

    /// Writes down what happened, at its place among the rows.
    ///
    /// # Errors
    /// [`CaptureError::Io`].
    pub fn note(&mut self, host_s: f64, what: &str) -> Result<(), CaptureError> {
        self.write_pending().map_err(io(&self.path))?;
        writeln!(self.sink, "# event at {host_s:.3} s: {what}").map_err(io(&self.path))
    }

    /// Sees to it that all rows are in the file.
    ///
    /// # Errors
    /// [`CaptureError::Io`].
    pub fn flush(&mut self) -> Result<(), CaptureError> {
        let waiting = self.builder.take_waiting();
        let place = waiting.is_some().then(|| self.places.pop()).flatten();
        let written = self.write_pending();
        self.builder.put_back(waiting);
        self.places.extend(place);
        written
            .and_then(|()| self.sink.flush())
            .map_err(io(&self.path))
    }

    fn write_pending(&mut self) -> std::io::Result<()> {
        if self.places.is_empty() {
            return Ok(());
        }
        let mut record = self.builder.build();
        record.seq = Some(self.places.iter().map(|place| place.seq).collect());
        record.t_ticks = Some(self.places.iter().map(|place| place.t_ticks).collect());
        self.builder.clear();
        self.places.clear();
        write_rows(&mut self.sink, &record)
    }

    /// Ends the file.
    ///
    /// # Errors
    /// [`CaptureError::Io`].
    pub fn finish(mut self) -> Result<(), CaptureError> {
        self.write_pending()
            .and_then(|()| self.sink.flush())
            .map_err(io(&self.path))?;
        match self.sink {
            Sink::Plain(_) => Ok(()),
            Sink::Gz(out) => out
                .finish()
                .and_then(|mut file| file.flush())
                .map_err(io(&self.path)),
        }
    }
}

fn io(path: &Path) -> impl Fn(std::io::Error) -> CaptureError {
    let path = path.to_owned();
    move |source| CaptureError::Io {
        path: path.clone(),
        source,
    }
}

fn follow(calibration: &Calibration) -> Continuity {
    let ticks = (1.0 / calibration.rate_hz / calibration.tick_s).round();
    Continuity::new(calibration.tick_s, ticks as u64)
}

/// The lines of a file up to where it was cut off.
fn complete_lines(path: &Path) -> std::io::Result<String> {
    let file = BufReader::new(File::open(path)?);
    let mut input: Box<dyn BufRead> = if is_gz(path) {
        Box::new(BufReader::new(flate2::bufread::MultiGzDecoder::new(file)))
    } else {
        Box::new(file)
    };
    let mut bytes = Vec::new();
    match input.read_to_end(&mut bytes) {
        Ok(_) => {}
        // A block that was not finished: what came before it is there.
        Err(error) if is_gz(path) && error.kind() == std::io::ErrorKind::UnexpectedEof => {}
        Err(error) => return Err(error),
    }
    let end = bytes.iter().rposition(|byte| *byte == b'\n');
    bytes.truncate(end.map_or(0, |at| at + 1));
    String::from_utf8(bytes).map_err(std::io::Error::other)
}

/// How a file ends.
struct Ends {
    start_unix_s: f64,
    rows: u64,
    last: Option<(u64, u64, f64)>,
    offsets: (u64, u64),
}

impl Ends {
    fn of(path: &Path, text: &str, now: &Calibration) -> Result<Self, CaptureError> {
        let refuse = |why: String| CaptureError::Resume {
            path: path.to_owned(),
            why,
        };
        let key = |key: &str| {
            let value = text
                .lines()
                .filter_map(|line| line.strip_prefix("# ")?.split_once(": "))
                .find(|(name, _)| *name == key);
            value
                .and_then(|(_, value)| value.trim().parse::<f64>().ok())
                .ok_or_else(|| {
                    refuse(format!(
                        "its header has no `{key}`: it is no capture of a board"
                    ))
                })
        };
        let start_unix_s = key(START)?;
        is_set_alike(&key, now)?.map_or(Ok(()), |why| Err(refuse(why)))?;
        let mut ends = Ends {
            start_unix_s,
            rows: 0,
            last: None,
            offsets: (0, 0),
        };
        let mut names = true;
        for line in text.lines() {
            if let Some(offsets) = line.strip_prefix(OFFSETS) {
                let (seq, ticks) = offsets_of(offsets)
                    .ok_or_else(|| refuse(format!("its line `{line}` cannot be read")))?;
                ends.offsets = (seq as u64, ticks as u64);
            } else if line.starts_with('#') || line.is_empty() {
            } else if std::mem::take(&mut names) {
                if !line.starts_with("seq,t_ticks,host_time_s,gyro_x,") {
                    return Err(refuse("its columns are not those of a capture".to_owned()));
                }
                if line.contains(",corrected_x,") != now.corrected {
                    let with = if now.corrected { "has no" } else { "has" };
                    return Err(refuse(format!(
                        "the correction on the board was switched since: the file {with} columns for corrected rates"
                    )));
                }
                if now.corrected && !line.contains(",attitude_w,") {
                    return Err(refuse(
                        "it is of an earlier version, which had no columns for the attitude"
                            .to_owned(),
                    ));
                }
            } else {
                let row = row_of(line);
                ends.last =
                    Some(row.ok_or_else(|| refuse(format!("its row `{line}` cannot be read")))?);
                ends.rows += 1;
            }
        }
        if names {
            return Err(refuse("it ends before its column names".to_owned()));
        }
        Ok(ends)
    }
}

/// Why a file cannot go on with a board that is set so; `None` where it can.
fn is_set_alike(
    key: &dyn Fn(&str) -> Result<f64, CaptureError>,
    now: &Calibration,
) -> Result<Option<String>, CaptureError> {
    for (name, now) in [
        ("rate_hz", now.rate_hz),
        ("tick_s", now.tick_s),
        ("gyro_lsb_dps", now.gyro_lsb_dps),
        ("acc_counts_per_g", now.acc_counts_per_g),
    ] {
        let then = key(name)?;
        if (then / now - 1.0).abs() > 1e-9 {
            return Ok(Some(format!(
                "the board is set differently now: `{name}` is {now}, in the file {then}"
            )));
        }
    }
    Ok(None)
}

/// The first cells of a row: number, ticks and host time.
fn row_of(line: &str) -> Option<(u64, u64, f64)> {
    let mut cells = line.split(',');
    let mut cell = || cells.next();
    Some((
        cell()?.parse().ok()?,
        cell()?.parse().ok()?,
        cell()?.parse().ok()?,
    ))
}

/// Offsets of the numbers and of the ticks.
fn offsets_of(text: &str) -> Option<(i64, i64)> {
    let (seq, ticks) = text.split_once(" t_ticks ")?;
    Some((seq.parse().ok()?, ticks.parse().ok()?))
}
