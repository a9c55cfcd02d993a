//! The scale factor is wrong.

use crate::effect::{
    Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    parameter, value,
};
use crate::record::Base;
use crate::record::Quantity;
use crate::simulate::Simulation;

/// The effect.
pub struct ScaleError;

/// Its id.
pub const ID: &str = "scale_error";

/// The one instance that the library lists.
pub static EFFECT: ScaleError = ScaleError;

impl Effect for ScaleError {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[parameter(
            "relative",
            "1",
            "true scale over the stated one, minus 1",
        )];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Scale factor error",
            physics: "reading = (1 + relative) x rate: tolerance of the part (1 % for the ADIS16250) or a wrong constant in the chain.",
            excitation: "A slow sway of the base whose tilt the accelerometers see.",
            test: "The tilt of the accelerometers regressed on the integrated rate, in a band around the sway.",
            remedy: "Calibrate the scale factor on a rate table and correct the constant of this axis.",
            figure: "Tilt from the accelerometers against tilt from the rate.",
            example: Example::new(Plot::Tilt, &[("relative", 0.15)])
                .in_a_world(&[("sway_deg", 5.0)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "cross_axis",
                experiment: "a rate-table run about one axis",
            },
            Rival {
                cause: "g_sensitivity",
                experiment: "a six-position test at rest",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.all(Quantity::Acc).count() < 2 {
            return Err("no accelerometer channels: nothing to hold the rate against".into());
        }
        if view.base == Some(Base::Turntable) {
            return Err(
                "a turntable does not tilt: sway the base by some degrees about a horizontal axis"
                    .into(),
            );
        }
        if !view.moving {
            return Err(
                "the axis does not turn: sway the base by some degrees, or use a rate table".into(),
            );
        }
        Ok(vec![Hypothesis::Scale])
    }

    fn excited_by(&self) -> &'static [&'static str] {
        &["turn_dps", "sway_deg"]
    }

    fn stage(&self) -> Stage {
        Stage::World
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let relative = value(parameters, "relative");
        for &axis in channels {
            simulation.scale[axis] *= 1.0 + relative;
        }
    }
}
