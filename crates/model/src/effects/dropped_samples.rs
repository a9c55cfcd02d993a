//! Frames are missing.

use rand_distr::{Distribution, Uniform};

use crate::effect::{
    Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    parameter, value,
};
use crate::simulate::Simulation;

/// The effect.
pub struct DroppedSamples;

/// Its id.
pub const ID: &str = "dropped_samples";

/// The one instance that the library lists.
pub static EFFECT: DroppedSamples = DroppedSamples;

impl Effect for DroppedSamples {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[parameter("count", "1", "frames lost")];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Dropped samples",
            physics: "Frames are lost between the board and the file: a line error, a full buffer, a slow host.",
            excitation: "Nothing.",
            test: "Audit: gaps of the sequence numbers, and time that passes without a number.",
            remedy: "Lower the rate or raise the speed of the line, enlarge the buffer, and let the filter step by the time stamps.",
            figure: "Gaps over time.",
            example: Example::new(Plot::Gaps, &[("count", 30.0)]).on_all(),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "stale_samples",
                experiment: "the new-data flags",
            },
            Rival {
                cause: "clock_rate",
                experiment: "the sequence numbers",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, _view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        Ok(vec![Hypothesis::Audit])
    }

    fn stage(&self) -> Stage {
        Stage::Frames
    }

    fn simulate(&self, parameters: &Parameters, _channels: &[usize], simulation: &mut Simulation) {
        let count = value(parameters, "count").round().max(0.0) as usize;
        let Ok(at) = Uniform::new(1, simulation.samples.max(2)) else {
            return;
        };
        for _ in 0..count {
            let i = at.sample(&mut simulation.rng).min(simulation.samples - 1);
            simulation.keep[i] = false;
        }
    }
}
