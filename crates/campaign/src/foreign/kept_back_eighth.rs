//! Foreign effects kept back from the engine, eighth set (2026-11-22): twenty as an examiner of the field would write
//! them in an afternoon. Listed from the causes of docs/effects.md before the names of the second to the seventh set
//! were read; a dozen that turned out to be an earlier one, or too weak within the limits, were then replaced. None was
//! diagnosed while they were written, and the engine's code was not read. The tests of `library_share` hold that no
//! effect of the library describes them, nor, where they are signals, a sum of two.

use std::f64::consts::TAU;

use super::kept_back_fourth::{about_mean, cycles};
use super::kept_back_seventh::noise::Turning;
use super::{Foreign, PLAIN, Set, extremes, of_signal};
use crate::random::Draw;
use crate::stand::{Needs, Stand, held, wander};

pub(super) mod codes;
pub(super) mod noise;

/// Their names: five that have a structure in time of their own, five that follow a recorded channel, six of noise, two
/// that couple axes and two of codes.
pub const NAMES: [&str; 20] = [
    "peaks with long skirts",
    "pressure behind a valve",
    "two switches on one lamp",
    "tone keyed by bits",
    "loop that never settles",
    "temperature that saturates",
    "change of the acceleration",
    "acceleration that saturates",
    "fold in the supply",
    "motor whose influence ages",
    "noise that undoes itself",
    "noise between two edges",
    "noise that feeds its own size",
    "swing that pushes one way",
    "reference renewed every few readings",
    "hump of noise that runs through the band",
    "changes of another axis",
    "magnitude of another axis",
    "amplifier that bends to a logarithm",
    "play in the reading",
];

/// The set.
pub(super) const SET: Set = Set {
    names: &NAMES,
    needs: |_| Needs {
        temperature: true,
        motor: true,
        ..Needs::default()
    },
    parts,
    one,
    ..PLAIN
};

/// Causes of the library that are a true part of it: the straight line through a law that saturates or ages.
fn parts(name: &str) -> &'static [&'static str] {
    match name {
        "temperature that saturates" => &["temperature"],
        "acceleration that saturates" => &["g_sensitivity"],
        "motor whose influence ages" => &["motor_bias"],
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
        "peaks with long skirts" => peaks(draw, stand),
        "pressure behind a valve" => pressure(draw, stand),
        "two switches on one lamp" => lamp(draw, stand),
        "tone keyed by bits" => keyed(draw, stand),
        "loop that never settles" => unsettled(draw, stand),
        "temperature that saturates" => warm_end(draw, stand, axis),
        "change of the acceleration" => change(draw, stand),
        "acceleration that saturates" => stop(draw, stand),
        "fold in the supply" => fold(draw, stand),
        "motor whose influence ages" => ageing(draw, stand),
        _ => {
            return noise::one(draw, stand, name, axis, wanted)
                .or_else(|| codes::one(draw, stand, name, axis, wanted));
        }
    };
    Some(of_signal(stand, name, axis, &unit, wanted))
}

/// Something sweeps past a resonance now and then, and what is absorbed follows the law of Lorentz: 1 / (1 + (t / w)^2),
/// of either sign, whose skirts never quite end.
fn peaks(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (width, apart) = (draw.by_ratio(0.15, 0.9), draw.by_ratio(8.0, 40.0));
    let mut all = vec![];
    let mut at = apart * draw.exponential();
    while at < stand.seconds {
        all.push((at, draw.sign() * draw.between(0.5, 1.5)));
        at += apart * (0.2 + draw.exponential());
    }
    let of = |t: f64| -> f64 {
        let skirt = |(at, size): &(f64, f64)| size / (1.0 + ((t - at) / width).powi(2));
        all.iter().map(skirt).sum()
    };
    (0..stand.samples())
        .map(|i| of(i as f64 / stand.rate_hz))
        .collect()
}

/// A vessel that is filled through one throat and emptied through another: exponentials between two levels, with one time
/// constant upward and one downward, which a valve switches whenever it is needed.
fn pressure(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (n, rate_hz, sign) = (stand.samples(), stand.rate_hz, draw.sign());
    let (fills, empties) = (draw.by_ratio(0.15, 0.8), draw.by_ratio(1.0, 4.0));
    let mut open = draw.chance(0.5);
    let valve = held(draw, n, rate_hz, (1.5, 8.0), |_| {
        open = !open;
        f64::from(u8::from(open))
    });
    let mut level = 0.0;
    valve
        .iter()
        .map(|end| {
            let tau = if *end > 0.5 { fills } else { empties };
            level = end + (level - end) * (-1.0 / (tau * rate_hz)).exp();
            sign * level
        })
        .collect()
}

/// Two switches on one lamp, each turned over by a clock of its own: it is lit where they differ. The periods have no
/// common measure.
fn lamp(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let slow = draw.by_ratio(4.0, 14.0);
    let fast = slow / draw.between(1.3, 2.9);
    let (one, other) = (draw.between(0.0, 1.0), draw.between(0.0, 1.0));
    let high = |turns: f64| turns.fract() < 0.5;
    (0..stand.samples())
        .map(|i| {
            let t = i as f64 / stand.rate_hz;
            let lit = high(one + t / slow) != high(other + t / fast);
            f64::from(u8::from(lit))
        })
        .collect()
}

/// A carrier that turns over by the bits of a message: its phase is one of two, its size is always the same.
fn keyed(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (f, bit) = (draw.by_ratio(0.8, 9.5), draw.by_ratio(0.4, 3.0));
    let first = draw.between(0.0, TAU);
    let bits = held(draw, stand.samples(), stand.rate_hz, (bit, bit), Draw::sign);
    bits.iter()
        .enumerate()
        .map(|(i, b)| b * (first + TAU * f * i as f64 / stand.rate_hz).sin())
        .collect()
}

/// A clocked loop with too much gain: each of its levels is 1 - 2 x^2 of the one before, and none comes twice (Ulam and
/// von Neumann 1947).
fn unsettled(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let clock = draw.by_ratio(0.3, 2.5);
    let mut x = draw.between(-0.9, 0.9);
    held(draw, stand.samples(), stand.rate_hz, (clock, clock), |_| {
        x = 1.0 - 2.0 * x * x;
        x
    })
}

/// What yields to the warmth until it lies against a stop, at either end: tanh of the temperature. The heater has a
/// thermostat.
fn warm_end(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let temperature = &stand.world.temperature[axis];
    let (low, high) = extremes(temperature);
    let (middle, width) = (draw.between(0.3, 0.7), draw.between(0.02, 0.08));
    let place = |t: &f64| (t - low) / (high - low).max(1e-9);
    temperature
        .iter()
        .map(|t| ((place(t) - middle) / width).tanh())
        .collect()
}

/// A swing of the bench that the accelerometer along one axis follows from sample to sample, of variance 1, with its size
/// there, g.
fn swing(draw: &mut Draw, stand: &mut Stand, pitch: (f64, f64)) -> Vec<f64> {
    let (along, rms) = (draw.of_many(3), draw.between(0.08, 0.3));
    let part = Turning::new(
        draw.by_ratio(pitch.0, pitch.1),
        draw.by_ratio(0.05, 0.3),
        stand.rate_hz,
    );
    let shake = part.of(draw, stand.samples());
    let still = if along == 2 { 1.0 } else { 0.0 };
    for (a, s) in stand.world.acc[along].iter_mut().zip(&shake) {
        *a = still + rms * s + 0.005 * draw.normal();
    }
    shake
}

/// A capacitor lets through how fast the acceleration changes, and nothing of what it is.
fn change(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let shake = swing(draw, stand, (0.3, 3.0));
    let last = shake.len() - 1;
    (0..shake.len())
        .map(|i| shake[(i + 1).min(last)] - shake[i.saturating_sub(1)])
        .collect()
}

/// A mass between stops that are close: what it does follows the acceleration for a little and is then the same however
/// hard it is pushed.
fn stop(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let shake = swing(draw, stand, (0.3, 4.0));
    let free = draw.by_ratio(0.05, 0.3);
    shake.iter().map(|s| (s / free).tanh()).collect()
}

/// A window comparator, or a rectifier in the reference: what the supply is off its middle, either way.
fn fold(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (rms, tau) = (draw.between(0.015, 0.04), draw.by_ratio(1.0, 6.0));
    let load = wander(draw, stand.samples(), stand.rate_hz, rms, tau);
    let middle = 5.0 + rms * draw.between(-0.25, 0.25);
    stand.world.supply = load.iter().map(|l| 5.0 + l).collect();
    let off: Vec<f64> = stand
        .world
        .supply
        .iter()
        .map(|u| (u - middle).abs() / rms)
        .collect();
    about_mean(&off)
}

/// What the motor's field does to the part wears off in the course of the run, and comes out on the other side.
fn ageing(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let n = stand.samples();
    stand.world.duty = held(draw, n, stand.rate_hz, (3.0, 12.0), |d| {
        (d.between(-1.0, 1.0) * 255.0).round() / 255.0
    });
    let (none, sign) = (n as f64 * draw.between(0.35, 0.65), draw.sign());
    let left = |i: usize| sign * (1.0 - i as f64 / none);
    let duty = stand.world.duty.iter().enumerate();
    duty.map(|(i, d)| left(i) * d).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stand() -> (Draw, Stand) {
        let mut draw = Draw::of(20_261_122, 71, 0);
        let needed = (SET.needs)(NAMES[0]);
        let stand = Stand::draw(&mut draw, 600.0, 20.0, needed);
        (draw, stand)
    }

    fn correlation(a: &[f64], b: &[f64]) -> f64 {
        let (a, b) = (about_mean(a), about_mean(b));
        let of = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        of(&a, &b) / (of(&a, &a) * of(&b, &b)).sqrt()
    }

    /// The axis along which it is shaken most.
    fn widest(stand: &Stand) -> usize {
        let spread = |k: &usize| super::super::swing(&stand.world.acc[*k]);
        let most = |a: &usize, b: &usize| spread(a).total_cmp(&spread(b));
        (0..3).max_by(most).expect("there are three axes")
    }

    #[test]
    fn a_lamp_and_a_keyed_tone_are_of_two_states() {
        let (mut draw, stand) = stand();
        let y = lamp(&mut draw, &stand);
        assert!(y.iter().all(|v| *v == 0.0 || *v == 1.0));
        let lit = y.iter().sum::<f64>() / y.len() as f64;
        assert!((0.4..0.6).contains(&lit), "{lit}");
        // Squared, the bits are gone: what is left has one pitch, so that any three successive values tell it.
        let y = keyed(&mut draw, &stand);
        let square: Vec<f64> = y.iter().map(|v| v * v - 0.5).collect();
        let twice_cos = (square[0] + square[2]) / square[1];
        for w in square.windows(3) {
            assert!((w[0] + w[2] - twice_cos * w[1]).abs() < 1e-6);
        }
    }

    #[test]
    fn a_loop_that_never_settles_is_white_from_level_to_level_and_known_from_the_one_before() {
        let (mut draw, mut stand) = stand();
        stand.seconds = 6000.0;
        stand.world.duty = vec![0.0; 120_000];
        let mut levels = unsettled(&mut draw, &stand);
        levels.dedup();
        assert!(levels.len() > 2000);
        let (all, next) = (&levels[..levels.len() - 1], &levels[1..]);
        assert!(correlation(all, next).abs() < 5.0 / (levels.len() as f64).sqrt());
        for (x, y) in all.iter().zip(next) {
            assert!((y - (1.0 - 2.0 * x * x)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_change_of_the_acceleration_is_a_quarter_of_a_turn_off_it_and_a_stop_is_soon_reached() {
        let (mut draw, mut stand) = stand();
        let y = change(&mut draw, &mut stand);
        let r = correlation(&y, &stand.world.acc[widest(&stand)]);
        assert!(r.abs() < 0.1, "{r}");
        let y = stop(&mut draw, &mut stand);
        let r = correlation(&y, &stand.world.acc[widest(&stand)]);
        assert!((0.75..0.97).contains(&r), "{r}");
        let against = y.iter().filter(|v| v.abs() > 0.95).count() as f64 / y.len() as f64;
        assert!(against > 0.4, "{against}");
    }

    #[test]
    fn a_fold_and_an_ageing_have_hardly_a_straight_line() {
        let (mut draw, mut stand) = stand();
        let y = fold(&mut draw, &mut stand);
        assert!(correlation(&y, &stand.world.supply).abs() < 0.5);
        let y = ageing(&mut draw, &mut stand);
        let (early, late) = (0..y.len() / 4, 3 * y.len() / 4..y.len());
        let of = |r: std::ops::Range<usize>| correlation(&y[r.clone()], &stand.world.duty[r]);
        assert!(of(early) * of(late) < -0.5);
    }

    #[test]
    fn pressure_rises_by_one_exponential_and_falls_by_another() {
        let (mut draw, stand) = stand();
        let y = pressure(&mut draw, &stand);
        // Within a stretch, what is left to the end shrinks by one factor.
        let (mut rising, mut falling) = (vec![], vec![]);
        let y: Vec<f64> = y.iter().map(|v| v.abs()).collect();
        for w in y.windows(2) {
            if w[1] > w[0] && w[0] < 0.9 {
                rising.push((1.0 - w[1]) / (1.0 - w[0]));
            } else if w[1] < w[0] && w[0] > 0.1 {
                falling.push(w[1] / w[0]);
            }
        }
        for all in [&rising, &falling] {
            assert!(all.len() > 50 && all.iter().all(|f| (f - all[0]).abs() < 1e-9));
        }
        assert!(rising[0] < falling[0]);
    }

    #[test]
    fn peaks_have_skirts_and_a_warm_end_lies_flat() {
        let (mut draw, mut stand) = stand();
        let y = peaks(&mut draw, &stand);
        assert!(y.iter().all(|v| *v != 0.0));
        let y = warm_end(&mut draw, &mut stand, 1);
        let flat = y.iter().filter(|v| v.abs() > 0.9).count() as f64 / y.len() as f64;
        assert!(flat > 0.5, "{flat}");
    }
}
