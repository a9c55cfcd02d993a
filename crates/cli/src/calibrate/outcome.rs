//! What a sequence has found: numbers with intervals, and terms of a model file.

use model::file::{ChannelModel, EffectModel};
use model::{ModelFile, Parameter};
use serde::Serialize;

const GYROS: [&str; 3] = ["gyro_x", "gyro_y", "gyro_z"];

/// A number that can be told now and could not before.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Identified {
    /// Of which channel.
    pub channel: String,
    /// What.
    pub what: String,
    /// How big; its standard error is that of a 95 % interval over 1.96.
    pub size: Parameter,
}

/// The answer of a sequence.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Which sequence.
    pub sequence: &'static str,
    /// What is told now.
    pub identified: Vec<Identified>,
    /// What is not, and why.
    pub not_identified: Vec<String>,
    /// What was offered and refused.
    pub refused: Vec<String>,
    /// Terms for a model file.
    #[serde(skip)]
    pub effects: Vec<EffectModel>,
    /// Bias, deg/s, and angle random walk, deg/sqrt(h), of each gyro, where they were measured.
    #[serde(skip)]
    pub baseline: [Option<(Parameter, Parameter)>; 3],
    /// Samples a second.
    #[serde(skip)]
    pub rate_hz: f64,
    /// Unit of a count, deg/s.
    #[serde(skip)]
    pub lsb_dps: f64,
}

/// A model file with what was found in the place of what it said of the same before. Without one, a new one of the gyros alone.
#[must_use]
pub fn merged(before: Option<ModelFile>, outcome: &Outcome) -> ModelFile {
    let mut model = before.unwrap_or_else(|| ModelFile {
        stand: format!("calibrated by the sequence {}", outcome.sequence),
        rate_hz: outcome.rate_hz,
        ..ModelFile::default()
    });
    for effect in &outcome.effects {
        for old in &mut model.effects {
            if old.cause == effect.cause {
                if old.channels.is_empty() {
                    old.channels = GYROS.map(str::to_owned).to_vec();
                }
                old.channels
                    .retain(|channel| !effect.channels.contains(channel));
            }
        }
        // An effect without channels would be one of all.
        model
            .effects
            .retain(|old| old.cause != effect.cause || !old.channels.is_empty());
    }
    model.effects.extend(outcome.effects.iter().cloned());
    for (name, found) in GYROS.into_iter().zip(&outcome.baseline) {
        let Some((bias, noise)) = found else { continue };
        if model.channels.iter().any(|channel| channel.name == name) {
            // A record tells its noise better than some seconds.
            continue;
        }
        model.channels.push(ChannelModel {
            name: name.to_owned(),
            unit: "deg/s".to_owned(),
            lsb: Some(outcome.lsb_dps),
            baseline: [
                ("bias".to_owned(), bias.clone()),
                ("angle_random_walk".to_owned(), noise.clone()),
            ]
            .into_iter()
            .collect(),
        });
    }
    model
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_found_takes_the_place_of_what_was_said_of_the_same_gyro() {
        let effect = |channels: &[&str], value: f64| EffectModel {
            cause: "g_sensitivity".to_owned(),
            channels: channels.iter().map(|c| (*c).to_owned()).collect(),
            parameters: [("acc_x".to_owned(), Parameter::exact(value, "deg/s/g"))].into(),
        };
        let before = ModelFile {
            effects: vec![effect(&[], 1.0)],
            ..ModelFile::paper()
        };
        let outcome = Outcome {
            sequence: "six-position",
            identified: vec![],
            not_identified: vec![],
            refused: vec![],
            effects: vec![effect(&["gyro_y"], 2.0)],
            baseline: [None, None, None],
            rate_hz: 20.0,
            lsb_dps: 0.073_26,
        };
        let after = merged(Some(before), &outcome);
        let of = |k: usize| {
            (
                after.effects[k].channels.clone(),
                after.effects[k].parameters["acc_x"].value,
            )
        };
        assert_eq!(of(0), (vec!["gyro_x".to_owned(), "gyro_z".to_owned()], 1.0));
        assert_eq!(of(1), (vec!["gyro_y".to_owned()], 2.0));
        ModelFile::parse(&after.to_toml()).expect("it is a model file");
    }
}
