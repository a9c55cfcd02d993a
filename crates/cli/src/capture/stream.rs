//! A stream, unpacked.

use std::io::{BufRead, BufReader, Result};

/// How gzip begins.
const GZIP: &[u8] = &[0x1f, 0x8b];

/// The text of a stream that is gzip, or of one that is not.
///
/// # Errors
/// The stream's.
pub fn unpacked<'a>(mut input: impl BufRead + 'a) -> Result<Box<dyn BufRead + 'a>> {
    if input.fill_buf()?.starts_with(GZIP) {
        let text = flate2::bufread::MultiGzDecoder::new(input);
        return Ok(Box::new(BufReader::new(text)));
    }
    Ok(Box::new(input))
}
