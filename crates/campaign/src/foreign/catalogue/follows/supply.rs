//! Signals that follow the supply.

use super::super::super::prelude::*;

/// A window comparator, or a rectifier in the reference: what the supply is off its middle, either way.
pub(super) fn fold(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (rms, ..) = wandering(draw, stand, (1.0, 6.0));
    let middle = 5.0 + rms * draw.between(-0.25, 0.25);
    about_mean(&each(&stand.world.supply, |u| (u - middle).abs() / rms))
}

/// A converter that steps its input up or down to one voltage has the least ripple where both are equal, and more the
/// further the input is off, either way; the part rectifies the ripple. The loads before it are of many sizes.
pub(super) fn up_or_down(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let most = draw.between(0.06, 0.15);
    loaded(draw, stand, most, (3.0, 15.0));
    let equal = 5.0 - most * draw.between(0.35, 0.65);
    // Between the two there is a range in which both take part.
    let both = most * draw.between(0.0, 0.15);
    each(&stand.world.supply, |u| (u - equal).hypot(both))
}

/// A regulator holds the part's supply until what is left above its output is less than it needs; only what is missing
/// beyond comes through. The loads are of many sizes, most of them harmless.
pub(super) fn drop_out(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    const MOST: f64 = 0.12;
    loaded(draw, stand, MOST, (4.0, 25.0));
    let needed = 5.0 - MOST * draw.between(0.4, 0.75);
    each(&stand.world.supply, |u| (u - needed).min(0.0))
}

/// A capacitor behind a diode: the reference follows the supply up at once, and sinks slowly towards it when it falls.
pub(super) fn behind_diode(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (_, tau, load) = wandering(draw, stand, (0.4, 2.0));
    let sinks = 1.0 - (-1.0 / (tau * draw.between(3.0, 8.0) * stand.rate_hz)).exp();
    about_mean(&carry(load[0], &load, |kept, u| {
        u.max(kept + sinks * (u - kept))
    }))
}

/// A charge pump runs the faster the more it has to deliver; its ripple is folded by the sampling, so that each load has a
/// pitch of its own, anywhere in the band. The loads are of many sizes.
pub(super) fn pump(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let most = draw.between(0.05, 0.15);
    loaded(draw, stand, most, (3.0, 15.0));
    let (idle, span) = (draw.between(1.0, 9.0), draw.between(10.0, 40.0));
    let first = draw.phase();
    let pitches = each(&stand.world.supply, |u| idle + span * (5.0 - u) / most);
    tone(first, &pitches, stand.rate_hz)
}

/// A regulator holds the rate against a constant supply, but lets each step of the load through until its loop has
/// settled: the supply less what it has followed.
pub(super) fn changes_of_supply(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let supply = &stand.world.supply;
    let followed = stand.lagged(supply, draw.by_ratio(0.3, 4.0));
    each_pair(supply, &followed, |u, f| u - f)
}

/// A supply, which the stand gets, that wanders: its rms, V, the time in which it does, s, and what it is off 5 V by.
fn wandering(draw: &mut Draw, stand: &mut Stand, tau: (f64, f64)) -> (f64, f64, Vec<f64>) {
    let (rms, tau) = (draw.between(0.015, 0.04), draw.by_ratio(tau.0, tau.1));
    let load = stand.wander(draw, rms, tau);
    stand.world.supply = each(&load, |l| 5.0 + l);
    (rms, tau, load)
}
