//! Flicker noise: the bias instability of IEEE Std 952.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::effect::{
    Covariance, Docs, Effect, Example, Found, Frequencies, Hypothesis, ParameterSpec, Parameters,
    Plot, Rival, Stage, View, parameter, value,
};
use crate::parameter::Parameter;
use crate::simulate::Simulation;

/// The effect.
pub struct Flicker;

/// Its id.
pub const ID: &str = "flicker";

/// The one instance that the library lists.
pub static EFFECT: Flicker = Flicker;

impl Effect for Flicker {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[parameter(
            "bias_instability",
            "deg/h",
            "B of IEEE Std 952; the flat part of the Allan curve lies at 0.664 B",
        )];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Flicker noise",
            physics: "Two-sided spectral density B^2 / (2 pi f): charge traps in the read-out electronics.",
            excitation: "Nothing; the longer the record, the clearer.",
            test: "White variance, random walk and B refitted by maximum likelihood.",
            remedy: "Give the simulation flicker noise of this B and the filter a bias state with several time constants; averaging longer does not help.",
            figure: "Spectrum of the rate with the model before and after: a density that falls with the root of the frequency, its square as 1/f.",
            example: Example::new(Plot::Spectrum, &[("bias_instability", 300.0)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "gauss_markov",
                experiment: "a longer record: flicker goes on rising to lower frequencies",
            },
            Rival {
                cause: "telegraph",
                experiment: "a longer record: look at the histogram for two levels",
            },
            Rival {
                cause: "low_pass",
                experiment: "change the filter taps",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.samples < 256 {
            return Err("fewer than 256 samples".into());
        }
        Ok(vec![Hypothesis::Covariance(Arc::new(Pink))])
    }

    fn describe(&self, found: &Found) -> Parameters {
        let Some((kb, error)) = found.coefficients.first() else {
            return Parameters::new();
        };
        let b = found.white_sigma * (kb / 2.0).exp();
        let (b, unit) = if found.unit == "deg/s" {
            (b * 3600.0, "deg/h")
        } else {
            (b, found.unit.as_str())
        };
        [(
            "bias_instability".to_owned(),
            Parameter::estimated(b, b * error / 2.0, unit),
        )]
        .into()
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let b = value(parameters, "bias_instability") / 3600.0;
        for &axis in channels {
            let none = vec![0.0; simulation.rate[axis].len()];
            let others = std::mem::replace(&mut simulation.rate[axis], none);
            for (variance, samples) in half_difference(simulation.span) {
                simulation.add_markov(axis, b * variance.sqrt(), samples);
            }
            let rate = &mut simulation.rate[axis];
            for stretch in &simulation.stretches {
                smooth(&mut rate[stretch.samples.clone()]);
            }
            rate.iter_mut().zip(others).for_each(|(r, o)| *r += o);
        }
    }
}

/// Gauss-Markov processes that sum up to white noise of density 1 differenced minus half a time, of density 1 / s at s = 2 sin(w / 2):
/// variances and correlation times in samples, the last one white. With poles exp(-a) at u = 2 sinh(a / 2) it is
/// 1 / s = (2 / pi) int du / (u^2 + s^2), and a process of variance v has the density 2 v sinh(a) / (u^2 + s^2).
fn half_difference(samples: usize) -> Vec<(f64, f64)> {
    // Of u in e-folds the ripple is 1 / cosh(pi^2). From 8 on, the integrand is flat within 4 / 64.
    let (fastest, slowest) = (8.0, 1.0 / (30.0 * samples as f64));
    let count = (fastest / slowest).ln().ceil();
    let of = |j: usize| {
        let u = fastest * (-(j as f64 + 0.5)).exp();
        let a = 2.0 * (0.5 * u).asinh();
        ((PI * (0.5 * a).cosh()).recip(), a.recip())
    };
    let white = 2.0 / (PI * fastest);
    (0..count as usize).map(of).chain([(white, 0.0)]).collect()
}

/// Makes of a density 1 / (2 sin(w / 2)) one of 1 / w: a filter without delay, of the root of their ratio by least squares over all
/// frequencies; it is 6 % high at half the sample rate and within 2 % elsewhere.
fn smooth(rate: &mut [f64]) {
    const TAPS: [f64; 3] = [0.040639, -0.010565, 0.004047];
    let from = rate.to_vec();
    for (i, r) in rate.iter_mut().enumerate() {
        let beside = |k: usize| from[i.saturating_sub(k)] + from[(i + k).min(from.len() - 1)];
        let taps = (1..).zip(TAPS);
        *r += taps
            .map(|(k, tap)| tap * (beside(k) - 2.0 * from[i]))
            .sum::<f64>();
    }
}

/// Few Gauss-Markov processes with correlation times `apart` in their logarithm that sum up to flicker noise of B = 1: variances
/// and correlation times in samples. int S(tau) d ln tau of 2 s^2 tau / (1 + (w tau)^2) = pi s^2 / w, and the density per sample is B^2 / w; the ripple
/// is 1 / cosh(pi^2 / apart).
fn ladder(samples: usize, apart: f64) -> Vec<(f64, f64)> {
    // Sampled, the fastest ones are white: from this correlation time on, in samples, they sum up to 1 / w at half the sample rate.
    let (shortest, longest) = (0.45, samples as f64 * 30.0);
    let count = ((longest / shortest).ln() / apart).ceil().max(1.0) as usize;
    let tau = |j: usize| shortest * ((j as f64 + 0.5) * apart).exp();
    (0..count).map(|j| (apart / PI, tau(j))).collect()
}

/// Coordinate: ln(B^2 / white variance).
struct Pink;

impl Covariance for Pink {
    fn dimensions(&self) -> usize {
        1
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        at.omega.iter().map(|w| theta[0].exp() / w).collect()
    }

    fn poles(&self, theta: &[f64], samples: usize) -> Option<Vec<(f64, f64)>> {
        let all = ladder(samples, 2.0).into_iter();
        Some(
            all.map(|(variance, p)| (theta[0].exp() * variance, (-1.0 / p).exp()))
                .collect(),
        )
    }

    fn bounds(&self, _samples: usize) -> Vec<(f64, f64)> {
        vec![(-18.0, 6.0)]
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        vec![vec![-4.5], vec![-8.0]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frequencies per sample, and the density of processes there over that of flicker noise.
    fn over_flicker(all: Vec<(f64, f64)>, made: impl Fn(f64) -> f64) -> Vec<f64> {
        let omega: Vec<f64> = (0..200)
            .map(|k| PI * (-0.05 * f64::from(k)).exp())
            .collect();
        let at = Frequencies::at(omega.clone());
        let wanted = Pink.density(&[0.0], &at);
        let each = (all.into_iter()).map(|(v, p)| at.one_pole(v, (-1.0f64 / p).exp()));
        let sum = each.fold(vec![0.0; omega.len()], |sum, d| {
            sum.iter().zip(d).map(|(a, b)| a + b).collect()
        });
        let found = sum.iter().zip(&omega).map(|(s, w)| s * made(*w));
        found.zip(wanted).map(|(f, w)| f / w).collect()
    }

    #[test]
    fn the_states_of_a_filter_have_the_density_of_flicker() {
        for apart in [1.0, 2.0] {
            for ratio in over_flicker(ladder(12_000, apart), |_| 1.0) {
                assert!((ratio - 1.0).abs() < 0.25, "{apart}: {ratio}");
            }
        }
    }

    #[test]
    fn what_is_simulated_has_the_density_of_flicker_up_to_half_the_sample_rate() {
        // The filter, by what it makes of one reading.
        let mut response = [0.0; 15];
        response[7] = 1.0;
        smooth(&mut response);
        let gain = |w: f64| -> f64 {
            let at = response.iter().zip(-7i32..);
            at.map(|(r, k)| r * (w * f64::from(k)).cos()).sum()
        };
        let all = over_flicker(half_difference(12_000), |w| gain(w).powi(2));
        for (k, ratio) in all.iter().enumerate() {
            let most = if k < 4 { 0.08 } else { 0.025 };
            assert!((ratio - 1.0).abs() < most, "{k}: {ratio}");
        }
    }
}
