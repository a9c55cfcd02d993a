//! Frames: gaps of the sequence numbers, time that passes without a number, readings flagged as not new, alarms.

use model::record::{Axis, Record, flag};

use super::{Audit, Gyro, counted};
use crate::audit::local::{median, width};
use crate::result::Unexplained;

/// Frames before and after a leap of the time that say whether it lasts.
const AROUND: usize = 20;
/// Spread of the intervals, in intervals, beyond which a time column says nothing of single frames.
const IRREGULAR: f64 = 0.3;

/// Leaps of `time` against `number` that last: row and frames lost. `time` is in intervals.
fn leaps(time: &[f64], number: &[f64]) -> Vec<(usize, u64)> {
    let n = time.len();
    let ahead: Vec<f64> = time.iter().zip(number).map(|(t, s)| t - s).collect();
    let mut found = vec![];
    let mut i = 1;
    while i < n {
        if ahead[i] - ahead[i - 1] > 0.5 {
            let after = median(&ahead[i..(i + AROUND).min(n)]);
            let before = median(&ahead[i.saturating_sub(AROUND)..i]);
            // A late frame is late alone; a lost one leaves all that follow late.
            let lost = (after - before).round();
            if lost >= 1.0 {
                found.push((i, lost as u64));
                let rest: f64 = (ahead[i] - ahead[i - 1]).round();
                if rest < lost {
                    // Several close by: the median saw more than this one.
                    if let Some(last) = found.last_mut() {
                        last.1 = rest.max(1.0) as u64;
                    }
                }
            }
        }
        i += 1;
    }
    found
}

fn in_intervals(t: &[f64], number: &[f64]) -> Option<Vec<f64>> {
    let intervals: Vec<f64> = t
        .windows(2)
        .zip(number.windows(2))
        .filter(|(_, s)| s[1] > s[0])
        .map(|(t, s)| (t[1] - t[0]) / (s[1] - s[0]))
        .collect();
    let period = median(&intervals);
    if period.is_nan() || period <= 0.0 {
        return None;
    }
    let first = t.first()?;
    Some(t.iter().map(|v| (v - first) / period).collect())
}

pub(super) fn audit(record: &Record, gyros: &[Gyro<'_>], at: &[f64], audit: &mut Audit) {
    let rows = at.len();
    let names: Vec<String> = gyros.iter().map(|g| g.channel.name.clone()).collect();
    if rows < 2 {
        return;
    }
    let seq = record.seq.as_ref().filter(|s| s.len() == rows);
    let ticks = record.t_ticks.as_ref().filter(|t| t.len() == rows);
    let host = record.host_time_s.as_ref().filter(|t| t.len() == rows);
    let mut events: Vec<(usize, u64)> = vec![];
    if let Some(seq) = seq {
        events.extend(
            (1..rows)
                .filter(|i| seq[*i] > seq[*i - 1] + 1)
                .map(|i| (i, seq[i] - seq[i - 1] - 1)),
        );
    }
    let with_gaps = events.iter().map(|e| e.1).sum::<u64>();
    let number: Vec<f64> = match seq {
        Some(s) => s.iter().map(|v| v.saturating_sub(s[0]) as f64).collect(),
        None => (0..rows).map(|i| i as f64).collect(),
    };
    let clock: Option<Vec<f64>> = ticks
        .map(|t| t.iter().map(|v| v.saturating_sub(t[0]) as f64).collect())
        .or_else(|| host.filter(|_| seq.is_none()).cloned());
    match clock.as_ref().and_then(|t| in_intervals(t, &number)) {
        Some(time) => {
            let steps: Vec<f64> = time
                .windows(2)
                .zip(number.windows(2))
                .map(|(t, s)| t[1] - t[0] - (s[1] - s[0]))
                .collect();
            let spread = width(&steps, 0.02);
            if spread > IRREGULAR {
                audit.untested(
                    "dropped_samples",
                    &format!(
                        "the times come at intervals that differ by {:.0} %, so a missing one does not show: record a sequence number or a device time",
                        100.0 * spread
                    ),
                );
            } else {
                audit.silently_lost = leaps(&time, &number);
                events.extend(&audit.silently_lost);
            }
        }
        None if seq.is_none() => audit.untested(
            "dropped_samples",
            "the record has neither sequence numbers nor times",
        ),
        None => {}
    }
    let lost: u64 = events.iter().map(|e| e.1).sum();
    let what = format!(
        "{lost} frames are missing: {with_gaps} by the sequence numbers, {} by the time between numbers",
        lost - with_gaps
    );
    let fails = audit.limit("dropped_samples", "record", lost as f64, 0.0, what.clone());
    if fails && !names.is_empty() {
        events.sort_unstable();
        let times: Vec<f64> = events.iter().map(|e| at[e.0 - 1]).collect();
        audit.findings.push(counted(
            "dropped_samples",
            names,
            lost as f64,
            None,
            &times,
            what,
        ));
    }
    flags(record, gyros, at, audit);
}

fn flags(record: &Record, gyros: &[Gyro<'_>], at: &[f64], audit: &mut Audit) {
    let Some(flags) = record.flags.as_ref().filter(|f| f.len() == at.len()) else {
        return;
    };
    for g in gyros {
        let Some(axis) = g.channel.axis else { continue };
        let name = g.channel.name.as_str();
        let bit = |first: u16, axis: Axis| first << axis.index();
        let old: Vec<usize> = (0..flags.len())
            .filter(|i| flags[*i] & bit(flag::NEW_DATA_X, axis) == 0)
            .collect();
        let what = format!("{} readings of {name} are flagged as not new", old.len());
        if audit.limit("new_data_flag", name, old.len() as f64, 0.0, what.clone()) {
            let times: Vec<f64> = old.iter().map(|i| at[*i]).collect();
            audit.findings.push(counted(
                "stale_samples",
                vec![name.to_owned()],
                old.len() as f64,
                None,
                &times,
                what,
            ));
            old.iter().for_each(|i| audit.mask(name, *i));
        }
        let alarms: Vec<usize> = (0..flags.len())
            .filter(|i| flags[*i] & bit(flag::ERROR_ALARM_X, axis) != 0)
            .collect();
        let what = format!(
            "the error/alarm bit of {name} is raised in {} frames, first at {:.2} s",
            alarms.len(),
            alarms.first().map_or(0.0, |i| at[*i])
        );
        if audit.limit("error_alarm", name, alarms.len() as f64, 0.0, what.clone()) {
            if let Some(c) = audit.checks.last_mut() {
                c.fails_after = true;
            }
            audit.unexplained.push(Unexplained {
                channel: name.into(),
                what,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_frame_is_not_a_lost_one() {
        let number: Vec<f64> = (0..100).map(f64::from).collect();
        let mut time = number.clone();
        time[40] += 0.9;
        assert_eq!(leaps(&time, &number), vec![]);
        time[60..].iter_mut().for_each(|t| *t += 2.0);
        assert_eq!(leaps(&time, &number), vec![(60, 2)]);
        time[65..].iter_mut().for_each(|t| *t += 1.0);
        assert_eq!(leaps(&time, &number), vec![(60, 2), (65, 1)]);
    }
}
