//! Two levels so far apart that each reading tells on which of them it lies: nothing is in doubt but whether they are a process.
//!
//! Means over blocks, by which levels in the noise are weighed, would only hide them: a block in which such levels switch reads
//! what neither level nor noise does.

use std::sync::Arc;

use model::effect::{Covariance, Effect};

use super::level::spectrum;
use super::{MARGIN, dwell_times};
use crate::fit::channel::{Form, State, Term};
use crate::fit::likelihood::Noise;
use crate::fit::scan::residual;
use crate::fit::threshold;
use crate::ingest::jumps::TwoLevels;
use crate::search::Search;

/// The state with two levels in the place of what was contested, where readings are plainly on one or the other and that is the better
/// explanation; `kept` are the others. The levels' term is of candidate number `at`, and has the spectrum of `process`.
pub(super) fn hold(
    search: &Search<'_>,
    state: &State,
    kept: &[Term],
    (at, effect): (usize, &'static dyn Effect),
    process: Option<Arc<dyn Covariance>>,
) -> Option<State> {
    if search.view.moving || search.view.sways() {
        return None;
    }
    let (process, panel) = (process?, &search.panel);
    let kept = search.refit(kept.to_vec(), state.noise.log_walk);
    let rest = residual(panel, &kept.columns(), &kept.solution);
    let rest = panel.dct.inverse(&rest);
    let two = TwoLevels::of(&rest, search.view.lsb.unwrap_or(0.0))?;
    let (half, error) = half_height(search, &kept, &two);
    let level = two.level(half);
    // What is beside them is sought anew: what was found with them in the data was found in what they make of it.
    let found = panel.without(&level, || {
        search.beside_any_spectrum(search.ascend(search.baseline(&state.noise)))
    });
    let (n, count) = (rest.len() as f64, two.switches() as f64);
    let dwell = n / count;
    // Of exponential stays, in readings.
    let of_stays = count * (dwell.ln() + 1.0);
    let ahead = 0.5 * (Search::total(&found) - Search::total(state)) - of_stays;
    if ahead <= MARGIN {
        return None;
    }
    let white = found.solution.white;
    let theta = spectrum(
        &[white.ln(), 0.0, (half / white.sqrt()).ln(), dwell.ln()],
        0.0,
        white.ln(),
    );
    let mut own = Term::new(
        effect,
        at,
        Form::Covariance(process, theta.clone()),
        threshold::two_level(),
    );
    let rate_hz = search.view.rate_hz;
    own.lr = 2.0 * (ahead - MARGIN) + own.threshold;
    own.stated = Some(vec![
        (half, error),
        (dwell / rate_hz, dwell / rate_hz / count.sqrt()),
    ]);
    own.claims
        .extend(dwell_times::of_stays(&two.upper, 1.0 / rate_hz));
    Some(with_levels(search, found, own, level))
}

/// Half the distance of two levels beside white noise and a random walk, with its standard error. One of the readings on either
/// side of a switch may be a mean over both levels: they tell of the levels by a column of their own.
fn half_height(search: &Search<'_>, kept: &State, two: &TwoLevels) -> (f64, f64) {
    let panel = &search.panel;
    let mut inside = two.level(1.0);
    let mut beside = vec![0.0; inside.len()];
    for k in two.beside_switches() {
        (beside[k], inside[k]) = (beside[k] + inside[k], 0.0);
    }
    let mut columns = kept.columns();
    let own = columns.len();
    columns.extend([panel.add(&inside), panel.add(&beside)]);
    let (_, solution) = panel.fit(&Noise::new(kept.noise.log_walk.min(-12.0)), &columns);
    let variance = solution.white * solution.inverse[own][own];
    (solution.beta[own], variance.sqrt())
}

/// The state of the data without their levels, and the term that stands for these.
fn with_levels(search: &Search<'_>, found: State, own: Term, level: Vec<f64>) -> State {
    let mut terms = found.terms.clone();
    terms.push(own);
    let forms: Vec<Form> = terms.iter().map(|t| t.form.clone()).collect();
    let mut state = search.refit(terms, found.noise.log_walk);
    // Beside their spectrum a process and a random walk are hardly to be told; without them they were.
    for (form, t) in forms.into_iter().zip(&mut state.terms) {
        t.form = form;
    }
    let thetas = state.terms.iter().filter_map(|t| match &t.form {
        Form::Covariance(_, theta) => Some(theta.clone()),
        _ => None,
    });
    let thetas: Vec<Vec<f64>> = thetas.collect();
    for (own, (_, theta)) in thetas.into_iter().zip(&mut state.noise.terms) {
        *theta = own;
    }
    state.noise.log_walk = found.noise.log_walk;
    state.solution.white = found.solution.white;
    state.notes = found.notes;
    state.level = Some(Arc::new(level));
    state
}
