//! The model that is handed over: of everything that was found the parameters under which a simulation is the record's.
//! What each of them is to a simulation, docs/model-file.md states.

mod counts;

use std::collections::BTreeMap;

use model::effect::{Frames, Frequencies, Hypothesis, Parameters, slowest};
use model::effects::{base_motion, effect};
use model::excitation::at_rest;
use model::file::{ChannelModel, EffectModel, FittedOn, ModelFile};
use model::record::Base;
use model::unnamed::Unnamed;

use self::counts::before_counts;
use crate::attribute::events;
use crate::fit::before_filter;
use crate::fit::channel::{Levels, State, VarianceFound};
use crate::ingest::types::Grid;
use crate::joint::{levels_of, levels_under};
use crate::report::findings::peak_rate;
use crate::result::{Finding, Parameter};
use crate::search::searched::Searched;
use crate::unnamed::Fitted;

/// Least part of the white variance that is an axis' own.
const LEAST_OWN: f64 = 1e-6;

/// The model that the record was held against.
pub(crate) fn baseline_model(
    searched: &[Searched<'_>],
    grid: &Grid,
    fitted_on: FittedOn,
) -> ModelFile {
    model(searched, grid, &|s| baseline(s, grid), fitted_on)
}

/// The model extended by the findings `named` and by what has no name. What was mended before the search adds nothing to what was
/// fitted.
pub(crate) fn extended_model(
    searched: &[Searched<'_>],
    grid: &Grid,
    named: &[&Finding],
    unnamed: &Fitted,
    is_mended: &dyn Fn(&EffectModel) -> bool,
    fitted_on: FittedOn,
) -> ModelFile {
    let mut extended = model(searched, grid, &|s| beside(s, named, grid), fitted_on);
    extended.effects = effects_of(named);
    for (channel, s) in extended.channels.iter_mut().zip(searched) {
        let frames = Frames {
            samples: grid.n,
            rate_hz: grid.rate_hz,
        };
        before_filters(channel, &extended.effects, s, frames);
    }
    // A tone that is not handed over has no detail.
    let known = |t: &&Unnamed| {
        let of = |cause: &String| extended.effects.iter().any(|e| e.cause == *cause);
        t.refines.as_ref().is_none_or(of)
    };
    extended.unnamed = unnamed.terms.iter().filter(known).cloned().collect();
    for own in &unnamed.beside {
        let channel = extended.channels.iter_mut().find(|c| c.name == own.channel);
        if let Some(channel) = channel {
            own.on(&mut channel.baseline);
        }
    }
    let read: Vec<EffectModel> = (extended.effects.iter())
        .filter(|e| !is_mended(e))
        .cloned()
        .collect();
    for (channel, s) in extended.channels.iter_mut().zip(searched) {
        // What was fitted to a motion of the base is no noise of the sensor.
        let by_table = turned_by_table(s, grid);
        if by_table || s.target.moving && grid.base != Some(Base::Turntable) {
            at_rest(channel, &s.target.y, grid.rate_hz);
        }
        // What a table does is known, and no finding; a simulation has to hold it.
        if by_table {
            extended.effects.push(motion_of(s, grid));
        }
        let lost = s.target.lost.len() as f64 / grid.n as f64;
        before_counts(channel, &read, &s.target.y, grid.rate_hz, lost);
    }
    extended
}

/// Whether a table turns this axis.
fn turned_by_table(s: &Searched<'_>, grid: &Grid) -> bool {
    s.target.moving && !s.target.astray && grid.base == Some(Base::Turntable)
}

/// The motion of the base about an axis, as an input of the model.
fn motion_of(s: &Searched<'_>, grid: &Grid) -> EffectModel {
    let peak = peak_rate(&grid.dct, &s.target.y, s.target.white, grid.rate_hz);
    let peak = Parameter::estimated(peak.0, peak.1, &s.target.unit);
    EffectModel {
        cause: base_motion::ID.into(),
        channels: vec![s.target.name.clone()],
        parameters: [("peak".to_owned(), peak)].into(),
    }
}

/// The noise before the filters among the effects, and as what holds readings makes it, in the place of that of the readings: what an
/// angle grows by.
fn before_filters(
    channel: &mut ChannelModel,
    effects: &[EffectModel],
    s: &Searched<'_>,
    frames: Frames,
) {
    let own = (effects.iter()).filter(|e| e.channels.contains(&channel.name));
    let known = own.filter_map(|e| Some((effect(&e.cause)?, &e.parameters)));
    let at = Frequencies::default();
    let filtered = known.clone().any(|(e, p)| e.passes(p, &at).is_some());
    let holds = known.clone().any(|(e, p)| e.holds(p, frames).is_some());
    let Some(p) = (channel.baseline.get_mut("angle_random_walk")).filter(|_| filtered || holds)
    else {
        return;
    };
    let over = slowest(known, frames).sqrt();
    let error = match filtered {
        true => 0.5 * before_filter::error(&s.search.panel, &s.state),
        false => 0.0,
    };
    p.value *= over;
    p.std_error = p.std_error.map(|own| (own * over).hypot(error * p.value));
}

/// The noise and bias of each channel of a model.
pub(crate) fn parameters_of(model: &ModelFile) -> BTreeMap<String, Parameters> {
    let own = |c: &ChannelModel| (c.name.clone(), c.baseline.clone());
    model.channels.iter().map(own).collect()
}

fn model(
    searched: &[Searched<'_>],
    grid: &Grid,
    of: &dyn Fn(&Searched<'_>) -> Parameters,
    fitted_on: FittedOn,
) -> ModelFile {
    let channel = |s: &Searched<'_>| ChannelModel {
        name: s.target.name.clone(),
        unit: s.target.unit.clone(),
        lsb: s.target.lsb,
        baseline: of(s),
    };
    ModelFile {
        stand: "fitted".into(),
        rate_hz: grid.rate_hz,
        fitted_on: Some(fitted_on),
        excitation: BTreeMap::new(),
        channels: searched.iter().map(channel).collect(),
        effects: vec![],
        unnamed: vec![],
    }
}

/// The baseline that the record was held against.
fn baseline(s: &Searched<'_>, grid: &Grid) -> Parameters {
    parameters(s, &s.baseline, &levels_of(s, &s.baseline), grid)
}

/// The baseline beside the causes `named`.
fn beside(s: &Searched<'_>, named: &[&Finding], grid: &Grid) -> Parameters {
    let on_it = |f: &&&Finding| f.channels.contains(&s.target.name);
    let is_named =
        |v: &&VarianceFound| named.iter().filter(on_it).any(|f| f.cause == v.effect.id());
    let laws: Vec<&VarianceFound> = s.variance.each.iter().filter(is_named).collect();
    let mut levels = match &s.joint {
        Some(joint) if laws.len() == s.variance.each.len() => joint.levels,
        _ => levels_under(s, &laws),
    };
    let mut common = s.search.candidates.iter();
    let common = common.find(|c| matches!(c.hypothesis, Hypothesis::Common));
    let common = common.map(|c| c.effect.id());
    let mut shared = named
        .iter()
        .filter(on_it)
        .filter(|f| Some(f.cause.as_str()) == common);
    if let Some(sigma) = shared.next().and_then(|f| f.parameters.get("sigma")) {
        levels = own_part(&levels, sigma, grid.n as f64);
    }
    parameters(s, &s.state, &levels, grid)
}

/// The noise of an axis without what it shares with others.
fn own_part(all: &Levels, sigma: &Parameter, n: f64) -> Levels {
    let shared = sigma.value * sigma.value;
    let shared_error = 2.0 * sigma.value * sigma.std_error.unwrap_or(0.0);
    let own = (all.white - shared).max(LEAST_OWN * all.white);
    // Of jointly normal values, cov(aa, ab) = 2 E[aa] E[ab].
    let error = (all.white * all.white_error).powi(2) + shared_error * shared_error
        - 2.0 * 2.0 * all.white * shared / n;
    let white_error = error.max(0.0).sqrt() / own;
    let log_walk = all.log_walk + (all.white / own).ln();
    Levels {
        white: own,
        white_error,
        log_walk,
        ..*all
    }
}

fn parameters(s: &Searched<'_>, state: &State, levels: &Levels, grid: &Grid) -> Parameters {
    let (unit, rate) = (s.target.unit.as_str(), grid.rate_hz);
    let white = levels.white.sqrt();
    let walk = white * (levels.log_walk / 2.0).exp() * rate.sqrt();
    let (density, density_unit) = if unit == "deg/s" {
        (60.0 / rate.sqrt(), "deg/sqrt(h)".to_owned())
    } else {
        (1.0 / rate.sqrt(), format!("{unit}*sqrt(s)"))
    };
    let mean_error = mean_error(s, state, walk, rate);
    let named = |name: &str, value, error, unit: &str| {
        (name.to_owned(), Parameter::estimated(value, error, unit))
    };
    [
        named("bias", bias(s, state, grid), mean_error, unit),
        named(
            "angle_random_walk",
            white * density,
            white * density * before_filter::error_of_root(1.0, levels.white_error),
            &density_unit,
        ),
        named(
            "rate_random_walk",
            walk,
            walk * levels.walk_error,
            &format!("{unit}/sqrt(s)"),
        ),
    ]
    .into()
}

/// Standard error of the mean beside a random walk of `walk` per root second: white noise and processes by their density at
/// the lowest frequency of the record, 1 / 2T.
fn mean_error(s: &Searched<'_>, state: &State, walk: f64, rate_hz: f64) -> f64 {
    let n = s.search.panel.bins.n as f64;
    let mut stationary = state.noise_beside_level();
    stationary.log_walk = f64::NEG_INFINITY;
    let lowest = stationary.everywhere(&s.search.panel.bins)[1];
    (state.solution.white * lowest / n + walk * walk * n / rate_hz / 3.0).sqrt()
}

/// The mean of the readings less that of what the terms add, a level that is known among them.
fn bias(s: &Searched<'_>, state: &State, grid: &Grid) -> f64 {
    let n = grid.n as f64;
    let mean = s.target.y.iter().sum::<f64>() / n;
    let beta = state.terms.iter().zip(&s.found).flat_map(|(t, found)| {
        let own = t.columns.iter().zip(&found.coefficients);
        own.map(|(c, (beta, _))| (*c, *beta))
    });
    let added = beta.filter_map(|(c, beta)| {
        let first = s.search.panel.first(c, 1);
        first.first().map(|sum| beta * sum / n.sqrt())
    });
    let level = state.level.iter().flat_map(|level| level.iter());
    mean - added.sum::<f64>() - level.sum::<f64>() / n
}

/// Gives far readings their sides, their size (the root of the mean square of how far they lie from what the model expects
/// there) and its spread, both less what the noise adds.
pub(crate) fn size_outliers(findings: &mut [Finding], searched: &[Searched<'_>]) {
    for f in findings.iter_mut().filter(|f| f.cause == "outliers") {
        let own = searched
            .iter()
            .find(|s| f.channels == [s.target.name.as_str()]);
        let Some(s) = own.filter(|s| !s.target.moving) else {
            continue;
        };
        let sizes = events::sizes(s, &f.times_s);
        if sizes.is_empty() {
            continue;
        }
        let unit = &s.target.unit;
        f.parameters
            .extend(far_readings(&sizes, s.state.solution.white, unit));
    }
}

/// The parameters of readings that lie `sizes` off in white noise of variance `white`.
fn far_readings(sizes: &[f64], white: f64, unit: &str) -> Parameters {
    let count = sizes.len() as f64;
    let mean = |of: &dyn Fn(f64) -> f64| sizes.iter().map(|v| of(*v)).sum::<f64>() / count;
    let square = mean(&|v| v * v);
    let size = (square - white).max(0.0).sqrt();
    let above = mean(&|v| f64::from(u8::from(v > 0.0)));
    let side_error = (above * (1.0 - above) / count).sqrt();
    let named = |name: &str, value, error, unit: &str| {
        (name.to_owned(), Parameter::estimated(value, error, unit))
    };
    let mut parameters: Parameters = [named("upward", above, side_error, "1")].into();
    let mut size_error = (white / count).sqrt();
    let free = count - 1.0;
    if free > 0.0 {
        // The distances of others of the kind vary by the spread and by the noise.
        let about = mean(&|v| v.abs());
        let variance = mean(&|v| (v.abs() - about).powi(2)) * count / free;
        size_error = size_error.max((variance / count).sqrt());
        let spread = (variance - white).max(0.0).sqrt().min(size);
        let error = (variance.max(white) / (2.0 * free)).sqrt();
        parameters.extend([named("spread", spread, error, unit)]);
    }
    parameters.extend([named("size", size, size_error, unit)]);
    parameters
}

/// The effects of the extended model: the causes, and what stands for the unexplained in it.
pub(crate) fn effects_of(findings: &[&Finding]) -> Vec<EffectModel> {
    let mut all = vec![];
    for f in findings {
        let Some(e) = effect(&f.cause) else { continue };
        let known = |p: &Parameters| -> Parameters {
            p.iter()
                .filter(|(k, _)| e.parameters().iter().any(|s| s.name == *k))
                .map(|(k, v)| (k.clone(), v.clone()))
                .collect()
        };
        if f.per_channel.is_empty() && f.occurrences.is_empty() {
            let whole = f.components.is_empty().then_some(&f.parameters);
            all.extend(whole.into_iter().chain(&f.components).map(|p| EffectModel {
                cause: f.cause.clone(),
                channels: f.channels.clone(),
                parameters: known(p),
            }));
        }
        let whole = f.occurrences.is_empty().then_some(&f.per_channel);
        let several = f.occurrences.iter().chain(&f.harmonics);
        for once in whole.into_iter().chain(several) {
            // What is the same to the last digit on several channels is one event on all of them.
            let first = all.len();
            for (channel, p) in once {
                let parameters = known(p);
                match all[first..].iter_mut().find(|e| e.parameters == parameters) {
                    Some(same) => same.channels.push(channel.clone()),
                    None => all.push(EffectModel {
                        cause: f.cause.clone(),
                        channels: vec![channel.clone()],
                        parameters,
                    }),
                }
            }
        }
    }
    all
}
