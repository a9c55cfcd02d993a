//! ROS 1 bags, version 2.0: records of a header of `name=value` fields and data, in chunks that may be packed.

use std::collections::HashMap;
use std::io::{BufRead, Read as _};

use super::super::unpack::{unpack_bzip2, unpack_lz4};
use super::imu::{Kind, Topics};
use super::{Bytes, LogError, Read, chunk_of, packed_by};

/// `op` of the records that are read (ROS wiki, Bags/Format/2.0).
const MESSAGE: u8 = 0x02;
const CHUNK: u8 = 0x05;
const CONNECTION: u8 = 0x07;

/// Fields of a record's header.
struct Fields<'a>(Vec<(&'a [u8], &'a [u8])>);

impl<'a> Fields<'a> {
    fn of(header: &'a [u8]) -> Option<Self> {
        let mut bytes = Bytes::new(header);
        let mut fields = Vec::new();
        while !bytes.is_empty() {
            let field = bytes.counted()?;
            let at = field.iter().position(|b| *b == b'=')?;
            fields.push((&field[..at], &field[at + 1..]));
        }
        Some(Self(fields))
    }

    fn get(&self, name: &str) -> Option<Bytes<'a>> {
        let field = self.0.iter().find(|(n, _)| *n == name.as_bytes());
        field.map(|(_, value)| Bytes::new(value))
    }

    fn text(&self, name: &str) -> Option<String> {
        Some(String::from_utf8_lossy(self.get(name)?.rest()).into_owned())
    }
}

#[derive(Default)]
struct Reader {
    /// Topics of connections.
    connections: HashMap<u32, String>,
    topics: Topics,
}

/// Reads the file behind its first line.
pub(super) fn read(input: &mut dyn BufRead, topic: Option<&str>) -> Read {
    let mut reader = Reader::default();
    // Nothing is taken of a length that the file does not have.
    let mut counted = |into: &mut Vec<u8>| -> std::io::Result<Option<bool>> {
        let mut length = Vec::with_capacity(4);
        input.take(4).read_to_end(&mut length)?;
        let Some(length) = Bytes::new(&length).u32() else {
            return Ok(length.is_empty().then_some(false));
        };
        into.clear();
        input.take(length.into()).read_to_end(into)?;
        Ok((into.len() == length as usize).then_some(true))
    };
    let (mut header, mut data) = (Vec::new(), Vec::new());
    let is_cut = loop {
        match counted(&mut header)? {
            Some(false) => break false,
            Some(true) if counted(&mut data)? == Some(true) => {
                reader.record(&header, &data, true)?;
            }
            _ => break true,
        }
    };
    Ok((reader.topics.table(topic)?, is_cut))
}

impl Reader {
    fn record(&mut self, header: &[u8], data: &[u8], may_be_chunk: bool) -> Result<(), LogError> {
        let bad = || LogError::Damaged("a record's header is none".to_owned());
        let fields = Fields::of(header).ok_or_else(bad)?;
        let op = fields.get("op").and_then(|mut b| b.u8()).ok_or_else(bad)?;
        match op {
            CONNECTION => self.connection(&fields, data).ok_or_else(bad),
            MESSAGE => self.message(&fields, data).ok_or_else(bad),
            CHUNK if may_be_chunk => self.chunk(&fields, data),
            _ => Ok(()),
        }
    }

    fn connection(&mut self, fields: &Fields<'_>, data: &[u8]) -> Option<()> {
        let id = fields.get("conn")?.u32()?;
        let topic = fields.text("topic")?;
        let message = Fields::of(data)?.text("type")?;
        self.topics
            .add(&topic, &message, Kind::of(&message, "ros1"));
        self.connections.insert(id, topic);
        Some(())
    }

    fn message(&mut self, fields: &Fields<'_>, data: &[u8]) -> Option<()> {
        let id = fields.get("conn")?.u32()?;
        let mut time = fields.get("time")?;
        let recorded = i64::from(time.u32()?) * 1_000_000_000 + i64::from(time.u32()?);
        if let Some(topic) = self.connections.get(&id) {
            self.topics.take(topic, recorded, data);
        }
        Some(())
    }

    fn chunk(&mut self, fields: &Fields<'_>, packed: &[u8]) -> Result<(), LogError> {
        let cut = || LogError::Damaged("a chunk is too short".to_owned());
        let size = fields.get("size").and_then(|mut b| b.u32());
        let size = u64::from(size.ok_or_else(cut)?);
        chunk_of(size)?;
        let packing = fields.text("compression").ok_or_else(cut)?;
        let unpacked = match packing.as_str() {
            "none" => packed.to_vec(),
            "bz2" => unpack_bzip2(packed, size)?,
            "lz4" => unpack_lz4(packed, size)?,
            other => return Err(packed_by(other, "bz2, lz4 and none")),
        };
        let mut records = Bytes::new(&unpacked);
        while !records.is_empty() {
            let header = records.counted().ok_or_else(cut)?;
            let data = records.counted().ok_or_else(cut)?;
            self.record(header, data, false)?;
        }
        Ok(())
    }
}
