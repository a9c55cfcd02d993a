//! The bias follows the temperature of the die along a parabola.

use crate::effect::{
    Column, Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Regression, Rival,
    Stage, View, optional, parameter, value,
};
use crate::record::Quantity;
use crate::simulate::Simulation;

/// The effect.
pub struct TemperatureQuadratic;

/// Its id.
pub const ID: &str = "temperature_quadratic";

/// The one instance that the library lists.
pub static EFFECT: TemperatureQuadratic = TemperatureQuadratic;

impl Effect for TemperatureQuadratic {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter(
                "slope",
                "deg/s/degC",
                "change of the bias per degree at the reference",
            ),
            parameter("curvature", "deg/s/degC^2", "coefficient of the square"),
            optional(
                "reference",
                "degC",
                "temperature that both refer to; 25 where it is left out",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Bias follows temperature along a parabola",
            physics: "b(t) = slope (T - T0) + curvature (T - T0)^2 with T0 = 25 degC, the zero of the sensor.",
            excitation: "A temperature swing of a few degrees; the power grows with the square of the swing.",
            test: "Least squares on T and T^2 of the smoothed temperature channel; against a linear term already found, the square alone.",
            remedy: "Subtract slope and curvature times the measured temperature from the rate, or hold the temperature steady.",
            figure: "Rate in time blocks, the other terms taken out, against temperature: a parabola.",
            example: Example::new(
                Plot::RateAgainst("temp_x"),
                &[("slope", 0.02), ("curvature", 0.04)],
            )
            .in_a_world(&[("ambient_degc", 22.0), ("heater_degc", 6.5)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "temperature",
                experiment: "a heater cycle of twice the swing",
            },
            Rival {
                cause: "warm_up",
                experiment: "a heater cycle of two periods: a temperature term repeats, a warm-up does not",
            },
            Rival {
                cause: "rate_ramp",
                experiment: "a record ten times longer with a heater cycle",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        let signal = view
            .signal(Quantity::Temp)
            .ok_or("no temperature channel: record the gyro's temperature")?;
        let swing = signal.range();
        if swing < 2.0 * super::temperature::LEAST_SWING {
            return Err(format!(
                "{} moves by {swing:.2} degC only, {} are needed for a curvature: record a heater cycle",
                signal.name,
                2.0 * super::temperature::LEAST_SWING
            ));
        }
        let power = |n: i32| {
            signal
                .smooth
                .iter()
                .map(|t| (t - REFERENCE).powi(n))
                .collect()
        };
        Ok(vec![Hypothesis::Regression(Regression {
            columns: vec![
                Column {
                    parameter: "slope",
                    values: power(1),
                },
                Column {
                    parameter: "curvature",
                    values: power(2),
                },
            ],
            fixed: vec![("reference", REFERENCE, "degC")],
            follows: Some(signal.name.clone()),
        })])
    }

    fn extends(&self) -> Option<&'static str> {
        Some("temperature")
    }

    fn excited_by(&self) -> &'static [&'static str] {
        &["heater_degc", "self_heating_degc", "drift_degc"]
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let (slope, curvature) = (value(parameters, "slope"), value(parameters, "curvature"));
        let reference = parameters.get("reference").map_or(REFERENCE, |p| p.value);
        for &axis in channels {
            for (rate, t) in simulation.rate[axis]
                .iter_mut()
                .zip(&simulation.temperature[axis])
            {
                let d = t - reference;
                *rate += slope * d + curvature * d * d;
            }
        }
    }
}

/// Zero of the ADIS16250's temperature register, degC.
const REFERENCE: f64 = 25.0;
