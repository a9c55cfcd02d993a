//! Axes share white noise, each its part.

use rand_distr::{Distribution, StandardNormal};

use crate::effect::{
    Docs, Effect, Example, Found, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    optional,
};
use crate::parameter::Parameter;
use crate::record::Quantity;
use crate::simulate::Simulation;

/// The effect.
pub struct CorrelatedNoise;

/// The one instance that the library lists.
pub static EFFECT: CorrelatedNoise = CorrelatedNoise;

/// Its id.
pub const ID: &str = "correlated_noise";

/// Its parameters, by the axis that the correlation is with.
pub(crate) const WITH: [&str; 6] = [
    "with_gyro_x",
    "with_gyro_y",
    "with_gyro_z",
    "with_acc_x",
    "with_acc_y",
    "with_acc_z",
];
/// Most of the noise of an axis that may be shared with others: what is left is its own.
const MOST_SHARED: f64 = 0.999;

impl Effect for CorrelatedNoise {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            optional(
                WITH[0],
                "1",
                "correlation of the white noise with that of gyro_x",
            ),
            optional(
                WITH[1],
                "1",
                "correlation of the white noise with that of gyro_y",
            ),
            optional(
                WITH[2],
                "1",
                "correlation of the white noise with that of gyro_z",
            ),
            optional(WITH[3], "1", "of an accelerometer, with that of acc_x"),
            optional(WITH[4], "1", "of an accelerometer, with that of acc_y"),
            optional(WITH[5], "1", "of an accelerometer, with that of acc_z"),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Correlated noise",
            physics: "corr(e_i(t), e_j(t)) = r of white noises of any sizes and either sign: gyros whose axes are not square to each other, a matrix that mixes them, a supply or reference that acts on each by its own sensitivity. Noise that all axes share alike is common_noise. angle_random_walk is the whole noise of each axis; simulated by a source for each pair, so that the sizes of the correlations of one axis add up to less than 1.",
            excitation: "At least two gyros.",
            test: "Correlation of the whitened residuals of each pair of axes, where no common noise explains it.",
            remedy: "Give the filter the full covariance matrix of the measurement noise; undo a mixing matrix before the noise is estimated.",
            figure: "By how much another axis changes from reading to reading, against by how much this one does.",
            example: Example::new(Plot::AxisAgainst("gyro_y"), &[(WITH[1], -0.5)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "common_noise",
                experiment: "a third axis: a source of all axes correlates with each of them",
            },
            Rival {
                cause: "cross_axis",
                experiment: "turn the table about the other axis: a cross-axis sensitivity takes its rate as well as its noise",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.all(Quantity::Gyro).count() < 2 {
            return Err("a single gyro: nothing to compare with".into());
        }
        Ok(vec![Hypothesis::Correlation])
    }

    /// One correlation, `names` says with which axis.
    fn describe(&self, found: &Found) -> Parameters {
        let each = found.names.iter().zip(&found.coefficients);
        each.map(|(name, (r, error))| ((*name).to_owned(), Parameter::estimated(*r, *error, "1")))
            .collect()
    }

    fn stage(&self) -> Stage {
        Stage::Noise
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        for &axis in channels {
            for (k, name) in WITH.iter().enumerate() {
                let other = k % 3;
                let r = parameters.get(*name).map_or(0.0, |p| p.value);
                if r != 0.0 && other != axis {
                    share(simulation, [axis, other], r);
                }
            }
        }
    }
}

/// Gives two axes a source of their own, which makes the correlation r and leaves the size of each as it is.
pub(crate) fn share(simulation: &mut Simulation, axes: [usize; 2], r: f64) {
    let most = axes.map(|a| simulation.own[a] - (1.0 - MOST_SHARED));
    let part = r.abs().min(most[0]).min(most[1]).max(0.0);
    let n = simulation.samples;
    let normal = |s: &mut Simulation| -> f64 { StandardNormal.sample(&mut s.rng) };
    let source: Vec<f64> = (0..n).map(|_| normal(simulation)).collect();
    for (k, axis) in axes.into_iter().enumerate() {
        let sign = if k == 1 { r.signum() } else { 1.0 };
        let sigma = sign * part.sqrt() * simulation.white_sigma[axis];
        simulation.shared[axis].resize(n, 0.0);
        let before = simulation.own[axis];
        let after = before - part;
        simulation.own[axis] = after;
        let shared = simulation.shared[axis].iter_mut();
        // The shared part is scaled by the variance that is left to the own one, and is not to lose by it.
        for ((shared, v), c) in shared.zip(&mut simulation.variance[axis]).zip(&source) {
            *v *= after / before;
            *shared = *shared * (before / after).sqrt() + sigma * c / after.sqrt();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ModelFile;
    use crate::file::EffectModel;

    #[test]
    fn the_correlation_is_made_and_the_size_of_each_axis_is_kept() {
        let mut model = ModelFile::paper();
        let plain = crate::simulate(&model, 2000.0, 20.0, 4).unwrap();
        let parameters = [(WITH[0], -0.4), (WITH[1], 0.3)];
        model.effects.push(EffectModel {
            cause: "correlated_noise".into(),
            channels: vec!["gyro_z".into()],
            parameters: parameters
                .iter()
                .map(|(n, r)| ((*n).to_owned(), Parameter::exact(*r, "1")))
                .collect(),
        });
        let record = crate::simulate(&model, 2000.0, 20.0, 4).unwrap();
        // Differences are free of the random walk; they have the correlation of white noise.
        let differences = |r: &crate::record::Record, k: usize| -> Vec<f64> {
            r.channels[k]
                .values
                .windows(2)
                .map(|w| w[1] - w[0])
                .collect()
        };
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let d = [0, 1, 2].map(|k| differences(&record, k));
        let r =
            |a: usize, b: usize| dot(&d[a], &d[b]) / (dot(&d[a], &d[a]) * dot(&d[b], &d[b])).sqrt();
        // 40 000 differences: 0.006 a standard error.
        for (a, b, wanted) in [(0, 2, -0.4), (1, 2, 0.3), (0, 1, 0.0)] {
            assert!((r(a, b) - wanted).abs() < 0.03, "{a} {b}: {}", r(a, b));
        }
        for (k, own) in d.iter().enumerate() {
            let before = differences(&plain, k);
            let ratio = dot(own, own) / dot(&before, &before);
            assert!((ratio - 1.0).abs() < 0.05, "{k}: {ratio}");
        }
    }
}
