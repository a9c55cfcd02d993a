//! Far readings, judged again by what a first search of the channel finds.
//!
//! Before the search a reading is held against white noise and a random walk. What follows a recorded signal may be farther off
//! than these reach: the first readings of a surge behind a step of the motor are its largest. Set aside they are missing where
//! the size of it is told best, so those that the model explains come back; so do the tails of a noise that Student's law
//! describes better than a normal one with a group apart. And readings that are no farther off than noise
//! reaches now and then, but too many, are set aside where nothing else makes them.

use std::collections::BTreeMap;

use super::channel;
use crate::audit::Audit;
use crate::ingest::blows::Blow;
use crate::ingest::spikes::spike_limit;
use crate::ingest::types::{Grid, Target};
use crate::ingest::wild;
use crate::search::searched::Searched;

/// Searches of a channel for readings that come back: each of them may bear out more.
const ROUNDS: usize = 3;

/// Judges the far readings of each channel at rest; `singles` are the places of those that the audit of counts set aside. Those of
/// `blows` are neither single ones nor the tails of a noise.
pub(super) fn settle(
    grid: &mut Grid,
    audited: &Audit,
    singles: &BTreeMap<String, Vec<usize>>,
    blows: &[Blow],
) {
    let single = spike_limit(grid.n);
    for i in 0..grid.targets.len() {
        if grid.targets[i].moving {
            continue;
        }
        for _ in 0..ROUNDS {
            let back = explained(grid, i, singles, (blows, single));
            if back.is_empty() {
                break;
            }
            wild::give_back(grid, i, &back);
        }
        set_aside_wild(grid, i, audited, (blows, single));
    }
}

/// Single far readings of a channel that lie within the noise of what a search finds there, or are the tails of that noise.
fn explained(
    grid: &Grid,
    channel: usize,
    singles: &BTreeMap<String, Vec<usize>>,
    (blows, single): (&[Blow], f64),
) -> Vec<usize> {
    let target = &grid.targets[channel];
    let of_counts = singles.get(&target.name);
    let far = |at: &usize| target.spikes.contains(at) || of_counts.is_some_and(|s| s.contains(at));
    if !target.aside.iter().any(|a| far(&a.0)) {
        return vec![];
    }
    let s = channel::searched(grid, target);
    let aside = aside(&s, target, blows);
    let mut read = vec![true; s.e.len()];
    target.lost.iter().for_each(|i| read[*i] = false);
    let own = s.e.iter().zip(read).filter(|(_, read)| *read);
    let all = own
        .map(|(e, _)| *e)
        .chain(aside.iter().map(|(_, size)| *size));
    let tails = wild::are_tails(all, single);
    let found = !s.state.terms.is_empty();
    let each = aside.into_iter();
    each.filter(|(at, size)| far(at) && (tails || found && size.abs() < single))
        .map(|(at, _)| at)
        .collect()
}

/// The places of the readings that are set aside, but for those of blows, and how far they lie from what a search found, in standard
/// deviations of the noise there.
fn aside(s: &Searched<'_>, target: &Target, blows: &[Blow]) -> Vec<(usize, f64)> {
    let white = s.state.solution.white.sqrt();
    let data = s.search.panel.dct.inverse(&s.search.panel.column(0));
    let law = |i: usize| s.variance.product().map_or(1.0, |v| v[i].sqrt());
    let of_blow = |at: &usize| blows.iter().any(|b| b.readings.contains(at));
    let single = target.aside.iter().filter(|(at, _)| !of_blow(at));
    single
        .map(|(at, given)| (*at, s.e[*at] + (given - data[*at]) / (white * law(*at))))
        .collect()
}

/// Sets aside wild readings that are too many rather than too far off, where a first search shows that nothing else makes them.
fn set_aside_wild(
    grid: &mut Grid,
    channel: usize,
    audited: &Audit,
    (blows, single): (&[Blow], f64),
) {
    let target = &grid.targets[channel];
    let by_counts = ["outliers", "spikes"];
    let told = by_counts
        .iter()
        .any(|id| audited.is_suppressed(id, &target.name));
    if told || !wild::suspected(grid, channel) {
        return;
    }
    let s = channel::searched(grid, target);
    let known = aside(&s, target, blows).into_iter().map(|(_, size)| size);
    let known: Vec<f64> = known.collect();
    let mut e = s.e.clone();
    target.lost.iter().for_each(|at| e[*at] = 0.0);
    let Some(limit) = wild::found(&e, &known, single) else {
        return;
    };
    let places: Vec<usize> = (0..e.len()).filter(|at| e[*at].abs() >= limit).collect();
    drop(s);
    wild::set_aside(grid, channel, &places, limit);
}
