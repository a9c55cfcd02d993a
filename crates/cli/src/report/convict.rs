//! The figure that convicts each cause: the one that the engine drew of it, or the view that its effect names, of the
//! measurement beside a simulation without the cause.

use diagnosis::result::{Evidence, Finding};
use maud::{Markup, html};
use model::effect::Plot;
use model::effects::effect;
use model::record::Record;

use super::exhibits::views::{self, Pair};
use super::plot::{self, Figure};
use super::shock::{self, Knock};
use super::{ReportError, Subject, at_two_widths, standalone};

/// Share of its frequency by which the view of a line reaches either side, and that reach at least, Hz.
const AROUND_LINE: f64 = 0.1;
const LEAST_AROUND_HZ: f64 = 0.2;

/// What convicts a cause on a channel.
struct Convicting {
    cause: String,
    channel: String,
    title: String,
    caption: String,
    figure: Figure,
}

/// Of all findings.
fn all(subject: &Subject<'_>) -> Vec<Convicting> {
    let diagnosed = subject.diagnosed;
    let mut without = None;
    let mut out = vec![];
    let mut drawn: Vec<&Evidence> = vec![];
    for finding in &diagnosed.diagnosis.findings {
        let own: Vec<&Evidence> = (diagnosed.evidence.iter())
            .filter(|e| e.cause == finding.cause && finding.channels.contains(&e.channel))
            .filter(|e| fits(e))
            .collect();
        // Of two steps of one axis each has its figure once.
        for evidence in &own {
            if drawn.iter().any(|d| std::ptr::eq(*d, *evidence)) {
                continue;
            }
            drawn.push(evidence);
            out.push(Convicting {
                cause: evidence.cause.clone(),
                channel: evidence.channel.clone(),
                title: evidence.title.clone(),
                caption: caption(evidence),
                figure: standalone::figure(evidence),
            });
        }
        if own.is_empty() {
            let without = without.get_or_insert_with(|| without_causes(subject));
            out.extend(without.as_ref().and_then(|r| view(subject, finding, r)));
        }
    }
    out
}

/// The figures of all findings, each with its caption.
///
/// # Errors
/// [`ReportError`] where one cannot be drawn.
pub(super) fn figures(subject: &Subject<'_>) -> Result<Vec<Markup>, ReportError> {
    all(subject).iter().map(captioned).collect()
}

/// The same as files: `cause-channel.svg` and the SVG, with title and legend on white.
///
/// # Errors
/// [`ReportError`] where one cannot be drawn.
pub(super) fn files(subject: &Subject<'_>) -> Result<Vec<(String, String)>, ReportError> {
    let mut out: Vec<(String, String)> = Vec::new();
    for shown in all(subject) {
        let stem = format!("{}-{}", shown.cause, shown.channel);
        let again = out.iter().filter(|(name, _)| name.starts_with(&stem));
        let name = match again.count() {
            0 => format!("{stem}.svg"),
            n => format!("{stem}-{}.svg", n + 1),
        };
        let figure = Figure {
            width: standalone::SIZE.0,
            height: standalone::HEIGHT,
            ..shown.figure
        };
        out.push((name, standalone::alone(&shown.title, &figure)?));
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

/// What an engine's figure shows, by what it has at its axes. An effect says it of the kind of figure that it names; the
/// engine draws another where a term has another form, as the surge of a motor has, which it shows in time.
fn caption(evidence: &Evidence) -> String {
    let docs = effect(&evidence.cause).map(|e| e.docs());
    let Some(docs) = docs.filter(|d| evidence.caption == d.figure) else {
        return evidence.caption.clone();
    };
    let plot = docs.example.plot;
    let (is_said, own) = match evidence.x_label.as_str() {
        _ if evidence.log_x => (
            matches!(plot, Plot::Spectrum),
            "Spectrum of the rate with the model before and after.".to_owned(),
        ),
        "frequency, Hz" => (
            matches!(plot, Plot::Lines { .. }),
            "Amplitude spectrum of the rate around it, other terms taken out.".to_owned(),
        ),
        "time, s" => (
            matches!(plot, Plot::RateInTime { .. }),
            "Rate in time blocks, the other terms taken out, with the course that the model gives it.".to_owned(),
        ),
        other => (
            matches!(plot, Plot::RateAgainst(_)),
            format!("Rate in time blocks, the other terms taken out, against {other}."),
        ),
    };
    match is_said {
        true => docs.figure.to_owned(),
        false => own,
    }
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
fn view(subject: &Subject<'_>, finding: &Finding, without: &Record) -> Option<Convicting> {
    let docs = effect(&finding.cause)?.docs();
    let rate_hz = subject.diagnosed.diagnosis.input.rate_hz;
    let shown = |channel: &str, figure, caption| Convicting {
        cause: finding.cause.clone(),
        channel: channel.to_owned(),
        title: format!("{channel}: {}", docs.title),
        caption,
        figure,
    };
    if finding.cause == model::effects::shock::ID {
        let knock = Knock {
            finding,
            measured: subject.record,
            without,
            rate_hz,
        };
        if let Some(drawn) = shock::drawing(&knock) {
            return Some(shown(&drawn.channel, drawn.figure, drawn.caption));
        }
    }
    let channel = finding
        .channels
        .iter()
        .find(|c| subject.record.channel(c).is_some());
    let channel = channel.map_or("gyro_x", String::as_str);
    let pair = Pair {
        with: subject.record,
        without,
        labels: ["measured", "simulated without it"],
        at: (finding.times_s.first()).map(|t| (t * rate_hz).round() as usize),
    };
    let plot = place(docs.example.plot, finding, channel);
    let figure = views::figure(plot, channel, &pair).ok()?;
    Some(shown(channel, figure, views::caption(plot, pair.labels)))
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

/// A figure with title and caption.
fn captioned(shown: &Convicting) -> Result<Markup, ReportError> {
    let wide = Figure {
        width: plot::WIDE,
        height: 400,
        ..shown.figure.clone()
    };
    Ok(html! {
        figure {
            (at_two_widths(&wide)?)
            figcaption { b { (shown.title) ". " } (shown.caption) }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn evidence(cause: &str, x_label: &str, log_x: bool) -> Evidence {
        Evidence {
            cause: cause.into(),
            title: String::new(),
            channel: "gyro_x".into(),
            x_label: x_label.into(),
            y_label: "rate, deg/s".into(),
            log_x,
            log_y: log_x,
            series: vec![],
            caption: effect(cause).map_or("", |e| e.docs().figure).into(),
        }
    }

    #[test]
    fn a_caption_says_what_stands_at_the_axes_whatever_the_cause() {
        let kinds = [
            ("time, s", false, "in time blocks"),
            ("pwm, counts", false, "against"),
            ("frequency, Hz", false, "Amplitude spectrum"),
            ("frequency, Hz", true, "Spectrum of the rate"),
        ];
        for effect in model::effects::EFFECTS {
            for (x_label, log_x, words) in kinds {
                let said = caption(&evidence(effect.id(), x_label, log_x));
                let in_time = x_label == "time, s";
                assert!(
                    said.contains(words),
                    "{} over {x_label}: {said}",
                    effect.id()
                );
                assert!(
                    !(in_time && said.contains("against")),
                    "{}: {said}",
                    effect.id()
                );
            }
        }
        // The surge of a motor is drawn in time, its steady part over the duty.
        let said = caption(&evidence("motor_bias", "time, s", false));
        assert!(
            said.starts_with("Rate in time blocks, the other terms"),
            "{said}"
        );
        let said = caption(&evidence("motor_bias", "pwm, counts", false));
        assert_eq!(said, "Rate in time blocks against duty.");
        // What the engine says of a figure of its own stays.
        let own = Evidence {
            caption: "Two levels.".into(),
            ..evidence("telegraph", "time, s", false)
        };
        assert_eq!(caption(&own), "Two levels.");
    }

    #[test]
    fn a_view_says_itself_what_it_shows() {
        for effect in model::effects::EFFECTS {
            let plot = effect.docs().example.plot;
            let said = views::caption(plot, ["measured", "simulated without it"]);
            // No view is whitened, or has terms taken out, or a model in it.
            for word in ["hitened", "taken out", "before and after", "each of them"] {
                assert!(!said.contains(word), "{}: {said}", effect.id());
            }
            assert!(
                said.ends_with(": measured and simulated without it."),
                "{said}"
            );
        }
    }
}
