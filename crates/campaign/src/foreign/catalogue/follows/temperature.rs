//! Signals that follow a temperature.

use super::super::super::prelude::*;

/// A reference whose drift with temperature is a share of the supply: the product of both about their means. A term in
/// one of them alone is not in it.
pub(super) fn by_supply(stand: &Stand, axis: usize) -> Vec<f64> {
    let temperature = about_mean(&stand.world.temperature[axis]);
    let supply = about_mean(&stand.world.supply);
    each_pair(&temperature, &supply, |t, u| t * u)
}

/// A mount that creeps in small jerks while it expands: each turns the part there and back.
pub(super) fn creaks(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    // Without the flutter of the room.
    let half = (2.0 * stand.rate_hz) as usize;
    let pace = each(&pace(&stand.world.temperature[axis], half), f64::abs);
    let total: f64 = pace.iter().sum();
    let (jerks, width) = (draw.between(30.0, 90.0), draw.between(0.4, 1.5));
    let length = (width * stand.rate_hz) as usize;
    let mut signal = vec![0.0; pace.len()];
    for (i, p) in pace.iter().enumerate() {
        if draw.chance(jerks * p / total) {
            let size = draw.signed(0.6, 1.4);
            let jerk = |k| size * (TAU * (k as f64 + 0.5) / length as f64).sin();
            add_at(&mut signal, i, (0..length).map(jerk));
        }
    }
    signal
}

/// What yields to the warmth until it lies against a stop, at either end: tanh of the temperature. The heater has a
/// thermostat.
pub(super) fn warm_end(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let (middle, width) = (draw.between(0.3, 0.7), draw.between(0.02, 0.08));
    let places = within_range(&stand.world.temperature[axis]);
    each(&places, |place| ((place - middle) / width).tanh())
}

/// Thermal hysteresis: layers that slip on each other (Prandtl and Ishlinskii), so that the bias takes another branch cooling
/// than it took warming. The straight line through the loops is taken off, for the part is compensated.
pub(super) fn branches(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    const LAYERS: usize = 4;
    lamp(draw, stand);
    let own = &stand.world.temperature[axis];
    let span = swing(own);
    let from_first: Vec<f64> = each(own, |t| t - own[0]);
    let layers: [(f64, f64); LAYERS] =
        std::array::from_fn(|_| (span * draw.between(0.03, 0.2), draw.between(0.5, 1.5)));
    without_line(&behind_plays(&from_first, &layers), &from_first)
}

/// Activity dips: a vibrating part has other modes than the one that is driven, and their frequencies move with the
/// temperature at another pace. Where two meet, energy goes over and the rate is off, by the law of a resonance in the
/// temperature, either way and in a range of some tenths of a degree.
pub(super) fn dips(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let temperature = &stand.world.temperature[axis];
    let (low, high) = extremes(temperature);
    let span = high - low;
    let count = 2 + draw.of_many(4);
    // One in each of as many equal ranges: dips do not lie on each other.
    let mut dips = vec![0.0; temperature.len()];
    for i in 0..count {
        let place = (i as f64 + draw.between(0.2, 0.8)) / count as f64;
        let (at, width) = (low + span * place, span * draw.by_ratio(0.01, 0.05));
        let depth = draw.signed(0.5, 1.5);
        let dip = |t: f64| depth / (1.0 + ((t - at) / width).powi(2));
        add_at(&mut dips, 0, each(temperature, dip));
    }
    dips
}

/// Firmware that corrects by a thermometer of few bits: what of the slope is left within its steps.
pub(super) fn coarse(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let (step, first) = (draw.by_ratio(0.5, 2.0), draw.between(0.0, 1.0));
    let sign = draw.sign();
    each(&stand.world.temperature[axis], |t| {
        let steps = t / step + first;
        sign * (steps - steps.round())
    })
}

/// The part is kept warm by a heater with a thermostat, whose current shifts the ground while it is on, and warms the
/// regulator, which takes longer to cool. The room's air is not still, and so no two periods are alike.
pub(super) fn heater(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let air = stand.wander(draw, 0.1, 10.0);
    // Shares of what the heater warms by if it is left on.
    let (asked, play) = (draw.between(0.35, 0.65), draw.by_ratio(0.05, 0.3));
    let takes = draw.by_ratio(4.0, 20.0);
    let (mut on, mut warm) = (draw.chance(0.5), asked);
    let heats = each(&air, |air| {
        let heats = one_if(on);
        warm += (heats + air - warm) / (takes * stand.rate_hz);
        on = warm < asked + if on { 0.5 } else { -0.5 } * play;
        (heats, warm - asked)
    });
    let (current, warmth): (Vec<f64>, Vec<f64>) = heats.into_iter().unzip();
    let full = draw.between(5.0, 15.0);
    for own in &mut stand.world.temperature {
        *own = each_pair(own, &warmth, |t, w| t + full * w);
    }
    let (tail, sign) = (draw.between(0.2, 0.8), draw.sign());
    let regulator = stand.lagged(&current, draw.by_ratio(1.0, 6.0));
    about_mean(&each_pair(&current, &regulator, |c, r| {
        sign * (c + tail * r)
    }))
}

/// A heater touches the part's case on one side: while it warms, heat flows through and bends it, by the rate at which the
/// temperature rises. It cools by air on all sides, evenly, and is then not bent. The heater has a thermostat.
pub(super) fn one_side(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let case = stand.lagged(&stand.world.temperature[axis], draw.by_ratio(0.1, 1.0));
    let before = (draw.between(0.5, 2.0) * stand.rate_hz) as usize;
    stand.series(|i| (case[i] - case[i.saturating_sub(before)]).max(0.0))
}

/// A sheet under stress, of a housing or of a bimetal disc, snaps over at a temperature and back at a lower one
/// (Timoshenko 1925), a little after the thermometer: two places of the mount, by where the temperature last came from.
pub(super) fn disc(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let sheet = stand.lagged(&stand.world.temperature[axis], draw.by_ratio(0.3, 3.0));
    let (low, high) = extremes(&sheet);
    let at = |share: f64| low + share * (high - low);
    let (over, back) = (at(draw.between(0.5, 0.7)), at(draw.between(0.25, 0.45)));
    let snapped = carry(false, &sheet, |was, t| t > if was { back } else { over });
    each(&snapped, one_if)
}

/// A bridge that is fed with alternating current and balanced at one temperature: what comes out is a tone as large as the
/// temperature is off it, whose phase turns over there. The heater has a thermostat.
pub(super) fn bridge(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let temperature = &stand.world.temperature[axis];
    let balanced = mean(temperature) + 0.1 * swing(temperature) * draw.between(-1.0, 1.0);
    let (pitch, first) = (draw.by_ratio(0.8, 9.5), draw.phase());
    let tone = in_time(stand, |t| (first + TAU * pitch * t).sin());
    each_pair(temperature, &tone, |t, s| (t - balanced) * s)
}

/// The near side of the part has the temperature at once and the far side later, and what they differ by bends it: by the
/// lamp, for what bends slowly is hidden by a random walk.
pub(super) fn gradient(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    lamp(draw, stand);
    let near = &stand.world.temperature[axis];
    let far = stand.lagged(near, draw.by_ratio(0.5, 3.0));
    each_pair(near, &far, |t, f| t - f)
}

/// A part that compensates its temperature by a table that it reads without interpolating: between two entries the rate
/// runs off by the slope that is left, at the next entry it is put right.
pub(super) fn teeth(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    let temperature = &stand.world.temperature[axis];
    let (low, high) = extremes(temperature);
    let entry = (high - low).max(1e-9) / draw.between(4.0, 10.0);
    let first = draw.between(0.0, 1.0);
    each(temperature, |t| ((t - low) / entry + first).fract() - 0.5)
}

/// The capacitor that holds the sample leaks while the firmware is busy with something else, whose loop slips past this one:
/// the wait grows from reading to reading until it is a whole loop and begins anew. The leak is twofold by ten degrees, and
/// the loop is timed by a resistance and a capacitance, which wander.
pub(super) fn droop(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let slips = draw.sign() * draw.by_ratio(0.15, 3.0);
    let size = slips.abs() * draw.by_ratio(0.01, 0.05);
    let tau = draw.by_ratio(5.0, 60.0);
    let off = stand.wander(draw, size, tau);
    let waits = carry(draw.between(0.0, 1.0), &off, |wait, off| {
        (wait + (slips + off) / stand.rate_hz).rem_euclid(1.0)
    });
    let sign = draw.sign();
    let own = &stand.world.temperature[axis];
    about_mean(&each_pair(own, &waits, |t, wait| {
        sign * wait * ((t - own[0]) / 10.0).exp2()
    }))
}

/// Quadrature, which wanders, leaks into the rate by the sine of the demodulator's phase error. That was trimmed at one
/// temperature and goes with what the temperature is off it.
pub(super) fn quadrature(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let tau = draw.by_ratio(2.0, 20.0);
    let wanders = stand.wander(draw, 1.0, tau);
    each_pair(&wanders, &from_trim(draw, stand, axis), |q, p| q * p)
}

/// A compensation by a table over temperature without interpolation: at each boundary the bias jumps, and each entry has an
/// error of its own beside what the temperature does within its reach. The straight line is right.
pub(super) fn entries(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let own = &stand.world.temperature[axis];
    let (low, high) = extremes(own);
    let wide = (high - low).max(1e-9) / draw.between(4.0, 10.0);
    let (first, slope) = (draw.between(0.0, 1.0), draw.between(-1.0, 1.0));
    let errors: [f64; 12] = std::array::from_fn(|_| draw.normal());
    let off = each(own, |t| {
        let place = (t - low) / wide + first;
        errors[(place as usize).min(errors.len() - 1)] + slope * (place.fract() - 0.5)
    });
    without_line(&off, own)
}

/// Heat that flows through the package bends it: by the pace at which the temperature rises, behind two of its layers.
pub(super) fn warming(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    lamp(draw, stand);
    let pace = changes(&stand.world.temperature[axis]);
    let layer = draw.by_ratio(0.3, 1.0);
    let flows = stand.lagged(&stand.lagged(&pace, layer), layer);
    either_way(draw, &flows)
}

/// The glass point of a moulding compound: beyond it the package strains the element by another slope. The part was
/// compensated by a straight line.
pub(super) fn softens(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let own = &stand.world.temperature[axis];
    let (low, high) = extremes(own);
    // Not in the middle, where a parabola comes near it.
    let from_end = draw.between(0.15, 0.35);
    let at = low + (high - low) * draw.either(from_end, 1.0 - from_end);
    let sign = draw.sign();
    let beyond = each(own, |t| sign * (t - at).max(0.0));
    without_line(&beyond, own)
}

/// The thermometer sits at the heater, and the die far behind it. By minutes it would be, but what moves so slowly stays weak
/// beside a random walk (d' 12): a small heater that is switched within seconds, and a die that is as late.
pub(super) fn die(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    lit(draw, stand, (1.5, 8.0), (1.0, 3.0));
    let late = stand.lagged(&stand.world.temperature[axis], draw.by_ratio(2.0, 8.0));
    either_way(draw, &about_mean(&late))
}

/// What follows the temperature only after it has moved through the play.
pub(super) fn backlash(stand: &Stand, axis: usize) -> Vec<f64> {
    let temperature = &stand.world.temperature[axis];
    let play = 0.4 * swing(temperature);
    let held = carry(temperature[0], temperature, |held, t| {
        held.clamp(t - play, t + play)
    });
    // Minus what a linear term takes.
    each_pair(&held, temperature, |held, t| held - 0.6 * t)
}

/// How fast the temperature rises.
pub(super) fn rate_of_temperature(stand: &Stand, axis: usize) -> Vec<f64> {
    let half = (2.0 * stand.rate_hz) as usize;
    pace(&stand.world.temperature[axis], half)
}

/// The motor's command times what the temperature is off its mean.
pub(super) fn by_duty(stand: &Stand, axis: usize) -> Vec<f64> {
    let temperature = about_mean(&stand.world.temperature[axis]);
    each_pair(&stand.world.duty, &temperature, |d, t| d * t)
}

/// An oscillator in the read-out that drifts with temperature and beats with the sampling.
pub(super) fn drifting_tone(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    let (from, span) = (draw.between(0.5, 6.0), draw.signed(0.4, 3.0));
    let places = within_range(&stand.world.temperature[axis]);
    let pitches = each(&places, |place| from + span * place);
    tone(draw.phase(), &pitches, stand.rate_hz)
}
