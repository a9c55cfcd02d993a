//! Steps beside two levels: what no switch between the levels makes is a jump of its own.

use model::effect::Hypothesis;

use crate::fit::channel::{Form, State};
use crate::fit::likelihood::least_walk;
use crate::search::{MOST_ALIKE, Search};
use crate::two_level::fit::{Coordinates, with_column};

/// Blocks on either side of a step that it is weighed on.
const REACH: usize = 1000;

/// The state with the spectrum of its covariance fitted from that of the levels, where that is better: what the step was
/// taken for before leads the fit astray.
fn from_levels(search: &Search<'_>, state: State, length: usize, x: &Coordinates) -> State {
    let mut terms = state.terms.clone();
    let blocks = (length as f64).ln();
    for t in terms.iter_mut().filter(|t| t.wanders()) {
        if let Form::Covariance(_, theta) = &mut t.form {
            *theta = super::level::spectrum(x, blocks, x[0] + blocks);
        }
    }
    let other = search.refit(terms, least_walk(search.panel.bins.n));
    let better = other.solution.log_likelihood > state.solution.log_likelihood;
    if better { other } else { state }
}

/// The state with the steps that stand beside its two levels, each weighed by the likelihood of the levels themselves:
/// for a Gaussian process of their spectrum every switch is a surprise. `rest` holds the data, from which they are
/// taken; `x` the levels on blocks of `length` samples.
pub(super) fn beside(
    search: &Search<'_>,
    mut state: State,
    rest: &mut [f64],
    length: usize,
    x: &Coordinates,
) -> State {
    for _ in 0..MOST_ALIKE {
        let steps = |c: &crate::search::Candidate| matches!(c.hypothesis, Hypothesis::Step);
        let offers = search.offers(&state, &steps);
        let Some(offer) = offers.into_iter().find(|o| o.score() > 0.0) else {
            break;
        };
        let limit = offer.threshold;
        let mut next = from_levels(search, search.accept(&state, offer), length, x);
        let by = 2.0 * (next.solution.log_likelihood - state.solution.log_likelihood);
        let Some(Form::Step(at, _)) = next.terms.last().map(|t| &t.form) else {
            break;
        };
        let at = *at;
        let first = (at as usize).saturating_sub(REACH * length);
        let blocks = super::means(&rest[first..], length, 2 * REACH);
        let (height, gained) =
            with_column(&blocks, x, &super::after(blocks.len(), first, length, at));
        if 2.0 * gained < limit {
            break;
        }
        if let Some(step) = next.terms.last_mut() {
            step.lr = by;
        }
        let from = at.ceil() as usize;
        rest[from..].iter_mut().for_each(|v| *v -= height);
        state = next;
    }
    state
}
