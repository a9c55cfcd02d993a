//! Cells of a time column.

use chrono::{DateTime, NaiveDateTime, NaiveTime};

/// Beyond this, steps of an f64 are longer than 1: 2^53.
const EXACT: i64 = 1 << 53;

/// Reads the time of one row after the other. Whole numbers that an f64 does not hold (nanoseconds since 1970) and
/// dates count from the first row on.
#[derive(Debug)]
pub(super) struct Clock {
    /// Seconds a unit.
    scale: f64,
    first: Option<i64>,
    /// The last time of day without a date, and the midnights before it.
    of_day: Option<(i64, i64)>,
}

impl Clock {
    pub fn new(scale: f64) -> Self {
        Self {
            scale,
            first: None,
            of_day: None,
        }
    }

    /// Time of a cell, s; `number` reads one that is no date and no long whole number.
    pub fn seconds(&mut self, cell: &str, number: impl FnOnce(&str) -> Option<f64>) -> Option<f64> {
        if let Ok(whole) = cell.parse::<i64>()
            && (whole.unsigned_abs() > EXACT.unsigned_abs() || self.first.is_some())
        {
            return Some(self.since(whole) as f64 * self.scale);
        }
        if let Some(value) = number(cell) {
            return Some(value * self.scale);
        }
        let since_1970 = nanoseconds(cell).or_else(|| self.since_midnight(cell))?;
        Some(self.since(since_1970) as f64 * 1e-9)
    }

    /// Time of a cell that is a plain number of few digits, s; nothing where times count from the first row on.
    pub fn plain(&self, number: f64) -> Option<f64> {
        self.first.is_none().then_some(number * self.scale)
    }

    /// A time of day without a date; past midnight the next day goes on.
    fn since_midnight(&mut self, cell: &str) -> Option<i64> {
        let now = of_day(cell)?;
        let (last, mut midnights) = self.of_day.unwrap_or((now, 0));
        midnights += i64::from(now < last - DAY_NS / 2);
        self.of_day = Some((now, midnights));
        Some(now + midnights * DAY_NS)
    }

    fn since(&mut self, whole: i64) -> i64 {
        whole.saturating_sub(*self.first.get_or_insert(whole))
    }
}

/// Nanoseconds a day.
const DAY_NS: i64 = 86_400_000_000_000;

/// Whether a cell is a time of day, with a date or without.
pub(super) fn is_date(cell: &str) -> bool {
    nanoseconds(cell).or_else(|| of_day(cell)).is_some()
}

/// A time of day, since midnight.
fn of_day(cell: &str) -> Option<i64> {
    if !cell.contains(':') {
        return None;
    }
    let time = NaiveTime::parse_from_str(&cell.replacen(',', ".", 1), "%H:%M:%S%.f").ok()?;
    time.signed_duration_since(NaiveTime::MIN).num_nanoseconds()
}

/// A date and time of day, since 1970: by ISO 8601, with a zone or without, or with the date as `2026/11/21` or
/// `21.11.2026`. What begins with a month for some and with a day for others is not taken.
fn nanoseconds(cell: &str) -> Option<i64> {
    if !cell.contains(':') {
        return None;
    }
    if let Ok(time) = DateTime::parse_from_rfc3339(cell) {
        return time.timestamp_nanos_opt();
    }
    let cell = cell.replacen('T', " ", 1).replacen(',', ".", 1);
    let time = ["%Y-%m-%d", "%Y/%m/%d", "%d.%m.%Y"]
        .iter()
        .find_map(|date| {
            NaiveDateTime::parse_from_str(&cell, &format!("{date} %H:%M:%S%.f")).ok()
        })?;
    time.and_utc().timestamp_nanos_opt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(scale: f64, cells: [&str; 2]) -> [Option<f64>; 2] {
        let mut clock = Clock::new(scale);
        cells.map(|cell| clock.seconds(cell, |cell| cell.parse().ok()))
    }

    #[test]
    fn nanoseconds_since_1970_keep_their_last_digit_and_dates_become_seconds() {
        let [first, second] = read(1e-9, ["1403636579783655584", "1403636579783655585"]);
        assert_eq!((first, second), (Some(0.0), Some(1e-9)));
        assert_eq!(read(1e-3, ["1500", "1520.5"]), [Some(1.5), Some(1.5205)]);
        for cells in [
            ["2014-06-24 19:02:59.783655", "2014-06-24 19:03:00.283655"],
            ["2014-06-24T19:02:59.5Z", "2014-06-24T21:03:00.0+02:00"],
            ["2014-06-30T23:59:59.5", "2014-07-01T00:00:00"],
            ["2014/06/30 23:59:59.5", "2014/07/01 00:00:00"],
            ["30.06.2014 23:59:59,5", "01.07.2014 00:00:00,0"],
            ["19:02:59.5", "19:03:00"],
            ["23:59:59.5", "00:00:00.0"],
        ] {
            assert_eq!(read(1.0, cells), [Some(0.0), Some(0.5)], "{cells:?}");
        }
        assert_eq!(read(1.0, ["06/07/2014 19:02:59", "x"]), [None, None]);
    }
}
