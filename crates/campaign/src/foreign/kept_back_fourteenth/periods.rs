//! The fourteenth set's signals that have a structure in time of their own.

use super::super::kept_back_fourth::about_mean;
use super::super::kept_back_sixth::shocks;
use crate::random::Draw;
use crate::stand::{Stand, lagged, wander};

/// The door of the laboratory: drawn open, the pressure falls, and it jumps up when the door falls shut, mostly right after;
/// either leaks away through the gaps. The lid of the package bends by it.
pub(super) fn door(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    const LEFT_OPEN: f64 = 0.2;
    let (keep, sign) = (
        (-1.0 / (draw.by_ratio(0.5, 4.0) * stand.rate_hz)).exp(),
        draw.sign(),
    );
    let mut kicks = vec![0.0; stand.samples()];
    let mut at = draw.between(1.0, 15.0);
    while at < stand.seconds {
        let open = if draw.chance(LEFT_OPEN) {
            draw.between(10.0, 40.0)
        } else {
            draw.between(1.5, 6.0)
        };
        for (when, kick) in [
            (at, -draw.between(0.4, 1.0)),
            (at + open, draw.between(0.7, 1.5)),
        ] {
            if let Some(k) = kicks.get_mut((when * stand.rate_hz) as usize) {
                *k += sign * kick;
            }
        }
        at += open + 2.0 + 12.0 * draw.exponential();
    }
    let mut pressure = 0.0;
    let all: Vec<f64> = kicks
        .iter()
        .map(|k| {
            pressure = keep * pressure + k;
            pressure
        })
        .collect();
    lagged(&all, draw.by_ratio(0.05, 0.3), stand.rate_hz)
}

/// A hard shock, which the accelerometers show, throws the proof mass at its stop, where it sticks for a while. When it comes
/// free, the charge that the stop has left on it leaks away.
pub(super) fn stuck(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (hard, sticks) = (draw.between(0.5, 0.8), draw.by_ratio(0.3, 2.5));
    let (left, leaks) = (draw.between(0.2, 0.8), draw.by_ratio(0.5, 4.0));
    let mut y = vec![0.0; stand.samples()];
    for (at, force) in shocks(draw, stand) {
        if force.abs() < hard {
            continue;
        }
        let free = sticks * draw.between(0.3, 1.7);
        for (k, v) in y.iter_mut().skip(at + 1).enumerate() {
            let since = k as f64 / stand.rate_hz - free;
            let off = if since < 0.0 {
                1.0
            } else {
                left * (-since / leaks).exp()
            };
            *v = force.signum() * off;
        }
    }
    y
}

/// The part is kept warm by a heater with a thermostat, whose current shifts the ground while it is on, and warms the
/// regulator, which takes longer to cool. The room's air is not still, and so no two periods are alike.
pub(super) fn heater(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    let air = wander(draw, n, rate_hz, 0.1, 10.0);
    // Shares of what the heater warms by if it is left on.
    let (asked, play) = (draw.between(0.35, 0.65), draw.by_ratio(0.05, 0.3));
    let takes = draw.by_ratio(4.0, 20.0);
    let (mut on, mut warm) = (draw.chance(0.5), asked);
    let (mut current, mut warmth) = (vec![], vec![]);
    for air in air {
        let heats = f64::from(u8::from(on));
        warm += (heats + air - warm) / (takes * rate_hz);
        on = warm < asked + if on { 0.5 } else { -0.5 } * play;
        current.push(heats);
        warmth.push(warm - asked);
    }
    let full = draw.between(5.0, 15.0);
    for own in &mut stand.world.temperature {
        own.iter_mut()
            .zip(&warmth)
            .for_each(|(t, w)| *t += full * w);
    }
    let (tail, sign) = (draw.between(0.2, 0.8), draw.sign());
    let regulator = lagged(&current, draw.by_ratio(1.0, 6.0), rate_hz);
    let both = current.iter().zip(regulator);
    about_mean(
        &both
            .map(|(c, r)| sign * (c + tail * r))
            .collect::<Vec<f64>>(),
    )
}

#[cfg(test)]
mod tests {
    use super::super::tests::stand;
    use super::*;
    use crate::foreign::{extremes, swing};

    #[test]
    fn a_door_kicks_either_way_and_the_pressure_leaks_away() {
        let (mut draw, stand) = stand(20);
        for _ in 0..5 {
            let y = door(&mut draw, &stand);
            let (low, high) = extremes(&y);
            assert!(low < -0.2 && high > 0.2, "{low} {high}");
            // Kicks come every 14 s and more often than not in pairs; a leak takes 4 s at most.
            let still = y.iter().filter(|v| v.abs() < 0.2 * swing(&y)).count();
            assert!(still > y.len() / 3, "{still}");
        }
    }

    #[test]
    fn a_mass_sticks_at_the_side_of_the_shock_and_comes_free() {
        let (mut draw, mut stand) = stand(21);
        let before = stand.world.acc.clone();
        let y = stuck(&mut draw, &mut stand);
        assert_ne!(before, stand.world.acc);
        let at_stop: Vec<bool> = y.iter().map(|v| v.abs() == 1.0).collect();
        let times = at_stop.chunk_by(|a, b| a == b).filter(|run| run[0]);
        let lengths: Vec<usize> = times.map(<[bool]>::len).collect();
        assert!(lengths.len() > 5, "{lengths:?}");
        // 2.5 s and two thirds of that more, and again where one is thrown there twice.
        assert!(lengths.iter().all(|l| *l < 170), "{lengths:?}");
        assert!(y.iter().all(|v| v.abs() == 1.0 || v.abs() <= 0.8));
    }

    #[test]
    fn a_heater_is_on_while_it_warms_and_off_while_it_cools() {
        let (mut draw, mut stand) = stand(22);
        stand.world.temperature = std::array::from_fn(|_| vec![25.0; stand.samples()]);
        let y = heater(&mut draw, &mut stand);
        let own = &stand.world.temperature[0];
        let middle = 0.5 * (extremes(&y).0 + extremes(&y).1);
        let warms: Vec<bool> = own.windows(2).map(|w| w[1] > w[0]).collect();
        let high: Vec<bool> = y[1..].iter().map(|v| *v > middle).collect();
        let alike = warms.iter().zip(&high).filter(|(a, b)| a == b).count();
        let share = alike as f64 / warms.len() as f64;
        assert!(!(0.1..0.9).contains(&share), "{share}");
        let periods = warms.windows(2).filter(|w| !w[0] && w[1]).count();
        assert!((15..1000).contains(&periods), "{periods}");
    }
}
