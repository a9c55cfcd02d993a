//! Couplings between two axes that remember.

use super::super::super::prelude::*;
use super::{other_than, rates, white_of};

/// What lets changes through: a series less what it has been within some seconds.
fn without_mean(series: &[f64], rate_hz: f64) -> Vec<f64> {
    const SLOW_S: f64 = 5.0;
    each_pair(series, &lagged(series, SLOW_S, rate_hz), |v, slow| v - slow)
}

/// A comparator that another axis trips, its input behind a capacitor: a swing of that axis beyond the threshold sets it, one
/// as far the other way clears it, and this axis is off to one side or the other until then. Alone it is telegraph noise; the
/// other axis tells every switch.
pub(super) fn latch(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (other, rate_hz) = (other_than(draw, axis), stand.rate_hz);
    let threshold = stand.white(other).sqrt() * draw.between(1.7, 2.3);
    let (first, sign) = (draw.sign(), draw.sign());
    let latched = move |its: &[f64]| {
        carry(first, &without_mean(its, rate_hz), |state, v| {
            let trips = v.abs() > threshold;
            if trips { sign * v.signum() } else { state }
        })
    };
    let like = latched(&white_of(draw, stand, other));
    coupled(stand, axis, &like, move |counts| {
        latched(&rates(&counts[other]))
    })
}

/// A capacitor keeps a share of the last reading, and the switch that turns it round is driven by the sense of another axis:
/// a share of this axis's last reading comes back, upright or reversed. No two readings correlate, of one axis or of both; of
/// three, the last reading, this one and the other axis's, the product does not vanish.
pub(super) fn turned_round(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (other, sign, rate_hz) = (other_than(draw, axis), draw.sign(), stand.rate_hz);
    remade(
        0.95,
        // Of white noise the variance grows by 1 / (1 - kept^2), and what is new stays.
        |stand, kept| Known::by_reading(stand, -(-kept.powi(2)).ln_1p()),
        move |counts, draw, kept| {
            let its = without_mean(&each(&counts[other], f64::from), rate_hz);
            let own = each(&counts[axis], |c| within_step(c, draw));
            let fast = without_mean(&own, rate_hz);
            let mut last = 0.0;
            (0..own.len())
                .map(|i| {
                    let added = kept * sign * its[i].signum() * last;
                    last = fast[i] + added;
                    (own[i] + added).round() as i32
                })
                .collect()
        },
    )
}
