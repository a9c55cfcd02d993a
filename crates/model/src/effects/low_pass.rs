//! A filter makes neighbouring samples alike.

use std::sync::Arc;

use crate::effect::{
    Covariance, Docs, Effect, Example, Found, Frequencies, Hypothesis, ParameterSpec, Parameters,
    Plot, Rival, Stage, View, parameter, value,
};
use crate::parameter::Parameter;
use crate::simulate::Simulation;

/// The effect.
pub struct LowPass;

/// The one instance that the library lists.
pub static EFFECT: LowPass = LowPass;

impl Effect for LowPass {
    fn id(&self) -> &'static str {
        "low_pass"
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[parameter(
            "lag1_correlation",
            "1",
            "correlation of neighbouring samples of the white part",
        )];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Low-pass filter",
            physics: "The white noise has passed a filter whose memory reaches over a sample: the Bartlett filter of the ADIS16250 with many taps, or a pole of the read-out.",
            excitation: "Nothing.",
            test: "White noise shaped by one pole or by a triangular window, one width each, refitted by maximum likelihood.",
            figure: "Spectrum of the rate with the model before and after: it falls towards half the sample rate.",
            example: Example::new(Plot::Spectrum, &[("lag1_correlation", 0.5)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "gauss_markov",
                experiment: "change the filter taps",
            },
            Rival {
                cause: "flicker",
                experiment: "change the filter taps",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.samples < 256 {
            return Err("fewer than 256 samples".into());
        }
        Ok(vec![
            Hypothesis::Covariance(Arc::new(Pole)),
            Hypothesis::Covariance(Arc::new(Triangle)),
        ])
    }

    fn describe(&self, found: &Found) -> Parameters {
        let Some(&(theta, error)) = found.coefficients.first() else {
            return Parameters::new();
        };
        let rho = logistic(theta);
        [(
            "lag1_correlation".to_owned(),
            Parameter::estimated(rho, error * rho * (1.0 - rho), "1"),
        )]
        .into()
    }

    fn stage(&self) -> Stage {
        Stage::Output
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        // Two-point average with weights 1 : w has the lag-1 correlation w / (1 + w^2) <= 1/2; beyond it, one pole.
        let rho = value(parameters, "lag1_correlation").clamp(0.0, 0.999);
        for &axis in channels {
            let noise = &mut simulation.white[axis];
            if rho <= 0.3 {
                let w = if rho > 0.0 {
                    (1.0 - (1.0 - 4.0 * rho * rho).sqrt()) / (2.0 * rho)
                } else {
                    0.0
                };
                let norm = (1.0 + w * w).sqrt();
                let mut before = noise.first().copied().unwrap_or(0.0);
                for v in noise.iter_mut() {
                    let now = *v;
                    *v = (now + w * before) / norm;
                    before = now;
                }
            } else {
                let step = (1.0 - rho * rho).sqrt();
                let mut x = noise.first().copied().unwrap_or(0.0);
                for v in noise.iter_mut().skip(1) {
                    x = rho * x + step * *v;
                    *v = x;
                }
            }
        }
    }
}

fn logistic(theta: f64) -> f64 {
    1.0 / (1.0 + (-theta).exp())
}

/// One pole: correlation r^|lag|. Coordinate: logit r.
struct Pole;

impl Covariance for Pole {
    fn dimensions(&self) -> usize {
        1
    }

    fn filters_white(&self) -> bool {
        true
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        at.one_pole(1.0, logistic(theta[0]))
    }

    fn bounds(&self, _samples: usize) -> Vec<(f64, f64)> {
        vec![(-7.0, 3.0)]
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        vec![vec![-3.0], vec![0.0]]
    }
}

/// Triangular window (the data sheet's Bartlett filter). Coordinate: logit of the lag-1 correlation.
struct Triangle;

/// Autocorrelation of a triangular window at `u` half-bases: the cubic B-spline, 1 at 0 and 0 from 2 on.
fn spline(u: f64) -> f64 {
    if u < 1.0 {
        1.0 - 1.5 * u * u + 0.75 * u * u * u
    } else if u < 2.0 {
        (2.0 - u).powi(3) / 4.0
    } else {
        0.0
    }
}

/// `u` at which the spline has the value `r`.
fn inverse_spline(r: f64) -> f64 {
    let (mut low, mut high) = (0.0, 2.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if spline(middle) > r {
            low = middle
        } else {
            high = middle
        }
    }
    0.5 * (low + high)
}

impl Covariance for Triangle {
    fn dimensions(&self) -> usize {
        1
    }

    fn filters_white(&self) -> bool {
        true
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        let unit = inverse_spline(logistic(theta[0]));
        let taps: Vec<f64> = (1..)
            .map(|l| spline(f64::from(l) * unit))
            .take_while(|r| *r > 0.0)
            .collect();
        at.cosine
            .iter()
            .map(|c| {
                // Sum of taps times cosines of multiples of the frequency, by Clenshaw's recurrence.
                let (first, second) = taps
                    .iter()
                    .rev()
                    .fold((0.0, 0.0), |(b, next), r| (r + 2.0 * c * b - next, b));
                let tail = 2.0 * (c * first - second);
                // Quantization and the electronics behind the filter keep the density off zero.
                (1.0 + tail).max(0.0) + 2e-3
            })
            .collect()
    }

    fn bounds(&self, _samples: usize) -> Vec<(f64, f64)> {
        vec![(-7.0, 3.0)]
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        vec![vec![-3.0], vec![0.0]]
    }
}
