//! A text whose lines are made anew on the way, each in its place.

use std::borrow::Cow;
use std::io::{BufRead, Read, Result};

use super::stream::LONGEST_LINE;

/// Lines that `make` makes of those of the input: the line without its end, and the place for what comes instead of it.
pub(super) struct Made<R, F> {
    input: R,
    make: F,
    line: Vec<u8>,
    /// What was made, and how much of it was given.
    made: String,
    given: usize,
}

impl<R: BufRead, F: FnMut(&str, &mut String)> Made<R, F> {
    pub fn new(input: R, make: F) -> Self {
        Self {
            input,
            make,
            line: Vec::new(),
            made: String::new(),
            given: 0,
        }
    }

    /// Makes the next line; nothing at the end.
    fn next(&mut self) -> Result<()> {
        self.line.clear();
        self.made.clear();
        self.given = 0;
        let mut input = self.input.by_ref().take(LONGEST_LINE);
        if input.read_until(b'\n', &mut self.line)? > 0 {
            let line = decoded(&self.line);
            (self.make)(line.trim_end_matches(['\r', '\n']), &mut self.made);
            self.made.push('\n');
        }
        Ok(())
    }
}

/// UTF-8, or Latin-1 where it is none.
pub(super) fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => bytes.iter().map(|b| char::from(*b)).collect(),
    }
}

impl<R: BufRead, F: FnMut(&str, &mut String)> Read for Made<R, F> {
    fn read(&mut self, into: &mut [u8]) -> Result<usize> {
        let from = self.fill_buf()?;
        let n = from.len().min(into.len());
        into[..n].copy_from_slice(&from[..n]);
        self.consume(n);
        Ok(n)
    }
}

impl<R: BufRead, F: FnMut(&str, &mut String)> BufRead for Made<R, F> {
    fn fill_buf(&mut self) -> Result<&[u8]> {
        if self.given == self.made.len() {
            self.next()?;
        }
        Ok(&self.made.as_bytes()[self.given..])
    }

    fn consume(&mut self, n: usize) {
        self.given = (self.given + n).min(self.made.len());
    }
}
