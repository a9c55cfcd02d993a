//! Gyros that deliver an angle instead of a rate.

use model::record::{Channel, Quantity, Record};

use super::CaptureError;
use super::columns::Said;
use super::error::brief;
use super::units::{ANGLE, is_angle};

/// What a column with the unit of an angle may be, by its name.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Angle {
    /// Steps of an angle from row to row.
    Increments,
    /// That of an attitude, which three gyros make together.
    Attitude,
    /// A rate, whose unit was written short.
    Rate,
    /// Nobody knows.
    Unknown,
}

impl Angle {
    pub fn of(column: &str) -> Self {
        let name = column.to_lowercase();
        let has = |parts: &[&str]| parts.iter().any(|part| name.contains(part));
        if has(&["delta", "dtheta", "dangle", "dang_", "incr"]) {
            Self::Increments
        } else if has(&["gyr", "rate", "omega", "angular"]) {
            Self::Rate
        } else if has(&[
            "roll", "pitch", "yaw", "euler", "heading", "attitude", "orient",
        ]) {
            Self::Attitude
        } else {
            Self::Unknown
        }
    }

    /// What to do about it.
    pub fn help(self, unit: &str) -> String {
        match self {
            Self::Attitude => format!(
                "map the columns of the rates where the file has them, `--columns gyro_x=...`; else say `--units gyro={unit}`, \
                 and differences are taken for rates, which they are near level alone; `gyro={unit}/s` if the cells are rates"
            ),
            _ => format!(
                "say which: `--units gyro={unit}/s` for a rate; `gyro={unit}` for an angle, which is differenced; for increments \
                 their size times the sample rate, `gyro=100{unit}/s` at 100 Hz"
            ),
        }
    }
}

/// Sees that a gyro's column has rates: where its name says the unit of an angle, that may be an angle, or written short for a
/// rate. `given` is by `--units`, and what a line `unit of ...` states was meant.
pub(super) fn is_rate(
    said: &Said<'_>,
    at: usize,
    given: Option<&str>,
    stated: Option<&str>,
    quantity: Quantity,
) -> Result<(), CaptureError> {
    let column = &said.names[at];
    let is_gyro = quantity == Quantity::Gyro;
    let Some(unit) = stated.filter(|unit| is_gyro && is_angle(unit)) else {
        return Ok(());
    };
    if given.is_some() || said.lines.unit_of(column).is_some() {
        return Ok(());
    }
    let kind = Angle::of(column);
    let name = brief(column);
    let why = match kind {
        Angle::Increments => {
            format!(
                "by its name the column `{name}` has increments of an angle, by its unit ({unit}) an angle"
            )
        }
        Angle::Rate => {
            format!("by its name the column `{name}` has a rate, by its unit ({unit}) an angle")
        }
        Angle::Attitude => {
            format!(
                "the column `{name}` has an angle of the attitude ({unit}), and a gyro's rate is needed"
            )
        }
        Angle::Unknown => {
            format!("by its unit ({unit}) the column `{name}` has an angle, and a gyro reads rates")
        }
    };
    Err(CaptureError::Option {
        option: "--units",
        why,
        help: kind.help(unit),
    })
}

/// Half a turn, deg: no gyro turns by so much from one row to the next.
const HALF_TURN: f64 = 180.0;

/// Lets an angle go on that is told within one turn, -180 to 180 or 0 to 360 deg, and so jumps; how often it does.
fn go_on(values: &mut [f64]) -> usize {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let least = finite().fold(f64::INFINITY, f64::min);
    let most = finite().fold(f64::NEG_INFINITY, f64::max);
    if !(least >= -HALF_TURN && most <= HALF_TURN || least >= 0.0 && most <= 2.0 * HALF_TURN) {
        return 0;
    }
    let (mut turns, mut jumps, mut last) = (0.0, 0, f64::NAN);
    for v in values {
        let step = *v - last;
        if step.abs() > HALF_TURN {
            turns -= step.signum();
            jumps += 1;
        }
        if v.is_finite() {
            last = *v;
        }
        *v += turns * 2.0 * HALF_TURN;
    }
    jumps
}

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
        let jumps = go_on(&mut channel.values);
        if jumps > 0 {
            record.notes.push(format!(
                "the angle of {} goes on over the end of its turn ({jumps} x)",
                channel.name
            ));
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_within_one_turn_goes_on_and_one_beyond_is_left() {
        for (values, jumps, last) in [
            (vec![170.0, 178.0, -174.0, -166.0], 1, 194.0),
            (vec![350.0, 358.0, 6.0, 358.0], 2, 358.0),
            (vec![0.5, f64::NAN, 359.5], 1, -0.5),
            (vec![100.0, 400.0], 0, 400.0),
            (vec![-10.0, 10.0], 0, 10.0),
        ] {
            let mut went = values.clone();
            assert_eq!(go_on(&mut went), jumps, "{values:?}");
            assert_eq!(went.last(), Some(&last), "{values:?}");
        }
    }
}
