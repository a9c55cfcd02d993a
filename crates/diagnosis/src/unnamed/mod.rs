//! What is left of a record as terms of a model: a size and a place in the domain where it lies, in the place of a name.
//!
//! Under them a simulation is the record's where nothing can be named. Each is sought only on channels where the search, or the
//! replicates of the model, left something.

mod bump;
mod followed;
mod sizes;
mod spectrum;
mod white;

use std::collections::BTreeSet;

use model::Parameter;
use model::effect::{Parameters, Signal, extremes};
use model::record::Quantity;
use model::unnamed::{Column, Domain, Unnamed};

use crate::criticise::one_source;
use crate::fit::before_filter::{HALF_WIDTH, error_of_root, error_of_square};
use crate::fit::channel::{Form, Term};
use crate::ingest::types::Grid;
use crate::result::Finding;
use crate::search::searched::Searched;
use crate::test_level::{self, Observation};
use bump::Bump;
use followed::of_combinations;
use spectrum::{Spectrum, as_one, spectrum};
use white::{White, hz};

/// Channels that terms are sought for.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Wanted {
    /// By themselves.
    pub channels: BTreeSet<String>,
    /// With others.
    pub pairs: BTreeSet<[String; 2]>,
}

impl Wanted {
    /// Where something was seen.
    pub(crate) fn of(seen: &[Observation]) -> Self {
        let mut all = Self::default();
        seen.iter().for_each(|o| all.add(o));
        all
    }

    /// Adds what one observation is of.
    pub(crate) fn add(&mut self, seen: &Observation) {
        match seen.domain {
            test_level::Domain::Noise => {
                self.channels.insert(seen.channel.clone());
            }
            test_level::Domain::Coupling => {
                for other in &seen.follows {
                    let mut pair = [seen.channel.clone(), other.clone()];
                    pair.sort();
                    self.pairs.insert(pair);
                }
            }
            test_level::Domain::Codes | test_level::Domain::Readings => {}
        }
    }
}

/// The noise of a channel beside what has no name, over that without it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Beside {
    pub channel: String,
    /// Of the white variance.
    pub white: f64,
    /// Standard error of that.
    pub white_error: f64,
    /// What all that has no name has of the white variance at each frequency: white as well as not.
    pub floor: f64,
    /// Of the variance of a step of the random walk.
    pub walk: f64,
}

impl Beside {
    /// The noise of a baseline beside it.
    pub(crate) fn on(&self, baseline: &mut Parameters) {
        if let Some(p) = baseline.get_mut("angle_random_walk") {
            let variance = p.value * p.value;
            let before = error_of_square(p.value, p.std_error.unwrap_or(0.0));
            let fitted = before.max(variance * self.white_error);
            let error = fitted.hypot(variance * self.floor / HALF_WIDTH);
            p.value *= self.white.sqrt();
            p.std_error = Some(error_of_root(p.value * p.value, error));
        }
        if let Some(p) = baseline.get_mut("rate_random_walk") {
            p.value *= self.walk.sqrt();
            p.std_error = p.std_error.map(|e| e * self.walk.sqrt());
        }
    }
}

/// What was fitted.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Fitted {
    pub terms: Vec<Unnamed>,
    pub beside: Vec<Beside>,
}

/// Causes by which axes share noise already.
const SHARING: [&str; 4] = [
    model::effects::common_noise::ID,
    model::effects::correlated_noise::ID,
    model::effects::cross_axis::ID,
    model::effects::base_motion::ID,
];

/// The terms of what is wanted, beside these causes, of which some only stand `nearest` to what has no name.
pub(crate) fn fit(
    searched: &[Searched<'_>],
    grid: &Grid,
    wanted: &Wanted,
    causes: &[&Finding],
    nearest: &[&Finding],
) -> Fitted {
    let mut all = Fitted::default();
    let mut whites: Vec<(&Searched<'_>, White)> = vec![];
    for s in searched.iter().filter(|s| !s.target.moving) {
        let name = &s.target.name;
        let alone = wanted.channels.contains(name);
        let paired = wanted.pairs.iter().any(|p| p.contains(name));
        // Of one band only where something is left.
        let mut merged = as_one(s, if alone { 1 } else { 2 });
        // A tone that other axes feel too has no detail of its own.
        let felt = |id: &str| {
            let mut all = causes
                .iter()
                .filter(|f| f.cause == id && f.channels.contains(name));
            all.any(|f| f.channels.len() > 1)
        };
        merged.retain(|tone| !felt(tone.id));
        if !alone && !paired && merged.is_empty() {
            continue;
        }
        let own = (alone || !merged.is_empty())
            .then(|| spectrum(s, &merged))
            .flatten();
        let density = match &own {
            Some(found) => found.density.clone(),
            None => s.state.noise.over(&s.search.panel.bins),
        };
        let white = White::of(s, density);
        let floor = floor(s, own.as_ref().map_or(&[], |f| &f.bumps), nearest);
        if let Some(found) = &own {
            all.terms.extend(of_spectrum(s, found, grid.rate_hz));
        }
        if own.is_some() || floor > 0.0 {
            all.beside.push(Beside {
                channel: name.clone(),
                white: own.as_ref().map_or(1.0, |f| f.white),
                white_error: own.as_ref().map_or(0.0, |f| f.white_error),
                floor,
                walk: own.as_ref().map_or(1.0, |f| f.walk),
            });
        }
        if alone {
            all.terms.extend(of_white(s, &white, grid.rate_hz));
            all.terms.extend(of_combinations(s, grid));
            all.terms.extend(of_lag(s, grid.rate_hz));
            all.terms.extend(of_signals(s, &white, grid, causes));
        }
        whites.push((s, white));
    }
    let of_pair = |pair| of_pair(pair, &whites, causes);
    all.terms.extend(wanted.pairs.iter().filter_map(of_pair));
    all
}

/// What bumps, and the processes that only stand nearest to what has no name, have together of the white density at every frequency.
fn floor(s: &Searched<'_>, bumps: &[Bump], nearest: &[&Finding]) -> f64 {
    let bins = &s.search.panel.bins;
    let stands = |t: &&Term| {
        let mut all = nearest.iter().filter(|f| f.cause == t.effect.id());
        all.any(|f| f.channels.contains(&s.target.name))
    };
    let mut sum = vec![0.0; bins.at.omega.len()];
    let mut add = |density: Vec<f64>| sum.iter_mut().zip(density).for_each(|(s, d)| *s += d);
    bumps.iter().for_each(|b| add(b.over(&bins.at.omega)));
    for term in s.state.terms.iter().filter(stands) {
        match &term.form {
            Form::Covariance(process, theta) if !process.filters_white() => {
                add(process.density(theta, &bins.at));
            }
            _ => {}
        }
    }
    let least = |each: &mut dyn Iterator<Item = f64>| each.fold(f64::INFINITY, f64::min);
    match s.state.noise.filter().map(|only| only.over(bins)) {
        None => least(&mut sum.iter().copied()),
        // Through the filter, or as what comes behind it: of either the slowest make an angle.
        Some(white) => {
            let through = least(&mut sum.iter().zip(&white).map(|(s, w)| s / w));
            through.max(least(&mut sum.iter().copied()) / white[0])
        }
    }
}

/// What the white noise of two channels shares, where none of these causes has it.
fn of_pair(
    pair: &[String; 2],
    whites: &[(&Searched<'_>, White)],
    causes: &[&Finding],
) -> Option<Unnamed> {
    let of = |name: &String| whites.iter().find(|w| w.0.target.name == *name);
    let shares = |f: &&Finding| {
        let both = pair.iter().all(|c| f.channels.contains(c));
        both && (SHARING.contains(&f.cause.as_str()) || one_source::is_shared(f))
    };
    let ((a, white), (b, other)) = (of(&pair[0])?, of(&pair[1])?);
    if causes.iter().any(shares) {
        return None;
    }
    let r = white.shared_with(other)?;
    let sigma = (a.state.solution.white * b.state.solution.white).powf(0.25);
    Some(Unnamed {
        domain: Domain::Cross,
        channels: pair.to_vec(),
        follows: None,
        refines: None,
        rms: Parameter::exact(r.abs().sqrt() * sigma, &a.target.unit),
        columns: vec![Column::new(vec![r], "1")],
    })
}

fn term(s: &Searched<'_>, domain: Domain, rms: f64, columns: Vec<Column>) -> Unnamed {
    Unnamed {
        domain,
        channels: vec![s.target.name.clone()],
        follows: None,
        refines: None,
        rms: Parameter::exact(rms, &s.target.unit),
        columns,
    }
}

/// The bands of each tone in detail, and what is noise beside them.
fn of_spectrum(s: &Searched<'_>, found: &Spectrum, rate_hz: f64) -> Vec<Unnamed> {
    let white = s.state.solution.white;
    let of = |bumps: &[Bump], refines: Option<&str>| {
        let column = |unit: &str, of: &dyn Fn(&Bump) -> f64| {
            Column::new(bumps.iter().map(of).collect(), unit)
        };
        let columns = vec![
            column("Hz", &|b| hz(b.center, rate_hz)),
            column("Hz", &|b| hz(b.width, rate_hz)),
            column(&s.target.unit, &|b| (white * b.variance).sqrt()),
        ];
        let variance: f64 = bumps.iter().map(|b| white * b.variance).sum();
        Unnamed {
            refines: refines.map(str::to_owned),
            ..term(s, Domain::Spectrum, variance.sqrt(), columns)
        }
    };
    let tones = found.tones.iter().map(|(id, bumps)| of(bumps, Some(id)));
    let noise = (!found.bumps.is_empty()).then(|| of(&found.bumps, None));
    tones.chain(noise).collect()
}

/// Noise that comes again.
fn of_lag(s: &Searched<'_>, rate_hz: f64) -> Option<Unnamed> {
    let (lag, correlation) = s.state.terms.iter().find_map(Term::lag)?;
    // Of white noise of variance 1 and one p that comes again after the lag, +-p / (2 (1 + p)).
    let r = correlation.abs();
    let size = (s.state.solution.white * 2.0 * r / (1.0 - 2.0 * r)).sqrt();
    let columns = vec![
        Column::new(vec![lag as f64 / rate_hz], "s"),
        Column::new(vec![size], &s.target.unit),
        Column::new(vec![correlation.signum()], "1"),
    ];
    Some(term(s, Domain::Lag, size, columns))
}

/// What follows the channels that were recorded beside the gyros, straight, but for those that a source shakes together with the axis.
fn of_signals(
    s: &Searched<'_>,
    white: &White<'_>,
    grid: &Grid,
    causes: &[&Finding],
) -> Vec<Unnamed> {
    let axis = |signal: &Signal| signal.axis.is_none() || signal.axis == s.target.axis;
    let own = grid.signals.iter().filter(|signal| match signal.quantity {
        Quantity::Temp => axis(signal),
        Quantity::Supply | Quantity::Acc | Quantity::Pwm => true,
        _ => false,
    });
    let shaken = |signal: &&Signal| {
        let mut causes = causes.iter();
        causes
            .any(|f| f.channels.contains(&s.target.name) && one_source::is_read_by(f, &signal.name))
    };
    let terms = own.filter(|signal| !shaken(signal)).filter_map(|signal| {
        let values: &[f64] = &signal.smooth;
        let slope = white.slope_over(values)?;
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
        let ends = extremes(values);
        let levels = ends.map(|v| slope * (v - mean));
        Some(Unnamed {
            follows: Some(signal.name.clone()),
            ..term(
                s,
                Domain::Channel,
                slope.abs() * square.sqrt(),
                vec![
                    Column::new(ends.into(), &signal.unit),
                    Column::new(levels.into(), &s.target.unit),
                ],
            )
        })
    });
    terms.collect()
}

/// The course of the size of the white noise, and the shape of its distribution.
fn of_white(s: &Searched<'_>, white: &White<'_>, rate_hz: f64) -> Vec<Unnamed> {
    let sigma = s.state.solution.white.sqrt();
    let mut all = vec![];
    if let Some((times, factors)) = white.course(rate_hz) {
        let n = factors.len() as f64;
        let square = factors.iter().map(|f| (f - 1.0).powi(2)).sum::<f64>() / n;
        all.push(term(
            s,
            Domain::Variance,
            sigma * square.sqrt().sqrt(),
            vec![Column::new(times, "s"), Column::new(factors, "1")],
        ));
    }
    if let Some(shape) = white.shape() {
        // What of the variance lies elsewhere than a normal distribution has it: by the leading terms of its Hermite series.
        let square = shape[0].powi(2) / 6.0 + shape[1].powi(2) / 24.0;
        all.push(term(
            s,
            Domain::Codes,
            sigma * square.sqrt(),
            shape.map(|v| Column::new(vec![v], "1")).into(),
        ));
    }
    all
}
