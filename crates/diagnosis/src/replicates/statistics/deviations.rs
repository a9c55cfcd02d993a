//! Allan deviations and angles, by prefix sums.

use super::Statistic;

/// Angles are compared over these times, s.
const ANGLES_S: [f64; 2] = [10.0, 100.0];
/// A stretch is to hold so many clusters, and so many times the time of an angle.
const CLUSTERS: usize = 8;
const TIMES: usize = 4;
/// Places in a cluster, or in the time of an angle, at which one begins: more add nothing.
const PLACES: usize = 8;
/// Clusters of which one begins at every sample.
const EVERY: [usize; 4] = [1, 2, 4, 8];
/// Prefix sums that two of the longest of them have.
const SPAN: usize = 2 * EVERY[EVERY.len() - 1] + 1;
/// Fewest stretches whose means have a deviation.
const LEAST_STRETCHES: usize = 4;

/// Overlapping Allan deviation by octaves, changes of the angle, and deviation of the means of stretches.
pub(super) struct Deviations {
    length: usize,
    stretches: usize,
    tau0: f64,
    clusters: Vec<usize>,
    angles: Vec<(f64, usize)>,
}

impl Deviations {
    pub fn new(length: usize, stretches: usize, rate_hz: f64) -> Self {
        let octaves = std::iter::successors(Some(1), |m| Some(2 * m));
        let angles = ANGLES_S.map(|t| (t, (t * rate_hz).round() as usize));
        Self {
            length,
            stretches,
            tau0: 1.0 / rate_hz,
            clusters: octaves.take_while(|m| CLUSTERS * m <= length).collect(),
            angles: angles
                .into_iter()
                .filter(|(_, m)| *m > 0 && TIMES * m <= length)
                .collect(),
        }
    }

    pub fn name(&self, unit: &str, all: &mut Vec<Statistic>) {
        for m in &self.clusters {
            let tau = *m as f64 * self.tau0;
            let what = format!("Allan deviation at {} s", short(tau));
            // Its band ends at about half a cycle in tau.
            all.push(Statistic::new(what, unit).below(0.5 / tau));
        }
        let (integral, its_unit) = model::integral::of(unit);
        for (t, _) in &self.angles {
            let what = format!("change of the {integral} over {t} s");
            all.push(Statistic::new(what, &its_unit).below(0.5 / t));
        }
        if self.stretches >= LEAST_STRETCHES {
            let what = "deviation from stretch to stretch";
            all.push(Statistic::new(what, unit).below(0.0));
        }
    }

    /// Of the prefix sums of readings about their mean, one more than readings.
    pub fn take(&self, sums: &[f64], all: &mut Vec<f64>) {
        let (every, some) = self.clusters.split_at(EVERY.len().min(self.clusters.len()));
        let squares = self.at_every_place(sums);
        for (m, square) in every.iter().zip(squares) {
            let count = self.stretches * (self.length - 2 * m + 1);
            all.push((0.5 * (square / count as f64)).sqrt() / *m as f64);
        }
        for m in some {
            let bend = |s: &[f64], k: usize| s[k + 2 * m] - 2.0 * s[k + m] + s[k];
            let mean = self.mean_square(sums, 2 * m, *m, bend);
            all.push((0.5 * mean).sqrt() / *m as f64);
        }
        for (_, m) in &self.angles {
            let mean = self.mean_square(sums, *m, *m, |s, k| s[k + m] - s[k]);
            all.push(mean.sqrt() * self.tau0);
        }
        if self.stretches >= LEAST_STRETCHES {
            let ends = (0..=self.stretches).map(|j| sums[j * self.length]);
            let ends: Vec<f64> = ends.collect();
            let bends = ends.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).powi(2));
            let mean = bends.sum::<f64>() / (self.stretches - 1) as f64;
            all.push((0.5 * mean).sqrt() / self.length as f64);
        }
    }

    /// Sums of the squares of what bends over the shortest clusters, [`EVERY`] of them: side by side, for one waits for the
    /// product before it.
    fn at_every_place(&self, sums: &[f64]) -> [f64; EVERY.len()] {
        let bend = |s: &[f64], m: usize| s[2 * m] - 2.0 * s[m] + s[0];
        let mut all = [0.0; EVERY.len()];
        for j in 0..self.stretches {
            let sums = &sums[j * self.length..=(j + 1) * self.length];
            let together = (sums.len() + 1).saturating_sub(SPAN);
            let mut squares = [0.0; EVERY.len()];
            for s in sums.windows(SPAN).filter_map(<[f64]>::first_chunk::<SPAN>) {
                for (square, m) in squares.iter_mut().zip(EVERY) {
                    let bend = bend(s, m);
                    *square += bend * bend;
                }
            }
            for (square, m) in squares.iter_mut().zip(EVERY) {
                for s in sums[together..].windows(2 * m + 1) {
                    let bend = bend(s, m);
                    *square += bend * bend;
                }
            }
            all.iter_mut().zip(squares).for_each(|(all, s)| *all += s);
        }
        all
    }

    /// Mean square over all stretches of what spans `span` samples, at every place of which a time of `m` has [`PLACES`].
    fn mean_square(
        &self,
        sums: &[f64],
        span: usize,
        m: usize,
        of: impl Fn(&[f64], usize) -> f64,
    ) -> f64 {
        let stride = (m / PLACES).max(1);
        let (mut sum, mut count) = (0.0, 0usize);
        for j in 0..self.stretches {
            let sums = &sums[j * self.length..=(j + 1) * self.length];
            let last = self.length - span;
            if stride == 1 {
                sum += (0..=last).map(|k| of(sums, k).powi(2)).sum::<f64>();
            } else {
                sum += (0..=last)
                    .step_by(stride)
                    .map(|k| of(sums, k).powi(2))
                    .sum::<f64>();
            }
            count += last / stride + 1;
        }
        sum / count as f64
    }
}

/// A number with three digits.
pub(super) fn short(v: f64) -> String {
    let digits = (2 - v.abs().max(1e-12).log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{v:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}
