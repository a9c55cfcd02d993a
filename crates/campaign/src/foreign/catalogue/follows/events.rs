//! Signals by the order and the times at which a recorded channel changes, and by a loop that it drives out of its range.

use super::super::super::prelude::*;

/// An oven that can heat and not cool. Where a lamp close by makes it too warm around, the loop's integral runs off, and has to
/// run back before it heats again: the die is too warm, and then too cold for as much. The thermometer is outside.
pub(super) fn oven(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Vec<f64> {
    const STEPS: usize = 10;
    lit(draw, stand, (1.5, 7.0), (0.7, 2.0));
    let room = &stand.world.temperature[axis];
    let (low, high) = extremes(room);
    let set = low + (high - low) * draw.between(0.3, 0.6);
    let most = (high - low) * draw.between(1.5, 3.0);
    let (tau, gain) = (draw.by_ratio(0.3, 1.0), draw.between(1.0, 3.0));
    let runs = gain / (tau * draw.between(1.0, 3.0));
    let step = 1.0 / (stand.rate_hz * STEPS as f64);
    let (mut die, mut integral) = (room[0].max(set), (set - room[0]).max(0.0));
    let off = each(room, |room| {
        for _ in 0..STEPS {
            let error = set - die;
            integral += step * runs * error;
            let heat = (gain * error + integral).clamp(0.0, most);
            die += step / tau * (room + heat - die);
        }
        die - set
    });
    about_mean(&either_way(draw, &off))
}

/// Firmware takes off what it reckons the command to do, and its register is double: a new value gets through when the next
/// one is written, however long that takes. What it takes off belongs to the command before; the present one does nothing.
pub(super) fn command_before(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let duty = &stand.world.duty;
    let written = carry((duty[0], 0.0), duty, |(now, before), d| {
        (d, if d == now { before } else { now })
    });
    either_way(draw, &each(&written, |(_, before)| before))
}

/// Grease that sets while the motor rests, by the logarithm of the time: to break it loose takes a surge that hangs on how long
/// the rest was, and not on the command. Rests are short and long.
pub(super) fn grease(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let setting = draw.by_ratio(0.5, 2.0);
    let keep = (-1.0 / (draw.by_ratio(0.25, 1.0) * stand.rate_hz)).exp();
    let level = |d: &mut Draw| in_steps(d.signed(0.3, 1.0));
    stand.world.duty = in_spells(stand, (0.0, draw.between(1.0, 5.0)), |was: f64| {
        if was == 0.0 {
            (level(draw), draw.between(1.0, 4.0))
        } else {
            (0.0, draw.by_ratio(0.3, 25.0))
        }
    });
    let (mut rested, mut left) = (0.0f64, 0.0);
    let surges = each(&stand.world.duty, |d| {
        left *= keep;
        if d == 0.0 {
            // The current is off.
            (rested, left) = (rested + 1.0 / stand.rate_hz, 0.0);
        } else if rested > 0.0 {
            left = (rested / setting).ln_1p();
            rested = 0.0;
        }
        left
    });
    about_mean(&either_way(draw, &surges))
}

/// A vibration far above the readings' rate, and firmware that has to serve the motor before it samples: the more it is driven,
/// the later. Some hundred microseconds turn the phase of what is folded into the band; pitch and size stay.
pub(super) fn served(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let turn = TAU * draw.by_ratio(0.5, 8.0) / stand.rate_hz;
    let (first, late) = (draw.phase(), draw.between(4.0, 10.0));
    let duty = &stand.world.duty;
    stand.series(|i| (first + turn * i as f64 + late * duty[i].abs()).cos())
}
