//! Foreign effects kept back from the engine, tenth set (2026-11-22): twenty by an outside examiner. Sixty effects beyond
//! the causes of the library were written down before any file of this project was read, and twenty of them drawn at
//! random (`shuf`, seed 13536238297718263650 of `/dev/urandom`). The draw was final: none was left out because an earlier
//! set has its like. Those that turned out, once all was written, to have one are [`TWINS`]. None was diagnosed while they
//! were written, and the engine's code was not read; the ninth set was, for its shape. The tests of `library_share` hold that
//! no effect of the library describes them, nor, where they are signals, a sum of two.
//!
//! Where the table's rate matters, the part turns with the table, and the rate of the table's encoder has been taken off:
//! what is left in the readings is what the part gets wrong.

use std::f64::consts::TAU;

use super::kept_back_fourth::about_mean;
use super::kept_back_sixth::in_steps;
use super::{Foreign, PLAIN, Set, of_signal};
use crate::random::Draw;
use crate::stand::{Stand, held, lagged, wander};

pub(super) mod codes;
pub(super) mod events;
pub(super) mod noise;

/// Their names, in the order in which they were listed.
pub const NAMES: [&str; 20] = [
    "error by the square of the table's rate",
    "bias by the square of an acceleration",
    "quantisation of an angle that is differenced",
    "dead zone about zero rate",
    "bearing that sticks and slips",
    "cogging whose pitch follows the speed",
    "cable that pulls when it is wound up",
    "bias by the heading of the table",
    "dielectric that remembers strong rates",
    "brushes that spark when the command changes",
    "charge that jumps and leaks away",
    "shocks that ring and recover in part",
    "creep by the logarithm of time",
    "noise by the magnitude of the table's rate",
    "zero taken anew at every rest",
    "slew limit of the output stage",
    "other gain and offset beyond a rate",
    "lower rate filled up by straight lines",
    "wobble of the table",
    "narrow band that a fan drives",
];

/// Those of them that have a near twin in an earlier set, with the one that is nearest: the same kind of signal or of law
/// by the same kind of cause, sizes and pace apart. What is in doubt counts as one. Looked for once all was written.
const TWINS: [(&str, &str); 17] = [
    (
        "error by the square of the table's rate",
        "heat of the motor that comes late",
    ),
    (
        "bias by the square of an acceleration",
        "square of a shaking",
    ),
    (
        "quantisation of an angle that is differenced",
        "noise of a differenced angle",
    ),
    (
        "dead zone about zero rate",
        "dead zone of a push-pull stage",
    ),
    ("bearing that sticks and slips", "stick and slip"),
    (
        "cogging whose pitch follows the speed",
        "ripple at the speed of the motor",
    ),
    (
        "cable that pulls when it is wound up",
        "cable that winds up",
    ),
    (
        "bias by the heading of the table",
        "ripple at the speed of the motor",
    ),
    (
        "brushes that spark when the command changes",
        "noise after each change of the command",
    ),
    ("charge that jumps and leaks away", "jumps that relax"),
    ("shocks that ring and recover in part", "knocks that ring"),
    ("creep by the logarithm of time", "creep"),
    ("zero taken anew at every rest", "jumps at random"),
    (
        "slew limit of the output stage",
        "reading that may change by so much at most",
    ),
    (
        "lower rate filled up by straight lines",
        "interpolation between two clocks",
    ),
    ("wobble of the table", "ripple at the speed of the motor"),
    ("narrow band that a fan drives", "noise with a resonance"),
];

/// The set.
pub(super) const SET: Set = Set {
    names: &NAMES,
    twins: &TWINS,
    parts,
    one,
    ..PLAIN
};

/// Causes of the library that are a true part of it: the straight line by the command through its square and through what
/// remembers it, the steps that stay after a shock or a zero, a variance by the command where the rate lags behind, and the
/// filter that straight lines between samples are.
fn parts(name: &str) -> &'static [&'static str] {
    match name {
        "error by the square of the table's rate" => &["motor_bias"],
        "dielectric that remembers strong rates" => &["motor_bias"],
        "shocks that ring and recover in part" | "zero taken anew at every rest" => &["bias_step"],
        "noise by the magnitude of the table's rate" => &["motor_noise"],
        "lower rate filled up by straight lines" => &["low_pass"],
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
        "error by the square of the table's rate" => squared_rate(draw, stand),
        "bias by the square of an acceleration" => squared_acceleration(draw, stand),
        "bearing that sticks and slips" => stick_slip(draw, stand),
        "cogging whose pitch follows the speed" => cogging(draw, stand),
        "cable that pulls when it is wound up" => cable(draw, stand),
        "bias by the heading of the table" => heading(draw, stand),
        "dielectric that remembers strong rates" => remembered(draw, stand),
        "charge that jumps and leaks away" => events::charge(draw, stand),
        "shocks that ring and recover in part" => events::shocks(draw, stand),
        "creep by the logarithm of time" => events::creep(draw, stand),
        "zero taken anew at every rest" => zeroed(draw, stand),
        "wobble of the table" => wobble(draw, stand),
        _ => {
            return noise::one(draw, stand, name, axis, wanted)
                .or_else(|| codes::one(draw, stand, name, axis, wanted));
        }
    };
    Some(of_signal(stand, name, axis, &unit, wanted))
}

/// Commands of a rate table's programme, which the stand gets: levels held for so long, s, slow ones more often than fast
/// ones, in either sense, and a rest now and then.
pub(super) fn programme(draw: &mut Draw, stand: &mut Stand, dwell_s: (f64, f64)) {
    const RESTS: f64 = 0.25;
    stand.world.duty = held(draw, stand.samples(), stand.rate_hz, dwell_s, |d| {
        if d.chance(RESTS) {
            0.0
        } else {
            in_steps((0.45 * d.normal()).clamp(-1.0, 1.0))
        }
    });
}

/// How long a programme of rates stays at one, s.
pub(super) const DWELL: (f64, f64) = (3.0, 12.0);

/// The table's rate over that at full duty: behind the command by the time that the motor takes to spin up.
pub(super) fn rate_of_table(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    lagged(&stand.world.duty, draw.by_ratio(0.3, 1.5), stand.rate_hz)
}

/// The angle that the table has turned by, rad, where its rate at full duty is so many turns per second.
pub(super) fn angle_of_table(rate: &[f64], full: f64, rate_hz: f64) -> Vec<f64> {
    let mut angle = 0.0;
    rate.iter()
        .map(|r| {
            angle += TAU * full * r / rate_hz;
            angle
        })
        .collect()
}

/// An even term of the scale factor: turning one way a little too much is read, the other way too little.
fn squared_rate(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    let sign = draw.sign();
    about_mean(&rate.iter().map(|r| sign * r * r).collect::<Vec<f64>>())
}

/// Vibration along a level axis, told, that swells and fades.
pub(super) fn swelling(draw: &mut Draw, stand: &mut Stand) -> usize {
    const RAIL_G: f64 = 1.9;
    let (usual, tau) = (draw.by_ratio(0.1, 0.4), draw.by_ratio(10.0, 60.0));
    let swell = wander(draw, stand.samples(), stand.rate_hz, 0.5, tau);
    let level = draw.of_many(2);
    stand.world.acc[level] = swell
        .iter()
        .map(|s| (usual * s.exp() * draw.normal()).clamp(-RAIL_G, RAIL_G))
        .collect();
    level
}

/// Rectification (g^2 of IEEE Std 528): the square of the acceleration along a level axis, whose vibration swells and fades.
fn squared_acceleration(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let level = swelling(draw, stand);
    let square: Vec<f64> = stand.world.acc[level].iter().map(|a| a * a).collect();
    let sign = draw.sign();
    about_mean(&square).iter().map(|s| sign * s).collect()
}

/// A table that creeps: the bearing sticks until the drive has wound up, then slips on by as much as it stood still. What
/// the rate is off from the one commanded.
fn stick_slip(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const CREEP: (f64, f64) = (0.04, 0.2);
    stand.world.duty = held(draw, stand.samples(), stand.rate_hz, (15.0, 60.0), |d| {
        if d.chance(0.2) {
            0.0
        } else {
            in_steps(d.sign() * d.by_ratio(CREEP.0, CREEP.1))
        }
    });
    // The time for which the slowest one sticks, s, and that of a slip.
    let (longest, slip) = (draw.by_ratio(2.0, 8.0), draw.by_ratio(0.1, 0.4));
    let slips = (slip * stand.rate_hz).round().max(1.0) as usize;
    let sum = (slips * (slips + 1)) as f64 / 2.0;
    let holds = |draw: &mut Draw| longest * CREEP.0 * stand.rate_hz * draw.between(0.5, 1.5);
    // How far the drive has wound up, at how much the bearing gives, and readings of the slip that are left.
    let (mut wound, mut gives, mut left) = (0.0, holds(draw), 0);
    let mut sense = 0.0;
    let duty = stand.world.duty.iter();
    duty.map(|d| {
        // A drive that stands or turns back has to be wound up again.
        if *d == 0.0 || d.signum() != sense {
            (wound, left, sense) = (0.0, 0, if *d == 0.0 { 0.0 } else { d.signum() });
        }
        if *d == 0.0 {
            return 0.0;
        }
        if left == 0 && wound >= gives {
            left = slips;
        }
        if left == 0 {
            wound += d.abs();
            return -d;
        }
        // A slip dies away as it goes.
        let goes = sense * wound * left as f64 / sum;
        left -= 1;
        if left == 0 {
            (wound, gives) = (0.0, holds(draw));
        }
        goes
    })
    .collect()
}

/// Cogging of the motor: so many ripples a turn, so that their pitch is the speed; slow ones are the larger, and none at
/// rest.
fn cogging(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    // Ripples per second at full duty; inertia is what counts beyond a corner.
    let (pitch, corner) = (draw.by_ratio(3.0, 9.5), draw.between(0.1, 0.3));
    let first = draw.between(0.0, TAU);
    angle_of_table(&rate, pitch, stand.rate_hz)
        .iter()
        .zip(&rate)
        .map(|(angle, r)| 2.0 * r * corner / (r * r + corner * corner) * (first + angle).cos())
        .collect()
}

/// A cable to the table that has some slack: wound up further, either way, it pulls the part askew, the more the further.
/// The programme turns to and fro, now further and now less far.
fn cable(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    // In turns, and turns per second at full duty.
    let (far, full) = (draw.by_ratio(0.2, 0.5), draw.by_ratio(0.2, 0.5));
    let (mut angle, mut sense) = (0.0, draw.sign());
    let mut duty = Vec::with_capacity(stand.samples());
    while duty.len() < stand.samples() {
        let level = in_steps(draw.between(0.3, 1.0));
        let to = far * draw.between(0.4, 1.0);
        while sense * angle < to {
            duty.push(sense * level);
            angle += full * sense * level / stand.rate_hz;
        }
        sense = -sense;
    }
    duty.truncate(stand.samples());
    stand.world.duty = duty;
    let rate = rate_of_table(draw, stand);
    let angle = about_mean(&angle_of_table(&rate, full, stand.rate_hz));
    let (slack, sign) = (TAU * far * draw.between(0.3, 0.6), draw.sign());
    let pull = |a: &f64| sign * a.signum() * (a.abs() - slack).max(0.0);
    about_mean(&angle.iter().map(pull).collect::<Vec<f64>>())
}

/// A stray magnetic field: the bias goes round with the table, and, by soft iron, a little twice as fast.
fn heading(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    let (full, soft) = (draw.by_ratio(0.1, 0.4), draw.between(0.0, 0.4));
    let (first, second) = (draw.between(0.0, TAU), draw.between(0.0, TAU));
    let bias: Vec<f64> = angle_of_table(&rate, full, stand.rate_hz)
        .iter()
        .map(|a| (a + first).cos() + soft * (2.0 * a + second).cos())
        .collect();
    about_mean(&bias)
}

/// Dielectric absorption of a ceramic capacitor in the signal's way, which strong fields polarise out of proportion:
/// relaxations of four time constants, an octave or two apart, carry on what strong rates have left.
fn remembered(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, (1.0, 5.0));
    let rate = rate_of_table(draw, stand);
    let (shortest, apart) = (draw.by_ratio(0.3, 1.0), draw.between(2.5, 4.0));
    let sign = draw.sign();
    let strong: Vec<f64> = rate.iter().map(|r| r.powi(3)).collect();
    let mut all = vec![0.0; rate.len()];
    for k in 0..4 {
        let tail = lagged(&strong, shortest * apart.powi(k), stand.rate_hz);
        all.iter_mut().zip(tail).for_each(|(v, t)| *v += sign * t);
    }
    about_mean(&all)
}

/// Firmware that takes the mean of a few readings for the zero whenever the table stands still: from then until the next
/// rest all readings are off by what those were.
fn zeroed(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const SETTLES_S: f64 = 1.0;
    let mut turning = draw.chance(0.5);
    let dwell = draw.by_ratio(3.0, 9.0);
    let samples = stand.samples();
    stand.world.duty = held(
        draw,
        samples,
        stand.rate_hz,
        (0.5 * dwell, 1.5 * dwell),
        |d| {
            turning = !turning;
            f64::from(u8::from(turning)) * in_steps(d.sign() * d.between(0.2, 1.0))
        },
    );
    let settles = (SETTLES_S * stand.rate_hz).round() as usize;
    let (mut zero, mut rests) = (0.0, 0);
    let duty = stand.world.duty.iter();
    let all: Vec<f64> = duty
        .map(|d| {
            rests = if *d == 0.0 { rests + 1 } else { 0 };
            if rests == settles {
                zero = draw.normal();
            }
            zero
        })
        .collect();
    about_mean(&all)
}

/// A table whose axis is not square to its face: a level axis sees the sine of the angle times the rate.
fn wobble(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    let (full, first) = (draw.by_ratio(0.1, 0.5), draw.between(0.0, TAU));
    let angle = angle_of_table(&rate, full, stand.rate_hz);
    let seen = |(a, r): (&f64, &f64)| r * (a + first).sin();
    about_mean(&angle.iter().zip(&rate).map(seen).collect::<Vec<f64>>())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::stand::Needs;

    pub(super) fn stand(index: u64) -> (Draw, Stand) {
        let mut draw = Draw::of(20_261_122, 108, index);
        let stand = Stand::draw(&mut draw, 600.0, 20.0, Needs::default());
        (draw, stand)
    }

    fn energy(y: &[f64]) -> f64 {
        y.iter().map(|v| v * v).sum()
    }

    /// Largest change from one sample to the next.
    pub(in super::super) fn largest_change(y: &[f64]) -> f64 {
        y.windows(2)
            .map(|w| (w[1] - w[0]).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn a_square_of_the_rate_does_not_know_its_sense() {
        let (mut draw, mut stand) = stand(0);
        let y = squared_rate(&mut draw, &mut stand);
        let rate = about_mean(&stand.world.duty);
        let product: f64 = y.iter().zip(&rate).map(|(y, r)| y * r).sum();
        let alike = product / (energy(&y) * energy(&rate)).sqrt();
        assert!(alike.abs() < 0.4, "{alike}");
        // At rest for a while it is where no rate takes it: the least or the most.
        let (low, high) = super::super::extremes(&y);
        let i = stand
            .world
            .duty
            .windows(60)
            .position(|w| w.iter().all(|d| *d == 0.0));
        let rest = y[i.expect("a rest of 3 s") + 59];
        assert!((rest - low).min(high - rest) < 0.01 * (high - low));
    }

    #[test]
    fn a_rectified_acceleration_is_the_square_of_one_that_stays_on_scale() {
        let (mut draw, mut stand) = stand(1);
        let y = squared_acceleration(&mut draw, &mut stand);
        assert!(stand.world.acc.iter().flatten().all(|a| a.abs() < 2.0));
        let of = |acc: &Vec<f64>| {
            let square = about_mean(&acc.iter().map(|a| a * a).collect::<Vec<f64>>());
            let off = |sign: f64| -> f64 {
                square
                    .iter()
                    .zip(&y)
                    .map(|(s, y)| (s - sign * y).powi(2))
                    .sum()
            };
            off(1.0).min(off(-1.0))
        };
        let off = stand.world.acc.iter().map(of).fold(f64::INFINITY, f64::min);
        assert!(off < 1e-9, "{off}");
    }

    #[test]
    fn a_table_that_sticks_gets_as_far_as_it_is_told() {
        let (mut draw, mut stand) = stand(2);
        let y = stick_slip(&mut draw, &mut stand);
        assert_eq!(y.len(), stand.samples());
        let (mut told, mut is) = (0.0f64, 0.0f64);
        let mut behind = 0.0f64;
        for (y, duty) in y.iter().zip(&stand.world.duty) {
            assert!(*duty != 0.0 || *y == 0.0);
            // Sticking, it does not turn; slipping, it turns the way it is told to.
            assert!((y + duty) * duty > -1e-9 || *duty == 0.0);
            told += duty.abs();
            is += (y + duty) * duty.signum();
            behind = behind.max((told - is).abs());
        }
        assert!((is / told - 1.0).abs() < 0.05, "{is} {told}");
        assert!(behind < 0.15 * told);
    }

    #[test]
    fn a_ripple_comes_as_often_as_the_motor_turns_and_a_heading_once_a_turn() {
        let rate = vec![0.5; 2000];
        let angle = angle_of_table(&rate, 4.0, 20.0);
        assert!((angle[1999] / TAU - 200.0).abs() < 1e-6);
        let (mut draw, mut stand) = stand(3);
        let y = cogging(&mut draw, &mut stand);
        for (y, w) in y[60..].iter().zip(stand.world.duty.windows(61)) {
            // None at rest.
            assert!(y.abs() <= 1.0 + 1e-9);
            assert!(w.iter().any(|d| *d != 0.0) || y.abs() < 0.1, "{y}");
        }
        // Standing still, a table keeps its heading.
        let y = heading(&mut draw, &mut stand);
        for (y, w) in y.windows(2).skip(200).zip(stand.world.duty.windows(202)) {
            let rests = w.iter().all(|d| *d == 0.0);
            assert!(!rests || (y[1] - y[0]).abs() < 0.01);
        }
        let y = wobble(&mut draw, &mut stand);
        assert!(y.iter().all(|y| y.abs() < 1.2));
    }

    #[test]
    fn a_cable_has_slack_and_pulls_both_ways() {
        let (mut draw, mut stand) = stand(4);
        let y = cable(&mut draw, &mut stand);
        let (low, high) = super::super::extremes(&y);
        let mut levels = y.clone();
        levels.sort_by(f64::total_cmp);
        let slack = levels[levels.len() / 2];
        let loose = y.iter().filter(|v| (*v - slack).abs() < 1e-9).count();
        assert!(loose > y.len() / 10, "{loose}");
        assert!(slack - low > 0.1 * (high - low) && high - slack > 0.1 * (high - low));
    }

    #[test]
    fn a_dielectric_remembers_for_longer_than_the_motor_takes() {
        let (mut draw, mut stand) = stand(5);
        let y = remembered(&mut draw, &mut stand);
        let rest = |w: &[f64]| w.iter().all(|d| *d == 0.0);
        let from = stand.world.duty.windows(80).position(rest);
        let from = from.expect("a rest of 4 s");
        // Five time constants of a motor later it still goes on falling.
        let moved = (y[from + 79] - y[from + 60]).abs();
        assert!(moved > 1e-3, "{moved}");
        assert!(largest_change(&y) < 0.5);
    }

    #[test]
    fn a_zero_is_taken_at_rest_alone_and_holds() {
        let (mut draw, mut stand) = stand(10);
        let y = zeroed(&mut draw, &mut stand);
        let mut taken = 0;
        for (w, d) in y.windows(2).zip(&stand.world.duty[1..]) {
            if w[0] != w[1] {
                assert_eq!(*d, 0.0);
                taken += 1;
            }
        }
        assert!(taken > 20, "{taken}");
    }
}
