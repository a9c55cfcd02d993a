//! Bias null: the mean of each rate at rest, over N samples, with the standard error it reached.

use zerocopy::little_endian::I16;

use crate::math::{divide, root, scaled};

/// Largest spread (max - min) of a rate at rest, counts: eight times the 5.4 counts rms that a gyro has at 20 Hz
/// (ARW 5.27 deg/sqrt(h)) is exceeded by a still stand once in many thousand runs; a turning one exceeds it at once.
const SPREAD_AT_REST: i16 = 60;
/// Largest mean rate that can be a bias, counts: 5 deg/s. What is more is a rotation.
const LARGEST_BIAS: u16 = 68;
/// Fewest samples that have a standard error.
pub const MIN_SAMPLES: u16 = 2;
/// Most samples: sums of 14-bit counts and of squared steps hold in 32 bits, with room.
pub const MAX_SAMPLES: u16 = 16_384;

/// A bias measurement under way.
#[derive(Clone, Copy, Debug)]
pub struct BiasNull {
    have: u16,
    axes: [AxisSum; 3],
}

/// What a further sample brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// More are needed, or it is done.
    Resting,
    /// The stand moves.
    Moving,
}

impl BiasNull {
    /// Nothing yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            have: 0,
            axes: [AxisSum {
                sum: 0,
                steps: 0,
                last: 0,
                low: 0,
                high: 0,
            }; 3],
        }
    }

    /// How many samples it has.
    #[must_use]
    pub fn have(&self) -> u16 {
        self.have
    }

    /// Takes a sample, counts.
    pub fn take(&mut self, rates: &[I16; 3]) -> Outcome {
        let first = self.have == 0;
        self.have = self.have.wrapping_add(1);
        let mut resting = true;
        for (axis, rate) in self.axes.iter_mut().zip(rates) {
            resting &= axis.take(rate.get(), first);
        }
        if resting {
            Outcome::Resting
        } else {
            Outcome::Moving
        }
    }

    /// Mean rate of an axis, Q16.16 deg/s, by a scale in Q8.24 deg/s for each count, and its standard error in the same
    /// unit. `None` for a stand that turns.
    #[must_use]
    pub fn mean_and_error(&self, axis: u8, scale: i32) -> Option<(i32, i32)> {
        let sum = self.axes.get(axis as usize)?;
        let mean = sum.mean(self.have, scale)?;
        Some((mean, sum.error(self.have, scale)))
    }
}

impl Default for BiasNull {
    fn default() -> Self {
        Self::new()
    }
}

#[derive(Clone, Copy, Debug)]
struct AxisSum {
    sum: i32,
    /// Sum of the squared steps from sample to sample.
    steps: u32,
    last: i16,
    low: i16,
    high: i16,
}

// Out of line, so that the compiler reaches an axis by pointer: in line it makes an address for each field anew.
impl AxisSum {
    /// Takes a reading, counts; whether the spread is one at rest.
    #[inline(never)]
    fn take(&mut self, value: i16, first: bool) -> bool {
        if first {
            (self.last, self.low, self.high) = (value, value, value);
        }
        let step = value.wrapping_sub(self.last);
        self.last = value;
        self.sum = self.sum.wrapping_add(i32::from(value));
        // |step| <= 60 at rest: at most 3600 * 16384 < 2^26.
        self.steps = self
            .steps
            .wrapping_add(step.wrapping_mul(step).cast_unsigned().into());
        self.low = value.min(self.low);
        self.high = value.max(self.high);
        self.high.wrapping_sub(self.low) <= SPREAD_AT_REST
    }

    /// The mean; `None` where it is a rotation.
    #[inline(never)]
    fn mean(&self, have: u16, scale: i32) -> Option<i32> {
        // |sum| <= 16384 * 8191 < 2^27; what passes this has |sum| << 8 < 2^29.
        let magnitude = self.sum.unsigned_abs();
        if divide(magnitude, have) >= u32::from(LARGEST_BIAS) {
            return None;
        }
        let mean = scaled(divide(magnitude << 8, have) as u16, scale);
        Some(if self.sum < 0 {
            mean.wrapping_neg()
        } else {
            mean
        })
    }

    /// The mean's standard error: that of white noise whose variance is half the mean square of the steps from sample to
    /// sample, so that a drift does not count as noise.
    #[inline(never)]
    fn error(&self, have: u16, scale: i32) -> i32 {
        // Steps squared, mean in Q6; half of it is the variance, a further division by n the mean's, in Q20.
        let square_q6 = divide(self.steps << 6, have.wrapping_sub(1));
        let error_q10 = root(divide(square_q6 << 13, have));
        scaled(error_q10, scale) >> 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One count for each 1/256: the mean in Q8 counts comes out as it is in Q16.
    const UNIT: i32 = 1 << 24;

    fn take(null: &mut BiasNull, counts: impl IntoIterator<Item = i16>) -> Outcome {
        for value in counts {
            if null.take(&[I16::new(value), I16::ZERO, I16::ZERO]) == Outcome::Moving {
                return Outcome::Moving;
            }
        }
        Outcome::Resting
    }

    #[test]
    fn the_mean_and_its_standard_error_come_out_in_q16() {
        let mut null = BiasNull::new();
        assert_eq!(
            take(&mut null, [-3, -5, -3, -5, -3, -5, -3, -5]),
            Outcome::Resting
        );
        let (mean, error) = null.mean_and_error(0, UNIT).expect("it rests");
        assert_eq!(mean, -4 << 16);
        // Steps of 2: variance 2, of the mean of eight 1/4.
        assert!((error - 32_768).abs() < 128, "{error}");
    }

    #[test]
    fn the_standard_error_is_that_of_white_noise() {
        // Sum of four uniform numbers: sigma = sqrt(4 * (16^2 - 1) / 12) = 9.22 counts.
        let (mut state, n) = (1u32, 4096);
        let mut uniform = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 28) as i16
        };
        let mut null = BiasNull::new();
        let counts: Vec<i16> = (0..n).map(|_| (0..4).map(|_| uniform()).sum()).collect();
        assert_eq!(take(&mut null, counts.iter().copied()), Outcome::Resting);
        let (_, error) = null.mean_and_error(0, UNIT).expect("it rests");
        let expected = 9.22 / f64::from(n).sqrt() * 65_536.0;
        assert!(
            (f64::from(error) / expected - 1.0).abs() < 0.05,
            "{error} {expected}"
        );
    }

    #[test]
    fn a_turning_stand_is_refused() {
        let mut null = BiasNull::new();
        assert_eq!(take(&mut null, [0, 0, 61]), Outcome::Moving);
        let mut steady = BiasNull::new();
        assert_eq!(take(&mut steady, [1365, 1365]), Outcome::Resting);
        assert_eq!(steady.mean_and_error(0, UNIT), None, "100 deg/s is no bias");
        let mut full = BiasNull::new();
        assert_eq!(
            take(&mut full, (0..MAX_SAMPLES).map(|_| -8192)),
            Outcome::Resting
        );
        assert_eq!(full.mean_and_error(0, UNIT), None);
    }
}
