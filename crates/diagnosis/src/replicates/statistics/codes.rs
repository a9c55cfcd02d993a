//! The readings as counts: equal neighbours, and the bits.

use model::nearest::nearest;

use super::Statistic;

/// Lowest bits whose share of ones is compared.
const BITS: usize = 8;

/// Share of readings that are equal to the one before, and of ones in each of the lowest bits.
pub(super) struct Codes {
    step: f64,
    /// Whether the count of a reading is known: one of which an offset was taken off has other bits.
    counted: bool,
}

impl Codes {
    /// For readings in steps, 0 where there are none, whose counts are known or not.
    pub fn new(step: f64, counted: bool) -> Self {
        Self { step, counted }
    }

    pub fn name(&self, all: &mut Vec<Statistic>) {
        if self.step > 0.0 {
            all.push(Statistic::new(
                "share of readings equal to the one before",
                "1",
            ));
            for bit in 0..if self.counted { BITS } else { 0 } {
                all.push(Statistic::new(format!("share of ones in bit {bit}"), "1"));
            }
        }
    }

    /// `codes` is room for the lowest byte of each count.
    pub fn take(&self, x: &[f64], codes: &mut Vec<u8>, all: &mut Vec<f64>) {
        if self.step <= 0.0 {
            return;
        }
        let n = x.len() as f64;
        let near = 0.5 * self.step;
        let equal = x.windows(2).map(|w| u32::from((w[1] - w[0]).abs() < near));
        all.push(f64::from(equal.sum::<u32>()) / n);
        if !self.counted {
            return;
        }
        let scale = 1.0 / self.step;
        codes.clear();
        let lowest = (x.iter()).map(|v| nearest(v * scale, i32::MIN, i32::MAX) as u8);
        codes.extend(lowest);
        // Counted in bytes, emptied before they overflow.
        let mut ones = [0usize; BITS];
        for some in codes.chunks(usize::from(u8::MAX)) {
            for (bit, ones) in ones.iter_mut().enumerate() {
                *ones += usize::from(some.iter().map(|c| c >> bit & 1).sum::<u8>());
            }
        }
        all.extend(ones.map(|count| count as f64 / n));
    }
}
