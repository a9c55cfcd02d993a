//! A capture that is written while it runs, and can be resumed.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use flate2::write::GzEncoder;
use wire::{Corrected, Hello, Sample};

use super::ends::{BEFORE, Ends, LastRow, OFFSETS, START, complete_lines, is_gz};
use super::write::{write_head, write_rows};
use super::{Calibration, CaptureError, Continuity, Held, Place, RecordBuilder, Restart};

enum Sink {
    Plain(Held),
    Gz(GzEncoder<Held>),
}

impl Sink {
    fn new(file: File, path: &Path) -> Self {
        let file = Held::new(file);
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
        if let Err(error) = write_head(&mut sink, &head).and_then(|()| sink.flush()) {
            // Half a header is no file to go on with. That it cannot be removed either adds nothing.
            let _ = std::fs::remove_file(path);
            return Err(io(path)(error));
        }
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
        let (complete, _) = complete_lines(path).map_err(io(path))?;
        let ends = Ends::of(path, &complete, calibration)?;
        let sink = if is_gz(path) {
            // What was cut off in the middle of a compressed block cannot be appended to: it is written anew.
            // The old file stays until the new one is on the disk.
            let new = path.with_extension("gz.new");
            let mut sink = Sink::new(File::create(&new).map_err(io(&new))?, path);
            sink.write_all(complete.as_bytes())
                .and_then(|()| sink.flush())
                .and_then(|()| std::fs::rename(&new, path))
                .map_err(io(&new))?;
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
        if let Some(last) = &ends.last {
            follow = follow.after(last.seq, last.t_ticks, last.host_s, ends.offsets);
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

    /// Ends this file and begins the next one of the same capture: numbers, ticks and host times go on in it, and `about`
    /// goes into its header.
    ///
    /// # Errors
    /// As [`create`](Self::create) and [`finish`](Self::finish).
    pub fn next_part(
        mut self,
        path: &Path,
        about: &[(String, String)],
    ) -> Result<Self, CaptureError> {
        let calibration = self.builder.calibration().clone();
        let mut next = Self::create(path, &calibration, about, Some(self.start_unix_s))?;
        // The old one is whole before the new one gets rows.
        self.write_pending().map_err(io(&self.path))?;
        if let Some((offsets, last)) = self.follow.at() {
            let (seq, ticks) = (offsets.0 as i64, offsets.1 as i64);
            let LastRow {
                seq: last_seq,
                t_ticks,
                host_s,
                ..
            } = last;
            writeln!(
                next.sink,
                "{OFFSETS}{seq} t_ticks {ticks}\n{BEFORE}{last_seq},{t_ticks},{host_s:.6}"
            )
            .and_then(|()| next.sink.flush())
            .map_err(io(path))?;
        }
        next.follow = self.follow.clone();
        self.finish()?;
        Ok(next)
    }

    /// Host time of the last row, s; 0 before the first.
    #[must_use]
    pub fn last_host_s(&self) -> f64 {
        self.follow.at().map_or(0.0, |(_, last)| last.host_s)
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
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

    /// Sees to it that all rows are in the file. Where the disk has no room they wait in memory, in their order, and this may
    /// be tried again.
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
    /// [`CaptureError::Io`]: what was not in the file by then is lost.
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

pub(super) fn io(path: &Path) -> impl Fn(std::io::Error) -> CaptureError {
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
