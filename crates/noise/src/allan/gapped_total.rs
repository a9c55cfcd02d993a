//! Total, modified total, Theo1 and ThêoH deviations of a record with gaps.
//!
//! Written in cluster means, none of them needs what a gap took: a reflection of a record with empty places is a record with
//! empty places, and means are over what is there, by the rules of [`Gapped::overlapping_allan`]. Without gaps they are the
//! definitions, but that long cluster times take 64 pairs of Theo1 and 16 windows of mtotdev in a cluster: neighbours say the same.

use rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::gapped::{Gapped, GappedEstimate, NEEDED_SHARE, Segment, WHOLE_BELOW};
use super::{Estimate, theoh};

/// Strides within a cluster: a finer one adds nothing.
const STRIDES: usize = 64;
/// The same of the windows of the modified total deviation, which are three clusters long and cost nine.
const WINDOW_STRIDES: usize = 16;
/// Distances of the two clusters of Theo1 that are taken, of m/2.
const DISTANCES: usize = 256;
/// Ratios behind the factor of ThêoH.
const RATIOS: usize = 32;
/// White windows that tell how much more white noise the gaps of a window let through, and the points of all of them.
const WHITE_WINDOWS: [usize; 2] = [64, 1024];
const WHITE_POINTS: usize = 2_000_000;

impl Gapped {
    /// Total deviation at `m`: the overlapping Allan deviation of every stretch reflected about both ends, about its own
    /// points. `white_share` is the part of white noise in the Allan variance at `m`.
    #[must_use]
    pub fn total(&self, tau0: f64, m: usize, white_share: f64) -> Option<GappedEstimate> {
        let needed = self.needed(m);
        let (mut squares, mut inflation, mut n, mut possible) = (0.0, 0.0, 0usize, 0usize);
        for segment in &self.segments {
            let slots = segment.sums.len() - 1;
            if m == 0 || m + 1 > slots {
                continue;
            }
            let reflected = reflect(segment);
            possible += slots - 1;
            for at in slots + 1..2 * slots {
                let (left, n1) = reflected.part(at - m, at);
                let (right, n2) = reflected.part(at, at + m);
                if n1 < needed || n2 < needed {
                    continue;
                }
                let (n1, n2) = (f64::from(n1), f64::from(n2));
                squares += (right / n2 - left / n1).powi(2);
                inflation += 0.5 * m as f64 * (1.0 / n1 + 1.0 / n2);
                n += 1;
            }
        }
        self.estimate(squares / 2.0, inflation, n, possible, tau0, m, white_share)
    }

    /// Theo1 at `m` (even, from 10), whose cluster time is 0.75·m·τ₀: over all distances 2δ, the mean square of the
    /// difference of two clusters of m/2 − δ slots, times m/2 − δ. `white_share` is the part of white noise in it.
    #[must_use]
    pub fn theo1(&self, tau0: f64, m: usize, white_share: f64) -> Option<GappedEstimate> {
        if m < 10 || !m.is_multiple_of(2) {
            return None;
        }
        let half = m / 2;
        let distances = half.min(DISTANCES);
        let (mut variance, mut inflation, mut pairs, mut possible) = (0.0, 0.0, 0usize, 0usize);
        for d in 0..distances {
            // The middle of equal parts of 0..m/2: all of them where there are few.
            let delta = (2 * d + 1) * half / (2 * distances);
            let length = half - delta;
            // Few slots far apart: which of them are there says nothing of slow noise, and the white is accounted for.
            let needed = if m < 8 * WHOLE_BELOW {
                self.needed(length)
            } else {
                self.share_needed(length)
            };
            let (mut squares, mut white, mut n) = (0.0, 0.0, 0usize);
            for segment in &self.segments {
                let Some(terms) = segment.sums.len().checked_sub(m).filter(|t| *t > 0) else {
                    continue;
                };
                let stride = stride(m, terms, STRIDES).min((length / 8).max(1));
                for i in (0..terms).step_by(stride) {
                    possible += 1;
                    let (first, n1) = segment.part(i, i + length);
                    let (second, n2) = segment.part(i + half + delta, i + m);
                    if n1 < needed || n2 < needed {
                        continue;
                    }
                    let (n1, n2) = (f64::from(n1), f64::from(n2));
                    squares += (second / n2 - first / n1).powi(2);
                    white += 0.5 * length as f64 * (1.0 / n1 + 1.0 / n2);
                    n += 1;
                }
            }
            if n == 0 {
                // A distance that no pair has would leave its noise out.
                return None;
            }
            variance += squares / n as f64 * length as f64;
            inflation += white / n as f64;
            pairs += n;
        }
        let share = white_share.clamp(0.0, 1.0);
        let inflated = share * inflation / distances as f64 + (1.0 - share);
        let scale = half as f64 / distances as f64 / (0.75 * (m * m) as f64);
        Some(GappedEstimate {
            estimate: Estimate {
                m,
                tau_s: 0.75 * m as f64 * tau0,
                deviation: (variance * scale / inflated).sqrt(),
                n: pairs,
            },
            possible,
        })
    }

    /// ThêoH at `m`, as [`super::Deviation::Theoh`] has it, for the longest stretch; `share` is the part of white noise in the
    /// Allan variance (`false`) and in Theo1 (`true`).
    #[must_use]
    pub fn theoh_curve(
        &self,
        tau0: f64,
        ms: &[usize],
        share: impl Fn(bool, usize) -> f64,
    ) -> Vec<GappedEstimate> {
        let longest = self.lengths().into_iter().max().unwrap_or(0);
        let allan_to = theoh::allan_to(longest);
        let allan = |m: usize| self.overlapping_allan(tau0, m, share(false, m));
        let theo1 = |m: usize| self.theo1(tau0, m, share(true, m));
        let beyond = |m: usize| m.is_multiple_of(2) && 3 * m > 4 * allan_to && m <= longest;
        let mut factor = None;
        if ms.iter().any(|m| beyond(*m)) && longest + 1 >= theoh::NEEDED {
            let last = ((longest + 1) / 6).saturating_sub(3);
            let ratios = (last + 1).min(RATIOS);
            let found: Vec<f64> = (0..ratios)
                .filter_map(|k| {
                    let i = (2 * k + 1) * (last + 1) / (2 * ratios);
                    let above = allan(9 + 3 * i)?.estimate.deviation;
                    Some((above / theo1(12 + 4 * i)?.estimate.deviation).powi(2))
                })
                .filter(|r| r.is_finite())
                .collect();
            factor = (!found.is_empty()).then(|| found.iter().sum::<f64>() / found.len() as f64);
        }
        ms.iter()
            .filter_map(|&m| {
                if m <= allan_to {
                    return allan(m);
                }
                let factor = factor.filter(|_| beyond(m))?;
                let mut found = theo1(m)?;
                found.estimate.deviation *= f64::sqrt(factor);
                Some(found)
            })
            .collect()
    }

    /// Modified total deviation at `m`: windows of 3m points, freed from the slope between their halves (by the readings that
    /// are there, with the weights that the definition gives them), extended by even reflection. `white_share` is the
    /// part of white noise in the modified Allan variance at `m`; how much more of it the gaps let through is measured on white
    /// noise of a fixed seed with and without them, in the same windows.
    #[must_use]
    pub fn modified_total(&self, tau0: f64, m: usize, white_share: f64) -> Option<GappedEstimate> {
        if m == 0 {
            return None;
        }
        let rows = 3 * m - 1;
        let mut window = Window::new(m, self.needed(m));
        let (mut squares, mut possible) = (0.0, 0usize);
        let mut places = Vec::new();
        for (s, segment) in self.segments.iter().enumerate() {
            let Some(terms) = segment.sums.len().checked_sub(rows).filter(|t| *t > 0) else {
                continue;
            };
            for j in (0..terms).step_by(stride(m, terms, WINDOW_STRIDES)) {
                possible += 1;
                window.take(segment, j, |sum| sum);
                if let Some(found) = window.mean_square() {
                    squares += found;
                    places.push((s, j));
                }
            }
        }
        let n = places.len();
        if n == 0 {
            return None;
        }
        let [fewest, most] = WHITE_WINDOWS;
        let windows = (WHITE_POINTS / rows).clamp(fewest, most);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(m as u64);
        let (mut seen, mut whole) = (0.0, 0.0);
        let mut full = Window::new(m, m as u32);
        for _ in 0..windows {
            let (s, j) = places[rng.next_u64() as usize % n];
            window.take(&self.segments[s], j, |_| 0.0);
            for (i, slot) in full.readings.iter_mut().enumerate() {
                *slot = (StandardNormal.sample(&mut rng), true);
                window.readings[i].0 = slot.0;
            }
            if let (Some(a), Some(b)) = (window.mean_square(), full.mean_square()) {
                seen += a;
                whole += b;
            }
        }
        self.estimate(
            squares / 2.0,
            seen / whole * n as f64,
            n,
            possible,
            tau0,
            m,
            white_share,
        )
    }
}

/// So many starts apart that `strides` lie within a cluster, and that a stretch of few keeps 64 of them.
fn stride(m: usize, terms: usize, strides: usize) -> usize {
    (m / strides).min(terms / STRIDES).max(1)
}

impl Segment {
    /// Σ of the readings in the slots `from..to`, and their number.
    fn part(&self, from: usize, to: usize) -> (f64, u32) {
        (
            self.sums[to] - self.sums[from],
            self.counts[to] - self.counts[from],
        )
    }
}

/// A stretch between its two mirror images. The phase is reflected oddly, so the rate evenly.
fn reflect(segment: &Segment) -> Segment {
    let slots = segment.sums.len() - 1;
    let order = (0..slots).rev().chain(0..slots).chain((0..slots).rev());
    let (mut sum, mut count) = (0.0, 0);
    let mut out = Segment {
        sums: vec![sum],
        counts: vec![count],
    };
    for slot in order {
        let (s, c) = segment.part(slot, slot + 1);
        sum += s;
        count += c;
        out.sums.push(sum);
        out.counts.push(count);
    }
    out
}

/// One window of the modified total deviation: 3m − 1 readings between 3m points.
struct Window {
    m: usize,
    needed: u32,
    /// Reading and whether it is there.
    readings: Vec<(f64, bool)>,
    /// Weights of the readings in the slope between the means of the two halves.
    weights: Vec<f64>,
    /// Running sums and counts of the three parts.
    extended: Segment,
    sums: Vec<f64>,
    counts: Vec<u32>,
}

impl Window {
    fn new(m: usize, needed: u32) -> Self {
        let (points, half) = (3 * m, 3 * m / 2);
        let weights = (0..points - 1)
            .map(|k| {
                // Points of the later and of the earlier half behind this reading.
                half.min(points - 1 - k) as f64 - half.saturating_sub(1 + k) as f64
            })
            .collect();
        Self {
            m,
            needed,
            readings: vec![(0.0, false); points - 1],
            weights,
            extended: Segment {
                sums: Vec::new(),
                counts: Vec::new(),
            },
            sums: Vec::new(),
            counts: Vec::new(),
        }
    }

    fn take(&mut self, segment: &Segment, from: usize, of: impl Fn(f64) -> f64) {
        for (i, slot) in self.readings.iter_mut().enumerate() {
            let (sum, count) = segment.part(from + i, from + i + 1);
            *slot = (of(sum), count > 0);
        }
    }

    /// Mean of the squares of the 6m averages of m differences of neighbouring cluster means; `None` where half of them
    /// cannot be had.
    fn mean_square(&mut self) -> Option<f64> {
        let (mut sum, mut weight) = (0.0, 0.0);
        for ((value, there), w) in self.readings.iter().zip(&self.weights) {
            if *there {
                sum += w * value;
                weight += w;
            }
        }
        // With m = 1 the halves are single points, and the definition takes the slope between them as well.
        let slope = if weight > 0.0 { sum / weight } else { 0.0 };
        self.extend(slope);
        let m = self.m;
        let differences = 7 * m;
        self.sums.clear();
        self.counts.clear();
        self.sums.push(0.0);
        self.counts.push(0);
        let (mut sum, mut count) = (0.0, 0);
        for i in 0..differences.min(self.extended.sums.len() - 2 * m) {
            let (first, n1) = self.extended.part(i, i + m);
            let (second, n2) = self.extended.part(i + m, i + 2 * m);
            if n1 >= self.needed && n2 >= self.needed {
                sum += second / f64::from(n2) - first / f64::from(n1);
                count += 1;
            }
            self.sums.push(sum);
            self.counts.push(count);
        }
        let needed = if m < WHOLE_BELOW {
            m as u32
        } else {
            (NEEDED_SHARE * m as f64).ceil() as u32
        };
        let (mut squares, mut n) = (0.0, 0usize);
        for i in 0..6 * m {
            let there = self.counts[i + m] - self.counts[i];
            if there >= needed {
                squares += ((self.sums[i + m] - self.sums[i]) / f64::from(there)).powi(2);
                n += 1;
            }
        }
        (n >= 3 * m).then(|| squares / n as f64)
    }

    /// The readings less `slope`, between their mirror images. The phase is reflected evenly, so the rate oddly, and between
    /// two parts stands the same point twice: a rate of nothing.
    fn extend(&mut self, slope: f64) {
        let out = &mut self.extended;
        out.sums.clear();
        out.counts.clear();
        let (mut sum, mut count) = (0.0, 0);
        out.sums.push(sum);
        out.counts.push(count);
        let mut push = |value: f64, there: bool| {
            if there {
                sum += value;
                count += 1;
            }
            out.sums.push(sum);
            out.counts.push(count);
        };
        for (value, there) in self.readings.iter().rev() {
            push(slope - value, *there);
        }
        push(0.0, true);
        for (value, there) in &self.readings {
            push(value - slope, *there);
        }
        push(0.0, true);
        for (value, there) in self.readings.iter().rev() {
            push(slope - value, *there);
        }
    }
}

#[cfg(test)]
#[path = "gapped_total_tests.rs"]
mod tests;
