//! A channel that was searched: its model, residuals and what was asked of them.

use model::effect::Found;

use crate::fit::channel::{Joint, State, VarianceLaws};
use crate::ingest::types::Target;
use crate::result::{Check, DetectionLimit};
use crate::search::Search;
use crate::test_level::Outcome;

/// One gyro, searched.
pub(crate) struct Searched<'a> {
    pub target: &'a Target,
    pub search: Search<'a>,
    pub baseline: State,
    pub state: State,
    pub found: Vec<Found>,
    /// Whitened residual in time.
    pub e: Vec<f64>,
    /// Whitened coefficients.
    pub u: Vec<f64>,
    /// The same of what was read alone, where readings are lost.
    pub told: Option<Vec<f64>>,
    /// Omnibus checks, before and after.
    pub checks: Vec<Check>,
    /// The laws of the variance that were found.
    pub variance: VarianceLaws,
    /// The estimate of all parameters under them.
    pub joint: Option<Joint>,
    /// Smallest sizes that the search would have named, whether it did or not.
    pub limits: Vec<DetectionLimit>,
    /// Effects that follow a channel, and whether by the law that their name claims.
    pub laws: Vec<(&'static str, Outcome)>,
}

impl Searched<'_> {
    /// Whitened coefficients of what was read, and the part of them that are free.
    pub(crate) fn told(&self) -> (&[f64], f64) {
        match &self.told {
            Some(told) => (told, self.search.read),
            None => (&self.u, 1.0),
        }
    }

    /// Step of the readings over the standard deviation of what the model leaves.
    pub(crate) fn step(&self) -> f64 {
        let (bins, state) = (&self.search.panel.bins, &self.state);
        // Where a filter passes little, what the model leaves is rounding.
        let part = state.noise.filter().map_or(1.0, |filter| {
            let over = filter.over(bins).into_iter().zip(bins.counts());
            over.map(|(g, count)| count / g).sum::<f64>() / (bins.n as f64 - 1.0)
        });
        self.target.step * (part / state.solution.white).sqrt()
    }
}
