//! What a sequence has found: numbers with intervals, and terms of a model file.

use model::file::{ChannelModel, EffectModel};
use model::{ModelFile, Parameter};
use serde::Serialize;

use crate::plan::Sequence;

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
    /// Temperatures between which it was measured, degC.
    #[serde(skip)]
    pub temperatures: Option<[f64; 2]>,
    /// Samples a second.
    #[serde(skip)]
    pub rate_hz: f64,
    /// Unit of a count, deg/s.
    #[serde(skip)]
    pub lsb_dps: f64,
}

impl Outcome {
    /// Of a sequence that has found nothing yet, on a board whose gyros have steps of `lsb_dps`.
    pub(super) fn of(sequence: &Sequence, rate_hz: f64, lsb_dps: f64) -> Self {
        Self {
            sequence: sequence.name,
            identified: Vec::new(),
            not_identified: sequence.cannot.iter().map(|c| (*c).to_owned()).collect(),
            refused: Vec::new(),
            effects: Vec::new(),
            baseline: [None, None, None],
            temperatures: None,
            rate_hz,
            lsb_dps,
        }
    }
}

/// Whether one takes the place of the other: a slope and a parabola over temperature are one thing.
fn is_alike(a: &str, b: &str) -> bool {
    let both = |start: &str| a.starts_with(start) && b.starts_with(start);
    a == b || both("temperature")
}

/// The temperatures that a model is for, its excitation: at least those of the sequence. The middle stays where it was, as the bias
/// of the model is that of the middle.
fn widened(model: &mut ModelFile, [low, high]: [f64; 2], is_new: bool) {
    const SWINGS: [&str; 3] = ["self_heating_degc", "drift_degc", "heater_degc"];
    let setting = |key: &str| model.excitation.get(key).copied();
    let swings = SWINGS.map(|key| setting(key).unwrap_or(0.0));
    let (mut middle, mut reach) = ((low + high) / 2.0, (high - low) / 2.0);
    if let (Some(ambient), false) = (setting("ambient_degc"), is_new) {
        middle = ambient + swings.iter().sum::<f64>() / 2.0;
        let before = swings.iter().map(|swing| swing.abs()).sum::<f64>() / 2.0;
        let now = (high - middle).max(middle - low);
        if now <= before {
            return;
        }
        reach = now;
    }
    for key in SWINGS {
        model.excitation.remove(key);
    }
    let mut set = |key: &str, value| model.excitation.insert(key.to_owned(), value);
    set("ambient_degc", middle - reach);
    set("heater_degc", 2.0 * reach);
}

/// A model file with what was found in the place of what it said of the same before. Without one, a new one of the gyros alone.
#[must_use]
pub fn merged(before: Option<ModelFile>, outcome: &Outcome) -> ModelFile {
    let is_new = before.is_none();
    let mut model = before.unwrap_or_else(|| ModelFile {
        stand: format!("calibrated by the sequence {}", outcome.sequence),
        rate_hz: outcome.rate_hz,
        ..ModelFile::default()
    });
    // A model of a record is for the temperatures of that record, but for what a heater has measured.
    let is_of_heat = outcome
        .effects
        .iter()
        .any(|e| e.cause.starts_with("temperature"));
    if let Some(range) = outcome.temperatures.filter(|_| is_new || is_of_heat) {
        widened(&mut model, range, is_new);
    }
    for effect in &outcome.effects {
        for old in &mut model.effects {
            if is_alike(&old.cause, &effect.cause) {
                if old.channels.is_empty() {
                    old.channels = GYROS.map(str::to_owned).to_vec();
                }
                old.channels
                    .retain(|channel| !effect.channels.contains(channel));
            }
        }
        // An effect without channels would be one of all.
        let is_other =
            |old: &EffectModel| !is_alike(&old.cause, &effect.cause) || !old.channels.is_empty();
        model.effects.retain(is_other);
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
            temperatures: None,
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

    #[test]
    fn a_heater_widens_the_range_of_a_model_about_its_middle() {
        let range = |model: &ModelFile| {
            let of = |key: &str| model.excitation.get(key).copied().unwrap_or(0.0);
            [
                of("ambient_degc"),
                of("ambient_degc") + of("heater_degc") + of("drift_degc"),
            ]
        };
        let mut model = ModelFile::paper();
        model.excitation = [
            ("ambient_degc".to_owned(), 24.0),
            ("drift_degc".to_owned(), 4.0),
        ]
        .into();
        widened(&mut model, [25.0, 27.0], false);
        assert_eq!(range(&model), [24.0, 28.0], "it is wide enough");
        widened(&mut model, [25.0, 36.0], false);
        assert_eq!(range(&model), [16.0, 36.0], "26 degC stays the middle");
        widened(&mut model, [25.0, 35.0], true);
        assert_eq!(range(&model), [25.0, 35.0]);
    }
}
