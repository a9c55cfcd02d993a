//! A random walk that is there from the start stands for what is slow, whatever that is: for a process with a correlation
//! time and a law of the temperature together, of which neither one alone does better than the walk. Where the walk is
//! large, the search is made a second time with the process in its place, and with one law beside it.

use std::collections::HashSet;

use model::effect::{Covariance, Hypothesis};

use super::{Candidate, Search};
use crate::fit::channel::{Form, State};

/// Correlation times, samples, that a process in the place of the walk starts from: a record's length over these.
const SPANS: [f64; 3] = [60.0, 600.0, 3000.0];
/// Half cycles of a record over which a walk has to be larger than the white noise: with fewer it has swallowed little.
const LEAST_HALF_CYCLES: f64 = 20.0;
/// What the walk starts from beside the process, ln of its variance over what it was: nothing, but in reach of the fit.
const LOG_LEFT: f64 = -10.0;

impl Search<'_> {
    /// The better of a state and of the search that begins with a process in the place of its walk.
    pub(super) fn or_process_for_walk(&self, state: State) -> State {
        let n = self.panel.bins.n as f64;
        let walk = state.noise.log_walk;
        // A walk is as large as the white noise where 2 sin(w / 2) is the ratio of their standard deviations.
        let half_cycles = (0.5 * walk).exp() * n / std::f64::consts::PI;
        if half_cycles < LEAST_HALF_CYCLES || self.view.moving || self.view.sways() {
            return state;
        }
        let plain =
            |c: &dyn Covariance| c.dimensions() == 2 && c.grid().is_empty() && !c.filters_white();
        let Some(process) = self.processes().into_iter().find(|p| plain(p.1.as_ref())) else {
            return state;
        };
        let in_its_place = |span: f64| {
            // A process of this variance departs from its value as the walk does, over less than its time.
            let time = (n / span).max(2.0).ln();
            let theta = vec![walk + time - std::f64::consts::LN_2, time];
            self.refit(vec![self.process(process, theta)], walk + LOG_LEFT)
        };
        let best = |a: &State, b: &State| Self::total(a).total_cmp(&Self::total(b));
        let alone = SPANS.into_iter().map(in_its_place).max_by(best);
        let beside = alone.iter().flat_map(|s| self.with_one_law(s));
        let all = beside.chain(alone.clone());
        let start = all.max_by(best);
        let other = start.map(|s| self.pair_up(self.climb(s)));
        let better = |o: &State| Self::total(o) > Self::total(&state);
        other.filter(better).unwrap_or(state)
    }

    /// The states with one law of the mean more: of each effect the column and the shape that offer most. What a law is worth
    /// beside a process that has taken its part too is little; it is told once both are fitted.
    fn with_one_law(&self, state: &State) -> Vec<State> {
        let of_mean = |c: &Candidate| {
            use Hypothesis::{Regression, Shaped, Step};
            matches!(c.hypothesis, Regression(_) | Shaped(_) | Step)
        };
        let mut offers = self.offers(state, &of_mean);
        offers.sort_by(|a, b| b.score().total_cmp(&a.score()));
        let mut seen = HashSet::new();
        offers.retain(|o| seen.insert((o.effect.id(), matches!(o.form, Form::Columns))));
        let with = |offer| self.accept(state, offer);
        offers.into_iter().map(with).collect()
    }
}
