//! Turns about z by the azimuth motor: what the gyros about x and y feel of them, and on a tilted stand the scale of the one about
//! z, against the turns that gravity counts.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use model::Parameter;
use model::file::EffectModel;
use model::record::{Base, Record};
use numerics::least_squares::{fit, student};

use super::{Identified, Outcome, SequenceError, Told};
use crate::capture::STANDARD_GRAVITY;
use crate::correct::{Course, record};
use crate::link::Link;
use crate::plan::SEQUENCES;

/// How the sequence is run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turns {
    /// Command of the motor, 1 to 255.
    pub duty: i16,
    /// How long each way, s.
    pub seconds: f64,
}

/// Rest before, between and after the turns, s: the biases are taken there.
const REST_S: f64 = 10.0;
/// How long the motor's ramp and the table's run-down may take, s.
const RAMP_S: f64 = 3.0;
/// A second's mean at rest may be off by this beside its noise, deg/s.
const STEADY_DPS: f64 = 0.5;
/// A table that turns slower does not, deg/s.
const LEAST_DPS: f64 = 3.0;
/// Gravity across the axis that counts turns, g: 3 degrees of tilt.
const LEAST_G: f64 = 0.05;
/// Turns that tell the scale, at the least.
const LEAST_TURNS: f64 = 2.0;
/// How far a scale may be off, 1: the data sheet's 0.01, and some.
const WIDEST: f64 = 0.06;

/// Runs it: rest, one way, rest, the other way, rest.
///
/// # Errors
/// [`SequenceError`].
pub fn turns(
    link: &mut Link,
    how: Turns,
    tell: &mut dyn FnMut(Told),
) -> Result<Outcome, SequenceError> {
    tell(Told::Do(format!(
        "keep clear: the table turns at {} of 255 for {:.0} s each way",
        how.duty, how.seconds
    )));
    let one = how.seconds + RAMP_S;
    let course = Course {
        from: link.now(),
        seconds: 3.0 * REST_S + 2.0 * one,
        steps: vec![
            (REST_S, how.duty),
            (REST_S + how.seconds, 0),
            (2.0 * REST_S + one, -how.duty),
            (2.0 * REST_S + one + how.seconds, 0),
        ],
        base: Base::Turntable,
    };
    let taken = record(link, &course, |_| {})?;
    outcome(&taken.record)
}

/// What is needed of a record, sample by sample.
struct Read {
    t: Vec<f64>,
    rate: [Vec<f64>; 3],
    acc: [Vec<f64>; 3],
    rests: Vec<bool>,
}

fn read(record: &Record) -> Option<Read> {
    let values = |name: &str| Some(record.channel(name)?.values.clone());
    let mut rate = [values("gyro_x")?, values("gyro_y")?, values("gyro_z")?];
    let acc = [values("acc_x")?, values("acc_y")?, values("acc_z")?];
    let tick = record.header.tick_s?;
    let ticks = record.t_ticks.as_ref()?;
    let first = *ticks.first()?;
    let t: Vec<f64> = ticks.iter().map(|k| (k - first) as f64 * tick).collect();
    let pwm = values("pwm")?;
    // At rest: no command, and none for some seconds before.
    let mut last = f64::NEG_INFINITY;
    let rests: Vec<bool> = t
        .iter()
        .zip(&pwm)
        .map(|(t, pwm)| {
            if *pwm != 0.0 {
                last = *t;
            }
            t - last > RAMP_S
        })
        .collect();
    for rate in &mut rate {
        let bias = bias(&t, rate, &rests);
        rate.iter_mut()
            .zip(&t)
            .for_each(|(rate, t)| *rate -= bias(*t));
    }
    Some(Read {
        t,
        rate,
        acc,
        rests,
    })
}

/// A straight line through what is read at rest: the bias, and how it drifts.
fn bias(t: &[f64], y: &[f64], rests: &[bool]) -> impl Fn(f64) -> f64 + use<> {
    let at_rest = || {
        t.iter()
            .zip(y)
            .zip(rests)
            .filter(|(_, rests)| **rests)
            .map(|(ty, _)| ty)
    };
    let n = at_rest().count().max(1) as f64;
    let (mt, my) = (
        at_rest().map(|p| p.0).sum::<f64>() / n,
        at_rest().map(|p| p.1).sum::<f64>() / n,
    );
    let square: f64 = at_rest().map(|p| (p.0 - mt).powi(2)).sum();
    let both: f64 = at_rest().map(|p| (p.0 - mt) * (p.1 - my)).sum();
    let slope = if square > 0.0 { both / square } else { 0.0 };
    move |t| my + slope * (t - mt)
}

/// What moved the stand while it should rest: a second's mean off the line through the rests by more than noise makes it.
fn not_at_rest(read: &Read) -> Option<String> {
    let length = read.t.iter().take_while(|t| **t < 1.0).count().max(8);
    let resting: Vec<usize> = (0..read.t.len()).filter(|k| read.rests[*k]).collect();
    (0..3).find_map(|axis| {
        let rates: Vec<f64> = resting.iter().map(|k| read.rate[axis][*k]).collect();
        // By neighbours: what is slow is not in it.
        let noise = numerics::series::white_by_differences(&rates).sqrt();
        let allowed = STEADY_DPS + 5.0 * noise / (length as f64).sqrt();
        let means = rates.chunks_exact(length).map(|c| c.iter().sum::<f64>() / length as f64);
        let worst = means.map(f64::abs).fold(0.0, f64::max);
        (worst > allowed).then(|| {
            let name = ["x", "y", "z"][axis];
            format!("gyro_{name} turned by {worst:.1} deg/s within a second in which the table should rest")
        })
    })
}

/// Ordinary least squares: values and standard errors for 95 % by Student's t.
fn regress(y: &[f64], columns: &[Vec<f64>]) -> Option<(Vec<f64>, Vec<f64>, f64)> {
    let n = y.len();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let normal: Vec<Vec<f64>> = columns
        .iter()
        .map(|a| columns.iter().map(|b| dot(a, b)).collect())
        .collect();
    let inverse = super::six_position::inverted(normal)?;
    let right: Vec<f64> = columns.iter().map(|a| dot(a, y)).collect();
    let values: Vec<f64> = inverse.iter().map(|row| dot(row, &right)).collect();
    let left: f64 = (0..n)
        .map(|k| {
            (y[k]
                - values
                    .iter()
                    .zip(columns)
                    .map(|(v, c)| v * c[k])
                    .sum::<f64>())
            .powi(2)
        })
        .sum();
    let free = (n - columns.len()) as f64;
    let wider = student(free) / 1.96 * (left / free).sqrt();
    let errors = (0..values.len())
        .map(|k| inverse[k][k].sqrt() * wider)
        .collect();
    Some((values, errors, left))
}

/// The scale of the gyro about z: reading over truth, minus 1, and its standard error.
///
/// Gravity across the axis goes round once a turn, so acc = c + a cos(angle) + b sin(angle) on each accelerometer tells the true
/// angle to a degree at each reading, for ever. The integral of the rate is 1 + scale times it, beside what bias and delay add, and
/// the white noise of the rate, which is a random walk of the angle.
fn scale(read: &Read, angle: &[f64]) -> Option<(f64, f64)> {
    let gravity = |scale: f64| {
        let at = angle.iter().map(|a| a / (1.0 + scale));
        let columns = [
            vec![1.0; angle.len()],
            at.clone().map(f64::cos).collect(),
            at.map(f64::sin).collect(),
        ];
        [0, 1].map(|axis| regress(&read.acc[axis], &columns))
    };
    let squares = |scale: f64| {
        let of = gravity(scale).map(|found| found.map_or(f64::INFINITY, |found| found.2));
        of[0] + of[1]
    };
    let turned = angle.iter().fold(0.0f64, |most, a| most.max(a.abs()));
    // Steps of a tenth of a turn at the end of the angle: the lowest place is seen from there.
    let step = 0.1 * TAU / turned;
    let count = (WIDEST / step).ceil() as i32;
    let (_, near) = (-count..=count)
        .map(|k| f64::from(k) * step)
        .map(|s| (squares(s), s))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    let begin = numerics::minimise::golden(&squares, near - step, near + step, 30);
    let [Some((x, ..)), Some((y, ..))] = gravity(begin) else {
        return None;
    };
    // What gravity says, beside what is expected by then, turn by turn.
    let determinant = x[1] * y[2] - x[2] * y[1];
    let beside: Vec<f64> = (0..angle.len())
        .map(|k| {
            let (ax, ay) = (read.acc[0][k] - x[0], read.acc[1][k] - y[0]);
            let cos = (y[2] * ax - x[2] * ay) / determinant;
            let sin = (x[1] * ay - y[1] * ax) / determinant;
            let off = sin.atan2(cos) - angle[k] / (1.0 + begin);
            off - TAU * (off / TAU).round()
        })
        .collect();
    let length = read.t.iter().take_while(|t| **t < 1.0).count().max(8);
    let means = |values: &[f64]| means(values, length);
    let (t, read_angle, off) = (means(&read.t), means(angle), means(&beside));
    let truth = read_angle
        .iter()
        .zip(&off)
        .map(|(a, off)| a / (1.0 + begin) + off);
    let columns = [
        vec![1.0; t.len()],
        truth.collect(),
        t.clone(),
        means(&read.rate[2]),
    ];
    let white = numerics::series::white_by_differences(&beside) / length as f64;
    let found = fit(&read_angle, &t, &vec![white; t.len()], &columns)?;
    let (value, error) = (found.values[1] - 1.0, found.errors[1]);
    (error.is_finite() && value.abs() < WIDEST).then_some((value, error))
}

/// Means of so many neighbours each.
fn means(values: &[f64], length: usize) -> Vec<f64> {
    let blocks = values.chunks_exact(length);
    blocks
        .map(|b| b.iter().sum::<f64>() / length as f64)
        .collect()
}

fn outcome(record: &Record) -> Result<Outcome, SequenceError> {
    let read = read(record).ok_or_else(|| {
        not_done(
            "no sample arrived while the table turned",
            "`imu-stand monitor` shows what the line brings",
        )
    })?;
    let turning: Vec<usize> = (0..read.t.len())
        .filter(|k| read.rate[2][*k].abs() > LEAST_DPS)
        .collect();
    was_done(&read, &turning)?;
    let rate_hz = record.header.rate_hz.unwrap_or(20.0);
    let mut out = Outcome::of(&SEQUENCES[1], rate_hz, 0.073_26);
    let across = |axis: usize| {
        let all = turning
            .iter()
            .map(|k| read.acc[axis][*k] / STANDARD_GRAVITY);
        let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
            (l.min(v), h.max(v))
        });
        (high - low) / 2.0
    };
    let is_tilted = across(0).min(across(1)) > LEAST_G;
    cross_axis(&read, is_tilted, &mut out);
    scale_of_z(&read, is_tilted, &mut out);
    Ok(out)
}

fn not_done(what: &str, help: &str) -> SequenceError {
    SequenceError::NotDone {
        what: what.to_owned(),
        help: help.to_owned(),
    }
}

/// Sees that the table turned both ways and rested between, and that nobody else moved the stand.
fn was_done(read: &Read, turning: &[usize]) -> Result<(), SequenceError> {
    let both = [1.0, -1.0].map(|sign| {
        turning
            .iter()
            .filter(|k| sign * read.rate[2][**k] > 0.0)
            .count()
    });
    if both.iter().any(|count| *count < 100) {
        return Err(not_done(
            "the table has not turned both ways",
            "is the belt on, and the motor's supply? More by `--duty 120`; `imu-stand board motor` shows whether it turns",
        ));
    }
    if read.rests.iter().filter(|rests| **rests).count() < 50 {
        return Err(not_done(
            "the table did not rest between its turns",
            "less by `--duty`: it has to stop within seconds",
        ));
    }
    match not_at_rest(read) {
        Some(why) => Err(not_done(
            &why,
            "leave the stand alone from the first rest to the last, and begin again",
        )),
        None => Ok(()),
    }
}

/// The scale of gyro z against the turns that gravity counts, where it goes round often enough.
fn scale_of_z(read: &Read, is_tilted: bool, out: &mut Outcome) {
    let mut angle = vec![0.0];
    for k in 1..read.t.len() {
        let rate = 0.5 * (read.rate[2][k - 1] + read.rate[2][k]);
        angle.push(angle[k - 1] + (rate * (read.t[k] - read.t[k - 1])).to_radians());
    }
    let turned = angle.iter().fold(0.0f64, |most, v| most.max(v.abs())) / TAU;
    if !is_tilted {
        out.not_identified.push(
            "scale of gyro_z: its axis stands upright, and gravity does not go round; tilt the stand by 10 degrees or more and turn again".to_owned(),
        );
    } else if turned < LEAST_TURNS {
        out.not_identified.push(format!(
            "scale of gyro_z: {turned:.1} turns, {LEAST_TURNS:.0} are needed: longer by `--seconds`"
        ));
    } else if let Some((value, error)) = scale(read, &angle) {
        let size = Parameter::estimated(value, error, "1");
        out.identified.push(Identified {
            channel: "gyro_z".to_owned(),
            what: format!("scale error, against {turned:.1} turns that gravity counts"),
            size: size.clone(),
        });
        out.effects.push(EffectModel {
            cause: "scale_error".to_owned(),
            channels: vec!["gyro_z".to_owned()],
            parameters: BTreeMap::from([("relative".to_owned(), size)]),
        });
    }
}

/// What the gyros about x and y read of the rate about z, beside a bias that walks; gravity that goes round has columns of its
/// own.
fn cross_axis(read: &Read, is_tilted: bool, out: &mut Outcome) {
    let length = read.t.iter().take_while(|t| **t < 1.0).count().max(8);
    let means = |values: &[f64]| means(values, length);
    let (t, about_z) = (means(&read.t), means(&read.rate[2]));
    for (axis, name) in ["x", "y"].into_iter().enumerate() {
        let y = means(&read.rate[axis]);
        let mut columns = vec![vec![1.0; y.len()], about_z.clone()];
        if is_tilted {
            columns.extend([means(&read.acc[0]), means(&read.acc[1])]);
        }
        // Of neighbouring readings: a table that speeds up between two of them is not in it.
        let white = numerics::series::white_by_differences(&read.rate[axis]) / length as f64;
        let Some(found) = fit(&y, &t, &vec![white; y.len()], &columns) else {
            continue;
        };
        let size = Parameter::estimated(found.values[1], found.errors[1], "1");
        let channel = format!("gyro_{name}");
        out.identified.push(Identified {
            channel: channel.clone(),
            what: "share of the rate about z".to_owned(),
            size: size.clone(),
        });
        out.effects.push(EffectModel {
            cause: "cross_axis".to_owned(),
            channels: vec![channel],
            parameters: BTreeMap::from([("from_gyro_z".to_owned(), size)]),
        });
    }
}
