//! What is asked of the readings of one channel.

use super::*;

/// Whether the readings that there are are all the same.
pub(super) fn is_constant(y: &[f64]) -> bool {
    let mut known = y.iter().filter(|v| v.is_finite());
    let first = known.next();
    known.all(|v| Some(v) == first)
}

/// Factor to the unit in which a gyro is searched, and that unit.
pub(super) fn unit_of(channel: &Channel) -> (f64, String) {
    match channel.unit.as_str() {
        "rad/s" => (180.0 / std::f64::consts::PI, "deg/s".to_owned()),
        other => (1.0, other.to_owned()),
    }
}

pub(super) fn white_of(y: &[f64]) -> f64 {
    let known: Vec<f64> = y.iter().copied().filter(|v| v.is_finite()).collect();
    let d: Vec<f64> = known.windows(2).map(|w| w[1] - w[0]).collect();
    d.iter().map(|d| d * d).sum::<f64>() / (2.0 * d.len().max(1) as f64)
}
