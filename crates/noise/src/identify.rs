//! Which power-law noise dominates at a cluster time.

use crate::allan::Phase;
use crate::edf::NoiseType;

/// Means needed for an answer.
const NEEDED: usize = 30;

/// Noise type at the averaging factor `m` from the lag-1 autocorrelation of cluster means; `None` with fewer than 30
/// of them.
///
/// Means over `m` samples are freed from a linear trend and differenced until their lag-1 autocorrelation r₁ says they
/// are stationary: δ = r₁/(1 + r₁), differenced d times while δ ≥ 1/4, α = −2(δ + d).
///
/// # Source
/// W. Riley, C. Greenhall, "Power law noise identification using the lag 1 autocorrelation", EFTF 2004.
#[must_use]
pub fn identify(phase: &Phase, m: usize) -> Option<NoiseType> {
    let mut z = phase.cluster_means(m);
    if z.len() < NEEDED {
        return None;
    }
    remove_trend(&mut z);
    for d in 0..3 {
        let delta = {
            let r1 = lag_1(&z)?;
            r1 / (1.0 + r1)
        };
        if delta < 0.25 || d == 2 {
            return Some(NoiseType::nearest(-2.0 * (delta + f64::from(d))));
        }
        z = z.windows(2).map(|w| w[1] - w[0]).collect();
    }
    None
}

fn remove_trend(z: &mut [f64]) {
    let n = z.len() as f64;
    let middle = (n - 1.0) / 2.0;
    let mean = z.iter().sum::<f64>() / n;
    let slope = z
        .iter()
        .enumerate()
        .map(|(i, v)| (i as f64 - middle) * (v - mean))
        .sum::<f64>()
        / (n * (n * n - 1.0) / 12.0);
    for (i, v) in z.iter_mut().enumerate() {
        *v -= mean + slope * (i as f64 - middle);
    }
}

fn lag_1(z: &[f64]) -> Option<f64> {
    let mean = z.iter().sum::<f64>() / z.len() as f64;
    let squares: f64 = z.iter().map(|v| (v - mean).powi(2)).sum();
    let products: f64 = z.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum();
    (squares > 0.0).then(|| products / squares)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn white_phase_white_rate_and_random_walk_are_told_apart_at_each_cluster_time() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(17);
        let e: Vec<f64> = (0..20_001)
            .map(|_| StandardNormal.sample(&mut rng))
            .collect();
        let walk: Vec<f64> = e
            .iter()
            .scan(0.0, |s, v| {
                *s += v;
                Some(*s)
            })
            .collect();
        let difference: Vec<f64> = e.windows(2).map(|w| w[1] - w[0]).collect();
        for (y, expected) in [
            (&e, NoiseType::WhiteRate),
            (&walk, NoiseType::RandomWalkRate),
            (&difference, NoiseType::WhitePhase),
        ] {
            let phase = Phase::from_values(y, std::slice::from_ref(&(0..y.len())));
            for m in [4, 16, 64] {
                assert_eq!(identify(&phase, m), Some(expected), "m = {m}");
            }
            assert_eq!(identify(&phase, 1000), None);
        }
    }
}
