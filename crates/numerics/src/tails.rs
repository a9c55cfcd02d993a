//! Chances far out: tails of distributions, where one minus the distribution function has no digits left.
//!
//! ```
//! use numerics::tails::{chi_square, two_sided};
//!
//! assert!((two_sided(1.959_964) - 0.05).abs() < 1e-6);
//! assert!((chi_square(3.841_459, 1.0) - 0.05).abs() < 1e-6);
//! assert!(two_sided(20.0) > 0.0);
//! ```

use statrs::distribution::{Binomial, ChiSquared, ContinuousCDF, DiscreteCDF, Normal, Poisson};

/// P(Z > z) of the standard normal.
#[must_use]
pub fn upper_normal(z: f64) -> f64 {
    Normal::standard().sf(z)
}

/// Two-sided tail of the standard normal.
#[must_use]
pub fn two_sided(z: f64) -> f64 {
    (2.0 * upper_normal(z.abs())).min(1.0)
}

/// P(X > x) of chi-square.
#[must_use]
pub fn chi_square(x: f64, degrees: f64) -> f64 {
    ChiSquared::new(degrees).map_or(1.0, |c| c.sf(x))
}

/// P(X >= `observed`) of a Poisson variable of that mean.
#[must_use]
pub fn at_least(observed: u64, mean: f64) -> f64 {
    match observed.checked_sub(1) {
        None => 1.0,
        Some(below) => Poisson::new(mean.max(1e-12)).map_or(1.0, |p| p.sf(below)),
    }
}

/// P(X >= `hits`) of `trials` trials of chance `p`.
#[must_use]
pub fn hits_at_least(hits: u64, trials: u64, p: f64) -> f64 {
    match hits.checked_sub(1) {
        None => 1.0,
        Some(below) => Binomial::new(p, trials).map_or(1.0, |b| b.sf(below)),
    }
}

/// Distance in sigma that one of `n` normal samples reaches with chance `chance`, either side.
#[must_use]
pub fn farthest(n: usize, chance: f64) -> f64 {
    // Bonferroni; two_sided is monotonic, so halving finds it.
    let each = chance / n.max(1) as f64;
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if two_sided(middle) > each {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// Chance that chi-square of so many degrees of freedom exceeds `x`; NaN where there are none.
#[must_use]
pub fn chi_tail(x: f64, degrees: f64) -> f64 {
    ChiSquared::new(degrees).map_or(f64::NAN, |c| c.sf(x))
}

/// Two-sided tail of the standard normal.
#[must_use]
pub fn normal_tail(z: f64) -> f64 {
    2.0 * Normal::standard().sf(z.abs())
}

/// Standard errors of a sum of products that are 0 on average and independent: exact to the second moment whatever changes
/// the spread of their factors.
pub fn errors_of_sum(products: impl Iterator<Item = f64>) -> f64 {
    let (sum, square) = products.fold((0.0, 0.0), |(sum, square), p| (sum + p, square + p * p));
    sum / f64::max(square, f64::MIN_POSITIVE).sqrt()
}

/// Kurtosis of `n` values as a standard normal score. Anscombe and Glynn (1983): the cube root makes the skewed statistic
/// normal.
pub fn kurtosis_score(b2: f64, n: f64) -> f64 {
    let mean = 3.0 * (n - 1.0) / (n + 1.0);
    let variance = 24.0 * n * (n - 2.0) * (n - 3.0) / ((n + 1.0).powi(2) * (n + 3.0) * (n + 5.0));
    let x = (b2 - mean) / variance.sqrt();
    let skew = 6.0 * (n * n - 5.0 * n + 2.0) / ((n + 7.0) * (n + 9.0))
        * (6.0 * (n + 3.0) * (n + 5.0) / (n * (n - 2.0) * (n - 3.0))).sqrt();
    let a = 6.0 + 8.0 / skew * (2.0 / skew + (1.0 + 4.0 / (skew * skew)).sqrt());
    let inner = (1.0 - 2.0 / a) / (1.0 + x * (2.0 / (a - 4.0)).sqrt());
    ((1.0 - 2.0 / (9.0 * a)) - inner.cbrt()) / (2.0 / (9.0 * a)).sqrt()
}

/// The 95 % quantile of the standard normal.
pub const ONE_SIDED: f64 = 1.644_854;

/// The 97.5 % quantile of the standard normal: 95 % lie within it.
pub const TWO_SIDED: f64 = 1.959_964;

/// Median of chi-square of one degree: of the square of a normal variable.
pub const MEDIAN: f64 = 0.4549;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_farthest_of_12000_samples_lies_at_5_7_sigma_once_in_10000() {
        // Phi(-5.7) = 6.0e-9, twice, times 12000 = 1.4e-4.
        let z = farthest(12_000, 1.4e-4);
        assert!((z - 5.7).abs() < 0.02, "{z}");
    }

    #[test]
    fn poisson_tail_agrees_with_its_sum() {
        // P(X >= 3), mean 2: 1 - e^-2 (1 + 2 + 2)
        assert!((at_least(3, 2.0) - (1.0 - (-2f64).exp() * 5.0)).abs() < 1e-12);
        assert!(at_least(0, 2.0) == 1.0);
    }
}
