//! What the board is set to, and how it outlives a power cut: two copies in EEPROM, each with a generation and a
//! CRC, of which the older one is overwritten. A cut at any byte leaves the other.

use crate::acquire::FASTEST;
use adis16250::{Filter, Range};
use wire::fields::SetUp;
use zerocopy::little_endian::{I32, U16, U32};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout, Unaligned};

/// Bytes of one stored copy.
pub const STORED_LEN: usize = size_of::<Config>();
/// Where the two copies begin. Address 0 is left alone: a known weak spot when power sags.
pub const SLOTS: [u16; 2] = [16, 80];
const _: () = assert!(SLOTS[0] as usize + STORED_LEN <= SLOTS[1] as usize);
/// Format of a stored copy; another number is not read.
pub const FORMAT: u8 = 2;

/// The set-up, as it lies in the EEPROM.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned,
)]
#[repr(C)]
pub struct Config {
    format: u8,
    /// One more than that of the copy that was stored before, wrapping.
    pub generation: u8,
    /// What the hello frame says; bias in Q16.16 deg/s, scale in Q8.24 deg/s for each count.
    pub set_up: SetUp,
    /// The board's number.
    pub board_id: U16,
    /// Motor ramp, steps a second.
    pub ramp_per_s: U16,
    /// Largest motor command.
    pub max_duty: u8,
    /// Of all before it, when it was stored.
    crc: U32,
}

/// Largest scale, Q8.24 deg/s for each count: 0.25, more than three times that of the widest range. 2^13 counts times it are
/// 2048 deg/s, which Q16.16 holds with room for any bias.
pub const MAX_SCALE: i32 = (1 << 22) - 1;
/// A bias is below this in magnitude, Q16.16 deg/s: 512 deg/s, more than the widest range.
pub const BIAS_BOUND: i32 = 512 << 16;
/// Fastest rate: 256 Hz, the gyro's own.
pub const MIN_PERIOD: u16 = 976;
/// A 16-bit timer of 4 us holds no more than 262 ms; slower rates take every n-th of its periods, n up to 4.
pub const MAX_PERIOD: u16 = 62_500;
/// Most periods of a sample: 1 Hz is the slowest rate.
const MAX_PERIODS: u8 = 4;
/// Largest UBRR.
const MAX_DIVISOR: u16 = 4_095;

impl Config {
    /// All zero: not in order.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            format: 0,
            generation: 0,
            set_up: SetUp {
                period_ticks: U16::ZERO,
                baud_divisor: U16::ZERO,
                gyro_range: 0,
                gyro_filter: 0,
                gyro_sample_period: 0,
                acc_range: 0,
                config_source: 0,
                bias: [I32::ZERO; 3],
                scale: [I32::ZERO; 3],
                periods_per_sample: 0,
            },
            board_id: U16::ZERO,
            ramp_per_s: U16::ZERO,
            max_duty: 0,
            crc: U32::ZERO,
        }
    }

    /// The built-in set-up; the board keeps its number.
    #[inline(never)]
    pub fn set_default(&mut self) {
        let this = crate::math::somewhere(self);
        this.set_up.period_ticks.set(12_500);
        this.set_up.periods_per_sample = 1;
        this.set_up.baud_divisor.set(25);
        this.set_up.gyro_range = 4;
        this.set_up.gyro_filter = 2;
        this.set_up.gyro_sample_period = 1;
        this.set_up.acc_range = 0;
        this.set_up.bias = [I32::ZERO; 3];
        this.set_scale_of_range();
        this.ramp_per_s.set(crate::motor::DEFAULT_RAMP_PER_S);
        this.max_duty = 255;
    }

    /// The nominal scale of the range.
    #[inline(never)]
    pub fn set_scale_of_range(&mut self) {
        let range = Range::from_code(self.set_up.gyro_range).unwrap_or_default();
        self.set_up.scale = [I32::new(range.scale_q24()); 3];
    }

    /// Makes it a copy to be stored.
    #[inline(always)]
    pub fn seal(&mut self) {
        self.format = FORMAT;
        self.generation = self.generation.wrapping_add(1);
        let register = self.register(STORED_LEN - size_of::<U32>());
        self.crc.set(wire::crc::finish(register));
    }

    /// The CRC's register after the first `len` bytes.
    fn register(&self, len: usize) -> u32 {
        let mut register = wire::crc::INIT;
        for &byte in self.as_bytes().iter().take(len) {
            register = wire::crc::update(register, byte);
        }
        register
    }

    /// Whether it has its CRC, as a stored copy.
    #[cfg(test)]
    fn is_whole(&self) -> bool {
        self.register(STORED_LEN) == wire::crc::RESIDUE && self.format == FORMAT
    }

    /// SENS/AVG of the gyros.
    #[must_use]
    #[inline(never)]
    pub fn sens_avg(&self) -> u16 {
        u16::from_le_bytes([self.set_up.gyro_filter, self.set_up.gyro_range])
    }

    /// Whether every field is in its range, and range and filter are a pair that the gyro has: a narrow range demands
    /// taps.
    #[must_use]
    #[inline(never)]
    pub fn is_in_order(&self) -> bool {
        let Some(range) = Range::from_code(self.set_up.gyro_range) else {
            return false;
        };
        for (scale, bias) in self.set_up.scale.iter().zip(&self.set_up.bias) {
            let (scale, bias) = (scale.get(), bias.get());
            // Their high words tell: no comparison of four bytes with four.
            let high = (bias >> 16) as i16;
            const HIGH: i16 = (BIAS_BOUND >> 16) as i16;
            // Spelled out, as the image that was tested has it.
            #[allow(clippy::manual_range_contains)]
            if scale == 0
                || (scale >> 16) as u16 > (MAX_SCALE >> 16) as u16
                || high >= HIGH
                || high < -HIGH
            {
                return false;
            }
        }
        self.set_up.gyro_filter >= range.shortest_filter() as u8
            && self.set_up.gyro_filter <= Filter::Taps64 as u8
            && u16::from(self.set_up.gyro_sample_period) == FASTEST
            && self.set_up.acc_range <= 3
            && (MIN_PERIOD..=MAX_PERIOD).contains(&self.set_up.period_ticks.get())
            && (1..=MAX_PERIODS).contains(&self.set_up.periods_per_sample)
            && self.set_up.baud_divisor.get() <= MAX_DIVISOR
    }
}

impl Default for Config {
    fn default() -> Self {
        let mut config = Self::new();
        config.set_default();
        config
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_stored_comes_back_and_one_wrong_bit_does_not() {
        let mut config = Config {
            board_id: 7.into(),
            generation: 8,
            ..Config::default()
        };
        config.set_up.bias = [1, -2, 3].map(I32::new);
        config.seal();
        let bytes = config.as_bytes().to_vec();
        let read = Config::read_from_bytes(&bytes).unwrap();
        assert!(read.is_whole() && read.is_in_order());
        assert_eq!((read, read.generation), (config, 9));
        for bit in 0..STORED_LEN * 8 {
            let mut bad = bytes.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            let read = Config::read_from_bytes(&bad).unwrap();
            assert!(!read.is_whole(), "bit {bit}");
        }
    }

    #[test]
    fn an_erased_eeprom_is_no_configuration() {
        for byte in [0xff, 0] {
            let read = Config::read_from_bytes(&[byte; STORED_LEN]).unwrap();
            assert!(!read.is_whole());
        }
    }

    #[test]
    fn scale_and_bias_are_bounded_so_that_no_rate_wraps() {
        let with = |axis: usize, scale: i32, bias: i32| {
            let mut config = Config::default();
            config.set_up.scale[axis].set(scale);
            config.set_up.bias[axis].set(bias);
            config.is_in_order()
        };
        let usual = Range::Dps320.scale_q24();
        for axis in 0..3 {
            assert!(with(axis, 1, 0) && with(axis, MAX_SCALE, BIAS_BOUND - 1));
            assert!(with(axis, usual, -BIAS_BOUND));
            for scale in [0, -1, i32::MIN, MAX_SCALE + 1, i32::MAX] {
                assert!(!with(axis, scale, 0), "{scale}");
            }
            for bias in [BIAS_BOUND, -BIAS_BOUND - 1, i32::MAX, i32::MIN] {
                assert!(!with(axis, usual, bias), "{bias}");
            }
        }
        // Counts have 14 bits.
        for counts in [-8192, 8191] {
            let exact = (i64::from(counts) * i64::from(MAX_SCALE)) >> 8;
            let rate = adis16250::RateCounts(counts).dps_q16(MAX_SCALE);
            assert!((i64::from(rate) - exact).abs() <= 1, "{rate} {exact}");
            assert!(
                rate.checked_sub(BIAS_BOUND).is_some() && rate.checked_add(BIAS_BOUND).is_some()
            );
        }
    }

    #[test]
    fn a_sample_period_that_the_clock_does_not_suit_is_not_in_order() {
        for period in [0, 2, 8, 0x81] {
            let mut config = Config::default();
            config.set_up.gyro_sample_period = period;
            assert!(!config.is_in_order(), "{period:#04x}");
        }
    }

    #[test]
    fn rates_from_1_to_256_hz_are_in_order_and_no_others() {
        let with = |period: u16, every: u8| {
            let mut config = Config::default();
            config.set_up.period_ticks.set(period);
            config.set_up.periods_per_sample = every;
            config.is_in_order()
        };
        assert!(with(976, 1) && with(12_500, 1) && with(62_500, 4));
        assert!(!with(975, 1) && !with(62_501, 1) && !with(50_000, 5) && !with(12_500, 0));
    }
}
