//! Levels: what is switched, charged, clocked or counted, with a time of its own.

use super::super::super::prelude::*;

/// A part that is dragged by friction, holds until a stress that differs a little each time, and lets go.
pub(super) fn stick_and_slip(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let rise = 1.0 / (draw.by_ratio(6.0, 30.0) * stand.rate_hz);
    let mut level = draw.between(0.0, 1.0);
    let mut holds = 1.0;
    stand.series(|_| {
        level += rise;
        if level > holds {
            level = 0.0;
            holds = draw.between(0.6, 1.4);
        }
        level
    })
}

/// A vessel that is filled through one throat and emptied through another: exponentials between two levels, with one time
/// constant upward and one downward, which a valve switches whenever it is needed.
pub(super) fn pressure(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let sign = draw.sign();
    let (fills, empties) = (draw.by_ratio(0.15, 0.8), draw.by_ratio(1.0, 4.0));
    let open = draw.chance(0.5);
    let valve = stand.by_turns(draw, open, (1.5, 8.0), |_| 1.0);
    let level = carry(0.0, &valve, |level, end| {
        let tau = if end > 0.5 { fills } else { empties };
        end + (level - end) * (-1.0 / (tau * stand.rate_hz)).exp()
    });
    each(&level, |level| sign * level)
}

/// Two switches on one lamp, each turned over by a clock of its own: it is lit where they differ. The periods have no
/// common measure.
pub(super) fn two_switches(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let slow = draw.by_ratio(4.0, 14.0);
    let fast = slow / draw.between(1.3, 2.9);
    let (one, other) = (draw.between(0.0, 1.0), draw.between(0.0, 1.0));
    let high = |turns: f64| turns.fract() < 0.5;
    in_time(stand, |t| {
        one_if(high(one + t / slow) != high(other + t / fast))
    })
}

/// A clocked loop with too much gain: each of its levels is 1 - 2 x^2 of the one before, and none comes twice (Ulam and
/// von Neumann 1947).
pub(super) fn unsettled(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let clock = draw.by_ratio(0.3, 2.5);
    let mut x = draw.between(-0.9, 0.9);
    stand.held(draw, (clock, clock), |_| {
        x = 1.0 - 2.0 * x * x;
        x
    })
}

/// The gain control of the drive hunts: the amplitude grows slowly until a comparator trips, falls much faster until it trips
/// back, and so on; noise at the comparator makes no two of them quite alike.
pub(super) fn hunting(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (period, falls) = (draw.by_ratio(2.0, 12.0), draw.between(0.1, 0.25));
    let (up, down) = (1.0 / (1.0 - falls), -1.0 / falls);
    let noise = draw.between(0.03, 0.1);
    let per_sample = 1.0 / (period * stand.rate_hz);
    let (mut level, mut rises, mut until) = (draw.between(0.0, 1.0), true, 1.0);
    let sign = draw.sign();
    let y = stand.series(|_| {
        level += per_sample * if rises { up } else { down };
        if rises == (level > until) {
            rises = !rises;
            until = one_if(rises) + noise * draw.normal();
        }
        sign * level
    });
    about_mean(&y)
}

/// A radio next to the part sends for a moment once a period, and rectified at the reference its carrier is an offset for as
/// long as it lasts; a reading that it begins or ends in has its share.
pub(super) fn sending(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let period = draw.by_ratio(1.0, 6.0);
    let lasts = period * draw.between(0.04, 0.12);
    let (first, sign) = (draw.between(0.0, period), draw.sign());
    let reading = 1.0 / stand.rate_hz;
    in_time(stand, |t| {
        let since = (first + t) % period;
        let ended = (lasts - since).clamp(0.0, reading);
        let next = (since + reading - period).clamp(0.0, lasts);
        sign * (ended + next) / reading
    })
}

/// The firmware fires the self-test at a fixed period, as for a part that is not in use: the mass is pushed one way, held,
/// pushed the other way and let go, and follows behind its read-out's filter.
pub(super) fn self_test(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (period, holds) = (draw.between(12.0, 45.0), draw.between(0.4, 1.5));
    let (first, sign) = (draw.between(0.0, period), draw.sign());
    let pushed = in_time(stand, |t| match (first + t) % period / holds {
        x if x < 1.0 => sign,
        x if x < 2.0 => -sign,
        _ => 0.0,
    });
    stand.lagged(&pushed, draw.by_ratio(0.05, 0.3))
}

/// A converter takes its elements in turn so that none counts more than the others (dynamic element matching): reading by
/// reading the next, each off by its own amount, and after the last the first again: at least 16 lines, none far above the
/// others.
pub(super) fn in_turn(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let count = 32 + draw.of_many(33);
    let off = about_mean(&white(draw, count));
    let first = draw.of_many(count);
    stand.series(|i| off[(first + i) % count])
}

/// Something else on the same ground, a logger that writes or a radio that calls, draws a short current at every turn of
/// its own clock, which is not a multiple of the samples': lines without end, all of one size.
pub(super) fn pulse(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (period, width) = (draw.by_ratio(1.5, 8.0), draw.between(1.0, 2.2));
    let first = draw.between(0.0, 1.0);
    let share = width / (period * stand.rate_hz);
    in_time(stand, |t| one_if((first + t / period).fract() < share))
}

/// A bus beside the part whose bits are a step up or a step down in their middle (Manchester code), so that it has no
/// mean: two levels, neither of which lasts longer than a bit.
pub(super) fn message(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let half = draw.by_ratio(0.1, 0.9);
    let (mut level, mut first) = (1.0, false);
    stand.held(draw, (half, half), |d| {
        first = !first;
        level = if first { d.sign() } else { -level };
        level
    })
}

/// A relaxation oscillator: charged through a resistance, and emptied when it reaches its threshold.
pub(super) fn charge(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let period = draw.by_ratio(3.0, 60.0);
    let (bend, sign) = (draw.between(0.3, 3.0), draw.sign());
    let first = draw.between(0.0, 1.0);
    in_time(stand, |t| {
        let place = (first + t / period).fract();
        sign * (1.0 - (-bend * place).exp())
    })
}

/// Something that is done once in a period, a radio that sends or a valve that moves: a few samples, then nothing.
pub(super) fn train(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    // Two lines would do where the pulses fill a larger part of their period.
    let period = draw.by_ratio(4.0, 20.0);
    let (sign, width) = (draw.sign(), draw.between(0.25, 0.5));
    let first = draw.between(0.0, period);
    in_time(stand, |t| {
        let since = (first + t) % period;
        let pulse = sign * (0.5 * TAU * since / width).sin().powi(2);
        if since < width { pulse } else { 0.0 }
    })
}

/// The line on which the frame's number goes out shares a return with the part: it rests where the parity of the number
/// leaves it, high after an odd count of ones (Thue 1906, Morse 1921), and the reading of the next frame is off by that. No
/// stretch of it comes three times in a row; it has neither a period nor lines.
pub(super) fn parity(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let first = draw.of_many(1 << 15) as u32;
    (0..stand.samples() as u32)
        .map(|i| 1.0 - 2.0 * f64::from((first + i).count_ones() % 2))
        .collect()
}

/// Two amplifiers take turns, one measuring while the other nulls itself; what their offsets differ by changes its sign
/// with every reading. Now and then a reading is missed, and the turns are exchanged from there on.
pub(super) fn slipping(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let stays = draw.by_ratio(1.0, 8.0) * stand.rate_hz;
    let mut which = 1.0;
    stand.series(|_| {
        which *= draw.choose(1.0 / stays, 1.0, -1.0);
        which
    })
}

/// A converter dithers its input by a shift register with feedback, x^order + x^tap + 1 over two elements, and does not take all
/// of it off again: as the polynomial is primitive the same 31, 63 or 127 levels over and over, spread over as many weak lines as
/// the sequence is long.
pub(super) fn dither(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (order, tap): (u32, u32) = draw.one_of(&[(5, 2), (6, 1), (7, 1)]);
    // Any state other than zero.
    let mut state = 1 + draw.of_many((1 << order) - 1) as u32;
    let hold = 1 + draw.of_many(2);
    let mut level = 0.0;
    stand.series(|i| {
        if i % hold == 0 {
            level = if state & 1 == 1 { 1.0 } else { -1.0 };
            let bit = (state ^ (state >> tap)) & 1;
            state = (state >> 1) | (bit << (order - 1));
        }
        level
    })
}

/// The sun comes through drifting clouds and warms one side of the part; the other follows through the housing, and what
/// the two differ by bends it. The thermometer is in the shade.
pub(super) fn sun(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let shines = draw.chance(0.5);
    let dwell = draw.by_ratio(4.0, 15.0);
    let sky = stand.by_turns(draw, shines, (0.3 * dwell, 1.7 * dwell), |d| {
        d.between(0.4, 1.0)
    });
    // The edge of a cloud is not sharp.
    let sky = stand.lagged(&sky, draw.between(0.3, 1.0));
    let (near, apart) = (draw.by_ratio(0.8, 2.5), draw.between(2.5, 6.0));
    let [near, far] = [near, near * apart].map(|tau| stand.lagged(&sky, tau));
    either_way(draw, &about_mean(&each_pair(&near, &far, |n, f| n - f)))
}

/// What a film has taken up whose face has this humidity: Fick's law, each odd term of the series a lag of its own. At first
/// it goes as the square root of time, and after the longest lag it is full.
fn taken_up(face: &[f64], longest_s: f64, stand: &Stand) -> Vec<f64> {
    const TERMS: i32 = 40;
    let mut all = vec![0.0; face.len()];
    for k in 0..TERMS {
        let odd = f64::from(2 * k + 1).powi(2);
        let term = stand.lagged(face, longest_s / odd);
        let share = 8.0 / (PI * PI * odd);
        add_at(&mut all, 0, each(&term, |t| share * t));
    }
    all
}

/// Moisture diffuses into the package and swells it, by the square root of time, and out again: the air is damp and dry by
/// turns, which nothing records. A film takes hours and minutes; here it is as thin as it has to be to stand out from a
/// random walk.
pub(super) fn moisture(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let damp = draw.chance(0.5);
    let dwell = draw.by_ratio(4.0, 12.0);
    let face = stand.by_turns(draw, damp, (0.6 * dwell, 1.4 * dwell), |d| {
        d.between(0.6, 1.0)
    });
    let longest = dwell * draw.by_ratio(0.7, 3.0);
    about_mean(&taken_up(&face, longest, stand))
}

/// The air conditioning of the room blows cold until its thermostat is content, then the room warms up again for longer: the
/// draught cools one side of the part, and the part's thermometer, which is inside, sees nothing. Its cycles are of less than
/// a minute, for those of minutes stay weak beside a random walk (d' 20).
pub(super) fn draught(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (period, blows) = (draw.by_ratio(20.0, 45.0), draw.between(0.02, 0.08));
    let (mut level, mut cools, sign) = (draw.between(0.0, 1.0), draw.chance(0.5), draw.sign());
    let mut pace = 1.0;
    let room = stand.series(|_| {
        let takes = period * if cools { -blows } else { 1.0 - blows };
        level += pace / (takes * stand.rate_hz);
        if !(0.0..=1.0).contains(&level) {
            level = level.clamp(0.0, 1.0);
            cools = !cools;
            // The sun, a door: no two of them take quite as long.
            pace = draw.between(0.85, 1.15);
        }
        sign * level
    });
    about_mean(&stand.lagged(&room, draw.by_ratio(0.3, 1.5)))
}

/// A level that turns over with a period.
pub(super) fn square_wave(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let period = draw.between(5.0, 40.0);
    in_time(stand, |t| 2.0 * one_if((t / period).fract() < 0.5) - 1.0)
}

/// A level that runs up and falls back.
pub(super) fn sawtooth(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let period = draw.between(20.0, 90.0);
    in_time(stand, |t| (t / period).fract() - 0.5)
}

/// A level that is another at random times.
pub(super) fn jumps(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    in_spells(stand, (0.0, 0.0), |_| {
        (draw.normal(), 25.0 * draw.exponential())
    })
}

/// A random walk for a part of the run.
pub(super) fn walk_for_a_while(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let length = stand.seconds * draw.between(0.15, 0.4);
    let start = draw.between(0.05 * stand.seconds, 0.95 * stand.seconds - length);
    let mut y = 0.0;
    in_time(stand, |t| {
        if (start..start + length).contains(&t) {
            y += draw.normal();
        }
        y
    })
}
