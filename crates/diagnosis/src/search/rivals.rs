//! What the search says of its own answer: effects that would do as well, and crowds of terms that no one cause makes.

use std::f64::consts::PI;

use model::effect::Hypothesis;
use model::record::Quantity;

use super::{Candidate, MOST_ALIKE, Search};
use crate::fit::channel::{self, Form, Note, RIVAL_SPAN, State, Term};
use crate::fit::threshold;
use numerics::series::white_by_differences;

/// Part of its frequency by which a crowd of lines reaches beyond the outermost ones.
const AROUND: f64 = 0.02;

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

/// Highest multiple in a comb of lines, and the largest part of a fundamental that a line may lie beside its multiple:
/// any lines fit a comb that is fine enough.
const HIGHEST_TOOTH: f64 = 24.0;
const LARGEST_MISS: f64 = 0.1;

/// The fundamental of which three or more lines of (frequency in Hz, likelihood ratio) are multiples, within three
/// standard errors, and which ones; the highest that fits.
fn comb(lines: &[(f64, f64)], per_record: f64) -> Option<(f64, Vec<u32>)> {
    let error = |l: &(f64, f64)| per_record / PI * (3.0 / l.1.max(3.0)).sqrt();
    let mut sorted = lines.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let lowest = sorted.first()?;
    let apart = sorted.windows(2).map(|w| w[1].0 - w[0].0);
    let mut starts: Vec<f64> = (1..=4)
        .map(|k| lowest.0 / f64::from(k))
        .chain(apart)
        .collect();
    starts.sort_by(|a, b| b.total_cmp(a));
    starts.into_iter().find_map(|start| {
        let mut f = start;
        // From the lowest tooth up, each line narrows the fundamental.
        for _ in 0..2 {
            let (mut top, mut bottom) = (0.0, 0.0);
            for l in &sorted {
                let k = (l.0 / f).round().max(1.0);
                let weight = (k / error(l)).powi(2);
                top += weight * l.0 / k;
                bottom += weight;
                f = top / bottom;
            }
        }
        let teeth: Vec<u32> = sorted.iter().map(|l| (l.0 / f).round() as u32).collect();
        let fits = |(l, k): (&(f64, f64), &u32)| {
            let miss = (l.0 - f64::from(*k) * f).abs();
            *k > 0
                && f64::from(*k) <= HIGHEST_TOOTH
                && miss < (3.0 * error(l)).min(LARGEST_MISS * f)
        };
        let apart = teeth.windows(2).all(|w| w[1] > w[0]);
        (apart && sorted.iter().zip(&teeth).all(fits)).then_some((f, teeth))
    })
}

impl Search<'_> {
    /// More lines or more steps than separate causes make are one structure that the library does not have: the
    /// strongest line stays, the steps go, and a note says what is seen.
    pub(super) fn crowds(&self, state: &mut State) -> Vec<Note> {
        let mut notes = vec![];
        let hz = |w: f64| w * self.view.rate_hz / std::f64::consts::TAU;
        let lines: Vec<(f64, f64)> = state
            .terms
            .iter()
            .filter_map(|t| match t.form {
                Form::Line(w) | Form::SideBands(w, _) => Some((w, t.lr)),
                _ => None,
            })
            .map(|(w, lr)| (hz(w), lr))
            .collect();
        let span = |low: f64, high: f64| {
            let to_omega = std::f64::consts::TAU / self.view.rate_hz;
            Some((
                low * (1.0 - AROUND) * to_omega,
                high * (1.0 + AROUND) * to_omega,
            ))
        };
        if let Some((low, times)) = harmonics(&lines, self.view.rate_hz / self.panel.bins.n as f64)
        {
            let what = format!(
                "lines at {low:.4} Hz and {times} times that: one motion that repeats, and is no sine"
            );
            let at = span(low, low * f64::from(times));
            notes.push(Note { what, at });
        }
        if lines.len() > MOST_ALIKE {
            let (low, high) = lines
                .iter()
                .fold((f64::INFINITY, 0.0f64), |(l, h), (f, _)| {
                    (l.min(*f), h.max(*f))
                });
            let per_record = self.view.rate_hz / self.panel.bins.n as f64;
            let repeats = comb(&lines, per_record);
            let what = if let Some((fundamental, teeth)) = repeats {
                let teeth: Vec<String> = teeth.iter().map(u32::to_string).collect();
                format!(
                    "lines at {} times {fundamental:.4} Hz: a comb of harmonics, one motion that repeats and is no sine",
                    teeth.join(", ")
                )
            } else {
                format!(
                    "{} lines from {low:.3} to {high:.3} Hz: no steady line but a band or a chirp",
                    lines.len()
                )
            };
            let at = span(low, high);
            notes.push(Note { what, at });
            let strongest = lines.iter().map(|l| l.1).fold(0.0, f64::max);
            state.terms.retain(|t| match t.form {
                Form::Line(_) | Form::SideBands(..) => t.lr == strongest,
                _ => true,
            });
            self.as_line(&mut state.terms);
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
            notes.push(Note { what, at: None });
            state.terms.retain(|t| !matches!(t.form, Form::Step(..)));
        }
        if !notes.is_empty() {
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
    /// of the gyro that it follows or for the parameter that it needs less, takes the place.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comb_is_known_by_its_fundamental_though_teeth_are_missing() {
        let per_record = 1.0 / 600.0;
        let lines: Vec<(f64, f64)> = [3.0, 1.0, 2.0, 5.0]
            .iter()
            .map(|k| (k * 0.7312 + 2e-5 * (k - 2.0), 60.0))
            .collect();
        let (fundamental, teeth) = comb(&lines, per_record).unwrap();
        assert!((fundamental - 0.7312).abs() < 1e-4, "{fundamental}");
        assert_eq!(teeth, vec![1, 2, 3, 5]);
        // Without the fundamental: their distance tells it.
        let odd = [(1.4624, 60.0), (2.1936, 60.0), (5.1184, 60.0)];
        assert_eq!(comb(&odd, per_record).unwrap().1, vec![2, 3, 7]);
    }

    #[test]
    fn lines_of_a_chirp_are_no_comb() {
        let lines = [(1.013, 40.0), (1.371, 50.0), (1.9107, 45.0), (2.833, 60.0)];
        assert_eq!(comb(&lines, 1.0 / 600.0), None);
    }
}
