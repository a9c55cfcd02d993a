//! A tone whose pitch wanders so slowly that its phase can be tracked through the record.
//!
//! A mains hum, a motor or a fan has a pitch that stays for seconds or minutes. What such a tone makes of a spectrum is the time that
//! it spent at each frequency, which is neither a line nor a noise of any smooth density: the search lays lines and bands on it, one
//! beside the other. Where the phase can be told block by block ([`phase`]) and the tone does better than all of these together, it
//! takes their place, the record is searched again without it, and the name stands if nothing is left there.

mod claims;
mod led;
mod phase;

use std::f64::consts::PI;
use std::sync::Arc;

use model::effect::{Hypothesis, Peak};
use model::effects::wandering_line;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::Search;
use crate::fit::channel::{Form, Path, State, Term};
use crate::fit::scan::residual;
use crate::fit::threshold;
use claims::claim;
pub(crate) use led::Lead;
use numerics::column::dot;
use numerics::order_statistics::median;
use numerics::tails;
use phase::{FORGOTTEN, Tracked, tracked};

/// Most tones that are tracked on one channel: a hum or a rotor, and harmonics of it.
const MOST_TONES: usize = 5;
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
/// Nats by which the tone has to be ahead of what the search has laid there.
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
    /// Nats by which it is ahead of what was laid there.
    lead: f64,
    /// Whether another one leads it, and nats that are then left of it by a phase that is in doubt.
    is_led: bool,
    left: f64,
    from: f64,
    to: f64,
}

impl TrackedTone {
    fn ahead(&self) -> f64 {
        self.lead - self.left
    }
}

/// A tone that was looked for over one reach: in blocks of that length, about an angular frequency, in noise of that density.
struct Attempt {
    seen: Tracked,
    /// Nats by which it is ahead of what was laid there.
    lead: f64,
    middle: f64,
    length: f64,
    density: f64,
    place: Place,
}

impl Attempt {
    fn path(&self) -> Path {
        Path {
            amplitude: self.seen.at[0].exp(),
            omega: self.middle,
            length: self.length,
            phase: self.seen.phase.clone(),
        }
    }
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
    /// The state in which tones that can be tracked, or are led by those of other channels, stand for the lines and bands that were laid
    /// on them; `again` searches the data as they are.
    #[must_use]
    pub(crate) fn beside_tracked_tones(
        &self,
        mut state: State,
        leads: &[Lead],
        again: &dyn Fn() -> State,
    ) -> State {
        let mut leads = leads.to_vec();
        let mut refused: Vec<(f64, f64)> = vec![];
        let mut tones: Vec<TrackedTone> = vec![];
        let mut course = vec![0.0; self.panel.bins.n];
        while tones.len() < MOST_TONES {
            let next = || self.next_tone(&state, &leads, &refused);
            let found = match tones.is_empty() {
                true => next(),
                false => self.panel.without(&course, next),
            };
            let Some(tone) = found else { break };
            let mut more = course.clone();
            more.iter_mut().zip(&tone.course).for_each(|(a, b)| *a += b);
            let rest = self.panel.without(&more, again);
            let left = places(&rest, self.spacing());
            let any = |s: &State| s.terms.iter().any(Term::is_any_spectrum);
            let same_place = left.iter().any(|p| p.to > tone.from && p.from < tone.to);
            if same_place && tone.is_led {
                // A phase in doubt leaves something of a strong one, which may lead itself.
                refused.push((tone.from, tone.to));
                continue;
            }
            if same_place || (any(&rest) && !any(&state)) {
                break;
            }
            (state, course) = (rest, more);
            leads.extend(Lead::of(&tone.term));
            tones.push(tone);
        }
        if tones.is_empty() {
            return state;
        }
        self.with_tones(state, tones, course)
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

    /// The strongest tone that can be tracked through what was laid about one place; those that lie where some were `refused` lead
    /// themselves.
    fn next_tone(
        &self,
        state: &State,
        leads: &[Lead],
        refused: &[(f64, f64)],
    ) -> Option<TrackedTone> {
        let all = places(state, self.spacing());
        let split = |p: &&Place| p.terms.len() > 1 || state.terms[p.terms[0]].is_band();
        let mut found: Vec<TrackedTone> = vec![];
        for place in all.iter().filter(split) {
            let middle = 0.5 * (place.from + place.to);
            if found.iter().any(|t| (t.from..t.to).contains(&middle)) {
                continue;
            }
            found.extend(self.widest(state, place, &all));
        }
        let free = |t: &TrackedTone| !refused.iter().any(|r| r.1 > t.from && r.0 < t.to);
        found.extend(self.led(state, &all, leads).into_iter().filter(free));
        found.retain(|t| t.lead > MARGIN);
        let best_there = |t: &TrackedTone| {
            let there = found.iter().filter(|o| o.to > t.from && o.from < t.to);
            there.map(TrackedTone::ahead).fold(f64::MIN, f64::max) <= t.ahead()
        };
        let strongest = found.iter().enumerate().filter(|(_, t)| best_there(t));
        let strongest = strongest.max_by(|(_, a), (_, b)| a.term.lr.total_cmp(&b.term.lr));
        let place = strongest.map(|(i, _)| i)?;
        Some(found.swap_remove(place))
    }

    /// The tone about a place, over as much about it as tells more of it.
    fn widest(&self, state: &State, place: &Place, all: &[Place]) -> Option<TrackedTone> {
        let mut tries: Vec<Attempt> = vec![];
        let density = self.density_about(state, &place.wider(f64::from(1 << MOST_DOUBLED), all));
        for doubled in 0..MOST_DOUBLED {
            let wider = place.wider(f64::from(1 << doubled), all);
            let Some(attempt) = self.attempt(state, wider, density) else {
                continue;
            };
            let before = tries.last().map_or(f64::MIN, |t| t.seen.nats);
            if attempt.seen.nats < before + MARGIN {
                break;
            }
            tries.push(attempt);
        }
        // A phase that is a random walk has the Lorentzian of a band, by which it is told as well as by its course, but
        // for what is locked to it.
        let is_course = |t: &&Attempt| t.seen.at[2] > FORGOTTEN.ln() || has_multiple(place, all);
        let best = tries.last().filter(is_course)?;
        // Long blocks show a departure of the pitch best; of its memory, those over which it turns the phase by less than noise does: a
        // block tells the mean of the phase.
        let all = |t: &&Attempt| t.seen.nats > ALL_OF_IT * best.seen.nats;
        let points = |t: &&Attempt| t.seen.turned < t.seen.noise / t.seen.at[0].exp().powi(2);
        let long = tries.iter().find(all)?;
        let short = tries.iter().filter(all).find(points).unwrap_or(best);
        let mut term = self.term(best)?;
        term.claims.push(claim(&long.seen, &short.seen));
        Some(TrackedTone {
            course: best.path().course(self.panel.bins.n),
            term,
            lead: best.lead,
            is_led: false,
            left: 0.0,
            from: best.place.from,
            to: best.place.to,
        })
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

    /// The tone in a place, where its phase can be told.
    fn attempt(&self, state: &State, place: Place, density: f64) -> Option<Attempt> {
        let n = self.panel.bins.n;
        let to_k = n as f64 / PI;
        // Neither a slow process nor what half the sample rate turns back.
        if place.from <= 0.0 || place.to >= PI {
            return None;
        }
        let (from, count) = (
            (place.from * to_k) as usize,
            (0.5 * (place.to - place.from) * to_k) as usize,
        );
        if count < LEAST_BLOCKS || from + 2 * count > n {
            return None;
        }
        let middle = (from + count) as f64 / to_k;
        let others = without_others(self, state, &place.terms);
        let blocks = turned_back(&others[from..from + 2 * count], middle, n);
        let length = n as f64 / count as f64;
        let seen = tracked(&blocks, 2.0 * density / length);
        let doubt = seen.phase.iter().map(|p| p.1).sum::<f64>() / seen.phase.len() as f64;
        let times = blocks.len() as f64 * (-seen.at[2]).exp();
        if doubt > LARGEST_DOUBT || times < LEAST_TIMES {
            return None;
        }
        Some(Attempt {
            lead: seen.nats - self.laid(state, &place, density, &others),
            seen,
            middle,
            length,
            density,
            place,
        })
    }

    /// Nats by which the terms of a place are ahead of noise of a density, about it; `without` them is what the others leave.
    fn laid(&self, state: &State, place: &Place, density: f64, without: &[f64]) -> f64 {
        let n = self.panel.bins.n;
        let half = place.to - place.from;
        let to_k = n as f64 / PI;
        let from = ((place.from - half) * to_k).max(1.0) as usize;
        let to = (((place.to + half) * to_k) as usize).min(n);
        let with = residual(&self.panel, &state.columns(), &state.solution);
        let noise = state.noise.through((from..to).map(|k| k as f64 / to_k));
        let nats = |r: f64, g: f64| -0.5 * (r * r / g + g.ln());
        let all = with[from..to].iter().zip(&without[from..to]).zip(noise);
        all.map(|((r, o), g)| nats(*r, state.solution.white * g) - nats(*o, density))
            .sum()
    }

    /// The term of a tone that was tracked.
    fn term(&self, of: &Attempt) -> Option<Term> {
        let (seen, block) = (&of.seen, of.length);
        let [amplitude, pitch, time] = [seen.at[0], seen.at[1], seen.at[2]].map(f64::exp);
        let (pitch, time) = (pitch / block, time * block);
        let omega = of.middle + seen.at[3] / block;
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
        let stated = [
            (amplitude, amplitude * error(unit(0))),
            (omega, error(unit(3)) / block),
            (half, half * error(of_width)),
            (pitch, pitch * error(unit(1))),
            (time, time * error(unit(2))),
        ];
        self.described(stated, &Arc::new(of.path()), of.density, seen.nats)
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

/// Whether a place lies at a multiple of another one, or another one at a multiple of it.
fn has_multiple(place: &Place, all: &[Place]) -> bool {
    let middle = |p: &Place| 0.5 * (p.from + p.to);
    let near = |a: &Place, b: &Place| {
        led::RATIOS.iter().any(|(of, to)| {
            let ratio = f64::from(*of) / f64::from(*to);
            of != to && (led::folded(ratio * middle(a)).0 - middle(b)).abs() < 0.5 * (b.to - b.from)
        })
    };
    all.iter().any(|o| near(place, o) || near(o, place))
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
