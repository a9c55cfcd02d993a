//! Readings that lie between others: a log that was put on even times before it came here.
//!
//! What neighbours have in common on a curve between evenly spaced readings goes up and down as the two rates beat ([`cyclic`]).
//! Where the times of the readings were uneven nothing beats; but straight pieces between two readings that agree are that reading, so
//! that some of what is written with many digits lies on the step of the converter, and the rest anywhere between.

mod cyclic;

pub use cyclic::Beats;

use model::record::{Quantity, Record};

use super::rounding::in_steps;
use super::{Audit, Gyro, LEAST_READINGS};
use crate::test_level::CheckId;
use numerics::order_statistics::{median, robust_sigma};

/// Readings on either side whose mean is taken off: what drifts is no part of it.
const LEVEL: usize = 50;
/// Standard deviations beyond which a reading counts as if it lay there.
const FAR: f64 = 5.0;
/// Variance of a tone over the swing of the variance, from which on it may be the tone that beats.
const KNOWN: f64 = 0.25;

/// Sums of `reach` values on either side and the one between; fewer at the ends.
fn sums(y: &[f64], reach: usize) -> Vec<f64> {
    let mut before = vec![0.0; y.len() + 1];
    for (i, v) in y.iter().enumerate() {
        before[i + 1] = before[i] + v;
    }
    let at = |i: usize| before[(i + reach + 1).min(y.len())] - before[i.saturating_sub(reach)];
    (0..y.len()).map(at).collect()
}

/// Readings about their level, in standard deviations.
fn about_level(y: &[f64]) -> Option<Vec<f64>> {
    let known: Vec<f64> = y.iter().copied().filter(|v| v.is_finite()).collect();
    if known.len() < LEAST_READINGS.max(10 * LEVEL) || known.len() < y.len() - y.len() / 10 {
        return None;
    }
    let middle = median(&known);
    let filled: Vec<f64> = y
        .iter()
        .map(|v| if v.is_finite() { v - middle } else { 0.0 })
        .collect();
    let (all, count) = (sums(&filled, LEVEL), sums(&vec![1.0; y.len()], LEVEL));
    let level = all.iter().zip(&count).map(|(s, n)| s / n);
    let mut own: Vec<f64> = filled.iter().zip(level).map(|(v, l)| v - l).collect();
    let sigma = robust_sigma(&own);
    if sigma.is_nan() || sigma <= 0.0 {
        return None;
    }
    for v in &mut own {
        *v = (*v / sigma).clamp(-FAR, FAR);
    }
    let n = own.len() as f64;
    let square = own.iter().map(|v| v * v).sum::<f64>() / n;
    own.iter_mut().for_each(|v| *v /= square.sqrt());
    Some(own)
}

/// What beats where all gyros of a record lie on a curve between others.
pub(super) fn beats(record: &Record) -> Option<Beats> {
    let gyros = record
        .all(Quantity::Gyro)
        .filter(|c| c.values.len() == record.len());
    let all: Option<Vec<Vec<f64>>> = gyros.map(|c| about_level(&c.values)).collect();
    let all = all.filter(|all| !all.is_empty())?;
    // What drifts within the stretch whose mean is taken off is none.
    let first = 0.1 / LEVEL as f64;
    let own: Vec<&[f64]> = all.iter().map(Vec::as_slice).collect();
    cyclic::beats(&own, first).filter(|b| !all.iter().any(|own| tone(own) > KNOWN * b.swing))
}

/// Variance of the highest tone of readings over theirs.
fn tone(own: &[f64]) -> f64 {
    let n = own.len();
    let highest = cyclic::power(own).into_iter().skip(1).fold(0.0, f64::max);
    2.0 * highest / (n * n) as f64
}

/// Fewest values that come so often, steps of the writing that they have to lie apart, and the part of them on even places.
const FEWEST: usize = 8;
const WIDE: f64 = 20.0;
const EVEN: f64 = 0.9;
/// How often a value comes that is no chance, beside ten times as often as the densest.
const OFTEN: f64 = 6.0;
/// Parts of the readings on such values that are neither chance nor the converter's step alone.
const ON_STEPS: std::ops::Range<f64> = 0.002..0.8;

/// Readings on a step of the converter among others.
struct OnSteps {
    part: f64,
    /// In the unit of the readings.
    step: f64,
}

fn on_steps(g: &Gyro<'_>) -> Option<OnSteps> {
    let (y, fine) = in_steps(g)?;
    let mut all: Vec<i64> = y
        .iter()
        .filter(|v| v.is_finite())
        .map(|v| v.round() as i64)
        .collect();
    let sigma = robust_sigma(&y);
    if all.len() < LEAST_READINGS || sigma < 10.0 * WIDE {
        return None;
    }
    let n = all.len() as f64;
    all.sort_unstable();
    let least = OFTEN + 10.0 * 0.4 * n / sigma;
    let often = all
        .chunk_by(|a, b| a == b)
        .filter(|c| c.len() as f64 > least);
    let often: Vec<(f64, f64)> = often.map(|c| (c[0] as f64, c.len() as f64)).collect();
    if often.len() < FEWEST {
        return None;
    }
    let gaps: Vec<f64> = often.windows(2).map(|w| w[1].0 - w[0].0).collect();
    let (mut step, zero) = (median(&gaps), often[often.len() / 2].0);
    if step < WIDE {
        return None;
    }
    // A line through their places, from the middle on outwards.
    for _ in 0..4 {
        let places = often
            .iter()
            .map(|(v, _)| (((v - zero) / step).round(), v - zero));
        let [top, bottom] = places.fold([0.0; 2], |s, (k, v)| [s[0] + k * v, s[1] + k * k]);
        step = top / bottom;
    }
    let near = |v: f64| ((v - zero) / step - ((v - zero) / step).round()).abs() * step < 1.6;
    let even = often.iter().filter(|(v, _)| near(*v)).count() as f64;
    let part = all.iter().filter(|v| near(**v as f64)).count() as f64 / n - 3.0 / step;
    let holds = even >= EVEN * often.len() as f64 && ON_STEPS.contains(&part);
    holds.then_some(OnSteps {
        part,
        step: step * fine,
    })
}

/// What to do about it.
const ADVICE: &str = "diagnose the log as it was before it was put on these times, by its own ones";

fn told(
    names: &str,
    rate_hz: f64,
    beats: Option<&Beats>,
    on: Option<&OnSteps>,
    unit: &str,
) -> String {
    let mut seen = vec![];
    if let Some(Beats { rates, swing }) = beats {
        let hz: Vec<String> = rates
            .iter()
            .map(|r| format!("{:.2}", r * rate_hz))
            .collect();
        let of = match hz.as_slice() {
            [] => "of another rate".to_owned(),
            some => format!("that came evenly at {} Hz", some.join(" or ")),
        };
        seen.push(format!(
            "lie on a curve between others {of}: what neighbours have in common goes up and down as the two rates beat, their variance by {:.0} %",
            100.0 * swing
        ));
    } else {
        seen.push("lie between others of other times".to_owned());
    }
    if let Some(OnSteps { part, step }) = on {
        seen.push(format!(
            "{:.1} % are on a step of {step:.4} {unit} that the sensor may have, the rest anywhere between",
            100.0 * part
        ));
    }
    format!("readings of {names} {}; {ADVICE}", seen.join("; "))
}

/// Tells of readings that lie between others, once for all gyros, with what beats; whether they do.
pub(super) fn audit(
    gyros: &[Gyro<'_>],
    rate_hz: f64,
    beats: Option<&Beats>,
    audit: &mut Audit,
) -> bool {
    let on: Vec<Option<OnSteps>> = gyros.iter().map(on_steps).collect();
    let each = !on.is_empty() && on.iter().all(Option::is_some);
    let on = on.into_iter().flatten().next().filter(|_| each);
    let names: Vec<String> = gyros.iter().map(|g| g.channel.name.clone()).collect();
    let unit = gyros.first().map_or("", |g| g.channel.unit.as_str());
    let seen = beats.is_some() || on.is_some();
    let what = match seen {
        true => told(&names.join(", "), rate_hz, beats, on.as_ref(), unit),
        false => "no readings lie between others of another rate".to_owned(),
    };
    let swing = beats.map_or(0.0, |b| b.swing);
    let part = on.as_ref().map_or(0.0, |o| o.part);
    if audit.limit(
        CheckId::Resampled,
        "record",
        swing.max(part),
        0.0,
        what.clone(),
    ) {
        audit.unexplain("record", what);
        audit.between = names;
    }
    seen
}
