//! Two processes on one channel. One after the other they are sought by what the first leaves, and the first has taken a
//! part of the second: a filter beside flicker noise is met as a bias that comes back, or as two levels. Here every pair
//! that the library allows is weighed as a pair.

use std::sync::Arc;

use model::effect::{Covariance, Hypothesis};

use super::Search;
use crate::fit::channel::{Form, State, Term};
use crate::fit::likelihood::scoring;
use crate::fit::threshold;

/// Correlation times, samples, at which a second process is sought beside the first: a record's length over these.
const SPANS: [f64; 3] = [60.0, 600.0, 3000.0];

/// Processes and filters of a state, and their coordinates.
type Freedom = (usize, usize);

/// A covariance of the library: number of its candidate, and what it is.
type Process<'a> = (usize, &'a Arc<dyn Covariance>);

impl Search<'_> {
    pub(super) fn processes(&self) -> Vec<Process<'_>> {
        let all = self.candidates.iter().enumerate();
        all.filter_map(|(i, c)| match &c.hypothesis {
            Hypothesis::Covariance(p) if !p.is_peak() && !c.is_nameless() => Some((i, p)),
            _ => None,
        })
        .collect()
    }

    pub(super) fn process(&self, (i, c): Process<'_>, theta: Vec<f64>) -> Term {
        let form = Form::Covariance(Arc::clone(c), theta);
        let limit = threshold::covariance(c.dimensions());
        Term::new(self.candidates[i].effect, i, form, limit)
    }

    /// The state with the pair of processes that explains most, where that is better than those that were found.
    pub(super) fn pair_up(&self, state: State) -> State {
        let paired = |t: &Term| t.is_covariance() && !t.is_band() && !t.has_no_name();
        if !state.terms.iter().any(paired) {
            return state;
        }
        // A filter of many coordinates, or of many tops, is weighed beside others where it was found.
        let held = |i: usize| state.terms.iter().any(|t| t.candidate == i);
        let mut all = self.processes();
        let is_plain = |c: &dyn Covariance| c.dimensions() <= scoring::FEW && c.grid().is_empty();
        all.retain(|(i, c)| is_plain(c.as_ref()) || held(*i));
        let others: Vec<Term> = state.terms.iter().filter(|t| !paired(t)).cloned().collect();
        let n = self.panel.bins.n;
        let starts = |c: &Arc<dyn Covariance>| -> Vec<Vec<f64>> {
            if c.dimensions() == 2 && c.grid().is_empty() {
                let times = SPANS.map(|s| (n as f64 / s).max(2.0).ln());
                times.map(|t| vec![-3.0 - 0.5 * t, t]).to_vec()
            } else {
                c.starts(n)
            }
        };
        let mut pairs: Vec<(Freedom, State)> = vec![];
        for (k, a) in all.iter().enumerate() {
            for b in &all[k + 1..] {
                let one_effect =
                    self.candidates[a.0].effect.id() == self.candidates[b.0].effect.id();
                if one_effect || a.1.filters_white() && b.1.filters_white() {
                    continue;
                }
                let from = |of_a: &Vec<f64>, of_b: Vec<f64>| {
                    let mut terms = others.clone();
                    terms.push(self.process(*a, of_a.clone()));
                    terms.push(self.process(*b, of_b));
                    self.refit(terms, state.noise.log_walk)
                };
                let all = starts(a.1).into_iter();
                let all = all.flat_map(|of_a| starts(b.1).into_iter().map(move |b| from(&of_a, b)));
                let best = all.max_by(|a, b| Self::total(a).total_cmp(&Self::total(b)));
                let freedom = a.1.dimensions() + b.1.dimensions();
                pairs.extend(best.map(|best| ((2, freedom), best)));
            }
        }
        let freedom = |s: &State| -> Freedom {
            let coordinates = s.noise.terms.iter().map(|t| t.1.len());
            (
                s.terms.iter().filter(|t| paired(t)).count(),
                coordinates.sum(),
            )
        };
        pairs.push((freedom(&state), state));
        // Of those that do about as well, the one with the least freedom: a pole in all of the noise is no process beside it.
        let best = pairs.iter().map(|p| Self::total(&p.1));
        let best = best.fold(f64::NEG_INFINITY, f64::max);
        pairs.sort_by(|a, b| {
            let ahead = Self::total(&b.1).total_cmp(&Self::total(&a.1));
            a.0.cmp(&b.0).then(ahead)
        });
        let close =
            |(_, s): &(Freedom, State)| Self::total(s) > best - crate::fit::channel::RIVAL_SPAN;
        let mut open: Vec<State> = pairs.into_iter().filter(close).map(|p| p.1).collect();
        let chosen = self.filter_first(open.swap_remove(0));
        self.earned(chosen, open)
    }

    /// The state, weighed anew; where a term of it does not earn its place, the best of the others.
    fn earned(&self, mut state: State, others: Vec<State>) -> State {
        self.reweigh(&mut state);
        let best = |a: &State, b: &State| Self::total(a).total_cmp(&Self::total(b));
        match others.into_iter().max_by(best) {
            Some(mut other) if state.terms.iter().any(|t| t.score() < 0.0) => {
                self.reweigh(&mut other);
                other
            }
            _ => state,
        }
    }

    /// Of one pole that filters the white noise and one that does not, either may be the filter for the likelihood: it is
    /// the faster one.
    fn filter_first(&self, state: State) -> State {
        let place = |filter: bool| {
            state.terms.iter().position(|t| match &t.form {
                Form::Covariance(c, _) => {
                    c.filters_white() == filter
                        && !c.is_peak()
                        && c.dimensions() == 2 - usize::from(filter)
                }
                _ => false,
            })
        };
        let (Some(filter), Some(process)) = (place(true), place(false)) else {
            return state;
        };
        let theta = |i: usize| match &state.terms[i].form {
            Form::Covariance(_, theta) => theta.clone(),
            _ => vec![],
        };
        // Coordinates: logit of the correlation from sample to sample; ln of the variance and of the time in samples.
        let (of_filter, of_process) = (theta(filter), theta(process));
        let correlation = 1.0 / (1.0 + (-of_filter[0]).exp());
        let (slow, fast) = (-correlation.ln().recip(), of_process[1].exp());
        if slow <= fast {
            return state;
        }
        let kept = (-fast.recip()).exp();
        let mut terms = state.terms.clone();
        let mut put = |i: usize, to: Vec<f64>| {
            if let Form::Covariance(_, theta) = &mut terms[i].form {
                *theta = to;
            }
        };
        put(filter, vec![(kept / (1.0 - kept)).ln()]);
        put(process, vec![-of_process[0], slow.ln()]);
        let other = self.refit(terms, state.noise.log_walk - of_process[0]);
        // A triangular window is no pole, and loses by the exchange.
        let close = crate::fit::channel::RIVAL_SPAN / 2.0;
        if other.solution.log_likelihood > state.solution.log_likelihood - close {
            other
        } else {
            state
        }
    }
}
