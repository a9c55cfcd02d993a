//! A record in the DCT-II domain, binned, and what each noise term contributes there.

use std::ops::Range;

use crate::likelihood::Dct;

/// Noise terms with a variance of their own. The rate ramp is a mean, not a variance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Term {
    /// N, angle random walk.
    White,
    /// B, bias instability.
    Flicker,
    /// K, rate random walk.
    RandomWalk,
    /// Q, quantization noise of the angle.
    Quantization,
}

impl Term {
    /// All, in the order of the coefficient arrays.
    pub const ALL: [Self; 4] = [
        Self::White,
        Self::Flicker,
        Self::RandomWalk,
        Self::Quantization,
    ];

    /// Variance of the coefficient at w = πk/N for a unit coefficient: s², B², q, Q²/τ₀².
    fn shape(self, w: f64) -> f64 {
        let laplacian = 2.0 - 2.0 * w.cos();
        match self {
            Self::White => 1.0,
            // Two-sided density B²/(2πf) of IEEE Std 952 at f = w/(2πτ₀), over τ₀.
            Self::Flicker => 1.0 / w,
            Self::RandomWalk => 1.0 / laplacian,
            Self::Quantization => laplacian,
        }
    }

    /// From the coefficient (a variance) to the letter of IEEE Std 952: N, B, K, Q.
    #[must_use]
    pub fn letter(self, coefficient: f64, tau0: f64) -> f64 {
        match self {
            Self::White => (coefficient * tau0).sqrt(),
            Self::Flicker => coefficient.sqrt(),
            Self::RandomWalk => (coefficient / tau0).sqrt(),
            Self::Quantization => coefficient.sqrt() * tau0,
        }
    }

    /// Back.
    #[must_use]
    pub fn coefficient(self, letter: f64, tau0: f64) -> f64 {
        match self {
            Self::White => letter * letter / tau0,
            Self::Flicker => letter * letter,
            Self::RandomWalk => letter * letter * tau0,
            Self::Quantization => (letter / tau0).powi(2),
        }
    }
}

/// Coefficients of the four terms, in the order of [`Term::ALL`].
pub type Coefficients = [f64; 4];

/// Squared DCT-II coefficients of all runs, in narrow bins of frequency.
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// Sample interval, s.
    pub tau0: f64,
    /// Samples in the runs.
    pub samples: usize,
    /// Bins, ascending.
    pub bins: Vec<Bin>,
}

/// Coefficients so close to each other that their variances are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bin {
    /// Mean angular frequency per sample, 0..π.
    pub w: f64,
    /// Its width.
    pub width: f64,
    /// Coefficients in it.
    pub count: f64,
    /// Σ c².
    pub cc: f64,
    /// Σ c·r, r the DCT of time in s.
    pub cr: f64,
    /// Σ r².
    pub rr: f64,
    /// Mean shape of each term.
    pub shape: [f64; 4],
}

/// Bins per unit of ln w: the variance moves by 3 % within a bin of a random walk. The lowest coefficients get one each.
const BINS_PER_LN: f64 = 64.0;

impl Spectrum {
    /// Of the readings `values` in `runs` without gaps. Each run has its own free constant (its coefficient 0 is left
    /// out), so nothing has to be known about what happened in a gap.
    #[must_use]
    pub fn of(values: &[f64], runs: &[Range<usize>], tau0: f64) -> Self {
        let top = std::f64::consts::PI;
        let longest = runs
            .iter()
            .map(ExactSizeIterator::len)
            .max()
            .unwrap_or(0)
            .max(2) as f64;
        let index = |w: f64| ((top / w).ln() * BINS_PER_LN) as usize;
        let mut bins = vec![Bin::default(); index(top / longest) + 1];
        for run in runs.iter().filter(|r| r.len() > 1) {
            let n = run.len() as f64;
            let dct = Dct::new(run.len());
            let c = dct.forward(&values[run.clone()]);
            let times: Vec<f64> = (0..run.len())
                .map(|i| (i as f64 - (n - 1.0) / 2.0) * tau0)
                .collect();
            let r = dct.forward(&times);
            for k in 1..run.len() {
                let w = top * k as f64 / n;
                let bin = &mut bins[index(w)];
                bin.w += w;
                bin.width += top / n;
                bin.count += 1.0;
                bin.cc += c[k] * c[k];
                bin.cr += c[k] * r[k];
                bin.rr += r[k] * r[k];
                for (s, term) in bin.shape.iter_mut().zip(Term::ALL) {
                    *s += term.shape(w);
                }
            }
        }
        bins.retain(|b| b.count > 0.0);
        bins.reverse();
        for bin in &mut bins {
            bin.w /= bin.count;
            bin.shape = bin.shape.map(|s| s / bin.count);
        }
        Self {
            tau0,
            samples: runs.iter().map(ExactSizeIterator::len).sum(),
            bins,
        }
    }

    /// Variance of the coefficients of a bin.
    #[inline]
    #[must_use]
    pub fn variance(bin: &Bin, c: &Coefficients) -> f64 {
        bin.shape.iter().zip(c).map(|(s, c)| s * c).sum()
    }

    /// Weights of the bins in the Allan variance at `m`: σ²(mτ₀) = Σ weight · Σ c² / N, by the transfer function
    /// 2 sin⁴(mw/2)/(m sin(w/2))², averaged over a bin that holds more than a period of it.
    #[must_use]
    pub fn allan_weights(&self, m: usize) -> Vec<f64> {
        let mf = m as f64;
        self.bins
            .iter()
            .map(|b| {
                let half = mf * b.w / 2.0;
                // Mean of sin⁴ over the bin: 3/8 − cos(2·half)/2·sinc + cos(4·half)/8·sinc.
                let spread = if b.count > 1.0 {
                    mf * b.width / 2.0
                } else {
                    0.0
                };
                let sinc = |x: f64| if x.abs() < 1e-9 { 1.0 } else { x.sin() / x };
                let sin4 = 0.375 - 0.5 * (2.0 * half).cos() * sinc(spread)
                    + 0.125 * (4.0 * half).cos() * sinc(2.0 * spread);
                2.0 * sin4 / (mf * (b.w / 2.0).sin()).powi(2) / self.samples as f64
            })
            .collect()
    }
}

/// Allan variance that the terms have together at τ, U² (IEEE Std 952, the limits of a fine sampling; white and random
/// walk exact for sampled sums).
#[must_use]
pub fn model_allan_variance(c: &Coefficients, rate_ramp: f64, tau0: f64, m: usize) -> f64 {
    let (mf, tau) = (m as f64, m as f64 * tau0);
    let [white, flicker, walk, quantization] = *c;
    white / mf
        + flicker * flicker_allan(mf)
        + walk * (2.0 * mf * mf + 1.0) / (6.0 * mf)
        + 3.0 * quantization / (mf * mf)
        + (rate_ramp * tau).powi(2) / 2.0
}

/// σ²/B² of sampled flicker at m. With many samples in a cluster 2 ln 2/π; a small m lacks what lies above the Nyquist
/// frequency.
fn flicker_allan(m: f64) -> f64 {
    let limit = 2.0 * std::f64::consts::LN_2 / std::f64::consts::PI;
    if m > FINE as f64 {
        return limit;
    }
    static FINE_TABLE: std::sync::OnceLock<Vec<f64>> = std::sync::OnceLock::new();
    let table = FINE_TABLE.get_or_init(|| (0..=FINE).map(|m| sampled_flicker(m.max(1))).collect());
    table.get(m as usize).copied().unwrap_or(limit)
}

/// Samples in a cluster beyond which flicker is taken as continuous: 2 ln 2/π holds within 1e-3.
const FINE: usize = 64;

/// (1/π) ∫ 2 sin⁴(mw/2)/(m sin(w/2))² dw/w over 0..π, midpoint rule.
fn sampled_flicker(m: usize) -> f64 {
    let steps = 64 * m + 256;
    let m = m as f64;
    let dw = std::f64::consts::PI / steps as f64;
    (0..steps)
        .map(|i| {
            let w = (i as f64 + 0.5) * dw;
            2.0 * (m * w / 2.0).sin().powi(4) / (m * (w / 2.0).sin()).powi(2) / w
        })
        .sum::<f64>()
        * dw
        / std::f64::consts::PI
}
