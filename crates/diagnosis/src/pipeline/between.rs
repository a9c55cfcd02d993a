//! A record whose readings lie between others of another rate: that is told once, and what follows of it is no thing of its own.

use model::effects::{
    am_line, common_noise, correlated_noise, low_pass, narrow_band, noise_change,
    quantization_noise, wandering_line,
};

use super::concluded::Told;
use crate::test_level::{Domain, Observation};

/// Causes of fast noise that a curve between readings looks like.
const LOOKS_LIKE: [&str; 8] = [
    am_line::ID,
    common_noise::ID,
    low_pass::ID,
    narrow_band::ID,
    wandering_line::ID,
    noise_change::ID,
    quantization_noise::ID,
    correlated_noise::ID,
];

/// Takes the names of fast noise from channels whose readings lie `between` others: they stay in the model, as what comes nearest.
pub(super) fn without_names(told: &mut Told, between: &[String]) {
    let own = |f: &mut crate::result::Finding| {
        LOOKS_LIKE.contains(&f.cause.as_str()) && f.channels.iter().all(|c| between.contains(c))
    };
    let fallen: Vec<_> = told.findings.extract_if(.., own).collect();
    told.nearest.extend(fallen);
}

/// Whether something is told by that already: what is seen of noise and codes of those channels, and follows no other.
pub(super) fn tells(seen: &Observation, between: &[String]) -> bool {
    let follows = |c: &String| !between.contains(c);
    between.contains(&seen.channel)
        && seen.domain != Domain::Readings
        && !seen.follows.iter().any(follows)
}
