//! The library of effects: one file each, and one line in [`EFFECTS`].

use crate::effect::Effect;

macro_rules! library {
    ($($module:ident),+ $(,)?) => {
        $(pub mod $module;)+
        /// Every effect of the library, in the order of docs/effects.md.
        pub static EFFECTS: &[&dyn Effect] = &[$(&$module::EFFECT),+];
    };
}

library! {
    temperature,
    temperature_quadratic,
    warm_up,
    rate_ramp,
    line,
    am_line,
    motor_bias,
    motor_noise,
    g_sensitivity,
    supply_sensitivity,
    bias_step,
    cross_axis,
    scale_error,
    base_motion,
    gauss_markov,
    flicker,
    low_pass,
    telegraph,
    common_noise,
    noise_change,
    outliers,
    saturation,
    coarse_lsb,
    stuck_bit,
    stale_samples,
    dropped_samples,
    timestamp_jitter,
    clock_rate,
}

/// The effect of that cause id.
#[must_use]
pub fn effect(id: &str) -> Option<&'static dyn Effect> {
    EFFECTS.iter().copied().find(|e| e.id() == id)
}
