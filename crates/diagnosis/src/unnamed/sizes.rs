//! Sizes of shapes that a spectrum is the sum of, by the likelihood of the energies in bins.

use std::f64::consts::PI;

use super::bump::Bump;
use crate::fit::likelihood::{Bins, invert};
use numerics::column::dot;

/// Score, the square of a standard normal value of one sign, that a further bump has to reach: bumps are sought where something is
/// left, and what three standard errors make is in the simulations too.
pub(super) const LEAST_SCORE: f64 = 9.0;
/// Widths of a bump about the bin that stands out most, over that of the bin.
const WIDTHS_OF_A_BIN: [f64; 3] = [1.0, 3.0, 9.0];
/// Least part of the information on a bump that what is fitted beside it leaves: of less nothing is told.
const LEAST_LEFT: f64 = 0.02;
/// Part of a shape below which it is what others make together.
const LEAST_OWN: f64 = 1e-8;
/// Most steps of a fit, least part of one, and what a further one has to gain, nats.
const MOST_STEPS: usize = 40;
const LEAST_STEP: f64 = 1e-3;
const ENOUGH: f64 = 1e-4;
/// Standard errors by which a size that is zero has to rise.
const LEAST_RISE: f64 = 1e-3;

/// The sums that a fit runs over.
pub(super) struct Fit<'a> {
    pub counts: &'a [f64],
    /// Energy of a coefficient over the white variance.
    pub power: Vec<f64>,
    /// What has a name and stays.
    pub named: Vec<f64>,
    /// White noise, random walk, bumps.
    pub shapes: Vec<Vec<f64>>,
    pub sizes: Vec<f64>,
}

impl Fit<'_> {
    pub fn density(&self) -> Vec<f64> {
        let mut sum = self.named.clone();
        for (shape, size) in self.shapes.iter().zip(&self.sizes) {
            let each = sum.iter_mut().zip(shape);
            each.for_each(|(s, v)| *s += size * v);
        }
        sum
    }

    /// Likelihood ratio's derivative by the size of a shape, over its standard deviation beside the sizes that are fitted along with
    /// it: a broad bump is nearly white, and what white noise takes up of it is no information.
    pub fn score(&self, density: &[f64], shape: &[f64], beside: &[Vec<f64>]) -> f64 {
        let own = self.relative(density, shape);
        let off = self.counts.iter().zip(&self.power).zip(density);
        let up: f64 = (off.zip(&own))
            .map(|(((m, p), s), v)| (0.5 * m).sqrt() * (p / s - 1.0) * v)
            .sum();
        let taken: f64 = beside.iter().map(|b| dot(b, &own).powi(2)).sum();
        let information = dot(&own, &own);
        let left = (information - taken).max(LEAST_LEFT * information);
        up / left.sqrt().max(f64::MIN_POSITIVE)
    }

    /// Bumps about the bin that stands out most of the density: what is narrow stands between the places of any list.
    pub fn about_the_highest(&self, density: &[f64], bins: &Bins) -> Vec<Bump> {
        let off = self.counts.iter().zip(&self.power).zip(density);
        let scores = off.map(|((m, p), s)| (0.5 * m).sqrt() * (p / s - 1.0));
        let highest = scores.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        let found = highest.filter(|(_, z)| *z > 0.0 && z * z > LEAST_SCORE);
        let of_bin = |k: usize| {
            let width = self.counts[k] * PI / bins.n as f64;
            WIDTHS_OF_A_BIN.map(|by| Bump {
                center: bins.at.omega[k],
                width: by * width,
                variance: 1.0,
            })
        };
        found.map_or(vec![], |(k, _)| of_bin(k).into())
    }

    /// A shape over the density, by the root of the information of each bin.
    fn relative(&self, density: &[f64], shape: &[f64]) -> Vec<f64> {
        let each = self.counts.iter().zip(density).zip(shape);
        each.map(|((m, s), v)| (0.5 * m).sqrt() * v / s).collect()
    }

    /// The directions of the shapes of these places, each without what those before it have.
    pub fn directions(
        &self,
        density: &[f64],
        places: impl Iterator<Item = usize>,
    ) -> Vec<Vec<f64>> {
        let mut all: Vec<Vec<f64>> = vec![];
        for k in places {
            let mut own = self.relative(density, &self.shapes[k]);
            let before = dot(&own, &own);
            for other in &all {
                let by = dot(&own, other);
                own.iter_mut().zip(other).for_each(|(a, b)| *a -= by * b);
            }
            let left = dot(&own, &own);
            if left > LEAST_OWN * before {
                own.iter_mut().for_each(|a| *a /= left.sqrt());
                all.push(own);
            }
        }
        all
    }

    /// Sizes climb the likelihood and stay positive.
    ///
    /// # Source
    /// Fevotte, Idier (2011), Algorithms for nonnegative matrix factorization with the beta-divergence, Neural Comput. 23:
    /// 2421-2456: multiplicative updates of the Itakura-Saito divergence, exponent 1/2, under which it falls.
    pub fn climb(&mut self, rounds: usize) {
        for _ in 0..rounds {
            let density = self.density();
            for (shape, size) in self.shapes.iter().zip(&mut self.sizes) {
                let each = self.counts.iter().zip(&self.power).zip(&density).zip(shape);
                let (more, less) = each.fold((0.0, 0.0), |(more, less), (((m, p), s), v)| {
                    let part = m * v / s;
                    (more + part * p / s, less + part)
                });
                if less > 0.0 {
                    *size *= (more / less).sqrt();
                }
            }
        }
    }

    /// ln likelihood of sizes.
    fn log_likelihood(&self) -> f64 {
        let density = self.density();
        let each = self.counts.iter().zip(&self.power).zip(&density);
        -0.5 * each.map(|((m, p), s)| m * (s.ln() + p / s)).sum::<f64>()
    }

    /// The sizes that are most likely, none below zero: steps by the information, each the least squares of sizes that are not
    /// negative. Along what is nearly white together the likelihood hardly changes, and a climb by factors stands still there.
    pub fn settle(&mut self) {
        let mut best = self.log_likelihood();
        for _ in 0..MOST_STEPS {
            let (from, to) = (self.sizes.clone(), self.step());
            let mut part = 1.0;
            let gained = loop {
                let way = from.iter().zip(&to);
                self.sizes = way.map(|(a, b)| a + part * (b - a)).collect();
                let now = self.log_likelihood();
                if now > best {
                    break now - best;
                }
                part *= 0.5;
                if part < LEAST_STEP {
                    self.sizes = from;
                    return;
                }
            };
            best += gained;
            if gained < ENOUGH {
                return;
            }
        }
    }

    /// Where the least squares of the energies, by the information at these sizes, has them.
    fn step(&self) -> Vec<f64> {
        let density = self.density();
        let all: Vec<Vec<f64>> = (self.shapes.iter())
            .map(|shape| self.relative(&density, shape))
            .collect();
        let each = self.counts.iter().zip(&self.power).zip(&self.named);
        let wanted: Vec<f64> = (each.zip(&density))
            .map(|(((m, p), n), s)| (0.5 * m).sqrt() * (p - n) / s)
            .collect();
        let products: Vec<Vec<f64>> = (all.iter())
            .map(|a| all.iter().map(|b| dot(a, b)).collect())
            .collect();
        let along: Vec<f64> = all.iter().map(|a| dot(a, &wanted)).collect();
        not_negative(&products, &along, &self.sizes)
    }

    /// Takes out what the others make as well without it, beginning with what costs least, of the shapes behind the first `fixed`;
    /// the places of what stays among them.
    pub fn prune(&mut self, fixed: usize, least: f64) -> Vec<usize> {
        let mut stay: Vec<usize> = (fixed..self.shapes.len()).collect();
        self.settle();
        while !stay.is_empty() {
            let with = self.log_likelihood();
            let density = self.density();
            let cost = |k: usize| {
                let own = self.relative(&density, &self.shapes[k]);
                let others = (0..self.shapes.len()).filter(|j| *j != k);
                let beside = self.directions(&density, others);
                let taken: f64 = beside.iter().map(|b| dot(b, &own).powi(2)).sum();
                self.sizes[k].powi(2) * (dot(&own, &own) - taken).max(0.0)
            };
            let costs = (fixed..self.shapes.len()).map(|k| (k, cost(k)));
            let Some((k, _)) = costs.min_by(|a, b| a.1.total_cmp(&b.1)) else {
                break;
            };
            let (shape, before) = (self.shapes.remove(k), self.sizes.clone());
            self.sizes.remove(k);
            self.settle();
            if 2.0 * (with - self.log_likelihood()) > least {
                self.shapes.insert(k, shape);
                self.sizes = before;
                break;
            }
            stay.remove(k - fixed);
        }
        stay.into_iter().map(|k| k - fixed).collect()
    }

    /// Standard error of a size beside all others.
    pub fn error(&self, place: usize) -> f64 {
        let density = self.density();
        let own = self.relative(&density, &self.shapes[place]);
        let others = (0..self.shapes.len()).filter(|k| *k != place);
        let beside = self.directions(&density, others);
        let taken: f64 = beside.iter().map(|b| dot(b, &own).powi(2)).sum();
        let all = dot(&own, &own);
        (all - taken).max(LEAST_OWN * all).sqrt().recip()
    }
}

/// The sizes `x`, none below zero, of the least x'Px / 2 - a'x.
///
/// # Source
/// Lawson, Hanson (1974), Solving least squares problems, chapter 23; begun with what is positive at the `start`.
fn not_negative(products: &[Vec<f64>], along: &[f64], start: &[f64]) -> Vec<f64> {
    let count = along.len();
    let mut x = start.to_vec();
    let mut free: Vec<bool> = x.iter().map(|v| *v > 0.0).collect();
    for _ in 0..4 * count + 4 {
        // To the best of what is free, and no further than to the first zero.
        loop {
            let own: Vec<usize> = (0..count).filter(|k| free[*k]).collect();
            let of = |i: &usize| own.iter().map(|j| products[*i][*j]).collect();
            let (inverse, _) = invert(&own.iter().map(of).collect::<Vec<_>>());
            let best = inverse.iter().map(|row| {
                let each = row.iter().zip(&own);
                each.map(|(v, k)| v * along[*k]).sum::<f64>()
            });
            let best: Vec<(usize, f64)> = own.iter().copied().zip(best).collect();
            let ends = best.iter().filter(|(_, z)| *z <= 0.0);
            let part = ends.map(|(k, z)| (*k, x[*k] / (x[*k] - z)));
            let first = part.min_by(|a, b| a.1.total_cmp(&b.1));
            let by = first.map_or(1.0, |f| f.1);
            for (k, z) in &best {
                x[*k] += by * (z - x[*k]);
            }
            let Some((k, _)) = first else { break };
            (x[k], free[k]) = (0.0, false);
        }
        let rises = |k: &usize| {
            let rise = along[*k] - dot(&products[*k], &x);
            (*k, rise / products[*k][*k].sqrt())
        };
        let bound = (0..count).filter(|k| !free[*k] && products[*k][*k] > 0.0);
        let steepest = bound.map(|k| rises(&k)).max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((k, _)) = steepest.filter(|s| s.1 > LEAST_RISE) else {
            break;
        };
        free[k] = true;
    }
    x
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, Gamma, StandardUniform};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::super::bump::lorentzian;
    use super::*;

    #[test]
    fn sizes_climb_to_those_of_the_power() {
        let shape = |center: f64| -> Vec<f64> {
            (1..400)
                .map(|k| lorentzian(center, 0.1, PI * f64::from(k) / 400.0))
                .collect()
        };
        let shapes = vec![vec![1.0; 399], shape(0.5), shape(2.0)];
        let mut fit = Fit {
            counts: &[10.0; 399],
            power: vec![],
            named: vec![0.2; 399],
            shapes,
            sizes: vec![0.7, 0.3, 0.05],
        };
        fit.power = fit.density();
        fit.sizes = vec![1.0, 0.1, 0.1];
        fit.climb(600);
        for (size, truth) in fit.sizes.iter().zip([0.7, 0.3, 0.05]) {
            assert!((size / truth - 1.0).abs() < 0.01, "{size} {truth}");
        }
        assert!(fit.score(&fit.density(), &shape(1.2), &[]).abs() < 0.1);
    }

    #[test]
    fn a_broad_bump_counts_by_what_white_noise_does_not_take_up_of_it() {
        let omega: Vec<f64> = (1..400).map(|k| PI * f64::from(k) / 400.0).collect();
        let broad = Bump {
            center: 2.2,
            width: 0.7 * 2.2,
            variance: 1.0,
        }
        .over(&omega);
        let mut fit = Fit {
            counts: &[150.0; 399],
            power: broad.iter().map(|b| 0.97 + 0.03 * b).collect(),
            named: vec![0.0; 399],
            shapes: vec![vec![1.0; 399]],
            sizes: vec![1.0],
        };
        fit.settle();
        let density = fit.density();
        let beside = fit.directions(&density, 0..1);
        // 60 000 coefficients of a relative error of 1.4 each, and an rms excess of 0.03 times that of the bump about its mean.
        let n = omega.len() as f64;
        let mean = broad.iter().sum::<f64>() / n;
        let rms = (broad.iter().map(|b| (b - mean).powi(2)).sum::<f64>() / n).sqrt();
        let wanted = 0.03 * rms * (0.5 * 150.0 * n).sqrt();
        let score = fit.score(&density, &broad, &beside);
        assert!((score / wanted - 1.0).abs() < 0.05, "{score} {wanted}");
        assert!(fit.score(&density, &broad, &[]) < 0.8 * score);
    }

    /// Energies of coefficients of this density, over bins.
    fn drawn(bins: &Bins, density: &[f64], seed: u64) -> Vec<f64> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let each = bins.counts().iter().zip(density);
        each.map(|(m, s)| {
            let law = Gamma::new(0.5 * m, 2.0 * s / m).expect("a law");
            law.sample(&mut rng)
        })
        .collect()
    }

    fn begun<'a>(bins: &'a Bins, power: Vec<f64>) -> Fit<'a> {
        Fit {
            counts: bins.counts(),
            named: vec![0.0; power.len()],
            shapes: vec![vec![1.0; power.len()]],
            sizes: vec![1.0],
            power,
        }
    }

    #[test]
    fn bumps_that_are_white_together_leave_white_noise_all_of_it() {
        let bins = Bins::new(60_000);
        for seed in 0..12 {
            let power = drawn(&bins, &vec![1.0; bins.counts().len()], seed);
            let mut fit = begun(&bins, power);
            // As many broad bumps as cover the band, and each as large as the white noise to begin with.
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed + 100);
            for k in 0..8 {
                let center = PI
                    * (f64::from(k) + Distribution::<f64>::sample(&StandardUniform, &mut rng))
                    / 8.0;
                let bump = Bump {
                    center,
                    width: 0.7 * center + 0.2,
                    variance: 1.0,
                };
                fit.shapes.push(bump.over(&bins.at.omega));
                fit.sizes.push(1.0);
            }
            // A climb by factors leaves them what they have.
            fit.climb(600);
            assert!(fit.sizes[0] < 0.9, "seed {seed}: {}", fit.sizes[0]);
            fit.prune(1, LEAST_SCORE);
            // What is left of them by chance costs three standard errors of a bump, of which a part is white.
            let error = fit.error(0);
            let off = (fit.sizes[0] - 1.0).abs();
            assert!(
                off < 4.0 * error && error < 0.05,
                "seed {seed}: {} {error}",
                fit.sizes[0]
            );
        }
    }

    #[test]
    fn white_noise_beside_a_bump_is_known_as_well_as_its_error_says() {
        let bins = Bins::new(60_000);
        let mut squares = 0.0;
        let draws = 40;
        for seed in 0..draws {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed + 200);
            let unit = |rng: &mut Xoshiro256PlusPlus| -> f64 { StandardUniform.sample(rng) };
            let center = 0.3 + 2.0 * unit(&mut rng);
            let bump = Bump {
                center,
                width: center * (0.1 + 0.6 * unit(&mut rng)),
                variance: 0.5 + 2.0 * unit(&mut rng),
            };
            let own = bump.over(&bins.at.omega);
            let density: Vec<f64> = own.iter().map(|v| 1.0 + v).collect();
            let mut fit = begun(&bins, drawn(&bins, &density, seed));
            fit.shapes.push(own);
            fit.sizes.push(1.0);
            assert_eq!(fit.prune(1, LEAST_SCORE), [0]);
            squares += ((fit.sizes[0] - 1.0) / fit.error(0)).powi(2);
        }
        // Chi-square over its 40 degrees: 0.5 to 1.7 but for one in 200.
        let mean = squares / draws as f64;
        assert!((0.5..1.7).contains(&mean), "{mean}");
    }

    #[test]
    fn white_noise_under_what_covers_it_reaches_down_to_nothing() {
        let bins = Bins::new(20_000);
        let count = bins.counts().len();
        let mut fit = begun(&bins, drawn(&bins, &vec![1.0; count], 7));
        // A bump that is all but white.
        let bump = Bump {
            center: 1.5,
            width: 12.0,
            variance: 1.0,
        };
        fit.shapes.push(bump.over(&bins.at.omega));
        fit.sizes.push(1.0);
        fit.settle();
        assert!(
            fit.error(0) > fit.sizes[0],
            "{} {}",
            fit.sizes[0],
            fit.error(0)
        );
        assert_eq!(fit.prune(1, LEAST_SCORE), [0usize; 0]);
        assert!((fit.sizes[0] - 1.0).abs() < 0.05, "{}", fit.sizes[0]);
    }
}
