//! MCAP, which rosbag2 writes: records one after the other, in compressed chunks or not. What is needed of them is read in
//! their order, so that a file without its index, of a recorder that was killed, is read as far as it goes.

use std::collections::HashMap;
use std::io::{BufRead, Read as _};

use super::super::unpack::{unpack_lz4, unpack_zstd};
use super::imu::{Kind, Topics};
use super::{Bytes, LogError, Read, chunk_of, packed_by};

/// Opcodes of the records that are read (MCAP format specification).
const SCHEMA: u8 = 0x03;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const CHUNK: u8 = 0x06;
const DATA_END: u8 = 0x0f;

/// What is known so far.
#[derive(Default)]
struct Reader {
    /// Names of message types.
    schemas: HashMap<u16, String>,
    /// Topics of channels.
    channels: HashMap<u16, String>,
    topics: Topics,
}

/// Reads the file behind its magic.
pub(super) fn read(input: &mut dyn BufRead, topic: Option<&str>) -> Read {
    let mut reader = Reader::default();
    let mut content = Vec::new();
    let is_cut = loop {
        let mut head = Vec::with_capacity(9);
        input.take(9).read_to_end(&mut head)?;
        let mut bytes = Bytes::new(&head);
        let (Some(opcode), Some(length)) = (bytes.u8(), bytes.u64()) else {
            break true;
        };
        if opcode == DATA_END {
            break false;
        }
        if matches!(opcode, SCHEMA | CHANNEL | MESSAGE | CHUNK) {
            content.clear();
            input.take(length).read_to_end(&mut content)?;
            if (content.len() as u64) < length {
                break true;
            }
            reader.record(opcode, &content)?;
        } else {
            std::io::copy(&mut input.take(length), &mut std::io::sink())?;
        }
    };
    Ok((reader.topics.table(topic)?, is_cut))
}

impl Reader {
    fn record(&mut self, opcode: u8, content: &[u8]) -> Result<(), LogError> {
        let read = match opcode {
            SCHEMA => self.schema(content),
            CHANNEL => self.channel(content),
            MESSAGE => self.message(content),
            CHUNK => return self.chunk(content),
            _ => Some(()),
        };
        read.ok_or_else(|| LogError::Damaged(format!("a record of kind {opcode} is too short")))
    }

    fn schema(&mut self, content: &[u8]) -> Option<()> {
        let mut bytes = Bytes::new(content);
        let (id, name) = (bytes.u16()?, bytes.text()?);
        self.schemas.insert(id, name);
        Some(())
    }

    fn channel(&mut self, content: &[u8]) -> Option<()> {
        let mut bytes = Bytes::new(content);
        let (id, schema) = (bytes.u16()?, bytes.u16()?);
        let (topic, encoding) = (bytes.text()?, bytes.text()?);
        let message = self.schemas.get(&schema).map_or("", String::as_str);
        self.topics
            .add(&topic, message, Kind::of(message, &encoding));
        self.channels.insert(id, topic);
        Some(())
    }

    fn message(&mut self, content: &[u8]) -> Option<()> {
        let mut bytes = Bytes::new(content);
        let channel = bytes.u16()?;
        bytes.u32()?; // sequence number
        let recorded = bytes.u64()? as i64;
        bytes.u64()?; // time of publication
        if let Some(topic) = self.channels.get(&channel) {
            self.topics.take(topic, recorded, bytes.rest());
        }
        Some(())
    }

    fn chunk(&mut self, content: &[u8]) -> Result<(), LogError> {
        let cut = || LogError::Damaged("a chunk is too short".to_owned());
        let mut bytes = Bytes::new(content);
        let mut head = || {
            bytes.take(16)?; // times of the first and the last message
            let size = bytes.u64()?;
            bytes.u32()?; // CRC
            let packing = bytes.text()?;
            let length = usize::try_from(bytes.u64()?).ok()?;
            Some((size, packing, bytes.take(length)?))
        };
        let (size, packing, packed) = head().ok_or_else(cut)?;
        chunk_of(size)?;
        let unpacked = match packing.as_str() {
            "" => packed.to_vec(),
            "zstd" => unpack_zstd(packed, size)?,
            "lz4" => unpack_lz4(packed, size)?,
            other => return Err(packed_by(other, "zstd, lz4 and none")),
        };
        let mut records = Bytes::new(&unpacked);
        while !records.is_empty() {
            let mut next = || {
                let opcode = records.u8()?;
                let length = usize::try_from(records.u64()?).ok()?;
                Some((opcode, records.take(length)?))
            };
            let (opcode, content) = next().ok_or_else(cut)?;
            if opcode != CHUNK {
                self.record(opcode, content)?;
            }
        }
        Ok(())
    }
}
