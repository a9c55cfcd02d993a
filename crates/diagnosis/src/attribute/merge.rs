//! What belongs together is one finding: far readings within a turn, at a step, in a louder stretch; one event on several
//! channels; several terms of one cause.

use std::ops::Range;

use model::effects::effect;

use crate::attribute::events::{BLOW_S, blow_of, step_at};
use crate::ingest::types::Grid;
use crate::result::{Finding, Gain, Parameter};

/// Far readings while the base turns, or is knocked, are its motion.
pub(crate) fn turning(
    mut findings: Vec<Finding>,
    knocked: &[Range<usize>],
    grid: &Grid,
) -> Vec<Finding> {
    let n = grid.n;
    let turns: Vec<_> = (grid.targets.iter())
        .flat_map(|t| t.excursions.iter().map(|e| e.with_margin(n)))
        .chain(knocked.iter().cloned())
        .collect();
    let within = |t: &f64| {
        let i = (t * grid.rate_hz).round() as usize;
        turns.iter().any(|turn| turn.contains(&i))
    };
    findings.retain_mut(|f| {
        let before = f.times_s.len();
        if f.cause != "outliers" || before == 0 {
            return true;
        }
        f.times_s.retain(|t| !within(t));
        let lost = before - f.times_s.len();
        if let Some(count) = f.parameters.get_mut("count") {
            count.value -= lost as f64;
        }
        !f.times_s.is_empty()
    });
    findings
}

/// Far readings that lie all at a step of the same channel are told with the step, not as a cause of their own.
pub(crate) fn blows(mut findings: Vec<Finding>) -> Vec<Finding> {
    let steps: Vec<(String, f64)> = (findings.iter())
        .filter_map(|f| Some((f.channels.first()?.clone(), step_at(f)?)))
        .collect();
    for (channel, at) in steps {
        let of_it = |f: &mut Finding| {
            f.cause == "outliers" && f.channels == [channel.as_str()] && blow_of(f, at)
        };
        let blow: Vec<Finding> = findings.extract_if(.., of_it).collect();
        let own = findings
            .iter_mut()
            .find(|f| f.channels[0] == channel && step_at(f) == Some(at));
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
pub(crate) const LOUD: f64 = 3.0;

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

/// Adds what another part of a finding gains.
fn add_gain(finding: &mut Finding, other: Option<Gain>) {
    if let (Some(a), Some(b)) = (&mut finding.gain, other) {
        a.held_out_log_score_nats = a
            .held_out_log_score_nats
            .zip(b.held_out_log_score_nats)
            .map(|(x, y)| x + y);
        a.std_error = a.std_error.zip(b.std_error).map(|(x, y)| x.hypot(y));
        a.delta_bic = a.delta_bic.zip(b.delta_bic).map(|(x, y)| x + y);
    }
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
            other.effective |= f.effective;
            other.likelihood_ratio =
                Some(other.likelihood_ratio.unwrap_or(0.0) + f.likelihood_ratio.unwrap_or(0.0));
            add_gain(other, f.gain);
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
            other.effective |= f.effective;
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
            add_gain(other, f.gain);
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
            for all in f.per_channel.values_mut().chain([&mut f.parameters]) {
                all.entry(p.name.to_owned()).or_insert_with(absent);
            }
        }
    }
    findings
}
