//! Cells of slow channels that are no readings: what a thermometer puts out after a reset (85 degC of a DS18B20) or without its
//! sensor (-127 degC), a zero, a register that reads all ones. They jump far off and back at once, as nothing that has a heat
//! capacity can.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::{Channel, Quantity, Record};

/// Least jump of a temperature that is none, degC, and of a supply, in parts of itself: a supply does break down for a moment.
const LEAST_DEG_C: f64 = 3.0;
const LEAST_OF_SUPPLY: f64 = 0.5;
/// The same in changes from cell to cell, of which this share is smaller.
const USUAL: f64 = 0.8;
const CHANGES: f64 = 15.0;
/// Cells after which what jumped is back; where a reading is held over many, readings.
const LONGEST: usize = 3;
const READINGS: usize = 2;
/// Share of the cells up to which they are single ones.
const MOST: f64 = 0.05;
/// Cells by whose middle the first one is judged.
const FIRST: usize = 25;
/// Values that a note names.
const NAMED: usize = 3;

/// The record with such cells as missing readings, which a note counts by channel.
#[must_use]
pub fn left_out(mut record: Cow<'_, Record>) -> Cow<'_, Record> {
    for at in 0..record.channels.len() {
        let cells = cells(&record.channels[at]);
        if cells.is_empty() {
            continue;
        }
        let record = record.to_mut();
        let note = note(&record.channels[at], &cells);
        for cell in cells {
            record.channels[at].values[cell] = f64::NAN;
        }
        record.notes.push(note);
    }
    record
}

fn note(channel: &Channel, cells: &[usize]) -> String {
    let mut often: BTreeMap<String, usize> = BTreeMap::new();
    for cell in cells {
        // As a table has it, not as it was scaled.
        let value = (channel.values[*cell] * 1e6).round() / 1e6;
        *often.entry(value.to_string()).or_default() += 1;
    }
    let mut often: Vec<(String, usize)> = often.into_iter().collect();
    often.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    let more = match often.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} other values"),
    };
    let (unit, count) = (&channel.unit, cells.len());
    let values = often.iter().take(NAMED);
    let values: Vec<String> = values.map(|(v, n)| format!("{n} x {v} {unit}")).collect();
    format!(
        "{}: {} far off and back at once, which nothing real is: {}",
        channel.name,
        values.join(", ") + &more,
        ending(count, channel.values.len())
    )
}

fn ending(count: usize, of: usize) -> String {
    format!("{count} of {of} cells are taken as no reading")
}

/// Whether a note says of a channel that so many cells were left out: all that it has no reading in.
pub(crate) fn are_told(record: &Record, name: &str, count: usize) -> bool {
    let (name, ending) = (format!("{name}: "), ending(count, record.len()));
    let mut notes = record.notes.iter();
    notes.any(|note| note.starts_with(&name) && note.ends_with(&ending))
}

/// Such cells of a channel.
fn cells(channel: &Channel) -> Vec<usize> {
    let is_slow = matches!(channel.quantity, Quantity::Temp | Quantity::Supply);
    let values = &channel.values;
    // Most channels of a record are others, and most slow ones are in order: nothing is copied for them.
    let known: Vec<usize> = match is_slow {
        true => (0..values.len())
            .filter(|i| values[*i].is_finite())
            .collect(),
        false => return vec![],
    };
    if known.len() < FIRST {
        return vec![];
    }
    let at = |k: usize| values[known[k]];
    let mut changes: Vec<f64> = (1..known.len())
        .map(|k| (at(k) - at(k - 1)).abs())
        .collect();
    let largest = changes.iter().copied().fold(0.0, f64::max);
    let usual = (USUAL * changes.len() as f64) as usize;
    let usual = *changes.select_nth_unstable_by(usual, f64::total_cmp).1;
    let least = match (channel.quantity, channel.unit.as_str()) {
        (Quantity::Temp, "degC") => LEAST_DEG_C,
        (Quantity::Supply, "V") => LEAST_OF_SUPPLY * middle(known.iter().map(|k| values[*k])).abs(),
        _ => return vec![],
    };
    let far = least.max(CHANGES * usual);
    if largest <= far {
        return vec![];
    }
    let longest = LONGEST.max(READINGS * held(&at, known.len()));
    let mut last = middle((0..FIRST).map(at));
    let (mut found, mut k) = (vec![], 0);
    while k < known.len() {
        let is_far = |k: &usize| (at(*k) - last).abs() > far;
        if is_far(&k) {
            let end = (k + 1..known.len().min(k + longest + 1)).find(|k| !is_far(k));
            let again = |k: &usize| found.iter().any(|f: &usize| values[*f] == at(*k));
            match end {
                Some(end) => {
                    found.extend(known[k..end].iter());
                    k = end;
                    continue;
                }
                // The record ends with what was seen before.
                None if known.len() - k <= longest && (k..known.len()).all(|k| again(&k)) => {
                    found.extend(known[k..].iter());
                    break;
                }
                None => {}
            }
        }
        last = at(k);
        k += 1;
    }
    let few = found.len() as f64 <= MOST * known.len() as f64;
    found.into_iter().filter(|_| few).collect()
}

/// Cells over which a reading is held, in the middle.
fn held(at: &dyn Fn(usize) -> f64, cells: usize) -> usize {
    let (mut runs, mut from) = (vec![], 0);
    for k in 1..cells {
        if at(k) != at(k - 1) {
            runs.push((k - from) as f64);
            from = k;
        }
    }
    runs.push((cells - from) as f64);
    // Runs are cut by what jumps.
    (middle(runs.into_iter()) as usize).min(cells / FIRST)
}

fn middle(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(quantity: Quantity, values: Vec<f64>) -> Record {
        let (name, unit) = match quantity {
            Quantity::Temp => ("temp", "degC"),
            _ => ("supply", "V"),
        };
        Record {
            channels: vec![Channel {
                name: name.into(),
                quantity,
                axis: None,
                unit: unit.into(),
                values,
                counts: None,
                lsb: None,
            }],
            ..Record::default()
        }
    }

    /// A thermometer of 1/16 degC that swings by 5 degC.
    fn temperature(rows: usize) -> Vec<f64> {
        let at = |k: usize| 25.0 + 5.0 * (k as f64 / 3000.0).sin();
        (0..rows).map(|k| (at(k) * 16.0).round() / 16.0).collect()
    }

    fn left(record: &Record) -> (Vec<usize>, Vec<String>) {
        let left = left_out(Cow::Borrowed(record));
        let values = left.channels[0].values.iter().enumerate();
        let none = values.filter(|(_, v)| v.is_nan()).map(|(k, _)| k);
        (none.collect(), left.notes.clone())
    }

    #[test]
    fn what_a_thermometer_puts_out_without_a_reading_is_none_and_is_told() {
        let mut values = temperature(12_000);
        let bad = [0, 147, 263, 264, 5000, 11_999];
        bad.iter().for_each(|k| values[*k] = 85.0);
        values[600] = -127.0;
        let (none, notes) = left(&record(Quantity::Temp, values));
        assert_eq!(none, [0, 147, 263, 264, 600, 5000, 11_999]);
        let told = "temp: 6 x 85 degC, 1 x -127 degC far off and back at once, which nothing real is: 7 of 12000 cells are \
                    taken as no reading";
        assert_eq!(notes, [told]);
    }

    #[test]
    fn a_thermometer_whose_readings_are_held_holds_what_is_none_too() {
        let each = temperature(600).into_iter().enumerate();
        let each = each.map(|(k, v)| if k % 97 == 5 { 85.0 } else { v });
        let values: Vec<f64> = each.flat_map(|v| [v; 20]).collect();
        assert_eq!(left(&record(Quantity::Temp, values)).0.len(), 7 * 20);
        let steady = |k: usize| if k % 500 == 7 { 0.0 } else { 25.0 };
        let values = (0..10_000).map(steady).collect();
        assert_eq!(left(&record(Quantity::Temp, values)).0.len(), 20);
    }

    #[test]
    fn what_lasts_what_is_noise_and_what_is_too_often_is_a_reading() {
        let steps = |k: usize| if k % 1000 < 500 { 20.0 } else { 60.0 };
        let noise = |k: usize| 25.0 + 9.0 * ((k * 7919 % 1009) as f64 / 1009.0 - 0.5);
        let often = |k: usize| if k % 10 == 3 { 85.0 } else { 25.0 };
        // A supply that breaks down to two thirds.
        let dips = |k: usize| if k % 500 == 7 { 3.3 } else { 5.0 };
        for (quantity, of) in [
            (Quantity::Temp, &steps as &dyn Fn(usize) -> f64),
            (Quantity::Temp, &noise),
            (Quantity::Temp, &often),
            (Quantity::Supply, &dips),
        ] {
            let whole = record(quantity, (0..10_000).map(of).collect());
            assert!(matches!(left_out(Cow::Borrowed(&whole)), Cow::Borrowed(_)));
        }
        let zero = |k: usize| if k % 500 == 7 { 0.0 } else { 5.0 };
        let values = (0..10_000).map(zero).collect();
        assert_eq!(left(&record(Quantity::Supply, values)).0.len(), 20);
    }
}
