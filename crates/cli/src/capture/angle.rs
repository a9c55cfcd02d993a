//! Gyros that deliver an angle instead of a rate.

use model::record::{Channel, Quantity, Record};

use super::CaptureError;
use super::units::ANGLE;

/// Makes rates of the gyro channels that hold an angle: each reading the mean rate to the next row. Where that is more than
/// one and a half intervals away, and in the last row, there is none.
pub(super) fn difference_angles(record: &mut Record) -> Result<(), CaptureError> {
    let rows = record.len();
    let angles = |c: &Channel| c.quantity == Quantity::Gyro && c.unit == ANGLE;
    if !record.channels.iter().any(angles) {
        return Ok(());
    }
    let steps: Vec<f64> = match (&record.host_time_s, record.header.rate_hz) {
        (Some(times), _) => times.windows(2).map(|t| t[1] - t[0]).collect(),
        (None, Some(rate)) => vec![1.0 / rate; rows.saturating_sub(1)],
        (None, None) => {
            return Err(CaptureError::Option {
                option: "--units",
                why: "an angle becomes a rate by the time between its rows, which nothing tells"
                    .to_owned(),
                help: "add `--rate HZ`, or map a time column: `--columns time=...`".to_owned(),
            });
        }
    };
    let mut sorted = steps.clone();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let gap = |i: usize| {
        let lost = record
            .seq
            .as_ref()
            .is_some_and(|seq| seq[i + 1] != seq[i] + 1);
        lost || !(steps[i] > 0.0 && steps[i] < 1.5 * usual)
    };
    let gaps: Vec<bool> = (0..steps.len()).map(gap).collect();
    for channel in record.channels.iter_mut().filter(|c| angles(c)) {
        let rates: Vec<f64> = channel
            .values
            .windows(2)
            .zip(&steps)
            .zip(&gaps)
            .map(|((pair, step), gap)| {
                if *gap {
                    f64::NAN
                } else {
                    (pair[1] - pair[0]) / step
                }
            })
            .chain([f64::NAN])
            .collect();
        channel.values = rates;
        channel.unit = "deg/s".to_owned();
    }
    Ok(())
}
