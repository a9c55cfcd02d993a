//! Stationary terms of the noise, by their density.

use std::sync::Arc;

/// Frequencies at which a density is wanted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frequencies {
    /// Angular frequency, rad per sample.
    pub omega: Vec<f64>,
    /// Its cosine.
    pub cosine: Vec<f64>,
    /// How wide the place is that each stands for, rad per sample: empty where it is itself.
    pub width: Vec<f64>,
}

impl Frequencies {
    /// Angular frequencies, each itself.
    #[must_use]
    pub fn at(omega: Vec<f64>) -> Self {
        let cosine = omega.iter().map(|w| w.cos()).collect();
        let width = vec![];
        Self {
            omega,
            cosine,
            width,
        }
    }

    /// Density of an AR(1) process of variance `variance` and pole `p`.
    #[must_use]
    pub fn one_pole(&self, variance: f64, p: f64) -> Vec<f64> {
        let (top, bottom) = (variance * (1.0 - p * p), 1.0 + p * p);
        self.cosine
            .iter()
            .map(|c| top / (bottom - 2.0 * p * c))
            .collect()
    }
}

/// A peak in a spectrum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// Angular frequency of its middle, rad per sample.
    pub omega: f64,
    /// Half its width at half its height, rad per sample.
    pub half_width: f64,
    /// Its variance over the white one.
    pub variance: f64,
}

/// A stationary process added to the noise, or a filter on it.
pub trait Covariance: Send + Sync {
    /// Names of the shape's coordinates; they are optimised unconstrained within [`Covariance::bounds`].
    fn dimensions(&self) -> usize;
    /// Contribution at each frequency, in units of the white variance.
    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64>;
    /// Derivatives of the density by each coordinate, where they are known.
    fn slopes(&self, _theta: &[f64], _at: &Frequencies) -> Option<Vec<Vec<f64>>> {
        None
    }
    /// Whether coordinates are of the kind that its name means; one of fewer of them, or none, is told instead.
    fn claims(&self, _theta: &[f64]) -> bool {
        true
    }
    /// Whether the density replaces the white noise (a filter) instead of adding to it.
    fn filters_white(&self) -> bool {
        false
    }
    /// Whether its noise is Gaussian; else its own simulation says what its distribution is.
    fn is_normal(&self) -> bool {
        true
    }
    /// Excess kurtosis of its values at the law that its name says.
    fn excess_kurtosis(&self) -> f64 {
        0.0
    }
    /// Parameters that say which of the effect's processes it is.
    fn fixed(&self) -> Vec<(&'static str, f64, &'static str)> {
        vec![]
    }
    /// The same as first-order processes, each its variance in units of the white variance and its pole, of `samples` samples;
    /// none where it is no sum of such.
    fn poles(&self, _theta: &[f64], _samples: usize) -> Option<Vec<(f64, f64)>> {
        None
    }
    /// Lower and upper bound of each coordinate, for `samples` samples.
    fn bounds(&self, samples: usize) -> Vec<(f64, f64)>;
    /// Where to start the search from.
    fn starts(&self, samples: usize) -> Vec<Vec<f64>>;
    /// Points of which the best is where the search starts, in the place of the starts: of a term whose likelihood has many tops.
    fn grid(&self) -> Vec<Vec<f64>> {
        vec![]
    }
    /// The same term with its coordinates measured from a peak of the spectrum, in widths of it, and where it starts from
    /// there: of a term that stands at one frequency, which has to be sought in the data.
    fn about(&self, _peak: &Peak) -> Option<(Arc<dyn Covariance>, Vec<f64>)> {
        None
    }
    /// The same term at one lag, samples, and where it starts from where readings correlate by so much there: of a term that stands
    /// at a lag, which has to be sought in the data.
    fn at_lag(&self, _lag: usize, _correlation: f64) -> Option<(Arc<dyn Covariance>, Vec<f64>)> {
        None
    }
    /// The lag at which such a term stands, samples, and the correlation that it makes there of white noise.
    fn lag(&self, _theta: &[f64]) -> Option<(usize, f64)> {
        None
    }
    /// Other shapes of such a term at the same place, with the same coordinates.
    fn variants(&self) -> Vec<Arc<dyn Covariance>> {
        vec![]
    }
    /// Whether it is such a term.
    fn is_peak(&self) -> bool {
        false
    }
    /// The peak that such a term is.
    fn peak(&self, _theta: &[f64]) -> Option<Peak> {
        None
    }
    /// Coordinates with their standard errors as [`Effect::describe`] takes them.
    fn described(&self, coordinates: &[(f64, f64)]) -> Vec<(f64, f64)> {
        coordinates.to_vec()
    }
}
