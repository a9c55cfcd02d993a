//! Equivalent degrees of freedom of a deviation, and its chi-square interval.
//!
//! ```
//! use noise::allan::Deviation;
//! use noise::edf::{NoiseType, chi_square_interval, edf};
//!
//! // White noise, 1000 samples, clusters of 100.
//! let freedom = edf(Deviation::Oadev, NoiseType::WhiteRate, 100, &[1000]);
//! let (low, high) = chi_square_interval(1.0, freedom, 0.95);
//! assert!((12.0..16.0).contains(&freedom));
//! assert!(low < 1.0 && 1.0 < high);
//! ```

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::allan::{Deviation, allan_to};

/// Power-law noise by the exponent α of the one-sided spectral density of the rate, f^α.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseType {
    /// α = 2: quantization noise of an angle.
    WhitePhase,
    /// α = 1.
    FlickerPhase,
    /// α = 0: angle random walk.
    WhiteRate,
    /// α = −1: bias instability.
    FlickerRate,
    /// α = −2: rate random walk.
    RandomWalkRate,
}

impl NoiseType {
    /// α.
    #[must_use]
    pub fn alpha(self) -> i32 {
        match self {
            Self::WhitePhase => 2,
            Self::FlickerPhase => 1,
            Self::WhiteRate => 0,
            Self::FlickerRate => -1,
            Self::RandomWalkRate => -2,
        }
    }

    /// The type of the nearest exponent.
    #[must_use]
    pub fn nearest(alpha: f64) -> Self {
        match alpha.round() as i32 {
            2.. => Self::WhitePhase,
            1 => Self::FlickerPhase,
            0 => Self::WhiteRate,
            -1 => Self::FlickerRate,
            _ => Self::RandomWalkRate,
        }
    }
}

/// Strides within a cluster beyond which a finer stride adds nothing: the estimator is then as good as continuous.
const FINE_STRIDES: usize = 64;

/// What ThêoH's factor against the bias, itself an estimate, leaves of the freedom of Theo1: 0.52 and 0.35 (white rate, at
/// 0.3 and 0.6 of the record), 0.51 and 0.59 (flicker), 0.78 and 0.9 (walk) by the scatter over 200 records of 1000 samples.
const FACTOR_COST: f64 = 0.5;

/// Equivalent degrees of freedom of a deviation over runs of `run_samples` samples at the averaging factor `m`.
///
/// The estimator is a mean of squares of a stationary Gaussian process z, so edf = (Σ s(0))² / ΣΣ s(i − j)², with s the
/// covariance of z for the given power-law noise; pairs in different runs are taken as independent. Total deviations
/// have the published closed forms. At least 1 where there is any difference.
///
/// # Source
/// C. Greenhall, W. Riley, "Uncertainty of stability variances based on finite differences", PTTI 2003, the basic sum;
/// NIST SP 1065 (2008), tables 7 and 8 for the total and modified total deviations.
#[must_use]
pub fn edf(kind: Deviation, noise: NoiseType, m: usize, run_samples: &[usize]) -> f64 {
    let (order, modified, overlapping) = match kind {
        Deviation::Adev => (2, false, false),
        Deviation::Oadev => (2, false, true),
        Deviation::Mdev | Deviation::Tdev => (2, true, true),
        Deviation::Hdev => (3, false, false),
        Deviation::Ohdev => (3, false, true),
        Deviation::Totdev | Deviation::Mtotdev => return total_edf(kind, noise, m, run_samples),
        Deviation::Theo1 => return theo1_edf(noise, m, run_samples),
        Deviation::Theoh if m > allan_to(run_samples.iter().copied().max().unwrap_or(0)) => {
            return (FACTOR_COST * theo1_edf(noise, m, run_samples)).max(1.0);
        }
        Deviation::Theoh => (2, false, true),
    };
    let strides = match (overlapping, noise) {
        (false, _) => 1,
        // White phase is as rough as the samples: every stride counts.
        (true, NoiseType::WhitePhase) if !modified => m,
        (true, _) => m.min(FINE_STRIDES),
    };
    let covariance = covariance(noise, order, modified, m, strides);
    // Σᵢⱼ over M terms of a run: M s(0)² + 2 Σₗ (M − l) s(l)², summed over runs.
    let span = if modified {
        (order + 1) * m - 1
    } else {
        order * m
    };
    let mut terms = 0.0;
    let mut pairs = 0.0;
    for &n in run_samples {
        let Some(fine) = (n + 1).checked_sub(span).filter(|t| *t > 0) else {
            continue;
        };
        let count = (fine as f64 * strides as f64 / m as f64).max(1.0).ceil();
        terms += count;
        pairs += covariance
            .iter()
            .enumerate()
            .take_while(|(lag, _)| (*lag as f64) < count)
            .map(|(lag, s)| (count - lag as f64) * s * s * if lag == 0 { 1.0 } else { 2.0 })
            .sum::<f64>();
    }
    if terms == 0.0 {
        return 0.0;
    }
    (terms * terms * covariance[0] * covariance[0] / pairs).max(1.0)
}

/// Covariance of the differenced process at lags of τ/`strides`, up to the lag where the differences part.
fn covariance(
    noise: NoiseType,
    order: usize,
    modified: bool,
    m: usize,
    strides: usize,
) -> Vec<f64> {
    let alpha = noise.alpha();
    // Of a difference of white points with itself, shifted by 0, 1, 2, ... points.
    let binomial: &[f64] = if order == 2 {
        &[6.0, -4.0, 1.0]
    } else {
        &[20.0, -15.0, 6.0, -1.0]
    };
    if alpha == 2 && !modified {
        // White phase: only differences that share a point are correlated, at multiples of τ.
        return (0..=order * strides)
            .map(|lag| {
                if lag.is_multiple_of(strides) {
                    binomial[lag / strides]
                } else {
                    0.0
                }
            })
            .collect();
    }
    // F: the phase enters averaged over τ/F; not at all for the unmodified deviations, but α = 1 needs a bandwidth.
    let averaging = if modified {
        Some(1.0)
    } else if alpha <= 0 {
        None
    } else {
        Some(m as f64)
    };
    let x = |t: f64| -> f64 {
        match averaging {
            None => generalized(t, alpha + 2),
            Some(f) => {
                f * f
                    * (2.0 * generalized(t, alpha)
                        - generalized(t - 1.0 / f, alpha)
                        - generalized(t + 1.0 / f, alpha))
            }
        }
    };
    (0..(order + 1) * strides)
        .map(|lag| {
            let t = lag as f64 / strides as f64;
            binomial[0] * x(t)
                + binomial[1..]
                    .iter()
                    .enumerate()
                    .map(|(k, b)| {
                        let shift = (k + 1) as f64;
                        b * (x(t - shift) + x(t + shift))
                    })
                    .sum::<f64>()
        })
        .collect()
}

/// Generalized autocovariance of the phase averaged once, by the exponent α of the rate; up to a factor.
fn generalized(t: f64, alpha: i32) -> f64 {
    let a = t.abs();
    let log = if a > 0.0 { a.ln() } else { 0.0 };
    match alpha {
        4 => 0.0,
        3 => -log,
        2 => -a,
        1 => a * a * log,
        0 => a.powi(3),
        -1 => -a.powi(4) * log,
        _ => -a.powi(5),
    }
}

fn total_edf(kind: Deviation, noise: NoiseType, m: usize, run_samples: &[usize]) -> f64 {
    let (b, c) = match (kind, noise) {
        (Deviation::Totdev, NoiseType::FlickerRate) => (1.17, 0.22),
        (Deviation::Totdev, NoiseType::RandomWalkRate) => (0.93, 0.36),
        (Deviation::Totdev, _) => (1.50, 0.0),
        (_, NoiseType::WhitePhase) => (1.90, 2.10),
        (_, NoiseType::FlickerPhase) => (1.20, 1.40),
        (_, NoiseType::WhiteRate) => (1.10, 1.20),
        (_, NoiseType::FlickerRate) => (0.85, 0.50),
        (_, NoiseType::RandomWalkRate) => (0.75, 0.31),
    };
    run_samples
        .iter()
        .filter(|n| kind.longest(**n) >= m)
        .map(|n| (b * *n as f64 / m as f64 - c).max(1.0))
        .sum()
}

/// Degrees of freedom of Theo1 by the fitted forms of NIST SP 1065 (2008), table 12, with N phase points and r = 0.75 m.
fn theo1_edf(noise: NoiseType, m: usize, run_samples: &[usize]) -> f64 {
    run_samples
        .iter()
        .filter(|n| Deviation::Theo1.longest(**n) >= m)
        .map(|n| {
            let (n, r) = ((n + 1) as f64, 0.75 * m as f64);
            let edf = match noise {
                NoiseType::WhitePhase => {
                    0.86 * (n + 1.0) * (n - 4.0 / 3.0 * r) / (n - r) * (r / (r + 1.14))
                }
                NoiseType::FlickerPhase => {
                    (4.798 * n * n - 6.374 * n * r + 12.387 * r) / ((r + 36.6).sqrt() * (n - r))
                        * (r / (r + 0.3))
                }
                NoiseType::WhiteRate => {
                    ((4.1 * n + 0.8) / r - (3.1 * n + 6.5) / n)
                        * (r.powf(1.5) / (r.powf(1.5) + 5.2))
                }
                NoiseType::FlickerRate => {
                    (2.0 * n * n - 1.3 * n * r - 3.5 * r) / (n * r)
                        * (r.powi(3) / (r.powi(3) + 2.3))
                }
                NoiseType::RandomWalkRate => {
                    (4.4 * n - 2.0) / (2.9 * r)
                        * ((4.4 * n - 1.0).powi(2) - 8.6 * r * (4.4 * n - 1.0) + 11.4 * r * r)
                        / (4.4 * n - 3.0).powi(2)
                }
            };
            edf.max(1.0)
        })
        .sum()
}

/// Interval of a deviation with `edf` degrees of freedom: σ·√(edf/χ²) at the two tails of `1 − confidence`, in the unit of
/// `deviation`; 0 to infinity where `edf` is not positive.
#[must_use]
pub fn chi_square_interval(deviation: f64, edf: f64, confidence: f64) -> (f64, f64) {
    let Some(chi2) = ChiSquared::new(edf).ok().filter(|_| edf > 0.0) else {
        return (0.0, f64::INFINITY);
    };
    let tail = (1.0 - confidence) / 2.0;
    let at = |p: f64| deviation * (edf / chi2.inverse_cdf(p)).sqrt();
    (at(1.0 - tail), at(tail))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_rate_side_by_side_has_the_textbook_degrees_of_freedom() {
        // Differences of M + 1 independent means: correlation −1/2 of neighbours, edf = M²/(M + 2(M − 1)/4).
        let means = 101.0;
        let terms: f64 = means - 1.0;
        let expected = terms * terms / (terms + (terms - 1.0) / 2.0);
        let got = edf(Deviation::Adev, NoiseType::WhiteRate, 1, &[101]);
        assert!((got / expected - 1.0).abs() < 1e-9, "{got} {expected}");
    }

    #[test]
    fn white_rate_overlapped_agrees_with_the_closed_form_of_the_handbook() {
        // NIST SP 1065, table 5: (3(N−1)/(2m) − 2(N−2)/N) · 4m²/(4m² + 5) for N phase points.
        for (n, m) in [
            (12_001usize, 1usize),
            (12_001, 10),
            (12_001, 100),
            (12_001, 1000),
        ] {
            let (nf, mf) = (n as f64, m as f64);
            let expected = (1.5 * (nf - 1.0) / mf - 2.0 * (nf - 2.0) / nf) * 4.0 * mf * mf
                / (4.0 * mf * mf + 5.0);
            let got = edf(Deviation::Oadev, NoiseType::WhiteRate, m, &[n - 1]);
            assert!(
                (got / expected - 1.0).abs() < 0.06,
                "m = {m}: {got} {expected}"
            );
        }
    }

    #[test]
    fn white_phase_overlapped_agrees_with_the_closed_form_of_the_handbook() {
        // NIST SP 1065, table 5: (N + 1)(N − 2m)/(2(N − m)) for N phase points.
        let (n, m) = (12_001.0, 400.0);
        let expected = (n + 1.0) * (n - 2.0 * m) / (2.0 * (n - m));
        let got = edf(Deviation::Oadev, NoiseType::WhitePhase, 400, &[12_000]);
        assert!((got / expected - 1.0).abs() < 0.06, "{got} {expected}");
    }

    #[test]
    fn a_long_cluster_time_has_few_degrees_of_freedom_and_gaps_take_more() {
        // model-criticism: 600 s at 20 Hz, tau = 100 s: 4.4 (white) to 6.2.
        let whole = edf(Deviation::Oadev, NoiseType::RandomWalkRate, 2000, &[12_000]);
        assert!((3.0..7.0).contains(&whole), "{whole}");
        let cut = edf(
            Deviation::Oadev,
            NoiseType::RandomWalkRate,
            2000,
            &[6_000, 5_000],
        );
        assert!(cut < whole, "{cut} {whole}");
        assert_eq!(
            edf(
                Deviation::Oadev,
                NoiseType::WhiteRate,
                2000,
                &[3_000, 3_000]
            ),
            0.0
        );
    }

    #[test]
    fn ref_chi_square_interval() {
        // χ²(10): 2.5 % point 3.2470, 97.5 % point 20.4832.
        let (low, high) = chi_square_interval(1.0, 10.0, 0.95);
        assert!((low - (10.0f64 / 20.4832).sqrt()).abs() < 1e-5);
        assert!((high - (10.0f64 / 3.2470).sqrt()).abs() < 1e-4);
    }
}
