//! Foreign effects kept back from the engine, seventh set (2026-11-21): the twenty that came first to the mind of an
//! examiner who knew the causes of docs/effects.md, listed before any of the earlier sets was read. Most are of a kind with
//! one that an earlier set holds, made anew here. None was diagnosed while they were written, and the engine's code was not
//! read. The tests of `library_share` hold that no effect of the library describes them, nor, where they are signals, a sum
//! of two.

use std::f64::consts::TAU;

use super::{Foreign, PLAIN, Set, of_signal};
use crate::random::Draw;
use crate::stand::{Needs, Stand, held, lagged};

pub(super) mod noise;

/// Their names: three that follow a recorded channel, seven that have a structure in time of their own, eight of noise, one
/// that couples axes and one of codes.
pub const NAMES: [&str; 20] = [
    "mount that slips in many places",
    "gradient across the part",
    "square of a shaking",
    "rotor that runs up or down",
    "tone whose pitch wanders",
    "machine that starts and stops",
    "knocks that ring",
    "pulses of one sign",
    "charge and reset",
    "one short pulse each period",
    "mode that noise drives",
    "reverberation of the noise",
    "angle that is rounded",
    "noise that swells and ebbs",
    "noise of random size",
    "noise of a double-exponential law",
    "colour that turns",
    "long memory",
    "tail of another axis",
    "dead band at zero",
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

/// Causes of the library that are a true part of it: what follows the acceleration along a loop follows it along a line as
/// well, tails as heavy as those have samples that Gaussian noise cannot make, and a memory without end is a kin of flicker.
fn parts(name: &str) -> &'static [&'static str] {
    match name {
        "mount that slips in many places" => &["g_sensitivity"],
        "noise of a double-exponential law" => &["outliers"],
        "long memory" => &["flicker"],
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
        "mount that slips in many places" => slips(draw, stand),
        "gradient across the part" => gradient(draw, stand, axis),
        "square of a shaking" => squared(draw, stand),
        "rotor that runs up or down" => sweep(draw, stand),
        "tone whose pitch wanders" => wandering(draw, stand),
        "machine that starts and stops" => machine(draw, stand),
        "knocks that ring" => knocks(draw, stand),
        "pulses of one sign" => pulses(draw, stand),
        "charge and reset" => charge(draw, stand),
        "one short pulse each period" => train(draw, stand),
        _ => return noise::one(draw, stand, name, axis, wanted),
    };
    Some(of_signal(stand, name, axis, &unit, wanted))
}

/// Many small contacts, each of which follows the acceleration only after its own play (Prandtl and Ishlinskii): the way
/// there is another than the way back. The straight line through the loop is taken off, for the part is calibrated.
fn slips(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const CONTACTS: usize = 5;
    let (n, along) = (stand.samples(), draw.of_many(3));
    let rms = draw.between(0.08, 0.3);
    let sway = noise::Turning::new(
        draw.by_ratio(0.15, 1.5),
        draw.by_ratio(0.02, 0.2),
        stand.rate_hz,
    );
    let force: Vec<f64> = sway.of(draw, n).iter().map(|s| rms * s).collect();
    let contacts: [(f64, f64); CONTACTS] =
        std::array::from_fn(|_| (rms * draw.between(0.3, 1.5), draw.between(0.5, 1.5)));
    let y = behind_plays(&force, &contacts);
    let still = if along == 2 { 1.0 } else { 0.0 };
    for (acc, a) in stand.world.acc[along].iter_mut().zip(&force) {
        *acc = still + a + 0.005 * draw.normal();
    }
    without_line(&y, &force)
}

/// What follows a series, from 0, by many contacts, each after its own play and with its own weight.
pub(super) fn behind_plays(series: &[f64], contacts: &[(f64, f64)]) -> Vec<f64> {
    let mut held = vec![0.0f64; contacts.len()];
    series
        .iter()
        .map(|a| {
            let follow = |((play, weight), held): (&(f64, f64), &mut f64)| {
                *held = held.clamp(a - play, a + play);
                weight * *held
            };
            contacts.iter().zip(&mut held).map(follow).sum()
        })
        .collect()
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
    let rest = |(y, x): (&f64, &f64)| y - my - slope * (x - mx);
    y.iter().zip(x).map(rest).collect()
}

/// The temperatures that a lamp close by makes, which is switched on and off within seconds.
pub(super) fn lamp(draw: &mut Draw, stand: &mut Stand) {
    lit(draw, stand, (2.0, 14.0), (2.0, 6.0));
}

/// Those of one that is switched after so long and warms within so long, s.
pub(super) fn lit(draw: &mut Draw, stand: &mut Stand, dwell_s: (f64, f64), lag_s: (f64, f64)) {
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    let (room, top) = (draw.between(20.0, 30.0), draw.between(3.0, 10.0));
    let mut on = draw.chance(0.5);
    let lamp = held(draw, n, rate_hz, dwell_s, |d| {
        on = !on;
        room + if on { top * d.between(0.5, 1.0) } else { 0.0 }
    });
    let heat = lagged(&lamp, draw.by_ratio(lag_s.0, lag_s.1), rate_hz);
    // Three parts on one board: nearly the same temperature.
    stand.world.temperature = std::array::from_fn(|_| {
        let off = draw.between(-0.5, 0.5);
        heat.iter().map(|t| t + off).collect()
    });
}

/// The near side of the part has the temperature at once and the far side later, and what they differ by bends it: by the
/// lamp, for what bends slowly is hidden by a random walk.
fn gradient(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    lamp(draw, stand);
    let near = &stand.world.temperature[axis];
    let far = lagged(near, draw.by_ratio(0.5, 3.0), stand.rate_hz);
    near.iter().zip(far).map(|(t, f)| t - f).collect()
}

/// A shaking that the accelerometers follow from sample to sample, strong and weak by turns, and a rate that answers to
/// its square alone.
fn squared(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (rate_hz, n) = (stand.rate_hz, stand.samples());
    let (along, rms) = (draw.of_many(3), draw.between(0.08, 0.3));
    let shake = noise::Turning::new(
        draw.by_ratio(0.4, 6.0),
        draw.by_ratio(0.02, 0.3),
        stand.rate_hz,
    );
    let shake = shake.of(draw, n);
    let depth = draw.between(0.3, 0.9);
    let swell = TAU / (draw.by_ratio(10.0, 80.0) * rate_hz);
    let first = draw.between(0.0, TAU);
    let still = if along == 2 { 1.0 } else { 0.0 };
    shake
        .iter()
        .enumerate()
        .map(|(i, s)| {
            let a = rms * s * (1.0 + depth * (first + swell * i as f64).sin());
            stand.world.acc[along][i] = still + a + 0.005 * draw.normal();
            a * a
        })
        .collect()
}

/// A rotor that takes the whole record to run up or to run down, evenly in pitch or in its logarithm.
fn sweep(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    let (mut from, mut to) = (draw.between(0.3, 3.0), draw.between(4.0, 9.7));
    if draw.chance(0.5) {
        std::mem::swap(&mut from, &mut to);
    }
    let even = draw.chance(0.5);
    let mut phase = draw.between(0.0, TAU);
    (0..n)
        .map(|i| {
            let at = i as f64 / n as f64;
            let f = if even {
                from + (to - from) * at
            } else {
                from * (to / from).powf(at)
            };
            phase += TAU * f / rate_hz;
            phase.sin()
        })
        .collect()
}

/// An oscillator without a crystal: its pitch wanders about its mean.
fn wandering(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    let pitch = draw.between(1.0, 9.0);
    let (sigma, tau) = (draw.by_ratio(0.05, 0.4), draw.by_ratio(5.0, 60.0));
    let mut phase = draw.between(0.0, TAU);
    crate::stand::wander(draw, n, rate_hz, sigma, tau)
        .iter()
        .map(|off| {
            phase += TAU * (pitch + off) / rate_hz;
            phase.sin()
        })
        .collect()
}

/// A machine in the next room that is started and stopped as it is needed: each time with a phase and a load of its own,
/// rising and falling over a second or so.
fn machine(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let rate_hz = stand.rate_hz;
    let (pitch, slip) = (draw.by_ratio(0.6, 9.5), draw.by_ratio(0.002, 0.02));
    let (runs, rests) = (draw.by_ratio(4.0, 20.0), draw.by_ratio(6.0, 40.0));
    let rise = draw.by_ratio(0.3, 2.0);
    let mut y = vec![0.0; stand.samples()];
    let mut from = rests * draw.exponential();
    while from < stand.seconds {
        let to = from + runs * draw.between(0.5, 1.5);
        let (f, phase) = (pitch * (1.0 + slip * draw.normal()), draw.between(0.0, TAU));
        let size = draw.between(0.6, 1.4);
        for (i, v) in y.iter_mut().enumerate() {
            let t = i as f64 / rate_hz;
            if (from..to).contains(&t) {
                let swelling = ((t - from) / rise).min((to - t) / rise).min(1.0);
                *v += size * swelling * (TAU * f * (t - from) + phase).sin();
            }
        }
        from = to + rests * draw.exponential() + 0.5;
    }
    y
}

/// Knocks at random on a bench that rings: any sense, many small ones and few large ones.
fn knocks(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let rate_hz = stand.rate_hz;
    let (f, decay) = (draw.by_ratio(0.7, 9.0), draw.by_ratio(0.3, 3.0));
    let apart = draw.by_ratio(6.0, 30.0);
    let mut y = vec![0.0; stand.samples()];
    let mut at = apart * draw.exponential();
    while at < stand.seconds {
        let size = draw.sign() * (0.3 + draw.exponential());
        let first = (at * rate_hz).ceil() as usize;
        for (k, v) in y.iter_mut().enumerate().skip(first) {
            let since = k as f64 / rate_hz - at;
            if since > 10.0 * decay {
                break;
            }
            *v += size * (-since / decay).exp() * (TAU * f * since).sin();
        }
        at += apart * draw.exponential();
    }
    y
}

/// Charges that arrive at random and leak away: shot noise, all of one sign.
fn pulses(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let rate_hz = stand.rate_hz;
    let (sign, decay) = (draw.sign(), draw.by_ratio(0.5, 5.0));
    // Few enough that most stand alone.
    let apart = decay * draw.by_ratio(4.0, 12.0);
    let keep = (-1.0 / (decay * rate_hz)).exp();
    let (mut y, mut left) = (0.0, apart * draw.exponential());
    (0..stand.samples())
        .map(|_| {
            y *= keep;
            left -= 1.0 / rate_hz;
            while left <= 0.0 {
                y += sign * (0.3 + draw.exponential());
                left += apart * draw.exponential();
            }
            y
        })
        .collect()
}

/// A relaxation oscillator: charged through a resistance, and emptied when it reaches its threshold.
fn charge(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (rate_hz, period) = (stand.rate_hz, draw.by_ratio(3.0, 60.0));
    let (bend, sign) = (draw.between(0.3, 3.0), draw.sign());
    let first = draw.between(0.0, 1.0);
    (0..stand.samples())
        .map(|i| {
            let place = (first + i as f64 / rate_hz / period).fract();
            sign * (1.0 - (-bend * place).exp())
        })
        .collect()
}

/// Something that is done once in a period, a radio that sends or a valve that moves: a few samples, then nothing.
fn train(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    // Two lines would do where the pulses fill a larger part of their period.
    let (rate_hz, period) = (stand.rate_hz, draw.by_ratio(4.0, 20.0));
    let (sign, width) = (draw.sign(), draw.between(0.25, 0.5));
    let first = draw.between(0.0, period);
    (0..stand.samples())
        .map(|i| {
            let since = (first + i as f64 / rate_hz) % period;
            if since < width {
                sign * (0.5 * TAU * since / width).sin().powi(2)
            } else {
                0.0
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stand() -> (Draw, Stand) {
        let mut draw = Draw::of(20_261_121, 60, 0);
        let needed = (SET.needs)(NAMES[0]);
        let stand = Stand::draw(&mut draw, 600.0, 20.0, needed);
        (draw, stand)
    }

    /// The axis along which it is shaken most, none where the stand is still along all.
    fn widest(stand: &Stand) -> usize {
        let spread = |k: &usize| super::super::swing(&stand.world.acc[*k]);
        let most = |a: &usize, b: &usize| spread(a).total_cmp(&spread(b));
        (0..3).max_by(most).expect("there are three axes")
    }

    #[test]
    fn a_line_is_taken_off_whole() {
        let x: Vec<f64> = (0..50).map(|i| f64::from(i * i)).collect();
        let y: Vec<f64> = x.iter().map(|x| 3.0 - 0.2 * x).collect();
        assert!(without_line(&y, &x).iter().all(|v| v.abs() < 1e-9));
        assert_eq!(without_line(&[1.0, 3.0], &[2.0, 2.0]), [-1.0, 1.0]);
    }

    #[test]
    fn a_mount_that_slips_has_two_branches() {
        let (mut draw, mut stand) = stand();
        let y = slips(&mut draw, &mut stand);
        let a = &stand.world.acc[widest(&stand)];
        // On its way there it lags below, on its way back above.
        let (mut there, mut back) = (vec![], vec![]);
        for i in 2..a.len() - 2 {
            let pace = a[i + 2] - a[i - 2];
            if pace > 0.03 {
                there.push(y[i]);
            } else if pace < -0.03 {
                back.push(y[i]);
            }
        }
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        assert!(there.len() > 100 && back.len() > 100);
        assert!(mean(&there) < mean(&back));
    }

    #[test]
    fn a_square_has_no_straight_line_in_the_acceleration() {
        let (mut draw, mut stand) = stand();
        let y = squared(&mut draw, &mut stand);
        let left = without_line(&y, &stand.world.acc[widest(&stand)]);
        let energy = |v: &[f64]| {
            let mean = v.iter().sum::<f64>() / v.len() as f64;
            v.iter().map(|v| (v - mean).powi(2)).sum::<f64>()
        };
        assert!(energy(&left) > 0.95 * energy(&y));
    }

    #[test]
    fn pulses_are_of_one_sign_and_a_train_repeats() {
        let (mut draw, stand) = stand();
        let y = pulses(&mut draw, &stand);
        assert!(y.iter().all(|v| *v >= 0.0) || y.iter().all(|v| *v <= 0.0));
        let y = train(&mut draw, &stand);
        let on = y.iter().filter(|v| **v != 0.0).count() as f64 / y.len() as f64;
        assert!((0.005..0.15).contains(&on), "{on}");
    }
}
