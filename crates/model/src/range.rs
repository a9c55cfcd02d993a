//! What the numbers of a model file may be. A file is written by people and programs, and read where a motor turns: what no
//! stand has is refused before anything acts on it.

use crate::unnamed::{EXCESS_KURTOSIS_LIMITS, SKEWNESS_LIMITS};

/// Least and greatest value, both included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Range {
    least: f64,
    most: f64,
    whole: bool,
}

/// No reading is larger, in its unit: those beyond it are none in a capture either.
const LARGEST: f64 = 1e100;
/// Seconds and hertz that mean anything.
const LONGEST: f64 = 1e15;
const SHORTEST: f64 = 1e-12;
/// Samples that an effect of single samples may touch.
const MOST_SAMPLES: f64 = 1e8;
/// Bits of a reading of the gyro, the lowest of which is 0.
const HIGHEST_BIT: f64 = 13.0;
/// A process that switches oftener between two samples shows nothing more, and a simulation draws each switch.
const SWITCHES_A_SAMPLE: f64 = 100.0;
/// Effects of one file, and its channels: no stand has more.
pub(crate) const MOST_EFFECTS: usize = 1000;
pub(crate) const MOST_CHANNELS: usize = 64;

/// Of anything.
pub(crate) const ANY: Range = range(-LARGEST, LARGEST);
/// Of a size: a standard error, N, K, Q.
pub(crate) const SIZE: Range = range(0.0, LARGEST);
/// Of a step of the readings.
pub(crate) const STEP: Range = range(1e-100, LARGEST);
/// Of the correlation of two axes, each of which has noise of its own.
pub(crate) const CORRELATION: Range = range(-0.999, 0.999);
/// Of what comes again over what was there before.
pub(crate) const WEIGHT: Range = range(-1.0, 1.0);
/// Of moments of a distribution that a noise may have ([`crate::simulate`] has one for each of these).
pub(crate) const SKEWNESS: Range = range(SKEWNESS_LIMITS[0], SKEWNESS_LIMITS[1]);
pub(crate) const EXCESS_KURTOSIS: Range =
    range(EXCESS_KURTOSIS_LIMITS[0], EXCESS_KURTOSIS_LIMITS[1]);
/// Of a sample rate, Hz, and of a time, s, that divides.
pub(crate) const POSITIVE: Range = range(SHORTEST, LONGEST);

const fn range(least: f64, most: f64) -> Range {
    Range {
        least,
        most,
        whole: false,
    }
}

const fn whole(least: f64, most: f64) -> Range {
    Range {
        least,
        most,
        whole: true,
    }
}

impl Range {
    /// Says what a value has to be, where it is not.
    pub fn refuses(self, name: &str, value: f64) -> Option<String> {
        let Self { least, most, whole } = self;
        let holds = (least..=most).contains(&value) && !(whole && value.fract() != 0.0);
        let kind = if whole { "a whole number " } else { "" };
        let [value, least, most] = [value, least, most].map(written);
        (!holds).then(|| format!("{name} is {value}; it has to be {kind}from {least} to {most}"))
    }
}

/// A number as a person writes it: `1e300`, and not a one with three hundred zeros.
pub(crate) fn written(value: f64) -> String {
    match value.abs() {
        0.0 | 1e-4..1e7 => value.to_string(),
        _ => format!("{value:e}"),
    }
}

/// Of a setting of the excitation. Periods and time constants divide.
pub(crate) fn of_setting(key: &str) -> Range {
    match key {
        "motor_duty" | "motor_on" | "motor_forward" => range(0.0, 1.0),
        "vibration_g" => SIZE,
        key if key.ends_with("_s") => POSITIVE,
        _ => ANY,
    }
}

/// Least and greatest value that a parameter of an effect may have, by its name and unit: where an interval about an
/// estimate ends, too.
#[must_use]
pub fn bounds(name: &str, unit: &str) -> [f64; 2] {
    let Range { least, most, .. } = of_parameter(name, unit, f64::INFINITY);
    [least, most]
}

/// Most means one after the other, and most readings of each.
const MOST_STAGES: f64 = 3.0;
const MOST_AVERAGED: f64 = 64.0;

/// Most counts from one reading to the next: as many as the highest bit makes.
pub(crate) const MOST_COUNTS: f64 = (1u32 << HIGHEST_BIT as u32) as f64;

/// Largest coefficient of the logarithm of a filter's gain: e^40 between what passes and what does not.
const MOST_CEPSTRUM: f64 = 20.0;

/// Of a parameter of an effect by its name and unit, on a stand of that rate.
pub(crate) fn of_parameter(name: &str, unit: &str, rate_hz: f64) -> Range {
    match (name, unit) {
        ("count" | "clipped", _) => range(0.0, MOST_SAMPLES),
        ("running" | "behind", _) => range(1.0, MOST_SAMPLES),
        ("bit" | "missing_bits", _) => whole(0.0, HIGHEST_BIT),
        ("step_counts", _) => whole(1.0, MOST_COUNTS),
        ("value" | "by_magnitude" | "triangular" | "silent" | "normal", _) => whole(0.0, 1.0),
        ("stages", _) => whole(1.0, MOST_STAGES),
        ("averaged", _) => whole(1.0, MOST_AVERAGED),
        ("fraction" | "upward", _) => range(0.0, 1.0),
        ("lag1_correlation" | "skew", _) => range(-1.0, 1.0),
        ("variance_increase" | "variance_increase_at_full_duty", _) => range(-1.0, LARGEST),
        ("dwell_time", _) => range(1.0 / (SWITCHES_A_SAMPLE * rate_hz), LONGEST),
        ("time_constant" | "correlation_time" | "surge_time", _) => POSITIVE,
        ("sigma" | "rms" | "size" | "spread" | "bias_instability", _) => SIZE,
        (name, _) if name.starts_with("with_") => range(-1.0, 1.0),
        (name, _) if name.starts_with("cepstrum_") => range(-MOST_CEPSTRUM, MOST_CEPSTRUM),
        ("delay", _) | (_, "Hz") => range(0.0, LONGEST),
        (_, "s") => range(-LONGEST, LONGEST),
        _ => ANY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_refused_as_they_are_written() {
        assert_eq!(
            ANY.refuses("slope", 1e300).as_deref(),
            Some("slope is 1e300; it has to be from -1e100 to 1e100")
        );
        assert_eq!(
            POSITIVE.refuses("rate_hz", 0.0).as_deref(),
            Some("rate_hz is 0; it has to be from 1e-12 to 1e15")
        );
        assert_eq!(
            of_parameter("bit", "1", 20.0)
                .refuses("bit", -0.5)
                .as_deref(),
            Some("bit is -0.5; it has to be a whole number from 0 to 13")
        );
        let all = [f64::NAN, f64::INFINITY, -12_345.678, 0.001, 1e-300];
        assert_eq!(
            all.map(written),
            ["NaN", "inf", "-12345.678", "0.001", "1e-300"]
        );
    }
}
