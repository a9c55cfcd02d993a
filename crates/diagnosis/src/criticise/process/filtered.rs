//! What passes a filter, in time: its moments, and its energy by stretches and by courses.

use super::{LEAST, LEAST_OF_COURSE, ROUNDING, STRETCHES, powers};
use crate::fit::likelihood::Panel;
use numerics::column::dot;
use numerics::tails::{chi_tail, kurtosis_score};

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

    /// Sum of the squared deviations of the energies in stretches, its chance, the stretch that is farthest off and its
    /// energy over the mean.
    pub(super) fn steadiness(&self, more: f64) -> Option<(f64, f64, usize, f64)> {
        let length = self.values.len() / STRETCHES;
        if (length as f64) < more * LEAST * self.sums[0] {
            return None;
        }
        let energies: Vec<f64> = self
            .values
            .chunks_exact(length)
            .take(STRETCHES)
            .map(|c| c.iter().map(|v| v * v).sum::<f64>() / length as f64)
            .collect();
        let mean = energies.iter().sum::<f64>() / STRETCHES as f64;
        let variance = 2.0 * self.sums[0] / length as f64;
        let off = |e: &f64| (e / mean - 1.0).powi(2) / variance;
        let statistic: f64 = energies.iter().map(off).sum();
        let worst =
            (0..STRETCHES).max_by(|a, b| off(&energies[*a]).total_cmp(&off(&energies[*b])))?;
        let chance = chi_tail(statistic, STRETCHES as f64 - 1.0);
        Some((statistic, chance, worst, energies[worst] / mean))
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
