//! The bias follows the temperature of the die.

use crate::effect::{
    Column, Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Regression, Rival,
    Stage, View, parameter, value,
};
use crate::record::Quantity;
use crate::simulate::Simulation;

/// The effect.
pub struct Temperature;

/// Its id.
pub const ID: &str = "temperature";

/// The one instance that the library lists.
pub static EFFECT: Temperature = Temperature;

impl Effect for Temperature {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[parameter(
            "slope",
            "deg/s/degC",
            "change of the bias per degree",
        )];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Bias follows temperature",
            physics: "b(t) = slope (T(t) - mean T). The mechanical and electrical offsets of the gyro drift with its die temperature; the ADIS16250 data sheet gives 0.03 deg/s/degC typically.",
            excitation: "A temperature that moves by at least half a degree, best up and down again (a heater cycle).",
            test: "Least squares on the smoothed temperature channel, random walk refitted.",
            remedy: "Subtract the slope times the measured temperature from the rate, or hold the temperature steady.",
            figure: "Rate in time blocks, the other terms taken out, against temperature: a straight line.",
            example: Example::new(Plot::RateAgainst("temp_x"), &[("slope", 0.08)])
                .in_a_world(&[("heater_degc", 6.0)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "warm_up",
                experiment: "a heater cycle of two periods: a temperature term repeats, a warm-up does not",
            },
            Rival {
                cause: "rate_ramp",
                experiment: "a record ten times longer with a heater cycle: a ramp goes on, a temperature term follows the heater",
            },
            Rival {
                cause: "temperature_quadratic",
                experiment: "a heater cycle of twice the swing",
            },
            Rival {
                cause: "bias_step",
                experiment: "repeat the run: a step does not come back at the same temperature",
            },
            Rival {
                cause: "supply_sensitivity",
                experiment: "a heater cycle at constant supply",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        Ok(vec![Hypothesis::Regression(Regression {
            columns: vec![Column {
                parameter: "slope",
                values: centred(view)?.0,
            }],
            fixed: vec![],
            follows: Some(centred(view)?.1),
        })])
    }

    fn excited_by(&self) -> &'static [&'static str] {
        &["heater_degc", "self_heating_degc", "drift_degc"]
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let slope = value(parameters, "slope");
        for &axis in channels {
            let mean =
                simulation.temperature[axis].iter().sum::<f64>() / simulation.samples.max(1) as f64;
            for (rate, t) in simulation.rate[axis]
                .iter_mut()
                .zip(&simulation.temperature[axis])
            {
                *rate += slope * (t - mean);
            }
        }
    }
}

/// Smallest swing of the temperature that says anything, degC.
pub(super) const LEAST_SWING: f64 = 0.5;

/// The temperature minus its mean, and the name of its channel.
fn centred(view: &View<'_>) -> Result<(Vec<f64>, String), String> {
    let signal = view
        .signal(Quantity::Temp)
        .ok_or("no temperature channel: record the gyro's temperature")?;
    let swing = signal.range();
    if swing < LEAST_SWING {
        return Err(format!(
            "{} moves by {swing:.2} degC only, {LEAST_SWING} are needed: record a heater cycle",
            signal.name
        ));
    }
    let mean = signal.smooth.iter().sum::<f64>() / signal.smooth.len() as f64;
    Ok((
        signal.smooth.iter().map(|t| t - mean).collect(),
        signal.name.clone(),
    ))
}
