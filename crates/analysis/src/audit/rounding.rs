//! Tails that the known step of the converter makes.
//!
//! Normal noise of less than a count, rounded, is not normal: most readings lie on one code and a few on the next. Its
//! spread (from a third of a count on, where the mean of the codes is still the level) follows from the variance of the readings about their level, and its excess kurtosis from that.

use statrs::distribution::{ContinuousCDF, Normal};

use crate::audit::local::{Levels, Local};

/// Noise from which on rounding leaves nothing: at 0.8 counts the excess is below 1e-3.
const COARSE: f64 = 1.0;
/// Standard errors within which the kurtosis is the one that rounding makes.
const AGREES: f64 = 5.0;
/// What the level, known to what its neighbours tell, leaves of it, as a share.
const OF_LEVEL: f64 = 0.15;

/// Mean square and mean fourth power of rounded normal readings about their levels.
fn moments(levels: &Levels, sigma: f64) -> (f64, f64) {
    let normal = Normal::standard();
    let (mut all, mut second, mut fourth) = (0.0, 0.0, 0.0);
    for (level, readings) in levels.iter() {
        let far = 6.0 * sigma + 1.0;
        let codes = (level - far).floor() as i64..=(level + far).ceil() as i64;
        for c in codes {
            let d = c as f64 - level;
            let p = normal.cdf((d + 0.5) / sigma) - normal.cdf((d - 0.5) / sigma);
            second += readings * p * d * d;
            fourth += readings * p * d.powi(4);
        }
        all += readings;
    }
    (second / all, fourth / all)
}

/// Whether the kurtosis of the readings is the one that rounding to counts makes of normal noise.
pub(super) fn explains_tails(local: &Local, known: &[bool]) -> bool {
    const LEAST: f64 = 0.05;
    let own: Vec<f64> = local
        .residual
        .iter()
        .zip(known)
        .filter(|(_, k)| **k)
        .map(|(r, _)| *r)
        .collect();
    let n = own.len() as f64;
    let second = own.iter().map(|r| r * r).sum::<f64>() / n;
    let fourth = own.iter().map(|r| r.powi(4)).sum::<f64>() / n;
    if second <= 0.0 || second > COARSE * COARSE + 1.0 / 12.0 {
        return false;
    }
    let levels = Levels::new(&local.level, known);
    let (mut low, mut high) = (LEAST, 1.5 * COARSE);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if moments(&levels, middle).0 < second {
            low = middle;
        } else {
            high = middle;
        }
    }
    let (s, f) = moments(&levels, 0.5 * (low + high));
    let (seen, made) = (fourth / (second * second), f / (s * s));
    let error = (24.0 / n).sqrt() * (made / 3.0).max(1.0);
    (seen - made).abs() < AGREES * error + OF_LEVEL * (made - 3.0).abs()
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    fn kurtosis_is_of_rounding(sigma: f64, far: f64) -> bool {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let y: Vec<f64> = (0..12_000)
            .map(|i| {
                let z: f64 = StandardNormal.sample(&mut rng);
                let tail = if i % 100 == 0 { far } else { 1.0 };
                (7.3 + sigma * tail * z).round()
            })
            .collect();
        explains_tails(&Local::new(&y), &[true; 12_000])
    }

    #[test]
    fn rounding_explains_its_own_tails_and_no_others() {
        for sigma in [0.35, 0.49, 0.7] {
            assert!(kurtosis_is_of_rounding(sigma, 1.0), "{sigma}");
            assert!(!kurtosis_is_of_rounding(sigma, 6.0), "{sigma}");
        }
    }
}
