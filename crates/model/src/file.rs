//! The model file: what the diagnosis writes, the simulation reads and a person edits.
//!
//! ```toml
//! format = "imu-stand-model/1"
//! stand = "the paper's"
//! rate_hz = 20.0
//!
//! [fitted_on]
//! file = "run.csv"
//! seconds = 600.0
//!
//! [excitation]
//! heater_degc = 6.0
//!
//! [[channel]]
//! name = "gyro_z"
//! unit = "deg/s"
//! lsb = 0.07326
//! angle_random_walk = { value = 5.27, std_error = 0.03, unit = "deg/sqrt(h)" }
//!
//! [[effect]]
//! cause = "temperature"
//! channels = ["gyro_z"]
//! slope = { value = 0.08, std_error = 0.01, unit = "deg/s/degC" }
//!
//! [[unnamed]]
//! domain = "spectrum"
//! channels = ["gyro_z"]
//! rms = { value = 0.05, unit = "deg/s" }
//! center = { values = [3.1, 7.0], unit = "Hz" }
//! width = { values = [0.4, 2.0], unit = "Hz" }
//! size = { values = [0.03, 0.04], unit = "deg/s" }
//! ```

mod parser;
mod unnamed;

use std::collections::BTreeMap;
use std::fmt::Write as _;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::effect::{Parameters, unit_on};
use crate::effects::effect;
use crate::excitation::SETTINGS;
use crate::parameter::Parameter;
use crate::range::{self, Range};
use crate::unnamed::Unnamed;
use parser::Parser;

/// Format line of a model file.
pub const FORMAT: &str = "imu-stand-model/1";

/// Baseline parameters of a channel with their units on a gyro in deg/s.
pub const BASELINE: [(&str, &str); 4] = [
    ("bias", "deg/s"),
    ("angle_random_walk", "deg/sqrt(h)"),
    ("rate_random_walk", "deg/s/sqrt(s)"),
    ("quantization_noise", "deg"),
];

/// An effect with its parameters, by the names of docs/effects.md.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EffectModel {
    /// Cause id: `temperature`, `line`, ...
    pub cause: String,
    /// Channels it acts on; empty means all.
    pub channels: Vec<String>,
    /// Its parameters by name.
    pub parameters: Parameters,
}

/// The baseline of one channel: bias + white noise + random walk, quantised.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChannelModel {
    /// Name of the column: `gyro_x`, ...
    pub name: String,
    /// Unit of its readings.
    pub unit: String,
    /// Unit per count, where it is quantised.
    pub lsb: Option<f64>,
    /// `bias`, `angle_random_walk`, `rate_random_walk`.
    pub baseline: Parameters,
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
    /// What acts on the stand in a simulation ([`crate::excitation::SETTINGS`]).
    pub excitation: BTreeMap<String, f64>,
    /// Channels with their baselines.
    pub channels: Vec<ChannelModel>,
    /// Effects.
    pub effects: Vec<EffectModel>,
    /// What has a size and no name.
    pub unnamed: Vec<Unnamed>,
}

/// What is wrong with a model file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct ModelFileError {
    /// Line of the file, from 1.
    pub line: usize,
    /// What was found and what was expected.
    pub what: String,
}

impl ModelFile {
    /// The stand of the paper: three gyros at 20 Hz with its figures, nothing else.
    #[must_use]
    pub fn paper() -> Self {
        let channel = |name: &str| ChannelModel {
            name: name.to_owned(),
            unit: "deg/s".to_owned(),
            lsb: Some(0.07326),
            baseline: [
                ("bias".to_owned(), Parameter::exact(0.0, "deg/s")),
                (
                    "angle_random_walk".to_owned(),
                    Parameter::exact(5.27, "deg/sqrt(h)"),
                ),
                (
                    "rate_random_walk".to_owned(),
                    Parameter::exact(0.0015, "deg/s/sqrt(s)"),
                ),
            ]
            .into(),
        };
        Self {
            stand: "Istomin and Belyaev, 2009".to_owned(),
            rate_hz: 20.0,
            channels: ["gyro_x", "gyro_y", "gyro_z"].map(channel).into(),
            ..Self::default()
        }
    }

    /// Read a model file.
    ///
    /// # Errors
    /// [`ModelFileError`] with the line, for anything that is no TOML, unknown, missing, or in another unit.
    pub fn parse(text: &str) -> Result<Self, ModelFileError> {
        Parser { text }.file()
    }

    /// The file as text.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut out = String::new();
        let _ = writeln!(
            out,
            "format = {}\nstand = {}\nrate_hz = {:?}",
            quoted(FORMAT),
            quoted(&self.stand),
            self.rate_hz
        );
        if let Some(on) = &self.fitted_on {
            let _ = writeln!(out, "\n[fitted_on]\nfile = {}", quoted(&on.file));
            if let Some(hash) = &on.hash {
                let _ = writeln!(out, "hash = {}", quoted(hash));
            }
            let _ = writeln!(out, "seconds = {:?}", on.seconds);
        }
        if !self.excitation.is_empty() {
            out.push_str("\n[excitation]\n");
            for (key, value) in &self.excitation {
                let _ = writeln!(out, "{key} = {value:?}");
            }
        }
        for channel in &self.channels {
            let _ = writeln!(
                out,
                "\n[[channel]]\nname = {}\nunit = {}",
                quoted(&channel.name),
                quoted(&channel.unit)
            );
            if let Some(lsb) = channel.lsb {
                let _ = writeln!(out, "lsb = {lsb:?}");
            }
            parameters(&mut out, &channel.baseline);
        }
        for e in &self.effects {
            let channels: Vec<_> = e.channels.iter().map(|c| quoted(c)).collect();
            let _ = writeln!(
                out,
                "\n[[effect]]\ncause = {}\nchannels = [{}]",
                quoted(&e.cause),
                channels.join(", ")
            );
            parameters(&mut out, &e.parameters);
        }
        self.unnamed.iter().for_each(|term| unnamed(&mut out, term));
        out
    }
}

/// Unit of a baseline parameter on a channel of that unit.
#[must_use]
pub fn baseline_unit(spec: &str, channel_unit: &str) -> String {
    match (channel_unit, spec) {
        ("deg/s", _) => spec.to_owned(),
        (_, "deg/sqrt(h)") => format!("{channel_unit}*sqrt(s)"),
        (_, "deg") => format!("{channel_unit}*s"),
        _ => unit_on(spec, channel_unit),
    }
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// Parameters, one a line.
fn parameters(out: &mut String, all: &Parameters) {
    for (name, p) in all.iter().filter(|(_, p)| p.value.is_finite()) {
        let error = p
            .std_error
            .filter(|e| e.is_finite())
            .map_or(String::new(), |e| format!(", std_error = {e:?}"));
        let _ = writeln!(
            out,
            "{name} = {{ value = {:?}{error}, unit = {} }}",
            p.value,
            quoted(&p.unit)
        );
    }
}

/// An unnamed term with its columns.
fn unnamed(out: &mut String, term: &Unnamed) {
    let channels: Vec<_> = term.channels.iter().map(|c| quoted(c)).collect();
    let _ = writeln!(
        out,
        "\n[[unnamed]]\ndomain = {}\nchannels = [{}]",
        quoted(term.domain.id()),
        channels.join(", ")
    );
    if let Some(follows) = &term.follows {
        let _ = writeln!(out, "follows = {}", quoted(follows));
    }
    if let Some(refines) = &term.refines {
        let _ = writeln!(out, "refines = {}", quoted(refines));
    }
    parameters(out, &[("rms".to_owned(), term.rms.clone())].into());
    let specs = term.domain.columns(term.follows.is_some());
    for (spec, column) in specs.iter().zip(&term.columns) {
        let _ = writeln!(
            out,
            "{} = {{ values = {:?}, unit = {} }}",
            spec.name,
            column.values,
            quoted(&column.unit)
        );
    }
}
