//! A term that was found on a grid gets its exact place, and joins the model.

use super::Search;
use crate::fit::channel::{Form, State, Term};
use crate::fit::delayed::{self, Beside};
use crate::fit::{scan, threshold};
use std::sync::Arc;

/// Coefficients below half the sample rate within which a line may stand at it, and what the frequency and the phase that it needs
/// less there gain by chance, as a likelihood ratio: chi-square of two degrees of freedom, at 1 %.
const OF_HALF_THE_RATE: f64 = 3.0;
const ONE_MORE: f64 = 9.21;

impl Search<'_> {
    /// Build the columns of a scanned term and refine its location.
    pub(super) fn refine(&self, state: &State, mut term: Term) -> Term {
        let n = self.panel.bins.n;
        let own = state.columns();
        let g = state.noise.over(&self.panel.bins);
        let width = self.panel.width();
        let with = |columns: &[Vec<f64>]| {
            let added = self.panel.add_all(columns);
            let l = self
                .panel
                .solve(&g, &[own.clone(), added].concat())
                .log_likelihood;
            self.panel.truncate(width);
            -l
        };
        let bin = std::f64::consts::PI / n as f64;
        let values: Vec<Vec<f64>> = match &mut term.form {
            Form::Columns | Form::Covariance(..) => return term,
            Form::Step(at, error) => {
                let from = |at: f64| {
                    vec![
                        (0..n)
                            .map(|i| f64::from(u8::from(i as f64 >= at)))
                            .collect(),
                    ]
                };
                *at = place_of_step(n, *at, *error, &|at| with(&from(at)));
                from(*at)
            }
            Form::Shaped(shape, at) => {
                let others: Vec<&Term> = state.terms.iter().collect();
                let effect = term.effect.id();
                let beside = Beside::new(&self.panel, &others, effect, Arc::clone(shape));
                *at = beside.best(&self.panel, &g, *at).0.exp();
                self.panel.truncate(width);
                let (least, most) = shape.delays();
                if most > least {
                    let of = Arc::clone(shape);
                    let top = delayed::climb(&self.panel, &g, &others, effect, of, *at);
                    (*shape, *at) = (top.shape, top.x.exp());
                }
                shape.columns(*at).into_iter().map(|c| c.values).collect()
            }
            Form::Line(omega) => {
                let place = scan::place_of_line(
                    &self.panel,
                    &state.noise,
                    &own,
                    &state.solution,
                    &state.lines(),
                    *omega,
                );
                *omega = place.unwrap_or_else(|| {
                    numerics::minimise::golden(
                        &|w| with(&scan::sinusoid(n, w)),
                        *omega - bin,
                        *omega + bin,
                        12,
                    )
                });
                let at_half = scan::sinusoid(n, std::f64::consts::PI)[..1].to_vec();
                // At half the sample rate a line is a sign that changes with every reading: there is no sine beside it.
                let near = std::f64::consts::PI - *omega < OF_HALF_THE_RATE * bin;
                if near && 2.0 * (with(&at_half) - with(&scan::sinusoid(n, *omega))) < ONE_MORE {
                    *omega = std::f64::consts::PI;
                    term.names.truncate(1);
                    at_half
                } else {
                    scan::sinusoid(n, *omega).into()
                }
            }
            Form::SideBands(carrier, distance) => {
                let phase = state.carrier().map_or(0.0, |c| c.1);
                let bands = |d: f64| scan::swings(n, *carrier, phase, d).to_vec();
                *distance = numerics::minimise::golden(
                    &|d| with(&bands(d)),
                    *distance - bin,
                    *distance + bin,
                    10,
                );
                let d = *distance;
                [scan::sinusoid(n, *carrier).to_vec(), bands(d)].concat()
            }
        };
        term.columns = self.panel.add_all(&values);
        term
    }

    /// Add a term, in place of the one that it extends.
    pub(crate) fn accept(&self, state: &State, mut term: Term) -> State {
        let mut beside = state.clone();
        if let Form::Shaped(shape, _) = &term.form {
            let replaced = Self::replaced(state, term.effect.id(), shape.as_ref());
            if !replaced.is_empty() {
                beside.terms.retain(|t| !replaced.contains(&t.candidate));
                // Later it is weighed as a whole.
                let of = &self.candidates[term.candidate];
                term.threshold = of.limit_of_shape(term.names.len());
            }
        }
        let mut term = self.refine(&beside, self.stripped(&beside, term));
        let mut terms = beside.terms;
        if term.effect.extends().is_some() && matches!(term.form, Form::Columns) {
            // Later it is weighed as a whole.
            term.threshold = threshold::regression(term.columns.len(), 1);
        }
        if let Some(extended) = term.effect.extends() {
            let carrier = |t: &Term| match (&t.form, &term.form) {
                (Form::Line(a), Form::SideBands(b, _)) => a == b,
                _ => true,
            };
            terms.retain(|t| !(t.effect.id() == extended && carrier(t)));
        }
        terms.push(term);
        self.refit(self.placed(state, terms), state.noise.log_walk)
    }

    /// The state without a term and without every shape that follows the same channel: beside the term it took the place that was
    /// left, and is sought anew.
    pub(super) fn cleared_of(&self, state: &State, i: usize) -> State {
        let of = &state.terms[i].of;
        let own = |t: &Term| {
            let whole = matches!(&t.form, Form::Shaped(shape, _) if shape.whole());
            whole && t.of.iter().any(|c| of.contains(c))
        };
        let each = state.terms.iter().enumerate();
        let kept = each.filter(|(j, t)| *j != i && !own(t));
        let kept = kept.map(|(_, t)| t.clone()).collect();
        self.refit(kept, state.noise.log_walk)
    }

    /// Terms of which every shape but the last, which is new, has its best place beside the others.
    fn placed(&self, state: &State, terms: Vec<Term>) -> Vec<Term> {
        let mut beside = State {
            terms,
            ..state.clone()
        };
        for i in 0..beside.terms.len().saturating_sub(1) {
            if matches!(beside.terms[i].form, Form::Shaped(..)) {
                let term = beside.terms.remove(i);
                let term = self.refine(&beside, term);
                beside.terms.insert(i, term);
            }
        }
        self.delayed(&mut beside.terms);
        beside.terms
    }

    /// The columns of an effect that has a delayed shape become as late as that.
    fn delayed(&self, terms: &mut [Term]) {
        for i in 0..terms.len() {
            let Form::Shaped(shape, _) = &terms[i].form else {
                continue;
            };
            let (shape, effect) = (Arc::clone(shape), terms[i].effect.id());
            for t in terms.iter_mut() {
                t.columns = delayed::columns_beside(&self.panel, t, shape.as_ref(), effect);
            }
        }
    }

    /// The columns of a state; in the place of one that is late, its candidate's and how the late one differs from that. They
    /// span no less, and what nearly is a multiple of another one takes the digits of all sums.
    pub(crate) fn spanning(&self, state: &State) -> Vec<usize> {
        let of = |t: &Term| {
            let own = &self.candidates[t.candidate].columns;
            let as_many = matches!(t.form, Form::Columns) && own.len() == t.columns.len();
            if !as_many || *own == t.columns {
                return t.columns.clone();
            }
            let changes = t.columns.iter().zip(own).map(|(late, own)| {
                let (late, own) = (self.panel.column(*late), self.panel.column(*own));
                let change: Vec<f64> = late.iter().zip(own.iter()).map(|(l, o)| l - o).collect();
                self.panel.dct.inverse(&change)
            });
            let changes: Vec<Vec<f64>> = changes.collect();
            [own.clone(), self.panel.add_all(changes)].concat()
        };
        state.terms.iter().flat_map(of).collect()
    }
}

/// The reading between two places of the scan at which a step begins, where its time is known better than these are apart: of
/// a large one each reading that is on the wrong side is far off.
fn place_of_step(n: usize, at: f64, error: f64, minus_l: &dyn Fn(f64) -> f64) -> f64 {
    let apart = scan::apart(n);
    if apart <= 1.0 || error >= apart {
        return at;
    }
    let (first, last) = ((at - apart).ceil() as usize, (at + apart) as usize);
    let all = (first..=last).map(|i| (i as f64, minus_l(i as f64)));
    let best = all.min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(at, |b| b.0)
}
