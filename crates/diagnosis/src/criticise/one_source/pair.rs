//! Coherence and phase of two residuals.

use numerics::minimise::golden;
use rustfft::num_complex::Complex;

use super::MOST;

/// Steps of the search for it, each of which leaves 0.62 of where it may be; times that its phase is estimated anew.
const STEPS: usize = 40;
const ROUNDS: usize = 3;

/// Two residuals at the frequencies that both bands share, each by a weight.
pub(super) struct Pair {
    /// Product of the weights, X* Y, and the energy of both.
    each: Vec<(f64, Complex<f64>, f64)>,
}

impl Pair {
    pub(super) fn new(x: &[Complex<f64>], y: &[Complex<f64>], a: &[f64], b: &[f64]) -> Self {
        let values = x[1..].iter().zip(&y[1..]).zip(a.iter().zip(b));
        let each =
            values.map(|((x, y), (a, b))| (a * b, x.conj() * y, x.norm_sqr() + y.norm_sqr()));
        Self {
            each: each.collect(),
        }
    }

    /// Phase at which a coherence is likeliest.
    fn phase(&self, r: f64) -> f64 {
        let terms = self.each.iter();
        let sum: Complex<f64> = terms
            .map(|(w, product, _)| product * (w / (1.0 - (r * w).powi(2))))
            .sum();
        sum.arg()
    }

    /// Likelihood ratio of a coherence and a phase against none.
    fn ratio(&self, r: f64, phase: f64) -> f64 {
        let turned = Complex::from_polar(1.0, -phase);
        let terms = self.each.iter().map(|(w, product, energy)| {
            let a = r * w;
            let left = 1.0 - a * a;
            -left.ln() - (a * a * energy - 2.0 * a * (product * turned).re) / left
        });
        2.0 * terms.sum::<f64>()
    }

    /// Coherence and phase with their standard errors, and their likelihood ratio.
    pub(super) fn estimate(&self) -> ((f64, f64), (f64, f64), f64) {
        let mut r = 0.0;
        for _ in 0..ROUNDS {
            let phase = self.phase(r);
            r = golden(&|r| -self.ratio(r, phase), 0.0, MOST, STEPS);
        }
        let phase = self.phase(r);
        // Fisher's information of a correlation of complex normal values beside their variances, and of its phase.
        let [of_size, of_phase] = self
            .each
            .iter()
            .fold([0.0, 0.0], |[size, phase], (w, _, _)| {
                let square = (r * w).powi(2);
                let left = 1.0 - square;
                [size + 2.0 * (w / left).powi(2), phase + 2.0 * square / left]
            });
        let error = |information: f64| information.max(f64::MIN_POSITIVE).sqrt().recip();
        (
            (r, error(of_size)),
            (phase, error(of_phase)),
            self.ratio(r, phase),
        )
    }
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    #[test]
    fn coherence_and_phase_are_those_that_were_planted_within_their_errors() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
        let mut draw = || -> Complex<f64> {
            let [a, b]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
            Complex::new(a, b) * 0.5f64.sqrt()
        };
        for (r, phase) in [(0.3, -2.0), (0.7, 0.4), (0.95, 3.0)] {
            let (mut sizes, mut phases) = (0, 0);
            for _ in 0..200 {
                // A band that makes up to nine tenths of the variance.
                let weights: Vec<f64> = (-200..200)
                    .map(|k| (9.0 / (10.0 + (f64::from(k) / 20.0).powi(2))).sqrt())
                    .collect();
                let (mut x, mut y) = (vec![Complex::default()], vec![Complex::default()]);
                for w in &weights {
                    let (source, own) = (draw(), draw());
                    let other = r * source + (1.0f64 - r * r).sqrt() * own;
                    let left = (1.0 - w * w).sqrt();
                    x.push(w * source + left * draw());
                    y.push(w * other * Complex::from_polar(1.0, phase) + left * draw());
                }
                let (size, at, lr) = Pair::new(&x, &y, &weights, &weights).estimate();
                sizes += usize::from((size.0 - r).abs() < 1.96 * size.1);
                let off = (at.0 - phase + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU);
                phases += usize::from((off - std::f64::consts::PI).abs() < 1.96 * at.1);
                assert!(lr > 0.0);
            }
            // 190 of 200 are expected at 95 %, fewer than 180 once in 500.
            assert!(sizes >= 180 && phases >= 180, "{r}: {sizes}, {phases}");
        }
    }
}
