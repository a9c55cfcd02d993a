//! Flicker noise: the bias instability of IEEE Std 952.

use std::sync::Arc;

use crate::effect::{
    Covariance, Docs, Effect, Example, Found, Frequencies, Hypothesis, ParameterSpec, Parameters,
    Plot, Rival, Stage, View, parameter, value,
};
use crate::parameter::Parameter;
use crate::simulate::Simulation;

/// The effect.
pub struct Flicker;

/// Its id.
pub const ID: &str = "flicker";

/// The one instance that the library lists.
pub static EFFECT: Flicker = Flicker;

impl Effect for Flicker {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[parameter(
            "bias_instability",
            "deg/h",
            "B of IEEE Std 952; the flat part of the Allan curve lies at 0.664 B",
        )];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Flicker noise",
            physics: "Two-sided spectral density B^2 / (2 pi f): charge traps in the read-out electronics.",
            excitation: "Nothing; the longer the record, the clearer.",
            test: "White variance, random walk and B refitted by maximum likelihood.",
            remedy: "Give the simulation flicker noise of this B and the filter a bias state with several time constants; averaging longer does not help.",
            figure: "Spectrum of the rate with the model before and after: a density that falls with the root of the frequency, its square as 1/f.",
            example: Example::new(Plot::Spectrum, &[("bias_instability", 300.0)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "gauss_markov",
                experiment: "a longer record: flicker goes on rising to lower frequencies",
            },
            Rival {
                cause: "telegraph",
                experiment: "a longer record: look at the histogram for two levels",
            },
            Rival {
                cause: "low_pass",
                experiment: "change the filter taps",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.samples < 256 {
            return Err("fewer than 256 samples".into());
        }
        Ok(vec![Hypothesis::Covariance(Arc::new(Pink))])
    }

    fn describe(&self, found: &Found) -> Parameters {
        let Some((kb, error)) = found.coefficients.first() else {
            return Parameters::new();
        };
        let b = found.white_sigma * (kb / 2.0).exp();
        let (b, unit) = if found.unit == "deg/s" {
            (b * 3600.0, "deg/h")
        } else {
            (b, found.unit.as_str())
        };
        [(
            "bias_instability".to_owned(),
            Parameter::estimated(b, b * error / 2.0, unit),
        )]
        .into()
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let b = value(parameters, "bias_instability") / 3600.0;
        for &axis in channels {
            for (variance, samples) in ladder(simulation.span, 1.0) {
                simulation.add_markov(axis, b * variance.sqrt(), samples);
            }
        }
    }
}

/// Gauss-Markov processes with correlation times `apart` in their logarithm that sum up to flicker noise of B = 1: variances
/// and correlation times in samples. int S(tau) d ln tau of 2 s^2 tau / (1 + (w tau)^2) = pi s^2 / w, and the density per sample is B^2 / w; the ripple
/// is 1 / cosh(pi^2 / apart).
fn ladder(samples: usize, apart: f64) -> Vec<(f64, f64)> {
    // Sampled, the fastest ones are white: from this correlation time on, in samples, they sum up to 1 / w at half the sample rate.
    let (shortest, longest) = (0.45, samples as f64 * 30.0);
    let count = ((longest / shortest).ln() / apart).ceil().max(1.0) as usize;
    let tau = |j: usize| shortest * ((j as f64 + 0.5) * apart).exp();
    (0..count)
        .map(|j| (apart / std::f64::consts::PI, tau(j)))
        .collect()
}

/// Coordinate: ln(B^2 / white variance).
struct Pink;

impl Covariance for Pink {
    fn dimensions(&self) -> usize {
        1
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        at.omega.iter().map(|w| theta[0].exp() / w).collect()
    }

    fn poles(&self, theta: &[f64], samples: usize) -> Option<Vec<(f64, f64)>> {
        let all = ladder(samples, 2.0).into_iter();
        Some(
            all.map(|(variance, p)| (theta[0].exp() * variance, (-1.0 / p).exp()))
                .collect(),
        )
    }

    fn bounds(&self, _samples: usize) -> Vec<(f64, f64)> {
        vec![(-18.0, 6.0)]
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        vec![vec![-4.5], vec![-8.0]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ladder_has_the_density_of_flicker() {
        let omega = [1e-3, 1e-2, 0.1, 0.5, std::f64::consts::PI];
        let at = Frequencies::at(omega.to_vec());
        let wanted = Pink.density(&[0.0], &at);
        for apart in [1.0, 2.0] {
            let all = ladder(12_000, apart)
                .into_iter()
                .map(|(v, p)| at.one_pole(v, (-1.0f64 / p).exp()));
            let sum = all.fold(vec![0.0; omega.len()], |sum, d| {
                sum.iter().zip(d).map(|(a, b)| a + b).collect()
            });
            for (found, wanted) in sum.iter().zip(&wanted) {
                assert!(
                    (found / wanted - 1.0).abs() < 0.1,
                    "{apart}: {sum:?} {wanted:?}"
                );
            }
        }
    }
}
