//! Forward stagewise search for the causes in one channel: every hypothesis of every effect is weighed with the random
//! walk refitted, the best one joins, covariance terms are challenged by what they may have swallowed, and what the
//! others make superfluous is dropped. The search knows hypotheses, not effects.

use std::sync::Arc;

use model::effect::{Effect, Hypothesis, Shape, View};
use model::effects::EFFECTS;

use crate::likelihood::{Noise, Panel, Solution};
use crate::scan;
use crate::threshold;

/// Most terms on one channel.
const MOST_TERMS: usize = 8;
/// Most lines, and most steps, that are told as separate causes.
const MOST_ALIKE: usize = 2;
/// Scores closer than this (twice 3 nats) leave the answer open.
pub const RIVAL_SPAN: f64 = 6.0;
/// Fewest cycles of a line in the record.
const LEAST_CYCLES: f64 = 3.0;
/// Longest beat that side bands are sought at, Hz, and fewest beats in the record.
const FASTEST_BEAT_HZ: f64 = 0.6;
const LEAST_BEATS: f64 = 3.0;

/// What an accepted or weighed term is made of.
#[derive(Clone)]
pub enum Form {
    /// Columns of a regression.
    Columns,
    /// Columns of a shape at its coordinate.
    Shaped(Arc<dyn Shape>, f64),
    /// A step at that time in samples, with its standard error.
    Step(f64, f64),
    /// A line of that angular frequency.
    Line(f64),
    /// A line with side bands at that distance, both rad per sample.
    SideBands(f64, f64),
    /// A stationary term of the noise.
    Covariance(Arc<dyn model::effect::Covariance>, Vec<f64>),
}

/// A term of the model of a channel.
#[derive(Clone)]
pub struct Term {
    /// The effect.
    pub effect: &'static dyn Effect,
    /// Number of its hypothesis in the list of candidates.
    pub candidate: usize,
    /// What it is made of.
    pub form: Form,
    /// Columns of the panel that it uses.
    pub columns: Vec<usize>,
    /// Names of the coefficients.
    pub names: Vec<&'static str>,
    /// Values held fixed.
    pub fixed: Vec<(&'static str, f64, &'static str)>,
    /// The channel that it follows.
    pub follows: Option<String>,
    /// Likelihood ratio against the model without it.
    pub lr: f64,
    /// What a false one reaches once in the stated number of clean channels.
    pub threshold: f64,
    /// Effects that leave the answer open, with their log odds.
    pub alternatives: Vec<(&'static dyn Effect, f64)>,
    /// Coefficients found by other means than the fit.
    pub stated: Option<Vec<(f64, f64)>>,
}

impl Term {
    /// Likelihood ratio beyond the threshold.
    #[must_use]
    pub fn score(&self) -> f64 {
        self.lr - self.threshold
    }

    fn is_covariance(&self) -> bool {
        matches!(self.form, Form::Covariance(..))
    }
}

/// A hypothesis under test.
pub struct Candidate {
    /// Its effect.
    pub effect: &'static dyn Effect,
    /// The hypothesis.
    pub hypothesis: Hypothesis,
    columns: Vec<usize>,
    grid: Vec<(f64, Vec<usize>)>,
    siblings: usize,
}

impl Candidate {
    /// Columns of the panel that a regression uses.
    #[must_use]
    pub fn columns(&self) -> &[usize] {
        &self.columns
    }
}

/// A model of a channel.
#[derive(Clone)]
pub struct State {
    /// Terms.
    pub terms: Vec<Term>,
    /// Noise shape, the covariance terms in it.
    pub noise: Noise,
    /// Its fit.
    pub solution: Solution,
    /// Structure that was seen and that no single effect explains.
    pub notes: Vec<String>,
}

impl State {
    /// All columns in use, term by term.
    #[must_use]
    pub fn columns(&self) -> Vec<usize> {
        self.terms
            .iter()
            .flat_map(|t| t.columns.iter().copied())
            .collect()
    }
}

/// The search on one channel.
pub struct Search<'a> {
    /// Data and columns.
    pub panel: Panel,
    /// What the effects see.
    pub view: View<'a>,
    /// Hypotheses.
    pub candidates: Vec<Candidate>,
    /// What cannot be tested, with the reason.
    pub not_tested: Vec<(&'static str, String)>,
}

impl<'a> Search<'a> {
    /// Lay out all hypotheses for a channel.
    #[must_use]
    pub fn new(panel: Panel, view: View<'a>) -> Self {
        let mut candidates = vec![];
        let mut not_tested = vec![];
        for effect in EFFECTS.iter().copied() {
            match effect.hypotheses(&view) {
                Err(why) => not_tested.push((effect.id(), why)),
                Ok(hypotheses) => {
                    let siblings = hypotheses.len();
                    for hypothesis in hypotheses {
                        let columns = match &hypothesis {
                            Hypothesis::Regression(r) => {
                                r.columns.iter().map(|c| panel.add(&c.values)).collect()
                            }
                            _ => vec![],
                        };
                        let grid = match &hypothesis {
                            Hypothesis::Shaped(s) => s
                                .grid()
                                .into_iter()
                                .map(|at| {
                                    (
                                        at,
                                        s.columns(at)
                                            .iter()
                                            .map(|c| panel.add(&c.values))
                                            .collect(),
                                    )
                                })
                                .collect(),
                            _ => vec![],
                        };
                        candidates.push(Candidate {
                            effect,
                            hypothesis,
                            columns,
                            grid,
                            siblings,
                        });
                    }
                }
            }
        }
        Self {
            panel,
            view,
            candidates,
            not_tested,
        }
    }

    /// The state with these terms, fitted from a starting noise.
    #[must_use]
    pub fn refit(&self, terms: Vec<Term>, start: f64) -> State {
        let mut noise = Noise::new(start);
        for t in &terms {
            if let Form::Covariance(c, theta) = &t.form {
                noise.terms.push((Arc::clone(c), theta.clone()));
            }
        }
        let columns: Vec<usize> = terms
            .iter()
            .flat_map(|t| t.columns.iter().copied())
            .collect();
        let (noise, solution) = self.panel.fit(&noise, &columns);
        let mut state = State {
            terms,
            noise,
            solution,
            notes: vec![],
        };
        let mut fitted = state.noise.terms.iter();
        for t in &mut state.terms {
            if let Form::Covariance(_, theta) = &mut t.form
                && let Some((_, best)) = fitted.next()
            {
                theta.clone_from(best);
            }
        }
        state
    }

    fn without(&self, state: &State, i: usize) -> State {
        let mut terms = state.terms.clone();
        terms.remove(i);
        self.refit(terms, state.noise.log_walk)
    }

    /// Best term that candidate `i` offers to `state`; `quick` leaves out refinements.
    fn weigh(&self, state: &State, walks: &[(Noise, Vec<f64>, f64)], i: usize) -> Option<Term> {
        let candidate = &self.candidates[i];
        let null = state.solution.log_likelihood;
        let own = state.columns();
        let term = |form, columns: Vec<usize>, names, lr, threshold| Term {
            effect: candidate.effect,
            candidate: i,
            form,
            columns,
            names,
            fixed: vec![],
            follows: None,
            lr,
            threshold,
            alternatives: vec![],
            stated: None,
        };
        let n = self.panel.bins.n;
        match &candidate.hypothesis {
            Hypothesis::Regression(r) => {
                let columns = [own, candidate.columns.clone()].concat();
                let lr = 2.0 * (self.panel.profile(walks, &columns) - null);
                let names = r.columns.iter().map(|c| c.parameter).collect();
                // In the place of a narrower term, only the columns beyond it are new.
                let held: usize = state
                    .terms
                    .iter()
                    .filter(|t| candidate.effect.extends() == Some(t.effect.id()))
                    .map(|t| t.columns.len())
                    .sum();
                let new = r.columns.len().saturating_sub(held).max(1);
                let limit = threshold::regression(new, candidate.siblings);
                let mut t = term(Form::Columns, candidate.columns.clone(), names, lr, limit);
                t.fixed.clone_from(&r.fixed);
                t.follows.clone_from(&r.follows);
                Some(t)
            }
            Hypothesis::Shaped(shape) => {
                let (at, columns, lr) = candidate
                    .grid
                    .iter()
                    .map(|(at, c)| {
                        (
                            *at,
                            c,
                            2.0 * (self
                                .panel
                                .profile(walks, &[own.clone(), c.clone()].concat())
                                - null),
                        )
                    })
                    .max_by(|a, b| a.2.total_cmp(&b.2))?;
                let names: Vec<_> = shape.columns(at).iter().map(|c| c.parameter).collect();
                let limit = threshold::shaped(names.len());
                Some(term(
                    Form::Shaped(Arc::clone(shape), at),
                    columns.clone(),
                    names,
                    lr,
                    limit,
                ))
            }
            Hypothesis::Step => {
                let margin = (0.5 * self.view.rate_hz).max(4.0);
                let noises: Vec<Noise> = walks.iter().step_by(2).map(|w| w.0.clone()).collect();
                let curve = scan::steps(&self.panel, &noises, &own, null);
                let inside: Vec<_> = curve
                    .into_iter()
                    .filter(|(t, _)| *t >= margin && *t <= n as f64 - margin)
                    .collect();
                let (at, lr) = inside.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1))?;
                let weight = |l: f64| ((l - lr) / 2.0).exp();
                let near = |t: f64| (t - at).abs() < 0.1 * n as f64;
                let (mut sum, mut square) = (0.0, 0.0);
                for (t, l) in inside.iter().filter(|(t, _)| near(*t)) {
                    sum += weight(*l);
                    square += weight(*l) * (t - at).powi(2);
                }
                let error = (square / sum).sqrt().max(0.5);
                Some(term(
                    Form::Step(at, error),
                    vec![],
                    vec!["height"],
                    lr,
                    threshold::step(n),
                ))
            }
            Hypothesis::Line => {
                let lr = scan::lines(&self.panel, &state.noise, &own, &state.solution);
                let least = (2.0 * LEAST_CYCLES) as usize;
                let k = (least..n - 1).max_by(|a, b| lr[*a].total_cmp(&lr[*b]))?;
                let omega = std::f64::consts::PI * k as f64 / n as f64;
                Some(term(
                    Form::Line(omega),
                    vec![],
                    vec!["cosine", "sine"],
                    lr[k],
                    threshold::line(n),
                ))
            }
            Hypothesis::SideBands => {
                let carrier = state.terms.iter().find_map(|t| match t.form {
                    Form::Line(omega) => Some(omega),
                    _ => None,
                })?;
                let lr = scan::lines(&self.panel, &state.noise, &own, &state.solution);
                let bin = std::f64::consts::PI / n as f64;
                let centre = (carrier / bin).round() as usize;
                let widest = (2.0 * FASTEST_BEAT_HZ / self.view.rate_hz * n as f64) as usize;
                let d = ((2.0 * LEAST_BEATS) as usize..=widest)
                    .filter(|d| centre > d + 1 && centre + d < n)
                    .max_by(|a, b| {
                        (lr[centre + a] + lr[centre - a])
                            .total_cmp(&(lr[centre + b] + lr[centre - b]))
                    })?;
                let sum = lr[centre + d] + lr[centre - d];
                let names = vec![
                    "cosine",
                    "sine",
                    "upper_cosine",
                    "upper_sine",
                    "lower_cosine",
                    "lower_sine",
                ];
                Some(term(
                    Form::SideBands(carrier, d as f64 * bin),
                    vec![],
                    names,
                    sum,
                    threshold::side_bands(widest),
                ))
            }
            Hypothesis::Covariance(c) => {
                let best = c
                    .starts(n)
                    .into_iter()
                    .map(|theta| {
                        let mut noise = state.noise.clone();
                        noise.terms.push((Arc::clone(c), theta));
                        self.panel.fit(&noise, &own)
                    })
                    .max_by(|a, b| a.1.log_likelihood.total_cmp(&b.1.log_likelihood))?;
                let lr = 2.0 * (best.1.log_likelihood - null);
                let theta = best.0.terms.last().map(|t| t.1.clone())?;
                let limit = threshold::covariance(c.dimensions());
                Some(term(
                    Form::Covariance(Arc::clone(c), theta),
                    vec![],
                    vec![],
                    lr,
                    limit,
                ))
            }
            _ => None,
        }
    }

    /// Whether a candidate may still join.
    fn open(&self, state: &State, i: usize) -> bool {
        let c = &self.candidates[i];
        match &c.hypothesis {
            Hypothesis::Step | Hypothesis::Line => !self.view.moving,
            Hypothesis::SideBands => state.terms.iter().all(|t| t.candidate != i),
            Hypothesis::Covariance(_) => {
                !self.view.moving && state.terms.iter().all(|t| t.effect.id() != c.effect.id())
            }
            Hypothesis::Regression(r) => {
                !self.view.moving
                    && state
                        .terms
                        .iter()
                        .all(|t| t.effect.id() != c.effect.id() || t.follows != r.follows)
            }
            Hypothesis::Shaped(_) => {
                !self.view.moving && state.terms.iter().all(|t| t.candidate != i)
            }
            _ => false,
        }
    }

    /// What every open candidate offers, those that extend a term in its place.
    fn offers(&self, state: &State, allow: &dyn Fn(&Candidate) -> bool) -> Vec<Term> {
        let walks = self.panel.walks(&state.noise);
        (0..self.candidates.len())
            .filter(|i| allow(&self.candidates[*i]) && self.open(state, *i))
            .filter_map(|i| self.weigh(state, &walks, i))
            .filter(|t| t.lr.is_finite())
            .collect()
    }

    /// Build the columns of a scanned term and refine its location.
    fn refine(&self, state: &State, mut term: Term) -> Term {
        let n = self.panel.bins.n;
        let own = state.columns();
        let g = state.noise.over(&self.panel.bins);
        let width = self.panel.width();
        let with = |columns: &[Vec<f64>]| {
            let added: Vec<usize> = columns.iter().map(|c| self.panel.add(c)).collect();
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
            Form::Step(at, _) => vec![
                (0..n)
                    .map(|i| f64::from(u8::from(i as f64 >= *at)))
                    .collect(),
            ],
            Form::Shaped(shape, at) => {
                let grid = shape.grid();
                let i = grid.iter().position(|g| *g == *at).unwrap_or(0);
                let (low, high) = (grid[i.saturating_sub(1)], grid[(i + 1).min(grid.len() - 1)]);
                let make = |x: f64| -> Vec<Vec<f64>> {
                    shape
                        .columns(x.exp())
                        .into_iter()
                        .map(|c| c.values)
                        .collect()
                };
                *at = crate::optimise::golden(&|x| with(&make(x)), low.ln(), high.ln(), 8).exp();
                make(at.ln())
            }
            Form::Line(omega) => {
                *omega = crate::optimise::golden(
                    &|w| with(&scan::sinusoid(n, w)),
                    *omega - bin,
                    *omega + bin,
                    12,
                );
                scan::sinusoid(n, *omega).into()
            }
            Form::SideBands(carrier, distance) => {
                let bands = |d: f64| -> Vec<Vec<f64>> {
                    [*carrier + d, *carrier - d]
                        .iter()
                        .flat_map(|w| scan::sinusoid(n, *w))
                        .collect()
                };
                *distance = crate::optimise::golden(
                    &|d| with(&bands(d)),
                    *distance - bin,
                    *distance + bin,
                    10,
                );
                let d = *distance;
                [scan::sinusoid(n, *carrier).to_vec(), bands(d)].concat()
            }
        };
        term.columns = values.iter().map(|v| self.panel.add(v)).collect();
        term
    }

    /// Add a term, in place of the one that it extends.
    fn accept(&self, state: &State, term: Term) -> State {
        let mut term = self.refine(state, term);
        let mut terms = state.terms.clone();
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
        self.refit(terms, state.noise.log_walk)
    }

    /// Likelihood ratio of each term given the others.
    fn reweigh(&self, state: &mut State) {
        for i in 0..state.terms.len() {
            let rest = self.without(state, i);
            let covariance = state.terms[i].is_covariance();
            state.terms[i].lr =
                2.0 * (state.solution.log_likelihood - rest.solution.log_likelihood);
            // A refit that starts well may beat one that starts badly; never report less than nothing.
            if covariance {
                state.terms[i].lr = state.terms[i].lr.max(0.0);
            }
        }
    }

    /// Total score: likelihood beyond what all thresholds ask.
    fn total(state: &State) -> f64 {
        2.0 * state.solution.log_likelihood - state.terms.iter().map(|t| t.threshold).sum::<f64>()
    }

    /// Search.
    #[must_use]
    pub fn run(&self, start: &Noise) -> (State, State) {
        let (noise, solution) = self.panel.fit(&Noise::new(start.log_walk), &[]);
        let baseline = State {
            terms: vec![],
            noise,
            solution,
            notes: vec![],
        };
        let mut state = baseline.clone();
        while state.terms.len() < MOST_TERMS {
            let offers = self.offers(&state, &|_| true);
            let Some(best) = Self::simplest_best(offers) else {
                break;
            };
            if best.score() <= 0.0 {
                break;
            }
            let next = self.accept(&state, best);
            if Self::total(&next) <= Self::total(&state) {
                break;
            }
            state = self.swap(next);
        }
        loop {
            self.reweigh(&mut state);
            let Some(i) = (0..state.terms.len())
                .filter(|i| state.terms[*i].score() < 0.0)
                .min_by(|a, b| state.terms[*a].score().total_cmp(&state.terms[*b].score()))
            else {
                break;
            };
            state = self.without(&state, i);
        }
        state = crate::contest::hold(self, state);
        let notes = self.crowds(&mut state);
        self.find_rivals(&mut state);
        state.notes = notes;
        (baseline, state)
    }

    /// More lines or more steps than separate causes make are one structure that the library does not have: the
    /// strongest line stays, the steps go, and a note says what is seen.
    fn crowds(&self, state: &mut State) -> Vec<String> {
        let mut notes = vec![];
        let hz = |w: f64| w * self.view.rate_hz / std::f64::consts::TAU;
        let lines: Vec<(f64, f64)> = state
            .terms
            .iter()
            .filter_map(|t| match t.form {
                Form::Line(w) | Form::SideBands(w, _) => Some((hz(w), t.lr)),
                _ => None,
            })
            .collect();
        if lines.len() > MOST_ALIKE {
            let (low, high) = lines
                .iter()
                .fold((f64::INFINITY, 0.0f64), |(l, h), (f, _)| {
                    (l.min(*f), h.max(*f))
                });
            notes.push(format!(
                "{} lines from {low:.3} to {high:.3} Hz: no steady line but a band, a chirp or harmonics",
                lines.len()
            ));
            let strongest = lines.iter().map(|l| l.1).fold(0.0, f64::max);
            state.terms.retain(|t| {
                !matches!(t.form, Form::Line(_) | Form::SideBands(..)) || t.lr == strongest
            });
        }
        let times: Vec<f64> = state
            .terms
            .iter()
            .filter_map(|t| match t.form {
                Form::Step(at, _) => Some(at / self.view.rate_hz),
                _ => None,
            })
            .collect();
        if times.len() > MOST_ALIKE {
            let told: Vec<String> = times.iter().map(|t| format!("{t:.1}")).collect();
            notes.push(format!(
                "jumps at {} s: more than single events make",
                told.join(", ")
            ));
            state.terms.retain(|t| !matches!(t.form, Form::Step(..)));
        }
        if !notes.is_empty() {
            *state = self.refit(std::mem::take(&mut state.terms), state.noise.log_walk);
            self.reweigh(state);
        }
        notes
    }

    /// The best offer; where it extends another that would pass too, that one: the extension has to earn its place.
    fn simplest_best(offers: Vec<Term>) -> Option<Term> {
        let best = offers
            .iter()
            .max_by(|a, b| a.score().total_cmp(&b.score()))?;
        let narrower = offers
            .iter()
            .filter(|o| {
                // Side bands come after their line; another line beside it is no narrower case of them.
                matches!(best.form, Form::Columns)
                    && best.effect.extends() == Some(o.effect.id())
                    && o.score() > 0.0
            })
            .max_by(|a, b| a.score().total_cmp(&b.score()));
        Some(narrower.unwrap_or(best).clone())
    }

    /// A covariance term that swallowed a regressor gives way to it.
    fn swap(&self, state: State) -> State {
        let mut best = state;
        let covariances: Vec<usize> = (0..best.terms.len())
            .filter(|i| best.terms[*i].is_covariance())
            .collect();
        for i in covariances.into_iter().rev() {
            if best.terms.get(i).is_none_or(|t| !t.is_covariance()) {
                continue;
            }
            let mut rest = self.without(&best, i);
            // Up to three terms may share what the one took.
            for _ in 0..3 {
                let offers = self.offers(&rest, &|c| {
                    !matches!(c.hypothesis, Hypothesis::Covariance(_))
                });
                let Some(offer) = Self::simplest_best(offers) else {
                    break;
                };
                if offer.score() <= 0.0 {
                    break;
                }
                rest = self.accept(&rest, offer);
                if Self::total(&rest) > Self::total(&best) {
                    best = rest;
                    break;
                }
            }
        }
        best
    }

    /// Put every other effect that would do as well in the place of a term beside it.
    fn find_rivals(&self, state: &mut State) {
        for i in 0..state.terms.len() {
            if state.terms[i].stated.is_some() {
                continue;
            }
            let rest = self.without(state, i);
            let own = state.terms[i].effect.id();
            let extended = state.terms[i].effect.extends();
            let score = state.terms[i].score();
            let mut alternatives = std::mem::take(&mut state.terms[i].alternatives);
            for offer in self.offers(&rest, &|c| c.effect.id() != own) {
                let close = offer.score() > 0.0 && offer.score() > score - RIVAL_SPAN;
                // The narrower case of an extension that needed more than it is no rival.
                if !close
                    || extended == Some(offer.effect.id())
                    || offer.effect.extends() == Some(own)
                {
                    continue;
                }
                let odds = (offer.score() - score) / 2.0;
                match alternatives
                    .iter_mut()
                    .find(|a| a.0.id() == offer.effect.id())
                {
                    Some(a) => a.1 = a.1.max(odds),
                    None => alternatives.push((offer.effect, odds)),
                }
            }
            alternatives.sort_by(|a, b| b.1.total_cmp(&a.1));
            state.terms[i].alternatives = alternatives;
        }
    }
}
