//! What has no name, and what a finding or an entry without a name does.

use std::collections::BTreeMap;

use model::effect::Parameters;
use serde::{Deserialize, Serialize};

/// What something does to a channel.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Consequence {
    /// Share of the variance of the readings.
    pub share_of_variance: f64,
    /// Angle error that it makes by itself, deg rms, by horizon (`10s`, `100s`); horizons longer than a quarter of the
    /// record are left out.
    pub angle_rms_deg: BTreeMap<String, f64>,
    /// Velocity error that it makes by itself on an accelerometer, m/s rms, by the same horizons.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub velocity_rms_mps: BTreeMap<String, f64>,
    /// Largest change of an angle or velocity error over these horizons, or of an Allan deviation at an octave, relative.
    pub largest_change: f64,
}

impl Consequence {
    /// Of white noise that two axes share: neither is changed by itself; the deviation of their sum, or of their difference,
    /// is.
    #[must_use]
    pub fn of_correlation(r: f64) -> Self {
        Self {
            share_of_variance: r.abs(),
            angle_rms_deg: BTreeMap::new(),
            velocity_rms_mps: BTreeMap::new(),
            largest_change: (1.0 + r.abs()).sqrt() - 1.0,
        }
    }
}

/// Structure that no effect of the library explains: one entry for what is seen of one thing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Unexplained {
    /// The channel.
    pub channel: String,
    /// What is seen, where, how large, in one sentence.
    pub what: String,
    /// Each observation of it, in full.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub details: Vec<String>,
    /// Its size, in the unit of the channel.
    #[serde(default)]
    pub rms: Option<f64>,
    /// Its share of the variance of the readings.
    #[serde(default)]
    pub share_of_variance: Option<f64>,
    /// Lowest and highest frequency, Hz, where it has such a place.
    #[serde(default)]
    pub band_hz: Option<[f64; 2]>,
    /// Start and end, s from the start of the record, where it lasts for a part of it.
    #[serde(default)]
    pub span_s: Option<[f64; 2]>,
    /// Times of its events, s from the start.
    #[serde(default)]
    pub times_s: Vec<f64>,
    /// Frequency, amplitude and phase of each line that it is made of, the largest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<Parameters>,
    /// The recorded channel that it follows.
    #[serde(default)]
    pub follows: Option<String>,
    /// Ids of the checks that see it.
    #[serde(default)]
    pub checks: Vec<String>,
    /// Domains of the unnamed terms by which the extended model has it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub modelled: Vec<String>,
    /// What it does, where that can be told.
    #[serde(default)]
    pub consequence: Option<Consequence>,
    /// Whether it changes an angle or a deviation by more than the threshold, or its consequence is not known.
    #[serde(default = "material")]
    pub material: bool,
    /// Place among findings and unexplained entries by consequence, the largest first.
    #[serde(default)]
    pub rank: usize,
}

/// Of a file that does not say: nothing tells that it is small.
pub(super) fn material() -> bool {
    true
}

impl Unexplained {
    /// Whether its sentence, or an observation of it, holds these words.
    #[must_use]
    pub fn says(&self, words: &str) -> bool {
        let all = self.details.iter().chain([&self.what]);
        all.into_iter().any(|text| text.contains(words))
    }
}
