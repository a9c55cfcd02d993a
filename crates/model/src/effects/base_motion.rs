//! The base moves.

use std::ops::Range;

use crate::effect::{
    Docs, Effect, Example, Found, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    optional, parameter, value,
};
use crate::parameter::Parameter;
use crate::record::Quantity;
use crate::simulate::Simulation;

/// The effect.
pub struct BaseMotion;

/// Its id.
pub const ID: &str = "base_motion";

/// The one instance that the library lists.
pub static EFFECT: BaseMotion = BaseMotion;

impl Effect for BaseMotion {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("peak", "deg/s", "largest rate of the motion"),
            optional(
                "start",
                "s",
                "start of one turn out and back, where it is no sway",
            ),
            optional("end", "s", "its end"),
            optional(
                "frequency",
                "Hz",
                "frequency of the sway in a simulation; 0.1 where it is left out",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "The base moves",
            physics: "True rotation of the base: no error of the sensor. It is reported as an input, and slow causes of that axis are not tested; a turn of seconds is left out on all axes, and the rest is searched.",
            excitation: "Motion.",
            test: "Excess rms between 0.02 and 0.6 Hz above 0.3 deg/s, more than any bias of this class of part can wander, unless the record says that the base was at rest (`base: static`) and noise, jumps and processes without a slope describe it to the last test; or, in a record at rest, rates of more than 1 deg/s that come smoothly and are gone within 30 s.",
            remedy: "Put the stand on a base that does not move, or record the motion with a reference and feed it to the simulation as an input. Where the base stood still, say so: --base static.",
            figure: "The rate in time blocks.",
            example: Example::new(
                Plot::RateInTime { block_s: 2.0 },
                &[("peak", 3.0), ("frequency", 0.02)],
            ),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "line",
                experiment: "decouple the base from the bench",
            },
            Rival {
                cause: "g_sensitivity",
                experiment: "shake along the axis without turning",
            },
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
        let mut all = Parameters::from([(
            "peak".to_owned(),
            Parameter::estimated(peak.0, peak.1, &found.unit),
        )]);
        for (name, at) in ["start", "end"].iter().zip(&found.location) {
            all.insert((*name).into(), Parameter::estimated(at.0, at.1, "s"));
        }
        all
    }

    fn same_event(&self, a: &Parameters, b: &Parameters) -> bool {
        match (stretch(a), stretch(b)) {
            (Some(a), Some(b)) => a.start < b.end && b.start < a.end,
            (a, b) => a.is_none() && b.is_none(),
        }
    }

    fn recurs(&self, parameters: &Parameters) -> bool {
        stretch(parameters).is_some()
    }

    fn stage(&self) -> Stage {
        Stage::World
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let peak = value(parameters, "peak");
        let frequency = parameters.get("frequency").map_or(0.1, |p| p.value);
        let turn = stretch(parameters);
        // In a turn there and back, or since the start.
        let cycles = |t: f64| match &turn {
            Some(turn) if turn.contains(&t) => (t - turn.start) / (turn.end - turn.start),
            Some(_) => 0.0,
            None => frequency * t,
        };
        for &axis in channels {
            for (i, w) in simulation.motion[axis].iter_mut().enumerate() {
                *w += peak * (std::f64::consts::TAU * cycles(i as f64 / simulation.rate_hz)).sin();
            }
        }
    }
}

/// When a turn begins and ends, s, where it is one.
fn stretch(parameters: &Parameters) -> Option<Range<f64>> {
    Some(parameters.get("start")?.value..parameters.get("end")?.value)
}
