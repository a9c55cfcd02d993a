//! What stands beside a shape that a sensor shows late: the other columns of its effect are as late as it is.

use std::sync::Arc;

use model::effect::Shape;

use super::channel::{Form, Term};
use super::likelihood::Panel;

/// Mean delay before anything is known, samples: readings whose noise is white went through no window longer than from one to the
/// next, of which the mean delay is half.
const MEAN_DELAY: f64 = 0.5;

/// Logarithm of the weight of a delay, samples, before the record is asked: exponential.
pub(crate) fn prior(delay: f64) -> f64 {
    -delay / MEAN_DELAY
}

/// A shape with the numbers of all columns that stand beside it, those of its own effect first and as late as it is.
pub(crate) struct Beside {
    shape: Arc<dyn Shape>,
    others: Vec<usize>,
}

impl Beside {
    /// A shape of `effect` beside `terms`, of which none is the one that has it. What its delay makes is new in the panel.
    pub(crate) fn new(panel: &Panel, terms: &[&Term], effect: &str, shape: Arc<dyn Shape>) -> Self {
        let own = |t: &&&Term| shares(shape.as_ref(), t, effect);
        let kin = terms.iter().filter(own);
        let kin = kin.flat_map(|t| columns(panel, t, shape.as_ref()));
        let rest = terms.iter().filter(|t| !own(t));
        let others = kin.chain(rest.flat_map(|t| t.columns.clone())).collect();
        Self { shape, others }
    }

    /// What `f` makes of the columns of the shape at a value, which come first, and of those beside it.
    pub(crate) fn with<T>(&self, panel: &Panel, at: f64, f: impl FnOnce(&[usize]) -> T) -> T {
        let width = panel.width();
        let own = self.shape.columns(at).into_iter().map(|c| c.values);
        let all = [panel.add_all(own), self.others.clone()].concat();
        let made = f(&all);
        panel.truncate(width);
        made
    }

    /// Near a point of the shape's grid, the logarithm of the value of the highest likelihood under noise of a density, and that
    /// likelihood.
    pub(crate) fn best(&self, panel: &Panel, density: &[f64], at: f64) -> (f64, f64) {
        let (from, to) = neighbours(&self.shape.grid(), at);
        let of = |x: f64| -self.likelihood(panel, density, x);
        let x = numerics::minimise::golden(&of, from.ln(), to.ln(), PLACED);
        (x, -of(x))
    }

    /// The likelihood at the logarithm of a value.
    pub(crate) fn likelihood(&self, panel: &Panel, density: &[f64], x: f64) -> f64 {
        let solve = |columns: &[usize]| panel.solve(density, columns).log_likelihood;
        self.with(panel, x.exp(), solve)
    }
}

/// Steps to the best value of a shape between the neighbours of a point: of two a factor of nine apart, to 0.7 %.
const PLACED: usize = 12;

/// Neighbours in a grid of the point nearest to a value.
pub(crate) fn neighbours(grid: &[f64], at: f64) -> (f64, f64) {
    let off = |g: &f64| (g / at).ln().abs();
    let nearest = (0..grid.len()).min_by(|i, j| off(&grid[*i]).total_cmp(&off(&grid[*j])));
    let i = nearest.unwrap_or(0);
    (grid[i.saturating_sub(1)], grid[(i + 1).min(grid.len() - 1)])
}

/// Whether a term is of a shape's effect, and as late as that is.
fn shares(shape: &dyn Shape, term: &Term, effect: &str) -> bool {
    let (least, most) = shape.delays();
    let known = |name: &&str| shape.beside(name, &term.fixed).is_some();
    most > least
        && term.effect.id() == effect
        && matches!(term.form, Form::Columns)
        && term.names.iter().all(known)
}

/// Columns of a term that shares the delay of a shape, in samples.
fn values(shape: &dyn Shape, term: &Term) -> Vec<Vec<f64>> {
    let late = |name: &&'static str| shape.beside(name, &term.fixed);
    term.names.iter().filter_map(late).collect()
}

/// Numbers of the columns of a term as late as a shape of `effect`; its own where it shares no delay.
pub(crate) fn columns_beside(
    panel: &Panel,
    term: &Term,
    shape: &dyn Shape,
    effect: &str,
) -> Vec<usize> {
    if shares(shape, term, effect) {
        columns(panel, term, shape)
    } else {
        term.columns.clone()
    }
}

fn columns(panel: &Panel, term: &Term, shape: &dyn Shape) -> Vec<usize> {
    panel.add_all(values(shape, term))
}

/// The most likely coordinate and delay of a shape.
pub(crate) struct Climbed {
    /// So late.
    pub(crate) shape: Arc<dyn Shape>,
    /// Logarithm of the coordinate.
    pub(crate) x: f64,
    /// Covariance of that and of the delay, in samples.
    pub(crate) covariance: [[f64; 2]; 2],
}

/// Steps of the climb, and how often one that overshoots is halved.
const CLIMBS: usize = 8;
const HALVED: usize = 6;
/// The climb ends with a step below this share of a standard error.
const NEAR: f64 = 0.02;
/// Differences that slopes are taken over: of the coordinate's logarithm, and of the delay in samples.
const SLOPE_OVER: f64 = 1e-3;

/// Climbs from a coordinate and a shape's delay to the most likely ones near it under noise of a density, by Gauss-Newton steps.
pub(crate) fn climb(
    panel: &Panel,
    density: &[f64],
    terms: &[&Term],
    effect: &str,
    shape: Arc<dyn Shape>,
    at: f64,
) -> Climbed {
    let (least, most) = shape.delays();
    let kin: Vec<&Term> = (terms.iter().copied())
        .filter(|t| shares(shape.as_ref(), t, effect))
        .collect();
    let course = |delay: f64, x: f64, beta: &[f64]| -> Vec<f64> {
        let late = shape.later(delay).unwrap_or_else(|| Arc::clone(&shape));
        let own = late.columns(x.exp()).into_iter().map(|c| c.values);
        let beside = kin.iter().flat_map(|t| values(late.as_ref(), t));
        let mut sum = vec![0.0; panel.bins.n];
        for (b, column) in beta.iter().zip(own.chain(beside)) {
            sum.iter_mut().zip(column).for_each(|(s, v)| *s += b * v);
        }
        sum
    };
    let width = panel.width();
    let solved = |delay: f64, x: f64, slopes: Option<&[f64]>| {
        let late = shape.later(delay).unwrap_or_else(|| Arc::clone(&shape));
        let beside = Beside::new(panel, terms, effect, late);
        let solution = beside.with(panel, x.exp(), |columns| {
            let Some(beta) = slopes else {
                return panel.solve(density, columns);
            };
            let slope = |low: [f64; 2], high: [f64; 2]| -> Vec<f64> {
                let by = (high[0] - low[0]) + (high[1] - low[1]);
                let low = course(low[0], low[1], beta);
                let high = course(high[0], high[1], beta).into_iter();
                high.zip(low).map(|(h, l)| (h - l) / by).collect()
            };
            let by = SLOPE_OVER;
            let of_x = slope([delay, x - by], [delay, x + by]);
            let (low, high) = ((delay - by).max(least), (delay + by).min(most));
            let of_delay = slope([low, x], [high, x]);
            let columns = [panel.add_all([of_x, of_delay]), columns.to_vec()].concat();
            panel.solve(density, &columns)
        });
        panel.truncate(width);
        solution
    };
    let grid = shape.grid();
    let bounds = (grid[0].ln(), grid[grid.len() - 1].ln());
    let (mut x, mut delay) = (at.ln(), shape.delay());
    let mut here = solved(delay, x, None);
    let mut covariance = [[0.0; 2]; 2];
    for _ in 0..CLIMBS {
        let sloped = solved(delay, x, Some(&here.beta));
        let of = |i: usize, j: usize| sloped.white * sloped.inverse[i][j];
        covariance = [[of(0, 0), of(0, 1)], [of(1, 0), of(1, 1)]];
        let by_prior = |i: usize| -of(i, 1) / MEAN_DELAY;
        let step = [sloped.beta[0] + by_prior(0), sloped.beta[1] + by_prior(1)];
        let mut share = 1.0;
        let mut moved = 0.0;
        for _ in 0..HALVED {
            let to = (delay + share * step[1]).clamp(least, most);
            // At its bound the delay gives the coordinate what the rest of its step would have.
            let left = share * step[1] - (to - delay);
            let along = if covariance[1][1] > 0.0 {
                covariance[0][1] / covariance[1][1]
            } else {
                0.0
            };
            let at = (x + (share * step[0] - along * left)).clamp(bounds.0, bounds.1);
            let there = solved(to, at, None);
            let gain = there.log_likelihood + prior(to) - here.log_likelihood - prior(delay);
            if gain >= 0.0 {
                let off = |by: f64, variance: f64| by.abs() / variance.sqrt();
                moved = off(at - x, covariance[0][0]).max(off(to - delay, covariance[1][1]));
                (x, delay, here) = (at, to, there);
                break;
            }
            share *= 0.5;
        }
        if !(moved > NEAR) {
            break;
        }
    }
    let shape = shape.later(delay).unwrap_or(shape);
    Climbed {
        shape,
        x,
        covariance,
    }
}
