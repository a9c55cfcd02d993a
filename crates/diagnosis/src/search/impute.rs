//! Lost readings, filled again once it is known how the channel moves.
//!
//! White noise and a random walk fill them at first, in which there is nothing of a filter, of a process, of a line or of
//! what follows a temperature: as data they would make all of these weaker, by the part that was lost, and name a filter
//! wrongly. So before the search they are drawn from the spectrum that the others have, and after it from what was found,
//! and everything is fitted again (the EM algorithm with a draw in the place of the expectation: what is off shrinks each
//! time by the part of the information that was lost). The errors are those of the readings that there are.

use crate::fit::channel::{Form, State, Term, whitened};
use crate::fit::likelihood::{Noise, Panel, invert};
use crate::fit::scan::residual;
use crate::ingest::conditional_draw;
use crate::ingest::fill::{draws, many};
use crate::ingest::types::Target;
use crate::search::Search;
use numerics::tails;

/// Times that it is done: of a hole of a third, 1/81 is left.
const PASSES: usize = 4;
/// Chance below which the filled readings are none of the noise that a state has.
const UNLIKE: f64 = 0.01;
/// The state fitted to the data of the panel with its lost readings filled by what it explains itself; none where they are
/// too few to matter: readings that a large line is missing in are tails of the noise, however few.
pub(crate) fn again(search: &Search<'_>, state: &State, target: &Target) -> Option<State> {
    // What was found by other means than the fit is not fitted again.
    let stated = state.terms.iter().any(|t| t.stated.is_some());
    if stated || target.moving || target.lost.is_empty() {
        return None;
    }
    let passes = match many(&target.lost, search.panel.bins.n) {
        true => PASSES,
        // Of so few nothing is left.
        false if are_unlike(search, state, &target.lost) => 1,
        false => return None,
    };
    let mut state = state.clone();
    for _ in 0..passes {
        let mut y = rest(search, &state);
        refill(search, &state, &coordinates(&state), &mut y, &target.lost);
        search.settle(&mut state);
        // What explained the filled readings, as a step where they begin, has nothing left to explain.
        let weakest = |s: &State| {
            let scores = s.terms.iter().map(Term::score).enumerate();
            let weak = scores.filter(|(_, score)| *score < 0.0);
            weak.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
        };
        while let Some(i) = weakest(&state) {
            state.terms.remove(i);
            search.settle(&mut state);
        }
    }
    widen(search, &mut state, &target.lost);
    state.wider = wider(search, &state, &target.lost);
    Some(state)
}

/// Whether the filled readings are farther off than the noise of a state.
fn are_unlike(search: &Search<'_>, state: &State, lost: &[usize]) -> bool {
    if state.terms.is_empty() {
        return false;
    }
    let (_, e) = whitened(&search.panel, state);
    let square = lost.iter().map(|i| e[*i] * e[*i]).sum();
    tails::chi_tail(square, lost.len() as f64) < UNLIKE
}

/// What the columns leave, by sample.
fn rest(search: &Search<'_>, state: &State) -> Vec<f64> {
    let panel = &search.panel;
    panel
        .dct
        .inverse(&residual(panel, &state.columns(), &state.solution))
}

/// Draws the lost ones of what the columns leave under the noise of these coordinates, and puts them into the data.
fn refill(search: &Search<'_>, state: &State, at: &[f64], rest: &mut [f64], lost: &[usize]) {
    let panel = &search.panel;
    let (noise, white) = noise_at(state, at);
    let before = rest.to_vec();
    let precision = precision(panel, &noise, white);
    conditional_draw::fill(
        &panel.dct,
        &precision,
        rest,
        lost,
        &mut draws(search.view.channel),
    );
    // Elsewhere nothing changes.
    let mut change = vec![0.0; rest.len()];
    lost.iter().for_each(|i| change[*i] = rest[*i] - before[*i]);
    let mut data = panel.column(0).to_vec();
    let change = panel.dct.forward(&change);
    data.iter_mut().zip(change).for_each(|(d, c)| *d += c);
    panel.replace_data(data);
}

fn precision(panel: &Panel, noise: &Noise, white: f64) -> Vec<f64> {
    let g = noise.everywhere(&panel.bins);
    g.iter().map(|g| (white * g).recip()).collect()
}

/// Whitened coefficients of what the readings that there are tell: the lost ones at their mean. They have as many degrees of
/// freedom as there are readings.
pub(crate) fn told(search: &Search<'_>, state: &State, lost: &[usize]) -> Vec<f64> {
    let panel = &search.panel;
    let precision = precision(panel, &state.noise, state.solution.white);
    let mut y = rest(search, state);
    conditional_draw::fill_mean(&panel.dct, &precision, &mut y, lost);
    let c = panel.dct.forward(&y);
    c.iter()
        .zip(&precision)
        .map(|(c, p)| c * p.sqrt())
        .collect()
}

/// Coordinates of the noise of a state: ln of the white variance, the random walk's, those of the terms.
fn coordinates(state: &State) -> Vec<f64> {
    let mut x = vec![state.solution.white.ln(), state.noise.log_walk];
    x.extend(state.noise.terms.iter().flat_map(|t| t.1.iter().copied()));
    x
}

fn noise_at(state: &State, x: &[f64]) -> (Noise, f64) {
    let mut noise = state.noise.clone();
    noise.log_walk = x[1];
    let mut rest = &x[2..];
    for (_, theta) in &mut noise.terms {
        let (own, tail) = rest.split_at(theta.len());
        theta.copy_from_slice(own);
        rest = tail;
    }
    (noise, x[0].exp())
}

/// Step of the differences that stand for derivatives, in logarithms.
const STEP: f64 = 0.1;

/// How much wider the errors of the coordinates are than those of data without holes: the filled readings follow what was
/// fitted, and each is one draw. With the information I of the filled data and J, what of its gradient follows the
/// coordinates that they were drawn with (Meng and Rubin 1991), the variance is (I - J)^-1 I (I - J)^-1 in the place of I^-1.
fn wider(search: &Search<'_>, state: &State, lost: &[usize]) -> Vec<f64> {
    let panel = &search.panel;
    let (columns, x) = (state.columns(), coordinates(state));
    let m = x.len();
    let n = (panel.bins.n - 1) as f64;
    let log_likelihood = |x: &[f64]| {
        let (noise, white) = noise_at(state, x);
        let s = panel.solve(&noise.over(&panel.bins), &columns);
        -0.5 * (n * white.ln() + s.log_det_noise + s.rss / white)
    };
    let shifted = |x: &[f64], by: &[(usize, f64)]| {
        let mut x = x.to_vec();
        by.iter().for_each(|(i, sign)| x[*i] += sign * STEP);
        x
    };
    let gradient = || -> Vec<f64> {
        let at = |i, sign| log_likelihood(&shifted(&x, &[(i, sign)]));
        (0..m)
            .map(|i| (at(i, 1.0) - at(i, -1.0)) / (2.0 * STEP))
            .collect()
    };
    let second = |i: usize, j: usize| {
        let at = |a, b| log_likelihood(&shifted(&x, &[(i, a), (j, b)]));
        (at(1.0, 1.0) - at(1.0, -1.0) - at(-1.0, 1.0) + at(-1.0, -1.0)) / (4.0 * STEP * STEP)
    };
    // What the data hardly tell, as a random walk too small to show, stands still.
    let known: Vec<usize> = (0..m).filter(|i| second(*i, *i) < -1.0).collect();
    let of_known = |f: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
        let row = |i: &usize| known.iter().map(|j| f(*i, *j)).collect();
        known.iter().map(row).collect()
    };
    let information = of_known(&|i, j| -second(i.min(j), i.max(j)));
    let data = panel.column(0).to_vec();
    let with_draws_at = |i: usize, sign: f64| {
        let mut y = rest(search, state);
        refill(search, state, &shifted(&x, &[(i, sign)]), &mut y, lost);
        let g = gradient();
        panel.replace_data(data.clone());
        g
    };
    let follows: Vec<Vec<f64>> = known
        .iter()
        .map(|i| {
            let (up, down) = (with_draws_at(*i, 1.0), with_draws_at(*i, -1.0));
            let slope = up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * STEP));
            slope.collect()
        })
        .collect();
    let p = known.len();
    let left: Vec<Vec<f64>> = (0..p)
        .map(|a| {
            let both = |b: usize| 0.5 * (follows[a][known[b]] + follows[b][known[a]]);
            (0..p).map(|b| information[a][b] - both(b)).collect()
        })
        .collect();
    let (inverse, _) = invert(&left);
    let (filled, _) = invert(&information);
    let mut wider = vec![1.0; m];
    for (a, i) in known.iter().enumerate() {
        let pairs = (0..p).flat_map(|b| (0..p).map(move |c| (b, c)));
        let variance: f64 = pairs
            .map(|(b, c)| inverse[a][b] * information[b][c] * inverse[c][a])
            .sum();
        wider[*i] = (variance / filled[a][a]).sqrt().max(1.0);
    }
    wider
}

/// Takes the part of each column's energy that lies in lost readings out of what is known of its coefficient. A step is
/// known by what lies about it.
fn widen(search: &Search<'_>, state: &mut State, lost: &[usize]) {
    let wider: Vec<f64> = state
        .terms
        .iter()
        .flat_map(|t| {
            t.columns
                .iter()
                .map(|c| (matches!(t.form, Form::Step(..)), *c))
        })
        .map(|(step, column)| {
            if step {
                return 1.0;
            }
            let mut c = search.panel.column(column).to_vec();
            c[0] = 0.0;
            let values = search.panel.dct.inverse(&c);
            let energy: f64 = values.iter().map(|v| v * v).sum();
            let gone: f64 = lost.iter().map(|i| values[*i] * values[*i]).sum();
            (1.0 - gone / energy.max(f64::MIN_POSITIVE))
                .max(0.05)
                .sqrt()
                .recip()
        })
        .collect();
    for (row, a) in state.solution.inverse.iter_mut().zip(&wider) {
        row.iter_mut().zip(&wider).for_each(|(v, b)| *v *= a * b);
    }
}
