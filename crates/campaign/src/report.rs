//! docs/power.md: method, bars with what was measured against them, tables.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::case::{Estimate, Family, Hit, Outcome};
use crate::foreign::{EFFECTS, sets};
use crate::plant::asked_from;
use crate::tally::Rate;

mod bars;
mod checks;
mod effects;
mod structures;

/// Whether a run says something that a summary hides.
#[must_use]
pub fn worth_a_line(o: &Outcome) -> bool {
    match o.family {
        Family::Foreign(_) => !o.wrong.is_empty() || o.unexplained.is_empty(),
        _ => !o.right(),
    }
}

/// A run in a line.
#[must_use]
pub fn line(o: &Outcome) -> String {
    let effect = |(label, d, hit): &(_, f64, Hit)| format!("{label} (d' {d:.1}) {hit:?}");
    let planted: Vec<String> = o.truths.iter().map(effect).collect();
    let strange = match o.strength.is_nan() {
        true => String::new(),
        false => format!(" d' {:.0}", o.strength),
    };
    let (label, index, planted) = (o.family.label(), o.index, planted.join(", "));
    let (wrong, unexplained) = (o.wrong.join(", "), o.unexplained.join("; "));
    format!("{label}{strange} #{index}: {planted} | wrong: {wrong} | unexplained: {unexplained}")
}

fn percent(r: Rate) -> String {
    if r.trials == 0 {
        return "-".into();
    }
    let (low, high) = r.interval();
    let [share, low, high] = [r.share(), low, high].map(|share| 100.0 * share);
    format!("{share:.1} % ({r}, {low:.1}..{high:.1})")
}

/// The runs of a family.
fn of(all: &[Outcome], family: Family) -> impl Iterator<Item = &Outcome> + Clone {
    all.iter().filter(move |o| o.family == family)
}

/// Runs in which something is told that has no cause or a wrong one.
fn alarms<'a>(runs: impl IntoIterator<Item = &'a Outcome>) -> Rate {
    Rate::of(runs.into_iter().map(|o| !o.quiet()))
}

/// Runs in which something is unexplained, and those in which a cause is named that is not there.
fn unexplained_and_wrong<'a>(runs: impl Iterator<Item = &'a Outcome> + Clone) -> [Rate; 2] {
    let unexplained = runs.clone().map(|o| !o.unexplained.is_empty());
    [
        Rate::of(unexplained),
        Rate::of(runs.map(|o| !o.wrong.is_empty())),
    ]
}

/// How often each was said, in words. What was said of a channel is counted without it.
fn counts<'a>(said: impl Iterator<Item = &'a String>) -> String {
    let mut by: BTreeMap<&str, usize> = BTreeMap::new();
    for text in said {
        let short = text.split(" on ").next().unwrap_or(text);
        let short = short.split(". ").next().unwrap_or(short);
        *by.entry(short).or_default() += 1;
    }
    let list: Vec<String> = by.iter().map(|(k, n)| format!("{k} {n}")).collect();
    list.join(", ")
}

/// Whether an effect was named.
fn found(t: &(&str, f64, Hit)) -> bool {
    t.2 != Hit::Missed
}

fn strong(o: &Outcome) -> bool {
    o.truths.iter().all(|t| t.1 >= asked_from(t.0))
}

/// Whether the 95 % interval of an estimate holds the truth.
fn covers(e: &Estimate) -> bool {
    (e.value - e.truth).abs() <= 1.959_964 * e.std_error
}

/// Estimates of runs strong enough that being named does not select them.
fn estimates(all: &[Outcome]) -> BTreeMap<(&'static str, String), Vec<&Estimate>> {
    let mut by: BTreeMap<_, Vec<&Estimate>> = BTreeMap::new();
    let one = |o: &&Outcome| matches!(o.family, Family::One(_)) && strong(o);
    for e in all.iter().filter(one).flat_map(|o| &o.estimates) {
        let own = by.entry((e.label, e.parameter.clone())).or_default();
        own.push(e);
    }
    // Locations and shapes cover as sizes do; counts and phases are not graded.
    by.retain(|k, _| !k.1.ends_with("phase"));
    by
}

/// The page, of runs of which `planned` were to be.
#[must_use]
pub fn page(all: &[Outcome], command: &str, date: &str, seconds: f64, planned: usize) -> String {
    let mut out = String::from("# What the diagnosis can find: detection rates\n\n");
    let (runs, minutes) = (all.len(), seconds / 60.0);
    let comma = if date.is_empty() { "" } else { ", " };
    let _ = writeln!(
        out,
        "{runs} runs{comma}{date}, {minutes:.0} min: `{command}`\n"
    );
    let proper = crate::cases(crate::DEFAULT, None).len();
    if runs < planned {
        let _ = writeln!(
            out,
            "Ended early: {planned} runs were planned; each row has its share of those made.\n"
        );
    } else if runs < proper {
        let _ = writeln!(
            out,
            "A sample of the {proper} runs of the campaign proper: read the intervals, not the shares.\n"
        );
    }
    out.push_str(METHOD);
    bars::bars(&mut out, all);
    clean(&mut out, all);
    effects::tables(&mut out, all);
    structures::table(&mut out, all);
    foreign(&mut out, all);
    checks::table(&mut out, all);
    let _ = write!(out, "\n{NAMES}");
    times(&mut out, all);
    out
}

const METHOD: &str = "\
## Method

- **A run** is a simulated stand: 600 s at 20 Hz, three axes; angle random walk 3.6 to 7 deg/sqrt(h), rate random walk 0 (15 % of the
  axes) or 3e-4 to 7e-3 deg/s/sqrt(s); temperature, supply, motor command and vibration act. An effect is on a random channel.
- **Strength d'** is the square root of twice the expected log likelihood ratio against white noise and a random walk fitted again.
  It is computed from the simulated signal or density, beside the other effects of the channel, their sizes fitted again.
- **The oracle** knows the shape of the effect and makes one test at 1 %. It finds 95 of 100 from d' 4.22 on.
- **Slow effects** stay below 0.25 deg/s rms (foreign ones 0.28): a gyro that reads more below 1 Hz may have been turned.
- **Seeds**: thresholds were chosen on seeds below 1000; each campaign draws a fresh one.
- *Named*: the cause is in the answer, first or among the alternatives. *Alone*: nothing else is named or unexplained. *Wrong*: a
  cause is named on that channel that is not there. A part of the truth (a line for a modulated one, a slope for a parabola) is not
  wrong.
- A share has its hits and runs, and in the first table its 95 % interval (Clopper and Pearson).

Generator and engine share the model of the effects, so the rates are an upper bound for unknown sensors. The motor's current, the
foreign effects, [hidden effects](hidden-effect.md) and [measured records](real-data.md) are not from that model.

";

const NAMES: &str = include_str!("report/names.md");

/// Largest rate random walk of the three axes, deg/s/sqrt(s): edges of the rows.
const WALKS: [f64; 5] = [0.0, 1.5e-3, 3e-3, 5e-3, 1.0];

fn clean(out: &mut String, all: &[Outcome]) {
    out.push_str("## False alarms by noise\n\n| clean runs | with an alarm |\n|---|---|\n");
    for edges in WALKS.windows(2) {
        let (from, to) = (edges[0], edges[1]);
        let top = |o: &Outcome| o.walks.iter().copied().fold(0.0, f64::max);
        let own = of(all, Family::Clean).filter(|o| (from..to).contains(&top(o)));
        let rate = percent(alarms(own));
        let _ = writeln!(
            out,
            "| largest random walk {from}..{to} deg/s/sqrt(s) | {rate} |"
        );
    }
    let elsewhere = percent(alarms(of(all, Family::Elsewhere)));
    let _ = writeln!(out, "| 60 to 7200 s, 1 to 1000 Hz | {elsewhere} |");
    use Family::{Clean, CleanOf, Elsewhere};
    let clean = all.iter();
    let clean = clean.filter(|o| matches!(o.family, Clean | Elsewhere | CleanOf(_)));
    let said = counts(clean.flat_map(|o| o.wrong.iter().chain(&o.unexplained)));
    let said = if said.is_empty() { "none" } else { &said };
    let _ = writeln!(out, "\nAlarms: {said}.\n");
}

/// Whether a rate is short of a bar of the foreign effects by more than its binomial error.
fn is_short(unexplained: Rate, named: Rate) -> bool {
    unexplained.interval().1 < bars::UNEXPLAINED || named.interval().0 > bars::NAMED
}

fn foreign(out: &mut String, all: &[Outcome]) {
    let mut rows = String::new();
    let mut others = 0;
    for (i, effect) in EFFECTS.iter().enumerate() {
        let own = of(all, Family::Foreign(i));
        if own.clone().next().is_none() || effect.later.is_some() {
            continue;
        }
        let [unexplained, named] = unexplained_and_wrong(own.clone());
        if !is_short(unexplained, named) {
            others += 1;
            continue;
        }
        let (name, wrong) = (effect.name, counts(own.flat_map(|o| &o.wrong)));
        let _ = writeln!(rows, "| {name} | {unexplained} | {wrong} |");
    }
    let _ = writeln!(
        out,
        "\n## Foreign effects\n\n{}\nEffects that miss a bar by more than their binomial error, of any strength ({others} do not):\n\n\
         | effect | unexplained | wrong names |\n|---|---|---|\n{}",
        sets::page(),
        rows.trim_end()
    );
}

/// How long a diagnosis took, with the slowest rows.
fn times(out: &mut String, all: &[Outcome]) {
    let mut rows: BTreeMap<Family, (f64, usize)> = BTreeMap::new();
    for o in all {
        let row = rows.entry(o.family).or_default();
        *row = (row.0 + o.seconds, row.1 + 1);
    }
    let total: f64 = rows.values().map(|r| r.0).sum();
    let mean = |(f, (sum, n)): (&Family, &(f64, usize))| (f.label(), sum / *n as f64);
    let mut means: Vec<(&str, f64)> = rows.iter().map(mean).collect();
    means.sort_by(|a, b| b.1.total_cmp(&a.1));
    let row = |(label, s): &(&str, f64)| format!("{label} {s:.1} s");
    let slowest: Vec<String> = means.iter().take(2).map(row).collect();
    let (ms, slowest) = (1e3 * total / all.len().max(1) as f64, slowest.join(", "));
    let _ = writeln!(
        out,
        "\nA diagnosis took {ms:.0} ms on average; slowest rows: {slowest}."
    );
}
