//! Foreign effects kept back from the engine, sixth set (2026-11-21): written from the physics and mathematics named
//! here, by someone who had not read how the diagnosis decides beyond what `report/names.md` and `report/kept.md` tell, nor
//! diagnosed a run while writing. The tests of `library_share` hold that no effect of the library describes them, nor,
//! where they are signals, a sum of two.

use std::f64::consts::TAU;

use super::{Foreign, PLAIN, Set, of_signal};
use crate::random::Draw;
use crate::stand::{Needs, Stand, held, lagged, wander};

pub(super) mod codes;
pub(super) mod noise;

/// Their names: seven that follow a recorded channel, six that have a structure in time of their own, eight of noise, six
/// of codes and three that couple axes.
pub const NAMES: [&str; 30] = [
    "ring of the arm at each reversal",
    "cable that winds up",
    "pit in the table's bearing",
    "judder of a table that turns slowly",
    "rotor that rests anywhere",
    "recovery after a shock",
    "pump whose pitch follows the load",
    "footsteps that pass",
    "heart of whoever leans on the bench",
    "machine that runs up through a resonance",
    "idle tones of a modulator",
    "parity of the frame's number",
    "amplifiers that take turns and slip",
    "amplifier blocked after a shock",
    "mean over as many looks as fit",
    "interpolation between two clocks",
    "memory that is trimmed at one temperature",
    "product of the last two swings",
    "filter that lets large changes through",
    "filter that is switched in while the motor runs",
    "zero taken anew from each block",
    "gain that differs with the sense",
    "step that grows with the reading",
    "two lines of the word exchanged",
    "lowest bit that carries the parity",
    "far readings put between their neighbours",
    "reading that may change by so much at most",
    "toggling line of another axis's word",
    "another axis, its sign alternating",
    "product of the two other axes",
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
        vibration: name.contains("shock"),
    }
}

/// Causes of the library that are a true part of it: a filter is one, whenever it acts.
fn parts(name: &str) -> &'static [&'static str] {
    match name {
        "interpolation between two clocks"
        | "filter that lets large changes through"
        | "filter that is switched in while the motor runs" => &["low_pass"],
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
        "ring of the arm at each reversal" => reversals(draw, stand),
        "cable that winds up" => cable(draw, stand),
        "pit in the table's bearing" => pit(draw, stand),
        "judder of a table that turns slowly" => judder(draw, stand),
        "rotor that rests anywhere" => rotor(draw, stand),
        "recovery after a shock" => recovery(draw, stand),
        "pump whose pitch follows the load" => pump(draw, stand),
        "footsteps that pass" => footsteps(draw, stand),
        "heart of whoever leans on the bench" => heart(draw, stand),
        "machine that runs up through a resonance" => machine(draw, stand),
        "idle tones of a modulator" => idle_tones(draw, stand),
        "parity of the frame's number" => parity(draw, stand),
        "amplifiers that take turns and slip" => slipping(draw, stand),
        _ => {
            return noise::one(draw, stand, name, axis, wanted)
                .or_else(|| codes::one(draw, stand, name, axis, wanted));
        }
    };
    Some(of_signal(stand, name, axis, &unit, wanted))
}

pub(super) fn in_steps(command: f64) -> f64 {
    (command * 255.0).round() / 255.0
}

/// Whenever the motor is turned about, the gear runs through its play and strikes on the other flank, and the arm that
/// carries the part rings. A change of pace in one sense stays on its flank and is not felt.
fn reversals(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    let mut sense = draw.sign();
    stand.world.duty = held(draw, n, rate_hz, (2.0, 9.0), |d| {
        if d.chance(0.5) {
            sense = -sense;
        }
        in_steps(sense * d.between(0.3, 1.0))
    });
    let (f, decay) = (draw.by_ratio(0.8, 7.0), draw.by_ratio(0.3, 1.2));
    // The slower the motor after it was turned about, the longer it takes through the play.
    let play = draw.between(0.05, 0.2);
    let mut y = vec![0.0; n];
    for i in 1..n {
        let (before, now) = (stand.world.duty[i - 1], stand.world.duty[i]);
        if before * now >= 0.0 {
            continue;
        }
        let at = i as f64 / rate_hz + play / now.abs();
        for (k, v) in y.iter_mut().enumerate().skip(i) {
            let since = k as f64 / rate_hz - at;
            if since > 8.0 * decay {
                break;
            }
            if since >= 0.0 {
                *v += now * (-since / decay).exp() * (TAU * f * since).sin();
            }
        }
    }
    y
}

/// The cable to the table hangs slack over a part of a turn either way; beyond, it twists and pulls the part's mount
/// askew. It knows the angle that the motor has turned, the sum of its speed, not its command.
fn cable(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const SLACK: f64 = 0.35;
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    // Turned about before the cable breaks, or of the operator's will.
    let end = draw.between(4.0, 9.0);
    let (mut angle, mut command, mut left) = (0.0f64, 0.0, 0.0);
    stand.world.duty = (0..n)
        .map(|_| {
            left -= 1.0 / rate_hz;
            if left <= 0.0 || angle * command > 0.0 && angle.abs() > end {
                let sense = if angle.abs() > 0.3 * end {
                    -angle.signum()
                } else {
                    draw.sign()
                };
                command = in_steps(sense * draw.between(0.5, 1.0));
                left = draw.between(3.0, 14.0);
            }
            angle += command / rate_hz;
            command
        })
        .collect();
    let speed = lagged(&stand.world.duty, draw.between(0.1, 0.5), rate_hz);
    let mut angle = 0.0f64;
    speed
        .iter()
        .map(|s| {
            angle += s / rate_hz;
            angle.signum() * (angle.abs() - SLACK * end).max(0.0)
        })
        .collect()
}

/// One pit in the bearing of the table: at one angle of each turn it dips in and out again, the harder the faster it turns,
/// and the angle is the sum of a speed that follows the command behind a lag.
fn pit(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    stand.world.duty = held(draw, n, rate_hz, (3.0, 15.0), |d| {
        in_steps(d.sign() * d.between(0.3, 1.0))
    });
    let (top, width) = (draw.by_ratio(0.3, 1.2), draw.between(0.04, 0.08));
    let mut angle = draw.between(0.0, 1.0);
    lagged(&stand.world.duty, draw.between(0.1, 0.8), rate_hz)
        .iter()
        .map(|speed| {
            angle += top * speed / rate_hz;
            let off = (angle - angle.round()) / width;
            -speed * off * (-0.5 * off * off).exp()
        })
        .collect()
}

/// Below a certain speed the table does not glide but sticks and slips, many times a second, and not quite regularly. The
/// motor is swept up and down through zero.
fn judder(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (rate_hz, period) = (stand.rate_hz, draw.between(20.0, 60.0));
    let (top, first) = (draw.between(0.5, 1.0), draw.between(0.0, 1.0));
    stand.world.duty = (0..stand.samples())
        .map(|i| in_steps(top * (TAU * (first + i as f64 / rate_hz / period)).sin()))
        .collect();
    let (least, most) = (0.04, top * draw.between(0.25, 0.45));
    let pitch = draw.between(2.5, 6.5);
    let (mut place, mut pace) = (0.0, pitch);
    stand
        .world
        .duty
        .iter()
        .map(|d| {
            if !(least..most).contains(&d.abs()) {
                place = 0.0;
                return 0.0;
            }
            place += pace / rate_hz;
            if place >= 1.0 {
                place -= 1.0;
                pace = pitch * draw.between(0.75, 1.25);
            }
            d.signum() * (place - 0.5)
        })
        .collect()
}

/// The rotor's magnet comes to rest at any angle, and its stray field is then that of this angle until the next stroke;
/// while it turns, the field turns too and leaves nothing.
fn rotor(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate_hz = stand.rate_hz;
    let (mut runs, mut left, mut command, mut field) = (false, draw.between(1.0, 8.0), 0.0, 0.0);
    let mut y = vec![];
    stand.world.duty = (0..stand.samples())
        .map(|_| {
            left -= 1.0 / rate_hz;
            if left <= 0.0 {
                runs = !runs;
                if runs {
                    (command, field) = (in_steps(draw.sign() * draw.between(0.3, 1.0)), 0.0);
                    left = draw.between(1.5, 6.0);
                } else {
                    (command, field) = (0.0, draw.between(0.0, TAU).cos());
                    left = draw.between(4.0, 15.0);
                }
            }
            y.push(field);
            command
        })
        .collect();
    y
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

/// A shock drives the loop that holds the part's amplitude to its stop. It comes back from there over seconds, and the rate
/// is off meanwhile: nothing at the shock itself, most of it when the accelerometer has long been still.
fn recovery(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let shocks = shocks(draw, stand);
    let (rises, falls) = (draw.by_ratio(0.2, 0.6), draw.by_ratio(0.8, 3.0));
    let mut y = vec![0.0; stand.samples()];
    for (at, hard) in shocks {
        for (k, v) in y.iter_mut().skip(at + 1).enumerate() {
            let since = k as f64 / stand.rate_hz;
            *v += hard * ((-since / falls).exp() - (-since / rises).exp());
        }
    }
    y
}

/// A charge pump runs the faster the more it has to deliver; its ripple is folded by the sampling, so that each load has a
/// pitch of its own, anywhere in the band. The loads are of many sizes.
fn pump(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    let most = draw.between(0.05, 0.15);
    let load = held(draw, n, rate_hz, (3.0, 15.0), |d| d.between(0.0, most));
    let slow = wander(draw, n, rate_hz, 0.001, 60.0);
    stand.world.supply = load.iter().zip(slow).map(|(l, s)| 5.0 - l - s).collect();
    let (idle, span) = (draw.between(1.0, 9.0), draw.between(10.0, 40.0));
    let mut phase = draw.between(0.0, TAU);
    stand
        .world
        .supply
        .iter()
        .map(|u| {
            phase += TAU * (idle + span * (5.0 - u) / most) / rate_hz;
            phase.sin()
        })
        .collect()
}

/// People pass by on a floor that rings: steps at a pace that is nearly regular, each a short ring, growing until the
/// walker is next to the bench.
fn footsteps(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let rate_hz = stand.rate_hz;
    let (f, decay) = (draw.by_ratio(2.5, 8.0), draw.by_ratio(0.08, 0.25));
    let mut y = vec![0.0; stand.samples()];
    let mut nearest = draw.between(3.0, 15.0);
    while nearest < stand.seconds + 5.0 {
        let (pace, takes, heavy) = (
            draw.between(0.45, 0.65),
            draw.between(1.5, 5.0),
            draw.between(0.6, 1.4),
        );
        let mut at = nearest - 3.0 * takes;
        while at < nearest + 3.0 * takes {
            let size = heavy / (1.0 + ((at - nearest) / takes).powi(2));
            let first = (at * rate_hz).ceil().max(0.0) as usize;
            for (k, v) in y.iter_mut().enumerate().skip(first) {
                let since = k as f64 / rate_hz - at;
                if since > 6.0 * decay {
                    break;
                }
                *v += size * (-since / decay).exp() * (TAU * f * since).sin();
            }
            at += pace * (1.0 + 0.04 * draw.normal());
        }
        nearest += 10.0 + 30.0 * draw.exponential();
    }
    y
}

/// Whoever leans on the bench moves it by every beat of the heart (ballistocardiography): a stroke there, a larger one
/// back and a smaller one there again, at intervals that follow the breath and wander besides.
fn heart(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let rate_hz = stand.rate_hz;
    let (beat, breath) = (draw.between(0.7, 1.1), draw.between(3.0, 6.0));
    let (width, depth) = (draw.between(0.06, 0.1), draw.between(0.03, 0.08));
    let mut y = vec![0.0; stand.samples()];
    let (mut at, mut off) = (draw.between(0.0, 1.0), 0.0);
    while at < stand.seconds {
        let breathes = (TAU * at / breath).sin();
        let size = 1.0 + 0.2 * breathes;
        for (after, share) in [(0.10, -0.6), (0.20, 1.0), (0.31, -0.5)] {
            let middle = (at + after) * rate_hz;
            let reach = 4.0 * width * rate_hz;
            let first = (middle - reach).max(0.0) as usize;
            for (k, v) in y.iter_mut().enumerate().skip(first) {
                let x = (k as f64 - middle) / width / rate_hz;
                if x > 4.0 {
                    break;
                }
                *v += size * share * (-0.5 * x * x).exp();
            }
        }
        off = 0.9 * off + 0.02 * draw.normal();
        at += beat * (1.0 + depth * breathes + off);
    }
    y
}

/// A machine next door whose rotor is not balanced starts, runs and is left to run down. It shakes the bench only while
/// its speed passes the bench's resonance: a swing up through that pitch within seconds, and later one down through it.
fn machine(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let rate_hz = stand.rate_hz;
    let (resonance, damping) = (draw.by_ratio(1.2, 5.0), draw.between(0.05, 0.12));
    // Speed at which it runs: far above, where the bench no longer follows.
    let runs = resonance * draw.between(6.0, 9.0);
    let (up, down) = (draw.between(8.0, 20.0), draw.between(4.0, 10.0));
    let (mut on, mut left, mut speed) = (true, draw.between(15.0, 40.0), 0.0);
    let mut phase = draw.between(0.0, TAU);
    (0..stand.samples())
        .map(|_| {
            left -= 1.0 / rate_hz;
            if left <= 0.0 {
                on = !on;
                left = draw.between(15.0, 40.0);
            }
            let (goal, takes) = if on { (runs, up) } else { (0.0, down) };
            speed += (goal - speed) / takes / rate_hz;
            phase += TAU * speed / rate_hz;
            // What turns faster than half the sample rate does not pass the part's filter.
            if speed > 0.45 * rate_hz {
                return 0.0;
            }
            let x = speed / resonance;
            let (stiff, lossy) = (1.0 - x * x, 2.0 * damping * x);
            let late = lossy.atan2(stiff);
            x * x / stiff.hypot(lossy) * (phase - late).sin() / (1.0 + x.powi(4))
        })
        .collect()
}

/// A modulator of first order at rest gives out a pattern: what it has summed and not yet given is a sawtooth whose pitch
/// is its input, all its harmonics folded, and the input is the part's own offset, which wanders.
fn idle_tones(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (size, memory) = (draw.by_ratio(0.003, 0.03), draw.by_ratio(10.0, 60.0));
    let off = wander(draw, stand.samples(), stand.rate_hz, size, memory);
    let (middle, mut sum) = (draw.between(0.05, 0.45), draw.between(0.0, 1.0));
    off.iter()
        .map(|o| {
            sum = (sum + middle + o).rem_euclid(1.0);
            sum - 0.5
        })
        .collect()
}

/// The line on which the frame's number goes out shares a return with the part: it rests where the parity of the number
/// leaves it, high after an odd count of ones (Thue 1906, Morse 1921), and the reading of the next frame is off by that. No
/// stretch of it comes three times in a row; it has neither a period nor lines.
fn parity(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let first = draw.of_many(1 << 15) as u32;
    (0..stand.samples() as u32)
        .map(|i| 1.0 - 2.0 * f64::from((first + i).count_ones() % 2))
        .collect()
}

/// Two amplifiers take turns, one measuring while the other nulls itself; what their offsets differ by changes its sign
/// with every reading. Now and then a reading is missed, and the turns are exchanged from there on.
fn slipping(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let stays = draw.by_ratio(1.0, 8.0) * stand.rate_hz;
    let mut which = 1.0;
    (0..stand.samples())
        .map(|_| {
            if !draw.chance(1.0 / stays) {
                which = -which;
            }
            which
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stand(index: u64) -> (Draw, Stand) {
        let mut draw = Draw::of(20_261_121, 42, index);
        let stand = Stand::draw(&mut draw, 600.0, 20.0, Needs::default());
        (draw, stand)
    }

    #[test]
    fn an_arm_rings_after_a_reversal_and_not_after_a_change_of_pace() {
        let (mut draw, mut stand) = stand(0);
        let y = reversals(&mut draw, &mut stand);
        let duty = &stand.world.duty;
        let (mut turned, mut quiet) = (None, 0);
        for i in 1..y.len() {
            if duty[i] * duty[i - 1] < 0.0 {
                turned = Some(i);
            } else if duty[i] != duty[i - 1] && turned.is_none_or(|t| i - t > 240) {
                quiet += 1;
                assert!(y[i..(i + 20).min(y.len())].iter().all(|v| v.abs() < 1e-3));
            }
        }
        assert!(turned.is_some() && y.iter().any(|v| v.abs() > 0.1));
        println!("{quiet} changes of pace long after a reversal");
    }

    #[test]
    fn a_cable_is_slack_in_the_middle_and_pulls_either_way() {
        let (mut draw, mut stand) = stand(1);
        let y = cable(&mut draw, &mut stand);
        let share =
            |of: &dyn Fn(f64) -> bool| y.iter().filter(|v| of(**v)).count() as f64 / y.len() as f64;
        assert!(share(&|v| v == 0.0) > 0.15 && share(&|v| v != 0.0) > 0.15);
    }

    #[test]
    fn a_rotor_has_a_field_where_it_rests_and_none_where_it_turns() {
        let (mut draw, mut stand) = stand(2);
        let y = rotor(&mut draw, &mut stand);
        for (d, v) in stand.world.duty.iter().zip(&y) {
            assert!(*d == 0.0 || *v == 0.0);
        }
        assert!(y.iter().filter(|v| **v != 0.0).count() > y.len() / 3);
    }

    #[test]
    fn the_parity_of_a_number_never_comes_three_times_in_a_row() {
        let (mut draw, stand) = stand(3);
        let y = parity(&mut draw, &stand);
        for length in [1, 2, 3, 5, 8, 16, 30] {
            for at in 0..y.len() - 3 * length {
                let part = |k: usize| &y[at + k * length..at + (k + 1) * length];
                assert!(part(0) != part(1) || part(1) != part(2), "{length} at {at}");
            }
        }
    }
}
