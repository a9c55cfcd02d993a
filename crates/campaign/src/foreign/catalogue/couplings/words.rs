//! Couplings between the words of the axes, bit by bit.

use super::super::super::prelude::*;
use super::other_than;

/// A packer whose code book is the lattice D3, which has the triples of an even sum: of a frame it cannot say it moves this axis by
/// one count, either way. It packs only the frames that the link asks for. Any two axes are as independent as before, and all
/// three are not.
pub(super) fn even_sum(axis: usize) -> Shape {
    remade(
        1.0,
        |stand, chance| {
            let even = 0.5 * (1.0 + chance);
            let of = |p: f64| if p > 0.0 { p * (2.0 * p).ln() } else { 0.0 };
            Known::nats(stand.samples() as f64 * (of(even) + of(1.0 - even)))
        },
        move |counts, draw, chance| {
            let frames = 0..counts[axis].len();
            let packed = |i: usize| {
                let odd = counts.iter().map(|all| all[i]).sum::<i32>() % 2 != 0;
                let moved = odd && draw.chance(chance);
                let by = draw.either(1, -1);
                counts[axis][i] + if moved { by } else { 0 }
            };
            frames.map(packed).collect()
        },
    )
}

/// A part that is selected too early drives the line while the word before is still on it. Either can pull the line down, so that
/// of the last bits those are 1 that are 1 in both words, this axis's and the other's. It hangs on who is late, by chance.
pub(super) fn both_drive(draw: &mut Draw, axis: usize) -> Shape {
    let other = other_than(draw, axis);
    let low = (1 << (3 + draw.of_many(2))) - 1;
    let read = move |own: i32, its: i32| own & (its | !low);
    remade(
        1.0,
        move |stand, chance| {
            let (own, its) = (law(stand, axis), law(stand, other));
            let by = |(code, q): (i32, f64)| (own.mapped(chance, |own| read(own, code)).shares, q);
            let laws: Vec<(Vec<f64>, f64)> = its.codes().map(by).collect();
            let mean = |k: usize| laws.iter().map(|(law, q)| q * law[k]).sum();
            let even = own.with((0..own.shares.len()).map(mean).collect());
            let (even, n) = (even.refitted(), stand.samples());
            let square = |(law, q): &(Vec<f64>, f64)| q * of_law(law, &even, n).powi(2);
            Known::Strength(laws.iter().map(square).sum::<f64>().sqrt())
        },
        move |counts, draw, chance| {
            each_pair(&counts[axis], &counts[other], |own, its| {
                draw.choose(chance, read(own, its), own)
            })
        },
    )
}
