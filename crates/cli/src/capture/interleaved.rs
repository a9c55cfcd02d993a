//! Tables of sensors that have rows of their own, as logs are that were merged by time: a row has the readings of one sensor
//! and no others, or one sensor reads in every row and another in every second. The rows of the gyros are the record, without
//! gyros those of the accelerometers; what has no readings in them is taken between its own.

use model::record::{Quantity, Record};

use super::error::brief_list;

/// Fewest rows without a reading of the sensor: one or two are lost in any log.
const FEWEST: usize = 10;
/// Of the rows without a reading of a sensor, at most one in so many is one that it should have had: its steps without them are even.
const EVEN: f64 = 4.0;

/// Leaves the rows of the leading sensor where others have rows of their own, and says so.
pub(super) fn take(record: &mut Record) {
    let Some(times) = &record.host_time_s else {
        return;
    };
    let rise = times.is_sorted();
    if !rise || record.seq.is_some() || record.t_ticks.is_some() {
        return;
    }
    let mut kinds = [Quantity::Gyro, Quantity::Acc].into_iter();
    let Some(leading) = kinds.find(|q| record.all(*q).next().is_some()) else {
        return;
    };
    let leads = |row: usize| record.all(leading).any(|c| !c.values[row].is_nan());
    let of_others: Vec<bool> = (0..record.len()).map(|row| !leads(row)).collect();
    let others = of_others.iter().filter(|o| **o).count();
    if others < FEWEST {
        return;
    }
    let own = |all: &[f64]| kept(all, &of_others);
    let own_times = own(times);
    if lost(&own_times).is_none_or(|lost| EVEN * lost > others as f64) {
        return;
    }
    let (mut between, mut fewer) = (vec![], vec![]);
    for channel in record.channels.iter_mut() {
        let own_values = own(&channel.values);
        let readings = own_values.iter().filter(|v| !v.is_nan()).count();
        let all = channel.values.iter().filter(|v| !v.is_nan()).count();
        if channel.quantity == leading || 2 * readings >= own_values.len() || all == 0 {
            if readings < all {
                fewer.push(channel.name.clone());
            }
            channel.values = own_values;
            channel.counts = channel
                .counts
                .as_ref()
                .map(|counts| kept(counts, &of_others));
            continue;
        }
        let holds = channel.quantity == Quantity::Pwm;
        channel.values = taken_between(times, &channel.values, &own_times, holds);
        (channel.counts, channel.lsb) = (None, None);
        between.push(channel.name.clone());
    }
    let leads = record.all(leading).map(|c| c.name.clone());
    let mut note = format!(
        "{others} of {} rows have no reading of {}, and those that have one are even: these are the record",
        times.len(),
        listed(&leads.collect::<Vec<_>>())
    );
    if !fewer.is_empty() {
        note += &format!(
            "; of {} the readings in these rows are taken",
            listed(&fewer)
        );
    }
    if !between.is_empty() {
        note += &format!(
            "; what has rows of its own is taken between its readings, and has not the noise of its sensor: {}",
            listed(&between)
        );
    }
    record.notes.push(note);
    record.flags = record.flags.as_ref().map(|flags| kept(flags, &of_others));
    record.host_time_s = Some(own_times);
}

fn listed(names: &[String]) -> String {
    brief_list(names).join(", ")
}

/// What is in the rows of the leading sensor.
fn kept<T: Copy>(all: &[T], of_others: &[bool]) -> Vec<T> {
    let rows = all.iter().zip(of_others);
    rows.filter(|(_, other)| !**other)
        .map(|(v, _)| *v)
        .collect()
}

/// Readings that are missing between rising times, by the usual step; `None` of times that have none.
fn lost(times: &[f64]) -> Option<f64> {
    let steps = || times.windows(2).map(|t| t[1] - t[0]);
    let mut all: Vec<f64> = steps().collect();
    let middle = all.len() / 2;
    if all.is_empty() {
        return None;
    }
    let usual = *all.select_nth_unstable_by(middle, f64::total_cmp).1;
    let more = |step: f64| ((step / usual).round() - 1.0).max(0.0);
    (usual > 0.0).then(|| steps().map(more).sum())
}

/// Values at other times, on straight lines between the readings, or each as it holds until the next; before the first and after
/// the last it is these.
fn taken_between(times: &[f64], values: &[f64], at: &[f64], holds: bool) -> Vec<f64> {
    let readings = || times.iter().zip(values).filter(|(_, v)| !v.is_nan());
    let mut next = readings().peekable();
    let mut before = None;
    let value = |t: &f64| {
        while let Some(reading) = next.next_if(|(s, _)| *s <= t) {
            before = Some(reading);
        }
        match (before, next.peek().copied()) {
            (Some((a, x)), Some((b, y))) if !holds => x + (y - x) * (t - a) / (b - a),
            (Some((_, x)), _) | (None, Some((_, x))) => *x,
            (None, None) => f64::NAN,
        }
    };
    at.iter().map(value).collect()
}
