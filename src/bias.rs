//! Bias null: the mean of each rate at rest, over N samples, with the standard error it reached.
//!
//! A gyro's Bartlett filter and its 50 Hz pole make neighbouring samples alike, so that neither the spread of single samples
//! nor their steps tell the error of their mean. The sums of blocks do, when a block is much longer than the filter: with
//! d = S(j+1) - S(j) over the sums S of k blocks of b samples each, the standard error of the mean of n = k b samples is
//! sqrt(pi)/2 (sum |d| / (k - 1)) / (b sqrt(k)), as the mean magnitude of a normal deviate is sqrt(2/pi) of its sigma, and d has
//! twice the variance of S (batch means; the mean magnitude in place of the root of the squares needs neither squares nor
//! their root, and is 8 % less sure). A drift does not count as noise.

use zerocopy::little_endian::I16;

use crate::math::{area, divide, root, times};

/// Largest spread (max - min) of a rate at rest, counts: eight times the 5.4 counts rms that a gyro has at 20 Hz
/// (ARW 5.27 deg/sqrt(h)) is exceeded by a still stand once in many thousand runs; a turning one exceeds it at once.
const SPREAD_AT_REST: i16 = 60;
/// Largest mean rate that can be a bias, counts: 5 deg/s. What is more is a rotation.
const LARGEST_BIAS: u16 = 68;
/// The first reading of one is no further than the spread from that.
const FIRST_MOST: u16 = LARGEST_BIAS + SPREAD_AT_REST as u16 - 1;
/// Fewest blocks: with eight the standard error is itself known to a quarter.
const MIN_BLOCKS: u16 = 8;
/// Most samples: sums of counts hold in 32 bits, with room.
pub const MAX_SAMPLES: u16 = 16_384;
/// Samples in a row that are not in order, after which a measurement is given up.
const PATIENCE: u8 = 16;
/// Length of a block without a filter, timer ticks: eight of the gyro's samples at 256 Hz. A filter of 2^m taps in each stage
/// makes it 2^m times as long; then neighbouring blocks' correlation takes 4 % off the error.
const BLOCK_TICKS: u32 = 7_813;

/// Samples in a block, for a filter of 2^m taps (m <= 6) and a period of the sample timer in ticks: 1 ..= 513.
fn block_len(filter: u8, period_ticks: u16) -> u16 {
    // Shifted in a loop, as the AVR has no other.
    let mut ticks = BLOCK_TICKS;
    for _ in 0..filter {
        ticks <<= 1;
    }
    (divide(ticks, period_ticks) as u16).wrapping_add(1)
}

/// A bias measurement under way.
#[derive(Clone, Copy, Debug)]
pub struct BiasNull {
    wanted: u16,
    have: u16,
    /// Samples in a block, and in the one under way.
    block: u16,
    in_block: u16,
    /// Whole blocks.
    blocks: u16,
    /// Samples in a row that were not in order.
    lost: u8,
    axes: [AxisSum; 3],
}

/// What a further sample brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// More are needed.
    GoesOn,
    /// It has all it wants.
    Done,
    /// The stand moves.
    Moving,
    /// Too many samples in a row were not in order.
    NotInOrder,
}

impl BiasNull {
    /// Nothing yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            wanted: 0,
            have: 0,
            block: 0,
            in_block: 0,
            blocks: 0,
            lost: 0,
            axes: [AxisSum {
                sum: 0,
                steps: 0,
                first: 0,
                part: 0,
                last: 0,
                low: 0,
                high: 0,
            }; 3],
        }
    }

    /// Begins one over so many samples of gyros with this filter at this period; false for fewer than eight blocks, or
    /// more than [`MAX_SAMPLES`].
    #[inline(always)]
    pub fn begin(&mut self, samples: u16, filter: u8, period_ticks: u16) -> bool {
        *self = Self::new();
        self.wanted = samples;
        self.block = block_len(filter, period_ticks);
        (self.block.wrapping_mul(MIN_BLOCKS)..=MAX_SAMPLES).contains(&samples)
    }

    /// Takes a sample, counts, if it is in order: a gyro that is silent, stale or in error would be averaged as if it were at
    /// rest.
    pub fn take(&mut self, rates: &[I16; 3], in_order: bool) -> Outcome {
        if !in_order {
            self.lost = self.lost.wrapping_add(1);
            return if self.lost >= PATIENCE {
                Outcome::NotInOrder
            } else {
                Outcome::GoesOn
            };
        }
        self.lost = 0;
        let first = self.have == 0;
        self.have = self.have.wrapping_add(1);
        self.in_block = self.in_block.wrapping_add(1);
        let ends = self.in_block >= self.block;
        let mut resting = true;
        for (axis, rate) in self.axes.iter_mut().zip(rates) {
            resting &= axis.take(rate.get(), first);
            if ends {
                axis.end_block(self.blocks == 0);
            }
        }
        if ends {
            self.in_block = 0;
            self.blocks = self.blocks.wrapping_add(1);
        }
        if !resting {
            Outcome::Moving
        } else if self.have >= self.wanted {
            Outcome::Done
        } else {
            Outcome::GoesOn
        }
    }

    /// What was found of each axis.
    pub fn axes(&self) -> impl Iterator<Item = &AxisSum> {
        self.axes.iter()
    }

    /// Mean rate of an axis, Q16.16 deg/s, by a scale in Q8.24 deg/s for each count; [`TURNS`] for a stand that turns.
    #[must_use]
    #[inline(never)]
    pub fn mean(&self, sum: &AxisSum, scale: i32) -> i32 {
        // Of offsets that are above -60, so that the division needs no sign; |sum| <= 60 * 16384 < 2^20.
        let lowest = area(self.have, SPREAD_AT_REST as u16);
        let above = sum.sum.cast_unsigned().wrapping_add(lowest);
        let mean_q8 = (sum.first.wrapping_sub(SPREAD_AT_REST) << 8)
            .wrapping_add(divide(above << 8, self.have) as i16);
        if sum.first.unsigned_abs() > FIRST_MOST || mean_q8.unsigned_abs() >= LARGEST_BIAS << 8 {
            return TURNS;
        }
        // Q24 times Q8.
        times(scale, mean_q8)
    }

    /// Its standard error in the same unit: as the head of this file has it, times the scale.
    #[must_use]
    pub fn error(&self, sum: &AxisSum, scale: i32) -> i32 {
        /// sqrt(pi)/2 in Q10.
        const OF_MAGNITUDE: u16 = 907;
        // Blocks differ by 60 b at the most: the sum is below 2^20, the quotient below 69 in Q10.
        let high = area((sum.steps >> 16) as u16, OF_MAGNITUDE);
        let steps = area(sum.steps as u16, OF_MAGNITUDE).wrapping_add(high << 16);
        let samples = self.block.wrapping_mul(self.blocks.wrapping_sub(1));
        let step = divide(steps, samples);
        // sqrt(k) in Q8.
        let root = root(u32::from(self.blocks) << 16);
        // Below 69 / sqrt(8) = 24 counts; Q24 times Q10 is Q34, of which 18 are kept.
        let error = divide(step << 8, root) as i16;
        times(scale, error) >> 2
    }
}

/// In place of a mean: no bias is that large.
pub const TURNS: i32 = i32::MIN;

impl Default for BiasNull {
    fn default() -> Self {
        Self::new()
    }
}

/// Sums of one axis. Everything is counted from the first reading, so that it stays small.
#[derive(Clone, Copy, Debug)]
pub struct AxisSum {
    sum: i32,
    /// Sum of the magnitudes of the steps from block to block.
    steps: u32,
    first: i16,
    /// Sum of the block under way, and of the one before; at most 60 * 513.
    part: i16,
    last: i16,
    low: i8,
    high: i8,
}

// Out of line, so that the compiler reaches an axis by pointer: in line it makes an address for each field anew.
impl AxisSum {
    /// Takes a reading, counts; whether the spread is one at rest.
    fn take(&mut self, value: i16, first: bool) -> bool {
        if first {
            self.first = value;
        }
        // 14 bits and 14 bits.
        let offset = value.wrapping_sub(self.first);
        if offset > SPREAD_AT_REST || offset < SPREAD_AT_REST.wrapping_neg() {
            return false;
        }
        self.sum = self.sum.wrapping_add(i32::from(offset));
        self.part = self.part.wrapping_add(offset);
        self.low = self.low.min(offset as i8);
        self.high = self.high.max(offset as i8);
        i16::from(self.high).wrapping_sub(self.low.into()) <= SPREAD_AT_REST
    }

    /// A block has ended.
    #[inline(never)]
    fn end_block(&mut self, first: bool) {
        if !first {
            // Blocks differ by the spread in each of their samples at the most.
            let step = self.part.wrapping_sub(self.last).unsigned_abs();
            self.steps = self.steps.wrapping_add(step.into());
        }
        (self.last, self.part) = (self.part, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One count for each 1/256: the mean in Q8 counts comes out as it is in Q16.
    const UNIT: i32 = 1 << 24;
    const AT_20_HZ: u16 = 12_500;

    impl BiasNull {
        fn mean_and_error(&self, axis: usize, scale: i32) -> Option<(i32, i32)> {
            let sum = &self.axes[axis];
            let mean = self.mean(sum, scale);
            (mean != TURNS).then(|| (mean, self.error(sum, scale)))
        }
    }

    fn begun(samples: u16, filter: u8, period_ticks: u16) -> BiasNull {
        let mut null = BiasNull::new();
        assert!(null.begin(samples, filter, period_ticks));
        null
    }

    fn take(null: &mut BiasNull, counts: impl IntoIterator<Item = i16>) -> Outcome {
        let mut outcome = Outcome::GoesOn;
        for value in counts {
            outcome = null.take(&[I16::new(value), I16::ZERO, I16::ZERO], true);
            if outcome != Outcome::GoesOn {
                return outcome;
            }
        }
        outcome
    }

    #[test]
    fn the_mean_and_its_standard_error_come_out_in_q16() {
        // At 20 Hz without a filter a block is a sample.
        let mut null = begun(8, 0, AT_20_HZ);
        assert_eq!(
            take(&mut null, [-3, -5, -3, -5, -3, -5, -3, -5]),
            Outcome::Done
        );
        let (mean, error) = null.mean_and_error(0, UNIT).expect("it rests");
        assert_eq!(mean, -4 << 16);
        // Steps of 2, the root of eight.
        let of = |step: f64| std::f64::consts::PI.sqrt() / 2.0 * step / 8f64.sqrt() * 65_536.0;
        assert!((f64::from(error) / of(2.0) - 1.0).abs() < 0.005, "{error}");
        // At the default filter a block has three samples: eight sums that step by 2, and a sample that is in none.
        let mut null = begun(25, 2, AT_20_HZ);
        take(
            &mut null,
            (0..25).map(|n| {
                if n == 24 || n % 3 != 0 {
                    -4
                } else {
                    -3 - n / 3 % 2 * 2
                }
            }),
        );
        let (mean, error) = null.mean_and_error(0, UNIT).expect("it rests");
        assert_eq!(mean, -4 << 16);
        assert!(
            (f64::from(error) / of(2.0 / 3.0) - 1.0).abs() < 0.005,
            "{error}"
        );
    }

    /// Normal deviates enough, from a generator that every platform has: twelve uniform numbers less six.
    struct Noise(u64);

    impl Noise {
        fn next(&mut self) -> f64 {
            let mut uniform = || {
                self.0 = (self.0)
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (self.0 >> 40) as f64 / f64::from(1 << 24)
            };
            (0..12).map(|_| uniform()).sum::<f64>() - 6.0
        }
    }

    /// Readings of a gyro whose 256 Hz samples are white noise through the two boxcars of 2^m taps, each `every`-th of them.
    fn readings(noise: &mut Noise, sigma: f64, filter: u8, every: usize, n: usize) -> Vec<i16> {
        let taps = 1usize << filter;
        let raw: Vec<f64> = (0..n * every + 2 * taps)
            .map(|_| sigma * noise.next())
            .collect();
        let boxcar = |x: &[f64]| -> Vec<f64> {
            x.windows(taps)
                .map(|window| window.iter().sum::<f64>() / taps as f64)
                .collect()
        };
        let filtered = boxcar(&boxcar(&raw));
        (0..n).map(|k| filtered[k * every].round() as i16).collect()
    }

    /// 200 measurements: the spread of their means and the errors that they tell. The ratio of the two mean squares is off
    /// by 10 % rms at the most (chi-square of 200), 2.5 of those are allowed, and the 8 % that the blocks take off.
    #[test]
    fn the_standard_error_is_right_at_every_rate_and_filter() {
        let mut noise = Noise(1);
        for (filter, every, n) in [
            (0, 1, 513),
            (2, 1, 1056),
            (4, 1, 4128),
            (2, 3, 1024),
            (2, 13, 512),
            (6, 13, 1024),
            (2, 64, 128),
        ] {
            let period = (976 * every as u32).min(62_500) as u16;
            // 6 counts rms before the filter at least, so that rounding is a small part of it.
            let sigma = 6.0;
            let (mut means, mut told) = (0.0, 0.0);
            for _ in 0..200 {
                let mut null = begun(n, filter, period);
                let counts = readings(&mut noise, sigma, filter, every, n.into());
                assert_eq!(take(&mut null, counts), Outcome::Done);
                let (mean, error) = null.mean_and_error(0, UNIT).expect("it rests");
                means += f64::from(mean).powi(2);
                told += f64::from(error).powi(2);
            }
            let ratio = told / means;
            println!(
                "2^{filter} taps, every {every}: told {:.3} of the error",
                ratio.sqrt()
            );
            assert!(
                (0.67..1.25).contains(&ratio),
                "2^{filter} taps, every {every}: {ratio}"
            );
        }
    }

    #[test]
    fn a_turning_stand_is_refused() {
        let mut null = begun(100, 0, AT_20_HZ);
        assert_eq!(take(&mut null, [0, 0, 61]), Outcome::Moving);
        let mut null = begun(100, 0, AT_20_HZ);
        assert_eq!(take(&mut null, [0, 31, -30]), Outcome::Moving, "61 apart");
        let mut steady = begun(8, 0, AT_20_HZ);
        assert_eq!(take(&mut steady, [1365; 8]), Outcome::Done);
        assert_eq!(steady.mean_and_error(0, UNIT), None, "100 deg/s is no bias");
        let mut full = begun(MAX_SAMPLES, 0, AT_20_HZ);
        assert_eq!(
            take(&mut full, (0..MAX_SAMPLES).map(|_| -8192)),
            Outcome::Done
        );
        assert_eq!(full.mean_and_error(0, UNIT), None);
    }

    #[test]
    fn what_is_not_in_order_is_left_out_and_too_much_of_it_ends_the_measurement() {
        let mut null = begun(8, 0, AT_20_HZ);
        for value in [-3, -5, -3, -5, -3, -5, -3, -5] {
            for _ in 0..PATIENCE - 1 {
                let wrong = [I16::new(40), I16::ZERO, I16::ZERO];
                assert_eq!(null.take(&wrong, false), Outcome::GoesOn);
            }
            take(&mut null, [value]);
        }
        assert_eq!(null.mean_and_error(0, UNIT).expect("it rests").0, -4 << 16);
        let mut null = begun(8, 0, AT_20_HZ);
        let end = (1..100).find(|_| null.take(&[I16::ZERO; 3], false) == Outcome::NotInOrder);
        assert_eq!(end, Some(PATIENCE));
    }

    #[test]
    fn fewer_than_eight_blocks_have_no_standard_error_worth_its_name_and_are_refused() {
        for (filter, period, fewest) in [
            (2, AT_20_HZ, 24),
            (2, 976, 264),
            (6, 976, 4104),
            (0, 62_500, 8),
        ] {
            let mut null = BiasNull::new();
            assert!(!null.begin(fewest - 1, filter, period), "{fewest}");
            assert!(null.begin(fewest, filter, period), "{fewest}");
        }
        assert!(!BiasNull::new().begin(MAX_SAMPLES + 1, 2, AT_20_HZ));
    }

    #[test]
    fn a_drift_across_the_largest_blocks_does_not_wrap() {
        let mut null = begun(MAX_SAMPLES, 6, 976);
        // From end to end of the spread with each of 31 blocks.
        let counts = (0..MAX_SAMPLES).map(|n| if n / 513 % 2 == 0 { -30 } else { 30 });
        assert_eq!(take(&mut null, counts), Outcome::Done);
        let (_, error) = null.mean_and_error(0, UNIT).expect("it rests");
        let expected = std::f64::consts::PI.sqrt() / 2.0 * 60.0 / 31f64.sqrt() * 65_536.0;
        assert!(
            (f64::from(error) / expected - 1.0).abs() < 0.003,
            "{error} {expected}"
        );
    }
}
