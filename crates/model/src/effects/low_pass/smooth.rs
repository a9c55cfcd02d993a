//! A filter of any smooth shape: the logarithm of its spectrum is a sum of cosines (P. Bloomfield, "An exponential model for
//! the spectrum of a scalar time series", Biometrika 60, 1973). Moving averages, windows of several taps and filters of higher
//! order have one each.

use std::sync::LazyLock;

use crate::effect::{Covariance, Frequencies, Parameters};

/// Names of the cosines' coefficients in a model file, by lag.
pub(super) const NAMES: [&str; MOST] = [
    "cepstrum_1",
    "cepstrum_2",
    "cepstrum_3",
    "cepstrum_4",
    "cepstrum_5",
    "cepstrum_6",
    "cepstrum_7",
    "cepstrum_8",
    "cepstrum_9",
    "cepstrum_10",
    "cepstrum_11",
    "cepstrum_12",
    "cepstrum_13",
    "cepstrum_14",
    "cepstrum_15",
    "cepstrum_16",
    "cepstrum_17",
    "cepstrum_18",
    "cepstrum_19",
    "cepstrum_20",
    "cepstrum_21",
    "cepstrum_22",
    "cepstrum_23",
    "cepstrum_24",
    "cepstrum_25",
    "cepstrum_26",
    "cepstrum_27",
    "cepstrum_28",
    "cepstrum_29",
    "cepstrum_30",
    "cepstrum_31",
    "cepstrum_32",
];

/// Most cosines: they leave of a mean of eight readings a thousandth, in nats a reading, where rounding makes a hundredth of the
/// variance.
pub(super) const MOST: usize = 32;

/// Places of half a turn over which a spectrum is averaged; of 32 cosines in the exponent the mean has ten digits there.
const PLACES: usize = 512;

/// What a low-pass filter passes at most of any frequency, over what it passes of the slowest: 1 dB of ripple.
const RIPPLE: f64 = 1.26;
/// What it passes at least somewhere, in the same measure; what passes more is not told from a process in white noise.
const STOPPED: f64 = 0.12;
/// Half power lies at so many of the smallest distances in frequency that its cosines tell apart, at least.
const FLAT: f64 = 2.0;
/// How far beyond the half power, in the cosine of the frequency, no more than half passes.
const NEAR: f64 = 1e-2;
/// How much of rounding there may be where nothing passes: its size is that of the step and of the noise between neighbours,
/// which a filter makes smaller.
const ROUNDINGS: f64 = 2.0;

/// A filter whose spectrum has so many cosines. Coordinates: their coefficients, by lag.
pub(super) struct Smooth {
    /// Cosines.
    pub cosines: usize,
    /// Variance of the rounding of the readings, over that of their noise.
    pub rounding: f64,
}

/// Sum of coefficients times cosines of multiples of the angle of that cosine (Clenshaw's recurrence).
pub(super) fn cosine_sum(coefficients: &[f64], cosine: f64) -> f64 {
    let (first, second) = (coefficients.iter().rev())
        .fold((0.0, 0.0), |(b, next), r| (r + 2.0 * cosine * b - next, b));
    cosine * first - second
}

/// Cosines of the places.
pub(super) fn places() -> impl Iterator<Item = f64> {
    static PLACED: LazyLock<Vec<f64>> = LazyLock::new(|| {
        let angle = |i: usize| (i as f64 + 0.5) * std::f64::consts::PI / PLACES as f64;
        (0..PLACES).map(|i| angle(i).cos()).collect()
    });
    PLACED.iter().copied()
}

/// Cosines of the multiples of some angles, from once the angle on: cos (k + 1) w = 2 cos w cos k w - cos (k - 1) w.
struct Multiples<'a> {
    once: &'a [f64],
    before: Vec<f64>,
    now: Vec<f64>,
}

impl<'a> Multiples<'a> {
    /// Of angles of these cosines.
    fn of(once: &'a [f64]) -> Self {
        Self {
            once,
            before: once.to_vec(),
            now: vec![1.0; once.len()],
        }
    }

    fn next(&mut self) -> &[f64] {
        for ((before, now), once) in self.before.iter_mut().zip(&self.now).zip(self.once) {
            *before = 2.0 * once * now - *before;
        }
        std::mem::swap(&mut self.before, &mut self.now);
        &self.now
    }
}

/// Mean over all frequencies of the exponential.
fn mean(coefficients: &[f64]) -> f64 {
    places()
        .map(|c| cosine_sum(coefficients, c).exp())
        .sum::<f64>()
        / PLACES as f64
}

/// The spectrum, of mean 1, at some frequencies.
pub(super) fn density(coefficients: &[f64], at: &Frequencies) -> Vec<f64> {
    let mean = mean(coefficients);
    let of = |c: &f64| cosine_sum(coefficients, *c).exp() / mean;
    at.cosine.iter().map(of).collect()
}

/// The correlation of neighbours, and its standard error where the coefficients have these.
pub(super) fn lag1(coefficients: &[(f64, f64)]) -> (f64, f64) {
    let values: Vec<f64> = coefficients.iter().map(|c| c.0).collect();
    let mean = mean(&values);
    let (mut lag1, mut alone) = (0.0, vec![0.0; values.len()]);
    let mut both = alone.clone();
    for c in places() {
        let d = cosine_sum(&values, c).exp() / mean / PLACES as f64;
        lag1 += d * c;
        let (mut before, mut bend) = (c, 1.0);
        for (alone, both) in alone.iter_mut().zip(&mut both) {
            (before, bend) = (bend, 2.0 * c * bend - before);
            *alone += d * bend;
            *both += d * c * bend;
        }
    }
    let slopes = alone.iter().zip(&both).map(|(a, b)| b - lag1 * a);
    let variance: f64 = (slopes.zip(coefficients))
        .map(|(slope, (_, error))| (slope * error).powi(2))
        .sum();
    (lag1, variance.sqrt())
}

/// The frequency, rad per sample, at which half of what passes of the slowest does, and its standard error; none where more does
/// everywhere.
pub(super) fn half_power(coefficients: &[(f64, f64)]) -> Option<(f64, f64)> {
    let values: Vec<f64> = coefficients.iter().map(|c| c.0).collect();
    let half = cosine_sum(&values, 1.0) - std::f64::consts::LN_2;
    let omega = places().find(|c| cosine_sum(&values, *c) < half)?.acos();
    let lags = || {
        coefficients
            .iter()
            .zip(1u16..)
            .map(|(c, k)| (c, f64::from(k)))
    };
    let falls: f64 = lags().map(|((c, _), k)| c * k * (k * omega).sin()).sum();
    let each = lags().map(|((_, error), k)| (error * ((k * omega).cos() - 1.0)).powi(2));
    Some((omega, each.sum::<f64>().sqrt() / falls.abs()))
}

/// The coefficients of a model file: none of one that states no such filter.
pub(super) fn stated(parameters: &Parameters) -> Option<Vec<f64>> {
    let of = |name: &&str| parameters.get(*name).map(|p| p.value);
    let last = NAMES.iter().rposition(|name| of(name).is_some())?;
    Some(
        NAMES[..=last]
            .iter()
            .map(|n| of(n).unwrap_or(0.0))
            .collect(),
    )
}

/// Taps of the filter that draws the noise of such a spectrum out of white noise, sum of squares 1, where rounding adds the part
/// `rounding` of the variance by itself.
pub(super) fn taps(coefficients: &[f64], rounding: f64) -> Vec<f64> {
    let mean = mean(coefficients);
    let drawn = places().map(|c| cosine_sum(coefficients, c).exp() / mean - rounding);
    let logs: Vec<f64> = drawn.map(|d| d.max(LEAST_DRAWN).ln()).collect();
    // ln of the factor without zeros outside the unit circle has half of each cosine's coefficient; its exponential is by
    // recurrence (Oppenheim and Schafer, "Discrete-Time Signal Processing", 13.6).
    let of = |k: usize| {
        let angle = std::f64::consts::PI * k as f64 / PLACES as f64;
        let cosines = (0..PLACES).map(|i| (angle * (i as f64 + 0.5)).cos());
        logs.iter().zip(cosines).map(|(l, c)| l * c).sum::<f64>() / PLACES as f64
    };
    let halves: Vec<f64> = (1..LONGEST).map(of).collect();
    let mut taps = vec![1.0];
    for n in 1..LONGEST {
        let each = (1..=n).map(|k| k as f64 * halves[k - 1] * taps[n - k]);
        let tap = each.sum::<f64>() / n as f64;
        taps.push(tap);
    }
    let all: f64 = taps.iter().map(|t| t * t).sum();
    let mut left = all;
    let kept = taps.iter().take_while(|t| {
        let more = left > LEAST_TAPS * all;
        left -= *t * *t;
        more
    });
    let kept = kept.count();
    taps.truncate(kept);
    let norm = taps.iter().map(|t| t * t).sum::<f64>().sqrt();
    taps.iter_mut().for_each(|t| *t /= norm);
    taps
}

/// Least density that is drawn, over the mean.
const LEAST_DRAWN: f64 = 1e-5;
/// Most taps, and the part of their energy that may be left off at the end.
const LONGEST: usize = 256;
const LEAST_TAPS: f64 = 1e-6;

impl Covariance for Smooth {
    fn dimensions(&self) -> usize {
        self.cosines
    }

    fn filters_white(&self) -> bool {
        true
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        density(theta, at)
    }

    fn slopes(&self, theta: &[f64], at: &Frequencies) -> Option<Vec<Vec<f64>>> {
        let own = density(theta, at);
        let mean = mean(theta);
        let cosines: Vec<f64> = places().collect();
        let weights = cosines
            .iter()
            .map(|c| cosine_sum(theta, *c).exp() / mean / PLACES as f64);
        let weights: Vec<f64> = weights.collect();
        let (mut over, mut there) = (Multiples::of(&cosines), Multiples::of(&at.cosine));
        let of = |_: &f64| {
            let level: f64 = weights.iter().zip(over.next()).map(|(w, b)| w * b).sum();
            let each = own.iter().zip(there.next());
            each.map(|(d, bend)| d * (bend - level)).collect()
        };
        Some(theta.iter().map(of).collect())
    }

    fn bounds(&self, _samples: usize) -> Vec<(f64, f64)> {
        vec![(-LARGEST, LARGEST); self.cosines]
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        vec![vec![0.0; self.cosines]]
    }

    fn claims(&self, theta: &[f64]) -> bool {
        let exact: Vec<(f64, f64)> = theta.iter().map(|c| (*c, 0.0)).collect();
        let Some((half, _)) = half_power(&exact) else {
            return false;
        };
        // What goes on rising to the lowest frequencies that so many cosines tell apart is a process that wanders.
        let is_flat = half > FLAT * std::f64::consts::PI / theta.len() as f64;
        let slowest = cosine_sum(theta, 1.0);
        let passed = || places().map(|c| (c, (cosine_sum(theta, c) - slowest).exp()));
        let most = passed().map(|p| p.1).fold(0.0, f64::max);
        let least = passed().map(|p| p.1).fold(f64::INFINITY, f64::min);
        // What passes again beyond is a notch.
        let again = passed().filter(|(c, _)| *c < half.cos() - NEAR);
        let again = again.map(|p| p.1).fold(0.0, f64::max);
        let floor = ROUNDINGS * self.rounding * mean(theta) / slowest.exp();
        is_flat && most < RIPPLE && least < STOPPED + floor && again < 0.5
    }
}

/// Largest coefficient: a filter of order m has at most 2 m at the first lag.
const LARGEST: f64 = 10.0;

#[cfg(test)]
mod tests {
    use super::*;

    fn frequencies() -> Frequencies {
        let omega: Vec<f64> = (1..40).map(|i| f64::from(i) * 0.08).collect();
        Frequencies::at(omega)
    }

    /// Coefficients of a mean of so many readings, on which rounding adds a part.
    fn of_mean(width: usize, rounding: f64) -> Vec<f64> {
        let own = |angle: f64| {
            let half = angle / 2.0;
            let gain = (half * width as f64).sin() / half.sin() / (width as f64).sqrt();
            gain * gain + rounding
        };
        let all: Vec<(f64, f64)> = places().map(|c| (c.acos(), own(c.acos()).ln())).collect();
        (1..=MOST)
            .map(|k| {
                let each = all.iter().map(|(w, l)| l * (w * k as f64).cos());
                2.0 * each.sum::<f64>() / PLACES as f64
            })
            .collect()
    }

    #[test]
    fn a_mean_of_three_readings_has_its_correlation_and_half_power() {
        let c = of_mean(3, 0.02);
        let (lag1, error) = lag1(&c.iter().map(|c| (*c, 0.01)).collect::<Vec<_>>());
        assert!((lag1 - 2.0 / 3.0 / 1.02).abs() < 1e-3, "{lag1}");
        assert!(error > 1e-3 && error < 0.02, "{error}");
        // (1 + 2 cos w)^2 = 9 / 2.
        let wanted = ((4.5f64.sqrt() - 1.0) / 2.0).acos();
        let (half, error) = half_power(&c.iter().map(|c| (*c, 0.01)).collect::<Vec<_>>()).unwrap();
        assert!(
            (half - wanted).abs() < 0.02 && error > 1e-3 && error < 0.05,
            "{half} {error}"
        );
        let smooth = Smooth {
            cosines: MOST,
            rounding: 0.02,
        };
        assert!(smooth.claims(&c));
        // White noise beside a slow process passes too much.
        assert!(!smooth.claims(&[0.5, 0.3, 0.2]));
        // What a notch at a quarter of the rate leaves is no low-pass.
        assert!(!smooth.claims(&[0.0, 2.0, 0.0, -0.3, 0.0, 0.1]));
        // Nor is what rises to the lowest frequencies.
        let walks: Vec<f64> = (1..=MOST)
            .map(|k| 1.8 * 0.95f64.powi(k as i32) / k as f64)
            .collect();
        assert!(!smooth.claims(&walks));
    }

    #[test]
    fn what_is_drawn_and_rounding_have_the_spectrum_together() {
        let c = of_mean(3, 0.02);
        let part = 0.02 / 1.02;
        let taps = taps(&c, part);
        let at = |lag: usize| -> f64 {
            let late = taps.iter().skip(lag);
            taps.iter().zip(late).map(|(a, b)| a * b).sum()
        };
        for (lag, wanted) in [(0, 1.0), (1, 2.0 / 3.0), (2, 1.0 / 3.0), (3, 0.0), (5, 0.0)] {
            assert!((at(lag) - wanted).abs() < 5e-3, "{lag}: {}", at(lag));
        }
    }

    #[test]
    fn its_slopes_are_those_of_its_density() {
        let (c, at) = (of_mean(4, 0.05)[..6].to_vec(), frequencies());
        let smooth = Smooth {
            cosines: 6,
            rounding: 0.0,
        };
        let slopes = smooth.slopes(&c, &at).unwrap();
        for (k, slope) in slopes.iter().enumerate() {
            let moved = |by: f64| {
                let mut c = c.clone();
                c[k] += by;
                smooth.density(&c, &at)
            };
            let (up, down) = (moved(1e-5), moved(-1e-5));
            for ((s, u), d) in slope.iter().zip(&up).zip(&down) {
                assert!((s - (u - d) / 2e-5).abs() < 1e-6);
            }
        }
    }
}
