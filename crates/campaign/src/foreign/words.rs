//! Words that the makers of foreign effects share: what drives the world of a stand, what follows it, and events.

use std::f64::consts::TAU;

use crate::random::Draw;
use crate::series::{about_mean, add_at, carry, changes, each, each_pair, ramped, swing};
use crate::stand::Stand;

/// How long a programme of rates stays at one, s.
pub(super) const DWELL: (f64, f64) = (3.0, 12.0);

/// A signal of time, s.
pub(super) fn in_time(stand: &Stand, mut of: impl FnMut(f64) -> f64) -> Vec<f64> {
    stand.series(|i| of(i as f64 / stand.rate_hz))
}

/// A series of either sign.
pub(super) fn either_way(draw: &mut Draw, series: &[f64]) -> Vec<f64> {
    let sign = draw.sign();
    each(series, |v| sign * v)
}

/// Independent draws of the normal law.
pub(crate) fn white(draw: &mut Draw, n: usize) -> Vec<f64> {
    (0..n).map(|_| draw.normal()).collect()
}

/// A rate, counts, that was read as this code: within its step it is anywhere.
pub(super) fn within_step(code: i32, draw: &mut Draw) -> f64 {
    f64::from(code) + draw.between(-0.5, 0.5)
}

/// A command as it can be given, in 255 steps.
pub(super) fn in_steps(command: f64) -> f64 {
    (command * 255.0).round() / 255.0
}

/// What a series does to a mode of this pitch and half width, Hz, from the sample after on.
pub(super) fn resonating(series: &[f64], mode: (f64, f64), rate_hz: f64) -> Vec<f64> {
    let keep = (-TAU * mode.1 / rate_hz).exp();
    let (sin, cos) = (TAU * mode.0 / rate_hz).sin_cos();
    let turned = |(push, moves): (f64, f64), v| {
        let push_next = keep * (cos * push - sin * moves) + v;
        (push_next, keep * (sin * push + cos * moves))
    };
    each(&carry((0.0, 0.0), series, turned), |(_, moves)| moves)
}

/// What follows a series, from 0, by many contacts, each after its own play and with its own weight.
pub(super) fn behind_plays(series: &[f64], contacts: &[(f64, f64)]) -> Vec<f64> {
    let mut held = vec![0.0f64; contacts.len()];
    each(series, |a| {
        let follow = |((play, weight), held): (&(f64, f64), &mut f64)| {
            *held = held.clamp(a - play, a + play);
            weight * *held
        };
        contacts.iter().zip(&mut held).map(follow).sum()
    })
}

/// A stretch of a phasor, from any state on, that turns by so many rad from reading to reading, keeps a share of itself and is
/// driven at random: the real part, of variance 1.
pub(crate) fn phasor(draw: &mut Draw, keep: f64, turns: impl Iterator<Item = f64>) -> Vec<f64> {
    let drive = (1.0 - keep * keep).sqrt();
    let (mut re, mut im) = (draw.normal(), draw.normal());
    turns
        .map(|turn| {
            let (sin, cos) = turn.sin_cos();
            (re, im) = (
                keep * (cos * re - sin * im) + drive * draw.normal(),
                keep * (sin * re + cos * im) + drive * draw.normal(),
            );
            re
        })
        .collect()
}

/// A swing whose phasor turns at a pitch and forgets itself as a Gauss-Markov process does: r^k cos(w k), variance 1.
#[derive(Clone, Copy)]
pub(super) struct Turning {
    keep: f64,
    turn: f64,
}

impl Turning {
    /// By pitch and half width, Hz.
    pub(super) fn new(pitch: f64, half_width: f64, rate_hz: f64) -> Self {
        Self {
            keep: (-TAU * half_width / rate_hz).exp(),
            turn: TAU * pitch / rate_hz,
        }
    }

    /// One of these ranges of pitch and half width, Hz.
    pub(super) fn any(
        draw: &mut Draw,
        stand: &Stand,
        pitch: (f64, f64),
        half_width: (f64, f64),
    ) -> Self {
        let pitch = draw.by_ratio(pitch.0, pitch.1);
        let half_width = draw.by_ratio(half_width.0, half_width.1);
        Self::new(pitch, half_width, stand.rate_hz)
    }

    /// Its density at an angular frequency, rad per sample; 1 in the mean.
    pub(super) fn density(&self, w: f64) -> f64 {
        let r = self.keep;
        let side = |w: f64| (1.0 - r * r) / (1.0 + r * r - 2.0 * r * w.cos());
        0.5 * (side(w - self.turn) + side(w + self.turn))
    }

    /// A stretch of it, from any state on.
    pub(super) fn of(&self, draw: &mut Draw, n: usize) -> Vec<f64> {
        phasor(draw, self.keep, std::iter::repeat_n(self.turn, n))
    }
}

/// A tone that begins at a phase, rad, and has these pitches, Hz.
pub(super) fn tone(phase: f64, pitches: &[f64], rate_hz: f64) -> Vec<f64> {
    let phases = carry(phase, pitches, |phase, pitch| phase + TAU * pitch / rate_hz);
    each(&phases, f64::sin)
}

/// An axis's temperature from that at which something of it was trimmed, near the middle of its range.
pub(super) fn from_trim(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    let temperature = about_mean(&stand.world.temperature[axis]);
    let trimmed = draw.between(-0.1, 0.1) * swing(&temperature);
    each(&temperature, |t| t - trimmed)
}

/// How much a series changes from so many samples before to so many after.
pub(super) fn pace(series: &[f64], half: usize) -> Vec<f64> {
    let last = series.len() - 1;
    let change = |i: usize| series[(i + half).min(last)] - series[i.saturating_sub(half)];
    (0..=last).map(change).collect()
}

/// A small heater on the board with a thermostat of short cycles: the temperatures it makes.
pub(super) fn cycles(draw: &mut Draw, stand: &mut Stand) {
    let (swing, on) = (draw.between(4.0, 10.0), draw.chance(0.5));
    let heater = stand.by_turns(draw, on, (8.0, 30.0), |_| 1.0);
    let warm = stand.lagged(&heater, draw.between(3.0, 9.0));
    let size = draw.by_ratio(0.02, 0.2);
    let room = stand.wander(draw, size, 200.0);
    for temperature in &mut stand.world.temperature {
        let (first, gain) = (temperature[0], draw.between(0.95, 1.05));
        *temperature = each_pair(&warm, &room, |w, r| {
            first + gain * (swing * (w - warm[0]) + r - room[0])
        });
    }
}

/// The temperatures that a lamp close by makes, which is switched on and off within seconds.
pub(super) fn lamp(draw: &mut Draw, stand: &mut Stand) {
    lit(draw, stand, (2.0, 14.0), (2.0, 6.0));
}

/// Those of one that is switched after so long and warms within so long, s.
pub(super) fn lit(draw: &mut Draw, stand: &mut Stand, dwell_s: (f64, f64), lag_s: (f64, f64)) {
    let (room, top) = (draw.between(20.0, 30.0), draw.between(3.0, 10.0));
    let mut on = draw.chance(0.5);
    let lamp = stand.held(draw, dwell_s, |d| {
        on = !on;
        room + if on { top * d.between(0.5, 1.0) } else { 0.0 }
    });
    let heat = stand.lagged(&lamp, draw.by_ratio(lag_s.0, lag_s.1));
    // Three parts on one board: nearly the same temperature.
    stand.world.temperature = std::array::from_fn(|_| {
        let off = draw.between(-0.5, 0.5);
        each(&heat, |t| t + off)
    });
}

/// A supply, which the stand gets, with loads of many sizes, up to one, V, each for a random time, s.
pub(super) fn loaded(draw: &mut Draw, stand: &mut Stand, most: f64, dwell_s: (f64, f64)) {
    let load = stand.held(draw, dwell_s, |d| d.between(0.0, most));
    let slow = stand.wander(draw, 0.001, 60.0);
    stand.world.supply = each_pair(&load, &slow, |l, s| 5.0 - l - s);
}

/// What the accelerometer along an axis reads of a force, g, which the stand gets.
pub(super) fn felt(draw: &mut Draw, stand: &mut Stand, along: usize, force: &[f64]) {
    let still = if along == 2 { 1.0 } else { 0.0 };
    stand.world.acc[along] = each(force, |a| still + a + 0.005 * draw.normal());
}

/// A swing of the bench that the accelerometer along one axis follows from sample to sample, of variance 1, with its size
/// there, g.
pub(super) fn shaken(draw: &mut Draw, stand: &mut Stand, pitch: (f64, f64)) -> Vec<f64> {
    let (along, rms) = (draw.of_many(3), draw.between(0.08, 0.3));
    let part = Turning::any(draw, stand, pitch, (0.05, 0.3));
    let shake = part.of(draw, stand.samples());
    felt(draw, stand, along, &each(&shake, |s| rms * s));
    shake
}

/// The acceleration along an axis, without what it is at rest, g.
pub(super) fn shaking(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    about_mean(&stand.world.acc[draw.of_many(3)])
}

/// Vibration along a level axis, told, that swells and fades.
pub(super) fn swelling(draw: &mut Draw, stand: &mut Stand) -> usize {
    const RAIL_G: f64 = 1.9;
    let (usual, tau) = (draw.by_ratio(0.1, 0.4), draw.by_ratio(10.0, 60.0));
    let swell = stand.wander(draw, 0.5, tau);
    let level = draw.of_many(2);
    stand.world.acc[level] = each(&swell, |s| {
        (usual * s.exp() * draw.normal()).clamp(-RAIL_G, RAIL_G)
    });
    level
}

/// Shocks that the accelerometers show, each a single reading: samples, and how hard, g.
pub(super) fn shocks(draw: &mut Draw, stand: &mut Stand) -> Vec<(usize, f64)> {
    let along = draw.of_many(2);
    let mut all = vec![];
    let mut at = draw.between(3.0, 12.0);
    while at < stand.seconds - 1.0 {
        let i = ((at * stand.rate_hz) as usize).min(stand.samples() - 1);
        let hard = draw.signed(0.5, 1.2);
        stand.world.acc[along][i] += hard;
        all.push((i, hard));
        at += 4.0 + 12.0 * draw.exponential();
    }
    all
}

/// Commands of a motor, which the stand gets, of either sense: a level between two, each for a random time, s.
pub(super) fn commanded(
    draw: &mut Draw,
    stand: &mut Stand,
    dwell_s: (f64, f64),
    (least, most): (f64, f64),
) {
    stand.world.duty = stand.held(draw, dwell_s, |d| in_steps(d.signed(least, most)));
}

/// The same of a motor that rests in between; it begins other than `turning`.
pub(super) fn strokes(
    draw: &mut Draw,
    stand: &mut Stand,
    turning: bool,
    (dwell_s, (least, most)): ((f64, f64), (f64, f64)),
) {
    let level = |d: &mut Draw| in_steps(d.signed(least, most));
    stand.world.duty = stand.by_turns(draw, turning, dwell_s, level);
}

/// The same up to full duty, whichever it begins with.
pub(super) fn with_rests(draw: &mut Draw, stand: &mut Stand, dwell_s: (f64, f64), least: f64) {
    let turning = draw.chance(0.5);
    strokes(draw, stand, turning, (dwell_s, (least, 1.0)));
}

/// Commands of a rate table's programme, which the stand gets: levels held for so long, s, slow ones more often than fast
/// ones, in either sense, and a rest now and then.
pub(super) fn programme(draw: &mut Draw, stand: &mut Stand, dwell_s: (f64, f64)) {
    const RESTS: f64 = 0.25;
    stand.world.duty = stand.held(draw, dwell_s, |d| {
        d.zero_or(RESTS, |d| in_steps((0.45 * d.normal()).clamp(-1.0, 1.0)))
    });
}

/// The table's rate over that at full duty: behind the command by the time that the motor takes to spin up.
pub(super) fn rate_of_table(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    stand.lagged(&stand.world.duty, draw.by_ratio(0.3, 1.5))
}

/// The rate of a table on a programme whose rates last so long, s.
pub(super) fn turned(draw: &mut Draw, stand: &mut Stand, dwell_s: (f64, f64)) -> Vec<f64> {
    programme(draw, stand, dwell_s);
    rate_of_table(draw, stand)
}

/// The rate of a table on a programme, whose drive ramps from rate to rate with one acceleration.
pub(super) fn ramped_table(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    ramped(&stand.world.duty, draw.by_ratio(0.15, 0.6), stand.rate_hz)
}

/// The angle that the table has turned by, rad, where its rate at full duty is so many turns per second.
pub(super) fn angle_of_table(rate: &[f64], full: f64, rate_hz: f64) -> Vec<f64> {
    carry(0.0, rate, |angle, r| angle + TAU * full * r / rate_hz)
}

/// How often each reading passes one of so many places of a turn, which lie at equal angles.
pub(super) fn passes(angle: &[f64], per_turn: f64, first: f64) -> Vec<f64> {
    let places = each(angle, |a| (a / TAU * per_turn + first).floor());
    each(&changes(&places), f64::abs)
}

/// Events of a record, s: at least so many, of so many numbers, the first after a tenth of it, and no two within a twentieth.
pub(super) fn events(draw: &mut Draw, stand: &Stand, least: usize, numbers: usize) -> Vec<f64> {
    let count = least + draw.of_many(numbers);
    let mut all: Vec<f64> = vec![];
    while all.len() < count {
        let at = stand.seconds * draw.between(0.1, 0.9);
        if all.iter().all(|a| (a - at).abs() > 0.05 * stand.seconds) {
            all.push(at);
        }
    }
    all
}

/// How large each of them is, of either sign.
pub(super) fn sizes(draw: &mut Draw, events: &[f64]) -> Vec<f64> {
    each(events, |_| draw.signed(0.5, 1.5))
}

/// What events add, by the time since each of them, s.
pub(super) fn since(stand: &Stand, events: &[f64], of: impl Fn(usize, f64) -> f64) -> Vec<f64> {
    in_time(stand, |t| {
        let one = |(k, at): (usize, &f64)| if t < *at { 0.0 } else { of(k, t - at) };
        events.iter().enumerate().map(one).sum()
    })
}

/// What is one thing after another, each for a while: `next` tells, by what it was, what comes and for how long, s.
pub(super) fn in_spells<A: Copy>(
    stand: &Stand,
    (mut now, mut left): (A, f64),
    mut next: impl FnMut(A) -> (A, f64),
) -> Vec<A> {
    stand.series(|_| {
        left -= 1.0 / stand.rate_hz;
        if left <= 0.0 {
            (now, left) = next(now);
        }
        now
    })
}

/// A signal of what comes now and then: `add` adds what comes at a time, s, and tells when the next one does.
pub(super) fn arriving(
    stand: &Stand,
    mut at: f64,
    mut add: impl FnMut(&mut [f64], f64) -> f64,
) -> Vec<f64> {
    let mut all = vec![0.0; stand.samples()];
    while at < stand.seconds {
        at = add(&mut all, at);
    }
    all
}

/// Adds a stroke, shared by the two readings that it lies between: its place, in readings, and its size.
pub(super) fn strike(y: &mut [f64], place: f64, size: f64) {
    let late = place.fract();
    add_at(
        y,
        place as usize,
        [1.0 - late, late].map(|part| part * size),
    );
}

/// Adds the ring, of a pitch, Hz, that decays in so many s, of a knock at a time, s; `end` decays later it is over.
pub(super) fn ring(
    y: &mut [f64],
    rate_hz: f64,
    (at, size): (f64, f64),
    (f, decay): (f64, f64),
    end: f64,
) {
    let first = (at * rate_hz).ceil() as usize;
    let since = (first..).map(|k| k as f64 / rate_hz - at);
    let rings = since.take_while(|since| *since <= end * decay);
    add_at(
        y,
        first,
        rings.map(|t| size * (-t / decay).exp() * (TAU * f * t).sin()),
    );
}
