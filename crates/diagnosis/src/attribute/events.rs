//! What the names of events claim, held against the record.
//!
//! A wild reading is one that has nothing to do with anything: the readings about it are as everywhere, it comes when it
//! comes, and what was found on the channel leaves it as far away as before. A ring, a jump that relaxes or a burst
//! begins with such a reading too, the square of an acceleration has its largest ones, and noise whose size changes
//! makes some: those are a part of it, and no cause of their own.
//!
//! A turn of the base is one thing that happens to a base at rest. Where the channel wanders by jumps, or otherwise than a
//! stationary Gaussian process, in the band of such a turn, it is as likely the largest piece of that.

use std::f64::consts::PI;
use std::ops::Range;

use model::effect::Signal;
use model::record::Quantity;

use crate::audit::MOST_TIMES;
use crate::criticise::residual;
use crate::fit::channel::{Form, Term, undo};
use crate::ingest::base_turns::Excursion;
use crate::result::{Finding, Parameter};
use crate::search::searched::Searched;
use crate::test_level::{CheckId, Observation};
use numerics::tails;

/// Chance below which a claim fails, over everything that it is asked for. It is asked only where an event is named.
const LEAST_CHANCE: f64 = 1e-3;
/// Readings on either side over which squares are added up.
const REACHES: [usize; 3] = [3, 10, 30];
/// Time constants, readings, of the damped swings that may follow or go before, and how many pitches are tried.
const FADES: [f64; 3] = [2.0, 8.0, 30.0];
const PITCHES: usize = 16;
/// Readings over which a swing is looked for.
const SWINGS: usize = 60;
/// Readings beside one that went through a filter with it.
const FILTERED: usize = 2;
/// Distances, readings, within which wild ones may crowd.
const CROWDS: [usize; 5] = [1, 4, 16, 64, 256];
/// Standard deviations from which on a reading is a fault of the transfer, wherever and however often it comes.
const FAULT: f64 = 1000.0;
/// Part of the readings whose excesses tell how the tail of the noise goes on.
const TAIL: f64 = 0.01;
/// Checks of the law of the noise: where one fails, wild readings have to stand clear of the tail that there is.
const LAWS: [CheckId; 7] = [
    CheckId::Skewness,
    CheckId::Bicovariance,
    CheckId::ThreeReadings,
    CheckId::Neighbours,
    CheckId::VarianceRhythm,
    CheckId::TimeFrequency,
    CheckId::VarianceLaw,
];
/// Half cycles of the fastest part of a turn of the base: twice as many as its shape has.
const FASTEST: f64 = 6.0;
/// Part of the energy of a turn that may go on beside it: a wobble of a fifth of its size.
const WOBBLE: f64 = 0.05;

/// A reading that was set aside as wild, in standard deviations of what the full model leaves.
#[derive(Clone, Copy)]
struct Wild {
    at: usize,
    time_s: f64,
    size: f64,
}

/// The whitened residual of a channel where it was read.
struct Residual<'a> {
    e: &'a [f64],
    known: Vec<bool>,
    /// Readings beside a wild one that are not asked.
    gap: usize,
}

/// A sum of squares, and its degrees of freedom.
type Score = (f64, f64);

impl<'a> Residual<'a> {
    fn new(s: &Searched<'_>, e: &'a [f64], gap: usize) -> Self {
        let mut known = vec![true; e.len()];
        s.target.lost.iter().for_each(|i| known[*i] = false);
        Self { e, known, gap }
    }

    /// Readings from `from` to `to` after (or before) a place, with their distance from it.
    fn around(
        &self,
        at: usize,
        after: bool,
        reach: usize,
    ) -> impl Iterator<Item = (usize, f64)> + '_ {
        (1 + self.gap..=reach.max(1 + self.gap)).filter_map(move |d| {
            let i = if after {
                at.checked_add(d)
            } else {
                at.checked_sub(d)
            }?;
            let known = *self.known.get(i)?;
            known.then(|| (d, self.e[i]))
        })
    }

    /// Energy on one side of a place: of the readings near it, and of swings that fade away from it. The same ones for every
    /// place.
    fn beside(&self, at: usize, after: bool) -> Vec<Score> {
        let near = REACHES.iter().map(|reach| {
            let energy = self.around(at, after, *reach);
            energy.fold((0.0, 0.0), |(s, n), (_, v)| (s + v * v, n + 1.0))
        });
        let window: Vec<(usize, f64)> = self.around(at, after, SWINGS).collect();
        let pitch = |i: usize| PI * (i as f64 + 0.5) / PITCHES as f64;
        let swings = FADES
            .iter()
            .flat_map(|fade| (0..PITCHES).map(|i| swing(&window, *fade, pitch(i))));
        near.chain(swings).collect()
    }

    fn scores(&self, at: usize) -> Vec<Score> {
        [self.beside(at, false), self.beside(at, true)].concat()
    }

    /// Chance of the energy about some places, over all that was asked.
    fn chance<'s>(&self, of: impl Iterator<Item = &'s Vec<Score>>) -> f64 {
        let mut sums: Vec<Score> = vec![];
        for scores in of {
            sums.resize(scores.len(), (0.0, 0.0));
            for (sum, s) in sums.iter_mut().zip(scores) {
                *sum = (sum.0 + s.0, sum.1 + s.1);
            }
        }
        let chances = sums.iter().filter(|s| s.1 > 0.0);
        let least = chances.map(|(sum, degrees)| tails::chi_tail(*sum, *degrees));
        least.fold(1.0, f64::min) * sums.len() as f64
    }
}

/// Energy of a window in a damped swing of either phase.
fn swing(window: &[(usize, f64)], fade: f64, omega: f64) -> Score {
    let (mut cc, mut cs, mut ss, mut ce, mut se) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (d, e) in window {
        let size = (-(*d as f64) / fade).exp();
        let (s, c) = (omega * *d as f64).sin_cos();
        let (c, s) = (size * c, size * s);
        (cc, cs, ss) = (cc + c * c, cs + c * s, ss + s * s);
        (ce, se) = (ce + c * e, se + s * e);
    }
    let determinant = cc * ss - cs * cs;
    // A window of a reading or two has no swing.
    if determinant <= 1e-6 * cc * ss {
        return (0.0, 0.0);
    }
    let energy = (ss * ce * ce - 2.0 * cs * ce * se + cc * se * se) / determinant;
    (energy, 2.0)
}

/// The chance that so many pairs of wild readings are so near each other, where each comes by itself.
fn crowded(wild: &[Wild], n: usize) -> f64 {
    let k = wild.len();
    let pairs = (k * k.saturating_sub(1)) as f64 / 2.0;
    let chance = |reach: &usize| {
        let near = |i: usize| {
            let later = wild[i + 1..].iter();
            later
                .filter(|w| w.at.abs_diff(wild[i].at) <= *reach)
                .count()
        };
        let observed: usize = (0..k).map(near).sum();
        tails::at_least(observed as u64, pairs * 2.0 * *reach as f64 / n as f64)
    };
    CROWDS.iter().map(chance).fold(1.0, f64::min) * CROWDS.len() as f64
}

/// What a recorded channel does where wild readings are that it does seldom, and the chance of that.
fn follows(wild: &[Wild], signals: &[Signal]) -> Option<(f64, String)> {
    let others = signals.iter().filter(|s| s.quantity != Quantity::Gyro);
    let measures: Vec<(String, Vec<f64>)> = others
        .flat_map(|s| {
            let middle = numerics::order_statistics::median(&s.values);
            let size = s.values.iter().map(|v| (v - middle).abs()).collect();
            let change = s.values.windows(2).map(|w| (w[1] - w[0]).abs());
            let change = std::iter::once(0.0).chain(change).collect();
            [
                (format!("{} is far from its middle", s.name), size),
                (format!("{} changes", s.name), change),
            ]
        })
        .collect();
    let count = measures.len() as f64;
    let scored = measures.into_iter().map(|(what, values)| {
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len() as f64;
        // What ties counts as as much.
        let rank = |w: &Wild| {
            let below = sorted.partition_point(|v| *v < values[w.at]);
            ((n - below as f64) / n).ln()
        };
        let sum: f64 = wild.iter().map(rank).sum();
        let p = tails::chi_tail(-2.0 * sum, 2.0 * wild.len() as f64);
        (p * count, what)
    });
    scored.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// How many readings the tail of the residual has beyond a size, carried on as its farthest part goes: by an exponential,
/// which that of normal noise stays within.
fn carried_on(r: &Residual<'_>, wild: &[Wild]) -> impl Fn(f64) -> f64 {
    let mut sizes: Vec<f64> = (0..r.e.len())
        .filter(|i| r.known[*i] && wild.iter().all(|w| w.at != *i))
        .map(|i| r.e[i].abs())
        .collect();
    sizes.sort_by(|a, b| b.total_cmp(a));
    let count = ((TAIL * sizes.len() as f64) as usize).max(1);
    let from = sizes.get(count).copied().unwrap_or(0.0);
    let mean = sizes.iter().take(count).map(|v| v - from).sum::<f64>() / count as f64;
    move |size| count as f64 * (-(size - from) / mean.max(f64::MIN_POSITIVE)).exp()
}

/// The wild readings of a finding.
fn wild_of(s: &Searched<'_>, e: &[f64], times: &[f64]) -> Vec<Wild> {
    let rate_hz = s.search.view.rate_hz;
    let white = s.state.solution.white.sqrt();
    let data = s.search.panel.dct.inverse(&s.search.panel.column(0));
    let nearest = |t: &f64| {
        let off = |i: usize| (i as f64 / rate_hz - t).abs();
        let own = s.target.aside.iter();
        let (at, given) = own.min_by(|a, b| off(a.0).total_cmp(&off(b.0)))?;
        Some(Wild {
            at: *at,
            time_s: *t,
            size: e[*at] + (given - data[*at]) / white,
        })
    };
    times.iter().filter_map(nearest).collect()
}

/// How far the readings at some times lie from what the model expects there, unit of the channel.
pub(crate) fn sizes(s: &Searched<'_>, times: &[f64]) -> Vec<f64> {
    let white = s.state.solution.white.sqrt();
    let mut e = s.e.clone();
    s.variance.undo(&mut e);
    wild_of(s, &e, times)
        .iter()
        .map(|w| w.size * white)
        .collect()
}

/// Take the name of wild readings from what is none, of one channel: `kept` are its findings whose names hold, `failing`
/// tells its checks that fail.
pub(crate) fn hold_outliers(
    s: &Searched<'_>,
    kept: &[Finding],
    findings: &mut Vec<Finding>,
    failing: &dyn Fn(CheckId) -> bool,
) -> Vec<Observation> {
    // Far readings at a step are told with it.
    let blow = |f: &Finding| kept.iter().filter_map(step_at).any(|at| blow_of(f, at));
    let own = |f: &mut Finding| {
        f.cause == "outliers" && f.channels == [s.target.name.as_str()] && !blow(f)
    };
    let named: Vec<Finding> = findings.extract_if(.., own).collect();
    if named.is_empty() {
        return vec![];
    }
    // A law of the variance that is no cause of its own explains no loud neighbours.
    let mut e = s.e.clone();
    let laws = s.variance.each.iter();
    for v in laws.filter(|v| kept.iter().all(|f| f.cause != v.effect.id())) {
        undo(&mut e, &v.law);
    }
    let mut told = vec![];
    for finding in named {
        let (rest, said) = outliers(s, &e, finding, failing);
        findings.extend(rest);
        told.extend(said);
    }
    told
}

/// What is left of a finding of wild readings in the whitened residual `e`, and what is said of the rest.
fn outliers(
    s: &Searched<'_>,
    e: &[f64],
    finding: Finding,
    failing: &dyn Fn(CheckId) -> bool,
) -> (Option<Finding>, Option<Observation>) {
    let told =
        |why: &str, what: &str| Observation::of_noise(&s.target.name, format!("{why}: {what}"));
    if failing(CheckId::Kurtosis) {
        // Single far readings of a noise whose bulk is not normal are its tails.
        return (None, Some(told("noise with tails", &finding.what)));
    }
    let all = wild_of(s, e, &finding.times_s);
    if all.is_empty() || s.target.moving || s.search.view.sways() {
        return (Some(finding), None);
    }
    let (faults, mut wild): (Vec<Wild>, Vec<Wild>) =
        all.into_iter().partition(|w| w.size.abs() > FAULT);
    let before = wild.len();
    // What was found explains them: they are its largest.
    if !s.state.terms.is_empty() {
        let single = || crate::ingest::spikes::spike_limit(e.len());
        let limit = s.target.wild_from.unwrap_or_else(single);
        wild.retain(|w| w.size.abs() > limit);
    }
    let (apart, why) = unlike(s, e, &wild, failing);
    let lost = before - wild.len() + apart.len();
    if lost == 0 {
        return (Some(finding), None);
    }
    let said = why.map(|why| {
        let first = apart.iter().map(|w| w.time_s).fold(f64::INFINITY, f64::min);
        let what = match apart.len() {
            1 => format!("1 far reading, at {first:.2} s"),
            n => format!("{n} far readings, the first at {first:.2} s"),
        };
        told(&why, &what)
    });
    wild.retain(|w| apart.iter().all(|a| a.at != w.at));
    let mut times: Vec<f64> = wild.iter().chain(&faults).map(|w| w.time_s).collect();
    times.sort_by(f64::total_cmp);
    let Some(first) = times.first() else {
        return (None, said);
    };
    let count = finding.parameters.get("count").map_or(0.0, |p| p.value) - lost as f64;
    let name = &s.target.name;
    let what = format!(
        "{count} single readings of {name} are none that the noise makes, the first at {first:.2} s"
    );
    let parameters = [("count".to_owned(), Parameter::exact(count, "1"))];
    times.truncate(MOST_TIMES);
    let rest = Finding {
        parameters: parameters.into(),
        times_s: times,
        what,
        ..finding
    };
    (Some(rest), said)
}

/// Those of some wild readings that are no single ones in a place like others, and why.
fn unlike(
    s: &Searched<'_>,
    e: &[f64],
    wild: &[Wild],
    failing: &dyn Fn(CheckId) -> bool,
) -> (Vec<Wild>, Option<String>) {
    if wild.is_empty() {
        return (vec![], None);
    }
    let filtered = s.state.terms.iter().any(Term::is_filter);
    let residual = Residual::new(s, e, if filtered { FILTERED } else { 0 });
    let scores: Vec<Vec<Score>> = wild.iter().map(|w| residual.scores(w.at)).collect();
    let own = |i: &usize| {
        let chance = residual.chance(std::iter::once(&scores[*i]));
        chance * (wild.len() as f64) < LEAST_CHANCE
    };
    let mut apart: Vec<Wild> = (0..wild.len()).filter(own).map(|i| wild[i]).collect();
    // Where most are pieces of something, the others are not known to be none.
    let most = 2 * apart.len() > wild.len();
    if most || apart.is_empty() && residual.chance(scores.iter()) < LEAST_CHANCE {
        apart = wild.to_vec();
    }
    if !apart.is_empty() {
        let why = "a part of something longer, for the readings about them are no noise";
        return (apart, Some(why.into()));
    }
    if crowded(wild, e.len()) < LEAST_CHANCE {
        let why = "a burst, for they lie too near each other to come by themselves";
        return (wild.to_vec(), Some(why.into()));
    }
    if let Some((_, what)) = follows(wild, s.search.view.signals).filter(|f| f.0 < LEAST_CHANCE) {
        let why = format!("no readings that come by themselves, for they lie where {what}");
        return (wild.to_vec(), Some(why));
    }
    if LAWS.into_iter().any(failing) {
        let beyond = carried_on(&residual, wild);
        let tail = |w: &&Wild| beyond(w.size.abs()) > LEAST_CHANCE;
        let apart: Vec<Wild> = wild.iter().filter(tail).copied().collect();
        let why = (!apart.is_empty()).then(|| "the tail of a noise that is not normal".into());
        return (apart, why);
    }
    (vec![], None)
}

/// Whether something of that energy that happens in some readings goes on before them or after.
fn goes_on(s: &Searched<'_>, readings: &Range<usize>, energy: f64) -> bool {
    let residual = Residual::new(s, &s.e, 0);
    let beside = |at: usize, after: bool| {
        let scores = residual.beside(at, after);
        let most = scores.iter().map(|s| s.0 - s.1).fold(0.0, f64::max);
        most > WOBBLE * energy && residual.chance(std::iter::once(&scores)) < LEAST_CHANCE
    };
    beside(readings.start, false) || beside(readings.end.saturating_sub(1), true)
}

/// Whether a blow of that likelihood ratio is a part of something longer on a channel.
pub(crate) fn is_part_of_more(s: &Searched<'_>, readings: &Range<usize>, lr: f64) -> bool {
    let n = s.e.len();
    let near = |e: &Excursion| {
        let turn = e.with_margin(n);
        turn.start < readings.end + readings.len() && readings.start < turn.end + readings.len()
    };
    s.target.excursions.iter().any(near) || goes_on(s, readings, lr)
}

/// Whether the noise of a channel is none whose far readings are known.
pub(crate) fn lawless(failing: &dyn Fn(CheckId) -> bool) -> bool {
    failing(CheckId::Kurtosis) || LAWS.into_iter().any(failing)
}

/// Why a turn of the base is not borne out by what a channel does otherwise; nothing where it is.
pub(crate) fn no_turn(
    s: &Searched<'_>,
    turn: &Excursion,
    failing: &dyn Fn(CheckId) -> bool,
) -> Option<&'static str> {
    let around = turn.with_margin(s.e.len());
    let energy = 0.5 * turn.peak.0.powi(2) * turn.samples.len() as f64 / s.state.solution.white;
    if goes_on(s, &around, energy) {
        return Some("it goes on beside");
    }
    let step = |f: &Form| matches!(f, Form::Step(at, _) if around.contains(&(*at as usize)));
    if s.state.terms.iter().any(|t| step(&t.form)) {
        return Some("the level is another one after it");
    }
    let fastest = (FASTEST / turn.samples.len().max(1) as f64).min(1.0);
    let wandering = [CheckId::ProcessLaw, CheckId::ProcessLevels];
    let notes = (s.state.notes.iter())
        .any(|note| note.at.is_empty() || note.at.iter().any(|(from, _)| from / PI < fastest));
    let mut left = residual::failing_bands(&s.u).chain(residual::unsteady(&s.e));
    let has_its_like =
        notes || wandering.into_iter().any(failing) || left.any(|p| p.from < fastest);
    has_its_like.then_some("it has its like in what is left")
}

/// Longest that a blow lasts that shifts a bias, s: far readings within it of the step are the blow itself.
pub(crate) const BLOW_S: f64 = 1.0;

/// When a bias steps, s, where a finding says so.
pub(crate) fn step_at(f: &Finding) -> Option<f64> {
    let time = f.parameters.get("time").map(|p| p.value);
    time.filter(|_| f.cause == "bias_step")
}

/// Whether the far readings of a finding lie all at a step at that time, s.
pub(crate) fn blow_of(f: &Finding, at: f64) -> bool {
    !f.times_s.is_empty() && f.times_s.iter().all(|t| (t - at).abs() < BLOW_S)
}
