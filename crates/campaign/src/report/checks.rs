//! What each check sees of the foreign effects, and what it alone sees.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use crate::case::{Family, Outcome};

/// Runs in which a check sees something, and those in which nothing else does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Seen {
    runs: usize,
    alone: usize,
}

fn seen(all: &[Outcome]) -> BTreeMap<&str, Seen> {
    let mut by: BTreeMap<&str, Seen> = BTreeMap::new();
    for o in (all.iter()).filter(|o| matches!(o.family, Family::Foreign(_))) {
        let ids: BTreeSet<&str> = o.checks.iter().flatten().map(String::as_str).collect();
        // An entry without a check is a term of the search that has no name.
        let alone = ids.len() == 1 && o.checks.iter().all(|of| !of.is_empty());
        for id in ids {
            let own = by.entry(id).or_default();
            own.runs += 1;
            own.alone += usize::from(alone);
        }
    }
    by
}

/// The table of the checks.
pub(super) fn table(out: &mut String, all: &[Outcome]) {
    let mut rows: Vec<(&str, Seen)> = seen(all).into_iter().collect();
    rows.sort_by_key(|(id, s)| (std::cmp::Reverse(s.runs), *id));
    let _ = writeln!(
        out,
        "\n## What each check sees of foreign effects\n\nRuns in which a check sees something that has no name, and those in which \
         no other check does. One that is never alone may be one too many: a campaign without it, of a seed that did not choose it, \
         decides.\n\n| check | runs | alone |\n|---|---|---|"
    );
    for (id, s) in rows {
        let _ = writeln!(out, "| `{id}` | {} | {} |", s.runs, s.alone);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(checks: &[&[&str]]) -> Outcome {
        let owned = |ids: &&[&str]| ids.iter().map(|id| (*id).to_owned()).collect();
        Outcome {
            family: Family::Foreign(0),
            index: 0,
            truths: vec![],
            wrong: vec![],
            unexplained: vec![],
            checks: checks.iter().map(owned).collect(),
            estimates: vec![],
            walks: [0.0; 3],
            strength: 30.0,
            seconds: 0.0,
        }
    }

    #[test]
    fn a_check_is_alone_where_neither_another_nor_a_term_of_the_search_sees_anything() {
        let all = [
            of(&[&["a"]]),
            of(&[&["a", "b"]]),
            of(&[&["b"], &[]]),
            of(&[&["a"], &["a"]]),
        ];
        let found = seen(&all);
        assert_eq!(found["a"], Seen { runs: 3, alone: 2 });
        assert_eq!(found["b"], Seen { runs: 2, alone: 0 });
    }
}
