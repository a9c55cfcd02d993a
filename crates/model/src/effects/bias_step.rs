//! The bias jumps once.

use crate::effect::{
    Docs, Effect, Example, Found, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    parameter, value,
};
use crate::parameter::Parameter;
use crate::simulate::Simulation;

/// The effect.
pub struct BiasStep;

/// Its id.
pub const ID: &str = "bias_step";

/// The one instance that the library lists.
pub static EFFECT: BiasStep = BiasStep;

impl Effect for BiasStep {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("time", "s", "time of the jump from the start"),
            parameter("height", "deg/s", "bias after minus before"),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Bias step",
            physics: "b(t) = height for t >= time: a knock that shifts the mount or the element, a latch-up, a charge that moves.",
            excitation: "Nothing.",
            test: "Likelihood ratio at all times at once, random walk refitted; largest one taken.",
            remedy: "Fasten mount and connectors and repeat the run; where the step comes again, let the filter estimate the bias anew after it.",
            figure: "Rate in time blocks with the two levels.",
            example: Example::new(
                Plot::RateInTime { block_s: 5.0 },
                &[("time", 240.0), ("height", 0.4)],
            ),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "rate_ramp",
                experiment: "a record ten times longer: a ramp goes on, a step stays",
            },
            Rival {
                cause: "telegraph",
                experiment: "a longer record: telegraph noise comes back",
            },
            Rival {
                cause: "temperature",
                experiment: "repeat the run: a step does not come back at the same temperature",
            },
            Rival {
                cause: "supply_sensitivity",
                experiment: "switch the load several times",
            },
            Rival {
                cause: "motor_bias",
                experiment: "switch the motor several times",
            },
            Rival {
                cause: "warm_up",
                experiment: "a second cold start",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.samples < 64 {
            return Err("fewer than 64 samples".into());
        }
        Ok(vec![Hypothesis::Step])
    }

    fn describe(&self, found: &Found) -> Parameters {
        let mut all = Parameters::new();
        if let (Some(height), Some(time)) = (found.coefficients.first(), found.location.first()) {
            all.insert(
                "height".into(),
                Parameter::estimated(height.0, height.1, &found.unit),
            );
            all.insert("time".into(), Parameter::estimated(time.0, time.1, "s"));
        }
        all
    }

    fn same_event(&self, a: &Parameters, b: &Parameters) -> bool {
        let (Some(a), Some(b)) = (a.get("time"), b.get("time")) else {
            return false;
        };
        let error = a.std_error.unwrap_or(0.0).hypot(b.std_error.unwrap_or(0.0));
        (a.value - b.value).abs() <= 3.0 * error + 0.1
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let (time, height) = (value(parameters, "time"), value(parameters, "height"));
        for &axis in channels {
            for (i, rate) in simulation.rate[axis].iter_mut().enumerate() {
                if i as f64 / simulation.rate_hz >= time {
                    *rate += height;
                }
            }
        }
    }
}
