//! The bias switches between two levels.

use rand_distr::{Distribution, Exp1};

use crate::effect::{
    Docs, Effect, Example, Found, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    parameter, value,
};
use crate::parameter::Parameter;
use crate::simulate::Simulation;

/// The effect.
pub struct Telegraph;

/// Its id.
pub const ID: &str = "telegraph";

/// The one instance that the library lists.
pub static EFFECT: Telegraph = Telegraph;

impl Effect for Telegraph {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("half_height", "deg/s", "half the distance of the levels"),
            parameter("dwell_time", "s", "mean time on a level"),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Telegraph noise",
            physics: "b(t) = +-half_height, switching at random with the mean dwell time on either level: a single charge trap, a loose contact, popcorn noise.",
            excitation: "Nothing; many switches within the record.",
            test: "Likelihood of a two-level hidden Markov chain against Gauss-Markov and steps; Bartlett's test of the dwell times, which are exponential where it switches at random.",
            remedy: "Check contacts and replace the part where it persists; until then simulate two levels with this dwell time and let the filter's bias follow.",
            figure: "Rate in time blocks beside a simulation without the two levels.",
            example: Example::new(
                Plot::RateInTime { block_s: 2.0 },
                &[("half_height", 0.3), ("dwell_time", 40.0)],
            ),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "gauss_markov",
                experiment: "a longer record: look at the histogram for two levels",
            },
            Rival {
                cause: "flicker",
                experiment: "a longer record: look at the histogram for two levels",
            },
            Rival {
                cause: "bias_step",
                experiment: "a longer record: telegraph noise comes back",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.seconds() < 60.0 {
            return Err("the record is shorter than a minute".into());
        }
        Ok(vec![Hypothesis::TwoLevel])
    }

    /// Coefficients: half the distance of the levels, and the dwell time in s.
    fn describe(&self, found: &Found) -> Parameters {
        let [half, dwell, ..] = found.coefficients[..] else {
            return Parameters::new();
        };
        [
            (
                "half_height".to_owned(),
                Parameter::estimated(half.0, half.1, &found.unit),
            ),
            (
                "dwell_time".to_owned(),
                Parameter::estimated(dwell.0, dwell.1, "s"),
            ),
        ]
        .into()
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let (half, dwell) = (
            value(parameters, "half_height"),
            value(parameters, "dwell_time"),
        );
        if dwell <= 0.0 {
            return;
        }
        for &axis in channels {
            let mut level = half;
            let mut left = dwell * Distribution::<f64>::sample(&Exp1, &mut simulation.rng);
            for k in 0..simulation.stretches.len() {
                left -= simulation.stretches[k].skipped as f64 / simulation.rate_hz;
                for i in simulation.stretches[k].samples.clone() {
                    while left < 0.0 {
                        level = -level;
                        left += dwell * Distribution::<f64>::sample(&Exp1, &mut simulation.rng);
                    }
                    simulation.rate[axis][i] += level;
                    left -= 1.0 / simulation.rate_hz;
                }
            }
        }
    }
}
