//! Bias null: the mean of each rate at rest, over N samples, with the standard error it reached.

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

    /// Takes a sample of one axis, counts. The caller counts the samples: [`Self::count`].
    #[inline(never)]
    pub fn take(&mut self, axis: u8, value: i16) -> Outcome {
        let first = self.have == 0;
        let Some(sum) = self.axes.get_mut(axis as usize) else {
            return Outcome::Moving;
        };
        if first {
            *sum = AxisSum {
                sum: 0,
                steps: 0,
                last: value,
                low: value,
                high: value,
            };
        }
        let step = value.wrapping_sub(sum.last);
        sum.last = value;
        sum.sum = sum.sum.wrapping_add(i32::from(value));
        sum.low = value.min(sum.low);
        sum.high = value.max(sum.high);
        if sum.high.wrapping_sub(sum.low) > SPREAD_AT_REST {
            return Outcome::Moving;
        }
        // |step| <= 60: at most 3600 * 16384 < 2^26.
        sum.steps = sum
            .steps
            .wrapping_add(step.wrapping_mul(step).cast_unsigned().into());
        Outcome::Resting
    }

    /// A sample of all axes has been taken.
    pub fn count(&mut self) {
        self.have = self.have.wrapping_add(1);
    }

    /// What [`mean`](Self::mean) says of a stand that turns; no bias is as large.
    pub const ROTATION: i32 = i32::MIN;

    /// Mean rate of an axis, Q16.16 deg/s, by a scale in Q8.24 deg/s for each count.
    #[must_use]
    pub fn mean(&self, axis: u8, scale: i32) -> i32 {
        let Some(sum) = self.axes.get(axis as usize) else {
            return Self::ROTATION;
        };
        // |sum| <= 16384 * 8191 < 2^27; what passes this has |sum| << 8 < 2^29.
        let magnitude = sum.sum.unsigned_abs();
        if divide(magnitude, self.have) >= u32::from(LARGEST_BIAS) {
            return Self::ROTATION;
        }
        let mean = scaled(divide(magnitude << 8, self.have) as u16, scale);
        if sum.sum < 0 {
            mean.wrapping_neg()
        } else {
            mean
        }
    }

    /// Standard error of the mean, in its unit: that of white noise whose variance is half the mean square of the steps
    /// from sample to sample, so that a drift does not count as noise.
    #[must_use]
    pub fn error(&self, axis: u8, scale: i32) -> i32 {
        let Some(sum) = self.axes.get(axis as usize) else {
            return 0;
        };
        // Steps squared, mean in Q6; half of it is the variance, a further division by n the mean's, in Q20.
        let square_q6 = divide(sum.steps << 6, self.have.wrapping_sub(1));
        let error_q10 = root(divide(square_q6 << 13, self.have));
        scaled(error_q10, scale) >> 2
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

#[cfg(test)]
mod tests {
    use super::*;

    /// One count for each 1/256: the mean in Q8 counts comes out as it is in Q16.
    const UNIT: i32 = 1 << 24;

    fn take(null: &mut BiasNull, counts: impl IntoIterator<Item = i16>) -> Outcome {
        for value in counts {
            if null.take(0, value) == Outcome::Moving {
                return Outcome::Moving;
            }
            null.count();
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
        let (mean, error) = (null.mean(0, UNIT), null.error(0, UNIT));
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
        let error = null.error(0, UNIT);
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
        assert_eq!(
            steady.mean(0, UNIT),
            BiasNull::ROTATION,
            "100 deg/s is no bias"
        );
        let mut full = BiasNull::new();
        assert_eq!(
            take(&mut full, (0..MAX_SAMPLES).map(|_| -8192)),
            Outcome::Resting
        );
        assert_eq!(full.mean(0, UNIT), BiasNull::ROTATION);
    }
}
