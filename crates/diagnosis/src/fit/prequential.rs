//! What a term gains on data that its fit has not seen.
//!
//! Prequential Bayes score: the marginal likelihood m of the first n_j samples (mean and coefficients flat, white
//! variance by Jeffreys, in closed form; random walk and sizes of stationary terms mixed over a grid), and for each of
//! twelve blocks ln m(1..n_j) - ln m(1..n_{j-1}) of the extended model minus the same of the model without the term.
//! A regressor that has not moved yet (a step before its time) has no coefficient: it is left out, and the blocks
//! until it has moved count nothing.

use std::rc::Rc;

use model::effect::Peak;
use statrs::function::gamma::ln_gamma;

use crate::fit::channel::{Form, State};
use crate::fit::likelihood::{Bins, Dct, Noise, Panel, least_walk};
use numerics::log_product::LogProduct;

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
    /// Its standard error from the spread of the blocks.
    pub std_error: f64,
    /// rms angle error, deg, (reduced, extended), over 10 s and 100 s, where the held-out part has three such windows.
    pub angle: Vec<(&'static str, [f64; 2])>,
}

fn log_sum(values: &[f64]) -> f64 {
    let top = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    top + values.iter().map(|v| (v - top).exp()).sum::<f64>().ln()
}

/// A prefix of the record under one model: ln m, the coefficients and the random walk that fit it best.
struct Prefix {
    log_m: f64,
    beta: Vec<f64>,
    log_walk: f64,
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
    let mut best = (f64::NEG_INFINITY, vec![], walk);
    for (log_walk, weight, log_det) in mixture {
        let s = panel.solve_weighted(weight, *log_det, columns);
        let log_m = constant - free * s.rss.ln() - 0.5 * (s.log_det_noise + s.log_det_normal);
        if log_m > best.0 {
            best = (log_m, s.beta, *log_walk);
        }
        all.push(log_m);
    }
    Prefix {
        log_m: log_sum(&all) - (all.len() as f64).ln(),
        beta: best.1,
        log_walk: best.2,
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
        let windows = [("10s", 10.0), ("100s", 100.0)]
            .iter()
            .map(|(name, s)| (*name, (s * rate_hz).round() as usize))
            .filter(|(_, w)| *w >= 2 && 3 * w <= y.len() - ends[0])
            .collect();
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
        let (dct, bins) = (Dct::new(end), Rc::new(Bins::about(end, peaks)));
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
                prefix.log_walk,
                (end, *next),
                *length,
                self.rate_hz,
                squares,
            );
        }
    }

    /// The score of a term: the evidence and the errors without it and with all, the last of each.
    fn score(&self, term: usize, log_m: &[Vec<f64>], squares: &[Vec<Squares>]) -> Score {
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
        let (nats, std_error) = total(&gains);
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
    for j in 0..blocks.ends.len() {
        let (panel, columns) = blocks.panel(&peaks, j);
        // Without a term that is no noise the mixture is that of the whole.
        let whole = mixture(&panel, state, None);
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
        }
    }
    (0..state.terms.len())
        .map(|term| blocks.score(term, &log_m, &squares))
        .collect()
}

/// Ends of the blocks, the end of what lies before them first.
fn ends(n: usize) -> Vec<usize> {
    let share = |j: usize| BEFORE + (1.0 - BEFORE) * j as f64 / BLOCKS as f64;
    (0..=BLOCKS)
        .map(|j| (share(j) * n as f64).round() as usize)
        .collect()
}

/// Sum over the blocks, with its standard error from their spread.
fn total(gains: &[f64]) -> (f64, f64) {
    let nats: f64 = gains.iter().sum();
    let count = gains.len() as f64;
    let mean = nats / count;
    let spread = gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (nats, (spread * count).sqrt())
}

/// Least share of a record that shows a law of the variance at more than half its height, for it to have a size.
const SHOWN: f64 = 2e-3;
/// Largest ratio of variances that is asked, as ln.
const MOST_RATIO: f64 = 6.0;

/// What a law of the variance gains on data that its size has not seen, nats, and the standard error. `e` is the whitened
/// residual without the law, `law` its shape in time, which is that of the whole record, as the time of a step is.
#[must_use]
pub fn of_variance(e: &[f64], law: &[f64]) -> (f64, f64) {
    let low = law.iter().copied().fold(f64::INFINITY, f64::min);
    let high = law.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let height: Vec<f64> = law.iter().map(|v| (v - low) / (high - low)).collect();
    let ends = ends(e.len());
    let gains: Vec<f64> = ends
        .windows(2)
        .map(|w| {
            let (seen, of) = (&e[..w[0]], &height[..w[0]]);
            let shown = of.iter().filter(|h| **h > 0.5).count() as f64;
            let (all, count) = (e.len() as f64, seen.len() as f64);
            if shown < SHOWN * all || shown > count - SHOWN * all {
                return 0.0;
            }
            // The larger over the smaller variance, and the smaller one by the likelihood.
            let at = |ratio: f64| {
                let rise = ratio.exp_m1();
                move |h: f64| 1.0 + rise * h
            };
            let energy = |ratio: f64| -> f64 {
                let (parts, at) = (seen.iter().zip(of), at(ratio));
                parts.map(|(e, h)| e * e / at(*h)).sum::<f64>() / count
            };
            let minus_l = |ratio: f64| {
                let (mut product, at) = (LogProduct::default(), at(ratio));
                of.iter().for_each(|h| product.multiply(at(*h)));
                0.5 * (product.ln() + count * energy(ratio).ln())
            };
            let ratio = numerics::minimise::golden(&minus_l, -MOST_RATIO, MOST_RATIO, 30);
            let (plain, least, at) = (energy(0.0), energy(ratio), at(ratio));
            let nats = |e: f64, v: f64| -0.5 * (v.ln() + e * e / v);
            let next = e[w[0]..w[1]].iter().zip(&height[w[0]..w[1]]);
            next.map(|(e, h)| nats(*e, least * at(*h)) - nats(*e, plain))
                .sum()
        })
        .collect();
    total(&gains)
}

/// What knowing that channels share noise gains on data that the correlation was not taken from, nats, and the standard
/// error: each block under the correlations of all that lies before it.
#[must_use]
pub fn of_correlation(channels: &[&[f64]]) -> (f64, f64) {
    let Some(n) = channels.iter().map(|c| c.len()).min() else {
        return (0.0, 0.0);
    };
    let gains: Vec<f64> = ends(n)
        .windows(2)
        .map(|w| {
            let rms =
                |c: &&[f64]| (c[..w[0]].iter().map(|v| v * v).sum::<f64>() / w[0] as f64).sqrt();
            let scale: Vec<f64> = channels.iter().map(rms).collect();
            let moment = |i: usize, j: usize, from: usize, to: usize| -> f64 {
                let both = channels[i][from..to].iter().zip(&channels[j][from..to]);
                both.map(|(a, b)| a * b).sum::<f64>() / (scale[i] * scale[j])
            };
            let matrix = |of: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
                let row = |i| (0..channels.len()).map(|j| of(i, j)).collect();
                (0..channels.len()).map(row).collect()
            };
            let before = matrix(&|i, j| moment(i, j, 0, w[0]) / w[0] as f64);
            let (inverse, log_det) = crate::fit::likelihood::invert(&before);
            let inside = matrix(&|i, j| moment(i, j, w[0], w[1]));
            let mut square = 0.0;
            for (i, row) in inside.iter().enumerate() {
                for (j, v) in row.iter().enumerate() {
                    square += v * (inverse[i][j] - f64::from(u8::from(i == j)));
                }
            }
            -0.5 * ((w[1] - w[0]) as f64 * log_det + square)
        })
        .collect();
    total(&gains)
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

/// Angle errors of windows that start in `span`, the filter's level held from their start; `rest` begins at `from`.
fn add_angles(
    rest: &[f64],
    from: usize,
    log_walk: f64,
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
        let gain = p / (p + 1.0);
        level += gain * (v - level);
        p *= 1.0 - gain;
    }
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    fn white(n: usize, seed: u64) -> Vec<f64> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        (0..n).map(|_| StandardNormal.sample(&mut rng)).collect()
    }

    #[test]
    fn a_law_of_the_variance_gains_what_it_is_worth_and_costs_where_there_is_none() {
        let law: Vec<f64> = (0..12_000)
            .map(|i| if i / 600 % 2 == 0 { 1.0 } else { 2.0 })
            .collect();
        let e: Vec<f64> = white(12_000, 1)
            .iter()
            .zip(&law)
            .map(|(e, v)| e * f64::sqrt(*v))
            .collect();
        // A reading tells ln(mean) - mean ln of the variances over two: (ln 1.5 - ln 2 / 2) / 2 = 0.0294 nats, of 7200.
        let (nats, error) = of_variance(&e, &law);
        assert!(
            (nats - 212.0).abs() < 5.0 * error && error < 40.0,
            "{nats} {error}"
        );
        let costs: f64 = (0..20)
            .map(|s| of_variance(&white(12_000, s + 10), &law).0)
            .sum();
        assert!((-40.0..5.0).contains(&costs), "{costs}");
    }

    #[test]
    fn shared_noise_gains_what_it_is_worth_and_costs_where_there_is_none() {
        let shared = white(12_000, 2);
        let with = |seed: u64| -> Vec<f64> {
            let own = white(12_000, seed);
            own.iter().zip(&shared).map(|(a, b)| a + 0.5 * b).collect()
        };
        let (x, y) = (with(3), with(4));
        // Correlation 0.25 / 1.25: -ln(1 - 0.04) / 2 nats of 7200 readings.
        let (nats, error) = of_correlation(&[&x, &y]);
        assert!(
            (nats - 147.0).abs() < 5.0 * error && error < 40.0,
            "{nats} {error}"
        );
        let (x, y) = (white(12_000, 5), white(12_000, 6));
        assert!(of_correlation(&[&x, &y]).0 < 3.0);
    }
}
