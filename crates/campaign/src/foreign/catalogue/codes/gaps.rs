//! Gaps that a driver hides.

use super::super::super::prelude::*;

/// Readings of a gap, least and most.
const GAP: (usize, usize) = (4, 10);

/// A driver that hides the gaps that a link has lost, none touching another and together as strong as wanted: `nats` tells what
/// a gap of a length adds to half the d'^2, and `fill` fills one from a reading on.
pub(super) fn hidden(
    draw: &mut Draw,
    stand: &Stand,
    (axis, wanted): (usize, f64),
    nats: &dyn Fn(usize) -> f64,
    fill: fn(&mut [i32], usize, usize),
) -> Shape {
    let n = stand.samples();
    let mut gaps: Vec<(usize, usize)> = vec![];
    let mut left = 0.5 * wanted * wanted;
    while left > 0.0 {
        let from = 1 + draw.of_many(n - GAP.1 - 2);
        let length = GAP.0 + draw.of_many(GAP.1 + 1 - GAP.0);
        let free = |(f, l): &(usize, usize)| from > f + l || *f > from + length;
        if !gaps.iter().all(free) {
            continue;
        }
        // The last one is as short as it has to be.
        let off = |length: &usize| (nats(*length) - left).abs();
        let length = (1..=length)
            .min_by(|a, b| off(a).total_cmp(&off(b)))
            .unwrap_or(length);
        left -= nats(length);
        gaps.push((from, length));
        if left < 0.5 * nats(1) {
            break;
        }
    }
    let change = Change::made(move |counts, _| {
        let mut own = counts[axis].clone();
        for (from, length) in &gaps {
            fill(&mut own, *from, *length);
        }
        own
    });
    Shape::Fixed(Known::nats(0.5 * wanted * wanted - left), change)
}

/// Nats by which a straight line tells a reading that lies on it from one of the noise: that of the density at the line,
/// for the converter's step, averaged over a gap of this many readings.
fn nats_of_gap(length: usize, sigma_counts: f64) -> f64 {
    let square = |k: usize| {
        let part = k as f64 / (length + 1) as f64;
        part.powi(2) + (1.0 - part).powi(2)
    };
    let mean = (1..=length).map(square).sum::<f64>() / length as f64;
    (sigma_counts * TAU.sqrt()).ln() + 0.5 * mean
}

/// A driver that hides what the link has lost: between the last reading before a gap and the first one after it there is a
/// straight line.
pub(super) fn bridged(draw: &mut Draw, stand: &Stand, axis: usize, wanted: f64) -> Shape {
    let sigma = stand.white(axis).sqrt() / LSB;
    let nats = |length| length as f64 * nats_of_gap(length, sigma);
    hidden(draw, stand, (axis, wanted), &nats, |own, from, length| {
        let (before, after) = (own[from - 1], own[from + length]);
        for k in 1..=length {
            let part = k as f64 / (length + 1) as f64;
            let along = f64::from(before) + part * f64::from(after - before);
            own[from + k - 1] = along.round() as i32;
        }
    })
}
