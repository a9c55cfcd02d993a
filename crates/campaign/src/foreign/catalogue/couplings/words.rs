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
            let even = 0.5 * (1.0 + chance.min(1.0));
            let of = |p: f64| if p > 0.0 { p * (2.0 * p).ln() } else { 0.0 };
            Known::nats(stand.samples() as f64 * (of(even) + of(1.0 - even)))
        },
        move |counts, draw, chance| {
            let frames = 0..counts[axis].len();
            frames
                .map(|i| {
                    let odd = counts.iter().map(|all| all[i]).sum::<i32>() % 2 != 0;
                    let moved = odd && draw.chance(chance);
                    let by = if draw.chance(0.5) { 1 } else { -1 };
                    counts[axis][i] + if moved { by } else { 0 }
                })
                .collect()
        },
    )
}

/// A part that is selected too early drives the line while the word before is still on it. Either can pull the line down, so that
/// of the last bits those are 1 that are 1 in both words, this axis's and the other's. It hangs on who is late, by chance.
pub(super) fn both_drive(draw: &mut Draw, axis: usize) -> Shape {
    let other = other_than(draw, axis);
    let low = (1 << (3 + draw.of_many(2))) - 1;
    let read = move |own: i32, its: i32| own & (its | !low);
    let strength = move |stand: &Stand, chance: f64| {
        let ((first, own), (its_first, its)) = (law(stand, axis), law(stand, other));
        let laws: Vec<Vec<f64>> = (its_first..)
            .zip(&its)
            .map(|(its, _)| {
                let mut law = each(&own, |p| (1.0 - chance) * p);
                for (code, p) in (first..).zip(&own) {
                    let to = usize::try_from(read(code, its) - first).ok();
                    if let Some(share) = to.and_then(|to| law.get_mut(to)) {
                        *share += chance * p;
                    }
                }
                law
            })
            .collect();
        let mean = |k: usize| laws.iter().zip(&its).map(|(law, q)| q * law[k]).sum();
        let all: Vec<f64> = (0..own.len()).map(mean).collect();
        let even = refitted(first, &all);
        let n = stand.samples();
        let squares = laws.iter().zip(&its);
        let square: f64 = squares
            .map(|(law, q)| q * of_law(law, &even, n).powi(2))
            .sum();
        Known::Strength(square.sqrt())
    };
    remade(
        1.0,
        move |stand, chance| strength(stand, chance.min(1.0)),
        move |counts, draw, chance| {
            each_pair(&counts[axis], &counts[other], |own, its| {
                if draw.chance(chance) {
                    read(own, its)
                } else {
                    own
                }
            })
        },
    )
}
