//! A tone whose pitch wanders so slowly that its phase can be tracked through the record.
//!
//! A mains hum, a motor or a fan has a pitch that stays for seconds or minutes. What such a tone makes of a spectrum is the time that
//! it spent at each frequency, which is neither a line nor a noise of any smooth density: the search lays lines and bands on it, one
//! beside the other. Where the phase can be told block by block ([`phase`]), by all channels together ([`rotor`]), and the tones of a
//! channel ([`parts`]) do better than all of these together, they take their place, the record is searched again without them, and the
//! name stands if nothing is left there.

mod claims;
mod parts;
mod phase;
mod rotor;

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;

use model::effect::{Hypothesis, Peak};
use model::effects::wandering_line;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::Search;
use crate::fit::channel::{Form, Path, State, Term};
use crate::fit::threshold;
use crate::test_level::Outcome;
use claims::claim;
use numerics::column::dot;
use numerics::order_statistics::median;
use numerics::tails;
use phase::{Coordinates, Tracked, tracked};
pub(crate) use rotor::{Rotor, rotors};

/// Half widths of a peak, either side, that its tone is sought in: a normal law of that half width at half power ends at 3.5 of its
/// standard deviations.
const REACH: f64 = 3.0;
/// Coefficients either side of a place, at least.
const LEAST_REACH: f64 = 12.0;
/// How often the reach is doubled: lines and bands laid on a tone need not reach over all of it.
const MOST_DOUBLED: u32 = 6;
/// Fewest blocks.
const LEAST_BLOCKS: usize = 48;
/// Part of what a tone tells at most that the longest blocks which tell of it are looked for.
const ALL_OF_IT: f64 = 0.97;
/// Nats that more of the spectrum about a tone has to tell of it.
const MARGIN: f64 = 8.0;
/// Variance of the phase, rad^2, up to which the linear filter follows it: it slips by a turn hardly ever.
const LARGEST_DOUBT: f64 = 0.1;
/// Correlation times of the pitch in the record, at least: fewer do not tell a process from a course.
const LEAST_TIMES: f64 = 3.0;
/// Relative step of a derivative.
const STEP: f64 = 0.01;

/// Amplitude, frequency, half width, rms of the pitch and its time, each with its error; frequencies in rad per sample, the time in
/// samples.
type Stated = [(f64, f64); 5];

/// Terms about one place, and the angular frequencies that they reach over, rad per sample.
struct Place {
    terms: Vec<usize>,
    from: f64,
    to: f64,
}

/// A tone that was tracked, with its course sample by sample.
struct TrackedTone {
    term: Term,
    course: Vec<f64>,
    /// Nats that its phase gains where it follows the noise of the channel.
    by_itself: f64,
    /// Tones of the rotor that it is one of.
    among: usize,
    from: f64,
    to: f64,
}

/// A tone that was looked for in blocks of that length, turned back by an angular frequency.
struct Attempt {
    seen: Tracked,
    middle: f64,
    length: f64,
}

impl Attempt {
    /// Over the coefficients between angular frequencies, in noise of that density, sought from the law on that one over fewer of them
    /// told; none where the phase is not told there.
    fn over(
        coefficients: &[f64],
        (from, to): (f64, f64),
        density: f64,
        before: Option<&Self>,
    ) -> Option<Self> {
        let n = coefficients.len();
        let to_k = n as f64 / PI;
        // Neither a slow process nor what half the sample rate turns back.
        if from <= 0.0 || to >= PI {
            return None;
        }
        let (from, count) = ((from * to_k) as usize, (0.5 * (to - from) * to_k) as usize);
        if count < LEAST_BLOCKS || from + 2 * count > n {
            return None;
        }
        let middle = (from + count) as f64 / to_k;
        let blocks = turned_back(&coefficients[from..from + 2 * count], middle, n);
        let length = n as f64 / count as f64;
        let before = before.map(|b| b.in_blocks(length, middle));
        let seen = tracked(&blocks, 2.0 * density / length, before);
        let doubt = seen.phase.iter().map(|p| p.1).sum::<f64>() / seen.phase.len() as f64;
        let times = blocks.len() as f64 * (-seen.at[2]).exp();
        (doubt < LARGEST_DOUBT && times > LEAST_TIMES).then_some(Self {
            seen,
            middle,
            length,
        })
    }

    /// Its law in blocks of another length that are turned back by another frequency.
    fn in_blocks(&self, length: f64, middle: f64) -> Coordinates {
        let [amplitude, pitch, time, mean] = self.seen.at;
        let longer = length / self.length;
        let mean = (self.middle + mean / self.length - middle) * length;
        [amplitude, pitch + longer.ln(), time - longer.ln(), mean]
    }

    fn path(&self) -> Path {
        Path {
            amplitude: self.seen.at[0].exp(),
            omega: self.middle,
            length: self.length,
            phase: self.seen.phase.clone(),
            shared: false,
        }
    }

    /// What is told of it.
    fn stated(&self) -> Stated {
        let (seen, block) = (&self.seen, self.length);
        let [amplitude, pitch, time] = [seen.at[0], seen.at[1], seen.at[2]].map(f64::exp);
        let (pitch, time) = (pitch / block, time * block);
        let omega = self.middle + seen.at[3] / block;
        let half = 0.5 * wandering_line::width_at_half_power(pitch, time);
        let error = |of: [f64; 4]| {
            let along = |row: &Vec<f64>| dot(row, &of);
            let rows = seen.covariance.iter().zip(of);
            rows.map(|(row, o)| o * along(row))
                .sum::<f64>()
                .max(0.0)
                .sqrt()
        };
        let unit = |i: usize| std::array::from_fn(|k| f64::from(u8::from(i == k)));
        // By how much the logarithm of the width moves with those of the pitch and its time.
        let width = |p: f64, t: f64| wandering_line::width_at_half_power(p, t).ln();
        let by = 1.0 + STEP;
        let of_width = [
            0.0,
            (width(pitch * by, time) - width(pitch, time)) / by.ln(),
            (width(pitch, time * by) - width(pitch, time)) / by.ln(),
            0.0,
        ];
        [
            (amplitude, amplitude * error(unit(0))),
            (omega, error(unit(3)) / block),
            (half, half * error(of_width)),
            (pitch, pitch * error(unit(1))),
            (time, time * error(unit(2))),
        ]
    }
}

/// The attempt over as much about a place, by how often that is doubled, as tells more of its tone, and what that claims.
fn widest(
    mut over: impl FnMut(f64, Option<&Attempt>) -> Option<Attempt>,
) -> Option<(Attempt, Outcome)> {
    let mut tries: Vec<Attempt> = vec![];
    // Long blocks show a departure of the pitch best; of its memory, those over which it turns the phase by less than noise does: a
    // block tells the mean of the phase.
    let is_point = |t: &Attempt| t.seen.turned < t.seen.noise / t.seen.at[0].exp().powi(2);
    let mut shorter = None;
    for doubled in 0..MOST_DOUBLED {
        let Some(attempt) = over(f64::from(1 << doubled), tries.last()) else {
            continue;
        };
        let before = tries.last().map_or(f64::MIN, |t| t.seen.nats);
        if attempt.seen.nats > before + MARGIN {
            tries.push(attempt);
        } else if tries.last().is_none_or(is_point) {
            break;
        } else if is_point(&attempt) {
            shorter = Some(attempt);
            break;
        }
    }
    let best = tries.last()?;
    let all = |t: &&Attempt| t.seen.nats > ALL_OF_IT * best.seen.nats;
    let long = tries.iter().find(all)?;
    let blocks = tries.iter().chain(&shorter).filter(all);
    let short = blocks.into_iter().find(|t| is_point(t)).unwrap_or(best);
    let claim = claim(&long.seen, &short.seen);
    Some((tries.pop()?, claim))
}

/// As much about some coefficients as the noise beside them is read from.
fn all_about(from: usize, to: usize, n: usize) -> Range<usize> {
    let more = (to - from) << (MOST_DOUBLED - 1);
    from.saturating_sub(more).max(1)..(to + more).min(n)
}

impl Place {
    /// The same that reaches farther, with the terms of all places whose middle lies there.
    fn wider(&self, by: f64, all: &[Self]) -> Self {
        let (middle, half) = (
            0.5 * (self.from + self.to),
            0.5 * by * (self.to - self.from),
        );
        let (from, to) = (middle - half, middle + half);
        let within = |p: &&Self| (from..to).contains(&(0.5 * (p.from + p.to)));
        let terms = all.iter().filter(within).flat_map(|p| &p.terms);
        Self {
            terms: terms.copied().collect(),
            from,
            to,
        }
    }
}

impl Search<'_> {
    /// The state in which the parts of `rotors` stand for the lines and bands that were laid on them; `target` is the number of the
    /// channel, and `again` searches the data as they are.
    #[must_use]
    pub(crate) fn beside_tracked_tones(
        &self,
        mut state: State,
        target: usize,
        rotors: &[Rotor],
        again: &dyn Fn() -> State,
    ) -> State {
        let mut tones: Vec<TrackedTone> = vec![];
        let mut course = vec![0.0; self.panel.bins.n];
        for rotor in rotors {
            let parts = || self.parts(&state, rotor, target);
            let found = self.beside_course(&course, parts);
            if let Some((rest, kept)) = self.taken_out(&state, &course, found, again) {
                add_all(&mut course, &kept);
                state = rest;
                tones.extend(kept);
            }
        }
        if tones.is_empty() {
            return state;
        }
        self.with_tones(state, tones, course)
    }

    /// What is made of the data beside a course.
    fn beside_course<T>(&self, course: &[f64], f: impl FnOnce() -> T) -> T {
        match course.iter().all(|c| *c == 0.0) {
            true => f(),
            false => self.panel.without(course, f),
        }
    }

    /// The data searched again without some tones, beside a course, and those of them that leave nothing in their place; none where
    /// the strongest does, or they do no better than what was laid on them.
    fn taken_out(
        &self,
        state: &State,
        course: &[f64],
        mut tones: Vec<TrackedTone>,
        again: &dyn Fn() -> State,
    ) -> Option<(State, Vec<TrackedTone>)> {
        let nats = |t: &TrackedTone| t.term.lr;
        let strongest = tones.iter().map(nats).fold(0.0, f64::max);
        while tones.iter().any(|t| nats(t) >= strongest) {
            let mut all = course.to_vec();
            add_all(&mut all, &tones);
            let rest = self.panel.without(&all, again);
            let left = places(&rest, self.spacing());
            let before = tones.len();
            tones.retain(|t| !left.iter().any(|p| p.to > t.from && p.from < t.to));
            if tones.len() == before {
                let asked = |t: &TrackedTone| t.term.threshold + 2.0 * t.by_itself;
                let asked: f64 = tones.iter().map(asked).sum();
                if Self::total(&rest) - asked <= Self::total(state) {
                    return None;
                }
                let claimed = || {
                    tones.iter_mut().for_each(|t| self.claim_steady(t, &rest));
                };
                self.panel.without(&all, claimed);
                return Some((rest, tones));
            }
        }
        None
    }

    fn spacing(&self) -> f64 {
        PI / self.panel.bins.n as f64
    }

    /// The state of the data without the tones, and their terms.
    fn with_tones(&self, found: State, tones: Vec<TrackedTone>, mut course: Vec<f64>) -> State {
        let mut terms = found.terms.clone();
        terms.extend(tones.into_iter().map(|t| t.term));
        let mut state = self.refit(terms, found.noise.log_walk);
        // Beside the spectrum of a tone what lies there is hardly to be told; without it it was.
        for (theirs, (_, theta)) in found.noise.terms.iter().zip(&mut state.noise.terms) {
            theta.clone_from(&theirs.1);
        }
        for (theirs, t) in found.terms.iter().zip(&mut state.terms) {
            t.form = theirs.form.clone();
        }
        state.solution.white = found.solution.white;
        if let Some(level) = &found.level {
            course
                .iter_mut()
                .zip(level.iter())
                .for_each(|(c, l)| *c += l);
        }
        state.level = Some(Arc::new(course));
        state.notes = found.notes;
        state
    }

    /// Density of the noise about a place many times as wide as what lies there, by the median of what its terms leave: lines and
    /// bands laid on a tone have skirts, which take from what the fit says of the noise beside them.
    fn density_about(&self, state: &State, place: &Place) -> f64 {
        let n = self.panel.bins.n;
        let to_k = n as f64 / PI;
        let from = (place.from * to_k).max(1.0) as usize;
        let to = ((place.to * to_k) as usize).min(n);
        let others = without_others(self, state, &place.terms);
        density(&others[from..to])
    }

    /// The term of a tone of a path, in noise of a density, which is so many nats ahead of none.
    fn described(&self, stated: Stated, path: &Arc<Path>, density: f64, nats: f64) -> Option<Term> {
        let mode = self.candidates.iter().find_map(|c| match &c.hypothesis {
            Hypothesis::Covariance(c) if c.is_peak() => Some(Arc::clone(c)),
            _ => None,
        })?;
        let number = (self.candidates.iter())
            .position(|c| matches!(c.hypothesis, Hypothesis::WanderingTone))?;
        let [(amplitude, _), (omega, _), (half, _), ..] = stated;
        let peak = Peak {
            omega,
            half_width: half.max(2.0 * self.spacing()),
            variance: 0.5 * amplitude * amplitude / density,
        };
        let (form, theta) = mode.about(&peak)?;
        let limit = threshold::peak(self.panel.bins.n);
        let effect = self.candidates[number].effect;
        let mut term = Term::new(effect, number, Form::Covariance(form, theta), limit);
        term.stated = Some(stated.to_vec());
        term.path = Some(Arc::clone(path));
        term.lr = 2.0 * nats;
        Some(term)
    }
}

/// The places of lines and bands.
fn places(state: &State, spacing: f64) -> Vec<Place> {
    let of = |(i, t): (usize, &Term)| {
        let (middle, reach) = match &t.form {
            Form::Line(omega) => (*omega, 0.0),
            Form::SideBands(omega, apart) => (*omega, *apart),
            _ => t.peak().map(|p| (p.omega, REACH * p.half_width))?,
        };
        let reach = reach.max(LEAST_REACH * spacing);
        Some(Place {
            terms: vec![i],
            from: middle - reach,
            to: middle + reach,
        })
    };
    let terms = state.terms.iter().enumerate();
    let mut all: Vec<Place> = terms
        .filter(|(_, t)| t.stated.is_none())
        .filter_map(of)
        .collect();
    all.sort_by(|a, b| a.from.total_cmp(&b.from));
    all.dedup_by(|next, before| {
        let meet = next.from < before.to;
        if meet {
            before.to = before.to.max(next.to);
            before.terms.append(&mut next.terms);
        }
        meet
    });
    all
}

/// Adds the courses of some tones.
fn add_all(course: &mut [f64], tones: &[TrackedTone]) {
    for tone in tones {
        course
            .iter_mut()
            .zip(&tone.course)
            .for_each(|(a, b)| *a += b);
    }
}

/// Density of the noise among coefficients of which a few hold more.
fn density(coefficients: &[f64]) -> f64 {
    let energies: Vec<f64> = coefficients.iter().map(|c| c * c).collect();
    median(&energies) / tails::MEDIAN
}

/// The coefficients without the terms that are not among some.
fn without_others(search: &Search<'_>, state: &State, these: &[usize]) -> Vec<f64> {
    let panel = &search.panel;
    let mut r = panel.first(0, panel.bins.n);
    for (i, (t, own)) in state.parts().enumerate() {
        if !these.contains(&i) {
            let minus: Vec<f64> = own.iter().map(|b| -b).collect();
            panel.add_columns(&mut r, 0, &t.columns, &minus);
        }
    }
    r[0] = 0.0;
    r
}

/// The complex envelope of neighbouring coefficients of a transform over `n` samples, turned back by their middle, in half as many
/// values as there are coefficients: those lie that many samples apart, half a sample before each, and noise is independent from one
/// to the next. The first one is at the end of the record, and left out.
fn turned_back(coefficients: &[f64], middle: f64, n: usize) -> Vec<Complex<f64>> {
    let mut z: Vec<Complex<f64>> = coefficients.iter().map(|c| Complex::new(*c, 0.0)).collect();
    FftPlanner::new().plan_fft_inverse(z.len()).process(&mut z);
    let first = Complex::from_polar((2.0 / n as f64).sqrt(), 0.5 * middle);
    let signs = [-first, first].into_iter().cycle();
    let values = z[1..z.len() / 2].iter().zip(signs);
    values.map(|(z, by)| z * by).collect()
}
