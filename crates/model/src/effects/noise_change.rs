//! The noise is larger for a while.

use crate::effect::{
    Docs, Effect, Example, Found, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage,
    VarianceLaw, View, agree, parameter, value,
};
use crate::parameter::Parameter;
use crate::simulate::Simulation;

/// The effect.
pub struct NoiseChange;

/// Its id.
pub const ID: &str = "noise_change";

/// The one instance that the library lists.
pub static EFFECT: NoiseChange = NoiseChange;

impl Effect for NoiseChange {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("start", "s", "start of the stretch"),
            parameter("end", "s", "end of the stretch"),
            parameter(
                "variance_increase",
                "1",
                "white variance in the stretch over that outside, minus 1",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Noise changes for a while",
            physics: "var e(t) = s^2 (1 + variance_increase) for start <= t < end: a machine nearby, a loose part, a range switched.",
            excitation: "Nothing.",
            test: "Likelihood of all stretches of the whitened residual.",
            remedy: "Find what ran nearby between these times and repeat the run without it, or raise the measurement noise for that time.",
            figure: "Mean square of the whitened residual in time blocks.",
            example: Example::new(
                Plot::PowerInTime,
                &[("start", 200.0), ("end", 320.0), ("variance_increase", 1.5)],
            ),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[Rival {
            cause: "motor_noise",
            experiment: "switch the motor several times: the noise follows it or does not",
        }];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.samples < 512 {
            return Err("fewer than 512 samples".into());
        }
        Ok(vec![Hypothesis::Variance(VarianceLaw::Segment)])
    }

    fn describe(&self, found: &Found) -> Parameters {
        let mut all = Parameters::new();
        if let Some(increase) = found.coefficients.first() {
            all.insert(
                "variance_increase".into(),
                Parameter::estimated(increase.0, increase.1, "1"),
            );
        }
        for (name, at) in ["start", "end"].iter().zip(&found.location) {
            all.insert((*name).into(), Parameter::estimated(at.0, at.1, "s"));
        }
        all
    }

    fn same_event(&self, a: &Parameters, b: &Parameters) -> bool {
        agree(a, b, "start") && agree(a, b, "end")
    }

    fn stage(&self) -> Stage {
        Stage::Noise
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let (start, end) = (value(parameters, "start"), value(parameters, "end"));
        let increase = value(parameters, "variance_increase");
        for &axis in channels {
            for (i, v) in simulation.variance[axis].iter_mut().enumerate() {
                if (start..end).contains(&(i as f64 / simulation.rate_hz)) {
                    *v *= (1.0 + increase).max(0.0);
                }
            }
        }
    }
}
