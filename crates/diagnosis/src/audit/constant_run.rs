//! A gyro that stands still for a while: one reading, again and again, though its flag says new.
//!
//! A stretch of r repeats of one reading has the chance p^r n, p the share of neighbours that agree without a fault. It is
//! set aside before anything else is asked: it is no step of the bias, no quiet noise and no code that comes too often.

use std::borrow::Cow;
use std::cell::LazyCell;

use model::effects;
use model::record::{Channel, Quantity, Record, flag};

use super::repeats::{agreement, equal};
use super::runs::Runs;
use super::{Audit, LEAST_READINGS, counted};
use crate::test_level::CheckId;
use numerics::series::smallest_step;

/// Largest share of agreeing neighbours with which a reading that stands still says anything.
const MOST_AGREEING: f64 = 0.5;
/// Fewest readings of a stretch that is called frozen, and its chance at the largest.
const LEAST: f64 = 20.0;
const CHANCE: f64 = 1e-9;
/// Share of their repeats that gyros have in common when they stopped together.
const TOGETHER: f64 = 0.9;

/// What stands still of one gyro.
pub(super) struct Still {
    channel: String,
    /// Longest stretch, repeats; of any chance.
    longest: usize,
    /// Rows that repeat, of stretches that are none by chance.
    rows: Vec<usize>,
}

fn of(record: &Record, channel: &Channel, came: f64) -> Still {
    let values = &channel.values;
    let rows = values.len();
    let flags = record.flags.as_ref().filter(|f| f.len() == rows);
    let bit = channel.axis.map(|a| flag::NEW_DATA_X << a.index());
    let new = |i: usize| flags.zip(bit).is_none_or(|(f, bit)| f[i] & bit != 0);
    let lsb = channel.lsb.filter(|_| channel.counts.is_some());
    let step = lsb.unwrap_or_else(|| smallest_step(values));
    // Asked for where something stands still at all.
    let agreeing = LazyCell::new(|| agreement(values, step).0);
    let chance = |readings: f64| readings * agreeing.ln() + (rows as f64).ln();
    let (low, high) = values
        .iter()
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
            (l.min(*v), h.max(*v))
        });
    let mut still = Still {
        channel: channel.name.clone(),
        longest: 0,
        rows: vec![],
    };
    let mut start = 0;
    for i in 1..=rows {
        if i < rows && new(i) && equal(values[i], values[start], step) {
            continue;
        }
        let run = i - start - 1;
        // A reading at an end of the range is a rail, not a sensor that stopped.
        let inside = ![low, high].iter().any(|v| equal(values[start], *v, step));
        if inside {
            still.longest = still.longest.max(run);
            let readings = run as f64 * came;
            if readings >= LEAST && *agreeing < MOST_AGREEING && chance(readings) < CHANCE.ln() {
                still.rows.extend(start + 1..i);
            }
        }
        start = i;
    }
    still
}

/// The record without readings that stand still, and what stood still of each gyro; `came` readings of the sensor, at most 1, are one
/// that is written.
pub(super) fn set_aside(record: &Record, came: f64) -> (Cow<'_, Record>, Vec<Still>) {
    let asked = |c: &&Channel| {
        c.values.len() == record.len()
            && c.values.iter().filter(|v| v.is_finite()).count() >= LEAST_READINGS
    };
    let gyros = record.all(Quantity::Gyro).filter(asked);
    let all: Vec<Still> = gyros.map(|c| of(record, c, came)).collect();
    let mut rest = Cow::Borrowed(record);
    for still in all.iter().filter(|s| !s.rows.is_empty()) {
        let channels = &mut rest.to_mut().channels;
        if let Some(c) = channels.iter_mut().find(|c| c.name == still.channel) {
            still.rows.iter().for_each(|i| c.values[*i] = f64::NAN);
        }
    }
    (rest, all)
}

/// Whether two gyros stopped together.
fn together(a: &Still, b: &Still) -> bool {
    let common = a
        .rows
        .iter()
        .filter(|i| b.rows.binary_search(i).is_ok())
        .count();
    common as f64 > TOGETHER * a.rows.len().max(b.rows.len()) as f64
}

/// Checks and findings of what stood still; gyros that stopped together are one finding.
pub(super) fn audit(all: &[Still], at: &[f64], audit: &mut Audit) {
    let mut told: Vec<(&Still, Vec<String>)> = vec![];
    for still in all {
        let what = format!(
            "{} repeats one reading up to {} times running",
            still.channel, still.longest
        );
        let chance = if still.rows.is_empty() { 1.0 } else { CHANCE };
        let longest = still.longest as f64;
        if audit.check(
            CheckId::FrozenReadings,
            &still.channel,
            longest,
            chance,
            what,
        ) {
            match told.iter_mut().find(|(first, _)| together(first, still)) {
                Some((_, names)) => names.push(still.channel.clone()),
                None => told.push((still, vec![still.channel.clone()])),
            }
        }
    }
    for (still, names) in told {
        let times: Vec<f64> = still.rows.iter().map(|i| at[*i]).collect();
        let count = still.rows.len() as f64;
        let what = format!(
            "{} stood still: {count} readings repeat the one before, up to {} running",
            names.join(", "),
            still.longest
        );
        let mut finding = counted(
            effects::stale_samples::ID,
            names,
            count,
            Some(0.0),
            &times,
            what,
        );
        let runs = Runs::new(&still.rows, 0.0, at.len()).running();
        finding.parameters.insert("running".into(), runs);
        audit.findings.push(finding);
    }
}
