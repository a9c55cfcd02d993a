//! Foreign effects kept back from the engine, fifth set (2026-11-21): written from the physics and mathematics named
//! here, by someone who had not read how the diagnosis decides beyond what docs/power.md tells, nor diagnosed a run while
//! writing. The tests of `library_share` hold that no effect of the library describes them, nor, where they are signals, a
//! sum of two.

use std::f64::consts::TAU;

use super::kept_back_fourth::{about_mean, cycles};
use super::{Foreign, PLAIN, Set, extremes, of_signal, swing};
use crate::random::Draw;
use crate::stand::{Needs, Stand, held, wander};

pub(super) mod noise;

/// Their names: four that follow a recorded channel, two of events, one with a period, two of noise and one of codes.
pub const NAMES: [&str; 10] = [
    "dips where two modes meet",
    "acceleration weighed by temperature",
    "ripple of a converter that steps up or down",
    "ripple of the motor's chopped current",
    "ball that bounces until it lies",
    "iron that passes by",
    "elements that take turns",
    "noise of a supply near its end",
    "noise that a loop holds down",
    "dead zone of a push-pull stage",
];

/// The set.
pub(super) const SET: Set = Set {
    names: &NAMES,
    needs,
    parts,
    one,
    ..PLAIN
};

/// Beyond what every foreign effect gets.
fn needs(name: &str) -> Needs {
    Needs {
        temperature: true,
        motor: true,
        supply: false,
        vibration: name.contains("acceleration"),
    }
}

/// Causes of the library that are a true part of it: the straight line through a bent law, and what is left of an
/// acceleration at a temperature that is not the run's mean.
fn parts(name: &str) -> &'static [&'static str] {
    match name {
        "acceleration weighed by temperature" => &["g_sensitivity"],
        "ripple of a converter that steps up or down" => &["supply_sensitivity"],
        "ripple of the motor's chopped current" => &["motor_bias"],
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
        "dips where two modes meet" => dips(draw, stand, axis),
        "acceleration weighed by temperature" => weighed(draw, stand, axis),
        "ripple of a converter that steps up or down" => up_or_down(draw, stand),
        "ripple of the motor's chopped current" => chopped(draw, stand),
        "ball that bounces until it lies" => ball(draw, stand),
        "iron that passes by" => passing(draw, stand),
        "elements that take turns" => in_turn(draw, stand),
        _ => return noise::one(draw, stand, name, axis, wanted),
    };
    Some(of_signal(stand, name, axis, &unit, wanted))
}

/// Activity dips: a vibrating part has other modes than the one that is driven, and their frequencies move with the
/// temperature at another pace. Where two meet, energy goes over and the rate is off, by the law of a resonance in the
/// temperature, either way and in a range of some tenths of a degree.
fn dips(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let temperature = &stand.world.temperature[axis];
    let (low, high) = extremes(temperature);
    let span = high - low;
    let count = 2 + draw.of_many(4);
    // One in each of as many equal ranges: dips do not lie on each other.
    let modes: Vec<[f64; 3]> = (0..count)
        .map(|i| {
            let place = (i as f64 + draw.between(0.2, 0.8)) / count as f64;
            [
                low + span * place,
                span * draw.by_ratio(0.01, 0.05),
                draw.sign() * draw.between(0.5, 1.5),
            ]
        })
        .collect();
    temperature
        .iter()
        .map(|t| {
            let dip = |[at, width, depth]: &[f64; 3]| depth / (1.0 + ((t - at) / width).powi(2));
            modes.iter().map(dip).sum()
        })
        .collect()
}

/// A gyro's sensitivity to acceleration is trimmed away at one temperature, near the middle of its range; what the springs
/// lose in stiffness by a degree brings it back, with one sign above and the other below.
fn weighed(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    let temperature = from_trim(draw, stand, axis);
    let force = about_mean(&stand.world.acc[draw.of_many(3)]);
    temperature.iter().zip(force).map(|(t, a)| t * a).collect()
}

/// An axis's temperature from that at which something of it was trimmed, near the middle of its range.
pub(super) fn from_trim(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    let temperature = about_mean(&stand.world.temperature[axis]);
    let trimmed = draw.between(-0.1, 0.1) * swing(&temperature);
    temperature.iter().map(|t| t - trimmed).collect()
}

/// A converter that steps its input up or down to one voltage has the least ripple where both are equal, and more the
/// further the input is off, either way; the part rectifies the ripple. The loads before it are of many sizes.
fn up_or_down(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    let most = draw.between(0.06, 0.15);
    let load = held(draw, n, rate_hz, (3.0, 15.0), |d| d.between(0.0, most));
    let slow = wander(draw, n, rate_hz, 0.001, 60.0);
    stand.world.supply = load.iter().zip(slow).map(|(l, s)| 5.0 - l - s).collect();
    let equal = 5.0 - most * draw.between(0.35, 0.65);
    // Between the two there is a range in which both take part.
    let both = most * draw.between(0.0, 0.15);
    let supply = &stand.world.supply;
    supply.iter().map(|u| (u - equal).hypot(both)).collect()
}

/// A bridge chops the motor's current: in the coil it rises while the bridge is on, and falls while it is off, by
/// duty x (1 - duty), the most at half duty and nothing at rest and at full. What the part makes of a field that swings so
/// fast goes with its size or with its square, whatever its sense. The command is changed by steps.
fn chopped(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let power = 1 + draw.of_many(2) as i32;
    stand.world.duty = held(draw, stand.samples(), stand.rate_hz, (3.0, 15.0), |d| {
        (d.sign() * d.between(0.0, 1.0) * 255.0).round() / 255.0
    });
    let ripple = |d: &f64| 4.0 * d.abs() * (1.0 - d.abs());
    stand
        .world
        .duty
        .iter()
        .map(|d| ripple(d).powi(power))
        .collect()
}

/// A washer or a ball falls on the bench and bounces: each bounce is as high as the square of the restitution times the one
/// before, so that the blows come ever faster, each weaker by the restitution, and end after a finite time although there
/// are more than can be counted. Each blow turns the part on its mount, which swings back.
fn ball(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    const GRAVITY: f64 = 9.81;
    let n = stand.samples();
    let mut y = vec![0.0; n];
    // How much of a turn is left after a sample: the mount's stiffness.
    let back = draw.between(0.3, 0.8);
    let mut at = draw.between(2.0, 20.0);
    while at < stand.seconds {
        let (height, restitution) = (draw.by_ratio(0.1, 1.0), draw.between(0.8, 0.95));
        let size = draw.sign() * height.sqrt();
        let (mut flight, mut blow, mut hit) = ((8.0 * height / GRAVITY).sqrt(), size, at);
        while blow.abs() > 0.05 * size.abs() {
            let place = hit * stand.rate_hz;
            let first = place as usize;
            // A blow within a sample is shared with the next one.
            let late = place - first as f64;
            for (k, share) in [
                (0, 1.0 - late),
                (1, late - back * (1.0 - late)),
                (2, -back * late),
            ] {
                if let Some(v) = y.get_mut(first + k) {
                    *v += blow * share;
                }
            }
            flight *= restitution;
            hit += flight;
            blow *= restitution;
        }
        at = hit + 3.0 + 30.0 * draw.exponential();
    }
    y
}

/// A lift, a tram or a lorry passes: iron is a dipole, and its field at the part is that of a dipole on a straight line,
/// (3 cos^2 - 1) / r^3 with the angle to where it points. Each passes at its own distance and speed, and is magnetised
/// its own way.
fn passing(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let mut y = vec![0.0; stand.samples()];
    let mut at = draw.between(0.0, 20.0);
    while at < stand.seconds {
        // Distance over speed, s.
        let takes = draw.by_ratio(0.5, 4.0);
        let (size, (across, along)) = (draw.between(0.5, 1.5), draw.between(0.0, TAU).sin_cos());
        for (i, v) in y.iter_mut().enumerate() {
            let x = (i as f64 / stand.rate_hz - at) / takes;
            let square = 1.0 + x * x;
            // The component across the way: 3 (m.r) r / r^5 - m / r^3.
            *v += size * (3.0 * (across + along * x) / square - across) / square.powf(1.5);
        }
        at += 4.0 * takes + 25.0 * draw.exponential();
    }
    y
}

/// A converter takes its elements in turn so that none counts more than the others (dynamic element matching): reading by
/// reading the next, each off by its own amount, and after the last the first again: at least 16 lines, none far above the
/// others.
fn in_turn(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let count = 32 + draw.of_many(33);
    let off: Vec<f64> = (0..count).map(|_| draw.normal()).collect();
    let off = about_mean(&off);
    let first = draw.of_many(count);
    (0..stand.samples())
        .map(|i| off[(first + i) % count])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stand(index: u64) -> (Draw, Stand) {
        let mut draw = Draw::of(20_261_121, 33, index);
        let stand = Stand::draw(&mut draw, 600.0, 20.0, Needs::default());
        (draw, stand)
    }

    #[test]
    fn a_ball_lies_in_the_end_and_a_blow_is_taken_back_by_the_mount() {
        let (mut draw, stand) = stand(0);
        for _ in 0..5 {
            let y = ball(&mut draw, &stand);
            let moved = y.iter().filter(|v| **v != 0.0).count();
            // Most of the time it lies or has not come yet.
            assert!(moved > 100 && moved < y.len() / 2, "{moved}");
            let (one, both): (f64, f64) = (y.iter().map(|v| v.abs()).sum(), y.iter().sum());
            assert!(both.abs() < 0.8 * one, "{both} {one}");
        }
    }

    #[test]
    fn elements_come_again_in_their_order_and_sum_to_nothing() {
        let (mut draw, stand) = stand(1);
        for _ in 0..5 {
            let y = in_turn(&mut draw, &stand);
            let count = (1..y.len()).find(|k| y[0] == y[*k]).expect("a period");
            assert!((32..65).contains(&count), "{count}");
            assert!(y.iter().zip(&y[count..]).all(|(a, b)| a == b));
            assert!(y[..count].iter().sum::<f64>().abs() < 1e-9);
        }
    }

    #[test]
    fn chopped_current_has_no_ripple_at_rest_and_at_full() {
        let (mut draw, mut stand) = stand(2);
        let y = chopped(&mut draw, &mut stand);
        for (d, v) in stand.world.duty.iter().zip(y) {
            let distance = (d.abs() - 0.5).abs();
            assert!((0.0..=1.0).contains(&v));
            assert!(distance < 0.45 || v < 0.2, "{d} {v}");
            assert!(distance > 0.1 || v > 0.9, "{d} {v}");
        }
    }
}
