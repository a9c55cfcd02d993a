//! The model file: what the diagnosis writes, the simulation reads and a person edits.

use std::collections::BTreeMap;

use crate::parameter::Parameter;

/// Format line of a model file.
pub const FORMAT: &str = "imu-stand-model/1";

/// An effect with its parameters, by the names of docs/effects.md.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectModel {
    /// Cause id: `temperature`, `line`, ...
    pub cause: String,
    /// Channels it acts on.
    pub channels: Vec<String>,
    /// Its parameters by name.
    pub parameters: BTreeMap<String, Parameter>,
}

/// The baseline of one channel: bias + white noise + random walk, quantised.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelModel {
    /// Name of the column: `gyro_x`, ...
    pub name: String,
    /// Unit of its readings.
    pub unit: String,
    /// Unit per count, where it is quantised.
    pub lsb: Option<f64>,
    /// `bias`, `angle_random_walk`, `rate_random_walk`.
    pub baseline: BTreeMap<String, Parameter>,
}

/// The record a model was fitted on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FittedOn {
    /// File name as the user gave it.
    pub file: String,
    /// Digest of the file, where it is known.
    pub hash: Option<String>,
    /// Length, s.
    pub seconds: f64,
}

/// A model of a stand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelFile {
    /// Name of the stand.
    pub stand: String,
    /// Sample rate it was fitted at, Hz.
    pub rate_hz: f64,
    /// The record it was fitted on.
    pub fitted_on: Option<FittedOn>,
    /// What acts on the stand in a simulation.
    pub excitation: BTreeMap<String, f64>,
    /// Channels with their baselines.
    pub channels: Vec<ChannelModel>,
    /// Effects.
    pub effects: Vec<EffectModel>,
}
