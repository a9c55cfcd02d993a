//! The figure that convicts each cause: the one that the engine drew of it, or the view that its effect names, of the
//! measurement beside a simulation without the cause.

use diagnosis::result::{Evidence, Finding};
use maud::{Markup, html};
use model::effect::Plot;
use model::effects::effect;
use model::file::ModelFile;
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
            let without = simulated_without(subject, finding);
            out.extend(without.and_then(|r| view(subject, finding, &r)));
        }
    }
    out.extend(without_a_name(subject));
    out
}

/// The figure of each channel on which something that matters has no name: what the model has in its place shows where it lies.
fn without_a_name(subject: &Subject<'_>) -> Vec<Convicting> {
    let d = &subject.diagnosed.diagnosis;
    let mut out: Vec<Convicting> = vec![];
    for left in d.unexplained.iter().filter(|u| u.material) {
        let is_named = |cause: &String| {
            let mut findings = d.findings.iter();
            findings.any(|f| f.cause == *cause && f.channels.contains(&left.channel))
        };
        let own = |follows: bool| {
            let mut own = subject.diagnosed.evidence.iter();
            own.find(|e| {
                let same = e.channel == left.channel && !is_named(&e.cause);
                same && follows == (e.cause == Evidence::WITHOUT_A_NAME)
            })
        };
        // What follows a recorded channel has a figure of its own.
        let follows = left.follows.is_some();
        let own = own(follows).or_else(|| own(!follows));
        let shown = out.iter().any(|o| o.channel == left.channel);
        out.extend(own.filter(|_| !shown).map(|evidence| Convicting {
            cause: Evidence::WITHOUT_A_NAME.into(),
            channel: left.channel.clone(),
            title: format!("{}: what has no name", left.channel),
            caption: plain_caption(evidence),
            figure: standalone::figure(evidence),
        }));
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
    let is_said = match evidence.x_label.as_str() {
        _ if evidence.log_x => matches!(plot, Plot::Spectrum),
        "frequency, Hz" => matches!(plot, Plot::Lines { .. }),
        "time, s" => matches!(plot, Plot::RateInTime { .. }),
        _ => matches!(plot, Plot::RateAgainst(_)),
    };
    match is_said {
        true => docs.figure.to_owned(),
        false => plain_caption(evidence),
    }
}

/// The same without what an effect says of it.
fn plain_caption(evidence: &Evidence) -> String {
    let own = match evidence.x_label.as_str() {
        _ if evidence.log_x => "Spectrum of the rate with the model before and after.",
        "frequency, Hz" => "Amplitude spectrum of the rate around it, other terms taken out.",
        "time, s" => {
            "Rate in time blocks, the other terms taken out, with the course that the model gives it."
        }
        other => {
            return format!("Rate in time blocks, the other terms taken out, against {other}.");
        }
    };
    own.to_owned()
}

/// A simulation of the extended model without this one cause, in the world of the record; `None` where it cannot be
/// simulated. The baseline will not do: it was fitted to the record with all causes in it, and makes of a base that sways a
/// bias that walks by tens of deg/s.
fn simulated_without(subject: &Subject<'_>, finding: &Finding) -> Option<Record> {
    /// Half of the counts of the stand's gyro, 14 bits and a sign.
    const COUNTS: f64 = 8192.0;
    let mut model = without(&subject.diagnosed.extended_model, finding);
    // A record that names no step gets one that its largest reading fits into.
    for channel in model.channels.iter_mut().filter(|c| c.lsb.is_none()) {
        let readings = subject.record.channel(&channel.name)?;
        let [low, high] = model::effect::extremes(&readings.values);
        let largest = low.abs().max(high.abs());
        channel.lsb = (largest > 0.0 && largest.is_finite()).then_some(largest / COUNTS);
    }
    model::simulate_in_the_world_of(&model, subject.record, model.rate_hz, subject.seed).ok()
}

/// The model without the effects of a finding, and without the details of a cause that is gone.
fn without(extended: &ModelFile, finding: &Finding) -> ModelFile {
    let mut model = extended.clone();
    let shares = |channels: &[String]| {
        channels.is_empty() || channels.iter().any(|c| finding.channels.contains(c))
    };
    model
        .effects
        .retain(|e| e.cause != finding.cause || !shares(&e.channels));
    let is_left = |cause: &String| model.effects.iter().any(|e| e.cause == *cause);
    model
        .unnamed
        .retain(|term| term.refines.as_ref().is_none_or(is_left));
    model
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
    let mut figure = views::figure(plot, channel, &pair).ok()?;
    if matches!(plot, Plot::RateInTime { .. }) {
        // On a narrow page what was measured would hide what is simulated.
        figure.layers.rotate_left(1);
    }
    let mut caption = views::caption(plot, pair.labels);
    if subject.diagnosed.diagnosis.findings.len() > 1 {
        caption += " The other causes stay in the simulation.";
    }
    Some(shown(channel, figure, caption))
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
    fn a_simulation_without_a_cause_keeps_all_others() {
        let mut model = ModelFile::paper();
        let effect = |cause: &str, channel: &str| model::file::EffectModel {
            cause: cause.into(),
            channels: vec![channel.into()],
            parameters: Default::default(),
        };
        model.effects = [
            ("base_motion", "gyro_x"),
            ("line", "gyro_x"),
            ("line", "gyro_y"),
        ]
        .map(|(cause, channel)| effect(cause, channel))
        .to_vec();
        let finding = |cause: &str, channel: &str| -> Finding {
            serde_json::from_value(serde_json::json!({
                "cause": cause, "channels": [channel], "parameters": {}, "alternatives": [],
                "experiment": null, "gain": null, "material": true
            }))
            .expect("a finding")
        };
        let left = |cause: &str, channel: &str| -> Vec<String> {
            let model = without(&model, &finding(cause, channel));
            let of = |e: &model::file::EffectModel| format!("{} {}", e.cause, e.channels[0]);
            model.effects.iter().map(of).collect()
        };
        assert_eq!(
            left("base_motion", "gyro_x"),
            ["line gyro_x", "line gyro_y"]
        );
        assert_eq!(
            left("line", "gyro_x"),
            ["base_motion gyro_x", "line gyro_y"]
        );
        assert_eq!(left("line", "gyro_z").len(), 3);
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
