//! The bias follows the temperature of the die.

mod lag;

use std::sync::Arc;

use crate::effect::{
    Column, Docs, Effect, Example, Found, Hypothesis, ParameterSpec, Parameters, Plot, Regression,
    Rival, Signal, Stage, View, columns_as_parameters, optional, parameter, value,
};
use crate::parameter::Parameter;
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
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("slope", "deg/s/degC", "change of the bias per degree"),
            optional(
                LAG,
                "s",
                "time constant with which the bias is behind the thermometer; below 0, with which the thermometer is behind the bias",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Bias follows temperature",
            physics: "b(t) = slope (T(t) - mean T). Where a lag is stated, T is the reading behind a filter of that time constant (a die that warms later than the thermometer), or, below 0, T + |lag| dT/dt, what a thermometer that warms later than the die is on its way to. The mechanical and electrical offsets of the gyro drift with its die temperature; the ADIS16250 data sheet gives 0.03 deg/s/degC typically.",
            excitation: "A temperature that moves by at least half a degree, best up and down again (a heater cycle).",
            test: "Least squares on the smoothed temperature channel, at once and over a grid of lags either way, refined; size and lag averaged over each other; random walk refitted.",
            remedy: "Subtract the slope times the measured temperature, filtered by the lag where there is one, from the rate, or hold the temperature steady.",
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
        let signal = moving(view)?;
        let at_once = Hypothesis::Regression(Regression {
            columns: vec![Column {
                parameter: "slope",
                values: lag::about_mean(signal.smooth.to_vec()),
            }],
            fixed: vec![],
            follows: Some(signal.name.clone()),
        });
        let lagging = [false, true].map(|ahead| lag::Lagging {
            temperature: Arc::clone(&signal.smooth),
            channel: signal.name.clone(),
            rate_hz: view.rate_hz,
            ahead,
        });
        let lagging = lagging.into_iter().filter(lag::Lagging::any);
        let lagging = lagging.map(|l| Hypothesis::Shaped(Arc::new(l)));
        Ok(std::iter::once(at_once).chain(lagging).collect())
    }

    fn describe(&self, found: &Found) -> Parameters {
        let mut all = columns_as_parameters(self.parameters(), found);
        if let Some((lag, error)) = found.location.first() {
            all.insert(LAG.into(), Parameter::estimated(*lag, *error, "s"));
        }
        all
    }

    fn excited_by(&self) -> &'static [&'static str] {
        &["heater_degc", "self_heating_degc", "drift_degc"]
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let slope = value(parameters, "slope");
        let lag = value(parameters, LAG);
        let rate_hz = simulation.rate_hz;
        for &axis in channels {
            let course = lag::about_mean(lag::behind(&simulation.temperature[axis], lag, rate_hz));
            for (rate, t) in simulation.rate[axis].iter_mut().zip(course) {
                *rate += slope * t;
            }
        }
    }
}

/// The parameter that says how far the bias is behind.
const LAG: &str = "lag";

/// Smallest swing of the temperature that says anything, degC.
pub(super) const LEAST_SWING: f64 = 0.5;

/// The temperature of the channel, where it moves enough.
fn moving<'a>(view: &'a View<'_>) -> Result<&'a Signal, String> {
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
    Ok(signal)
}
