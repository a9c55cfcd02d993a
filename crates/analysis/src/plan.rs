//! How long to record: what a run of a given length would tell, from the Fisher information of the present model.

use std::f64::consts::PI;

use crate::error::AnalysisError;
use crate::noise_fit::Term;

/// What is known of the noise, in IEEE Std 952 letters and one unit U. A term that is 0 is absent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KnownNoise {
    /// N, U·√s.
    pub angle_random_walk_n: f64,
    /// B, U.
    pub bias_instability_b: f64,
    /// K, U/√s.
    pub rate_random_walk_k: f64,
}

/// Relative standard errors that a record would reach; `None` for an absent term.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// Of N.
    pub n: Option<f64>,
    /// Of B.
    pub b: Option<f64>,
    /// Of K.
    pub k: Option<f64>,
}

/// Relative standard errors of N, B and K from a record of `seconds` at `rate_hz`: the Cramér-Rao bound of the exact
/// likelihood in the DCT-II domain.
#[must_use]
pub fn expected(noise: &KnownNoise, rate_hz: f64, seconds: f64) -> Expected {
    let tau0 = 1.0 / rate_hz;
    let samples = (seconds * rate_hz).max(2.0);
    let c = [
        Term::White.coefficient(noise.angle_random_walk_n, tau0),
        Term::Flicker.coefficient(noise.bias_instability_b, tau0),
        Term::RandomWalk.coefficient(noise.rate_random_walk_k, tau0),
    ];
    let mut fisher = [[0.0f64; 3]; 3];
    // Coefficients one by one at low frequency, then 1 % of them at a time.
    let mut k = 1.0;
    while k < samples {
        let count = (0.01 * k).floor().max(1.0).min(samples - k);
        let w = PI * (k + (count - 1.0) / 2.0) / samples;
        let shape = [1.0, 1.0 / w, 1.0 / (2.0 - 2.0 * w.cos())];
        // In parts of the variance: d ln v / d ln c.
        let v: f64 = shape.iter().zip(c).map(|(s, c)| s * c).sum();
        let part: [f64; 3] = std::array::from_fn(|i| shape[i] * c[i] / v);
        for i in 0..3 {
            for j in 0..3 {
                fisher[i][j] += 0.5 * count * part[i] * part[j];
            }
        }
        k += count;
    }
    let present: Vec<usize> = (0..3).filter(|i| c[*i] > 0.0).collect();
    let variance = |wanted: usize| -> Option<f64> {
        let p = present.iter().position(|i| *i == wanted)?;
        // Schur complement by elimination of the others.
        let mut a: Vec<Vec<f64>> = present
            .iter()
            .map(|i| present.iter().map(|j| fisher[*i][*j]).collect())
            .collect();
        for q in (0..present.len()).filter(|q| *q != p) {
            let pivot = a[q].clone();
            for (row, line) in a.iter_mut().enumerate() {
                if row != q {
                    let f = line[q] / pivot[q];
                    line.iter_mut().zip(&pivot).for_each(|(x, y)| *x -= f * y);
                }
            }
        }
        Some(1.0 / a[p][p])
    };
    // A letter is the root of its coefficient: half the relative error.
    let relative = |i: usize| variance(i).map(|v| 0.5 * v.sqrt());
    Expected {
        n: relative(0),
        b: relative(1),
        k: relative(2),
    }
}

/// Shortest record, s, from which `term` has a relative standard error of `relative`.
///
/// # Errors
/// [`AnalysisError::BadOption`] when `relative` is not in 0.001..1 or the term is absent from `noise` (nothing can say
/// how long an unknown size takes), [`AnalysisError::Inconclusive`] when 1000 days are not enough.
pub fn seconds_for(
    noise: &KnownNoise,
    rate_hz: f64,
    term: Term,
    relative: f64,
) -> Result<f64, AnalysisError> {
    if !(0.001..1.0).contains(&relative) {
        return Err(AnalysisError::BadOption {
            option: "--want",
            found: format!("{} %", 100.0 * relative),
            expected: "between 0.1 % and 100 %".into(),
        });
    }
    if !(rate_hz.is_finite() && rate_hz > 0.0) {
        return Err(AnalysisError::BadOption {
            option: "--rate",
            found: rate_hz.to_string(),
            expected: "a positive number of samples per second".into(),
        });
    }
    let reached = |seconds: f64| {
        let e = expected(noise, rate_hz, seconds);
        match term {
            Term::White => e.n,
            Term::Flicker => e.b,
            Term::RandomWalk => e.k,
            Term::Quantization => None,
        }
    };
    let longest = 1000.0 * 86_400.0;
    let mut high = 16.0 / rate_hz;
    loop {
        match reached(high) {
            None => {
                return Err(AnalysisError::BadOption {
                    option: "--want",
                    found: format!("{term:?}"),
                    expected: "a term that the model has with a size of its own".into(),
                });
            }
            Some(e) if e <= relative => break,
            Some(_) if high > longest => {
                return Err(AnalysisError::Inconclusive {
                    what: format!("{term:?} within {} %", 100.0 * relative),
                    have: longest,
                    need: f64::INFINITY,
                    unit: "s",
                });
            }
            Some(_) => high *= 2.0,
        }
    }
    let mut low = high / 2.0;
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if reached(middle).is_some_and(|e| e <= relative) {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok(high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise_fit::{Spectrum, fit};
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn white_noise_alone_takes_one_over_two_e_squared_samples() {
        let noise = KnownNoise {
            angle_random_walk_n: 0.1,
            ..KnownNoise::default()
        };
        let seconds = seconds_for(&noise, 20.0, Term::White, 0.01).unwrap();
        assert!((seconds * 20.0 / 5001.0 - 1.0).abs() < 0.001, "{seconds}");
        assert!(seconds_for(&noise, 20.0, Term::RandomWalk, 0.2).is_err());
    }

    #[test]
    fn a_record_as_long_as_planned_pins_k_as_promised() {
        let noise = KnownNoise {
            angle_random_walk_n: 0.05,
            rate_random_walk_k: 0.02,
            ..KnownNoise::default()
        };
        let (rate, wanted) = (20.0, 0.15);
        let seconds = seconds_for(&noise, rate, Term::RandomWalk, wanted).unwrap();
        let n = (seconds * rate).round() as usize;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(77);
        let mut gauss = || -> f64 { StandardNormal.sample(&mut rng) };
        let runs = 200;
        let logs: Vec<f64> = (0..runs)
            .map(|_| {
                let mut bias = 0.0;
                let y: Vec<f64> = (0..n)
                    .map(|_| {
                        bias += noise.rate_random_walk_k / rate.sqrt() * gauss();
                        bias + noise.angle_random_walk_n * rate.sqrt() * gauss()
                    })
                    .collect();
                let found = fit(&Spectrum::of(&y, std::slice::from_ref(&(0..n)), 1.0 / rate));
                found.term(Term::RandomWalk).value.unwrap().ln()
            })
            .collect();
        let mean = logs.iter().sum::<f64>() / f64::from(runs);
        let sd =
            (logs.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / f64::from(runs - 1)).sqrt();
        // Spread of a standard deviation over 200 runs: 5 %; four of them, and a few per cent that the bound lacks.
        assert!(
            (0.8..1.3).contains(&(sd / wanted)),
            "{sd} {wanted} over {seconds} s"
        );
    }
}
