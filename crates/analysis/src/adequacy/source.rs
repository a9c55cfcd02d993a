//! What the name of a process claims of the temperature, the supply and the motor command: that it knows nothing of them.
//!
//! Noise may stand for whatever follows a recorded channel by no law of the library: a table that sticks and breaks loose, a zero
//! that firmware moves in slow turns. It wanders as a process does, and no check of its spectrum or its law sees more. But a
//! process is independent of what is recorded. Under the noise that was fitted with it, columns of each channel's past explain
//! no more than their number; here they are asked by kind, with what the library itself has of the channel taken off.

use model::effect::{Hypothesis, Signal};
use model::record::Quantity;

use super::CLAIMS;
use crate::beyond::{self, memory};
use crate::checks::{Outcome, chi_tail};
use crate::law::WIDENED;
use crate::search::{Candidate, Search, State, Term};

/// Kinds of columns, as `memory::departures` gives them.
const KINDS: [&str; 6] = [
    "by a bend or a drift",
    "late",
    "behind the heat of its size",
    "after each of its changes",
    "after each change of its size",
    "by its sense alone",
];

/// The slow channels of a record that move enough.
fn recorded<'a>(search: &'a Search<'_>) -> impl Iterator<Item = &'a Signal> {
    let least = [
        (Quantity::Temp, beyond::LEAST_TEMPERATURE),
        (Quantity::Supply, beyond::LEAST_SUPPLY),
        (Quantity::Pwm, beyond::LEAST_COMMAND),
    ];
    let moves = |(q, least)| search.view.signal(q).filter(|s| s.range() >= least);
    least.into_iter().filter_map(moves)
}

/// For each process among the terms, whether it is independent of what was recorded.
pub(crate) fn of_processes(search: &Search<'_>, state: &State) -> Vec<(&'static str, Outcome)> {
    let processes = state.terms.iter().filter(|t| is_process(t));
    let names: Vec<&'static str> = processes.map(|t| t.effect.id()).collect();
    if names.is_empty() {
        return vec![];
    }
    let asked: Vec<(String, f64, f64, usize)> = recorded(search)
        .flat_map(|signal| of_channel(search, state, signal))
        .collect();
    let chance = |(_, lr, p, _): &(String, f64, f64, usize)| (*lr, *p);
    let Some(least) = asked
        .iter()
        .min_by(|a, b| chance(a).1.total_cmp(&chance(b).1))
    else {
        return vec![];
    };
    let (how, lr, p, width) = least;
    let outcome = |id: &'static str| {
        let what = format!(
            "told as {id}, which knows nothing of what was recorded: follows {how}, {lr:.0} of chi-square in {width}"
        );
        let outcome = Outcome {
            id: CLAIMS[6],
            statistic: *lr,
            p_value: (p * asked.len() as f64).min(1.0),
            what,
        };
        (id, outcome)
    };
    names.into_iter().map(outcome).collect()
}

fn is_process(t: &Term) -> bool {
    use crate::search::Form;
    matches!(&t.form, Form::Covariance(c, _) if !c.filters_white())
}

/// What columns of each kind explain beside all that the library has of a channel: how, chi-square, its chance and degrees.
fn of_channel(
    search: &Search<'_>,
    state: &State,
    signal: &Signal,
) -> Vec<(String, f64, f64, usize)> {
    let panel = &search.panel;
    let g = state.noise.over(&panel.bins);
    let width = panel.width();
    let follows = |c: &&Candidate| match &c.hypothesis {
        Hypothesis::Regression(r) => r.follows.as_deref() == Some(signal.name.as_str()),
        _ => false,
    };
    let library = || {
        search
            .candidates
            .iter()
            .filter(|c| c.effect.id() != beyond::ID)
    };
    let ids: Vec<&str> = library().filter(follows).map(|c| c.effect.id()).collect();
    let mut own = state.columns();
    let of_it = library().filter(|c| ids.contains(&c.effect.id()));
    own.extend(of_it.flat_map(Candidate::all_columns));
    own.sort_unstable();
    own.dedup();
    let likelihood = |columns: &[usize]| panel.solve(&g, columns).log_likelihood;
    let null = likelihood(&own);
    let kinds = memory::departures(&search.view, signal);
    let asked = kinds
        .iter()
        .zip(KINDS)
        .filter(|(columns, _)| !columns.is_empty());
    let all = asked
        .map(|(columns, kind)| {
            let mut whole = own.clone();
            whole.extend(columns.iter().map(|d| panel.add(d)));
            let lr = 2.0 * (likelihood(&whole) - null);
            let degrees = columns.len();
            let p = chi_tail(lr / WIDENED, degrees as f64);
            (format!("{} {kind}", signal.name), lr, p, degrees)
        })
        .collect();
    panel.truncate(width);
    all
}
