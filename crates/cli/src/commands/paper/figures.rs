//! The page and its figures.

use std::path::Path;

use imu_stand::report::plot::{
    AFTER, BEFORE, Drawn, Figure, HALF, Layer, MEASURED, WIDE, envelope, number,
};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use miette::Result;
use model::record::sampling::Sampling;
use noise::allan::TauGrid;
use noise::analyze::{Analysis, ChannelAnalysis, Interval};
use noise::attitude::angle_growth;
use noise::fit::{Spectrum, fit};
use noise::paper_model::{PaperStand, STATED_ARW_DEG_SQRT_H, STATED_FLAT_DEG_H, Slow};

use super::criticism::{Claim, Hypothesis, LooksAlike, Range};
use super::{Arguments, Shown};

const STYLE: &str = include_str!("../../report/style.css");
/// Columns of a thinned signal.
const COLUMNS: usize = 700;
/// Instants at which the angle is drawn.
const ANGLE_POINTS: usize = 300;
/// Part of the record over which the bias is taken before the angle is integrated.
const CALIBRATION: f64 = 0.1;

/// What the page is made of.
pub struct Subject<'a> {
    pub arguments: &'a Arguments,
    pub shown: &'a Shown,
    pub analysis: &'a Analysis,
    pub found: &'a ChannelAnalysis,
    pub stand: &'a PaperStand,
    pub hypotheses: &'a [Hypothesis],
    pub claims: &'a [Claim],
    pub alike: &'a LooksAlike,
}

/// A figure with its interval, as people read it.
pub fn interval_text(interval: &Interval) -> String {
    let text = |v: Option<f64>| v.map_or_else(|| "-".to_owned(), |v| number(v, 3));
    match interval.value {
        Some(value) => format!(
            "{} [{} .. {}] {}",
            number(value, 3),
            text(interval.low),
            text(interval.high),
            interval.unit
        ),
        None => format!(
            "no value, at most {} {}",
            text(interval.high),
            interval.unit
        ),
    }
}

fn range_text(range: Range, digits: usize) -> String {
    format!(
        "{} ({} .. {})",
        number(range.median, digits),
        number(range.low, digits),
        number(range.high, digits)
    )
}

/// Draws and writes everything.
pub fn write(subject: &Subject<'_>) -> Result<()> {
    let out = &subject.arguments.out;
    let signal = subject
        .shown
        .record
        .channel(&subject.arguments.channel)
        .map(|c| c.values.as_slice())
        .unwrap_or_default();
    let tau0 = 1.0 / subject.analysis.input.rate_hz;
    let figures = [
        ("figure-3", plain(signal, tau0, WIDE)),
        ("figure-4", angle(subject, signal)?),
        ("figure-5", allan(subject, false)),
        ("figure-5-hypotheses", allan(subject, true)),
        (
            "figure-8a",
            plain(&subject.alike.pair[0], tau0_of(subject), HALF),
        ),
        (
            "figure-8b",
            plain(&subject.alike.pair[1], tau0_of(subject), HALF),
        ),
    ];
    let mut drawn = Vec::new();
    for (name, figure) in &figures {
        let svg = figure.svg().map_err(|error| {
            miette::miette!(help = "is the record empty or constant?", "{name}: {error}")
        })?;
        super::super::write(&out.join(format!("{name}.svg")), &svg)?;
        drawn.push(html! { (PreEscaped(&svg)) (figure.legend()) });
    }
    super::super::write(
        &out.join("paper.html"),
        &page(subject, &drawn, out).into_string(),
    )
}

fn tau0_of(subject: &Subject<'_>) -> f64 {
    subject.stand.tau0
}

fn plain(values: &[f64], tau0: f64, width: u32) -> Figure {
    let time: Vec<f64> = (0..values.len()).map(|i| i as f64 * tau0).collect();
    Figure {
        x_label: "time, s".to_owned(),
        y_label: "rate, deg/s".to_owned(),
        width,
        height: 300,
        layers: vec![Drawn {
            label: None,
            colour: MEASURED,
            layer: Layer::Line(envelope(&time, values, COLUMNS)),
        }],
        ..Figure::default()
    }
}

fn angle(subject: &Subject<'_>, values: &[f64]) -> Result<Figure> {
    let sampling = Sampling::of(&subject.shown.record, subject.arguments.input.rate)
        .map_err(super::super::explain)?;
    let runs = sampling.runs_of(values);
    let fitted = fit(&Spectrum::of(values, &runs, sampling.tau0));
    let length = runs.iter().map(ExactSizeIterator::len).max().unwrap_or(0) as f64 * sampling.tau0;
    let points = angle_growth(values, &runs, &fitted, CALIBRATION * length, ANGLE_POINTS);
    Ok(Figure {
        x_label: format!(
            "time since the calibration of {:.0} s, s",
            CALIBRATION * length
        ),
        y_label: "angle, deg".to_owned(),
        width: WIDE,
        height: 300,
        layers: vec![
            Drawn::new(
                "1 sigma and 2 sigma, as the fitted noise predicts",
                AFTER,
                Layer::Band(
                    points
                        .iter()
                        .map(|p| {
                            (
                                p.t_s,
                                p.expected - 2.0 * p.sigma,
                                p.expected + 2.0 * p.sigma,
                            )
                        })
                        .collect(),
                ),
            ),
            Drawn {
                label: None,
                colour: AFTER,
                layer: Layer::Band(
                    points
                        .iter()
                        .map(|p| (p.t_s, p.expected - p.sigma, p.expected + p.sigma))
                        .collect(),
                ),
            },
            Drawn::new(
                "integral of the rate",
                MEASURED,
                Layer::Line(points.iter().map(|p| (p.t_s, p.angle)).collect()),
            ),
        ],
        ..Figure::default()
    })
}

fn allan(subject: &Subject<'_>, with_hypotheses: bool) -> Figure {
    let mut layers = if with_hypotheses {
        vec![]
    } else {
        measured(subject)
    };
    layers.push(Drawn::new(
        "the paper's line, 5.27 deg/sqrt(h) and slope -1/2, continued",
        BEFORE,
        Layer::Line(
            [0.1, 1.0, 10.0, 100.0]
                .map(|tau: f64| (tau, 60.0 * STATED_ARW_DEG_SQRT_H / tau.sqrt()))
                .into(),
        ),
    ));
    layers.push(Drawn::new(
        "the paper's level, 150 deg/h",
        BEFORE,
        Layer::Line(vec![(10.0, STATED_FLAT_DEG_H), (100.0, STATED_FLAT_DEG_H)]),
    ));
    if with_hypotheses {
        layers.extend(curves(subject));
    }
    Figure {
        x_label: "cluster time, s".to_owned(),
        y_label: "Allan deviation, deg/h".to_owned(),
        log_x: true,
        log_y: true,
        width: WIDE,
        height: 460,
        layers,
        ..Figure::default()
    }
}

/// The deviation of the record, in its interval.
fn measured(subject: &Subject<'_>) -> Vec<Drawn> {
    let points: Vec<_> = subject.found.deviations.values().flatten().collect();
    vec![
        Drawn::new(
            "95 % interval",
            AFTER,
            Layer::Band(
                points
                    .iter()
                    .map(|p| (p.tau_s, 3600.0 * p.low, 3600.0 * p.high))
                    .collect(),
            ),
        ),
        Drawn::new(
            "overlapping Allan deviation of the record",
            MEASURED,
            Layer::Line(
                points
                    .iter()
                    .map(|p| (p.tau_s, 3600.0 * p.deviation))
                    .collect(),
            ),
        ),
    ]
}

/// What the hypotheses expect.
fn curves(subject: &Subject<'_>) -> Vec<Drawn> {
    let mut layers = vec![];
    for (hypothesis, colour) in subject
        .hypotheses
        .iter()
        .filter(|h| h.stand.slow != Slow::Nothing)
        .zip([AFTER, AFTER, MEASURED, MEASURED])
    {
        let curve = TauGrid::Log(10)
            .factors(2000)
            .into_iter()
            .map(|m| {
                (
                    m as f64 * hypothesis.stand.tau0,
                    3600.0 * hypothesis.stand.deviation(m),
                )
            })
            .collect();
        layers.push(Drawn::new(&hypothesis.name, colour, Layer::Line(curve)));
    }
    layers
}

fn page(subject: &Subject<'_>, drawn: &[Markup], out: &Path) -> Markup {
    let from = &subject.shown.from;
    let [three, four, five, five_b, eight_a, eight_b] = drawn else {
        return html! {};
    };
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "The paper's figures, and what does not fit" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header.unexplained {
                    p.kicker { "Istomin and Belyaev, 2009: the error model of a MEMS gyro, on the stand" }
                    h1 { "The two numbers of the paper do not fit together" }
                    p { (subject.claims.first().map_or("", |c| c.found.as_str())) }
                }
                (numbers(subject))
                section {
                    h2 { "Figure 3: the gyro at rest" }
                    figure { (three) figcaption { (from) ", " (subject.arguments.channel) "." } }
                    h2 { "Figure 4: its integral" }
                    figure { (four) figcaption {
                        "The bias is the mean over the calibration; from there the angle drifts. The bands are what the noise \
                         fitted to this record predicts for it." } }
                    h2 { "Figure 5: the Allan deviation" }
                    figure { (five) figcaption {
                        "The interval at 100 s says how little a record of "
                        (format!("{:.0}", subject.analysis.input.seconds)) " s knows there." } }
                    figure { (five_b) figcaption {
                        "Expected curves of noises sized by the paper's two numbers. None has slope -1/2 up to 10 s and a \
                         level of 150 deg/h from there." } }
                }
                (table(subject))
                section {
                    h2 { "Figure 8: measured (a) beside simulated (b)" }
                    div.pair {
                        figure { (eight_a) figcaption { b { "a" } " a stand with " (subject.alike.hidden) } }
                        figure { (eight_b) figcaption { b { "b" } " the model of figure 1: white noise and random walk" } }
                    }
                    (alike(subject.alike))
                }
                section {
                    h2 { "What does not fit" }
                    @for claim in subject.claims {
                        article { h2 { (claim.stated) } p { (claim.found) } }
                    }
                }
                p.note {
                    "Made by " code { (super::super::report::command()) } "; numbers in "
                    code { (out.join("paper.json").display()) } "."
                }
            }
        }
    }
}

fn numbers(subject: &Subject<'_>) -> Markup {
    let paper = &subject.found.paper;
    html! {
        section {
            h2 { "The two numbers, with intervals" }
            table.plain {
                tr { th { "" } th { "the paper" } th { (subject.shown.from) } th { "by likelihood, same record" } }
                tr {
                    td { "angle random walk (line, 0.1 .. 10 s)" }
                    td.number { (STATED_ARW_DEG_SQRT_H) " deg/sqrt(h)" }
                    td.number { (interval_text(&paper.angle_random_walk)) }
                    td.number { "N " (interval_text(&subject.found.parameters.angle_random_walk)) }
                }
                tr {
                    td { "in-run bias stability (level, 10 .. 100 s)" }
                    td.number { (STATED_FLAT_DEG_H) " deg/h" }
                    td.number { (interval_text(&paper.in_run_bias_stability)) }
                    td.number {
                        "B " (interval_text(&subject.found.parameters.bias_instability)) br;
                        "K " (interval_text(&subject.found.parameters.rate_random_walk))
                    }
                }
            }
            @if !subject.shown.measured {
                p.note {
                    "The record is simulated by the paper's equation 1 with N = "
                    (number(60.0 * subject.stand.angle_random_walk_n, 3)) " deg/sqrt(h) and K = "
                    (number(subject.stand.size, 3))
                    " deg/s/sqrt(s), so sized that its procedure is expected to read the stated two numbers."
                }
            }
            @for note in &paper.notes { p.warning { (note) } }
        }
    }
}

fn table(subject: &Subject<'_>) -> Markup {
    html! {
        section {
            h2 { "What 600 s of each noise read under the paper's procedure" }
            p.lead { "Median and middle 95 % of simulated records, the converter's steps included." }
            div.scroll { table {
                tr {
                    th { "noise" } th { "records" } th { "line, deg/sqrt(h)" } th { "slope 0.1 .. 10 s" }
                    th { "level, deg/h" } th { "slope 10 .. 100 s" } th { "as the paper says" }
                }
                @for h in subject.hypotheses {
                    tr {
                        td { (h.name) }
                        td.number { (h.runs) }
                        td.number { (range_text(h.line_deg_sqrt_h, 3)) }
                        td.number { (range_text(h.line_slope, 3)) }
                        td.number { (range_text(h.level_deg_h, 3)) }
                        td.number { (range_text(h.level_slope, 2)) }
                        td.number { (format!("{:.1} %", 100.0 * h.share_with_both)) }
                    }
                }
            } }
            p.note { "As the paper says: a line as steep as -0.49 and a level of 150 deg/h or more." }
        }
    }
}

fn alike(alike: &LooksAlike) -> Markup {
    html! {
        p.lead {
            "They look alike, and one of them is wrong. Over " (alike.draws) " such pairs the rms of (a) is "
            (range_text(alike.rms_ratio, 3)) " of that of (b), its range " (range_text(alike.range_ratio, 3))
            ". The diagnosis names the temperature in " (format!("{:.0} %", 100.0 * alike.named))
            " of the (a), finds nothing in " (format!("{:.0} %", 100.0 * alike.called_adequate))
            " of them, and finds something in " (format!("{:.0} %", 100.0 * alike.false_alarms)) " of the (b)."
        }
    }
}
