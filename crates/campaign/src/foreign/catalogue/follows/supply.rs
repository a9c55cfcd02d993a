//! Signals that follow the supply.

use std::f64::consts::TAU;

use super::super::super::words::about_mean;
use crate::random::Draw;
use crate::stand::{Stand, held, lagged, wander};

/// A window comparator, or a rectifier in the reference: what the supply is off its middle, either way.
pub(super) fn fold(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (rms, tau) = (draw.between(0.015, 0.04), draw.by_ratio(1.0, 6.0));
    let load = wander(draw, stand.samples(), stand.rate_hz, rms, tau);
    let middle = 5.0 + rms * draw.between(-0.25, 0.25);
    stand.world.supply = load.iter().map(|l| 5.0 + l).collect();
    let off: Vec<f64> = stand
        .world
        .supply
        .iter()
        .map(|u| (u - middle).abs() / rms)
        .collect();
    about_mean(&off)
}

/// A converter that steps its input up or down to one voltage has the least ripple where both are equal, and more the
/// further the input is off, either way; the part rectifies the ripple. The loads before it are of many sizes.
pub(super) fn up_or_down(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    let most = draw.between(0.06, 0.15);
    let load = held(draw, n, rate_hz, (3.0, 15.0), |d| d.between(0.0, most));
    let slow = wander(draw, n, rate_hz, 0.001, 60.0);
    stand.world.supply = load.iter().zip(slow).map(|(l, s)| 5.0 - l - s).collect();
    let equal = 5.0 - most * draw.between(0.35, 0.65);
    // Between the two there is a range in which both take part.
    let both = most * draw.between(0.0, 0.15);
    let supply = &stand.world.supply;
    supply.iter().map(|u| (u - equal).hypot(both)).collect()
}

/// A regulator holds the part's supply until what is left above its output is less than it needs; only what is missing
/// beyond comes through. The loads are of many sizes, most of them harmless.
pub(super) fn drop_out(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const MOST: f64 = 0.12;
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    let load = held(draw, n, rate_hz, (4.0, 25.0), |d| d.between(0.0, MOST));
    let slow = wander(draw, n, rate_hz, 0.001, 60.0);
    let needed = 5.0 - MOST * draw.between(0.4, 0.75);
    stand.world.supply = load.iter().zip(slow).map(|(l, s)| 5.0 - l - s).collect();
    let supply = &stand.world.supply;
    supply.iter().map(|u| (u - needed).min(0.0)).collect()
}

/// A capacitor behind a diode: the reference follows the supply up at once, and sinks slowly towards it when it falls.
pub(super) fn behind_diode(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
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

/// A charge pump runs the faster the more it has to deliver; its ripple is folded by the sampling, so that each load has a
/// pitch of its own, anywhere in the band. The loads are of many sizes.
pub(super) fn pump(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
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

/// A regulator holds the rate against a constant supply, but lets each step of the load through until its loop has
/// settled: the supply less what it has followed.
pub(super) fn changes_of_supply(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let supply = &stand.world.supply;
    let followed = lagged(supply, draw.by_ratio(0.3, 4.0), stand.rate_hz);
    supply.iter().zip(followed).map(|(u, f)| u - f).collect()
}
