//! Foreign effects kept back from the engine, fourteenth set (2026-11-22): twenty of forty ideas that were written down before
//! any file of this project was read, drawn at random. None of the twenty is a cause of the library. Once all was written,
//! each turned out to have a near twin: [`TWINS`]. None was diagnosed while they were written, and the engine's code was not
//! read; the earlier sets were, for their shape. The tests of `library_share` hold that no effect of the library describes
//! them, nor, where they are signals, a sum of two.
//!
//! Where the table's rate matters, the part turns with the table, and the rate of the table's encoder has been taken off, as
//! in the tenth set.

use std::f64::consts::TAU;

use super::kept_back_eleventh::changes;
use super::kept_back_fourth::{about_mean, cycles};
use super::kept_back_ninth::resonating;
use super::kept_back_tenth::{DWELL, angle_of_table, programme, rate_of_table};
use super::kept_back_twelfth::passes;
use super::{Foreign, PLAIN, Set, extremes, of_signal, swing};
use crate::random::Draw;
use crate::stand::{Stand, lagged, wander};

pub(super) mod codes;
pub(super) mod noise;
mod periods;

/// Their names, in the order in which they were drawn.
pub const NAMES: [&str; 20] = [
    "two converters that take turns at the rate",
    "scale factor where two modes cross",
    "differences that saturate until the key frame",
    "correction by a thermometer of coarse steps",
    "cable that jumps off an edge",
    "rubber that softens under the centrifugal load",
    "edge that whistles at some speeds",
    "cages of two bearings that beat",
    "door that is opened and shut",
    "lamp that shines on the die",
    "drive loop in a limit cycle",
    "steady turning taken for rest",
    "charge by the square of the rate",
    "mass that sticks to its stop",
    "heater that shifts the ground",
    "belt that jumps a tooth",
    "range that is switched with hysteresis",
    "output stage that slews softly",
    "filter that smooths small changes",
    "oil that sloshes in the gear",
];

/// Those of them that have a near twin in an earlier set, with the one that is nearest, by the rule of the twelfth set: what
/// is in doubt counts as one, and all do.
const TWINS: [(&str, &str); 20] = [
    (
        "two converters that take turns at the rate",
        "amplifiers that take turns and slip",
    ),
    (
        "scale factor where two modes cross",
        "dips where two modes meet",
    ),
    (
        "differences that saturate until the key frame",
        "differences sent in few levels",
    ),
    (
        "correction by a thermometer of coarse steps",
        "teeth of a table over temperature",
    ),
    (
        "cable that jumps off an edge",
        "cable chain that lays down its links",
    ),
    (
        "rubber that softens under the centrifugal load",
        "bias by the table's angular acceleration",
    ),
    (
        "edge that whistles at some speeds",
        "noise by the magnitude of the table's rate",
    ),
    (
        "cages of two bearings that beat",
        "cogging whose pitch follows the speed",
    ),
    (
        "door that is opened and shut",
        "charge that jumps and leaks away",
    ),
    (
        "lamp that shines on the die",
        "bias by the heading of the table",
    ),
    ("drive loop in a limit cycle", "amplitude loop that hunts"),
    (
        "steady turning taken for rest",
        "zero that takes slow turns for bias",
    ),
    (
        "charge by the square of the rate",
        "dielectric that remembers strong rates",
    ),
    ("mass that sticks to its stop", "recovery after a shock"),
    ("heater that shifts the ground", "square wave"),
    (
        "belt that jumps a tooth",
        "kick by each change of the motor's current",
    ),
    (
        "range that is switched with hysteresis",
        "other gain and offset beyond a rate",
    ),
    (
        "output stage that slews softly",
        "slew limit of the output stage",
    ),
    (
        "filter that smooths small changes",
        "filter that lets large changes through",
    ),
    (
        "oil that sloshes in the gear",
        "structure that rings after each change of the command",
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

/// Causes of the library that are a true part of it: the straight line by the command, or by its magnitude, through what is
/// taken off or switched by it, and through a product whose other factor is not 0 in the mean; the surge that a change of
/// the rate resembles; the straight line by temperature through what a heater's current leaves; a variance that is larger
/// where the table turns; and a filter, whenever it acts.
fn parts(name: &str) -> &'static [&'static str] {
    match name {
        "scale factor where two modes cross"
        | "differences that saturate until the key frame"
        | "rubber that softens under the centrifugal load"
        | "steady turning taken for rest"
        | "belt that jumps a tooth"
        | "range that is switched with hysteresis"
        | "oil that sloshes in the gear" => &["motor_bias"],
        "heater that shifts the ground" => &["temperature"],
        "edge that whistles at some speeds" => &["motor_noise"],
        "output stage that slews softly" | "filter that smooths small changes" => &["low_pass"],
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
        "two converters that take turns at the rate" => converters(draw, stand),
        "scale factor where two modes cross" => modes(draw, stand, axis),
        "differences that saturate until the key frame" => differences(draw, stand),
        "correction by a thermometer of coarse steps" => coarse(draw, stand, axis),
        "cable that jumps off an edge" => edge(draw, stand),
        "rubber that softens under the centrifugal load" => rubber(draw, stand),
        "cages of two bearings that beat" => cages(draw, stand),
        "door that is opened and shut" => periods::door(draw, stand),
        "lamp that shines on the die" => lamps(draw, stand),
        "drive loop in a limit cycle" => limit_cycle(draw, stand),
        "steady turning taken for rest" => steady(draw, stand),
        "charge by the square of the rate" => charge(draw, stand),
        "mass that sticks to its stop" => periods::stuck(draw, stand),
        "heater that shifts the ground" => periods::heater(draw, stand),
        "belt that jumps a tooth" => tooth(draw, stand),
        "range that is switched with hysteresis" => range(draw, stand),
        "oil that sloshes in the gear" => slosh(draw, stand),
        _ => {
            return noise::one(draw, stand, name, wanted)
                .or_else(|| codes::one(draw, stand, name, axis, wanted));
        }
    };
    Some(of_signal(stand, name, axis, &unit, wanted))
}

/// Two converters take the readings in turn; at rest they are trimmed alike, and their gains are not. The part is clocked a
/// little slower than the frames, so that now and then one is read twice running.
fn converters(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    let (mut turn, pace) = (draw.between(0.0, 2.0), draw.between(0.8, 0.995));
    rate.iter()
        .map(|r| {
            turn = (turn + pace) % 2.0;
            if turn < 1.0 { *r } else { -r }
        })
        .collect()
}

/// At one temperature the sense mode crosses a mode of the frame, and the scale factor goes through the resonance, of
/// whichever phase the demodulator has.
fn modes(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    let own = &stand.world.temperature[axis];
    let (low, span) = (extremes(own).0, swing(own));
    let (middle, half_width) = (
        low + span * draw.between(0.3, 0.7),
        span * draw.by_ratio(0.04, 0.2),
    );
    let (sin, cos) = draw.between(0.0, TAU).sin_cos();
    own.iter()
        .zip(&rate)
        .map(|(t, r)| {
            let off = (t - middle) / half_width;
            r * (sin + cos * off) / (1.0 + off * off)
        })
        .collect()
}

/// A logger keeps differences in words too short for the table's ramps, and a whole reading now and then: what a difference
/// could not hold is missing until the next of those.
fn differences(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, (1.0, 5.0));
    let changes = changes(&rate_of_table(draw, stand));
    let (low, high) = extremes(&changes);
    let most = low.abs().max(high) * draw.between(0.1, 0.5);
    let whole = (draw.by_ratio(1.0, 8.0) * stand.rate_hz).round() as usize;
    let mut off = 0.0;
    changes
        .iter()
        .enumerate()
        .map(|(i, change)| {
            off += change.clamp(-most, most) - change;
            if i % whole == 0 {
                off = 0.0;
            }
            off
        })
        .collect()
}

/// Firmware that corrects by a thermometer of few bits: what of the slope is left within its steps.
fn coarse(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let (step, first) = (draw.by_ratio(0.5, 2.0), draw.between(0.0, 1.0));
    let sign = draw.sign();
    let left = |t: &f64| {
        let steps = t / step + first;
        sign * (steps - steps.round())
    };
    stand.world.temperature[axis].iter().map(left).collect()
}

/// The cable to the table drags over an edge and jumps off it at a few angles: a kick, and the table rings. Turned back it
/// slides over without one.
fn edge(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    let angle = angle_of_table(&rate, draw.by_ratio(0.2, 0.8), stand.rate_hz);
    let mut kicks = vec![0.0; rate.len()];
    for _ in 0..1 + draw.of_many(3) {
        let (place, hard) = (draw.between(0.0, 1.0), draw.between(0.4, 1.6));
        for ((kick, jumps), r) in kicks.iter_mut().zip(passes(&angle, 1.0, place)).zip(&rate) {
            if *r > 0.0 {
                *kick += hard * jumps * draw.between(0.7, 1.3);
            }
        }
    }
    let mode = (draw.between(1.5, 8.0), draw.by_ratio(0.3, 1.5));
    resonating(&kicks, mode, stand.rate_hz)
}

/// The rubber that the part stands on gives way to the centrifugal load, and the more, the softer a load has made it (Payne):
/// it softens at once, and takes its time to harden. The part reads the rate at which it leans.
fn rubber(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    let hardens = 1.0 / (draw.by_ratio(5.0, 40.0) * stand.rate_hz);
    let (softens, sign, mut soft) = (draw.between(1.0, 4.0), draw.sign(), 0.0f64);
    let leans: Vec<f64> = rate
        .iter()
        .map(|r| {
            let load = r * r;
            soft = load.max(soft - hardens * soft);
            sign * load * (1.0 + softens * soft)
        })
        .collect();
    changes(&lagged(&leans, draw.by_ratio(0.3, 2.0), stand.rate_hz))
}

/// The cages of the table's two bearings, with the balls in them, go round a little differently: two ripples of the angle
/// that beat by the angle, and not by time.
fn cages(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    // Balls that pass in a turn, of eight to twelve in a cage that goes 0.4 turns.
    let (balls, apart) = (draw.between(3.0, 5.0), draw.between(0.02, 0.08));
    let angle = angle_of_table(&rate, balls * draw.by_ratio(0.3, 1.2), stand.rate_hz);
    let second = draw.between(0.5, 1.0);
    let [one, other] = [0, 1].map(|_| draw.between(0.0, TAU));
    let ripple = |a: f64| (a + one).cos() + second * ((1.0 + apart) * a + other).cos();
    angle
        .iter()
        .zip(&rate)
        .map(|(a, r)| r * ripple(*a))
        .collect()
}

/// Lamps about the stand shine on a die without a lid: photo current while the part is turned to one of them, and the
/// housing shades it else.
fn lamps(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    let angle = angle_of_table(&rate, draw.by_ratio(0.1, 0.4), stand.rate_hz);
    let (shade, sign) = (draw.between(-0.2, 0.6), draw.sign());
    let mut light = vec![0.0; angle.len()];
    for _ in 0..1 + draw.of_many(3) {
        let (place, bright) = (draw.between(0.0, TAU), draw.between(0.3, 1.0));
        for (l, a) in light.iter_mut().zip(&angle) {
            *l += sign * bright * ((a + place).cos() - shade).max(0.0);
        }
    }
    about_mean(&light)
}

/// The loop that holds the drive's amplitude goes to and fro between two limits, and the scale factor with it: of a rate, a
/// swing as large as the rate.
fn limit_cycle(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    let pace = 1.0 / draw.by_ratio(0.5, 6.0);
    let wavers = wander(draw, stand.samples(), stand.rate_hz, 0.1, 5.0);
    let mut phase = draw.between(0.0, 1.0);
    rate.iter()
        .zip(wavers)
        .map(|(r, w)| {
            phase = (phase + pace * (1.0 + w) / stand.rate_hz).rem_euclid(1.0);
            r * (4.0 * (phase - 0.5).abs() - 1.0)
        })
        .collect()
}

/// Firmware that takes readings which stay within a window for a while for a standstill, and leads its zero there: a steady
/// turn is eaten up, and comes back with the other sign in the next.
fn steady(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, (1.5, 7.0));
    let rate = rate_of_table(draw, stand);
    let waits = (draw.between(0.4, 1.5) * stand.rate_hz) as usize;
    let window = draw.by_ratio(0.02, 0.1);
    let follows = 1.0 / (draw.by_ratio(0.5, 3.0) * stand.rate_hz);
    let mut zero = 0.0;
    (0..rate.len())
        .map(|i| {
            if i >= waits && swing(&rate[i - waits..=i]) < window {
                zero += follows * (rate[i] - zero);
            }
            -zero
        })
        .collect()
}

/// Deflection, whichever way, charges the surfaces that the electrodes come near to; they are traps of several depths, so
/// that the charge is lost as a logarithm of time.
fn charge(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const TRAPS: i32 = 4;
    programme(draw, stand, (1.0, 5.0));
    let rate = rate_of_table(draw, stand);
    let (fills, sign) = (draw.by_ratio(0.3, 3.0), draw.sign());
    let (fastest, apart) = (draw.by_ratio(0.5, 2.0), draw.between(2.0, 4.0));
    let mut all = vec![0.0; rate.len()];
    for k in 0..TRAPS {
        let (empties, mut filled) = (1.0 / (fastest * apart.powi(k)), 0.0);
        for (v, r) in all.iter_mut().zip(&rate) {
            filled += (fills * r * r * (1.0 - filled) - empties * filled) / stand.rate_hz;
            *v += sign * filled;
        }
    }
    about_mean(&all)
}

/// Behind the encoder a toothed belt drives the table. Where the motor changes its speed by too much the belt jumps, once or
/// twice running, and the table is left behind by a tooth each time. What it holds differs from place to place of the belt.
fn tooth(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const MOST: f64 = 2.0;
    programme(draw, stand, DWELL);
    let holds = draw.between(0.4, 0.8);
    let apart = (draw.between(0.1, 0.4) * stand.rate_hz).ceil() as usize;
    let mut jumps = vec![0.0; stand.samples()];
    for (i, change) in changes(&stand.world.duty).iter().enumerate() {
        if *change == 0.0 {
            continue;
        }
        let here = holds * draw.between(0.4, 1.6);
        let teeth = (change.abs() / here).floor().min(MOST) as usize;
        for k in 0..teeth {
            if let Some(jump) = jumps.get_mut(i + k * apart) {
                *jump -= change.signum();
            }
        }
    }
    lagged(&jumps, draw.by_ratio(0.08, 0.3), stand.rate_hz)
}

/// A part that takes its wide range beyond a rate, and its narrow one again below a lower rate: the wide one has an offset
/// and a gain of its own.
fn range(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    let up = draw.between(0.3, 0.6);
    let down = up * draw.between(0.4, 0.8);
    let (offset, gain) = (draw.sign(), draw.between(-1.0, 1.0));
    let mut wide = false;
    let all: Vec<f64> = rate
        .iter()
        .map(|r| {
            wide = r.abs() > if wide { down } else { up };
            if wide { offset + gain * r } else { 0.0 }
        })
        .collect();
    about_mean(&all)
}

/// Oil in the two halves of the gear's case sloshes when the table is made to turn faster or slower, and takes the table
/// with it: two pitches, as the halves are not of a length.
fn slosh(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let pushed = changes(&rate_of_table(draw, stand));
    let (pitch, apart) = (draw.by_ratio(0.5, 2.5), draw.between(1.2, 1.9));
    let (half_width, second) = (draw.by_ratio(0.01, 0.06), draw.between(0.3, 1.0));
    let [one, other] =
        [pitch, apart * pitch].map(|pitch| resonating(&pushed, (pitch, half_width), stand.rate_hz));
    one.iter().zip(other).map(|(a, b)| a + second * b).collect()
}

#[cfg(test)]
mod tests;
