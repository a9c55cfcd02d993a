//! What follows recorded channels as no effect of the library does, over time; noise that comes again, by its spectrum.

use super::{is_course, of_terms};
use crate::fit::channel::Term;
use crate::ingest::types::Grid;
use crate::result::Evidence;
use crate::search::searched::Searched;

/// The figures of the terms of a channel that have no name.
pub(super) fn all(s: &Searched<'_>, grid: &Grid) -> Vec<Evidence> {
    let mut all = of_combinations(s, grid);
    let echoes = s.state.terms.iter().filter(|t| t.lag().is_some());
    all.extend(echoes.map(|term| {
        let name = &s.target.name;
        Evidence {
            cause: Evidence::WITHOUT_A_NAME.to_owned(),
            title: format!("{name}: noise that comes again"),
            caption: "Spectrum of the rate with the model before and after: it swings with the frequency.".into(),
            ..of_terms(s, grid, &[term])
        }
    }));
    all
}

/// A figure for each channel, or each few of them, that combinations follow: with all that follows the same, since of several
/// laws of one channel one may cancel another. One law of a channel is no line over it where it has a memory, so that all are seen
/// over time.
fn of_combinations(s: &Searched<'_>, grid: &Grid) -> Vec<Evidence> {
    let terms = &s.state.terms;
    let combinations: Vec<&Term> = terms.iter().filter(|t| t.is_combination()).collect();
    let first_of_its_kind = |i: usize| {
        let before = &combinations[..i];
        before.iter().all(|b| b.of != combinations[i].of)
    };
    let firsts = (0..combinations.len()).filter(|i| first_of_its_kind(*i));
    firsts
        .map(|i| {
            let first = combinations[i];
            let follows = |t: &&Term| {
                let same = !std::ptr::eq(*t, first) && s.search.sources(t) == first.of;
                same && is_course(t)
            };
            let all: Vec<&Term> = [first]
                .into_iter()
                .chain(terms.iter().filter(follows))
                .collect();
            let name = &s.target.name;
            Evidence {
                cause: Evidence::WITHOUT_A_NAME.to_owned(),
                title: format!("{name}: follows {}", first.of.join(" and ")),
                ..of_terms(s, grid, &all)
            }
        })
        .collect()
}
