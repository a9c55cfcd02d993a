//! One channel from its readings to a searched one: baseline, search, checks.

use std::sync::Arc;

use model::effect::View;

use crate::criticise::variance_law::Untold;
use crate::criticise::{
    follower_shape, process, random_walk, residual, short_time, step_time, variance_law,
};
use crate::fit::channel::{State, VarianceLaws, whitened};
use crate::fit::estimate;
use crate::fit::likelihood::{Noise, Panel};
use crate::ingest::types::{Grid, Target};
use crate::joint;
use crate::report::detection_limits;
use crate::result::Check;
use crate::search::searched::Searched;
use crate::search::tracked::{Rotor, rotors};
use crate::search::{Search, bands, impute};
use crate::test_level::{self, CheckId, Outcome, all_worded, omnibus_level, worded};
use crate::two_level::compare;

/// Half the mean square of the change from one sample to the next.
fn mean_square_step(y: &[f64]) -> f64 {
    let steps = y.windows(2).map(|w| (w[1] - w[0]).powi(2));
    steps.sum::<f64>() / (2 * y.len()) as f64
}

/// The search of a channel, its hypotheses laid out.
fn laid_out<'a>(grid: &'a Grid, target: &'a Target) -> Search<'a> {
    let coefficients = &target.coefficients;
    let bins = match bands::peaks(coefficients, &target.noise, target.white, &grid.bins) {
        none if none.is_empty() => Arc::clone(&grid.bins),
        peaks => Arc::new(grid.bins.finer_about(&peaks)),
    };
    let panel = Panel::of(&grid.dct, &bins, Arc::clone(coefficients));
    let view = View {
        channel: &target.name,
        axis: target.axis,
        lsb: target.lsb,
        white_sigma: target.white.sqrt(),
        neighbours_sigma: mean_square_step(&target.y).sqrt(),
        rate_hz: grid.rate_hz,
        samples: grid.n,
        base: grid.base,
        moving: target.moving,
        signals: &grid.signals,
    };
    let mut search = Search::new(panel, view, grid.bursts.is_some());
    // No later channel has more in common with others.
    grid.dct.keep_no_more();
    search.read = 1.0 - target.lost.len() as f64 / grid.n as f64;
    search
}

/// Coefficients and samples of a residual.
type Whitened = (Vec<f64>, Vec<f64>);

/// The checks of the residual of the baseline.
fn plain_checks((u, e): &Whitened, baseline: &State, grid: &Grid, target: &Target) -> Vec<Outcome> {
    let step = target.step / baseline.solution.white.sqrt();
    residual::all(u, e, grid.rate_hz, step)
}

/// Searches all channels, two at a time: their columns in common are those of the first. Of readings that lie `between` others
/// the spectrum has no kind, and is there before anything is sought beside it.
pub(super) fn all_searched(grid: &Grid, between: bool) -> Vec<Searched<'_>> {
    let Some(target) = grid.targets.first() else {
        return vec![];
    };
    let first = std::iter::once(Some(laid_out(grid, target)));
    let laid = first.chain(std::iter::repeat_with(|| None));
    let alone = test_level::on_two_threads(grid.targets.iter().zip(laid), |(target, laid)| {
        let laid = laid.unwrap_or_else(|| laid_out(grid, target));
        searched_from(grid, target, laid, between, (0, &[]))
    });
    beside_rotors(grid, alone, between)
}

/// Searches those channels again that have a part of a rotor: what shakes a stand is felt by all, and told best by all together.
fn beside_rotors<'a>(grid: &'a Grid, alone: Vec<Searched<'a>>, between: bool) -> Vec<Searched<'a>> {
    let rotors = rotors(grid, &alone);
    test_level::on_two_threads(alone.into_iter().enumerate(), |(k, s)| {
        match rotors.iter().any(|r| r.is_on(k)) {
            true => searched_from(
                grid,
                s.target,
                laid_out(grid, s.target),
                between,
                (k, &rotors),
            ),
            false => s,
        }
    })
}

/// How well the best model of a channel explains it: twice its log likelihood beyond what its terms have to; and how much better than
/// with a random walk of `log_walk`, the logarithm of its step variance over the white one, where it has a smaller one.
pub(super) fn best(grid: &Grid, target: &Target, log_walk: f64) -> (f64, f64) {
    let search = laid_out(grid, target);
    let baseline = search.baseline(&target.noise);
    let found = search.beside_any_spectrum(search.ascend(baseline.clone()));
    let best = search.beside_a_stretch(found, &baseline);
    let walking = Noise {
        log_walk: best.noise.log_walk.max(log_walk),
        terms: best.noise.terms.clone(),
    };
    let panel = &search.panel;
    let other = panel.solve(&walking.over(&panel.bins), &best.columns());
    let lost = best.solution.log_likelihood - other.log_likelihood;
    (search.total_beside_a_stretch(&best), 2.0 * lost)
}

/// Searches a channel, and asks its model and what that leaves.
pub(super) fn searched<'a>(grid: &'a Grid, target: &'a Target) -> Searched<'a> {
    searched_from(grid, target, laid_out(grid, target), false, (0, &[]))
}

fn searched_from<'a>(
    grid: &'a Grid,
    target: &'a Target,
    search: Search<'a>,
    between: bool,
    (number, rotors): (usize, &[Rotor]),
) -> Searched<'a> {
    let baseline = search.baseline(&target.noise);
    let mut plain = whitened(&search.panel, &baseline);
    let mut before = plain_checks(&plain, &baseline, grid, target);
    let explained = || {
        let baseline = search.baseline(&target.noise);
        let ascended = if between {
            search.ascend(search.beside_any_spectrum(baseline.clone()))
        } else {
            search.beside_any_spectrum(search.ascend(baseline.clone()))
        };
        compare::hold(&search, search.beside_a_stretch(ascended, &baseline))
    };
    let explained = search.beside_tracked_tones(explained(), number, rotors, &explained);
    let mut state = search.conclude(explained);
    let refilled = impute::again(&search, &state, target);
    if let Some(refilled) = refilled.clone() {
        state = refilled;
        if state.terms.is_empty() {
            plain = whitened(&search.panel, &state);
            before = plain_checks(&plain, &baseline, grid, target);
        }
    }
    let told = refilled.map(|s| impute::told(&search, &s, &target.lost));
    let found = estimate::found(&search.panel, &state, &target.unit, grid.rate_hz);
    let (u, e) = if state.terms.is_empty() {
        plain
    } else {
        drop(plain);
        whitened(&search.panel, &state)
    };
    let mut s = Searched {
        target,
        search,
        baseline,
        state,
        found,
        e,
        u,
        told,
        checks: vec![],
        variance: VarianceLaws::default(),
        joint: None,
        limits: vec![],
        laws: vec![],
    };
    s.limits = detection_limits::of_channel(&s);
    s.laws = follower_shape::of_followers(&s.search, &s.state);
    s.state.notes = all_worded(s.state.notes);
    for (_, outcome) in &mut s.laws {
        *outcome = worded(outcome.clone());
    }
    s.search.panel.release(&s.state.columns());
    if !target.moving {
        s.variance = variance_law::found(&s);
    }
    estimate_under_law(&mut s, grid);
    estimate_over_time(&mut s, grid);
    step_time::settle(&mut s);
    s.checks = channel_checks(&s, before);
    s
}

/// Everything that was found, estimated anew under the laws of the variance where there are any, and the residual by them.
fn estimate_under_law(s: &mut Searched<'_>, grid: &Grid) {
    let mut laws = std::mem::take(&mut s.variance);
    if laws.is_empty() {
        return;
    }
    let untold = variance_law::settle(s, &mut laws, &s.e);
    s.joint = joint::estimate(s, &laws.each, grid.bursts.as_ref());
    for Untold { of, mut shape } in untold {
        std::mem::swap(&mut laws.each[of].shape, &mut shape);
        let other = joint::estimate(s, &laws.each, grid.bursts.as_ref());
        std::mem::swap(&mut laws.each[of].shape, &mut shape);
        if let (Some(joint), Some(other)) = (&mut s.joint, other) {
            joint.reach(&other);
        }
    }
    if let Some(joint) = &s.joint {
        s.found.clone_from(&joint.found);
        for (v, told) in laws.each.iter_mut().zip(&joint.laws) {
            v.found.coefficients = vec![*told];
            v.parameters = v.effect.describe(&v.found);
        }
    }
    laws.divide(&mut s.e);
    if let Some(joint) = s.joint.as_ref().filter(|_| laws.are_loud()) {
        // What is whitened by a spectrum is not white where the noise is another one; by the filter it is.
        let own = s.e.iter_mut().zip(&joint.innovations);
        own.filter(|(_, own)| own.is_finite())
            .for_each(|(e, own)| *e = *own);
        s.u = s.search.panel.dct.forward(&s.e);
        s.u[0] = 0.0;
    }
    s.variance = laws;
}

/// Everything that was found in bursts laid end to end, estimated anew by the time that passed between them: a slope over a
/// course that goes on there is known as well as the walk lets it be.
fn estimate_over_time(s: &mut Searched<'_>, grid: &Grid) {
    if !s.variance.is_empty() || grid.bursts.is_none() {
        return;
    }
    s.joint = joint::estimate(s, &[], grid.bursts.as_ref());
    if let Some(joint) = &s.joint {
        s.found.clone_from(&joint.found);
    }
}

/// Checks of a normal distribution. Of a noise that has another one by its name, the replicates say whether it is that.
const OF_NORMAL: [CheckId; 2] = [CheckId::Kurtosis, CheckId::Neighbours];

/// All checks of a channel, those of the residual `before` the extension beside those after it.
fn channel_checks(s: &Searched<'_>, before: Vec<Outcome>) -> Vec<Check> {
    let after = if s.state.terms.is_empty() && s.variance.is_empty() {
        before.clone()
    } else {
        residual::all(&s.u, &s.e, s.search.view.rate_hz, s.step())
    };
    let normal = s.state.is_normal();
    let rhythm = after
        .iter()
        .find(|c| c.id == CheckId::VarianceRhythm)
        .cloned();
    before
        .into_iter()
        .zip(after)
        .map(|(b, a)| Check {
            id: b.id.into(),
            about: a.about,
            channel: s.target.name.clone(),
            statistic: b.statistic,
            p_value: Some(b.p_value),
            threshold: omnibus_level(),
            fails_before: b.p_value < omnibus_level(),
            // A base that moves is told as an input; what it leaves in the residual is no riddle.
            fails_after: a.p_value < omnibus_level()
                && !s.target.moving
                && !s.search.view.sways()
                && (normal || !OF_NORMAL.contains(&a.id)),
            what: if a.p_value < omnibus_level() {
                a.what
            } else {
                b.what
            },
        })
        .chain(claims(s, rhythm.as_ref()))
        .chain(short_time::checks(s))
        .chain(random_walk::check(s))
        .map(worded)
        .collect()
}

/// What the names on a channel claim; `rhythm` is the check for a rhythm of the variance.
fn claims(s: &Searched<'_>, rhythm: Option<&Outcome>) -> Vec<Check> {
    // Before a process was named nothing was claimed of it.
    let claims = process::of_processes(&s.search, &s.state, s.variance.product());
    let stationary = rhythm.and_then(|r| process::stationary(s, r));
    let claims = claims.into_iter().chain(stationary);
    let laws = s.laws.iter().map(|(_, outcome)| outcome.clone());
    let laws = laws.chain(variance_law::claims(s));
    let all = claims.chain(laws);
    all.map(|c| Check {
        id: c.id.into(),
        about: c.about,
        channel: s.target.name.clone(),
        statistic: c.statistic,
        p_value: Some(c.p_value),
        threshold: c.id.level(),
        fails_before: false,
        fails_after: c.p_value < c.id.level(),
        what: c.what,
    })
    .collect()
}
