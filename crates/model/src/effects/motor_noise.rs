//! The motor makes the rate noisier.

use std::sync::Arc;

use crate::effect::{
    Docs, Effect, Example, Found, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage,
    VarianceLaw, View, optional, parameter, value,
};
use crate::parameter::Parameter;
use crate::record::{FULL_DUTY, Quantity};
use crate::simulate::Simulation;

/// The effect.
pub struct MotorNoise;

/// Its id.
pub const ID: &str = "motor_noise";

/// The one instance that the library lists.
pub static EFFECT: MotorNoise = MotorNoise;

impl Effect for MotorNoise {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter(
                "variance_increase_at_full_duty",
                "1",
                "white variance at full duty over that at rest, minus 1",
            ),
            optional(
                "by_magnitude",
                "1",
                "1 where the variance follows the magnitude of duty, 0 where its square, which is meant where this is left out because a record does not tell",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Motor adds noise",
            physics: "var e(t) = s^2 (1 + increase x duty^2), where an amplitude grows with the duty, or s^2 (1 + increase x |duty|), where pulses come more often: brush noise and vibration coupled into the rate.",
            excitation: "A motor command that changes.",
            test: "Likelihood of the whitened residual with a variance that follows the square of duty, or |duty| where that is clearly better.",
            remedy: "Balance and isolate the motor and suppress its brushes, or raise the filter's measurement noise with the duty.",
            figure: "Mean square of the whitened residual in time blocks against duty.",
            example: Example::new(
                Plot::PowerAgainst("pwm"),
                &[("variance_increase_at_full_duty", 1.5)],
            )
            .in_a_world(&[("motor_duty", 0.8)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "noise_change",
                experiment: "switch the motor several times: the noise follows it or does not",
            },
            Rival {
                cause: "line",
                experiment: "a longer record at constant duty",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        let signal = view
            .signal(Quantity::Pwm)
            .ok_or("no motor channel: record the motor command")?;
        let size: Vec<f64> = signal
            .values
            .iter()
            .map(|v| (v / FULL_DUTY).abs())
            .collect();
        let (low, high) = size
            .iter()
            .fold((f64::INFINITY, 0.0f64), |(l, h), &v| (l.min(v), h.max(v)));
        if (high - low) * FULL_DUTY < super::motor_bias::LEAST_CHANGE {
            return Err(
                "the motor command does not change in size: switch the motor during the record"
                    .into(),
            );
        }
        let square = size.iter().map(|d| d * d).collect();
        let law = |shape, by_magnitude| {
            let fixed = vec![("by_magnitude", by_magnitude, "1")];
            Hypothesis::Variance(VarianceLaw::Shape {
                shape: Arc::new(shape),
                fixed,
                follows: signal.name.clone(),
            })
        };
        Ok(vec![law(square, 0.0), law(size, 1.0)])
    }

    fn describe(&self, found: &Found) -> Parameters {
        let increase = found.coefficients.first().map_or((0.0, 0.0), |c| *c);
        let fixed = found
            .fixed
            .iter()
            .map(|(name, value, unit)| ((*name).to_owned(), Parameter::exact(*value, unit)));
        let size = (
            "variance_increase_at_full_duty".to_owned(),
            Parameter::estimated(increase.0, increase.1, "1"),
        );
        fixed.chain([size]).collect()
    }

    fn excited_by(&self) -> &'static [&'static str] {
        &["motor_duty"]
    }

    fn stage(&self) -> Stage {
        Stage::Noise
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let increase = value(parameters, "variance_increase_at_full_duty");
        let by_size = value(parameters, "by_magnitude") != 0.0;
        for &axis in channels {
            for (v, d) in simulation.variance[axis].iter_mut().zip(&simulation.duty) {
                *v *= (1.0 + increase * if by_size { d.abs() } else { d * d }).max(0.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::file::EffectModel;
    use crate::{ModelFile, Parameter};

    #[test]
    fn the_law_is_kept_in_the_model_file_and_a_file_without_it_means_the_square() {
        // The command that 0.5 is rounded to.
        let duty = 128.0 / 255.0;
        let run = |increase: f64, by_magnitude: Option<f64>| {
            let mut model = ModelFile::paper();
            model.excitation.insert("motor_duty".into(), 0.5);
            let told = by_magnitude.map(|v| ("by_magnitude".into(), Parameter::exact(v, "1")));
            let size = (
                "variance_increase_at_full_duty".into(),
                Parameter::exact(increase, "1"),
            );
            let parameters = told.into_iter().chain([size]).collect();
            model.effects.push(EffectModel {
                cause: "motor_noise".into(),
                channels: vec!["gyro_x".into()],
                parameters,
            });
            let model = ModelFile::parse(&model.to_toml()).expect("a model");
            crate::simulate(&model, 200.0, 20.0, 1)
                .expect("a run")
                .channels
        };
        assert!(
            run(duty, Some(1.0)) == run(1.0, Some(0.0)),
            "increase x |duty|"
        );
        assert!(run(1.0, Some(0.0)) == run(1.0, None), "the square");
        assert!(run(1.0, Some(1.0)) != run(1.0, None), "two laws");
    }
}
