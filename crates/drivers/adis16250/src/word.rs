//! Words from the part, and what their counts mean.

use crate::Range;
use crate::register::control;

/// The 16 bits of a frame from the part.
///
/// | bit | output registers | ENDURANCE and control registers |
/// |---|---|---|
/// | 15 | new data (ND): refreshed since it was last read | data |
/// | 14 | error or alarm (EA): a bit of STATUS is set | data |
/// | 13:12 | data of the 14-bit registers; otherwise anything | data |
/// | 11:0 | data | data |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word(pub u16);

impl Word {
    /// The two bytes in the order of the bus.
    #[must_use]
    #[inline]
    pub const fn from_bytes(bytes: [u8; 2]) -> Self {
        Word(u16::from_be_bytes(bytes))
    }

    /// All 16 bits, for ENDURANCE and the control registers.
    #[must_use]
    #[inline]
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// The new-data bit (ND): the register was refreshed since it was last read.
    #[must_use]
    #[inline]
    pub const fn is_new(self) -> bool {
        self.0 & 0x8000 != 0
    }

    /// The error/alarm bit (EA): STATUS says what.
    #[must_use]
    #[inline]
    pub const fn has_error(self) -> bool {
        self.0 & 0x4000 != 0
    }

    /// All zeros or all ones: a data line that is stuck, or a part without power. A part in order answers so too: all
    /// zeros for an output without new data that is zero, all ones for one of -1 with an alarm. The supply is never either,
    /// so ask of both.
    #[must_use]
    #[inline]
    pub const fn is_stuck(self) -> bool {
        self.0 == 0x0000 || self.0 == 0xFFFF
    }

    /// 14 bits, twos complement.
    #[must_use]
    #[inline]
    pub const fn signed_14(self) -> i16 {
        (self.0 << 2).cast_signed() >> 2
    }

    /// 12 bits, twos complement.
    #[must_use]
    #[inline]
    pub const fn signed_12(self) -> i16 {
        (self.0 << 4).cast_signed() >> 4
    }

    /// 14 bits, unsigned.
    #[must_use]
    #[inline]
    pub const fn unsigned_14(self) -> u16 {
        self.0 & 0x3FFF
    }

    /// 12 bits, unsigned.
    #[must_use]
    #[inline]
    pub const fn unsigned_12(self) -> u16 {
        self.0 & 0x0FFF
    }

    /// As a reply to GYRO_OUT.
    #[must_use]
    #[inline]
    pub const fn rate(self) -> RateCounts {
        RateCounts(self.signed_14())
    }

    /// As a reply to TEMP_OUT.
    #[must_use]
    #[inline]
    pub const fn temperature(self) -> TemperatureCounts {
        TemperatureCounts(self.signed_12())
    }

    /// As a reply to SUPPLY_OUT.
    #[must_use]
    #[inline]
    pub const fn supply(self) -> SupplyCounts {
        SupplyCounts(self.unsigned_12())
    }

    /// As a reply to AUX_ADC.
    #[must_use]
    #[inline]
    pub const fn aux(self) -> AuxCounts {
        AuxCounts(self.unsigned_12())
    }

    /// As a reply to ANGL_OUT.
    #[must_use]
    #[inline]
    pub const fn angle(self) -> AngleCounts {
        AngleCounts(self.unsigned_14())
    }
}

/// GYRO_OUT, counts; positive is clockwise seen from above (*unverified*).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct RateCounts(pub i16);

impl RateCounts {
    /// Rate in 10^-6 deg/s. Exact, as the scale factors are 73.26, 36.63 and 18.315 mdeg/s.
    #[must_use]
    pub const fn micro_dps(self, range: Range) -> i32 {
        (self.0 as i32).wrapping_mul(range.micro_dps_per_count())
    }

    /// Rate in Q16.16 deg/s by a scale factor in Q8.24 deg/s for each count ([`Range::scale_q24`] or a calibrated one
    /// below 0.125 deg/s), rounded down, without 64-bit arithmetic.
    #[must_use]
    pub const fn dps_q16(self, scale_q24: i32) -> i32 {
        let counts = self.0 as i32;
        let (high, low) = (scale_q24 >> 8, scale_q24 & 0xFF);
        counts
            .wrapping_mul(high)
            .wrapping_add(counts.wrapping_mul(low) >> 8)
    }
}

/// TEMP_OUT, counts; 0 is 25 degC.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct TemperatureCounts(pub i16);

impl TemperatureCounts {
    /// Temperature in 10^-6 degC: 25 degC and 0.1453 degC for each count.
    #[must_use]
    pub const fn micro_celsius(self) -> i32 {
        (self.0 as i32)
            .wrapping_mul(145_300)
            .wrapping_add(25_000_000)
    }
}

/// SUPPLY_OUT, counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct SupplyCounts(pub u16);

impl SupplyCounts {
    /// Reads 4.75 V: the least the part is specified for.
    pub const LOWEST: SupplyCounts = SupplyCounts(2594);
    /// Reads 5.25 V: the most the part is specified for.
    pub const HIGHEST: SupplyCounts = SupplyCounts(2866);

    /// Voltage in µV, rounded down: 1831.5 µV for each count.
    #[must_use]
    pub const fn microvolts(self) -> u32 {
        (self.0 as u32).wrapping_mul(3663) >> 1
    }

    /// Within the 4.75 V to 5.25 V that the part is specified for.
    #[must_use]
    pub const fn is_in_range(self) -> bool {
        self.0 >= Self::LOWEST.0 && self.0 <= Self::HIGHEST.0
    }
}

/// AUX_ADC and AUX_DAC, counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct AuxCounts(pub u16);

impl AuxCounts {
    /// Voltage in µV, rounded down: 610.5 µV for each count.
    #[must_use]
    pub const fn microvolts(self) -> u32 {
        (self.0 as u32).wrapping_mul(1221) >> 1
    }
}

/// ANGL_OUT, counts, unsigned (*unverified*).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct AngleCounts(pub u16);

impl AngleCounts {
    /// Angle in 10^-6 deg: 0.03663 deg for each count.
    #[must_use]
    pub const fn micro_degrees(self) -> u32 {
        (self.0 as u32).wrapping_mul(36_630)
    }
}

/// GYRO_OFF, counts of 0.018315 deg/s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct OffsetCounts(pub i16);

impl OffsetCounts {
    /// Offset in 10^-6 deg/s.
    #[must_use]
    pub const fn micro_dps(self) -> i32 {
        (self.0 as i32).wrapping_mul(18_315)
    }
}

/// STATUS.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Status(pub u16);

impl Status {
    /// Nothing is wrong and no alarm is active.
    #[must_use]
    pub const fn is_ok(self) -> bool {
        self.0 & 0x033F == 0
    }

    /// Alarm 1 is active.
    #[must_use]
    pub const fn alarm_1(self) -> bool {
        self.0 & control::STATUS_ALARM_1 != 0
    }

    /// Alarm 2 is active.
    #[must_use]
    pub const fn alarm_2(self) -> bool {
        self.0 & control::STATUS_ALARM_2 != 0
    }

    /// The self-test failed.
    #[must_use]
    pub const fn self_test_failed(self) -> bool {
        self.0 & control::STATUS_SELF_TEST_FAILED != 0
    }

    /// The rate is beyond the sensor's range.
    #[must_use]
    pub const fn overrange(self) -> bool {
        self.0 & control::STATUS_OVERRANGE != 0
    }

    /// A frame was not understood.
    #[must_use]
    pub const fn spi_failed(self) -> bool {
        self.0 & control::STATUS_SPI_FAILED != 0
    }

    /// The flash was not written.
    #[must_use]
    pub const fn flash_failed(self) -> bool {
        self.0 & control::STATUS_FLASH_FAILED != 0
    }

    /// The supply is above 5.25 V.
    #[must_use]
    pub const fn supply_high(self) -> bool {
        self.0 & control::STATUS_SUPPLY_HIGH != 0
    }

    /// The supply is below 4.75 V.
    #[must_use]
    pub const fn supply_low(self) -> bool {
        self.0 & control::STATUS_SUPPLY_LOW != 0
    }
}
