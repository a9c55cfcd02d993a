//! The library of effects: one file each, one line that declares it and one in [`EFFECTS`].

use crate::effect::Effect;

pub mod am_line;
pub mod base_motion;
pub mod bias_step;
pub mod clock_rate;
pub mod coarse_lsb;
pub mod common_noise;
pub mod correlated_noise;
pub mod cross_axis;
pub mod double_rounding;
pub mod dropped_samples;
pub mod flicker;
pub mod g_sensitivity;
pub mod gauss_markov;
pub mod high_pass;
pub mod line;
pub mod low_pass;
pub mod motor_bias;
pub mod motor_noise;
pub mod narrow_band;
pub mod noise_change;
pub mod outliers;
pub mod quantization_noise;
pub mod rate_ramp;
pub mod saturation;
pub mod scale_error;
pub mod shock;
pub mod stale_samples;
pub mod stuck_bit;
pub mod supply_sensitivity;
pub mod telegraph;
pub mod temperature;
pub mod temperature_quadratic;
pub mod timestamp_jitter;
pub mod wandering_line;
pub mod warm_up;

/// Every effect of the library, in the order of docs/effects.md.
pub static EFFECTS: &[&dyn Effect] = &[
    &temperature::EFFECT,
    &temperature_quadratic::EFFECT,
    &warm_up::EFFECT,
    &rate_ramp::EFFECT,
    &line::EFFECT,
    &am_line::EFFECT,
    &motor_bias::EFFECT,
    &motor_noise::EFFECT,
    &g_sensitivity::EFFECT,
    &supply_sensitivity::EFFECT,
    &bias_step::EFFECT,
    &cross_axis::EFFECT,
    &scale_error::EFFECT,
    &base_motion::EFFECT,
    &gauss_markov::EFFECT,
    &flicker::EFFECT,
    &low_pass::EFFECT,
    &high_pass::EFFECT,
    &narrow_band::EFFECT,
    &wandering_line::EFFECT,
    &quantization_noise::EFFECT,
    &telegraph::EFFECT,
    &common_noise::EFFECT,
    &correlated_noise::EFFECT,
    &noise_change::EFFECT,
    &shock::EFFECT,
    &outliers::EFFECT,
    &saturation::EFFECT,
    &coarse_lsb::EFFECT,
    &stuck_bit::EFFECT,
    &double_rounding::EFFECT,
    &stale_samples::EFFECT,
    &dropped_samples::EFFECT,
    &timestamp_jitter::EFFECT,
    &clock_rate::EFFECT,
];

/// The effect of that cause id.
#[must_use]
pub fn effect(id: &str) -> Option<&'static dyn Effect> {
    EFFECTS.iter().copied().find(|e| e.id() == id)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_file_of_an_effect_is_declared_and_listed_once() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/src/effects");
        let files: BTreeSet<String> = std::fs::read_dir(folder)
            .unwrap()
            .filter_map(|f| Some(f.unwrap().path().file_stem()?.to_str()?.to_owned()))
            .filter(|name| name != "mod")
            .collect();
        let listed: BTreeSet<String> = EFFECTS.iter().map(|e| e.id().to_owned()).collect();
        assert_eq!(listed.len(), EFFECTS.len(), "an id is listed twice");
        assert_eq!(files, listed);
    }
}
