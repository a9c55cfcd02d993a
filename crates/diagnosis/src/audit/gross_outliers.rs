//! Readings that no motion and no noise comes near: a thousand times as far away as all others are from each other, for
//! a few samples, there and back from one sample to the next. A word that was shifted on the bus makes them, a parser that
//! lost a separator, a fill value. They are set aside before anything else is asked: a single one is more than all
//! the noise of a record, and several would be a base that moves.

use std::borrow::Cow;

use model::effects;
use model::record::{Channel, Quantity, Record};

use super::{Audit, LEAST_READINGS, counted};
use crate::test_level::CheckId;
use numerics::order_statistics::{median, width};

/// Share of the readings on either side that such readings are at most.
const SHARE: f64 = 0.002;
/// Widths of the rest from its middle.
const FAR: f64 = 1000.0;

/// Rows of a channel that read something wild.
pub(super) struct Wild {
    channel: String,
    rows: Vec<usize>,
}

fn of(channel: &Channel) -> Wild {
    let values = &channel.values;
    let known = values.iter().filter(|v| v.is_finite()).count();
    let (middle, wide) = (median(values), width(values, SHARE));
    let limit = FAR * wide;
    let rows = if known < LEAST_READINGS || limit.is_nan() || limit <= 0.0 {
        vec![]
    } else {
        let far = |i: &usize| (values[*i] - middle).abs() > limit;
        (0..values.len()).filter(far).collect()
    };
    Wild {
        channel: channel.name.clone(),
        rows,
    }
}

/// The record without wild readings, and which they are.
pub(super) fn set_aside(record: Cow<'_, Record>) -> (Cow<'_, Record>, Vec<Wild>) {
    let gyros = record.all(Quantity::Gyro);
    let all: Vec<Wild> = gyros
        .filter(|c| c.values.len() == record.len())
        .map(of)
        .filter(|w| !w.rows.is_empty())
        .collect();
    let mut rest = record;
    for wild in &all {
        let channels = &mut rest.to_mut().channels;
        if let Some(c) = channels.iter_mut().find(|c| c.name == wild.channel) {
            wild.rows.iter().for_each(|i| c.values[*i] = f64::NAN);
        }
    }
    (rest, all)
}

/// Findings of what was set aside.
pub(super) fn audit(all: &[Wild], record: &Record, at: &[f64], audit: &mut Audit) {
    for wild in all {
        let name = wild.channel.as_str();
        let Some(channel) = record.channels.iter().find(|c| c.name == name) else {
            continue;
        };
        let farthest = wild.rows.iter().map(|i| channel.values[*i]);
        let farthest = farthest.max_by(|a, b| a.abs().total_cmp(&b.abs()));
        let count = wild.rows.len() as f64;
        let what = format!(
            "{count} readings of {name} lie more than {FAR} times as far away as all others are from each other, the farthest at {:.3e} {}: set aside",
            farthest.unwrap_or(f64::NAN),
            channel.unit
        );
        audit.limit(CheckId::WildReadings, name, count, 0.0, what.clone());
        let times: Vec<f64> = wild.rows.iter().map(|i| at[*i]).collect();
        let names = vec![name.to_owned()];
        let finding = counted(effects::outliers::ID, names, count, None, &times, what);
        audit.findings.push(finding);
    }
}
