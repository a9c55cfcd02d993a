//! Codes that a protocol, a watchdog or a change of the range takes hold of.

use super::super::super::prelude::*;
use super::blocks::nats_of_block;
use super::edges::zero_of;

/// A watchdog takes two equal readings in a row for a part that hangs: the driver moves the second one on by a count, so that
/// the watchdog keeps still. No reading comes twice, except where the driver has had no time.
pub(super) fn moved_on(draw: &mut Draw) -> impl Fn(i32, i32) -> i32 + use<> {
    let by = if draw.chance(0.5) { 1 } else { -1 };
    move |before, code| if code == before { code + by } else { code }
}

/// A part that changes its range: a large swing switches to the coarse one, whose step is four or eight counts, and only some
/// readings later it goes back. The comparator that switches is slow and misses some swings.
pub(super) fn coarse_for_a_while(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    const LARGE: f64 = 2.3;
    let step: i32 = if draw.chance(0.5) { 4 } else { 8 };
    let kept = 4 + draw.of_many(5);
    let zero = zero_of(draw, stand, axis).round() as i32;
    let (mean, sigma) = mean_and_sigma(stand, axis);
    let often = statrs::function::erf::erfc(LARGE / 2f64.sqrt());
    let times = f64::from(step).powi(kept as i32);
    remade(
        1.0,
        move |stand, chance| {
            let swings = stand.samples() as f64 * often;
            Known::Strength(
                (2.0 * swings * nats_of_block(chance.min(1.0), times))
                    .max(0.0)
                    .sqrt(),
            )
        },
        move |counts, draw, chance| {
            let mut left = 0usize;
            each(&counts[axis], |code| {
                let coarse = left > 0;
                left = left.saturating_sub(1);
                if (f64::from(code) - mean).abs() > LARGE * sigma && draw.chance(chance) {
                    left = kept;
                }
                if coarse {
                    let steps = f64::from(code - zero) / f64::from(step);
                    zero + step * steps.round() as i32
                } else {
                    code
                }
            })
        },
    )
}

/// An alive counter, as buses in vehicles have: the lowest bits of the word are the frame's number, so that the receiver sees
/// whether the sender lives. They are so in frames of one kind, which come by chance. Every code comes as often as before.
pub(super) fn alive(draw: &mut Draw, axis: usize) -> Shape {
    let numbers: i32 = if draw.chance(0.5) { 2 } else { 4 };
    let first = draw.of_many(numbers as usize);
    let counted = move |code: i32, frame: usize| {
        code - code.rem_euclid(numbers) + ((frame + first) as i32).rem_euclid(numbers)
    };
    let strength = move |stand: &Stand, chance: f64| {
        let (start, even) = law(stand, axis);
        let parts = numbers as usize;
        let squares = (0..parts).map(|frame| {
            let mut read: Vec<f64> = even.iter().map(|p| (1.0 - chance) * p).collect();
            for (code, p) in (start..).zip(&even) {
                let to = usize::try_from(counted(code, frame) - start).ok();
                if let Some(share) = to.and_then(|to| read.get_mut(to)) {
                    *share += chance * p;
                }
            }
            of_law(&read, &even, stand.samples() / parts).powi(2)
        });
        Known::Strength(squares.sum::<f64>().sqrt())
    };
    remade(
        1.0,
        move |stand, chance| strength(stand, chance.min(1.0)),
        move |counts, draw, chance| {
            let read = |(frame, code): (usize, &i32)| {
                if draw.chance(chance) {
                    counted(*code, frame)
                } else {
                    *code
                }
            };
            counts[axis].iter().enumerate().map(read).collect()
        },
    )
}
