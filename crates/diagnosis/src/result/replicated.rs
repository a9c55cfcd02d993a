//! The record among simulations of a model, as it leaves the program.

use serde::{Deserialize, Serialize};

/// Chance at or below which the replicates of a model do not hold the record.
pub const LEVEL: f64 = 0.05;
/// The statistic by which a record strays farthest from the replicates of a model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Worst {
    /// Which.
    pub statistic: String,
    /// Of the record, in `unit`.
    pub value: f64,
    /// Lower edge of the envelope that holds 95 % of the replicates in all statistics of all channels at once.
    pub low: f64,
    /// Its upper edge.
    pub high: f64,
    /// Unit of the three.
    pub unit: String,
    /// The other axis, where the statistic is of two: for rules, and in no file.
    #[serde(skip)]
    pub with: Option<String>,
}

/// The record among the replicates of one model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Among {
    /// Chance that a record of the model strays in any channel as far as this channel of the record.
    pub p_value: f64,
    /// Where it strays farthest.
    pub worst: Worst,
}

impl Among {
    /// In words where the record strays farthest.
    #[must_use]
    pub fn strays(&self) -> String {
        let worst = &self.worst;
        let unit = if worst.unit == "1" {
            String::new()
        } else {
            format!(" {}", worst.unit)
        };
        let [value, low, high] = [worst.value, worst.low, worst.high].map(digits);
        let what = &worst.statistic;
        format!("{what} {value}{unit}, its simulations {low} to {high}")
    }

    /// Whether the replicates hold the record.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.p_value > LEVEL
    }
}

/// A channel of the record among the replicates of the model before and after it was extended.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Replicated {
    /// White noise, random walk and a constant bias.
    pub before: Among,
    /// The same with the causes found.
    pub after: Among,
}

/// Four digits, so that a value just outside its envelope is seen to be.
fn digits(v: f64) -> String {
    let size = v.abs();
    if size >= 1e4 || size > 0.0 && size < 1e-3 {
        return format!("{v:.3e}");
    }
    let places = (3 - size.max(1e-3).log10().floor() as i32).clamp(0, 6) as usize;
    format!("{v:.places$}")
}
