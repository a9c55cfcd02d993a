//! Foreign effects kept back from the engine, ninth set (2026-11-22): twenty as an outside examiner of the field would
//! write them. Some seventy ideas were listed from the causes of docs/effects.md before the names of the earlier sets were
//! read; nearly all of them were an earlier one, or a case of the library. What was left (four) was filled up with others,
//! by then with those names and the report's words on what a name has to hold in sight. None was diagnosed while they were
//! written, and the engine's code was not read. The tests of `library_share` hold that no effect of the library describes
//! them, nor, where they are signals, a sum of two.

use std::f64::consts::TAU;

use super::kept_back_fourth::{about_mean, cycles};
use super::{Foreign, PLAIN, Set, extremes, of_signal};
use crate::random::Draw;
use crate::stand::{Needs, Stand, held, wander};

pub(super) mod codes;
pub(super) mod noise;

/// Their names: five that have a structure in time of their own, six that follow a recorded channel, two of noise, three
/// that couple axes and four of codes.
pub const NAMES: [&str; 20] = [
    "tone whose pitch sways",
    "siren that drives past",
    "message in two-phase code",
    "iron that crackles",
    "knocks that a long pipe draws apart",
    "contact that chatters while the motor turns",
    "motor that sticks until it is pushed enough",
    "supply behind a diode",
    "mode that the acceleration drives",
    "contact that opens beyond an acceleration",
    "tone of a bridge that warmth unbalances",
    "noise that leans the way the motor turns",
    "noise that a swing to one side leaves louder",
    "another axis through a resonance",
    "gain that another axis turns",
    "diode between two axes",
    "low bits that a latch keeps",
    "differences sent in few levels",
    "code taken for a fault",
    "gaps bridged by straight lines",
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

/// Causes of the library that are a true part of it: the straight line through a threshold or a diode, the
/// far readings of a law with a tail, and the reading before in place of a code.
fn parts(name: &str) -> &'static [&'static str] {
    match name {
        "motor that sticks until it is pushed enough" => &["motor_bias"],
        "supply behind a diode" => &["supply_sensitivity"],
        "contact that opens beyond an acceleration" => &["g_sensitivity"],
        "diode between two axes" => &["cross_axis"],
        "noise that leans the way the motor turns" => &["outliers"],
        "code taken for a fault" => &["stale_samples"],
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
        "tone whose pitch sways" => swaying(draw, stand),
        "siren that drives past" => siren(draw, stand),
        "message in two-phase code" => message(draw, stand),
        "iron that crackles" => crackle(draw, stand),
        "knocks that a long pipe draws apart" => pipe(draw, stand),
        "contact that chatters while the motor turns" => chatter(draw, stand),
        "motor that sticks until it is pushed enough" => sticking(draw, stand),
        "supply behind a diode" => behind_diode(draw, stand),
        "mode that the acceleration drives" => driven(draw, stand),
        "contact that opens beyond an acceleration" => opens(draw, stand),
        "tone of a bridge that warmth unbalances" => bridge(draw, stand, axis),
        _ => {
            return noise::one(draw, stand, name, wanted)
                .or_else(|| codes::one(draw, stand, name, axis, wanted));
        }
    };
    Some(of_signal(stand, name, axis, &unit, wanted))
}

/// A signal of time, s.
pub(super) fn in_time(stand: &Stand, of: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..stand.samples())
        .map(|i| of(i as f64 / stand.rate_hz))
        .collect()
}

/// A fan whose control loop hunts: its pitch sways about the mean with a period, far enough that the tone has many side
/// bands and hardly a carrier.
fn swaying(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (sway, index) = (draw.by_ratio(0.02, 0.15), draw.between(4.0, 12.0));
    let reach = sway * index;
    let pitch = draw.between(reach + 0.5, 9.5 - reach);
    let (first, start) = (draw.between(0.0, TAU), draw.between(0.0, TAU));
    in_time(stand, |t| {
        (first + TAU * pitch * t + index * (start + TAU * sway * t).sin()).sin()
    })
}

/// A source that drives past at an even pace: its loudness goes as one over its distance, its pitch falls as it passes
/// (Doppler 1842), and the next one comes at random. The tone itself is far above the samples' rate.
fn siren(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let fall = draw.by_ratio(0.2, 2.0);
    let apart = draw.by_ratio(15.0, 50.0);
    let mut all = vec![];
    let mut at = apart * draw.exponential();
    while at < stand.seconds {
        let pitch = draw.between(fall + 0.5, 9.5 - fall);
        all.push((at, pitch, draw.by_ratio(0.6, 3.0), draw.between(0.0, TAU)));
        at += apart * (0.3 + draw.exponential());
    }
    in_time(stand, |t| {
        let of = |(at, pitch, pace, first): &(f64, f64, f64, f64)| {
            let distance = 1.0f64.hypot((t - at) / pace);
            let turns = pitch * (t - at) - fall * pace * distance;
            (first + TAU * turns).sin() / distance
        };
        all.iter().map(of).sum()
    })
}

/// A bus beside the part whose bits are a step up or a step down in their middle (Manchester code), so that it has no
/// mean: two levels, neither of which lasts longer than a bit.
fn message(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let half = draw.by_ratio(0.1, 0.9);
    let (mut level, mut first) = (1.0, false);
    held(draw, stand.samples(), stand.rate_hz, (half, half), |d| {
        first = !first;
        level = if first { d.sign() } else { -level };
        level
    })
}

/// Shortest and longest avalanche, s.
const AVALANCHES: (f64, f64) = (0.1, 4.0);

/// Iron that is slowly magnetised gives way in avalanches (Barkhausen 1919): of the mean field, durations by the power -2,
/// each a parabola as high as it is long (Sethna, Dahmen and Myers 2001), in either sense.
fn crackle(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (least, most) = AVALANCHES;
    let apart = draw.by_ratio(0.5, 3.0);
    let mut signal = vec![0.0; stand.samples()];
    let mut at = apart * draw.exponential();
    while at < stand.seconds {
        let long = 1.0 / draw.between(1.0 / most, 1.0 / least);
        let sign = draw.sign();
        let from = (at * stand.rate_hz).ceil() as usize;
        let to = ((at + long) * stand.rate_hz).ceil() as usize;
        for (i, v) in signal.iter_mut().enumerate().take(to).skip(from) {
            let part = (i as f64 / stand.rate_hz - at) / long;
            *v += sign * long * 4.0 * part * (1.0 - part);
        }
        at += long + apart * draw.exponential();
    }
    signal
}

/// What passes a chain of all-pass filters of this pole: every pitch as loud as before, each with a delay of its own.
fn dispersed(series: &[f64], stages: usize, pole: f64) -> Vec<f64> {
    let mut all = series.to_vec();
    for _ in 0..stages {
        let (mut last, mut out) = (0.0, 0.0);
        for v in &mut all {
            out = last - pole * *v + pole * out;
            last = *v;
            *v = out;
        }
    }
    all
}

/// Knocks on a long pipe, in which bending waves of high pitch run ahead of low ones, or the other way round: each arrives
/// as a whistle whose pitch slides, and all of them together are as white as a knock.
fn pipe(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let apart = draw.by_ratio(6.0, 25.0);
    let (stages, pole) = (8 + draw.of_many(13), draw.sign() * draw.between(0.4, 0.7));
    let mut knocks = vec![0.0; stand.samples()];
    let mut at = apart * draw.exponential();
    while at < stand.seconds {
        let size = draw.sign() * draw.between(0.5, 1.5);
        knocks[(at * stand.rate_hz) as usize] += size;
        at += apart * (0.1 + draw.exponential());
    }
    dispersed(&knocks, stages, pole)
}

/// Commands of a motor that rests in between.
fn with_rests(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let mut turning = draw.chance(0.5);
    held(draw, stand.samples(), stand.rate_hz, (3.0, 12.0), |d| {
        turning = !turning;
        let command = d.sign() * d.between(0.3, 1.0);
        f64::from(u8::from(turning)) * (command * 255.0).round() / 255.0
    })
}

/// Two brushes carry the current at rest; while the motor turns now one lifts and now the other, none for long.
fn chatter(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    stand.world.duty = with_rests(draw, stand);
    let dwell = draw.by_ratio(0.15, 0.5);
    let mut lifted = 1.0;
    let brush = held(
        draw,
        stand.samples(),
        stand.rate_hz,
        (0.5 * dwell, 1.5 * dwell),
        |_| {
            lifted = -lifted;
            lifted
        },
    );
    let turns = |(b, d): (&f64, &f64)| if *d == 0.0 { 0.0 } else { *b };
    brush.iter().zip(&stand.world.duty).map(turns).collect()
}

/// A motor on a governor, whose gear sticks: it starts where the command is beyond one threshold, then runs at its own
/// speed, and stops below a lower one. What it does to the rate follows that it runs, and which way.
fn sticking(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let tau = draw.by_ratio(1.5, 5.0);
    let command = wander(draw, stand.samples(), stand.rate_hz, 0.45, tau);
    stand.world.duty = command
        .iter()
        .map(|d| (d.clamp(-1.0, 1.0) * 255.0).round() / 255.0)
        .collect();
    let starts = draw.between(0.45, 0.7);
    let stops = starts * draw.between(0.2, 0.5);
    let (sign, mut runs) = (draw.sign(), 0.0);
    let duty = stand.world.duty.iter();
    duty.map(|d| {
        if d.abs() > starts {
            runs = d.signum();
        } else if d * runs < stops {
            runs = 0.0;
        }
        sign * runs
    })
    .collect()
}

/// A capacitor behind a diode: the reference follows the supply up at once, and sinks slowly towards it when it falls.
fn behind_diode(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (rms, tau) = (draw.between(0.015, 0.04), draw.by_ratio(0.4, 2.0));
    let load = wander(draw, stand.samples(), stand.rate_hz, rms, tau);
    stand.world.supply = load.iter().map(|l| 5.0 + l).collect();
    let sinks = 1.0 - (-1.0 / (tau * draw.between(3.0, 8.0) * stand.rate_hz)).exp();
    let mut kept = load[0];
    let behind: Vec<f64> = load
        .iter()
        .map(|u| {
            kept = u.max(kept + sinks * (u - kept));
            kept
        })
        .collect();
    about_mean(&behind)
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
    series
        .iter()
        .map(|v| {
            (push, moves) = (
                keep * (cos * push - sin * moves) + v,
                keep * (sin * push + cos * moves),
            );
            moves
        })
        .collect()
}

/// The acceleration along an axis, without what it is at rest, g.
fn shaking(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    about_mean(&stand.world.acc[draw.of_many(3)])
}

/// A part on a spring that the accelerometer does not have: what the acceleration does to it rings on at a pitch of its
/// own.
fn driven(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let mode = (draw.by_ratio(0.8, 8.5), draw.by_ratio(0.05, 0.3));
    resonating(&shaking(draw, stand), mode, stand.rate_hz)
}

/// A contact under a spring: closed until the acceleration is beyond a limit in one sense, then open, however far it goes.
fn opens(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let shake = shaking(draw, stand);
    let rms = (shake.iter().map(|a| a * a).sum::<f64>() / shake.len() as f64).sqrt();
    let (limit, sign) = (draw.between(0.7, 1.4) * rms, draw.sign());
    let open = |a: &f64| f64::from(u8::from(sign * a > limit));
    about_mean(&shake.iter().map(open).collect::<Vec<f64>>())
}

/// A bridge that is fed with alternating current and balanced at one temperature: what comes out is a tone as large as the
/// temperature is off it, whose phase turns over there. The heater has a thermostat.
fn bridge(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let temperature = &stand.world.temperature[axis];
    let mean = temperature.iter().sum::<f64>() / temperature.len() as f64;
    let (low, high) = extremes(temperature);
    let balanced = mean + 0.1 * (high - low) * draw.between(-1.0, 1.0);
    let (pitch, first) = (draw.by_ratio(0.8, 9.5), draw.between(0.0, TAU));
    let tone = in_time(stand, |t| (first + TAU * pitch * t).sin());
    temperature
        .iter()
        .zip(&tone)
        .map(|(t, s)| (t - balanced) * s)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stand(name: &str) -> (Draw, Stand) {
        let mut draw = Draw::of(20_261_122, 87, 0);
        let needed = needs(name);
        let stand = Stand::draw(&mut draw, 600.0, 20.0, needed);
        (draw, stand)
    }

    fn energy(y: &[f64]) -> f64 {
        y.iter().map(|v| v * v).sum()
    }

    #[test]
    fn a_bit_of_two_phases_has_no_mean_and_its_halves_differ() {
        let (mut draw, stand) = stand(NAMES[2]);
        let y = message(&mut draw, &stand);
        assert!(y.iter().all(|v| v.abs() == 1.0));
        let mean = y.iter().sum::<f64>() / y.len() as f64;
        assert!(mean.abs() < 2e-3, "{mean}");
        // A level lasts for half a bit or for a whole one.
        let mut runs: Vec<usize> = y.chunk_by(|a, b| a == b).map(<[f64]>::len).collect();
        runs.pop();
        let half = runs.iter().min().copied().unwrap_or(0);
        assert!(runs.iter().all(|r| *r == half || *r == 2 * half));
        assert!(runs.contains(&(2 * half)));
    }

    #[test]
    fn a_pipe_keeps_the_energy_of_every_pitch() {
        let mut knock = vec![0.0; 4000];
        knock[1000] = 1.0;
        for pole in [-0.6, 0.5] {
            let y = dispersed(&knock, 14, pole);
            assert!((energy(&y) - 1.0).abs() < 1e-9);
            // White: no lag correlates.
            for lag in [1, 2, 7] {
                let r: f64 = (lag..y.len()).map(|i| y[i] * y[i - lag]).sum();
                assert!(r.abs() < 1e-9, "{r}");
            }
            let most = y.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            assert!(most < 0.7, "{most}");
        }
    }

    #[test]
    fn avalanches_keep_to_their_lengths_and_short_ones_are_the_most() {
        let (mut draw, mut stand) = stand(NAMES[3]);
        stand.seconds = 60_000.0;
        stand.world.duty = vec![0.0; 1_200_000];
        let y = crackle(&mut draw, &stand);
        let lengths: Vec<usize> = y
            .chunk_by(|a, b| (*a == 0.0) == (*b == 0.0))
            .filter(|c| c[0] != 0.0)
            .map(<[f64]>::len)
            .collect();
        // Those that touch count as one.
        let most = (3.0 * AVALANCHES.1 * stand.rate_hz) as usize;
        assert!(lengths.iter().all(|l| *l <= most));
        let short = lengths.iter().filter(|l| **l <= 4).count() as f64;
        let share = short / lengths.len() as f64;
        // Of the power -2: half are shorter than twice the least.
        assert!((0.4..0.7).contains(&share), "{share}");
    }

    #[test]
    fn a_contact_is_still_while_the_motor_rests_and_a_sticking_motor_has_three_states() {
        let (mut draw, mut stand) = stand(NAMES[5]);
        let y = chatter(&mut draw, &mut stand);
        for (v, d) in y.iter().zip(&stand.world.duty) {
            assert_eq!(v.abs(), f64::from(u8::from(*d != 0.0)));
        }
        let y = sticking(&mut draw, &mut stand);
        let stuck = y.iter().filter(|v| **v == 0.0).count() as f64 / y.len() as f64;
        assert!((0.2..0.8).contains(&stuck), "{stuck}");
        assert!(y.contains(&1.0) && y.contains(&-1.0));
        // The same command finds it running or stuck, by where it came from.
        let between = |(d, v): (&f64, &f64)| ((0.35..0.45).contains(&d.abs())).then_some(*v == 0.0);
        let states: Vec<bool> = stand
            .world
            .duty
            .iter()
            .zip(&y)
            .filter_map(between)
            .collect();
        assert!(states.contains(&true) && states.contains(&false));
    }

    #[test]
    fn behind_a_diode_nothing_is_lower_than_the_supply() {
        let (mut draw, mut stand) = stand(NAMES[7]);
        let y = behind_diode(&mut draw, &mut stand);
        let over: Vec<f64> = y
            .iter()
            .zip(&stand.world.supply)
            .map(|(y, u)| y - u)
            .collect();
        let (low, high) = extremes(&over);
        assert!(over.iter().filter(|o| **o - low < 1e-9).count() > y.len() / 50);
        assert!(high > low + 0.01);
    }

    #[test]
    fn a_mode_rings_at_its_pitch_and_a_contact_has_two_states() {
        let mut knock = vec![0.0; 400];
        knock[0] = 1.0;
        let y = resonating(&knock, (2.0, 0.1), 20.0);
        // A damped sine of ten samples a turn.
        for (i, v) in y.iter().enumerate() {
            let told = (-TAU * 0.1 * i as f64 / 20.0).exp() * (TAU * 0.1 * i as f64).sin();
            assert!((v - told).abs() < 1e-9, "{i}: {v} {told}");
        }
        let (mut draw, stand) = stand(NAMES[9]);
        let mut y = opens(&mut draw, &stand);
        y.sort_by(f64::total_cmp);
        y.dedup();
        assert_eq!(y.len(), 2);
    }

    #[test]
    fn a_swaying_tone_a_siren_and_a_bridge_have_no_carrier() {
        let (mut draw, mut stand) = stand(NAMES[0]);
        for y in [
            swaying(&mut draw, &stand),
            siren(&mut draw, &stand),
            bridge(&mut draw, &mut stand, 1),
        ] {
            let coefficients = analysis::likelihood::Dct::new(y.len()).forward(&y);
            let most = coefficients.iter().map(|c| c * c).fold(0.0, f64::max);
            assert!(most < 0.5 * energy(&coefficients), "{most}");
        }
    }
}
