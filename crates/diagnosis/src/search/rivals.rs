//! What the search says of its own answer: effects that would do as well, and crowds of terms that no one cause makes.

use model::effect::Hypothesis;
use model::record::Quantity;

use super::{Candidate, MOST_ALIKE, Search};
use crate::fit::channel::{self, Form, Note, RIVAL_SPAN, State, Term};
use crate::fit::threshold;
use numerics::series::white_by_differences;

impl Search<'_> {
    /// More lines or more steps than separate causes make are one structure that the library does not have, and a note says what
    /// is seen. Lines that are steady stay in the model; of others the strongest one does, and no step.
    pub(super) fn crowds(&self, state: &mut State) -> Vec<Note> {
        let crowd = self.crowd_of_lines(state);
        let mut changed = crowd.is_some();
        let mut notes: Vec<Note> = vec![];
        if let Some(crowd) = crowd {
            if !crowd.held {
                let of_lines = |t: &Term| matches!(t.form, Form::Line(_) | Form::SideBands(..));
                let lines = state.terms.iter().filter(|t| of_lines(t));
                let strongest = lines.map(|t| t.lr).fold(0.0, f64::max);
                state.terms.retain(|t| !of_lines(t) || t.lr == strongest);
                self.as_line(&mut state.terms);
            }
            notes.push(crowd);
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
            let what = format!(
                "jumps at {} s: more than single events make",
                told.join(", ")
            );
            notes.push(Note {
                what,
                at: vec![],
                held: false,
            });
            state.terms.retain(|t| !matches!(t.form, Form::Step(..)));
            changed = true;
        }
        if changed {
            self.settle(state);
        }
        notes
    }

    /// What is no steady line swings in no single time: it is a line and no more.
    fn as_line(&self, terms: &mut [Term]) {
        let line = self
            .candidates
            .iter()
            .position(|c| matches!(c.hypothesis, Hypothesis::Line));
        for t in terms {
            if let (Form::SideBands(carrier, _), Some(i)) = (&t.form, line) {
                t.form = Form::Line(*carrier);
                t.effect = self.candidates[i].effect;
                t.candidate = i;
                t.columns.truncate(2);
                t.names.truncate(2);
                t.threshold = threshold::line(self.panel.bins.n);
            }
        }
    }

    /// Estimate again after terms, or the data, were changed by hand.
    pub(crate) fn settle(&self, state: &mut State) {
        let terms = std::mem::take(&mut state.terms);
        let before = std::mem::replace(state, self.refit(terms, state.noise.log_walk));
        (state.notes, state.level) = (before.notes, before.level);
        state.power_law = before.power_law;
        self.reweigh(state);
    }

    /// Likelihood ratio that a term cannot have because the gyro that it follows is noisy itself: a share `a` of its noise
    /// is in the column, and not in the data.
    fn lost_to_noise(&self, state: &State, offer: &Term) -> f64 {
        let followed = self.view.signals.iter().find(|s| {
            s.moving && s.quantity == Quantity::Gyro && offer.follows.as_deref() == Some(&s.name)
        });
        let Some(signal) = followed else { return 0.0 };
        let columns = [state.columns(), offer.columns.clone()].concat();
        let solution = self
            .panel
            .solve(&state.noise.over(&self.panel.bins), &columns);
        let share = solution.beta.last().copied().unwrap_or(0.0);
        let noise = share * share * white_by_differences(&signal.values);
        self.panel.bins.n as f64 * (noise / solution.white).ln_1p()
    }

    /// Put every other effect that would do as well in the place of a term beside it. One that does better, for the noise
    /// of the gyro that it follows or for the parameter that it needs less, takes the place. A line of a `crowd` has no name that
    /// another could take.
    pub(super) fn find_rivals(&self, state: &mut State, crowd: bool) {
        for i in 0..state.terms.len() {
            let line = matches!(state.terms[i].form, Form::Line(_));
            if state.terms[i].stated.is_some() || (crowd && line) {
                continue;
            }
            let rest = self.without(state, i);
            let own = state.terms[i].effect.id();
            let extended = state.terms[i].effect.extends();
            let score = state.terms[i].score();
            let mut alternatives = std::mem::take(&mut state.terms[i].alternatives);
            let mut better: Option<(Term, f64)> = None;
            // What else a band may be, its envelope has told.
            let band = state.terms[i].is_band();
            let asked = |c: &Candidate| {
                let peak = matches!(&c.hypothesis, Hypothesis::Covariance(c) if c.is_peak());
                c.effect.id() != own && c.effect.id() != channel::ID && !(band && peak)
            };
            for offer in self.offers(&rest, &asked) {
                let lost = self.lost_to_noise(&rest, &offer);
                let close = offer.score() > 0.0 && offer.score() + lost > score - RIVAL_SPAN;
                // The narrower case of an extension that needed more than it is no rival.
                if !close
                    || extended == Some(offer.effect.id())
                    || offer.effect.extends() == Some(own)
                {
                    continue;
                }
                // A parameter that is not needed costs ln n (Schwarz).
                let fewer = state.terms[i].effect.ends_in() == Some(offer.effect.id());
                let saved = if fewer {
                    let more = offer.threshold - state.terms[i].threshold;
                    (self.panel.bins.n as f64).ln() + more
                } else {
                    0.0
                };
                let odds = (offer.score() + lost + saved - score) / 2.0;
                match alternatives
                    .iter_mut()
                    .find(|a| a.0.id() == offer.effect.id())
                {
                    Some(a) => a.1 = a.1.max(odds),
                    None => alternatives.push((offer.effect, odds)),
                }
                if (lost > 0.0 || fewer) && odds > better.as_ref().map_or(0.0, |b| b.1) {
                    better = Some((offer, odds));
                }
            }
            if let Some((offer, by)) = better {
                alternatives.retain(|a| a.0.id() != offer.effect.id());
                alternatives.iter_mut().for_each(|a| a.1 -= by);
                alternatives.push((state.terms[i].effect, -by));
                state.terms[i] = offer;
                self.settle(state);
            }
            alternatives.sort_by(|a, b| b.1.total_cmp(&a.1));
            state.terms[i].alternatives = alternatives;
        }
    }
}
