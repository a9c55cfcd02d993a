//! Text in UTF-16, as spreadsheets and Windows save it, made UTF-8 on the way.

use std::io::{BufRead, BufReader, Read, Result};

/// How it begins: the mark of the order of its bytes.
const LITTLE: &[u8] = b"\xff\xfe";
const BIG: &[u8] = b"\xfe\xff";
/// Begins UTF-32 as well, which nobody saves tables in.
const UTF_32: &[u8] = b"\xff\xfe\0\0";

/// The stream as UTF-8 where it begins as UTF-16, else as it is.
///
/// # Errors
/// The stream's.
pub(super) fn utf8<'a>(mut input: impl BufRead + 'a) -> Result<Box<dyn BufRead + 'a>> {
    let start = input.fill_buf()?;
    let order: Option<fn([u8; 2]) -> u16> = match start {
        _ if start.starts_with(UTF_32) => None,
        _ if start.starts_with(LITTLE) => Some(u16::from_le_bytes),
        _ if start.starts_with(BIG) => Some(u16::from_be_bytes),
        _ => None,
    };
    let Some(order) = order else {
        return Ok(Box::new(input));
    };
    input.consume(LITTLE.len());
    Ok(Box::new(BufReader::new(Utf16 {
        input,
        order,
        half: None,
        made: Vec::new(),
        given: 0,
    })))
}

struct Utf16<R> {
    input: R,
    order: fn([u8; 2]) -> u16,
    /// The first of the two units of a character.
    half: Option<u16>,
    /// Made UTF-8, and how much of it was given.
    made: Vec<u8>,
    given: usize,
}

/// Units that are made at once.
const AT_ONCE: usize = 1 << 14;

impl<R: BufRead> Utf16<R> {
    fn make(&mut self) -> Result<()> {
        let mut bytes = Vec::with_capacity(2 * AT_ONCE);
        (&mut self.input)
            .take(2 * AT_ONCE as u64)
            .read_to_end(&mut bytes)?;
        // Half a unit at the end of a file that was cut off is nothing.
        let units = (bytes.chunks_exact(2)).map(|pair| (self.order)([pair[0], pair[1]]));
        let mut units: Vec<u16> = self.half.take().into_iter().chain(units).collect();
        let is_first = |unit: &u16| (0xd800..0xdc00).contains(unit);
        if bytes.len() == 2 * AT_ONCE {
            self.half = units.pop_if(|unit| is_first(unit));
        }
        let text: String = char::decode_utf16(units)
            .map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER))
            .collect();
        (self.made, self.given) = (text.into_bytes(), 0);
        Ok(())
    }
}

impl<R: BufRead> Read for Utf16<R> {
    fn read(&mut self, into: &mut [u8]) -> Result<usize> {
        if self.given == self.made.len() {
            self.make()?;
        }
        let rest = &self.made[self.given..];
        let count = rest.len().min(into.len());
        into[..count].copy_from_slice(&rest[..count]);
        self.given += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn utf_16_of_either_order_becomes_utf_8_over_the_edges_of_what_is_read_at_once() {
        // An odd count of units before characters of two.
        let text = format!("a{}°/s", "\u{1f600}".repeat(AT_ONCE));
        for (mark, bytes) in [
            (LITTLE, u16::to_le_bytes as fn(u16) -> [u8; 2]),
            (BIG, u16::to_be_bytes),
        ] {
            let mut file = mark.to_vec();
            file.extend(text.encode_utf16().flat_map(bytes));
            let mut read = String::new();
            let mut utf8 = utf8(&file[..]).expect("a stream");
            utf8.read_to_string(&mut read).expect("UTF-8");
            assert!(read == text);
        }
        let mut read = Vec::new();
        let mut utf8 = utf8(&b"plain"[..]).expect("a stream");
        utf8.read_to_end(&mut read).expect("as it is");
        assert_eq!(read, b"plain");
    }
}
