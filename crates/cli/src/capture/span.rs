//! A part of a record, by the time of its rows.

use std::str::FromStr;

use model::record::Record;

use super::CaptureError;
use super::steady::times;

/// How much earlier or later than an end a row still belongs to it, s: ends are written with six places.
const NEAR_S: f64 = 1e-6;

/// A part of a record, from one time to another, s from its first row; as a text `60,600`, `60,` or `,600`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    from_s: f64,
    to_s: f64,
}

impl FromStr for Span {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (from, to) = text.split_once(',').unwrap_or((text, ""));
        let end = |text: &str, without: f64| match text.trim() {
            "" => Some(without),
            text => text.parse().ok().filter(|s: &f64| *s >= 0.0),
        };
        let ends = end(from, 0.0).zip(end(to, f64::INFINITY));
        let span = ends.and_then(|(from_s, to_s)| Self::new(from_s, to_s));
        span.filter(|_| !text.is_empty()).ok_or_else(|| {
            "takes two times, s from the first row: 60,600, or one: 60, or ,600".into()
        })
    }
}

impl Span {
    /// From one time to a later one, s from the first row, both included; `None` of what is none.
    #[must_use]
    pub fn new(from_s: f64, to_s: f64) -> Option<Self> {
        (from_s >= 0.0 && from_s < to_s && from_s.is_finite()).then_some(Self { from_s, to_s })
    }

    /// Leaves the rows in it, and a note.
    pub(super) fn cut(self, record: &mut Record) -> Result<(), CaptureError> {
        let rows = record.len();
        let times = times(record).or_else(|| {
            let rate_hz = record.header.rate_hz?;
            Some((0..rows).map(|k| k as f64 / rate_hz).collect())
        });
        let refused = |why: String| {
            CaptureError::Option {
            option: "--span",
            why,
            help: "say times within the record, s from its first row: `--span 60,600`, `--span 60,` or `--span ,600`".to_owned(),
        }
        };
        let times = times.ok_or_else(|| {
            refused("the rows have no times, and no rate says them (`--rate HZ`)".to_owned())
        })?;
        let last = times.last().copied().unwrap_or(0.0);
        let is_in = |t: &f64| (self.from_s - NEAR_S..=self.to_s + NEAR_S).contains(t);
        let first = times.iter().position(is_in);
        let end = times.iter().rposition(is_in).map(|k| k + 1);
        let (Some(first), Some(end)) = (first, end) else {
            return Err(refused(format!(
                "no row lies in it: the record ends {last:.3} s after its first row"
            )));
        };
        keep(record, first, end);
        record.notes.push(format!(
            "of {rows} rows those from {:.3} to {:.3} s are taken (--span): {}; times count from the first of them",
            times[first],
            times[end - 1],
            end - first
        ));
        Ok(())
    }
}

/// Drops the rows before `first` and from `end` on.
fn keep(record: &mut Record, first: usize, end: usize) {
    fn part<T>(of: &mut Vec<T>, first: usize, end: usize) {
        of.truncate(end);
        of.drain(..first);
    }
    let Record {
        header: _,
        seq,
        t_ticks,
        host_time_s,
        flags,
        channels,
        notes: _,
    } = record;
    seq.iter_mut().for_each(|v| part(v, first, end));
    t_ticks.iter_mut().for_each(|v| part(v, first, end));
    host_time_s.iter_mut().for_each(|v| part(v, first, end));
    flags.iter_mut().for_each(|v| part(v, first, end));
    for channel in channels {
        part(&mut channel.values, first, end);
        channel.counts.iter_mut().for_each(|v| part(v, first, end));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::record::{Channel, Quantity};

    fn record() -> Record {
        let channel = Channel {
            name: "gyro_x".to_owned(),
            quantity: Quantity::Gyro,
            axis: None,
            unit: "deg/s".to_owned(),
            values: (0..100).map(f64::from).collect(),
            counts: Some((0..100).collect()),
            lsb: Some(1.0),
        };
        Record {
            host_time_s: Some((0..100).map(|k| 5.0 + 0.1 * f64::from(k)).collect()),
            channels: vec![channel],
            ..Record::default()
        }
    }

    #[test]
    fn the_rows_within_stay_ends_included_with_all_that_they_have() {
        for (text, first, count) in [
            ("2,3", 20, 11),
            ("9.5,", 95, 5),
            (",0.25", 0, 3),
            ("9", 90, 10),
        ] {
            let mut record = record();
            let span: Span = text.parse().expect("a span");
            span.cut(&mut record).expect("rows");
            assert_eq!(record.len(), count, "{text}");
            assert_eq!(record.channels[0].values[0], first as f64, "{text}");
            assert_eq!(
                record.channels[0].counts.as_ref().map(Vec::len),
                Some(count)
            );
            assert_eq!(record.host_time_s.as_ref().map(Vec::len), Some(count));
            assert_eq!(record.notes.len(), 1);
        }
    }

    #[test]
    fn what_is_no_span_or_has_no_row_is_refused() {
        for text in ["", "-1,2", "3,2", "a,b", "inf,", "nan,2"] {
            assert!(text.parse::<Span>().is_err(), "{text}");
        }
        let late: Span = "20,30".parse().expect("a span");
        let error = late.cut(&mut record()).expect_err("no row").to_string();
        assert!(error.contains("ends 9.900 s"), "{error}");
    }
}
