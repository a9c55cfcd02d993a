//! ThêoH: the overlapping Allan deviation up to a fifth of the record, beyond it Theo1 freed from its bias.
//!
//! Theo1 differs from the Allan variance by a factor that depends on the noise. The bias-removed form measures that factor
//! where both exist, at the cluster times 9τ₀, 12τ₀, 15τ₀ ... up to half the record, and multiplies Theo1 with their mean:
//!
//! σ²(0.75 m τ₀) = Theo1(m)·Σᵢ₌₀ⁿ [Avar(9 + 3i) / Theo1(12 + 4i)] / (n + 1), n = ⌊N/6 − 3⌋ for N points of phase.
//!
//! # Source
//! D. Howe, J. Taylor, T. Tasset, "ThêoH bias-removal method", FCS 2006; NIST SP 1065 (2008), section 5.2.15. Of long
//! records the phase is averaged for the factor, as in J. Taylor, D. Howe, "Fast TheoBR: a method for long data set
//! stability analysis", IEEE Trans. UFFC 57 (2010).

use super::correlate::Correlator;
use super::{PhasePoint, kernels, total};

/// Part of the record up to which the Allan deviation is taken.
const ALLAN_SHARE: f64 = 0.2;
/// Points of phase from which the factor is taken of averages.
const LONGEST: usize = 4096;
/// Points of phase that the factor needs: one ratio.
pub(super) const NEEDED: usize = 19;

/// The largest averaging factor at which ThêoH is the overlapping Allan deviation, for a longest run of so many samples.
pub(crate) fn allan_to(samples: usize) -> usize {
    (ALLAN_SHARE * samples as f64) as usize
}

/// Mean of the ratios of Allan variance and Theo1; `None` for a run too short or one in which nothing moves.
pub(super) fn factor<T: PhasePoint>(runs: &[Vec<T>], correlator: &mut Correlator) -> Option<f64> {
    let points = runs.iter().map(Vec::len).max()?;
    if points < NEEDED {
        return None;
    }
    let step = points.div_ceil(LONGEST);
    let runs: Vec<Vec<f64>> = runs
        .iter()
        .map(|x| {
            x.chunks_exact(step)
                .map(|part| {
                    let inner: f64 = part.iter().map(|v| (*v - x[0]).to_f64()).sum();
                    inner / step as f64
                })
                .collect()
        })
        .collect();
    // Where 6 divides the points, the last Allan variance would have no term.
    let last = ((points / step - 1) / 6).saturating_sub(3);
    let mut sum = 0.0;
    for i in 0..=last {
        let (allan_m, theo_m) = (9 + 3 * i, 12 + 4 * i);
        let (mut allan, mut theo) = ((0.0, 0usize), (0.0, 0usize));
        for x in &runs {
            let (squares, n) = kernels::second_differences(x, allan_m, 1);
            allan = (allan.0 + squares, allan.1 + n);
            let (squares, n) = total::theo1(x, theo_m, correlator);
            theo = (theo.0 + squares, theo.1 + n);
        }
        let allan = allan.0 / (2.0 * (allan_m * allan_m) as f64 * allan.1 as f64);
        let theo = theo.0 / (0.75 * (theo_m * theo_m) as f64 * theo.1 as f64);
        sum += allan / theo;
    }
    Some(sum / (last + 1) as f64).filter(|f| f.is_finite())
}

#[cfg(test)]
mod tests {
    use crate::allan::{Deviation, Estimate, Phase, TauGrid, deviation};
    use crate::edf::{NoiseType, chi_square_interval, edf};
    use crate::synthetic::Truth;
    use rand_core::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    fn single(y: &[f64]) -> Phase {
        Phase::from_values(y, std::slice::from_ref(&(0..y.len())))
    }

    /// The definition, sample by sample.
    fn by_definition(y: &[f64], m: usize) -> f64 {
        let mut x = vec![0.0];
        for v in y {
            x.push(x[x.len() - 1] + v);
        }
        let points = x.len();
        let allan = |m: usize| {
            let squares: f64 = (0..points - 2 * m)
                .map(|k| (x[k + 2 * m] - 2.0 * x[k + m] + x[k]).powi(2))
                .sum();
            squares / (2.0 * (m * m) as f64 * (points - 2 * m) as f64)
        };
        let theo1 = |m: usize| {
            let mut sum = 0.0;
            for i in 0..points - m {
                for delta in 0..m / 2 {
                    let value = (x[i] - x[i + m / 2 - delta]) + (x[i + m] - x[i + m / 2 + delta]);
                    sum += value * value / (m / 2 - delta) as f64;
                }
            }
            sum / (0.75 * (m * m) as f64 * (points - m) as f64)
        };
        let n = (points as f64 / 6.0 - 3.0).floor() as usize;
        let factor: f64 = (0..=n).map(|i| allan(9 + 3 * i) / theo1(12 + 4 * i)).sum();
        (factor / (n + 1) as f64 * theo1(m)).sqrt()
    }

    #[test]
    fn it_is_the_definition_beyond_a_fifth_of_the_record_and_the_allan_deviation_before() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let y = Truth {
            n: 0.2,
            k: 0.05,
            ..Truth::default()
        }
        .record(700, 0.5, &mut rng);
        let phase = single(&y);
        for m in [1, 64, 140] {
            let got = deviation(&phase, Deviation::Theoh, 0.5, m).unwrap();
            assert_eq!(got, deviation(&phase, Deviation::Oadev, 0.5, m).unwrap());
        }
        for m in [188, 400, 700] {
            let got = deviation(&phase, Deviation::Theoh, 0.5, m).unwrap();
            let expected = by_definition(&y, m);
            assert!(
                (got.deviation / expected - 1.0).abs() < 1e-9,
                "{m}: {got:?} {expected}"
            );
            assert_eq!(got.tau_s, 0.375 * m as f64);
        }
        // Between the two, and for an odd m, there is nothing.
        assert_eq!(deviation(&phase, Deviation::Theoh, 0.5, 150), None);
        assert_eq!(deviation(&phase, Deviation::Theoh, 0.5, 401), None);
        let taus: Vec<f64> = phase
            .curve(Deviation::Theoh, 0.5, &TauGrid::Octave.factors(700))
            .iter()
            .map(|e| e.tau_s / 0.5)
            .collect();
        assert_eq!(
            taus,
            [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 192.0, 384.0]
        );
    }

    #[test]
    fn averages_of_the_phase_give_the_factor_of_the_whole() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        let mut correlator = super::Correlator::new();
        for truth in [
            Truth {
                n: 0.2,
                ..Truth::default()
            },
            Truth {
                n: 0.2,
                k: 0.05,
                ..Truth::default()
            },
        ] {
            let y = truth.record(4090, 0.5, &mut rng);
            let mut x = vec![0.0];
            for v in &y {
                x.push(x[x.len() - 1] + v);
            }
            let whole = super::factor(std::slice::from_ref(&x), &mut correlator).unwrap();
            let thinned: Vec<f64> = x
                .chunks_exact(4)
                .map(|c| c.iter().sum::<f64>() / 4.0)
                .collect();
            let of_averages = super::factor(&[thinned], &mut correlator).unwrap();
            assert!(
                (of_averages / whole - 1.0).abs() < 0.02,
                "{whole} {of_averages}"
            );
        }
    }

    /// Bias and coverage at the two longest cluster times: `IMU_STAND_LONG=1 cargo test -p noise theoh -- --nocapture`
    /// prints them for 2000 records of each noise.
    #[test]
    fn it_is_free_of_the_bias_of_theo1_and_its_interval_covers() {
        let records = if std::env::var_os("IMU_STAND_LONG").is_some() {
            2000
        } else {
            100
        };
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(907);
        // Not the length at which the loss of freedom was measured.
        let n = 600;
        for (name, truth, noise) in [
            (
                "white",
                Truth {
                    n: 1.0,
                    ..Truth::default()
                },
                NoiseType::WhiteRate,
            ),
            (
                "flicker",
                Truth {
                    b: 1.0,
                    ..Truth::default()
                },
                NoiseType::FlickerRate,
            ),
            (
                "walk",
                Truth {
                    k: 1.0,
                    ..Truth::default()
                },
                NoiseType::RandomWalkRate,
            ),
        ] {
            for m in [240usize, 480] {
                let tau = 0.75 * m as f64;
                let expected =
                    truth.n.powi(2) / tau + (0.664 * truth.b).powi(2) + truth.k.powi(2) * tau / 3.0;
                let free = edf(Deviation::Theoh, noise, m, &[n]);
                let (mut mean, mut plain, mut covered, mut square) = (0.0, 0.0, 0, 0.0);
                for _ in 0..records {
                    let phase = single(&truth.record(n, 1.0, &mut rng));
                    let Estimate { deviation: d, .. } =
                        deviation(&phase, Deviation::Theoh, 1.0, m).unwrap();
                    let theo1 = deviation(&phase, Deviation::Theo1, 1.0, m)
                        .unwrap()
                        .deviation;
                    mean += d * d / records as f64;
                    square += d.powi(4) / records as f64;
                    plain += theo1 * theo1 / records as f64;
                    let (low, high) = chi_square_interval(d, free, 0.95);
                    covered += usize::from((low..=high).contains(&expected.sqrt()));
                }
                let share = covered as f64 / records as f64;
                assert!((0.90..=1.0).contains(&share), "{name} {tau}: {share}");
                let bias = mean / expected;
                assert!((0.8..1.5).contains(&bias), "{name} {tau}: {bias}");
                println!(
                    "{name}, {n} samples, tau {tau}: variance / truth {:.3} (Theo1 {:.3}), edf {free:.2} ({:.2} by the scatter), covered {share:.3}",
                    mean / expected,
                    plain / expected,
                    2.0 * mean * mean / (square - mean * mean)
                );
            }
        }
    }
}
