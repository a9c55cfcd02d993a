//! What is packed, in pieces of a known length or as a stream.

use std::io::{BufRead, Error, ErrorKind, Read, Result};

use ruzstd::decoding::{FrameDecoder, StreamingDecoder};

/// Reads all of it, and no byte more than was said.
pub(super) fn whole(mut input: impl Read, size: u64) -> Result<Vec<u8>> {
    let mut out = Vec::new();
    input.by_ref().take(size).read_to_end(&mut out)?;
    if out.len() as u64 != size {
        let why = format!("{} bytes of {size} are in a packed piece", out.len());
        return Err(Error::new(ErrorKind::InvalidData, why));
    }
    Ok(out)
}

/// Of Zstandard.
pub(super) fn unpack_zstd(packed: &[u8], size: u64) -> Result<Vec<u8>> {
    whole(zstd(packed)?, size)
}

/// Of Zstandard, of an unknown length: no byte more than these.
pub(super) fn unpack_zstd_up_to(packed: &[u8], most: u64) -> Result<Vec<u8>> {
    let mut out = Vec::new();
    zstd(packed)?.take(most).read_to_end(&mut out)?;
    Ok(out)
}

/// Of LZ4 in its frame format.
pub(super) fn unpack_lz4(packed: &[u8], size: u64) -> Result<Vec<u8>> {
    whole(lz4_flex::frame::FrameDecoder::new(packed), size)
}

/// Of bzip2.
pub(super) fn unpack_bzip2(packed: &[u8], size: u64) -> Result<Vec<u8>> {
    whole(bzip2::read::MultiBzDecoder::new(packed), size)
}

/// A stream of Zstandard, of one frame after the other.
pub(super) fn zstd<R: BufRead>(packed: R) -> Result<impl Read> {
    Ok(Frames::Within(Box::new(frame(packed)?)))
}

type Frame<R> = StreamingDecoder<R, FrameDecoder>;

fn frame<R: Read>(packed: R) -> Result<Frame<R>> {
    StreamingDecoder::new(packed).map_err(|error| bad(&error))
}

fn bad(error: &dyn std::fmt::Display) -> Error {
    Error::new(ErrorKind::InvalidData, format!("Zstandard: {error}"))
}

/// The decoder reads one frame; parallel writers make many.
enum Frames<R: BufRead> {
    Within(Box<Frame<R>>),
    Ended,
}

impl<R: BufRead> Read for Frames<R> {
    fn read(&mut self, into: &mut [u8]) -> Result<usize> {
        if into.is_empty() {
            return Ok(0);
        }
        while let Frames::Within(decoder) = self {
            let count = decoder.read(into).map_err(|error| bad(&error))?;
            if count > 0 {
                return Ok(count);
            }
            let Frames::Within(decoder) = std::mem::replace(self, Frames::Ended) else {
                break;
            };
            let mut rest = decoder.into_inner();
            if !rest.fill_buf()?.is_empty() {
                *self = Frames::Within(Box::new(frame(rest)?));
            }
        }
        Ok(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame of one raw block (RFC 8878): magic, descriptor with a size of one byte, that size, header of a last block.
    fn raw(text: &[u8]) -> Vec<u8> {
        let mut out = vec![0x28, 0xb5, 0x2f, 0xfd, 0x20, text.len() as u8];
        let block = (text.len() << 3) | 1;
        out.extend([block as u8, (block >> 8) as u8, 0]);
        out.extend(text);
        out
    }

    #[test]
    fn frames_of_zstandard_follow_one_another_and_a_size_is_held() {
        let both = [raw(b"time,"), raw(b"gyro_x")].concat();
        let mut text = String::new();
        let read = zstd(&both[..]).unwrap().read_to_string(&mut text);
        assert_eq!((read.unwrap(), text.as_str()), (11, "time,gyro_x"));
        assert_eq!(unpack_zstd(&both, 5).unwrap(), b"time,");
        let short = unpack_zstd(&both, 12).unwrap_err();
        assert_eq!(short.kind(), ErrorKind::InvalidData);
        assert!(unpack_zstd(&both[..9], 5).is_err());
    }
}
