//! Driver for the MMA7260QT three-axis analog accelerometer (Freescale, now NXP).
//!
//! | | |
//! |---|---|
//! | part | MMA7260QT |
//! | data sheet | Freescale MMA7260QT Rev. 5, 03/2008 (page 1 was read; the rest of the figures are *unverified*) |
//! | interface | two range inputs, one sleep input, three analog outputs |
//! | supply | 2.2 V to 3.6 V, figures at 3.3 V; the inputs are **not** 5 V tolerant |
//! | output | VDD/2 at 0 g; 800, 600, 300 or 200 mV/g at 3.3 V; both in proportion to VDD |
//! | bandwidth | 350 Hz for x and y, 150 Hz for z, one pole |
//! | start-up | 2 ms from power-on or from sleep ([`WAKE_US`]) |
//! | sign | at rest, the axis that points up reads +1 g |
//! | self-test | the part has none; [`Scale::from_flip`] is the check that is left |
//!
//! What is *unverified* comes from sibling parts, from other drivers or from memory: all but the supply range, the pins,
//! the four ranges and 800 mV/g. The range inputs especially: two other drivers agree with the table in [`Range`],
//! the jumper table of one carrier board might exchange 2 g and 4 g. A flip by 1 g settles it on hardware.
//!
//! # Levels
//! On a microcontroller at 5 V, never drive an input high: switch the pin between "low" and "released", with a resistor
//! from the input to the sensor's own 3.3 V. The pins handed to [`Mma7260qt`] are then open-drain outputs for which
//! "high" means released.
//!
//! # Reading
//! embedded-hal 1.0 has no trait for converters. [`ReadCounts`] takes its place, and any closure from an axis to counts
//! is one. Let the converter's reference be the sensor's supply: zero and scale are then independent of it.
//!
//! ```
//! use mma7260qt::{Axis, Range, Scale, acceleration};
//!
//! const SCALE: Scale = Scale::ratiometric(Range::G1_5, 10);
//! // A converter that sees 0 g, 0 g and +1 g.
//! let mut adc = |axis: Axis| Ok::<u16, ()>(if axis == Axis::Z { 760 } else { 512 });
//! let micro_g = acceleration(&mut adc, &SCALE).unwrap();
//! assert_eq!(micro_g[0], 0);
//! assert!((micro_g[2] - 1_000_000).abs() < 4_100); // within a count
//! ```
#![no_std]
#![forbid(unsafe_code)]

mod scale;

pub use scale::{Scale, acceleration, acceleration_each};

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::OutputPin;

/// From power-on, or from the end of sleep, until the outputs are right, µs: the most of both (*unverified*).
pub const WAKE_US: u32 = 2_000;

/// From a change of range until the outputs are right, µs. Not specified; five time constants of the slowest output's
/// filter, 5 / (2π · 150 Hz), rounded up.
pub const RANGE_CHANGE_US: u32 = 5_400;

/// One of the three outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// XOUT, pin 15.
    X,
    /// YOUT, pin 14.
    Y,
    /// ZOUT, pin 13.
    Z,
}

/// Measurement range.
///
/// | g-select2 | g-select1 | range | sensitivity at 3.3 V |
/// |---|---|---|---|
/// | 0 | 0 | 1.5 g | 800 mV/g |
/// | 0 | 1 | 2 g | 600 mV/g |
/// | 1 | 0 | 4 g | 300 mV/g |
/// | 1 | 1 | 6 g | 200 mV/g |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Range {
    /// 1.5 g, also with both inputs open.
    #[default]
    G1_5 = 0b00,
    /// 2 g.
    G2 = 0b01,
    /// 4 g.
    G4 = 0b10,
    /// 6 g.
    G6 = 0b11,
}

impl Range {
    /// The range with g-select2 and g-select1 as bits 1 and 0.
    #[must_use]
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0b00 => Some(Range::G1_5),
            0b01 => Some(Range::G2),
            0b10 => Some(Range::G4),
            0b11 => Some(Range::G6),
            _ => None,
        }
    }

    /// g-select2 and g-select1 as bits 1 and 0.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// Sensitivity at a supply of 3.3 V, mV/g. Typical; the limits are 7.5 % to either side (*unverified*).
    #[must_use]
    pub const fn millivolts_per_g(self) -> u16 {
        match self {
            Range::G1_5 => 800,
            Range::G2 => 600,
            Range::G4 => 300,
            Range::G6 => 200,
        }
    }
}

/// Something that converts an output of the part to counts.
pub trait ReadCounts {
    /// What can go wrong.
    type Error;

    /// The counts of one output.
    ///
    /// # Errors
    /// Where there is no conversion.
    fn read_counts(&mut self, axis: Axis) -> Result<u16, Self::Error>;
}

impl<E, F: FnMut(Axis) -> Result<u16, E>> ReadCounts for F {
    type Error = E;

    fn read_counts(&mut self, axis: Axis) -> Result<u16, E> {
        self(axis)
    }
}

/// A pin that could not be set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error<E1, E2, E3> {
    /// The pin at g-select1.
    GSelect1(E1),
    /// The pin at g-select2.
    GSelect2(E2),
    /// The pin at the sleep input.
    Sleep(E3),
}

impl<E1: core::fmt::Debug, E2: core::fmt::Debug, E3: core::fmt::Debug> core::fmt::Display
    for Error<E1, E2, E3>
{
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Error::GSelect1(error) => write!(f, "g-select1: {error:?}"),
            Error::GSelect2(error) => write!(f, "g-select2: {error:?}"),
            Error::Sleep(error) => write!(f, "sleep: {error:?}"),
        }
    }
}

impl<E1: core::fmt::Debug, E2: core::fmt::Debug, E3: core::fmt::Debug> core::error::Error
    for Error<E1, E2, E3>
{
}

/// The part's three inputs.
#[derive(Debug)]
pub struct Mma7260qt<G1, G2, S> {
    g_select1: G1,
    g_select2: G2,
    sleep: S,
    range: Range,
}

type PinError<G1, G2, S> = Error<
    <G1 as embedded_hal::digital::ErrorType>::Error,
    <G2 as embedded_hal::digital::ErrorType>::Error,
    <S as embedded_hal::digital::ErrorType>::Error,
>;

impl<G1: OutputPin, G2: OutputPin, S: OutputPin> Mma7260qt<G1, G2, S> {
    /// Sets the range, then wakes the part: [`WAKE_US`] later the outputs are right.
    ///
    /// # Errors
    /// Where a pin could not be set.
    pub fn new(
        g_select1: G1,
        g_select2: G2,
        sleep: S,
        range: Range,
    ) -> Result<Self, PinError<G1, G2, S>> {
        let mut part = Mma7260qt {
            g_select1,
            g_select2,
            sleep,
            range,
        };
        part.set_range(range)?;
        part.wake()?;
        Ok(part)
    }

    /// Sets the range: [`RANGE_CHANGE_US`] later the outputs are right. In between the part may pass through a third
    /// range.
    ///
    /// # Errors
    /// Where a pin could not be set.
    pub fn set_range(&mut self, range: Range) -> Result<(), PinError<G1, G2, S>> {
        self.g_select1
            .set_state((range.code() & 0b01 != 0).into())
            .map_err(Error::GSelect1)?;
        self.g_select2
            .set_state((range.code() & 0b10 != 0).into())
            .map_err(Error::GSelect2)?;
        self.range = range;
        Ok(())
    }

    /// The range that was set last.
    #[must_use]
    pub const fn range(&self) -> Range {
        self.range
    }

    /// Puts the part to sleep: 3 µA instead of 500 µA. Its outputs mean nothing until [`wake`](Self::wake).
    ///
    /// # Errors
    /// Where the pin could not be set.
    pub fn sleep(&mut self) -> Result<(), PinError<G1, G2, S>> {
        self.sleep.set_low().map_err(Error::Sleep)
    }

    /// Wakes the part: [`WAKE_US`] later the outputs are right.
    ///
    /// # Errors
    /// Where the pin could not be set.
    pub fn wake(&mut self) -> Result<(), PinError<G1, G2, S>> {
        self.sleep.set_high().map_err(Error::Sleep)
    }

    /// [`set_range`](Self::set_range), then the time that it takes.
    ///
    /// # Errors
    /// Where a pin could not be set.
    pub fn set_range_and_wait(
        &mut self,
        range: Range,
        delay: &mut impl DelayNs,
    ) -> Result<(), PinError<G1, G2, S>> {
        self.set_range(range)?;
        delay.delay_us(RANGE_CHANGE_US);
        Ok(())
    }

    /// [`wake`](Self::wake), then the time that it takes.
    ///
    /// # Errors
    /// Where the pin could not be set.
    pub fn wake_and_wait(&mut self, delay: &mut impl DelayNs) -> Result<(), PinError<G1, G2, S>> {
        self.wake()?;
        delay.delay_us(WAKE_US);
        Ok(())
    }

    /// Gives the pins back: g-select1, g-select2, sleep.
    pub fn release(self) -> (G1, G2, S) {
        (self.g_select1, self.g_select2, self.sleep)
    }
}
