//! Noise whose variance changes: by what is recorded, by its own course, or by its last readings.

use super::super::super::prelude::*;

/// What noise that feeds its own size makes of independent draws: variance[i] = 1 - stays + gain last^2 + (stays - gain)
/// variance[i-1], with the series itself.
fn fed(gain: f64, stays: f64, independent: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let gain = gain.min(stays);
    let fed = carry((1.0f64, 1.0f64), independent, |(variance, last), z| {
        let next = 1.0 - stays + gain * last * last + (stays - gain) * variance;
        (next, next.sqrt() * z)
    });
    fed.into_iter().unzip()
}

/// A part that ages in the course of the record, or settles: by so many decibels an hour its noise goes up or down.
pub(super) fn ramp(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (sign, n) = (draw.sign(), stand.samples() as f64);
    stand.series(|i| sign * (i as f64 / n - 0.5))
}

/// Leakage that doubles every so many degrees: so does the variance of its noise.
pub(super) fn warmth(stand: &Stand, axis: usize) -> Vec<f64> {
    let own = about_mean(&stand.world.temperature[axis]);
    let span = swing(&own);
    each(&own, |t| t / span)
}

/// A slip ring whose brushes ride over one to three worn places a turn, at which the contact is noisy whether it turns or
/// not. The programme turns slowly enough to tell them.
pub(super) fn worn(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let rate = turned(draw, stand, DWELL);
    let full = draw.by_ratio(0.1, 0.5);
    let places: Vec<(f64, f64)> = (0..1 + draw.of_many(3))
        .map(|_| (draw.between(0.0, 1.0), draw.between(0.05, 0.15)))
        .collect();
    each(&angle_of_table(&rate, full, stand.rate_hz), |angle| {
        let turns = angle / TAU;
        let on = |(at, wide): &(f64, f64)| (turns - at).rem_euclid(1.0) < *wide;
        one_if(places.iter().any(on))
    })
}

/// How much of its input's noise a regulator lets through, by sample: the less is left above its output, the less its loop
/// can hold it down, by a factor e for every few millivolts. The loads are of many sizes.
pub(super) fn near_end(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let most = draw.between(0.05, 0.15);
    loaded(draw, stand, most, (3.0, 25.0));
    let fold = most * draw.between(0.1, 0.4);
    let supply = &stand.world.supply;
    let least = extremes(supply).0;
    each(supply, |u| ((least - u) / fold).exp())
}

/// Air whistles at an edge of the turning table while its speed is within a band, and shakes the element. A tone that sounds
/// holds on beyond the band in which it begins.
pub(super) fn whistle(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let speed = stand.lagged(&stand.world.duty, draw.by_ratio(0.5, 3.0));
    let (low, wide) = (draw.between(0.1, 0.4), draw.between(0.1, 0.25));
    let (high, holds) = (low + wide, wide * draw.between(0.2, 0.5));
    let sounds = carry(false, &speed, |on, s| {
        let beyond = if on { holds } else { 0.0 };
        (low - beyond..high + beyond).contains(&s.abs())
    });
    stand.lagged(&each(&sounds, one_if), draw.by_ratio(0.1, 0.6))
}

/// How much is left, by sample, of what the last changes of the motor's command have stirred up: brushes that leave their
/// seat spark until they have found another, the more the larger the change, whether the motor runs then or not. The
/// command changes by steps.
pub(super) fn after_changes(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    stand.world.duty = stand.held(draw, (6.0, 30.0), |d| in_steps(d.between(-1.0, 1.0)));
    stirred(&stand.world.duty, draw.by_ratio(0.8, 4.0), stand.rate_hz)
}

/// Noise whose size is exp(size z / 2) for the swing z before it, itself of variance 1: the law of its variance, with the
/// series.
fn louder(size: f64, independent: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let mut last = 0.0;
    let louder = each(independent, |z: f64| {
        let variance: f64 = (size * std::mem::replace(&mut last, z)).exp();
        (variance, variance.sqrt() * z)
    });
    louder.into_iter().unzip()
}

/// Where an amplifier that a shock has driven to its stop does not answer: 1 for a while after each shock, by sample.
fn blocked(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let lasts = draw.by_ratio(0.4, 1.5) * stand.rate_hz;
    let mut all = vec![0.0; stand.samples()];
    for (at, hard) in shocks(draw, stand) {
        // The harder the shock, the longer.
        let length = (lasts * hard.abs()).ceil() as usize;
        let after = all.iter_mut().skip(at + 1);
        after.take(length).for_each(|b| *b = 1.0);
    }
    all
}

/// A reading is the mean of as many looks at the part as fit before it has to go out: one to four, by where the clock of
/// the looks stands, which is no multiple of the readings'.
fn looks(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (mut place, pace) = (draw.between(0.0, 1.0), draw.between(0.1, 0.9));
    stand.series(|_| {
        place = (place + pace).fract();
        1.0 + (4.0 * place).floor()
    })
}

/// Brushes that spark while the current changes: each change of the command by its size, then dying away.
pub(super) fn sparks(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, (3.0, 15.0));
    stirred(&stand.world.duty, draw.by_ratio(0.4, 2.0), stand.rate_hz)
}

/// A scale factor that is noisy: the noise grows with the rate. The table is heavy, and follows its motor late.
pub(super) fn rate_squared(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = stand.lagged(&stand.world.duty, draw.by_ratio(3.0, 12.0));
    each(&rate, |r| r * r)
}

/// A fan coil that blows until its thermostat is content, on one of three steps, and runs up and down within seconds. The
/// pressure of turbulence goes with the square of the speed, and its variance with the fourth power.
pub(super) fn fan(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (period, blows) = (draw.by_ratio(12.0, 80.0), draw.between(0.2, 0.6));
    let runs_up = draw.by_ratio(0.5, 3.0);
    let first = (draw.chance(0.5), 1.0);
    let asked = in_spells(stand, (first, 0.0), |(on, _)| {
        let step = draw.one_of(&[0.6, 0.8, 1.0]);
        let share = if on { 1.0 - blows } else { blows };
        ((!on, step), period * share * draw.between(0.75, 1.25))
    });
    let asked = each(&asked, |(on, step)| one_if(on) * step);
    each(&stand.lagged(&asked, runs_up), |s| s.powi(4))
}

/// Helium that is blown about the stand now and then, as for a leak test, goes through the lid and into the cavity behind
/// it, and out again: a lag for each. The gas damps the element, and the noise of damping goes with it.
pub(super) fn gas(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (lid, cavity) = (draw.by_ratio(8.0, 30.0), draw.by_ratio(20.0, 90.0));
    // Once a record would be a stretch of more noise.
    let outside = stand.by_turns(draw, true, (15.0, 120.0), |d| d.between(0.5, 1.0));
    stand.lagged(&stand.lagged(&outside, lid), cavity)
}

/// A bus or a radio that is busy for a moment every few seconds, and adds noise as long as it is; its clock is another than
/// that of the readings.
pub(super) fn bursts(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let period = draw.by_ratio(1.5, 10.0);
    let busy = draw.between(0.06, 0.3);
    let first = draw.between(0.0, 1.0);
    in_time(stand, |t| one_if((first + t / period).fract() < busy))
}

/// A variance that swings about its mean.
pub(super) fn swinging(draw: &mut Draw, stand: &Stand) -> Shape {
    let period = draw.between(30.0, 150.0);
    let swing = in_time(stand, |t| (TAU * t / period).sin());
    variance(0.999, move |depth| {
        each(&swing, |s| (1.0 + depth * s).max(1e-3))
    })
}

/// A variance that grows through the run. The period that is drawn is that of the one that swings.
pub(super) fn growing(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    draw.between(30.0, 150.0);
    in_time(stand, |t| t / stand.seconds)
}

/// Noise that comes for seconds and rests for longer.
pub(super) fn spells(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let rests = (false, draw.between(5.0, 40.0));
    let on = in_spells(stand, rests, |on| {
        let (least, most) = if on { (20.0, 60.0) } else { (2.0, 10.0) };
        (!on, draw.between(least, most))
    });
    each(&on, one_if)
}

/// Where an axis's temperature is between the lowest and the highest of the run. The spell that is drawn is that of noise
/// in bursts.
pub(super) fn place_of_temperature(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    draw.between(5.0, 40.0);
    within_range(&stand.world.temperature[axis])
}

/// A logarithm of the size that wanders, within a time between these, s.
pub(super) fn wandering_size(draw: &mut Draw, stand: &Stand, within_s: (f64, f64)) -> Vec<f64> {
    let tau = draw.by_ratio(within_s.0, within_s.1);
    stand.wander(draw, 1.0, tau)
}

/// A read-out that serves something else in between, or converters that take turns: every few samples are noisier.
pub(super) fn every_few(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let every = 2 + draw.of_many(6);
    let phase = draw.of_many(every);
    stand.series(|i| one_if(i % every == phase))
}

/// Noise that swells and ebbs with a period.
pub(super) fn swell(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let swell = TAU / (draw.by_ratio(5.0, 150.0) * stand.rate_hz);
    let first = draw.phase();
    stand.series(|i| (first + swell * i as f64).sin())
}

/// A gyro reads its rate as a carrier's size; what the carrier leaks into the read-out, its quadrature, is as large as the
/// acceleration that pushes the two plates apart, and the phase of the demodulator is never quiet: noise whose size is
/// the acceleration of the same instant.
pub(super) fn by_acceleration(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let force = shaking(draw, stand);
    let square = mean_square(&force);
    each(&force, |a| a * a / square)
}

/// An amplifier that a shock has driven to its stop gives out nothing.
pub(super) fn silenced(draw: &mut Draw, stand: &mut Stand) -> Shape {
    let blocked = blocked(draw, stand);
    variance(f64::INFINITY, move |size| {
        each(&blocked, |b| 1.0 / (1.0 + size * b))
    })
}

/// A mean of a share of the noise over as many looks as fit.
pub(super) fn averaged(draw: &mut Draw, stand: &Stand) -> Shape {
    let looks = looks(draw, stand);
    variance(1.0, move |share| {
        each(&looks, |l| 1.0 - share * (1.0 - 1.0 / l))
    })
}

/// White noise that goes through a law of its own variance, by size: `of` gives the law with the series.
fn through(
    white: Vec<f64>,
    of: impl Fn(f64, &[f64]) -> (Vec<f64>, Vec<f64>) + Copy + 'static,
) -> Shape {
    let known = white.clone();
    noise(
        f64::INFINITY,
        move |_, size| Known::Variance(of(size, &known).0),
        move |_, _, size| of(size, &white).1,
    )
}

/// A gain control that is pumped by what it has just passed: the variance of a reading goes with the square of the one
/// before (Engle 1982), and all that stays of a size is what the last reading gave. The spectrum stays white.
pub(super) fn remembering(draw: &mut Draw, stand: &Stand) -> Shape {
    through(white(draw, stand.samples()), |share, white| {
        fed(share, share.min(0.95), white)
    })
}

/// A series over the root of the mean of its law of variance: the variance of a run is seldom 1, and what it adds to it
/// would be told before its shape.
fn evened((law, series): (Vec<f64>, Vec<f64>), sign: f64) -> (Vec<f64>, Vec<f64>) {
    let size = mean(&law).sqrt();
    (law, each(&series, |x| sign * x / size))
}

/// A large swing makes the next ones larger, and the unrest dies down over some tens of readings (GARCH, Bollerslev 1986).
/// The spectrum stays white.
pub(super) fn feeding(draw: &mut Draw, stand: &Stand) -> Shape {
    let stays = 1.0 - draw.by_ratio(0.02, 0.1);
    through(white(draw, stand.samples()), move |gain, white| {
        evened(fed(gain, stays, white), 1.0)
    })
}

/// An amplifier whose working point is carried along by what it last gave out: after a swing to one side the next reading
/// is noisier, after one to the other quieter (the asymmetry of Nelson 1991). Neither readings nor their squares correlate
/// by much; a reading does with the square after it.
pub(super) fn one_sided(draw: &mut Draw, stand: &Stand) -> Shape {
    let (white, sign) = (white(draw, stand.samples()), draw.sign());
    through(white, move |size, white| evened(louder(size, white), sign))
}

/// What a jump of the motor's command stirs up, by its size, and what dies away with a time constant, s.
fn stirred(duty: &[f64], dies_s: f64, rate_hz: f64) -> Vec<f64> {
    leaking(&each(&changes(duty), f64::abs), dies_s, rate_hz)
}

/// How fast the temperature moves either way, the fastest 1: while parts of unlike expansion rub along each other they
/// crackle, too fast and too small to tell one jerk from another, and are quiet once it has settled.
pub(super) fn slow_pace(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    let half = (draw.between(1.0, 4.0) * stand.rate_hz) as usize;
    let pace = each(&pace(&stand.world.temperature[axis], half), f64::abs);
    let fastest = extremes(&pace).1.max(1e-9);
    each(&pace, |p| p / fastest)
}
