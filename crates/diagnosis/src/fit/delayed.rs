//! What stands beside a shape that a sensor shows late: the other columns of its effect are as late as it is.

mod climb;

use std::sync::Arc;

use model::effect::Shape;

use super::channel::{Form, Term};
use super::likelihood::Panel;

pub(crate) use climb::climb;

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
