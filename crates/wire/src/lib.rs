//! Frames, CRC and versions of the IMU stand's serial link, for the board and for the host alike.
//!
//! The format itself is `docs/wire-format.md`; this crate is one implementation of it and is pinned to it by byte
//! vectors that were computed independently (`tests/ref_vectors.rs`).
//!
//! On the line a frame is `COBS(payload ++ CRC-32C(payload), little endian) ++ 0x00`. The payload is a version byte, a
//! kind byte and fields of fixed width, little endian. Every kind has one exact length, so the time a sample takes on
//! the line does not depend on what was measured.
//!
//! `no_std`, no allocation, no table in memory on the AVR (constants land in its 1 KB of SRAM), no division, no 64-bit
//! arithmetic, and nothing that can panic.
//!
//! ```
//! use wire::{Decoder, Frame, Sample, encode};
//!
//! let sample = Sample { seq: 7, gyro: [-12, 3, 4368], flags: wire::flags::IN_ORDER, ..Sample::default() };
//! let mut line = [0; wire::MAX_FRAME];
//! let len = encode(&Frame::Sample(sample), &mut line).unwrap();
//!
//! let mut decoder = Decoder::new();
//! let frames: Vec<_> = line[..len].iter().filter_map(|&byte| decoder.push(byte)).collect();
//! assert_eq!(frames, [Ok(Frame::Sample(sample))]);
//! ```
#![no_std]
// The AVR's CRC is a few lines of assembly.
#![cfg_attr(not(target_arch = "avr"), forbid(unsafe_code))]
#![cfg_attr(target_arch = "avr", deny(unsafe_code), feature(asm_experimental_arch))]

#[cfg(test)]
extern crate std;

mod cobs;
mod command;
pub mod correction;
pub mod crc;
mod decode;
pub mod fields;
mod frame;
mod health;
pub mod link;

pub use command::{Asked, Axis, Command, Request, Sensor, Shape, Status, code, encode_request};
pub use decode::{DecodeError, Decoder, LinkCounts, RequestDecoder, RequestError};
pub use frame::{
    Corrected, EncodeError, Frame, Hello, Reply, Sample, correction_state, encode, flags,
    reset_cause,
};
pub use health::{Fault, FaultCounts, Health};

/// Version of the format that this crate writes and reads; the first byte of every payload.
pub const VERSION: u8 = 1;

/// The byte that ends a frame, and occurs nowhere else on the line.
pub const DELIMITER: u8 = 0x00;

/// The kind byte of each payload.
pub mod kind {
    /// [`Hello`](crate::Hello), board to PC.
    pub const HELLO: u8 = 0x01;
    /// [`Sample`](crate::Sample), board to PC.
    pub const SAMPLE: u8 = 0x02;
    /// [`Health`](crate::Health), board to PC.
    pub const HEALTH: u8 = 0x03;
    /// [`Reply`](crate::Reply), board to PC.
    pub const REPLY: u8 = 0x04;
    /// [`Corrected`](crate::Corrected), board to PC.
    pub const CORRECTED: u8 = 0x05;
    /// [`Request`](crate::Request), PC to board.
    pub const REQUEST: u8 = 0x10;
}

/// Bytes on the line that a payload does not have: COBS code, CRC-32C, delimiter.
pub const OVERHEAD: usize = 1 + 4 + 1;

/// Length of the longest frame on the line, delimiter included; a buffer of this size takes any frame.
pub const MAX_FRAME: usize = Health::FRAME_LEN;

// COBS needs one code byte only while payload and CRC have at most 253 bytes, and lengths are kept in a `u8`.
const _: () = assert!(
    MAX_FRAME <= 255
        && Hello::FRAME_LEN <= MAX_FRAME
        && Sample::FRAME_LEN <= MAX_FRAME
        && Reply::FRAME_LEN <= MAX_FRAME
        && Corrected::FRAME_LEN <= MAX_FRAME
);
