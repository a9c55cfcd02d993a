//! docs/power.md: method, bars with what was measured against them, tables.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::case::{Estimate, Family, Hit, Outcome};
use crate::foreign::{FOREIGN, sets};
use crate::plant::{BY_COUNT, BY_STRENGTH, asked_from, strong as row_of};
use crate::tally::{ORACLE, Rate, d95, oracle};

mod bars;
mod checks;
mod company;

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
    let planted: Vec<String> = o
        .truths
        .iter()
        .map(|(label, d, hit)| format!("{label} (d' {d:.1}) {hit:?}"))
        .collect();
    let strange = if o.strength.is_nan() {
        String::new()
    } else {
        format!(" d' {:.0}", o.strength)
    };
    format!(
        "{}{strange} #{}: {} | wrong: {} | unexplained: {}",
        o.family.label(),
        o.index,
        planted.join(", "),
        o.wrong.join(", "),
        o.unexplained.join("; ")
    )
}

fn percent(r: Rate) -> String {
    if r.trials == 0 {
        return "-".into();
    }
    let (low, high) = r.interval();
    format!(
        "{:.1} % ({}/{}, {:.1}..{:.1})",
        100.0 * r.share(),
        r.hits,
        r.trials,
        100.0 * low,
        100.0 * high
    )
}

fn strong(o: &Outcome) -> bool {
    o.truths.iter().all(|t| t.1 >= asked_from(t.0))
}

fn singles(all: &[Outcome]) -> impl Iterator<Item = &Outcome> {
    all.iter().filter(|o| matches!(o.family, Family::One(_)))
}

/// Whether the 95 % interval of an estimate holds the truth.
fn covers(e: &Estimate) -> bool {
    (e.value - e.truth).abs() <= 1.959_964 * e.std_error
}

/// Relative deviations of the estimates of a parameter, and how often its interval holds the truth.
struct Spread {
    covered: Rate,
    median: f64,
    mean: f64,
    error: f64,
}

fn spread(estimates: &[&Estimate]) -> Spread {
    let covered = Rate::of(estimates.iter().map(|e| covers(e)));
    let mut ratios: Vec<f64> = estimates
        .iter()
        .filter(|e| e.truth != 0.0)
        .map(|e| e.value / e.truth)
        .collect();
    ratios.sort_by(f64::total_cmp);
    let n = ratios.len().max(1) as f64;
    let mean = ratios.iter().sum::<f64>() / n;
    let variance = ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    Spread {
        covered,
        median: ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN),
        mean,
        error: (variance / n).sqrt(),
    }
}

/// Estimates of runs strong enough that being named does not select them.
fn estimates(all: &[Outcome]) -> BTreeMap<(&'static str, String), Vec<&Estimate>> {
    let mut by: BTreeMap<_, Vec<&Estimate>> = BTreeMap::new();
    for o in all
        .iter()
        .filter(|o| matches!(o.family, Family::One(_)) && strong(o))
    {
        for e in &o.estimates {
            by.entry((e.label, e.parameter.clone()))
                .or_default()
                .push(e);
        }
    }
    // Locations and shapes cover as sizes do; counts and phases are not graded.
    by.retain(|k, _| !k.1.ends_with("phase"));
    by
}

/// The page, of runs of which `planned` were to be.
#[must_use]
pub fn page(all: &[Outcome], command: &str, date: &str, seconds: f64, planned: usize) -> String {
    let mut out = String::new();
    let _ = writeln!(out, "# What the diagnosis can find: detection rates\n");
    let _ = writeln!(
        out,
        "{} runs{}{date}, {:.0} min: `{command}`\n",
        all.len(),
        if date.is_empty() { "" } else { ", " },
        seconds / 60.0
    );
    let proper = crate::cases(crate::DEFAULT, None).len();
    if all.len() < planned {
        let _ = writeln!(
            out,
            "Ended early: {planned} runs were planned; each row has its share of those made.\n"
        );
    } else if all.len() < proper {
        let _ = writeln!(
            out,
            "A sample, shorter than the {proper} runs of the campaign proper: read the intervals, not the shares.\n"
        );
    }
    out.push_str(METHOD);
    bars::bars(&mut out, all);
    clean(&mut out, all);
    causes(&mut out, all);
    curves(&mut out, all);
    counted(&mut out, all);
    company::tables(&mut out, all);
    foreign(&mut out, all);
    checks::table(&mut out, all);
    intervals(&mut out, all);
    confusion(&mut out, all);
    times(&mut out, all);
    out
}

const METHOD: &str = "\
## Method

- **A run** is a simulated stand: 600 s at 20 Hz, three axes; angle random walk 3.6 to 7 deg/sqrt(h), rate random walk 0 (15 % of the
  axes) or 3e-4 to 7e-3 deg/s/sqrt(s); temperature, supply, motor command and vibration acting; an effect on a random channel.
- **Strength d'** is the square root of twice the expected log likelihood ratio against white noise and a random walk fitted again,
  computed from the simulated signal or spectral density. Of two effects on one channel each is measured with the other present.
- **The oracle** knows the shape of the effect and makes one test at 1 %. It finds 95 of 100 from d' 4.22 on.
- **Slow effects** stay below 0.25 deg/s rms (foreign ones 0.28): a gyro that reads more below 1 Hz may have been turned.
- **Seeds**: thresholds were chosen on seeds below 1000; each campaign draws a fresh one.
- *Named*: the cause is in the answer, first or among the alternatives. *Alone*: and nothing else is named or unexplained.
  *Wrong*: a cause is named on that channel that is not there. A part of the truth (a line for a modulated one, a slope for a
  parabola, Gauss-Markov for telegraph noise) is neither.
- A rate is given as share (hits/runs, 95 % interval of Clopper and Pearson).

Generator and engine share the model of the effects: the rates are an upper bound for unknown sensors. Not from that model are the
motor's current, the foreign effects, [hidden effects](hidden-effect.md) and [measured records](real-data.md).

";

const NAMES: &str = include_str!("report/names.md");

fn clean(out: &mut String, all: &[Outcome]) {
    let _ = writeln!(
        out,
        "## False alarms by noise\n\n| largest rate random walk of the three axes | clean runs with an alarm |\n|---|---|"
    );
    let regimes = [(0.0, 1.5e-3), (1.5e-3, 3e-3), (3e-3, 5e-3), (5e-3, 1.0)];
    for (low, high) in regimes {
        let of = all.iter().filter(|o| {
            let top = o.walks.iter().copied().fold(0.0, f64::max);
            o.family == Family::Clean && top >= low && top < high
        });
        let _ = writeln!(
            out,
            "| {low:.4}..{high:.4} deg/s/sqrt(s) | {} |",
            percent(Rate::of(of.map(|o| !o.quiet())))
        );
    }
    for (i, (rate, seconds)) in crate::case::ELSEWHERE.iter().enumerate() {
        let of = all.iter().filter(|o| {
            o.family == Family::Elsewhere && o.index as usize % crate::case::ELSEWHERE.len() == i
        });
        let _ = writeln!(
            out,
            "| any, {seconds} s at {rate} Hz | {} |",
            percent(Rate::of(of.map(|o| !o.quiet())))
        );
    }
    for (i, kind) in crate::clean::KINDS.iter().enumerate() {
        let of = all.iter().filter(|o| o.family == Family::CleanOf(i));
        let label = kind.label.trim_start_matches("nothing, ");
        let _ = writeln!(
            out,
            "| any, {label} | {} |",
            percent(Rate::of(of.map(|o| !o.quiet())))
        );
    }
    let said: BTreeMap<String, usize> = all
        .iter()
        .filter(|o| o.truths.is_empty() && !matches!(o.family, Family::Foreign(_)))
        .flat_map(|o| o.wrong.iter().chain(&o.unexplained))
        .fold(BTreeMap::new(), |mut by, s| {
            let short = s
                .split(" on ")
                .next()
                .unwrap_or(s)
                .split(". ")
                .next()
                .unwrap_or("")
                .to_owned();
            *by.entry(short).or_default() += 1;
            by
        });
    let list: Vec<String> = said.iter().map(|(k, n)| format!("{k} ({n})")).collect();
    let _ = writeln!(
        out,
        "\nAlarms: {}.\n",
        if list.is_empty() {
            "nothing".into()
        } else {
            list.join("; ")
        }
    );
}

fn causes(out: &mut String, all: &[Outcome]) {
    let _ = writeln!(
        out,
        "## One effect\n\n| effect | from d' | named | first | alone | wrong name, any strength | named 95 % from d' | over the oracle's, asked |\n|---|---|---|---|---|---|---|---|"
    );
    for (i, label) in BY_STRENGTH.iter().enumerate() {
        let own: Vec<&Outcome> = all.iter().filter(|o| o.family == Family::One(i)).collect();
        let strong: Vec<&&Outcome> = own.iter().filter(|o| strong(o)).collect();
        let curve: Vec<(f64, bool)> = own
            .iter()
            .map(|o| (o.truths[0].1, o.truths[0].2 != Hit::Missed))
            .collect();
        let (at, ratio) = d95(&curve).map_or_else(
            || ("-".into(), "-".into()),
            |(x, e)| (format!("{x:.1} +- {e:.1}"), format!("{:.2}", x / ORACLE)),
        );
        let short = |r: Rate| format!("{}/{}", r.hits, r.trials);
        let _ = writeln!(
            out,
            "| {label} | {} | {} | {} | {} | {} | {at} | {ratio}, {} |",
            asked_from(label),
            percent(Rate::of(
                strong.iter().map(|o| o.truths[0].2 != Hit::Missed)
            )),
            short(Rate::of(strong.iter().map(|o| o.truths[0].2 == Hit::Named))),
            short(Rate::of(strong.iter().map(|o| o.right()))),
            short(Rate::of(own.iter().map(|o| !o.wrong.is_empty()))),
            row_of(label).asked_ratio,
        );
    }
}

/// Edges of the power curves, d'.
const STRENGTHS: [f64; 8] = [3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0, 26.0];

fn curves(out: &mut String, all: &[Outcome]) {
    let bands: Vec<(f64, f64)> = STRENGTHS.windows(2).map(|w| (w[0], w[1])).collect();
    let heads: Vec<String> = bands
        .iter()
        .map(|(a, b)| format!("{a:.0}..{b:.0}"))
        .collect();
    let _ = writeln!(
        out,
        "\n## Power curves\n\nShare named, by d'. The oracle knows the shape and makes one test at 1 %.\n\n| effect | {} |\n|---|{}",
        heads.join(" | "),
        "---|".repeat(bands.len())
    );
    let oracle: Vec<String> = bands
        .iter()
        .map(|(a, b)| format!("{:.2}", oracle((a * b).sqrt())))
        .collect();
    let _ = writeln!(out, "| *oracle* | {} |", oracle.join(" | "));
    for (i, label) in BY_STRENGTH.iter().enumerate() {
        let cells: Vec<String> = bands
            .iter()
            .map(|(low, high)| {
                let own = all.iter().filter(|o| {
                    o.family == Family::One(i) && (*low..*high).contains(&o.truths[0].1)
                });
                let rate = Rate::of(own.map(|o| o.truths[0].2 != Hit::Missed));
                match rate.trials {
                    0 => "-".into(),
                    n => format!("{:.2} ({n})", rate.share()),
                }
            })
            .collect();
        let _ = writeln!(out, "| {label} | {} |", cells.join(" | "));
    }
    let _ = writeln!(out, "\nIn brackets: runs.");
}

fn counted(out: &mut String, all: &[Outcome]) {
    let _ = writeln!(
        out,
        "\n## Faults of frames, counts and base\n\n1..8 outliers of 8.5..30 sigma (small: 3..40 of 6..8.5), rails at 2..2.6 sigma, 1..3 missing bits, bits stuck in 15..100 % of the samples, 15..75 repeats,\n5..65 lost frames, jitter 0.4..5 ms, clocks 300..3000 ppm off, motion of 1.5..20 deg/s.\n\n| fault | named | alone |\n|---|---|---|"
    );
    for (i, label) in BY_COUNT.iter().enumerate() {
        let own: Vec<&Outcome> = all
            .iter()
            .filter(|o| o.family == Family::Counted(i))
            .collect();
        let _ = writeln!(
            out,
            "| {label} | {} | {} |",
            percent(Rate::of(own.iter().map(|o| o.truths[0].2 != Hit::Missed))),
            percent(Rate::of(own.iter().map(|o| o.right()))),
        );
    }
}

fn foreign(out: &mut String, all: &[Outcome]) {
    let mut rows = String::new();
    let mut met = 0;
    for (i, label) in FOREIGN.iter().enumerate() {
        let own: Vec<&Outcome> = all
            .iter()
            .filter(|o| o.family == Family::Foreign(i))
            .collect();
        if own.is_empty() {
            continue;
        }
        let unexplained = Rate::of(own.iter().map(|o| !o.unexplained.is_empty()));
        let named = Rate::of(own.iter().map(|o| !o.wrong.is_empty()));
        if unexplained.share() >= bars::UNEXPLAINED && named.share() <= bars::NAMED {
            met += 1;
            continue;
        }
        let mut names: BTreeMap<&str, usize> = BTreeMap::new();
        for w in own.iter().flat_map(|o| &o.wrong) {
            *names
                .entry(w.split(" on ").next().unwrap_or(w))
                .or_default() += 1;
        }
        let names: Vec<String> = names.iter().map(|(k, n)| format!("{k} {n}")).collect();
        let short = |r: Rate| format!("{}/{}", r.hits, r.trials);
        let _ = writeln!(
            rows,
            "| {label} | {} | {} | {} |",
            short(unexplained),
            short(named),
            names.join(", ")
        );
    }
    let _ = writeln!(
        out,
        "\n{NAMES}## Foreign effects\n\n{}\nEffects that miss a bar by themselves, of any strength ({met} do not):\n\n\
         | effect | unexplained | given a name | names given |\n|---|---|---|---|\n{rows}",
        sets::page()
    );
}

fn intervals(out: &mut String, all: &[Outcome]) {
    let _ = writeln!(
        out,
        "## Estimates\n\nRuns of the strength asked in which the cause was named first. Asked: coverage of 93 to 97 %, sizes within 3 %.\n\n| effect | parameter | coverage of the 95 % interval | estimate / truth: median | mean |\n|---|---|---|---|---|"
    );
    for ((label, parameter), of) in estimates(all) {
        let s = spread(&of);
        let _ = writeln!(
            out,
            "| {label} | `{parameter}` | {} | {:.3} | {:.3} +- {:.3} |",
            percent(s.covered),
            s.median,
            s.mean,
            s.error
        );
    }
}

fn confusion(out: &mut String, all: &[Outcome]) {
    let _ = writeln!(
        out,
        "\n## Confusion\n\n| planted (one effect, any strength) | runs | other names given | unexplained |\n|---|---|---|---|"
    );
    let mut rows: BTreeMap<&str, (usize, BTreeMap<&str, usize>, usize)> = BTreeMap::new();
    for o in all
        .iter()
        .filter(|o| matches!(o.family, Family::One(_) | Family::Counted(_)))
    {
        let row = rows.entry(o.truths[0].0).or_default();
        row.0 += 1;
        row.2 += usize::from(!o.unexplained.is_empty());
        for w in &o.wrong {
            *row.1
                .entry(w.split(" on ").next().unwrap_or(w))
                .or_default() += 1;
        }
    }
    for (label, (runs, wrong, left)) in rows {
        if wrong.is_empty() && left == 0 {
            continue;
        }
        let names: Vec<String> = wrong.iter().map(|(k, n)| format!("{k} {n}")).collect();
        let _ = writeln!(out, "| {label} | {runs} | {} | {left} |", names.join(", "));
    }
}

/// How long a diagnosis took, with the slowest rows.
fn times(out: &mut String, all: &[Outcome]) {
    let mut rows: BTreeMap<Family, (f64, usize)> = BTreeMap::new();
    for o in all {
        let row = rows.entry(o.family).or_default();
        *row = (row.0 + o.seconds, row.1 + 1);
    }
    let total: f64 = rows.values().map(|r| r.0).sum();
    let mut means: Vec<(&str, f64)> = rows
        .iter()
        .map(|(f, (sum, n))| (f.label(), sum / *n as f64))
        .collect();
    means.sort_by(|a, b| b.1.total_cmp(&a.1));
    let slowest: Vec<String> = means
        .iter()
        .take(5)
        .map(|(label, s)| format!("{label} {s:.1} s"))
        .collect();
    let _ = writeln!(
        out,
        "\nA diagnosis took {:.0} ms on average; slowest rows: {}.",
        1e3 * total / all.len().max(1) as f64,
        slowest.join(", ")
    );
}
