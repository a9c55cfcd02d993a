//! The gyro feels the rotation about another axis.

use crate::effect::{
    Column, Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Regression, Rival,
    Stage, View, optional, value,
};
use crate::record::Quantity;
use crate::simulate::Simulation;

/// The effect.
pub struct CrossAxis;

/// Its id.
pub const ID: &str = "cross_axis";

/// The one instance that the library lists.
pub static EFFECT: CrossAxis = CrossAxis;

impl Effect for CrossAxis {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            optional(
                "from_gyro_x",
                "1",
                "share of what gyro x reads of the motion",
            ),
            optional(
                "from_gyro_y",
                "1",
                "share of what gyro y reads of the motion",
            ),
            optional(
                "from_gyro_z",
                "1",
                "share of what gyro z reads of the motion",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Cross-axis sensitivity",
            physics: "b(t) = sum of shares x rates about the other axes, as their gyros read them: misaligned mounting, coupled modes of the element. Where such a gyro has a scale error too, its reading is (1 + relative) x the true rate, and the share of the true rate is (1 + relative) x the one told here.",
            excitation: "Rotation about another axis, while this one is at rest.",
            test: "Least squares on the other gyros that turn, random walk refitted.",
            remedy: "Calibrate the alignment on a rate table and multiply the three rates by the inverse of the measured matrix.",
            figure: "Rate in blocks of the other rate against that rate.",
            example: Example::new(Plot::RateByValue("gyro_z"), &[("from_gyro_z", 0.03)])
                .in_a_world(&[("turn_dps", 20.0)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "base_motion",
                experiment: "a rate table with a stiff axis",
            },
            Rival {
                cause: "g_sensitivity",
                experiment: "a six-position test at rest",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        let sources: Vec<_> = view
            .all(Quantity::Gyro)
            .filter(|s| s.moving && s.axis != view.axis && s.axis.is_some())
            .collect();
        if sources.is_empty() {
            return Err("no other axis turns for more than seconds: do a rate-table run, or say `--base moving` where it was turned to see that".into());
        }
        Ok(sources
            .iter()
            .map(|s| {
                let mean = s.values.iter().sum::<f64>() / s.values.len() as f64;
                let source = s.axis.map_or(0, |a| a.index());
                Hypothesis::Regression(Regression {
                    columns: vec![Column {
                        parameter: ["from_gyro_x", "from_gyro_y", "from_gyro_z"][source],
                        values: s.values.iter().map(|v| v - mean).collect(),
                    }],
                    fixed: vec![],
                    follows: Some(s.name.clone()),
                })
            })
            .collect())
    }

    fn excited_by(&self) -> &'static [&'static str] {
        &["turn_dps", "sway_deg"]
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        for (source, name) in ["from_gyro_x", "from_gyro_y", "from_gyro_z"]
            .iter()
            .enumerate()
        {
            // It is told by what the other gyro reads.
            let share = value(parameters, name) * simulation.scale[source];
            for &axis in channels {
                for (rate, w) in simulation.rate[axis]
                    .iter_mut()
                    .zip(&simulation.motion[source])
                {
                    *rate += share * w;
                }
            }
        }
    }
}
