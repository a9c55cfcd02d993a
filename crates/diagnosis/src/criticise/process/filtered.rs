//! What passes a filter, in time: its moments, and its energy by courses.

use super::{LEAST, LEAST_OF_COURSE, ROUNDING, powers};
use crate::fit::likelihood::Panel;
use numerics::column::dot;
use numerics::tails::kurtosis_score;

/// Whitened coefficients behind a filter, in time over the standard deviations that they have there, and how such values correlate.
pub(super) struct Filtered {
    pub(super) values: Vec<f64>,
    /// Sums of the second to fourth power of the correlation over all lags.
    pub(super) sums: [f64; 3],
}

impl Filtered {
    pub(super) fn new(panel: &Panel, u: &[f64], filter: &[f64], sizes: Option<Vec<f64>>) -> Self {
        let passed: Vec<f64> = u.iter().zip(filter).map(|(u, f)| u * f).collect();
        let power: Vec<f64> = filter.iter().map(|f| f * f).collect();
        let total: f64 = power.iter().sum();
        // The inverse transform gives the correlation at the middles between lags: twice their sum is that over all lags.
        let scale = (u.len() as f64 / 2.0).sqrt() / total;
        let correlation = panel.dct.inverse(&power);
        let sums = [2, 3, 4].map(|k| {
            let all = correlation.iter().map(|r| (r * scale).powi(k));
            2.0 * all.sum::<f64>()
        });
        let mut values = panel.dct.inverse(&passed);
        let sizes = sizes.iter().flatten();
        values.iter_mut().zip(sizes).for_each(|(v, s)| *v /= s);
        Self { values, sums }
    }

    /// Skewness and kurtosis over their standard errors; NaN where too few independent values stand behind.
    pub(super) fn moments(&self) -> [(&'static str, f64); 2] {
        let n = self.values.len() as f64;
        let mean = |k| self.values.iter().map(|v| v.powi(k)).sum::<f64>() / n;
        let variance = mean(2);
        let independent = |sum: f64| Some(n / sum.max(1.0)).filter(|n| *n > LEAST);
        // The third Hermite moment: the mean that lies beside zero is taken off.
        let third = mean(3) / variance.powf(1.5) - 3.0 * mean(1) / variance.sqrt();
        let skewness = independent(self.sums[1]).map_or(f64::NAN, |n| third * (n / 6.0).sqrt());
        let fourth = mean(4) / (variance * variance);
        let kurtosis = independent(self.sums[2]).map_or(f64::NAN, |n| kurtosis_score(fourth, n));
        [("skewness", skewness), ("kurtosis", kurtosis)]
    }

    /// Chi-square of two degrees of the energy against a course and its square, and the part of the energy, rms, that
    /// follows them. `None` where too few independent values stand behind.
    pub(super) fn follows(&self, course: &[f64], more: f64) -> Option<(f64, f64)> {
        let n = self.values.len() as f64;
        if n < more * LEAST_OF_COURSE * self.sums[0] {
            return None;
        }
        let energy = self.values.iter().map(|v| v * v).sum::<f64>() / n;
        let [first, square, _] = powers(course);
        // What is left of a course that rests, or of the square of one of two levels, is rounding.
        let score = |c: &[f64], of: &[f64], power: i32| {
            let raw: f64 = of.iter().map(|v| v.powi(2 * power)).sum();
            if dot(c, c) < ROUNDING * raw {
                return 0.0;
            }
            let more = self.values.iter().map(|v| v * v / energy - 1.0);
            more.zip(c).map(|(m, c)| m * c).sum::<f64>() / dot(c, c).sqrt()
        };
        let scores = score(&first, course, 1).powi(2) + score(&square, &first, 2).powi(2);
        let follows = (scores / (2.0 * self.sums[0]), (scores / n).sqrt());
        Some(follows)
    }
}
