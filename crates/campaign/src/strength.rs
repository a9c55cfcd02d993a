//! How strong an effect is: d', the square root of twice the expected log likelihood ratio, the random walk refitted
//! under the baseline, so that what a random walk can hide does not count.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use diagnosis::likelihood::{Bins, Dct, least_walk};
use numerics::minimise::golden;
pub use numerics::minimise::size_for;

use crate::series::{add_at, each, each_pair, mean};
use crate::stand::Stand;

/// Random walks that are tried first, and the largest of them.
const WALKS: usize = 24;
const MOST_WALK: f64 = 2.0;
/// Sizes of a process beside another one that are tried, of its own.
const RESIZED: (f64, f64) = (0.1, 10.0);

/// What a length is made of, whatever its noise.
struct Length {
    dct: Dct,
    bins: Bins,
    count: Vec<f64>,
    walk: Vec<f64>,
    /// Random walks to try, with 1/g over the bins and the sum of ln g.
    tried: Vec<(f64, Vec<f64>, f64)>,
}

impl Length {
    fn new(n: usize) -> Self {
        let bins = Bins::new(n);
        let ones = vec![1.0; n];
        let count = bins.products(&ones, &ones);
        let walk = each(&bins.at.omega, |w| 1.0 / (4.0 * (w / 2.0).sin().powi(2)));
        let low = least_walk(n);
        let tried = |i| {
            let x = low + (MOST_WALK - low) * i as f64 / (WALKS - 1) as f64;
            let g = each(&walk, |w| 1.0 + x.exp() * w);
            let logs = g.iter().zip(&count).map(|(g, m)| m * g.ln()).sum();
            (x, each(&g, |g| 1.0 / g), logs)
        };
        Self {
            dct: Dct::new(n),
            tried: (0..WALKS).map(tried).collect(),
            bins,
            count,
            walk,
        }
    }

    /// That of `n` samples, made once on each thread.
    fn of(n: usize) -> Rc<Self> {
        thread_local! {
            static KNOWN: RefCell<HashMap<usize, Rc<Length>>> = RefCell::default();
        }
        let made = || Rc::new(Self::new(n));
        KNOWN.with(|k| Rc::clone(k.borrow_mut().entry(n).or_insert_with(made)))
    }
}

/// The spectrum that a channel of a stand has, on the bins of its length.
#[derive(Clone)]
pub struct Meter {
    length: Rc<Length>,
    /// Variance of a coefficient without the effect.
    clean: Vec<f64>,
    /// White variance, and over it what processes beside the effect add: the baseline has them too.
    white: f64,
    beside: Option<Vec<f64>>,
}

impl Meter {
    /// For an axis of a stand.
    #[must_use]
    pub fn new(stand: &Stand, axis: usize) -> Self {
        let length = Length::of(stand.samples());
        let (white, step) = (stand.white(axis), stand.step(axis));
        Self {
            clean: each(&length.walk, |w| white + step * w),
            length,
            white,
            beside: None,
        }
    }

    /// Angular frequencies of the bins, rad per sample.
    #[must_use]
    pub fn omega(&self) -> &[f64] {
        &self.length.bins.at.omega
    }

    /// The bins of its length.
    #[cfg(test)]
    pub(crate) fn bins(&self) -> &Bins {
        &self.length.bins
    }

    /// The same channel with a process beside its noise that adds `density` to the variance of each coefficient, and that is
    /// known: what it makes likelier is no strength of an effect beside it.
    #[must_use]
    pub fn over(&self, density: &[f64]) -> Self {
        let none = vec![0.0; density.len()];
        let before = self.beside.as_ref().unwrap_or(&none);
        let beside = each_pair(before, density, |b, d| b + d / self.white);
        Self {
            clean: each_pair(&self.clean, density, |c, d| c + d),
            beside: Some(beside),
            ..self.clone()
        }
    }

    /// Coefficients of each bin.
    #[must_use]
    pub fn counts(&self) -> &[f64] {
        &self.length.count
    }

    /// Expected energy in each bin where its coefficients have these variances.
    fn energies(&self, variances: &[f64]) -> Vec<f64> {
        each_pair(variances, &self.length.count, |v, m| m * v)
    }

    /// Expected energy of the noise in each bin.
    #[must_use]
    pub fn noise(&self) -> Vec<f64> {
        self.energies(&self.clean)
    }

    /// Minus twice the log likelihood of a spectrum of these variances under itself.
    fn under_itself(&self, variances: &[f64]) -> f64 {
        let bins = variances.iter().zip(&self.length.count);
        bins.map(|(v, m)| m * (1.0 + v.ln())).sum()
    }

    /// Energy of a signal in each bin.
    #[must_use]
    pub fn energy(&self, signal: &[f64]) -> Vec<f64> {
        let c = self.length.dct.forward(signal);
        self.length.bins.products(&c, &c)
    }

    /// What is left of a signal when the best multiples of others are taken off, in the metric of the noise.
    #[must_use]
    pub fn beyond(&self, signal: &[f64], others: &[Vec<f64>]) -> Vec<f64> {
        let weighted = |a: &[f64], b: &[f64]| -> f64 {
            let sums = self.length.bins.products(a, b);
            sums.iter().zip(&self.clean).map(|(s, v)| s / v).sum()
        };
        let mut c = self.length.dct.forward(signal);
        let mut basis: Vec<Vec<f64>> = vec![];
        for other in others {
            let mut x = self.length.dct.forward(other);
            for b in &basis {
                let share = weighted(&x, b);
                add_at(&mut x, 0, each(b, |b| -share * b));
            }
            let length = weighted(&x, &x).sqrt();
            if length > 1e-9 {
                x.iter_mut().for_each(|x| *x /= length);
                basis.push(x);
            }
        }
        for b in &basis {
            let share = weighted(&c, b);
            add_at(&mut c, 0, each(b, |b| -share * b));
        }
        c[0] = 0.0;
        self.length.dct.inverse(&c)
    }

    /// d' of a signal of known shape, by its energies.
    #[must_use]
    pub fn of_signal(&self, energy: &[f64]) -> f64 {
        let expected = each_pair(&self.noise(), energy, |n, e| n + e);
        self.against_baseline(&expected, self.under_itself(&self.clean))
    }

    /// The multiple of a signal of these energies that is `wanted` strong, and how strong it is.
    #[must_use]
    pub fn sized(&self, energy: &[f64], wanted: f64) -> (f64, f64) {
        let strength = |size: f64| self.of_signal(&each(energy, |e| e * size * size));
        let size = size_for(wanted, &strength);
        (size, strength(size))
    }

    /// d' of a process that adds `density` to the variance of each coefficient, or of a filter that shapes the white
    /// noise (then `density` is what the filter changes, negative where it takes off).
    #[must_use]
    pub fn of_density(&self, density: &[f64]) -> f64 {
        let with = each_pair(&self.clean, density, |v, d| (v + d).max(1e-9 * v));
        self.against_baseline(&self.energies(&with), self.under_itself(&with))
    }

    /// A strength beside processes whose size is fitted again too: what more or less of them explains does not count.
    #[must_use]
    pub fn beside_fitted(&self, strength: &dyn Fn(&Self) -> f64) -> f64 {
        if self.beside.is_none() {
            return strength(self);
        }
        let sized = |ln: f64| {
            let mut other = self.clone();
            let beside = other.beside.iter_mut().flatten();
            beside.for_each(|d| *d *= ln.exp());
            strength(&other)
        };
        let (least, most) = RESIZED;
        sized(golden(&sized, least.ln(), most.ln(), 20))
    }

    /// White noise and random walk refitted to expected energies, beside the processes that are known.
    fn against_baseline(&self, expected: &[f64], truth: f64) -> f64 {
        let n: f64 = self.length.count.iter().sum();
        let beside = self.beside.as_deref();
        let minus_two_l = |log_walk: f64| {
            let lambda = log_walk.exp();
            let (mut sum, mut logs) = (0.0, 0.0);
            let all = expected.iter().zip(&self.length.walk);
            for (b, ((e, w), m)) in all.zip(&self.length.count).enumerate() {
                let g = 1.0 + lambda * w + beside.map_or(0.0, |d| d[b]);
                sum += e / g;
                logs += m * g.ln();
            }
            n * (sum / n).ln() + logs + n
        };
        let tried = |(log_walk, weight, logs): &(f64, Vec<f64>, f64)| {
            if beside.is_some() {
                return minus_two_l(*log_walk);
            }
            let sum: f64 = expected.iter().zip(weight).map(|(e, w)| e * w).sum();
            n * (sum / n).ln() + logs + n
        };
        let all: Vec<f64> = self.length.tried.iter().map(tried).collect();
        let i = (0..WALKS)
            .min_by(|a, b| all[*a].total_cmp(&all[*b]))
            .unwrap_or(0);
        let (low, best) = (self.length.tried[0].0, self.length.tried[i].0);
        let x = golden(&minus_two_l, (best - 1.0).max(low), best + 1.0, 20);
        let l = minus_two_l(x).min(all[0]);
        (l - truth).max(0.0).sqrt()
    }
}

/// d' of a variance that changes in time, `law` its ratio to that at rest.
#[must_use]
pub fn of_variance(law: &[f64]) -> f64 {
    let logs: f64 = law.iter().map(|v| v.ln()).sum();
    let square = law.len() as f64 * mean(law).ln() - logs;
    square.max(0.0).sqrt()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Draw;
    use crate::stand::Needs;

    #[test]
    fn noise_of_four_times_the_variance_halves_a_strength_and_its_own_is_none() {
        let mut draw = Draw::of(5, 0, 0);
        let stand = Stand::draw(&mut draw, 600.0, 20.0, Needs::NONE);
        let meter = Meter::new(&stand, 0);
        let energy = meter.energy(&stand.series(|i| (1.3 * i as f64).sin()));
        let (size, alone) = meter.sized(&energy, 6.0);
        let energy = each(&energy, |e| size * size * e);
        let flat = vec![3.0 * stand.white(0); energy.len()];
        let loud = meter.over(&flat);
        // The random walk is lost in such noise, so that a little more than half is left of what it hid.
        let left = loud.of_signal(&energy) / alone;
        assert!((left - 0.5).abs() < 0.01, "{left}");
        let none = vec![0.0; energy.len()];
        assert!(loud.of_signal(&none) < 0.1, "{}", loud.of_signal(&none));
    }
}
