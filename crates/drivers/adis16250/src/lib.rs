//! Driver for the ADIS16250/ADIS16255 single-axis yaw rate gyroscope (Analog Devices).
//!
//! | | |
//! |---|---|
//! | part | ADIS16250; ADIS16255 (the same registers, calibrated over temperature) |
//! | data sheet | ADIS16250/ADIS16255 Rev. B (pages 11, 12, 15) and Rev. D (page 1) |
//! | bus | SPI mode 3 (clock idles high, both sides sample on the rising edge), MSB first, chip select low |
//! | word | 16 bits; bit 15 write, bits 13:8 byte address, bits 7:0 data |
//! | pipeline | a frame carries a command in and the reply to the *previous* read command out |
//! | clock | at most 2.5 MHz from 64 SPS up, at most 1.0 MHz below (Rev. B, page 15) |
//! | between frames | [`Pace`]: at least 40 µs from start to start and 30 µs of gap from 64 SPS up, 100 µs below |
//! | scale | 0.07326 deg/s, 0.1453 degC from 25 degC, 1.8315 mV for each count (Rev. B, page 12) |
//! | start-up | 220 ms until the outputs can be trusted ([`START_UP_MS`]) |
//! | sign | clockwise seen from above is positive (*unverified*) |
//!
//! What is marked *unverified* here comes from sibling parts or from memory, not from a page of this part's data sheet
//! that was read; check it on hardware before you rely on it.
//!
//! # Two ways to use it
//! [`Adis16250`] reads and writes registers one at a time and waits out the pauses. A loop that has to read several
//! registers on time does not want to wait: it sends [`Command`]s by [`exchange`] at its own pace, and each [`Word`] is
//! the reply to the command before.
//!
//! ```
//! use adis16250::{Command, Register, Word};
//!
//! // The frames on the bus, and what they bring back.
//! assert_eq!(Command::read(Register::GyroOut).bytes(), [0x04, 0x00]);
//! let word = Word::from_bytes([0x91, 0x10]);
//! assert!(word.is_new() && !word.has_error());
//! assert_eq!(word.rate().micro_dps(adis16250::Range::Dps320), 319_999_680);
//! ```
#![no_std]
#![forbid(unsafe_code)]

mod alarm;
mod config;
mod device;
mod error;
mod gpio;
mod outputs;
mod register;
mod word;

pub use alarm::{Alarm, AlarmNumber, AlarmOutput, AlarmSource, Trigger};
pub use config::{DataReady, Filter, Line, Pace, Polarity, Range, SamplePeriod, SensAvg, Stimulus};
pub use device::Adis16250;
pub use error::Error;
pub use gpio::{GpioCtrl, LineUse};
pub use register::{Access, Command, Register, control};
pub use word::{
    AngleCounts, AuxCounts, OffsetCounts, RateCounts, Status, SupplyCounts, TemperatureCounts, Word,
};

/// From power-on, or from the end of a reset, until the outputs can be trusted, ms.
///
/// The drivers of sibling parts wait this long; the part's own figure is 150 ms to 165 ms, *unverified*.
pub const START_UP_MS: u32 = 220;

/// One frame: sends `command` and returns the reply to the read command before it.
///
/// After a write command, or after the first frame, the reply means nothing. The pause until the next frame is the
/// caller's: see [`Pace`].
///
/// # Errors
/// Those of the bus.
#[inline]
pub fn exchange<S: embedded_hal::spi::SpiDevice>(
    spi: &mut S,
    command: Command,
) -> Result<Word, S::Error> {
    let mut frame = command.bytes();
    spi.transfer_in_place(&mut frame)?;
    // Byte by byte, as they came: as an array they would be put together in both orders on the AVR.
    let [high, low] = frame;
    Ok(Word(u16::from(high) << 8 | u16::from(low)))
}
