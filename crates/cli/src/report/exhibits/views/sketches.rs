//! What each kind of figure has at its axes, and how it draws a record.

use std::ops::Range;

use model::effect::Plot;
use model::record::Record;

use super::{
    BLOCK_S, Drawing, POINTS, Pair, around, beyond_line, blocks, blocks_of_time, by_value, counts,
    device_s, gaps, histogram, lines, most_changed, named, normal_curve, ones, power, rate_hz,
    spectrum, tilt,
};
use crate::report::plot::{self, AFTER, Drawn, Layer, MEASURED};

/// A kind of figure of a channel, before it is drawn.
pub(super) struct Sketch<'a> {
    pub x_label: String,
    pub y_label: String,
    /// Whether both axes are logarithmic.
    pub log: bool,
    /// Dots, not a line.
    pub dots: bool,
    pub y_range: Option<Range<f64>>,
    /// What stands there once, whatever the record.
    pub extra: Option<Drawn>,
    pub series: Box<dyn Fn(&Record) -> Drawing + 'a>,
}

impl<'a> Sketch<'a> {
    /// Of dots.
    fn dots(
        x_label: impl Into<String>,
        y_label: impl Into<String>,
        series: impl Fn(&Record) -> Drawing + 'a,
    ) -> Self {
        Self {
            x_label: x_label.into(),
            y_label: y_label.into(),
            log: false,
            dots: true,
            y_range: None,
            extra: None,
            series: Box::new(series),
        }
    }

    /// Of a line.
    fn line(
        x_label: impl Into<String>,
        y_label: impl Into<String>,
        series: impl Fn(&Record) -> Drawing + 'a,
    ) -> Self {
        Self {
            dots: false,
            ..Self::dots(x_label, y_label, series)
        }
    }
}

/// What the figure of that kind shows.
pub(super) fn caption(plot: Plot) -> String {
    let text = match plot {
        Plot::RateInTime { .. } => "Rate in time blocks",
        Plot::RateAgainst(other) => return format!("Rate in time blocks against {other}"),
        Plot::RateByValue(other) => return format!("Rate in blocks of {other} against {other}"),
        Plot::PowerInTime => {
            "Mean square of the noise (half that of the steps between readings) in time blocks"
        }
        Plot::PowerAgainst(other) => {
            return format!(
                "Mean square of the noise (half that of the steps between readings) in time blocks against {other}"
            );
        }
        Plot::Spectrum => "Spectrum of the rate",
        Plot::Lines { .. } => "Amplitude spectrum of the rate around it",
        Plot::AxisAgainst(other) => {
            return format!(
                "By how much {other} changes from reading to reading, in blocks of how much the rate does"
            );
        }
        Plot::Tilt => {
            "Tilt by the accelerometers against tilt by the rate, each without a straight line"
        }
        Plot::Around => "Readings around one event",
        Plot::Histogram => "Histogram of the counts, and the normal law",
        Plot::Bits => "Share of ones by bit",
        Plot::Gaps => "Frames missing over time",
        Plot::DeviceTime => "Device time minus its line",
        Plot::HostTime => "Host time minus device time",
    };
    text.to_owned()
}

const TIME: &str = "time, s";
const FREQUENCY: &str = "frequency, Hz";

/// The sketch of that kind of figure.
pub(super) fn sketch<'a>(
    plot: Plot,
    channel: &'a str,
    pair: &Pair<'_>,
) -> Result<Sketch<'a>, String> {
    let unit = named(pair.with, channel)?.unit.as_str();
    let rate = format!("rate of {channel}, {unit}");
    let power = format!("mean square of the noise, ({unit})^2");
    let of = |name: &str| label(pair.with, name);
    Ok(match plot {
        Plot::RateInTime { block_s } => Sketch {
            // Many blocks are a curve.
            dots: block_s >= BLOCK_S,
            ..rate_in_time(rate, channel, block_s)
        },
        Plot::RateAgainst(other) => rate_against(of(other)?, rate, channel, other),
        Plot::RateByValue(other) => Sketch::dots(of(other)?, rate, move |r| {
            Ok(by_value(
                &named(r, other)?.values,
                &named(r, channel)?.values,
            ))
        }),
        Plot::PowerInTime => power_in_time(power, channel),
        Plot::PowerAgainst(other) => power_against(of(other)?, power, channel, other),
        Plot::Spectrum => density(unit, channel),
        Plot::Lines { from_hz, to_hz } => {
            Sketch::line(FREQUENCY, format!("amplitude, {unit}"), move |r| {
                Ok(lines(named(r, channel)?, rate_hz(r)?, from_hz, to_hz))
            })
        }
        Plot::AxisAgainst(other) => {
            let change = |name: &str| format!("change of {name}, {unit}");
            Sketch::dots(change(channel), change(other), move |r| {
                axis_against(r, channel, other)
            })
        }
        Plot::Tilt => Sketch::dots(
            format!("tilt by integrating {channel}, deg"),
            "tilt by the accelerometers, deg",
            move |r| tilt(r, named(r, channel)?),
        ),
        Plot::Around => about_a_sample(rate, channel, pair)?,
        Plot::Histogram => codes(channel, pair)?,
        Plot::Bits => bits(channel),
        Plot::Gaps => Sketch::line(TIME, "frames missing", gaps),
        Plot::DeviceTime => Sketch::dots(TIME, "device time minus its line, ms", device_time),
        Plot::HostTime => Sketch::line(TIME, "host time minus device time, ms", host_time),
    })
}

/// A channel with its unit.
fn label(record: &Record, name: &str) -> Result<String, String> {
    Ok(match named(record, name)?.unit.as_str() {
        "1" => format!("{name}, counts"),
        unit => format!("{name}, {unit}"),
    })
}

fn rate_in_time(rate: String, channel: &str, block_s: f64) -> Sketch<'_> {
    Sketch::dots(TIME, rate, move |r| {
        let own = blocks(r, named(r, channel)?, block_s);
        Ok(blocks_of_time(r, block_s).into_iter().zip(own).collect())
    })
}

fn rate_against<'a>(of: String, rate: String, channel: &'a str, other: &'a str) -> Sketch<'a> {
    Sketch::dots(of, rate, move |r| {
        let x = blocks(r, named(r, other)?, BLOCK_S);
        let y = blocks(r, named(r, channel)?, BLOCK_S);
        Ok(x.into_iter().zip(y).collect())
    })
}

fn power_in_time(label: String, channel: &str) -> Sketch<'_> {
    Sketch::dots(TIME, label, move |r| {
        let power = power(r, named(r, channel)?);
        Ok(blocks_of_time(r, BLOCK_S).into_iter().zip(power).collect())
    })
}

fn power_against<'a>(of: String, label: String, channel: &'a str, other: &'a str) -> Sketch<'a> {
    Sketch::dots(of, label, move |r| {
        let x = blocks(r, named(r, other)?, BLOCK_S);
        Ok(x.into_iter().zip(power(r, named(r, channel)?)).collect())
    })
}

fn density<'a>(unit: &str, channel: &'a str) -> Sketch<'a> {
    let label = format!("one-sided density, ({unit})^2/Hz");
    Sketch {
        log: true,
        ..Sketch::line(FREQUENCY, label, move |r| {
            Ok(spectrum(named(r, channel)?, rate_hz(r)?))
        })
    }
}

/// Changes from reading to reading, in which nothing that wanders slowly shows.
fn axis_against(record: &Record, channel: &str, other: &str) -> Drawing {
    let changes = |name: &str| -> Result<Vec<f64>, String> {
        let values = named(record, name)?.values.windows(2);
        Ok(values.map(|w| w[1] - w[0]).collect())
    };
    Ok(by_value(&changes(channel)?, &changes(other)?))
}

/// Either side of the sample that the pair names, or in which its records differ most; what was read stands there as a line.
fn about_a_sample<'a>(
    rate: String,
    channel: &'a str,
    pair: &Pair<'_>,
) -> Result<Sketch<'a>, String> {
    let own = named(pair.with, channel)?;
    let most_changed = || Ok(most_changed(own, named(pair.without, channel)?));
    let middle = pair.at.map_or_else(most_changed, Ok::<usize, String>)?;
    Ok(Sketch {
        extra: Some(Drawn {
            label: None,
            colour: MEASURED,
            layer: Layer::Line(around(pair.with, own, middle)?),
        }),
        ..Sketch::dots(TIME, rate, move |r| around(r, named(r, channel)?, middle))
    })
}

/// How often each code comes, beside the normal law of the record without the effect.
fn codes<'a>(channel: &'a str, pair: &Pair<'_>) -> Result<Sketch<'a>, String> {
    let normal = normal_curve(counts(named(pair.without, channel)?)?);
    Ok(Sketch {
        extra: Some(Drawn::new("normal law", AFTER, Layer::Line(normal))),
        ..Sketch::dots(format!("{channel}, counts"), "samples", move |r| {
            Ok(histogram(counts(named(r, channel)?)?))
        })
    })
}

fn bits(channel: &str) -> Sketch<'_> {
    Sketch {
        y_range: Some(-0.04..1.04),
        ..Sketch::dots(format!("bit of {channel}"), "share of ones", move |r| {
            Ok(ones(counts(named(r, channel)?)?))
        })
    }
}

fn device_time(record: &Record) -> Drawing {
    let device = device_s(record)?;
    let straight = beyond_line(&device);
    let step = (device.len() / POINTS).max(1);
    let rows = device.iter().zip(&straight).step_by(step);
    Ok(rows.map(|(t, late)| (*t, 1e3 * late)).collect())
}

fn host_time(record: &Record) -> Drawing {
    let device = device_s(record)?;
    let host = record.host_time_s.as_ref().ok_or("host times")?;
    let both = host.iter().zip(&device);
    let ms: Vec<f64> = both.map(|(h, d)| 1e3 * (h - d)).collect();
    Ok(plot::envelope(&device, &ms, POINTS))
}
