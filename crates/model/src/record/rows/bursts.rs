//! Records that come in bursts: some seconds of readings, a pause of minutes, and again.

use std::ops::Range;

use crate::file::ModelFile;
use crate::record::Record;

use super::parts::steps;
use super::{Place, rate, taken};

/// Least bursts that tell of what is slower than one: a scatter of seven differences is known to 27 %.
const LEAST: usize = 8;
/// Least pause between two bursts, against the readings of one.
const PAUSE: f64 = 1.0;
/// Least readings of a burst: below it there is no spectrum of what is faster.
const LEAST_READINGS: usize = 16;
/// Most that one pause, and one burst, may be off the usual one: what a random walk adds from burst to burst is taken to be alike.
const ALIKE: f64 = 0.5;
/// Share of the bursts that has to be so.
const MOST: f64 = 0.8;
/// Share of the readings in one part from which on that part tells more by itself.
const ONE_PART: f64 = 0.25;

/// Where the bursts lie, of a record in which they are laid end to end.
#[derive(Clone, Debug, PartialEq)]
pub struct Bursts {
    /// First place of each.
    pub starts: Vec<usize>,
    /// Start of each, s from the first.
    pub at_s: Vec<f64>,
    /// Usual length, s.
    pub length_s: f64,
    /// Mean time from start to start, s.
    pub period_s: f64,
    /// Sample rate in one, Hz.
    pub rate_hz: f64,
}

impl Bursts {
    /// The instant of a time as it passed, as if nothing lay between the bursts; both s from the start.
    #[must_use]
    pub fn joined(&self, time_s: f64) -> f64 {
        let burst = self
            .at_s
            .partition_point(|at| *at <= time_s + 0.5 / self.rate_hz);
        let burst = burst.saturating_sub(1);
        self.starts[burst] as f64 / self.rate_hz + time_s - self.at_s[burst]
    }

    /// Makes the random walk of a model that of bursts end to end, which adds in the length of one what it adds in the period.
    pub fn join(&self, model: &mut ModelFile) {
        walk(model, (self.period_s / self.length_s).sqrt());
    }

    /// Makes the random walk of a model of bursts end to end that of time as it passed.
    pub fn part(&self, model: &mut ModelFile) {
        walk(model, (self.length_s / self.period_s).sqrt());
    }

    /// Samples from the one before to each of `samples`, the time between the bursts with them.
    #[must_use]
    pub fn spans(&self, samples: usize) -> Vec<f64> {
        let rate_hz = self.rate_hz;
        let mut spans = vec![1.0; samples];
        for (start, at) in self.starts.windows(2).zip(self.at_s.windows(2)) {
            let within = (start[1] - start[0] - 1) as f64;
            if let Some(span) = spans.get_mut(start[1]) {
                *span = (rate_hz * (at[1] - at[0]) - within).max(1.0);
            }
        }
        spans
    }

    /// Time of an instant, given as if nothing lay between the bursts; both s from the start.
    #[must_use]
    pub fn time(&self, joined_s: f64) -> f64 {
        let place = (joined_s * self.rate_hz).max(0.0);
        let burst = self.starts.partition_point(|s| *s as f64 <= place);
        let burst = burst.saturating_sub(1);
        self.at_s[burst] + (place - self.starts[burst] as f64) / self.rate_hz
    }
}

/// Makes the random walks of a model so much larger.
fn walk(model: &mut ModelFile, by: f64) {
    let walks = model.channels.iter_mut();
    for walk in walks.filter_map(|c| c.baseline.get_mut("rate_random_walk")) {
        walk.value *= by;
        walk.std_error = walk.std_error.map(|e| e * by);
    }
}

/// Rows of a record between its pauses, by the steps of its rows.
fn parts(steps: &[f64]) -> Vec<Range<usize>> {
    let mut parts: Vec<Range<usize>> = vec![];
    let mut from = 0;
    for (row, step) in steps.iter().enumerate().skip(1) {
        if *step > 1.0 + PAUSE * LEAST_READINGS.max(row - from) as f64 {
            parts.push(from..row);
            from = row;
        }
    }
    parts.push(from..steps.len());
    parts
}

/// Whether parts are bursts: many, long enough, alike in length and pause, and none much longer than the others.
fn are_bursts(parts: &[Range<usize>], lengths: &[f64], steps: &[f64]) -> bool {
    let pause = |p: &Range<usize>| steps[p.start];
    let pauses: Vec<f64> = parts.iter().skip(1).map(pause).collect();
    let most = |all: &[f64]| {
        let usual = rate::median(all);
        let near = all.iter().filter(|v| (**v - usual).abs() <= ALIKE * usual);
        near.count() as f64 >= MOST * all.len() as f64
    };
    let longest = lengths.iter().copied().fold(0.0, f64::max);
    parts.len() >= LEAST
        && rate::median(lengths) >= LEAST_READINGS as f64
        && longest < ONE_PART * steps.len() as f64
        && most(lengths)
        && most(&pauses)
}

/// The bursts of a record laid end to end, where it comes in such; no part of it is much longer than the others.
#[must_use]
pub fn end_to_end(record: &Record) -> Option<(Record, Bursts)> {
    let steps = steps(record)?;
    let parts = parts(&steps);
    let lengths: Vec<f64> = parts.iter().map(|p| p.len() as f64).collect();
    let fits = are_bursts(&parts, &lengths, &steps);
    let rate_hz = super::by_times(record).or(record.header.rate_hz);
    let rate_hz = rate_hz.filter(|r| fits && *r > 0.0)?;
    let (mut places, mut starts, mut at_s) = (Vec::with_capacity(record.len()), vec![], vec![]);
    let (mut place, mut time) = (0i64, 0.0);
    for part in &parts {
        for row in part.clone() {
            let step = if row == part.start { 1.0 } else { steps[row] };
            place += if row == 0 {
                0
            } else {
                step.round().max(1.0) as i64
            };
            time += if row == 0 { 0.0 } else { steps[row] / rate_hz };
            if row == part.start {
                starts.push(place as usize);
                at_s.push(time);
            }
            places.push(Place {
                row,
                seq: Some(place),
                ticks: None,
                shift_s: 0.0,
            });
        }
    }
    let bursts = Bursts {
        length_s: rate::median(&lengths) / rate_hz,
        period_s: at_s[at_s.len() - 1] / (at_s.len() - 1) as f64,
        starts,
        at_s,
        rate_hz,
    };
    let mut out = taken(record, &places);
    out.header.rate_hz = Some(rate_hz);
    out.seq = Some(
        places
            .iter()
            .filter_map(|p| p.seq.map(|s| s as u64))
            .collect(),
    );
    // Of the clock nothing is left that the numbers do not tell.
    (out.t_ticks, out.host_time_s) = (None, None);
    out.notes.push(format!(
        "the record comes in {} bursts of {:.3} s, one every {:.0} s: they are diagnosed end to end. What follows a recorded channel, and \
         noise faster than a burst, is sought; courses of time, lines and slow processes are not. K is for time as it passed",
        bursts.starts.len(),
        bursts.length_s,
        bursts.period_s
    ));
    Some((out, bursts))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{Axis, Channel, Header, Quantity};

    /// Rows at the times of bursts of `length` readings at 50 Hz.
    fn of(bursts: usize, length: usize, period_s: f64) -> Record {
        let each = |b: usize| (0..length).map(move |i| b as f64 * period_s + i as f64 * 0.02);
        let times: Vec<f64> = (0..bursts).flat_map(each).collect();
        Record {
            header: Header::default(),
            channels: vec![Channel {
                name: "gyro_x".into(),
                quantity: Quantity::Gyro,
                axis: Some(Axis::X),
                unit: "deg/s".into(),
                values: (0..times.len()).map(|i| i as f64).collect(),
                counts: None,
                lsb: None,
            }],
            host_time_s: Some(times),
            ..Record::default()
        }
    }

    #[test]
    fn bursts_are_laid_end_to_end_and_their_times_are_kept() {
        let (joined, bursts) = end_to_end(&of(12, 100, 60.0)).expect("bursts");
        assert_eq!(
            joined.seq.as_deref(),
            Some(&(0..1200).collect::<Vec<u64>>()[..])
        );
        assert_eq!(joined.notes.len(), 1);
        assert!((joined.header.rate_hz.expect("a rate") - 50.0).abs() < 1e-6);
        assert_eq!(bursts.starts[..3], [0, 100, 200]);
        assert!((bursts.length_s - 2.0).abs() < 1e-9 && (bursts.period_s - 60.0).abs() < 0.1);
        // A quarter of a second into the fourth burst.
        assert!((bursts.time(6.25) - 180.25).abs() < 0.1);
        for t in [0.0, 1.98, 2.0, 6.25, 23.98] {
            let back = bursts.joined(bursts.time(t));
            assert!((back - t).abs() < 1e-9, "{t}: {back}");
        }
    }

    #[test]
    fn few_parts_short_pauses_and_one_long_part_are_no_bursts() {
        assert!(end_to_end(&of(4, 100, 60.0)).is_none());
        assert!(end_to_end(&of(12, 100, 2.2)).is_none());
        assert!(end_to_end(&of(1, 1200, 60.0)).is_none());
        let mut long = of(12, 100, 60.0);
        let times = long.host_time_s.as_mut().expect("times");
        let last = times[times.len() - 1];
        times.extend((1..1500).map(|i| last + f64::from(i) * 0.02));
        let rows = times.len();
        long.channels[0].values.resize(rows, 0.0);
        assert!(end_to_end(&long).is_none());
    }

    #[test]
    fn a_reading_that_is_lost_in_a_burst_leaves_its_place_free() {
        let mut record = of(12, 100, 60.0);
        record.host_time_s.as_mut().expect("times").remove(150);
        record.channels[0].values.remove(150);
        let (joined, _) = end_to_end(&record).expect("bursts");
        let seq = joined.seq.expect("numbers");
        assert_eq!(seq[148..152], [148, 149, 151, 152]);
    }
}
