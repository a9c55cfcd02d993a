//! What a gyro's samples show of what happens before its filters: the analog pole, then the Bartlett filter of four taps
//! that the part has after power-on, at its own 256 samples a second, read 20 times a second.

use std::f64::consts::TAU;

use bench::bartlett;

/// Rate at which the board samples, Hz.
pub(super) const RATE_HZ: f64 = 20.0;
/// The part's own clock, Hz (ADIS16250 data sheet).
const CLOCK_HZ: f64 = 256.0;
/// Taps of its filter after power-on: two boxcars of 2^2 (ADIS16250 data sheet, SENS/AVG).
const FILTER: u32 = 2;
/// Its analog pole, Hz, and the unit of its readings, deg/s, after power-on (ADIS16250 data sheet).
const STATED_POLE_HZ: f64 = 50.0;
const LSB_DPS: f64 = 0.073_26;
/// How much later than the bias a reading steps, s: the pole, half of the filter's taps, and half a period of the part's clock until
/// the board reads.
pub(super) const LATE_S: f64 =
    1.0 / (TAU * STATED_POLE_HZ) + ((1 << FILTER) - 1) as f64 / CLOCK_HZ + 0.5 / CLOCK_HZ;
/// Time in which the noise on the shared reference decays, s (`bench::Fault::CommonNoise`).
const COMMON_TAU_S: f64 = 15e-3;
/// Clock periods after which nothing is left of a pulse through a pole of 50 Hz: e^-30.
const MEMORY: usize = 24;
/// Points over the time by which two gyros' samples are apart.
const POINTS: i32 = 20;

/// The frequency that a tone has in the samples, Hz.
pub(super) fn folded(frequency_hz: f64) -> f64 {
    (frequency_hz - RATE_HZ * (frequency_hz / RATE_HZ).round()).abs()
}

/// Amplitude in the samples of a tone of amplitude 1.
pub(super) fn tone_gain(frequency_hz: f64, pole_hz: f64) -> f64 {
    let weights = bartlett(FILTER);
    let middle = (weights.len() / 2) as f64;
    let of_filter: f64 = (weights.iter().enumerate())
        .map(|(k, w)| w * (TAU * frequency_hz / CLOCK_HZ * (k as f64 - middle)).cos())
        .sum();
    of_filter.abs() / (frequency_hz / pole_hz).hypot(1.0)
}

/// Correlation of neighbouring readings of a gyro whose noise goes through this pole in place of the stated one; `random_walk` is
/// its angle random walk behind the stated one, deg/sqrt(h). What rounding adds to a reading, no other one has.
pub(super) fn lag1_correlation(pole_hz: f64, random_walk: f64) -> f64 {
    let at = |lag_s: f64, pole_hz: f64| {
        covariance(&bartlett(FILTER), lag_s, 1.0 / (TAU * pole_hz)) * pole_hz
    };
    // Behind a pole the variance of white noise is proportional to the corner.
    let variance = (random_walk / 60.0).powi(2) * RATE_HZ / at(0.0, STATED_POLE_HZ);
    variance * at(1.0 / RATE_HZ, pole_hz) / (variance * at(0.0, pole_hz) + LSB_DPS.powi(2) / 12.0)
}

/// Standard deviation that the samples of several gyros have in common, of noise on their reference with `sigma`.
///
/// Each gyro takes its own samples: those of two are apart by less than a clock period, small differences as often as
/// the overlap of two periods.
pub(super) fn shared_sigma(sigma: f64, pole_hz: f64) -> f64 {
    let keep = (-TAU * pole_hz / CLOCK_HZ).exp();
    let weights = bartlett(FILTER);
    let mut response = vec![0.0; MEMORY + weights.len()];
    for back in 0..MEMORY {
        for (k, w) in weights.iter().enumerate() {
            response[back + k] += w * (1.0 - keep) * keep.powi(back as i32);
        }
    }
    let (mut sum, mut all) = (0.0, 0.0);
    for point in 1 - POINTS..POINTS {
        let apart = f64::from(point) / f64::from(POINTS);
        let often = 1.0 - apart.abs();
        sum += often * covariance(&response, apart / CLOCK_HZ, COMMON_TAU_S);
        all += often;
    }
    sigma * (sum / all).sqrt()
}

/// Covariance at a lag of noise that decays within `tau_s` and has variance 1, behind a filter at the part's clock.
fn covariance(weights: &[f64], lag_s: f64, tau_s: f64) -> f64 {
    let mut sum = 0.0;
    for (i, a) in weights.iter().enumerate() {
        for (j, b) in weights.iter().enumerate() {
            let apart = lag_s + (i as f64 - j as f64) / CLOCK_HZ;
            sum += a * b * (-apart.abs() / tau_s).exp();
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tone_above_half_the_sample_rate_folds_down() {
        for (true_hz, seen_hz) in [(3.0, 3.0), (12.0, 8.0), (23.5, 3.5), (40.0, 0.0)] {
            assert!((folded(true_hz) - seen_hz).abs() < 1e-12, "{true_hz} Hz");
        }
    }

    #[test]
    fn a_slow_tone_passes_whole_and_one_at_the_corner_loses_3_db_and_the_filters_share() {
        assert!((tone_gain(1e-3, 50.0) - 1.0).abs() < 1e-6);
        // Two boxcars of four: (sin(4 x) / (4 sin x))^2 with x = pi f / 256 Hz.
        let x = std::f64::consts::PI * 50.0 / CLOCK_HZ;
        let filter = ((4.0 * x).sin() / (4.0 * x.sin())).powi(2);
        assert!((tone_gain(50.0, 50.0) - filter / 2f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn white_noise_behind_the_stated_pole_is_hardly_alike_and_behind_a_slow_one_it_is() {
        assert!(lag1_correlation(50.0, 4.2) < 1e-3);
        // Far below the filter's band the pole alone is left: exp(-2 pi f / 20 Hz).
        let alone = (-TAU * 0.05 / RATE_HZ).exp();
        assert!((lag1_correlation(0.05, 1e6) - alone).abs() < 0.01);
        // 4.2 deg/sqrt(h), 0.313 deg/s behind the stated pole, are 0.058 deg/s behind one a hundred times as slow, which alone makes
        // 0.874; rounding adds 0.021 deg/s.
        let rounded = lag1_correlation(0.5, 4.2);
        assert!((0.76..0.78).contains(&rounded), "{rounded}");
    }

    #[test]
    fn shared_noise_loses_a_fifth_in_the_filters() {
        // 0.795 was measured on the bench: the covariance of two gyros over 600 s, 0.413 of 0.5205 and 0.594 of 0.7471.
        assert!((shared_sigma(1.0, 50.0) - 0.795).abs() < 0.003);
    }
}
