//! A number that leaves the project: value, standard error, unit.

use serde::{Deserialize, Serialize};

/// A value with its standard error and unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// The estimate, in `unit`.
    pub value: f64,
    /// Its standard error, in `unit`; `None` where it is given, not estimated.
    pub std_error: Option<f64>,
    /// Unit: `deg/s`, `deg/s/degC`, `Hz`, `1`, ...
    pub unit: String,
}

impl Parameter {
    /// An estimate with its standard error.
    #[must_use]
    pub fn estimated(value: f64, std_error: f64, unit: &str) -> Self {
        Self {
            value,
            std_error: std_error.is_finite().then_some(std_error),
            unit: unit.to_owned(),
        }
    }

    /// A value that is given or counted, without error.
    #[must_use]
    pub fn exact(value: f64, unit: &str) -> Self {
        Self {
            value,
            std_error: None,
            unit: unit.to_owned(),
        }
    }
}
