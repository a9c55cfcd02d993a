//! A bias that wanders and comes back.

use std::sync::Arc;

use crate::effect::{
    Covariance, Docs, Effect, Example, Found, Frequencies, Hypothesis, ParameterSpec, Parameters,
    Plot, Rival, Stage, View, parameter, value,
};
use crate::parameter::Parameter;
use crate::simulate::Simulation;

/// The effect.
pub struct GaussMarkov;

/// Its id.
pub const ID: &str = "gauss_markov";

/// The one instance that the library lists.
pub static EFFECT: GaussMarkov = GaussMarkov;

impl Effect for GaussMarkov {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("sigma", "deg/s", "standard deviation"),
            parameter(
                "correlation_time",
                "s",
                "time in which the correlation falls to 1/e",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Gauss-Markov bias",
            physics: "First-order Gauss-Markov process: autocorrelation sigma^2 exp(-|t| / correlation_time); loops in the electronics, air currents, slow modes.",
            excitation: "Nothing; several correlation times.",
            test: "White variance, random walk, sigma and correlation time refitted by maximum likelihood.",
            remedy: "Add a first-order Gauss-Markov bias state with this sigma and correlation time to the filter, in place of a larger random walk.",
            figure: "Spectrum of the rate with the model before and after: a shoulder.",
            example: Example::new(Plot::Spectrum, &[("sigma", 0.2), ("correlation_time", 2.0)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "flicker",
                experiment: "a longer record: flicker goes on rising to lower frequencies",
            },
            Rival {
                cause: "low_pass",
                experiment: "change the filter taps",
            },
            Rival {
                cause: "telegraph",
                experiment: "a longer record: look at the histogram for two levels",
            },
            Rival {
                cause: "bias_step",
                experiment: "a longer record",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.samples < 256 {
            return Err("fewer than 256 samples".into());
        }
        Ok(vec![Hypothesis::Covariance(Arc::new(Process))])
    }

    /// Without white noise beside it, it is white noise through a filter of one pole.
    fn ends_in(&self) -> Option<&'static str> {
        Some(super::low_pass::ID)
    }

    fn describe(&self, found: &Found) -> Parameters {
        let [(a, a_error), (t, t_error), ..] = found.coefficients[..] else {
            return Parameters::new();
        };
        let sigma = found.white_sigma * (a / 2.0).exp();
        let tau = t.exp() / found.rate_hz;
        [
            (
                "sigma".to_owned(),
                Parameter::estimated(sigma, sigma * a_error / 2.0, &found.unit),
            ),
            (
                "correlation_time".to_owned(),
                Parameter::estimated(tau, tau * t_error, "s"),
            ),
        ]
        .into()
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let (sigma, tau) = (
            value(parameters, "sigma"),
            value(parameters, "correlation_time"),
        );
        for &axis in channels {
            simulation.add_markov(axis, sigma, tau * simulation.rate_hz);
        }
    }
}

/// Coordinates: ln(sigma^2 / white variance), ln(correlation time in samples).
struct Process;

impl Covariance for Process {
    fn dimensions(&self) -> usize {
        2
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        at.one_pole(theta[0].exp(), (-(-theta[1]).exp()).exp())
    }

    fn poles(&self, theta: &[f64], _samples: usize) -> Option<Vec<(f64, f64)>> {
        Some(vec![(theta[0].exp(), (-(-theta[1]).exp()).exp())])
    }

    fn bounds(&self, samples: usize) -> Vec<(f64, f64)> {
        // At half the sample rate it is up to a hundred times as loud as the white noise, however long its correlation time: there
        // its density is the variance over twice that time.
        let longest = samples as f64 / 10.0;
        vec![(-16.0, (200.0 * longest).ln()), (0.0, longest.ln())]
    }

    fn starts(&self, samples: usize) -> Vec<Vec<f64>> {
        let longest = samples as f64 / 60.0;
        [1.5, 6.0, 25.0, 100.0]
            .iter()
            .filter(|t| **t < longest.max(2.0))
            .map(|t: &f64| vec![-3.0 - 0.5 * t.ln(), t.ln()])
            .collect()
    }
}
