//! Readings of others held against what the units claim: gravity at rest, and gyros as there are.

use model::record::{Channel, FULL_DUTY, Quantity, Record};

use super::{CaptureError, STANDARD_GRAVITY};

/// White noise of the ADIS16250, a noisy part (data sheet), deg/s/sqrt(Hz). A reading at rest that is five times as noisy is
/// more often a unit that is wrong by 57.3.
const NOISY_PART: f64 = 0.05;
const TOO_NOISY: f64 = 5.0 * NOISY_PART;
/// The same of the ADIS16490, a quiet one of silicon (data sheet); half of it is a fibre-optic gyro's.
const QUIET_PART: f64 = 0.002;
const TOO_QUIET: f64 = QUIET_PART / 2.0;
/// Measurement range of the widest gyros of silicon, deg/s (ICM-20649).
const WIDEST: f64 = 4000.0;
/// Offsets and scale errors of an accelerometer stay below a tenth of gravity.
const OF_GRAVITY: f64 = 0.1;
/// Scatter of an accelerometer, m/s^2, above which it is not taken to be at rest: a twentieth of gravity.
const AT_REST: f64 = 0.05 * STANDARD_GRAVITY;

/// What in a record of others cannot be in the units that are claimed, and what to say then. `is_assumed` says that
/// nobody stated the unit of the gyros.
pub(super) fn doubts(record: &Record, is_assumed: bool) -> Vec<String> {
    // A capture of the stand has its scales in its header.
    if record.header.entries.iter().any(|(key, _)| key == "format") {
        return Vec::new();
    }
    let mut notes = Vec::new();
    notes.extend(gravity(record));
    notes.extend(rates(record, is_assumed));
    notes.extend(temperatures(record));
    notes.extend(command(record));
    notes.extend(copy(record));
    notes
}

/// Refuses a record of whose gyros, or of whose channels where it has none, nothing is `kept` that was `read`, because no
/// sensor reads such numbers.
pub(super) fn in_range(read: &Record, kept: &Record) -> Result<(), CaptureError> {
    let is_gyro = |c: &Channel| c.quantity == Quantity::Gyro;
    let has_gyro = read.channels.iter().any(is_gyro);
    let has_reading = |c: &Channel| c.values.iter().any(|v| !v.is_nan());
    let both = read.channels.iter().zip(&kept.channels);
    let mut both = both.filter(|(c, _)| is_gyro(c) || !has_gyro);
    if both.clone().any(|(_, kept)| has_reading(kept)) {
        return Ok(());
    }
    let Some((beyond, _)) = both.find(|(c, _)| has_reading(c)) else {
        return Ok(());
    };
    let readings = || beyond.values.iter().copied().filter(|v| !v.is_nan());
    Err(CaptureError::OutOfRange {
        channel: beyond.name.clone(),
        count: readings().count(),
        largest: readings().fold(0.0, |a: f64, v| if v.abs() > a.abs() { v } else { a }),
        unit: beyond.unit.clone(),
    })
}

/// Two axes have no noise in common to the last digit.
fn copy(record: &Record) -> Option<String> {
    let is_one = |a: &f64, b: &f64| a == b || (a.is_nan() && b.is_nan());
    [Quantity::Gyro, Quantity::Acc]
        .into_iter()
        .find_map(|kind| {
            let all: Vec<_> = record.all(kind).collect();
            let varies = |values: &[f64]| values.windows(2).any(|w| w[0] != w[1]);
            let (one, other) = (all.iter().enumerate()).find_map(|(k, one)| {
                let same = |other: &&&Channel| {
                    one.values
                        .iter()
                        .zip(&other.values)
                        .all(|(a, b)| is_one(a, b))
                };
                let other = all[k + 1..].iter().find(same)?;
                varies(&one.values).then_some((one, other))
            })?;
            Some(format!(
                "{} reads as {} in every row: is one column in the file, or in `--columns`, twice?",
                other.name, one.name
            ))
        })
}

/// Gravity is what a still accelerometer reads.
fn gravity(record: &Record) -> Option<String> {
    let axes: Vec<f64> = (record.all(Quantity::Acc))
        .map(|c| median(c.values.iter().copied()))
        .collect::<Option<_>>()?;
    if axes.len() != 3 {
        return None;
    }
    let norm = axes.iter().map(|a| a * a).sum::<f64>().sqrt();
    // Of a sensor that is turned from one position to another no axis has a middle, and gravity has one all the same.
    let columns: Vec<_> = record.all(Quantity::Acc).map(|c| &c.values).collect();
    let at = |i: usize| columns.iter().map(|c| c[i] * c[i]).sum::<f64>().sqrt();
    let by_row = median((0..record.len()).map(at))?;
    let is_near = |of: f64| {
        [norm, by_row]
            .iter()
            .any(|a| (a / of - 1.0).abs() < OF_GRAVITY)
    };
    if is_near(STANDARD_GRAVITY) {
        return None;
    }
    let should = [
        (1.0, "g"),
        (1000.0, "mg"),
        (STANDARD_GRAVITY * STANDARD_GRAVITY, "m/s2"),
        (STANDARD_GRAVITY * 1e-3 * STANDARD_GRAVITY, "m/s2"),
    ];
    let read = format!(
        "the accelerometers read {} m/s^2 in the middle, and gravity is 9.81",
        short(by_row)
    );
    match should.iter().find(|(of, _)| is_near(*of)) {
        Some((_, unit)) => Some(format!(
            "{read}: is the file in {unit}? Then say `--units acc={unit}`"
        )),
        // Some systems take gravity off, and some parts are turned during a record.
        None if !(0.5 * STANDARD_GRAVITY..=2.0 * STANDARD_GRAVITY).contains(&by_row) => {
            Some(format!(
                "{read}: see that the unit is right (`--units acc=...`), or gravity was taken off"
            ))
        }
        None => None,
    }
}

fn rates(record: &Record, is_assumed: bool) -> Option<String> {
    let is_still = record.all(Quantity::Acc).all(|c| {
        let middle = median(c.values.iter().copied()).unwrap_or(0.0);
        let off = median(c.values.iter().map(|v| (v - middle).abs()));
        off.is_none_or(|off| TO_SIGMA * off < AT_REST)
    });
    let gyros = || record.all(Quantity::Gyro).filter(|c| c.unit == "deg/s");
    let largest = gyros().flat_map(|c| &c.values).map(|v| v.abs());
    let largest = largest.filter(|v| v.is_finite()).fold(0.0, f64::max);
    if largest > WIDEST {
        return Some(format!(
            "a gyro reads {} deg/s, more than any part of silicon measures: is the file in deg/s, or in counts? `--units gyro=...`",
            short(largest)
        ));
    }
    let rate = rate_hz(record)?;
    let density: Vec<f64> = gyros().filter_map(|c| white(&c.values, rate)).collect();
    let noisiest = density.iter().copied().fold(0.0, f64::max);
    let quietest = density.iter().copied().fold(f64::INFINITY, f64::min);
    if is_still && noisiest > TOO_NOISY {
        return Some(format!(
            "a gyro has a noise of {} deg/s/sqrt(Hz), {} times that of a noisy part: if it was at rest, is the file in deg/s and \
             not in rad/s? Then say `--units gyro=deg/s`",
            short(noisiest),
            short(noisiest / NOISY_PART)
        ));
    }
    (is_assumed && quietest < TOO_QUIET).then(|| {
        format!(
            "a gyro has a noise of {} deg/s/sqrt(Hz), less than parts of silicon have, and nothing says its unit: is the file in \
             rad/s? Then say `--units gyro=rad/s`",
            short(quietest)
        )
    })
}

/// A command of no more than one step of 255 drives nothing; as a fraction it is the whole range.
fn command(record: &Record) -> Option<String> {
    let of = record.all(Quantity::Pwm).next()?;
    let sizes = of.values.iter().map(|v| v.abs()).filter(|v| v.is_finite());
    let largest = sizes.fold(0.0, f64::max);
    if largest > FULL_DUTY {
        return Some(format!(
            "the motor command reaches {}, and full duty is {FULL_DUTY}: in which unit is the file? `--units pwm=%`, \
             `pwm=fraction`",
            short(largest)
        ));
    }
    (0.0 < largest && largest <= 1.0).then(|| {
        format!(
            "the motor command is {} of {FULL_DUTY} at most, which turns nothing: is the file in fractions of full duty? Then \
             say `--units pwm=fraction`",
            short(largest)
        )
    })
}

/// No board works at these temperatures; in kelvin it does.
fn temperatures(record: &Record) -> Option<String> {
    let hot = record
        .all(Quantity::Temp)
        .filter_map(|c| median(c.values.iter().copied()))
        .find(|t| (220.0..400.0).contains(t))?;
    Some(format!(
        "a temperature is {} degC in the middle: is the file in kelvin? Then say `--units temp=K`",
        short(hot)
    ))
}

/// Standard deviation of a normal distribution over its median absolute deviation.
const TO_SIGMA: f64 = 1.4826;

/// White noise as a density, from differences of neighbours, U/sqrt(Hz); none where nothing differs.
fn white(values: &[f64], rate_hz: f64) -> Option<f64> {
    let steps = values.windows(2).map(|v| (v[1] - v[0]).abs());
    let sigma = TO_SIGMA * median(steps)? / std::f64::consts::SQRT_2;
    (sigma > 0.0).then(|| sigma / rate_hz.sqrt())
}

fn rate_hz(record: &Record) -> Option<f64> {
    let of_times = record.host_time_s.as_ref().and_then(|times| {
        let step = median(times.windows(2).map(|t| t[1] - t[0]))?;
        (step > 0.0).then(|| 1.0 / step)
    });
    of_times.or(record.header.rate_hz)
}

/// Readings of which a middle is taken: it is known to a percent of the scatter by so many.
const ENOUGH: usize = 1 << 15;

/// The middle of those that are numbers; of long series, that of readings evenly among them.
fn median(values: impl ExactSizeIterator<Item = f64>) -> Option<f64> {
    let step = values.len() / ENOUGH + 1;
    let values = values.step_by(step).filter(|v| v.is_finite());
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

fn short(value: f64) -> String {
    crate::report::plot::number(value, 3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::record::Axis;

    /// Noise of a standard deviation about a middle, without a generator: a quantile of each row in turn.
    fn noise(sigma: f64, middle: f64) -> Vec<f64> {
        let unit = |k: usize| (k * 7919 % 1000) as f64 / 1000.0 - 0.5;
        (0..1000)
            .map(|k| middle + sigma * 12f64.sqrt() * unit(k))
            .collect()
    }

    fn record(gyro: f64, acc: [f64; 3], temp: f64) -> Record {
        let channel = |name: &str, quantity, unit: &str, values| Channel {
            name: name.to_owned(),
            quantity,
            axis: Some(Axis::X),
            unit: unit.to_owned(),
            values,
            counts: None,
            lsb: None,
        };
        let mut channels = vec![
            channel("gyro_x", Quantity::Gyro, "deg/s", noise(gyro, 0.3)),
            channel("temp", Quantity::Temp, "degC", noise(0.01, temp)),
        ];
        channels.extend(acc.map(|a| channel("acc_x", Quantity::Acc, "m/s^2", noise(0.01, a))));
        Record {
            host_time_s: Some((0..1000).map(|k| f64::from(k) * 0.01).collect()),
            channels,
            ..Record::default()
        }
    }

    #[test]
    fn a_column_that_stands_twice_is_told() {
        let mut record = record(0.3, [0.1, -0.2, STANDARD_GRAVITY], 25.0);
        assert_eq!(copy(&record), None);
        let mut twin = record.channels[0].clone();
        twin.name = "gyro_y".to_owned();
        record.channels.push(twin);
        let said = copy(&record).expect("a copy");
        assert!(said.starts_with("gyro_y reads as gyro_x"), "{said}");
        record.channels[0].values[500] += 1e-9;
        assert_eq!(copy(&record), None);
    }

    #[test]
    fn a_sensor_turned_from_position_to_position_has_gravity_in_no_axis_and_in_every_row() {
        let positions = |size: f64| {
            let mut record = record(0.3, [0.0; 3], 25.0);
            for (k, c) in record.channels[2..].iter_mut().enumerate() {
                for (i, v) in c.values.iter_mut().enumerate() {
                    let sign = if i / 500 == 0 { 1.0 } else { -1.0 };
                    *v += if i / 100 % 3 == k { sign * size } else { 0.0 };
                }
            }
            doubts(&record, false)
        };
        assert!(positions(STANDARD_GRAVITY).is_empty());
        let in_g = positions(1.0);
        assert!(
            in_g.len() == 1 && in_g[0].contains("--units acc=g"),
            "{in_g:?}"
        );
    }

    #[test]
    fn what_cannot_be_in_the_unit_claimed_is_told_and_what_can_is_not() {
        let g = STANDARD_GRAVITY;
        let level = [0.1, -0.2, g];
        for (gyro, acc, temp, is_assumed, told) in [
            (0.3, level, 25.0, true, None),
            (0.3, [0.01, 0.0, 1.01], 25.0, false, Some("--units acc=g")),
            (0.3, [3.0, -4.0, 999.0], 25.0, false, Some("--units acc=mg")),
            (
                0.3,
                [0.0, 0.1, g * g],
                25.0,
                false,
                Some("--units acc=m/s2"),
            ),
            (
                0.3,
                [0.0, 0.1, 0.12],
                25.0,
                false,
                Some("gravity was taken off"),
            ),
            (0.3 * 57.3, level, 25.0, false, Some("--units gyro=deg/s")),
            (0.3 / 57.3, level, 25.0, true, Some("--units gyro=rad/s")),
            (0.3 / 57.3, level, 25.0, false, None),
            (4000.0, level, 25.0, false, Some("more than any part")),
            (0.3, level, 298.0, false, Some("--units temp=K")),
        ] {
            let notes = doubts(&record(gyro, acc, temp), is_assumed);
            match told {
                None => assert!(notes.is_empty(), "{notes:?}"),
                Some(told) => {
                    assert!(
                        notes.len() == 1 && notes[0].contains(told),
                        "{told}: {notes:?}"
                    );
                }
            }
        }
        let mut own = record(17.0, [0.0, 0.0, 1.0], 298.0);
        own.header.entries = vec![("format".to_owned(), "imu-stand-capture/1".to_owned())];
        assert!(doubts(&own, true).is_empty());
    }
}
