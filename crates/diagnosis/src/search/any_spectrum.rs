//! The search again beside a spectrum of no kind.
//!
//! Noise that the library has no law for hides what stands beside it: the search takes it for white, and its terms stand in for
//! the law that is missing. Where the neighbours of what is left depend on each other, the same search is made beside a sum of
//! cosines that follows any smooth spectrum (Bloomfield 1973). That state is the answer where it explains more than it would by
//! chance for all that it is free in; the sum of cosines has no name in it, unless it is a filter.

use std::sync::Arc;

use model::effect::Hypothesis;

use super::Search;
use crate::fit::channel::{Form, State, Term, is_wide};
use crate::fit::likelihood::scoring;
use crate::fit::threshold;
use crate::test_level::omnibus_level;

/// How much broader than a band is what the cosines beside it tell apart: the half period of the fastest over the band's width.
const BROADER: f64 = 2.0;

impl Search<'_> {
    /// What was `found`, or what is found beside a spectrum of no kind where that explains more.
    pub(crate) fn beside_any_spectrum(&self, found: State) -> State {
        if self.view.moving || self.view.sways() {
            return found;
        }
        // Cosines that tell apart what is narrower than a band would take its place.
        let peaks = found.terms.iter().filter_map(Term::peak);
        let widths = peaks.filter(|p| !is_wide(p)).map(|p| 2.0 * p.half_width);
        let most = std::f64::consts::PI / (BROADER * widths.fold(0.0, f64::max));
        let candidates = self.candidates.iter().enumerate();
        let beside = |(i, c)| self.with_spectrum(&found, (i, c), most);
        let all = candidates.filter_map(beside);
        let best = all.max_by(|a, b| Self::total(a).total_cmp(&Self::total(b)));
        best.unwrap_or(found)
    }

    /// What is found beside one sum of cosines, where there is a reason to ask and it explains more.
    fn with_spectrum(
        &self,
        found: &State,
        (i, candidate): (usize, &super::Candidate),
        most: f64,
    ) -> Option<State> {
        let Hypothesis::Covariance(of) = &candidate.hypothesis else {
            return None;
        };
        let limit = threshold::covariance(of.dimensions());
        let follows_any = of.filters_white() && of.dimensions() > scoring::FEW;
        if !follows_any
            || of.dimensions() as f64 > most
            || self.neighbours(found, of.dimensions()) < limit
        {
            return None;
        }
        let start = of.starts(self.panel.bins.n).into_iter().next()?;
        let form = Form::Covariance(Arc::clone(of), start);
        let term = Term::new(candidate.effect, i, form, limit);
        let beside = found.terms.iter().filter(|t| !t.is_filter());
        let all: Vec<Term> = beside.cloned().chain([term]).collect();
        let state = self.climb(self.refit(all, found.noise.log_walk));
        let more = freedom(&state).saturating_sub(freedom(found)).max(1);
        let by_chance = threshold::tail(more, omnibus_level());
        (explains(&state) - explains(found) > by_chance).then_some(state)
    }
}

/// Coordinates of the noise of a state.
fn freedom(state: &State) -> usize {
    let coordinates = state.noise.terms.iter().map(|(_, theta)| theta.len());
    coordinates.sum()
}

/// Twice the log likelihood of a state beyond what all but the noise cost.
fn explains(state: &State) -> f64 {
    let signals = state.terms.iter().filter(|t| !t.is_covariance());
    2.0 * state.solution.log_likelihood - signals.map(|t| t.threshold).sum::<f64>()
}
