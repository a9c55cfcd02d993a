//! What the simulation of a sensor gets wrong, and why.

use model::record::Record;

use crate::error::AnalysisError;
use crate::result::Diagnosed;

/// Options of [`diagnose`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DiagnoseOptions {
    /// Seed of whatever is random (fill of lost samples, replicates).
    pub seed: u64,
    /// Name of the file, for the report.
    pub file: String,
    /// Digest of the file, for the model file.
    pub hash: Option<String>,
}

/// Diagnose a record.
///
/// # Errors
/// [`AnalysisError::Inconclusive`] when the record is too short, [`AnalysisError::NoChannel`] when it holds no gyro,
/// [`AnalysisError::NoRate`] when its sample rate is unknown.
pub fn diagnose(record: &Record, _options: &DiagnoseOptions) -> Result<Diagnosed, AnalysisError> {
    Err(AnalysisError::Inconclusive {
        what: "a diagnosis".into(),
        have: record.len() as f64,
        need: 1200.0,
        unit: "samples",
    })
}
