//! The motor makes the rate noisier.

use crate::effect::{Docs, Effect, Example, Found, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View, VarianceLaw, parameter, value};
use crate::parameter::Parameter;
use crate::record::Quantity;
use crate::simulate::Simulation;

/// The effect.
pub struct MotorNoise;

/// The one instance that the library lists.
pub static EFFECT: MotorNoise = MotorNoise;

impl Effect for MotorNoise {
    fn id(&self) -> &'static str {
        "motor_noise"
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("variance_increase_at_full_duty", "1", "white variance at full duty over that at rest, minus 1"),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Motor adds noise",
            physics: "var e(t) = s^2 (1 + increase x duty^2): brush noise and vibration coupled into the rate.",
            excitation: "A motor command that changes.",
            test: "Likelihood of the whitened residual with a variance that follows duty, or its square.",
            figure: "Mean square of the whitened residual in time blocks against duty.",
            example: Example::new(Plot::PowerAgainst("pwm"), &[("variance_increase_at_full_duty", 1.5)]).in_a_world(&[("motor_duty", 0.8)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival { cause: "noise_change", experiment: "switch the motor several times: the noise follows it or does not" },
            Rival { cause: "line", experiment: "a longer record at constant duty" }
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        let signal = view.signal(Quantity::Pwm).ok_or("no motor channel: record the motor command")?;
        let size: Vec<f64> = signal.values.iter().map(|v| (v / super::motor_bias::FULL_DUTY).abs()).collect();
        let (low, high) = size.iter().fold((f64::INFINITY, 0.0f64), |(l, h), &v| (l.min(v), h.max(v)));
        if (high - low) * super::motor_bias::FULL_DUTY < super::motor_bias::LEAST_CHANGE {
            return Err("the motor command does not change in size: switch the motor during the record".into());
        }
        let square = size.iter().map(|d| d * d).collect();
        let law = |shape| Hypothesis::Variance(VarianceLaw::Shape { shape, follows: signal.name.clone() });
        Ok(vec![law(square), law(size)])
    }

    fn describe(&self, found: &Found) -> Parameters {
        let increase = found.coefficients.first().map_or((0.0, 0.0), |c| *c);
        [("variance_increase_at_full_duty".to_owned(), Parameter::estimated(increase.0, increase.1, "1"))].into()
    }

    fn excited_by(&self) -> &'static [&'static str] {
        &["motor_duty"]
    }

    fn stage(&self) -> Stage {
        Stage::Noise
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let increase = value(parameters, "variance_increase_at_full_duty");
        for &axis in channels {
            for (v, d) in simulation.variance[axis].iter_mut().zip(&simulation.duty) {
                *v *= (1.0 + increase * d * d).max(0.0);
            }
        }
    }
}
