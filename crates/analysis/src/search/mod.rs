//! Forward stagewise search for the causes in one channel: every hypothesis of every effect is weighed with the random
//! walk refitted, the best one joins, covariance terms are challenged by what they may have swallowed, and what the
//! others make superfluous is dropped. The search knows hypotheses, not effects.

mod envelope;
mod excise;
pub(crate) mod impute;
pub(crate) mod power_law;
mod process_pairs;
mod refine;
mod rivals;
mod score;

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;

use model::effect::{Effect, Hypothesis, Shape, View};
use model::effects::EFFECTS;
use model::record::Quantity;

use crate::criticise::process::LEAST_CHANCE;
use crate::criticise::residual::Outcome;
use crate::features;
use crate::fit::likelihood::{Noise, Panel, Solution};
use crate::fit::threshold;
use power_law::PowerLawFound;

/// Most terms on one channel.
const MOST_TERMS: usize = 8;
/// Most lines, and most steps, that are told as separate causes.
pub const MOST_ALIKE: usize = 2;
/// Scores closer than this (twice 3 nats) leave the answer open.
pub const RIVAL_SPAN: f64 = 6.0;
/// Fewest cycles of a line in the record.
const LEAST_CYCLES: f64 = 3.0;
/// A swing of a line is slow up to here, Hz; faster ones are sought up to this share of the line's own frequency, beyond
/// which side bands are lines like others; and fewest swings in the record.
const SLOW_BEAT_HZ: f64 = 0.6;
const FASTEST_BEAT: f64 = 0.25;
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
    /// What its name claims, where a contest has weighed that.
    pub claims: Vec<Outcome>,
}

impl Term {
    /// A term of candidate number `candidate`, not weighed yet.
    pub(crate) fn new(
        effect: &'static dyn Effect,
        candidate: usize,
        form: Form,
        threshold: f64,
    ) -> Self {
        Self {
            effect,
            candidate,
            form,
            columns: vec![],
            names: vec![],
            fixed: vec![],
            follows: None,
            lr: 0.0,
            threshold,
            alternatives: vec![],
            stated: None,
            claims: vec![],
        }
    }

    /// Likelihood ratio beyond the threshold.
    #[must_use]
    pub fn score(&self) -> f64 {
        self.lr - self.threshold
    }

    /// Whether it is a process that is added.
    pub(crate) fn is_process(&self) -> bool {
        matches!(&self.form, Form::Covariance(c, _) if !c.filters_white())
    }

    /// Whether it is a filter that the white noise goes through.
    pub(crate) fn is_filter(&self) -> bool {
        self.is_covariance() && !self.is_process()
    }

    pub(crate) fn is_covariance(&self) -> bool {
        matches!(self.form, Form::Covariance(..))
    }

    fn has_no_name(&self) -> bool {
        self.effect.id() == features::ID
    }

    /// Whether it has the freedom to stand for several terms of the library.
    fn may_swallow(&self) -> bool {
        self.is_covariance() || self.has_no_name()
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
    /// What it has to reach beyond its threshold.
    handicap: f64,
}

impl Candidate {
    /// Columns of the panel that a regression uses.
    #[must_use]
    pub fn columns(&self) -> &[usize] {
        &self.columns
    }

    /// A shape's coordinates that are tried first, with the columns there.
    pub(crate) fn grid(&self) -> &[(f64, Vec<usize>)] {
        &self.grid
    }

    /// How many hypotheses its effect offers.
    pub(crate) fn siblings(&self) -> usize {
        self.siblings
    }

    /// The same, and those of a shape at every point of its grid.
    pub(crate) fn all_columns(&self) -> impl Iterator<Item = usize> {
        let grid = self.grid.iter().flat_map(|(_, columns)| columns);
        self.columns.iter().chain(grid).copied()
    }
}

/// Structure that was seen and that no single effect explains.
#[derive(Clone, Debug)]
pub struct Note {
    /// What is seen.
    pub what: String,
    /// Lowest and highest angular frequency, rad per sample, where it has such a place.
    pub at: Option<(f64, f64)>,
}

/// The narrow crowd that a line is the strongest one of, rad per sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wandering {
    /// Angular frequency of the line.
    pub line: f64,
    /// Half the width of the crowd.
    pub half: f64,
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
    pub notes: Vec<Note>,
    /// The line that wanders: a line still, though no steady one.
    pub wandering: Option<Wandering>,
    /// The level of a process that is not Gaussian, where one was named: sample by sample.
    pub level: Option<Rc<Vec<f64>>>,
    /// The one power law that explains as much as the processes.
    pub power_law: Option<PowerLawFound>,
    /// How much wider lost readings make the errors of the noise: of the white variance, the random walk, the coordinates of
    /// the terms; none where they are few.
    pub wider: Vec<f64>,
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

    /// Whether a line of that angular frequency is the one that wanders.
    pub(crate) fn wanders(&self, omega: f64) -> Option<Wandering> {
        self.wandering.filter(|w| (w.line - omega).abs() <= w.half)
    }

    /// Every term with the coefficients of its columns.
    pub(crate) fn parts(&self) -> impl Iterator<Item = (&Term, &[f64])> {
        let mut rest = self.solution.beta.as_slice();
        self.terms.iter().map(move |t| {
            let (own, others) = rest.split_at(t.columns.len());
            rest = others;
            (t, own)
        })
    }

    /// Angular frequencies of the lines, with the places of their columns.
    fn lines(&self) -> Vec<(f64, usize)> {
        let mut at = 0;
        let mut all = vec![];
        for t in &self.terms {
            if let Form::Line(omega) | Form::SideBands(omega, _) = t.form {
                all.push((omega, at));
            }
            at += t.columns.len();
        }
        all
    }

    /// Angular frequency of the first line, and phase p of its cos(w t + p).
    fn carrier(&self) -> Option<(f64, f64)> {
        self.parts().find_map(|(t, own)| match (&t.form, own) {
            (Form::Line(omega), [c, s, ..]) => Some((*omega, (-s).atan2(*c))),
            _ => None,
        })
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
    /// Part of the readings that was read.
    pub read: f64,
    /// What candidates offered to states without processes.
    offered: RefCell<HashMap<Place, HashMap<usize, Option<Term>>>>,
}

/// What a state without processes is known by: the data's revision, its random walk, its terms with their columns.
type Place = (usize, u64, Vec<(usize, Vec<usize>)>);

impl<'a> Search<'a> {
    /// Lay out all hypotheses for a channel.
    #[must_use]
    pub fn new(panel: Panel, view: View<'a>) -> Self {
        let mut candidates = vec![];
        let mut not_tested = vec![];
        // What follows a thermometer of this axis is no column of another one.
        let own = |follows: &str| {
            let mut thermometers = view
                .signals
                .iter()
                .filter(|s| s.quantity == Quantity::Temp && s.axis.is_some());
            thermometers.any(|s| follows.contains(&s.name))
        };
        for effect in EFFECTS {
            let hypotheses = match effect.hypotheses(&view) {
                Err(why) => {
                    not_tested.push((effect.id(), why));
                    continue;
                }
                Ok(hypotheses) => hypotheses,
            };
            let siblings = hypotheses.len();
            for mut hypothesis in hypotheses {
                let follows = match &hypothesis {
                    Hypothesis::Regression(r) => r.follows.as_deref(),
                    _ => None,
                };
                let common = !follows.is_some_and(own);
                let columns = match &mut hypothesis {
                    // The panel has them now.
                    Hypothesis::Regression(r) => {
                        let columns = r.columns.iter_mut();
                        let values = columns.map(|c| std::mem::take(&mut c.values));
                        panel.add_candidate(&values.collect::<Vec<_>>(), common)
                    }
                    _ => vec![],
                };
                let grid = match &hypothesis {
                    Hypothesis::Shaped(s) => s
                        .grid()
                        .into_iter()
                        .map(|at| {
                            let columns = s.columns(at).into_iter().map(|c| c.values);
                            let columns: Vec<Vec<f64>> = columns.collect();
                            (at, panel.add_candidate(&columns, common))
                        })
                        .collect(),
                    _ => vec![],
                };
                candidates.push(Candidate {
                    effect: *effect,
                    hypothesis,
                    columns,
                    grid,
                    siblings,
                    handicap: 0.0,
                });
            }
        }
        let unknown = features::combinations(&view);
        let siblings = unknown.len();
        for combination in unknown {
            let common = !own(&combination.what);
            let columns = panel.add_named(&combination.what, common, &combination.columns);
            candidates.push(Candidate {
                effect: &features::EFFECT,
                hypothesis: combination.hypothesis(columns.len()),
                columns,
                grid: vec![],
                siblings,
                // A cause of the library that does as well goes before a combination that has no name.
                handicap: RIVAL_SPAN,
            });
        }
        Self {
            panel,
            view,
            candidates,
            not_tested,
            read: 1.0,
            offered: RefCell::default(),
        }
    }

    /// The channel that a term follows; what has a shape of its own follows what else of its effect does.
    pub(crate) fn followed<'b>(&'b self, term: &'b Term) -> Option<&'b str> {
        let of_effect = || {
            let own = |c: &&Candidate| c.effect.id() == term.effect.id();
            self.candidates
                .iter()
                .filter(own)
                .find_map(|c| match &c.hypothesis {
                    Hypothesis::Regression(r) => r.follows.as_deref(),
                    _ => None,
                })
        };
        let shaped = matches!(term.form, Form::Shaped(..));
        let of_shape = || of_effect().filter(|_| shaped);
        term.follows.as_deref().or_else(of_shape)
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
            wandering: None,
            level: None,
            power_law: None,
            wider: vec![],
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

    /// What of a likelihood ratio of the spectrum the readings have earned that there are: those that were filled by the
    /// spectrum repeat what it has by chance, which makes each departure larger by the part that was lost.
    fn of_read(&self) -> f64 {
        self.read * self.read
    }

    fn without(&self, state: &State, i: usize) -> State {
        let mut terms = state.terms.clone();
        terms.remove(i);
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
                state.terms[i].lr = (self.of_read() * state.terms[i].lr).max(0.0);
            }
        }
    }

    /// Total score: likelihood beyond what all thresholds ask.
    fn total(state: &State) -> f64 {
        2.0 * state.solution.log_likelihood - state.terms.iter().map(|t| t.threshold).sum::<f64>()
    }

    /// White noise and a random walk alone.
    #[must_use]
    pub fn baseline(&self, start: &Noise) -> State {
        self.refit(vec![], start.log_walk)
    }

    /// Search from the baseline. What is set aside on the way is no longer in the data of the panel.
    #[must_use]
    pub fn run(&self, baseline: State) -> State {
        let mut state = self.climb(baseline);
        let aside = self.set_aside(&state);
        if let Some((rest, _, _)) = &aside {
            state = self.climb(rest.clone());
        }
        state = self.pair_up(state);
        state = crate::two_level::compare::hold(self, state);
        let mut notes = std::mem::take(&mut state.notes);
        if let Some((_, note, wandering)) = aside {
            notes.push(note);
            state.wandering = wandering;
        }
        notes.extend(self.crowds(&mut state));
        self.find_rivals(&mut state);
        state.power_law = power_law::instead(self, &state);
        state.notes = notes;
        state
    }

    /// Add terms while they pass, then drop what the others made superfluous.
    fn climb(&self, mut state: State) -> State {
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
                return state;
            };
            state = self.without(&state, i);
        }
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
        let best = narrower.unwrap_or(best);
        // Of one effect's shapes that do about as well, the first listed is the plain one.
        let plain = offers
            .iter()
            .filter(|o| o.effect.id() == best.effect.id() && o.candidate < best.candidate)
            .filter(|_| matches!(best.form, Form::Columns | Form::Shaped(..)))
            .find(|o| o.score() > 0.0 && o.score() > best.score() - RIVAL_SPAN);
        Some(plain.unwrap_or(best).clone())
    }

    /// A term that swallowed others gives way to them: a covariance to regressors, a combination to what has a name.
    fn swap(&self, state: State) -> State {
        let mut best = state;
        for i in (0..best.terms.len()).rev() {
            let Some(term) = best.terms.get(i).filter(|t| t.may_swallow()) else {
                continue;
            };
            let covariance = term.is_covariance();
            let mut rest = self.without(&best, i);
            // Up to three terms may share what the one took.
            for _ in 0..3 {
                let offers = self.offers(&rest, &|c| {
                    if covariance {
                        !matches!(c.hypothesis, Hypothesis::Covariance(_))
                    } else {
                        c.effect.id() != features::ID
                    }
                });
                let Some(offer) = Self::simplest_best(offers) else {
                    break;
                };
                if offer.score() <= 0.0 {
                    break;
                }
                rest = self.accept(&rest, offer);
                let ahead = if covariance {
                    Self::total(&rest) - Self::total(&best)
                } else {
                    // Each has passed its threshold: what has a name needs to do as well, no better, but for what the
                    // other gains by chance with more columns.
                    let by_chance = match best.columns().len().saturating_sub(rest.columns().len())
                    {
                        0 => 0.0,
                        more => threshold::tail(more, LEAST_CHANCE),
                    };
                    2.0 * (rest.solution.log_likelihood - best.solution.log_likelihood)
                        + RIVAL_SPAN.max(by_chance)
                };
                if ahead > 0.0 {
                    best = rest;
                    break;
                }
            }
        }
        best
    }
}
