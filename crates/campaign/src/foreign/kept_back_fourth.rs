//! Foreign effects kept back from the engine, fourth set (2026-11-21): written from the physics and mathematics named
//! here, by someone who had not read how the diagnosis decides beyond what docs/power.md tells, nor diagnosed a run while
//! writing. The tests of `library_share` hold that no effect of the library describes them, nor, where they are signals, a
//! sum of two.

use std::f64::consts::TAU;

use super::{Foreign, PLAIN, Set, extremes, of_signal};
use crate::random::Draw;
use crate::stand::{Needs, Stand, held, lagged, wander};

pub(super) mod codes;
pub(super) mod noise;

/// Their names: six that follow a recorded channel, four that have a structure in time of their own, five of noise, one of
/// codes and two that couple axes.
pub const NAMES: [&str; 18] = [
    "heat that comes in from one side",
    "disc that snaps over",
    "regulator that drops out",
    "product of two accelerations",
    "play of a mount under acceleration",
    "iron that stays magnetised",
    "touches that warm and fade",
    "swing that builds up and is quenched",
    "pulse of another clock",
    "tone that hops between two pitches",
    "noise that ends at an edge",
    "noise as large as the acceleration",
    "noise after each change of the command",
    "tone caught at any phase",
    "spikes that come in pairs",
    "reading that is renewed beyond a threshold",
    "another axis, frames late",
    "frames that hold another axis",
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

/// Causes of the library that are a true part of it: the straight line of what has a dead zone.
fn parts(name: &str) -> &'static [&'static str] {
    match name {
        "regulator that drops out" => &["supply_sensitivity"],
        "play of a mount under acceleration" => &["g_sensitivity"],
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
        "heat that comes in from one side" => one_side(draw, stand, axis),
        "disc that snaps over" => disc(draw, stand, axis),
        "regulator that drops out" => drop_out(draw, stand),
        "product of two accelerations" => product(draw, stand),
        "play of a mount under acceleration" => play(draw, stand),
        "iron that stays magnetised" => iron(draw, stand),
        "touches that warm and fade" => touches(draw, stand),
        "swing that builds up and is quenched" => quenched(draw, stand),
        "pulse of another clock" => pulse(draw, stand),
        "tone that hops between two pitches" => hopping(draw, stand),
        "spikes that come in pairs" => noise::pairs(draw, stand, wanted),
        _ => {
            return noise::one(draw, stand, name, axis, wanted)
                .or_else(|| codes::one(draw, stand, name, axis, wanted));
        }
    };
    Some(of_signal(stand, name, axis, &unit, wanted))
}

/// A heater touches the part's case on one side: while it warms, heat flows through and bends it, by the rate at which the
/// temperature rises. It cools by air on all sides, evenly, and is then not bent. The heater has a thermostat.
fn one_side(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let case = lagged(
        &stand.world.temperature[axis],
        draw.by_ratio(0.1, 1.0),
        stand.rate_hz,
    );
    let before = (draw.between(0.5, 2.0) * stand.rate_hz) as usize;
    (0..stand.samples())
        .map(|i| (case[i] - case[i.saturating_sub(before)]).max(0.0))
        .collect()
}

/// A small heater on the board with a thermostat of short cycles: the temperatures it makes.
pub(super) fn cycles(draw: &mut Draw, stand: &mut Stand) {
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    let (swing, mut on) = (draw.between(4.0, 10.0), draw.chance(0.5));
    let heater = held(draw, n, rate_hz, (8.0, 30.0), |_| {
        on = !on;
        f64::from(u8::from(on))
    });
    let warm = lagged(&heater, draw.between(3.0, 9.0), rate_hz);
    let size = draw.by_ratio(0.02, 0.2);
    let room = wander(draw, n, rate_hz, size, 200.0);
    for temperature in &mut stand.world.temperature {
        let (first, gain) = (temperature[0], draw.between(0.95, 1.05));
        for (t, (w, r)) in temperature.iter_mut().zip(warm.iter().zip(&room)) {
            *t = first + gain * (swing * (w - warm[0]) + r - room[0]);
        }
    }
}

/// A sheet under stress, of a housing or of a bimetal disc, snaps over at a temperature and back at a lower one
/// (Timoshenko 1925), a little after the thermometer: two places of the mount, by where the temperature last came from.
fn disc(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let sheet = lagged(
        &stand.world.temperature[axis],
        draw.by_ratio(0.3, 3.0),
        stand.rate_hz,
    );
    let (low, high) = extremes(&sheet);
    let at = |share: f64| low + share * (high - low);
    let (over, back) = (at(draw.between(0.5, 0.7)), at(draw.between(0.25, 0.45)));
    let mut place = 0.0;
    sheet
        .iter()
        .map(|t| {
            if *t > over {
                place = 1.0;
            } else if *t < back {
                place = 0.0;
            }
            place
        })
        .collect()
}

/// A regulator holds the part's supply until what is left above its output is less than it needs; only what is missing
/// beyond comes through. The loads are of many sizes, most of them harmless.
fn drop_out(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const MOST: f64 = 0.12;
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    let load = held(draw, n, rate_hz, (4.0, 25.0), |d| d.between(0.0, MOST));
    let slow = wander(draw, n, rate_hz, 0.001, 60.0);
    let needed = 5.0 - MOST * draw.between(0.4, 0.75);
    stand.world.supply = load.iter().zip(slow).map(|(l, s)| 5.0 - l - s).collect();
    let supply = &stand.world.supply;
    supply.iter().map(|u| (u - needed).min(0.0)).collect()
}

pub(super) fn about_mean(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|v| v - mean).collect()
}

/// Anisoelasticity (IEEE Std 528): along its two principal axes a suspension yields unequally, and the mass that has moved
/// along one is turned by the acceleration along the other. Its axes lie at a slant to the board's.
fn product(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (sin, cos) = draw.between(0.0, TAU).sin_cos();
    let [x, y, _] = &stand.world.acc;
    x.iter()
        .zip(y)
        .map(|(x, y)| sin * x * y + 0.5 * cos * (x * x - y * y))
        .collect()
}

/// A part with play in its mount is held by friction: only what an acceleration has beyond that moves it, and turns it.
fn play(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let force = about_mean(&stand.world.acc[draw.of_many(3)]);
    let rms = (force.iter().map(|a| a * a).sum::<f64>() / force.len() as f64).sqrt();
    let holds = rms * draw.between(0.8, 1.6);
    force
        .iter()
        .map(|a| a.signum() * (a.abs() - holds).max(0.0))
        .collect()
}

/// A piece of iron near the part keeps some of the field of the motor's last strong current, until one of the other sense
/// turns it over: the play operator, of which models of hysteresis are sums (Prandtl 1928). The motor moves in short
/// strokes.
fn iron(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let coercive = draw.between(0.2, 0.4);
    let (mut stroke, mut left, mut command) = (true, 0.0, 0.0);
    stand.world.duty = (0..stand.samples())
        .map(|_| {
            left -= 1.0 / stand.rate_hz;
            if left <= 0.0 {
                stroke = !stroke;
                (command, left) = if stroke {
                    (draw.sign() * draw.between(0.3, 1.0), draw.between(0.5, 3.0))
                } else {
                    (0.0, draw.between(5.0, 25.0))
                };
                command = (command * 255.0).round() / 255.0;
            }
            command
        })
        .collect();
    let mut kept = 0.0f64;
    stand
        .world
        .duty
        .iter()
        .map(|d| {
            kept = kept.clamp(d - coercive, d + coercive);
            kept
        })
        .collect()
}

/// Somebody works at the stand and touches it now and then: heat goes in, reaches the part through what it is mounted on, and leaves again;
/// two lags of one time constant answer by t exp(-t). The part's thermometer sits on the other side.
fn touches(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let decay = draw.by_ratio(1.0, 6.0);
    let mut y = vec![0.0; stand.samples()];
    for _ in 0..12 + draw.of_many(24) {
        let (at, size) = (
            draw.between(0.0, 0.97 * stand.seconds),
            draw.between(0.4, 1.5),
        );
        for (i, v) in y.iter_mut().enumerate() {
            let since = (i as f64 / stand.rate_hz - at).max(0.0) / decay;
            *v += size * since * (1.0 - since).exp();
        }
    }
    y
}

/// A loop that is barely unstable: its swing grows by itself out of the noise until its own amplitude shifts the working
/// point and stops it, and it begins again (an oscillator that squegs).
fn quenched(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (f, growth) = (draw.by_ratio(0.4, 8.0), draw.by_ratio(1.5, 8.0));
    let grows = (1.0 / (growth * stand.rate_hz)).exp();
    let mut size = draw.by_ratio(0.02, 1.0);
    let mut phase = draw.between(0.0, TAU);
    (0..stand.samples())
        .map(|_| {
            size *= grows;
            phase += TAU * f / stand.rate_hz;
            if size > 1.0 {
                size = draw.by_ratio(0.01, 0.1);
                phase = draw.between(0.0, TAU);
            }
            size * phase.sin()
        })
        .collect()
}

/// Something else on the same ground, a logger that writes or a radio that calls, draws a short current at every turn of
/// its own clock, which is not a multiple of the samples': lines without end, all of one size.
fn pulse(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (period, width) = (draw.by_ratio(1.5, 8.0), draw.between(1.0, 2.2));
    let first = draw.between(0.0, 1.0);
    let share = width / (period * stand.rate_hz);
    (0..stand.samples())
        .map(|i| {
            let turn = first + i as f64 / stand.rate_hz / period;
            f64::from(u8::from(turn.fract() < share))
        })
        .collect()
}

/// A loop that locks one clock to another finds two places to lock in and hops between them, keeping its phase: a tone at
/// one pitch or the other, each for a random time.
fn hopping(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let first = draw.between(0.5, 9.0);
    let second = loop {
        let f = first + draw.sign() * draw.by_ratio(0.3, 4.0);
        if (0.4..9.5).contains(&f) {
            break f;
        }
    };
    let pitches = [
        (first, draw.by_ratio(4.0, 20.0)),
        (second, draw.by_ratio(4.0, 20.0)),
    ];
    let (mut at, mut left, mut phase) = (draw.of_many(2), 0.0, draw.between(0.0, TAU));
    (0..stand.samples())
        .map(|_| {
            left -= 1.0 / stand.rate_hz;
            if left <= 0.0 {
                at = 1 - at;
                left = pitches[at].1 * draw.exponential();
            }
            phase += TAU * pitches[at].0 / stand.rate_hz;
            phase.sin()
        })
        .collect()
}
