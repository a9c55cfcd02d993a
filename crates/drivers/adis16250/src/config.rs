//! Range, filter, sample period, pace, data-ready line.

use crate::RateCounts;
use crate::register::control;

/// Measurement range; bits 10:8 of SENS/AVG.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Range {
    /// 320 deg/s, 0.07326 deg/s for each count; the default.
    #[default]
    Dps320 = 0b100,
    /// 160 deg/s, 0.03663 deg/s for each count; at least 4 taps.
    Dps160 = 0b010,
    /// 80 deg/s, 0.018315 deg/s for each count; at least 16 taps.
    Dps80 = 0b001,
}

impl Range {
    /// The range of a code in SENS/AVG.
    #[must_use]
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0b100 => Some(Range::Dps320),
            0b010 => Some(Range::Dps160),
            0b001 => Some(Range::Dps80),
            _ => None,
        }
    }

    /// 10^-6 deg/s for each count. 73 260 is of the data sheet; the others are a half and a quarter of it (other
    /// sources round the last to 18 320).
    #[must_use]
    pub const fn micro_dps_per_count(self) -> i32 {
        match self {
            Range::Dps320 => 73_260,
            Range::Dps160 => 36_630,
            Range::Dps80 => 18_315,
        }
    }

    /// Q8.24 deg/s for each count.
    #[must_use]
    pub const fn scale_q24(self) -> i32 {
        match self {
            Range::Dps320 => 1_229_099,
            Range::Dps160 => 614_549,
            Range::Dps80 => 307_275,
        }
    }

    /// The shortest filter that the range goes with (*unverified*; it agrees with the noise given for each range).
    /// Whether the part enforces it is unknown, so the driver does.
    #[must_use]
    pub const fn shortest_filter(self) -> Filter {
        match self {
            Range::Dps320 => Filter::Taps1,
            Range::Dps160 => Filter::Taps4,
            Range::Dps80 => Filter::Taps16,
        }
    }
}

/// Taps in each of the filter's two stages; bits 2:0 of SENS/AVG. The two boxcars make a Bartlett window, 2N - 1 long,
/// with a delay of N - 1 samples (*unverified*).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Filter {
    /// No filter.
    Taps1 = 0,
    /// 2 taps in each stage.
    Taps2 = 1,
    /// 4 taps in each stage; the default.
    #[default]
    Taps4 = 2,
    /// 8 taps in each stage.
    Taps8 = 3,
    /// 16 taps in each stage.
    Taps16 = 4,
    /// 32 taps in each stage.
    Taps32 = 5,
    /// 64 taps in each stage.
    Taps64 = 6,
}

impl Filter {
    /// The filter of a code in SENS/AVG.
    #[must_use]
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Filter::Taps1),
            1 => Some(Filter::Taps2),
            2 => Some(Filter::Taps4),
            3 => Some(Filter::Taps8),
            4 => Some(Filter::Taps16),
            5 => Some(Filter::Taps32),
            6 => Some(Filter::Taps64),
            _ => None,
        }
    }

    /// Taps in each stage.
    #[must_use]
    pub const fn taps(self) -> u8 {
        1 << self as u8
    }

    /// By how many sample periods the filter delays: N - 1. It has settled after twice that.
    #[must_use]
    pub const fn delay_samples(self) -> u8 {
        self.taps() - 1
    }
}

/// The content of SENS/AVG: a range and a filter that goes with it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SensAvg {
    range: Range,
    filter: Filter,
}

impl SensAvg {
    /// The range, with the filter or, where that is too short for the range, with the shortest that is not.
    #[must_use]
    pub const fn new(range: Range, filter: Filter) -> Self {
        let shortest = range.shortest_filter();
        SensAvg {
            range,
            filter: if (filter as u8) < shortest as u8 {
                shortest
            } else {
                filter
            },
        }
    }

    /// What a register content means; `None` where it is no valid one, or has a filter too short for its range.
    #[must_use]
    pub const fn from_bits(bits: u16) -> Option<Self> {
        let [high, low] = bits.to_be_bytes();
        match (
            Range::from_code(high & 0b111),
            Filter::from_code(low & 0b111),
        ) {
            (Some(range), Some(filter)) if filter as u8 >= range.shortest_filter() as u8 => {
                Some(SensAvg { range, filter })
            }
            _ => None,
        }
    }

    /// The register content.
    #[must_use]
    pub const fn bits(self) -> u16 {
        u16::from_be_bytes([self.range as u8, self.filter as u8])
    }

    /// The range.
    #[must_use]
    pub const fn range(self) -> Range {
        self.range
    }

    /// The filter in use.
    #[must_use]
    pub const fn filter(self) -> Filter {
        self.filter
    }
}

/// The content of SMPL_PRD: bit 7 chooses the time base, bits 6:0 are one less than the multiple of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SamplePeriod(u8);

impl Default for SamplePeriod {
    fn default() -> Self {
        SamplePeriod::SPS_256
    }
}

impl SamplePeriod {
    /// 256 SPS, the most that the data sheet offers, and the default.
    pub const SPS_256: SamplePeriod = SamplePeriod(0x01);
    /// 64 SPS, the least at which the part runs in its fast mode.
    pub const SPS_64: SamplePeriod = SamplePeriod(0x07);

    /// From the register content. `None` for 0x00: 512 SPS by the formula, which the data sheet does not offer.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Option<Self> {
        if bits == 0 {
            None
        } else {
            Some(SamplePeriod(bits))
        }
    }

    /// The register content.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// The period in µs, rounded down: a multiple of 1.953125 ms (time base 0) or of 31 times that.
    #[must_use]
    pub const fn micros(self) -> u32 {
        let base_eighths = if self.0 & 0x80 == 0 {
            15_625
        } else {
            31 * 15_625
        };
        (((self.0 & 0x7F) as u32 + 1) * base_eighths) >> 3
    }

    /// How fast the bus may run at this period.
    #[must_use]
    pub const fn pace(self) -> Pace {
        if self.0 <= Self::SPS_64.0 {
            Pace::Fast
        } else {
            Pace::Normal
        }
    }
}

/// How fast the bus may run. The part's sources disagree about the pauses, and this rule satisfies all of them; the
/// figures themselves are *unverified*.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// Below 64 SPS: clock up to 1.0 MHz, frames 100 µs apart. The first, so that a part as it begins is all zeros.
    Normal,
    /// From 64 SPS up: clock up to 2.5 MHz, frames 40 µs from start to start with a gap of 30 µs.
    Fast,
}

impl Pace {
    /// The highest clock frequency, Hz (Rev. B, page 15).
    #[must_use]
    pub const fn clock_max_hz(self) -> u32 {
        match self {
            Pace::Fast => 2_500_000,
            Pace::Normal => 1_000_000,
        }
    }

    /// The pause from the end of a frame to the start of the next that keeps all rules at any clock, µs. A loop that
    /// knows its clock can do with less: 40 µs or 100 µs from start to start, and no gap below 30 µs.
    #[must_use]
    pub const fn pause_us(self) -> u32 {
        match self {
            Pace::Fast => 40,
            Pace::Normal => 100,
        }
    }
}

/// Level that means "active".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Polarity {
    /// Active low.
    ActiveLow,
    /// Active high.
    ActiveHigh,
}

/// A digital line of the part. Sibling parts name the same pins DIO1 and DIO2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// DIO0.
    Dio0,
    /// DIO1.
    Dio1,
}

/// The data-ready line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DataReady {
    /// Which line.
    pub line: Line,
    /// Which level says "ready".
    pub polarity: Polarity,
}

impl DataReady {
    /// The low byte of MSC_CTRL.
    #[must_use]
    pub const fn bits(self) -> u8 {
        let line = match self.line {
            Line::Dio0 => 0,
            Line::Dio1 => control::MSC_DATA_READY_DIO1,
        };
        let polarity = match self.polarity {
            Polarity::ActiveLow => 0,
            Polarity::ActiveHigh => control::MSC_DATA_READY_HIGH,
        };
        (control::MSC_DATA_READY | polarity | line) as u8
    }
}

/// A test stimulus that the sensor holds. Its effect is 721 counts typically, 439 to 1092, at 320 deg/s (*unverified*).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stimulus {
    /// None: normal operation.
    None,
    /// Positive.
    Positive,
    /// Negative.
    Negative,
}

impl Stimulus {
    /// Least and most by which the output of a good part moves at a range, counts (*unverified*; narrower ranges by their
    /// scale).
    #[must_use]
    pub const fn response(self, range: Range) -> (RateCounts, RateCounts) {
        let times = match range {
            Range::Dps320 => 1,
            Range::Dps160 => 2,
            Range::Dps80 => 4,
        };
        let (least, most) = (439 * times, 1_092 * times);
        match self {
            Stimulus::None => (RateCounts(0), RateCounts(0)),
            Stimulus::Positive => (RateCounts(least), RateCounts(most)),
            Stimulus::Negative => (RateCounts(-most), RateCounts(-least)),
        }
    }

    /// The high byte of MSC_CTRL.
    #[must_use]
    pub const fn bits(self) -> u8 {
        match self {
            Stimulus::None => 0,
            Stimulus::Positive => (control::MSC_STIMULUS_POSITIVE >> 8) as u8,
            Stimulus::Negative => (control::MSC_STIMULUS_NEGATIVE >> 8) as u8,
        }
    }
}
