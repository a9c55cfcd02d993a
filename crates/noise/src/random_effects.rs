//! One number from many runs: their mean, how much they differ beyond their own errors, and whether they differ at all.
//!
//! ```
//! let pooled = noise::random_effects::pool(&[5.0, 5.4, 5.1, 5.3], &[0.2; 4]).unwrap();
//! assert!((pooled.mean - 5.2).abs() < 1e-9);
//! assert_eq!(pooled.run_to_run, 0.0); // the errors explain what is seen
//! assert_eq!(noise::random_effects::pool(&[5.0, 5.4], &[0.2; 2]), None);
//! ```

use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

/// A figure over runs by the model: true values of the runs scatter by `run_to_run` about `mean`, estimates about them by
/// their own errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pooled {
    /// Mean over the runs, each weighted by its own and the run-to-run variance.
    pub mean: f64,
    /// Lower end of its 95 % interval (Student's t over the runs).
    pub mean_low: f64,
    /// Upper end.
    pub mean_high: f64,
    /// Standard deviation of the true values between runs: 0 where the errors explain what is seen.
    pub run_to_run: f64,
    /// Lower end of its 95 % interval.
    pub run_to_run_low: f64,
    /// Upper end.
    pub run_to_run_high: f64,
    /// Chance of a scatter as large where all runs are equal; `None` where errors are not known.
    pub equal_p: Option<f64>,
}

/// Pool estimates `x` with standard errors `errors` (0 where not known); `None` below three runs.
///
/// Q(v) = Σ (xᵢ − x̄)²/(eᵢ² + v), x̄ weighted likewise, has χ² with n − 1 degrees of freedom at the true v: at v = 0 it is the
/// test of equality, its quantiles bound v, and v̂ is where it equals n − 1.
///
/// # Source
/// R. Paule, J. Mandel, J. Res. NBS 87 (1982) 377; W. Viechtbauer, Statistics in Medicine 26 (2007) 37 (interval by the
/// profile of Q).
#[must_use]
pub fn pool(x: &[f64], errors: &[f64]) -> Option<Pooled> {
    let n = x.len();
    if n < 3 || errors.len() != n {
        return None;
    }
    let freedom = (n - 1) as f64;
    let at = |v: f64| {
        let weights: Vec<f64> = errors.iter().map(|e| 1.0 / (e * e + v)).collect();
        let total: f64 = weights.iter().sum();
        let mean = weights.iter().zip(x).map(|(w, x)| w * x).sum::<f64>() / total;
        let q: f64 = weights
            .iter()
            .zip(x)
            .map(|(w, x)| w * (x - mean).powi(2))
            .sum();
        (q, mean, total)
    };
    let known = errors.iter().all(|e| *e > 0.0);
    let mean = x.iter().sum::<f64>() / n as f64;
    let scatter = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
    // Q falls as v grows; where it is too small already at no variance, that is the answer.
    let variance_for = |target: f64| -> f64 {
        let floor = scatter.max(f64::MIN_POSITIVE) * 1e-12;
        if known && at(0.0).0 <= target {
            return 0.0;
        }
        let (mut low, mut high) = (floor, scatter.max(f64::MIN_POSITIVE));
        while at(high).0 > target {
            high *= 4.0;
        }
        for _ in 0..100 {
            let middle = (low * high).sqrt();
            if at(middle).0 > target {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    };
    let chi2 = ChiSquared::new(freedom).ok()?;
    let variance = variance_for(freedom);
    let (_, mean, total) = at(variance.max(f64::MIN_POSITIVE));
    let half = StudentsT::new(0.0, 1.0, freedom).ok()?.inverse_cdf(0.975) / total.sqrt();
    Some(Pooled {
        mean,
        mean_low: mean - half,
        mean_high: mean + half,
        run_to_run: variance.sqrt(),
        run_to_run_low: variance_for(chi2.inverse_cdf(0.975)).sqrt(),
        run_to_run_high: variance_for(chi2.inverse_cdf(0.025)).sqrt(),
        equal_p: known.then(|| chi2.sf(at(0.0).0)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn without_errors_it_is_the_mean_and_the_scatter() {
        let p = pool(&[1.0, 2.0, 3.0, 6.0], &[0.0; 4]).unwrap();
        assert!((p.mean - 3.0).abs() < 1e-9 && (p.run_to_run.powi(2) - 14.0 / 3.0).abs() < 1e-6);
        // t(3) at 97.5 %: 3.182.
        assert!((p.mean_high - 3.0 - 3.182_446 * p.run_to_run / 2.0).abs() < 1e-4);
        assert_eq!(p.equal_p, None);
        assert!(pool(&[1.0, 2.0], &[0.1, 0.1]).is_none());
    }

    #[test]
    fn intervals_hold_the_truth_and_equal_runs_are_called_different_as_often_as_stated() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
        let mut gauss = || -> f64 { StandardNormal.sample(&mut rng) };
        for spread in [0.0, 0.3, 1.0] {
            let sets = 1000;
            let (mut mean_in, mut spread_in, mut alarms) = (0, 0, 0);
            for _ in 0..sets {
                let errors: Vec<f64> = (0..8).map(|i| 0.2 + 0.05 * f64::from(i)).collect();
                let x: Vec<f64> = errors
                    .iter()
                    .map(|e| 5.0 + spread * gauss() + e * gauss())
                    .collect();
                let p = pool(&x, &errors).unwrap();
                mean_in += usize::from(p.mean_low <= 5.0 && 5.0 <= p.mean_high);
                spread_in += usize::from(p.run_to_run_low <= spread && spread <= p.run_to_run_high);
                alarms += usize::from(p.equal_p.unwrap() < 0.05);
            }
            // Binomial(1000, 0.95): below 920 has a chance of 2e-5. At the boundary the intervals hold more.
            assert!(
                mean_in >= 925 && spread_in >= 925,
                "{spread}: {mean_in} {spread_in}"
            );
            if spread == 0.0 {
                assert!((25..80).contains(&alarms), "{alarms}");
            } else if spread == 1.0 {
                assert!(alarms > 950, "{alarms}");
            }
        }
    }
}
