//! Cells of a time column.

use chrono::{DateTime, NaiveDate, NaiveTime};

use super::units::{What, convert, known};

/// Beyond this, steps of an f64 are longer than 1: 2^53.
const EXACT: i64 = 1 << 53;

/// Reads the time of one row after the other. Whole numbers that an f64 does not hold (nanoseconds since 1970) and
/// dates count from the first row on.
#[derive(Debug)]
pub(super) struct Clock {
    /// Seconds a unit.
    scale: f64,
    first: Option<i64>,
    /// Whether a cell said its unit.
    pub has_units: bool,
    /// The last time of day without a date, and the midnights before it.
    of_day: Option<(i64, i64)>,
    /// Of dates that do not say which number is the month's.
    days: Days,
}

impl Clock {
    pub fn new(scale: f64) -> Self {
        Self {
            scale,
            first: None,
            has_units: false,
            of_day: None,
            days: Days::default(),
        }
    }

    /// Time of a cell, s; `number` reads one that is no date and no long whole number.
    pub fn seconds(
        &mut self,
        cell: &str,
        mut number: impl FnMut(&str) -> Option<f64>,
    ) -> Option<f64> {
        if let Ok(whole) = cell.parse::<i64>()
            && (whole.unsigned_abs() > EXACT.unsigned_abs() || self.first.is_some())
        {
            return Some(self.since(whole) as f64 * self.scale);
        }
        if let Some(value) = number(cell) {
            return Some(value * self.scale);
        }
        if let Some((digits, s)) = with_unit(cell) {
            self.has_units = true;
            return Some(number(digits)? * s);
        }
        let of_date = nanoseconds(cell).or_else(|| self.since_first_date(cell));
        let whole = of_date.or_else(|| self.since_midnight(cell))?;
        Some(self.since(whole) as f64 * 1e-9)
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

    /// A time with a date, since the midnight before the first one.
    fn since_first_date(&mut self, cell: &str) -> Option<i64> {
        let at = Dated::of(cell)?;
        self.days
            .since_first(&at)?
            .checked_mul(DAY_NS)?
            .checked_add(at.of_day)
    }

    fn since(&mut self, whole: i64) -> i64 {
        whole.saturating_sub(*self.first.get_or_insert(whole))
    }
}

/// The number and the length of the unit, s, of a cell that says it, as MATLAB writes the durations of a timetable: `0.05 sec`.
pub(super) fn with_unit(cell: &str) -> Option<(&str, f64)> {
    let (digits, unit) = cell.split_once(' ')?;
    let is_number = digits.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '.'));
    let unit = known(unit).filter(|_| is_number)?;
    let s = convert(What::Time, Some(unit)).ok()?.scale;
    Some((digits, s))
}

/// Nanoseconds a day.
const DAY_NS: i64 = 86_400_000_000_000;

/// Whether a cell is a time of day, with a date or without.
pub(super) fn is_date(cell: &str) -> bool {
    let is_dated = nanoseconds(cell).or_else(|| of_day(cell)).is_some();
    is_dated || Dated::of(cell).is_some()
}

/// Whether a cell is a time of day without a date.
pub(super) fn is_of_day(cell: &str) -> bool {
    of_day(cell).is_some()
}

/// A time of day without a date, since midnight; or a span with its days, as pandas writes it: `0 days 00:00:00.05`.
fn of_day(cell: &str) -> Option<i64> {
    if !cell.contains(':') {
        return None;
    }
    let Some((days, time)) = cell.split_once(" days ").or(cell.split_once(" day ")) else {
        return since_midnight(cell);
    };
    let days: i64 = days.parse().ok()?;
    days.checked_mul(DAY_NS)?.checked_add(since_midnight(time)?)
}

/// A time of day, ns since midnight: `15:04:05.25`, `15:04:05:250`, `15-04-05.250`, `3:04:05.25 PM`.
fn since_midnight(text: &str) -> Option<i64> {
    let text = text.trim();
    let half = text.len().checked_sub(2).and_then(|at| text.get(at..));
    let is_half = |name: &str| half.is_some_and(|half| half.eq_ignore_ascii_case(name));
    let (is_am, is_pm) = (is_half("am"), is_half("pm"));
    let bare = match is_am || is_pm {
        true => text[..text.len() - 2].trim_end(),
        false => text,
    };
    let mut parts: Vec<&str> = bare.split([':', '-']).collect();
    let seconds = match parts[..] {
        // Thousandths behind one more colon.
        [_, _, seconds, ms] if ms.len() == 3 => format!("{seconds}.{ms}"),
        [_, _, seconds] => seconds.replacen(',', ".", 1),
        _ => return None,
    };
    parts.truncate(2);
    let hour: u32 = parts[0].parse().ok()?;
    let hour = match (is_am, is_pm) {
        (false, false) => hour,
        _ if !(1..=12).contains(&hour) => return None,
        _ => hour % 12 + if is_pm { 12 } else { 0 },
    };
    let time = format!("{hour:02}:{}:{seconds}", parts[1]);
    let time = NaiveTime::parse_from_str(&time, "%H:%M:%S%.f").ok()?;
    time.signed_duration_since(NaiveTime::MIN).num_nanoseconds()
}

/// A date and a time of day, apart.
fn apart(cell: &str) -> Option<(&str, i64)> {
    let (date, time) = cell.split_once(['T', ' '])?;
    Some((date, since_midnight(time)?))
}

/// A date and time of day, since 1970: by ISO 8601, with a zone or without, or with the date as `2026/11/21` or
/// `21.11.2026`.
fn nanoseconds(cell: &str) -> Option<i64> {
    if cell.contains(':')
        && let Ok(time) = DateTime::parse_from_rfc3339(cell)
    {
        return time.timestamp_nanos_opt();
    }
    let (date, time) = apart(cell)?;
    let date = ["%Y-%m-%d", "%Y/%m/%d", "%d.%m.%Y", "%d-%b-%Y"]
        .iter()
        .find_map(|form| NaiveDate::parse_from_str(date, form).ok())?;
    let midnight = date.and_time(NaiveTime::MIN).and_utc();
    midnight.timestamp_nanos_opt()?.checked_add(time)
}

/// A time of a date that begins with the month for some and with the day for others: `11/28/2026 3:04:05 PM`.
#[derive(Clone, Copy)]
struct Dated {
    /// The first number, the second one, and the year.
    date: (u32, u32, i32),
    of_day: i64,
}

impl Dated {
    fn of(cell: &str) -> Option<Self> {
        let (date, of_day) = apart(cell)?;
        let mut parts = date.split(['/', '-']);
        let (one, other, year) = (parts.next()?, parts.next()?, parts.next()?);
        let number = |text: &str| text.parse().ok();
        let date = (number(one)?, number(other)?, year.parse().ok()?);
        let found = Self { date, of_day };
        let is_one = year.len() == 4 && parts.next().is_none();
        let is_date = [true, false].iter().any(|m| found.day(*m).is_some());
        (is_one && is_date).then_some(found)
    }

    /// The day, where the month stands first and where it stands second.
    fn day(&self, month_first: bool) -> Option<NaiveDate> {
        let (one, other, year) = self.date;
        let (month, day) = if month_first {
            (one, other)
        } else {
            (other, one)
        };
        NaiveDate::from_ymd_opt(year, month, day)
    }
}

/// Days since the first date of a column, where its dates do not say which number is the month's.
#[derive(Debug, Default)]
struct Days {
    first: Option<(u32, u32, i32)>,
    month_first: Option<bool>,
}

impl Days {
    /// Which is the month's number does not matter to times of one day; it is told by a number above 12, and by a day that
    /// follows upon the first. `None` where nothing tells.
    fn since_first(&mut self, at: &Dated) -> Option<i64> {
        let first = *self.first.get_or_insert(at.date);
        if first == at.date {
            return Some(0);
        }
        let first = Dated {
            date: first,
            of_day: 0,
        };
        let days = |month_first: &bool| {
            let days = at.day(*month_first)? - first.day(*month_first)?;
            Some((*month_first, days.num_days()))
        };
        let ways = [true, false].into_iter();
        let ways = ways.filter(|m| self.month_first.is_none_or(|known| known == *m));
        let ways: Vec<(bool, i64)> = ways.filter_map(|m| days(&m)).collect();
        let (month_first, days) = match ways[..] {
            [one] => one,
            _ => {
                let mut next = ways.into_iter().filter(|(_, days)| *days == 1);
                next.next().filter(|_| next.next().is_none())?
            }
        };
        self.month_first = Some(month_first);
        Some(days)
    }
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
            ["30-Jun-2014 23:59:59.5", "01-Jul-2014 00:00:00.0"],
            ["19:02:59.5", "19:03:00"],
            ["23:59:59.5", "00:00:00.0"],
            ["19:02:59:500", "19:03:00:000"],
            ["2014-06-30 23-59-59.5", "2014-07-01 00-00-00.0"],
            ["11:59:59.5 AM", "12:00:00 pm"],
            ["0 days 23:59:59.500000", "1 days 00:00:00"],
            ["11:59:59.5PM", "12:00:00AM"],
            ["11/28/2026 3:04:05.5 PM", "11/28/2026 3:04:06 PM"],
            ["28/11/2026 15:04:05.5", "28/11/2026 15:04:06"],
            // A number above 12 tells the month; or the day that follows; a day alone needs neither.
            ["11/30/2026 23:59:59.5", "12/1/2026 00:00:00"],
            ["31-03-2026 23:59:59.5", "01-04-2026 00:00:00"],
            ["03/04/2026 11:59:59.5 PM", "03/05/2026 12:00:00 AM"],
            ["03/04/2026 11:59:59.5 PM", "04/04/2026 12:00:00 AM"],
            ["03/04/2026 11:59:59.5 PM", "03/04/2026 11:59:60 PM"],
        ] {
            assert_eq!(read(1.0, cells), [Some(0.0), Some(0.5)], "{cells:?}");
        }
        // Durations count from no first cell.
        assert_eq!(read(1.0, ["59.5 sec", "1 min"]), [Some(59.5), Some(60.0)]);
        assert_eq!(
            read(1.0, ["3599500 ms", "1 hr"]),
            [Some(3599.5), Some(3600.0)]
        );
        // Two days and two months later, or the other way round.
        let apart = ["03/04/2014 19:02:59", "05/06/2014 19:02:59"];
        assert_eq!(read(1.0, apart), [Some(0.0), None]);
        for cell in [
            "x",
            "13/13/2014 19:02:59",
            "06/07/14 19:02:59",
            "13:00:00 PM",
            "0:00:00 AM",
            "1:2",
            "19:02:59:5",
            "PM",
            "5 apples",
            "0.05 deg",
            "sec",
            " sec",
            "x days 00:00:01",
        ] {
            assert_eq!(read(1.0, [cell, "x"]), [None, None], "{cell}");
        }
    }
}
