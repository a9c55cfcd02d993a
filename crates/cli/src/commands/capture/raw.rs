//! The raw bytes of the line, kept beside the rows: all of them, each as soon as it was read.

use std::fs::{File, OpenOptions};
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use imu_stand::capture::Held;
use miette::{IntoDiagnostic, Result, WrapErr};

/// Bytes of which it may not be known yet where their frame ends; a line of noise has no ends.
const RECENT: usize = 1 << 16;

/// A file of them.
pub(super) struct Raw {
    path: PathBuf,
    file: Held,
    /// Its length when nothing waits, and what it was when this run began.
    length: u64,
    began: u64,
    /// Bytes that this run has read.
    read: u64,
    /// The last of them, whose frames were not taken yet.
    recent: Vec<u8>,
}

fn open(path: &Path) -> std::io::Result<(File, u64)> {
    let mut options = OpenOptions::new();
    let mut file = options.create(true).append(true).read(true).open(path)?;
    let mut length = file.metadata()?.len();
    if length > 0 {
        // A frame that was cut off ends here: without its end the next one would be lost with it.
        let mut last = [0];
        file.seek(SeekFrom::End(-1))?;
        file.read_exact(&mut last)?;
        if last != [0] {
            file.write_all(&[0])?;
            length += 1;
        }
    }
    Ok((file, length))
}

impl Raw {
    /// Begins a file, or goes on with it.
    pub fn open(path: &Path) -> Result<Self> {
        let opened = open(path).into_diagnostic();
        let (file, length) = opened.wrap_err_with(|| format!("cannot write {}", path.display()))?;
        Ok(Self {
            path: path.to_owned(),
            file: Held::new(file),
            length,
            began: length,
            read: 0,
            recent: Vec::new(),
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its name.
    pub fn name(&self) -> String {
        super::super::name(&self.path)
    }

    /// How long it was when this run began.
    pub fn began(&self) -> u64 {
        self.began
    }

    /// Where the frame begins that was not taken yet.
    pub fn offset(&self) -> u64 {
        self.length.saturating_sub(self.recent.len() as u64)
    }

    /// Adds what was read. Where the disk has no room it waits in memory, and [`flush`](Self::flush) tries again.
    pub fn write(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        // It takes every byte.
        self.file.write_all(bytes)?;
        self.length += bytes.len() as u64;
        self.read += bytes.len() as u64;
        self.recent.extend_from_slice(bytes);
        let over = self.recent.len().saturating_sub(RECENT);
        self.recent.drain(..over);
        self.file.flush()
    }

    /// Tries to write what waits.
    pub fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }

    /// How many bytes wait for room.
    pub fn waiting(&self) -> usize {
        self.file.waiting()
    }

    /// The frames that end within so many bytes of this run were taken.
    pub fn taken(&mut self, bytes: u64) {
        let left = self.read.saturating_sub(bytes) as usize;
        let over = self.recent.len().saturating_sub(left);
        self.recent.drain(..over);
    }

    /// Goes on in another file, from the frame on that was not taken yet: the bytes of both, one after the other, are those of
    /// the line. Where a step fails, this file stays as it is.
    pub fn next(&mut self, path: &Path) -> Result<()> {
        let offset = self.offset();
        let moved = self.file.flush().and_then(|()| {
            let (mut file, began) = open(path)?;
            file.write_all(&self.recent)?;
            self.file.file().set_len(offset)?;
            Ok((file, began))
        });
        let (file, began) = moved
            .into_diagnostic()
            .wrap_err_with(|| format!("cannot write {}", path.display()))?;
        self.length = began + self.recent.len() as u64;
        (self.file, self.began) = (Held::new(file), began);
        self.path = path.to_owned();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_goes_whole_into_one_file() {
        let folder = std::env::temp_dir().join(format!("imu-stand-raw-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        let (first, second) = (folder.join("1.raw"), folder.join("2.raw"));
        let mut raw = Raw::open(&first).unwrap();
        raw.write(b"ab\0cd").unwrap();
        raw.taken(3);
        assert_eq!(raw.offset(), 3);
        raw.next(&second).unwrap();
        assert_eq!(raw.offset(), 0);
        raw.write(b"e\0f").unwrap();
        raw.taken(7);
        assert_eq!(raw.offset(), 4);
        drop(raw);
        assert_eq!(std::fs::read(&first).unwrap(), b"ab\0");
        assert_eq!(std::fs::read(&second).unwrap(), b"cde\0f");
        // What was cut off in the middle of a frame is ended where it is gone on with.
        let raw = Raw::open(&second).unwrap();
        assert_eq!(raw.began(), 6);
        drop(raw);
        assert_eq!(std::fs::read(&second).unwrap(), b"cde\0f\0");
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
