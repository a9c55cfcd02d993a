//! One line that wanders is set aside, so that the rest of the channel can be told.
//!
//! A mode that something drives, or a motor whose speed drifts, fills a band about its frequency. As lines it takes all
//! terms that a channel may have, and as noise it raises the white level: steps, slopes and processes beside it are then
//! lost or withheld. The strongest line stands for it, a note says what is left of it; there the coefficients are taken
//! down to the energy of the noise about the band, and the search goes on. It keeps the name of a line where its size is
//! steady (`envelope`).

use std::f64::consts::{PI, TAU};

use super::envelope::{STEADY, swing};
use super::{MOST_ALIKE, Search};
use crate::fit::channel::{Form, Note, State, Term, Wandering};
use crate::fit::likelihood::Noise;
use crate::fit::scan::residual;
use crate::fit::threshold;
use crate::numerics::tails;

/// Span of a crowd of lines over their frequency, below which they are one that wanders.
const WANDERING: f64 = 0.02;
/// Part of its frequency by which the band reaches beyond the outermost lines, and coefficients at least.
const AROUND: f64 = 0.01;
const LEAST_AROUND: f64 = 20.0;
/// Half the width over which its energy is smoothed, coefficients.
const SMOOTH: usize = 8;
/// A skirt goes on while so many coefficients hold that much more than the noise (four errors of it), up to a part of the
/// frequency.
const STRETCH: usize = 60;
const SKIRT: f64 = 1.7;
const FARTHEST: f64 = 0.1;

fn omega_of(t: &Term) -> Option<f64> {
    match t.form {
        Form::Line(w) | Form::SideBands(w, _) => Some(w),
        _ => None,
    }
}

/// What was done to a band.
struct Evened {
    /// Energy that was there over that of the noise.
    left: f64,
    /// First coefficient, and the end.
    from: usize,
    to: usize,
    /// Whether it is a tone of steady size.
    steady: bool,
}

/// Lowest and highest of the most that lie within the span of one that wanders.
fn narrowest(omegas: &[f64]) -> Option<(f64, f64, usize)> {
    let mut sorted = omegas.to_vec();
    sorted.sort_by(f64::total_cmp);
    let from = |i: usize| {
        let inside = sorted[i..]
            .iter()
            .take_while(|w| **w - sorted[i] < WANDERING * **w);
        let count = inside.count();
        (sorted[i], sorted[i + count - 1], count)
    };
    (0..sorted.len()).map(from).max_by_key(|c| c.2)
}

impl Search<'_> {
    /// The channel without the rest of a line that wanders, a note of it, and where it is if it is a line still; nothing
    /// where no line does.
    pub(super) fn set_aside(&self, state: &State) -> Option<(State, Note, Option<Wandering>)> {
        let omegas: Vec<f64> = state.terms.iter().filter_map(omega_of).collect();
        let (low, high, count) = narrowest(&omegas)?;
        if count <= MOST_ALIKE || omegas.len() - count > MOST_ALIKE {
            return None;
        }
        let inside = |w: f64| w >= low && w <= high;
        let crowd = state.terms.iter().filter_map(|t| {
            let w = omega_of(t).filter(|w| inside(*w))?;
            Some((w, t.lr))
        });
        let (line, strongest) = crowd.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let mut terms = state.terms.clone();
        terms.retain(|t| omega_of(t).is_none_or(|w| !inside(w)) || t.lr == strongest);
        self.as_line(&mut terms);
        let rest = self.refit(terms, state.noise.log_walk);
        let n = self.panel.bins.n;
        let to_k = n as f64 / PI;
        let around = (AROUND * high * to_k).max(LEAST_AROUND);
        let from = (low * to_k - around).max(1.0) as usize;
        let to = ((high * to_k + around) as usize + 1).min(n);
        let Evened {
            left,
            from,
            to,
            steady,
        } = self.even_out(&rest, from, to)?;
        let seen = if steady {
            "one line whose frequency or amplitude wanders"
        } else {
            "a mode that noise drives, or a tone that comes and goes"
        };
        let hz = self.view.rate_hz / TAU;
        let note = Note {
            what: format!(
                "{count} lines from {:.3} to {:.3} Hz: {seen}; beside it {left:.1} times the energy of the noise, set aside from {:.3} to {:.3} Hz",
                low * hz,
                high * hz,
                from as f64 / to_k * hz,
                to as f64 / to_k * hz,
            ),
            at: Some((from as f64 / to_k, to as f64 / to_k)),
        };
        let wandering = Wandering {
            line,
            half: 0.5 * (high - low),
        };
        let state = self.refit(rest.terms, rest.noise.log_walk);
        Some((state, note, steady.then_some(wandering)))
    }

    /// Take what a state leaves from coefficient `from` to `to`, and on either side while more than the noise is there, down
    /// to the noise about.
    fn even_out(&self, state: &State, from: usize, to: usize) -> Option<Evened> {
        let r = residual(&self.panel, &state.columns(), &state.solution);
        let g = Noise::everywhere(&state.noise, &self.panel.bins);
        let n = r.len();
        let width = to - from;
        let (low, high) = (
            from.saturating_sub(8 * width).max(1),
            (to + 8 * width).min(n),
        );
        let scaled = |k: usize| r[k] * r[k] / g[k];
        let mut about: Vec<f64> = (low..from).chain(to..high).map(scaled).collect();
        if about.is_empty() {
            return None;
        }
        let middle = about.len() / 2;
        let white = *about.select_nth_unstable_by(middle, f64::total_cmp).1 / tails::MEDIAN;
        let mean = |a: usize, b: usize| (a..b).map(scaled).sum::<f64>() / (b - a) as f64 / white;
        let (mut from, mut to) = (from, to);
        let farthest = (FARTHEST * to as f64) as usize;
        let (first, last) = (
            from.saturating_sub(farthest).max(STRETCH),
            (to + farthest).min(n),
        );
        while from >= first + STRETCH && mean(from - STRETCH, from) > SKIRT {
            from -= STRETCH;
        }
        while to + STRETCH <= last && mean(to, to + STRETCH) > SKIRT {
            to += STRETCH;
        }
        let energy: Vec<f64> = (from..to)
            .map(|k| {
                let (a, b) = (k.saturating_sub(SMOOTH).max(from), (k + SMOOTH + 1).min(to));
                mean(a, b)
            })
            .collect();
        let mut y = self.panel.column(0).to_vec();
        // The line that stands for the band is a part of it.
        let whole = self.with_lines(state, &r, from, to);
        let whole = whole.iter().zip(&g[from..to]);
        let whole: Vec<f64> = whole.map(|(c, g)| c / (g * white).sqrt()).collect();
        let steady = swing(&whole) < STEADY;
        for (k, energy) in (from..to).zip(&energy) {
            y[k] += r[k] * (energy.max(1.0).sqrt().recip() - 1.0);
        }
        self.panel.replace_data(y);
        Some(Evened {
            left: energy.iter().sum::<f64>() / energy.len() as f64,
            from,
            to,
            steady,
        })
    }

    /// Coefficients `from` to `to` of the residual `r` with the lines of a state that lie there.
    fn with_lines(&self, state: &State, r: &[f64], from: usize, to: usize) -> Vec<f64> {
        let mut whole = r[from..to].to_vec();
        let to_k = self.panel.bins.n as f64 / PI;
        let inside = |w: f64| w * to_k >= from as f64 && w * to_k <= to as f64;
        for (t, own) in state.parts() {
            if omega_of(t).is_some_and(inside) {
                self.panel.add_columns(&mut whole, from, &t.columns, own);
            }
        }
        whole
    }

    /// What wanders swings in no single time: it is a line and no more.
    pub(super) fn as_line(&self, terms: &mut [Term]) {
        use model::effect::Hypothesis;
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_crowd_is_found_beside_a_line_of_its_own() {
        let omegas = [0.31, 0.312, 0.52, 0.3115, 0.313];
        assert_eq!(narrowest(&omegas), Some((0.31, 0.313, 4)));
        // A chirp has no place.
        assert!(narrowest(&[0.1, 0.2, 0.3, 0.4]).unwrap().2 == 1);
        assert_eq!(narrowest(&[]), None);
    }
}
