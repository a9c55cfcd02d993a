//! Effects in company: tables of pairs, of two or three on one axis, and of one beside a structure.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::percent;
use crate::case::{Family, Hit, Outcome};
use crate::company::STRUCTURES;
use crate::plant::BY_STRENGTH;
use crate::tally::Rate;

fn found(t: &(&str, f64, Hit)) -> bool {
    t.2 != Hit::Missed
}

/// The table of each effect in runs of a family.
fn table(out: &mut String, title: &str, all: &[Outcome], family: Family) {
    let _ = writeln!(
        out,
        "\n## {title}\n\n| effect, beside any other | named | runs wholly right |\n|---|---|---|"
    );
    for label in BY_STRENGTH {
        let own: Vec<&Outcome> = all
            .iter()
            .filter(|o| o.family == family && o.truths.iter().any(|t| t.0 == label))
            .collect();
        if own.is_empty() {
            continue;
        }
        let hits = own.iter().flat_map(|o| &o.truths).filter(|t| t.0 == label);
        let _ = writeln!(
            out,
            "| {label} | {} | {} |",
            percent(Rate::of(hits.map(found))),
            percent(Rate::of(own.iter().map(|o| o.right())))
        );
    }
}

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
A line or a band of d' 15 to 40; 3 to 40 outliers of 5 to 7.5 sigma; noise that comes again after 2 to 40 samples, the correlation
there of d' 10 to 20; a vibration of 35 % of the variance whose pitch wanders by a twentieth of its centre, beside it one of six
effects as on the measured record (docs/real-data.md). The strength of the effect is that beside the structure.

| structure | effect kept | not kept | another cause named | the structure named |
|---|---|---|---|---|
";

fn structures(out: &mut String, all: &[Outcome]) {
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
            percent(kept(all, i..i + 1)),
            lost.join(", "),
            percent(Rate::of(own.iter().map(|o| !o.wrong.is_empty()))),
            percent(Rate::of(itself)),
        );
    }
}

/// All of them.
pub(super) fn tables(out: &mut String, all: &[Outcome]) {
    table(out, "Two effects", all, Family::Pair);
    table(
        out,
        "Two or three effects on one axis",
        all,
        Family::OneAxis,
    );
    structures(out, all);
}
