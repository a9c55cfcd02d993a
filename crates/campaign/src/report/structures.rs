//! Effects in company: rates of two or three on one axis, and the table of one beside a structure.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::{found, of, unexplained_and_wrong};
use crate::case::{Family, Outcome};
use crate::company::STRUCTURES;
use crate::tally::Rate;

/// Effects of runs of a family that were named.
pub(super) fn named(all: &[Outcome], family: Family) -> Rate {
    Rate::of(of(all, family).flat_map(|o| &o.truths).map(found))
}

/// Runs in which the effect that stands beside a structure was named.
pub(super) fn kept(all: &[Outcome], kinds: std::ops::Range<usize>) -> Rate {
    let own = kinds.flat_map(|i| of(all, Family::Beside(i)));
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
        let own = of(all, Family::Beside(i));
        if own.clone().next().is_none() {
            continue;
        }
        let mut lost: BTreeMap<&str, usize> = BTreeMap::new();
        let first = own.clone().filter_map(|o| o.truths.first());
        for t in first.filter(|t| !found(t)) {
            *lost.entry(t.0).or_default() += 1;
        }
        let lost: Vec<String> = lost.iter().map(|(k, n)| format!("{k} {n}")).collect();
        let (label, lost, named) = (kind.label, lost.join(", "), kept(all, i..i + 1));
        let [_, wrong] = unexplained_and_wrong(own.clone());
        let itself = Rate::of(own.filter_map(|o| o.truths.get(1)).map(found));
        let _ = writeln!(out, "| {label} | {named} | {lost} | {wrong} | {itself} |");
    }
}
