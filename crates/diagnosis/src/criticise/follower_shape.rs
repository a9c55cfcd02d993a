//! What the name of an effect that follows a recorded channel claims, held against the record.
//!
//! The library says that the rate follows the channel in one shape: in proportion and at once, or as it states. Where the
//! truth follows the same channel by another law (late, by its changes alone, bent, less and less), the library's shape
//! takes the part of it that lies along it and is named for that part. Here the term is asked alone: do departures from
//! its shape, made of the same channel, explain more? A shape that is off by a part e of its size leaves e^2 of what it
//! explains to them.

use std::collections::BTreeSet;

use model::effect::Hypothesis;

use crate::criticise::process::independence;
use crate::features::lagged;
use crate::fit::channel;
use crate::fit::channel::{Form, State, Term};
use crate::fit::likelihood::Noise;
use crate::fit::score_test::Beside;
use crate::fit::threshold::WIDENED;
use crate::search::{Candidate, Search};
use crate::test_level::{CheckId, DEPARTURE, Outcome};
use numerics::tails::{chi_tail, normal_tail};

/// For each effect that follows a channel, whether its law holds.
pub(crate) fn of_followers(search: &Search<'_>, state: &State) -> Vec<(&'static str, Outcome)> {
    let of_library = |t: &&Term| t.effect.id() != channel::ID;
    let follows = |t: &Term| Some((t.effect.id(), search.followed(t)?.to_owned()));
    let named = state.terms.iter().filter(of_library);
    let followed: BTreeSet<(&'static str, String)> = named.filter_map(follows).collect();
    // Under the noise as it was fitted: few coefficients tell the random walk, and slow departures could be traded for it.
    let g = state.noise.over(&search.panel.bins);
    let mut all = vec![];
    for (effect, name) in &followed {
        let effect = *effect;
        let Some(signal) = search.view.signals.iter().find(|s| s.name == *name) else {
            continue;
        };
        let departures = lagged::departures(&search.view, signal);
        // What the library has of the effect, and of one that extends it, is no departure; nor is a lag beside a lag.
        let whole = |h: &Hypothesis| matches!(h, Hypothesis::Shaped(s) if s.whole());
        let mut own = state.terms.iter().filter(|t| t.effect.id() == effect);
        let lags = own.any(|t| matches!(&t.form, Form::Shaped(s, _) if s.whole()));
        let of_it = search
            .candidates
            .iter()
            .filter(|c| c.effect.id() == effect || c.effect.extends() == Some(effect))
            .filter(|c| lags || !whole(&c.hypothesis));
        let own = state.columns();
        // What its terms explain together: of several that share it, each alone has little.
        let without = state.terms.iter().filter(|t| t.effect.id() != effect);
        let rest: Vec<usize> = without.flat_map(|t| t.columns.iter().copied()).collect();
        let likelihood = |columns: &[usize]| search.panel.solve(&g, columns).log_likelihood;
        let explained = 2.0 * (likelihood(&own) - likelihood(&rest));
        let mut own = search.spanning(state);
        own.extend(of_it.flat_map(Candidate::all_columns));
        let beside = Beside::new(&search.panel, &g, &own);
        let (lr, degrees) = beside.gain_of(departures.flat_map(|d| d.columns));
        let p_value = if lr < DEPARTURE * explained {
            1.0
        } else {
            chi_tail(lr / WIDENED, degrees as f64)
        };
        all.push((
            effect,
            Outcome {
                id: CheckId::FollowerLaw,
                about: vec![(*name).to_owned()],
                statistic: lr,
                p_value,
                what: format!(
                    "told as {effect}: what is late, bent or drifts in its dependence on {name} explains {:.0} % of what it does",
                    100.0 * lr / explained
                ),
            },
        ));
    }
    all.extend(state.terms.iter().filter_map(|t| in_proportion(state, t)));
    all.extend(independence::of_processes(search, state));
    all
}

/// Whether the coefficients of a term of which the library says that they are parts of others are no more than that.
fn in_proportion(state: &State, term: &Term) -> Option<(&'static str, Outcome)> {
    let id = term.effect.id();
    if state.terms.iter().any(Term::is_filter) {
        return None;
    }
    let columns = state.terms.iter().flat_map(|t| {
        let name = move |i| t.names.get(i).filter(|_| t.effect.id() == id);
        (0..t.columns.len()).map(name)
    });
    let columns: Vec<Option<&&str>> = columns.collect();
    let place = |name: &str| columns.iter().position(|c| c.is_some_and(|c| *c == name));
    let s = &state.solution;
    let beyond = |name: &str| {
        let (whole, part) = term.effect.at_most(name)?;
        let own = place(name)?;
        let error = |variance: f64| (s.white * variance).sqrt();
        Some(match place(whole) {
            Some(of) => {
                let part = part * (s.beta[own] * s.beta[of]).signum();
                let covariance = s.inverse[own][own] - 2.0 * part * s.inverse[own][of]
                    + part * part * s.inverse[of][of];
                (s.beta[own] - part * s.beta[of]) * s.beta[own].signum() / error(covariance)
            }
            None => s.beta[own].abs() / error(s.inverse[own][own]),
        })
    };
    let asked = term.names.iter().filter_map(|n| Some((*n, beyond(n)?)));
    let (name, most) = asked.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let chance = term.names.len() as f64 * normal_tail(most.max(0.0));
    Some((
        id,
        Outcome {
            id: CheckId::FollowerLaw,
            // What is told late is the part of a channel that is told at once by its name.
            about: term
                .effect
                .at_most(name)
                .into_iter()
                .map(|(whole, _)| whole.to_owned())
                .collect(),
            statistic: most,
            p_value: chance.min(1.0),
            what: format!(
                "told as {id}: {name} is larger than it can be by {most:.1} standard errors"
            ),
        },
    ))
}

/// Whether a term keeps most of what it explains, and enough to be named, where an effect beside it that follows a channel
/// may depart from its shape. Of one that a contest weighed by other means, most of what its spectrum explains.
pub(crate) fn holds_beside(search: &Search<'_>, state: &State, term: &Term, effect: &str) -> bool {
    let of_it = state.terms.iter().filter(|t| t.effect.id() == effect);
    let mut names: Vec<&str> = of_it.filter_map(|t| search.followed(t)).collect();
    names.dedup();
    let signals = search.view.signals.iter();
    let departures = signals
        .filter(|s| names.contains(&s.name.as_str()))
        .flat_map(|s| lagged::departures(&search.view, s))
        .flat_map(|d| d.columns);
    let width = search.panel.width();
    let added = search.panel.add_all(departures);
    let explained = |beside: &[usize]| {
        2.0 * (likelihood(search, state, beside, None)
            - likelihood(search, state, beside, Some(term)))
    };
    let before = match term.stated {
        Some(_) => explained(&[]),
        None => term.lr,
    };
    let lr = explained(&added);
    search.panel.truncate(width);
    lr > term.threshold.max(0.5 * before)
}

/// Log likelihood of a state beside some columns, without a term where one is `left_out`.
fn likelihood(
    search: &Search<'_>,
    state: &State,
    beside: &[usize],
    left_out: Option<&Term>,
) -> f64 {
    let mut noise = Noise::new(state.noise.log_walk);
    let mut fitted = state.noise.terms.iter();
    let mut columns = beside.to_vec();
    for t in &state.terms {
        let covariance = match t.form {
            Form::Covariance(..) => fitted.next(),
            _ => None,
        };
        if !left_out.is_some_and(|l| std::ptr::eq(l, t)) {
            noise.terms.extend(covariance.cloned());
            columns.extend(&t.columns);
        }
    }
    search.panel.fit(&noise, &columns).1.log_likelihood
}
