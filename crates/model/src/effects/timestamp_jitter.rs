//! Samples are taken at uneven times.

use rand_distr::{Distribution, StandardNormal};

use crate::effect::{
    Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    parameter, value,
};
use crate::simulate::Simulation;

/// The effect.
pub struct TimestampJitter;

/// Its id.
pub const ID: &str = "timestamp_jitter";

/// The one instance that the library lists.
pub static EFFECT: TimestampJitter = TimestampJitter;

impl Effect for TimestampJitter {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[parameter(
            "sigma",
            "s",
            "standard deviation of the sampling instant",
        )];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Timestamp jitter",
            physics: "Samples are taken, or stamped, late by a random time: an interrupt that waits, a busy loop in place of a timer.",
            excitation: "Device times.",
            test: "Audit: robust spread of the device times about their line.",
            remedy: "Sample by a hardware timer and stamp the instant of sampling; until then integrate with the nominal interval.",
            figure: "Device time minus its line.",
            example: Example::new(Plot::DeviceTime, &[("sigma", 2e-3)]).on_all(),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[Rival {
            cause: "dropped_samples",
            experiment: "the sequence numbers",
        }];
        RIVALS
    }

    fn hypotheses(&self, _view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        Ok(vec![Hypothesis::Audit])
    }

    fn stage(&self) -> Stage {
        Stage::Frames
    }

    fn simulate(&self, parameters: &Parameters, _channels: &[usize], simulation: &mut Simulation) {
        let sigma = value(parameters, "sigma");
        for i in 0..simulation.samples {
            let e: f64 = StandardNormal.sample(&mut simulation.rng);
            simulation.device_time[i] += sigma * e;
        }
    }
}
