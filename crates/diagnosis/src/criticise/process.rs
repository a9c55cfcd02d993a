//! What the name of a process claims, held against the record.
//!
//! White noise, a random walk and one stationary term have the freedom to come near almost any wandering signal: the
//! omnibus checks then see little, because what is off is spread over the few coefficients in which the term acts. Here the
//! term is asked alone, where it acts: has its part of the spectrum its shape, is it Gaussian, and is it there all the
//! time? With d_k its density and g_k that of all noise, its share of coefficient k is f_k = d_k / g_k.
//!
//! * Shape: Rao's score test of ln d_k against smooth bends (Neyman's smooth test), which leave room for the estimated
//!   parameters by being orthogonal to them in the information.
//! * Law: third and fourth Hermite moments of the smoothed process (coefficients c_k f_k) and of what drives it (u_k f_k),
//!   whose variances over a Gaussian process of correlation r are 6 and 24 times the sum of r^3 and r^4. Of what has short
//!   tails by its name long ones alone are asked.
//! * Levels: Cox's test of how far two levels are ahead or behind (`contest`).
//! * Dwells: Bartlett's test of whether two levels switch at random (`contest::dwells`).
//! * Source: what it knows nothing of, by its mean (`source`).
//! * Size: the same energy against temperature, supply and command and what stands in the model beside it, a line say, and against
//!   their squares: it knows nothing of them.

mod filtered;
pub(crate) mod independence;

use std::f64::consts::PI;

use model::effect::{Hypothesis, View};
use model::record::Quantity;

use crate::fit::channel::{Form, State, Term, whitened_by_spectrum};
use crate::fit::likelihood::{Bins, Noise, Panel};
use crate::search::Search;
use crate::search::searched::Searched;
use crate::test_level::{CheckId, DEPARTURE, Outcome};
use filtered::Filtered;
use numerics::column::dot;
use numerics::tails::{chi_tail, errors_of_sum, normal_tail};

/// Rms by which the density of a band or a filter may be off, as a part of it, where it acts: no mode of a real structure is a
/// Lorentzian to the last, and no window is one triangle.
const OFF: f64 = 0.2;
/// How many more independent values a band has to have in a stretch, or the record: energies of a narrow one are far from
/// normal, and a claim fails by chance once in a thousand bands.
const MORE: f64 = 4.0;
/// Cosines that bend a spectrum.
const BENDS: usize = 6;
/// Fewest independent values that a bend or a moment may rest on.
const LEAST: f64 = 24.0;
/// The same for a course over the whole record.
const LEAST_OF_COURSE: f64 = 4.0 * LEAST;
/// Part of its energy, rms, that may follow what else was recorded: its size is then off by a tenth.
const DEPTH: f64 = 0.2;
/// Energy of a column over that of what it was made of, below which it is rounding.
const ROUNDING: f64 = 1e-9;
/// Least variance over its mean that a law gives.
const LEAST_SIZE: f64 = 0.05;
/// Step of a numerical derivative.
const STEP: f64 = 1e-3;

/// What the processes among the terms of a state claim, each claim with its chance; the white noise may follow a `law` of the
/// variance, that of the whole residual.
pub(crate) fn of_processes(
    search: &Search<'_>,
    state: &State,
    law: Option<&[f64]>,
) -> Vec<Outcome> {
    let mut all: Vec<Outcome> = state.terms.iter().flat_map(|t| t.claims.clone()).collect();
    if state.noise.terms.is_empty() {
        return all;
    }
    let tracked = |t: &Term| t.is_band() && t.stated.is_some();
    if let Some(level) = state
        .level
        .as_ref()
        .filter(|_| state.terms.iter().any(tracked))
    {
        // Of tones that were tracked their course has told; the other processes are those of the record without them.
        let others = state.terms.iter().filter(|t| t.stated.is_none());
        let others: Vec<Term> = others.cloned().collect();
        let of_stated = state.terms.iter().filter(|t| t.stated.is_some());
        let of_stated: Vec<Outcome> = of_stated.flat_map(|t| t.claims.clone()).collect();
        let rest = || of_processes(search, &search.refit(others, state.noise.log_walk), law);
        return [of_stated, search.panel.without(level, rest)].concat();
    }
    let (u, _) = whitened_by_spectrum(&search.panel, state);
    let covariances: Vec<&Term> = state.terms.iter().filter(|t| t.is_covariance()).collect();
    let beside_white = |of: &dyn Fn(&Term) -> bool| {
        let own = covariances.iter().zip(&state.noise.terms);
        Noise {
            log_walk: f64::NEG_INFINITY,
            terms: own.filter(|(o, _)| of(o)).map(|(_, t)| t.clone()).collect(),
        }
    };
    let white = beside_white(&Term::is_filter);
    for term in &covariances {
        // A part of a band is asked with it, and what has no name claims nothing.
        if term.is_part() || term.has_no_name() {
            continue;
        }
        // Bands that overlap are one.
        let of_it = |o: &Term| match (term.cluster, o.cluster) {
            (Some(own), Some(other)) => own.number == other.number,
            _ => std::ptr::eq(*term, o),
        };
        let process = Process {
            panel: &search.panel,
            state,
            u: &u,
            id: term.effect.id(),
            is_normal: term.is_normal(),
            claims: claims(term),
            off: if term.cluster.is_some() || term.is_filter() {
                OFF
            } else {
                0.0
            },
            more: if term.is_band() { MORE } else { 1.0 },
            view: &search.view,
            law,
            white: &white,
            alone: beside_white(&of_it),
            is_filter: term.is_filter(),
        };
        all.extend(process.shape());
        // Two levels have the spectrum of a process that is Gaussian, and are not. The law and the course of what a filter lets
        // through are those of the noise, which has tests of its own.
        let gaussian = &search.candidates[term.candidate].hypothesis;
        if matches!(gaussian, Hypothesis::Covariance(_)) && !term.is_filter() {
            all.extend(process.in_time());
        }
    }
    all
}

/// What a process claims of its shape, law and size.
fn claims(term: &Term) -> [Option<CheckId>; 3] {
    if term.is_band() {
        // Whether it is Gaussian and steady, the envelope of a band has told.
        let (shape, size) = (CheckId::BandSpectrum, CheckId::BandSize);
        return [Some(shape), None, Some(size)];
    }
    [
        Some(CheckId::ProcessSpectrum),
        Some(CheckId::ProcessLaw),
        Some(CheckId::ProcessSize),
    ]
}

/// Whether a channel that was told as a stationary, Gaussian process is stationary from reading to reading, by the `rhythm` of
/// its variance.
pub(crate) fn stationary(s: &Searched<'_>, rhythm: &Outcome) -> Option<Outcome> {
    let is_one = |t: &Term| {
        if t.is_band() || t.has_no_name() {
            return false;
        }
        let hypothesis = &s.search.candidates[t.candidate].hypothesis;
        matches!(t.form, Form::Covariance(..)) && matches!(hypothesis, Hypothesis::Covariance(_))
    };
    let term = s.state.terms.iter().find(|t| is_one(t))?;
    Some(Outcome {
        id: CheckId::ProcessRhythm,
        about: vec![],
        what: format!("told as {}: {}", term.effect.id(), rhythm.what),
        ..*rhythm
    })
}

/// A series and its square and cube, each without its mean and what the powers below it have of it.
fn powers(e: &[f64]) -> [Vec<f64>; 3] {
    let mean = e.iter().sum::<f64>() / e.len().max(1) as f64;
    let centred: Vec<f64> = e.iter().map(|v| v - mean).collect();
    let ones = vec![1.0; e.len()];
    let without = |mut own: Vec<f64>, below: &[&[f64]]| {
        for b in below {
            let share = dot(&own, b) / dot(b, b).max(f64::MIN_POSITIVE);
            own.iter_mut().zip(*b).for_each(|(o, b)| *o -= share * b);
        }
        own
    };
    let power = |k| centred.iter().map(|v| v.powi(k)).collect();
    let square = without(power(2), &[&ones, &centred]);
    let cube = without(power(3), &[&ones, &centred, &square]);
    [centred, square, cube]
}

/// The claim of noise that two axes share: each follows the other in a straight line, the same way up and down. What comes
/// over on one side alone, or beyond a threshold, follows the square or the cube as well. `lr` is the likelihood ratio of
/// their correlation, of which a twentieth may be left, and `pairs` the number of pairs that are asked.
pub(crate) fn straight(a: &[f64], b: &[f64], lr: f64, pairs: usize) -> Outcome {
    let score = |e: &[f64], bend: &[f64]| errors_of_sum(e.iter().zip(bend).map(|(e, b)| e * b));
    let scores = [(a, powers(b)), (b, powers(a))]
        .map(|(e, [_, square, cube])| [square, cube].map(|bend| score(e, &bend)));
    let scores = scores.as_flattened();
    let statistic: f64 = scores.iter().map(|z| z * z).sum();
    let bent = scores.iter().map(|z| z.abs()).fold(0.0, f64::max);
    Outcome {
        id: CheckId::CommonNoiseLaw,
        about: vec![],
        statistic,
        p_value: if statistic < DEPARTURE * lr {
            1.0
        } else {
            (pairs as f64 * chi_tail(statistic, scores.len() as f64)).min(1.0)
        },
        what: format!(
            "told as shared noise: one follows the square or the cube of the other by {bent:.1} standard errors, what they share would do so in a straight line"
        ),
    }
}

/// A process that was named.
struct Process<'a> {
    panel: &'a Panel,
    state: &'a State,
    /// Whitened coefficients of the residual.
    u: &'a [f64],
    id: &'static str,
    /// Whether it is Gaussian.
    is_normal: bool,
    /// Its claims of shape, law and size.
    claims: [Option<CheckId>; 3],
    /// Rms by which its density may be off, as a part of it, whatever the chance.
    off: f64,
    /// Independent values that its energies rest on, over those that others do.
    more: f64,
    view: &'a View<'a>,
    /// Law of the variance of the whole residual, and the white noise, which follows it.
    law: Option<&'a [f64]>,
    white: &'a Noise,
    /// Its noise beside a white one of variance 1, which it filters where it is a filter.
    alone: Noise,
    is_filter: bool,
}

/// Sum of m a b / 2: the information that deviations a and b of ln variance share.
fn information(m: &[f64], a: &[f64], b: &[f64]) -> f64 {
    m.iter()
        .zip(a)
        .zip(b)
        .map(|((m, a), b)| 0.5 * m * a * b)
        .sum()
}

/// Takes out of `x` what the orthonormal `basis` holds and returns the length of the rest.
fn orthogonal(x: &mut [f64], basis: &[Vec<f64>], m: &[f64]) -> f64 {
    // Twice is enough (Kahan and Parlett).
    for _ in 0..2 {
        for b in basis {
            let share = information(m, x, b);
            x.iter_mut().zip(b).for_each(|(x, b)| *x -= share * b);
        }
    }
    information(m, x, x).sqrt()
}

/// Adds to an orthonormal basis the bends of a process that has this `share` of each bin: cosines over the part of its `weight`
/// that lies below a bin, as Neyman's (1937) are over the distribution. So each bends as much where it acts as another, and
/// none is made of its tails, where there is next to nothing of it.
fn add_bends(basis: &mut Vec<Vec<f64>>, share: &[f64], weight: &[f64], m: &[f64]) {
    let total: f64 = weight.iter().sum();
    let mut below = 0.0;
    let place: Vec<f64> = (weight.iter())
        .map(|w| {
            below += w;
            (below - 0.5 * w) / total
        })
        .collect();
    for order in 1..=BENDS {
        let bend = |(u, f): (&f64, &f64)| f * (PI * order as f64 * u).cos();
        let mut x: Vec<f64> = place.iter().zip(share).map(bend).collect();
        let before = information(m, &x, &x).sqrt();
        let length = orthogonal(&mut x, basis, m);
        // A shape that lies in the others' span has no length of its own; 0 of 0 is none either.
        if length.is_nan() || length <= 1e-3 * before {
            continue;
        }
        let power = |k| m.iter().zip(&x).map(|(m, x)| m * x.powi(k)).sum::<f64>();
        let rests_on = power(2).powi(2) / power(4);
        x.iter_mut().for_each(|x| *x /= length);
        if rests_on > LEAST {
            basis.push(x);
        }
    }
}

impl Process<'_> {
    fn outcome(&self, id: CheckId, statistic: f64, p_value: f64, what: String) -> Outcome {
        Outcome {
            id,
            about: vec![],
            statistic,
            p_value,
            what: format!("told as {}: {what}", self.id),
        }
    }

    /// Its share of all noise `g`, of its density beside the white noise. That of a filter is what it leaves of the white noise
    /// above the least that it leaves anywhere.
    fn share(&self, alone: &[f64], g: &[f64]) -> Vec<f64> {
        let white = if self.is_filter {
            alone.iter().copied().fold(f64::INFINITY, f64::min)
        } else {
            1.0
        };
        let of = |(a, g): (&f64, &f64)| if g.is_finite() { (a - white) / g } else { 0.0 };
        alone.iter().zip(g).map(of).collect()
    }

    /// Deviations of ln g by each coordinate of the noise, and by the white variance.
    fn estimated(&self, bins: &Bins, g: &[f64]) -> Vec<Vec<f64>> {
        let noise = &self.state.noise;
        let mut all = vec![vec![1.0; g.len()]];
        let mut add = |moved: &Noise| {
            let by = |(a, b): (f64, &f64)| (a / b).ln() / STEP;
            all.push(moved.over(bins).into_iter().zip(g).map(by).collect());
        };
        let mut moved = noise.clone();
        moved.log_walk += STEP;
        add(&moved);
        for (i, (_, theta)) in noise.terms.iter().enumerate() {
            for k in 0..theta.len() {
                let mut moved = noise.clone();
                moved.terms[i].1[k] += STEP;
                add(&moved);
            }
        }
        all
    }

    /// An orthonormal basis of what estimates of the noise take up.
    fn basis(&self, bins: &Bins, g: &[f64], m: &[f64]) -> Vec<Vec<f64>> {
        let mut basis: Vec<Vec<f64>> = vec![];
        for mut x in self.estimated(bins, g) {
            let before = information(m, &x, &x).sqrt();
            let length = orthogonal(&mut x, &basis, m);
            if length > 1e-6 * before.max(1e-6) {
                x.iter_mut().for_each(|x| *x /= length);
                basis.push(x);
            }
        }
        basis
    }

    /// Whether its part of the spectrum has its shape.
    fn shape(&self) -> Option<Outcome> {
        let bins = &self.panel.bins;
        let ones = vec![1.0; bins.n];
        let m = bins.products(&ones, &ones);
        let energy = bins.products(self.u, self.u);
        let g = self.state.noise.over(bins);
        let share = self.share(&self.alone.over(bins), &g);
        let mut basis = self.basis(bins, &g, &m);
        let estimated = basis.len();
        let weight: Vec<f64> = m.iter().zip(&share).map(|(m, f)| m * f * f).collect();
        add_bends(&mut basis, &share, &weight, &m);
        let bends = &basis[estimated..];
        let scores: Vec<f64> = bends
            .iter()
            .map(|x| {
                let off = energy.iter().zip(&m).zip(x);
                off.map(|((e, m), x)| 0.5 * (e - m) * x).sum()
            })
            .collect();
        let statistic: f64 = scores.iter().map(|s| s * s).sum();
        let degrees = bends.len() as f64;
        let least = self.off * self.off * 0.5 * weight.iter().sum::<f64>();
        let p_value = if bends.is_empty() || statistic - degrees < least {
            1.0
        } else {
            chi_tail(statistic, degrees)
        };
        // Where it acts, how far the bent spectrum is from the named one.
        let bent = |b: usize| -> f64 { scores.iter().zip(bends).map(|(s, x)| s * x[b]).sum() };
        let heaviest = (0..m.len()).max_by(|a, b| {
            let weigh = |b: usize| bent(b).abs() * weight[b].sqrt();
            weigh(*a).total_cmp(&weigh(*b))
        })?;
        let hz = bins.at.omega[heaviest] / (2.0 * PI) * self.view.rate_hz;
        let what = format!(
            "its spectrum is bent otherwise; all noise is {:.2} of the model's about {hz:.3} Hz",
            bent(heaviest).exp()
        );
        Some(self.outcome(self.claims[0]?, statistic, p_value, what))
    }

    /// Standard deviations in time of what passes a filter, whose mean square is 1: of what the law of the variance changes, the
    /// white noise, other bands have another part than the whole residual has.
    fn sizes(&self, filter: &[f64], g: &[f64]) -> Option<Vec<f64>> {
        let law = self.law?;
        let white = self.white.everywhere(&self.panel.bins);
        let part = |weight: &dyn Fn(usize) -> f64| {
            let finite = (0..g.len()).filter(|k| g[*k].is_finite());
            let sums = finite.map(|k| (weight(k) * white[k] / g[k], weight(k)));
            let (own, all) = sums.fold((0.0, 0.0), |s, t| (s.0 + t.0, s.1 + t.1));
            own / all
        };
        let by = part(&|k| filter[k] * filter[k]) / part(&|_| 1.0);
        let size = |v: &f64| (1.0 + by * (v - 1.0)).max(LEAST_SIZE).sqrt();
        Some(law.iter().map(size).collect())
    }

    /// Whether it is Gaussian, and of a size that follows nothing.
    fn in_time(&self) -> Vec<Outcome> {
        let bins = &self.panel.bins;
        let g = self.state.noise.everywhere(bins);
        let share = self.share(&self.alone.everywhere(bins), &g);
        let drive = Filtered::new(self.panel, self.u, &share, self.sizes(&share, &g));
        let filter: Vec<f64> = (share.iter().zip(&g))
            .map(|(f, g)| if g.is_finite() { f * g.sqrt() } else { 0.0 })
            .collect();
        let level = Filtered::new(self.panel, self.u, &filter, self.sizes(&filter, &g));
        let mut worst: Option<(f64, f64, String)> = None;
        let moments = [("what drives it", &drive), ("its level", &level)]
            .into_iter()
            .flat_map(|(name, f)| f.moments().map(|(of, z)| (z, format!("{of} of {name}"))));
        let mut count = 0;
        for (z, name) in moments.filter(|m| m.0.is_finite()) {
            count += 1;
            // Errors of rounding have shorter tails than Gaussian ones: it is long ones that they do not have.
            let z = if self.is_normal || name.starts_with("skewness") {
                z
            } else {
                z.max(0.0)
            };
            if worst.as_ref().is_none_or(|w| z.abs() > w.0.abs()) {
                worst = Some((z, normal_tail(z), name));
            }
        }
        let law = worst.and_then(|(z, p, name)| {
            let p = (p * f64::from(count)).min(1.0);
            let what = format!("{name}, in standard errors of a Gaussian one");
            Some(self.outcome(self.claims[1]?, z, p, what))
        });
        let size = self.size(&drive);
        law.into_iter().chain(size).collect()
    }

    /// What the terms of the model with a course of their own make in time, by the title of their effect.
    fn courses(&self) -> impl Iterator<Item = (&str, Vec<f64>)> {
        let in_time = self.state.parts().filter(|(t, _)| !t.is_covariance());
        in_time.map(|(t, own)| {
            let mut sum = vec![0.0; self.panel.bins.n];
            self.panel.add_columns(&mut sum, 0, &t.columns, own);
            (t.effect.id(), self.panel.dct.inverse(&sum))
        })
    }

    /// Whether its size follows what else was recorded, or what stands in the model beside it.
    fn size(&self, drive: &Filtered) -> Option<Outcome> {
        let quantities = [Quantity::Temp, Quantity::Supply, Quantity::Pwm];
        let recorded = quantities.iter().filter_map(|q| self.view.signal(*q));
        let recorded =
            recorded.map(|s| (s.name.as_str(), true, drive.follows(&s.smooth, self.more)));
        let beside = self
            .courses()
            .map(|(id, course)| (id, false, drive.follows(&course, self.more)));
        let all = recorded.chain(beside);
        let asked: Vec<_> = all
            .filter_map(|(name, recorded, found)| Some((name, recorded, found?)))
            .collect();
        let (name, recorded, (statistic, depth)) =
            asked.iter().max_by(|a, b| a.2.0.total_cmp(&b.2.0))?;
        let chance = (asked.len() as f64 * chi_tail(*statistic, 2.0)).min(1.0);
        let p = if *depth < DEPTH { 1.0 } else { chance };
        let what = format!("its energy follows {name}, by {:.0} % rms", 100.0 * depth);
        let outcome = self.outcome(self.claims[2]?, *statistic, p, what);
        Some(Outcome {
            about: recorded.then(|| (*name).to_owned()).into_iter().collect(),
            ..outcome
        })
    }
}

#[cfg(test)]
mod tests;
