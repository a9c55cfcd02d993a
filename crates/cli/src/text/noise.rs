//! The noise of a model in words: bias, N, B and K of a channel, in the units in which `analyze` has them.

use std::collections::BTreeMap;

use diagnosis::result::Diagnosed;
use model::effects::flicker;
use model::file::ModelFile;
use model::parameter::Parameter;

use super::answer;
use crate::report::plot::number;

/// Part of the smallest random walk to be seen below which a limit is none: where the likelihood has its peak at no random walk
/// at all, its curvature there says nothing.
const NOTHING: f64 = 0.01;

/// The parameter of flicker.
const B: &str = "bias_instability";

/// How much of a term the record shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// Nothing, not even how large it is at most.
    Nothing,
    /// An upper limit.
    Limit,
    /// A size.
    Size,
}

/// A term of the noise of a channel.
pub struct Term {
    /// The value.
    pub value: Parameter,
    /// What of it the record shows.
    pub shown: Shown,
    /// Value and 95 % interval, or an upper limit, for people.
    pub said: String,
}

/// A term of the noise, by its key (`angle_random_walk`, ...), in a record of `seconds`.
#[must_use]
pub fn term(model: &ModelFile, channel: &str, key: &str, seconds: f64) -> Option<Term> {
    let own = model.channels.iter().find(|c| c.name == channel)?;
    let value = usual(own.baseline.get(key)?);
    let unseen = || unseen_walk(&own.baseline, seconds).is_some();
    let shown = match key {
        "bias" => Shown::Size,
        "rate_random_walk" if unseen() => Shown::Nothing,
        _ if answer::upper_limit(&value).is_some() => Shown::Limit,
        _ => Shown::Size,
    };
    let said = match (key, shown) {
        ("bias", _) => answer::with_interval(&value),
        (_, Shown::Nothing) => "too small to be told from 0".to_owned(),
        _ => answer::level(&value),
    };
    Some(Term { value, shown, said })
}

/// Of a random walk K that a record of `seconds` does not tell from none: the smallest that it would show, in the unit of K.
/// `None` where K is told, by its size or by a limit.
#[must_use]
pub fn unseen_walk(noise: &BTreeMap<String, Parameter>, seconds: f64) -> Option<f64> {
    let k = noise.get("rate_random_walk")?;
    let smallest = smallest_walk(noise.get("angle_random_walk"), seconds);
    let limit = k.value + answer::HALF_WIDTH_95 * k.std_error.unwrap_or(0.0);
    let has_interval = k.std_error.is_some_and(|e| e > 0.0 && e.is_finite());
    // Without an interval what is smaller than can be seen is no estimate.
    let is_unseen = limit <= NOTHING * smallest || !has_interval && limit < smallest;
    is_unseen.then_some(smallest)
}

/// The bias instability B beside the causes: its size where flicker is one of them, else the limit that follows where it is
/// not: of a larger one, 95 records in 100 would have shown it. `None` where nothing looked for it. The lowest point of the
/// Allan curve over 0.664 is no B: white noise alone has one.
#[must_use]
pub fn instability(of: &Diagnosed, channel: &str) -> Option<String> {
    let d = &of.diagnosis;
    let is_on = |channels: &[String]| channels.iter().any(|c| c == channel);
    let found = d.findings.iter();
    let found = found.filter(|f| f.cause == flicker::ID && is_on(&f.channels));
    let mut found = found.map(|f| f.per_channel.get(channel).unwrap_or(&f.parameters));
    let modelled = of.extended_model.effects.iter();
    let modelled = modelled.filter(|e| e.cause == flicker::ID);
    let mut modelled = modelled.filter(|e| e.channels.is_empty() || is_on(&e.channels));
    let of_term = found.next().or_else(|| Some(&modelled.next()?.parameters));
    if let Some(b) = of_term.and_then(|p| p.get(B)) {
        return Some(answer::level(b));
    }
    let mut limits = d.detection_limits.iter();
    let limit = limits.find(|l| l.cause == flicker::ID && l.channel == channel)?;
    let size = number(limit.value, 2);
    Some(format!(
        "< {size} {} (none found; 95 % of larger ones would show)",
        limit.unit
    ))
}

/// The random walk that after `seconds` has gone as far as white noise moves a mean over them: K sqrt(T / 3) = N / sqrt(T).
fn smallest_walk(white: Option<&Parameter>, seconds: f64) -> f64 {
    let Some(n) = white else { return 0.0 };
    // N in the channel's unit times sqrt(s).
    let n = match n.unit.as_str() {
        "deg/sqrt(h)" => n.value / 60.0,
        _ => n.value,
    };
    3f64.sqrt() * n / seconds
}

/// A random walk of a velocity in m/s/sqrt(h), as of an angle in deg/sqrt(h); all else as it is.
fn usual(p: &Parameter) -> Parameter {
    let mut p = p.clone();
    if p.unit == "m/s^2*sqrt(s)" {
        p.unit = "m/s/sqrt(h)".to_owned();
        p.value *= 60.0;
        p.std_error = p.std_error.map(|e| 60.0 * e);
    }
    p
}

#[cfg(test)]
mod tests {
    use model::file::ChannelModel;

    use super::*;

    fn model(k: f64, error: f64) -> ModelFile {
        let terms = [
            ("angle_random_walk", 0.003, 3e-5, "m/s^2*sqrt(s)"),
            ("rate_random_walk", k, error, "m/s^2/sqrt(s)"),
        ];
        let baseline = terms.map(|(key, value, error, unit)| {
            (key.to_owned(), Parameter::estimated(value, error, unit))
        });
        let channel = ChannelModel {
            name: "acc_x".to_owned(),
            unit: "m/s^2".to_owned(),
            baseline: baseline.into(),
            ..ModelFile::paper().channels[0].clone()
        };
        ModelFile {
            channels: vec![channel],
            ..ModelFile::paper()
        }
    }

    #[test]
    fn the_bias_instability_is_that_of_the_flicker_found_else_what_would_have_been() {
        let diagnosis = |findings: serde_json::Value| {
            serde_json::json!({
                "format": "", "input": {"file": "", "seconds": 1.0, "rate_hz": 1.0, "samples": 1, "channels": []},
                "baseline": {}, "checks": [], "unexplained": [], "not_tested": [], "verdict": "adequate",
                "findings": findings,
                "detection_limits": [
                    {"cause": "flicker", "channel": "gyro_y", "parameter": "bias_instability", "value": 169.1, "unit": "deg/h"}
                ]
            })
        };
        let diagnosed = |findings| Diagnosed {
            diagnosis: serde_json::from_value(diagnosis(findings)).expect("a diagnosis"),
            baseline_model: ModelFile::default(),
            extended_model: ModelFile::default(),
            evidence: vec![],
        };
        let of = diagnosed(serde_json::json!([{
            "cause": "flicker", "channels": ["gyro_x"], "alternatives": [], "experiment": null, "gain": null,
            "parameters": {"bias_instability": {"value": 226.0, "std_error": 10.0, "unit": "deg/h"}}
        }]));
        let said =
            |of: &Diagnosed, channel| instability(of, channel).map(|b| b.replace('\u{a0}', " "));
        assert_eq!(
            said(&of, "gyro_x").as_deref(),
            Some("226 deg/h (95 %: 206 to 246)")
        );
        assert_eq!(
            said(&of, "gyro_y").as_deref(),
            Some("< 169 deg/h (none found; 95 % of larger ones would show)")
        );
        assert_eq!(said(&of, "gyro_z"), None);
        // A term of the model that is no finding.
        let mut of = diagnosed(serde_json::json!([]));
        of.extended_model.effects = vec![model::file::EffectModel {
            cause: "flicker".into(),
            channels: vec!["gyro_z".into()],
            parameters: [(
                "bias_instability".to_owned(),
                Parameter::estimated(3.0, 2.0, "deg/h"),
            )]
            .into(),
        }];
        assert_eq!(said(&of, "gyro_z").as_deref(), Some("< 6.9 deg/h"));
        assert_eq!(said(&of, "gyro_x"), None);
    }

    #[test]
    fn a_velocity_walks_by_the_root_of_an_hour_and_a_limit_of_nothing_is_none() {
        let told =
            |k, error, key: &str| term(&model(k, error), "acc_x", key, 600.0).expect("a term");
        let said = |k, error, key: &str| told(k, error, key).said.replace('\u{a0}', " ");
        let n = said(1e-4, 1e-5, "angle_random_walk");
        assert_eq!(n, "0.1800 m/s/sqrt(h) (95 %: 0.1765 to 0.1835)");
        // 0.003 sqrt(3) / 600 is 8.7e-6.
        let walk = |k, error| said(k, error, "rate_random_walk");
        let none = "too small to be told from 0";
        assert_eq!(walk(3e-33, 3e-31), none);
        // Nor is it one of which nothing tells the error.
        assert_eq!(walk(1e-6, f64::NAN), none);
        assert_eq!(walk(1e-6, 1e-5), "< 2.1e-5 m/s^2/sqrt(s)");
        let shown = |k, error| told(k, error, "rate_random_walk").shown;
        assert_eq!(shown(3e-33, 3e-31), Shown::Nothing);
        assert_eq!(shown(1e-6, 1e-5), Shown::Limit);
        assert_eq!(shown(1e-4, 1e-5), Shown::Size);
    }
}
