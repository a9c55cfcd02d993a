//! Single samples far off.

use rand_distr::{Distribution, Uniform};

use crate::effect::{
    Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    optional, parameter, value,
};
use crate::simulate::Simulation;

/// The effect.
pub struct Outliers;

/// Its id.
pub const ID: &str = "outliers";

/// The one instance that the library lists.
pub static EFFECT: Outliers = Outliers;

impl Effect for Outliers {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("count", "1", "samples far off"),
            optional(
                "size",
                "deg/s",
                "root mean square of their distance from the truth; 10 white sigma where it is left out",
            ),
            optional(
                "upward",
                "1",
                "share of them that lie above the truth; to either side in turn where it is left out",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Outliers",
            physics: "Single samples that the noise cannot have made: a disturbed SPI word, a discharge, a knock.",
            excitation: "Nothing.",
            test: "Audit: distance of the whitened sample against the normal tail of the record length.",
            remedy: "Check wiring and signal levels of the data line, and let the filter reject innovations beyond 5 sigma.",
            figure: "The rate around each of them.",
            example: Example::new(Plot::Around, &[("count", 4.0)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "telegraph",
                experiment: "a longer record",
            },
            Rival {
                cause: "stuck_bit",
                experiment: "look at the counts: a stuck bit is off by one power of two",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, _view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        Ok(vec![Hypothesis::Audit])
    }

    fn stage(&self) -> Stage {
        Stage::Output
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let count = simulation.events(value(parameters, "count").round().max(0.0) as usize);
        let Ok(at) = Uniform::new(0, simulation.samples.max(1)) else {
            return;
        };
        for &axis in channels {
            let size = parameters
                .get("size")
                .map_or(10.0 * simulation.white_sigma[axis], |p| p.value);
            let upward = parameters.get("upward").map_or(0.5, |p| p.value);
            // Of the first k, the whole number next below k + 1/2 of that share.
            let above = |k: usize| (k as f64 * upward + 0.5).floor();
            for k in 0..count {
                let i = at.sample(&mut simulation.rng);
                let up = above(k + 1) > above(k);
                simulation.white[axis][i] += if up { size } else { -size };
            }
        }
    }
}
