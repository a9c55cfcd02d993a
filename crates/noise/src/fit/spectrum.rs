//! A record in the DCT-II domain, binned, and what each noise term contributes there.

use std::ops::Range;

use numerics::transform::Dct;

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
        let longest = runs
            .iter()
            .map(ExactSizeIterator::len)
            .max()
            .unwrap_or(0)
            .max(2);
        let mut bins = Bins::new(longest);
        for run in runs {
            bins.add_run(values, run, tau0, 0.0);
        }
        bins.finish(tau0, runs.iter().map(ExactSizeIterator::len).sum())
    }

    /// Of a record with gaps, bridged at low frequency.
    ///
    /// Above a frequency set by the gaps the coefficients are those of the runs, as in [`Spectrum::of`]. Below it they are
    /// those of the means over blocks of so many slots of the grid (over the samples that are there, `slots` being their
    /// places), with the variance that each term has in such means: aliases are summed, and white noise has the mean of
    /// 1/samples. So the slow terms see the whole length of the record, and nothing is filled in. Blocks that are less
    /// than half as full as the record part it.
    #[must_use]
    pub fn with_gaps(values: &[f64], runs: &[Range<usize>], slots: &[u64], tau0: f64) -> Self {
        if runs.len() < 2 {
            return Self::of(values, runs, tau0);
        }
        let stretches = crate::allan::segments(runs, slots);
        let candidates: Vec<(usize, Vec<BlockRun>)> = BLOCK_SIZES
            .into_iter()
            .map(|size| (size, block_runs(values, &stretches, slots, tau0, size)))
            .collect();
        let reach = |(size, blocks): &(usize, Vec<BlockRun>)| {
            size * blocks.iter().map(|b| b.means.len()).max().unwrap_or(0)
        };
        let longest_run = runs.iter().map(ExactSizeIterator::len).max().unwrap_or(0);
        let best = candidates.iter().map(reach).max().unwrap_or(0);
        let Some((size, blocks)) = candidates
            .iter()
            .find(|c| reach(c) * 10 >= best * 9 && reach(c) > longest_run && reach(c) >= 64 * c.0)
        else {
            return Self::of(values, runs, tau0);
        };
        let top = std::f64::consts::PI;
        let limit = top * PASSED / *size as f64;
        let mut bins = Bins::new(size * best.div_ceil(*size));
        for run in runs {
            bins.add_run(values, run, tau0, limit);
        }
        for run in blocks {
            let n = run.means.len() as f64;
            let dct = Dct::new(run.means.len());
            let scale = (*size as f64).sqrt();
            let (c, r) = (dct.forward(&run.means), dct.forward(&run.times));
            for k in 1..run.means.len() {
                let w = top * k as f64 / n / *size as f64;
                if w >= limit {
                    break;
                }
                let shape = block_shape(w, *size, run.inverse_counts);
                bins.add(w, top / n / *size as f64, c[k] * scale, r[k] * scale, shape);
            }
        }
        bins.finish(tau0, runs.iter().map(ExactSizeIterator::len).sum())
    }

    /// Several records of the same noise at the same rate as one: each keeps its own constant.
    #[must_use]
    pub fn together(spectra: &[Self]) -> Self {
        let mut bins: Vec<Bin> = spectra
            .iter()
            .flat_map(|s| s.bins.iter().copied())
            .collect();
        bins.sort_by(|a, b| a.w.total_cmp(&b.w));
        Self {
            tau0: spectra.first().map_or(0.0, |s| s.tau0),
            samples: spectra.iter().map(|s| s.samples).sum(),
            bins,
        }
    }

    /// Coefficients that it is made of: fewer than the samples where these lie in short runs.
    #[must_use]
    pub fn coefficients(&self) -> f64 {
        self.bins.iter().map(|b| b.count).sum()
    }

    /// The part below the angular frequency `limit` per sample.
    #[must_use]
    pub fn below(&self, limit: f64) -> Self {
        let mut out = self.clone();
        out.bins.retain(|b| b.w < limit);
        out
    }

    /// Variance of the coefficients of a bin.
    #[inline]
    #[must_use]
    pub fn variance(bin: &Bin, c: &Coefficients) -> f64 {
        bin.shape.iter().zip(c).map(|(s, c)| s * c).sum()
    }

    /// Variance of a coefficient at the angular frequency `w` per sample, 0 < w ≤ π.
    #[must_use]
    pub fn variance_at(w: f64, c: &Coefficients) -> f64 {
        Term::ALL.iter().zip(c).map(|(t, c)| t.shape(w) * c).sum()
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

/// Sizes of blocks tried, in slots.
const BLOCK_SIZES: [usize; 7] = [8, 16, 32, 64, 128, 256, 512];
/// Part of the frequencies of block means that is used: near their Nyquist frequency the aliases grow.
const PASSED: f64 = 0.25;

/// Means over neighbouring blocks of slots.
struct BlockRun {
    means: Vec<f64>,
    /// Of their centres, s.
    times: Vec<f64>,
    /// Mean of 1/samples.
    inverse_counts: f64,
}

fn block_runs(
    values: &[f64],
    stretches: &[Vec<Range<usize>>],
    slots: &[u64],
    tau0: f64,
    size: usize,
) -> Vec<BlockRun> {
    let mut out = Vec::new();
    for rows in stretches {
        let (first, last) = (rows[0].start, rows[rows.len() - 1].end - 1);
        let length = (slots[last] - slots[first]) as usize + 1;
        let present: usize = rows.iter().map(ExactSizeIterator::len).sum();
        let needed = (0.5 * size as f64 * present as f64 / length as f64).max(1.0);
        let mut sums = vec![(0.0, 0u32); length / size];
        for row in rows.iter().cloned().flatten() {
            if let Some(block) = sums.get_mut((slots[row] - slots[first]) as usize / size) {
                block.0 += values[row];
                block.1 += 1;
            }
        }
        let full: Vec<bool> = sums.iter().map(|b| f64::from(b.1) >= needed).collect();
        let mut at = 0;
        for part in full.chunk_by(|a, b| a == b) {
            let blocks = &sums[at..at + part.len()];
            at += part.len();
            if part[0] && part.len() > 1 {
                let n = blocks.len() as f64;
                out.push(BlockRun {
                    means: blocks.iter().map(|b| b.0 / f64::from(b.1)).collect(),
                    times: (0..blocks.len())
                        .map(|i| (i as f64 - (n - 1.0) / 2.0) * tau0 * size as f64)
                        .collect(),
                    inverse_counts: blocks.iter().map(|b| 1.0 / f64::from(b.1)).sum::<f64>() / n,
                });
            }
        }
    }
    out
}

/// Variance of √size times a coefficient of block means, at the frequency `w` per sample, for unit coefficients.
fn block_shape(w: f64, size: usize, inverse_counts: f64) -> [f64; 4] {
    let top = std::f64::consts::TAU;
    let l = size as f64;
    let mut shape = [0.0; 4];
    for j in 0..size {
        let alias = w + top * j as f64 / l;
        let mean = ((l * alias / 2.0).sin() / (l * (alias / 2.0).sin())).powi(2);
        let folded = alias.min(top - alias);
        for (s, term) in shape.iter_mut().zip(Term::ALL) {
            *s += mean * term.shape(folded);
        }
    }
    // The white part sums to 1 over a full block.
    shape[Term::White as usize] = l * inverse_counts;
    shape
}

/// Bins of a spectrum while it is made, from the highest frequency down.
struct Bins {
    bins: Vec<Bin>,
}

impl Bins {
    fn index(w: f64) -> usize {
        ((std::f64::consts::PI / w).ln() * BINS_PER_LN) as usize
    }

    fn new(longest: usize) -> Self {
        let lowest = std::f64::consts::PI / longest as f64;
        Self {
            // One more: rounding must not lose the lowest.
            bins: vec![Bin::default(); Self::index(lowest) + 2],
        }
    }

    fn add(&mut self, w: f64, width: f64, c: f64, r: f64, shape: [f64; 4]) {
        let bin = &mut self.bins[Self::index(w)];
        bin.w += w;
        bin.width += width;
        bin.count += 1.0;
        bin.cc += c * c;
        bin.cr += c * r;
        bin.rr += r * r;
        for (sum, s) in bin.shape.iter_mut().zip(shape) {
            *sum += s;
        }
    }

    /// The coefficients of a run, but for the constant and those below `lowest`.
    fn add_run(&mut self, values: &[f64], run: &Range<usize>, tau0: f64, lowest: f64) {
        if run.len() < 2 {
            return;
        }
        let n = run.len() as f64;
        let dct = Dct::new(run.len());
        let c = dct.forward(&values[run.clone()]);
        let times: Vec<f64> = (0..run.len())
            .map(|i| (i as f64 - (n - 1.0) / 2.0) * tau0)
            .collect();
        let r = dct.forward(&times);
        for k in 1..run.len() {
            let w = std::f64::consts::PI * k as f64 / n;
            if w >= lowest {
                let shape = Term::ALL.map(|t| t.shape(w));
                self.add(w, std::f64::consts::PI / n, c[k], r[k], shape);
            }
        }
    }

    fn finish(self, tau0: f64, samples: usize) -> Spectrum {
        let mut bins = self.bins;
        bins.retain(|b| b.count > 0.0);
        bins.reverse();
        for bin in &mut bins {
            bin.w /= bin.count;
            bin.shape = bin.shape.map(|s| s / bin.count);
        }
        Spectrum {
            tau0,
            samples,
            bins,
        }
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
