//! The sample rate: what the header states, against the device's clock; else by the times of the rows.

use std::borrow::Cow;

use crate::record::{Record, batches};

use super::LARGEST;

/// Deviation of a stated rate that is no matter of clocks: rate and tick are nominal by the same crystal.
const WRONG: f64 = 0.01;
/// Deviation within which the host's clock takes a side.
const SIDE: f64 = 0.05;

/// Middle of `v`; NaN of nothing.
pub(super) fn median(v: &[f64]) -> f64 {
    let mut v: Vec<f64> = v.iter().copied().filter(|x| x.is_finite()).collect();
    if v.is_empty() {
        return f64::NAN;
    }
    let middle = v.len() / 2;
    *v.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Steps of `a` to a step of `b`, by the steps that are about as usual; in whatever order the rows are.
pub(super) fn ratio(a: &[i64], b: &[i64]) -> Option<f64> {
    let steps = || {
        (a.windows(2).zip(b.windows(2)))
            .map(|(a, b)| ((a[1] - a[0]) as f64, (b[1] - b[0]) as f64))
            .filter(|(a, b)| a / b > 0.0 && (a / b).is_finite())
    };
    let (mut low, mut high) = (f64::INFINITY, 0.0f64);
    let (mut over, mut under) = (0.0, 0.0);
    for (a, b) in steps() {
        let step = a / b;
        (low, high) = (low.min(step), high.max(step));
        (over, under) = (over + a.abs(), under + b.abs());
    }
    // Which of them is usual matters where not all are alike.
    if high - low >= 0.49 * low {
        let usual = median(&steps().map(|(a, b)| a / b).collect::<Vec<_>>());
        let alike = steps().filter(|(a, b)| (a / b - usual).abs() < 0.5 * usual);
        (over, under) = alike.fold((0.0, 0.0), |s, (a, b)| (s.0 + a.abs(), s.1 + b.abs()));
    }
    (under > 0.0 && over > 0.0).then(|| over / under)
}

/// Share of the steps that are about the usual one, where times are those of sampling.
const REGULAR: f64 = 0.9;
/// Intervals over which samples can be counted by the times about them.
const COUNTABLE: f64 = 1000.0;
/// How far from a whole number of intervals a step is that still counts them.
const WHOLE: f64 = 0.25;

/// Sample rate by the times of the rows, Hz: slope of a line through times against sequence numbers, else against places
/// that are counted by the times. An interruption too long to count samples over begins a line of its own with the same
/// slope. Times that come in batches, or are rounded to more than the interval, go against the rows.
pub fn by_times(record: &Record) -> Option<f64> {
    let t = record.host_time_s.as_ref()?;
    if t.len() < 2 || t.iter().any(|t| !t.is_finite()) {
        return None;
    }
    let line = |place: &dyn Fn(usize) -> f64| {
        let places: Vec<f64> = (0..t.len()).map(place).collect();
        slope(&[(places, t.clone())])
    };
    let interval = match record.seq.as_ref().filter(|s| s.len() == t.len()) {
        Some(s) => line(&|i| s[i] as f64 - s[0] as f64),
        None => {
            let steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
            let usual = median(&steps);
            let alike = || steps.iter().filter(|d| (**d - usual).abs() < 0.5 * usual);
            let (count, sum) = (alike().count() as f64, alike().sum::<f64>());
            if count > REGULAR * steps.len() as f64 && !batches::arrive(t) {
                // A first line by what is certain, a second one over short holes.
                let first = slope(&parts(t, sum / count, 1.5)).unwrap_or(sum / count);
                slope(&parts(t, first, COUNTABLE)).or(Some(first))
            } else {
                line(&|i| i as f64)
            }
        }
    };
    interval
        .map(f64::recip)
        .filter(|r| r.is_finite() && *r > 0.0)
}

/// Places and times of the parts between steps that are longer than `longest` intervals or no whole number of them.
fn parts(t: &[f64], interval: f64, longest: f64) -> Vec<(Vec<f64>, Vec<f64>)> {
    let mut parts = vec![(vec![0.0], vec![t[0]])];
    let mut place = 0.0;
    for w in t.windows(2) {
        let step = (w[1] - w[0]) / interval;
        let whole = step.round().max(1.0);
        let is_next = whole == 1.0 && (0.5..=1.5).contains(&step);
        if is_next || (step <= longest && (step - whole).abs() < WHOLE) {
            place += whole;
        } else {
            place = 0.0;
            parts.push((vec![], vec![]));
        }
        if let Some((places, times)) = parts.last_mut() {
            places.push(place);
            times.push(w[1]);
        }
    }
    parts
}

/// Common slope of lines, each with a level of its own.
fn slope(lines: &[(Vec<f64>, Vec<f64>)]) -> Option<f64> {
    let (mut over, mut under) = (0.0, 0.0);
    for (x, y) in lines {
        let n = x.len() as f64;
        let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
        over += (x.iter().zip(y))
            .map(|(x, y)| (x - mx) * (y - my))
            .sum::<f64>();
        under += x.iter().map(|x| (x - mx).powi(2)).sum::<f64>();
    }
    (under > 0.0).then(|| over / under)
}

/// Steps of a clock that starts anew now and then to one that goes back, at least; a column that is no time goes back at every other.
const LEAST_FORWARD: usize = 20;

/// Takes the rate of a record from the times of its rows where its header has none or they contradict it, which is told.
pub(super) fn take_from_times(record: &mut Cow<'_, Record>) {
    let stated = record.header.rate_hz;
    let stated = stated.filter(|r| r.is_finite() && *r > 0.0);
    // With ticks, the device's clock has been heard.
    if stated.is_some() && record.t_ticks.is_some() {
        return;
    }
    let Some(rate) = by_times(record) else {
        return;
    };
    let t = record.host_time_s.as_deref().unwrap_or_default();
    let steps = t.len().saturating_sub(1);
    if let Some(stated) = stated {
        let back = t.windows(2).filter(|w| w[1] < w[0]).count();
        if (stated / rate - 1.0).abs() > SIDE && back * LEAST_FORWARD <= steps {
            let record = record.to_mut();
            record.header.rate_hz = Some(rate);
            let entries = record.header.entries.iter_mut();
            (entries.filter(|(key, _)| key == "rate_hz")).for_each(|e| e.1 = rate.to_string());
            record.notes.push(format!(
                "the stated rate is {stated:.4} Hz, but by the times of the rows it is {rate:.4} Hz: the times are taken"
            ));
        }
        return;
    }
    let same = t.windows(2).filter(|w| w[0] == w[1]).count();
    let record = record.to_mut();
    record.header.rate_hz = Some(rate);
    if record.seq.is_none() && 2 * same >= steps {
        record.notes.push(format!(
            "{same} of {steps} rows have the time of the row before: the times are rounded to more than the interval. Rows are \
             taken as evenly spaced at {rate:.4} Hz, and missing ones cannot be seen"
        ));
    }
}

/// Let rate and tick of the header agree with what was measured. Two of three tell where the host's clock is there.
pub(super) fn check(record: &mut Cow<'_, Record>) {
    let Some(tick_s) = record.header.tick_s.filter(|t| t.is_finite() && *t > 0.0) else {
        return;
    };
    let number = numbers(record);
    let Some(period) = ticks_of_a_sample(record, &number) else {
        return;
    };
    let measured = 1.0 / (period * tick_s);
    if !measured.is_finite() {
        return;
    }
    let Some(stated) = record.header.rate_hz.filter(|r| r.is_finite() && *r > 0.0) else {
        record.to_mut().header.rate_hz = Some(measured);
        return;
    };
    if (measured / stated - 1.0).abs() <= WRONG {
        return;
    }
    let host = record.host_time_s.as_ref().and_then(|h| {
        let seconds = h.last()? - h.first()?;
        let numbers = (number.last()? - number.first()?) as f64;
        Some(numbers / seconds).filter(|r| r.is_finite() && *r > 0.0)
    });
    let sides = |rate: f64| host.is_some_and(|h| (rate / h - 1.0).abs() < SIDE);
    let header = &mut record.to_mut().header;
    let (key, value, told) = if sides(stated) && !sides(measured) {
        let tick = 1.0 / (period * stated);
        header.tick_s = Some(tick);
        (
            "tick_s",
            tick,
            format!(
                "the header says ticks of {tick_s:.3e} s, which makes {measured:.4} Hz; the header's rate, {stated:.4} Hz, is \
                 the host clock's too: ticks are taken as {tick:.3e} s"
            ),
        )
    } else {
        header.rate_hz = Some(measured);
        let witness = if sides(measured) {
            " and the host's"
        } else {
            ""
        };
        (
            "rate_hz",
            measured,
            format!(
                "the stated rate is {stated:.4} Hz, but the device's clock{witness} measured {measured:.4} Hz: all times \
                 and frequencies follow the measured one"
            ),
        )
    };
    for entry in header.entries.iter_mut().filter(|(k, _)| k == key) {
        entry.1 = value.to_string();
    }
    record.to_mut().notes.push(told);
}

/// Numbers of the rows: their sequence numbers, or as they come.
fn numbers(record: &Record) -> Vec<i64> {
    let rows = record.len();
    match record.seq.as_ref().filter(|s| s.len() == rows) {
        Some(s) => s.iter().map(|v| *v as i64).collect(),
        None => (0..rows as i64).collect(),
    }
}

/// Ticks from one number to the next.
fn ticks_of_a_sample(record: &Record, number: &[i64]) -> Option<f64> {
    let rows = record.len();
    let ticks = record.t_ticks.as_ref();
    let ticks: Option<Vec<i64>> = ticks
        .filter(|t| t.len() == rows && t.iter().all(|v| *v <= LARGEST))
        .map(|t| t.iter().map(|v| *v as i64).collect());
    ratio(&ticks?, number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rate(t: Vec<f64>) -> f64 {
        let record = Record {
            host_time_s: Some(t),
            ..Record::default()
        };
        by_times(&record).unwrap_or(f64::NAN)
    }

    #[test]
    fn neither_rounded_times_nor_holes_of_any_length_bend_the_rate() {
        let interval = 0.050_342_3;
        let rounded = |t: f64, to: f64| (t / to).floor() * to;
        let whole = (0..12_000).map(|i| rounded(0.05 * f64::from(i), 1.0));
        assert!((rate(whole.collect()) / 20.0 - 1.0).abs() < 1e-5);
        for hole in [0.0, 37.0, 600.0, 1e5 + 0.4] {
            let t = (0..12_000).map(|i| {
                let place = f64::from(i) + if i < 4000 { 0.0 } else { hole };
                rounded(place * interval, 1e-4)
            });
            let r = rate(t.collect());
            assert!((r * interval - 1.0).abs() < 1e-7, "{hole}: {r}");
        }
        // One row of fifty is missing.
        let t = (0..12_000).filter(|i| i % 50 != 7);
        let r = rate(t.map(|i| rounded(f64::from(i) * interval, 1e-4)).collect());
        assert!((r * interval - 1.0).abs() < 1e-7, "{r}");
        assert!(rate(vec![5.0; 100]).is_nan() && rate(vec![1.0]).is_nan());
    }
}
