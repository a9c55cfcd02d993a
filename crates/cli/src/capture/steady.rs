//! Whether a record is one record: one sample rate, sampling times, one attitude. Every command sees the same notes.

use model::record::sampling::Sampling;
use model::record::{Axis, Base, Quantity, Record};

use super::{CaptureError, STANDARD_GRAVITY};
use crate::report::plot::number;

/// Parts of a record that are compared, and steps that each has at least.
const BLOCKS: usize = 30;
const STEPS: usize = 8;
/// Ratio of two rates beyond which no clock's drift makes them.
const OTHER_RATE: f64 = 1.2;
/// Turn against gravity, deg, that no vibration and no temperature of an accelerometer makes.
const TURNED_DEG: f64 = 5.0;
/// Size of a mean acceleration, g, that is gravity.
const GRAVITY: std::ops::Range<f64> = 0.7..1.3;

/// What is not steady.
pub(super) fn unsteady(record: &Record) -> Vec<String> {
    let times = times(record);
    let rates = times.as_deref().and_then(changing_rate);
    let own = match (&rates, Sampling::of(record, None)) {
        // It says of such times that they are of arrival.
        (None, Ok(sampling)) => sampling.warnings,
        _ => Vec::new(),
    };
    let turned = turned(record, times.as_deref());
    let holes = holes(record, times.as_deref());
    (own.into_iter().chain(rates).chain(turned).chain(holes)).collect()
}

/// Share of a record, and samples, from which on a hole has its place said; and how many such holes are no bursts.
const HOLE: (f64, u64) = (0.01, 10);
const HOLES: usize = 5;
/// Samples from which on a step is one whose length nothing tells.
const UNCOUNTED: u64 = 1 << 40;

/// Where the largest holes are.
fn holes(record: &Record, times: Option<&[f64]>) -> Option<String> {
    let sampling = Sampling::of(record, None).ok()?;
    let slots = &sampling.slots;
    // Between two rows of one time, say, nothing tells how many there should be.
    let step = |pair: &[u64]| pair[1].saturating_sub(pair[0]);
    let counted = |pair: &[u64]| Some(step(pair)).filter(|n| *n < UNCOUNTED).unwrap_or(0);
    let all: u64 = slots.windows(2).map(counted).sum();
    let least = HOLE.1.max((HOLE.0 * all as f64) as u64);
    let lost = |pair: &[u64]| counted(pair).saturating_sub(1);
    let rows: Vec<usize> = (0..slots.len().saturating_sub(1))
        .filter(|row| lost(&slots[*row..row + 2]) >= least)
        .collect();
    if rows.is_empty() || rows.len() > HOLES || times.is_none_or(|times| times.len() != slots.len())
    {
        return None;
    }
    let places = rows.iter().map(|row| {
        let at = |row: usize| times.map_or(f64::NAN, |times| times[row]);
        format!(
            "{:.2} to {:.2} s ({} samples)",
            at(*row),
            at(row + 1),
            lost(&slots[*row..row + 2])
        )
    });
    Some(format!(
        "no rows from {}",
        places.collect::<Vec<_>>().join(", ")
    ))
}

/// Device time where there is one, else the time column, s from the first row on.
pub(super) fn times(record: &Record) -> Option<Vec<f64>> {
    match (&record.t_ticks, record.header.tick_s, &record.host_time_s) {
        (Some(ticks), Some(tick_s), _) => {
            let first = *ticks.first()?;
            let since = |t: &u64| t.wrapping_sub(first) as i64 as f64 * tick_s;
            Some(ticks.iter().map(since).collect())
        }
        (_, _, Some(times)) => {
            let first = *times.first()?;
            Some(times.iter().map(|t| t - first).collect())
        }
        _ => None,
    }
}

fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() {
        return f64::NAN;
    }
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Medians and means of the steps in parts of a record; `None` of one too short.
fn by_parts(times: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
    let steps: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
    let length = steps.len() / BLOCKS;
    if length < STEPS {
        return None;
    }
    let parts = steps.chunks_exact(length).take(BLOCKS);
    let each = parts.map(|part| {
        let mean = part.iter().sum::<f64>() / part.len() as f64;
        (median(&mut part.to_vec()), mean)
    });
    Some(each.unzip())
}

/// Whether the steps of a record are not the same throughout. By their median and mean in parts: a gap moves one part's mean,
/// arrival in bursts the medians alone.
fn rate_changes(medians: &[f64], means: &[f64]) -> bool {
    let is_other = |of: &[f64]| {
        let parts = of.chunks_exact(BLOCKS / 3);
        let thirds: Vec<f64> = parts.map(|third| median(&mut third.to_vec())).collect();
        let [least, most] = [f64::min, f64::max].map(|pick| thirds.iter().copied().reduce(pick));
        let (Some(least), Some(most)) = (least, most) else {
            return false;
        };
        least > 0.0 && most > OTHER_RATE * least
    };
    is_other(medians) && is_other(means)
}

/// The row from which on steps are nearer to the last ones than to the first: the split by which most steps are on their side.
fn split(times: &[f64], first: f64, last: f64) -> usize {
    let between = (first * last).sqrt();
    let (mut lead, mut best) = (0_i64, (0_i64, 0));
    for (k, step) in times.windows(2).map(|w| w[1] - w[0]).enumerate() {
        lead += if (step > between) == (first > between) {
            1
        } else {
            -1
        };
        if lead > best.0 {
            best = (lead, k + 1);
        }
    }
    best.1
}

/// Part of itself to which a rate has to be known where the times alone tell it, and by which a note says how far it is.
const KNOWN: f64 = 0.05;
const TOLD: f64 = 2e-3;

/// Part of itself by which the rate may be off where most rows have the time of the row before: the times are rounded to
/// steps, and neither the first nor the last is seen whole. `None` of other times.
fn rounded(times: &[f64]) -> Option<f64> {
    let steps: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
    let mut apart: Vec<f64> = steps.iter().copied().filter(|step| *step > 0.0).collect();
    if 2 * apart.len() >= steps.len() {
        return None;
    }
    let step = median(&mut apart);
    let span = times.last()? - times.first()?;
    Some(step / span).filter(|part| part.is_finite())
}

/// What to say of a rate that only rounded times tell.
///
/// # Errors
/// Where they are too coarse to tell it, as seconds since 1970 in single precision are.
pub(super) fn by_rounded_times(record: &Record) -> Result<Option<String>, CaptureError> {
    let Some(part) = times(record).as_deref().and_then(rounded) else {
        return Ok(None);
    };
    let percent = number(100.0 * part, 2);
    if part > KNOWN {
        return Err(CaptureError::Time {
            why: format!("the times are rounded so coarsely that they tell the rate to {percent} % only"),
            help: "say the rate: `--rate HZ`; or write the times with more digits (seconds since 1970 need double precision)"
                .to_owned(),
        });
    }
    Ok((part > TOLD).then(|| {
        format!("such times tell the rate to {percent} %; `--rate HZ` says it to all digits")
    }))
}

/// An error where the file is two records behind one another, each of one rate.
pub(super) fn one_rate(record: &Record) -> Result<(), CaptureError> {
    times(record)
        .and_then(|times| two_rates(&times))
        .map_or(Ok(()), Err)
}

fn two_rates(times: &[f64]) -> Option<CaptureError> {
    let (medians, means) = by_parts(times)?;
    let (first, last) = (medians[0], medians[BLOCKS - 1]);
    let is_other = first.max(last) > OTHER_RATE * first.min(last);
    if !is_other || !rate_changes(&medians, &means) {
        return None;
    }
    let row = split(times, first, last);
    let is_steady = |part: &[f64]| {
        by_parts(part).is_none_or(|(medians, means)| !rate_changes(&medians, &means))
    };
    if !is_steady(&times[..=row]) || !is_steady(&times[row..]) {
        return None;
    }
    Some(CaptureError::TwoRates {
        before_hz: 1.0 / first,
        after_hz: 1.0 / last,
        row: row + 1,
        at_s: times[row],
    })
}

/// What to say of a rate that changes more than once, or slowly.
fn changing_rate(times: &[f64]) -> Option<String> {
    let (medians, means) = by_parts(times)?;
    if !rate_changes(&medians, &means) {
        return None;
    }
    let (first, last) = (medians[0], medians[BLOCKS - 1]);
    let (least, most) = medians
        .iter()
        .fold((first, first), |(low, high), v| (low.min(*v), high.max(*v)));
    let between = (least * most).sqrt();
    let at = medians
        .iter()
        .position(|m| (*m > between) != (first > between));
    let row = at.map_or(0, |block| block * (times.len() - 1) / BLOCKS);
    Some(format!(
        "the sample rate changes: {:.4} Hz at the start, {:.4} Hz at the end, the first change near row {} ({:.4} s): \
         what is said of rates, noise and spectra mixes them; take the parts one by one (`--span FROM,TO`)",
        1.0 / first,
        1.0 / last,
        row + 1,
        times.get(row).copied().unwrap_or(0.0)
    ))
}

/// A sensor that lies in another attitude later on, where nobody says that its base moves.
fn turned(record: &Record, times: Option<&[f64]>) -> Option<String> {
    if matches!(record.header.base, Some(Base::Moving | Base::Turntable)) {
        return None;
    }
    let axis = |axis| {
        let channel = record.of(Quantity::Acc, Some(axis))?;
        (channel.unit == "m/s^2").then_some(channel.values.as_slice())
    };
    let [Some(x), Some(y), Some(z)] = Axis::ALL.map(axis) else {
        return None;
    };
    let length = record.len() / BLOCKS;
    if length < STEPS {
        return None;
    }
    let mean = |of: &[f64], block: usize| {
        let mut part: Vec<f64> = of.get(block * length..(block + 1) * length)?.to_vec();
        part.retain(|v| v.is_finite());
        (!part.is_empty()).then(|| median(&mut part) / STANDARD_GRAVITY)
    };
    let down = |block: usize| {
        let v = [mean(x, block)?, mean(y, block)?, mean(z, block)?];
        let size = v.iter().map(|v| v * v).sum::<f64>().sqrt();
        GRAVITY.contains(&size).then(|| v.map(|v| v / size))
    };
    let first = down(0)?;
    let angle = |block: usize| {
        let cosine: f64 = down(block)?.iter().zip(first).map(|(a, b)| a * b).sum();
        Some(cosine.clamp(-1.0, 1.0).acos().to_degrees())
    };
    // Two parts in a row: what sways comes back within one.
    let is_turned = |block: &usize| {
        let far = |block| angle(block).is_some_and(|a| a > TURNED_DEG);
        far(*block) && (far(block + 1) || block + 1 == BLOCKS)
    };
    let at = (1..BLOCKS).find(is_turned)?;
    let most = (at..BLOCKS).filter_map(angle).fold(0.0, f64::max);
    let row = at * length;
    let when = times.and_then(|times| times.get(row));
    let place = when.map_or(format!("row {}", row + 1), |t| format!("{t:.4} s"));
    Some(format!(
        "the sensor is turned against gravity, by {most:.0} deg at most, from {place} on: noise figures are of a sensor that \
         lies still; take one part (`--span FROM,TO`), or say what the base does (`--base moving`)"
    ))
}

#[cfg(test)]
mod tests {
    use model::record::Channel;

    use super::*;

    fn times_of(step: &dyn Fn(usize) -> f64) -> Vec<f64> {
        let steps = (0..1200).map(step).scan(0.0, |t, step| {
            *t += step;
            Some(*t)
        });
        steps.collect()
    }

    #[test]
    fn two_records_behind_one_another_are_refused_with_their_place_to_the_row() {
        for (k, slow, fast) in [(600, 0.05, 1e-4), (300, 0.05, 0.01), (900, 0.01, 0.05)] {
            // Sampled late or early by a tenth.
            let late = |i: usize| 1.0 + 0.1 * ((i * 7 % 11) as f64 / 5.0 - 1.0);
            let times = times_of(&|i| late(i) * if i < k { slow } else { fast });
            let Some(CaptureError::TwoRates { row, at_s, .. }) = two_rates(&times) else {
                panic!("{k}: one rate");
            };
            // The step that begins the second part is that of the row before.
            assert_eq!(row, k, "{slow} {fast}");
            assert_eq!(at_s, times[k - 1]);
        }
    }

    #[test]
    fn a_hole_has_its_place_and_single_samples_and_bursts_have_none() {
        let record = |step: &dyn Fn(usize) -> f64| {
            let times = times_of(step);
            let readings = Channel {
                name: "gyro_x".to_owned(),
                quantity: Quantity::Gyro,
                axis: Some(Axis::X),
                unit: "deg/s".to_owned(),
                values: vec![0.0; times.len()],
                counts: None,
                lsb: None,
            };
            Record {
                channels: vec![readings],
                host_time_s: Some(times),
                ..Record::default()
            }
        };
        let told = |step: &dyn Fn(usize) -> f64| unsteady(&record(step)).join("; ");
        let said = told(&|k| if k == 700 { 5.0 } else { 0.05 });
        assert_eq!(said, "no rows from 34.95 to 39.95 s (99 samples)");
        assert_eq!(told(&|k| if k % 100 == 50 { 0.1 } else { 0.05 }), "");
        let bursts = told(&|k| if k % 100 == 50 { 30.0 } else { 0.05 });
        assert!(!bursts.contains("no rows"), "{bursts}");
        // Two rows of one time are no hole, and hide none.
        let twice = |k| match k {
            300 => 0.0,
            700 => 5.0,
            _ => 0.05,
        };
        assert_eq!(told(&twice), "no rows from 34.90 to 39.90 s (99 samples)");
    }

    #[test]
    fn a_rate_that_changes_slowly_or_twice_is_told_and_gaps_and_bursts_are_none() {
        let told = |step: &dyn Fn(usize) -> f64| {
            let times = times_of(step);
            (two_rates(&times).is_some(), changing_rate(&times).is_some())
        };
        assert_eq!(told(&|k| 0.1 * 1.006f64.powi(k as i32)), (false, true));
        let twice = |k: usize| if (400..800).contains(&k) { 0.01 } else { 0.05 };
        assert_eq!(told(&twice), (false, true));
        let none = (false, false);
        assert_eq!(told(&|_| 0.05), none);
        assert_eq!(told(&|k| if k == 700 { 500.0 } else { 0.05 }), none);
        // Ten rows at once, twice a second; and in the last third twenty at once, once a second.
        assert_eq!(told(&|k| if k % 10 == 0 { 0.5 } else { 1e-6 }), none);
        let later = |k: usize| match (k >= 800, k % 10, k % 20) {
            (false, 0, _) => 0.5,
            (true, _, 0) => 1.0,
            _ => 1e-6,
        };
        assert_eq!(told(&later), none);
    }
}
