//! A diagnosis on the first screen of a terminal: the verdict, one entry a cause, what is left, and the noise.

use std::fmt::Write;

use diagnosis::result::{Diagnosed, Diagnosis, Finding, Unexplained, Verdict};
use model::record::Base;

use super::noise::{self, Shown};
use super::{advice, answer, item, verdict};

/// Entries of what is left over that the first screen shows; the rest is counted.
const SHOWN: usize = 4;
/// Words of such an entry.
const WORDS: usize = 28;

/// What the commands print below it where the details are not asked for.
pub const MORE: &str = "--details: gains, failing checks, why not tested, the smallest sizes found";

/// A diagnosis, verdict first, of a record whose `base` did what is said there.
#[must_use]
pub fn diagnosis(diagnosed: &Diagnosed, base: Option<Base>) -> String {
    let d = &diagnosed.diagnosis;
    let mut out = String::new();
    let input = &d.input;
    let _ = writeln!(
        out,
        "{}: {:.0} s at {:.4} Hz, {} samples",
        input.file, input.seconds, input.rate_hz, input.samples
    );
    for note in &input.notes {
        let _ = writeln!(out, "{}", item("note: ", note));
    }
    let verdict = item("verdict  ", &verdict::sentence(d));
    let _ = writeln!(out, "{}", verdict.trim_start());
    let small = |f: &&Finding| !f.material;
    let material: Vec<&Finding> = d.findings.iter().filter(|f| !small(f)).collect();
    for (k, finding) in material.iter().enumerate() {
        let _ = writeln!(out, "\n{:>2}. {}", k + 1, lead(&answer::headline(finding)));
        let lines = [
            answer::elsewhere(finding),
            answer::cost(finding),
            remedy(&material, k, base),
            answer::open_question(finding),
        ];
        for line in lines.into_iter().flatten() {
            let _ = writeln!(out, "{}", item("", &line));
        }
        if finding.confirmed_on_held_out_data == Some(false) {
            let not = "Detected in the whole run, not confirmed on held-out data.";
            let _ = writeln!(out, "{}", item("", not));
        }
    }
    write_small(
        &mut out,
        &d.findings.iter().filter(small).collect::<Vec<_>>(),
    );
    write_unexplained(&mut out, &d.unexplained);
    write_replicates(&mut out, d);
    write_noise(&mut out, diagnosed);
    write_rest(&mut out, d);
    out
}

/// Whether simulations of the model that is handed over look like the record: one line.
fn write_replicates(out: &mut String, d: &Diagnosis) {
    // A channel on which nothing was found is as far off as this in one record of twenty, and is not told for it; nor is one of
    // a model of which the verdict says that it holds.
    let is_told = |channel: &String| {
        let found = d.findings.iter().any(|f| f.channels.contains(channel));
        let left = || d.unexplained.iter().any(|u| u.channel == *channel);
        d.verdict == Verdict::Unexplained && (found || left())
    };
    let outside: Vec<String> = (d.replicates.iter())
        .filter(|(channel, r)| !r.after.holds() && is_told(channel))
        .map(|(channel, r)| format!("{channel} ({})", r.after.strays()))
        .collect();
    if d.replicates.is_empty() {
        return;
    }
    let said = match outside.is_empty() {
        true => "simulations of this model look like the record on every channel".to_owned(),
        false => format!(
            "simulations of this model differ from the record: {}",
            outside.join("; ")
        ),
    };
    let _ = writeln!(out, "\n{}", item("", &said).trim_start());
}

/// What to do about the finding of the number `k`; once a cause.
fn remedy(all: &[&Finding], k: usize, base: Option<Base>) -> Option<String> {
    let same = all.iter().position(|f| f.cause == all[k].cause);
    match same.filter(|first| *first < k) {
        Some(first) => Some(format!("What to do: as for {}.", first + 1)),
        None => answer::remedy(all[k], base),
    }
}

/// A headline behind its number: wrapped like an item, without the indent of its first line.
fn lead(text: &str) -> String {
    item("", text).trim_start().to_owned()
}

/// Causes that change no angle or velocity error and no deviation by much: a line each.
fn write_small(out: &mut String, all: &[&Finding]) {
    if all.is_empty() {
        return;
    }
    let _ = writeln!(out, "\nfound, and too small to matter (`--matters`)");
    for finding in all {
        let _ = writeln!(out, "{}", item("", &answer::headline(finding)));
    }
}

fn write_unexplained(out: &mut String, all: &[Unexplained]) {
    let (large, small): (Vec<_>, Vec<_>) = all.iter().partition(|u| u.material);
    if !small.is_empty() {
        let mut channels: Vec<&str> = small.iter().map(|u| u.channel.as_str()).collect();
        channels.sort_unstable();
        channels.dedup();
        let on = channels.join(", ");
        let what = format!(
            "without a name, and too small to matter: {} on {on} (--details)",
            small.len()
        );
        let _ = writeln!(out, "\n{}", item("", &what).trim_start());
    }
    if large.is_empty() {
        return;
    }
    let _ = writeln!(out, "\nleft over, without a name");
    for left in large.iter().take(SHOWN) {
        let lead = format!("{}: ", left.channel);
        let _ = writeln!(out, "{}", item(&lead, &shortened(&left.what)));
        if let Some(c) = &left.consequence {
            let cost = answer::consequence_of(c, left.material);
            let _ = writeln!(out, "{}", item("", &cost));
        }
        if let Some(lines) = answer::lines(left) {
            let _ = writeln!(out, "{}", item("", &lines));
        }
        if let Some(of) = &left.follows {
            let next = format!(
                "What to do: change {of} alone and record again; where {} follows again, subtract what follows it.",
                left.channel
            );
            let _ = writeln!(out, "{}", item("", &next));
        }
    }
    if large.len() > SHOWN {
        let more = large.len() - SHOWN;
        let _ = writeln!(
            out,
            "    and {more} more (all of them: --json, or the report)"
        );
    }
    for next in advice::of(large.iter().copied()) {
        let _ = writeln!(out, "{}", item("", next));
    }
}

/// The first parts of an entry, which semicolons divide, so many that there are few words; the first one whole.
fn shortened(what: &str) -> String {
    let words = |text: &str| text.split_whitespace().count();
    let (mut open, mut end) = (0, None);
    for (i, c) in what.char_indices() {
        match c {
            '(' => open += 1,
            ')' => open -= 1,
            ';' if open == 0 && (end.is_none() || words(&what[..i]) <= WORDS) => end = Some(i),
            _ => {}
        }
    }
    match end {
        Some(end) if words(what) > WORDS => format!("{}; ...", &what[..end]),
        _ => what.to_owned(),
    }
}

/// N, B and K of every channel with their 95 % intervals, before and after where the causes change them.
fn write_noise(out: &mut String, of: &Diagnosed) {
    let channels: Vec<&str> = (of.extended_model.channels.iter())
        .map(|c| c.name.as_str())
        .collect();
    if channels.is_empty() {
        return;
    }
    let (title, without) = match (
        of.diagnosis.findings.is_empty(),
        of.diagnosis.unexplained.is_empty(),
    ) {
        (false, _) => ("noise beside the causes", "without the causes"),
        (true, false) => ("noise beside what has no name", "without what has no name"),
        (true, true) => ("noise", ""),
    };
    let _ = writeln!(out, "\n{title}, with 95 % intervals");
    let seconds = of.diagnosis.input.seconds;
    for name in channels {
        let term = |key: &str| {
            let before = noise::term(&of.baseline_model, name, key, seconds);
            let after = noise::term(&of.extended_model, name, key, seconds)?;
            Some(change(before, &after, without))
        };
        // The baseline has no B.
        let terms = [
            ("N", term("angle_random_walk")),
            ("B", noise::instability(of, name)),
            ("K", term("rate_random_walk")),
        ];
        for (letter, text) in terms {
            if let Some(text) = text {
                let _ = writeln!(out, "{}", item(&format!("{name}  {letter} "), &text));
            }
        }
    }
}

/// A parameter, and what it was before where it was clearly another.
fn change(before: Option<noise::Term>, after: &noise::Term, without: &str) -> String {
    let now = &after.said;
    let error = after.value.std_error.unwrap_or(0.0).max(f64::MIN_POSITIVE);
    // Of two that cannot be seen the difference says nothing.
    let seen = before.filter(|b| match b.shown {
        Shown::Nothing => false,
        Shown::Limit => after.shown != Shown::Nothing,
        Shown::Size => true,
    });
    match seen.map(|b| b.value.value) {
        Some(b) if (b - after.value.value).abs() > answer::HALF_WIDTH_95 * error => {
            let before = crate::report::plot::number(b, 3);
            format!("{now}; {without} {before}")
        }
        _ => now.clone(),
    }
}

fn write_rest(out: &mut String, d: &Diagnosis) {
    if !d.not_tested.is_empty() {
        let mut causes: Vec<&str> = d.not_tested.iter().map(|n| n.cause.as_str()).collect();
        causes.dedup();
        let _ = writeln!(
            out,
            "\n{}",
            item("not tested: ", &causes.join(", ")).trim_start()
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use diagnosis::result::{Among, Replicated};

    #[test]
    fn a_verdict_that_the_model_holds_and_what_is_said_of_its_simulations_agree() {
        let mut d: Diagnosis = serde_json::from_value(serde_json::json!({
            "format": "", "input": {"file": "", "seconds": 1.0, "rate_hz": 1.0, "samples": 1, "channels": []},
            "baseline": {}, "checks": [], "findings": [], "not_tested": [], "verdict": "adequate",
            // Too small to matter, and taken up by a term.
            "unexplained": [{"channel": "gyro_x", "what": "kurtosis 3.4 without the unnamed term"}]
        }))
        .expect("a diagnosis");
        // Farther off than 95 of 100 records of the model, and not than all.
        let after = Among {
            p_value: 0.03,
            ..Among::default()
        };
        let before = Among::default();
        d.replicates
            .insert("gyro_x".into(), Replicated { before, after });
        let said = |d: &Diagnosis| {
            let mut out = String::new();
            write_replicates(&mut out, d);
            out
        };
        let alike = "simulations of this model look like the record on every channel";
        assert_eq!(said(&d).trim(), alike);
        d.verdict = Verdict::Unexplained;
        assert!(said(&d).contains("differ from the record: gyro_x"));
    }

    #[test]
    fn an_entry_is_cut_between_its_parts_and_never_in_its_first() {
        let number = "codes that no distribution has (4 nats; 5 sigma), and a step of 0.0009 deg/s that was rounded to 0.0001 \
                      comes nearest: write the counts of the sensor, or more digits than its step has, and record again";
        assert_eq!(shortened(number), number);
        let parts = format!("a band; 1.0 to 2.0 Hz; {number}; more");
        assert_eq!(shortened(&parts), "a band; 1.0 to 2.0 Hz; ...");
        assert_eq!(
            shortened(&format!("{number}; more")),
            format!("{number}; ...")
        );
        assert_eq!(shortened("a band; 1.0 to 2.0 Hz"), "a band; 1.0 to 2.0 Hz");
    }
}
