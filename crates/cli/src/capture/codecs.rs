//! Codecs that the pages of Parquet alone have.

use std::io::{Error, ErrorKind, Result};

use super::logs::Bytes;
use super::unpack::whole;

/// Of gzip.
pub(super) fn unpack_gzip(packed: &[u8], size: u64) -> Result<Vec<u8>> {
    whole(flate2::read::MultiGzDecoder::new(packed), size)
}

/// Bytes that the decoder of Brotli takes at once.
const AT_ONCE: usize = 1 << 12;

/// Of Brotli.
pub(super) fn unpack_brotli(packed: &[u8], size: u64) -> Result<Vec<u8>> {
    whole(
        brotli_decompressor::Decompressor::new(packed, AT_ONCE),
        size,
    )
}

/// LZ4 can make 255 bytes of one at most.
const LZ4_RATIO: usize = 255;

/// One block of LZ4, without a frame.
pub(super) fn unpack_lz4_block(packed: &[u8], size: usize) -> Result<Vec<u8>> {
    let wrong = |why: String| Error::new(ErrorKind::InvalidData, format!("LZ4: {why}"));
    if size / LZ4_RATIO > packed.len() {
        return Err(wrong(format!("{size} bytes cannot be in {}", packed.len())));
    }
    let out =
        lz4_flex::block::decompress(packed, size).map_err(|error| wrong(error.to_string()))?;
    if out.len() != size {
        return Err(wrong(format!("{} bytes of {size}", out.len())));
    }
    Ok(out)
}

/// Blocks of LZ4 as Hadoop frames them: two lengths, unpacked and packed, big-endian, before each.
pub(super) fn unpack_lz4_hadoop(packed: &[u8], size: usize) -> Result<Vec<u8>> {
    let cut = || Error::new(ErrorKind::InvalidData, "LZ4: a frame is cut off");
    let mut bytes = Bytes::new(packed).with_order(true);
    let mut out = Vec::new();
    while !bytes.is_empty() {
        let unpacked = bytes.u32().ok_or_else(cut)? as usize;
        let block = bytes.counted().ok_or_else(cut)?;
        out.extend(unpack_lz4_block(block, unpacked)?);
        if out.len() > size {
            break;
        }
    }
    if out.len() == size {
        Ok(out)
    } else {
        Err(cut())
    }
}
