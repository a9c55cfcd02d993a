//! The gyros share a part of their noise.

use rand_distr::{Distribution, StandardNormal};

use crate::effect::{
    Docs, Effect, Example, Found, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    parameter, value,
};
use crate::parameter::Parameter;
use crate::record::Quantity;
use crate::simulate::Simulation;

/// The effect.
pub struct CommonNoise;

/// Its id.
pub const ID: &str = "common_noise";

/// The one instance that the library lists.
pub static EFFECT: CommonNoise = CommonNoise;

impl Effect for CommonNoise {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[parameter(
            "sigma",
            "deg/s",
            "standard deviation of the shared part, beside which angle_random_walk is each axis' own",
        )];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Common noise",
            physics: "e_i(t) = own noise + c(t): a shared supply or reference, broadband shaking of the base. The shared part is white as the own one and goes through the same filter.",
            excitation: "At least two gyros.",
            test: "Correlation of the whitened residuals of each pair of axes.",
            remedy: "Filter the shared supply and reference and isolate the base; until then give the filter correlated measurement noise.",
            figure: "By how much another axis changes from reading to reading, against by how much this one does.",
            example: Example::new(Plot::AxisAgainst("gyro_y"), &[("sigma", 0.5)]).on_all(),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "base_motion",
                experiment: "decouple the base from the bench",
            },
            Rival {
                cause: "supply_sensitivity",
                experiment: "a battery in place of the supply",
            },
            Rival {
                cause: "correlated_noise",
                experiment: "a third axis: a source of all axes correlates with each of them",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.all(Quantity::Gyro).count() < 2 {
            return Err("a single gyro: nothing to compare with".into());
        }
        Ok(vec![Hypothesis::Common])
    }

    fn describe(&self, found: &Found) -> Parameters {
        let sigma = found.coefficients.first().map_or((0.0, 0.0), |c| *c);
        [(
            "sigma".to_owned(),
            Parameter::estimated(sigma.0, sigma.1, &found.unit),
        )]
        .into()
    }

    fn same_event(&self, _a: &Parameters, _b: &Parameters) -> bool {
        true
    }

    fn stage(&self) -> Stage {
        Stage::Noise
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let sigma = value(parameters, "sigma");
        for &axis in channels {
            simulation.shared[axis].resize(simulation.samples, 0.0);
        }
        for i in 0..simulation.samples {
            let c: f64 = StandardNormal.sample(&mut simulation.rng);
            for &axis in channels {
                simulation.shared[axis][i] += sigma * c;
            }
        }
    }
}
