//! The words and tables of the report.

use diagnosis::result::{Check, Finding, NotTested, Unexplained, Verdict};
use maud::{Markup, html};
use model::file::ModelFile;
use model::record::Base;

use super::Subject;
use super::plot::number;
use crate::text::{advice, answer};

/// Verdict, input and findings: what a reader in a hurry reads.
pub(super) fn verdict(subject: &Subject<'_>, headline: &str) -> Markup {
    let d = &subject.diagnosed.diagnosis;
    let (class, word) = match d.verdict {
        Verdict::Adequate => ("adequate", "adequate"),
        Verdict::Extended => ("extended", "extended"),
        Verdict::Unexplained => ("unexplained", "unexplained"),
    };
    html! {
        header class=(class) {
            p.kicker {
                (d.input.file) " \u{b7} " (number(d.input.seconds, 3)) " s at " (format!("{:.3}", d.input.rate_hz))
                " Hz \u{b7} " (d.input.samples) " samples"
            }
            h1 { span.word { (word) } " " (headline) }
            @for note in &d.input.notes {
                p.warning { "Note: " (with_code(note)) "." }
            }
            @if d.findings.is_empty() && d.unexplained.is_empty() {
                p.lead {
                    "White noise, a random walk and a constant bias describe every channel, and no cause of the library "
                    "improves on them. How small a cause would have been found stands at the end."
                }
            }
            @if let Some(hidden) = subject.hidden {
                .hidden {
                    p { b { "Hidden in the simulated stand" } }
                    @for line in hidden.lines() { p { (line) } }
                }
            }
        }
        @if !d.findings.is_empty() {
            section.findings {
                @for found in &d.findings { (finding(found, subject.record.header.base)) }
            }
        }
        (left_over(&d.unexplained))
    }
}

/// A text with what it puts between backticks set as code.
fn with_code(text: &str) -> Markup {
    html! {
        @for (k, part) in text.split('`').enumerate() {
            @if k % 2 == 1 { code { (part) } } @else { (part) }
        }
    }
}

/// What has no name, in one row a channel.
fn left_over(all: &[Unexplained]) -> Markup {
    let mut channels: Vec<&str> = vec![];
    for left in all {
        if !channels.contains(&left.channel.as_str()) {
            channels.push(&left.channel);
        }
    }
    html! {
        @if !all.is_empty() {
            section {
                h2 { "Left over, without a name" }
                table {
                    thead { tr { th { "channel" } th { "what is seen" } } }
                    tbody {
                        @for channel in channels {
                            tr {
                                td { code { (channel) } }
                                td { @for left in all.iter().filter(|u| u.channel == channel) { (entry(left)) } }
                            }
                        }
                    }
                }
                p.note {
                    "What to do: " (advice::of(all.iter()).join(" "))
                }
            }
        }
    }
}

/// One entry, what it does, and what was seen of it, folded.
fn entry(left: &Unexplained) -> Markup {
    html! {
        div {
            (left.what)
            @if let Some(c) = &left.consequence { ". " (with_code(&answer::consequence_of(c, left.material))) }
            @if let Some(text) = answer::lines(left) { " " (text) }
            @if let Some(text) = answer::modelled(left) { " " (text) }
            @if !left.details.is_empty() {
                details.fold {
                    summary { "what was seen" }
                    ul { @for seen in &left.details { li { (seen) } } }
                }
            }
        }
    }
}

/// The record among simulations of the model before and after.
pub(super) fn replicates(subject: &Subject<'_>) -> Markup {
    let all = &subject.diagnosed.diagnosis.replicates;
    html! {
        @if !all.is_empty() {
            table {
                thead {
                    tr {
                        th { "channel" }
                        th { "chance before" }
                        th { "chance after" }
                        th { "where it strays farthest after" }
                    }
                }
                tbody {
                    @for (channel, r) in all {
                        tr {
                            td { code { (channel) } }
                            td.number { (number(r.before.p_value, 2)) }
                            td.number { (number(r.after.p_value, 2)) }
                            td { (r.after.strays()) }
                        }
                    }
                }
            }
            p {
                "The chance that a record of the model strays as far from its simulations as this one, in any of its "
                "statistics and channels. Up to 0.05 the model does not hold a channel on which something was found or is left. "
                "One on which nothing was is as far off in one record of twenty: it has to stray from all of its simulations."
            }
        }
    }
}

fn finding(found: &Finding, base: Option<Base>) -> Markup {
    html! {
        article {
            h2 { (answer::title(&found.cause)) small { " on " (found.channels.join(", ")) ", " code { (found.cause) } } }
            @if let Some(cost) = answer::cost(found) { p { (with_code(&cost)) } }
            @if let Some(remedy) = answer::remedy(found, base).filter(|_| found.material) { p { (remedy) } }
            table.plain {
                tbody {
                    @for (name, parameter) in answer::listed(found) {
                        tr { th { (name.replace('_', " ")) } td.number { (answer::found_size(&found.cause, name, parameter)) } }
                    }
                }
            }
            @if let Some(elsewhere) = answer::elsewhere(found) { p { (elsewhere) } }
            @if !found.alternatives.is_empty() {
                p.warning {
                    "This run cannot tell it from: "
                    @for (k, rival) in found.alternatives.iter().enumerate() {
                        @if k > 0 { ", " }
                        (rival.cause.replace('_', " ")) " (log odds " (number(rival.log_odds, 2)) ")"
                    }
                    "."
                    @if let Some(experiment) = &found.experiment { " To decide: " (experiment) }
                }
            } @else if let Some(experiment) = &found.experiment {
                p { "To be sure: " (experiment) }
            }
            @if found.confirmed_on_held_out_data == Some(false) {
                p.warning { "Detected in the whole run, not confirmed on data held out from the fit." }
            }
        }
    }
}

/// Gain, checks, limits, and how it was made.
pub(super) fn details(subject: &Subject<'_>) -> Markup {
    html! {
        (gain(subject))
        (checks(subject))
        (limits(subject))
        (made(subject))
    }
}

fn gain(subject: &Subject<'_>) -> Markup {
    let d = &subject.diagnosed.diagnosis;
    let gained: Vec<_> = d
        .findings
        .iter()
        .filter_map(|f| Some((f, f.gain.as_ref()?)))
        .collect();
    let or_dash = |v: Option<f64>| v.map_or_else(|| "\u{2013}".to_owned(), |v| number(v, 3));
    html! {
        @if !gained.is_empty() {
            section {
                h2 { "What each cause gains" }
                .scroll { table {
                    thead { tr {
                        th { "cause" } th { "channels" } th.number { "held-out log score, nats" }
                        th.number { "\u{394} BIC" } th.number { "Allan misfit, before \u{2192} after" }
                        th.number { "error by integration, rms, before \u{2192} after" }
                    } }
                    tbody { @for (found, gain) in gained { tr {
                        td { (found.cause.replace('_', " ")) }
                        td { (found.channels.join(", ")) }
                        td.number {
                            (or_dash(gain.held_out_log_score_nats))
                            @if let Some(error) = gain.std_error { " \u{b1} " (number(error, 2)) }
                        }
                        td.number { (or_dash(gain.delta_bic)) }
                        td.number { (or_dash(gain.allan_misfit_before)) " \u{2192} " (or_dash(gain.allan_misfit_after)) }
                        td.number {
                            @for (over, [before, after]) in &gain.angle_rms_deg {
                                div { (over) ": " (number(*before, 3)) " \u{2192} " (number(*after, 3)) " deg" }
                            }
                            @for (over, [before, after]) in &gain.velocity_rms_mps {
                                div { (over) ": " (number(*before, 3)) " \u{2192} " (number(*after, 3)) " m/s" }
                            }
                        }
                    } } }
                } }
                p.note {
                    "The log score is that of data not used for the fit, extended minus baseline, in nats: x nats make unseen data e^x times "
                    "as likely, so above 0 the cause helps. BIC (Bayesian information criterion) weighs the likelihood against the "
                    "number of parameters: more is better. "
                    "The misfit is the largest distance of the Allan curve from the model's replicates, in their standard deviations."
                }
            }
        }
    }
}

/// The noise model before and after the causes, with 95 % intervals.
pub(super) fn noise(subject: &Subject<'_>) -> Markup {
    let diagnosed = subject.diagnosed;
    let of = |model: &ModelFile, channel: &str, name: &str| {
        let term =
            crate::text::noise::term(model, channel, name, diagnosed.diagnosis.input.seconds);
        term.map(|term| term.said)
    };
    let dash = || "\u{2013}".to_owned();
    html! {
        section {
            h2 { "The noise, before and after the causes" }
            .scroll { table {
                thead { tr {
                    th { "channel" } th { "parameter" } th.number { "without the causes" } th.number { "beside the causes" }
                } }
                tbody {
                    @for channel in &diagnosed.extended_model.channels {
                        @for name in channel.baseline.keys() {
                            tr {
                                td { code { (channel.name) } }
                                td { (baseline_name(name, &channel.unit)) }
                                td.number { (of(&diagnosed.baseline_model, &channel.name, name).unwrap_or_else(dash)) }
                                td.number { (of(&diagnosed.extended_model, &channel.name, name).unwrap_or_else(dash)) }
                            }
                        }
                        @if let Some(b) = crate::text::noise::instability(diagnosed, &channel.name) {
                            tr {
                                td { code { (channel.name) } }
                                td { "bias instability" }
                                td.number { (dash()) }
                                td.number { (b) }
                            }
                        }
                    }
                }
            } }
            p.note {
                "A bias instability B (flicker noise) is in a model only where it was found. Where it was not, the limit is the size that "
                "would have been found 95 % of the time. The lowest point of an Allan curve over 0.664 is no B: white noise alone has one."
            }
        }
    }
}

/// What a parameter of the noise is called: the keys are a gyro's.
fn baseline_name(key: &str, unit: &str) -> String {
    let of = match (key, model::integral::of(unit).0) {
        ("angle_random_walk", "velocity") => "velocity_random_walk",
        ("rate_random_walk", "velocity") => "acceleration_random_walk",
        _ => key,
    };
    of.replace('_', " ")
}

/// The checks that fail, and all of them folded.
fn checks(subject: &Subject<'_>) -> Markup {
    let all = &subject.diagnosed.diagnosis.checks;
    let failing: Vec<&Check> = all
        .iter()
        .filter(|c| c.fails_before || c.fails_after)
        .collect();
    html! {
        section {
            h2 { "Checks" }
            @if failing.is_empty() {
                p { "All " (all.len()) " checks pass." }
            } @else {
                p { (failing.len()) " of " (all.len()) " checks fail, before the extension or after it:" }
                div.mended[failing.iter().all(|c| !c.fails_after)] { (check_table(&failing)) }
                (mended(&failing))
            }
            details.fold {
                summary { "All checks" }
                (check_table(&all.iter().collect::<Vec<_>>()))
            }
        }
    }
}

/// In print, the checks that the extension mended by name alone: the table there has those that still fail.
fn mended(failing: &[&Check]) -> Markup {
    let mended: Vec<_> = failing.iter().filter(|c| !c.fails_after).collect();
    let channels: std::collections::BTreeSet<&str> =
        mended.iter().map(|c| c.channel.as_str()).collect();
    let names = |channel: &str| {
        let own = mended.iter().filter(|c| c.channel == channel);
        let names: Vec<String> = own.map(|c| c.id.replace('_', " ")).collect();
        names.join(", ")
    };
    html! {
        @if !mended.is_empty() {
            p.printed {
                "They fail before the extension and pass after it (the page on a screen has their sizes): "
                @for (k, channel) in channels.iter().enumerate() {
                    @if k > 0 { "; " }
                    code { (channel) } " " (names(channel))
                }
                "."
            }
        }
    }
}

fn check_table(checks: &[&Check]) -> Markup {
    let mark = |fails: bool| html! { @if fails { span.fails { "fails" } } @else { span.passes { "passes" } } };
    html! {
        .scroll { table {
            thead { tr {
                th { "check" } th { "channel" } th.number { "statistic" } th.number { "p" } th { "before" }
                th { "after" } th { "what it looks at" }
            } }
            tbody { @for check in checks { tr.mended[check.fails_before && !check.fails_after] {
                td { (check.id.replace('_', " ")) }
                td { code { (check.channel) } }
                td.number { (number(check.statistic, 3)) }
                td.number { (check.p_value.map_or_else(|| "\u{2013}".to_owned(), chance)) }
                td { (mark(check.fails_before)) }
                td { (mark(check.fails_after)) }
                td { (check.what) }
            } } }
        } }
    }
}

fn limits(subject: &Subject<'_>) -> Markup {
    let d = &subject.diagnosed.diagnosis;
    html! {
        @if !d.detection_limits.is_empty() {
            section {
                h2 { "What this run would have found" }
                p.lead { "The smallest size of each cause that was looked for and not found, that would have been found 95 % of the time." }
                details.fold { summary { "All sizes" } .scroll { table {
                    thead { tr { th { "cause" } th { "channel" } th { "parameter" } th.number { "size" } } }
                    tbody { @for limit in &d.detection_limits { tr {
                        td { (limit.cause.replace('_', " ")) }
                        td { code { (limit.channel) } }
                        td { (limit.parameter.replace('_', " ")) (crate::text::held_at(limit)) }
                        td.number { (number(limit.value, 2)) " " @if limit.unit != "1" { (limit.unit) } }
                    } } }
                } } }
            }
        }
        @if !d.not_tested.is_empty() {
            section {
                h2 { "Not tested" }
                table.halves {
                    thead { tr { th { "cause" } th { "why, and what to record" } } }
                    tbody { @for (causes, why) in by_reason(&d.not_tested) { tr { td { (causes) } td { (why) } } } }
                }
            }
        }
    }
}

/// What was not tested, one entry a reason: a base that moves rules out twenty causes by one.
fn by_reason(all: &[NotTested]) -> Vec<(String, &str)> {
    let mut out: Vec<(String, &str)> = vec![];
    for not in all {
        let cause = not.cause.replace('_', " ");
        match out.iter_mut().find(|(_, why)| *why == not.why) {
            Some((causes, _)) => *causes += &format!(", {cause}"),
            None => out.push((cause, &not.why)),
        }
    }
    out
}

fn made(subject: &Subject<'_>) -> Markup {
    let d = &subject.diagnosed.diagnosis;
    html! {
        section.made {
            h2 { "How this was made" }
            table.plain { tbody {
                tr { th { "command" } td { code { (subject.command) } } }
                tr { th { "file" } td { (d.input.file) " (" (d.input.channels.join(", ")) ")" } }
                @if let Some(hash) = subject.hash { tr { th { "digest" } td { code { (hash) } } } }
                tr { th { "seed" } td { (subject.seed) } }
                tr { th { "program" } td { "imu-stand " (env!("CARGO_PKG_VERSION")) } }
            } }
        }
    }
}

/// A chance; below what a double holds it is not 0.
fn chance(p: f64) -> String {
    if p > 0.0 {
        number(p, 2)
    } else {
        "< 1e-300".to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_between_backticks_is_code_and_the_rest_stays_text() {
        let said = with_code("too small (`--matters`) & `<b>`").into_string();
        assert_eq!(
            said,
            "too small (<code>--matters</code>) &amp; <code>&lt;b&gt;</code>"
        );
    }

    #[test]
    fn causes_that_one_reason_rules_out_are_one_entry() {
        let not = |cause: &str, why: &str| NotTested {
            cause: cause.into(),
            why: why.into(),
        };
        let all = [
            not("warm_up", "it moves"),
            not("motor_bias", "no motor channel"),
            not("rate_ramp", "it moves"),
        ];
        assert_eq!(
            by_reason(&all),
            [
                ("warm up, rate ramp".to_owned(), "it moves"),
                ("motor bias".to_owned(), "no motor channel")
            ]
        );
    }
}
