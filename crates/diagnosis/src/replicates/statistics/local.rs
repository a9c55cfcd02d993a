//! The shape of the noise and its size in time: readings less the mean of those around them.

use super::Statistic;
use super::deviations::short;

/// Readings to either side that make up the mean: a second and more at the stand's 20 Hz, so that what is slow has no part.
const HALF: usize = 16;
/// Parts of the record whose noise is compared.
const BLOCKS: usize = 16;

/// Skewness, kurtosis, extremes, and the variance over time and over the motor command.
pub(super) struct Local {
    length: usize,
    /// Square of the duty about its mean over its own sum of squares, where it changes.
    duty: Option<Vec<f64>>,
}

impl Local {
    /// For stretches of `length` samples, and the motor command in them.
    pub fn new(length: usize, duty: Option<&[f64]>) -> Self {
        let duty = duty.map(|d| d.iter().map(|v| v * v).collect::<Vec<f64>>());
        let shape = duty.and_then(|d| {
            let inside: Vec<f64> = interior(d.len(), length).map(|i| d[i]).collect();
            let mean = inside.iter().sum::<f64>() / inside.len().max(1) as f64;
            let square: f64 = inside.iter().map(|v| (v - mean).powi(2)).sum();
            let scaled = inside.iter().map(|v| (v - mean) / square).collect();
            (square > 0.0).then_some(scaled)
        });
        Self {
            length,
            duty: shape,
        }
    }

    pub fn name(&self, unit: &str, all: &mut Vec<Statistic>) {
        for what in ["skewness", "kurtosis"] {
            all.push(Statistic::new(format!("{what} about the local mean"), "1"));
        }
        for what in ["highest", "lowest"] {
            all.push(Statistic::new(
                format!("{what} reading about the local mean"),
                unit,
            ));
        }
        for b in 0..BLOCKS {
            let percent = |k: usize| short(100.0 * k as f64 / BLOCKS as f64);
            let what = format!(
                "noise from {} to {} % of the record",
                percent(b),
                percent(b + 1)
            );
            all.push(Statistic::new(what, unit));
        }
        if self.duty.is_some() {
            all.push(Statistic::new(
                "change of the noise with the square of the motor command",
                "1",
            ));
        }
    }

    /// Of readings about their mean, and their prefix sums; `r` is room for what is left of them.
    pub fn take(&self, x: &[f64], sums: &[f64], r: &mut Vec<f64>, all: &mut Vec<f64>) {
        r.clear();
        let width = (2 * HALF + 1) as f64;
        for (values, sums) in x
            .chunks_exact(self.length)
            .zip((0..).map(|j| &sums[j * self.length..]))
        {
            let middle = &values[HALF..self.length - HALF];
            let means = sums[2 * HALF + 1..]
                .iter()
                .zip(sums)
                .map(|(b, a)| (b - a) / width);
            r.extend(middle.iter().zip(means).map(|(v, mean)| v - mean));
        }
        let n = r.len() as f64;
        // All sums side by side, for each waits for the one before it.
        let (mut two, mut three, mut four, mut with_duty) = (0.0, 0.0, 0.0, 0.0);
        let mut blocks = [0.0; BLOCKS];
        for (b, rms) in blocks.iter_mut().enumerate() {
            let places = b * r.len() / BLOCKS..(b + 1) * r.len() / BLOCKS;
            let block = &r[places.clone()];
            let mut own = 0.0;
            let mut add = |v: f64| {
                let square = v * v;
                own += square;
                two += square;
                three += square * v;
                four += square * square;
                square
            };
            match &self.duty {
                Some(duty) => {
                    for (v, duty) in block.iter().zip(&duty[places]) {
                        with_duty += add(*v) * duty;
                    }
                }
                None => block.iter().for_each(|v| {
                    add(*v);
                }),
            }
            *rms = (own / block.len().max(1) as f64).sqrt();
        }
        let variance = (two / n).max(f64::MIN_POSITIVE);
        all.push(three / n / variance.powf(1.5));
        all.push(four / n / variance.powi(2));
        let [low, high] = model::effect::extremes(r);
        all.extend([high, low]);
        all.extend(blocks);
        if self.duty.is_some() {
            all.push(with_duty / variance);
        }
    }
}

/// Places that have [`HALF`] readings to either side, in stretches of `length`.
fn interior(samples: usize, length: usize) -> impl Iterator<Item = usize> {
    (0..samples / length).flat_map(move |j| j * length + HALF..(j + 1) * length - HALF)
}
