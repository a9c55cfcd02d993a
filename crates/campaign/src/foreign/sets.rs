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

const fn set(date: &'static str, author_knew: &'static str, grades: &'static [Grade]) -> Set {
    Set {
        date,
        author_knew,
        grades,
        wrong_names: "",
    }
}

impl Set {
    const fn wrong(mut self, wrong_names: &'static str) -> Self {
        self.wrong_names = wrong_names;
        self
    }
}

const PAGE: &str = "docs/power.md, no code";
const EFFECTS_PAGE: &str = "docs/effects.md, no code";
const NOTHING: &str = "nothing; 20 drawn of 40";

/// All sets, the first one first.
#[rustfmt::skip]
pub const SETS: [Set; 17] = [
    set("2026-11-21", "the engine: its own author", &[grade(2_353_998_398, 35, 9, 48)]),
    set("2026-11-21", "not how the diagnosis decides", &[grade(16_172_907_664_231, 247, 30, 276)])
        .wrong("`gauss_markov`, `telegraph` (19): aperiodic oscillation"),
    set("2026-11-21", "answers to the earlier sets", &[grade(7_859_661_426_779_480, 208, 49, 277)]),
    set("2026-11-21", PAGE, &[grade(82, 91, 23, 103)]),
    set("2026-11-21", PAGE, &[grade(117_781_921_824_460, 177, 32, 200)]),
    set("2026-11-21", PAGE, &[grade(173_675_865_318_449, 158, 37, 240)]),
    set("2026-11-21", EFFECTS_PAGE, &[grade(274_881_295_748_995, 186, 32, 200)])
        .wrong("`gauss_markov` (10): long memory"),
    set("2026-11-22", EFFECTS_PAGE, &[grade(117_566_462_272_920, 345, 52, 395)])
        .wrong("`stale_samples` (20): backlash of the reading; `gauss_markov` (13): a loop that never settles"),
    set("2026-11-22", EFFECTS_PAGE, &[grade(15_894_898_329_322, 311, 51, 400)])
        .wrong("`common_noise` (20): a diode between two axes"),
    set("2026-11-22", "nothing; 20 drawn of 60", &[grade(231_486_972_553_679, 359, 62, 393)]),
    set("2026-11-22", "nothing; 20 drawn of the 40 left", &[grade(146_067_689_064_882, 384, 21, 396)]),
    set("2026-11-22", "nothing; the last 20 of these", &[grade(12_034_569_997_386, 354, 66, 400)])
        .wrong("a line (20): hum, draught; `gauss_markov` (13): quadrature"),
    set("2026-11-22", NOTHING, &[grade(47_298_557_885_862, 374, 25, 400), grade(27_004_272_196_837, 361, 31, 394)]),
    set("2026-11-22", NOTHING, &[grade(89_432_555_532_976, 383, 15, 400), grade(63_774_036_767_264, 380, 10, 394)])
        .wrong("`gauss_markov`, `warm_up` (16): a thermometer of coarse steps"),
    set("2026-11-25", "docs/power.md, docs/effects.md, the earlier sets", &[grade(1_795_571_875, 309, 31, 390)])
        .wrong("`line` (13): blocks that come out sorted"),
    set("2026-11-25", "docs/effects.md, docs/power.md, the earlier sets; no code of the engine", &[grade(1_795_651_529, 121, 30, 160)])
        .wrong("`line` and `gauss_markov` (9): a plate that a sway helps over; `wandering_line` (8): a tone sampled later"),
    set("2026-11-26", "the catalogue, docs/effects.md; no code of the engine", &[grade(1_795_679_091, 113, 16, 144)])
        .wrong("`quantization_noise` (11): blocks packed by a cosine transform; `gauss_markov` (3): a peak that a command clears, the ring of an edge"),
];

/// How the sets are written and graded.
const RULES: &str = "\
Foreign effects are effects that the library does not have. They were written in sets, and none was diagnosed while it was written.
The first grade of a set, before any change of the engine by it, tells what to expect of unknown effects. Tests hold that no effect of the library, nor two of them for a signal, explains 95 % of what a foreign effect adds to the
likelihood. A library effect that is a true part of a foreign one (the straight line through a bent law) counts neither as right nor as
wrong. Dates, authors, seeds and near twins: `crates/campaign/src/foreign/sets.rs`.
The failures of each set were read after its first grade. What a campaign measures of all sets is therefore no longer what to expect
of unknown effects: that is the first grade of the latest one.
";

/// The latest set, counted from 1, and its first grade.
#[must_use]
pub fn latest() -> Option<(usize, Grade)> {
    let mut graded = SETS.iter().enumerate().rev();
    graded.find_map(|(i, s)| Some((i + 1, *s.grades.first()?)))
}

/// First grades: of the latest set, and of the others together.
#[must_use]
pub fn page() -> String {
    let mut out = format!(
        "{RULES}\n| first grade, d' 25 and more | effects | runs | unexplained | wrong name |\n|---|---|---|---|---|\n"
    );
    let effects = |set: usize| EFFECTS.iter().filter(|e| e.set == set).count();
    let mut row = |label: String, effects: usize, of: &[Grade]| {
        let sum = |number: fn(&Grade) -> u32| of.iter().map(number).sum::<u32>();
        let runs = sum(|g| g.runs);
        let share = |hits: u32| 100.0 * f64::from(hits) / f64::from(runs.max(1));
        let (told, named) = (share(sum(|g| g.unexplained)), share(sum(|g| g.named)));
        let _ = writeln!(
            out,
            "| {label} | {effects} | {runs} | {told:.1} % | {named:.1} % |"
        );
    };
    if let Some((latest, own)) = latest() {
        let earlier = SETS.iter().take(latest - 1);
        let first: Vec<Grade> = earlier.filter_map(|s| s.grades.first().copied()).collect();
        let all = (1..latest).map(effects).sum();
        row(format!("sets 1 to {}", latest - 1), all, &first);
        row(format!("set {latest}"), effects(latest), &[own]);
    }
    out
}
