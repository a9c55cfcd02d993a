//! Rates with their binomial bounds, power curves, coverage.

use statrs::distribution::{Beta, Binomial, ContinuousCDF, DiscreteCDF, Normal};

use crate::series::{each, one_if};

/// The oracle's limit: d' that one test at 1 % finds 95 times in 100.
pub const ORACLE: f64 = 4.22;

/// Chance that the oracle, one two-sided test at 1 %, finds an effect of strength `d`.
#[must_use]
pub fn oracle(d: f64) -> f64 {
    let normal = Normal::standard();
    let limit = normal.inverse_cdf(0.995);
    normal.sf(limit - d) + normal.cdf(-limit - d)
}

/// So many of so many. It is told by hits and trials, for a table whose rows a reader compares with each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rate {
    /// Hits.
    pub hits: u64,
    /// Trials.
    pub trials: u64,
}

impl std::fmt::Display for Rate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.trials {
            0 => f.write_str("-"),
            n => write!(f, "{}/{n}", self.hits),
        }
    }
}

impl Rate {
    /// Count a trial.
    pub fn count(&mut self, hit: bool) {
        self.hits += u64::from(hit);
        self.trials += 1;
    }

    /// Of an iterator.
    pub fn of(all: impl IntoIterator<Item = bool>) -> Self {
        let mut rate = Self::default();
        all.into_iter().for_each(|hit| rate.count(hit));
        rate
    }

    /// Share, NaN without trials.
    #[must_use]
    pub fn share(self) -> f64 {
        self.hits as f64 / self.trials as f64
    }

    /// 95 % interval (Clopper and Pearson, 1934).
    #[must_use]
    pub fn interval(self) -> (f64, f64) {
        let (k, n) = (self.hits as f64, self.trials as f64);
        let quantile =
            |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |d| d.inverse_cdf(p));
        let low = match self.hits {
            0 => 0.0,
            _ => quantile(k, n - k + 1.0, 0.025),
        };
        let high = match self.trials - self.hits {
            0 => 1.0,
            _ => quantile(k + 1.0, n - k, 0.975),
        };
        (low, high)
    }

    /// Chance of no more hits than these at a true rate of `p`.
    #[must_use]
    pub fn at_most(self, p: f64) -> f64 {
        Binomial::new(p, self.trials).map_or(f64::NAN, |b| b.cdf(self.hits))
    }

    /// Chance of no fewer hits than these at a true rate of `p`.
    #[must_use]
    pub fn at_least(self, p: f64) -> f64 {
        if self.hits == 0 {
            return 1.0;
        }
        Binomial::new(p, self.trials).map_or(f64::NAN, |b| b.sf(self.hits - 1))
    }
}

/// The strength at which a logistic curve of ln d' reaches 95 %, with its standard error; `None` where the data do not
/// hold both outcomes.
#[must_use]
pub fn d95(runs: &[(f64, bool)]) -> Option<(f64, f64)> {
    let hits = runs.iter().filter(|r| r.1).count();
    if hits < 5 || hits + 3 > runs.len() {
        return None;
    }
    // Newton's method, with half a hit and half a miss far off as a prior, so that separable data converge.
    let mut data = each(runs, |(d, hit)| (d.ln(), one_if(hit), 1.0));
    data.extend([(1.5f64.ln(), 0.0, 0.5), (40f64.ln(), 1.0, 0.5)]);
    let (mut a, mut b) = (-8.0f64, 5.0f64);
    let mut inverse = [0.0; 3];
    for _ in 0..60 {
        let (mut ga, mut gb, mut aa, mut ab, mut bb) = (0.0, 0.0, 1e-9, 0.0, 1e-9);
        for (x, y, w) in &data {
            let p = 1.0 / (1.0 + (-(a + b * x)).exp());
            let v = w * (p * (1.0 - p)).max(1e-9);
            ga += w * (y - p);
            gb += w * (y - p) * x;
            aa += v;
            ab += v * x;
            bb += v * x * x;
        }
        let det = aa * bb - ab * ab;
        inverse = [bb / det, -ab / det, aa / det];
        let by_a = inverse[0] * ga + inverse[1] * gb;
        let by_b = inverse[1] * ga + inverse[2] * gb;
        let damp = (2.0 / by_a.abs().max(by_b.abs()).max(2.0)).min(1.0);
        (a, b) = (a + damp * by_a, b + damp * by_b);
    }
    if b < 0.5 {
        return None;
    }
    let x = (19f64.ln() - a) / b;
    // Delta method: dx/da = -1/b, dx/db = -x/b.
    let variance = (inverse[0] + 2.0 * x * inverse[1] + x * x * inverse[2]) / (b * b);
    Some((x.exp(), x.exp() * variance.max(0.0).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_of_no_hit_in_n_is_one_minus_the_root_of_a_fortieth() {
        let (low, high) = Rate::of([false; 100]).interval();
        let bound = 1.0 - 0.025f64.powf(0.01);
        assert!(low == 0.0 && (high - bound).abs() < 1e-6, "{high}");
    }

    #[test]
    fn the_oracle_finds_its_limit_95_times_in_100() {
        assert!((oracle(ORACLE) - 0.95).abs() < 1e-3 && (oracle(0.0) - 0.01).abs() < 1e-6);
    }

    #[test]
    fn a_logistic_curve_gives_its_own_point_back() {
        // p = 0.95 at d' = 6 with slope 8.
        let mut runs = vec![];
        let mut state = 7u64;
        for i in 0..4000 {
            let d = 3.0 * (i as f64 / 4000.0 * 4f64.ln()).exp();
            let p = 1.0 / (1.0 + (-(19f64.ln() + 8.0 * (d / 6.0).ln())).exp());
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            runs.push((d, ((state >> 11) as f64 / (1u64 << 53) as f64) < p));
        }
        let (x, error) = d95(&runs).expect("both outcomes");
        let is_near = (x - 6.0).abs() < 4.0 * error && error < 0.2;
        assert!(is_near, "{x} +- {error}");
    }
}
