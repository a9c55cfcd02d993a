//! Low bits are missing.

use crate::effect::{
    Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    parameter, value,
};
use crate::simulate::Simulation;

/// The effect.
pub struct CoarseLsb;

/// Its id.
pub const ID: &str = "coarse_lsb";

/// The one instance that the library lists.
pub static EFFECT: CoarseLsb = CoarseLsb;

impl Effect for CoarseLsb {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] =
            &[parameter("missing_bits", "1", "low bits that are always 0")];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Coarse quantisation",
            physics: "The lowest bits are always zero: a wrong shift, a format with fewer bits.",
            excitation: "Nothing.",
            test: "Audit: share of ones in the low bits against the share that the noise makes.",
            remedy: "Correct the shift or the data format in the reading code; if the part has no more bits, give the simulation the larger step.",
            figure: "Share of ones by bit.",
            example: Example::new(Plot::Bits, &[("missing_bits", 2.0)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[Rival {
            cause: "stuck_bit",
            experiment: "look at the counts: one bit or all below it",
        }];
        RIVALS
    }

    fn hypotheses(&self, _view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        Ok(vec![Hypothesis::Audit])
    }

    fn coarsens(&self, parameters: &Parameters) -> f64 {
        f64::from(1u32 << missing(parameters))
    }

    fn stage(&self) -> Stage {
        Stage::Counts
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let bits = missing(parameters);
        for &axis in channels {
            for c in &mut simulation.counts[axis] {
                *c = (*c >> bits) << bits;
            }
        }
    }
}

fn missing(parameters: &Parameters) -> u32 {
    value(parameters, "missing_bits").round().clamp(0.0, 13.0) as u32
}
