//! The bias runs away at a constant rate.

use crate::effect::{
    Column, Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Regression, Rival,
    Stage, View, parameter, value,
};
use crate::simulate::Simulation;

/// The effect.
pub struct RateRamp;

/// Its id.
pub const ID: &str = "rate_ramp";

/// The one instance that the library lists.
pub static EFFECT: RateRamp = RateRamp;

impl Effect for RateRamp {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[parameter(
            "slope",
            "deg/s^2",
            "change of the bias per second",
        )];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Rate ramp",
            physics: "b(t) = slope t, the R of IEEE Std 952: slow ageing, or a drift much longer than the record.",
            excitation: "Nothing but time; a longer record shows it better by the power 3/2.",
            test: "Least squares on time, random walk refitted.",
            remedy: "Let the part warm up and age before the run, and give the filter a bias with a slope, or null the bias more often.",
            figure: "Rate in time blocks with the straight line.",
            example: Example::new(Plot::RateInTime { block_s: 5.0 }, &[("slope", 1e-3)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "temperature",
                experiment: "a record ten times longer with a heater cycle: a ramp goes on, a temperature term follows the heater",
            },
            Rival {
                cause: "temperature_quadratic",
                experiment: "a record ten times longer with a heater cycle",
            },
            Rival {
                cause: "warm_up",
                experiment: "a record ten times longer: a ramp goes on, a warm-up ends",
            },
            Rival {
                cause: "bias_step",
                experiment: "a record ten times longer: a ramp goes on, a step stays",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        let values = (0..view.samples).map(|i| view.time(i)).collect();
        Ok(vec![Hypothesis::Regression(Regression {
            columns: vec![Column {
                parameter: "slope",
                values,
            }],
            fixed: vec![],
            follows: None,
        })])
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let slope = value(parameters, "slope");
        for &axis in channels {
            for (i, rate) in simulation.rate[axis].iter_mut().enumerate() {
                *rate += slope * i as f64 / simulation.rate_hz;
            }
        }
    }
}
