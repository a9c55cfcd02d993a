//! The most likely coordinate and delay of a shape, found together by Gauss-Newton steps: each stands for the other in part.

use std::sync::Arc;

use model::effect::Shape;

use super::{Beside, MEAN_DELAY, prior, shares, values};
use crate::fit::channel::Term;
use crate::fit::likelihood::{Panel, Solution};

/// Steps of the climb, and how often one that overshoots is halved.
const STEPS: usize = 8;
const HALVED: usize = 6;
/// The climb ends with a step below this share of a standard error.
const NEAR: f64 = 0.02;
/// Differences that slopes are taken over: of the coordinate's logarithm, and of the delay in samples.
const SLOPE_OVER: f64 = 1e-3;

/// The most likely coordinate and delay of a shape.
pub(crate) struct Climbed {
    /// So late.
    pub(crate) shape: Arc<dyn Shape>,
    /// Logarithm of the coordinate.
    pub(crate) x: f64,
    /// Covariance of that and of the delay, in samples.
    pub(crate) covariance: [[f64; 2]; 2],
}

/// Climbs from a coordinate and a shape's delay to the most likely ones near it under noise of a density.
pub(crate) fn climb(
    panel: &Panel,
    density: &[f64],
    terms: &[&Term],
    effect: &str,
    shape: Arc<dyn Shape>,
    at: f64,
) -> Climbed {
    let slope = Slope {
        panel,
        density,
        terms,
        effect,
        shape,
    };
    let (x, delay) = (at.ln(), slope.shape.delay());
    let mut here = Place {
        x,
        delay,
        solution: slope.solved(x, delay, None),
    };
    let mut covariance = [[0.0; 2]; 2];
    for _ in 0..STEPS {
        let sloped = slope.solved(here.x, here.delay, Some(&here.solution.beta));
        let of = |i: usize, j: usize| sloped.white * sloped.inverse[i][j];
        covariance = [[of(0, 0), of(0, 1)], [of(1, 0), of(1, 1)]];
        let step = [0, 1].map(|i| sloped.beta[i] - covariance[i][1] / MEAN_DELAY);
        let Some(there) = slope.up(&here, step, covariance) else {
            break;
        };
        let off = |by: f64, variance: f64| by.abs() / variance.sqrt();
        let moved = off(there.x - here.x, covariance[0][0])
            .max(off(there.delay - here.delay, covariance[1][1]));
        here = there;
        if moved < NEAR {
            break;
        }
    }
    Climbed {
        shape: slope.late(here.delay),
        x: here.x,
        covariance,
    }
}

/// A point of the climb.
struct Place {
    x: f64,
    delay: f64,
    solution: Solution,
}

/// What is climbed.
struct Slope<'a> {
    panel: &'a Panel,
    density: &'a [f64],
    terms: &'a [&'a Term],
    effect: &'a str,
    shape: Arc<dyn Shape>,
}

impl Slope<'_> {
    fn late(&self, delay: f64) -> Arc<dyn Shape> {
        let shape = self.shape.later(delay);
        shape.unwrap_or_else(|| Arc::clone(&self.shape))
    }

    /// What the columns of the effect make with these coefficients, by sample.
    fn course(&self, x: f64, delay: f64, beta: &[f64]) -> Vec<f64> {
        let late = self.late(delay);
        let kin = self.terms.iter();
        let kin = kin.filter(|t| shares(late.as_ref(), t, self.effect));
        let own = late.columns(x.exp()).into_iter().map(|c| c.values);
        let all = own.chain(kin.flat_map(|t| values(late.as_ref(), t)));
        let mut sum = vec![0.0; self.panel.bins.n];
        for (b, column) in beta.iter().zip(all) {
            sum.iter_mut().zip(column).for_each(|(s, v)| *s += b * v);
        }
        sum
    }

    /// How that changes with the coordinate's logarithm and with the delay.
    fn slopes(&self, x: f64, delay: f64, beta: &[f64]) -> [Vec<f64>; 2] {
        let (least, most) = self.shape.delays();
        let over = |low: (f64, f64), high: (f64, f64), by: f64| -> Vec<f64> {
            let from = self.course(low.0, low.1, beta);
            let to = self.course(high.0, high.1, beta).into_iter();
            to.zip(from).map(|(to, from)| (to - from) / by).collect()
        };
        let by = SLOPE_OVER;
        let (from, to) = ((delay - by).max(least), (delay + by).min(most));
        [
            over((x - by, delay), (x + by, delay), 2.0 * by),
            over((x, from), (x, to), to - from),
        ]
    }

    /// The fit at a point; with the coefficients there, beside the two slopes, which come first.
    fn solved(&self, x: f64, delay: f64, beta: Option<&[f64]>) -> Solution {
        let width = self.panel.width();
        let beside = Beside::new(self.panel, self.terms, self.effect, self.late(delay));
        let solution = beside.with(self.panel, x.exp(), |columns| {
            let slopes = beta.map(|beta| self.panel.add_all(self.slopes(x, delay, beta)));
            let columns = [slopes.unwrap_or_default(), columns.to_vec()].concat();
            self.panel.solve(self.density, &columns)
        });
        self.panel.truncate(width);
        solution
    }

    /// A higher place along a step, which is halved until there is one. It stays within the grid and the delays that there are:
    /// at its bound the delay gives the coordinate what the rest of its step would have.
    fn up(&self, here: &Place, step: [f64; 2], covariance: [[f64; 2]; 2]) -> Option<Place> {
        let (least, most) = self.shape.delays();
        let grid = self.shape.grid();
        let (low, high) = (grid[0].ln(), grid[grid.len() - 1].ln());
        let along = covariance[0][1] / covariance[1][1].max(f64::MIN_POSITIVE);
        let halves = std::iter::successors(Some(1.0), |share| Some(0.5 * share));
        let tried = halves.take(HALVED).map(|share| {
            let delay = (here.delay + share * step[1]).clamp(least, most);
            let left = share * step[1] - (delay - here.delay);
            let x = (here.x + share * step[0] - along * left).clamp(low, high);
            Place {
                x,
                delay,
                solution: self.solved(x, delay, None),
            }
        });
        let height = |p: &Place| p.solution.log_likelihood + prior(p.delay);
        tried.into_iter().find(|p| height(p) >= height(here))
    }
}
