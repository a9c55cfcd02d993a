//! A filter makes neighbouring samples alike.

use std::sync::Arc;

use crate::effect::{
    Covariance, Docs, Effect, Example, Found, Frequencies, Hypothesis, ParameterSpec, Parameters,
    Plot, Rival, Stage, View, optional, parameter, value,
};
use crate::parameter::Parameter;
use crate::simulate::Simulation;

/// The effect.
pub struct LowPass;

/// Its id.
pub const ID: &str = "low_pass";

/// The one instance that the library lists.
pub static EFFECT: LowPass = LowPass;

impl Effect for LowPass {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter(
                "lag1_correlation",
                "1",
                "correlation of neighbouring samples of the white part",
            ),
            optional(
                "triangular",
                "1",
                "1 where the filter is a triangular window, 0 where it is one pole; left out, a mean of two samples up to a correlation of 0.3 and one pole beyond",
            ),
            optional(
                "pole",
                "1",
                "correlation from one lag to the next beyond the first, of one pole behind a window that is shorter than a sample; left out, lag1_correlation",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Low-pass filter",
            physics: "The white noise has passed a filter whose memory reaches over a sample: the Bartlett filter of the ADIS16250 with many taps, or a pole of the read-out.",
            excitation: "Nothing.",
            test: "White noise shaped by one pole, by one pole behind a window that is shorter than a sample, or by a triangular window, refitted by maximum likelihood.",
            remedy: "Simulate white noise through this filter, and take fewer taps, or a lower sample rate, if the filter has to see white noise.",
            figure: "Spectrum of the rate with the model before and after: it falls towards half the sample rate.",
            example: Example::new(Plot::Spectrum, &[("lag1_correlation", 0.5)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "gauss_markov",
                experiment: "change the filter taps",
            },
            Rival {
                cause: "flicker",
                experiment: "change the filter taps",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.samples < 256 {
            return Err("fewer than 256 samples".into());
        }
        Ok(vec![
            Hypothesis::Covariance(Arc::new(Pole)),
            Hypothesis::Covariance(Arc::new(Triangle)),
            Hypothesis::Covariance(Arc::new(BehindWindow)),
        ])
    }

    fn describe(&self, found: &Found) -> Parameters {
        let Some(&(theta, error)) = found.coefficients.first() else {
            return Parameters::new();
        };
        let rho = logistic(theta);
        let fixed = found
            .fixed
            .iter()
            .map(|(name, value, unit)| ((*name).to_owned(), Parameter::exact(*value, unit)));
        let size = (
            "lag1_correlation".to_owned(),
            Parameter::estimated(rho, error * rho * (1.0 - rho), "1"),
        );
        let pole = found.coefficients.get(1).map(|&(q, error)| {
            let least = least_pole(rho);
            let q_error = error * logistic(q) * (1.0 - logistic(q));
            let pole = Parameter::estimated(pole(rho, q), (rho - least) * q_error, "1");
            ("pole".to_owned(), pole)
        });
        fixed.chain([size]).chain(pole).collect()
    }

    fn stage(&self) -> Stage {
        Stage::Output
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let stated = value(parameters, "lag1_correlation");
        let kind = parameters.get("triangular").map(|p| p.value != 0.0);
        let further = parameters.get("pole").map(|p| p.value);
        for &axis in channels {
            // The correlation is that of the readings: rounding, which comes behind the filter, has none.
            let rounding = simulation.rounding[axis] / simulation.white_sigma[axis].powi(2);
            let drawn = if rounding < 1.0 { 1.0 - rounding } else { 1.0 };
            let rho = (stated / drawn).clamp(0.0, 0.999);
            let noise = &mut simulation.white[axis];
            match (kind, further) {
                (Some(true), _) => averaged(noise, &window(rho)),
                (None, None) if rho <= 0.3 => averaged(noise, &two_samples(rho)),
                // From one lag to the next rounding changes nothing.
                (_, pole) => {
                    let pole = pole.unwrap_or(stated).clamp(least_pole(rho), rho);
                    behind_a_window(noise, rho, pole);
                }
            }
        }
    }
}

/// A mean of a sample and the one before, weights 1 : w, of the lag-1 correlation w / (1 + w^2) <= 1/2; sum of squares 1.
fn two_samples(rho: f64) -> Vec<f64> {
    let w = if rho > 0.0 {
        (1.0 - (1.0 - 4.0 * rho * rho).sqrt()) / (2.0 * rho)
    } else {
        0.0
    };
    let norm = (1.0 + w * w).sqrt();
    vec![1.0 / norm, w / norm]
}

/// Taps of a noise that has the correlations of a triangular window of that lag-1 correlation, sum of squares 1: the factor
/// of its density without zeros outside the unit circle (Wilson's iteration, SIAM J. Numer. Anal. 6, 1969).
fn window(rho: f64) -> Vec<f64> {
    let unit = inverse_spline(rho);
    let all = (0..)
        .map(|l| spline(f64::from(l) * unit))
        .take_while(|r| *r > 0.0);
    let mut r: Vec<f64> = all.collect();
    r[0] += FLOOR;
    let lags = r.len();
    let mut b = vec![0.0; lags];
    b[0] = r.iter().map(|v| v.abs()).sum::<f64>().sqrt();
    for _ in 0..FACTORING {
        // The next factor x of b solves sum_i (b_i x_{i+l} + x_i b_{i+l}) = r_l + (correlation of b at l).
        let mut a = vec![vec![0.0; lags]; lags];
        let mut right = r.clone();
        for (l, (row, right)) in a.iter_mut().zip(&mut right).enumerate() {
            for i in 0..lags - l {
                row[i + l] += b[i];
                row[i] += b[i + l];
                *right += b[i] * b[i + l];
            }
        }
        b = solved(a, right);
    }
    let norm = b.iter().map(|v| v * v).sum::<f64>().sqrt();
    b.iter_mut().for_each(|v| *v /= norm);
    b
}

/// Iterations of [`window`]: they converge quadratically but near a zero of the density, where each halves what is off.
const FACTORING: usize = 40;

/// The solution of a x = right, by elimination with pivots.
fn solved(mut a: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let m = right.len();
    for k in 0..m {
        let best = (k..m)
            .max_by(|i, j| a[*i][k].abs().total_cmp(&a[*j][k].abs()))
            .unwrap_or(k);
        a.swap(k, best);
        right.swap(k, best);
        for i in k + 1..m {
            let f = a[i][k] / a[k][k];
            let (above, below) = a.split_at_mut(i);
            below[0]
                .iter_mut()
                .zip(&above[k])
                .for_each(|(v, u)| *v -= f * u);
            right[i] -= f * right[k];
        }
    }
    for k in (0..m).rev() {
        let known: f64 = (k + 1..m).map(|j| a[k][j] * right[j]).sum();
        right[k] = (right[k] - known) / a[k][k];
    }
    right
}

/// A moving average in place; what lies before the first sample is the first sample.
fn averaged(noise: &mut [f64], taps: &[f64]) {
    let given = noise.to_vec();
    for (i, v) in noise.iter_mut().enumerate() {
        let at = |k: usize| given[i.saturating_sub(k)];
        *v = taps.iter().enumerate().map(|(k, t)| t * at(k)).sum();
    }
}

/// One pole with the correlations rho and pole * rho at lags 1 and 2, in place, variance kept: x' = pole x + e' + theta e.
fn behind_a_window(noise: &mut [f64], rho: f64, pole: f64) {
    let off = rho - pole;
    let own = 1.0 + pole * pole - 2.0 * pole * rho;
    let theta = 2.0 * off / (own + (own * own - 4.0 * off * off).max(0.0).sqrt());
    let step = ((1.0 - pole * pole) / (1.0 + 2.0 * pole * theta + theta * theta)).sqrt();
    let mut before = noise.first().copied().unwrap_or(0.0);
    let mut x = before;
    for v in noise.iter_mut().skip(1) {
        let drawn = *v;
        x = pole * x + step * (drawn + theta * before);
        (*v, before) = (x, drawn);
    }
}

/// Smallest pole that noise of the lag-1 correlation `rho` can have: below it some density would be negative.
fn least_pole(rho: f64) -> f64 {
    (2.0 * rho - 1.0).max(0.0)
}

/// The pole at the coordinate `q`, between the smallest one and that of a pole alone.
fn pole(rho: f64, q: f64) -> f64 {
    let least = least_pole(rho);
    least + (rho - least) * logistic(q)
}

fn logistic(theta: f64) -> f64 {
    1.0 / (1.0 + (-theta).exp())
}

/// One pole: correlation r^|lag|. Coordinate: logit r.
struct Pole;

impl Covariance for Pole {
    fn dimensions(&self) -> usize {
        1
    }

    fn filters_white(&self) -> bool {
        true
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        at.one_pole(1.0, logistic(theta[0]))
    }

    fn fixed(&self) -> Vec<(&'static str, f64, &'static str)> {
        vec![("triangular", 0.0, "1")]
    }

    fn bounds(&self, _samples: usize) -> Vec<(f64, f64)> {
        vec![(-7.0, 3.0)]
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        vec![vec![-3.0], vec![0.0]]
    }
}

/// One pole behind a window that is shorter than a sample, as a capacitor on a part that averages: rho pole^(|lag| - 1).
/// Coordinates: logit of the lag-1 correlation, place of the pole between the smallest one and that of a pole alone.
struct BehindWindow;

impl Covariance for BehindWindow {
    fn dimensions(&self) -> usize {
        2
    }

    fn filters_white(&self) -> bool {
        true
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        let rho = logistic(theta[0]);
        let pole = pole(rho, theta[1]).max(LEAST_POLE);
        let share = rho / pole;
        let alone = at.one_pole(share, pole).into_iter();
        alone
            .map(|d| (1.0 - share + d).max(LEAST_DENSITY))
            .collect()
    }

    fn fixed(&self) -> Vec<(&'static str, f64, &'static str)> {
        vec![("triangular", 0.0, "1")]
    }

    fn bounds(&self, _samples: usize) -> Vec<(f64, f64)> {
        vec![(-7.0, 3.0), (-4.0, 4.0)]
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        vec![vec![-1.0, 1.0], vec![0.5, 2.0]]
    }
}

/// A pole of nothing, by which its share would be infinite; and a density that is none, but for the error of its terms.
const LEAST_POLE: f64 = 1e-6;
const LEAST_DENSITY: f64 = 1e-9;

/// Triangular window (the data sheet's Bartlett filter). Coordinate: logit of the lag-1 correlation.
struct Triangle;

/// Density that quantization and the electronics behind the filter leave where the window has none, over the white one.
const FLOOR: f64 = 2e-3;

/// Autocorrelation of a triangular window at `u` half-bases: the cubic B-spline, 1 at 0 and 0 from 2 on.
fn spline(u: f64) -> f64 {
    if u < 1.0 {
        1.0 - 1.5 * u * u + 0.75 * u * u * u
    } else if u < 2.0 {
        (2.0 - u).powi(3) / 4.0
    } else {
        0.0
    }
}

/// `u` at which the spline has the value `r`.
fn inverse_spline(r: f64) -> f64 {
    let (mut low, mut high) = (0.0, 2.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if spline(middle) > r {
            low = middle
        } else {
            high = middle
        }
    }
    0.5 * (low + high)
}

impl Covariance for Triangle {
    fn dimensions(&self) -> usize {
        1
    }

    fn filters_white(&self) -> bool {
        true
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        let unit = inverse_spline(logistic(theta[0]));
        let taps: Vec<f64> = (1..)
            .map(|l| spline(f64::from(l) * unit))
            .take_while(|r| *r > 0.0)
            .collect();
        at.cosine
            .iter()
            .map(|c| {
                // Sum of taps times cosines of multiples of the frequency, by Clenshaw's recurrence.
                let (first, second) = taps
                    .iter()
                    .rev()
                    .fold((0.0, 0.0), |(b, next), r| (r + 2.0 * c * b - next, b));
                let tail = 2.0 * (c * first - second);
                (1.0 + tail).max(0.0) + FLOOR
            })
            .collect()
    }

    fn fixed(&self) -> Vec<(&'static str, f64, &'static str)> {
        vec![("triangular", 1.0, "1")]
    }

    fn bounds(&self, _samples: usize) -> Vec<(f64, f64)> {
        vec![(-7.0, 3.0)]
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        vec![vec![-3.0], vec![0.0]]
    }
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    #[test]
    fn a_pole_behind_a_window_has_its_two_correlations() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut noise: Vec<f64> = (0..200_000)
            .map(|_| StandardNormal.sample(&mut rng))
            .collect();
        behind_a_window(&mut noise, 0.65, 0.5);
        let at = |lag: usize| {
            let both = noise.iter().zip(&noise[lag..]).map(|(a, b)| a * b);
            both.sum::<f64>() / noise.len() as f64
        };
        for (lag, wanted) in [(0, 1.0), (1, 0.65), (2, 0.325), (3, 0.1625)] {
            // Four standard errors of 200 000 samples that are alike over three.
            assert!((at(lag) - wanted).abs() < 0.016, "{lag}: {}", at(lag));
        }
    }

    #[test]
    fn what_is_simulated_has_the_correlations_that_are_fitted() {
        for rho in [0.1, 0.25, 0.5, 0.8] {
            let unit = inverse_spline(rho);
            let taps = window(rho);
            for lag in 0..taps.len() {
                let found: f64 = taps.iter().zip(&taps[lag..]).map(|(a, b)| a * b).sum();
                let floor = if lag == 0 { FLOOR } else { 0.0 };
                let wanted = (spline(lag as f64 * unit) + floor) / (1.0 + FLOOR);
                assert!(
                    (found - wanted).abs() < 1e-3,
                    "{rho}, lag {lag}: {found} {wanted}"
                );
            }
        }
    }
}
