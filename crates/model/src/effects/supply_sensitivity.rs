//! The bias follows the supply.

use crate::effect::{
    Column, Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Regression, Rival,
    Stage, View, parameter, value,
};
use crate::record::Quantity;
use crate::simulate::Simulation;

/// The effect.
pub struct SupplySensitivity;

/// Its id.
pub const ID: &str = "supply_sensitivity";

/// The one instance that the library lists.
pub static EFFECT: SupplySensitivity = SupplySensitivity;

impl Effect for SupplySensitivity {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] =
            &[parameter("slope", "deg/s/V", "change of the bias per volt")];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Bias follows supply",
            physics: "b(t) = slope (U(t) - mean U): references of the read-out that are not ratiometric; the ADIS16250 data sheet gives 1 deg/s/V.",
            excitation: "A supply that moves by more than 5 mV.",
            test: "Least squares on the supply channel, random walk refitted.",
            remedy: "Regulate the supply of the sensor by itself, or subtract the slope times the measured supply from the rate.",
            figure: "Rate in time blocks against supply.",
            example: Example::new(Plot::RateAgainst("supply"), &[("slope", 5.0)])
                .in_a_world(&[("supply_load_v", 0.06)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "motor_bias",
                experiment: "switch a dummy load with the motor off",
            },
            Rival {
                cause: "temperature",
                experiment: "switch a load for less than a thermal time constant",
            },
            Rival {
                cause: "bias_step",
                experiment: "switch the load several times",
            },
            Rival {
                cause: "rate_ramp",
                experiment: "switch a load: the bias follows it or does not",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        let signal = view
            .signal(Quantity::Supply)
            .ok_or("no supply channel: record the supply voltage")?;
        let swing = signal.range();
        if swing < LEAST_SWING {
            return Err(format!(
                "{} moves by {:.1} mV only, {:.0} are needed: switch a load during the record",
                signal.name,
                swing * 1e3,
                LEAST_SWING * 1e3
            ));
        }
        let mean = signal.smooth.iter().sum::<f64>() / signal.smooth.len() as f64;
        Ok(vec![Hypothesis::Regression(Regression {
            columns: vec![Column {
                parameter: "slope",
                values: signal.smooth.iter().map(|u| u - mean).collect(),
            }],
            fixed: vec![],
            follows: Some(signal.name.clone()),
        })])
    }

    fn excited_by(&self) -> &'static [&'static str] {
        &["supply_load_v", "supply_motor_v"]
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let slope = value(parameters, "slope");
        let mean = simulation.supply.iter().sum::<f64>() / simulation.samples.max(1) as f64;
        for &axis in channels {
            for (rate, u) in simulation.rate[axis].iter_mut().zip(&simulation.supply) {
                *rate += slope * (u - mean);
            }
        }
    }
}

/// Smallest swing of the supply that says anything, V: three counts of the ADIS16250.
const LEAST_SWING: f64 = 5e-3;
