//! What the name of a process claims of the temperature, the supply and the motor command: that it knows nothing of them.
//!
//! Noise may stand for whatever follows a recorded channel by no law of the library: a table that sticks and breaks loose, a zero
//! that firmware moves in slow turns. It wanders as a process does, and no check of its spectrum or its law sees more. But a
//! process is independent of what is recorded. Under the noise that was fitted with it, columns of each channel's past explain
//! no more than their number; here they are asked by kind, with what the library itself has of the channel taken off.

use model::effect::{Hypothesis, Signal};
use model::record::Quantity;

use crate::features;
use crate::features::lagged::{self, Departure};
use crate::fit::channel;
use crate::fit::channel::{State, Term};
use crate::fit::score_test::Beside;
use crate::fit::threshold::WIDENED;
use crate::search::{Candidate, Search};
use crate::test_level::{CheckId, Outcome};
use numerics::tails::chi_tail;

/// What columns of one kind explain beside all that the library has of a channel.
struct Asked {
    /// Names of the channels.
    about: Vec<String>,
    how: String,
    chi_square: f64,
    degrees: usize,
    chance: f64,
}

/// The slow channels of a record that move enough.
fn recorded<'a>(search: &'a Search<'_>) -> impl Iterator<Item = &'a Signal> {
    let least = [
        (Quantity::Temp, features::LEAST_TEMPERATURE),
        (Quantity::Supply, features::LEAST_SUPPLY),
        (Quantity::Pwm, features::LEAST_COMMAND),
    ];
    let moves = |(q, least)| search.view.signal(q).filter(|s| s.range() >= least);
    least.into_iter().filter_map(moves)
}

/// For each process among the terms, whether it is independent of what was recorded.
pub(crate) fn of_processes(search: &Search<'_>, state: &State) -> Vec<(&'static str, Outcome)> {
    let processes = || state.terms.iter().filter(|t| t.is_process());
    if processes().next().is_none() {
        return vec![];
    }
    let mut asked: Vec<Asked> = recorded(search)
        .flat_map(|signal| of_channel(search, state, signal))
        .collect();
    asked.extend(of_shaking(search, state));
    let Some(most) = asked.iter().min_by(|a, b| a.chance.total_cmp(&b.chance)) else {
        return vec![];
    };
    let outcome = |t: &Term| {
        let id = t.effect.id();
        let outcome = Outcome {
            id: CheckId::ProcessSource,
            about: most.about.clone(),
            statistic: most.chi_square,
            p_value: (most.chance * asked.len() as f64).min(1.0),
            what: format!(
                "told as {id}, which knows nothing of what was recorded: follows {}, {:.0} of chi-square in {}",
                most.how, most.chi_square, most.degrees
            ),
        };
        (id, outcome)
    };
    processes().map(outcome).collect()
}

/// The kinds of columns of a channel, asked under the noise as it was fitted.
fn of_channel(search: &Search<'_>, state: &State, signal: &Signal) -> Vec<Asked> {
    let panel = &search.panel;
    let g = state.noise.over(&panel.bins);
    let follows = |c: &&Candidate| match &c.hypothesis {
        Hypothesis::Regression(r) => r.follows.as_deref() == Some(signal.name.as_str()),
        _ => false,
    };
    let candidates = || search.candidates.iter();
    let library = || candidates().filter(|c| c.effect.id() != channel::ID);
    let ids: Vec<&str> = library().filter(follows).map(|c| c.effect.id()).collect();
    let mut own = search.spanning(state);
    let of_it = library().filter(|c| ids.contains(&c.effect.id()));
    own.extend(of_it.flat_map(Candidate::all_columns));
    own.sort_unstable();
    own.dedup();
    let is_temperature = signal.quantity == Quantity::Temp;
    let waves = is_temperature.then(|| lagged::in_waves(signal));
    let departures = lagged::departures(&search.view, signal).chain(waves);
    let beside = Beside::new(panel, &g, &own);
    let names = std::slice::from_ref(&signal.name);
    let asked = departures.map(|departure| ask(&beside, names, departure));
    asked.filter(|a| a.degrees > 0).collect()
}

/// How much the accelerometers shake, asked in the same way.
fn of_shaking(search: &Search<'_>, state: &State) -> Option<Asked> {
    let panel = &search.panel;
    let g = state.noise.over(&panel.bins);
    let shaking = lagged::shaking(&search.view)?;
    let names = search.view.all(Quantity::Acc).map(|a| a.name.clone());
    let names: Vec<String> = names.collect();
    let beside = Beside::new(panel, &g, &state.columns());
    let asked = ask(&beside, &names, shaking);
    (asked.degrees > 0).then_some(asked)
}

fn ask(beside: &Beside<'_>, channels: &[String], departure: Departure<'_>) -> Asked {
    let Departure { how, columns } = departure;
    let (chi_square, degrees) = beside.gain_of(columns);
    Asked {
        about: channels.to_vec(),
        how: format!("{} {how}", channels.join(", ")),
        chi_square,
        degrees,
        chance: chi_tail(chi_square / WIDENED, degrees as f64),
    }
}
