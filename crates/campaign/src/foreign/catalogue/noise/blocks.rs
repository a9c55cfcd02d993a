//! Noise that is handled by pairs or by blocks, and is as white as before.

use statrs::function::gamma::{digamma, ln_gamma};

use super::super::super::prelude::*;

/// Cells of an integral.
const CELLS: i32 = 400;

/// Mean square of the largest of so many normal numbers.
fn square_of_largest(looks: i32) -> f64 {
    let wide = 2.0 * REACH / f64::from(CELLS);
    let square = |k: i32| {
        let x = wide * (f64::from(k) + 0.5) - REACH;
        wide * x * x * f64::from(looks) * below(x).powi(looks - 1) * normal(x)
    };
    (0..CELLS).map(square).sum()
}

/// Nats of a pair that is the least and the largest of so many looks by `chance`, else two looks, in either order: against two
/// independent readings of the variance that they have. Of the shares of the normal law below each, as far apart as `apart`, the
/// density is 2 (1 - apart) without, and looks (looks - 1) / 2 apart^(looks - 2) times that with it.
fn nats_of_pair(looks: i32, chance: f64) -> f64 {
    let variance = 1.0 + chance * (square_of_largest(looks) - 1.0);
    let of = |k: i32| {
        let apart = (f64::from(k) + 0.5) / f64::from(CELLS);
        let pairs = 0.5 * f64::from(looks * (looks - 1));
        let times = 1.0 - chance + chance * pairs * apart.powi(looks - 2);
        2.0 * (1.0 - apart) * times * times.max(1e-12).ln() / f64::from(CELLS)
    };
    let own: f64 = (0..CELLS).map(of).sum();
    own + variance.ln() - variance + 1.0
}

/// A logger that keeps of each stretch the least and the largest look, in the order in which they came, so that no peak is lost
/// when the record is drawn (peak detection of oscilloscopes): each pair has one high reading and one low one. A stretch holds
/// several looks where the bus was free, by chance, and else two.
pub(super) fn extremes_of_stretch(draw: &mut Draw) -> Shape {
    let looks = 4 + draw.of_many(4);
    let number = looks as i32;
    let largest = square_of_largest(number);
    noise(
        1.0,
        move |stand, chance| Known::by_reading(stand, nats_of_pair(number, chance)),
        move |stand, draw, chance| {
            let scale = (1.0 + chance * (largest - 1.0)).sqrt();
            let mut second = None;
            stand.series(|_| {
                if let Some(kept) = second.take() {
                    return kept;
                }
                let several = draw.chance(chance);
                let all = white(draw, if several { looks } else { 2 });
                let (low, high) = extremes(&all);
                let (one, other) = draw.either((low, high), (high, low));
                second = Some(other / scale);
                one / scale
            })
        },
    )
}

/// A link that levels every block, as the gain control of a tape or a radio does, and undoes only a part of that: loud blocks come
/// back too quiet and quiet ones too loud, all nearly of one energy. Within a block nothing tells. The size is the power of the
/// block's own size that is taken off.
pub(super) fn levelled(draw: &mut Draw) -> Shape {
    const MOST: f64 = 0.97;
    let length = 8 + draw.of_many(17);
    let n = length as f64;
    // Logarithm of the gain that leaves the variance as it is: of chi^2 the powers are known.
    let gain = move |size: f64| {
        let left = 1.0 - size;
        let power = left * 2f64.ln() + ln_gamma(0.5 * n + left) - ln_gamma(0.5 * n);
        0.5 * (n.ln() - power)
    };
    noise(
        MOST,
        move |stand, size| {
            let logarithm = 0.5 * (digamma(0.5 * n) + 2f64.ln());
            let nats = n * (size * logarithm - gain(size)) - (-size).ln_1p();
            Known::nats(stand.samples() as f64 / n * nats)
        },
        move |stand, draw, size| {
            let first = draw.of_many(length);
            let mut all = white(draw, stand.samples() + length);
            for block in all.chunks_mut(length) {
                let radius = block.iter().map(|v| v * v).sum::<f64>().sqrt();
                let by = (gain(size) - size * radius.ln()).exp();
                block.iter_mut().for_each(|v| *v *= by);
            }
            all[first..first + stand.samples()].to_vec()
        },
    )
}
