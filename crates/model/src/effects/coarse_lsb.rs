//! Low bits are missing.

use crate::effect::{
    Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View, detail,
    optional, parameter, value,
};
use crate::range;
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
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("missing_bits", "1", "low bits that are always 0"),
            optional(
                "step_counts",
                "1",
                "counts from one reading to the next: 2^missing_bits where it is not given",
            ),
            detail("step_size", "deg/s", "the same in the unit of the readings"),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Coarse quantisation",
            physics: "The lowest bits are always zero, or all counts are multiples of a few: a wrong shift, a format with fewer bits, a scale that the part does not fill.",
            excitation: "Nothing.",
            test: "Audit: whether all changes are multiples of some counts. It needs to know what a count is: the part's own counts, a scale that the file or `--units` states, or a gyro of the same record and unit with a step 2^k times finer.",
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
        f64::from(step(parameters))
    }

    fn stage(&self) -> Stage {
        Stage::Counts
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let step = step(parameters);
        for &axis in channels {
            for c in &mut simulation.counts[axis] {
                *c = c.div_euclid(step) * step;
            }
        }
    }
}

/// Counts from one reading to the next.
#[must_use]
pub fn step(parameters: &Parameters) -> i32 {
    let given = value(parameters, "step_counts").round();
    let of_bits = value(parameters, "missing_bits").round().exp2();
    (if given >= 1.0 { given } else { of_bits }).clamp(1.0, range::MOST_COUNTS) as i32
}
