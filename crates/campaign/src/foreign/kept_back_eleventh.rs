//! Foreign effects kept back from the engine, eleventh set (2026-11-22): twenty by an outside examiner, of the forty ideas
//! that the draw of the tenth set had left of its sixty, all written down before any file of this project was read. The
//! draw (`shuf`, seed 9260019549983001150 of `/dev/urandom`) was final: none was left out because an earlier set has its
//! like, and none is a cause of the library. Those that turned out, once all was written, to have a near twin are
//! [`TWINS`]. None was diagnosed while they were written, and the engine's code was not read; the earlier sets were, for
//! their shape. The tests of `library_share` hold that no effect of the library describes them, nor, where they are
//! signals, a sum of two.
//!
//! Where the table's rate matters, the part turns with the table, and the rate of the table's encoder has been taken off, as
//! in the tenth set.

use std::f64::consts::TAU;

use super::kept_back_fifth::from_trim;
use super::kept_back_fourth::{about_mean, cycles};
use super::kept_back_ninth::resonating;
use super::kept_back_seventh::{behind_plays, lamp, without_line};
use super::kept_back_tenth::{DWELL, programme, rate_of_table, swelling};
use super::{Foreign, Set, of_signal, swing};
use crate::motor::current;
use crate::random::Draw;
use crate::stand::{Needs, Stand, lagged};

pub(super) mod codes;
pub(super) mod noise;
mod periods;

/// Their names, in the order in which they were drawn.
pub const NAMES: [&str; 20] = [
    "bias by the running level of a vibration",
    "lorries that sway the ground",
    "code step at mid-scale",
    "alias that glides while its clock warms up",
    "axis that is converted late",
    "noise that ramps through the record",
    "high byte of the reading before",
    "slip ring that is worn at some angles",
    "amplitude loop that hunts",
    "bias on one branch warming and another cooling",
    "scale factor that follows temperature",
    "kick by each change of the motor's current",
    "misalignment that grows with temperature",
    "correction that overflows at high rates",
    "error by the cube of the table's rate",
    "transmitter that pulls the reference while it sends",
    "rest of an accelerometer's last sample",
    "noise that grows with the warmth",
    "ramp of the rate that wanders",
    "self-test at a fixed period",
];

/// Those of them that have a near twin in an earlier set, with the one that is nearest: the same kind of signal or of law
/// by the same kind of cause, sizes and pace apart. What is in doubt counts as one. Looked for once all was written.
const TWINS: [(&str, &str); 19] = [
    (
        "bias by the running level of a vibration",
        "vibration rectified",
    ),
    (
        "lorries that sway the ground",
        "machine that starts and stops",
    ),
    (
        "code step at mid-scale",
        "other gain and offset beyond a rate",
    ),
    ("alias that glides while its clock warms up", "chirp"),
    ("axis that is converted late", "change of the acceleration"),
    ("noise that ramps through the record", "growing variance"),
    (
        "high byte of the reading before",
        "low bits that a latch keeps",
    ),
    ("slip ring that is worn at some angles", "bursts of noise"),
    ("amplitude loop that hunts", "charge and reset"),
    (
        "bias on one branch warming and another cooling",
        "backlash in temperature",
    ),
    (
        "scale factor that follows temperature",
        "duty times temperature",
    ),
    (
        "kick by each change of the motor's current",
        "ring of the arm at each reversal",
    ),
    (
        "misalignment that grows with temperature",
        "acceleration weighed by temperature",
    ),
    (
        "correction that overflows at high rates",
        "motor that sticks until it is pushed enough",
    ),
    (
        "error by the cube of the table's rate",
        "error by the square of the table's rate",
    ),
    (
        "transmitter that pulls the reference while it sends",
        "one short pulse each period",
    ),
    (
        "rest of an accelerometer's last sample",
        "acceleration that comes late",
    ),
    (
        "noise that grows with the warmth",
        "noise that follows temperature",
    ),
    ("self-test at a fixed period", "one short pulse each period"),
];

/// The set.
pub(super) const SET: Set = Set {
    names: &NAMES,
    twins: &TWINS,
    needs,
    parts,
    on_axis,
    one,
};

/// Beyond what every foreign effect gets.
fn needs(name: &str) -> Needs {
    Needs {
        temperature: matches!(
            name,
            "scale factor that follows temperature" | "noise that grows with the warmth"
        ),
        motor: false,
        supply: false,
        vibration: name == "rest of an accelerometer's last sample",
    }
}

/// The axis it acts on where another cannot be: a part is misaligned to a table that turns about z.
fn on_axis(name: &str, axis: usize) -> usize {
    if name == "misalignment that grows with temperature" {
        axis.min(1)
    } else {
        axis
    }
}

/// Causes of the library that are a true part of it: the straight line through a bent law, or what is left of a product at
/// a temperature that is not the run's mean; the surge that a change of the rate resembles; ground that really sways;
/// words that are disturbed.
fn parts(name: &str) -> &'static [&'static str] {
    match name {
        "lorries that sway the ground" => &["base_motion"],
        "high byte of the reading before" => &["outliers"],
        "bias on one branch warming and another cooling" => &["temperature"],
        "axis that is converted late"
        | "scale factor that follows temperature"
        | "correction that overflows at high rates"
        | "error by the cube of the table's rate" => &["motor_bias"],
        "misalignment that grows with temperature" => &["cross_axis"],
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
        "bias by the running level of a vibration" => vibration_level(draw, stand),
        "lorries that sway the ground" => periods::lorries(draw, stand),
        "alias that glides while its clock warms up" => periods::gliding(draw, stand),
        "axis that is converted late" => late(draw, stand),
        "amplitude loop that hunts" => periods::hunting(draw, stand),
        "bias on one branch warming and another cooling" => branches(draw, stand, axis),
        "scale factor that follows temperature" => scale(draw, stand, axis),
        "kick by each change of the motor's current" => kicks(draw, stand),
        "misalignment that grows with temperature" => misaligned(draw, stand, axis),
        "correction that overflows at high rates" => overflow(draw, stand),
        "error by the cube of the table's rate" => cubed_rate(draw, stand),
        "transmitter that pulls the reference while it sends" => periods::sending(draw, stand),
        "rest of an accelerometer's last sample" => rest_of_sample(draw, stand),
        "self-test at a fixed period" => periods::self_test(draw, stand),
        _ => {
            return noise::one(draw, stand, name, axis, wanted)
                .or_else(|| codes::one(draw, stand, name, axis, wanted));
        }
    };
    Some(of_signal(stand, name, axis, &unit, wanted))
}

/// Vibration rectification: what the part makes of a vibration far above its band follows the running mean square, which
/// the accelerometer shows; its read-out takes a second or more over that mean.
fn vibration_level(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let level = swelling(draw, stand);
    let square: Vec<f64> = stand.world.acc[level].iter().map(|a| a * a).collect();
    let runs = lagged(&square, draw.by_ratio(0.3, 2.0), stand.rate_hz);
    let sign = draw.sign();
    about_mean(&runs).iter().map(|r| sign * r).collect()
}

/// What follows a command no faster than so much a second.
pub(super) fn ramped(command: &[f64], most_per_s: f64, rate_hz: f64) -> Vec<f64> {
    let most = most_per_s / rate_hz;
    let mut follows = command.first().copied().unwrap_or(0.0);
    command
        .iter()
        .map(|c| {
            follows += (c - follows).clamp(-most, most);
            follows
        })
        .collect()
}

/// A multiplexed converter that comes to this axis a part of a frame after the encoder was read, or before: off by that
/// time's change of the rate. The table's drive ramps from rate to rate with one acceleration.
fn late(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = ramped(&stand.world.duty, draw.by_ratio(0.15, 0.6), stand.rate_hz);
    let sign = draw.sign();
    changes(&rate).iter().map(|c| sign * c).collect()
}

/// Change since the sample before.
pub(super) fn changes(series: &[f64]) -> Vec<f64> {
    let mut last = series.first().copied().unwrap_or(0.0);
    let change = |v: &f64| v - std::mem::replace(&mut last, *v);
    series.iter().map(change).collect()
}

/// Thermal hysteresis: layers that slip on each other (Prandtl and Ishlinskii), so that the bias takes another branch cooling
/// than it took warming. The straight line through the loops is taken off, for the part is compensated.
fn branches(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    const LAYERS: usize = 4;
    lamp(draw, stand);
    let own = &stand.world.temperature[axis];
    let span = swing(own);
    let from_first: Vec<f64> = own.iter().map(|t| t - own[0]).collect();
    let layers: [(f64, f64); LAYERS] =
        std::array::from_fn(|_| (span * draw.between(0.03, 0.2), draw.between(0.5, 1.5)));
    without_line(&behind_plays(&from_first, &layers), &from_first)
}

/// A scale factor that follows temperature: the rate times what the temperature is off that of the calibration.
fn scale(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    programme(draw, stand, (1.0, 5.0));
    let rate = rate_of_table(draw, stand);
    let temperature = from_trim(draw, stand, axis);
    let sign = draw.sign();
    let error = |(r, t): (&f64, &f64)| sign * r * t;
    rate.iter().zip(&temperature).map(error).collect()
}

/// Each change of the motor's current, that of spinning up included, induces a kick in a loop of the wiring. The loop and
/// what hangs on it are not damped much: the kick swings to either side and dies away.
fn kicks(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let induced = changes(&current(draw, &stand.world.duty, stand.rate_hz));
    let mode = (draw.by_ratio(0.8, 5.0), draw.by_ratio(0.1, 0.4));
    resonating(&induced, mode, stand.rate_hz)
}

/// A mount that was aligned at one temperature and leans as it warms up: a level axis sees the turning of the table about
/// z, which the gyro of that axis reads, times what the temperature is off that one.
fn misaligned(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let period = draw.by_ratio(5.0, 15.0);
    stand.excitation = vec![
        ("turn_dps", draw.between(7.0, 28.0)),
        ("turn_period_s", period),
    ];
    let temperature = from_trim(draw, stand, axis);
    let sign = draw.sign();
    let lean = |(i, t): (usize, &f64)| sign * t * (TAU * i as f64 / stand.rate_hz / period).sin();
    temperature.iter().enumerate().map(lean).collect()
}

/// Firmware that multiplies the rate in a word that is too narrow: beyond a rate the product wraps around, and the reading
/// is off by the whole range of the word, one way turning one way, and the other way the other.
fn overflow(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    // Where the word ends, and the reading's noise, over the rate at full duty.
    let (ends, noise) = (draw.between(0.35, 0.65), draw.by_ratio(0.005, 0.03));
    let sign = draw.sign();
    rate.iter()
        .map(|r| -sign * ((r + noise * draw.normal()) / (2.0 * ends)).round())
        .collect()
}

/// An odd term of the scale factor: its cube, less the straight line that is right at the rate at which it was calibrated.
fn cubed_rate(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    let (calibrated, sign) = (draw.between(0.5, 0.9), draw.sign());
    let error = |r: &f64| sign * r * (r * r - calibrated * calibrated);
    rate.iter().map(error).collect()
}

/// A multiplexer that comes to this gyro first in each frame, from the accelerometer that was last in the frame before: a
/// share of that sample is still on the capacitor.
fn rest_of_sample(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let force = about_mean(&stand.world.acc[draw.of_many(3)]);
    let sign = draw.sign();
    let before = |i: usize| sign * force[i.saturating_sub(1)];
    (0..force.len()).map(before).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::foreign::kept_back_tenth::tests::largest_change;

    pub(super) fn stand(index: u64) -> (Draw, Stand) {
        let mut draw = Draw::of(20_261_122, 120, index);
        let stand = Stand::draw(&mut draw, 600.0, 20.0, Needs::default());
        (draw, stand)
    }

    #[test]
    fn a_level_of_vibration_moves_slower_than_the_vibration() {
        let (mut draw, mut stand) = stand(0);
        let y = vibration_level(&mut draw, &mut stand);
        assert!(y.iter().sum::<f64>().abs() < 1e-6);
        assert!(largest_change(&y) < 0.5 * swing(&y));
    }

    #[test]
    fn a_late_axis_and_a_kick_are_off_only_after_a_change_of_the_command() {
        let (mut draw, mut stand) = stand(1);
        let y = late(&mut draw, &mut stand);
        // A ramp of 2 at 0.15 a second takes 13 s; at most 0.6 / 20 between two samples.
        let settled = |w: &[f64]| w.iter().all(|d| *d == w[0]);
        for (i, w) in stand.world.duty.windows(270).enumerate() {
            assert!(y[i].abs() < 0.031);
            assert!(!settled(w) || y[i + 269].abs() < 1e-12);
        }
        // A kick one way is taken back, and a bias of the current is not left.
        let y = kicks(&mut draw, &mut stand);
        let (all, sum) = (
            y.iter().map(|v| v.abs()).sum::<f64>(),
            y.iter().sum::<f64>(),
        );
        assert!(sum.abs() < 0.1 * all, "{sum} {all}");
    }

    #[test]
    fn a_rate_that_is_followed_in_ramps_gets_there() {
        let y = ramped(&[0.0, 1.0, 1.0, 1.0, -0.1], 10.0, 20.0);
        assert_eq!(y, [0.0, 0.5, 1.0, 1.0, 0.5]);
    }

    #[test]
    fn branches_differ_at_the_same_temperature() {
        let (mut draw, mut stand) = stand(2);
        let y = branches(&mut draw, &mut stand, 1);
        let t = &stand.world.temperature[1];
        let (low, high) = super::super::extremes(t);
        let middle = |i: &usize| (t[*i] - 0.5 * (low + high)).abs() < 0.02 * (high - low);
        let at: Vec<f64> = (0..y.len()).filter(middle).map(|i| y[i]).collect();
        assert!(swing(&at) > 0.3 * swing(&y), "{} {}", swing(&at), swing(&y));
    }

    #[test]
    fn a_word_that_overflows_is_off_by_whole_ranges_and_only_at_high_rates() {
        let (mut draw, mut stand) = stand(3);
        let y = overflow(&mut draw, &mut stand);
        let wrapped = y.iter().filter(|v| **v != 0.0).count();
        assert!(wrapped > 100 && wrapped < y.len() / 2, "{wrapped}");
        assert!(y.iter().all(|v| v.fract() == 0.0));
        for (y, w) in y[60..].iter().zip(stand.world.duty.windows(61)) {
            let slow = w.iter().all(|d| d.abs() < 0.2);
            assert!(!slow || *y == 0.0);
        }
    }

    #[test]
    fn a_cube_knows_the_sense_and_is_right_at_one_rate() {
        let (mut draw, mut stand) = stand(4);
        let y = cubed_rate(&mut draw, &mut stand);
        let at_rest = |w: &[f64]| w.iter().all(|d| d.abs() < 1e-9);
        let i = stand.world.duty.windows(60).position(at_rest);
        assert!(y[i.expect("a rest of 3 s") + 59].abs() < 0.05);
        let (low, high) = super::super::extremes(&y);
        assert!(low < -0.05 && high > 0.05, "{low} {high}");
    }

    #[test]
    fn what_is_left_of_a_sample_is_that_of_the_frame_before() {
        let (mut draw, mut stand) = stand(5);
        stand.world.acc = std::array::from_fn(|_| (0..100).map(f64::from).collect());
        let y = rest_of_sample(&mut draw, &stand);
        assert!(y[1] == y[0] && (y[2] - y[1]).abs() == 1.0);
    }

    #[test]
    fn a_lean_vanishes_where_the_table_turns_over() {
        let (mut draw, mut stand) = stand(6);
        let y = misaligned(&mut draw, &mut stand, 0);
        let half_s = 0.5 * stand.excitation[1].1;
        for k in 0..(stand.seconds / half_s) as usize {
            let i = (k as f64 * half_s * stand.rate_hz).round() as usize;
            assert!(y[i].abs() < 0.05 * swing(&y));
        }
        assert_eq!([0, 1, 2].map(|axis| on_axis(NAMES[12], axis)), [0, 1, 1]);
        assert_eq!(on_axis(NAMES[0], 2), 2);
    }
}
