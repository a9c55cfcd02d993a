//! Contests between whole explanations: two levels against what looks like a stationary process or a chain of steps.
//!
//! Both sides are weighed on the same block means: the Gaussian model by its exact likelihood, the two-level one (with
//! white noise and a random walk of the level) by a bank of Kalman filters, one for each level, merged by moments.

mod dwell_times;
mod steps;

use std::f64::consts::TAU;
use std::rc::Rc;
use std::sync::Arc;

use model::effect::{Covariance, Effect, Hypothesis};

use crate::fit::channel::{Form, Note, State, Term};
use crate::fit::likelihood::{Bins, Dct, Noise, Panel, least_walk};
use crate::fit::scan::residual;
use crate::fit::threshold;
use crate::numerics::tails::normal_tail;
use crate::search::Search;
use crate::test_level;
use crate::test_level::{CLAIMS, Outcome};
pub use crate::two_level::fit::two_level;
use crate::two_level::fit::{
    Coordinates, Side, Sides, again, covariance_of, fitted, many_ahead, path,
};

/// Nats by which two levels have to be better.
const MARGIN: f64 = 4.0;
/// Switches that two levels make at least, where steps explain them too.
const LEAST_SWITCHES: f64 = 3.0;
/// Nats within which the answer stays open.
const OPEN: f64 = 3.0;
/// Longest block of a short record, s, and most blocks.
const BLOCK_S: f64 = 0.2;
const MOST_BLOCKS: usize = 6000;
/// How much longer a block is behind a filter of a pole up to 0.7 from sample to sample: it leaves neighbours of such
/// blocks a correlation of a tenth.
const BEHIND_A_FILTER: f64 = 4.0;
/// Variance of the level about its most probable mean, over that of the two levels, above which it is not taken off.
const LARGEST_DOUBT: f64 = 0.05;
/// Blocks of a coarse look.
const COARSE_BLOCKS: usize = 400;
/// Most blocks of a correlation time, where a record holds more blocks than that.
const BLOCKS_OF_A_TIME: f64 = 10.0;

/// Stationary terms with their coordinates.
type Processes = Vec<(Arc<dyn Covariance>, Vec<f64>)>;

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

/// Means of at most `count` blocks.
fn means(y: &[f64], length: usize, count: usize) -> Vec<f64> {
    let mean = |c: &[f64]| c.iter().sum::<f64>() / length as f64;
    y.chunks_exact(length).take(count).map(mean).collect()
}

/// Share of each of `count` blocks that lies behind time `at`, samples; the blocks start at `first`.
fn after(count: usize, first: usize, length: usize, at: f64) -> Vec<f64> {
    let behind = |i: usize| (first + (i + 1) * length) as f64 - at;
    let share = |i: usize| (behind(i) / length as f64).clamp(0.0, 1.0);
    (0..count).map(share).collect()
}

/// Whether two levels may stand behind what the search left to the random walk, by a coarse look.
fn looks_two_level(search: &Search<'_>, state: &State) -> bool {
    let n = search.panel.bins.n;
    if search.view.moving || search.view.sways() {
        return false;
    }
    let length = n.div_ceil(COARSE_BLOCKS);
    let r = residual(&search.panel, &state.columns(), &state.solution);
    let blocks = means(&search.panel.dct.inverse(&r), length, COARSE_BLOCKS);
    let m = blocks.len();
    if m < COARSE_BLOCKS / 2 {
        return false;
    }
    let panel = Panel::new(&Dct::new(m), &Rc::new(Bins::new(m)), &blocks);
    let (noise, walk) = panel.fit(&Noise::new(-9.0), &[]);
    // A level that never moves does not switch.
    if noise.log_walk <= least_walk(m) {
        return false;
    }
    let variance = blocks.iter().map(|v| v * v).sum::<f64>() / m as f64;
    let white = (state.solution.white / length as f64).min(variance);
    let excess = (variance - white).max(0.05 * white);
    let (two, _) = fitted(&blocks, white, excess, &[(0.9, 10.0), (0.7, 40.0)], 100);
    let gaussian = walk.log_likelihood - 0.5 * (m - 1) as f64 * (1.0 + TAU.ln());
    two - gaussian > MARGIN
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
    let contested = |t: &Term| t.is_process() || matches!(t.form, Form::Step(..));
    let steps = state
        .terms
        .iter()
        .filter(|t| matches!(t.form, Form::Step(..)))
        .count();
    let wandering = state
        .terms
        .iter()
        .any(|t| contested(t) && !matches!(t.form, Form::Step(..)));
    // The data without the terms that are not contested.
    let kept: Vec<Term> = state
        .terms
        .iter()
        .filter(|t| !contested(t))
        .cloned()
        .collect();
    let contest = wandering || steps >= 2;
    if !(contest || looks_two_level(search, &search.refit(kept.clone(), state.noise.log_walk))) {
        return state;
    }
    let Some((_, _, process)) = stationary(search) else {
        return state;
    };
    let n = search.panel.bins.n;
    let mut theirs = kept;
    let longest = 100f64.min(n as f64 / 60.0);
    let contested_limits = state.terms.iter().filter(|t| contested(t));
    theirs.push(Term::new(
        candidate.effect,
        at,
        Form::Covariance(process, vec![-3.0, longest.max(2.0).ln()]),
        contested_limits
            .map(|t| t.threshold)
            .fold(threshold::two_level(), f64::min),
    ));
    let rival = search.refit(theirs, state.noise.log_walk);
    let r = residual(&search.panel, &rival.columns(), &rival.solution);
    let mut rest = search.panel.dct.inverse(&r);
    // A process that is fast for a long record is weighed on a stretch of it, in blocks that still show it.
    // What a filter makes of neighbours is to be gone from block to block.
    let longer = if state.terms.iter().any(Term::is_filter) {
        BEHIND_A_FILTER
    } else {
        1.0
    };
    let shortest = ((longer * BLOCK_S * search.view.rate_hz) as usize).max(1);
    // What a step beside it adds to its spectrum is none of its own.
    let is_step = |t: &&Term| matches!(t.form, Form::Step(..));
    let time_of = |s: &State| {
        s.noise
            .terms
            .last()
            .map_or(0.0, |(_, theta)| theta[1].exp())
    };
    let time = if wandering && steps > 0 {
        let beside = state.terms.iter().filter(is_step).cloned();
        let terms = rival.terms.iter().cloned().chain(beside).collect();
        time_of(&search.refit(terms, state.noise.log_walk))
    } else {
        time_of(&rival)
    };
    let length = n
        .div_ceil(MOST_BLOCKS)
        .min((time / BLOCKS_OF_A_TIME) as usize)
        .max(shortest);
    let first = n.saturating_sub(MOST_BLOCKS * length) / 2;
    let mut blocks = means(&rest[first..], length, MOST_BLOCKS);
    let m = blocks.len();
    if m < 200 {
        return state;
    }
    // Gaussian side: the better of what was found and the AR(1)-like term, steps as columns.
    let (dct, bins) = (Dct::new(m), Rc::new(Bins::new(m)));
    let panel = Panel::new(&dct, &bins, &blocks);
    let gaussian = |panel: &Panel, terms: Processes, columns: &[usize]| {
        let noise = Noise {
            log_walk: -9.0,
            terms,
        };
        let (noise, solution) = panel.fit(&noise, columns);
        let count = (m - 1) as f64;
        let l = solution.log_likelihood - 0.5 * count * (1.0 + TAU.ln());
        (l, noise, solution.white)
    };
    let own_columns: Vec<usize> = state
        .terms
        .iter()
        .filter_map(|t| match t.form {
            // The block that holds it reads a mean of both levels.
            Form::Step(s, _) => Some(panel.add(&after(m, first, length, s))),
            _ => None,
        })
        .collect();
    // Correlation times are in samples: of blocks, they are shorter by the block.
    let shorter = (length as f64).ln();
    let terms_of = |s: &State| -> Processes {
        s.terms
            .iter()
            .filter_map(|t| match &t.form {
                Form::Covariance(c, theta) if t.is_process() => {
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
    let like_one = gaussian(&panel, terms_of(&rival), &[]);
    let found = gaussian(&panel, terms_of(&state), &own_columns);
    let theirs = like_one.0.max(found.0 - steps as f64 * (m as f64).ln());
    let variance = blocks.iter().map(|v| v * v).sum::<f64>() / m as f64;
    let white = (state.solution.white / length as f64).min(variance);
    let excess = (variance - white).max(0.05 * white);
    let starts = [(1.0, 15.0), (0.8, 60.0), (0.6, 200.0)];
    let (mut two, mut x) = fitted(&blocks, white, excess, &starts, 160);
    let ahead = two - theirs;
    // A step or two are no noise that switches.
    if steps > 0 && !wandering && (m as f64) < 1.001 * LEAST_SWITCHES * x[3].exp() {
        return state;
    }
    if !contest && 2.0 * ahead < threshold::two_level() {
        return state;
    }
    let mut other = if wandering { found } else { like_one };
    let cox = |two: f64, x: &Coordinates, (l, noise, white): (f64, Noise, f64), truth| {
        let sides = Sides {
            dct: &dct,
            bins: &bins,
            noise,
            white,
            two: *x,
        };
        sides.cox(two - l, truth)
    };
    let mut state = state;
    if ahead <= MARGIN && wandering {
        let z = cox(two, &x, other.clone(), Side::Gaussian);
        let claim = levels_claim(z, "a Gaussian process");
        for t in state.terms.iter_mut().filter(|t| contested(t)) {
            t.claims.push(claim.clone());
        }
    }
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
    let mut settled = rival;
    let without = settled.terms.len();
    let block_s = length as f64 / search.view.rate_hz;
    let at_random = |blocks: &[f64], x: &Coordinates| dwell_times::at_random(blocks, x, block_s);
    let mut switches = at_random(&blocks, &x);
    // What switches by a clock has no steps beside it: its own are surprises to levels that switch at random.
    if !switches
        .as_ref()
        .is_some_and(|s| s.p_value < test_level::CLAIM_LEVEL)
    {
        settled = steps::beside(search, settled, &mut rest, length, &x);
    }
    if settled.terms.len() > without {
        blocks = means(&rest[first..], length, MOST_BLOCKS);
        (two, x) = again(&blocks, &x);
        switches = at_random(&blocks, &x);
        let panel = Panel::new(&dct, &bins, &blocks);
        other = gaussian(&panel, terms_of(&settled), &[]);
    }
    let errors = covariance_of(&blocks, &x);
    // ln of the half height is x2 + x0 / 2.
    let least = (-2.0 * x[2]).exp() / m as f64;
    let half_error = (errors[2][2] + errors[0][2] + 0.25 * errors[0][0])
        .max(least)
        .sqrt();
    // Where the likelihood hardly bends, the switches that were seen still bound it.
    let seen = m as f64 * (-x[3]).exp();
    let dwell_error = errors[3][3].max(1.0 / seen.max(1.0)).sqrt();
    // A block in which the level switches reads anything between the levels: half a block's worth for each switch.
    let mixed = (0.5 * (-x[3]).exp()).min(0.3);
    let half = (x[2] + 0.5 * x[0]).exp() / (1.0 - mixed);
    let dwell = x[3].exp() * block_s;
    if many_ahead(&blocks, &x) > MARGIN {
        settled.notes.push(Note {
            what: "jumps between more than two levels".into(),
            at: None,
        });
    }
    // Where only a stretch was weighed, the level elsewhere is not known; and where it is much in doubt, taking it off
    // would take noise off.
    let levels = path(&blocks, &x);
    let steps_at = (x[2] + 0.5 * x[0]).exp();
    let doubt = levels
        .iter()
        .map(|l| 1.0 - (l / steps_at).powi(2))
        .sum::<f64>()
        / m as f64;
    if first == 0 && doubt < LARGEST_DOUBT {
        let at = |i: usize| levels[(i / length).min(m - 1)];
        settled.level = Some(Rc::new((0..n).map(at).collect()));
    }
    if let Some(t) = settled.terms.get_mut(without - 1) {
        t.stated = Some(vec![
            (half, half * half_error),
            (dwell, dwell * dwell_error),
        ]);
        t.lr = 2.0 * (ahead - MARGIN) + t.threshold;
        let z = cox(two, &x, other, Side::TwoLevels);
        t.claims.push(levels_claim(z, "two levels"));
        t.claims.extend(switches);
    }
    settled
}

/// The claim of a contest of levels: `z` standard errors from what the lead of two levels is for what was named.
pub(crate) fn levels_claim(z: f64, named: &str) -> Outcome {
    let more = if z > 0.0 { "more" } else { "less" };
    Outcome {
        id: CLAIMS[3],
        statistic: z,
        p_value: normal_tail(z),
        what: format!(
            "told as {named}, it lies {more} about two levels than one does, in standard errors"
        ),
    }
}
