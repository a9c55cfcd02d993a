//! A process as means over blocks show it.
//!
//! Block means are no readings: they are smoother than samples of the process so far apart. A strong process whose white noise
//! the means have averaged away is nothing else at their highest frequencies, so its density has to be theirs.

use std::f64::consts::PI;
use std::sync::Arc;

use model::effect::{Covariance, Frequencies};

/// Frequencies of the readings that stand for one of the blocks on either side of it, the nearest first; the share of all that
/// lie farther is some 1 / (pi^2 NEAREST), and has the density of half the sample rate. A wandering process has little there.
const NEAREST: usize = 8;

/// Means of a process over blocks of `length` readings; coordinates are those of the readings.
pub(super) struct OfBlocks {
    pub process: Arc<dyn Covariance>,
    pub length: usize,
}

impl Covariance for OfBlocks {
    fn dimensions(&self) -> usize {
        self.process.dimensions()
    }

    /// In units of the white variance of the means: 1 where that of the readings is.
    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        if self.length == 1 {
            return self.process.density(theta, at);
        }
        let length = self.length as f64;
        let nearest = NEAREST.min((self.length - 1) / 2) as i64;
        let folds = (2 * nearest + 1) as usize;
        let folded = |w: &f64| {
            let w = *w;
            (-nearest..=nearest).map(move |k| (w + 2.0 * PI * k as f64) / length)
        };
        let all = at.omega.iter().flat_map(folded);
        // A density is the same at -w.
        let mut omega: Vec<f64> = all.map(f64::abs).collect();
        omega.push(PI);
        let near = self.process.density(theta, &Frequencies::at(omega.clone()));
        let far = near[near.len() - 1];
        let parts = near.chunks_exact(folds).zip(omega.chunks_exact(folds));
        let means = parts.zip(&at.omega).map(|((near, omega), at)| {
            let passed = (0.5 * at).sin() / length;
            let (mut sum, mut rest) = (0.0, 1.0);
            for (density, w) in near.iter().zip(omega) {
                let share = (passed / (0.5 * w).sin()).powi(2);
                sum += share * density;
                rest -= share;
            }
            sum + rest.max(0.0) * far
        });
        means.collect()
    }

    fn bounds(&self, samples: usize) -> Vec<(f64, f64)> {
        self.process.bounds(samples * self.length)
    }

    fn starts(&self, samples: usize) -> Vec<Vec<f64>> {
        self.process.starts(samples * self.length)
    }
}

#[cfg(test)]
mod tests {
    use super::super::one_pole::OnePole;
    use super::*;

    #[test]
    fn a_density_of_means_is_the_sum_of_their_covariances() {
        // Of readings v r^|i - j|, means over L of them have these covariances at a lag of k blocks.
        let (length, time) = (10usize, 40.0f64);
        let r = (-1.0 / time).exp();
        let between = |k: usize| {
            let pairs = (0..length).flat_map(|i| (0..length).map(move |j| (i, j)));
            let lag = |(i, j): (usize, usize)| (k * length + j).abs_diff(i) as i32;
            pairs.map(|p| r.powi(lag(p))).sum::<f64>() / (length * length) as f64
        };
        let covariances: Vec<f64> = (0..200).map(between).collect();
        let means = OfBlocks {
            process: Arc::new(OnePole),
            length,
        };
        let omega = vec![0.01, 0.1, 0.7, 2.0, PI];
        let all = means.density(&[0.0, time.ln()], &Frequencies::at(omega.clone()));
        for (w, density) in omega.iter().zip(all) {
            let lags = covariances.iter().enumerate().skip(1);
            let sum: f64 = lags.map(|(k, c)| 2.0 * c * (k as f64 * w).cos()).sum();
            // White means have 1 / L of the variance.
            let wanted = length as f64 * (covariances[0] + sum);
            assert!(
                (density / wanted - 1.0).abs() < 0.01,
                "{w}: {density} {wanted}"
            );
        }
    }
}
