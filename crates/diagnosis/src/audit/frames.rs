//! Frames: gaps of the sequence numbers, time that passes without a number, readings flagged as not new, alarms.

use model::effects;
use model::record::batches;
use model::record::{Axis, Record, flag};

use super::repeats::beat;
use super::runs::Runs;
use super::{Audit, Gyro, counted};
use crate::test_level::{CheckId, Observation};
use numerics::order_statistics::{median, width};

/// Frames before and after a leap of the time that say whether it lasts.
const AROUND: usize = 20;
/// Spread of the intervals, in intervals, beyond which a time column says nothing of single frames.
const IRREGULAR: f64 = 0.3;
/// Share of the rows of the gyro with the fewest that gyros have in common where one event concerns them all.
const SHARED: f64 = 0.8;

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

/// Intervals that pass without a number: by the times of the rows, in units of the interval, and their numbers.
fn lost_in_time(time: &[f64], number: &[f64], audit: &mut Audit) {
    let steps = time.windows(2).zip(number.windows(2));
    let steps = steps.map(|(t, s)| t[1] - t[0] - (s[1] - s[0]));
    // What is missing is whole intervals; a row that comes early or by halves is another matter.
    let odd: Vec<f64> = steps
        .map(|s| if s > 0.5 { s - s.round() } else { s })
        .collect();
    let spread = width(&odd, 0.02);
    if spread > IRREGULAR {
        audit.untested(
            effects::dropped_samples::ID,
            &format!(
                "the times come at intervals that differ by {:.0} %, so a missing one does not show: record a sequence number or a device time",
                100.0 * spread
            ),
        );
    } else {
        audit.silently_lost = leaps(time, number);
    }
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
    let is_host = ticks.is_none() && seq.is_none();
    match clock.as_ref().and_then(|t| in_intervals(t, &number)) {
        Some(_) if is_host && host.is_some_and(|t| batches::arrive(t)) => audit.untested(
            effects::dropped_samples::ID,
            "rows arrive many at once, so a missing one does not show in their times: record a sequence number or a device time",
        ),
        Some(time) => lost_in_time(&time, &number, audit),
        None if seq.is_none() => audit.untested(
            effects::dropped_samples::ID,
            "the record has neither sequence numbers nor times",
        ),
        None => {}
    }
    events.extend(&audit.silently_lost);
    let lost: u64 = events.iter().map(|e| e.1).sum();
    let what = format!(
        "{lost} frames are missing: {with_gaps} by the sequence numbers, {} by the time between numbers",
        lost - with_gaps
    );
    audit.smallest(effects::dropped_samples::ID, "record", "count", 1.0, "1");
    let (id, count) = (CheckId::DroppedSamples, lost as f64);
    let fails = audit.limit(id, "record", count, 0.0, what.clone());
    if fails && !names.is_empty() {
        events.sort_unstable();
        let times: Vec<f64> = events.iter().map(|e| at[e.0 - 1]).collect();
        let cause = effects::dropped_samples::ID;
        let finding = counted(cause, names, count, None, &times, what);
        audit.findings.push(finding);
    }
    flags(record, gyros, at, audit);
}

fn flags(record: &Record, gyros: &[Gyro<'_>], at: &[f64], audit: &mut Audit) {
    let Some(flags) = record.flags.as_ref().filter(|f| f.len() == at.len()) else {
        return;
    };
    let bit = |first: u16, axis: Axis| first << axis.index();
    let mut all: Vec<(&str, Vec<usize>)> = vec![];
    for g in gyros {
        let Some(axis) = g.channel.axis else { continue };
        let name = g.channel.name.as_str();
        let old: Vec<usize> = (0..flags.len())
            .filter(|i| flags[*i] & bit(flag::NEW_DATA_X, axis) == 0)
            .collect();
        let what = format!("{} readings of {name} are flagged as not new", old.len());
        audit.limit(CheckId::NewDataFlag, name, old.len() as f64, 0.0, what);
        old.iter().for_each(|i| audit.mask(name, *i));
        all.push((name, old));
        let alarms: Vec<usize> = (0..flags.len())
            .filter(|i| flags[*i] & bit(flag::ERROR_ALARM_X, axis) != 0)
            .collect();
        let what = format!(
            "the error/alarm bit of {name} is raised in {} frames, first at {:.2} s",
            alarms.len(),
            alarms.first().map_or(0.0, |i| at[*i])
        );
        if audit.limit(
            CheckId::ErrorAlarm,
            name,
            alarms.len() as f64,
            0.0,
            what.clone(),
        ) {
            if let Some(c) = audit.checks.last_mut() {
                c.fails_after = true;
            }
            let seen = Observation::of_readings(name, what);
            audit.unexplained.push(seen.by(CheckId::ErrorAlarm, 0.0));
        }
    }
    for (names, rows) in together(all) {
        let what = match names.as_slice() {
            [name] => format!("{} readings of {name} are flagged as not new", rows.len()),
            _ => format!(
                "{} frames are flagged as not new for {} together",
                rows.len(),
                names.join(", ")
            ),
        };
        let times: Vec<f64> = rows.iter().map(|i| at[*i]).collect();
        let count = rows.len() as f64;
        let mut finding = counted(effects::stale_samples::ID, names, count, None, &times, what);
        let runs = Runs::new(&rows, 0.0, flags.len()).running();
        finding.parameters.insert("running".into(), runs);
        let rate = beat::sensor_rate(&rows, 0.0, at);
        (finding.parameters).extend(rate.map(|rate| ("sensor_rate".into(), rate)));
        audit.findings.push(finding);
    }
}

/// Rows of each gyro as events: rows that several gyros share are one, the most gyros first.
fn together(mut all: Vec<(&str, Vec<usize>)>) -> Vec<(Vec<String>, Vec<usize>)> {
    let mut events = vec![];
    let mut groups: Vec<u32> = (1..1u32 << all.len())
        .filter(|g| g.count_ones() > 1)
        .collect();
    groups.sort_by_key(|g| std::cmp::Reverse(g.count_ones()));
    for group in groups {
        let own = |i: &usize| (group >> i) & 1 == 1;
        let members: Vec<usize> = (0..all.len()).filter(own).collect();
        let Some(fewest) = members.iter().map(|i| all[*i].1.len()).min() else {
            continue;
        };
        let common: Vec<usize> = (all[members[0]].1.iter().copied())
            .filter(|r| members.iter().all(|i| all[*i].1.binary_search(r).is_ok()))
            .collect();
        if common.is_empty() || (common.len() as f64) < SHARED * fewest as f64 {
            continue;
        }
        for i in &members {
            all[*i].1.retain(|r| common.binary_search(r).is_err());
        }
        let names = members.iter().map(|i| all[*i].0.to_owned()).collect();
        events.push((names, common));
    }
    events.extend(
        (all.into_iter())
            .filter(|(_, rows)| !rows.is_empty())
            .map(|(name, rows)| (vec![name.to_owned()], rows)),
    );
    events
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_gyros_share_are_one_event() {
        let half: Vec<usize> = (0..100).step_by(2).collect();
        let common = vec![4, 10, 51, 52];
        let of = |more: &[usize]| {
            let mut rows = [common.clone(), more.to_vec()].concat();
            rows.sort_unstable();
            rows.dedup();
            rows
        };
        let names = |n: &[&str]| n.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>();
        let (x, y, z) = (of(&half), of(&[7]), of(&[]));
        let rest: Vec<usize> = half
            .iter()
            .copied()
            .filter(|r| ![4, 10, 52].contains(r))
            .collect();
        assert_eq!(
            together(vec![("x", x), ("y", y), ("z", z)]),
            vec![
                (names(&["x", "y", "z"]), common.clone()),
                (names(&["x"]), rest),
                (names(&["y"]), vec![7])
            ]
        );
        let apart = vec![("x", vec![1, 5, 9]), ("y", vec![2, 5, 8]), ("z", vec![])];
        assert_eq!(together(apart).len(), 2);
    }

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
