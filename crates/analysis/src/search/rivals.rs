//! What the search says of its own answer: effects that would do as well, and crowds of terms that no one cause makes.

use std::f64::consts::PI;

use model::effect::Hypothesis;

use super::{Form, MOST_ALIKE, RIVAL_SPAN, Search, State};

/// Span of a crowd of lines over their frequency, below which they are one that wanders.
const WANDERING: f64 = 0.02;

/// Largest harmonic that is sought; a higher one would fit too many frequencies.
const HIGHEST_HARMONIC: u32 = 7;

/// Of two lines of (frequency in Hz, likelihood ratio), the lower one and the multiple of it at which the other lies
/// within three standard errors of a frequency, sqrt(3 / LR) / (pi T) each; `per_record` is 1 / T. Two lines with
/// nothing to do with each other meet that by chance only.
fn harmonics(lines: &[(f64, f64)], per_record: f64) -> Option<(f64, u32)> {
    let [a, b] = lines else {
        return None;
    };
    let (low, high) = if a.0 < b.0 { (a, b) } else { (b, a) };
    let error = |l: &(f64, f64)| per_record / PI * (3.0 / l.1.max(3.0)).sqrt();
    (2..=HIGHEST_HARMONIC).find_map(|k| {
        let off = (high.0 - f64::from(k) * low.0).abs();
        let limit = 3.0 * (f64::from(k) * error(low)).hypot(error(high));
        (off < limit).then_some((low.0, k))
    })
}

impl Search<'_> {
    /// More lines or more steps than separate causes make are one structure that the library does not have: the
    /// strongest line stays, the steps go, and a note says what is seen.
    pub(super) fn crowds(&self, state: &mut State) -> Vec<String> {
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
        if let Some((low, times)) = harmonics(&lines, self.view.rate_hz / self.panel.bins.n as f64)
        {
            notes.push(format!(
                "lines at {low:.4} Hz and {times} times that: one motion that repeats, and is no sine"
            ));
        }
        if lines.len() > MOST_ALIKE {
            let (low, high) = lines
                .iter()
                .fold((f64::INFINITY, 0.0f64), |(l, h), (f, _)| {
                    (l.min(*f), h.max(*f))
                });
            state.wandering = high - low < WANDERING * high;
            let seen = if state.wandering {
                "one line whose frequency or amplitude wanders"
            } else {
                "no steady line but a band, a chirp or harmonics"
            };
            notes.push(format!(
                "{} lines from {low:.3} to {high:.3} Hz: {seen}",
                lines.len()
            ));
            let strongest = lines.iter().map(|l| l.1).fold(0.0, f64::max);
            state.terms.retain(|t| {
                !matches!(t.form, Form::Line(_) | Form::SideBands(..)) || t.lr == strongest
            });
            // What wanders swings in no single time: it is a line and no more.
            let line = self
                .candidates
                .iter()
                .position(|c| matches!(c.hypothesis, Hypothesis::Line));
            for t in &mut state.terms {
                if let (Form::SideBands(carrier, _), Some(i)) = (&t.form, line) {
                    t.form = Form::Line(*carrier);
                    t.effect = self.candidates[i].effect;
                    t.candidate = i;
                    t.columns.truncate(2);
                    t.names.truncate(2);
                    t.threshold = crate::threshold::line(self.panel.bins.n);
                }
            }
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
            let wandering = state.wandering;
            *state = self.refit(std::mem::take(&mut state.terms), state.noise.log_walk);
            state.wandering = wandering;
            self.reweigh(state);
        }
        notes
    }

    /// Put every other effect that would do as well in the place of a term beside it.
    pub(super) fn find_rivals(&self, state: &mut State) {
        for i in 0..state.terms.len() {
            if state.terms[i].stated.is_some() {
                continue;
            }
            let rest = self.without(state, i);
            let own = state.terms[i].effect.id();
            let extended = state.terms[i].effect.extends();
            let score = state.terms[i].score();
            let mut alternatives = std::mem::take(&mut state.terms[i].alternatives);
            for offer in self.offers(&rest, &|c| {
                c.effect.id() != own && c.effect.id() != crate::beyond::ID
            }) {
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
