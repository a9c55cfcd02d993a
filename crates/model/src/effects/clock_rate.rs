//! The board clock is off.

use crate::effect::{
    Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    parameter, value,
};
use crate::simulate::Simulation;

/// The effect.
pub struct ClockRate;

/// Its id.
pub const ID: &str = "clock_rate";

/// The one instance that the library lists.
pub static EFFECT: ClockRate = ClockRate;

impl Effect for ClockRate {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[parameter(
            "ppm",
            "ppm",
            "device clock fast against the host, parts per million",
        )];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Clock rate",
            physics: "The device clock runs fast or slow beyond its stated tolerance: a wrong crystal, an RC oscillator, a wrong divider.",
            excitation: "Device and host times.",
            test: "Audit: slope of host time against device time, against the stated tolerance.",
            remedy: "Measure the clock against a reference and write the true tick into the configuration, or fit a better crystal.",
            figure: "Host time minus device time.",
            example: Example::new(Plot::HostTime, &[("ppm", 800.0)]).on_all(),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[Rival {
            cause: "dropped_samples",
            experiment: "the sequence numbers",
        }];
        RIVALS
    }

    fn hypotheses(&self, _view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        Ok(vec![Hypothesis::Audit])
    }

    fn stage(&self) -> Stage {
        Stage::Frames
    }

    fn simulate(&self, parameters: &Parameters, _channels: &[usize], simulation: &mut Simulation) {
        let stretch = 1.0 / (1.0 + value(parameters, "ppm") * 1e-6);
        for t in &mut simulation.host_time {
            *t *= stretch;
        }
    }
}
