//! Sums of squared differences: one pass, no allocation, several accumulators so that additions overlap.

use super::PhasePoint;

/// A deviation at one cluster time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Averaging factor.
    pub m: usize,
    /// Cluster time τ = m·τ₀, s.
    pub tau_s: f64,
    /// The deviation, U.
    pub deviation: f64,
    /// Differences in it.
    pub n: usize,
}

const LANES: usize = 8;

/// Σ (x[k+2m] − 2x[k+m] + x[k])² over k = 0, `stride`, 2·`stride`, ..., and the number of terms.
pub(crate) fn second_differences<T: PhasePoint>(x: &[T], m: usize, stride: usize) -> (f64, usize) {
    let Some(terms) = x.len().checked_sub(2 * m).filter(|t| *t > 0) else {
        return (0.0, 0);
    };
    let d = |a: T, b: T, c: T| ((c - b) - (b - a)).to_f64();
    if stride > 1 {
        let mut sum = 0.0;
        let mut n = 0;
        for k in (0..terms).step_by(stride) {
            sum += d(x[k], x[k + m], x[k + 2 * m]).powi(2);
            n += 1;
        }
        return (sum, n);
    }
    let (a, b, c) = (&x[..terms], &x[m..m + terms], &x[2 * m..2 * m + terms]);
    let mut sums = [0.0f64; LANES];
    let (a8, a_rest) = a.as_chunks::<LANES>();
    let (b8, b_rest) = b.as_chunks::<LANES>();
    let (c8, c_rest) = c.as_chunks::<LANES>();
    for ((a, b), c) in a8.iter().zip(b8).zip(c8) {
        for lane in 0..LANES {
            let value = d(a[lane], b[lane], c[lane]);
            sums[lane] += value * value;
        }
    }
    for ((a, b), c) in a_rest.iter().zip(b_rest).zip(c_rest) {
        sums[0] += d(*a, *b, *c).powi(2);
    }
    (sums.iter().sum(), terms)
}

/// Σ (x[k+3m] − 3x[k+2m] + 3x[k+m] − x[k])² over k = 0, `stride`, ..., and the number of terms.
pub(crate) fn third_differences<T: PhasePoint>(x: &[T], m: usize, stride: usize) -> (f64, usize) {
    let Some(terms) = x.len().checked_sub(3 * m).filter(|t| *t > 0) else {
        return (0.0, 0);
    };
    let d = |a: T, b: T, c: T, e: T| {
        let middle = c - b;
        ((e - a) - (middle + middle + middle)).to_f64()
    };
    if stride > 1 {
        let squares = (0..terms)
            .step_by(stride)
            .map(|k| d(x[k], x[k + m], x[k + 2 * m], x[k + 3 * m]).powi(2));
        return (squares.sum(), terms.div_ceil(stride));
    }
    let part = |from: usize| x[from..from + terms].as_chunks::<LANES>();
    let ((a8, a), (b8, b), (c8, c), (e8, e)) = (part(0), part(m), part(2 * m), part(3 * m));
    let mut sums = [0.0f64; LANES];
    for (((a, b), c), e) in a8.iter().zip(b8).zip(c8).zip(e8) {
        for lane in 0..LANES {
            let value = d(a[lane], b[lane], c[lane], e[lane]);
            sums[lane] += value * value;
        }
    }
    for (((a, b), c), e) in a.iter().zip(b).zip(c).zip(e) {
        sums[0] += d(*a, *b, *c, *e).powi(2);
    }
    (sums.iter().sum(), terms)
}

/// Σⱼ (Σᵢ₌ⱼ..ⱼ₊ₘ₋₁ x[i+2m] − 2x[i+m] + x[i])², by a running inner sum, and the number of terms.
pub(crate) fn averaged_second_differences<T: PhasePoint>(x: &[T], m: usize) -> (f64, usize) {
    let Some(terms) = (x.len() + 1).checked_sub(3 * m).filter(|t| *t > 0) else {
        return (0.0, 0);
    };
    let d = |k: usize| (x[k + 2 * m] - x[k + m]) - (x[k + m] - x[k]);
    let mut inner = T::default();
    for k in 0..m {
        inner = inner + d(k);
    }
    let mut sum = inner.to_f64().powi(2);
    for j in 1..terms {
        let middle = x[j + 2 * m - 1] - x[j + m - 1];
        inner = inner + ((x[j + 3 * m - 1] - x[j - 1]) - (middle + middle + middle));
        let value = inner.to_f64();
        sum += value * value;
    }
    (sum, terms)
}

#[cfg(test)]
mod tests {
    use crate::allan::{Deviation, Phase, TauGrid, deviation};

    fn single(values: &[f64]) -> Phase {
        Phase::from_values(values, std::slice::from_ref(&(0..values.len())))
    }

    /// NIST SP 1065 (2008), section 12.4: the 1000-point set of a multiplicative congruential generator.
    fn nist() -> Vec<f64> {
        std::iter::successors(Some(1_234_567_890u64), |n| Some(16807 * n % 2_147_483_647))
            .take(1000)
            .map(|n| n as f64 / 2_147_483_647.0)
            .collect()
    }

    #[test]
    fn ref_nist_sp_1065_thousand_points() {
        // Table 31, page 108. The modified total there is corrected for its bias under white FM (factor
        // 1/√0.73), which the plain estimator is not.
        let published = [
            (Deviation::Adev, [2.922319e-01, 9.965736e-02, 3.897804e-02]),
            (Deviation::Oadev, [2.922319e-01, 9.159953e-02, 3.241343e-02]),
            (Deviation::Mdev, [2.922319e-01, 6.172376e-02, 2.170921e-02]),
            (Deviation::Tdev, [1.687202e-01, 3.563623e-01, 1.253382e+00]),
            (Deviation::Hdev, [2.943883e-01, 1.052754e-01, 3.910860e-02]),
            (Deviation::Ohdev, [2.943883e-01, 9.581083e-02, 3.237638e-02]),
            (
                Deviation::Totdev,
                [2.922319e-01, 9.134743e-02, 3.406530e-02],
            ),
            (
                Deviation::Mtotdev,
                [2.418528e-01, 6.499161e-02, 2.287774e-02].map(|v: f64| v * 0.73f64.sqrt()),
            ),
        ];
        let phase = single(&nist());
        for (kind, values) in published {
            for (m, value) in [1, 10, 100].into_iter().zip(values) {
                let got = deviation(&phase, kind, 1.0, m).unwrap().deviation;
                assert!(
                    (got / value - 1.0).abs() < 3e-7,
                    "{} m = {m}: {got} {value}",
                    kind.name()
                );
            }
        }
    }

    #[test]
    fn ref_theo1_of_the_thousand_points_by_stable32() {
        // Stable32's run over the same set (its PHASE.DAT), to the five digits that it prints: averaging factor and
        // deviation. As kept with the tests of allantools (tests/phasedat/phase_dat_theo1_alpha0_decade.txt).
        let phase = single(&nist());
        for (m, value) in [
            (10, 1.0757e-1),
            (20, 7.2762e-2),
            (40, 4.8652e-2),
            (100, 3.1789e-2),
            (202, 2.4120e-2),
            (400, 1.4321e-2),
            (998, 5.0234e-3),
            (1000, 5.0524e-3),
        ] {
            let got = deviation(&phase, Deviation::Theo1, 1.0, m).unwrap();
            assert!(
                (got.deviation / value - 1.0).abs() < 6e-5,
                "m = {m}: {} {value}",
                got.deviation
            );
        }
    }

    #[test]
    fn theo1_is_the_double_sum_of_its_definition() {
        let y = nist();
        let phase = single(&y);
        let x: Vec<f64> = std::iter::once(0.0)
            .chain(y.iter().scan(0.0, |sum, v| {
                *sum += v;
                Some(*sum)
            }))
            .collect();
        for m in [10, 100, 1000] {
            let mut sum = 0.0;
            for i in 0..x.len() - m {
                for delta in 0..m / 2 {
                    let value = (x[i] - x[i + m / 2 - delta]) + (x[i + m] - x[i + m / 2 + delta]);
                    sum += value * value / (m / 2 - delta) as f64;
                }
            }
            let expected = (sum / (0.75 * (x.len() - m) as f64)).sqrt() / m as f64;
            let got = deviation(&phase, Deviation::Theo1, 0.5, m).unwrap();
            assert!((got.deviation / expected - 1.0).abs() < 1e-10, "{m}");
            assert_eq!(got.tau_s, 0.375 * m as f64);
        }
    }

    #[test]
    fn a_pure_rate_ramp_reads_r_tau_over_sqrt_2() {
        let (rate_ramp_r, tau0) = (0.25, 0.5);
        let y: Vec<f64> = (0..64).map(|k| rate_ramp_r * k as f64 * tau0).collect();
        let phase = single(&y);
        for m in [1, 3, 8] {
            let tau = m as f64 * tau0;
            for (kind, expected) in [
                (Deviation::Adev, rate_ramp_r * tau / 2f64.sqrt()),
                (Deviation::Oadev, rate_ramp_r * tau / 2f64.sqrt()),
                (Deviation::Mdev, rate_ramp_r * tau / 2f64.sqrt()),
                (Deviation::Hdev, 0.0),
                (Deviation::Ohdev, 0.0),
            ] {
                let got = deviation(&phase, kind, tau0, m).unwrap().deviation;
                assert!(
                    (got - expected).abs() < 1e-12,
                    "{} {m}: {got} {expected}",
                    kind.name()
                );
            }
        }
    }

    #[test]
    fn an_alternating_reading_reads_as_sqrt_2_at_one_and_nothing_at_two() {
        // y = ±1 in turn: (y₂ − y₁)²/2 = 2 at m = 1, and means of two are all zero.
        let y: Vec<f64> = (0..40)
            .map(|k| if k % 2 == 0 { 1.0 } else { -1.0 })
            .collect();
        let phase = single(&y);
        assert!(
            (deviation(&phase, Deviation::Oadev, 1.0, 1)
                .unwrap()
                .deviation
                - 2f64.sqrt())
            .abs()
                < 1e-15
        );
        assert!(
            deviation(&phase, Deviation::Oadev, 1.0, 2)
                .unwrap()
                .deviation
                < 1e-15
        );
    }

    #[test]
    fn counts_and_values_agree_and_no_difference_spans_a_gap() {
        let counts: Vec<i32> = nist().iter().map(|v| (v * 1000.0) as i32).collect();
        let values: Vec<f64> = counts.iter().map(|c| f64::from(*c) * 0.07326).collect();
        let runs = [0..300, 300..950, 960..1000];
        let (a, b) = (
            Phase::from_counts(&counts, 0.07326, &runs),
            Phase::from_values(&values, &runs),
        );
        for kind in Deviation::ALL {
            for m in [1, 5, 100] {
                if kind == Deviation::Theo1 && (m < 10 || m % 2 != 0) {
                    assert_eq!(deviation(&a, kind, 0.05, m), None);
                    continue;
                }
                let (a, b) = (
                    deviation(&a, kind, 0.05, m).unwrap(),
                    deviation(&b, kind, 0.05, m).unwrap(),
                );
                assert_eq!(a.n, b.n);
                assert!(
                    (a.deviation / b.deviation - 1.0).abs() < 1e-10,
                    "{}",
                    kind.name()
                );
            }
        }
        // 300 + 650 + 40 samples, each run on its own: n − 2m + 1 second differences.
        assert_eq!(
            deviation(&a, Deviation::Oadev, 0.05, 20).unwrap().n,
            261 + 611 + 1
        );
        assert_eq!(deviation(&a, Deviation::Oadev, 0.05, 326), None);
    }

    #[test]
    fn the_grids_hold_each_factor_once_and_none_too_long() {
        assert_eq!(TauGrid::Octave.factors(20), [1, 2, 4, 8, 16]);
        assert_eq!(TauGrid::Decade.factors(100), [1, 2, 4, 10, 20, 40, 100]);
        assert_eq!(TauGrid::Log(3).factors(50), [1, 2, 5, 10, 22, 46]);
        assert_eq!("log:20".parse::<TauGrid>().unwrap(), TauGrid::Log(20));
        assert!("log:0".parse::<TauGrid>().is_err());
    }

    #[test]
    fn the_longest_factor_has_at_least_one_difference_and_the_next_has_none() {
        for n in 2..40 {
            let y: Vec<f64> = nist()[..n].to_vec();
            let phase = single(&y);
            for kind in Deviation::ALL {
                let longest = kind.longest(n);
                if longest > 0 {
                    assert!(
                        deviation(&phase, kind, 1.0, longest).is_some(),
                        "{} {n}",
                        kind.name()
                    );
                }
                assert!(
                    deviation(&phase, kind, 1.0, longest + 2).is_none()
                        && deviation(&phase, kind, 1.0, longest + 1).is_none(),
                    "{} {n}",
                    kind.name()
                );
            }
        }
    }
}
