//! Effects of the library: one row for each, alone and in company, and how well their parameters are estimated.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::{counts, covers, estimates, found, of, strong};
use crate::case::{Estimate, Family, Outcome};
use crate::plant::{COUNTED, STRONG};
use crate::tally::{ORACLE, Rate, d95, oracle};

/// Edges of the power curves, d'.
const STRENGTHS: [f64; 5] = [3.0, 5.0, 8.0, 13.0, 26.0];

/// Runs of a family in which an effect was named beside others.
fn beside(all: &[Outcome], family: Family, label: &str) -> Rate {
    let effects = of(all, family).flat_map(|o| &o.truths);
    Rate::of(effects.filter(|t| t.0 == label).map(found))
}

fn by_strength(out: &mut String, all: &[Outcome]) {
    let bands = || STRENGTHS.windows(2).map(|w| (w[0], w[1]));
    let heads: Vec<String> = bands().map(|(a, b)| format!("{a:.0}..{b:.0}")).collect();
    let chance = |(a, b): (f64, f64)| format!("{:.2}", oracle((a * b).sqrt()));
    let chances: Vec<String> = bands().map(chance).collect();
    let _ = writeln!(
        out,
        "## Effects of the library\n\n\
         Runs in which an effect was named, of all runs: alone by d', then strong ones beside another effect, and beside one or two on\n\
         the same axis. *Alone*: of the strong runs, those with nothing else named or unexplained. *95 % from*: the d' at which a\n\
         logistic curve reaches 95 %, and the d' that is asked.\n\n\
         | effect | {} | alone | 95 % from (asked) | of two | on one axis |\n|---|{}---|---|---|---|\n\
         | *oracle* | {} | | {ORACLE} | | |",
        heads.join(" | "),
        "---|".repeat(heads.len()),
        chances.join(" | ")
    );
    for (i, row) in STRONG.iter().enumerate() {
        let own = of(all, Family::One(i));
        let seen = own.clone().map(|o| (o.truths[0].1, found(&o.truths[0])));
        let curve: Vec<(f64, bool)> = seen.collect();
        let within = |(low, high): (f64, f64)| {
            let own = curve.iter().filter(|c| (low..high).contains(&c.0));
            Rate::of(own.map(|c| c.1)).to_string()
        };
        let named: Vec<String> = bands().map(within).collect();
        let alone = Rate::of(own.filter(|o| strong(o)).map(Outcome::right));
        let at = d95(&curve).map_or("-".into(), |(x, e)| format!("{x:.1}±{e:.1}"));
        let (label, named, asked) = (row.label, named.join(" | "), ORACLE * row.asked_ratio);
        let [pair, one_axis] =
            [Family::Pair, Family::OneAxis].map(|family| beside(all, family, label));
        let _ = writeln!(
            out,
            "| {label} | {named} | {alone} | {at} ({asked:.1}) | {pair} | {one_axis} |"
        );
    }
}

/// What a fault of frames, counts or base is drawn from.
const FAULTS: &str = "
Faults of frames, counts and base: 1..8 outliers of 8.5..30 sigma (small: 3..40 of 6..8.5), rails at 2..2.6 sigma, 1..3 missing bits,
bits stuck in 15..100 % of the samples, 15..75 repeats, 5..65 lost frames, jitter 0.4..5 ms, clocks 300..3000 ppm off, motion of
1.5..20 deg/s, high-pass filters of 0.05..0.8 Hz.
";

fn by_count(out: &mut String, all: &[Outcome]) {
    let _ = writeln!(out, "{FAULTS}\n| fault | named | alone |\n|---|---|---|");
    for (i, row) in COUNTED.iter().enumerate() {
        let (label, own) = (row.label, of(all, Family::Counted(i)));
        let named = Rate::of(own.clone().map(|o| found(&o.truths[0])));
        let alone = Rate::of(own.map(Outcome::right));
        let _ = writeln!(out, "| {label} | {named} | {alone} |");
    }
}

/// What was said of runs with one effect, of any strength, that is not the effect.
fn confusion(out: &mut String, all: &[Outcome]) {
    let mut by: BTreeMap<&str, Vec<&Outcome>> = BTreeMap::new();
    for o in all {
        if matches!(o.family, Family::One(_) | Family::Counted(_)) {
            by.entry(o.truths[0].0).or_default().push(o);
        }
    }
    let mut rows = Vec::new();
    for (label, own) in by {
        let mut said = counts(own.iter().flat_map(|o| &o.wrong));
        let left = own.iter().filter(|o| !o.unexplained.is_empty()).count();
        if left > 0 {
            let comma = if said.is_empty() { "" } else { ", " };
            let _ = write!(said, "{comma}something unexplained {left}");
        }
        if !said.is_empty() {
            rows.push(format!("{label} ({} runs): {said}", own.len()));
        }
    }
    let rows = match rows.as_slice() {
        [] => "nothing".into(),
        some => some.join("; "),
    };
    let _ = writeln!(
        out,
        "\nSaid beside or in place of one effect of any strength: {rows}."
    );
}

/// Intervals that hold the truth, and the mean of estimate over truth with its standard error.
fn told(parameter: &str, of: &[&Estimate]) -> String {
    let covered = Rate::of(of.iter().map(|e| covers(e)));
    let told = of.iter().filter(|e| e.truth != 0.0);
    let ratios: Vec<f64> = told.map(|e| e.value / e.truth).collect();
    let n = ratios.len().max(1) as f64;
    let mean = ratios.iter().sum::<f64>() / n;
    let variance = ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    let error = (variance / n).sqrt();
    format!("`{parameter}` {covered} {mean:.3}±{error:.3}")
}

fn intervals(out: &mut String, all: &[Outcome]) {
    let mut by: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for ((label, parameter), of) in estimates(all) {
        by.entry(label).or_default().push(told(&parameter, &of));
    }
    let _ = writeln!(
        out,
        "\n## Estimates\n\n\
         Of strong runs in which the cause was named first: 95 % intervals that hold the truth (asked: 93 to 97 %), and the mean of\n\
         estimate / truth with its standard error (asked: within 3 %).\n\n\
         | effect | parameters |\n|---|---|"
    );
    for (label, parameters) in by {
        let _ = writeln!(out, "| {label} | {} |", parameters.join("; "));
    }
}

/// All of them.
pub(super) fn tables(out: &mut String, all: &[Outcome]) {
    by_strength(out, all);
    by_count(out, all);
    confusion(out, all);
    intervals(out, all);
}
