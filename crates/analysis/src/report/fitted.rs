//! The fitted models, as files hold them: the baseline, and the one extended by what was found.

use std::collections::BTreeMap;

use model::effect::Parameters;
use model::effects::effect;
use model::file::{ChannelModel, EffectModel, FittedOn, ModelFile};

use crate::fit::channel::State;
use crate::fit::estimate;
use crate::ingest::types::Grid;
use crate::result::{Finding, Parameter};
use crate::search::searched::Searched;

/// White noise, random walk and bias of each channel, under its baseline or (`extended`) beside what was found.
pub(crate) fn parameters(
    searched: &[Searched<'_>],
    grid: &Grid,
    extended: bool,
) -> BTreeMap<String, Parameters> {
    let of = |s: &Searched<'_>| {
        let state = if extended { &s.state } else { &s.baseline };
        (s.target.name.clone(), baseline_of(s, state, grid))
    };
    searched.iter().map(of).collect()
}

/// The model file of all channels: their parameters, and the effects of `findings`, which stand in their order.
pub(crate) fn model<'a>(
    searched: &[Searched<'_>],
    grid: &Grid,
    extended: bool,
    findings: impl Iterator<Item = &'a Finding>,
    fitted_on: FittedOn,
) -> ModelFile {
    let mut baselines = parameters(searched, grid, extended);
    let channel = |s: &Searched<'_>| ChannelModel {
        name: s.target.name.clone(),
        unit: s.target.unit.clone(),
        lsb: s.target.lsb,
        baseline: baselines.remove(&s.target.name).unwrap_or_default(),
    };
    ModelFile {
        stand: "fitted".into(),
        rate_hz: grid.rate_hz,
        fitted_on: Some(fitted_on),
        excitation: BTreeMap::new(),
        channels: searched.iter().map(channel).collect(),
        effects: effects_of(findings),
    }
}

fn baseline_of(s: &Searched<'_>, state: &State, grid: &Grid) -> Parameters {
    let (unit, rate) = (s.target.unit.as_str(), grid.rate_hz);
    let white = state.solution.white.sqrt();
    let n = grid.n as f64;
    let mean = s.target.y.iter().sum::<f64>() / n;
    let errors = estimate::noise_errors(&s.search.panel, state);
    let walk = white * (state.noise.log_walk / 2.0).exp() * rate.sqrt();
    let walk_error = walk * errors.first().copied().unwrap_or(f64::NAN) / 2.0;
    let in_degrees = unit == "deg/s";
    let (density, density_unit) = if in_degrees {
        (60.0 / rate.sqrt(), "deg/sqrt(h)".to_owned())
    } else {
        (1.0 / rate.sqrt(), format!("{unit}*sqrt(s)"))
    };
    let mut all = Parameters::new();
    all.insert(
        "bias".into(),
        Parameter::estimated(
            mean,
            (white * white / n + walk * walk * n / rate / 3.0).sqrt(),
            unit,
        ),
    );
    all.insert(
        "angle_random_walk".into(),
        Parameter::estimated(
            white * density,
            white * density / (2.0 * n).sqrt() * state.wider.first().unwrap_or(&1.0),
            &density_unit,
        ),
    );
    all.insert(
        "rate_random_walk".into(),
        Parameter::estimated(walk, walk_error, &format!("{unit}/sqrt(s)")),
    );
    all
}

/// The effects of the extended model: the causes, and what stands for the unexplained in it.
fn effects_of<'a>(findings: impl Iterator<Item = &'a Finding>) -> Vec<EffectModel> {
    let mut all = vec![];
    for f in findings {
        let Some(e) = effect(&f.cause) else { continue };
        let known = |p: &Parameters| -> Parameters {
            p.iter()
                .filter(|(k, _)| e.parameters().iter().any(|s| s.name == *k))
                .map(|(k, v)| (k.clone(), v.clone()))
                .collect()
        };
        if f.per_channel.is_empty() {
            let whole = f.components.is_empty().then_some(&f.parameters);
            all.extend(whole.into_iter().chain(&f.components).map(|p| EffectModel {
                cause: f.cause.clone(),
                channels: f.channels.clone(),
                parameters: known(p),
            }));
        }
        // What is the same to the last digit on several channels is one event on all of them.
        let first = all.len();
        for (channel, p) in &f.per_channel {
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
    all
}
