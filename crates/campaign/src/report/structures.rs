//! Effects in company: rates of two or three on one axis, and the table of one beside a structure.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::{count, found};
use crate::case::{Family, Outcome};
use crate::company::STRUCTURES;
use crate::tally::Rate;

/// Effects of runs of a family that were named.
pub(super) fn named(all: &[Outcome], family: Family) -> Rate {
    let own = all.iter().filter(|o| o.family == family);
    Rate::of(own.flat_map(|o| &o.truths).map(found))
}

/// Runs in which the effect that stands beside a structure was named.
pub(super) fn kept(all: &[Outcome], kinds: std::ops::Range<usize>) -> Rate {
    let own = all
        .iter()
        .filter(|o| matches!(o.family, Family::Beside(i) if kinds.contains(&i)));
    Rate::of(own.filter_map(|o| o.truths.first()).map(found))
}

const STRUCTURED: &str = "
A strong effect beside a line or a band of d' 15 to 40; 3 to 40 outliers of 5 to 7.5 sigma; noise that comes again after 2 to 40
samples, with a correlation of d' 10 to 20; a vibration of 35 % of the variance whose pitch wanders by a twentieth of its centre
(beside it one of six effects of [a measured record](real-data.md)).

| structure | effect named | not named | another cause named | structure named |
|---|---|---|---|---|
";

/// The table of one effect beside a structure.
pub(super) fn table(out: &mut String, all: &[Outcome]) {
    let _ = write!(out, "\n## Beside a structure\n{STRUCTURED}");
    for (i, kind) in STRUCTURES.iter().enumerate() {
        let own: Vec<&Outcome> = all
            .iter()
            .filter(|o| o.family == Family::Beside(i))
            .collect();
        if own.is_empty() {
            continue;
        }
        let mut lost: BTreeMap<&str, usize> = BTreeMap::new();
        let first = own.iter().filter_map(|o| o.truths.first());
        for t in first.filter(|t| !found(t)) {
            *lost.entry(t.0).or_default() += 1;
        }
        let lost: Vec<String> = lost.iter().map(|(k, n)| format!("{k} {n}")).collect();
        let itself = own.iter().filter_map(|o| o.truths.get(1)).map(found);
        let _ = writeln!(
            out,
            "| {} | {} | {} | {} | {} |",
            kind.label,
            count(kept(all, i..i + 1)),
            lost.join(", "),
            count(Rate::of(own.iter().map(|o| !o.wrong.is_empty()))),
            count(Rate::of(itself)),
        );
    }
}
