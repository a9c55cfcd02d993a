//! Bias null: the mean of each rate at rest, over N samples.

/// Largest spread (max - min) of a rate at rest, counts: eight times the 5.4 counts rms that a gyro has at 20 Hz
/// (ARW 5.27 deg/sqrt(h)) is exceeded by a still stand once in many thousand runs; a turning one exceeds it at once.
const SPREAD_AT_REST: i16 = 60;
/// Largest mean rate that can be a bias, counts: 5 deg/s. What is more is a rotation.
const LARGEST_BIAS_Q8: i32 = 68 << 8;
/// Most samples that a sum of 14-bit counts holds in 32 bits, with room.
pub const MAX_SAMPLES: u16 = 16_384;

/// A bias measurement under way.
#[derive(Clone, Copy, Debug)]
pub struct BiasNull {
    number: u16,
    wanted: u16,
    have: u16,
    axes: [AxisSum; 3],
}

/// What a further sample brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// More are needed.
    Running,
    /// Done: mean of each axis, counts in Q8.
    Done([i32; 3]),
    /// The stand moves.
    Moving,
}

impl BiasNull {
    /// Starts; `number` is the request's.
    #[must_use]
    pub fn new(number: u16, wanted: u16) -> Self {
        Self {
            number,
            wanted,
            have: 0,
            axes: [AxisSum {
                sum: 0,
                low: i16::MAX,
                high: i16::MIN,
            }; 3],
        }
    }

    /// The request that the reply goes to.
    #[must_use]
    pub fn number(&self) -> u16 {
        self.number
    }

    /// Takes a sample, counts.
    #[inline(never)]
    pub fn take(&mut self, gyro: [i16; 3]) -> Outcome {
        let mut moving = false;
        for (&value, axis) in gyro.iter().zip(&mut self.axes) {
            moving |= axis.take(value);
        }
        if moving {
            return Outcome::Moving;
        }
        self.have = self.have.wrapping_add(1);
        if self.have < self.wanted {
            return Outcome::Running;
        }
        let mut mean = [0; 3];
        for (mean, axis) in mean.iter_mut().zip(&self.axes) {
            // |sum| <= 16384 * 8191 < 2^27.
            let whole_q8 = divide_q8(axis.sum.unsigned_abs(), self.have);
            *mean = if axis.sum < 0 {
                whole_q8.wrapping_neg()
            } else {
                whole_q8
            };
            if whole_q8 > LARGEST_BIAS_Q8 {
                return Outcome::Moving;
            }
        }
        Outcome::Done(mean)
    }
}

#[derive(Clone, Copy, Debug)]
struct AxisSum {
    sum: i32,
    low: i16,
    high: i16,
}

impl AxisSum {
    /// Whether the spread is more than that of a stand at rest.
    #[inline(never)]
    fn take(&mut self, value: i16) -> bool {
        self.sum = self.sum.wrapping_add(i32::from(value));
        self.low = value.min(self.low);
        self.high = value.max(self.high);
        self.high.wrapping_sub(self.low) > SPREAD_AT_REST
    }
}

/// `sum / n` in Q8, rounded down, a bit at a time: a tenth of the flash of a general 32-bit division.
#[inline(never)]
fn divide_q8(sum: u32, n: u16) -> i32 {
    let n = u32::from(n);
    let (mut quotient, mut rest) = (0u32, 0u32);
    for bit in (0..27u8).rev() {
        rest = rest << 1 | (sum >> bit & 1);
        quotient <<= 1;
        if rest >= n {
            rest = rest.wrapping_sub(n);
            quotient |= 1;
        }
    }
    for _ in 0..8 {
        rest <<= 1;
        quotient <<= 1;
        if rest >= n {
            rest = rest.wrapping_sub(n);
            quotient |= 1;
        }
    }
    quotient as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_each_axis_comes_out_in_q8() {
        let mut null = BiasNull::new(1, 4);
        for k in 0..3 {
            assert_eq!(null.take([k, -k, 7]), Outcome::Running);
        }
        assert_eq!(null.take([3, -3, 7]), Outcome::Done([384, -384, 1792]));
    }

    #[test]
    fn a_turning_stand_is_refused() {
        let mut null = BiasNull::new(1, 4);
        assert_eq!(null.take([0, 0, 0]), Outcome::Running);
        assert_eq!(null.take([0, 0, 61]), Outcome::Moving);
        let mut steady = BiasNull::new(1, 1);
        assert_eq!(
            steady.take([0, 0, 1365]),
            Outcome::Moving,
            "100 deg/s is no bias"
        );
    }
}
