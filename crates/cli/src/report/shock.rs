//! The figure that convicts a shock: the readings around it and their mean over its own length, in which a knock shows that
//! is smaller than the noise of a reading.

use diagnosis::result::{Finding, Parameter};
use model::effects::shock::Pulse;
use model::record::Record;

use super::plot::{self, AFTER, BEFORE, Drawn, Figure, Layer, MEASURED, READINGS, number};

/// Lengths of the shock that the figure reaches either side of it, and at least, s.
const LENGTHS: f64 = 8.0;
const AT_LEAST_S: f64 = 1.2;

/// What the figure is drawn of.
pub(super) struct Knock<'a> {
    pub finding: &'a Finding,
    pub measured: &'a Record,
    pub without: &'a Record,
    pub rate_hz: f64,
}

/// A figure with its channel and caption.
pub(super) struct Drawing {
    pub channel: String,
    pub figure: Figure,
    pub caption: String,
}

/// Where the readings of a shock lie, and how they are averaged.
struct Window {
    /// Rows of the figure, and of the shock.
    rows: std::ops::Range<usize>,
    shock: std::ops::Range<usize>,
    /// Readings of a mean.
    length: usize,
    /// A ring has no mean: its rms is shown.
    rings: bool,
}

impl Window {
    fn is_outside(&self, row: usize) -> bool {
        row + self.length < self.shock.start || row > self.shock.end + self.length
    }

    /// The level of a series beside the shock.
    fn level(&self, values: &[f64]) -> f64 {
        let beside = self.rows.clone().filter(|k| self.is_outside(*k));
        let all: Vec<f64> = beside
            .map(|k| values[k])
            .filter(|v| v.is_finite())
            .collect();
        all.iter().sum::<f64>() / all.len().max(1) as f64
    }

    /// Mean of a length of the series about each row, or its rms.
    fn averaged(&self, values: &[f64]) -> Vec<(usize, f64)> {
        let back = self.length / 2;
        let part = |k: usize| {
            let own = values.get(k.checked_sub(back)?..k - back + self.length)?;
            let mean = own.iter().sum::<f64>() / own.len() as f64;
            let power = own.iter().map(|v| v * v).sum::<f64>() / own.len() as f64;
            let value = if self.rings { power.sqrt() } else { mean };
            value.is_finite().then_some((k, value))
        };
        self.rows.clone().filter_map(part).collect()
    }
}

/// The figure of the channel that feels it most surely; `None` where the shock is a reading long, which is seen by itself.
pub(super) fn drawing(of: &Knock<'_>) -> Option<Drawing> {
    let (channel, parameters) = surest(of.finding)?;
    let value = |name: &str| parameters.get(name).map(|p: &Parameter| p.value);
    let pulse = Pulse {
        start: (of.finding.times_s.first().copied()).or_else(|| value("time"))?,
        ..Pulse::of(parameters)
    };
    let length = (pulse.duration * of.rate_hz).round() as usize;
    let readings = of.measured.channel(&channel)?;
    if length < 2 || length > readings.values.len() / 2 {
        return None;
    }
    let reach = ((LENGTHS * pulse.duration).max(AT_LEAST_S) * of.rate_hz) as usize;
    let shock = pulse.span(of.rate_hz, readings.values.len());
    let window = Window {
        rows: shock.start.saturating_sub(reach)..(shock.end + reach).min(readings.values.len()),
        rings: pulse.ring.is_some(),
        shock,
        length,
    };
    let about_level = |values: &[f64]| -> Vec<f64> {
        let level = window.level(values);
        values.iter().map(|v| v - level).collect()
    };
    let measured = about_level(&readings.values);
    let simulated = about_level(&of.without.channel(&channel)?.values);
    let seconds = |row: usize| row as f64 / of.rate_hz;
    let line = |values: &[f64]| {
        let points = window.averaged(values).into_iter();
        Layer::Line(points.map(|(k, v)| (seconds(k), v)).collect())
    };
    let dots = window.rows.clone().map(|k| (seconds(k), measured[k]));
    let what = if window.rings { "rms" } else { "mean" };
    let over = format!("{what} over {} s", number(pulse.duration, 2));
    let mut layers = vec![
        Drawn::new("readings", READINGS, Layer::Points(dots.collect())),
        Drawn::new(
            &format!("{over}, simulated without it"),
            BEFORE,
            line(&simulated),
        ),
    ];
    if !window.rings {
        let mut shape = vec![0.0; measured.len()];
        let own = pulse.readings(of.rate_hz, window.shock.clone());
        for (v, part) in shape[window.shock.clone()].iter_mut().zip(own) {
            *v = value("peak")? * part;
        }
        layers.push(Drawn::new(
            &format!("{over}, the shock found"),
            AFTER,
            line(&shape),
        ));
    }
    layers.push(Drawn::new(
        &format!("{over}, measured"),
        MEASURED,
        line(&measured),
    ));
    let caption = format!(
        "Readings around it (dots), less their mean beside it, and their {what} over {} s, the length of the shock (lines). \
         Noise averages out over that length, so a shock that no single reading shows stands out of the line beside it.",
        number(pulse.duration, 2)
    );
    Some(Drawing {
        figure: Figure {
            x_label: "time, s".into(),
            y_label: format!("rate of {channel}, {}", readings.unit),
            width: plot::WIDE,
            height: 400,
            layers,
            ..Figure::default()
        },
        channel,
        caption,
    })
}

type Parameters = std::collections::BTreeMap<String, Parameter>;

/// The channel whose peak is the most errors from 0, and what was found there.
fn surest(finding: &Finding) -> Option<(String, &Parameters)> {
    let sureness = |of: &Parameters| {
        let peak = of.get("peak")?;
        Some((peak.value / peak.std_error.filter(|e| *e > 0.0)?).abs())
    };
    let each = finding.per_channel.iter();
    let best = each.max_by(|a, b| {
        let [a, b] = [a, b].map(|(_, of)| sureness(of).unwrap_or(0.0));
        a.total_cmp(&b)
    });
    match best {
        Some((channel, of)) => Some((channel.clone(), of)),
        None => Some((finding.channels.first()?.clone(), &finding.parameters)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::record::{Channel, Header, Quantity};

    /// Ten seconds at 20 Hz of readings that alternate by 0.2, with a half sine of 0.4 over a second from 5 s on.
    fn record(knocked: bool) -> Record {
        let at = |k: usize| {
            let t = k as f64 / 20.0;
            let noise = if k.is_multiple_of(2) { 0.2 } else { -0.2 };
            let blow = if (5.0..6.0).contains(&t) {
                (std::f64::consts::PI * (t - 5.0)).sin()
            } else {
                0.0
            };
            1.0 + noise + if knocked { 0.4 * blow } else { 0.0 }
        };
        Record {
            header: Header {
                rate_hz: Some(20.0),
                ..Header::default()
            },
            channels: vec![Channel {
                name: "gyro_y".into(),
                quantity: Quantity::Gyro,
                axis: None,
                unit: "deg/s".into(),
                counts: None,
                values: (0..200).map(at).collect(),
                lsb: None,
            }],
            ..Record::default()
        }
    }

    fn finding(duration: f64, frequency: Option<f64>) -> Finding {
        let of = |value: f64, unit: &str| Parameter {
            value,
            std_error: Some(0.05),
            unit: unit.into(),
        };
        let mut all = Parameters::new();
        all.insert("time".into(), of(5.0, "s"));
        all.insert("peak".into(), of(0.4, "deg/s"));
        all.insert("duration".into(), of(duration, "s"));
        frequency.map(|f| all.insert("frequency".into(), of(f, "Hz")));
        Finding {
            cause: "shock".into(),
            channels: vec!["gyro_y".into()],
            parameters: all,
            times_s: vec![5.0],
            ..Finding::default()
        }
    }

    fn drawn(finding: &Finding) -> Option<Drawing> {
        let (measured, without) = (record(true), record(false));
        drawing(&Knock {
            finding,
            measured: &measured,
            without: &without,
            rate_hz: 20.0,
        })
    }

    fn largest(layer: &Drawn) -> (f64, f64) {
        let Layer::Line(points) = &layer.layer else {
            panic!("a line")
        };
        points
            .iter()
            .copied()
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .expect("points")
    }

    #[test]
    fn a_shock_smaller_than_the_noise_stands_out_of_the_mean_over_its_length() {
        let drawing = drawn(&finding(1.0, None)).expect("a figure");
        let labels: Vec<_> = drawing
            .figure
            .layers
            .iter()
            .map(|l| l.label.clone().unwrap_or_default())
            .collect();
        assert_eq!(
            labels,
            [
                "readings",
                "mean over 1.0 s, simulated without it",
                "mean over 1.0 s, the shock found",
                "mean over 1.0 s, measured"
            ]
        );
        assert!(
            drawing
                .caption
                .contains("their mean over 1.0 s, the length of the shock"),
            "{}",
            drawing.caption
        );
        // The mean of a half sine is 2 / pi of its peak, at its middle; noise that alternates leaves nothing.
        let (at, top) = largest(&drawing.figure.layers[3]);
        assert!(
            (at - 5.5).abs() < 0.11 && (top - 0.8 / std::f64::consts::PI).abs() < 0.01,
            "{at} {top}"
        );
        assert!(largest(&drawing.figure.layers[1]).1.abs() < 0.01);
        assert!((largest(&drawing.figure.layers[2]).1 - top).abs() < 0.01);
    }

    #[test]
    fn a_ring_is_shown_by_its_rms_and_a_shock_of_one_reading_by_itself() {
        let ring = drawn(&finding(1.0, Some(4.0))).expect("a figure");
        assert!(
            ring.caption.contains("their rms over 1.0 s"),
            "{}",
            ring.caption
        );
        assert_eq!(ring.figure.layers.len(), 3);
        assert!(drawn(&finding(0.05, None)).is_none());
    }
}
