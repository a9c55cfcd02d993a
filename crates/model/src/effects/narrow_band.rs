//! A mode that noise drives.

use std::f64::consts::{FRAC_PI_4, PI, TAU};
use std::sync::Arc;

use crate::effect::{
    Covariance, Docs, Effect, Example, Found, Frequencies, Hypothesis, ParameterSpec, Parameters,
    Peak, Plot, Rival, Stage, View, optional, parameter, value,
};
use crate::one_source::{self, with_shared};
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
        const PARAMETERS: &[ParameterSpec] = &with_shared::<4, 16>([
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
            optional(
                "skew",
                "1",
                "1 where the rate is what a driven mode is displaced by, -1 where it is its velocity; 0, left out, is a Lorentzian peak, as high on either side",
            ),
        ]);
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Narrow band",
            physics: "A mode of the structure or of the sensor that noise drives (a fan, a shaking floor, a bearing): autocorrelation rms^2 exp(-d |t|) (cos w t + skew (d / w) sin w |t|) with w = 2 pi center_frequency and d = pi bandwidth; its quality factor is center_frequency / bandwidth. By its displacement (skew 1) the slow side of the peak is higher, by its velocity (-1) the fast side; of a narrow one no record tells.",
            excitation: "Nothing; some ten times 1 / bandwidth.",
            test: "Energy of the whitened residual over all centres and widths, then all noise refitted by maximum likelihood, with the skew that is clearly likelier; the envelope tells it from a tone whose pitch wanders, and has to be as simulations of the noise make it.",
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
            skew: 0.0,
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
        let fixed = found.fixed.iter();
        let fixed = fixed.map(|f| (f.0.to_owned(), Parameter::exact(f.1, f.2)));
        let sizes = [
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
        ];
        fixed.chain(sizes).collect()
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let (rms, centre) = (
            value(parameters, "rms"),
            value(parameters, "center_frequency"),
        );
        let (width, skew) = (value(parameters, "bandwidth"), value(parameters, "skew"));
        let keeps = simulation.keeps(parameters);
        for &axis in channels {
            let split = simulation.split(axis, [centre, width], parameters);
            let own = rms * split.own;
            let unit = rms.max(f64::MIN_POSITIVE);
            let mut turning = Vec::new();
            let seen = |z: [f64; 2]| {
                if keeps {
                    turning.push(z.map(|v| v / unit));
                }
            };
            if skew == 0.0 {
                simulation.add_mode(axis, own, centre, width, seen);
            } else {
                let of = Resonator::new(centre, width, skew, simulation.rate_hz);
                simulation.add_resonator(axis, own, &of, seen);
            }
            simulation.add_shared(axis, [rms, centre, width], &split, turning);
        }
    }

    fn same_event(&self, a: &Parameters, b: &Parameters) -> bool {
        one_source::is_one(a, b, "bandwidth")
    }
}

/// A mode about a place: its coordinates are ln(variance / white variance), the way of the centre from that place in half
/// widths of it, and ln(half width over that one).
struct Mode {
    omega: f64,
    half_width: f64,
    /// Of the sine in the autocovariance, in units of that of the mode's displacement.
    skew: f64,
}

/// Widest band over its centre: what is wider is no narrow one.
const WIDEST: f64 = 0.5;
/// Least half width in spacings of the coefficients: what is narrower is a line for the record.
const NARROWEST: f64 = 1.5;
/// How many times narrower than where it was seen a band may be: a likelihood over bins that resolve the one does not see much
/// less.
const FINER: f64 = 4.0;

/// The part of the sine in the autocovariance of a mode, per sample: that of its displacement is decay over frequency.
fn sine_part(skew: f64, decay: f64, turn: f64) -> f64 {
    skew * decay / turn
}

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

    fn fixed(&self) -> Vec<(&'static str, f64, &'static str)> {
        if self.skew == 0.0 {
            return vec![];
        }
        vec![("skew", self.skew, "1")]
    }

    /// The autocovariance v p^|k| (cos(omega k) + s sin(omega |k|)), sampled: half a one-pole density either side of its
    /// centre, and what the sine leans them by.
    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        let (omega, half) = self.place(theta);
        let (p, lost) = ((-half).exp(), -(-half).exp_m1());
        let (top, least) = (theta[0].exp() * lost * (1.0 + p), lost * lost);
        let middle = omega.cos();
        let s = sine_part(self.skew, half, omega);
        let leaning = 2.0 * theta[0].exp() * s * p * omega.sin();
        at.cosine
            .iter()
            .map(|c| {
                // Of a = 1 - cos(w - omega) and b = 1 - cos(w + omega): their sum and their product.
                let (sum, product) = (2.0 - 2.0 * c * middle, (c - middle).powi(2));
                let over = least * (least + 2.0 * p * sum) + 4.0 * p * p * product;
                let lean = least * c + 2.0 * p * (c - middle);
                (top * (least + p * sum) + leaning * lean) / over
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
        let mode = Self {
            omega,
            half_width,
            skew: self.skew,
        };
        Some((Arc::new(mode), vec![variance.ln(), 0.0, 0.0]))
    }

    fn variants(&self) -> Vec<Arc<dyn Covariance>> {
        let all = [-1.0, 0.0, 1.0].into_iter();
        let others = all.filter(|skew| *skew != self.skew);
        let variant = |skew| Arc::new(Self { skew, ..*self }) as Arc<dyn Covariance>;
        others.map(variant).collect()
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

/// A sampled mode of autocovariance rms^2 p^|k| (cos(w k) + s sin(w |k|)), as the one process of two poles and a zero that has
/// it: y(k) = 2 p cos(w) y(k - 1) - p^2 y(k - 2) + e(k) + zero e(k - 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Resonator {
    /// Factors of the two readings before.
    before: [f64; 2],
    zero: f64,
    /// Standard deviation of e in units of the rms.
    driven: f64,
    /// Correlation of neighbours.
    neighbours: f64,
    /// Angle by which it turns in a sample, rad.
    turn: f64,
}

impl Resonator {
    /// Of centre and full width at half power, Hz, at a sample rate.
    pub(crate) fn new(center: f64, width: f64, skew: f64, rate_hz: f64) -> Self {
        let (decay, turn) = (PI * width / rate_hz, TAU * center / rate_hz);
        let p = (-decay).exp();
        let (sin, cos) = turn.sin_cos();
        let s = sine_part(skew, decay, turn);
        // (1 + zero^2 + 2 zero cos w) driven^2 is the numerator of the density, a + b cos w.
        let a = (1.0 - p * p) * (1.0 + p * p) - 4.0 * s * p * p * cos * sin;
        let b = 2.0 * p * (s * sin * (1.0 + p * p) - cos * (1.0 - p * p));
        let zero = b / (a + (a * a - b * b).max(0.0).sqrt());
        Self {
            before: [2.0 * p * cos, -p * p],
            zero,
            driven: (a / (1.0 + zero * zero)).max(0.0).sqrt(),
            neighbours: p * (cos + s * sin),
            turn,
        }
    }
}

impl Simulation {
    /// Adds to the rate of an axis a mode of that standard deviation, deg/s, in its stationary state. Where a stretch is left
    /// out it begins anew. As of [`Simulation::add_mode`], both quadratures are told to `seen`.
    fn add_resonator(
        &mut self,
        axis: usize,
        size: f64,
        of: &Resonator,
        mut seen: impl FnMut([f64; 2]),
    ) {
        let (sin, cos) = of.turn.sin_cos();
        // By half a turn a sample it has one quadrature.
        let over = if sin.abs() > f64::EPSILON.sqrt() {
            sin.recip()
        } else {
            0.0
        };
        let mut rates = std::mem::take(&mut self.rate[axis]);
        for k in 0..self.stretches.len() {
            // The two readings before and what drove the last one, which is all of it that the one before does not hold.
            let (older, driven) = (self.normal(), of.driven * self.normal());
            let rest = 1.0 - of.neighbours.powi(2) - of.driven.powi(2);
            let last = of.neighbours * older + driven + rest.max(0.0).sqrt() * self.normal();
            let (mut y, mut e) = ([last, older], driven);
            for rate in &mut rates[self.stretches[k].samples.clone()] {
                *rate += size * y[0];
                seen([y[0], (y[1] - cos * y[0]) * over].map(|v| size * v));
                let next = of.driven * self.normal();
                y = [
                    of.before[0] * y[0] + of.before[1] * y[1] + next + of.zero * e,
                    y[0],
                ];
                e = next;
            }
        }
        self.rate[axis] = rates;
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
            skew: 0.0,
        };
        let theta = [0.7, 0.3, -0.2];
        let (omega, half) = mode.place(&theta);
        let frequencies: Vec<f64> = (1..40).map(|i| 0.078 * f64::from(i)).collect();
        let at = Frequencies::at(frequencies.clone());
        for skew in [-1.0, 0.0, 1.0] {
            let mode = Mode { skew, ..mode };
            for (w, d) in frequencies.iter().zip(mode.density(&theta, &at)) {
                let lag = |k: i32| {
                    let (sin, cos) = (omega * f64::from(k)).sin_cos();
                    (-half * f64::from(k)).exp()
                        * (cos + skew * half / omega * sin)
                        * (w * f64::from(k)).cos()
                };
                let sum = 1.0 + 2.0 * (1..2000).map(lag).sum::<f64>();
                assert!((d / (0.7f64.exp() * sum) - 1.0).abs() < 1e-9, "{w} {skew}");
            }
        }
    }

    #[test]
    fn a_resonator_has_its_autocovariance() {
        for (center, width, skew) in [(1.2, 0.8, 1.0), (3.0, 1.0, -1.0), (7.5, 0.4, 1.0)] {
            let of = Resonator::new(center, width, skew, 20.0);
            let (decay, turn) = (PI * width / 20.0, TAU * center / 20.0);
            let lag = |k: f64| {
                (-decay * k).exp() * ((turn * k).cos() + skew * decay / turn * (turn * k).sin())
            };
            assert!((of.neighbours - lag(1.0)).abs() < 1e-12);
            // Yule and Walker: r(0) and r(1) by what drives it, further ones by the poles.
            let q = of.driven.powi(2);
            let [a, b] = of.before;
            let own = a * lag(1.0) + b * lag(2.0) + q * (1.0 + of.zero * (a + of.zero));
            assert!((own - 1.0).abs() < 1e-9, "{own}");
            assert!((a * lag(0.0) + b * lag(1.0) + of.zero * q - lag(1.0)).abs() < 1e-9);
            assert!((a * lag(1.0) + b * lag(0.0) - lag(2.0)).abs() < 1e-9);
        }
    }

    #[test]
    fn coordinates_are_told_as_centre_and_width_with_their_errors() {
        let mode = Mode {
            omega: 0.8,
            half_width: 0.05,
            skew: 0.0,
        };
        let told = mode.described(&[(0.7, 0.1), (2.0, 0.5), (0.1, 0.2)]);
        assert_eq!(told[0], (0.7, 0.1));
        assert!((told[1].0 - 0.9).abs() < 1e-12 && (told[1].1 - 0.025).abs() < 1e-12);
        assert!((told[2].0.exp() - 0.05 * 0.1f64.exp()).abs() < 1e-12 && told[2].1 == 0.2);
    }
}
