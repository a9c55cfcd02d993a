//! Noise in which a reading is bound to those before it by a law that is no correlation, or starts anew.

use super::super::super::prelude::*;
use super::memory::MOST;

/// Angles over which the law of a map of cosines is summed, and cells of a reading.
const ANGLES: usize = 96;
const CELLS: usize = 72;

/// d'^2 by reading of a cubic map that has `share` of the variance: what two neighbours tell against two independent ones.
fn of_cubic(share: f64) -> f64 {
    let sigma = (1.0 - share).sqrt();
    let wide = 2.0 * REACH / CELLS as f64;
    let at = |k: usize| wide * (k as f64 + 0.5) - REACH;
    let cell = |middle: f64, k: usize| wide / sigma * normal((at(k) - middle) / sigma);
    let laws = |times: f64| -> Vec<Vec<f64>> {
        let law = |a: usize| {
            let angle = PI * (a as f64 + 0.5) / ANGLES as f64;
            let middle = (2.0 * share).sqrt() * (times * angle).cos();
            (0..CELLS).map(|k| cell(middle, k)).collect()
        };
        (0..ANGLES).map(law).collect()
    };
    let (own, next) = (laws(1.0), laws(3.0));
    let one = |x: usize| own.iter().map(|law| law[x]).sum::<f64>() / ANGLES as f64;
    let mut nats = 0.0;
    for (x, p) in (0..CELLS).map(one).enumerate() {
        for (y, q) in (0..CELLS).map(|y| wide * normal(at(y))).enumerate() {
            let both = own.iter().zip(&next).map(|(o, n)| o[x] * n[y]);
            let both = both.sum::<f64>() / ANGLES as f64;
            if both > 1e-14 {
                nats += both * (both / (p * q)).ln();
            }
        }
    }
    2.0 * nats
}

/// A switching converter whose current loop has lost its period, alike in both half waves: its ripple, caught once a period,
/// obeys a cubic map (Chebyshev's; Deane and Hamill 1990 found such converters). It is white and does not lean, and no product
/// of two or three readings tells; the next one is four times the cube of the last, less three times that.
pub(super) fn cubic(draw: &mut Draw, stand: &Stand) -> Shape {
    let mut ripple = draw.between(-0.95, 0.95);
    let series = stand.series(|_| {
        // Rounding alone would end it some day.
        ripple = (ripple * (4.0 * ripple * ripple - 3.0) + 1e-9 * draw.normal()).clamp(-1.0, 1.0);
        2f64.sqrt() * ripple
    });
    let known = |stand: &Stand, part| Known::by_reading(stand, of_cubic(part));
    share(MOST, known, series)
}

/// An amplifier that has not settled when the next reading is taken: after a small swing some of it is left, and after a large
/// one, which it overshoots, some of its opposite. Where both come as often by size, neighbours do not correlate, and nor do
/// their sizes. The sense of a reading is that of the one before, or the opposite beyond the median of the sizes weighed by
/// themselves, a little more often than not.
pub(super) fn turning_back() -> Shape {
    // Of the size of a normal law half lies below: 1 - exp(-t^2 / 2).
    let large = (2.0 * 2f64.ln()).sqrt();
    noise(
        MOST,
        |stand, often| {
            let nats = (1.0 + often) * often.ln_1p() + (1.0 - often) * (-often).ln_1p();
            Known::by_reading(stand, nats)
        },
        move |stand, draw, often| {
            let opens = draw.sign();
            let mut last = draw.normal();
            stand.series(|_| {
                let goes_on = opens * if last.abs() < large { 1.0 } else { -1.0 };
                let as_told = draw.choose(0.5 * (1.0 + often), 1.0, -1.0);
                last = as_told * goes_on * last.signum() * draw.normal().abs();
                last
            })
        },
    )
}

/// A filter that begins anew with each block, as one does that belongs to a task of its own: the first reading goes through
/// as it is, and the longer the filter has run, the less it trusts the next one, by 1 / (1 + k size) as a recursive mean does.
/// The noise falls and its colour builds up, block by block.
pub(super) fn anew(draw: &mut Draw) -> Shape {
    let length = 6 + draw.of_many(15);
    let gain = |size: f64, k: usize| 1.0 / (1.0 + size * k as f64);
    // Mean variance of a block, and mean logarithm of what each reading brings that is new.
    let of_block = move |size: f64| {
        let (mut variance, mut sum, mut logs) = (1.0, 0.0, 0.0);
        for k in 0..length {
            let g = gain(size, k);
            variance = (1.0 - g).powi(2) * variance + g * g;
            sum += variance;
            logs += 2.0 * g.ln();
        }
        (sum / length as f64, logs / length as f64)
    };
    noise(
        1.0,
        move |stand, size| {
            let (variance, logs) = of_block(size);
            Known::by_reading(stand, variance.ln() - logs)
        },
        move |stand, draw, size| {
            let scale = of_block(size).0.sqrt();
            let first = draw.of_many(length);
            let mut filtered = draw.normal();
            stand.series(|i| {
                let g = gain(size, (i + first) % length);
                filtered += g * (draw.normal() - filtered);
                filtered / scale
            })
        },
    )
}
