//! Bars: what is asked of the diagnosis, and what was measured.

use std::fmt::Write as _;

use super::structures::{kept, named};
use super::{alarms, covers, estimates, of, percent, strong, unexplained_and_wrong};
use crate::case::{Family, Outcome};
use crate::clean::KINDS;
use crate::foreign::{EFFECTS, sets};
use crate::tally::Rate;

/// The side of a bar on which a rate meets it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    AtLeast,
    AtMost,
}
use Side::{AtLeast, AtMost};

/// A bar: what is asked, and what was measured.
struct Bar {
    what: String,
    side: Side,
    limit: f64,
    measured: Rate,
}

fn bar(what: impl Into<String>, side: Side, limit: f64, measured: Rate) -> Bar {
    Bar {
        what: what.into(),
        side,
        limit,
        measured,
    }
}

impl Bar {
    fn asked(&self) -> String {
        let sign = match self.side {
            AtLeast => ">=",
            AtMost => "<=",
        };
        format!("{sign} {:.1} %", 100.0 * self.limit)
    }

    /// Whether it is met, and whether the binomial error could have turned that.
    fn verdict(&self) -> &'static str {
        if self.measured.trials == 0 {
            return "not run";
        }
        let met = match self.side {
            AtLeast => self.measured.share() >= self.limit,
            AtMost => self.measured.share() <= self.limit,
        };
        let (low, high) = self.measured.interval();
        match (met, (low..=high).contains(&self.limit)) {
            (true, false) => "met",
            (true, true) => "met, within the error",
            (false, true) => "**missed, within the error**",
            (false, false) => "**missed**",
        }
    }
}

/// Least share of strong foreign effects that are reported as unexplained.
pub(super) const UNEXPLAINED: f64 = 0.92;
/// Largest share of strong foreign effects that are given a name.
pub(super) const NAMED: f64 = 0.03;

const BEYOND_REACH: &str = "
An effect is *strong* from d' 8 on; an AM line from 13; telegraph, noise change and scale from 10. Foreign effects without a d'
(another law of the noise, codes) count as strong. Not counted are those that 0.28 deg/s rms keep below d' 25, and those whose cause
the library has got since (modes, wandering tones, rounded angles, two roundings, a capacitor).

Some d' asked of the smallest sizes cannot be reached. False alarms of 0.5 % leave about 7e-5 to each of some twenty hypotheses on
three axes; one test at that level finds 95 of 100 from d' 5.6 to 5.8 on, not 5.5. A line may have any of 12 000 frequencies: d' 7.8,
not 7.2. The modulation of an AM line holds depth^2 / (2 + depth^2) of its energy: d' 6.9 of it is d' 12 of the line at depth 1 and
21 at depth 0.5; depths are drawn from 0.5 to 1.
";

/// Foreign effects that are strong enough to be reported.
fn strange(all: &[Outcome]) -> impl Iterator<Item = &Outcome> + Clone {
    let foreign =
        |o: &&Outcome| matches!(o.family, Family::Foreign(i) if EFFECTS[i].later.is_none());
    let strong = |o: &&Outcome| o.strength.is_nan() || o.strength >= 0.99 * 25.0;
    all.iter().filter(foreign).filter(strong)
}

/// Both bars of foreign effects: told, and given a name.
fn of_strange(what: &str, [told, wrong]: [Rate; 2]) -> [Bar; 2] {
    let what = format!("{what}: reported as unexplained");
    [
        bar(what, AtLeast, UNEXPLAINED, told),
        bar("the same: given a name", AtMost, NAMED, wrong),
    ]
}

/// Largest share of clean runs with an alarm.
const ALARMS: f64 = 0.005;

/// The bars of runs without an effect.
fn of_clean(all: &[Outcome]) -> Vec<Bar> {
    let of_family = |what: String, family| bar(what, AtMost, ALARMS, alarms(of(all, family)));
    let first = of_family("clean runs with an alarm".into(), Family::Clean);
    let others = KINDS.iter().enumerate().map(|(i, kind)| {
        let what = kind.label.trim_start_matches("nothing, ");
        of_family(format!("the same, {what}"), Family::CleanOf(i))
    });
    std::iter::once(first).chain(others).collect()
}

/// The bars of effects of the library.
#[rustfmt::skip]
fn of_library(all: &[Outcome]) -> Vec<Bar> {
    let of = |keep: &dyn Fn(&Outcome) -> bool, hit: &dyn Fn(&Outcome) -> bool| {
        Rate::of(all.iter().filter(|o| keep(o)).map(hit))
    };
    let one = |o: &Outcome| matches!(o.family, Family::One(_)) && strong(o);
    let pair = |o: &Outcome| o.family == Family::Pair;
    let one_axis = |o: &Outcome| o.family == Family::OneAxis;
    let planted = |o: &Outcome| matches!(o.family, Family::One(_) | Family::Pair | Family::Counted(_));
    let wrong = |o: &Outcome| !o.wrong.is_empty();
    vec![
        bar("one strong effect: named alone", AtLeast, 0.98, of(&one, &Outcome::right)),
        bar("two strong effects: effects named", AtLeast, 0.98, named(all, Family::Pair)),
        bar("the same: runs wholly right", AtLeast, 0.95, of(&pair, &Outcome::right)),
        bar("two or three strong effects on one axis: effects named", AtLeast, 0.97, named(all, Family::OneAxis)),
        bar("the same: runs wholly right", AtLeast, 0.93, of(&one_axis, &Outcome::right)),
        bar("one strong effect beside a line, a band, outliers or an echo: still named", AtLeast, 0.97, kept(all, 0..4)),
        bar("one beside a vibration that wanders: named", AtLeast, 0.95, kept(all, 4..5)),
        bar("runs with an effect of any strength: a wrong name", AtMost, 0.02, of(&planted, &wrong)),
    ]
}

/// The table of the bars.
pub(super) fn bars(out: &mut String, all: &[Outcome]) {
    let fit: Vec<_> = estimates(all).into_values().flatten().collect();
    let covered = Rate::of(fit.iter().map(|e| covers(e)));
    let mut bars = of_clean(all);
    bars.extend(of_library(all));
    if let Some((latest, first)) = sets::latest() {
        let of = |hits| Rate::of((0..first.runs).map(|run| run < hits));
        let what = format!("foreign effects of d' >= 25, set {latest} before any change by it");
        bars.extend(of_strange(&what, [first.unexplained, first.named].map(of)));
    }
    let rates = unexplained_and_wrong(strange(all));
    bars.extend(of_strange("foreign effects of d' >= 25, all sets", rates));
    let what = "95 % intervals that hold the truth";
    bars.push(bar(what, AtLeast, 0.93, covered));
    out.push_str("## Bars\n\n| bar | asked | measured | |\n|---|---|---|---|\n");
    for b in &bars {
        let (what, asked, measured, verdict) =
            (&b.what, b.asked(), percent(b.measured), b.verdict());
        let _ = writeln!(out, "| {what} | {asked} | {measured} | {verdict} |");
    }
    let _ = writeln!(out, "{BEYOND_REACH}");
}
