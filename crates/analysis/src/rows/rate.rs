//! The sample rate that the header states, against the device's clock.

use std::borrow::Cow;

use model::record::Record;

use super::keys::LARGEST;

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
    let steps: Vec<(f64, f64)> = a
        .windows(2)
        .zip(b.windows(2))
        .map(|(a, b)| ((a[1] - a[0]) as f64, (b[1] - b[0]) as f64))
        .filter(|(a, b)| a / b > 0.0 && (a / b).is_finite())
        .collect();
    let usual = median(&steps.iter().map(|(a, b)| a / b).collect::<Vec<_>>());
    let alike = steps
        .iter()
        .filter(|(a, b)| (a / b - usual).abs() < 0.5 * usual);
    let (over, under) = alike.fold((0.0, 0.0), |s, (a, b)| (s.0 + a.abs(), s.1 + b.abs()));
    (under > 0.0 && over > 0.0).then(|| over / under)
}

/// Let rate and tick of the header agree with what was measured. Two of three tell where the host's clock is there.
pub(super) fn check(record: &mut Cow<'_, Record>) {
    let rows = record.len();
    let Some(tick_s) = record.header.tick_s.filter(|t| t.is_finite() && *t > 0.0) else {
        return;
    };
    let number: Vec<i64> = match record.seq.as_ref().filter(|s| s.len() == rows) {
        Some(s) => s.iter().map(|v| *v as i64).collect(),
        None => (0..rows as i64).collect(),
    };
    let ticks = record.t_ticks.as_ref();
    let ticks: Option<Vec<i64>> = ticks
        .filter(|t| t.len() == rows && t.iter().all(|v| *v <= LARGEST))
        .map(|t| t.iter().map(|v| *v as i64).collect());
    let Some(period) = ticks.and_then(|t| ratio(&t, &number)) else {
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
