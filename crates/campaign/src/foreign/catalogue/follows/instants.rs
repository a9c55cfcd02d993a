//! Signals by the instant at which something is looked at or let go: within a period of the motor's pulses, ahead of a
//! command, or since the last one.

use super::super::super::prelude::*;

/// The converter samples at a fixed place of the period of the motor's pulses, and the edge that ends a pulse rings on the
/// ground: the reading is what the ring has come to since the edge. As the duty moves the edge, the readings trace the ring;
/// where the edge comes after the sample there is nothing.
pub(super) fn edge(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    commanded(draw, stand, (1.5, 5.0), (0.05, 1.0));
    let sampled = draw.between(0.6, 0.9);
    let (turns, decay) = (draw.between(2.5, 6.0), draw.between(0.25, 0.6));
    let sign = draw.sign();
    each(&stand.world.duty, |d| {
        let since = sampled - d.abs();
        let rings = sign * (-since / decay).exp() * (TAU * turns * since).cos();
        if since < 0.0 { 0.0 } else { rings }
    })
}

/// A holding brake, which the controller pulls free some time before it starts the motor, for it knows the plan: the coil takes
/// all of its current until the command comes, and next to none afterwards. What is read comes before what causes it.
pub(super) fn brake(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    with_rests(draw, stand, (2.0, 9.0), 0.2);
    let ahead = (draw.by_ratio(0.3, 1.5) * stand.rate_hz).ceil() as usize;
    let duty = &stand.world.duty;
    let sign = draw.sign();
    let coil = stand.series(|i| {
        let soon = &duty[i..(i + ahead + 1).min(duty.len())];
        sign * one_if(duty[i] == 0.0 && soon.iter().any(|d| *d != 0.0))
    });
    stand.lagged(&coil, draw.by_ratio(0.03, 0.15))
}

/// A protection circuit that keeps the largest acceleration it has felt, and that each new command clears: the bias is that
/// peak, however long ago it was.
pub(super) fn peak(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let (force, duty) = (shaking(draw, stand), &stand.world.duty);
    let cleared = each(&changes(duty), |change| change != 0.0);
    let felt = each_pair(&force, &cleared, |a, cleared| (a.abs(), cleared));
    let kept = carry(
        0.0f64,
        &felt,
        |most, (a, cleared)| {
            if cleared { a } else { most.max(a) }
        },
    );
    about_mean(&either_way(draw, &kept))
}

/// A carrier leaks into the read-out over a path that is about as long as its wave, and the shaking bends the path: the tone,
/// folded into the band, has the phase of the acceleration. It is as large as before, and as good as none of it is a line.
pub(super) fn path(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let force = shaking(draw, stand);
    let bends = draw.between(1.5, 3.0) / mean_square(&force).sqrt();
    let turn = TAU * draw.by_ratio(0.5, 9.0) / stand.rate_hz;
    let first = draw.phase();
    stand.series(|i| (first + turn * i as f64 + bends * force[i]).cos())
}
