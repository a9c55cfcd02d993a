//! Forward stagewise search for the causes in one channel: every hypothesis of every effect is weighed with the random
//! walk refitted, the best one joins, covariance terms are challenged by what they may have swallowed, and what the
//! others make superfluous is dropped. The search knows hypotheses, not effects.

mod any_spectrum;
mod band_alone;
pub(crate) mod band_source;
pub(crate) mod bands;
mod beyond;
mod candidates;
mod combs;
pub(crate) mod envelope;
mod harmonic;
pub(crate) mod impute;
pub(crate) mod power_law;
mod process_for_walk;
mod process_pairs;
mod refine;
mod rivals;
mod score;
pub(crate) mod searched;
mod stretch;
pub(crate) mod tracked;

use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;

use model::effect::{Hypothesis, View};

use crate::fit::channel::{Form, RIVAL_SPAN, State, Term};
use crate::fit::likelihood::{Bins, Dct, Noise, Panel};
use crate::fit::{channel, threshold};
use crate::test_level::CLAIM_LEVEL;
pub use candidates::Candidate;

/// Most terms on one channel.
const MOST_TERMS: usize = 8;
/// Most lines, and most steps, that are told as separate causes.
pub const MOST_ALIKE: usize = 2;

/// Likelihood ratio of the best peak that the search would offer to white noise: what its threshold is calibrated by.
#[must_use]
pub fn peak_of_white(y: &[f64]) -> f64 {
    let n = y.len();
    let (dct, plain) = (Dct::new(n), Arc::new(Bins::new(n)));
    let coefficients = Arc::new(dct.forward(y));
    let mean_square = y.iter().map(|v| v * v).sum::<f64>() / n as f64;
    let start = Noise::new(f64::NEG_INFINITY);
    let peaks = bands::peaks(&coefficients, &start, mean_square, &plain);
    let bins = Arc::new(Bins::about(n, &peaks));
    let view = View {
        channel: "gyro_x",
        axis: None,
        lsb: None,
        white_sigma: mean_square.sqrt(),
        neighbours_sigma: mean_square.sqrt(),
        rate_hz: 1.0,
        samples: n,
        base: None,
        moving: false,
        signals: &[],
    };
    let search = Search::new(Panel::of(&dct, &bins, coefficients), view, false);
    let state = search.baseline(&Noise::new(-9.0));
    let best = search.candidates.iter().enumerate().filter_map(|(i, c)| {
        let Hypothesis::Covariance(c) = &c.hypothesis else {
            return None;
        };
        let term = c.is_peak().then(|| search.weigh_peak(&state, i, c, 0.0));
        Some(term??.lr)
    });
    best.fold(0.0, f64::max)
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
    /// Lay out all hypotheses for a channel; of one in `bursts` that are laid end to end those that such a record can tell of.
    #[must_use]
    pub fn new(panel: Panel, view: View<'a>, bursts: bool) -> Self {
        let (candidates, not_tested) = candidates::all(&panel, &view, bursts);
        Self {
            panel,
            view,
            candidates,
            not_tested,
            read: 1.0,
            offered: RefCell::default(),
        }
    }

    /// What a term follows, in words; what has a shape of its own follows what else of its effect does.
    pub(crate) fn followed<'b>(&'b self, term: &'b Term) -> Option<&'b str> {
        let of_effect = || match &self.follower_beside(term)?.hypothesis {
            Hypothesis::Regression(r) => r.follows.as_deref(),
            _ => None,
        };
        term.follows.as_deref().or_else(of_effect)
    }

    /// Names of the recorded channels that a term follows, in the same way.
    pub(crate) fn sources<'b>(&'b self, term: &'b Term) -> &'b [String] {
        match self.follower_beside(term) {
            Some(c) if term.follows.is_none() => &c.of,
            _ => &term.of,
        }
    }

    /// The first hypothesis of the effect of a shape that follows a channel.
    fn follower_beside(&self, term: &Term) -> Option<&Candidate> {
        let own = |c: &&Candidate| {
            let follows = matches!(&c.hypothesis, Hypothesis::Regression(r) if r.follows.is_some());
            follows && c.effect.id() == term.effect.id()
        };
        let shaped = matches!(term.form, Form::Shaped(..));
        self.candidates.iter().find(own).filter(|_| shaped)
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
    pub(crate) fn total(state: &State) -> f64 {
        2.0 * state.solution.log_likelihood - state.terms.iter().map(|t| t.threshold).sum::<f64>()
    }

    /// White noise and a random walk alone.
    #[must_use]
    pub fn baseline(&self, start: &Noise) -> State {
        self.refit(vec![], start.log_walk)
    }

    /// Search from the baseline.
    #[must_use]
    pub fn ascend(&self, baseline: State) -> State {
        self.or_process_for_walk(self.pair_up(self.climb(baseline)))
    }

    /// The end of a search, once whole explanations have been compared: what is told beside the terms, and their rivals.
    #[must_use]
    pub fn conclude(&self, mut state: State) -> State {
        let mut notes = std::mem::take(&mut state.notes);
        notes.extend(self.crowds(&mut state));
        self.name_bands(&mut state);
        let crowd = notes.iter().any(|note| note.held);
        self.find_rivals(&mut state, crowd);
        state.power_law = power_law::instead(self, &state);
        state.notes = notes;
        state
    }

    /// Add terms while they pass, then drop what the others made superfluous.
    fn climb(&self, mut state: State) -> State {
        state = self.grown_with_teeth(state);
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

    /// The state with terms that pass, up to so many in all.
    fn grown(&self, mut state: State, most: usize) -> State {
        while state.terms.len() < most {
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
        state
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
            if let Some(other) = self.in_the_place_of(&best, i) {
                best = other;
            }
        }
        best
    }

    /// The state with up to three terms in the place of one that may have swallowed them, where they do as well.
    fn in_the_place_of(&self, state: &State, i: usize) -> Option<State> {
        let term = state.terms.get(i).filter(|t| t.may_swallow())?;
        let (covariance, band) = (term.is_covariance(), term.is_band());
        let allow = |c: &Candidate| {
            if band {
                // What stands at one frequency has taken what does.
                matches!(c.hypothesis, Hypothesis::Line | Hypothesis::SideBands)
            } else if covariance {
                !matches!(c.hypothesis, Hypothesis::Covariance(_))
            } else {
                c.effect.id() != channel::ID
            }
        };
        let mut rest = self.cleared_of(state, i);
        for others in 0..=3 {
            if others > 0 {
                let offer = Self::simplest_best(self.offers(&rest, &allow));
                rest = self.accept(&rest, offer.filter(|o| o.score() > 0.0)?);
                if Self::as_good(state, &rest, covariance) {
                    return Some(rest);
                }
            }
            // It holds what has a name: the name takes its own part, and leaves it what is beyond.
            if self.spans_part(&rest, term) {
                return Some(self.accept(&rest, term.clone()));
            }
        }
        None
    }

    /// Whether a state does as well as one of which a term gave way.
    fn as_good(than: &State, state: &State, covariance: bool) -> bool {
        if covariance {
            return Self::total(state) > Self::total(than);
        }
        // Each has passed its threshold: what has a name needs to do as well, no better, but for what the other gains by chance
        // with more columns.
        let by_chance = match than.columns().len().saturating_sub(state.columns().len()) {
            0 => 0.0,
            more => threshold::tail(more, CLAIM_LEVEL),
        };
        let lost = 2.0 * (than.solution.log_likelihood - state.solution.log_likelihood);
        lost < RIVAL_SPAN.max(by_chance)
    }
}
