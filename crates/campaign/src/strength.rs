//! How strong an effect is: d', the square root of twice the expected log likelihood ratio, the random walk refitted
//! under the baseline, so that what a random walk can hide does not count.

use analysis::likelihood::{Bins, Dct, least_walk};
use analysis::optimise::golden;

use crate::stand::Stand;

/// The spectrum that a channel of a stand has, on the bins of its length.
#[derive(Clone)]
pub struct Meter {
    dct: Dct,
    bins: Bins,
    count: Vec<f64>,
    walk: Vec<f64>,
    /// Variance of a coefficient without the effect.
    clean: Vec<f64>,
}

impl Meter {
    /// For an axis of a stand.
    #[must_use]
    pub fn new(stand: &Stand, axis: usize) -> Self {
        let n = stand.samples();
        let bins = Bins::new(n);
        let ones = vec![1.0; n];
        let count = bins.products(&ones, &ones);
        let walk: Vec<f64> = bins
            .at
            .omega
            .iter()
            .map(|w| 1.0 / (4.0 * (w / 2.0).sin().powi(2)))
            .collect();
        let clean = walk
            .iter()
            .map(|w| stand.white(axis) + stand.step(axis) * w)
            .collect();
        Self {
            dct: Dct::new(n),
            bins,
            count,
            walk,
            clean,
        }
    }

    /// Angular frequencies of the bins, rad per sample.
    #[must_use]
    pub fn omega(&self) -> &[f64] {
        &self.bins.at.omega
    }

    /// The same channel with a process beside its noise that adds `density` to the variance of each coefficient.
    #[must_use]
    pub fn over(&self, density: &[f64]) -> Self {
        let mut other = self.clone();
        other
            .clean
            .iter_mut()
            .zip(density)
            .for_each(|(v, d)| *v += d);
        other
    }

    /// Energy of a signal in each bin.
    #[must_use]
    pub fn energy(&self, signal: &[f64]) -> Vec<f64> {
        let c = self.dct.forward(signal);
        self.bins.products(&c, &c)
    }

    /// What is left of a signal when the best multiples of others are taken off, in the metric of the noise.
    #[must_use]
    pub fn beyond(&self, signal: &[f64], others: &[Vec<f64>]) -> Vec<f64> {
        let weighted = |a: &[f64], b: &[f64]| -> f64 {
            let sums = self.bins.products(a, b);
            sums.iter().zip(&self.clean).map(|(s, v)| s / v).sum()
        };
        let mut c = self.dct.forward(signal);
        let mut basis: Vec<Vec<f64>> = vec![];
        for other in others {
            let mut x = self.dct.forward(other);
            for b in &basis {
                let share = weighted(&x, b);
                x.iter_mut().zip(b).for_each(|(x, b)| *x -= share * b);
            }
            let length = weighted(&x, &x).sqrt();
            if length > 1e-9 {
                x.iter_mut().for_each(|x| *x /= length);
                basis.push(x);
            }
        }
        for b in &basis {
            let share = weighted(&c, b);
            c.iter_mut().zip(b).for_each(|(c, b)| *c -= share * b);
        }
        c[0] = 0.0;
        self.dct.inverse(&c)
    }

    /// d' of a signal of known shape, by its energies.
    #[must_use]
    pub fn of_signal(&self, energy: &[f64]) -> f64 {
        let expected: Vec<f64> = (0..energy.len())
            .map(|b| self.count[b] * self.clean[b] + energy[b])
            .collect();
        let truth: f64 = self
            .clean
            .iter()
            .zip(&self.count)
            .map(|(v, m)| m * (1.0 + v.ln()))
            .sum();
        self.against_baseline(&expected, truth)
    }

    /// The multiple of a signal of these energies that is `wanted` strong, and how strong it is.
    #[must_use]
    pub fn sized(&self, energy: &[f64], wanted: f64) -> (f64, f64) {
        let strength = |size: f64| {
            let scaled: Vec<f64> = energy.iter().map(|e| e * size * size).collect();
            self.of_signal(&scaled)
        };
        let size = size_for(wanted, &strength);
        (size, strength(size))
    }

    /// d' of a process that adds `density` to the variance of each coefficient, or of a filter that shapes the white
    /// noise (then `density` is what the filter changes, negative where it takes off).
    #[must_use]
    pub fn of_density(&self, density: &[f64]) -> f64 {
        let with: Vec<f64> = self
            .clean
            .iter()
            .zip(density)
            .map(|(v, d)| (v + d).max(1e-9 * v))
            .collect();
        let expected: Vec<f64> = with.iter().zip(&self.count).map(|(v, m)| v * m).collect();
        let truth = with
            .iter()
            .zip(&self.count)
            .map(|(v, m)| m * (1.0 + v.ln()))
            .sum();
        self.against_baseline(&expected, truth)
    }

    /// White noise and random walk refitted to expected energies.
    fn against_baseline(&self, expected: &[f64], truth: f64) -> f64 {
        let n: f64 = self.count.iter().sum();
        let minus_two_l = |log_walk: f64| {
            let lambda = log_walk.exp();
            let (mut sum, mut logs) = (0.0, 0.0);
            for ((e, w), m) in expected.iter().zip(&self.walk).zip(&self.count) {
                let g = 1.0 + lambda * w;
                sum += e / g;
                logs += m * g.ln();
            }
            n * (sum / n).ln() + logs + n
        };
        let low = least_walk(self.bins.n);
        let best = (0..24)
            .map(|i| low + (2.0 - low) * f64::from(i) / 23.0)
            .min_by(|a, b| minus_two_l(*a).total_cmp(&minus_two_l(*b)))
            .unwrap_or(low);
        let x = golden(&minus_two_l, (best - 1.0).max(low), best + 1.0, 20);
        let l = minus_two_l(x).min(minus_two_l(low));
        (l - truth).max(0.0).sqrt()
    }
}

/// d' of a variance that changes in time, `law` its ratio to that at rest.
#[must_use]
pub fn of_variance(law: &[f64]) -> f64 {
    let n = law.len() as f64;
    let mean = law.iter().sum::<f64>() / n;
    (n * mean.ln() - law.iter().map(|v| v.ln()).sum::<f64>())
        .max(0.0)
        .sqrt()
}

/// d' of noise of variance `shared` common to channels of these white variances.
#[must_use]
pub fn of_common(whites: &[f64], shared: f64, samples: usize) -> f64 {
    // det(D + c 11^T) = det D (1 + c sum 1/d).
    let own: f64 = whites.iter().map(|w| (w + shared).ln()).sum();
    let joint: f64 = whites.iter().map(|w| w.ln()).sum::<f64>()
        + (1.0 + shared * whites.iter().map(|w| 1.0 / w).sum::<f64>()).ln();
    (samples as f64 * (own - joint)).max(0.0).sqrt()
}

/// The size at which a strength, growing with size, reaches `wanted`.
#[must_use]
pub fn size_for(wanted: f64, strength: &dyn Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (-18.0f64, 8.0f64);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if strength(middle.exp()) < wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    (0.5 * (low + high)).exp()
}
