//! Single samples far off.

use rand_distr::{Distribution, Gamma, Uniform};

use crate::effect::{
    Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    optional, parameter, value,
};
use crate::simulate::Simulation;

/// The effect.
pub struct Outliers;

/// Its id.
pub const ID: &str = "outliers";

/// The one instance that the library lists.
pub static EFFECT: Outliers = Outliers;

impl Effect for Outliers {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("count", "1", "samples far off"),
            optional(
                "size",
                "deg/s",
                "root mean square of their distance from the truth; 10 white sigma where it is left out",
            ),
            optional(
                "upward",
                "1",
                "share of them that lie above the truth; to either side in turn where it is left out",
            ),
            optional(
                "spread",
                "deg/s",
                "standard deviation of their distances; all lie equally far where it is left out",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Outliers",
            physics: "Single samples that the noise cannot have made: a disturbed SPI word, a discharge, a knock.",
            excitation: "Nothing.",
            test: "Audit: distance of the whitened sample against the normal tail of the record length.",
            remedy: "Check wiring and signal levels of the data line, and let the filter reject innovations beyond 5 sigma.",
            figure: "The rate around each of them.",
            example: Example::new(Plot::Around, &[("count", 4.0)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "telegraph",
                experiment: "a longer record",
            },
            Rival {
                cause: "stuck_bit",
                experiment: "look at the counts: a stuck bit is off by one power of two",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, _view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        Ok(vec![Hypothesis::Audit])
    }

    fn stage(&self) -> Stage {
        Stage::Reading
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let count = simulation.events(value(parameters, "count").round().max(0.0) as usize);
        let Ok(at) = Uniform::new(0, simulation.samples.max(1)) else {
            return;
        };
        for &axis in channels {
            let size = parameters
                .get("size")
                .map_or(10.0 * simulation.white_sigma[axis], |p| p.value);
            let upward = parameters.get("upward").map_or(0.5, |p| p.value);
            let spread = parameters.get("spread").map_or(0.0, |p| p.value);
            let distances = distances(size, spread);
            // Of the first k, the whole number next below k + 1/2 of that share.
            let above = |k: usize| (k as f64 * upward + 0.5).floor();
            for k in 0..count {
                let i = at.sample(&mut simulation.rng);
                let up = above(k + 1) > above(k);
                let far = (distances.as_ref()).map_or(size, |d| d.sample(&mut simulation.rng));
                simulation.white[axis][i] += if up { far } else { -far };
            }
        }
    }
}

/// The law of distances of root mean square `size` and standard deviation `spread`: a gamma law, which has no value below
/// zero. None where all are the same, or no law of distances has such a spread.
fn distances(size: f64, spread: f64) -> Option<Gamma<f64>> {
    let mean = (size * size - spread * spread).sqrt();
    Gamma::new((mean / spread).powi(2), spread * spread / mean).ok()
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    #[test]
    fn distances_have_the_size_and_the_spread_that_are_given() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let law = distances(5.0, 1.5).expect("a law");
        let drawn: Vec<f64> = (0..40_000).map(|_| law.sample(&mut rng)).collect();
        let count = drawn.len() as f64;
        let mean = drawn.iter().sum::<f64>() / count;
        let square = drawn.iter().map(|d| d * d).sum::<f64>() / count;
        // Five standard errors: of a mean square of kurtosis below 4, and of a spread.
        assert!((square.sqrt() - 5.0).abs() < 0.04, "{}", square.sqrt());
        let spread = (square - mean * mean).sqrt();
        assert!((spread - 1.5).abs() < 0.03, "{spread}");
    }

    #[test]
    fn without_a_spread_all_lie_equally_far() {
        assert!(distances(5.0, 0.0).is_none());
        assert!(distances(5.0, 6.0).is_none());
    }
}
