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

/// The one instance that the library lists.
pub static EFFECT: Flicker = Flicker;

impl Effect for Flicker {
    fn id(&self) -> &'static str {
        "flicker"
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
            figure: "Spectrum of the rate with the model before and after: a slope of -1.",
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
        // A sum of Gauss-Markov processes, one per e-fold of the correlation time: int S(tau) d ln tau of
        // 2 s^2 tau / (1 + (w tau)^2) = pi s^2 / w, and the density per sample is B^2 / w. The sum swings about that by
        // 2 / cosh(pi^2), 2e-4 (Poisson's sum over sech(ln w tau)).
        let shortest: f64 = 0.05;
        let longest = simulation.span as f64 * 30.0;
        let count = (longest / shortest).ln().ceil() as usize;
        let sigma = b / std::f64::consts::PI.sqrt();
        for &axis in channels {
            for j in 0..count {
                simulation.add_markov(axis, sigma, shortest * (j as f64).exp());
            }
        }
    }
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

    fn bounds(&self, _samples: usize) -> Vec<(f64, f64)> {
        vec![(-18.0, 6.0)]
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        vec![vec![-4.5], vec![-8.0]]
    }
}
