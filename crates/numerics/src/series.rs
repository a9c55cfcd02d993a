//! What is asked of a series of readings.
//!
//! ```
//! use numerics::series::{smallest_step, white_by_differences};
//!
//! // A ramp that is rounded to 0.5, with alternating noise of +-1: the ramp does not count.
//! let readings: Vec<f64> = (0..1000).map(|i| f64::from(i / 500) * 0.5 + f64::from(i % 2) * 2.0).collect();
//! assert_eq!(smallest_step(&readings), 0.5);
//! assert!((white_by_differences(&readings) - (2.0f64 / 0.6745).powi(2) / 2.0).abs() < 1e-9);
//! ```

use crate::order_statistics::robust_sigma;

/// Longest distance, in steps, that tells whether readings lie on a lattice: beyond it rounding hides that.
pub const MOST_STEPS: f64 = 1000.0;

/// Smallest distance between two readings that is no dust of the arithmetic: the step of a channel that does not say.
/// 0 where the other distances are no multiples of it: such readings repeat exactly or not at all.
pub fn smallest_step(values: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let dust = 1e-6 * robust_sigma(&sorted);
    let gaps = || sorted.windows(2).map(|w| w[1] - w[0]).filter(|g| *g > dust);
    let step = gaps().fold(f64::INFINITY, f64::min);
    let (mut multiples, mut all) = (0.0, 0.0);
    for steps in gaps().map(|g| g / step).filter(|s| *s < MOST_STEPS) {
        all += 1.0;
        multiples += f64::from(u8::from((steps - steps.round()).abs() < 0.1));
    }
    if multiples > 0.8 * all { step } else { 0.0 }
}

/// White variance from first differences, robust against steps and spikes: half the square of their median size over 0.6745,
/// the median of a standard normal's size. In the square of the unit of `y`; what is not finite is left out; 0 below two values.
pub fn white_by_differences(y: &[f64]) -> f64 {
    let known: Vec<f64> = y.iter().copied().filter(|v| v.is_finite()).collect();
    let mut d: Vec<f64> = known.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    if d.is_empty() {
        return 0.0;
    }
    let middle = d.len() / 2;
    let (_, median, _) = d.select_nth_unstable_by(middle, f64::total_cmp);
    (*median / 0.6745).powi(2) / 2.0
}
