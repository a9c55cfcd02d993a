//! The two alarms. All of their bits are *unverified*: they are a sibling part's.

use crate::{Line, Polarity, Register};

/// Which of the two alarms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlarmNumber {
    /// Alarm 1, STATUS bit 8.
    One,
    /// Alarm 2, STATUS bit 9.
    Two,
}

impl AlarmNumber {
    /// Where its threshold is.
    #[must_use]
    pub const fn magnitude_register(self) -> Register {
        match self {
            AlarmNumber::One => Register::AlmMag1,
            AlarmNumber::Two => Register::AlmMag2,
        }
    }

    /// Where its number of samples is.
    #[must_use]
    pub const fn samples_register(self) -> Register {
        match self {
            AlarmNumber::One => Register::AlmSmpl1,
            AlarmNumber::Two => Register::AlmSmpl2,
        }
    }

    /// Its four bits in ALM_CTRL: 11:8 or 15:12.
    const fn control_shift(self) -> u8 {
        match self {
            AlarmNumber::One => 8,
            AlarmNumber::Two => 12,
        }
    }
}

/// What an alarm watches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum AlarmSource {
    /// SUPPLY_OUT.
    Supply = 0b001,
    /// GYRO_OUT.
    Rate = 0b010,
    /// AUX_ADC.
    Aux = 0b101,
    /// TEMP_OUT.
    Temperature = 0b110,
}

/// When an alarm fires.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trigger {
    /// The output is beyond the threshold.
    Level,
    /// The output changes by more than the threshold within so many samples.
    Change {
        /// Samples, content of ALM_SMPL.
        samples: u8,
    },
}

/// An alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Alarm {
    /// What it watches.
    pub source: AlarmSource,
    /// When it fires.
    pub trigger: Trigger,
    /// It fires above the threshold if set, below it if not.
    pub above: bool,
    /// Threshold in counts of the source, 14 bits; a signed source's in twos complement.
    pub threshold: i16,
}

impl Alarm {
    /// The alarm that these contents of ALM_CTRL, ALM_MAG and ALM_SMPL make; `None` where it is off.
    ///
    /// # Errors
    /// ALM_CTRL where its source is none.
    pub(crate) const fn from_bits(
        number: AlarmNumber,
        control: u16,
        magnitude: u16,
        samples: u16,
    ) -> Result<Option<Self>, u16> {
        let bits = control.wrapping_shr(number.control_shift() as u32);
        let source = match bits & 0b0111 {
            0b000 => return Ok(None),
            0b001 => AlarmSource::Supply,
            0b010 => AlarmSource::Rate,
            0b101 => AlarmSource::Aux,
            0b110 => AlarmSource::Temperature,
            _ => return Err(control),
        };
        let trigger = if bits & 0b1000 == 0 {
            Trigger::Level
        } else {
            Trigger::Change {
                samples: samples as u8,
            }
        };
        let threshold = match source {
            AlarmSource::Rate | AlarmSource::Temperature => (magnitude << 2).cast_signed() >> 2,
            AlarmSource::Supply | AlarmSource::Aux => (magnitude & 0x3FFF).cast_signed(),
        };
        Ok(Some(Alarm {
            source,
            trigger,
            above: magnitude & 0x8000 != 0,
            threshold,
        }))
    }

    /// Content of ALM_MAG.
    #[must_use]
    pub const fn magnitude_bits(&self) -> u16 {
        let polarity = if self.above { 0x8000 } else { 0 };
        polarity | (self.threshold.cast_unsigned() & 0x3FFF)
    }

    /// Content of ALM_SMPL.
    #[must_use]
    pub const fn samples_bits(&self) -> u16 {
        match self.trigger {
            Trigger::Level => 0,
            Trigger::Change { samples } => samples as u16,
        }
    }
}

/// ALM_CTRL with one alarm set, or switched off, and everything else as it was.
#[must_use]
pub(crate) const fn control_with(before: u16, number: AlarmNumber, alarm: Option<&Alarm>) -> u16 {
    let shift = number.control_shift();
    let bits: u16 = match alarm {
        None => 0,
        Some(alarm) => {
            let change = match alarm.trigger {
                Trigger::Level => 0,
                Trigger::Change { .. } => 0b1000,
            };
            (change | alarm.source as u8) as u16
        }
    };
    before & !(0b1111_u16.wrapping_shl(shift as u32)) | bits.wrapping_shl(shift as u32)
}

/// How the alarms report, besides STATUS and the error/alarm bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AlarmOutput {
    /// They compare filtered data.
    pub filtered: bool,
    /// Line and active level; `None` for no line.
    pub line: Option<(Line, Polarity)>,
}

impl AlarmOutput {
    /// The low byte of ALM_CTRL.
    #[must_use]
    pub const fn bits(self) -> u8 {
        let filtered = if self.filtered { 1 << 4 } else { 0 };
        filtered
            | match self.line {
                None => 0,
                Some((Line::Dio0, Polarity::ActiveLow)) => 0b100,
                Some((Line::Dio1, Polarity::ActiveLow)) => 0b101,
                Some((Line::Dio0, Polarity::ActiveHigh)) => 0b110,
                Some((Line::Dio1, Polarity::ActiveHigh)) => 0b111,
            }
    }
}
