//! How the answer to a contest of two levels is held against replicates of either side.

use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::fit::likelihood::{Bins, Dct, Noise};
use crate::two_level::fit::{Coordinates, replicate, two_levels};

/// Replicates of one side of a contest.
const REPLICATES: usize = 40;
/// Coordinates that both sides have: white noise, random walk, size and time of the one, and of the other.
const FITTED: f64 = 8.0;

/// One side of a contest.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Side {
    Gaussian,
    TwoLevels,
}

/// Both sides of a contest, fitted to the same block means.
pub(crate) struct Sides<'a> {
    pub dct: &'a Dct,
    pub bins: &'a Bins,
    /// The Gaussian one: noise and its white variance.
    pub noise: Noise,
    pub white: f64,
    pub two: Coordinates,
}

impl Sides<'_> {
    /// Nats that the two levels are ahead on block means, both as they were fitted.
    fn ahead(&self, all: &[Vec<f64>], g: &[f64]) -> Vec<f64> {
        let variances: Vec<f64> = g[1..].iter().map(|g| self.white * g).collect();
        let logs = (variances.iter()).map(|v| (std::f64::consts::TAU * v).ln());
        let logs: f64 = logs.sum();
        let gaussian = self.dct.forward_all(all).map(|c| {
            let squares = c[1..].iter().zip(&variances).map(|(c, v)| c * c / v);
            -0.5 * (squares.sum::<f64>() + logs)
        });
        let at: Vec<_> = all.iter().map(|y| (&y[..], self.two)).collect();
        let two = two_levels(&at);
        two.into_iter().zip(gaussian).map(|(l, g)| l - g).collect()
    }

    /// Coefficients of block means of the Gaussian side.
    fn gaussian(&self, g: &[f64], rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
        let mut c: Vec<f64> = g
            .iter()
            .map(|g| {
                let e: f64 = StandardNormal.sample(rng);
                e * (self.white * g).sqrt()
            })
            .collect();
        c[0] = 0.0;
        c
    }

    /// Cox's test of separate families: standard errors between `ahead`, the nats by which two levels are better, and
    /// what it is where `truth` holds. Replicates are weighed with both sides as they were fitted; what the fits add is
    /// half a chi-square of the fitted coordinates.
    pub fn cox(&self, ahead: f64, truth: Side) -> f64 {
        let g = self.noise.everywhere(self.bins);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(0x7477_6f20_7369_6465);
        let mut drawn = |draw: &mut dyn FnMut(&mut _) -> Vec<f64>| -> Vec<Vec<f64>> {
            (0..REPLICATES).map(|_| draw(&mut rng)).collect()
        };
        let all = match truth {
            Side::Gaussian => {
                let c = drawn(&mut |rng| self.gaussian(&g, rng));
                self.dct.inverse_all(&c).collect()
            }
            Side::TwoLevels => drawn(&mut |rng| replicate(g.len(), &self.two, rng)),
        };
        let all = self.ahead(&all, &g);
        let n = all.len() as f64;
        let mean = all.iter().sum::<f64>() / n;
        let variance = all.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (ahead - mean) / (variance + 0.5 * FITTED).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::one_pole::OnePole;
    use super::*;

    #[test]
    fn replicates_tell_two_levels_from_a_gaussian_process_of_their_spectrum() {
        let m = 2000;
        let (dct, bins) = (Dct::new(m), Bins::new(m));
        // Two levels of 1 sigma that stay 40 blocks have this spectrum.
        let sides = Sides {
            dct: &dct,
            bins: &bins,
            noise: Noise {
                log_walk: f64::NEG_INFINITY,
                terms: vec![(Arc::new(OnePole), vec![0.0, 20f64.ln()])],
            },
            white: 1.0,
            two: [0.0, -25.0, 0.0, 40f64.ln()],
        };
        let g = sides.noise.everywhere(&bins);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        let scores = |y: Vec<f64>| {
            let ahead = sides.ahead(&[y], &g)[0];
            [Side::Gaussian, Side::TwoLevels].map(|s| sides.cox(ahead, s))
        };
        // What holds stays within a few errors; what does not lies, on average, where its claim fails.
        let (runs, fails) = (5, 3.3);
        let (mut as_two, mut as_gaussian) = (0.0, 0.0);
        for _ in 0..runs {
            let [gaussian, two] = scores(dct.inverse(&sides.gaussian(&g, &mut rng)));
            assert!(gaussian.abs() < 3.5, "{gaussian}");
            as_two += two / f64::from(runs);
            let [gaussian, two] = scores(replicate(m, &sides.two, &mut rng));
            assert!(two.abs() < 3.5, "{two}");
            as_gaussian += gaussian / f64::from(runs);
        }
        assert!(
            as_two < -fails && as_gaussian > fails,
            "{as_two} {as_gaussian}"
        );
    }
}
