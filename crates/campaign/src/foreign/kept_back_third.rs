//! Foreign effects kept back from the engine, third set (2026-11-21): written from the physics and mathematics named
//! here, by someone who had not read how the diagnosis decides. The tests of `library_share` hold that no effect of the
//! library describes them, nor, where they are signals, a sum of two.

use std::f64::consts::{PI, TAU};

use super::{Foreign, PLAIN, Set, extremes, of_signal};
use crate::motor::current;
use crate::random::Draw;
use crate::stand::{Needs, Stand, held, lagged, wander};

pub(super) mod noise;

/// Their names: seven that have a structure in time, then seven of noise and codes.
pub const NAMES: [&str; 14] = [
    "ring-down of a spring that stiffens",
    "teeth of a table over temperature",
    "acceleration that comes late",
    "supply by its changes alone",
    "heat of the motor that comes late",
    "two oscillators that pull each other",
    "beat of the motor's pulses",
    "dither that repeats itself",
    "noise with a hole in its spectrum",
    "noise that remembers its last size",
    "swing that leaves its square behind",
    "noise while the temperature moves",
    "hump of noise that moves with temperature",
    "two codes of the part in one",
];

/// The set.
pub(super) const SET: Set = Set {
    names: &NAMES,
    needs,
    one,
    ..PLAIN
};

/// Beyond what every foreign effect gets.
fn needs(name: &str) -> Needs {
    Needs {
        temperature: true,
        motor: true,
        supply: name == "supply by its changes alone",
        vibration: name == "acceleration that comes late",
    }
}

/// One of them; `None` for another name. The world of the stand may gain spells of its motor.
fn one(
    draw: &mut Draw,
    stand: &mut Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    let unit = match name {
        "ring-down of a spring that stiffens" => ring_down(draw, stand),
        "teeth of a table over temperature" => teeth(draw, stand, axis),
        "acceleration that comes late" => late(draw, stand),
        "supply by its changes alone" => changes_of_supply(draw, stand),
        "heat of the motor that comes late" => heat(draw, stand),
        "two oscillators that pull each other" => pulled(draw, stand),
        "beat of the motor's pulses" => beat(draw, stand),
        "dither that repeats itself" => dither(draw, stand),
        _ => return noise::one(draw, stand, name, axis, wanted),
    };
    Some(of_signal(stand, name, axis, &unit, wanted))
}

/// A part on a spring that stiffens as it bends (Duffing 1918): x'' = -2x'/decay - w^2 (x + x^3), knocked a few times in a
/// run. Large swings are faster than small ones, so each knock starts high and its pitch falls while it fades.
fn ring_down(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    const PARTS: usize = 16;
    let h = 1.0 / stand.rate_hz / PARTS as f64;
    let (w, decay) = (TAU * draw.by_ratio(0.5, 3.0), draw.by_ratio(8.0, 40.0));
    let apart = draw.between(40.0, 120.0);
    let (mut x, mut speed) = (0.0, 0.0);
    let mut left = draw.between(5.0, 40.0);
    (0..stand.samples())
        .map(|_| {
            left -= 1.0 / stand.rate_hz;
            if left <= 0.0 {
                speed += w * draw.sign() * draw.between(1.0, 2.5);
                left = apart * draw.between(0.5, 1.5);
            }
            // Half a step of speed, a step of place, half a step of speed.
            for _ in 0..PARTS {
                let pull = |x: f64, v: f64| -2.0 * v / decay - w * w * (x + x.powi(3));
                speed += 0.5 * h * pull(x, speed);
                x += h * speed;
                speed += 0.5 * h * pull(x, speed);
            }
            x
        })
        .collect()
}

/// A part that compensates its temperature by a table that it reads without interpolating: between two entries the rate
/// runs off by the slope that is left, at the next entry it is put right.
fn teeth(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    let temperature = &stand.world.temperature[axis];
    let (low, high) = extremes(temperature);
    let entry = (high - low).max(1e-9) / draw.between(4.0, 10.0);
    let first = draw.between(0.0, 1.0);
    temperature
        .iter()
        .map(|t| ((t - low) / entry + first).fract() - 0.5)
        .collect()
}

/// Sensitivity to an acceleration that the frames show earlier: the rate passes the part's digital filter, which delays
/// it by some samples and smooths it, the accelerometer is read at once. Of a vibration the value of now tells nothing
/// about that of then.
fn late(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (after, from) = (1 + draw.of_many(5), draw.of_many(3));
    let smoothed = lagged(
        &stand.world.acc[from],
        draw.by_ratio(0.02, 0.15),
        stand.rate_hz,
    );
    (0..stand.samples())
        .map(|i| smoothed[i.saturating_sub(after)])
        .collect()
}

/// A regulator holds the rate against a constant supply, but lets each step of the load through until its loop has
/// settled: the supply less what it has followed.
fn changes_of_supply(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let supply = &stand.world.supply;
    let followed = lagged(supply, draw.by_ratio(0.3, 4.0), stand.rate_hz);
    supply.iter().zip(followed).map(|(u, f)| u - f).collect()
}

/// The heat of the motor's driver, current squared, reaches the part through the driver's case and the board, seconds after
/// the command and whatever its sign, as a strain that the part's own thermometer does not show. The motor runs in spells
/// of its own; where the supply sags, it does so by another load.
fn heat(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let mut on = true;
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    stand.world.duty = held(draw, n, rate_hz, (3.0, 20.0), |d| {
        on = !on;
        let command = d.sign() * d.between(0.4, 1.0);
        f64::from(u8::from(on)) * (command * 255.0).round() / 255.0
    });
    let warm: Vec<f64> = current(draw, &stand.world.duty, rate_hz)
        .iter()
        .map(|i| i * i)
        .collect();
    let case = lagged(&warm, draw.by_ratio(0.5, 2.0), rate_hz);
    lagged(&case, draw.by_ratio(1.0, 4.0), rate_hz)
}

/// Drives of two gyros on one board pull each other (Adler 1946): phase' = detuning - pull sin(phase). Nearly in step, the
/// phase creeps through a narrow place and then slips by a turn; as the detuning wanders it also stays locked for a
/// while. The rate sees sin(phase).
fn pulled(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    const PARTS: usize = 8;
    let h = 1.0 / stand.rate_hz / PARTS as f64;
    let pull = TAU * draw.by_ratio(0.15, 1.0);
    let (middle, swing) = (draw.between(1.0, 1.3), draw.between(0.1, 0.3));
    let memory = draw.by_ratio(8.0, 40.0);
    let detuning = wander(draw, stand.samples(), stand.rate_hz, swing, memory);
    let mut phase = draw.between(0.0, TAU);
    detuning
        .iter()
        .map(|d| {
            for _ in 0..PARTS {
                phase += h * pull * (middle + d - phase.sin());
            }
            phase.sin()
        })
        .collect()
}

/// A harmonic of the motor's pulses, folded by the sampling. Its size is that of a pulse train, sin(pi harmonic duty), so
/// it comes and goes with the command and vanishes at some; its pitch is the difference of two clocks that are not the
/// same, RC oscillators that wander.
fn beat(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    // The bridge needs its dead time: full duty is never reached.
    const FULL: f64 = 0.93;
    let harmonic = (1 + draw.of_many(3)) as f64;
    let middle = draw.between(1.5, 8.5);
    let (swing, memory) = (draw.by_ratio(0.05, 0.4), draw.by_ratio(3.0, 20.0));
    let off = wander(draw, stand.samples(), stand.rate_hz, swing, memory);
    let mut phase = draw.between(0.0, TAU);
    stand
        .world
        .duty
        .iter()
        .zip(off)
        .map(|(duty, off)| {
            phase += TAU * (middle + off) / stand.rate_hz;
            (PI * harmonic * FULL * duty).sin() * phase.sin()
        })
        .collect()
}

/// A shift register with feedback, x^order + x^tap + 1 over two elements: bits that look random and come again after
/// 2^order - 1 of them, if the polynomial is primitive.
pub(super) struct Register {
    order: u32,
    tap: u32,
    state: u32,
}

/// Primitive polynomials.
pub(super) const PRIMITIVE: [(u32, u32); 3] = [(5, 2), (6, 1), (7, 1)];

impl Register {
    /// From a state other than zero.
    pub(super) fn new((order, tap): (u32, u32), state: u32) -> Self {
        Self { order, tap, state }
    }

    pub(super) fn next(&mut self) -> bool {
        let bit = (self.state ^ (self.state >> self.tap)) & 1;
        let out = self.state & 1 == 1;
        self.state = (self.state >> 1) | (bit << (self.order - 1));
        out
    }
}

/// A converter dithers its input by a shift register and does not take all of it off again: the same 31, 63 or 127 levels
/// over and over, spread over as many weak lines as the sequence is long.
fn dither(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let polynomial = PRIMITIVE[draw.of_many(PRIMITIVE.len())];
    let state = 1 + draw.of_many((1 << polynomial.0) - 1) as u32;
    let (mut register, hold) = (Register::new(polynomial, state), 1 + draw.of_many(2));
    let mut level = 0.0;
    (0..stand.samples())
        .map(|i| {
            if i % hold == 0 {
                level = if register.next() { 1.0 } else { -1.0 };
            }
            level
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_register_visits_every_state_but_zero_before_it_repeats() {
        for polynomial in PRIMITIVE {
            let length = (1usize << polynomial.0) - 1;
            let mut register = Register::new(polynomial, 1);
            let bits: Vec<bool> = (0..2 * length).map(|_| register.next()).collect();
            assert_eq!(bits[..length], bits[length..]);
            // One more one than zeros, and no shift of it fits but the whole: the period is not a part of its length.
            assert_eq!(
                bits[..length].iter().filter(|b| **b).count(),
                length / 2 + 1
            );
            for shift in 1..length {
                let equal = (0..length).filter(|i| bits[*i] == bits[i + shift]).count();
                assert_eq!(equal, length / 2, "{polynomial:?} shifted by {shift}");
            }
        }
    }

    #[test]
    fn a_stiff_spring_swings_faster_the_further_it_swings() {
        let draw = &mut Draw::of(20_261_121, 12, 0);
        let stand = Stand::draw(draw, 600.0, 20.0, Needs::default());
        for _ in 0..5 {
            let x = ring_down(draw, &stand);
            let n = x.len();
            let most = x.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            assert!(
                most < 3.0 && x[n / 4..].iter().any(|v| v.abs() > 0.05),
                "{most}"
            );
            // Half swings between zeros, by the height they reach: the higher third is shorter than the lower.
            let (mut swings, mut since, mut height) = (vec![], 0usize, 0.0f64);
            for w in x.windows(2) {
                since += 1;
                height = height.max(w[1].abs());
                if w[0] * w[1] < 0.0 {
                    swings.push((height, since as f64));
                    (since, height) = (0, 0.0);
                }
            }
            swings.sort_by(|a, b| a.0.total_cmp(&b.0));
            let third = swings.len() / 3;
            let mean = |of: &[(f64, f64)]| of.iter().map(|s| s.1).sum::<f64>() / of.len() as f64;
            let (low, high) = (mean(&swings[..third]), mean(&swings[2 * third..]));
            assert!(third > 10 && high < low, "{high} against {low} samples");
        }
    }
}
