//! Foreign effects kept back from the engine, thirteenth set (2026-11-22): twenty of forty ideas that were written down before
//! any file of this project was read, drawn at random. One of the twenty was a cause of the library (a gyro that is read before
//! it has a new sample: stale samples), and the next in the order, the half-precision number, came in its place. Once all was
//! written, each turned out to have a near twin: [`TWINS`]. None was diagnosed while they were written, and the engine's code
//! was not read; the earlier sets were, for their shape. The tests of `library_share` hold that no effect of the library
//! describes them, nor, where they are signals, a sum of two.
//!
//! Where the table's rate matters, the part turns with the table, and the rate of the table's encoder has been taken off, or
//! the one commanded where it says so, as in the tenth set.

use std::f64::consts::TAU;

use super::kept_back_eleventh::{changes, ramped};
use super::kept_back_fourth::{about_mean, cycles};
use super::kept_back_ninth::resonating;
use super::kept_back_sixth::in_steps;
use super::kept_back_tenth::{DWELL, angle_of_table, programme, rate_of_table, swelling};
use super::kept_back_twelfth::passes;
use super::{Foreign, PLAIN, Set, of_signal};
use crate::random::Draw;
use crate::stand::{Stand, held, lagged, wander};

pub(super) mod codes;
pub(super) mod noise;
mod periods;

/// Their names, in the order in which they were drawn.
pub const NAMES: [&str; 20] = [
    "clock that drifts from the encoder's and is set",
    "low nibble of the reading after",
    "table that friction holds against its belt",
    "belt that rings by its teeth",
    "zero that takes slow turns for bias",
    "cable chain that lays down its links",
    "lines printed with few digits",
    "output that falls slower than it rises",
    "square of what a mount makes of the shaking",
    "sun through clouds on one side",
    "charge that follows the sense of the rate",
    "unbalanced table on a leaning axis",
    "trains that pass",
    "bit of the converter that weighs wrong",
    "cogging folded by the sampling",
    "fan coil that a thermostat switches",
    "gas that leaks into the cavity",
    "filter whose register wraps round",
    "sample and hold that droops while it waits",
    "half-precision number about a power of two",
];

/// Those of them that have a near twin in an earlier set, with the one that is nearest, by the rule of the twelfth set: what
/// is in doubt counts as one, and all do.
const TWINS: [(&str, &str); 20] = [
    (
        "clock that drifts from the encoder's and is set",
        "axis that is converted late",
    ),
    (
        "low nibble of the reading after",
        "high byte of the reading before",
    ),
    (
        "table that friction holds against its belt",
        "bearing that sticks and slips",
    ),
    (
        "belt that rings by its teeth",
        "structure that rings after each change of the command",
    ),
    (
        "zero that takes slow turns for bias",
        "zero taken anew at every rest",
    ),
    (
        "cable chain that lays down its links",
        "chipped ball of the table's bearing",
    ),
    (
        "lines printed with few digits",
        "step that grows with the reading",
    ),
    (
        "output that falls slower than it rises",
        "slew limit of the output stage",
    ),
    (
        "square of what a mount makes of the shaking",
        "square of a shaking",
    ),
    (
        "sun through clouds on one side",
        "heat that comes in from one side",
    ),
    (
        "charge that follows the sense of the rate",
        "dielectric that remembers strong rates",
    ),
    (
        "unbalanced table on a leaning axis",
        "gear that errs once a turn",
    ),
    ("trains that pass", "lorries that sway the ground"),
    (
        "bit of the converter that weighs wrong",
        "code step at mid-scale",
    ),
    (
        "cogging folded by the sampling",
        "cogging whose pitch follows the speed",
    ),
    (
        "fan coil that a thermostat switches",
        "bursts of a bus every few seconds",
    ),
    (
        "gas that leaks into the cavity",
        "noise that swells and ebbs",
    ),
    (
        "filter whose register wraps round",
        "correction that overflows at high rates",
    ),
    (
        "sample and hold that droops while it waits",
        "charge and reset",
    ),
    (
        "half-precision number about a power of two",
        "step that grows with the reading",
    ),
];

/// The set.
pub(super) const SET: Set = Set {
    names: &NAMES,
    twins: &TWINS,
    parts,
    one,
    ..PLAIN
};

/// Causes of the library that are a true part of it: the surge by which a belt is twisted while the table takes its speed;
/// the mean push of links that are laid down faster or slower, and the mean filling of traps, by the command; the line by
/// temperature through a size that follows it.
fn parts(name: &str) -> &'static [&'static str] {
    match name {
        "belt that rings by its teeth"
        | "cable chain that lays down its links"
        | "charge that follows the sense of the rate" => &["motor_bias"],
        "sample and hold that droops while it waits" => &["temperature"],
        _ => &[],
    }
}

/// One of them; `None` for another name. The world of the stand may gain what drives it.
fn one(
    draw: &mut Draw,
    stand: &mut Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    let unit = match name {
        "clock that drifts from the encoder's and is set" => clock(draw, stand),
        "table that friction holds against its belt" => friction(draw, stand),
        "belt that rings by its teeth" => belt(draw, stand),
        "zero that takes slow turns for bias" => slow_turns(draw, stand),
        "cable chain that lays down its links" => chain(draw, stand),
        "square of what a mount makes of the shaking" => mount(draw, stand),
        "sun through clouds on one side" => periods::sun(draw, stand),
        "charge that follows the sense of the rate" => sense(draw, stand),
        "unbalanced table on a leaning axis" => unbalanced(draw, stand),
        "trains that pass" => periods::trains(draw, stand),
        "cogging folded by the sampling" => cogging(draw, stand),
        "sample and hold that droops while it waits" => droop(draw, stand, axis),
        _ => {
            return noise::one(draw, stand, name, wanted)
                .or_else(|| codes::one(draw, stand, name, axis, wanted));
        }
    };
    Some(of_signal(stand, name, axis, &unit, wanted))
}

/// The encoder is stamped by another clock, which drifts away until it is set, and is then led back faster, past the right
/// time: what the rate has changed by in the time between the two is left, now with one sign and now with the other.
fn clock(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = ramped(&stand.world.duty, draw.by_ratio(0.15, 0.6), stand.rate_hz);
    let (away, back) = (draw.by_ratio(20.0, 90.0), draw.between(0.2, 0.6));
    let (mut apart, mut sense, mut pace) = (draw.between(-1.0, 1.0), draw.sign(), 1.0);
    let drifts = draw.sign();
    changes(&rate)
        .iter()
        .map(|change| {
            let takes = if sense == drifts { away } else { back * away };
            apart += 2.0 * sense * pace / (takes * stand.rate_hz);
            if apart.abs() > 1.0 {
                // No two of them are set alike.
                (sense, pace) = (-apart.signum(), draw.between(0.7, 1.4));
                apart = apart.clamp(-1.0, 1.0);
            }
            apart * change
        })
        .collect()
}

/// Steps of the reckoning for each reading: many for a belt that swings a few times a second.
const FINE: usize = 20;

/// A heavy table on a soft belt, by its equation of motion: friction holds it until the belt is tight, and is less once it
/// turns (Stribeck), so that it jerks where it is to turn slowly. What the rate is off the one commanded.
fn friction(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const CREEP: (f64, f64) = (0.03, 0.15);
    stand.world.duty = held(draw, stand.samples(), stand.rate_hz, (8.0, 40.0), |d| {
        if d.chance(0.2) {
            0.0
        } else {
            in_steps(d.sign() * d.by_ratio(CREEP.0, CREEP.1))
        }
    });
    let stiff = (TAU * draw.by_ratio(0.8, 2.5)).powi(2);
    // What is left of the friction at speed, and how far the belt gives before the table does, in seconds of the least creep.
    let (left, gives) = (draw.between(0.3, 0.7), draw.by_ratio(1.0, 4.0));
    let (holds, fades) = (stiff * CREEP.0 * gives, draw.by_ratio(0.02, 0.08));
    let loss = 2.0 * draw.between(0.05, 0.2) * stiff.sqrt();
    let step = 1.0 / stand.rate_hz / FINE as f64;
    let (mut tight, mut turns, mut rough) = (0.0f64, 0.0f64, 1.0);
    let duty = stand.world.duty.iter();
    duty.map(|drive| {
        let mut mean = 0.0;
        for _ in 0..FINE {
            tight += (drive - turns) * step;
            let pull = stiff * tight + loss * (drive - turns);
            if turns == 0.0 {
                if pull.abs() > holds * rough {
                    // It has begun to, and no more.
                    turns = pull.signum() * f64::MIN_POSITIVE;
                }
            } else {
                let less = left + (1.0 - left) * (-turns.abs() / fades).exp();
                let next = turns + (pull - turns.signum() * holds * rough * less) * step;
                // It comes to rest where it would turn back; the next place is as rough as it is.
                if next * turns < 0.0 {
                    (turns, rough) = (0.0, draw.between(0.7, 1.3));
                } else {
                    turns = next;
                }
            }
            mean += turns / FINE as f64;
        }
        mean - drive
    })
    .collect()
}

/// A toothed belt between the motor, which has the encoder, and the table: each change of the rate twists it and it swings
/// out, and each tooth that comes on the pulley pushes it, the harder the nearer their pitch is to that of the swing.
fn belt(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    let teeth = angle_of_table(&rate, draw.by_ratio(2.0, 9.0), stand.rate_hz);
    let height = draw.by_ratio(0.005, 0.03);
    let bumps: Vec<f64> = teeth.iter().map(|a| height * a.cos()).collect();
    let pushed: Vec<f64> = changes(&rate)
        .iter()
        .zip(changes(&bumps))
        .map(|(r, b)| r + b)
        .collect();
    let mode = (draw.by_ratio(0.6, 3.0), draw.by_ratio(0.04, 0.2));
    resonating(&pushed, mode, stand.rate_hz)
}

/// Firmware that takes whatever is slower than a threshold for bias, and lets its zero follow it: of a slow turn it takes
/// off the more the longer that lasts, and is off by as much in the next fast one, until it turns slowly again.
fn slow_turns(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let slow = draw.between(0.1, 0.25);
    // Long turns, of which the zero would keep most, stay weak beside a random walk.
    stand.world.duty = held(draw, stand.samples(), stand.rate_hz, (1.0, 5.0), |d| {
        let level = match d.of_many(5) {
            0 => 0.0,
            1 | 2 => slow * d.between(0.4, 0.9),
            _ => d.between(2.0 * slow, 1.0),
        };
        in_steps(d.sign() * level)
    });
    let rate = rate_of_table(draw, stand);
    let follows = 1.0 / (draw.by_ratio(0.4, 2.0) * stand.rate_hz);
    let mut zero = 0.0;
    rate.iter()
        .map(|r| {
            if r.abs() < slow {
                zero += follows * (r - zero);
            }
            -zero
        })
        .collect()
}

/// The cable chain beside the table lays down its links one by one, at equal angles: each is a kick as large as the link is
/// loose, forward when it is laid down and backward when it is taken up, and no harder the faster the table turns.
fn chain(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    // Links a second at full duty.
    let angle = angle_of_table(&rate, draw.by_ratio(0.8, 4.0), stand.rate_hz);
    let links = passes(&angle, 1.0, draw.between(0.0, 1.0));
    let kick = |(link, r): (&f64, &f64)| link * r.signum() * draw.between(0.6, 1.4);
    let kicks: Vec<f64> = links.iter().zip(&rate).map(kick).collect();
    let mode = (draw.between(1.5, 8.0), draw.by_ratio(0.4, 2.0));
    resonating(&kicks, mode, stand.rate_hz)
}

/// Rectification behind a mount of rubber: not the acceleration that is told, but what the mount's own mode makes of it, is
/// squared.
fn mount(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let level = swelling(draw, stand);
    let mode = (draw.by_ratio(1.0, 8.0), draw.by_ratio(0.1, 0.8));
    let moves = resonating(&stand.world.acc[level], mode, stand.rate_hz);
    let sign = draw.sign();
    let square: Vec<f64> = moves.iter().map(|m| sign * m * m).collect();
    about_mean(&square)
}

/// Traps in a dielectric that the electrode's side of the rate fills and the other empties, each in its own time, some
/// octaves of them, so that it goes as a logarithm of time; while the rate is low they stay as they are. It knows the sense
/// alone.
fn sense(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const TRAPS: i32 = 4;
    programme(draw, stand, (1.0, 5.0));
    let rate = rate_of_table(draw, stand);
    let (least, fastest) = (draw.between(0.1, 0.3), draw.by_ratio(0.3, 0.8));
    let (apart, sign) = (draw.between(1.6, 2.5), draw.sign());
    let mut all = vec![0.0; rate.len()];
    for k in 0..TRAPS {
        let takes = 1.0 / (fastest * apart.powi(k) * stand.rate_hz);
        let mut filled = 0.0;
        for (v, r) in all.iter_mut().zip(&rate) {
            if r.abs() > least {
                filled += takes.min(1.0) * (r.signum() - filled);
            }
            *v += sign * filled;
        }
    }
    about_mean(&all)
}

/// A table out of balance whose axis leans: its weight drives it on the one half of the turn and holds it on the other, and
/// a motor that nothing regulates gives way. What the rate is off the one commanded.
fn unbalanced(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let (takes, full) = (draw.by_ratio(0.3, 1.5), draw.by_ratio(0.15, 0.8));
    let (weight, first) = (draw.by_ratio(0.02, 0.08), draw.between(0.0, TAU));
    let even = lagged(&stand.world.duty, takes, stand.rate_hz);
    let gain = 1.0 - (-1.0 / (takes * stand.rate_hz)).exp();
    let (mut rate, mut angle) = (stand.world.duty[0], first);
    stand
        .world
        .duty
        .iter()
        .zip(even)
        .map(|(drive, even)| {
            // A worm gear holds it where the motor rests.
            let falls = if *drive == 0.0 { 0.0 } else { angle.sin() };
            rate += gain * (drive + weight * falls - rate);
            angle += TAU * full * rate / stand.rate_hz;
            rate - even
        })
        .collect()
}

/// Cogging of a motor of many poles, more than ten a second: the sampling folds it to anywhere, at each speed to another
/// place, and its overtone to a third. As torque, by inertia: slow ones are the larger, and none is at rest.
fn cogging(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    let poles = angle_of_table(&rate, draw.by_ratio(20.0, 90.0), stand.rate_hz);
    let (corner, overtone) = (draw.between(0.1, 0.3), draw.between(0.2, 0.7));
    let [first, second] = [0, 1].map(|_| draw.between(0.0, TAU));
    poles
        .iter()
        .zip(&rate)
        .map(|(a, r)| {
            let torque = (a + first).cos() + overtone * (2.0 * a + second).cos();
            r / (r * r + corner * corner) * torque
        })
        .collect()
}

/// Degrees in which a leak grows twofold.
const TWOFOLD_K: f64 = 10.0;

/// The capacitor that holds the sample leaks while the firmware is busy with something else, whose loop slips past this one:
/// the wait grows from reading to reading until it is a whole loop and begins anew. The leak is twofold by ten degrees, and
/// the loop is timed by a resistance and a capacitance, which wander.
fn droop(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let slips = draw.sign() * draw.by_ratio(0.15, 3.0);
    let (size, tau) = (
        slips.abs() * draw.by_ratio(0.01, 0.05),
        draw.by_ratio(5.0, 60.0),
    );
    let off = wander(draw, stand.samples(), stand.rate_hz, size, tau);
    let (mut wait, sign) = (draw.between(0.0, 1.0), draw.sign());
    let own = &stand.world.temperature[axis];
    let held: Vec<f64> = own
        .iter()
        .zip(off)
        .map(|(t, off)| {
            wait = (wait + (slips + off) / stand.rate_hz).rem_euclid(1.0);
            sign * wait * ((t - own[0]) / TWOFOLD_K).exp2()
        })
        .collect();
    about_mean(&held)
}

#[cfg(test)]
mod tests;
