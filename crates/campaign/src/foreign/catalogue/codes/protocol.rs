//! Codes that a protocol, a watchdog or a change of the range takes hold of.

use super::super::super::prelude::*;
use super::blocks::{in_coarse_steps, nats_of_block};
use super::edges::zero_code;

/// A watchdog takes two equal readings in a row for a part that hangs: the driver moves the second one on by a count, so that
/// the watchdog keeps still. No reading comes twice, except where the driver has had no time.
pub(super) fn moved_on(draw: &mut Draw) -> impl Fn(i32, i32) -> i32 + Copy + use<> {
    let by = draw.either(1, -1);
    move |before, code| code + if code == before { by } else { 0 }
}

/// A part that changes its range: a large swing switches to the coarse one, whose step is four or eight counts, and only some
/// readings later it goes back. The comparator that switches is slow and misses some swings.
pub(super) fn coarse_for_a_while(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    const LARGE: f64 = 2.3;
    let step: i32 = draw.either(4, 8);
    let kept = 4 + draw.of_many(5);
    let zero = zero_code(draw, stand, axis);
    let (mean, sigma) = mean_and_sigma(stand, axis);
    let often = 2.0 * below(-LARGE);
    let times = f64::from(step).powi(kept as i32);
    remade(
        1.0,
        move |stand, chance| {
            let swings = stand.samples() as f64 * often;
            Known::nats(swings * nats_of_block(chance, times))
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
                    in_coarse_steps(code, zero, step)
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
    let numbers: i32 = draw.either(2, 4);
    let first = draw.of_many(numbers as usize);
    let counted = move |code: i32, frame: usize| {
        code - code.rem_euclid(numbers) + ((frame + first) as i32).rem_euclid(numbers)
    };
    remade(
        1.0,
        move |stand, chance| {
            let even = law(stand, axis);
            let parts = numbers as usize;
            let square = |frame| {
                let read = even.mapped(chance, |code| counted(code, frame));
                of_law(&read.shares, &even.shares, stand.samples() / parts).powi(2)
            };
            Known::Strength((0..parts).map(square).sum::<f64>().sqrt())
        },
        move |counts, draw, chance| {
            let frames = counts[axis].iter().enumerate();
            let read =
                |(frame, code): (usize, &i32)| draw.choose(chance, counted(*code, frame), *code);
            frames.map(read).collect()
        },
    )
}
