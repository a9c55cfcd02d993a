//! Signals of what a recorded channel switches, triggers or releases.

use super::super::super::prelude::*;

/// The part is screwed to metal of another expansion: as the temperature moves, stress builds up in the joint, which
/// friction holds, and each shock lets all of it go. The bias is what the temperature has moved by since the last shock.
pub(super) fn released(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let shocks = shocks(draw, stand);
    let own = &stand.world.temperature[axis];
    let mut free = vec![own[0]; own.len()];
    for (at, _) in shocks {
        free[at..].fill(own[at]);
    }
    either_way(draw, &each_pair(own, &free, |t, free| t - free))
}

/// A supervisor resets the part when the supply dips below its threshold, and lets go some millivolts above it: after each
/// reset the drive settles again from its start, however deep the dip was. The loads are of many sizes, most of them
/// harmless.
pub(super) fn restarts(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const HYSTERESIS_V: f64 = 0.005;
    let most = draw.between(0.06, 0.15);
    loaded(draw, stand, most, (3.0, 15.0));
    let threshold = 5.0 - most * draw.between(0.4, 0.7);
    let keep = (-1.0 / (draw.by_ratio(0.8, 4.0) * stand.rate_hz)).exp();
    let (mut low, mut left) = (false, 0.0);
    let settles = each(&stand.world.supply, |u| {
        left *= keep;
        if low {
            low = u < threshold + HYSTERESIS_V;
        } else if u < threshold {
            (low, left) = (true, 1.0);
        }
        left
    });
    about_mean(&either_way(draw, &settles))
}

/// Wake on motion: a drive that is turned down while nothing moves. One acceleration beyond the threshold wakes it for some
/// seconds, which any further one prolongs; each state has its own bias, which the part reaches with a lag.
pub(super) fn asleep(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let force = shaking(draw, stand);
    let rms = mean_square(&force).sqrt();
    // Of the normal law, once in 4 to 13 s at 20 Hz.
    let threshold = rms * draw.between(2.5, 2.9);
    let awake = (draw.by_ratio(1.0, 5.0) * stand.rate_hz) as usize;
    let left = carry(0usize, &force, |left, a| {
        let wakes = a.abs() > threshold;
        if wakes { awake } else { left.saturating_sub(1) }
    });
    let sleeps = each(&left, |left| one_if(left == 0));
    let settled = stand.lagged(&sleeps, draw.by_ratio(0.1, 0.8));
    about_mean(&either_way(draw, &settled))
}

/// The part converts its thermometer in every few frames, right before this axis, and the capacitor that samples both keeps
/// a share of it: those readings are off by the temperature, the others are not.
pub(super) fn of_thermometer(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    cycles(draw, stand);
    let off = from_trim(draw, stand, axis);
    let every = 3 + draw.of_many(8);
    let (first, sign) = (draw.of_many(every), draw.sign());
    stand.series(|i| sign * off[i] * one_if(i % every == first))
}

/// Popcorn noise of one trap: it takes a charge by a rate that grows tenfold for each third of the temperature's range
/// (Arrhenius), and loses it by one that stays. In the cold it stays empty for minutes, in the heat it is full half of the time.
pub(super) fn popcorn(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    const DECADES: f64 = 3.0;
    let warm = within_range(&stand.world.temperature[axis]);
    let loses = 1.0 / (draw.by_ratio(0.4, 3.0) * stand.rate_hz);
    let full = carry(false, &warm, |full, w| {
        let takes = loses * 10f64.powf(DECADES * (w - 1.0));
        full ^ draw.chance(if full { loses } else { takes })
    });
    about_mean(&either_way(draw, &each(&full, one_if)))
}
