//! The sets in which the foreign effects were written: when, by an author who knew what of the engine, and how the engine
//! did on each before any change by it. docs/power.md prints the first grades.

use std::fmt::Write as _;

use super::catalogue::EFFECTS;

/// What a campaign found of a set.
#[derive(Clone, Copy, Debug)]
pub struct Grade {
    /// Its seed.
    pub seed: u64,
    /// Runs of d' 25 and more in which something was unexplained.
    pub unexplained: u32,
    /// Runs in which a cause was named that is not there.
    pub named: u32,
    /// Runs of d' 25 and more.
    pub runs: u32,
}

/// A set of foreign effects.
#[derive(Clone, Copy, Debug)]
pub struct Set {
    /// The day on which it was written.
    pub date: &'static str,
    /// What its author had read of this project.
    pub author_knew: &'static str,
    /// Grades by the engine as it was before any change by the set; the first one first.
    pub grades: &'static [Grade],
    /// Whether the engine was developed with it or may owe something to it since.
    pub seen: bool,
    /// The wrong names that were given most often, with their number and what they were given to.
    pub wrong_names: &'static str,
}

const fn grade(seed: u64, unexplained: u32, named: u32, runs: u32) -> Grade {
    Grade {
        seed,
        unexplained,
        named,
        runs,
    }
}

/// All sets, the first one first.
pub const SETS: [Set; 14] = [
    Set {
        date: "2026-11-21",
        author_knew: "the engine: its own author",
        grades: &[grade(2_353_998_398, 35, 9, 48)],
        seen: true,
        wrong_names: "",
    },
    Set {
        date: "2026-11-21",
        author_knew: "not how the diagnosis decides",
        grades: &[grade(16_172_907_664_231, 247, 30, 276)],
        seen: true,
        wrong_names: "`gauss_markov`, `telegraph` (19): aperiodic oscillation",
    },
    Set {
        date: "2026-11-21",
        author_knew: "answers to the earlier sets",
        grades: &[grade(7_859_661_426_779_480, 208, 49, 277)],
        seen: true,
        wrong_names: "",
    },
    Set {
        date: "2026-11-21",
        author_knew: "this page, no code",
        grades: &[grade(82, 91, 23, 103)],
        seen: true,
        wrong_names: "",
    },
    Set {
        date: "2026-11-21",
        author_knew: "this page, no code",
        grades: &[grade(117_781_921_824_460, 177, 32, 200)],
        seen: true,
        wrong_names: "",
    },
    Set {
        date: "2026-11-21",
        author_knew: "this page, no code",
        grades: &[grade(173_675_865_318_449, 158, 37, 240)],
        seen: true,
        wrong_names: "",
    },
    Set {
        date: "2026-11-21",
        author_knew: "docs/effects.md, no code",
        grades: &[grade(274_881_295_748_995, 186, 32, 200)],
        seen: true,
        wrong_names: "`gauss_markov` (10): long memory",
    },
    Set {
        date: "2026-11-22",
        author_knew: "docs/effects.md, no code",
        grades: &[grade(117_566_462_272_920, 345, 52, 395)],
        seen: true,
        wrong_names: "`stale_samples` (20): backlash of the reading; `gauss_markov` (13): a loop that never settles",
    },
    Set {
        date: "2026-11-22",
        author_knew: "docs/effects.md, no code",
        grades: &[grade(15_894_898_329_322, 311, 51, 400)],
        seen: true,
        wrong_names: "`common_noise` (20): a diode between two axes",
    },
    Set {
        date: "2026-11-22",
        author_knew: "nothing; 20 drawn of 60",
        grades: &[grade(231_486_972_553_679, 359, 62, 393)],
        seen: true,
        wrong_names: "",
    },
    Set {
        date: "2026-11-22",
        author_knew: "nothing; 20 drawn of the 40 left",
        grades: &[grade(146_067_689_064_882, 384, 21, 396)],
        seen: true,
        wrong_names: "",
    },
    Set {
        date: "2026-11-22",
        author_knew: "nothing; the last 20 of these",
        grades: &[grade(12_034_569_997_386, 354, 66, 400)],
        seen: true,
        wrong_names: "a line (20): hum, draught; `gauss_markov` (13): quadrature",
    },
    Set {
        date: "2026-11-22",
        author_knew: "nothing; 20 drawn of 40",
        grades: &[
            grade(47_298_557_885_862, 374, 25, 400),
            grade(27_004_272_196_837, 361, 31, 394),
        ],
        seen: true,
        wrong_names: "",
    },
    Set {
        date: "2026-11-22",
        author_knew: "nothing; 20 drawn of 40",
        grades: &[
            grade(89_432_555_532_976, 383, 15, 400),
            grade(63_774_036_767_264, 380, 10, 394),
        ],
        seen: false,
        wrong_names: "`gauss_markov`, `warm_up` (16): a thermometer of coarse steps",
    },
];

/// How the sets are written and graded.
const RULES: &str = "\
Foreign effects are effects that the library does not have. They were written in sets, and none was diagnosed while it was written.
The first grade of a set, before any change of the engine by it, tells what to expect of unknown effects (runs of d' 25 and more);
after a change the set counts as seen. Tests hold that no effect of the library, nor two of them for a signal, explains 95 % of what
a foreign effect adds to the likelihood. A library effect that is a true part of a foreign one (the straight line through a bent
law) counts neither as right nor as wrong. Dates, seeds and near twins: `crates/campaign/src/foreign/sets.rs`.
";

/// First grades of the sets as one table.
#[must_use]
pub fn page() -> String {
    let mut out = format!(
        "{RULES}\n| set | effects | its author knew | runs | unexplained | wrong name |\n|---|---|---|---|---|---|\n"
    );
    for (i, set) in SETS.iter().enumerate() {
        let own = EFFECTS.iter().filter(|e| e.set == i + 1).count();
        let Some(first) = set.grades.first() else {
            continue;
        };
        let _ = writeln!(
            out,
            "| {} | {own} | {} | {} | {} | {} |",
            i + 1,
            set.author_knew,
            first.runs,
            share(first.unexplained, first.runs),
            share(first.named, first.runs),
        );
    }
    out
}

/// Of hits in runs.
fn share(hits: u32, runs: u32) -> String {
    let share = 100.0 * f64::from(hits) / f64::from(runs);
    format!("{share:.1} %")
}
