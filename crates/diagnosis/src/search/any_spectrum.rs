//! The search again beside a spectrum of no kind.
//!
//! Noise that the library has no law for hides what stands beside it: the search takes it for white, and its terms stand in for
//! the law that is missing. Where the neighbours of what is left depend on each other, the same search is made beside a sum of
//! cosines that follows any smooth spectrum (Bloomfield 1973). That state is the answer where it explains more than it would by
//! chance for all that it is free in; the sum of cosines has no name in it, unless it is a filter.

use std::sync::Arc;

use model::effect::{Hypothesis, Peak};

use super::Search;
use crate::fit::channel::{Form, State, Term, is_wide};
use crate::fit::likelihood::scoring;
use crate::fit::threshold;
use crate::test_level::omnibus_level;

/// Half widths between the two places at which a twentieth of a resonance's height is left: 2 * 19^1/2.
const SKIRTS: f64 = 8.7;

impl Search<'_> {
    /// What was `found`, or what is found beside a spectrum of no kind where that explains more.
    pub(crate) fn beside_any_spectrum(&self, found: State) -> State {
        if self.view.moving || self.view.sways() {
            return found;
        }
        let candidates = self.candidates.iter().enumerate();
        let beside = |(i, c)| self.with_spectrum(&found, (i, c));
        let all = candidates.filter_map(beside);
        let best = all.max_by(|a, b| Self::total(a).total_cmp(&Self::total(b)));
        best.unwrap_or(found)
    }

    /// What is found beside one sum of cosines, where there is a reason to ask and it explains more.
    fn with_spectrum(
        &self,
        found: &State,
        (i, candidate): (usize, &super::Candidate),
    ) -> Option<State> {
        let Hypothesis::Covariance(of) = &candidate.hypothesis else {
            return None;
        };
        let limit = threshold::covariance(of.dimensions());
        let follows_any = of.filters_white() && of.dimensions() > scoring::FEW;
        if !follows_any || self.neighbours(found, of.dimensions()) < limit {
            return None;
        }
        let start = of.starts(self.panel.bins.n).into_iter().next()?;
        let form = Form::Covariance(Arc::clone(of), start);
        let term = Term::new(candidate.effect, i, form, limit);
        let beside = found.terms.iter().filter(|t| !t.is_filter());
        let all: Vec<Term> = beside.cloned().chain([term]).collect();
        let state = self.climb(self.refit(all, found.noise.log_walk));
        let freer = freedom(&state).saturating_sub(freedom(found)).max(1);
        let by_chance = threshold::tail(freer, omnibus_level());
        let explains_more = explains(&state) - explains(found) > by_chance;
        (explains_more && !share_a_place(found, &state, of.dimensions())).then_some(state)
    }
}

/// Whether so many cosines tell apart what is narrower than a band of a state with its skirts, which stays beside them: they have
/// taken a part of it.
fn share_a_place(found: &State, state: &State, cosines: usize) -> bool {
    let stays = |p: &Peak| {
        let mut peaks = state.terms.iter().filter_map(Term::peak);
        peaks.any(|o| (o.omega - p.omega).abs() < 0.5 * SKIRTS * p.half_width)
    };
    let mut bands = (found.terms.iter().filter_map(Term::peak)).filter(|p| !is_wide(p));
    let finest = std::f64::consts::PI / cosines as f64;
    bands.any(|p| finest < SKIRTS * p.half_width && stays(&p))
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
