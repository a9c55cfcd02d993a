//! From rates to angles: the drift of the integral with what the fitted model predicts for it, and the attitude.
//!
//! ```
//! use noise::attitude::{angle_between, integrate};
//!
//! // 90 deg in a second about z.
//! let start = [1.0, 0.0, 0.0, 0.0];
//! let rates = [[0.0, 0.0, std::f64::consts::FRAC_PI_2]; 11];
//! let (_, end) = integrate(&rates, 0.1, start)[5];
//! assert!((angle_between(start, end).to_degrees() - 90.0).abs() < 1e-9);
//! ```

use std::f64::consts::PI;
use std::ops::Range;

use crate::fit::{NoiseFit, Term};

/// The integrated rate at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnglePoint {
    /// Time since the end of the calibration, s.
    pub t_s: f64,
    /// Integral of the reading less the bias of the calibration, U·s.
    pub angle: f64,
    /// Expected value: that of the rate ramp where the fit has one, U·s.
    pub expected: f64,
    /// Standard deviation predicted by the fit, U·s.
    pub sigma: f64,
}

/// Integrate the longest run of `values`: the bias is the mean over the first `calibration_s`, and the angle grows from
/// there. Empty when the run is not longer than the calibration.
///
/// | name | meaning | unit | shape |
/// |---|---|---|---|
/// | `values` | readings | U | `n` |
/// | `runs` | rows without a gap between them | – | any |
/// | `calibration_s` | length over which the bias is taken | s | scalar |
/// | returns | angles at `points` instants, evenly spaced, and what `fit` predicts of them | U·s | `points` |
///
/// The prediction is the variance of θ(T+t) − θ(T) − (t/T)(θ(T) − θ(0)) for white noise, flicker, random walk and
/// quantization noise together, from their generalized structure functions: N²τ, −(B²/π)τ² ln τ, −K²τ³/6, 2Q².
#[must_use]
pub fn angle_growth(
    values: &[f64],
    runs: &[Range<usize>],
    fit: &NoiseFit,
    calibration_s: f64,
    points: usize,
) -> Vec<AnglePoint> {
    let tau0 = fit.tau0;
    let Some(run) = runs.iter().max_by_key(|r| r.len()) else {
        return Vec::new();
    };
    let y = &values[run.clone()];
    let calibration = (calibration_s / tau0).round().max(1.0) as usize;
    if y.len() <= calibration || points == 0 {
        return Vec::new();
    }
    let bias = y[..calibration].iter().sum::<f64>() / calibration as f64;
    let rest = y.len() - calibration;
    let mut out = Vec::with_capacity(points);
    let (mut angle, mut next) = (0.0, 1);
    for (i, v) in y[calibration..].iter().enumerate() {
        angle += (v - bias) * tau0;
        if i + 1 >= (next * rest).div_ceil(points) {
            next = (i + 1) * points / rest + 1;
            let t_s = (i + 1) as f64 * tau0;
            let length = calibration as f64 * tau0;
            out.push(AnglePoint {
                t_s,
                angle,
                expected: fit.maximum.ramp * t_s * (t_s + length) / 2.0,
                sigma: predicted_sigma(fit, length, t_s),
            });
        }
    }
    out
}

/// Standard deviation of the angle `t_s` after a calibration of length `calibration_s`, U·s.
#[must_use]
pub fn predicted_sigma(fit: &NoiseFit, calibration_s: f64, t_s: f64) -> f64 {
    let letters = Term::ALL.map(|t| t.letter(fit.maximum.coefficients[t as usize], fit.tau0));
    growth_sigma(letters, calibration_s, t_s)
}

/// The same from N, B, K and Q.
pub(crate) fn growth_sigma([n, b, k, q]: [f64; 4], calibration_s: f64, t_s: f64) -> f64 {
    let structure = |tau: f64| {
        n * n * tau - b * b / PI * tau * tau * tau.ln() - k * k * tau.powi(3) / 6.0 + 2.0 * q * q
    };
    let ratio = t_s / calibration_s;
    // −½ ΣΣ aᵢaⱼ D(tᵢ − tⱼ) with a = 1, −1 − ratio, ratio at T + t, T and 0.
    let variance = (1.0 + ratio) * structure(t_s) - ratio * structure(calibration_s + t_s)
        + (1.0 + ratio) * ratio * structure(calibration_s);
    variance.max(0.0).sqrt()
}

/// A unit quaternion (w, x, y, z) that takes body axes to the frame of the start.
pub type Quaternion = [f64; 4];

/// Attitude from three body rates.
///
/// | name | meaning | unit | shape |
/// |---|---|---|---|
/// | `rates` | body rates, corrected, evenly spaced, no gaps | rad/s | `n` × 3 |
/// | `tau0` | sample interval | s | scalar |
/// | `start` | attitude at the first sample | – | 4 |
/// | returns | index of the sample and attitude there, every second sample and the last | – | – |
///
/// Over two intervals H = 2τ₀ the rotation vector is H(ω₀ + 4ω₁ + ω₂)/6 + H²(ω₀ × ω₂)/12: the rate to fourth order and
/// the part of it that does not commute, so the error falls with τ₀⁴. Each step is a rotation, so the norm stays 1.
#[must_use]
pub fn integrate(rates: &[[f64; 3]], tau0: f64, start: Quaternion) -> Vec<(usize, Quaternion)> {
    let mut q = start;
    let mut out = vec![(0, q)];
    let mut i = 0;
    while i + 1 < rates.len() {
        let (first, last, h, mean): ([f64; 3], [f64; 3], f64, [f64; 3]);
        if i + 2 < rates.len() {
            (first, last, h) = (rates[i], rates[i + 2], 2.0 * tau0);
            mean = std::array::from_fn(|a| (first[a] + 4.0 * rates[i + 1][a] + last[a]) / 6.0);
            i += 2;
        } else {
            (first, last, h) = (rates[i], rates[i + 1], tau0);
            mean = std::array::from_fn(|a| (first[a] + last[a]) / 2.0);
            i += 1;
        }
        let cross = [
            first[1] * last[2] - first[2] * last[1],
            first[2] * last[0] - first[0] * last[2],
            first[0] * last[1] - first[1] * last[0],
        ];
        q = multiply(
            q,
            rotation(std::array::from_fn(|a| {
                h * mean[a] + h * h / 12.0 * cross[a]
            })),
        );
        out.push((i, q));
    }
    out
}

fn rotation(vector: [f64; 3]) -> Quaternion {
    let angle = vector.iter().map(|v| v * v).sum::<f64>().sqrt();
    let scale = if angle < 1e-9 {
        0.5
    } else {
        (angle / 2.0).sin() / angle
    };
    [
        (angle / 2.0).cos(),
        scale * vector[0],
        scale * vector[1],
        scale * vector[2],
    ]
}

/// Product of two unit quaternions (w, x, y, z), normalised: the rotation `b`, then `a`.
#[must_use]
pub fn multiply(a: Quaternion, b: Quaternion) -> Quaternion {
    let q = [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ];
    let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    q.map(|v| v / norm)
}

/// Angle between two attitudes, rad.
#[must_use]
pub fn angle_between(a: Quaternion, b: Quaternion) -> f64 {
    let d = multiply([a[0], -a[1], -a[2], -a[3]], b);
    2.0 * (d[1] * d[1] + d[2] * d[2] + d[3] * d[3])
        .sqrt()
        .atan2(d[0].abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{Spectrum, fit};
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// Error of the attitude after 10 s of q_z(αt)·q_x(βt), whose body rate is (β, α sin βt, α cos βt).
    fn coning_error(tau0: f64) -> f64 {
        let (alpha, beta) = (0.9, 1.7);
        let n = (10.0 / tau0).round() as usize;
        let rates: Vec<[f64; 3]> = (0..=n)
            .map(|i| {
                let (s, c) = (beta * i as f64 * tau0).sin_cos();
                [beta, alpha * s, alpha * c]
            })
            .collect();
        let (_, q) = *integrate(&rates, tau0, [1.0, 0.0, 0.0, 0.0])
            .last()
            .unwrap();
        let t = n as f64 * tau0;
        angle_between(
            q,
            multiply(
                rotation([0.0, 0.0, alpha * t]),
                rotation([beta * t, 0.0, 0.0]),
            ),
        )
    }

    #[test]
    fn the_drift_against_an_exact_rotation_falls_with_the_fourth_power_of_the_interval() {
        let (coarse, fine) = (coning_error(0.1), coning_error(0.05));
        assert!(fine < 1e-4, "{fine}");
        assert!((12.0..20.0).contains(&(coarse / fine)), "{coarse} {fine}");
    }

    #[test]
    fn the_predicted_growth_is_the_spread_of_many_integrals() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        let (tau0, n, k, calibration, length) = (0.05f64, 0.05, 0.01, 400usize, 2000usize);
        let mut gauss = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut squares = 0.0;
        let runs = 1000;
        let mut fitted = None;
        for _ in 0..runs {
            let mut bias = 0.0;
            let y: Vec<f64> = (0..length)
                .map(|_| {
                    bias += k * tau0.sqrt() * gauss();
                    bias + n / tau0.sqrt() * gauss()
                })
                .collect();
            let whole = 0..length;
            let fit = fitted.get_or_insert_with(|| {
                let mut f = fit(&Spectrum::of(&y, std::slice::from_ref(&whole), tau0));
                f.maximum.coefficients = [n * n / tau0, 0.0, k * k * tau0, 0.0];
                f.maximum.ramp = 0.0;
                f
            });
            let last = *angle_growth(&y, &[whole], fit, calibration as f64 * tau0, 10)
                .last()
                .unwrap();
            assert!((last.t_s - 80.0).abs() < 1e-9);
            squares += (last.angle / last.sigma).powi(2);
        }
        // χ²(1000): 4 standard deviations are 18 %.
        assert!((squares / f64::from(runs) - 1.0).abs() < 0.18, "{squares}");
    }

    /// Rms of the angle of the attitude over the rms that is predicted for it, with the standard error of that ratio, on
    /// stands at rest whose white noise predicts so many degrees; a tenth of 600 s calibrates, as in `analyze`.
    fn rms_over_predicted(predicted_deg: f64, stands: usize, seed: u64) -> (f64, f64) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let (tau0, calibration, length) = (1.0f64, 60usize, 600usize);
        let rest = (length - calibration - 1) as f64 * tau0;
        let unit = growth_sigma([1.0, 0.0, 0.0, 0.0], calibration as f64 * tau0, rest);
        let n = predicted_deg.to_radians() / (3f64.sqrt() * unit);
        let squares: Vec<f64> = (0..stands)
            .map(|_| {
                let mut rates: Vec<[f64; 3]> = (0..length)
                    .map(|_| {
                        let mut gauss = || -> f64 { StandardNormal.sample(&mut rng) };
                        [gauss(), gauss(), gauss()].map(|g| n / tau0.sqrt() * g)
                    })
                    .collect();
                let bias = [0, 1, 2].map(|axis| {
                    rates[..calibration].iter().map(|r| r[axis]).sum::<f64>() / calibration as f64
                });
                rates.drain(..calibration);
                for rate in &mut rates {
                    *rate = std::array::from_fn(|axis| rate[axis] - bias[axis]);
                }
                let start = [1.0, 0.0, 0.0, 0.0];
                let (_, end) = *integrate(&rates, tau0, start).last().unwrap();
                (angle_between(start, end).to_degrees() / predicted_deg).powi(2)
            })
            .collect();
        let count = stands as f64;
        let mean = squares.iter().sum::<f64>() / count;
        let variance = squares.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / count;
        let ratio = mean.sqrt();
        (ratio, (variance / count).sqrt() / (2.0 * ratio))
    }

    #[test]
    fn rotations_of_noise_add_like_numbers_up_to_the_limit_and_not_far_beyond() {
        for predicted in [20.0, 40.0, crate::angles::PREDICTED_TO_DEG] {
            let (ratio, error) = rms_over_predicted(predicted, 3000, 17);
            println!("predicted {predicted} deg rms: {ratio:.3} +- {error:.3} of it");
            assert!((ratio - 1.0).abs() < 4.0 * error, "{ratio} +- {error}");
        }
        // There the angle comes round.
        let (ratio, error) = rms_over_predicted(120.0, 3000, 17);
        println!("predicted 120 deg rms: {ratio:.3} +- {error:.3} of it");
        assert!(ratio < 1.0 - 4.0 * error, "{ratio} +- {error}");
    }
}
