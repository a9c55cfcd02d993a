//! The shape of the noise over bins of coefficients in which it hardly changes: finer than elsewhere about a peak.

use std::f64::consts::PI;
use std::sync::{Arc, OnceLock};

use model::effect::{Covariance, Frequencies, Peak};

use numerics::column::{Column, add_sums};
use numerics::log_product::sum_of_logs;

/// Bins of single coefficients at the low end.
const SINGLE: usize = 256;
/// Coefficients of each column that a processor has at hand while several are multiplied.
const AT_HAND: usize = 1 << 13;
/// Width of the other bins over their frequency.
const WIDTH: f64 = 0.01;

/// Bins in half a width of a peak, and in the way from its middle to any place beside it: over one of them a Lorentzian
/// changes by a quarter at most, and its mean is that in the middle to some thousandths.
const IN_A_PEAK: f64 = 6.0;
const BESIDE_A_PEAK: f64 = 8.0;

/// The bins of a length.
#[derive(Clone, Debug)]
pub struct Bins {
    /// Samples.
    pub n: usize,
    /// Whether they are those of every record of this length.
    pub(crate) plain: bool,
    /// First coefficient of each bin, and the end.
    start: Vec<usize>,
    counts: Vec<f64>,
    /// Middle of each bin.
    pub at: Frequencies,
    /// Random-walk shape 1 / (2 - 2 cos w).
    walk: Vec<f64>,
    /// Frequencies and random-walk shape at every coefficient, that of k = 0 in the place of which k = 1 stands, each once
    /// it is asked for, and the same for all bins of a length.
    fine: Arc<OnceLock<Frequencies>>,
    walks: Arc<OnceLock<Vec<f64>>>,
}

fn walk_shape(omega: f64) -> f64 {
    1.0 / (4.0 * (omega / 2.0).sin().powi(2))
}

impl Bins {
    /// Bins for `n` samples.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self::about(n, &[])
    }

    /// Bins for `n` samples of a noise that has these peaks.
    #[must_use]
    pub fn about(n: usize, peaks: &[Peak]) -> Self {
        let to_k = n as f64 / PI;
        // Next to a peak a bin may end within it, however far off it begins.
        let widest = |k: f64| {
            let beside = peaks.iter().map(|p| {
                let (middle, half) = (p.omega * to_k, p.half_width * to_k);
                let ahead = (k - middle).max((middle - k) / (1.0 + BESIDE_A_PEAK.recip()));
                (half / IN_A_PEAK).max(ahead / BESIDE_A_PEAK)
            });
            beside.fold(k * WIDTH, f64::min)
        };
        let mut start = vec![];
        let mut k = 1;
        while k < n {
            start.push(k);
            k += if k < SINGLE {
                1
            } else {
                (widest(k as f64) as usize).max(1)
            };
        }
        start.push(n);
        let omega: Vec<f64> = start
            .windows(2)
            .map(|w| PI * (w[0] + w[1] - 1) as f64 / 2.0 / n as f64)
            .collect();
        let walk = omega.iter().map(|w| walk_shape(*w)).collect();
        let counts: Vec<f64> = start.windows(2).map(|w| (w[1] - w[0]) as f64).collect();
        let at = Frequencies {
            width: counts.iter().map(|c| c / to_k).collect(),
            ..Frequencies::at(omega)
        };
        Self {
            n,
            plain: peaks.is_empty(),
            start,
            counts,
            at,
            walk,
            fine: Arc::default(),
            walks: Arc::default(),
        }
    }

    /// As [`Bins::about`], of the length of these.
    pub(crate) fn finer_about(&self, peaks: &[Peak]) -> Self {
        Self {
            fine: Arc::clone(&self.fine),
            walks: Arc::clone(&self.walks),
            ..Self::about(self.n, peaks)
        }
    }

    fn angles(&self) -> impl Iterator<Item = f64> {
        (0..self.n).map(|k| PI * k.max(1) as f64 / self.n as f64)
    }

    fn fine(&self) -> &Frequencies {
        self.fine
            .get_or_init(|| Frequencies::at(self.angles().collect()))
    }

    /// Random-walk shape 1 / (2 - 2 cos w) at every coefficient.
    pub(crate) fn walks(&self) -> &[f64] {
        self.walks
            .get_or_init(|| self.angles().map(walk_shape).collect())
    }

    /// Coefficients in each bin.
    pub(crate) fn counts(&self) -> &[f64] {
        &self.counts
    }

    /// Coefficients in the bin of an angular frequency.
    pub(crate) fn width_at(&self, omega: f64) -> f64 {
        let k = (omega * self.n as f64 / PI) as usize;
        let bin = self.start.partition_point(|start| *start <= k);
        let last = self.counts.len() - 1;
        self.counts[bin.saturating_sub(1).min(last)]
    }

    /// Sum of ln g over the coefficients, of g over the bins.
    pub(crate) fn log_det(&self, g: &[f64]) -> f64 {
        sum_of_logs(&self.counts, g)
    }

    /// Numbers over the bins, each at every coefficient of its bin, and 0 at k = 0.
    pub(crate) fn spread(&self, over: &[f64]) -> Vec<f64> {
        let mut at = vec![0.0; self.n];
        for (bin, v) in self.start.windows(2).zip(over) {
            at[bin[0]..bin[1]].fill(*v);
        }
        at
    }

    /// Sums of a[k] b[k] over each bin.
    #[must_use]
    pub fn products(&self, a: &[f64], b: &[f64]) -> Vec<f64> {
        let mut sums = Vec::with_capacity(self.counts.len());
        add_sums(&self.start, a, b, &mut sums);
        sums
    }

    /// The same of pairs of columns. A column of several pairs is read once.
    pub(crate) fn products_of(&self, pairs: &[[&Column; 2]]) -> Vec<Vec<f64>> {
        let mut all: Vec<Vec<f64>> = (pairs.iter())
            .map(|_| Vec::with_capacity(self.counts.len()))
            .collect();
        let mut rest = self.start.as_slice();
        while rest.len() > 1 {
            let at_hand = |k: &&usize| **k <= rest[0] + AT_HAND;
            let bins = rest[1..].iter().take_while(at_hand).count().max(1);
            for ([a, b], sums) in pairs.iter().zip(&mut all) {
                a.add_sums(b, &rest[..=bins], sums);
            }
            rest = &rest[bins..];
        }
        all
    }
}

/// An angular frequency, rad per sample, that every filter passes as the slowest.
const SLOWEST: f64 = 1e-4;
/// What a filter passes at most, over the mean, of a frequency that it stops.
const STOPPED: f64 = 0.01;

/// The shape of the noise: everything but its white variance.
#[derive(Clone)]
pub struct Noise {
    /// ln of the random walk's step variance over the white variance.
    pub log_walk: f64,
    /// Stationary terms with their coordinates.
    pub terms: Vec<(Arc<dyn Covariance>, Vec<f64>)>,
}

impl Noise {
    /// White noise and a random walk.
    #[must_use]
    pub fn new(log_walk: f64) -> Self {
        Self {
            log_walk,
            terms: vec![],
        }
    }

    /// The filter that the white noise goes through, where there is one.
    pub(crate) fn filter(&self) -> Option<Self> {
        let filters = self.terms.iter().filter(|t| t.0.filters_white());
        let terms: Vec<_> = filters.cloned().collect();
        (!terms.is_empty()).then_some(Self {
            log_walk: f64::NEG_INFINITY,
            terms,
        })
    }

    /// Samples over which the ends of a record are felt behind its filter: what came before is not known, and rings at a frequency
    /// that the filter stops. About the first zero of a mean of n readings the density is n^3 / 4 times the square of the distance.
    pub(crate) fn settles(&self, bins: &Bins) -> f64 {
        let Some(filter) = self.filter() else {
            return 0.0;
        };
        let deepest = filter.over(bins).into_iter().fold(f64::INFINITY, f64::min);
        if deepest > STOPPED {
            return 0.0;
        }
        (filter.at(SLOWEST).powi(3) / (4.0 * deepest)).sqrt()
    }

    /// The peaks that its terms are.
    #[must_use]
    pub fn peaks(&self) -> Vec<Peak> {
        let all = self.terms.iter();
        all.filter_map(|(term, theta)| term.peak(theta)).collect()
    }

    fn shape(&self, at: &Frequencies, walk: &[f64]) -> Vec<f64> {
        let lambda = self.log_walk.exp();
        let mut g: Vec<f64> = walk.iter().map(|w| lambda * w).collect();
        let mut white = None;
        for (term, theta) in &self.terms {
            let density = term.density(theta, at);
            if term.filters_white() {
                white = Some(density);
            } else {
                g.iter_mut().zip(density).for_each(|(g, d)| *g += d);
            }
        }
        match white {
            Some(w) => g.iter_mut().zip(w).for_each(|(g, w)| *g += w),
            None => g.iter_mut().for_each(|g| *g += 1.0),
        }
        g
    }

    /// g over the bins.
    #[must_use]
    pub fn over(&self, bins: &Bins) -> Vec<f64> {
        self.shape(&bins.at, &bins.walk)
    }

    /// g over the bins with any random walk in the place of its own, by ln of the step variance over the white one: what else
    /// there is of it is made once.
    pub(crate) fn with_walks<'a>(&self, bins: &'a Bins) -> impl Fn(f64) -> Vec<f64> + 'a {
        let still = Self {
            log_walk: f64::NEG_INFINITY,
            terms: self.terms.clone(),
        };
        let still = still.over(bins);
        move |log_walk| {
            let lambda = log_walk.exp();
            let all = still.iter().zip(&bins.walk);
            all.map(|(g, walk)| g + lambda * walk).collect()
        }
    }

    /// g at every coefficient k = 0..n; that of k = 0, which no likelihood uses, is infinite.
    #[must_use]
    pub fn everywhere(&self, bins: &Bins) -> Vec<f64> {
        self.first(bins, bins.n)
    }

    /// g at the first `count` coefficients; as [`Noise::everywhere`].
    #[must_use]
    pub fn first(&self, bins: &Bins, count: usize) -> Vec<f64> {
        let walk = &bins.walks()[..count];
        let mut g = if self.terms.is_empty() {
            // Where there is no density no frequency is asked for.
            self.shape(&Frequencies::default(), walk)
        } else if count < bins.n {
            let at = bins.fine();
            let few = Frequencies {
                omega: at.omega[..count].to_vec(),
                cosine: at.cosine[..count].to_vec(),
                width: vec![],
            };
            self.shape(&few, walk)
        } else {
            self.shape(bins.fine(), walk)
        };
        if let Some(first) = g.first_mut() {
            *first = f64::INFINITY;
        }
        g
    }

    /// g at one angular frequency, rad per sample.
    #[must_use]
    pub fn at(&self, omega: f64) -> f64 {
        self.through([omega])[0]
    }

    /// g at angular frequencies, rad per sample.
    #[must_use]
    pub fn through(&self, omega: impl IntoIterator<Item = f64>) -> Vec<f64> {
        let omega: Vec<f64> = omega.into_iter().collect();
        let walk: Vec<f64> = omega.iter().map(|w| walk_shape(*w)).collect();
        self.shape(&Frequencies::at(omega), &walk)
    }
}

/// Lower bound of `log_walk`: a random walk that changes no coefficient by a thousandth.
#[must_use]
pub fn least_walk(n: usize) -> f64 {
    (1e-3 * (PI / n as f64).powi(2)).ln()
}
