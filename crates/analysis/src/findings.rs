//! Findings out of what was estimated: one for each cause, with its rivals, its experiment and its gain.

use model::effect::{Effect, Found, Hypothesis, Parameters};
use model::effects::effect;
use model::parameter::Parameter;
use model::record::Base;

use crate::diagnosis::Searched;
use crate::grid::Grid;
use crate::result::{Alternative, Finding, Gain};
use crate::search::Form;
use crate::{evidence, gain, scale, threshold};

pub(crate) fn experiment(of: &dyn Effect, alternatives: &[Alternative]) -> Option<String> {
    let first = alternatives.first()?;
    let stated = of
        .rivals()
        .iter()
        .find(|r| r.cause == first.cause)
        .map(|r| r.experiment);
    let back = effect(&first.cause)
        .and_then(|e| e.rivals().iter().find(|r| r.cause == of.id()))
        .map(|r| r.experiment);
    Some(
        stated
            .or(back)
            .unwrap_or("a record ten times longer, each excitation switched on its own")
            .to_owned(),
    )
}

pub(crate) fn alternatives(all: &[(&'static dyn Effect, f64)]) -> Vec<Alternative> {
    all.iter()
        .map(|(e, odds)| Alternative {
            cause: e.id().into(),
            log_odds: *odds,
        })
        .collect()
}

/// Below it a value is told with an exponent.
const SMALL: f64 = 1e-4;

/// Decimal places that show two digits of a standard error.
fn decimals(error: f64) -> usize {
    if error > 0.0 && error.is_finite() {
        (1.0 - error.log10().floor()).clamp(0.0, 9.0) as usize
    } else {
        4
    }
}

pub(crate) fn sentence(title: &str, channel: &str, parameters: &Parameters) -> String {
    let values: Vec<String> = parameters
        .iter()
        .map(|(name, p)| {
            let unit = if p.unit == "1" { "" } else { &p.unit };
            let text = match p.std_error {
                Some(error) if p.value.abs().max(error) < SMALL => {
                    format!("{name} {:.2e} +- {error:.1e} {unit}", p.value)
                }
                Some(error) => {
                    let places = decimals(error);
                    format!("{name} {:.places$} +- {error:.places$} {unit}", p.value)
                }
                None if p.value != 0.0 && p.value.abs() < SMALL => {
                    format!("{name} {:.2e} {unit}", p.value)
                }
                None => format!("{name} {:.4} {unit}", p.value),
            };
            text.trim_end().to_owned()
        })
        .collect();
    format!("{title} on {channel}: {}", values.join(", "))
}

pub(crate) fn term_findings(s: &Searched<'_>, grid: &Grid, seed: u64) -> Vec<Finding> {
    if s.state.terms.is_empty() {
        return vec![];
    }
    let values: Vec<Vec<Vec<f64>>> = s
        .state
        .terms
        .iter()
        .map(|t| {
            t.columns
                .iter()
                .map(|c| s.search.panel.dct.inverse(&s.search.panel.column(*c)))
                .collect()
        })
        .collect();
    let scores = gain::scores(&s.target.y, grid.rate_hz, &s.state, &values);
    let misfit = evidence::allan_misfit(s, grid.rate_hz, seed);
    let n = (grid.n as f64).ln();
    // A base that is no turntable turns a little about the other axes too.
    let motion = s.search.candidates.iter();
    let motion = motion
        .filter(|_| s.search.view.sways())
        .find(|c| matches!(c.hypothesis, Hypothesis::Motion));
    let turning = |name: &str| grid.targets.iter().any(|t| t.moving && t.name == name);
    s.state
        .terms
        .iter()
        .zip(&s.found)
        .zip(scores)
        .map(|((term, found), score)| {
            let parameters = term.effect.describe(found);
            let mut alternatives = alternatives(&term.alternatives);
            if let Some(motion) = motion.filter(|_| term.follows.as_deref().is_some_and(turning)) {
                alternatives.push(Alternative {
                    cause: motion.effect.id().into(),
                    log_odds: 0.0,
                });
            }
            let size = (found.coefficients.len() + found.location.len()) as f64;
            Finding {
                cause: term.effect.id().into(),
                channels: vec![s.target.name.clone()],
                experiment: experiment(term.effect, &alternatives),
                alternatives,
                gain: Some(Gain {
                    held_out_log_score_nats: Some(score.nats),
                    std_error: Some(score.std_error),
                    delta_bic: Some(term.lr - size * n),
                    allan_misfit_before: Some(misfit[0]),
                    allan_misfit_after: Some(misfit[1]),
                    // The filter behind the angles knows the random walk alone: a stationary term leaves it as it is.
                    angle_rms_deg: score
                        .angle
                        .iter()
                        .map(|(k, [before, after])| {
                            let same = matches!(term.form, Form::Covariance(..));
                            let after = if same { before } else { after };
                            ((*k).to_owned(), [*before, *after])
                        })
                        .collect(),
                    ablation_nats: Some(term.lr / 2.0),
                }),
                what: sentence(term.effect.docs().title, &s.target.name, &parameters),
                parameters,
                likelihood_ratio: Some(term.lr),
                confirmed_on_held_out_data: Some(score.nats > 0.0),
                ..Finding::default()
            }
        })
        .collect()
}

pub(crate) fn variance_finding(s: &Searched<'_>) -> Option<Finding> {
    let v = s.variance.as_ref()?;
    let alternatives = alternatives(&v.alternatives);
    let undivided: Vec<f64> = s.e.iter().zip(&v.law).map(|(e, v)| e * v.sqrt()).collect();
    let (nats, std_error) = gain::of_variance(&undivided, &v.law);
    Some(Finding {
        cause: v.effect.id().into(),
        channels: vec![s.target.name.clone()],
        experiment: experiment(v.effect, &alternatives),
        alternatives,
        confirmed_on_held_out_data: Some(nats > 0.0),
        gain: Some(Gain {
            held_out_log_score_nats: Some(nats),
            std_error: Some(std_error),
            delta_bic: Some(v.lr - (v.parameters.len() as f64) * (s.target.y.len() as f64).ln()),
            ablation_nats: Some(v.lr / 2.0),
            ..Gain::default()
        }),
        what: sentence(v.effect.docs().title, &s.target.name, &v.parameters),
        parameters: v.parameters.clone(),
        likelihood_ratio: Some(v.lr),
        ..Finding::default()
    })
}

pub(crate) fn motion_finding(s: &Searched<'_>, grid: &Grid) -> Option<Finding> {
    if !s.target.moving || grid.base == Some(Base::Turntable) {
        return None;
    }
    let of = s
        .search
        .candidates
        .iter()
        .find(|c| matches!(c.hypothesis, Hypothesis::Motion))?
        .effect;
    // The rate in blocks of 0.4 s: short enough for the band of base motion, long enough to average the noise.
    let block = ((0.4 * grid.rate_hz).round() as usize).max(1);
    let y = &s.target.y;
    let mean = y.iter().sum::<f64>() / y.len() as f64;
    let peak = y
        .chunks_exact(block)
        .map(|c| (c.iter().sum::<f64>() / block as f64 - mean).abs())
        .fold(0.0, f64::max);
    let error = (s.target.white / block as f64).sqrt();
    let found = Found {
        unit: s.target.unit.clone(),
        coefficients: vec![(peak, error)],
        ..Found::default()
    };
    let parameters = of.describe(&found);
    Some(Finding {
        cause: of.id().into(),
        channels: vec![s.target.name.clone()],
        what: format!(
            "The base moves about {}: {:.2} deg/s rms between 0.02 and 0.6 Hz. No error of the sensor",
            s.target.name, s.target.motion_rms
        ),
        parameters,
        ..Finding::default()
    })
}

/// Longest that a blow lasts that shifts a bias, s: far readings within it of the step are the blow itself.
const BLOW_S: f64 = 1.0;

/// Far readings that lie all at a step of the same channel are told with the step, not as a cause of their own.
pub(crate) fn blows(mut findings: Vec<Finding>) -> Vec<Finding> {
    let step = |f: &Finding| f.parameters.get("time").map(|p| p.value);
    let steps: Vec<(String, f64)> = findings
        .iter()
        .filter(|f| f.cause == "bias_step")
        .filter_map(|f| Some((f.channels.first()?.clone(), step(f)?)))
        .collect();
    for (channel, at) in steps {
        let of_it = |f: &mut Finding| {
            f.cause == "outliers"
                && f.channels == [channel.as_str()]
                && !f.times_s.is_empty()
                && f.times_s.iter().all(|t| (t - at).abs() < BLOW_S)
        };
        let blow: Vec<Finding> = findings.extract_if(.., of_it).collect();
        let own = findings
            .iter_mut()
            .find(|f| f.cause == "bias_step" && f.channels[0] == channel && step(f) == Some(at));
        if let Some(f) = own.filter(|_| !blow.is_empty()) {
            let count: usize = blow.iter().map(|b| b.times_s.len()).sum();
            f.what = format!(
                "{}; {count} far readings within {BLOW_S} s of it are the blow",
                f.what
            );
        }
    }
    findings
}

/// Increase of the variance from which on far readings in a loud stretch are its noise: six sigma of the quiet are three of
/// its own.
const LOUD: f64 = 3.0;

/// Far readings that lie all in a stretch of louder noise of the same channel are that noise.
pub(crate) fn loud(mut findings: Vec<Finding>) -> Vec<Finding> {
    let stretches: Vec<(String, f64, f64)> = (findings.iter())
        .filter(|f| f.cause == "noise_change")
        .filter_map(|f| {
            let value = |name: &str| f.parameters.get(name).map(|p| p.value);
            value("variance_increase").filter(|v| *v >= LOUD)?;
            Some((f.channels.first()?.clone(), value("start")?, value("end")?))
        })
        .collect();
    findings.retain(|f| {
        let within = |(channel, from, to): &(String, f64, f64)| {
            f.channels == [channel.as_str()] && f.times_s.iter().all(|t| t >= from && t <= to)
        };
        f.cause != "outliers" || f.times_s.is_empty() || !stretches.iter().any(within)
    });
    findings
}

/// One finding for one event on several channels, and for one cause on one channel by several terms.
pub(crate) fn joined(findings: Vec<Finding>) -> Vec<Finding> {
    let mut all: Vec<Finding> = vec![];
    for f in findings {
        let same_channel = all.iter_mut().find(|o| {
            o.cause == f.cause
                && o.channels == f.channels
                && f.parameters.keys().all(|k| !o.parameters.contains_key(k))
        });
        if let Some(other) = same_channel {
            other.parameters.extend(f.parameters);
            other.likelihood_ratio =
                Some(other.likelihood_ratio.unwrap_or(0.0) + f.likelihood_ratio.unwrap_or(0.0));
            other.what = format!("{}; {}", other.what, f.what);
            continue;
        }
        let event = effect(&f.cause).and_then(|e| {
            all.iter_mut().find(|o| {
                o.cause == f.cause
                    && !o.channels.contains(&f.channels[0])
                    && e.same_event(&o.parameters, &f.parameters)
            })
        });
        if let Some(other) = event {
            if other.per_channel.is_empty() {
                other
                    .per_channel
                    .insert(other.channels[0].clone(), other.parameters.clone());
            }
            other
                .per_channel
                .insert(f.channels[0].clone(), f.parameters);
            other.channels.extend(f.channels);
            other.likelihood_ratio =
                Some(other.likelihood_ratio.unwrap_or(0.0) + f.likelihood_ratio.unwrap_or(0.0));
            if let (Some(a), Some(b)) = (&mut other.gain, f.gain) {
                a.held_out_log_score_nats = a
                    .held_out_log_score_nats
                    .zip(b.held_out_log_score_nats)
                    .map(|(x, y)| x + y);
                a.std_error = a.std_error.zip(b.std_error).map(|(x, y)| x.hypot(y));
                a.delta_bic = a.delta_bic.zip(b.delta_bic).map(|(x, y)| x + y);
            }
            other.what = format!("{}; {}", other.what, f.what);
            continue;
        }
        all.push(f);
    }
    all
}

/// Parameters that every finding of a cause has and that the fit left out are 0.
pub(crate) fn complete(mut findings: Vec<Finding>) -> Vec<Finding> {
    for f in &mut findings {
        let Some(of) = effect(&f.cause) else { continue };
        for p in of.parameters().iter().filter(|p| p.required) {
            let absent = || Parameter::exact(0.0, p.unit);
            f.parameters.entry(p.name.to_owned()).or_insert_with(absent);
        }
    }
    findings
}

/// The scale factor, where the base sways and the accelerometers see it; or why not.
pub(crate) fn scale_finding(
    s: &Searched<'_>,
    grid: &Grid,
) -> Result<Option<Finding>, (&'static str, String)> {
    let of = s
        .search
        .candidates
        .iter()
        .find(|c| matches!(c.hypothesis, Hypothesis::Scale))
        .map(|c| c.effect);
    let Some(of) = of else { return Ok(None) };
    let found = scale::against_tilt(grid, s.target).map_err(|why| (of.id(), why))?;
    let lr = (found.relative / found.std_error).powi(2);
    if lr < threshold::regression(1, 1) {
        return Ok(None);
    }
    let estimate = Found {
        unit: s.target.unit.clone(),
        names: vec!["relative"],
        coefficients: vec![(found.relative, found.std_error)],
        ..Found::default()
    };
    let parameters = of.describe(&estimate);
    Ok(Some(Finding {
        cause: of.id().into(),
        channels: vec![s.target.name.clone()],
        what: format!(
            "{}. The scale of the accelerometers is taken as right",
            sentence(of.docs().title, &s.target.name, &parameters)
        ),
        parameters,
        likelihood_ratio: Some(lr),
        gain: Some(Gain {
            delta_bic: Some(lr - (grid.n as f64).ln()),
            ablation_nats: Some(lr / 2.0),
            ..Gain::default()
        }),
        ..Finding::default()
    }))
}
