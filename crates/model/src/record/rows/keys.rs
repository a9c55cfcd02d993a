//! What tells the order of rows: sequence numbers, the device's time, else times of the rows.

use std::cmp::Ordering;

use crate::record::Record;

use super::{LARGEST, Place, rate};

/// Sequence numbers from a board's start that are its first.
pub(super) const START: usize = 20;
/// Steps of the sequence numbers on the wire before they begin again.
const TURN: f64 = 65_536.0;
/// Intervals that the device's time may go back by while the numbers go on: jitter.
const JITTER: f64 = 2.0;
/// Share of steps in which numbers and device time have to agree.
const AGREE: f64 = 0.9;
/// Ticks on the wire before they begin again.
const TICKS_TURN: u32 = 32;

/// Keys of the rows of a record.
pub(super) struct Keys {
    seq: Option<Vec<i64>>,
    ticks: Option<Vec<i64>>,
    host: Option<Vec<f64>>,
    /// Ticks from number to number; 1 without ticks.
    period: f64,
    /// Seconds from number to number, where known.
    period_s: Option<f64>,
}

impl Keys {
    /// Of a record that has any.
    pub(super) fn of(record: &Record) -> Option<Self> {
        let rows = record.len();
        let counter = |c: &Option<Vec<u64>>| {
            c.as_ref()
                .filter(|c| c.len() == rows && c.iter().all(|v| *v <= LARGEST))
                .map(|c| c.iter().map(|v| *v as i64).collect::<Vec<i64>>())
        };
        let host = record
            .host_time_s
            .clone()
            .filter(|h| h.len() == rows && h.iter().all(|t| t.is_finite()));
        let mut seq = counter(&record.seq).filter(|s| varies(s));
        let ticks = counter(&record.t_ticks).filter(|t| varies(t));
        let period = match (&ticks, &seq) {
            (Some(t), Some(s)) => rate::ratio(t, s),
            (Some(t), None) => {
                let mut sorted = t.clone();
                sorted.sort_unstable();
                let places: Vec<i64> = (0..sorted.len() as i64).collect();
                rate::ratio(&sorted, &places)
            }
            (None, _) => Some(1.0),
        };
        let ticks = ticks.filter(|_| period.is_some());
        let period = period.unwrap_or(1.0);
        if let (Some(t), Some(s)) = (&ticks, &seq) {
            seq = with_turns(t, s, period);
        }
        if seq.is_none() && ticks.is_none() && host.is_none() {
            return None;
        }
        let stated = || record.header.rate_hz.filter(|r| *r > 0.0).map(|r| 1.0 / r);
        let period_s = match (&ticks, record.header.tick_s) {
            (Some(_), Some(tick_s)) => Some(period * tick_s),
            _ => stated(),
        };
        Some(Self {
            seq,
            ticks,
            host,
            period,
            period_s: period_s.filter(|p| p.is_finite() && *p > 0.0),
        })
    }

    pub(super) fn len(&self) -> usize {
        let counters = self.seq.as_ref().or(self.ticks.as_ref()).map(Vec::len);
        counters.unwrap_or_else(|| self.host.as_ref().map_or(0, Vec::len))
    }

    /// Whether nothing but times of the rows tells.
    pub(super) fn is_host(&self) -> bool {
        self.seq.is_none() && self.ticks.is_none()
    }

    pub(super) fn seq(&self, row: usize) -> Option<i64> {
        self.seq.as_ref().map(|s| s[row])
    }

    pub(super) fn ticks(&self, row: usize) -> Option<i64> {
        self.ticks.as_ref().map(|t| t[row])
    }

    pub(super) fn host(&self, row: usize) -> Option<f64> {
        self.host.as_ref().map(|h| h[row])
    }

    pub(super) fn seq_at(&self, row: usize) -> i64 {
        self.seq(row).unwrap_or(0)
    }

    pub(super) fn ticks_at(&self, row: usize) -> i64 {
        self.ticks(row).unwrap_or(0)
    }

    pub(super) fn ticks_of(&self, instants: i64) -> i64 {
        (instants as f64 * self.period).round() as i64
    }

    /// The place in time that a row takes.
    pub(super) fn slot(&self, row: usize) -> i64 {
        self.seq(row)
            .unwrap_or_else(|| (self.ticks_at(row) as f64 / self.period).round() as i64)
    }

    /// What makes two rows the same instant.
    pub(super) fn identity(&self, row: usize) -> (i64, i64) {
        if self.is_host() {
            return (self.host(row).map_or(0, |h| h.to_bits() as i64), 0);
        }
        (self.seq_at(row), self.ticks_at(row))
    }

    pub(super) fn compare(&self, a: usize, b: usize) -> Ordering {
        if let Some(s) = &self.seq {
            s[a].cmp(&s[b])
        } else if let Some(t) = &self.ticks {
            t[a].cmp(&t[b])
        } else {
            self.host(a)
                .unwrap_or(0.0)
                .total_cmp(&self.host(b).unwrap_or(0.0))
        }
    }

    /// Whether `row`, which follows `before`, is earlier.
    pub(super) fn back(&self, before: usize, row: usize) -> bool {
        let by_time = self.seq.is_some() && !self.goes_on(before, row) && {
            let step = self.ticks_at(row) - self.ticks_at(before);
            (step as f64) < -JITTER * self.period
        };
        self.compare(row, before).is_lt() || by_time
    }

    /// Whether the numbers say that `row` comes next: then a time that leaps is a wrong time.
    fn goes_on(&self, before: usize, row: usize) -> bool {
        self.seq.is_some() && (1..=2).contains(&(self.seq_at(row) - self.seq_at(before)))
    }

    /// Whether `row` is not simply what comes after `before`.
    pub(super) fn odd(&self, before: usize, row: usize) -> bool {
        let same = self.compare(row, before).is_eq();
        // Rounded times come in equals; whether they are rows that are there twice is seen by their readings.
        same || self.back(before, row) || self.clocks_part(before, row)
    }

    /// Whether ticks seem to have begun again at their end, and the host's clock says that they were set to zero.
    pub(super) fn clocks_part(&self, before: usize, row: usize) -> bool {
        let (Some(t), Some(gain), Some(period_s)) =
            (&self.ticks, self.gain_s(before, row), self.period_s)
        else {
            return false;
        };
        let turned = t[row] >> TICKS_TURN != t[before] >> TICKS_TURN && t[row] >= t[before];
        if !turned || self.goes_on(before, row) {
            return false;
        }
        let passed = (t[row] - t[before]) as f64 / self.period * period_s;
        gain > 0.0 && (passed - gain).abs() > 2.0 + 0.01 * gain
    }

    /// Seconds that the host's clock went on.
    pub(super) fn gain_s(&self, before: usize, row: usize) -> Option<f64> {
        Some(self.host(row)? - self.host(before)?)
    }

    /// Seconds since the board's start.
    pub(super) fn since_start_s(&self, row: usize) -> f64 {
        let instants = match &self.ticks {
            Some(t) => (t[row] % (1 << TICKS_TURN)) as f64 / self.period,
            None => (self.seq_at(row) as f64) % TURN,
        };
        self.period_s.map_or(f64::INFINITY, |p| p * instants)
    }

    pub(super) fn is_at_start(&self, row: usize) -> bool {
        self.slot(row) < START as i64
    }

    /// Sample instants that the host's clock went on by, one at least.
    pub(super) fn instants(&self, before: usize, row: usize) -> Option<i64> {
        let gain = self.gain_s(before, row).filter(|g| *g > 0.0)?;
        let instants = (gain / self.period_s?).round().max(1.0);
        (instants < 1e9).then_some(instants as i64)
    }

    /// Whether times that run back at `back` places are times of sampling all the same: few places, or even when in order.
    pub(super) fn are_times(&self, left: &[usize], back: usize) -> bool {
        if back as f64 <= 0.01 * left.len() as f64 || back + 1 == left.len() {
            return true;
        }
        let mut t: Vec<f64> = left.iter().filter_map(|r| self.host(*r)).collect();
        t.sort_by(f64::total_cmp);
        let steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
        let usual = rate::median(&steps);
        let alike = steps.iter().filter(|d| (**d - usual).abs() < 0.5 * usual);
        alike.count() as f64 > 0.9 * steps.len() as f64
    }

    /// The rows `left`, as they come.
    pub(super) fn places(&self, left: &[usize]) -> Vec<Place> {
        let place = |row: &usize| Place {
            row: *row,
            seq: self.seq(*row),
            ticks: self.ticks(*row),
            shift_s: 0.0,
        };
        left.iter().map(place).collect()
    }

    /// What two rows of one instant have in common.
    pub(super) fn what(&self) -> &'static str {
        match (&self.seq, &self.ticks) {
            (Some(_), Some(_)) => "sequence number, device time",
            (Some(_), None) => "sequence number",
            (None, Some(_)) => "device time",
            (None, None) => "time",
        }
    }

    /// What the order is by.
    pub(super) fn by(&self) -> &'static str {
        match (&self.seq, &self.ticks) {
            (Some(_), Some(_)) => "sequence number and device time",
            (Some(_), None) => "sequence number",
            (None, Some(_)) => "device time",
            (None, None) => "their times",
        }
    }
}

fn varies(c: &[i64]) -> bool {
    c.iter().any(|v| Some(v) != c.first())
}

/// Numbers with the turns that the ticks tell; none where numbers and ticks have nothing to do with each other.
fn with_turns(ticks: &[i64], seq: &[i64], period: f64) -> Option<Vec<i64>> {
    let mut turns = 0.0;
    let mut out = vec![*seq.first()?];
    let mut agree = 1usize;
    for i in 1..seq.len() {
        let by_time = (ticks[i] - ticks[i - 1]) as f64 / period;
        let by_number = (seq[i] - seq[i - 1]) as f64;
        let missing = ((by_time - by_number) / TURN).round();
        let apart = (by_time - by_number - missing * TURN).abs();
        // Jitter, and a clock whose ticks to the number are no whole number.
        if apart <= JITTER + (1e-3 * by_time.abs()).min(TURN / 64.0) {
            agree += 1;
            turns += missing;
        }
        out.push(seq[i].saturating_add((turns * TURN) as i64));
    }
    (agree as f64 >= AGREE * seq.len() as f64).then_some(out)
}
