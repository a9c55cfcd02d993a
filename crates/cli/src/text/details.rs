//! What stands behind an answer: every parameter with its standard error, gains, checks that fail, what was not tested,
//! and the smallest size of each cause that would have been found.

use std::fmt::Write;

use diagnosis::result::{DetectionLimit, Diagnosis, Finding, Gain, Unexplained};

use super::{WIDTH, answer, item};
use crate::report::plot::{fixed, number, tidy};

/// The details of a diagnosis.
#[must_use]
pub fn details(d: &Diagnosis) -> String {
    let mut out = String::new();
    for finding in &d.findings {
        write_finding(&mut out, finding);
    }
    write_unexplained(&mut out, &d.unexplained);
    write_replicates(&mut out, d);
    write_checks(&mut out, d);
    if let Some(walks) = slow_noise(d) {
        let _ = writeln!(
            out,
            "\nslow noise, taken as a random walk\n{}",
            item("", &walks)
        );
    }
    if !d.not_tested.is_empty() {
        let _ = writeln!(out, "\nnot tested");
        for not in &d.not_tested {
            let _ = writeln!(out, "{}", item(&format!("{}: ", not.cause), &not.why));
        }
    }
    write_limits(&mut out, d);
    out
}

/// What has no name: each entry, and all that was seen of it.
fn write_unexplained(out: &mut String, all: &[Unexplained]) {
    if all.is_empty() {
        return;
    }
    let _ = writeln!(out, "\nleft over, without a name");
    for left in all {
        let lead = format!("{}. {}: ", left.rank, left.channel);
        let _ = writeln!(out, "{}", item(&lead, &left.what));
        if let Some(c) = &left.consequence {
            let cost = answer::consequence_of(c, left.material);
            let _ = writeln!(out, "{}", item("", &cost));
        }
        for text in [answer::lines(left), answer::modelled(left)]
            .into_iter()
            .flatten()
        {
            let _ = writeln!(out, "{}", item("", &text));
        }
        for seen in &left.details {
            let _ = writeln!(out, "{}", item("- ", seen));
        }
    }
}

/// The record among simulations of the model before and after, a line for each channel.
fn write_replicates(out: &mut String, d: &Diagnosis) {
    if d.replicates.is_empty() {
        return;
    }
    let _ = writeln!(
        out,
        "\nchance that a record of the model strays as far from its simulations"
    );
    for (channel, r) in &d.replicates {
        let chances = format!(
            "before {}, after {}",
            number(r.before.p_value, 2),
            number(r.after.p_value, 2)
        );
        let _ = writeln!(
            out,
            "{}",
            item(&format!("{channel}: {chances}; "), &r.after.strays())
        );
    }
}

/// The checks that fail, before the extension or after it, and how many pass.
fn write_checks(out: &mut String, d: &Diagnosis) {
    let failing = |c: &&diagnosis::result::Check| c.fails_before || c.fails_after;
    let count = d.checks.iter().filter(failing).count();
    let _ = writeln!(out, "\nchecks: {count} of {} fail", d.checks.len());
    for check in d.checks.iter().filter(failing) {
        let when = match (check.fails_before, check.fails_after) {
            (true, true) => "before and after",
            (true, false) => "before, not after",
            _ => "after",
        };
        let lead = format!("{} on {}, {when}: ", check.id, check.channel);
        let _ = writeln!(out, "{}", item(&lead, &check.what));
    }
}

/// One row of the detection limits: what it is of, where it holds, and the sizes by channel.
type LimitRow<'a> = (String, String, Vec<(&'a str, f64)>);

/// Detection limits: a line for each cause, a column for each channel.
fn write_limits(out: &mut String, d: &Diagnosis) {
    let mut channels: Vec<&str> = Vec::new();
    let mut rows: Vec<LimitRow<'_>> = Vec::new();
    for limit in &d.detection_limits {
        if !channels.contains(&limit.channel.as_str()) {
            channels.push(&limit.channel);
        }
        let unit = Some(limit.unit.as_str()).filter(|unit| *unit != "1");
        let unit = unit.map_or_else(String::new, |unit| format!(", {unit}"));
        let what = format!("{} {}{unit}", limit.cause, limit.parameter);
        let at = held_at(limit);
        let cell = (limit.channel.as_str(), limit.value);
        let same = |row: &&mut LimitRow<'_>| row.0 == what && row.1 == at;
        match rows.iter_mut().find(same) {
            Some((.., cells)) => cells.push(cell),
            None => rows.push((what, at, vec![cell])),
        }
    }
    if rows.is_empty() {
        return;
    }
    channels.sort_unstable();
    let title = "smallest size that this run would have found";
    // As many channels side by side as a terminal has place for.
    for group in channels.chunks(SIDE_BY_SIDE) {
        let _ = write!(out, "\n{title:<52}");
        for channel in group {
            let _ = write!(out, " {channel:>8}");
        }
        let _ = writeln!(out);
        let is_here = |(.., cells): &&LimitRow<'_>| cells.iter().any(|(c, _)| group.contains(c));
        for (what, at, cells) in rows.iter().filter(is_here) {
            let mut line = format!("    {what:<48}");
            for channel in group {
                let cell = cells.iter().find(|(name, _)| name == channel);
                let text = cell.map_or_else(|| "-".to_owned(), |(_, value)| short(*value));
                let _ = write!(line, " {text:>8}");
            }
            match line.chars().count() + at.chars().count() > WIDTH {
                true => {
                    let _ = writeln!(out, "{line}\n{}", item("  ", at.trim_start()));
                }
                false => {
                    let _ = writeln!(out, "{line}{at}");
                }
            }
        }
    }
}

/// Channels of one table of limits.
const SIDE_BY_SIDE: usize = 3;

/// The other parameters at which a limit holds, as `  at frequency 5.0 Hz`; nothing where there are none.
pub fn held_at(limit: &DetectionLimit) -> String {
    let each = limit.at.iter().map(|(name, p)| {
        let unit = Some(p.unit.as_str()).filter(|unit| *unit != "1");
        let unit = unit.map_or_else(String::new, |unit| format!(" {unit}"));
        format!("{} {}{unit}", name.replace('_', " "), short(p.value))
    });
    let all: Vec<String> = each.collect();
    if all.is_empty() {
        return String::new();
    }
    format!("  at {}", all.join(", "))
}

/// Two digits: a limit is no measurement.
fn short(value: f64) -> String {
    match value.abs() {
        size @ 0.01..1000.0 => {
            let last = size.log10().floor() as i32 - 1;
            let digits = usize::try_from(-last).unwrap_or(0);
            let unit = 10f64.powi(last);
            format!("{:.digits$}", (value / unit).round() * unit)
        }
        _ => format!("{value:.1e}"),
    }
}

fn write_finding(out: &mut String, finding: &Finding) {
    let title = format!(
        "{} on {}: parameters with their standard errors, and gain",
        finding.cause,
        finding.channels.join(", ")
    );
    let _ = writeln!(out, "\n{}", item("", &title).trim_start());
    for (name, parameter) in &finding.parameters {
        let size = measured(parameter.value, parameter.std_error);
        let unit = match parameter.unit.as_str() {
            "1" => String::new(),
            unit => format!(" {unit}"),
        };
        let _ = writeln!(out, "    {name:<24} {size}{unit}");
    }
    if !finding.what.is_empty() {
        let _ = writeln!(out, "{}", item("", &finding.what));
    }
    for rival in &finding.alternatives {
        let _ = writeln!(
            out,
            "    or: {} (log odds {:.1})",
            rival.cause, rival.log_odds
        );
    }
    if let Some(experiment) = &finding.experiment {
        let _ = writeln!(out, "{}", item("to decide: ", experiment));
    }
    if let Some(gain) = &finding.gain {
        write_gain(out, finding, gain);
    }
}

/// By how much a cause makes the model better.
fn write_gain(out: &mut String, finding: &Finding, gain: &Gain) {
    if let Some(nats) = gain.held_out_log_score_nats {
        let error = gain
            .std_error
            .map_or_else(String::new, |e| format!(" +- {e:.1}"));
        let _ = writeln!(out, "    held-out gain            {nats:.1}{error} nats");
    }
    if let Some(why) = &finding.no_gain {
        let _ = writeln!(out, "{}", item("no held-out gain: ", why));
    }
    if let Some(bic) = gain.delta_bic {
        let _ = writeln!(out, "    delta BIC                {bic:.1}");
    }
    for (what, unit, all) in [
        ("angle", "deg", &gain.angle_rms_deg),
        ("velocity", "m/s", &gain.velocity_rms_mps),
    ] {
        for (over, [before, after]) in all {
            let lead = format!("{what} error over {over}");
            let _ = writeln!(
                out,
                "    {lead:<24} {} -> {} {unit} rms",
                number(*before, 3),
                number(*after, 3)
            );
        }
    }
    if finding.confirmed_on_held_out_data == Some(false) {
        let _ = writeln!(
            out,
            "    detected in the whole run, not confirmed on held-out data"
        );
    }
}

/// Digits of a value whose error is 0.
const DIGITS: usize = 6;

/// A value with as many places as one that was measured with this standard error is shown with.
#[must_use]
pub fn rounded_as(value: f64, std_error: Option<f64>) -> String {
    match std_error {
        Some(_) => {
            let shown = measured(value, std_error);
            let end = shown.find(" +- ").unwrap_or(shown.len());
            shown[..end].to_owned()
        }
        None => tidy(value, 4),
    }
}

/// A value to the second digit of its standard error, both with the same places; to three digits where it has none.
#[must_use]
pub fn measured(value: f64, std_error: Option<f64>) -> String {
    let error = match std_error {
        Some(error) if error > 0.0 && error.is_finite() && value.is_finite() => error,
        Some(error) => return format!("{} +- {}", tidy(value, DIGITS), tidy(error, 2)),
        None => return answer::without_error(value),
    };
    // Of the rounded error: 0.0996 is 0.10.
    let exponent = |v: f64| format!("{v:.1e}").rsplit_once('e')?.1.parse::<i32>().ok();
    let place = exponent(error).unwrap_or(0) - 1;
    let size = exponent(value.abs().max(error)).unwrap_or(0);
    if (-4..9).contains(&size) && place > -10 {
        let places = (-place).max(0) as usize;
        return format!("{} +- {error:.places$}", fixed(value, places));
    }
    let digits = (size - place).clamp(1, answer::MOST_DIGITS) as usize;
    format!("{value:.digits$e} +- {error:.1e}")
}

/// Standard errors from which a random walk is there.
const ESTABLISHED: f64 = 3.0;

/// How the random walk of the baseline goes together with the bias instability that `analyze` may give.
fn slow_noise(d: &Diagnosis) -> Option<String> {
    // Where something is found, the baseline is not what the record is taken for.
    let is_found = |channel: &String| {
        let mut found = d.findings.iter();
        found.any(|f| f.channels.contains(channel))
            || d.unexplained.iter().any(|u| u.channel == *channel)
    };
    let walks: Vec<String> = (d.baseline.iter())
        .filter(|(channel, _)| !is_found(channel))
        .filter_map(|(channel, terms)| {
            let k = terms.get("rate_random_walk")?;
            let error = k.std_error.filter(|e| k.value > ESTABLISHED * e)?;
            let size = measured(k.value, Some(error));
            Some(format!("K {size} {} on {channel}", k.unit))
        })
        .collect();
    (!walks.is_empty()).then(|| {
        format!(
            "{}. That a bias instability (flicker) describes it better is not beyond doubt in this record, so it is no finding; \
             `imu-stand analyze` decides on lower odds, and may give the same noise as B",
            walks.join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_table_of_limits_is_no_wider_than_a_terminal() {
        let limits = ["acc_x", "acc_y", "acc_z", "gyro_x", "gyro_y", "gyro_z"].map(|channel| {
            serde_json::json!({
                "cause": "line", "channel": channel, "parameter": "amplitude", "value": 0.0123, "unit": "deg/s",
                "at": {"frequency": {"value": 5.0, "std_error": null, "unit": "Hz"}}
            })
        });
        let names = ["gyro_x", "gyro_y", "gyro_z"];
        let d = serde_json::json!({
            "format": "", "input": {"file": "", "seconds": 1.0, "rate_hz": 1.0, "samples": 1, "channels": []},
            "baseline": {}, "checks": [], "unexplained": [], "not_tested": [], "verdict": "adequate",
            "detection_limits": limits,
            "findings": [{
                "cause": "common_noise", "channels": names, "parameters": {}, "alternatives": [],
                "experiment": null, "gain": null
            }]
        });
        let text = super::details(&serde_json::from_value(d).expect("a diagnosis"));
        assert!(
            text.lines()
                .all(|line| line.chars().count() <= super::WIDTH),
            "{text}"
        );
        assert!(text.contains("at frequency 5.0 Hz"), "{text}");
        for channel in names {
            assert!(text.contains(channel), "{text}");
        }
    }

    #[test]
    fn figures_end_where_their_error_does_whatever_their_size() {
        for (value, error, shown) in [
            (-0.130_851, Some(2.78e-3), "-0.1309 +- 0.0028"),
            (5.32e-11, Some(6.3e-12), "5.32e-11 +- 6.3e-12"),
            (2.1e-5, Some(1.04e-6), "2.10e-5 +- 1.0e-6"),
            (3.299_877, Some(2.68e-5), "3.299877 +- 0.000027"),
            (125.3, Some(34.2), "125 +- 34"),
            (0.5, Some(0.099_6), "0.50 +- 0.10"),
            (2.0e-7, Some(0.4), "0.00 +- 0.40"),
            (601.0, None, "601"),
            (4.98, Some(0.0), "4.98 +- 0"),
        ] {
            assert_eq!(super::measured(value, error), shown);
        }
    }

    #[test]
    fn limits_have_two_digits() {
        let shorts = [0.038_21, 0.411, 4.24, 42.4, 284.0, 2.003e-4, 1234.0].map(super::short);
        assert_eq!(
            shorts,
            ["0.038", "0.41", "4.2", "42", "280", "2.0e-4", "1.2e3"]
        );
    }
}
