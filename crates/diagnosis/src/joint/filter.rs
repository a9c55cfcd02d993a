//! The filter of a random walk and first-order processes in white noise of a variance that changes, through which several
//! series go by the same gains.

use crate::fit::likelihood::Normal;

/// Variance of the walk before the first reading, over the white one: as good as flat.
const FLAT: f64 = 1e8;

/// Largest value of a law's shape; 1 where there is no law.
pub(super) fn top(shape: &[f64]) -> f64 {
    let top = shape.iter().copied().fold(0.0, f64::max);
    if top > 0.0 { top } else { 1.0 }
}

/// Shape of the noise in units of the white variance at the law's zero.
pub(super) struct Point {
    /// ln of the step variance of the walk.
    pub log_walk: f64,
    /// Variance and pole of each first-order process.
    pub poles: Vec<(f64, f64)>,
    /// Increase of the white variance at the top of each law.
    pub laws: Vec<f64>,
}

/// The data, the columns that may explain them, and the law's shape.
pub(super) struct Series<'a> {
    /// Values by sample: the data, then the columns.
    values: Vec<f64>,
    width: usize,
    /// What each law adds, and the largest value of that.
    laws: Vec<(&'a [f64], f64)>,
    /// Samples from the one before to each, where time passed that has no place.
    spans: Option<&'a [f64]>,
    /// Whether a sample was read.
    read: Vec<bool>,
    /// Samples that were.
    count: usize,
}

impl<'a> Series<'a> {
    /// Of `n` samples the data first, then the columns; `lost` samples were not read; `spans` as [`Series::spans`].
    pub(super) fn new(
        n: usize,
        columns: impl Iterator<Item = Vec<f64>>,
        shapes: impl Iterator<Item = &'a [f64]>,
        lost: &[usize],
        spans: Option<&'a [f64]>,
    ) -> Self {
        let columns: Vec<Vec<f64>> = columns.collect();
        let width = columns.len();
        let mut values = vec![0.0; width * n];
        for (j, column) in columns.iter().enumerate() {
            // The level is the walk's: what is far from zero costs digits.
            let first = column.first().copied().unwrap_or(0.0);
            for (row, v) in values.chunks_exact_mut(width).zip(column) {
                row[j] = v - first;
            }
        }
        let mut read = vec![true; n];
        lost.iter().for_each(|i| read[*i] = false);
        let count = read.iter().filter(|r| **r).count();
        Self {
            values,
            width,
            laws: shapes.map(|s| (s, top(s))).collect(),
            spans,
            read,
            count,
        }
    }

    /// Columns beside the data.
    pub(super) fn columns(&self) -> usize {
        self.width - 1
    }

    /// Laws of the variance.
    pub(super) fn laws(&self) -> usize {
        self.laws.len()
    }

    /// The white variance by sample, over that at the laws' zero.
    fn white(&self, at: &Point) -> Vec<f64> {
        let mut white = vec![1.0; self.read.len()];
        for ((shape, top), law) in self.laws.iter().zip(&at.laws) {
            let by = law / top;
            for (white, shape) in white.iter_mut().zip(*shape) {
                *white *= (1.0 + by * shape).max(f64::MIN_POSITIVE);
            }
        }
        white
    }

    /// Innovations that count: the first reading tells the level.
    pub(super) fn free(&self) -> f64 {
        self.count as f64 - 1.0
    }

    /// Innovations of what the columns leave, over their standard deviation; NaN where nothing was read, and of the first reading.
    pub(super) fn innovations(&self, at: &Point) -> Vec<f64> {
        let (normal, log_det) = self.through(at);
        let solution = normal.solved(self.free(), log_det);
        let white = solution.white.sqrt();
        let mut all = vec![f64::NAN; self.read.len()];
        self.each(at, |i, nu, s| {
            let explained = nu[1..].iter().zip(&solution.beta).map(|(x, b)| x * b);
            all[i] = (nu[0] - explained.sum::<f64>()) / (white * s.sqrt());
        });
        all
    }

    /// Sums of products of the innovations over their variances, and the sum of the logarithms of these.
    pub(super) fn through(&self, at: &Point) -> (Normal, f64) {
        let w = self.width;
        let mut sums = vec![0.0; w * w];
        let (mut logs, mut product) = (0.0, 1.0f64);
        self.each(at, |_, nu, s| {
            for (i, a) in nu.iter().enumerate() {
                let by = a / s;
                let sums = &mut sums[i * w..(i + 1) * w];
                sums[i..]
                    .iter_mut()
                    .zip(&nu[i..])
                    .for_each(|(sum, b)| *sum += by * b);
            }
            // A logarithm for many: their product stays within the numbers.
            product *= s;
            if !(1e-200..1e200).contains(&product) {
                logs += product.ln();
                product = 1.0;
            }
        });
        (normal(&sums, w), logs + product.ln())
    }

    /// Goes through the readings but the first: its place, the innovations of every series, their variance over the white one.
    #[inline]
    fn each(&self, at: &Point, mut seen: impl FnMut(usize, &[f64], f64)) {
        let (w, d) = (self.width, 1 + at.poles.len());
        let (step, white) = (at.log_walk.exp(), self.white(at));
        let mut p = vec![0.0; d * d];
        p[0] = FLAT;
        for (j, (variance, _)) in at.poles.iter().enumerate() {
            p[(j + 1) * (d + 1)] = *variance;
        }
        // State by component: that of every series.
        let mut state = vec![0.0; d * w];
        let (mut nu, mut row_sums) = (vec![0.0; w], vec![0.0; d]);
        let mut begun = false;
        let rows = self.values.chunks_exact(w).zip(&white).zip(&self.read);
        for (i, ((row, white), read)) in rows.enumerate() {
            let span = self.spans.map_or(1.0, |s| s[i]);
            if begun || !at.poles.is_empty() {
                let step = step * span * f64::from(u8::from(begun));
                predict(&mut p, &mut state, step, &at.poles, w);
            }
            if !*read {
                continue;
            }
            for (sum, p) in row_sums.iter_mut().zip(p.chunks_exact(d)) {
                *sum = p.iter().sum();
            }
            let s = row_sums.iter().sum::<f64>() + white;
            nu.copy_from_slice(row);
            for component in state.chunks_exact(w) {
                nu.iter_mut().zip(component).for_each(|(nu, m)| *nu -= m);
            }
            correct(&mut p, &mut state, (&row_sums, s), &nu);
            if begun {
                seen(i, &nu, s);
            }
            begun = true;
        }
    }
}

/// Everything one sample on: the walk by its step variance, the processes by their poles.
fn predict(p: &mut [f64], state: &mut [f64], step: f64, poles: &[(f64, f64)], w: usize) {
    p[0] += step;
    let d = 1 + poles.len();
    for (j, (variance, pole)) in poles.iter().enumerate() {
        let j = j + 1;
        state[j * w..(j + 1) * w]
            .iter_mut()
            .for_each(|m| *m *= pole);
        p[j * d..(j + 1) * d].iter_mut().for_each(|p| *p *= pole);
        p[j..].iter_mut().step_by(d).for_each(|p| *p *= pole);
        p[j * (d + 1)] += variance * (1.0 - pole * pole);
    }
}

/// What the innovations `nu` tell of each component, by the sums of its row of the covariance and the variance of them all.
#[inline]
fn correct(p: &mut [f64], state: &mut [f64], (row_sums, s): (&[f64], f64), nu: &[f64]) {
    for (component, sum) in state.chunks_exact_mut(nu.len()).zip(row_sums) {
        let gain = sum / s;
        let each = component.iter_mut().zip(nu);
        each.for_each(|(m, nu)| *m += gain * nu);
    }
    for (p, own) in p.chunks_exact_mut(row_sums.len()).zip(row_sums) {
        let each = p.iter_mut().zip(row_sums);
        each.for_each(|(p, other)| *p -= own * other / s);
    }
}

/// The same of sums whose lower half is left out.
fn normal(sums: &[f64], w: usize) -> Normal {
    let at = |i: usize, j: usize| sums[i.min(j) * w + i.max(j)];
    Normal {
        total: at(0, 0),
        right: (1..w).map(|j| at(0, j)).collect(),
        matrix: (1..w).map(|i| (1..w).map(|j| at(i, j)).collect()).collect(),
    }
}
