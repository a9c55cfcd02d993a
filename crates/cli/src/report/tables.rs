//! The words and tables of the report.

use analysis::result::{Finding, Parameter, Verdict};
use maud::{Markup, html};

use super::Subject;
use super::plot::number;

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
            @for note in &d.input.notes {
                p.warning { "Note: " (note) "." }
            }
            h1 { span.word { (word) } " " (headline) }
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
                @for found in &d.findings { (finding(found)) }
            }
        }
        @if !d.unexplained.is_empty() {
            section {
                h2 { "Unexplained" }
                table {
                    thead { tr { th { "channel" } th { "what is seen" } } }
                    tbody {
                        @for left in &d.unexplained {
                            tr { td { code { (left.channel) } } td { (left.what) } }
                        }
                    }
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
                "statistics and channels. Up to 0.05 the model does not hold the record."
            }
        }
    }
}

fn finding(found: &Finding) -> Markup {
    html! {
        article {
            h2 { (found.cause.replace('_', " ")) small { " on " (found.channels.join(", ")) } }
            @if !found.what.is_empty() { p { (found.what) } }
            table.plain {
                tbody {
                    @for (name, parameter) in &found.parameters {
                        tr { th { (name.replace('_', " ")) } td.number { (value(parameter)) } }
                    }
                }
            }
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

fn value(parameter: &Parameter) -> String {
    let unit = if parameter.unit == "1" {
        ""
    } else {
        &parameter.unit
    };
    let text = match parameter.std_error {
        // The error says how many digits of the value mean anything.
        Some(error) if error > 0.0 && error < parameter.value.abs() => {
            let digits = 2.0 + (parameter.value.abs().log10().floor() - error.log10().floor());
            let digits = (digits.max(2.0) as usize).min(9);
            format!(
                "{} \u{b1} {}",
                number(parameter.value, digits),
                number(error, 2)
            )
        }
        Some(error) => format!("{} \u{b1} {}", number(parameter.value, 2), number(error, 2)),
        None => number(parameter.value, 5),
    };
    format!("{text} {unit}").trim_end().to_owned()
}

/// Gain, checks, limits, and how it was made.
pub(super) fn details(subject: &Subject<'_>) -> Markup {
    html! {
        (gain(subject))
        (baseline(subject))
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
                        th.number { "angle error, deg rms, before \u{2192} after" }
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
                                div { (over) ": " (number(*before, 3)) " \u{2192} " (number(*after, 3)) }
                            }
                        }
                    } } }
                } }
                p.note {
                    "The log score is that of data not used for the fit, extended minus baseline: above 0 it helps. "
                    "The misfit is the largest distance of the Allan curve from the model's replicates, in their standard deviations."
                }
            }
        }
    }
}

fn baseline(subject: &Subject<'_>) -> Markup {
    html! {
        section {
            h2 { "The baseline model" }
            .scroll { table {
                thead { tr { th { "channel" } th { "parameter" } th.number { "value" } } }
                tbody {
                    @for (channel, parameters) in &subject.diagnosed.diagnosis.baseline {
                        @for (name, parameter) in parameters {
                            tr {
                                td { code { (channel) } }
                                td { (name.replace('_', " ")) }
                                td.number { (value(parameter)) }
                            }
                        }
                    }
                }
            } }
        }
    }
}

fn checks(subject: &Subject<'_>) -> Markup {
    let mark = |fails: bool| html! { @if fails { span.fails { "fails" } } @else { span.passes { "passes" } } };
    html! {
        section {
            h2 { "Checks" }
            .scroll { table {
                thead { tr {
                    th { "check" } th { "channel" } th.number { "statistic" } th.number { "p" } th { "before" }
                    th { "after" } th { "what it looks at" }
                } }
                tbody { @for check in &subject.diagnosed.diagnosis.checks { tr {
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
}

fn limits(subject: &Subject<'_>) -> Markup {
    let d = &subject.diagnosed.diagnosis;
    html! {
        @if !d.detection_limits.is_empty() {
            section {
                h2 { "What this run would have found" }
                p.lead { "The smallest size of each cause that was looked for and not found, that would have been found 95 % of the time." }
                .scroll { table {
                    thead { tr { th { "cause" } th { "channel" } th { "parameter" } th.number { "size" } } }
                    tbody { @for limit in &d.detection_limits { tr {
                        td { (limit.cause.replace('_', " ")) }
                        td { code { (limit.channel) } }
                        td { (limit.parameter.replace('_', " ")) (crate::text::held_at(limit)) }
                        td.number { (number(limit.value, 2)) " " @if limit.unit != "1" { (limit.unit) } }
                    } } }
                } }
            }
        }
        @if !d.not_tested.is_empty() {
            section {
                h2 { "Not tested" }
                table {
                    thead { tr { th { "cause" } th { "why, and what to record" } } }
                    tbody { @for not in &d.not_tested { tr { td { (not.cause.replace('_', " ")) } td { (not.why) } } } }
                }
            }
        }
    }
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
