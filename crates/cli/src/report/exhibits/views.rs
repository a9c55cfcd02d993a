//! What each kind of figure draws of a record.

use std::f64::consts::TAU;

use diagnosis::likelihood::Dct;
use model::effect::Plot;
use model::record::{Channel, Record};

use crate::report::plot::{self, BEFORE, Drawn, Figure, Layer, MEASURED};

/// Blocks of time behind a figure against a channel, s.
const BLOCK_S: f64 = 5.0;
/// Points where there is one for each of many samples.
const POINTS: usize = 300;
/// Points of a spectrum per decade, and the fewest coefficients behind one.
const PER_DECADE: f64 = 12.0;
const LEAST: usize = 4;
/// Seconds that an integrated rate is looked at.
const TILT_S: f64 = 60.0;
/// Seconds either side of a sample.
const AROUND_S: f64 = 1.2;
/// Bits of a count that noise fills.
const BITS: u32 = 8;

mod sketches;

use sketches::{Sketch, sketch};

type Points = Vec<(f64, f64)>;
/// A record's series, or what the record lacks.
type Drawing = Result<Points, String>;

/// Two records that a figure holds beside each other.
pub(in crate::report) struct Pair<'a> {
    /// The one with the effect.
    pub with: &'a Record,
    /// The one without it.
    pub without: &'a Record,
    /// Legend entries: of the one with the effect, of the one without it.
    pub labels: [&'a str; 2],
    /// The sample that [`Plot::Around`] shows; where it is left out, the one in which the two differ most.
    pub at: Option<usize>,
}

/// What the figure of that kind shows, and of which two records.
pub(in crate::report) fn caption(plot: Plot, labels: [&str; 2]) -> String {
    format!(
        "{}: {} and {}.",
        sketches::caption(plot),
        labels[0],
        labels[1]
    )
}

/// The figure of that kind of a channel, with the effect and without it. What is the same in both is drawn once.
///
/// # Errors
/// What the records lack.
pub(in crate::report) fn figure(
    plot: Plot,
    channel: &str,
    pair: &Pair<'_>,
) -> Result<Figure, String> {
    let Sketch {
        x_label,
        y_label,
        log,
        dots,
        y_range,
        extra,
        series,
    } = sketch(plot, channel, pair)?;
    let layer = |points| {
        if dots {
            Layer::Points(points)
        } else {
            Layer::Line(points)
        }
    };
    let (changed, plain) = (series(pair.with)?, series(pair.without)?);
    let mut layers = vec![];
    if changed != plain {
        layers.push(Drawn::new(pair.labels[1], BEFORE, layer(plain)));
    }
    // What joins the dots lies behind them, a law before them.
    let (behind, before): (Vec<Drawn>, Vec<Drawn>) =
        extra.into_iter().partition(|e| e.label.is_none());
    layers.extend(behind);
    layers.push(Drawn::new(pair.labels[0], MEASURED, layer(changed)));
    layers.extend(before);
    Ok(Figure {
        x_label,
        y_label,
        log_x: log,
        log_y: log,
        y_range,
        width: 760,
        height: 320,
        layers,
    })
}

fn named<'a>(record: &'a Record, name: &str) -> Result<&'a Channel, String> {
    let found = record.channels.iter().find(|c| c.name == name);
    found.ok_or_else(|| format!("the channel {name}"))
}

fn counts(channel: &Channel) -> Result<&[i32], String> {
    channel
        .counts
        .as_deref()
        .ok_or_else(|| format!("counts of {}", channel.name))
}

fn rate_hz(record: &Record) -> Result<f64, String> {
    record
        .header
        .rate_hz
        .ok_or_else(|| "a sample rate".to_owned())
}

fn device_s(record: &Record) -> Result<Vec<f64>, String> {
    let tick_s = record.header.tick_s.ok_or("the length of a tick")?;
    let ticks = record.t_ticks.as_ref().ok_or("device times")?;
    Ok(ticks.iter().map(|t| *t as f64 * tick_s).collect())
}

/// Samples of a block of that length.
fn block(record: &Record, block_s: f64) -> usize {
    ((block_s * record.header.rate_hz.unwrap_or(1.0)) as usize).max(1)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn blocks(record: &Record, channel: &Channel, block_s: f64) -> Vec<f64> {
    channel
        .values
        .chunks_exact(block(record, block_s))
        .map(mean)
        .collect()
}

fn blocks_of_time(record: &Record, block_s: f64) -> Vec<f64> {
    let count = record.len() / block(record, block_s);
    (0..count).map(|b| (b as f64 + 0.5) * block_s).collect()
}

/// Half the mean square of differences: white noise without what wanders slowly.
fn power(record: &Record, channel: &Channel) -> Vec<f64> {
    let half_square = |v: &[f64]| {
        let squares: Vec<f64> = v.windows(2).map(|w| (w[1] - w[0]).powi(2) / 2.0).collect();
        mean(&squares)
    };
    channel
        .values
        .chunks_exact(block(record, BLOCK_S))
        .map(half_square)
        .collect()
}

/// Means of `y` in blocks of the values of `x`.
fn by_value(x: &[f64], y: &[f64]) -> Points {
    const COUNT: usize = 60;
    let mut rows: Points = x.iter().copied().zip(y.iter().copied()).collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let size = (rows.len() / COUNT).max(1);
    let centre = |part: &[(f64, f64)]| {
        let n = part.len() as f64;
        let sum = part.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
        (sum.0 / n, sum.1 / n)
    };
    rows.chunks_exact(size).map(centre).collect()
}

/// Density by the squares of the cosine transform, averaged in bands of equal ratio.
fn spectrum(channel: &Channel, rate_hz: f64) -> Points {
    let n = channel.values.len();
    let level = mean(&channel.values);
    let centred: Vec<f64> = channel.values.iter().map(|v| v - level).collect();
    let c = Dct::new(n).forward(&centred);
    let mut points = vec![];
    let mut from = 2;
    while from < n {
        let to = ((from as f64 * 10f64.powf(1.0 / PER_DECADE)).ceil() as usize)
            .max(from + LEAST)
            .min(n);
        let middle = (from + to - 1) as f64 / 2.0 * rate_hz / 2.0 / n as f64;
        let square = c[from..to].iter().map(|v| v * v).sum::<f64>() / (to - from) as f64;
        points.push((middle, 2.0 * square / rate_hz));
        from = to;
    }
    points
}

/// Amplitudes at two points to a resolution, under a Hann window.
fn lines(channel: &Channel, rate_hz: f64, from_hz: f64, to_hz: f64) -> Points {
    let n = channel.values.len();
    let level = mean(&channel.values);
    let window = |i: usize| 1.0 - (TAU * (i as f64 + 0.5) / n as f64).cos();
    let seen: Vec<f64> = channel
        .values
        .iter()
        .enumerate()
        .map(|(i, v)| window(i) * (v - level))
        .collect();
    let step = rate_hz / n as f64 / 2.0;
    let count = ((to_hz - from_hz) / step).round() as usize;
    let amplitude = |f: f64| {
        let (sin, cos) = (TAU * f / rate_hz).sin_cos();
        // The phase turns by a rotation a sample.
        let (mut re, mut im, mut x, mut y) = (0.0, 0.0, 1.0, 0.0);
        for v in &seen {
            re += v * x;
            im += v * y;
            (x, y) = (x * cos - y * sin, x * sin + y * cos);
        }
        2.0 * f64::hypot(re, im) / n as f64
    };
    let x: Vec<f64> = (0..=count).map(|k| from_hz + step * k as f64).collect();
    let y: Vec<f64> = x.iter().map(|f| amplitude(*f)).collect();
    plot::envelope(&x, &y, POINTS)
}

/// Tilt about x from the force along y, about y from that along -x, against the integrated rate, both without a line.
fn tilt(record: &Record, rate: &Channel) -> Drawing {
    let hz = rate_hz(record)?;
    let n = ((TILT_S * hz) as usize).min(record.len());
    let (force, sign) = match rate.name.as_str() {
        "gyro_x" => ("acc_y", 1.0),
        _ => ("acc_x", -1.0),
    };
    const GRAVITY: f64 = 9.80665;
    let seen: Vec<f64> = named(record, force)?.values[..n]
        .iter()
        .map(|a| sign * (a / GRAVITY).clamp(-1.0, 1.0).asin().to_degrees())
        .collect();
    let mut angle = 0.0;
    let turned: Vec<f64> = rate.values[..n]
        .iter()
        .map(|v| {
            // The middle of a sample.
            angle += v / hz;
            angle - v / hz / 2.0
        })
        .collect();
    let step = (n / POINTS).max(1);
    let pairs = beyond_line(&turned).into_iter().zip(beyond_line(&seen));
    Ok(pairs.step_by(step).collect())
}

/// What is left beside the best straight line.
fn beyond_line(values: &[f64]) -> Vec<f64> {
    let middle = (values.len() as f64 - 1.0) / 2.0;
    let level = mean(values);
    let about = || {
        values
            .iter()
            .enumerate()
            .map(|(i, v)| (i as f64 - middle, v))
    };
    let along: f64 = about().map(|(x, v)| x * v).sum();
    let spread: f64 = about().map(|(x, _)| x * x).sum();
    about()
        .map(|(x, v)| v - level - along / spread.max(1.0) * x)
        .collect()
}

/// The sample that differs most.
fn most_changed(a: &Channel, b: &Channel) -> usize {
    let difference = |i: &usize| (a.values[*i] - b.values[*i]).abs();
    let rows = 0..a.values.len().min(b.values.len());
    rows.max_by(|i, j| difference(i).total_cmp(&difference(j)))
        .unwrap_or(0)
}

fn around(record: &Record, channel: &Channel, middle: usize) -> Drawing {
    let hz = rate_hz(record)?;
    let reach = (AROUND_S * hz) as usize;
    let rows = middle.saturating_sub(reach)..(middle + reach + 1).min(channel.values.len());
    Ok(rows.map(|i| (i as f64 / hz, channel.values[i])).collect())
}

fn histogram(counts: &[i32]) -> Points {
    let (low, high) = counts
        .iter()
        .fold((i32::MAX, i32::MIN), |(l, h), c| (l.min(*c), h.max(*c)));
    let mut bins = vec![0usize; (i64::from(high) - i64::from(low) + 1).max(0) as usize];
    for c in counts {
        bins[(c - low) as usize] += 1;
    }
    let at = |(i, n): (usize, usize)| (f64::from(low) + i as f64, n as f64);
    bins.into_iter().enumerate().map(at).collect()
}

/// The histogram that a normal law of the same mean and spread would have.
fn normal_curve(counts: &[i32]) -> Points {
    let values: Vec<f64> = counts.iter().map(|c| f64::from(*c)).collect();
    let level = mean(&values);
    let squares: Vec<f64> = values.iter().map(|v| (v - level).powi(2)).collect();
    let sigma = mean(&squares).sqrt();
    let height = values.len() as f64 / (sigma * TAU.sqrt());
    (-35..=35)
        .map(|k| {
            let z = f64::from(k) / 10.0;
            (level + z * sigma, height * (-z * z / 2.0).exp())
        })
        .collect()
}

fn ones(counts: &[i32]) -> Points {
    let share = |bit: u32| {
        let ones = counts.iter().filter(|c| (**c >> bit) & 1 == 1).count();
        ones as f64 / counts.len().max(1) as f64
    };
    (0..BITS).map(|bit| (f64::from(bit), share(bit))).collect()
}

/// A needle for each gap of the sequence numbers.
fn gaps(record: &Record) -> Drawing {
    let hz = rate_hz(record)?;
    let seq = record.seq.as_ref().ok_or("sequence numbers")?;
    let (Some(first), Some(last)) = (seq.first(), seq.last()) else {
        return Err("frames".into());
    };
    let mut points = vec![(*first as f64 / hz, 0.0)];
    for w in seq.windows(2) {
        let missing = w[1] - w[0] - 1;
        if missing > 0 {
            let at = (w[0] + 1) as f64 / hz;
            points.extend([(at, 0.0), (at, missing as f64), (at, 0.0)]);
        }
    }
    points.push((*last as f64 / hz, 0.0));
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(values: Vec<f64>) -> Channel {
        Channel {
            name: "gyro_x".into(),
            quantity: model::record::Quantity::Gyro,
            axis: None,
            unit: "deg/s".into(),
            counts: Some(values.iter().map(|v| *v as i32).collect()),
            values,
            lsb: Some(1.0),
        }
    }

    #[test]
    fn a_line_stands_at_its_amplitude() {
        let wave = (0..4000).map(|i| 0.3 * (TAU * 2.5 * f64::from(i) / 20.0).cos());
        let top = lines(&channel(wave.collect()), 20.0, 2.0, 3.0)
            .into_iter()
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .expect("points");
        assert!(
            (top.0 - 2.5).abs() < 1e-9 && (top.1 - 0.3).abs() < 1e-3,
            "{top:?}"
        );
    }

    #[test]
    fn the_density_of_white_noise_is_its_variance_over_half_the_rate() {
        // A cosine at every coefficient is white without chance.
        let n = 4096;
        let c: Vec<f64> = (0..n).map(|k| if k == 0 { 0.0 } else { 1.0 }).collect();
        let white = channel(Dct::new(n).inverse(&c));
        for (_, density) in spectrum(&white, 20.0) {
            assert!((density - 1.0 / 10.0).abs() < 1e-9, "{density}");
        }
    }

    #[test]
    fn a_straight_line_leaves_nothing_and_ones_are_counted() {
        let line: Vec<f64> = (0..50).map(|i| 3.0 - 0.2 * f64::from(i)).collect();
        assert!(beyond_line(&line).iter().all(|v| v.abs() < 1e-12));
        assert_eq!(
            ones(&[0b01, 0b11, 0b01, 0b00])[..2],
            [(0.0, 0.75), (1.0, 0.25)]
        );
        assert_eq!(histogram(&[2, 4, 4]), [(2.0, 1.0), (3.0, 0.0), (4.0, 2.0)]);
    }
}
