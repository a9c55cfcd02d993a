//! The base moves.

use crate::parameter::Parameter;
use crate::effect::{Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View, Found, parameter, optional, value};
use crate::record::Quantity;
use crate::simulate::Simulation;

/// The effect.
pub struct BaseMotion;

/// The one instance that the library lists.
pub static EFFECT: BaseMotion = BaseMotion;

impl Effect for BaseMotion {
    fn id(&self) -> &'static str {
        "base_motion"
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("peak", "deg/s", "largest rate of the motion"),
            optional("frequency", "Hz", "frequency of the sway in a simulation; 0.1 where it is left out"),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "The base moves",
            physics: "True rotation of the base: no error of the sensor. It is reported as an input, and slow causes of that axis are not tested.",
            excitation: "Motion.",
            test: "Excess rms between 0.02 and 0.6 Hz above 0.3 deg/s, more than any bias of this class of part can wander.",
            figure: "The rate in time blocks.",
            example: Example::new(Plot::RateInTime { block_s: 2.0 }, &[("peak", 3.0), ("frequency", 0.02)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival { cause: "line", experiment: "decouple the base from the bench" },
            Rival { cause: "g_sensitivity", experiment: "shake along the axis without turning" }
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.all(Quantity::Gyro).next().is_none() {
            return Err("no gyro channel".into());
        }
        Ok(vec![Hypothesis::Motion])
    }

    fn describe(&self, found: &Found) -> Parameters {
        let peak = found.coefficients.first().map_or((0.0, 0.0), |c| *c);
        [("peak".to_owned(), Parameter::estimated(peak.0, peak.1, &found.unit))].into()
    }

    fn same_event(&self, _a: &Parameters, _b: &Parameters) -> bool {
        true
    }

    fn stage(&self) -> Stage {
        Stage::World
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let peak = value(parameters, "peak");
        let frequency = parameters.get("frequency").map_or(0.1, |p| p.value);
        for &axis in channels {
            for (i, w) in simulation.motion[axis].iter_mut().enumerate() {
                *w += peak * (std::f64::consts::TAU * frequency * i as f64 / simulation.rate_hz).sin();
            }
        }
    }
}
