//! What belongs together is one finding: far readings within a turn, at a step, in a louder stretch; one event on several
//! channels; several terms of one cause.

use std::collections::BTreeMap;
use std::ops::Range;

use model::effect::Parameters;
use model::effects::{effect, wandering_line};

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
            let those = match count {
                1 => format!("1 far reading within {BLOW_S} s of it is the blow"),
                n => format!("{n} far readings within {BLOW_S} s of it are the blow"),
            };
            f.what = format!("{}; {those}", f.what);
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

/// One finding for what happened several times, each of which would say the same.
pub(crate) fn repeated(findings: Vec<Finding>) -> Vec<Finding> {
    let recurs = |f: &Finding| effect(&f.cause).is_some_and(|e| e.recurs(&f.parameters));
    let mut all: Vec<Finding> = vec![];
    for f in findings {
        let mut same = all.iter_mut().filter(|o| o.cause == f.cause && recurs(o));
        match same.next().filter(|_| recurs(&f)) {
            Some(other) => other.occurrences.extend(once(f)),
            None => all.push(f),
        }
    }
    all.into_iter().map(of_occurrences).collect()
}

/// One finding for the tones of a rotor: their pitches stay for one time.
pub(crate) fn rotors(findings: Vec<Finding>) -> Vec<Finding> {
    let stays = |f: &Finding| {
        f.parameters
            .get(wandering_line::PITCH_TIME)
            .map(|p| p.value)
    };
    let size = |f: &Finding| f.parameters.get("amplitude").map_or(0.0, |p| p.value);
    let mut all: Vec<Finding> = vec![];
    for mut f in findings {
        let same = |o: &&mut Finding| o.cause == f.cause && stays(o) == stays(&f);
        match stays(&f).and_then(|_| all.iter_mut().find(same)) {
            Some(other) => {
                if size(&f) > size(other) {
                    std::mem::swap(other, &mut f);
                }
                add_tone(other, f);
            }
            None => all.push(f),
        }
    }
    all
}

/// Adds another tone of a rotor to the strongest one.
fn add_tone(finding: &mut Finding, mut tone: Finding) {
    let channels = std::mem::take(&mut tone.channels);
    if finding.per_channel.is_empty() {
        let own = finding.channels.iter();
        finding.per_channel = own
            .map(|c| (c.clone(), finding.parameters.clone()))
            .collect();
    }
    for channel in &channels {
        if !finding.channels.contains(channel) {
            finding.channels.push(channel.clone());
        }
    }
    finding.effective |= tone.effective;
    let ratio = |f: &Finding| f.likelihood_ratio.unwrap_or(0.0);
    finding.likelihood_ratio = Some(ratio(finding) + ratio(&tone));
    add_gain(finding, tone.gain.take());
    finding.what = format!("{}; {}", finding.what, tone.what);
    finding.harmonics.append(&mut tone.harmonics);
    if tone.per_channel.is_empty() {
        let each = channels.into_iter().map(|c| (c, tone.parameters.clone()));
        tone.per_channel = each.collect();
    }
    finding.harmonics.push(tone.per_channel);
}

/// Parameters of one finding by channel.
fn once(f: Finding) -> Option<BTreeMap<String, Parameters>> {
    if f.per_channel.is_empty() {
        let channel = f.channels.into_iter().next()?;
        return Some(BTreeMap::from([(channel, f.parameters)]));
    }
    Some(f.per_channel)
}

/// A finding to which later ones of its kind were added, told as one.
fn of_occurrences(f: Finding) -> Finding {
    if f.occurrences.is_empty() {
        return f;
    }
    let mut told = Finding {
        cause: f.cause.clone(),
        ..Finding::default()
    };
    let later = f.occurrences.clone();
    told.occurrences = once(f).into_iter().chain(later).collect();
    let value = |p: &Parameters, name: &str| p.get(name).map_or(0.0, |p| p.value);
    let start = |by: &BTreeMap<String, Parameters>| {
        let starts = by.values().map(|p| value(p, "start"));
        starts.fold(f64::INFINITY, f64::min)
    };
    (told.occurrences).sort_by(|a, b| start(a).total_cmp(&start(b)));
    told.times_s = told.occurrences.iter().map(start).collect();
    let size = |p: &Parameters| value(p, "peak");
    let mut largest: BTreeMap<String, Parameters> = BTreeMap::new();
    for (channel, p) in told.occurrences.iter().flatten() {
        let known = largest.get(channel).map_or(0.0, size);
        if size(p) > known {
            largest.insert(channel.clone(), p.clone());
        }
    }
    let count = told.occurrences.len();
    for p in largest.values_mut() {
        p.retain(|name, _| name != "start" && name != "end");
        let of = Parameter::exact(count as f64, "1");
        p.insert("count".into(), of);
    }
    told.channels = largest.keys().cloned().collect();
    told.parameters = (largest.values())
        .max_by(|a, b| size(a).total_cmp(&size(b)))
        .cloned()
        .unwrap_or_default();
    let last = told.times_s.last().copied().unwrap_or_default();
    told.what = format!(
        "The base turns {count} times about {}, first at {:.1} s and last at {last:.1} s, by up to {:.2} deg/s, and is back at rest each time. No error of the sensor",
        told.channels.join(", "),
        told.times_s.first().copied().unwrap_or_default(),
        size(&told.parameters),
    );
    if largest.len() > 1 {
        told.per_channel = largest;
    }
    told
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

#[cfg(test)]
mod tests {
    use model::effects::base_motion;
    use model::file::EffectModel;

    use super::*;
    use crate::report::handover::effects_of;

    fn turn(channels: &[(&str, f64)], from: f64) -> Finding {
        let by = |peak: f64| {
            let exact = |value: f64, unit: &str| Parameter::exact(value, unit);
            Parameters::from([
                ("peak".into(), exact(peak, "deg/s")),
                ("start".into(), exact(from, "s")),
                ("end".into(), exact(from + 5.0, "s")),
            ])
        };
        let each = channels
            .iter()
            .map(|(name, peak)| ((*name).into(), by(*peak)));
        let per_channel: BTreeMap<String, Parameters> = each.collect();
        Finding {
            cause: base_motion::ID.into(),
            channels: per_channel.keys().cloned().collect(),
            parameters: per_channel.values().next().unwrap().clone(),
            per_channel: if channels.len() > 1 {
                per_channel
            } else {
                BTreeMap::new()
            },
            ..Finding::default()
        }
    }

    /// The effects that findings are in the model, in some order.
    fn in_model(all: &[Finding]) -> Vec<EffectModel> {
        let all: Vec<&Finding> = all.iter().collect();
        let mut effects = effects_of(&all);
        effects.sort_by_key(|e| format!("{e:?}"));
        effects
    }

    #[test]
    fn turns_at_several_times_are_one_entry_and_stay_several_in_the_model() {
        let sway = Finding {
            cause: base_motion::ID.into(),
            channels: vec!["gyro_z".into()],
            parameters: Parameters::from([("peak".into(), Parameter::exact(1.0, "deg/s"))]),
            ..Finding::default()
        };
        let both = [("gyro_x", 2.0), ("gyro_y", 4.0)];
        let turns = vec![
            turn(&[("gyro_x", 3.0)], 200.0),
            sway.clone(),
            turn(&both, 50.0),
            turn(&[("gyro_x", 1.5)], 400.0),
        ];
        let told = repeated(turns.clone());
        assert_eq!(told.len(), 2, "{told:#?}");
        assert_eq!(told[1], sway);
        let one = &told[0];
        assert_eq!(one.channels, ["gyro_x", "gyro_y"]);
        assert_eq!(one.times_s, [50.0, 200.0, 400.0]);
        assert_eq!(one.parameters["peak"].value, 4.0);
        assert_eq!(one.per_channel["gyro_x"]["peak"].value, 3.0);
        assert_eq!(one.parameters["count"].value, 3.0);
        // Each turn acts on each axis that felt it, as it does where each is told apart.
        assert_eq!(in_model(&told), in_model(&turns));
        let single = vec![turn(&both, 50.0)];
        assert_eq!(repeated(single.clone()), single);
    }

    #[test]
    fn tones_of_one_rotor_are_one_finding_and_stay_several_in_the_model() {
        let tone = |channels: &[&str], pitch: f64, amplitude: f64, time: f64| {
            let exact = |v: f64, unit: &str| Parameter::exact(v, unit);
            let parameters = Parameters::from([
                ("amplitude".into(), exact(amplitude, "deg/s")),
                ("center_frequency".into(), exact(pitch, "Hz")),
                (wandering_line::PITCH_TIME.into(), exact(time, "s")),
            ]);
            let each = channels.iter().map(|c| ((*c).into(), parameters.clone()));
            let several = channels.len() > 1;
            Finding {
                cause: wandering_line::ID.into(),
                channels: channels.iter().map(|c| (*c).into()).collect(),
                per_channel: each.filter(|_| several).collect(),
                parameters,
                ..Finding::default()
            }
        };
        let all = vec![
            tone(&["gyro_x"], 5.0, 0.1, 7.0),
            tone(&["gyro_x", "gyro_y"], 10.0, 0.3, 7.0),
            tone(&["gyro_z"], 5.0, 0.2, 8.0),
        ];
        let told = rotors(all.clone());
        assert_eq!(told.len(), 2, "{told:#?}");
        let rotor = &told[0];
        assert_eq!(rotor.parameters["center_frequency"].value, 10.0);
        assert_eq!(rotor.channels, ["gyro_x", "gyro_y"]);
        assert_eq!(rotor.harmonics.len(), 1);
        assert_eq!(rotor.harmonics[0]["gyro_x"]["center_frequency"].value, 5.0);
        assert_eq!(in_model(&told), in_model(&all));
    }
}
