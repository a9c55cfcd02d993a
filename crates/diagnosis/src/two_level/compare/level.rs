//! The level of two levels, sample by sample, and what is found beside it once it is known.

use std::sync::Arc;

use super::{Field, MOST_BLOCKS, contested, means};
use crate::fit::channel::{Form, State, Term};
use crate::fit::likelihood::{Bins, Dct, least_walk};
use crate::fit::scan::residual;
use crate::search::Search;
use crate::two_level::fit::{Coordinates, of_blocks, path};

/// Half height over the standard deviation of a block from which on a block tells its level without doubt: shorter ones do as
/// well, and fewer of them hold a switch.
const PLAIN: f64 = 4.0;
/// Variance of the level about its most probable mean, over that of the two levels, above which it is not taken off.
const LARGEST_DOUBT: f64 = 0.05;

impl Field<'_> {
    /// Shorter blocks where these tell the level without doubt, as short as the number of blocks allows; coordinates are
    /// then those of the shorter ones.
    pub(super) fn shortened(&mut self, x: &mut Coordinates) -> bool {
        let part = (x[2].exp() / PLAIN).powi(-2);
        let whole = self.rest.len().div_ceil(MOST_BLOCKS);
        let shorter = ((part * self.length as f64) as usize).max(whole).max(1);
        if self.first > 0 || shorter >= self.length {
            return false;
        }
        *x = of_blocks(x, shorter as f64 / self.length as f64);
        self.length = shorter;
        self.blocks = means(&self.rest, shorter, MOST_BLOCKS);
        self.dct = Dct::new(self.blocks.len());
        self.bins = Arc::new(Bins::new(self.blocks.len()));
        true
    }

    /// Gives the noise of a state the random walk that was found beside the two levels, and the term that stands for them
    /// their spectrum: for a process of one pole, walk and levels are much the same.
    pub(super) fn give_spectrum(&self, state: &mut State, term: usize, x: &Coordinates) {
        let blocks = (self.length as f64).ln();
        let white = state.solution.white.ln();
        let least = least_walk(self.search.panel.bins.n);
        state.noise.log_walk = (x[0] + x[1] - blocks - white).max(least);
        let of_levels = spectrum(x, blocks, white);
        let terms = state.terms.iter_mut().enumerate();
        let processes = terms.filter(|(_, t)| t.is_covariance());
        for ((i, t), (_, theta)) in processes.zip(&mut state.noise.terms) {
            if let (true, Form::Covariance(_, own)) = (i == term, &mut t.form) {
                own.clone_from(&of_levels);
                theta.clone_from(&of_levels);
            }
        }
    }

    /// The level, sample by sample; none where only a stretch was weighed, and where it is so much in doubt that taking it
    /// off would take noise off.
    pub(super) fn level(&self, state: &State, x: &Coordinates) -> Option<Vec<f64>> {
        if self.first > 0 {
            return None;
        }
        let steps_at = (x[2] + 0.5 * x[0]).exp();
        // Behind a filter neighbours are no independent witnesses of a level; means of blocks are.
        let levels = if state.terms.iter().any(Term::is_filter) {
            let of_blocks = path(&self.blocks, x);
            let at = |i: usize| of_blocks[(i / self.length).min(of_blocks.len() - 1)];
            (0..self.rest.len()).map(at).collect()
        } else {
            path(&self.rest, &of_blocks(x, 1.0 / self.length as f64))
        };
        let doubt = levels.iter().map(|l| 1.0 - (l / steps_at).powi(2));
        let doubt = doubt.sum::<f64>() / levels.len() as f64;
        (doubt < LARGEST_DOUBT).then_some(levels)
    }
}

/// Where steps are, samples.
fn places(terms: &[Term]) -> Vec<f64> {
    let place = |t: &Term| match t.form {
        Form::Step(at, _) => Some(at),
        _ => None,
    };
    terms.iter().filter_map(place).collect()
}

/// A search beside a level that is known.
pub(super) struct Beside {
    pub state: State,
    /// Number of the term that stands for the level.
    pub term: usize,
    /// What the other terms leave, by sample, the level with it.
    pub rest: Vec<f64>,
}

/// What is found once the level, for which the term of the number `term` stands, is taken off: to a search that takes it for a
/// process it is noise, in which a slope or a slow course does not show. `None` where that is nothing.
pub(super) fn beside(
    search: &Search<'_>,
    state: &State,
    term: usize,
    level: &[f64],
) -> Option<Beside> {
    let panel = &search.panel;
    let mut known = state.terms.clone();
    let own = known.remove(term);
    let (count, steps) = (known.len(), places(&known));
    let (found, mut rest) = panel.without(level, || {
        let mut found = search.ascend(search.refit(known, state.noise.log_walk));
        // Steps and processes are weighed by the likelihood of the levels: a stay on the wrong level looks like either.
        let stays = |t: &Term| {
            !contested(t)
                || places(std::slice::from_ref(t))
                    .iter()
                    .any(|s| steps.contains(s))
        };
        if !found.terms.iter().all(stays) {
            let terms = found.terms.iter().filter(|t| stays(t)).cloned().collect();
            found = search.refit(terms, found.noise.log_walk);
        }
        let rest = panel
            .dct
            .inverse(&residual(panel, &found.columns(), &found.solution));
        (found, rest)
    });
    if found.terms.len() <= count {
        return None;
    }
    rest.iter_mut().zip(level).for_each(|(r, l)| *r += l);
    let mut terms = found.terms.clone();
    let term = terms.len();
    terms.push(own);
    let mut state = search.refit(terms, found.noise.log_walk);
    // Beside the spectrum of a level a process and a random walk are hardly to be told; without it they were.
    for (theirs, (_, theta)) in found.noise.terms.iter().zip(&mut state.noise.terms) {
        theta.clone_from(&theirs.1);
    }
    for (theirs, t) in found.terms.iter().zip(&mut state.terms) {
        t.form = theirs.form.clone();
    }
    state.solution.white = found.solution.white;
    Some(Beside { state, term, rest })
}

/// The coordinates of a process of one pole with the spectrum of two levels: of their variance, over `white` (both as ln), and
/// half their dwell time long.
pub(super) fn spectrum(x: &Coordinates, blocks: f64, white: f64) -> Vec<f64> {
    let variance = 2.0 * x[2] + x[0];
    vec![variance - white, x[3] + blocks - std::f64::consts::LN_2]
}
