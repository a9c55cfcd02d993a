//! Noise whose size swings at one frequency.

use std::f64::consts::TAU;

use super::dependence::rhythm;
use crate::test_level::{MOST, omnibus_level};
use numerics::tails::chi_tail;

/// Distances from a line, in cycles of the record, at which it has less than this part of its energy by itself.
const BESIDE: [f64; 4] = [1.5, 2.5, 3.5, 4.5];
const PART: f64 = 0.1;
/// Chi-square of two degrees that noise has there at most.
const OF_NOISE: f64 = 16.0;

/// The frequency, cycles per sample, at which the square of a whitened residual swings; none where it does not, or not at one:
/// what comes once, and what wanders, is no line.
pub(crate) fn swing(e: &[f64]) -> Option<f64> {
    let found = rhythm(e).filter(|r| r.span == 0)?;
    if chi_tail(found.statistic, 2.0) * found.count as f64 > omnibus_level() {
        return None;
    }
    let e = &e[..e.len().min(MOST)];
    let n = e.len() as f64;
    let mean = e.iter().map(|v| v * v).sum::<f64>() / n;
    let power = |cycles: f64| {
        let (c, s) = e.iter().enumerate().fold((0.0, 0.0), |(c, s), (i, v)| {
            let (sin, cos) = (TAU * cycles * i as f64).sin_cos();
            let off = v * v - mean;
            (c + off * cos, s + off * sin)
        });
        c * c + s * s
    };
    let own = power(found.at);
    let most = own * PART.max(OF_NOISE / found.statistic);
    let beside = BESIDE
        .iter()
        .flat_map(|b| [found.at - b / n, found.at + b / n]);
    let mut inside = beside.filter(|f| (0.0..0.5).contains(f));
    inside.all(|f| power(f) < most).then_some(found.at)
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    #[test]
    fn a_size_that_swings_has_a_period_and_one_that_changes_once_or_wanders_has_none() {
        let n = 24_000;
        for seed in 0..6 {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
            let cycles = (12.0 + 40.3 * seed as f64) / f64::from(n);
            let noise: Vec<f64> = (0..n).map(|_| normal()).collect();
            let of = |size: &dyn Fn(usize) -> f64| -> Vec<f64> {
                let each = noise.iter().enumerate();
                each.map(|(i, v)| v * size(i)).collect()
            };
            let swings = of(&|i| 1.0 + 0.25 * (TAU * cycles * i as f64).sin());
            let found = swing(&swings).expect("a swing");
            assert!(
                (found - cycles).abs() * f64::from(n) < 0.5,
                "{found} {cycles}"
            );
            assert_eq!(swing(&of(&|_| 1.0)), None, "seed {seed}");
            let (from, length) = (2000 * (seed as usize + 1), 300 + 700 * seed as usize);
            let once = |i: usize| {
                if (from..from + length).contains(&i) {
                    2.0
                } else {
                    1.0
                }
            };
            assert_eq!(swing(&of(&once)), None, "seed {seed}");
            let mut level = 0.0;
            let wander: Vec<f64> = (0..n)
                .map(|_| {
                    level += -0.002 * level + 0.03 * normal();
                    f64::exp(level)
                })
                .collect();
            assert_eq!(swing(&of(&|i| wander[i])), None, "seed {seed}");
        }
    }
}
