//! The diagnosis as it leaves the program: `imu-stand-diagnosis/1`.

mod replicated;
mod unexplained;

use model::effect::{Effect, Parameters};
use std::collections::BTreeMap;

use model::file::ModelFile;
use serde::{Deserialize, Serialize};

pub use model::Parameter;

pub use replicated::{Among, LEVEL, Replicated, Worst};
pub use unexplained::{Consequence, Unexplained};

/// The `format` of a diagnosis.
pub const DIAGNOSIS_FORMAT: &str = "imu-stand-diagnosis/1";

/// What was diagnosed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// File name as the user gave it.
    pub file: String,
    /// Length of the record, s.
    pub seconds: f64,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Rows.
    pub samples: usize,
    /// Channels present.
    pub channels: Vec<String>,
    /// What was wrong with the rows, and what was done about it.
    #[serde(default)]
    pub notes: Vec<String>,
}

/// One omnibus check of a channel, against the model before and after it was extended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// `ljung_box`, `band_energy`, `time_frequency`, ...
    pub id: String,
    /// The channel, or `record` where it concerns all.
    pub channel: String,
    /// The statistic before the extension, in the unit `what` says.
    pub statistic: f64,
    /// Chance of a statistic as large under the baseline model; `None` where the check is a plain limit.
    pub p_value: Option<f64>,
    /// The statistic, or for a `p_value` the chance, beyond which the check fails.
    pub threshold: f64,
    /// Names of the recorded channels that it is about beside its own: for rules, and in no file.
    #[serde(skip)]
    pub about: Vec<String>,
    /// Whether the baseline model fails it.
    pub fails_before: bool,
    /// Whether the extended model still fails it.
    pub fails_after: bool,
    /// What it looks at, and what it saw.
    pub what: String,
}

/// Another cause that would explain the same data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Alternative {
    /// Cause id.
    pub cause: String,
    /// Log odds of this cause against the listed one, nats (negative: less likely).
    pub log_odds: f64,
}

/// What a finding gains.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Gain {
    /// Prequential log score on data not used for the fit, extended minus baseline, nats.
    pub held_out_log_score_nats: Option<f64>,
    /// Its standard error, nats: that of the model with the finding.
    pub std_error: Option<f64>,
    /// BIC of the baseline minus BIC with this finding (positive: better).
    pub delta_bic: Option<f64>,
    /// sup |z| of ln ADEV against replicates of the model without it.
    pub allan_misfit_before: Option<f64>,
    /// The same with it.
    pub allan_misfit_after: Option<f64>,
    /// rms error of the integrated angle, deg, [before, after], by horizon (`10s`, `100s`).
    pub angle_rms_deg: BTreeMap<String, [f64; 2]>,
    /// rms error of the velocity that an accelerometer is integrated to, m/s, [before, after], by horizon.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub velocity_rms_mps: BTreeMap<String, [f64; 2]>,
    /// Log likelihood lost when this finding alone is removed from the final model, nats.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ablation_nats: Option<f64>,
}

/// A cause found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// Cause id: `temperature`, `line`, ... (docs/effects.md).
    pub cause: String,
    /// Channels it acts on.
    pub channels: Vec<String>,
    /// Its parameters by name, as the contract names them. With several channels those of the first one.
    pub parameters: BTreeMap<String, Parameter>,
    /// Causes that this record cannot tell apart from it.
    pub alternatives: Vec<Alternative>,
    /// What to record in order to decide between them.
    pub experiment: Option<String>,
    /// What it gains.
    pub gain: Option<Gain>,
    /// Why the log score of its gain has no number, where it has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub no_gain: Option<String>,
    /// One sentence for a person.
    #[serde(default)]
    pub what: String,
    /// Parameters of each channel, where there are several.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub per_channel: BTreeMap<String, BTreeMap<String, Parameter>>,
    /// Parameters of the parts that it is the sum of, where one of its kind does not make its shape: a band that is no
    /// Lorentzian.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub components: Vec<BTreeMap<String, Parameter>>,
    /// Parameters of each time that it happened, by channel, where it did several times: turns of the base. The parameters of
    /// the finding are those of the largest, and their `count`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub occurrences: Vec<BTreeMap<String, BTreeMap<String, Parameter>>>,
    /// Parameters of the other tones of a rotor, by channel; those of the finding are the strongest one's.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub harmonics: Vec<BTreeMap<String, BTreeMap<String, Parameter>>>,
    /// Times of the events, s from the start, for causes that happen at instants.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub times_s: Vec<f64>,
    /// Likelihood ratio statistic (2 x log) of the whole record.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub likelihood_ratio: Option<f64>,
    /// Whether the parameters hold for the excitation of this record alone: what the sensor feels went through its own filter,
    /// which the channel that it follows did not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub effective: bool,
    /// What it does to the readings and to the integrated angle; `None` where it acts on frames or clocks, or where no
    /// replicates were asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub consequence: Option<Consequence>,
    /// Whether it changes an angle or a deviation by more than the threshold, or its consequence is not known.
    #[serde(default = "unexplained::material")]
    pub material: bool,
    /// Place among findings and unexplained entries by consequence, the largest first: 1, 2, ...
    #[serde(default)]
    pub rank: usize,
    /// Whether data not used for the fit confirm it; `None` where that was not asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confirmed_on_held_out_data: Option<bool>,
}

/// A cause that this record cannot show.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NotTested {
    /// Cause id.
    pub cause: String,
    /// Why: which channel or excitation is missing, and what to record.
    pub why: String,
}

/// The smallest size that this record would have shown, for a cause that was looked for and not found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DetectionLimit {
    /// Cause id.
    pub cause: String,
    /// The channel.
    pub channel: String,
    /// Name of the parameter.
    pub parameter: String,
    /// Smallest size that would have been found 95 % of the time.
    pub value: f64,
    /// Unit of `value`.
    pub unit: String,
    /// The other parameters, where the cause has some: the limit holds there.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub at: BTreeMap<String, Parameter>,
}

/// The verdict on the baseline model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The baseline model describes the record.
    #[default]
    Adequate,
    /// Causes were found, and the model extended by them describes the record.
    Extended,
    /// Something is left that no effect of the library explains.
    Unexplained,
}

/// A diagnosis, exactly as `--json` writes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// [`DIAGNOSIS_FORMAT`].
    pub format: String,
    /// What was diagnosed.
    pub input: Input,
    /// By channel: `angle_random_walk`, `rate_random_walk`, `bias` and others.
    pub baseline: BTreeMap<String, BTreeMap<String, Parameter>>,
    /// The same of the extended model: the noise that is left after the causes.
    #[serde(default)]
    pub extended: BTreeMap<String, BTreeMap<String, Parameter>>,
    /// Omnibus checks.
    pub checks: Vec<Check>,
    /// Causes found.
    pub findings: Vec<Finding>,
    /// What no cause explains.
    pub unexplained: Vec<Unexplained>,
    /// What this record cannot show.
    pub not_tested: Vec<NotTested>,
    /// What would have been found.
    #[serde(default)]
    pub detection_limits: Vec<DetectionLimit>,
    /// The record among simulations of the model before and after, by channel; empty where that was not asked.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub replicates: BTreeMap<String, Replicated>,
    /// The verdict.
    pub verdict: Verdict,
}

/// How a series of a figure is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SeriesStyle {
    /// Dots.
    Points,
    /// A line through the points.
    Line,
}

/// One series of a figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Legend entry.
    pub label: String,
    /// How it is drawn.
    pub style: SeriesStyle,
    /// Abscissae.
    pub x: Vec<f64>,
    /// Ordinates, as many.
    pub y: Vec<f64>,
}

/// The figure that convicts a cause.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Cause id it belongs to, or [`Self::WITHOUT_A_NAME`].
    pub cause: String,
    /// Title.
    pub title: String,
    /// The channel shown.
    pub channel: String,
    /// Label with unit.
    pub x_label: String,
    /// Label with unit.
    pub y_label: String,
    /// Whether the abscissa is logarithmic.
    pub log_x: bool,
    /// Whether the ordinate is logarithmic.
    pub log_y: bool,
    /// What is drawn.
    pub series: Vec<Series>,
    /// What to see in it.
    pub caption: String,
}

impl Evidence {
    /// In the place of a cause, of what follows recorded channels as no effect of the library does.
    pub const WITHOUT_A_NAME: &str = "unexplained";
}

/// All that a diagnosis yields.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnosed {
    /// The answer.
    pub diagnosis: Diagnosis,
    /// The model that the record was held against.
    pub baseline_model: ModelFile,
    /// The model extended by the causes found.
    pub extended_model: ModelFile,
    /// Figures.
    pub evidence: Vec<Evidence>,
}

/// Below it a value is told with an exponent.
pub(crate) const SMALL: f64 = 1e-4;

/// Decimal places that show two digits of a standard error.
pub(crate) fn decimals(error: f64) -> usize {
    if error > 0.0 && error.is_finite() {
        (1.0 - error.log10().floor()).clamp(0.0, 9.0) as usize
    } else {
        4
    }
}

/// What an effect is on a channel, by its parameters but those for programs.
pub(crate) fn sentence(of: &dyn Effect, channel: &str, parameters: &Parameters) -> String {
    let is_detail = |name: &str| {
        let mut specs = of.parameters().iter();
        specs.any(|s| s.name == name && s.detail)
    };
    let values: Vec<String> = parameters
        .iter()
        .filter(|(name, _)| !is_detail(name))
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
    format!("{} on {channel}: {}", of.docs().title, values.join(", "))
}

/// The limit of one parameter of an effect that is described, the others named in `at`.
pub(crate) fn limit(
    cause: &str,
    channel: &str,
    described: &Parameters,
    parameter: &str,
    at: &[&str],
) -> Option<DetectionLimit> {
    let size = described.get(parameter)?;
    let exact = |p: &Parameter| Parameter::exact(p.value, &p.unit);
    let others = at.iter().filter_map(|name| described.get_key_value(*name));
    Some(DetectionLimit {
        cause: cause.into(),
        channel: channel.into(),
        parameter: parameter.into(),
        value: size.value,
        unit: size.unit.clone(),
        at: others.map(|(name, p)| (name.clone(), exact(p))).collect(),
    })
}
