//! Pages of Parquet that are packed by a codec which `parquet` reads by C or by large features alone: unpacked here, in
//! Rust, and handed to its decoders.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};

use parquet::basic::{Compression, Encoding};
use parquet::column::page::{Page, PageMetadata, PageReader};
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::ColumnChunkMetaData;

use super::{codecs, unpack};

/// Whether a column's pages are read here.
pub(super) fn is_packed_otherwise(codec: Compression) -> bool {
    !matches!(codec, Compression::UNCOMPRESSED | Compression::SNAPPY)
}

/// The pages of one column chunk.
pub(super) struct Pages {
    chunk: Vec<u8>,
    /// Where the next page begins.
    at: usize,
    codec: Compression,
}

/// What stands before a page (`PageHeader` of parquet.thrift), by the numbers of its fields.
#[derive(Default)]
struct Head {
    kind: i64,
    unpacked: i64,
    packed: i64,
    /// Fields of the header of a data page, of a dictionary and of a data page of version 2.
    data: Fields,
    dictionary: Fields,
    data_v2: Fields,
    /// Bytes of the head itself.
    length: usize,
}

/// Whole numbers of a struct by their ids, from 1 on; a flag is 0 or 1.
type Fields = [Option<i64>; 8];

/// Kinds of page (`PageType`).
const DATA_PAGE: i64 = 0;
const DICTIONARY_PAGE: i64 = 2;
const DATA_PAGE_V2: i64 = 3;

fn bad(why: &str) -> ParquetError {
    ParquetError::General(why.to_owned())
}

impl Pages {
    /// Reads a chunk; nothing is taken that the file does not have.
    pub fn of(file: &mut File, column: &ColumnChunkMetaData) -> Result<Self> {
        let start = column
            .dictionary_page_offset()
            .unwrap_or(column.data_page_offset());
        let (Ok(start), Ok(length)) = (
            u64::try_from(start),
            u64::try_from(column.compressed_size()),
        ) else {
            return Err(bad("a column stands at a negative place"));
        };
        file.seek(SeekFrom::Start(start))?;
        let mut chunk = Vec::new();
        file.take(length).read_to_end(&mut chunk)?;
        Ok(Self {
            chunk,
            at: 0,
            codec: column.compression(),
        })
    }

    fn head(&self) -> Result<Option<Head>> {
        match self.chunk.get(self.at..) {
            None | Some([]) => Ok(None),
            Some(rest) => Thrift { bytes: rest, at: 0 }
                .head()
                .map(Some)
                .ok_or_else(|| bad("the header of a page is none")),
        }
    }

    /// Goes behind the page, and returns its bytes as they are.
    fn body(&mut self, head: &Head) -> Result<&[u8]> {
        let from = self.at + head.length;
        let to = usize::try_from(head.packed)
            .ok()
            .and_then(|n| from.checked_add(n));
        let to = to.filter(|to| *to <= self.chunk.len());
        let to = to.ok_or_else(|| bad("a page is longer than its column"))?;
        self.at = to;
        Ok(&self.chunk[from..to])
    }

    fn page(&mut self, head: &Head) -> Result<Option<Page>> {
        let codec = self.codec;
        let size = usize::try_from(head.unpacked).map_err(|_| bad("a page of negative size"))?;
        let packed = self.body(head)?;
        let page = match head.kind {
            DATA_PAGE => Page::DataPage {
                buf: unpacked(codec, packed, size)?.into(),
                num_values: count(head.data[0])?,
                encoding: encoding(head.data[1])?,
                def_level_encoding: encoding(head.data[2])?,
                rep_level_encoding: encoding(head.data[3])?,
                statistics: None,
            },
            DICTIONARY_PAGE => Page::DictionaryPage {
                buf: unpacked(codec, packed, size)?.into(),
                num_values: count(head.dictionary[0])?,
                encoding: encoding(head.dictionary[1])?,
                is_sorted: head.dictionary[2] == Some(1),
            },
            DATA_PAGE_V2 => {
                let h = &head.data_v2;
                let (def, rep) = (count(h[4])?, count(h[5])?);
                // The levels stand before the values and are never packed.
                let levels = def as usize + rep as usize;
                let is_packed = h[6] != Some(0);
                let (plain, values) = (packed.split_at_checked(levels))
                    .filter(|_| levels <= size)
                    .ok_or_else(|| bad("a page is shorter than its levels"))?;
                let mut buf = plain.to_vec();
                if is_packed && levels < size {
                    buf.extend(unpacked(codec, values, size - levels)?);
                } else {
                    buf.extend_from_slice(values);
                }
                Page::DataPageV2 {
                    buf: buf.into(),
                    num_values: count(h[0])?,
                    encoding: encoding(h[3])?,
                    num_nulls: count(h[1])?,
                    num_rows: count(h[2])?,
                    def_levels_byte_len: def,
                    rep_levels_byte_len: rep,
                    is_compressed: false,
                    statistics: None,
                }
            }
            // An index holds no values.
            _ => return Ok(None),
        };
        Ok(Some(page))
    }
}

impl PageReader for Pages {
    fn get_next_page(&mut self) -> Result<Option<Page>> {
        while let Some(head) = self.head()? {
            if let Some(page) = self.page(&head)? {
                return Ok(Some(page));
            }
        }
        Ok(None)
    }

    fn peek_next_page(&mut self) -> Result<Option<PageMetadata>> {
        let Some(head) = self.head()? else {
            return Ok(None);
        };
        let number = |n: Option<i64>| n.and_then(|n| usize::try_from(n).ok());
        let is_v2 = head.kind == DATA_PAGE_V2;
        Ok(Some(PageMetadata {
            num_rows: number(head.data_v2[2]).filter(|_| is_v2),
            num_levels: number(if is_v2 { head.data_v2[0] } else { head.data[0] }),
            is_dict: head.kind == DICTIONARY_PAGE,
        }))
    }

    fn skip_next_page(&mut self) -> Result<()> {
        if let Some(head) = self.head()? {
            self.body(&head)?;
        }
        Ok(())
    }
}

impl Iterator for Pages {
    type Item = Result<Page>;

    fn next(&mut self) -> Option<Self::Item> {
        self.get_next_page().transpose()
    }
}

fn count(number: Option<i64>) -> Result<u32> {
    let number = number.and_then(|n| u32::try_from(n).ok());
    number.ok_or_else(|| bad("the header of a page lacks a number"))
}

fn encoding(number: Option<i64>) -> Result<Encoding> {
    Ok(match number {
        Some(0) => Encoding::PLAIN,
        #[allow(deprecated)] // Old writers say so.
        Some(2) => Encoding::PLAIN_DICTIONARY,
        Some(3) => Encoding::RLE,
        #[allow(deprecated)]
        Some(4) => Encoding::BIT_PACKED,
        Some(5) => Encoding::DELTA_BINARY_PACKED,
        Some(6) => Encoding::DELTA_LENGTH_BYTE_ARRAY,
        Some(7) => Encoding::DELTA_BYTE_ARRAY,
        Some(8) => Encoding::RLE_DICTIONARY,
        Some(9) => Encoding::BYTE_STREAM_SPLIT,
        _ => return Err(bad("a page in an encoding that is not known")),
    })
}

/// The values of a page of so many bytes.
fn unpacked(codec: Compression, packed: &[u8], size: usize) -> Result<Vec<u8>> {
    if size == 0 {
        return Ok(Vec::new());
    }
    let bytes = size as u64;
    Ok(match codec {
        Compression::GZIP(_) => codecs::unpack_gzip(packed, bytes)?,
        Compression::BROTLI(_) => codecs::unpack_brotli(packed, bytes)?,
        Compression::ZSTD(_) => unpack::unpack_zstd(packed, bytes)?,
        Compression::LZ4_RAW => codecs::unpack_lz4_block(packed, size)?,
        // Hadoop's own framing, which old writers left out.
        Compression::LZ4 => match codecs::unpack_lz4_hadoop(packed, size) {
            Ok(values) => values,
            Err(_) => codecs::unpack_lz4_block(packed, size)?,
        },
        other => return Err(bad(&format!("its columns are packed by {other}"))),
    })
}

/// Thrift's compact protocol, as far as a page's head needs it.
struct Thrift<'a> {
    bytes: &'a [u8],
    at: usize,
}

/// Types of the compact protocol.
const STOP: u8 = 0;
const TRUE: u8 = 1;
const FALSE: u8 = 2;
const BYTE: u8 = 3;
const DOUBLE: u8 = 7;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const SET: u8 = 10;
const STRUCT: u8 = 12;
/// Structs within structs that are followed.
const DEEPEST: usize = 8;

impl Thrift<'_> {
    fn head(mut self) -> Option<Head> {
        let mut head = Head::default();
        let mut id = 0;
        while let Some(kind) = self.field(&mut id)? {
            match (id, kind) {
                (1..=3, _) => {
                    let number = self.number(kind, 0)?;
                    match id {
                        1 => head.kind = number?,
                        2 => head.unpacked = number?,
                        _ => head.packed = number?,
                    }
                }
                (5, STRUCT) => head.data = self.fields()?,
                (7, STRUCT) => head.dictionary = self.fields()?,
                (8, STRUCT) => head.data_v2 = self.fields()?,
                _ => {
                    self.number(kind, 0)?;
                }
            }
        }
        head.length = self.at;
        Some(head)
    }

    /// The numbers of a struct.
    fn fields(&mut self) -> Option<Fields> {
        let mut fields = Fields::default();
        let mut id = 0;
        while let Some(kind) = self.field(&mut id)? {
            let number = self.number(kind, 1)?;
            let place = usize::try_from(id - 1).ok();
            if let Some(field) = place.and_then(|place| fields.get_mut(place)) {
                *field = number;
            }
        }
        Some(fields)
    }

    /// Type of the next field, whose number is set; nothing inside at the end of the struct.
    fn field(&mut self, id: &mut i64) -> Option<Option<u8>> {
        let byte = self.byte()?;
        let kind = byte & 0x0f;
        if kind == STOP {
            return Some(None);
        }
        *id = match byte >> 4 {
            0 => self.zigzag()?,
            step => id.checked_add(i64::from(step))?,
        };
        Some(Some(kind))
    }

    /// A value: a whole number or flag as such, nothing inside for what is passed over.
    fn number(&mut self, kind: u8, depth: usize) -> Option<Option<i64>> {
        match kind {
            TRUE => Some(Some(1)),
            FALSE => Some(Some(0)),
            BYTE => self.byte().map(|b| Some(i64::from(b))),
            4..=6 => self.zigzag().map(Some),
            DOUBLE => self.skip(8).map(|()| None),
            BINARY => {
                let length = usize::try_from(self.varint()?).ok()?;
                self.skip(length).map(|()| None)
            }
            LIST | SET => {
                let byte = self.byte()?;
                let count = match byte >> 4 {
                    15 => self.varint()?,
                    n => n.into(),
                };
                for _ in 0..count {
                    self.number(byte & 0x0f, depth + 1)?;
                }
                Some(None)
            }
            STRUCT if depth < DEEPEST => {
                let mut id = 0;
                while let Some(kind) = self.field(&mut id)? {
                    self.number(kind, depth + 1)?;
                }
                Some(None)
            }
            _ => None,
        }
    }

    fn byte(&mut self) -> Option<u8> {
        let byte = *self.bytes.get(self.at)?;
        self.at += 1;
        Some(byte)
    }

    fn skip(&mut self, count: usize) -> Option<()> {
        self.at = self
            .at
            .checked_add(count)
            .filter(|at| *at <= self.bytes.len())?;
        Some(())
    }

    fn varint(&mut self) -> Option<u64> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Some(number);
            }
        }
        None
    }

    fn zigzag(&mut self) -> Option<i64> {
        let number = self.varint()?;
        Some((number >> 1) as i64 ^ -((number & 1) as i64))
    }
}
