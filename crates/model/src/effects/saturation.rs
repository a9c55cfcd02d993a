//! Readings end at a rail.

use crate::effect::{
    Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    optional,
};
use crate::simulate::Simulation;

/// The effect.
pub struct Saturation;

/// Its id.
pub const ID: &str = "saturation";

/// The one instance that the library lists.
pub static EFFECT: Saturation = Saturation;

impl Effect for Saturation {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            optional("low", "counts", "lowest reading"),
            optional("high", "counts", "highest reading"),
            optional("clipped", "1", "samples at a rail"),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Saturation",
            physics: "Readings beyond a limit are given as the limit: the range of the converter or of the register was chosen too small.",
            excitation: "Rates that reach the limit.",
            test: "Audit: the tail that should lie beyond the extreme readings, and does not.",
            remedy: "Choose a larger range, or excite the stand less; clipped readings have to be left out of any integration.",
            figure: "Histogram of the counts with the normal curve.",
            example: Example::new(Plot::Histogram, &[("high", 8.0)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[Rival {
            cause: "outliers",
            experiment: "a larger range",
        }];
        RIVALS
    }

    fn hypotheses(&self, _view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        Ok(vec![Hypothesis::Audit])
    }

    fn stage(&self) -> Stage {
        Stage::Counts
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let limit = |name: &str| parameters.get(name).map(|p| p.value.round() as i32);
        let (low, high) = (
            limit("low").unwrap_or(i32::MIN),
            limit("high").unwrap_or(i32::MAX),
        );
        for &axis in channels {
            for c in &mut simulation.counts[axis] {
                *c = (*c).clamp(low.min(high), high);
            }
        }
    }
}
