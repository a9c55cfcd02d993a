//! What a term gains on data that its fit has not seen.
//!
//! Prequential Bayes score: the marginal likelihood m of the first n_j samples (mean and coefficients flat, white
//! variance by Jeffreys, in closed form; random walk and sizes of stationary terms mixed over a grid), and for each of
//! twelve blocks ln m(1..n_j) - ln m(1..n_{j-1}) of the extended model minus the same of the model without the term.
//! Its standard error is the one that the extended model itself implies, by the variance of a log likelihood ratio.
//! The spread of the twelve blocks is none: a step gains in one of them, and what is learned before is common to all.
//! A regressor that has not moved yet (a step before its time) has no coefficient: it is left out, and the blocks
//! until it has moved count nothing.

mod events;
mod laws;

use std::sync::Arc;

use model::effect::Peak;
use statrs::function::gamma::ln_gamma;

use crate::fit::channel::{Form, State};
use crate::fit::likelihood::{Bins, Dct, Noise, Panel, Solution, least_walk};
pub(crate) use events::{of_events, of_outliers};
pub use laws::{of_correlation, of_variance};

/// Blocks, and the part of the record before the first.
const BLOCKS: usize = 12;
const BEFORE: f64 = 0.4;
/// Random walks of the mixture, evenly spaced in ln(q / s2) from the least that the length can show to [`MOST_WALK`]:
/// the same prior for every model, for a model that lacks a slow term makes up for it by its random walk.
const WALKS: u32 = 24;
/// A random walk whose step is as large as the white noise.
const MOST_WALK: f64 = 0.0;
/// Part of a regressor's whole variance that a prefix must have for its coefficient to be one.
const MOVED: f64 = 1e-3;

/// Score of a term.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Score {
    /// Extended minus reduced, nats, on all blocks.
    pub nats: f64,
    /// Its standard error.
    pub std_error: f64,
    /// rms angle error, deg, (reduced, extended), over 10 s and 100 s, where the held-out part has three such windows.
    pub angle: Vec<(&'static str, [f64; 2])>,
}

fn log_sum(values: &[f64]) -> f64 {
    let top = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    top + values.iter().map(|v| (v - top).exp()).sum::<f64>().ln()
}

/// A prefix of the record under one model: ln m, and the coefficients, the random walk and the variance of a coefficient by
/// bin of what fits it best.
struct Prefix {
    log_m: f64,
    beta: Vec<f64>,
    log_walk: f64,
    variance: Vec<f64>,
}

/// A noise of the mixture: its random walk, 1/g and the sum of ln g.
type Mixed = (f64, Vec<f64>, f64);

/// The mixture for a state without its term `skip`.
fn mixture(panel: &Panel, state: &State, skip: Option<usize>) -> Vec<Mixed> {
    let walk = state.noise.log_walk;
    // Sizes of stationary terms are averaged over a factor of e^2 either way of the fitted one.
    let sizes: &[f64] = if state
        .terms
        .iter()
        .enumerate()
        .any(|(i, t)| Some(i) != skip && matches!(t.form, Form::Covariance(..)))
    {
        &[-2.0, -1.0, 0.0, 1.0, 2.0]
    } else {
        &[0.0]
    };
    let low = least_walk(panel.bins.n).min(walk - 4.0);
    let step = (MOST_WALK.max(walk + 3.0) - low) / f64::from(WALKS);
    let mut all = vec![];
    for size in sizes {
        let terms: Vec<_> = state
            .terms
            .iter()
            .enumerate()
            .filter(|(i, _)| Some(*i) != skip)
            .filter_map(|(_, t)| match &t.form {
                Form::Covariance(c, theta) => {
                    let mut theta = theta.clone();
                    let bound = c.bounds(panel.bins.n)[0];
                    theta[0] = (theta[0] + size).clamp(bound.0, bound.1);
                    Some((c.clone(), theta))
                }
                _ => None,
            })
            .collect();
        let noise = Noise {
            log_walk: walk,
            terms,
        };
        let with = noise.with_walks(&panel.bins);
        for i in 0..=WALKS {
            let log_walk = low + step * f64::from(i);
            let mut weight = with(log_walk);
            let log_det = panel.bins.log_det(&weight);
            weight.iter_mut().for_each(|g| *g = g.recip());
            all.push((log_walk, weight, log_det));
        }
    }
    all
}

fn marginal(panel: &Panel, mixture: &[Mixed], columns: &[usize], walk: f64) -> Prefix {
    let free = ((panel.bins.n - 1) as f64 - columns.len() as f64) / 2.0;
    let constant = ln_gamma(free);
    let mut all = vec![];
    let mut best: (f64, Option<(Solution, &Mixed)>) = (f64::NEG_INFINITY, None);
    for mixed in mixture {
        let s = panel.solve_weighted(&mixed.1, mixed.2, columns);
        let log_m = constant - free * s.rss.ln() - 0.5 * (s.log_det_noise + s.log_det_normal);
        if log_m > best.0 {
            best = (log_m, Some((s, mixed)));
        }
        all.push(log_m);
    }
    let log_m = log_sum(&all) - (all.len() as f64).ln();
    match best.1 {
        Some((s, (log_walk, weight, _))) => Prefix {
            log_m,
            log_walk: *log_walk,
            variance: weight.iter().map(|w| s.white / w).collect(),
            beta: s.beta,
        },
        None => Prefix {
            log_m,
            log_walk: walk,
            variance: vec![],
            beta: vec![],
        },
    }
}

/// A channel with the columns of its terms, cut into blocks.
struct Blocks<'a> {
    y: &'a [f64],
    values: &'a [Vec<Vec<f64>>],
    rate_hz: f64,
    ends: Vec<usize>,
    /// Whether a term has moved before the end of a block.
    moved: Vec<Vec<bool>>,
    /// Names and lengths of the windows over which angles are compared, samples.
    windows: Vec<(&'static str, usize)>,
}

/// The sum of squares of angles over a window, and their number.
type Squares = (f64, usize);

impl<'a> Blocks<'a> {
    fn new(y: &'a [f64], rate_hz: f64, values: &'a [Vec<Vec<f64>>]) -> Self {
        let ends = ends(y.len());
        let moved: Vec<Vec<bool>> = (values.iter())
            .map(|term| {
                let columns: Vec<Vec<bool>> = term.iter().map(|c| moved(c, &ends)).collect();
                let by_all = |j: usize| columns.iter().all(|c| c[j]);
                (0..ends.len()).map(by_all).collect()
            })
            .collect();
        let windows = windows(y.len(), rate_hz);
        Self {
            y,
            values,
            rate_hz,
            ends,
            moved,
            windows,
        }
    }

    /// The numbers of the terms that have moved before the end of a block, without one.
    fn used(&self, skip: Option<usize>, block: usize) -> impl Iterator<Item = usize> {
        (0..self.values.len()).filter(move |i| Some(*i) != skip && self.moved[*i][block])
    }

    /// The panel of what lies before the end of a block, with the numbers of the columns of each term.
    fn panel(&self, peaks: &[Peak], block: usize) -> (Panel, Vec<Vec<usize>>) {
        let end = self.ends[block];
        let (dct, bins) = (Dct::new(end), Arc::new(Bins::about(end, peaks)));
        let shapes = self.values.iter().flatten().map(Vec::as_slice);
        let beginnings: Vec<&[f64]> = std::iter::once(self.y)
            .chain(shapes)
            .map(|c| &c[..end])
            .collect();
        let mut numbers = 1..;
        let columns = (self.values.iter())
            .map(|term| numbers.by_ref().take(term.len()).collect())
            .collect();
        (Panel::of_all(&dct, &bins, &beginnings), columns)
    }

    /// Add the errors of the angles over a block that what lies before it predicts.
    fn predict(&self, skip: Option<usize>, block: usize, prefix: &Prefix, squares: &mut [Squares]) {
        let (end, Some(next)) = (self.ends[block], self.ends.get(block + 1)) else {
            return;
        };
        let shapes: Vec<&Vec<f64>> = self
            .used(skip, block)
            .flat_map(|i| &self.values[i])
            .collect();
        // A filter has forgotten what lies forty of its memories back; windows may reach beyond the block.
        let memory = 40.0 * (-0.5 * prefix.log_walk).exp() + 1000.0;
        let from = end - end.min(memory as usize);
        let longest = self.windows.iter().map(|w| w.1).max().unwrap_or(0);
        let to = self.y.len().min(next + longest);
        let rest: Vec<f64> = (from..to)
            .map(|i| {
                self.y[i]
                    - shapes
                        .iter()
                        .zip(&prefix.beta)
                        .map(|(x, b)| x[i] * b)
                        .sum::<f64>()
            })
            .collect();
        for ((_, length), squares) in self.windows.iter().zip(squares) {
            add_angles(
                &rest,
                from,
                (prefix.log_walk, &|_| 1.0),
                (end, *next),
                *length,
                self.rate_hz,
                squares,
            );
        }
    }

    /// Variance of what a term gains on the blocks where the model that holds it is true: `whole` is the whole record under
    /// that model, `without` the same under the model without the term. With variances v1 and v0 of a coefficient with it
    /// and without, and s what the term adds to its mean, the log likelihood ratio of one has the variance
    /// (v1 / v0 - 1)^2 / 2 + s^2 v1 / v0^2.
    fn variance_of_gain(
        &self,
        term: usize,
        panel: &Panel,
        columns: &[Vec<usize>],
        whole: &Prefix,
        without: &Prefix,
    ) -> f64 {
        let held = 1.0 - BEFORE;
        let own = &columns[term];
        let ratios = whole.variance.iter().zip(&without.variance);
        let terms = ratios.zip(panel.bins.counts());
        let noise: f64 = terms.map(|((a, b), m)| m * (a / b - 1.0).powi(2)).sum();
        let learned = held * (0.5 * noise + own.len().max(1) as f64);
        if own.is_empty() {
            return learned;
        }
        let last = self.ends.len() - 1;
        let before = self.used(None, last).take_while(|i| *i < term);
        let first: usize = before.map(|i| columns[i].len()).sum();
        let Some(beta) = whole.beta.get(first..first + own.len()) else {
            return f64::NAN;
        };
        // The term's signal weighed in time: where in the record it is told.
        let mut c = vec![0.0; panel.bins.n];
        panel.add_columns(&mut c, 0, own, beta);
        let weights = whole.variance.iter().zip(&without.variance);
        let weights: Vec<f64> = weights.map(|(a, b)| a.sqrt() / b).collect();
        let weights = panel.bins.spread(&weights);
        c.iter_mut().zip(&weights).for_each(|(c, w)| *c *= w);
        let told = panel.dct.inverse(&c);
        let energy: f64 = told[self.ends[0]..].iter().map(|v| v * v).sum();
        energy + learned
    }

    /// The score of a term: the evidence and the errors without it and with all, the last of each.
    fn score(
        &self,
        term: usize,
        log_m: &[Vec<f64>],
        squares: &[Vec<Squares>],
        std_error: f64,
    ) -> Score {
        let full = log_m.len() - 1;
        let gains: Vec<f64> = (1..=BLOCKS)
            .map(|j| {
                let of = |m: usize| log_m[m][j] - log_m[m][j - 1];
                if self.moved[term][j - 1] {
                    of(full) - of(term)
                } else {
                    0.0
                }
            })
            .collect();
        let nats = gains.iter().sum();
        let rms = |m: usize, w: usize| (squares[m][w].0 / squares[m][w].1.max(1) as f64).sqrt();
        let angle = (self.windows.iter().enumerate())
            .map(|(w, (name, _))| (*name, [rms(term, w), rms(full, w)]))
            .collect();
        Score {
            nats,
            std_error,
            angle,
        }
    }
}

/// Score each term of a state on a channel; `columns_of(term)` gives its columns in samples.
#[must_use]
pub fn scores(y: &[f64], rate_hz: f64, state: &State, values: &[Vec<Vec<f64>>]) -> Vec<Score> {
    let peaks = state.noise.peaks();
    let blocks = Blocks::new(y, rate_hz, values);
    let models: Vec<Option<usize>> = (0..state.terms.len()).map(Some).chain([None]).collect();
    let mut log_m = vec![vec![]; models.len()];
    let mut squares = vec![vec![(0.0, 0usize); blocks.windows.len()]; models.len()];
    let mut errors = vec![f64::NAN; state.terms.len()];
    for j in 0..blocks.ends.len() {
        let (panel, columns) = blocks.panel(&peaks, j);
        // Without a term that is no noise the mixture is that of the whole.
        let whole = mixture(&panel, state, None);
        let mut prefixes = vec![];
        for (m, skip) in models.iter().enumerate() {
            let used: Vec<usize> = blocks
                .used(*skip, j)
                .flat_map(|i| columns[i].clone())
                .collect();
            let own = skip
                .filter(|i| state.terms[*i].is_covariance())
                .map(|i| mixture(&panel, state, Some(i)));
            let mixture = own.as_ref().unwrap_or(&whole);
            let prefix = marginal(&panel, mixture, &used, state.noise.log_walk);
            log_m[m].push(prefix.log_m);
            blocks.predict(*skip, j, &prefix, &mut squares[m]);
            prefixes.push(prefix);
        }
        if j + 1 == blocks.ends.len() {
            let (full, reduced) = (&prefixes[state.terms.len()], &prefixes);
            for (term, error) in errors.iter_mut().enumerate() {
                let of = &reduced[term];
                *error = blocks
                    .variance_of_gain(term, &panel, &columns, full, of)
                    .sqrt();
            }
        }
    }
    (0..state.terms.len())
        .map(|term| blocks.score(term, &log_m, &squares, errors[term]))
        .collect()
}

/// The sample from which on a record is held out.
pub(crate) fn held_from(n: usize) -> usize {
    ends(n)[0]
}

/// Ends of the blocks, the end of what lies before them first.
fn ends(n: usize) -> Vec<usize> {
    let share = |j: usize| BEFORE + (1.0 - BEFORE) * j as f64 / BLOCKS as f64;
    (0..=BLOCKS)
        .map(|j| (share(j) * n as f64).round() as usize)
        .collect()
}

/// Whether a regressor has moved before each of the ascending `ends`.
fn moved(column: &[f64], ends: &[usize]) -> Vec<bool> {
    let mean = column.iter().sum::<f64>() / column.len() as f64;
    // About one level throughout, so that sums up to one end go on to the next.
    let (mut sum, mut square, mut from) = (0.0, 0.0, 0);
    let mut variance = |end: usize| {
        for v in &column[from..end] {
            sum += v - mean;
            square += (v - mean).powi(2);
        }
        from = end;
        let n = end as f64;
        square / n - (sum / n).powi(2)
    };
    let before: Vec<f64> = ends.iter().map(|end| variance(*end)).collect();
    let whole = variance(column.len());
    before.iter().map(|v| *v > MOVED * whole).collect()
}

/// Horizons of the angles that leave room for three windows in the held-out part of `n` samples: name, samples.
pub(crate) fn windows(n: usize, rate_hz: f64) -> Vec<(&'static str, usize)> {
    let held = n - ends(n)[0];
    [("10s", 10.0), ("100s", 100.0)]
        .iter()
        .map(|(name, s)| (*name, (s * rate_hz).round() as usize))
        .filter(|(_, w)| *w >= 2 && 3 * w <= held)
        .collect()
}

/// Rms angle error, deg, by horizon, over the held-out part of what is left of a channel beside its causes: the level of a
/// filter that knows the random walk, and the variance of each reading over the mean one where a `law` is given, is held
/// from the start of each window.
pub(crate) fn angles(
    rest: &[f64],
    log_walk: f64,
    law: Option<&[f64]>,
    rate_hz: f64,
) -> Vec<(&'static str, f64)> {
    let n = rest.len();
    let each = windows(n, rate_hz).into_iter().map(|(name, length)| {
        let mut sum = (0.0, 0);
        let noise = |i: usize| law.map_or(1.0, |v| v[i]);
        let span = (ends(n)[0], n);
        add_angles(rest, 0, (log_walk, &noise), span, length, rate_hz, &mut sum);
        (name, (sum.0 / sum.1.max(1) as f64).sqrt())
    });
    each.collect()
}

/// Angle errors of windows that start in `span`, the filter's level held from their start; `rest` begins at `from`. `noise`
/// is the variance of a reading over the one that the random walk is held against.
fn add_angles(
    rest: &[f64],
    from: usize,
    (log_walk, noise): (f64, &dyn Fn(usize) -> f64),
    span: (usize, usize),
    length: usize,
    rate_hz: f64,
    sum: &mut (f64, usize),
) {
    let lambda = log_walk.exp();
    let (mut level, mut p) = (rest[0], 1.0);
    for (j, v) in rest.iter().enumerate().take(span.1 - from) {
        let i = from + j;
        // Windows start at multiples of their length from the start of the held-out part.
        if i >= span.0 && i.is_multiple_of(length) && j + length <= rest.len() {
            let angle: f64 = rest[j..j + length].iter().map(|v| v - level).sum::<f64>() / rate_hz;
            sum.0 += angle * angle;
            sum.1 += 1;
        }
        p += lambda;
        let gain = p / (p + noise(i));
        level += gain * (v - level);
        p *= 1.0 - gain;
    }
}
