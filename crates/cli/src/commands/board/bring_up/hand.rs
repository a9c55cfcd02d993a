//! What a hand does to a new board: presses the motor's stop, turns it about each axis, and lays it on each side.

use std::time::Duration;

use imu_stand::calibrate::{self, Told};
use imu_stand::link::Link;
use miette::Result;
use wire::{Command, Frame, Status};

use super::super::Session;
use super::super::show::{Q16, rate_hz};
use super::{AXES, Arguments, Step, not_done, step};

/// A hand that turns a gyro, deg/s: well above noise and bias.
const BY_HAND_DPS: f64 = 20.0;
/// How much more the turned gyro has to see than each of the others.
const PURE: f64 = 2.0;
/// How long the stop is waited for at the most, s: not every board has one.
const STOP_S: f64 = 30.0;
/// From one look at it to the next.
const LOOK: Duration = Duration::from_millis(150);
/// How long each side is recorded, s.
const SIDE_S: f64 = 5.0;
/// Zero and scale of an MMA7260QT at 3.3 V: 1.65 V within 10 %, 800 mV/g within 7.5 % (its data sheet); in counts.
const ACC_ZERO: [f64; 2] = [460.8, 563.2];
const ACC_SCALE: [f64; 2] = [229.6, 266.9];

/// The motor's stop, the sign of each gyro, and the six sides.
pub(super) fn by_hand(
    session: &mut Session,
    arguments: &Arguments,
    steps: &mut Vec<Step>,
) -> Result<()> {
    stop(&mut session.link, arguments, steps)?;
    signs(&mut session.link, arguments, steps)?;
    six_sides(&mut session.link, arguments, steps)
}

/// The motor's stop: pressed, the board refuses to arm; let go, it does not. The motor never turns.
fn stop(link: &mut Link, arguments: &Arguments, steps: &mut Vec<Step>) -> Result<()> {
    const WHAT: &str = "motor's stop, pressed";
    const EXPECTED: &str = "the board refuses to arm the motor; let go, it does not";
    if arguments.no_hand {
        steps.push(not_done(WHAT, EXPECTED));
        return Ok(());
    }
    let within = arguments.within.min(STOP_S);
    eprintln!(
        ">> press the motor's stop for a second (a board without one: wait for {within:.0} s)"
    );
    if !armed_says(link, Status::Stopped, within)? {
        steps.push(not_done(WHAT, EXPECTED));
        return Ok(());
    }
    eprintln!(">> let go of it");
    let opens = armed_says(link, Status::Ok, arguments.within)?;
    let found = if opens {
        "refused; let go, armed"
    } else {
        "refused, and it does not open"
    };
    steps.push(step(WHAT, found, EXPECTED, opens));
    Ok(())
}

/// Asks for a nonce until the board answers so; false where it never does.
fn armed_says(link: &mut Link, status: Status, within: f64) -> Result<bool> {
    let end = link.now() + Duration::from_secs_f64(within);
    while link.now() < end {
        if link.ask_any(Command::Arm { nonce: 0 }, |_| {})?.status == status {
            return Ok(true);
        }
        let next = link.now() + LOOK;
        while link.now() < next {
            link.read()?;
            while link.next().is_some() {}
        }
    }
    Ok(false)
}

/// The sign of each gyro, by a turn about its axis.
fn signs(link: &mut Link, arguments: &Arguments, steps: &mut Vec<Step>) -> Result<()> {
    for (k, (_, name)) in AXES.into_iter().enumerate() {
        let what = format!("sign of gyro {name}");
        const EXPECTED: &str = "clockwise, seen from where the axis points, counts up";
        if arguments.no_hand {
            steps.push(not_done(&what, EXPECTED));
            continue;
        }
        eprintln!(
            ">> turn the stand clockwise about {name}, seen from the side to which {name} points, and stop"
        );
        steps.push(match turned(link, k, arguments.within)? {
            Turn::None => not_done(&what, EXPECTED),
            Turn::Asked([x, y, z]) => {
                let found = format!("x {x:.1}, y {y:.1}, z {z:.1} deg/s");
                step(&what, found, EXPECTED, [x, y, z][k] > 0.0)
            }
            Turn::Other([x, y, z]) => {
                let found = format!(
                    "it saw no turn of its own; another gyro did: x {x:.1}, y {y:.1}, z {z:.1} deg/s"
                );
                step(&what, found, EXPECTED, false)
            }
        });
    }
    Ok(())
}

/// Zero and scale of the accelerometers, by the six sides.
fn six_sides(link: &mut Link, arguments: &Arguments, steps: &mut Vec<Step>) -> Result<()> {
    const SIDES: &str =
        "zero 461 to 563 counts, scale 230 to 267 counts/g: the part's 10 % and 7.5 %";
    if arguments.no_hand {
        steps.push(not_done("accelerometers on six sides", SIDES));
        return Ok(());
    }
    let how = calibrate::SixPosition {
        seconds: SIDE_S,
        within: arguments.within,
    };
    let mut tell = |told: Told| match told {
        Told::Do(what) => eprintln!(">> {what}"),
        Told::Note(what) | Told::Refused(what) => eprintln!("   {what}"),
    };
    let outcome = match calibrate::six_position(link, how, &mut tell) {
        Ok(outcome) => outcome,
        Err(calibrate::SequenceError::NotDone { what, .. }) => {
            let mut step = not_done("accelerometers on six sides", SIDES);
            step.found = what;
            steps.push(step);
            return Ok(());
        }
        Err(error) => return Err(error.into()),
    };
    for (_, name) in AXES {
        let size = |what: &str| {
            let channel = format!("acc_{name}");
            let found = outcome
                .identified
                .iter()
                .find(|i| i.channel == channel && i.what == what);
            found.map_or(f64::NAN, |found| found.size.value)
        };
        let (zero, scale) = (size("zero"), size("scale"));
        let within = |value: f64, [low, high]: [f64; 2]| (low..=high).contains(&value);
        steps.push(step(
            &format!("accelerometer {name}"),
            format!("zero {zero:.1} counts, scale {scale:.1} counts/g"),
            SIDES,
            within(zero, ACC_ZERO) && within(scale, ACC_SCALE),
        ));
    }
    Ok(())
}

/// What the gyros saw, deg/s, over half a second in which a hand turned the stand.
enum Turn {
    /// The one that was asked for saw most of it.
    Asked([f64; 3]),
    /// Others did, and it never.
    Other([f64; 3]),
    /// Nobody turned it.
    None,
}

/// Waits for a turn about an axis; others are let pass.
fn turned(link: &mut Link, axis: usize, within: f64) -> Result<Turn> {
    let end = link.now() + Duration::from_secs_f64(within);
    // What was turned before is over.
    wait_for_rest(link, end)?;
    let rate = link.hello.as_ref().and_then(rate_hz).unwrap_or(20.0);
    let half = ((rate / 2.0).ceil() as usize).max(4);
    let (mut recent, mut seen): (Vec<[f64; 3]>, Turn) = (Vec::new(), Turn::None);
    while link.now() < end {
        link.read()?;
        while let Some(frame) = link.next() {
            let Frame::Sample(sample) = frame else {
                continue;
            };
            recent.push(sample.rate.map(|rate| f64::from(rate) / Q16));
            let old = recent.len().saturating_sub(half);
            recent.drain(..old);
            let mean =
                [0, 1, 2].map(|k| recent.iter().map(|r| r[k]).sum::<f64>() / recent.len() as f64);
            let others = (0..3).filter(|k| *k != axis).map(|k| mean[k].abs());
            let most = others.fold(0.0, f64::max);
            if recent.len() < half || mean[axis].abs().max(most) < BY_HAND_DPS {
                continue;
            }
            if mean[axis].abs() > PURE * most {
                return Ok(Turn::Asked(mean));
            }
            seen = Turn::Other(mean);
        }
    }
    Ok(seen)
}

fn wait_for_rest(link: &mut Link, end: Duration) -> Result<()> {
    let mut still = 0;
    while link.now() < end && still < 10 {
        link.read()?;
        while let Some(frame) = link.next() {
            let Frame::Sample(sample) = frame else {
                continue;
            };
            let is_slow = sample
                .rate
                .iter()
                .all(|rate| f64::from(*rate).abs() < BY_HAND_DPS / 2.0 * Q16);
            still = if is_slow { still + 1 } else { 0 };
        }
    }
    Ok(())
}
