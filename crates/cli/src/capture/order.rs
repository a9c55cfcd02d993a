//! Counters and times of the rows: their turns, their order, and whether they are times at all.

use std::borrow::Cow;

use model::record::Record;
use model::record::sampling::Sampling;

use crate::report::plot::number;

use super::CaptureError;

/// Share of the steps that go back from which on rows are shuffled; that go forward, up to which all are turned round.
const SHUFFLED: f64 = 0.1;

fn is_shuffled(steps: impl ExactSizeIterator<Item = f64>) -> bool {
    let all = steps.len() as f64;
    let back = steps.filter(|step| *step < 0.0).count() as f64;
    back > SHUFFLED * all && back < (1.0 - SHUFFLED) * all
}

fn steps(of: &[f64]) -> impl ExactSizeIterator<Item = f64> {
    of.windows(2).map(|pair| pair[1] - pair[0])
}

/// Intervals between two rows on either side of a counter's end: more of them, and it did not pass it.
const NEAR: f64 = 10.0;

/// In shuffled rows, the value below which a counter of `turn` steps is in its next turn, 0 where it made none; `None`
/// where rows are not shuffled, and where one goes back tells. All that is taken: rows lie close together on both sides of
/// the counter's end, and none of them in the longest gap between.
fn next_turn(values: &[f64], turn: f64) -> Option<f64> {
    if !is_shuffled(steps(values)) {
        return None;
    }
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let (first, last) = (sorted.first()?, sorted.last()?);
    let over_the_end = turn - last + first;
    let mut gaps: Vec<f64> = steps(&sorted).collect();
    let (at, longest) = (gaps.iter().copied().enumerate()).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let middle = gaps.len() / 2;
    let usual = *gaps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let is_passed = (0.0..longest.min(NEAR * usual)).contains(&over_the_end);
    Some(if is_passed { sorted[at + 1] } else { 0.0 })
}

/// Undoes the wrapping of a counter of `modulus` steps, if it is wrapped. What goes back by less than half a turn, over
/// a wrap or not, stays where it is: a repeated or reordered row.
pub(super) fn unwrap(values: &[u64], modulus: u64) -> Vec<u64> {
    let steps: Vec<f64> = values.iter().map(|v| *v as f64).collect();
    if let Some(next) = next_turn(&steps, modulus as f64) {
        let turn = |v: u64| if (v as f64) < next { modulus } else { 0 };
        return values.iter().map(|v| v + turn(*v)).collect();
    }
    let (mut turns, mut last) = (0, 0);
    values
        .iter()
        .map(|&now| {
            // A value of `modulus` or more was unwrapped by whoever wrote it.
            if now < modulus && last < modulus && last > now && last - now > modulus / 2 {
                turns += modulus;
            }
            if now < modulus
                && last < modulus
                && turns > 0
                && now > last
                && now - last > modulus / 2
            {
                return now + turns - modulus;
            }
            last = now;
            now + turns
        })
        .collect()
}

/// Undoes the wrapping of a time that a counter of 32, 24 or 16 bits holds, as boards' microseconds do every 71 minutes, their
/// milliseconds in a `uint16_t` every 66 s, and the `sensor_time` of Bosch's parts every 655.36 s. How often, and how many bits it has; `None` where it goes on.
pub(super) fn unwrap_times(times: &mut [f64], scale: f64) -> Option<(usize, u32)> {
    let turns = unwrap_far(times, scale * 4_294_967_296.0);
    if turns > 0 {
        return Some((turns, 32));
    }
    // Ticks of the unit of the column, or of what boards count in: thousandths and millionths of it.
    for (bits, tick) in [16, 24, 32].iter().flat_map(|b| TICKS.map(|t| (*b, t))) {
        let turns = unwrap_even(times, scale * tick * 2f64.powi(bits));
        if turns > 0 {
            return Some((turns, bits as u32));
        }
    }
    None
}

/// Ticks of a counter, in the unit of the column.
const TICKS: [f64; 3] = [1.0, 1e-3, 1e-6];

/// As a time that goes back by more than half a turn says.
fn unwrap_far(times: &mut [f64], turn: f64) -> usize {
    if !times.iter().all(|t| (0.0..turn).contains(t)) {
        return 0;
    }
    if let Some(next) = next_turn(times, turn) {
        (times.iter_mut().filter(|t| **t < next)).for_each(|t| *t += turn);
        return usize::from(next > 0.0);
    }
    go_on(times, turn)
}

/// As times say that go back, and by a turn later would have made a step like all others: a short counter, whose turn is no
/// longer than a pause or a clock that was set.
fn unwrap_even(times: &mut [f64], turn: f64) -> usize {
    if times.len() < 3 || !times.iter().all(|t| (0.0..turn).contains(t)) {
        return 0;
    }
    let over: Vec<f64> = (steps(times).filter(|step| *step < -turn / 2.0))
        .map(|step| step + turn)
        .collect();
    let mut forward: Vec<f64> = steps(times).filter(|step| *step > 0.0).collect();
    if over.is_empty() || forward.is_empty() {
        return 0;
    }
    let usual = middle(&mut forward);
    let is_even = (0.5..1.5).contains(&(middle(&mut over.clone()) / usual));
    // Rows may be lost there.
    if !is_even || over.iter().any(|step| *step > NEAR * usual) {
        return 0;
    }
    go_on(times, turn)
}

/// The value in the middle.
fn middle(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Adds the turns where the time goes back by more than half of one; how many.
fn go_on(times: &mut [f64], turn: f64) -> usize {
    let (mut turns, mut last) = (0, 0.0);
    for t in times {
        turns += usize::from(last - *t > turn / 2.0);
        last = *t;
        *t += turn * turns as f64;
    }
    turns
}

/// What is said where a time column is none.
const NO_TIME: &str =
    "map the column of the time, `--columns time=...`, or leave time out and say `--rate HZ`";

/// An error where a time column says one time throughout.
pub(super) fn check_varies(times: &[f64]) -> Result<(), CaptureError> {
    match times {
        [first, _, rest @ ..] if !rest.is_empty() && times.iter().all(|t| t == first) => {
            Err(CaptureError::Time {
                why: format!("the time column is {first} throughout"),
                help: NO_TIME.to_owned(),
            })
        }
        _ => Ok(()),
    }
}

/// The record with its rows in order of time.
pub(super) fn in_order(record: Record) -> Record {
    match model::record::rows::in_order(&record) {
        Cow::Owned(mended) => Some(mended),
        Cow::Borrowed(_) => None,
    }
    .unwrap_or(record)
}

/// Longest and shortest time between rows that is taken in a unit that nobody said, s.
const BELIEVED_S: (f64, f64) = (1e-5, 2.0);

/// Sees that the times of rows in order rise, and, where nobody said their unit, that they are likely in seconds.
pub(super) fn check_times(times: &[f64], is_assumed: bool) -> Result<(), CaptureError> {
    if is_shuffled(steps(times)) {
        let back = steps(times).filter(|step| *step < 0.0).count();
        let row = steps(times).position(|step| step < 0.0).unwrap_or(0) + 2;
        return Err(CaptureError::Time {
            why: format!(
                "the time column does not rise: it goes back {back} times, first in row {row}, and in order it is not even"
            ),
            help: format!("{NO_TIME}; if it is the time of sampling, sort the rows by it"),
        });
    }
    if !is_assumed || times.len() < 2 {
        return Ok(());
    }
    let mut steps: Vec<f64> = steps(times).collect();
    let middle = steps.len() / 2;
    let usual = steps.select_nth_unstable_by(middle, f64::total_cmp).1.abs();
    let is_believed = usual == 0.0 || (BELIEVED_S.0..BELIEVED_S.1).contains(&usual);
    if !is_believed {
        return Err(CaptureError::Time {
            why: format!("in seconds, rows would be {usual} s apart"),
            help: format!(
                "say the unit of the time column: `--units time=ms` ({}; s if it is so; `0.1ms` and the like if it counts \
                 something else{}), or leave it out and say `--rate HZ`",
                by_unit(usual),
                of_bosch(times, usual)
            ),
        });
    }
    Ok(())
}

/// What steps may be of the `sensor_time` of Bosch's parts, a counter of 25.6 kHz (data sheets of BMI088, BMI160).
fn of_bosch(times: &[f64], step: f64) -> String {
    const HZ: f64 = 25_600.0;
    let is_likely = step >= 4.0 && times.iter().all(|t| t.fract() == 0.0);
    match is_likely {
        true => format!(
            ", 39.0625us for the `sensor_time` of Bosch's parts: {} Hz",
            number(HZ / step, 4)
        ),
        false => String::new(),
    }
}

/// The sample rate that each unit of a time makes of a step.
fn by_unit(step: f64) -> String {
    let units = [("ms", 1e3), ("us", 1e6), ("ns", 1e9)];
    let rates = units.map(|(unit, per_s)| format!("{unit}: {} Hz", number(per_s / step, 4)));
    rates.join(", ")
}

/// Deviation of a rate given from that of the times beyond which one of them is wrong: no clock is, by as much.
pub(super) const CONTRADICTS: f64 = 0.05;

/// An error where a rate was given for rows whose times say another one.
pub(super) fn check_rate(record: &mut Record, given: Option<f64>) -> Result<(), CaptureError> {
    let Some(given) = given else {
        return Ok(());
    };
    let stated = record.header.rate_hz.take();
    let by_times = Sampling::of(record, None).map(|sampling| 1.0 / sampling.tau0);
    record.header.rate_hz = stated;
    match by_times {
        Ok(rate) if (given / rate - 1.0).abs() > CONTRADICTS => Err(CaptureError::Option {
            option: "--rate",
            why: format!("{given} Hz, but by their times the rows come at {rate:.4} Hz"),
            help: "leave it out: it is for files without times. Where the times are wrong, map the other columns and not \
                   these, `--columns gyro_x=...`; in a capture of the stand, correct `tick_s` in the header"
                .to_owned(),
        }),
        // Without times, or with times that tell nothing, it is the rate.
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each of `n` places once, in an order without rule.
    fn shuffled(n: u64) -> impl Iterator<Item = u64> {
        // A prime to no part of which the lengths here are multiples.
        (0..n).map(move |k| (k * 7919 + 13) % n)
    }

    #[test]
    fn shuffled_counters_are_unwrapped_by_the_gap_that_they_leave() {
        let modulus = 1 << 16;
        // Longer than half a turn; begun near the end of one; lossy; unwrapped by whoever wrote it.
        for (first, n, lost) in [
            (0, 40_000, 0),
            (60_000, 20_000, 0),
            (60_000, 50_000, 0),
            (100, 60_000, 3000),
            (0, 200_000, 0),
        ] {
            let true_ones: Vec<u64> = shuffled(n)
                .filter(|k| !(n / 2..n / 2 + lost).contains(k))
                .map(|k| first + k)
                .collect();
            let is_wrapped = first + n < 2 * modulus;
            let seen = |v: &u64| if is_wrapped { v % modulus } else { *v };
            let seen: Vec<u64> = true_ones.iter().map(seen).collect();
            assert!(unwrap(&seen, modulus) == true_ones, "{first} {n} {lost}");
        }
        let micros: Vec<f64> = shuffled(5000)
            .map(|k| 4.0e9 + 500_000.0 * k as f64)
            .collect();
        let turn = 4_294_967_296.0;
        let mut seen: Vec<f64> = micros.iter().map(|t| t % turn * 1e-6).collect();
        assert_eq!(unwrap_times(&mut seen, 1e-6), Some((1, 32)));
        for (seen, t) in seen.iter().zip(&micros) {
            assert!((seen - t * 1e-6).abs() < 1e-6);
        }
    }

    #[test]
    fn a_short_counter_goes_on_where_a_turn_makes_its_step_even() {
        // 25 000 rows of 20 ms from 41.256 s on: eight turns of 65.536 s; and in seconds of such milliseconds.
        let truth: Vec<f64> = (0..25_000).map(|k| 41.256 + 0.02 * f64::from(k)).collect();
        for scale in [1e-3, 1.0] {
            let mut seen: Vec<f64> = truth.iter().map(|t| t % 65.536).collect();
            assert_eq!(unwrap_times(&mut seen, scale), Some((8, 16)));
            let far = |(a, b): (&f64, &f64)| (a - b).abs() > 1e-6;
            assert!(!seen.iter().zip(&truth).any(far));
        }
        // A clock that was set back, by another span; a recording of one minute before another.
        for turn in [40.0, 60.0] {
            let mut seen: Vec<f64> = truth.iter().map(|t| t % turn).collect();
            assert_eq!(unwrap_times(&mut seen, 1e-3), None, "{turn}");
        }
    }
}
