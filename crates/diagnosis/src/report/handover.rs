//! The model that is handed over: of everything that was found the parameters under which a simulation is the record's.
//! What each of them is to a simulation, docs/model-file.md states.

use std::collections::BTreeMap;

use model::effect::{Effect, Frames, Frequencies, Hypothesis, Parameters, Stage, slowest};
use model::effects::effect;
use model::excitation::at_rest;
use model::file::{ChannelModel, EffectModel, FittedOn, ModelFile};
use model::record::Base;
use model::simulate::white_of;
use model::unnamed::Unnamed;

use crate::attribute::events;
use crate::fit::before_filter;
use crate::fit::channel::{Levels, State, VarianceFound};
use crate::ingest::types::Grid;
use crate::joint::{levels_of, levels_under};
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
        if s.target.moving && grid.base != Some(Base::Turntable) {
            at_rest(channel, &s.target.y, grid.rate_hz);
        }
        let lost = s.target.lost.len() as f64 / grid.n as f64;
        before_counts(channel, &read, &s.target.y, grid.rate_hz, lost);
    }
    extended
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

/// Spread of the readings over that of their noise up to which their level stands still.
const STANDS: f64 = 1.2;
/// Samples of a simulation that tells what a fault of the counts adds, and how often it is made.
const SAMPLES: f64 = 20_000.0;
const TIMES: usize = 8;

/// The channel without what faults of the counts among the `effects` add by themselves: noise and level that readings of the
/// noise and level `channel` has come of, by simulations with them and without, of the same random numbers. What the audit
/// took out, a part `lost` of the readings, was not fitted.
fn before_counts(
    channel: &mut ChannelModel,
    effects: &[EffectModel],
    values: &[f64],
    rate_hz: f64,
    lost: f64,
) {
    // Bits that are cut off take half of the coarse step, less that of the fine one.
    let own = effects
        .iter()
        .filter(|e| e.channels.contains(&channel.name));
    let coarser = own
        .filter_map(|e| Some((effect(&e.cause)?, e)))
        .filter(|(known, _)| known.stage() == Stage::Counts)
        .map(|(known, e)| known.coarsens(&e.parameters));
    let cut = 0.5 * (coarser.product::<f64>() - 1.0) * channel.lsb.unwrap_or(0.0);
    if let Some(bias) = channel.baseline.get_mut("bias") {
        bias.value += cut;
    }
    // Where the level moves over many steps, a rounding adds nothing to mean and noise.
    let sigma = numerics::order_statistics::robust_sigma(values);
    let white = channel.baseline.get("angle_random_walk");
    let white = white.map_or(0.0, |p| white_of(&channel.unit, p.value, rate_hz));
    let stands = sigma < STANDS * white;
    let faults = effects.iter().filter(|e| {
        let on_counts = |known: &&dyn Effect| match known.stage() {
            Stage::Counts => known.coarsens(&e.parameters) == 1.0,
            Stage::Reading => known.coarsens(&e.parameters) != 1.0 && stands,
            _ => false,
        };
        e.channels.contains(&channel.name) && effect(&e.cause).is_some_and(|k| on_counts(&k))
    });
    let mut model = ModelFile {
        rate_hz,
        effects: faults.cloned().collect(),
        ..ModelFile::default()
    };
    model
        .effects
        .iter_mut()
        .for_each(|e| e.channels = vec![channel.name.clone()]);
    if model.effects.is_empty() {
        return;
    }
    // More than one noise and level can give the mean and the noise that were read: the one whose readings are spread alike is it.
    let mut read = values.to_vec();
    read.sort_by(f64::total_cmp);
    let starts = LEVELS.iter().flat_map(|l| NOISES.map(|n| (*l, n)));
    let settled = starts.filter_map(|start| settled(&mut model, channel, &read, start, lost));
    let Some((start, _)) = settled.min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return;
    };
    let Some(own) = settling(&mut model, channel, start, lost, SAMPLES) else {
        return;
    };
    for name in ["bias", "angle_random_walk"] {
        if let (Some(to), Some(of)) = (channel.baseline.get_mut(name), own.baseline.get(name)) {
            to.value = of.value;
        }
    }
}

/// Where the levels and noises before a fault of the counts are sought: in standard deviations of what was read from the mean of
/// that, and as parts of its noise.
const LEVELS: [f64; 7] = [-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5];
const NOISES: [f64; 2] = [1.0, 0.5];
/// Samples of a simulation that compares them: a twentieth of a standard deviation shows.
const FEW_SAMPLES: f64 = 4_000.0;
/// Quantiles by which readings are compared.
const QUANTILES: usize = 50;

/// The channel before the fault, sought from a place; none where it cannot be told.
fn settling(
    model: &mut ModelFile,
    channel: &ChannelModel,
    from: (f64, f64),
    lost: f64,
    samples: f64,
) -> Option<ChannelModel> {
    let mut own = channel.clone();
    own.baseline.remove("rate_random_walk");
    own.baseline.get_mut("bias")?.value += from.0;
    own.baseline.get_mut("angle_random_walk")?.value *= from.1;
    for _ in 0..TIMES {
        let added = added_by_counts(model, &own, lost, samples)?;
        for (name, by) in [("bias", added.mean), ("angle_random_walk", added.factor)] {
            let (own, read) = (own.baseline.get_mut(name)?, channel.baseline.get(name)?);
            let wanted = if name == "bias" {
                read.value - by
            } else {
                read.value / by
            };
            own.value = 0.5 * (own.value + wanted);
        }
    }
    Some(own)
}

/// A start, in the channel's unit, and how far apart the quantiles of what was read and of a simulation from there are; `start` is in
/// standard deviations of what was `read`, which is in ascending order.
fn settled(
    model: &mut ModelFile,
    channel: &ChannelModel,
    read: &[f64],
    start: (f64, f64),
    lost: f64,
) -> Option<((f64, f64), f64)> {
    let mean = read.iter().sum::<f64>() / read.len() as f64;
    let square = read.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    let from = (start.0 * (square / read.len() as f64).sqrt(), start.1);
    let own = settling(model, channel, from, lost, FEW_SAMPLES)?;
    let mut made = added_by_counts(model, &own, lost, FEW_SAMPLES)?.with;
    made.sort_by(f64::total_cmp);
    let at = |x: &[f64], q: usize| x[(2 * q + 1) * x.len() / (2 * QUANTILES)];
    let apart = (0..QUANTILES).map(|q| (at(read, q) - at(&made, q)).abs());
    Some((from, apart.sum()))
}

/// What a fault of the counts adds.
struct Added {
    /// To the mean.
    mean: f64,
    /// By which the noise is larger.
    factor: f64,
    /// What is read.
    with: Vec<f64>,
}

/// What the effects of a model add to the mean of a channel, and the factor by which they make its noise larger; none where
/// most of the readings that they change are taken out, or nothing can be simulated.
fn added_by_counts(
    model: &mut ModelFile,
    channel: &ChannelModel,
    lost: f64,
    samples: f64,
) -> Option<Added> {
    model.channels = vec![channel.clone()];
    let effects = std::mem::take(&mut model.effects);
    let run = |model: &ModelFile| {
        let record = model::simulate(model, samples / model.rate_hz, model.rate_hz, 1).ok()?;
        let own = record.channels.into_iter().find(|c| c.name == channel.name);
        own.map(|c| c.values)
    };
    let without = run(model);
    model.effects = effects;
    let (without, with) = (without?, run(model)?);
    let count = with.len() as f64;
    let changed = with.iter().zip(&without).filter(|(a, b)| a != b).count() as f64 / count;
    let mean = |x: &[f64]| x.iter().sum::<f64>() / count;
    let power = |x: &[f64]| x.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>();
    let factor = (power(&with) / power(&without)).sqrt();
    let told = lost < 0.5 * changed && factor.is_finite() && factor > 0.0;
    told.then(|| Added {
        mean: mean(&with) - mean(&without),
        factor,
        with,
    })
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
        for once in whole.into_iter().chain(&f.occurrences) {
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
