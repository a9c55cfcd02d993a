//! A mode that noise drives.

use std::f64::consts::{FRAC_PI_4, PI, TAU};
use std::sync::Arc;

use crate::effect::{
    Covariance, Docs, Effect, Example, Found, Frequencies, Hypothesis, ParameterSpec, Parameters,
    Peak, Plot, Rival, Stage, View, parameter, value,
};
use crate::parameter::Parameter;
use crate::simulate::Simulation;

/// The effect.
pub struct NarrowBand;

/// Its id.
pub const ID: &str = "narrow_band";

/// The one instance that the library lists.
pub static EFFECT: NarrowBand = NarrowBand;

/// Fewest samples in which a band is sought.
pub(super) const LEAST_SAMPLES: usize = 256;

impl Effect for NarrowBand {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("rms", "deg/s", "standard deviation"),
            parameter(
                "center_frequency",
                "Hz",
                "frequency of the mode as sampled; the true one may be an alias",
            ),
            parameter(
                "bandwidth",
                "Hz",
                "full width of its spectrum at half power",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Narrow band",
            physics: "Autocorrelation rms^2 exp(-pi bandwidth |t|) cos(2 pi center_frequency t), a Lorentzian peak of the spectrum: a mode of the structure or of the sensor that noise drives (a fan, a shaking floor, a bearing); its quality factor is center_frequency / bandwidth.",
            excitation: "Nothing; some ten times 1 / bandwidth.",
            test: "Energy of the whitened residual over all centres and widths, then all noise refitted by maximum likelihood; the envelope tells it from a tone whose pitch wanders.",
            remedy: "Stiffen or damp the mode at this frequency, or filter the band; until then simulate it as a second-order process.",
            figure: "Spectrum of the rate with the model before and after: a peak that is wider than a line.",
            example: Example::new(
                Plot::Spectrum,
                &[("center_frequency", 4.0), ("bandwidth", 0.3), ("rms", 0.25)],
            ),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "wandering_line",
                experiment: "a record that is long against 1 / bandwidth: a noise-driven mode comes and goes, a tone keeps its size",
            },
            Rival {
                cause: "line",
                experiment: "a longer record: a line grows out of its surroundings, a band does not",
            },
            Rival {
                cause: "gauss_markov",
                experiment: "a longer record",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.samples < LEAST_SAMPLES {
            return Err(format!("fewer than {LEAST_SAMPLES} samples"));
        }
        // Where no peak is sought it stands a quarter of the way to the highest frequency, a tenth of that wide.
        Ok(vec![Hypothesis::Covariance(Arc::new(Mode {
            omega: FRAC_PI_4,
            half_width: FRAC_PI_4 / 20.0,
        }))])
    }

    fn describe(&self, found: &Found) -> Parameters {
        let [(a, a_error), (omega, omega_error), (half, half_error), ..] = found.coefficients[..]
        else {
            return Parameters::new();
        };
        let rms = found.white_sigma * (a / 2.0).exp();
        let hz = found.rate_hz / TAU;
        let width = 2.0 * half.exp() * hz;
        [
            (
                "rms".to_owned(),
                Parameter::estimated(rms, rms * a_error / 2.0, &found.unit),
            ),
            (
                "center_frequency".to_owned(),
                Parameter::estimated(omega * hz, omega_error * hz, "Hz"),
            ),
            (
                "bandwidth".to_owned(),
                Parameter::estimated(width, width * half_error, "Hz"),
            ),
        ]
        .into()
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let (rms, centre) = (
            value(parameters, "rms"),
            value(parameters, "center_frequency"),
        );
        let width = value(parameters, "bandwidth");
        for &axis in channels {
            simulation.add_mode(axis, rms, centre, width);
        }
    }
}

/// A mode about a place: its coordinates are ln(variance / white variance), the way of the centre from that place in half
/// widths of it, and ln(half width over that one).
struct Mode {
    omega: f64,
    half_width: f64,
}

/// Widest band over its centre: what is wider is no narrow one.
const WIDEST: f64 = 0.5;
/// Least half width in spacings of the coefficients: what is narrower is a line for the record.
const NARROWEST: f64 = 1.5;
/// How many times narrower than where it was seen a band may be: a likelihood over bins that resolve the one does not see much
/// less.
const FINER: f64 = 4.0;

impl Mode {
    fn place(&self, theta: &[f64]) -> (f64, f64) {
        (
            self.omega + theta[1] * self.half_width,
            self.half_width * theta[2].exp(),
        )
    }
}

impl Covariance for Mode {
    fn dimensions(&self) -> usize {
        3
    }

    /// The autocovariance v p^|k| cos(omega k), sampled: half a one-pole density either side of its centre.
    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        let (omega, half) = self.place(theta);
        let (p, lost) = ((-half).exp(), -(-half).exp_m1());
        let (top, least) = (theta[0].exp() * lost * (1.0 + p), lost * lost);
        let middle = omega.cos();
        at.cosine
            .iter()
            .map(|c| {
                // Of a = 1 - cos(w - omega) and b = 1 - cos(w + omega): their sum and their product.
                let (sum, product) = (2.0 - 2.0 * c * middle, (c - middle).powi(2));
                top * (least + p * sum) / (least * (least + 2.0 * p * sum) + 4.0 * p * p * product)
            })
            .collect()
    }

    fn bounds(&self, samples: usize) -> Vec<(f64, f64)> {
        let spacing = PI / samples as f64;
        let ways = [spacing, PI - spacing].map(|w| (w - self.omega) / self.half_width);
        let least = (NARROWEST * spacing / self.half_width).ln();
        let least = least.max(-FINER.ln());
        let most = (0.5 * WIDEST * self.omega / self.half_width)
            .ln()
            .max(least);
        vec![(-16.0, 14.0), (ways[0], ways[1]), (least, most)]
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        vec![vec![-3.0, 0.0, 0.0]]
    }

    fn about(&self, peak: &Peak) -> Option<(Arc<dyn Covariance>, Vec<f64>)> {
        let Peak {
            omega,
            half_width,
            variance,
        } = *peak;
        Some((
            Arc::new(Self { omega, half_width }),
            vec![variance.ln(), 0.0, 0.0],
        ))
    }

    fn is_peak(&self) -> bool {
        true
    }

    fn peak(&self, theta: &[f64]) -> Option<Peak> {
        let (omega, half_width) = self.place(theta);
        Some(Peak {
            omega,
            half_width,
            variance: theta[0].exp(),
        })
    }

    /// ln(variance / white variance), centre in rad per sample, ln of the half width in rad per sample.
    fn described(&self, coordinates: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let [size, (way, way_error), (width, width_error)] = coordinates else {
            return vec![];
        };
        vec![
            *size,
            (
                self.omega + way * self.half_width,
                way_error * self.half_width,
            ),
            (self.half_width.ln() + width, *width_error),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_density_is_the_transform_of_its_autocovariance() {
        let mode = Mode {
            omega: 0.8,
            half_width: 0.05,
        };
        let theta = [0.7, 0.3, -0.2];
        let (omega, half) = mode.place(&theta);
        let frequencies: Vec<f64> = (1..40).map(|i| 0.078 * f64::from(i)).collect();
        let at = Frequencies {
            cosine: frequencies.iter().map(|w| w.cos()).collect(),
            omega: frequencies.clone(),
        };
        for (w, d) in frequencies.iter().zip(mode.density(&theta, &at)) {
            let lag = |k: i32| {
                (-half * f64::from(k)).exp()
                    * (omega * f64::from(k)).cos()
                    * (w * f64::from(k)).cos()
            };
            let sum = 1.0 + 2.0 * (1..2000).map(lag).sum::<f64>();
            assert!((d / (0.7f64.exp() * sum) - 1.0).abs() < 1e-9, "{w}");
        }
    }

    #[test]
    fn coordinates_are_told_as_centre_and_width_with_their_errors() {
        let mode = Mode {
            omega: 0.8,
            half_width: 0.05,
        };
        let told = mode.described(&[(0.7, 0.1), (2.0, 0.5), (0.1, 0.2)]);
        assert_eq!(told[0], (0.7, 0.1));
        assert!((told[1].0 - 0.9).abs() < 1e-12 && (told[1].1 - 0.025).abs() < 1e-12);
        assert!((told[2].0.exp() - 0.05 * 0.1f64.exp()).abs() < 1e-12 && told[2].1 == 0.2);
    }
}
