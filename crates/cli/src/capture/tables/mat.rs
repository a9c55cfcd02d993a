//! MATLAB's .mat of version 5 to 7.

use std::fs::File;
use std::io::{BufReader, Cursor, Read as _, Seek as _, SeekFrom};
use std::path::Path;

use super::hdf5::hdf5;
use super::{Arrays, NUMBER, ROOM, open};

pub(super) fn mat(path: &Path) -> Result<Arrays, String> {
    let mut start = [0; 10];
    let mut file = open(path)?;
    let mut out = Arrays::of(&file)?;
    if file.read_exact(&mut start).is_ok() && &start == b"MATLAB 7.3" {
        return hdf5(path);
    }
    // Later versions begin with words; version 4 with the kind of its first array.
    if !start.is_ascii() || start.contains(&0) {
        return Err(
            "it does not begin as a .mat of version 5 to 7.3: one of version 4 is written anew by `save(FILE, '-v7')`, or \
             scipy's `savemat(FILE, ...)`"
                .to_owned(),
        );
    }
    out.reserve("of all", &[unpacked_mat(&mut file)? / NUMBER])?;
    let file = matfile::MatFile::parse(Cursor::new(start).chain(file))
        .map_err(|error| format!("it is no .mat of version 5 to 7: {error}"))?;
    for array in file.arrays() {
        use matfile::NumericData as N;
        let values: Vec<f64> = match array.data() {
            N::Double { real, .. } => real.clone(),
            N::Single { real, .. } => real.iter().map(|v| f64::from(*v)).collect(),
            N::Int8 { real, .. } => real.iter().map(|v| f64::from(*v)).collect(),
            N::UInt8 { real, .. } => real.iter().map(|v| f64::from(*v)).collect(),
            N::Int16 { real, .. } => real.iter().map(|v| f64::from(*v)).collect(),
            N::UInt16 { real, .. } => real.iter().map(|v| f64::from(*v)).collect(),
            N::Int32 { real, .. } => real.iter().map(|v| f64::from(*v)).collect(),
            N::UInt32 { real, .. } => real.iter().map(|v| f64::from(*v)).collect(),
            N::Int64 { real, .. } => real.iter().map(|v| *v as f64).collect(),
            N::UInt64 { real, .. } => real.iter().map(|v| *v as f64).collect(),
        };
        out.add(array.name(), array.size(), values, false);
    }
    if out.columns.is_empty() {
        return Err(
            "it holds no array of numbers; the fields of a struct become arrays by `save(FILE, '-struct', 'NAME')`, or are read \
             as they are from version 7.3: `save(FILE, '-v7.3')`"
                .to_owned(),
        );
    }
    Ok(out)
}

/// Bytes that the packed elements of a .mat of version 5 to 7 unpack to, up to where they are too many; the file stands behind
/// its first ten bytes before and after. An element has its kind and length before it, 4 bytes each: kind 14 is an array, kind 15
/// a packed one. Others, and what does not unpack, are refused here: the library would print its view of them and go on.
fn unpacked_mat(file: &mut File) -> Result<u64, String> {
    const ARRAY: u32 = 14;
    const PACKED: u32 = 15;
    let wrong = |error: std::io::Error| error.to_string();
    let mut bytes = BufReader::new(&mut *file);
    // The header, of 128 bytes, says the order of bytes in its last two.
    let mut header = [0; 118];
    let mut size = 0;
    if bytes.read_exact(&mut header).is_ok() {
        let is_little = header.ends_with(b"IM");
        let word = |b: [u8; 4]| match is_little {
            true => u32::from_le_bytes(b),
            false => u32::from_be_bytes(b),
        };
        let mut tag = [0; 8];
        while bytes.read_exact(&mut tag).is_ok() {
            let [a, b, c, d, e, f, g, h] = tag;
            let (kind, length) = (word([a, b, c, d]), word([e, f, g, h]));
            let mut element = bytes.by_ref().take(length.into());
            if kind == PACKED {
                let unpacked = flate2::read::ZlibDecoder::new(&mut element).take(ROOM);
                size += std::io::copy(&mut { unpacked }, &mut std::io::sink())
                    .map_err(|error| format!("a packed array of it is damaged: {error}"))?;
            } else if kind != ARRAY {
                return Err(format!(
                    "it is damaged, or no .mat of version 5 to 7: an element of kind {kind} stands where an array has {ARRAY} or \
                     {PACKED}"
                ));
            }
            if size >= ROOM {
                size = u64::MAX;
                break;
            }
            std::io::copy(&mut element, &mut std::io::sink()).map_err(wrong)?;
        }
    }
    file.seek(SeekFrom::Start(10)).map_err(wrong)?;
    Ok(size)
}
