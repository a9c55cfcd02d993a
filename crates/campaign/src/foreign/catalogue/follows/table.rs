//! What a part that turns with a rate table gets wrong by the rate, the angle or the sense.

use super::super::super::prelude::*;

/// A multiplexed converter that comes to this axis a part of a frame after the encoder was read, or before: off by that
/// time's change of the rate. The table's drive ramps from rate to rate with one acceleration.
pub(super) fn converted_late(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = ramped_table(draw, stand);
    either_way(draw, &changes(&rate))
}

/// A scale factor that follows temperature: the rate times what the temperature is off that of the calibration.
pub(super) fn scale(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    let rate = turned(draw, stand, (1.0, 5.0));
    let temperature = from_trim(draw, stand, axis);
    either_way(draw, &each_pair(&rate, &temperature, |r, t| r * t))
}

/// Firmware that multiplies the rate in a word that is too narrow: beyond a rate the product wraps around, and the reading
/// is off by the whole range of the word, one way turning one way, and the other way the other.
pub(super) fn overflow(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    // Where the word ends, and the reading's noise, over the rate at full duty.
    let (ends, noise) = (draw.between(0.35, 0.65), draw.by_ratio(0.005, 0.03));
    let sign = draw.sign();
    each(&rate, |r| {
        -sign * ((r + noise * draw.normal()) / (2.0 * ends)).round()
    })
}

/// An odd term of the scale factor: its cube, less the straight line that is right at the rate at which it was calibrated.
pub(super) fn cubed_rate(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    let (calibrated, sign) = (draw.between(0.5, 0.9), draw.sign());
    each(&rate, |r| sign * r * (r * r - calibrated * calibrated))
}

/// Two converters take the readings in turn; at rest they are trimmed alike, and their gains are not. The part is clocked a
/// little slower than the frames, so that now and then one is read twice running.
pub(super) fn converters(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    let (mut turn, pace) = (draw.between(0.0, 2.0), draw.between(0.8, 0.995));
    each(&rate, |r| {
        turn = (turn + pace) % 2.0;
        if turn < 1.0 { r } else { -r }
    })
}

/// At one temperature the sense mode crosses a mode of the frame, and the scale factor goes through the resonance, of
/// whichever phase the demodulator has.
pub(super) fn modes(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let rate = turned(draw, stand, DWELL);
    let own = &stand.world.temperature[axis];
    let (low, span) = (extremes(own).0, swing(own));
    let middle = low + span * draw.between(0.3, 0.7);
    let half_width = span * draw.by_ratio(0.04, 0.2);
    let (sin, cos) = draw.phase().sin_cos();
    each_pair(own, &rate, |t, r| {
        let off = (t - middle) / half_width;
        r * (sin + cos * off) / (1.0 + off * off)
    })
}

/// A logger keeps differences in words too short for the table's ramps, and a whole reading now and then: what a difference
/// could not hold is missing until the next of those.
pub(super) fn differences(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, (1.0, 5.0));
    let changes = changes(&rate_of_table(draw, stand));
    let (low, high) = extremes(&changes);
    let most = low.abs().max(high) * draw.between(0.1, 0.5);
    let whole = (draw.by_ratio(1.0, 8.0) * stand.rate_hz).round() as usize;
    let mut off = 0.0;
    stand.series(|i| {
        let told = changes[i].clamp(-most, most);
        let keeps = one_if(i % whole != 0);
        off = keeps * (off + (told - changes[i]));
        off
    })
}

/// Lamps about the stand shine on a die without a lid: photo current while the part is turned to one of them, and the
/// housing shades it else.
pub(super) fn lamps(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    let angle = angle_of_table(&rate, draw.by_ratio(0.1, 0.4), stand.rate_hz);
    let (shade, sign) = (draw.between(-0.2, 0.6), draw.sign());
    let mut light = vec![0.0; angle.len()];
    for _ in 0..1 + draw.of_many(3) {
        let (place, bright) = (draw.phase(), draw.between(0.3, 1.0));
        let shines = |a: f64| sign * bright * ((a + place).cos() - shade).max(0.0);
        add_at(&mut light, 0, each(&angle, shines));
    }
    about_mean(&light)
}

/// The loop that holds the drive's amplitude goes to and fro between two limits, and the scale factor with it: of a rate, a
/// swing as large as the rate.
pub(super) fn limit_cycle(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    let pace = 1.0 / draw.by_ratio(0.5, 6.0);
    let wavers = stand.wander(draw, 0.1, 5.0);
    let mut phase = draw.between(0.0, 1.0);
    each_pair(&rate, &wavers, |r, w| {
        phase = (phase + pace * (1.0 + w) / stand.rate_hz).rem_euclid(1.0);
        r * (4.0 * (phase - 0.5).abs() - 1.0)
    })
}

/// Firmware that takes readings which stay within a window for a while for a standstill, and leads its zero there: a steady
/// turn is eaten up, and comes back with the other sign in the next.
pub(super) fn steady(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, (1.5, 7.0));
    let waits = (draw.between(0.4, 1.5) * stand.rate_hz) as usize;
    let window = draw.by_ratio(0.02, 0.1);
    let follows = 1.0 / (draw.by_ratio(0.5, 3.0) * stand.rate_hz);
    let mut zero = 0.0;
    stand.series(|i| {
        if i >= waits && swing(&rate[i - waits..=i]) < window {
            zero += follows * (rate[i] - zero);
        }
        -zero
    })
}

/// Deflection, whichever way, charges the surfaces that the electrodes come near to; they are traps of several depths, so
/// that the charge is lost as a logarithm of time.
pub(super) fn charged(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, (1.0, 5.0));
    let (fills, sign) = (draw.by_ratio(0.3, 3.0), draw.sign());
    let (fastest, apart) = (draw.by_ratio(0.5, 2.0), draw.between(2.0, 4.0));
    traps(rate.len(), sign, |k| {
        let empties = 1.0 / (fastest * apart.powi(k));
        let grows = |r: f64, full: f64| fills * r * r * (1.0 - full) - empties * full;
        carry(0.0, &rate, |full, r| full + grows(r, full) / stand.rate_hz)
    })
}

/// A part that takes its wide range beyond a rate, and its narrow one again below a lower rate: the wide one has an offset
/// and a gain of its own.
pub(super) fn range(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    let up = draw.between(0.3, 0.6);
    let down = up * draw.between(0.4, 0.8);
    let (offset, gain) = (draw.sign(), draw.between(-1.0, 1.0));
    let mut wide = false;
    about_mean(&each(&rate, |r| {
        wide = r.abs() > if wide { down } else { up };
        if wide { offset + gain * r } else { 0.0 }
    }))
}

/// An even term of the scale factor: turning one way a little too much is read, the other way too little.
pub(super) fn squared_rate(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    either_way(draw, &about_mean(&each(&rate, |r| r * r)))
}

/// A stray magnetic field: the bias goes round with the table, and, by soft iron, a little twice as fast.
pub(super) fn heading(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    let (full, soft) = (draw.by_ratio(0.1, 0.4), draw.between(0.0, 0.4));
    let (first, second) = (draw.phase(), draw.phase());
    let angle = angle_of_table(&rate, full, stand.rate_hz);
    about_mean(&each(&angle, |a| {
        (a + first).cos() + soft * (2.0 * a + second).cos()
    }))
}

/// Dielectric absorption of a ceramic capacitor in the signal's way, which strong fields polarise out of proportion:
/// relaxations of four time constants, an octave or two apart, carry on what strong rates have left.
pub(super) fn remembered(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, (1.0, 5.0));
    let (shortest, apart) = (draw.by_ratio(0.3, 1.0), draw.between(2.5, 4.0));
    let strong = each(&rate, |r| r.powi(3));
    traps(rate.len(), draw.sign(), |k| {
        stand.lagged(&strong, shortest * apart.powi(k))
    })
}

/// Firmware that takes the mean of a few readings for the zero whenever the table stands still: from then until the next
/// rest all readings are off by what those were.
pub(super) fn zeroed(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const SETTLES_S: f64 = 1.0;
    let turning = draw.chance(0.5);
    let dwell = draw.by_ratio(3.0, 9.0);
    let levels = ((0.5 * dwell, 1.5 * dwell), (0.2, 1.0));
    strokes(draw, stand, turning, levels);
    let settles = (SETTLES_S * stand.rate_hz).round() as usize;
    let (mut zero, mut rests) = (0.0, 0);
    about_mean(&each(&stand.world.duty, |d| {
        rests = if d == 0.0 { rests + 1 } else { 0 };
        if rests == settles {
            zero = draw.normal();
        }
        zero
    }))
}

/// A table whose axis is not square to its face: a level axis sees the sine of the angle times the rate.
pub(super) fn wobble(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    let (full, first) = (draw.by_ratio(0.1, 0.5), draw.phase());
    let angle = angle_of_table(&rate, full, stand.rate_hz);
    about_mean(&each_pair(&angle, &rate, |a, r| r * (a + first).sin()))
}

/// The encoder is stamped by another clock, which drifts away until it is set, and is then led back faster, past the right
/// time: what the rate has changed by in the time between the two is left, now with one sign and now with the other.
pub(super) fn clock(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = ramped_table(draw, stand);
    let (away, back) = (draw.by_ratio(20.0, 90.0), draw.between(0.2, 0.6));
    let (mut apart, mut sense, mut pace) = (draw.between(-1.0, 1.0), draw.sign(), 1.0);
    let drifts = draw.sign();
    each(&changes(&rate), |change| {
        let takes = if sense == drifts { away } else { back * away };
        apart += 2.0 * sense * pace / (takes * stand.rate_hz);
        if apart.abs() > 1.0 {
            // No two of them are set alike.
            (sense, pace) = (-apart.signum(), draw.between(0.7, 1.4));
            apart = apart.clamp(-1.0, 1.0);
        }
        apart * change
    })
}

/// Firmware that takes whatever is slower than a threshold for bias, and lets its zero follow it: of a slow turn it takes
/// off the more the longer that lasts, and is off by as much in the next fast one, until it turns slowly again.
pub(super) fn slow_turns(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let slow = draw.between(0.1, 0.25);
    // Long turns, of which the zero would keep most, stay weak beside a random walk.
    stand.world.duty = stand.held(draw, (1.0, 5.0), |d| {
        let level = match d.of_many(5) {
            0 => 0.0,
            1 | 2 => slow * d.between(0.4, 0.9),
            _ => d.between(2.0 * slow, 1.0),
        };
        in_steps(d.sign() * level)
    });
    let rate = rate_of_table(draw, stand);
    let follows = 1.0 / (draw.by_ratio(0.4, 2.0) * stand.rate_hz);
    let zero = carry(0.0, &rate, |zero, r| {
        let taken = if r.abs() < slow { follows } else { 0.0 };
        zero + taken * (r - zero)
    });
    each(&zero, |zero| -zero)
}

/// Traps in a dielectric that the electrode's side of the rate fills and the other empties, each in its own time, some
/// octaves of them, so that it goes as a logarithm of time; while the rate is low they stay as they are. It knows the sense
/// alone.
pub(super) fn sense(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, (1.0, 5.0));
    let (least, fastest) = (draw.between(0.1, 0.3), draw.by_ratio(0.3, 0.8));
    let (apart, sign) = (draw.between(1.6, 2.5), draw.sign());
    traps(rate.len(), sign, |k| {
        let takes = 1.0 / (fastest * apart.powi(k) * stand.rate_hz);
        carry(0.0, &rate, |full, r| {
            let goes = if r.abs() > least { takes.min(1.0) } else { 0.0 };
            full + goes * (r.signum() - full)
        })
    })
}

/// Cogging of a motor of many poles, more than ten a second: the sampling folds it to anywhere, at each speed to another
/// place, and its overtone to a third. As torque, by inertia: slow ones are the larger, and none is at rest.
pub(super) fn folded_cogging(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    let poles = angle_of_table(&rate, draw.by_ratio(20.0, 90.0), stand.rate_hz);
    let (corner, overtone) = (draw.between(0.1, 0.3), draw.between(0.2, 0.7));
    let [first, second] = [0, 1].map(|_| draw.phase());
    each_pair(&poles, &rate, |a, r| {
        let torque = (a + first).cos() + overtone * (2.0 * a + second).cos();
        r / (r * r + corner * corner) * torque
    })
}

/// Commands of a table that is indexed: it rests at a heading, and goes on by a few parts of a turn, either way.
fn indexed(draw: &mut Draw, stand: &mut Stand, full: f64) {
    let part = 1.0 / draw.one_of(&[4.0, 6.0, 8.0, 12.0]);
    let mut duty = Vec::with_capacity(stand.samples());
    while duty.len() < stand.samples() {
        let rests = (draw.between(1.5, 7.0) * stand.rate_hz) as usize;
        duty.extend(std::iter::repeat_n(0.0, rests));
        let (turn, level) = (part * (1 + draw.of_many(3)) as f64, draw.between(0.3, 1.0));
        let takes = (turn / full / level * stand.rate_hz).ceil();
        let command = in_steps(draw.sign() * turn / full / takes * stand.rate_hz);
        duty.extend(std::iter::repeat_n(command, takes as usize));
    }
    duty.truncate(stand.samples());
    stand.world.duty = duty;
}

/// What the ground turns by, seen by a level axis: the sine of the heading, from north. The earth's own 4e-3 deg/s are too
/// little for a part of this class; as strong as asked for, it is a turning platform that carries a leaning table.
pub(super) fn ground(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let full = draw.by_ratio(0.2, 0.5);
    indexed(draw, stand, full);
    let rate = rate_of_table(draw, stand);
    let north = draw.phase();
    let angle = angle_of_table(&rate, full, stand.rate_hz);
    each(&angle, |angle| (angle - north).sin())
}

/// Sum of what traps of several depths hold, each a series by its number.
fn traps(samples: usize, sign: f64, of: impl Fn(i32) -> Vec<f64>) -> Vec<f64> {
    const TRAPS: i32 = 4;
    let mut all = vec![0.0; samples];
    for k in 0..TRAPS {
        add_at(&mut all, 0, each(&of(k), |t| sign * t));
    }
    about_mean(&all)
}

/// A buffer of some readings that is sent backwards: while the table's drive ramps from rate to rate, each block runs against
/// the time.
pub(super) fn backwards(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = ramped_table(draw, stand);
    let length = 4 + draw.of_many(9);
    let last = rate.len() - 1;
    let sent = |i: usize| {
        let block = i / length * length;
        rate[(block + length - 1 - (i - block)).min(last)] - rate[i]
    };
    (0..=last).map(sent).collect()
}
