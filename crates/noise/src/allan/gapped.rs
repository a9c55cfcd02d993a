//! Allan and Hadamard deviations of a record with gaps: cluster means over the samples that are there, at
//! their true times.

use std::ops::Range;

use super::Estimate;

/// Part of a cluster's samples that have to be there, of the part that is there on the whole.
pub(super) const NEEDED_SHARE: f64 = 0.5;
/// Below this many samples a cluster has to be complete.
pub(super) const WHOLE_BELOW: usize = 8;

/// Readings on the grid of sample times, with what is missing left out of both sums and counts.
#[derive(Clone, Debug)]
pub struct Gapped {
    pub(super) segments: Vec<Segment>,
    present: usize,
}

#[derive(Clone, Debug)]
pub(super) struct Segment {
    /// Σ of the readings before each slot, less their mean.
    pub(super) sums: Vec<f64>,
    /// Their number.
    pub(super) counts: Vec<u32>,
}

/// A deviation of a gapped record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GappedEstimate {
    /// The deviation and the number of differences in it.
    pub estimate: Estimate,
    /// Differences that there would be without gaps.
    pub possible: usize,
}

/// Rows of one stretch of the grid.
pub(crate) fn segments(runs: &[Range<usize>], slots: &[u64]) -> Vec<Vec<Range<usize>>> {
    let present: usize = runs.iter().map(ExactSizeIterator::len).sum();
    let mut out: Vec<Vec<Range<usize>>> = Vec::new();
    for run in runs.iter().filter(|r| !r.is_empty()) {
        match out.last_mut() {
            // A gap longer than all that was measured, or of unknown length, is not bridged.
            Some(segment)
                if segment.last().is_some_and(|last| {
                    slots[run.start] > slots[last.end - 1]
                        && slots[run.start] - slots[last.end - 1] <= present as u64
                }) =>
            {
                segment.push(run.clone());
            }
            _ => out.push(vec![run.clone()]),
        }
    }
    out
}

/// Sums over differences of clusters.
#[derive(Clone, Copy, Debug, Default)]
struct Summed {
    squares: f64,
    inflation: f64,
    n: usize,
    possible: usize,
}

impl Summed {
    /// The variance is the mean square over `divisor`.
    fn estimate(
        self,
        of: &Gapped,
        divisor: f64,
        tau0: f64,
        m: usize,
        white_share: f64,
    ) -> Option<GappedEstimate> {
        let Self {
            squares,
            inflation,
            n,
            possible,
        } = self;
        of.estimate(
            squares / divisor,
            inflation,
            n,
            possible,
            tau0,
            m,
            white_share,
        )
    }
}

impl Gapped {
    /// Of the readings in `runs` (rows without a gap between them); `slots` is the place of each row on the grid of
    /// sample times ([`model::record::sampling::Sampling::slots`]).
    #[must_use]
    pub fn new(values: &[f64], runs: &[Range<usize>], slots: &[u64]) -> Self {
        let present: usize = runs.iter().map(ExactSizeIterator::len).sum();
        let mean =
            runs.iter().flat_map(|r| &values[r.clone()]).sum::<f64>() / present.max(1) as f64;
        let segments = segments(runs, slots)
            .into_iter()
            .map(|rows| {
                let first = slots[rows[0].start];
                let last = rows.last().map_or(first, |r| slots[r.end - 1]);
                let length = (last - first) as usize + 1;
                let (mut sums, mut counts) = (vec![0.0; length + 1], vec![0u32; length + 1]);
                for row in rows.into_iter().flatten() {
                    let slot = (slots[row] - first) as usize + 1;
                    sums[slot] = values[row] - mean;
                    counts[slot] = 1;
                }
                let (mut sum, mut count) = (0.0, 0);
                for (s, c) in sums.iter_mut().zip(&mut counts) {
                    sum += *s;
                    count += *c;
                    (*s, *c) = (sum, count);
                }
                Segment { sums, counts }
            })
            .collect();
        Self { segments, present }
    }

    /// Slots of the grid in each stretch, those with nothing in them included.
    #[must_use]
    pub fn lengths(&self) -> Vec<usize> {
        self.segments.iter().map(|s| s.sums.len() - 1).collect()
    }

    /// Share of the slots that are filled.
    #[must_use]
    pub fn filled(&self) -> f64 {
        self.present as f64 / self.lengths().iter().sum::<usize>().max(1) as f64
    }

    /// Overlapping Allan deviation at `m`: neighbouring clusters of `m` slots of which each is filled enough, their means
    /// taken over what is there; `None` where there are none.
    ///
    /// A mean over fewer samples has more white noise in it. `white_share` is the part that white noise has in the Allan
    /// variance at `m` (0..1, from a fit): that part is divided by the mean of (m/n₁ + m/n₂)/2, the rest is not.
    #[must_use]
    pub fn overlapping_allan(
        &self,
        tau0: f64,
        m: usize,
        white_share: f64,
    ) -> Option<GappedEstimate> {
        self.second_differences(tau0, m, 1, white_share)
    }

    /// Allan deviation at `m` of clusters side by side, by the same rules.
    #[must_use]
    pub fn allan(&self, tau0: f64, m: usize, white_share: f64) -> Option<GappedEstimate> {
        self.second_differences(tau0, m, m, white_share)
    }

    fn second_differences(
        &self,
        tau0: f64,
        m: usize,
        stride: usize,
        white_share: f64,
    ) -> Option<GappedEstimate> {
        let white = |[first, second]: [f64; 2]| 0.5 * m as f64 * (1.0 / first + 1.0 / second);
        self.differences((m, stride), |[first, second]| second - first, white)
            .estimate(self, 2.0, tau0, m, white_share)
    }

    /// Overlapping Hadamard deviation at `m`, by the same rules: (ȳ₃ − 2ȳ₂ + ȳ₁)²/6, the white part divided by the mean of
    /// (m/n₁ + 4m/n₂ + m/n₃)/6. `white_share` is the part of white noise in the Hadamard variance.
    #[must_use]
    pub fn overlapping_hadamard(
        &self,
        tau0: f64,
        m: usize,
        white_share: f64,
    ) -> Option<GappedEstimate> {
        self.third_differences(tau0, m, 1, white_share)
    }

    /// Hadamard deviation at `m` of clusters side by side, by the same rules.
    #[must_use]
    pub fn hadamard(&self, tau0: f64, m: usize, white_share: f64) -> Option<GappedEstimate> {
        self.third_differences(tau0, m, m, white_share)
    }

    fn third_differences(
        &self,
        tau0: f64,
        m: usize,
        stride: usize,
        white_share: f64,
    ) -> Option<GappedEstimate> {
        let white = |[first, second, third]: [f64; 3]| {
            m as f64 * (1.0 / first + 4.0 / second + 1.0 / third) / 6.0
        };
        let difference = |[first, second, third]: [f64; 3]| third - 2.0 * second + first;
        self.differences((m, stride), difference, white)
            .estimate(self, 6.0, tau0, m, white_share)
    }

    /// Sums over `CLUSTERS` neighbouring clusters of `m` slots, every `stride`-th: of the squared difference of their means,
    /// and of what so many samples make of the variance of white noise.
    fn differences<const CLUSTERS: usize>(
        &self,
        (m, stride): (usize, usize),
        difference: impl Fn([f64; CLUSTERS]) -> f64,
        white: impl Fn([f64; CLUSTERS]) -> f64,
    ) -> Summed {
        let needed = self.needed(m);
        let mut all = Summed::default();
        for Segment { sums, counts } in &self.segments {
            let terms = sums.len().checked_sub(CLUSTERS * m);
            let Some(terms) = terms.filter(|t| *t > 0 && m > 0) else {
                continue;
            };
            all.possible += terms.div_ceil(stride);
            for k in (0..terms).step_by(stride) {
                let filled: [u32; CLUSTERS] =
                    std::array::from_fn(|i| counts[k + (i + 1) * m] - counts[k + i * m]);
                if filled.iter().any(|f| *f < needed) {
                    continue;
                }
                let filled = filled.map(f64::from);
                let means =
                    std::array::from_fn(|i| (sums[k + (i + 1) * m] - sums[k + i * m]) / filled[i]);
                all.squares += difference(means).powi(2);
                all.inflation += white(filled);
                all.n += 1;
            }
        }
        all
    }

    /// Samples that a cluster of `m` slots needs.
    pub(super) fn needed(&self, m: usize) -> u32 {
        if m < WHOLE_BELOW {
            m as u32
        } else {
            self.share_needed(m)
        }
    }

    /// The same without asking short ones to be complete.
    pub(super) fn share_needed(&self, m: usize) -> u32 {
        (NEEDED_SHARE * self.filled() * m as f64).ceil().max(1.0) as u32
    }

    #[expect(clippy::too_many_arguments, reason = "the sums of one pass")]
    pub(super) fn estimate(
        &self,
        squares: f64,
        inflation: f64,
        n: usize,
        possible: usize,
        tau0: f64,
        m: usize,
        white_share: f64,
    ) -> Option<GappedEstimate> {
        if n == 0 {
            return None;
        }
        let share = white_share.clamp(0.0, 1.0);
        let inflated = share * inflation / n as f64 + (1.0 - share);
        Some(GappedEstimate {
            estimate: Estimate {
                m,
                tau_s: m as f64 * tau0,
                deviation: (squares / n as f64 / inflated).sqrt(),
                n,
            },
            possible,
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::allan::{Deviation, Phase, deviation};
    use crate::edf::{NoiseType, edf};
    use crate::synthetic::Truth;
    use rand_core::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// Rows left of `n` slots after each was dropped with a chance of `percent`, as values, runs and slots.
    pub(in crate::allan) fn thinned(
        y: &[f64],
        percent: u64,
        rng: &mut Xoshiro256PlusPlus,
    ) -> (Vec<f64>, Vec<Range<usize>>, Vec<u64>) {
        let (mut values, mut slots): (Vec<f64>, Vec<u64>) = (Vec::new(), Vec::new());
        for (i, v) in y.iter().enumerate() {
            if rng.next_u64() % 100 >= percent {
                values.push(*v);
                slots.push(i as u64);
            }
        }
        let mut runs = Vec::new();
        let mut start = 0;
        for i in 1..=slots.len() {
            if i == slots.len() || slots[i] != slots[i - 1] + 1 {
                runs.push(start..i);
                start = i;
            }
        }
        (values, runs, slots)
    }

    #[test]
    fn without_gaps_it_is_the_overlapping_allan_deviation() {
        let y: Vec<f64> = (0..500i64)
            .map(|k| ((k * k * 7919 + 31 * k) % 101) as f64)
            .collect();
        let whole = 0..500;
        let runs = std::slice::from_ref(&whole);
        let gapped = Gapped::new(&y, runs, &(0..500).collect::<Vec<u64>>());
        let phase = Phase::from_values(&y, runs);
        for m in [1, 7, 100] {
            let a = gapped.overlapping_allan(0.1, m, 0.5).unwrap();
            let b = deviation(&phase, Deviation::Oadev, 0.1, m).unwrap();
            assert_eq!((a.estimate.n, a.possible), (b.n, b.n));
            assert!((a.estimate.deviation / b.deviation - 1.0).abs() < 1e-9);
            let a = gapped.overlapping_hadamard(0.1, m, 0.5).unwrap();
            let b = deviation(&phase, Deviation::Ohdev, 0.1, m).unwrap();
            assert_eq!((a.estimate.n, a.possible), (b.n, b.n));
            assert!((a.estimate.deviation / b.deviation - 1.0).abs() < 1e-9);
        }
        assert_eq!(gapped.overlapping_allan(0.1, 251, 0.5), None);
    }

    #[test]
    fn a_third_of_the_samples_lost_at_random_leaves_the_deviation_unbiased_and_its_freedom_as_stated()
     {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(19);
        let (n, tau0, m) = (4000, 0.05, 100);
        // White noise at m = 100: N/√τ; a walk there: K√(τ/3).
        for (truth, share, expected, noise) in [
            (
                Truth {
                    n: 0.1,
                    ..Truth::default()
                },
                1.0,
                0.1 / 5f64.sqrt(),
                NoiseType::WhiteRate,
            ),
            (
                Truth {
                    k: 0.1,
                    ..Truth::default()
                },
                0.0,
                0.1 * (5.0f64 / 3.0).sqrt(),
                NoiseType::RandomWalkRate,
            ),
        ] {
            let runs = 300;
            // A walk has half the Hadamard variance.
            let hadamard = expected * if share == 0.0 { 0.5f64.sqrt() } else { 1.0 };
            let variances: Vec<[f64; 2]> = (0..runs)
                .map(|_| {
                    let (y, rows, slots) = thinned(&truth.record(n, tau0, &mut rng), 33, &mut rng);
                    let gapped = Gapped::new(&y, &rows, &slots);
                    let square = |found: Option<GappedEstimate>, expected: f64| {
                        (found.unwrap().estimate.deviation / expected).powi(2)
                    };
                    [
                        square(gapped.overlapping_allan(tau0, m, share), expected),
                        square(gapped.overlapping_hadamard(tau0, m, share), hadamard),
                    ]
                })
                .collect();
            for (i, kind) in [Deviation::Oadev, Deviation::Ohdev].into_iter().enumerate() {
                let mean = variances.iter().map(|v| v[i]).sum::<f64>() / runs as f64;
                let spread = variances.iter().map(|v| (v[i] - mean).powi(2)).sum::<f64>()
                    / (runs - 1) as f64;
                // Freedom about 50: a standard error of 1.2 % of the mean, and 8 % of the spread.
                assert!((mean - 1.0).abs() < 0.05, "{kind:?} {truth:?}: {mean}");
                let freedom = edf(kind, noise, m, &[n]);
                let ratio = 2.0 * mean * mean / spread / freedom;
                assert!((0.75..1.33).contains(&ratio), "{kind:?} {truth:?}: {ratio}");
            }
        }
    }

    #[test]
    fn a_gap_of_unknown_length_is_not_bridged() {
        let y = vec![1.0; 40];
        let slots: Vec<u64> = (0..40u64)
            .map(|i| if i < 20 { i } else { i + (1 << 40) })
            .collect();
        let gapped = Gapped::new(&y, &[0..20, 20..40], &slots);
        assert_eq!(gapped.lengths(), [20, 20]);
        assert_eq!(gapped.overlapping_allan(1.0, 11, 0.0), None);
    }
}
