//! The figure that convicts each cause: the one that the engine drew of it, or the view that its effect names, of the
//! measurement beside a simulation without the cause.

use diagnosis::result::{Evidence, Finding};
use maud::{Markup, PreEscaped, html};
use model::effect::Plot;
use model::effects::effect;
use model::record::Record;

use super::exhibits::views::{self, Pair};
use super::plot::{self, Figure};
use super::{ReportError, Subject, drawing, standalone};

/// Width and height of a figure on a telephone, units of its view box: letters keep their size at 390 px.
const NARROW: (u32, u32) = (430, 320);
/// Share of its frequency by which the view of a line reaches either side, and that reach at least, Hz.
const AROUND_LINE: f64 = 0.1;
const LEAST_AROUND_HZ: f64 = 0.2;

/// The figures of all findings, each with its caption.
///
/// # Errors
/// [`ReportError`] where one cannot be drawn.
pub(super) fn figures(subject: &Subject<'_>) -> Result<Vec<Markup>, ReportError> {
    let diagnosed = subject.diagnosed;
    let mut without = None;
    let mut out = vec![];
    for finding in &diagnosed.diagnosis.findings {
        let own: Vec<&Evidence> = (diagnosed.evidence.iter())
            .filter(|e| e.cause == finding.cause && finding.channels.contains(&e.channel))
            .filter(|e| fits(e))
            .collect();
        for evidence in &own {
            out.push(captioned(
                &standalone::figure(evidence),
                &evidence.title,
                &evidence.caption,
            )?);
        }
        if own.is_empty() {
            let without = without.get_or_insert_with(|| without_causes(subject));
            if let Some(view) = without.as_ref().and_then(|r| view(subject, finding, r)) {
                out.push(view?);
            }
        }
    }
    Ok(out)
}

/// Whether the engine's figure is of the kind that the effect says convicts it: a spectrum does not show what is seen in
/// time or by another channel's value.
fn fits(evidence: &Evidence) -> bool {
    let Some(plot) = effect(&evidence.cause).map(|e| e.docs().example.plot) else {
        return true;
    };
    let by_value = matches!(plot, Plot::RateByValue(_));
    let in_time = matches!(plot, Plot::RateInTime { .. });
    !(by_value || in_time && evidence.log_x)
}

/// A simulation of the baseline in the world of the record; `None` where the model cannot be simulated.
fn without_causes(subject: &Subject<'_>) -> Option<Record> {
    /// Half of the counts of the stand's gyro, 14 bits and a sign.
    const COUNTS: f64 = 8192.0;
    let mut model = subject.diagnosed.baseline_model.clone();
    // A record that names no step gets one that its largest reading fits into.
    for channel in model.channels.iter_mut().filter(|c| c.lsb.is_none()) {
        let readings = subject.record.channel(&channel.name)?;
        let [low, high] = model::effect::extremes(&readings.values);
        let largest = low.abs().max(high.abs());
        channel.lsb = (largest > 0.0 && largest.is_finite()).then_some(largest / COUNTS);
    }
    model::simulate_in_the_world_of(&model, subject.record, model.rate_hz, subject.seed).ok()
}

/// The view that the effect names; `None` where the record lacks what it is made of.
fn view(
    subject: &Subject<'_>,
    finding: &Finding,
    without: &Record,
) -> Option<Result<Markup, ReportError>> {
    let docs = effect(&finding.cause)?.docs();
    let channel = finding
        .channels
        .iter()
        .find(|c| subject.record.channel(c).is_some());
    let channel = channel.map_or("gyro_x", String::as_str);
    let rate_hz = subject.diagnosed.diagnosis.input.rate_hz;
    let pair = Pair {
        with: subject.record,
        without,
        labels: ["measured", "simulated without it"],
        at: (finding.times_s.first()).map(|t| (t * rate_hz).round() as usize),
    };
    let figure = views::figure(place(docs.example.plot, finding, channel), channel, &pair).ok()?;
    let title = format!("{channel}: {}", docs.title);
    Some(captioned(&figure, &title, docs.figure))
}

/// The view of this finding: on its own axis, along the channel that it follows most, about its own frequency.
fn place(plot: Plot, finding: &Finding, channel: &str) -> Plot {
    let of_axis = |names: [&'static str; 3]| {
        let axis = ["gyro_x", "gyro_y", "gyro_z"]
            .iter()
            .position(|g| *g == channel);
        axis.map(|i| names[i])
    };
    match plot {
        Plot::RateAgainst(name) if name.starts_with("temp_") => {
            Plot::RateAgainst(of_axis(["temp_x", "temp_y", "temp_z"]).unwrap_or(name))
        }
        Plot::RateByValue(name) => Plot::RateByValue(strongest(finding).unwrap_or(name)),
        Plot::AxisAgainst(name) => {
            let others = ["gyro_x", "gyro_y", "gyro_z"].into_iter();
            let mut shared =
                others.filter(|g| *g != channel && finding.channels.iter().any(|c| c == g));
            Plot::AxisAgainst(shared.next().unwrap_or(name))
        }
        Plot::Lines { .. } => {
            let f = finding.parameters.get("frequency").map_or(0.0, |p| p.value);
            let reach = (AROUND_LINE * f).max(LEAST_AROUND_HZ);
            Plot::Lines {
                from_hz: (f - reach).max(0.0),
                to_hz: f + reach,
            }
        }
        other => other,
    }
}

/// The channel whose coefficient is the most errors from 0.
fn strongest(finding: &Finding) -> Option<&'static str> {
    const FOLLOWED: [(&str, &str); 6] = [
        ("acc_x", "acc_x"),
        ("acc_y", "acc_y"),
        ("acc_z", "acc_z"),
        ("from_gyro_x", "gyro_x"),
        ("from_gyro_y", "gyro_y"),
        ("from_gyro_z", "gyro_z"),
    ];
    let score = |parameter: &str| {
        let p = finding.parameters.get(parameter)?;
        Some((p.value / p.std_error.filter(|e| *e > 0.0)?).abs())
    };
    let scored = FOLLOWED
        .iter()
        .filter_map(|(parameter, channel)| Some((score(parameter)?, *channel)));
    scored.max_by(|a, b| a.0.total_cmp(&b.0)).map(|s| s.1)
}

/// A figure for a wide page and for a telephone, of which the style shows one.
fn captioned(figure: &Figure, title: &str, caption: &str) -> Result<Markup, ReportError> {
    let wide = Figure {
        width: plot::WIDE,
        height: 400,
        ..figure.clone()
    };
    let narrow = Figure {
        width: NARROW.0,
        height: NARROW.1,
        ..figure.clone()
    };
    Ok(html! {
        figure {
            div.wide { (drawing(&wide)?) }
            div.narrow { (PreEscaped(narrow.svg()?)) }
            figcaption { b { (title) ". " } (caption) }
        }
    })
}
