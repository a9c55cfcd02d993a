//! The bias settles after power-up.

use std::sync::Arc;

use crate::effect::{
    Column, Docs, Effect, Example, Found, Hypothesis, ParameterSpec, Parameters, Plot, Rival,
    Shape, Stage, View, agree, parameter, value,
};
use crate::parameter::Parameter;
use crate::simulate::Simulation;

/// The effect.
pub struct WarmUp;

/// Its id.
pub const ID: &str = "warm_up";

/// The one instance that the library lists.
pub static EFFECT: WarmUp = WarmUp;

impl Effect for WarmUp {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter(
                "amplitude",
                "deg/s",
                "bias at the start of the record, minus the final one",
            ),
            parameter("time_constant", "s", "time in which it falls to 1/e"),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Warm-up",
            physics: "b(t) = amplitude exp(-t / time_constant): self-heating of a part whose thermometer lags or sits elsewhere, or settling of its electronics.",
            excitation: "A record that starts at power-up and lasts several time constants.",
            test: "Least squares on exponentials over a grid of time constants, refined; random walk refitted.",
            remedy: "Wait several of these time constants after power-up before the run, or subtract the exponential.",
            figure: "Rate in time blocks with the exponential.",
            example: Example::new(
                Plot::RateInTime { block_s: 5.0 },
                &[("amplitude", 0.5), ("time_constant", 90.0)],
            ),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "temperature",
                experiment: "a heater cycle of two periods, or a restart while warm: a temperature term repeats, a warm-up does not",
            },
            Rival {
                cause: "temperature_quadratic",
                experiment: "two cold starts at different ambient temperatures",
            },
            Rival {
                cause: "rate_ramp",
                experiment: "a record ten times longer: a ramp goes on, a warm-up ends",
            },
            Rival {
                cause: "bias_step",
                experiment: "a second cold start: a warm-up comes back, a step does not",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        Ok(vec![Hypothesis::Shaped(Arc::new(Exponentials {
            samples: view.samples,
            rate_hz: view.rate_hz,
        }))])
    }

    fn describe(&self, found: &Found) -> Parameters {
        let mut all = crate::effect::columns_as_parameters(self.parameters(), found);
        if let Some((tau, error)) = found.location.first() {
            all.insert(
                "time_constant".into(),
                Parameter::estimated(*tau, *error, "s"),
            );
        }
        all
    }

    fn same_event(&self, a: &Parameters, b: &Parameters) -> bool {
        agree(a, b, "time_constant")
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let (amplitude, tau) = (
            value(parameters, "amplitude"),
            value(parameters, "time_constant"),
        );
        if tau <= 0.0 {
            return;
        }
        for &axis in channels {
            for (i, rate) in simulation.rate[axis].iter_mut().enumerate() {
                *rate += amplitude * (-(i as f64) / simulation.rate_hz / tau).exp();
            }
        }
    }
}

/// Shortest time constant that is sought in a long record, s, and in readings: a die on its leads settles in tens of seconds, a supply
/// and a reference behind their capacitors in less than one; fewer readings are no course.
const SHORTEST_S: f64 = 0.5;
const SHORTEST_READINGS: f64 = 8.0;

/// exp(-t / tau), tau to a third of the record from a fiftieth of it, or from [`SHORTEST_S`] where that is less.
struct Exponentials {
    samples: usize,
    rate_hz: f64,
}

impl Shape for Exponentials {
    fn coordinate(&self) -> (&'static str, &'static str) {
        ("time_constant", "s")
    }

    fn grid(&self) -> Vec<f64> {
        let seconds = self.samples as f64 / self.rate_hz;
        let of_record = [50.0, 24.0, 12.0, 6.0, 3.0].map(|part| seconds / part);
        let shorter = std::iter::successors(Some(0.5 * of_record[0]), |tau| Some(0.5 * tau));
        let shortest = SHORTEST_S.max(SHORTEST_READINGS / self.rate_hz);
        let mut all: Vec<f64> = shorter.take_while(|tau| *tau >= shortest).collect();
        all.reverse();
        all.extend(of_record);
        all
    }

    fn columns(&self, at: f64) -> Vec<Column> {
        // Each the product of one of few coarse and one of few fine steps, and no exponential for every sample.
        const FINE: usize = 1 << 9;
        let exp = |i: usize| (-(i as f64) / self.rate_hz / at).exp();
        let fine: Vec<f64> = (0..FINE.min(self.samples)).map(exp).collect();
        let coarse = (0..self.samples).step_by(FINE).map(exp);
        let mut values = Vec::with_capacity(self.samples + FINE);
        coarse.for_each(|c| values.extend(fine.iter().map(|f| c * f)));
        values.truncate(self.samples);
        vec![Column {
            parameter: "amplitude",
            values,
        }]
    }
}
