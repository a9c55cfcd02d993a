//! Quantization noise of a rate that is the difference of a rounded angle.

use std::f64::consts::SQRT_2;
use std::sync::Arc;

use rand_distr::{Distribution, Uniform};

use crate::effect::{
    Covariance, Docs, Effect, Example, Found, Frequencies, Hypothesis, ParameterSpec, Parameters,
    Plot, Rival, Stage, View, optional, parameter, value,
};
use crate::parameter::Parameter;
use crate::simulate::Simulation;

/// The effect.
pub struct QuantizationNoise;

/// Its id.
pub const ID: &str = "quantization_noise";

/// The one instance that the library lists.
pub static EFFECT: QuantizationNoise = QuantizationNoise;

/// Fewest samples in which it is sought.
const LEAST_SAMPLES: usize = 256;

impl Effect for QuantizationNoise {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter(
                "q",
                "deg",
                "Q of IEEE Std 952, standard deviation of the angle's rounding: its step over sqrt(12)",
            ),
            optional(
                "normal",
                "1",
                "1 where the angle's error is normal, as that of an angle that is read with noise; left out, it is that of a rounding, uniform",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Quantization noise",
            physics: "A reading is the difference of two rounded angles, over the time between them: what one reading gains by rounding, the next one loses. Two-sided spectral density 2 Q^2 f_s (1 - cos(2 pi f / f_s)), Allan deviation sqrt(3) Q / tau. Counts of an integrating gyro, or of an encoder, differenced.",
            excitation: "Nothing.",
            test: "White variance, random walk and Q refitted by maximum likelihood.",
            remedy: "Read the angle with finer steps, or sum the readings in place of differencing them; until then simulate Q beside the white noise.",
            figure: "Spectrum of the rate with the model before and after: it rises towards half the sample rate.",
            example: Example::new(Plot::Spectrum, &[("q", 0.02)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "timestamp_jitter",
                experiment: "a stand at rest: errors of the sampling instant need a rate that moves",
            },
            Rival {
                cause: "narrow_band",
                experiment: "another sample rate: a mode stays at its frequency, the rise moves with half the sample rate",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.samples < LEAST_SAMPLES {
            return Err(format!("fewer than {LEAST_SAMPLES} samples"));
        }
        Ok(vec![Hypothesis::Covariance(Arc::new(Difference))])
    }

    fn describe(&self, found: &Found) -> Parameters {
        let Some((size, error)) = found.coefficients.first() else {
            return Parameters::new();
        };
        let q = found.white_sigma * (size / 2.0).exp() / (SQRT_2 * found.rate_hz);
        let unit = match found.unit.as_str() {
            "1" => "s".to_owned(),
            other => crate::integral::of(other).1,
        };
        [(
            "q".to_owned(),
            Parameter::estimated(q, q * error / 2.0, &unit),
        )]
        .into()
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        // A rounding error is uniform within half a step, which is sqrt(3) of its standard deviation.
        let q = value(parameters, "q");
        let half_step = 3f64.sqrt() * q;
        let Ok(rounding) = Uniform::new_inclusive(-half_step, half_step) else {
            return;
        };
        let normal = value(parameters, "normal") != 0.0;
        let error = |simulation: &mut Simulation| -> f64 {
            match normal {
                true => q * simulation.normal(),
                false => rounding.sample(&mut simulation.rng),
            }
        };
        for &axis in channels {
            let mut before = error(simulation);
            for i in 0..simulation.samples {
                let now = error(simulation);
                simulation.rate[axis][i] += (now - before) * simulation.rate_hz;
                before = now;
            }
        }
    }
}

/// White noise differenced. Coordinate: ln(variance / white variance).
struct Difference;

impl Covariance for Difference {
    fn dimensions(&self) -> usize {
        1
    }

    /// Errors of rounding are uniform.
    fn is_normal(&self) -> bool {
        false
    }

    /// Of the difference of two values of a uniform law: half of its -6/5.
    fn excess_kurtosis(&self) -> f64 {
        -0.6
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        let size = theta[0].exp();
        at.cosine.iter().map(|c| size * (1.0 - c)).collect()
    }

    fn bounds(&self, _samples: usize) -> Vec<(f64, f64)> {
        // From e^-12 of the white variance, which no record tells from none, to where the standard deviation of the white noise is a hundredth of its own.
        vec![(-12.0, 9.0)]
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        vec![vec![-2.0], vec![2.0]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_density_is_that_of_white_noise_differenced() {
        let omega: Vec<f64> = (1..30).map(|i| 0.1 * f64::from(i)).collect();
        let at = Frequencies::at(omega.clone());
        let variance = 0.6f64;
        for (w, d) in omega.iter().zip(Difference.density(&[variance.ln()], &at)) {
            // |1 - exp(-i w)|^2 of an error of half the variance.
            let square = (1.0 - w.cos()).powi(2) + w.sin().powi(2);
            assert!((d - 0.5 * variance * square).abs() < 1e-12, "{w}");
        }
    }
}
