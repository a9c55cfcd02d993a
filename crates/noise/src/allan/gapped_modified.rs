//! Modified Allan and time deviation of a record with gaps: averages over the differences of cluster means that are there.

use super::gapped::{Gapped, GappedEstimate, NEEDED_SHARE, Segment, WHOLE_BELOW};

/// Windows whose white noise is computed sample by sample.
const SAMPLED: usize = 128;

impl Gapped {
    /// Modified Allan deviation at `m`: mean square of averages over `m` neighbouring differences ȳᵢ₊ₘ − ȳᵢ of cluster
    /// means, halved. Cluster means are over the samples that are there, by the rules of
    /// [`Gapped::overlapping_allan`]; of the `m` differences at least half have to be there (all, below 8), and the average
    /// is over those.
    ///
    /// `white_share` is the part of white noise in the modified Allan variance at `m`: that part is divided by how much
    /// more of it the weights of the samples let through than those of a whole window, Σw²/Σw₀², the mean over
    /// 128 windows spread over the record.
    #[must_use]
    pub fn modified_allan(&self, tau0: f64, m: usize, white_share: f64) -> Option<GappedEstimate> {
        if m == 0 {
            return None;
        }
        let needed = self.needed(m);
        let needed_differences = if m < WHOLE_BELOW {
            m as u32
        } else {
            (NEEDED_SHARE * m as f64).ceil() as u32
        };
        let (mut squares, mut n, mut possible) = (0.0, 0usize, 0usize);
        let mut places: Vec<(usize, usize)> = Vec::new();
        for (at, segment) in self.segments.iter().enumerate() {
            let slots = segment.sums.len() - 1;
            let Some(terms) = (slots + 2).checked_sub(3 * m).filter(|t| *t > 0) else {
                continue;
            };
            possible += terms;
            let (sums, counts) = differences(segment, m, needed);
            for j in 0..terms {
                let there = counts[j + m] - counts[j];
                if there < needed_differences {
                    continue;
                }
                squares += ((sums[j + m] - sums[j]) / f64::from(there)).powi(2);
                n += 1;
                places.push((at, j));
            }
        }
        if n == 0 {
            return None;
        }
        let step = n.div_ceil(SAMPLED);
        let whole = Segment {
            sums: vec![0.0; 3 * m],
            counts: (0..3 * m as u32).collect(),
        };
        let nominal = white(&whole, 0, m, m as u32);
        let chosen = places.iter().step_by(step);
        let count = chosen.len() as f64;
        let seen: f64 = chosen
            .map(|(at, j)| white(&self.segments[*at], *j, m, needed))
            .sum();
        let inflation = seen / count / nominal;
        self.estimate(
            squares / 2.0,
            inflation * n as f64,
            n,
            possible,
            tau0,
            m,
            white_share,
        )
    }
}

/// Running sums of the differences of neighbouring clusters that are filled enough, and of their number.
fn differences(segment: &Segment, m: usize, needed: u32) -> (Vec<f64>, Vec<u32>) {
    let total = segment.sums.len() - 2 * m;
    let (mut sums, mut counts) = (Vec::with_capacity(total + 1), Vec::with_capacity(total + 1));
    let (mut sum, mut count) = (0.0, 0);
    sums.push(sum);
    counts.push(count);
    for i in 0..total {
        if let Some((first, second)) = filled(segment, i, m, needed) {
            sum += (segment.sums[i + 2 * m] - segment.sums[i + m]) / second
                - (segment.sums[i + m] - segment.sums[i]) / first;
            count += 1;
        }
        sums.push(sum);
        counts.push(count);
    }
    (sums, counts)
}

/// Samples in the two clusters of `m` slots from `i` on, where both are filled enough.
fn filled(segment: &Segment, i: usize, m: usize, needed: u32) -> Option<(f64, f64)> {
    let first = segment.counts[i + m] - segment.counts[i];
    let second = segment.counts[i + 2 * m] - segment.counts[i + m];
    (first >= needed && second >= needed).then(|| (f64::from(first), f64::from(second)))
}

/// Σw² of the window at `j`: the variance of its average for white noise of variance 1.
fn white(segment: &Segment, j: usize, m: usize, needed: u32) -> f64 {
    // Steps of the weights; their running sum is the weight of a slot.
    let mut steps = vec![0.0; 3 * m + 1];
    let mut there = 0.0;
    for i in 0..m {
        let Some((first, second)) = filled(segment, j + i, m, needed) else {
            continue;
        };
        steps[i] -= 1.0 / first;
        steps[i + m] += 1.0 / first + 1.0 / second;
        steps[i + 2 * m] -= 1.0 / second;
        there += 1.0;
    }
    let (mut weight, mut sum) = (0.0, 0.0);
    for (i, step) in steps.iter().take(3 * m - 1).enumerate() {
        weight += step;
        let present = segment.counts[j + i + 1] - segment.counts[j + i];
        sum += f64::from(present) * weight * weight;
    }
    sum / (there * there)
}

#[cfg(test)]
mod tests {
    use super::super::gapped::tests::thinned;
    use super::*;
    use crate::allan::{Deviation, Phase, deviation};
    use crate::edf::{NoiseType, edf};
    use crate::synthetic::Truth;
    use rand_core::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn without_gaps_it_is_the_modified_allan_deviation() {
        let y: Vec<f64> = (0..500i64)
            .map(|k| ((k * k * 7919 + 31 * k) % 101) as f64)
            .collect();
        let whole = 0..500;
        let runs = std::slice::from_ref(&whole);
        let gapped = Gapped::new(&y, runs, &(0..500).collect::<Vec<u64>>());
        let phase = Phase::from_values(&y, runs);
        for m in [1, 2, 7, 100, 167] {
            let a = gapped.modified_allan(0.1, m, 1.0).unwrap();
            let b = deviation(&phase, Deviation::Mdev, 0.1, m).unwrap();
            assert_eq!((a.estimate.n, a.possible), (b.n, b.n), "{m}");
            assert!(
                (a.estimate.deviation / b.deviation - 1.0).abs() < 1e-9,
                "{m}"
            );
        }
        assert_eq!(gapped.modified_allan(0.1, 168, 0.5), None);
    }

    #[test]
    fn a_third_of_the_samples_lost_at_random_leaves_it_unbiased_and_its_freedom_as_stated() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(23);
        let (n, tau0, m) = (4000, 0.05, 100);
        // At m = 100 white noise has half the Allan variance, a walk 33/40 of it.
        for (truth, share, expected, noise) in [
            (
                Truth {
                    n: 0.1,
                    ..Truth::default()
                },
                1.0,
                0.1 / 10f64.sqrt(),
                NoiseType::WhiteRate,
            ),
            (
                Truth {
                    k: 0.1,
                    ..Truth::default()
                },
                0.0,
                0.1 * (5.0f64 / 3.0 * 33.0 / 40.0).sqrt(),
                NoiseType::RandomWalkRate,
            ),
        ] {
            let runs = 300;
            let variances: Vec<f64> = (0..runs)
                .map(|_| {
                    let (y, rows, slots) = thinned(&truth.record(n, tau0, &mut rng), 33, &mut rng);
                    let gapped = Gapped::new(&y, &rows, &slots);
                    let found = gapped.modified_allan(tau0, m, share).unwrap();
                    (found.estimate.deviation / expected).powi(2)
                })
                .collect();
            let mean = variances.iter().sum::<f64>() / runs as f64;
            let spread =
                variances.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (runs - 1) as f64;
            // Freedom about 30: a standard error of 1.5 % of the mean, and 8 % of the spread.
            assert!((mean - 1.0).abs() < 0.06, "{truth:?}: {mean}");
            let freedom = edf(Deviation::Mdev, noise, m, &[n]);
            let ratio = 2.0 * mean * mean / spread / freedom;
            assert!((0.75..1.33).contains(&ratio), "{truth:?}: {ratio}");
        }
    }

    #[test]
    fn long_gaps_do_not_end_it_and_leave_white_noise_unbiased() {
        // Runs of 70 slots, gaps of 30: no run carries m = 100.
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(29);
        let truth = Truth {
            n: 0.1,
            ..Truth::default()
        };
        let (tau0, m, records) = (0.05, 100, 200);
        let mean = (0..records)
            .map(|_| {
                let y = truth.record(4000, tau0, &mut rng);
                let slots: Vec<u64> = (0..4000u64).filter(|s| s % 100 < 70).collect();
                let values: Vec<f64> = slots.iter().map(|s| y[*s as usize]).collect();
                let rows: Vec<std::ops::Range<usize>> =
                    (0..40).map(|k| 70 * k..70 * (k + 1)).collect();
                let found = Gapped::new(&values, &rows, &slots)
                    .modified_allan(tau0, m, 1.0)
                    .unwrap();
                (found.estimate.deviation / (0.1 / 10f64.sqrt())).powi(2)
            })
            .sum::<f64>()
            / f64::from(records);
        // Freedom about 50: a standard error of 1.4 %.
        assert!((mean - 1.0).abs() < 0.06, "{mean}");
    }
}
