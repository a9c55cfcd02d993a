//! A file on a disk that may be full: what could not be written waits in memory, and nothing of it is lost or written twice.

use std::fs::File;
use std::io::{Result, Write};

/// Bytes that wait before the file is asked by itself.
const BLOCK: usize = 1 << 13;

/// A file, and what waits for it. [`write`](Write::write) takes every byte; [`flush`](Write::flush) says whether all of them
/// are in the file, and may be tried again.
#[derive(Debug)]
pub struct Held {
    file: File,
    waiting: Vec<u8>,
}

impl Held {
    /// Writes at the file's place.
    #[must_use]
    pub fn new(file: File) -> Self {
        Self {
            file,
            waiting: Vec::new(),
        }
    }

    /// How many bytes wait.
    #[must_use]
    pub fn waiting(&self) -> usize {
        self.waiting.len()
    }

    /// The file, without what waits.
    #[must_use]
    pub fn file(&self) -> &File {
        &self.file
    }

    fn drain(&mut self) -> Result<()> {
        let (done, result) = write_to(&mut self.file, &self.waiting);
        self.waiting.drain(..done);
        result
    }
}

/// How many of the bytes were written, and why not all.
fn write_to(out: &mut impl Write, bytes: &[u8]) -> (usize, Result<()>) {
    let mut done = 0;
    while let Some(left) = bytes.get(done..).filter(|left| !left.is_empty()) {
        match out.write(left) {
            Ok(0) => return (done, Err(std::io::ErrorKind::WriteZero.into())),
            Ok(count) => done += count,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return (done, Err(error)),
        }
    }
    (done, Ok(()))
}

impl Write for Held {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.waiting.extend_from_slice(bytes);
        if self.waiting.len() >= BLOCK {
            // What is not written now is at the next flush, which says why.
            let _ = self.drain();
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        self.drain()?;
        self.file.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Takes so many bytes, and no more.
    struct Small(Vec<u8>, usize);

    impl Write for Small {
        fn write(&mut self, bytes: &[u8]) -> Result<usize> {
            let count = bytes.len().min(self.1.saturating_sub(self.0.len()));
            if count == 0 {
                return Err(std::io::ErrorKind::StorageFull.into());
            }
            self.0.extend(&bytes[..count]);
            Ok(count)
        }

        fn flush(&mut self) -> Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_write_that_fails_half_way_says_how_far_it_came() {
        let mut disk = Small(Vec::new(), 5);
        let (done, result) = write_to(&mut disk, b"abcdefgh");
        assert_eq!((done, disk.0.as_slice()), (5, b"abcde".as_slice()));
        assert!(result.is_err());
        disk.1 = 100;
        let (done, result) = write_to(&mut disk, b"fgh");
        assert_eq!((done, disk.0.as_slice()), (3, b"abcdefgh".as_slice()));
        assert!(result.is_ok());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_takes_nothing_and_loses_nothing() {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full");
        let mut held = Held::new(full.unwrap());
        held.write_all(&[7; 3 * BLOCK]).unwrap();
        assert_eq!(held.waiting(), 3 * BLOCK);
        for _ in 0..2 {
            assert!(held.flush().is_err());
            assert_eq!(held.waiting(), 3 * BLOCK);
        }
    }
}
