//! Noise that is much louder for a while, or quieter, against what a search finds where it takes it for the same throughout.
//!
//! Of such a record the loud part alone has a spectrum, of as many independent values as that part has readings. A search that
//! believes in all of them finds bands, processes and steps in chance; under the law of the variance they are worth nothing.

use model::effect::{Hypothesis, VarianceLaw};

use super::Search;
use crate::fit::channel::{State, whitened};
use crate::fit::scan;

impl Search<'_> {
    /// Twice the log likelihood beyond what terms have to reach, noise that is loud for a while with it.
    pub(crate) fn total_beside_a_stretch(&self, state: &State) -> f64 {
        let (_, e) = whitened(&self.panel, state);
        Self::total(state) + 2.0 * scan::of_a_stretch(&e)
    }

    /// The state without the terms that are worth nothing where noise is loud for a while; as it is where it is not, beside the
    /// `baseline`.
    pub(crate) fn beside_a_stretch(&self, found: State, baseline: &State) -> State {
        let segment = |h: &Hypothesis| matches!(h, Hypothesis::Variance(VarianceLaw::Segment));
        let asked = self.candidates.iter().any(|c| segment(&c.hypothesis));
        if found.terms.is_empty() || !asked || self.view.moving || self.view.sways() {
            return found;
        }
        let alone = self.total_beside_a_stretch(baseline);
        if alone <= Self::total(baseline) {
            return found;
        }
        let mut best = self.total_beside_a_stretch(&found);
        if alone >= best {
            return baseline.clone();
        }
        let mut state = found;
        loop {
            let fewer = (0..state.terms.len()).map(|i| self.without(&state, i));
            let weighed = fewer.map(|s| (self.total_beside_a_stretch(&s), s));
            match weighed.max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((total, fewer)) if total >= best => (best, state) = (total, fewer),
                _ => return state,
            }
        }
    }
}
