//! One bit is stuck.

use rand_distr::{Bernoulli, Distribution};

use crate::effect::{
    Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    parameter, value,
};
use crate::simulate::Simulation;

/// The effect.
pub struct StuckBit;

/// Its id.
pub const ID: &str = "stuck_bit";

/// The one instance that the library lists.
pub static EFFECT: StuckBit = StuckBit;

impl Effect for StuckBit {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("bit", "1", "number of the bit, 0 the lowest"),
            parameter("value", "1", "0 or 1"),
            parameter("fraction", "1", "share of the samples in which it sticks"),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Stuck bit",
            physics: "One bit of the word is always, or too often, 0 or 1: a weak line, a solder joint, a marginal set-up time.",
            excitation: "Nothing.",
            test: "Audit: share of ones in each low bit against the share that the noise makes.",
            remedy: "Check solder joint, series resistor and clock rate of the data line, and replace the part where the bit stays.",
            figure: "Share of ones by bit.",
            example: Example::new(
                Plot::Bits,
                &[("bit", 2.0), ("value", 1.0), ("fraction", 0.6)],
            ),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "coarse_lsb",
                experiment: "look at the counts: one bit or all below it",
            },
            Rival {
                cause: "outliers",
                experiment: "look at the counts: a stuck bit is off by one power of two",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, _view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        Ok(vec![Hypothesis::Audit])
    }

    fn stage(&self) -> Stage {
        Stage::Counts
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let bit = value(parameters, "bit").round().clamp(0.0, 13.0) as u32;
        let one = value(parameters, "value") != 0.0;
        let Ok(sticks) = Bernoulli::new(value(parameters, "fraction").clamp(0.0, 1.0)) else {
            return;
        };
        for &axis in channels {
            for i in 0..simulation.samples {
                if sticks.sample(&mut simulation.rng) {
                    let c = &mut simulation.counts[axis][i];
                    *c = if one {
                        *c | (1 << bit)
                    } else {
                        *c & !(1 << bit)
                    };
                }
            }
        }
    }
}
