//! Integrated readings, in runs without gaps.

use std::ops::{Add, Range, Sub};

use super::correlate::Correlator;
use super::{Deviation, Estimate, kernels, theoh, total};

/// A point of integrated readings: `f64`, or `i64` where the readings are counts and every sum is exact.
pub trait PhasePoint: Copy + Default + Add<Output = Self> + Sub<Output = Self> {
    /// As a floating-point number.
    fn to_f64(self) -> f64;
}

impl PhasePoint for f64 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
}

impl PhasePoint for i64 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self as f64
    }
}

/// Differences in a block: its points fit a second-level cache, with those of the short cluster times.
const BLOCK: usize = 1 << 14;

#[derive(Clone, Debug)]
enum Runs {
    Counts(Vec<Vec<i64>>),
    Values(Vec<Vec<f64>>),
}

/// Integrated readings: a run of `n` samples holds `n + 1` points, the first of them 0.
#[derive(Clone, Debug)]
pub struct Phase {
    runs: Runs,
    unit_per_count: f64,
    samples: usize,
    longest_run: usize,
}

impl Phase {
    /// From readings in unit U; `runs` are the rows without a gap between them. The mean over all of them is taken out
    /// first: no deviation sees it, and the sums stay small.
    #[must_use]
    pub fn from_values(values: &[f64], runs: &[Range<usize>]) -> Self {
        let samples: usize = runs.iter().map(ExactSizeIterator::len).sum();
        let mean =
            runs.iter().flat_map(|r| &values[r.clone()]).sum::<f64>() / samples.max(1) as f64;
        let points = runs
            .iter()
            .map(|run| {
                let mut sum = 0.0;
                let mut out = Vec::with_capacity(run.len() + 1);
                out.push(0.0);
                out.extend(values[run.clone()].iter().map(|v| {
                    sum += v - mean;
                    sum
                }));
                out
            })
            .collect();
        Self::new(Runs::Values(points), 1.0, runs)
    }

    /// From counts of `unit_per_count` U each: sums are exact.
    #[must_use]
    pub fn from_counts(counts: &[i32], unit_per_count: f64, runs: &[Range<usize>]) -> Self {
        let samples: usize = runs.iter().map(ExactSizeIterator::len).sum();
        let total: i64 = runs
            .iter()
            .flat_map(|r| &counts[r.clone()])
            .map(|c| i64::from(*c))
            .sum();
        let mean = total / samples.max(1) as i64;
        let points = runs
            .iter()
            .map(|run| {
                let mut sum = 0i64;
                let mut out = Vec::with_capacity(run.len() + 1);
                out.push(0);
                out.extend(counts[run.clone()].iter().map(|c| {
                    sum += i64::from(*c) - mean;
                    sum
                }));
                out
            })
            .collect();
        Self::new(Runs::Counts(points), unit_per_count, runs)
    }

    /// From one run of readings, integrated in place: no second copy of a long record.
    #[must_use]
    pub fn in_place(mut values: Vec<f64>) -> Self {
        let samples = values.len();
        let mean = values.iter().sum::<f64>() / samples.max(1) as f64;
        values.reserve_exact(1);
        let mut sum = 0.0;
        for v in &mut values {
            let reading = *v;
            *v = sum;
            sum += reading - mean;
        }
        values.push(sum);
        Self::new(
            Runs::Values(vec![values]),
            1.0,
            std::slice::from_ref(&(0..samples)),
        )
    }

    /// Overlapping Allan deviations at all of `ms` (ascending) in one go: a block of points is used for every `m` while
    /// it is in the cache. The same numbers as one by one, but for the order of additions.
    #[must_use]
    pub fn overlapping_allan(&self, tau0: f64, ms: &[usize]) -> Vec<Estimate> {
        fn sums<T: PhasePoint>(runs: &[Vec<T>], ms: &[usize]) -> Vec<(f64, usize)> {
            let mut out = vec![(0.0, 0); ms.len()];
            for x in runs {
                for start in (0..x.len()).step_by(BLOCK) {
                    for (&m, out) in ms.iter().zip(&mut out) {
                        let end = (start + BLOCK + 2 * m).min(x.len());
                        let (squares, n) = kernels::second_differences(&x[start..end], m, 1);
                        out.0 += squares;
                        out.1 += n;
                    }
                }
            }
            out
        }
        let sums = match &self.runs {
            Runs::Counts(runs) => sums(runs, ms),
            Runs::Values(runs) => sums(runs, ms),
        };
        ms.iter()
            .zip(sums)
            .filter(|(_, (_, n))| *n > 0)
            .map(|(&m, (squares, n))| Estimate {
                m,
                tau_s: m as f64 * tau0,
                deviation: (squares / (2.0 * n as f64)).sqrt() / m as f64 * self.unit_per_count,
                n,
            })
            .collect()
    }

    /// Deviations of one kind at all of `ms` (ascending); those no run is long enough for are left out.
    #[must_use]
    pub fn curve(&self, kind: Deviation, tau0: f64, ms: &[usize]) -> Vec<Estimate> {
        if kind == Deviation::Oadev {
            return self.overlapping_allan(tau0, ms);
        }
        let mut correlator = Correlator::new();
        if kind == Deviation::Theoh {
            return self.theoh(tau0, ms, &mut correlator);
        }
        ms.iter()
            .filter(|m| **m > 0)
            .filter_map(|m| self.deviation(kind, tau0, *m, &mut correlator))
            .collect()
    }

    /// ThêoH: those of `ms` that its two parts have.
    fn theoh(&self, tau0: f64, ms: &[usize], correlator: &mut Correlator) -> Vec<Estimate> {
        let allan_to = theoh::allan_to(self.longest_run);
        let beyond = |m: usize| m.is_multiple_of(2) && 3 * m > 4 * allan_to;
        let longest = Deviation::Theoh.longest(self.longest_run);
        // The factor is for all of them, and costs more than one.
        let factor = if ms.iter().any(|m| beyond(*m) && *m <= longest) {
            match &self.runs {
                Runs::Counts(runs) => theoh::factor(runs, correlator),
                Runs::Values(runs) => theoh::factor(runs, correlator),
            }
        } else {
            None
        };
        ms.iter()
            .filter_map(|&m| {
                if m <= allan_to && m <= longest {
                    return self.deviation(Deviation::Oadev, tau0, m, correlator);
                }
                let factor = factor.filter(|_| beyond(m))?;
                let mut out = self.deviation(Deviation::Theo1, tau0, m, correlator)?;
                out.deviation *= factor.sqrt();
                Some(out)
            })
            .collect()
    }

    fn new(points: Runs, unit_per_count: f64, runs: &[Range<usize>]) -> Self {
        Self {
            runs: points,
            unit_per_count,
            samples: runs.iter().map(ExactSizeIterator::len).sum(),
            longest_run: runs.iter().map(ExactSizeIterator::len).max().unwrap_or(0),
        }
    }

    /// Samples in all runs.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Samples in the longest run.
    #[must_use]
    pub fn longest_run(&self) -> usize {
        self.longest_run
    }

    /// Samples of each run.
    #[must_use]
    pub fn run_lengths(&self) -> Vec<usize> {
        match &self.runs {
            Runs::Counts(runs) => runs.iter().map(|r| r.len() - 1).collect(),
            Runs::Values(runs) => runs.iter().map(|r| r.len() - 1).collect(),
        }
    }

    /// Means over `m` samples, of all runs one after the other.
    #[must_use]
    pub fn cluster_means(&self, m: usize) -> Vec<f64> {
        fn means<T: PhasePoint>(runs: &[Vec<T>], m: usize, unit: f64) -> Vec<f64> {
            runs.iter()
                .flat_map(|x| {
                    x.iter()
                        .step_by(m)
                        .zip(x.iter().skip(m).step_by(m))
                        .map(move |(a, b)| (*b - *a).to_f64() * unit / m as f64)
                })
                .collect()
        }
        match &self.runs {
            Runs::Counts(runs) => means(runs, m, self.unit_per_count),
            Runs::Values(runs) => means(runs, m, self.unit_per_count),
        }
    }

    pub(super) fn deviation(
        &self,
        kind: Deviation,
        tau0: f64,
        m: usize,
        correlator: &mut Correlator,
    ) -> Option<Estimate> {
        if kind == Deviation::Theoh {
            return self.theoh(tau0, &[m], correlator).pop();
        }
        let (squares, n) = match &self.runs {
            Runs::Counts(runs) => squares(runs, kind, m, correlator),
            Runs::Values(runs) => squares(runs, kind, m, correlator),
        };
        if n == 0 {
            return None;
        }
        let mf = m as f64;
        // The points count samples, so τ₀ cancels: a second difference over m points is m·τ₀·(ȳ₂ − ȳ₁)/τ₀.
        let factor = match kind {
            Deviation::Adev | Deviation::Oadev | Deviation::Totdev => 1.0 / (2.0 * mf * mf),
            Deviation::Mdev | Deviation::Tdev | Deviation::Mtotdev => 1.0 / (2.0 * mf.powi(4)),
            Deviation::Hdev | Deviation::Ohdev => 1.0 / (6.0 * mf * mf),
            Deviation::Theo1 | Deviation::Theoh => 1.0 / (0.75 * mf * mf),
        };
        let mut deviation = (squares * factor / n as f64).sqrt() * self.unit_per_count;
        if kind == Deviation::Tdev {
            deviation *= mf * tau0 / 3f64.sqrt();
        }
        Some(Estimate {
            m,
            tau_s: if kind == Deviation::Theo1 {
                0.75 * mf * tau0
            } else {
                mf * tau0
            },
            deviation,
            n,
        })
    }
}

/// Sum of the squared differences of a deviation over all runs, and their number.
fn squares<T: PhasePoint>(
    runs: &[Vec<T>],
    kind: Deviation,
    m: usize,
    correlator: &mut Correlator,
) -> (f64, usize) {
    let mut out = (0.0, 0);
    for x in runs {
        let (squares, n) = match kind {
            Deviation::Adev => kernels::second_differences(x, m, m),
            Deviation::Oadev => kernels::second_differences(x, m, 1),
            Deviation::Mdev | Deviation::Tdev => kernels::averaged_second_differences(x, m),
            Deviation::Hdev => kernels::third_differences(x, m, m),
            Deviation::Ohdev => kernels::third_differences(x, m, 1),
            Deviation::Totdev => total::total(x, m),
            Deviation::Mtotdev => total::modified_total(x, m, correlator),
            Deviation::Theo1 | Deviation::Theoh => total::theo1(x, m, correlator),
        };
        out.0 += squares;
        out.1 += n;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::allan::{TauGrid, deviation};

    #[test]
    fn all_cluster_times_in_one_go_are_those_one_by_one() {
        let y: Vec<f64> = (0..50_000i64)
            .map(|k| ((k * k * 7919 + 31 * k) % 1013) as f64)
            .collect();
        let runs = [0..20_000, 20_001..50_000];
        let ms = TauGrid::Octave.factors(15_000);
        for phase in [Phase::from_values(&y, &runs), Phase::in_place(y.clone())] {
            let together = phase.overlapping_allan(0.05, &ms);
            assert_eq!(together.len(), ms.len());
            for e in together {
                let alone = deviation(&phase, Deviation::Oadev, 0.05, e.m).unwrap();
                assert_eq!(e.n, alone.n);
                assert!(
                    (e.deviation / alone.deviation - 1.0).abs() < 1e-12,
                    "m = {}",
                    e.m
                );
            }
        }
    }
}
