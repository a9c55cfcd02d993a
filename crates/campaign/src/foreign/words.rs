//! Words that the makers of foreign effects share: what drives the world of a stand, what follows it, and events.

use std::f64::consts::TAU;

use crate::random::Draw;
use crate::stand::Stand;

/// What is made of each value of a series.
pub(super) fn each<A: Copy, B>(values: &[A], of: impl FnMut(A) -> B) -> Vec<B> {
    values.iter().copied().map(of).collect()
}

/// What is made of each value of a series and the one beside it in another.
pub(super) fn each_pair<A: Copy, B: Copy, C>(
    values: &[A],
    others: &[B],
    mut of: impl FnMut(A, B) -> C,
) -> Vec<C> {
    let pairs = values.iter().zip(others);
    pairs.map(|(value, other)| of(*value, *other)).collect()
}

/// Least and largest of some values.
pub(super) fn extremes(values: &[f64]) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| {
            (l.min(v), h.max(v))
        })
}

/// How far the largest is from the least.
pub(super) fn swing(values: &[f64]) -> f64 {
    let (low, high) = extremes(values);
    high - low
}

/// How long a programme of rates stays at one, s.
pub(super) const DWELL: (f64, f64) = (3.0, 12.0);

/// A swing of the bench that the accelerometer along one axis follows from sample to sample, of variance 1, with its size
/// there, g.
pub(super) fn shaken(draw: &mut Draw, stand: &mut Stand, pitch: (f64, f64)) -> Vec<f64> {
    let (along, rms) = (draw.of_many(3), draw.between(0.08, 0.3));
    let part = Turning::new(
        draw.by_ratio(pitch.0, pitch.1),
        draw.by_ratio(0.05, 0.3),
        stand.rate_hz,
    );
    let shake = part.of(draw, stand.samples());
    felt(draw, stand, along, &each(&shake, |s| rms * s));
    shake
}

/// What the accelerometer along an axis reads of a force, g, which the stand gets.
pub(super) fn felt(draw: &mut Draw, stand: &mut Stand, along: usize, force: &[f64]) {
    let still = if along == 2 { 1.0 } else { 0.0 };
    stand.world.acc[along] = each(force, |a| still + a + 0.005 * draw.normal());
}

/// A rate, counts, that was read as this code: within its step it is anywhere.
pub(super) fn within_step(code: i32, draw: &mut Draw) -> f64 {
    f64::from(code) + draw.between(-0.5, 0.5)
}

/// What follows a command no faster than so much a second.
pub(super) fn ramped(command: &[f64], most_per_s: f64, rate_hz: f64) -> Vec<f64> {
    let most = most_per_s / rate_hz;
    let mut follows = command.first().copied().unwrap_or(0.0);
    each(command, |c| {
        follows += (c - follows).clamp(-most, most);
        follows
    })
}

/// Change since the sample before.
pub(super) fn changes(series: &[f64]) -> Vec<f64> {
    let mut last = series.first().copied().unwrap_or(0.0);
    each(series, |v| v - std::mem::replace(&mut last, v))
}

/// What a series adds to a store that leaks with a time constant, s.
pub(super) fn leaking(series: &[f64], leaks_s: f64, rate_hz: f64) -> Vec<f64> {
    let keep = (-1.0 / (leaks_s * rate_hz)).exp();
    let mut left = 0.0;
    each(series, |v| {
        left = keep * left + v;
        left
    })
}

/// An axis's temperature from that at which something of it was trimmed, near the middle of its range.
pub(super) fn from_trim(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    let temperature = about_mean(&stand.world.temperature[axis]);
    let trimmed = draw.between(-0.1, 0.1) * swing(&temperature);
    each(&temperature, |t| t - trimmed)
}

/// A small heater on the board with a thermostat of short cycles: the temperatures it makes.
pub(super) fn cycles(draw: &mut Draw, stand: &mut Stand) {
    let (swing, on) = (draw.between(4.0, 10.0), draw.chance(0.5));
    let heater = by_turns(draw, stand, on, (8.0, 30.0), |_| 1.0);
    let warm = stand.lagged(&heater, draw.between(3.0, 9.0));
    let size = draw.by_ratio(0.02, 0.2);
    let room = stand.wander(draw, size, 200.0);
    for temperature in &mut stand.world.temperature {
        let (first, gain) = (temperature[0], draw.between(0.95, 1.05));
        for (t, (w, r)) in temperature.iter_mut().zip(warm.iter().zip(&room)) {
            *t = first + gain * (swing * (w - warm[0]) + r - room[0]);
        }
    }
}

pub(super) fn about_mean(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    each(values, |v| v - mean)
}

/// A signal of time, s.
pub(super) fn in_time(stand: &Stand, mut of: impl FnMut(f64) -> f64) -> Vec<f64> {
    stand.series(|i| of(i as f64 / stand.rate_hz))
}

/// Commands of a motor, which the stand gets, of either sense: a level between two, each for a random time, s.
pub(super) fn commanded(
    draw: &mut Draw,
    stand: &mut Stand,
    dwell_s: (f64, f64),
    (least, most): (f64, f64),
) {
    stand.world.duty = stand.held(draw, dwell_s, |d| {
        in_steps(d.sign() * d.between(least, most))
    });
}

/// The same of a motor that rests in between; it begins other than `turning`.
pub(super) fn strokes(
    draw: &mut Draw,
    stand: &mut Stand,
    turning: bool,
    (dwell_s, (least, most)): ((f64, f64), (f64, f64)),
) {
    stand.world.duty = by_turns(draw, stand, turning, dwell_s, |d| {
        in_steps(d.sign() * d.between(least, most))
    });
}

/// The same up to full duty, whichever it begins with.
pub(super) fn with_rests(draw: &mut Draw, stand: &mut Stand, dwell_s: (f64, f64), least: f64) {
    let turning = draw.chance(0.5);
    strokes(draw, stand, turning, (dwell_s, (least, 1.0)));
}

/// What a series does to a mode of this pitch and half width, Hz, from the sample after on.
pub(super) fn resonating(
    series: &[f64],
    (pitch, half_width): (f64, f64),
    rate_hz: f64,
) -> Vec<f64> {
    let keep = (-TAU * half_width / rate_hz).exp();
    let (sin, cos) = (TAU * pitch / rate_hz).sin_cos();
    let (mut push, mut moves) = (0.0, 0.0);
    each(series, |v| {
        (push, moves) = (
            keep * (cos * push - sin * moves) + v,
            keep * (sin * push + cos * moves),
        );
        moves
    })
}

/// The acceleration along an axis, without what it is at rest, g.
pub(super) fn shaking(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    about_mean(&stand.world.acc[draw.of_many(3)])
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

/// What is left of a series when the straight line in another is taken off.
pub(super) fn without_line(y: &[f64], x: &[f64]) -> Vec<f64> {
    let n = y.len() as f64;
    let (my, mx) = (y.iter().sum::<f64>() / n, x.iter().sum::<f64>() / n);
    let (mut xy, mut xx) = (0.0, 0.0);
    for (y, x) in y.iter().zip(x) {
        xy += (y - my) * (x - mx);
        xx += (x - mx).powi(2);
    }
    let slope = if xx > 0.0 { xy / xx } else { 0.0 };
    each_pair(y, x, |y, x| y - my - slope * (x - mx))
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

/// A swing whose phasor turns at a pitch and forgets itself as a Gauss-Markov process does: r^k cos(w k), variance 1.
#[derive(Clone, Copy)]
pub(super) struct Turning {
    keep: f64,
    turn: f64,
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

impl Turning {
    /// By pitch and half width, Hz.
    pub(super) fn new(pitch: f64, half_width: f64, rate_hz: f64) -> Self {
        Self {
            keep: (-TAU * half_width / rate_hz).exp(),
            turn: TAU * pitch / rate_hz,
        }
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

pub(super) fn in_steps(command: f64) -> f64 {
    (command * 255.0).round() / 255.0
}

/// Shocks that the accelerometers show, each a single reading: samples, and how hard, g.
pub(super) fn shocks(draw: &mut Draw, stand: &mut Stand) -> Vec<(usize, f64)> {
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    let along = draw.of_many(2);
    let mut all = vec![];
    let mut at = draw.between(3.0, 12.0);
    while at < stand.seconds - 1.0 {
        let (i, hard) = (
            ((at * rate_hz) as usize).min(n - 1),
            draw.sign() * draw.between(0.5, 1.2),
        );
        stand.world.acc[along][i] += hard;
        all.push((i, hard));
        at += 4.0 + 12.0 * draw.exponential();
    }
    all
}

/// Commands of a rate table's programme, which the stand gets: levels held for so long, s, slow ones more often than fast
/// ones, in either sense, and a rest now and then.
pub(super) fn programme(draw: &mut Draw, stand: &mut Stand, dwell_s: (f64, f64)) {
    const RESTS: f64 = 0.25;
    stand.world.duty = stand.held(draw, dwell_s, |d| {
        if d.chance(RESTS) {
            0.0
        } else {
            in_steps((0.45 * d.normal()).clamp(-1.0, 1.0))
        }
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

/// The angle that the table has turned by, rad, where its rate at full duty is so many turns per second.
pub(super) fn angle_of_table(rate: &[f64], full: f64, rate_hz: f64) -> Vec<f64> {
    let mut angle = 0.0;
    each(rate, |r| {
        angle += TAU * full * r / rate_hz;
        angle
    })
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

/// Events of a record, s: `count` of them, the first after a tenth of it, and no two within a twentieth.
pub(super) fn events(draw: &mut Draw, stand: &Stand, count: usize) -> Vec<f64> {
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
    each(events, |_| draw.sign() * draw.between(0.5, 1.5))
}

/// What events add, by the time since each of them, s.
pub(super) fn since(stand: &Stand, events: &[f64], of: impl Fn(usize, f64) -> f64) -> Vec<f64> {
    stand.series(|i| {
        let t = i as f64 / stand.rate_hz;
        let one = |(k, at): (usize, &f64)| if t < *at { 0.0 } else { of(k, t - at) };
        events.iter().enumerate().map(one).sum()
    })
}

/// How often each reading passes one of so many places of a turn, which lie at equal angles.
pub(super) fn passes(angle: &[f64], per_turn: f64, first: f64) -> Vec<f64> {
    let places: Vec<f64> = each(angle, |a| (a / TAU * per_turn + first).floor());
    each(&changes(&places), |c| c.abs())
}

/// 1 where something is so, 0 where it is not.
pub(super) fn one_if(so: bool) -> f64 {
    f64::from(u8::from(so))
}

/// What is on and off by turns, each for a random time, s: of a size each time, and 0 while it is off. It begins other than
/// `on`.
pub(super) fn by_turns(
    draw: &mut Draw,
    stand: &Stand,
    mut on: bool,
    dwell_s: (f64, f64),
    mut size: impl FnMut(&mut Draw) -> f64,
) -> Vec<f64> {
    stand.held(draw, dwell_s, |d| {
        on = !on;
        one_if(on) * size(d)
    })
}

/// A series of either sign.
pub(super) fn either_way(draw: &mut Draw, series: &[f64]) -> Vec<f64> {
    let sign = draw.sign();
    each(series, |v| sign * v)
}

/// A tone that begins at a phase, rad, and has these pitches, Hz.
pub(super) fn tone(mut phase: f64, pitches: &[f64], rate_hz: f64) -> Vec<f64> {
    each(pitches, |pitch| {
        phase += TAU * pitch / rate_hz;
        phase.sin()
    })
}

/// How much a temperature changes from so many samples before to so many after.
pub(super) fn pace(temperature: &[f64], half: usize) -> Vec<f64> {
    let last = temperature.len() - 1;
    let change = |i: usize| temperature[(i + half).min(last)] - temperature[i.saturating_sub(half)];
    (0..=last).map(change).collect()
}

/// Where each value is between the least, 0, and the largest, 1.
pub(super) fn within_range(values: &[f64]) -> Vec<f64> {
    let (low, high) = extremes(values);
    each(values, |v| (v - low) / (high - low).max(1e-9))
}

/// Mean square of a series.
pub(super) fn mean_square(series: &[f64]) -> f64 {
    series.iter().map(|v| v * v).sum::<f64>() / series.len() as f64
}

/// A supply, which the stand gets, with loads of many sizes, up to one, V, each for a random time, s.
pub(super) fn loaded(draw: &mut Draw, stand: &mut Stand, most: f64, dwell_s: (f64, f64)) {
    let load = stand.held(draw, dwell_s, |d| d.between(0.0, most));
    let slow = stand.wander(draw, 0.001, 60.0);
    stand.world.supply = each_pair(&load, &slow, |l, s| 5.0 - l - s);
}

/// The rate of a table on a programme, whose drive ramps from rate to rate with one acceleration.
pub(super) fn ramped_table(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    ramped(&stand.world.duty, draw.by_ratio(0.15, 0.6), stand.rate_hz)
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

/// Adds the ring, of a pitch, Hz, that decays in so many s, of a knock at a time, s; `end` decays later it is over.
pub(super) fn ring(
    y: &mut [f64],
    rate_hz: f64,
    (at, size): (f64, f64),
    (f, decay): (f64, f64),
    end: f64,
) {
    let first = (at * rate_hz).ceil() as usize;
    for (k, v) in y.iter_mut().enumerate().skip(first) {
        let since = k as f64 / rate_hz - at;
        if since > end * decay {
            break;
        }
        *v += size * (-since / decay).exp() * (TAU * f * since).sin();
    }
}

/// Independent draws of the normal law.
pub(super) fn white(draw: &mut Draw, n: usize) -> Vec<f64> {
    (0..n).map(|_| draw.normal()).collect()
}
