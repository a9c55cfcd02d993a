//! Contests between whole explanations: two levels against what looks like a stationary process or a chain of steps.
//!
//! Both sides are weighed on the same block means: the Gaussian model by its exact likelihood, the two-level one (with
//! white noise and a random walk of the level) by a bank of Kalman filters, one for each level, merged by moments.

use std::rc::Rc;
use std::sync::Arc;

use model::effect::{Covariance, Effect, Hypothesis};

use crate::likelihood::{Bins, Dct, Noise, Panel};
use crate::scan::residual;
use crate::search::{Form, Search, State, Term};

/// Nats by which two levels have to be better.
const MARGIN: f64 = 4.0;
/// Nats within which the answer stays open.
const OPEN: f64 = 3.0;
/// Longest block, s, and most blocks.
const BLOCK_S: f64 = 0.2;
const MOST_BLOCKS: usize = 6000;

/// ln of variance, ln of random-walk step over it, ln of half height over the white sigma, ln of dwell in blocks.
type Coordinates = [f64; 4];

/// Levels of the two-level process, in half heights.
const TWO: [f64; 2] = [1.0, -1.0];
/// Levels that stand for any: five of a normal distribution.
const MANY: [f64; 5] = [-1.5, -0.7, 0.0, 0.7, 1.5];

/// Log likelihood of block means under white noise + random walk + two levels, the mean taken out.
#[must_use]
pub fn two_level(y: &[f64], x: &Coordinates) -> f64 {
    levels_likelihood(y, x, &TWO)
}

/// The same for jumps between any of `levels`, all equally likely.
fn levels_likelihood<const K: usize>(y: &[f64], x: &Coordinates, levels: &[f64; K]) -> f64 {
    let white = x[0].exp();
    let walk = white * x[1].exp();
    let half = x[2].exp() * white.sqrt();
    let others = (K - 1) as f64;
    // Two levels keep their share of 1/2 for ever, many theirs of 1/K.
    let share = K as f64 / others;
    let switch = (1.0 - (-share * (-x[3]).exp()).exp()) / share;
    let start = 1e4 * white + half * half;
    // State by level: weight, mean and variance of the slow level.
    let mut states = [((K as f64).recip(), 0.0, start); K];
    let mut sum = -0.5 * y.len() as f64 * std::f64::consts::TAU.ln();
    for (t, v) in y.iter().enumerate() {
        // Prediction by level: weight times 1/sqrt(s), mean, 1/s, gain, variance after the reading.
        let predicted = states.map(|(w, m, p)| {
            let p = p + if t > 0 { walk } else { 0.0 };
            let inverse = 1.0 / (p + white);
            (
                w * inverse.sqrt(),
                m,
                inverse,
                p * inverse,
                p * white * inverse,
            )
        });
        // State by level after it, with what it is off at best.
        let mut merged = [(0.0, 0.0, 0.0, 0.0); K];
        for (j, (level, merged)) in levels.iter().zip(&mut merged).enumerate() {
            let off = predicted.map(|(_, m, inverse, ..)| {
                let nu = v - m - half * level;
                (nu, 0.5 * nu * nu * inverse)
            });
            let least = off.iter().map(|o| o.1).fold(f64::INFINITY, f64::min);
            let mut parts = [(0.0, 0.0, 0.0); K];
            let (mut all, mut mean) = (0.0, 0.0);
            for (i, ((nu, q), (w, m, _, gain, after))) in off.iter().zip(&predicted).enumerate() {
                let moved = if i == j {
                    1.0 - switch
                } else {
                    switch / others
                };
                let weight = w * moved * (least - q).exp();
                let at = m + gain * nu;
                parts[i] = (weight, at, *after);
                all += weight;
                mean += weight * at;
            }
            mean /= all;
            let variance = parts
                .iter()
                .map(|(w, at, after)| w * (after + (at - mean).powi(2)))
                .sum::<f64>()
                / all;
            *merged = (all, mean, variance, least);
        }
        let least = merged.iter().map(|m| m.3).fold(f64::INFINITY, f64::min);
        let weights = merged.map(|m| m.0 * (least - m.3).exp());
        let total: f64 = weights.iter().sum();
        sum += total.ln() - least;
        states = std::array::from_fn(|j| (weights[j] / total, merged[j].1, merged[j].2));
    }
    // The diffuse start integrates the mean out. Its prior density is put back, and the factor of sqrt(count) by which
    // that integral differs from the density of the coefficients k >= 1 of the orthonormal DCT.
    sum + 0.5 * (std::f64::consts::TAU * start * y.len() as f64).ln()
}

/// Nats that many levels are ahead of two, from where the two are at their best.
fn many_ahead(y: &[f64], two: &Coordinates) -> f64 {
    let inside = |x: &[f64]| {
        [
            x[0],
            x[1].clamp(-25.0, 2.0),
            x[2].clamp(-6.0, 6.0),
            x[3].clamp(0.7, (y.len() as f64 / 3.0).ln()),
        ]
    };
    let objective = |x: &[f64]| {
        let clamped = inside(x);
        let outside: f64 = x.iter().zip(&clamped).map(|(a, b)| (a - b).powi(2)).sum();
        outside - levels_likelihood(y, &clamped, &MANY)
    };
    let best = crate::optimise::nelder_mead(&objective, two, &[0.1, 2.0, 0.3, 0.7], 60);
    -objective(&best) - two_level(y, two)
}

/// Covariance of the coordinates at a highest point of `l`: the inverse of its curvature, all coordinates free. One that
/// the data do not bend, such as a random walk of nearly nothing, is held.
fn covariance_of(l: &dyn Fn(&Coordinates) -> f64, x: &Coordinates) -> Vec<Vec<f64>> {
    const H: f64 = 0.06;
    let at = |moves: &[(usize, f64)]| {
        let mut y = *x;
        for (i, by) in moves {
            y[*i] += by * H;
        }
        l(&y)
    };
    let middle = l(x);
    let second = |i: usize, j: usize| {
        if i == j {
            return (at(&[(i, 1.0)]) - 2.0 * middle + at(&[(i, -1.0)])) / (H * H);
        }
        (at(&[(i, 1.0), (j, 1.0)]) - at(&[(i, 1.0), (j, -1.0)]) - at(&[(i, -1.0), (j, 1.0)])
            + at(&[(i, -1.0), (j, -1.0)]))
            / (4.0 * H * H)
    };
    let count = x.len();
    let bends: Vec<bool> = (0..count).map(|i| second(i, i) < -0.05).collect();
    let information: Vec<Vec<f64>> = (0..count)
        .map(|i| {
            (0..count)
                .map(|j| match (i == j, bends[i] && bends[j]) {
                    (_, true) => -second(i.min(j), i.max(j)),
                    (true, false) => 1e12,
                    (false, false) => 0.0,
                })
                .collect()
        })
        .collect();
    crate::likelihood::invert(&information).0
}

/// The AR(1)-like term of the library: stationary, two coordinates, no filter.
fn stationary(search: &Search<'_>) -> Option<(usize, &'static dyn Effect, Arc<dyn Covariance>)> {
    search
        .candidates
        .iter()
        .enumerate()
        .find_map(|(i, c)| match &c.hypothesis {
            Hypothesis::Covariance(p) if p.dimensions() == 2 && !p.filters_white() => {
                Some((i, c.effect, Arc::clone(p)))
            }
            _ => None,
        })
}

/// Let two levels compete with the stationary terms and steps of a state.
#[must_use]
pub fn hold(search: &Search<'_>, state: State) -> State {
    let Some((at, candidate)) = search
        .candidates
        .iter()
        .enumerate()
        .find(|(_, c)| matches!(c.hypothesis, Hypothesis::TwoLevel))
    else {
        return state;
    };
    let contested = |t: &Term| match &t.form {
        Form::Covariance(c, _) => !c.filters_white(),
        Form::Step(..) => true,
        _ => false,
    };
    let steps = state
        .terms
        .iter()
        .filter(|t| matches!(t.form, Form::Step(..)))
        .count();
    let wandering = state
        .terms
        .iter()
        .any(|t| contested(t) && !matches!(t.form, Form::Step(..)));
    if !(wandering || steps >= 2) {
        return state;
    }
    let Some((_, _, process)) = stationary(search) else {
        return state;
    };
    // The data without the terms that are not contested.
    let kept: Vec<Term> = state
        .terms
        .iter()
        .filter(|t| !contested(t))
        .cloned()
        .collect();
    let n = search.panel.bins.n;
    let mut theirs = kept.clone();
    let longest = 100f64.min(n as f64 / 60.0);
    theirs.push(Term {
        effect: candidate.effect,
        candidate: at,
        form: Form::Covariance(process, vec![-3.0, longest.max(2.0).ln()]),
        columns: vec![],
        names: vec![],
        fixed: vec![],
        follows: None,
        lr: 0.0,
        threshold: state
            .terms
            .iter()
            .filter(|t| contested(t))
            .map(|t| t.threshold)
            .fold(f64::INFINITY, f64::min),
        alternatives: vec![],
        stated: None,
    });
    let rival = search.refit(theirs, state.noise.log_walk);
    let r = residual(&search.panel, &rival.columns(), &rival.solution);
    let rest = search.panel.dct.inverse(&r);
    let length = ((BLOCK_S * search.view.rate_hz) as usize)
        .max(n.div_ceil(MOST_BLOCKS))
        .max(1);
    let blocks: Vec<f64> = rest
        .chunks_exact(length)
        .map(|c| c.iter().sum::<f64>() / length as f64)
        .collect();
    let m = blocks.len();
    if m < 200 {
        return state;
    }
    // Gaussian side: the better of what was found and the AR(1)-like term, steps as columns.
    let (dct, bins) = (Dct::new(m), Rc::new(Bins::new(m)));
    let panel = Panel::new(&dct, &bins, &blocks);
    let gaussian = |terms: &[(Arc<dyn Covariance>, Vec<f64>)], columns: &[usize]| {
        let noise = Noise {
            log_walk: -9.0,
            terms: terms.to_vec(),
        };
        let l = panel.fit(&noise, columns).1.log_likelihood;
        let count = (m - 1) as f64;
        l - 0.5 * count * (1.0 + std::f64::consts::TAU.ln())
    };
    let own_columns: Vec<usize> = state
        .terms
        .iter()
        .filter_map(|t| match t.form {
            Form::Step(s, _) => Some(
                panel.add(
                    &(0..m)
                        .map(|i| f64::from(u8::from((i * length) as f64 >= s)))
                        .collect::<Vec<_>>(),
                ),
            ),
            _ => None,
        })
        .collect();
    // Correlation times are in samples: of blocks, they are shorter by the block.
    let shorter = (length as f64).ln();
    let terms_of = |s: &State| -> Vec<(Arc<dyn Covariance>, Vec<f64>)> {
        s.terms
            .iter()
            .filter_map(|t| match &t.form {
                Form::Covariance(c, theta) if !c.filters_white() => {
                    let mut theta = theta.clone();
                    theta[0] += shorter;
                    if let Some(tau) = theta.get_mut(1) {
                        *tau = (*tau - shorter).max(0.1);
                    }
                    Some((Arc::clone(c), theta))
                }
                _ => None,
            })
            .collect()
    };
    // Each step costs its time and its height.
    let theirs = gaussian(&terms_of(&rival), &[])
        .max(gaussian(&terms_of(&state), &own_columns) - steps as f64 * (m as f64).ln());
    let variance = blocks.iter().map(|v| v * v).sum::<f64>() / m as f64;
    let white = (state.solution.white / length as f64).min(variance);
    let excess = (variance - white).max(0.05 * white);
    let mut best = (f64::INFINITY, vec![]);
    for (share, dwell) in [(1.0, 15.0), (0.8, 60.0), (0.6, 200.0)] {
        let start = [
            white.ln(),
            -12.0,
            0.5 * (share * excess / white).ln(),
            f64::ln(dwell),
        ];
        let objective = |x: &[f64]| {
            let inside = [
                x[0],
                x[1].clamp(-25.0, 2.0),
                x[2].clamp(-6.0, 6.0),
                x[3].clamp(0.7, (m as f64 / 3.0).ln()),
            ];
            let outside: f64 = x.iter().zip(&inside).map(|(a, b)| (a - b).powi(2)).sum();
            outside - two_level(&blocks, &inside)
        };
        let x = crate::optimise::nelder_mead(&objective, &start, &[0.1, 2.0, 0.3, 0.7], 160);
        let value = objective(&x);
        if value < best.0 {
            best = (value, x);
        }
    }
    let ahead = -best.0 - theirs;
    if ahead < -OPEN {
        return state;
    }
    if ahead <= MARGIN {
        let mut open = state;
        for t in open.terms.iter_mut().filter(|t| contested(t)) {
            if ahead.abs() <= OPEN {
                t.alternatives.push((candidate.effect, ahead));
            }
        }
        return open;
    }
    let x: Coordinates = [best.1[0], best.1[1], best.1[2], best.1[3]];
    let errors = covariance_of(&|y| two_level(&blocks, y), &x);
    // ln of the half height is x2 + x0 / 2.
    let half_error = (errors[2][2] + errors[0][2] + 0.25 * errors[0][0])
        .max(0.0)
        .sqrt();
    let dwell_error = errors[3][3].max(0.0).sqrt();
    // A block in which the level switches reads anything between the levels: half a block's worth for each switch.
    let mixed = (0.5 * (-x[3]).exp()).min(0.3);
    let half = (x[2] + 0.5 * x[0]).exp() / (1.0 - mixed);
    let dwell = x[3].exp() * length as f64 / search.view.rate_hz;
    let mut settled = rival;
    if many_ahead(&blocks, &x) > MARGIN {
        settled
            .notes
            .push("jumps between more than two levels".into());
    }
    if let Some(t) = settled.terms.last_mut() {
        t.stated = Some(vec![
            (half, half * half_error),
            (dwell, dwell * dwell_error),
        ]);
        t.lr = 2.0 * (ahead - MARGIN) + t.threshold;
    }
    settled
}
