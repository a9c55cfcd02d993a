//! What is left of the white noise of a channel: the course of its size, the shape of its distribution, and what it shares with
//! another axis.

use std::f64::consts::PI;

use crate::search::searched::Searched;
use numerics::column::dot;
use numerics::tails::{chi_square, two_sided};

/// Chance below which a domain has a term, on a channel where something is left over: not a level of alarms.
const LEVEL: f64 = 1e-2;
/// Stretches of time in which the size of the noise is told, and fewest samples of each.
const STRETCHES: usize = 60;
const LEAST_SAMPLES: usize = 200;
/// Least variance of a stretch over that of the record: none is silent.
const LEAST_FACTOR: f64 = 1e-3;

/// White residual of a channel, of variance 1 in the mean, and the channel as it is told by.
pub(super) struct White<'a> {
    s: &'a Searched<'a>,
    /// In time.
    e: Vec<f64>,
    /// Density over the bins, over the white variance of the causes' model.
    density: Vec<f64>,
}

impl<'a> White<'a> {
    /// Of a channel whose noise has this density.
    pub fn of(s: &'a Searched<'a>, density: Vec<f64>) -> Self {
        let panel = &s.search.panel;
        let bins = &panel.bins;
        let model = s.state.noise.over(bins);
        let ratio: Vec<f64> = model
            .iter()
            .zip(&density)
            .map(|(g, d)| (g / d).sqrt())
            .collect();
        let u: Vec<f64> = (s.u.iter().zip(bins.spread(&ratio)))
            .map(|(u, r)| u * r)
            .collect();
        let mut e = panel.dct.inverse(&u);
        s.variance.divide(&mut e);
        Self { s, e, density }
    }

    /// Mean square, skewness and excess kurtosis.
    fn moments(&self) -> [f64; 3] {
        let n = self.e.len() as f64;
        let about = |power: i32| self.e.iter().map(|e| e.powi(power)).sum::<f64>() / n;
        let square = about(2);
        [
            square,
            about(3) / square.powf(1.5),
            about(4) / (square * square) - 3.0,
        ]
    }

    /// Times of stretches, s, and the factor of the variance in each, where it is not the same throughout.
    pub fn course(&self, rate_hz: f64) -> Option<(Vec<f64>, Vec<f64>)> {
        let n = self.e.len();
        let count = (n / LEAST_SAMPLES).min(STRETCHES);
        if count < 2 {
            return None;
        }
        let [square, _, kurtosis] = self.moments();
        let length = n / count;
        let factors: Vec<f64> = (self.e.chunks_exact(length).take(count))
            .map(|e| dot(e, e) / (length as f64 * square))
            .collect();
        // The square of a value of kurtosis 3 + k has the variance 2 + k.
        let error = (2.0 + kurtosis.max(0.0)) / length as f64;
        let far: f64 = factors.iter().map(|f| (f - 1.0).powi(2) / error).sum();
        let degrees = (count - 1) as f64;
        if chi_square(far, degrees) > LEVEL {
            return None;
        }
        // What of the differences is not chance (James and Stein).
        let kept = (1.0 - degrees / far).max(0.0);
        let middle = |k: usize| (k as f64 + 0.5) * length as f64 / rate_hz;
        let mut told: Vec<f64> = (factors.iter())
            .map(|f| (1.0 + kept * (f - 1.0)).max(LEAST_FACTOR))
            .collect();
        // The white variance is the mean over the record.
        let mean = mean_of_course(&told);
        told.iter_mut().for_each(|f| *f /= mean);
        Some(((0..count).map(middle).collect(), told))
    }

    /// Skewness and excess kurtosis of the white noise of the readings before they are rounded, where they are not those of a
    /// normal one.
    pub fn shape(&self) -> Option<[f64; 2]> {
        let n = self.e.len() as f64;
        let [_, third, fourth] = self.moments();
        let scores = [third * (n / 6.0).sqrt(), fourth * (n / 24.0).sqrt()];
        if scores.iter().all(|z| two_sided(*z) > LEVEL) {
            return None;
        }
        let told = |k: usize, v: f64| {
            if two_sided(scores[k]) > LEVEL { 0.0 } else { v }
        };
        let [of_third, of_fourth] = self.cumulants();
        let white = self.s.state.solution.white;
        let step = self.s.target.step;
        // Sheppard's corrections: rounding adds h^2 / 12 to the variance and -h^4 / 120 to the fourth cumulant.
        let own = 1.0 - (step * step / (12.0 * white)).min(0.9);
        let rounding = step.powi(4) / (120.0 * white * white);
        let third = told(0, third) / (of_third * own.powf(1.5));
        let [least, most] = model::unnamed::SKEWNESS_LIMITS;
        let third = third.clamp(least, most);
        let fourth = told(1, fourth);
        let fourth = if fourth == 0.0 {
            0.0
        } else {
            let of_white = (fourth / of_fourth + rounding) / (own * own);
            let [least, most] = model::unnamed::EXCESS_KURTOSIS_LIMITS;
            of_white.clamp(least, most)
        };
        Some([third, fourth])
    }

    /// What the third and the fourth cumulant of white noise of variance 1 are once it is whitened: the sums of the powers of
    /// what an impulse becomes.
    fn cumulants(&self) -> [f64; 2] {
        let panel = &self.s.search.panel;
        let n = self.e.len();
        let mut impulse = vec![0.0; n];
        impulse[n / 2] = 1.0;
        let by: Vec<f64> = self.density.iter().map(|d| d.sqrt().recip()).collect();
        let through: Vec<f64> = (panel.dct.forward(&impulse).iter())
            .zip(panel.bins.spread(&by))
            .map(|(c, by)| c * by)
            .collect();
        let response = panel.dct.inverse(&through);
        [3, 4].map(|p| response.iter().map(|v| v.powi(p)).sum())
    }

    /// Slope over a recorded channel, unit of the readings over its unit, where they follow it.
    pub fn slope_over(&self, values: &[f64]) -> Option<f64> {
        let panel = &self.s.search.panel;
        if values.len() != self.e.len() {
            return None;
        }
        let white = self.s.state.solution.white;
        let by: Vec<f64> = self
            .density
            .iter()
            .map(|d| (d * white).sqrt().recip())
            .collect();
        let by = panel.bins.spread(&by);
        let whitened =
            |c: Vec<f64>| -> Vec<f64> { c.iter().zip(&by).map(|(c, by)| c * by).collect() };
        let z = whitened(panel.dct.forward(values));
        let u = panel.dct.forward(&self.e);
        let (product, square) = (dot(&u, &z), dot(&z, &z));
        let far = square > 0.0 && two_sided(product / square.sqrt()) < LEVEL;
        far.then(|| product / square)
    }

    /// Correlation of the white noise with that of another axis, where there is one.
    pub fn shared_with(&self, other: &Self) -> Option<f64> {
        let n = self.e.len();
        if other.e.len() != n {
            return None;
        }
        let r = dot(&self.e, &other.e) / (dot(&self.e, &self.e) * dot(&other.e, &other.e)).sqrt();
        if two_sided(r * (n as f64).sqrt()) > LEVEL {
            return None;
        }
        // White noise is a part of what is whitened: the mean of 1 / sqrt(g g') over the frequencies.
        let counts = self.s.search.panel.bins.counts();
        let part = |w: &White<'_>| -> Vec<f64> {
            let by: Vec<f64> = w.density.iter().map(|d| d.sqrt().recip()).collect();
            w.s.search.panel.bins.spread(&by)
        };
        let in_all: f64 = counts.iter().sum();
        let white = dot(&part(self), &part(other)) / in_all;
        Some(r / white)
    }
}

/// Mean of a factor whose logarithm goes straight from the middle of each stretch to that of the next, as a simulation has it.
fn mean_of_course(factors: &[f64]) -> f64 {
    let between = |w: &[f64]| {
        let by = (w[1] / w[0]).ln();
        if by.abs() < 1e-6 {
            0.5 * (w[0] + w[1])
        } else {
            (w[1] - w[0]) / by
        }
    };
    let ends = factors.first().zip(factors.last());
    let ends = ends.map_or(0.0, |(a, b)| 0.5 * (a + b));
    let all = factors.windows(2).map(between).sum::<f64>() + ends;
    all / factors.len().max(1) as f64
}

/// Angular frequency in Hz.
pub(super) fn hz(omega: f64, rate_hz: f64) -> f64 {
    0.5 * rate_hz * omega / PI
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_a_course_is_that_of_what_is_simulated() {
        let factors = [1.4f64, 0.9, 0.6, 0.6, 2.0];
        let steps = 10_000;
        let at = |k: i32| {
            let place = 5.0 * (f64::from(k) + 0.5) / f64::from(steps) - 0.5;
            let place = place.clamp(0.0, 4.0);
            let low = (place as usize).min(3);
            let part = place - low as f64;
            (factors[low].ln() * (1.0 - part) + factors[low + 1].ln() * part).exp()
        };
        let mean = (0..steps).map(at).sum::<f64>() / f64::from(steps);
        let told = mean_of_course(&factors);
        assert!((told / mean - 1.0).abs() < 1e-4, "{told} {mean}");
    }
}
