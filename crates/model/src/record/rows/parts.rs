//! Interruptions too long to bridge. Places without a row are filled so that a likelihood cannot tell, but what is
//! filled follows the rows about it: a hole that is long against the record would weigh more than its errors allow.

use std::borrow::Cow;
use std::ops::Range;

use crate::record::{Record, batches};

use super::LARGEST;
use super::keys::Keys;
use super::{Place, rate, taken};

/// Rows of which an interruption may be as long as one, in a part that is taken as one record.
const ROWS_TO_A_HOLE: f64 = 4.0;

/// Some rows of a record, one after the other.
#[must_use]
pub fn part_of(record: &Record, rows: Range<usize>) -> Record {
    let seq = record.seq.as_ref();
    let places: Vec<Place> = rows
        .map(|row| Place {
            row,
            seq: seq.map(|s| s[row] as i64),
            ticks: record.t_ticks.as_ref().map(|t| t[row] as i64),
            shift_s: 0.0,
        })
        .collect();
    taken(record, &places)
}

/// The longest part of a record without an interruption that is long against it. A record without any is borrowed.
#[must_use]
pub fn longest_part(record: &Record) -> Cow<'_, Record> {
    let Some(steps) = steps(record) else {
        return Cow::Borrowed(record);
    };
    let rows = record.len();
    let mut part = 0..rows;
    loop {
        let longest = (part.len() as f64 / ROWS_TO_A_HOLE).max(1.0);
        let mut parts: Vec<Range<usize>> = vec![];
        let mut from = part.start;
        for (row, step) in steps.iter().enumerate().take(part.end).skip(part.start + 1) {
            if step - 1.0 > longest {
                parts.push(from..row);
                from = row;
            }
        }
        parts.push(from..part.end);
        if parts.len() == 1 {
            break;
        }
        // Of equals the first.
        let most = parts.iter().map(Range::len).max().unwrap_or(0);
        if let Some(found) = parts.into_iter().find(|p| p.len() == most) {
            part = found;
        }
    }
    if part == (0..rows) {
        return Cow::Borrowed(record);
    }
    let mut out = part_of(record, part.clone());
    out.notes.push(format!(
        "the record is interrupted for longer than can be bridged: rows {} to {} of {rows}, its longest part, are diagnosed. \
         Split the file to have the others, too",
        part.start + 1,
        part.end
    ));
    Cow::Owned(out)
}

/// Intervals of `period` from the row before to each row, as far as the rows about them know of it: a single wrong time
/// is no interruption.
fn lasting(t: &[i64], period: f64) -> Vec<f64> {
    let step = |i: usize| {
        let before = [i.checked_sub(2), i.checked_sub(1)].into_iter().flatten();
        let last = t.len() - 1;
        let least = before
            .map(|b| t[i] - t[b])
            .chain((i > 0).then(|| t[(i + 1).min(last)] - t[i - 1]))
            .min();
        least.map_or(1.0, |l| l as f64 / period)
    };
    (0..t.len()).map(step).collect()
}

/// Intervals from the row before to each row.
pub(super) fn steps(record: &Record) -> Option<Vec<f64>> {
    let rows = record.len();
    let counter = |c: &Option<Vec<u64>>| {
        c.as_ref()
            .filter(|c| c.len() == rows && c.iter().all(|v| *v <= LARGEST))
            .map(|c| c.iter().map(|v| *v as i64).collect::<Vec<_>>())
    };
    let differences = |c: &[i64], unit: f64| -> Vec<f64> {
        let first = [1.0].into_iter().take(c.len());
        first
            .chain(c.windows(2).map(|w| (w[1] - w[0]) as f64 / unit))
            .collect()
    };
    let (seq, ticks) = (counter(&record.seq), counter(&record.t_ticks));
    let by_number = seq.as_ref().map(|s| differences(s, 1.0));
    let number: Vec<i64> = seq.unwrap_or_else(|| (0..rows as i64).collect());
    let by_ticks = ticks.and_then(|t| Some(lasting(&t, rate::ratio(&t, &number)?)));
    if by_number.is_some() || by_ticks.is_some() {
        return (0..rows)
            .map(|i| {
                let of = |s: &Option<Vec<f64>>| s.as_ref().map_or(0.0, |s| s[i]);
                Some(of(&by_number).max(of(&by_ticks)))
            })
            .collect();
    }
    let t = record.host_time_s.as_ref().filter(|t| t.len() == rows)?;
    Keys::of(record)?;
    let steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
    let usual = rate::median(&steps);
    let alike = steps.iter().filter(|d| (**d - usual).abs() < 0.5 * usual);
    // Times of arrival that come in batches tell nothing of interruptions.
    let regular = alike.count() as f64 > 0.9 * steps.len() as f64 && !batches::arrive(t);
    regular.then(|| {
        [1.0]
            .into_iter()
            .chain(steps.iter().map(|d| d / usual))
            .collect()
    })
}
