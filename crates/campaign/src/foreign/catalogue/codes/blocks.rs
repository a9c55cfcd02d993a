//! Readings that are handled by blocks, and words that disturb the next.

use super::super::super::prelude::*;
use super::edges::zero_code;
use super::gaps::hidden;

/// Nats by which a reading tells that it is a copy of another one: the entropy of its law.
fn nats_of_copy(stand: &Stand, axis: usize) -> f64 {
    let law = law(stand, axis);
    let some = law.shares.iter().filter(|p| **p > 0.0);
    some.map(|p| -p * p.ln()).sum()
}

/// Nats of a block that a fault, of this chance, makes so many times likelier.
pub(super) fn nats_of_block(chance: f64, times: f64) -> f64 {
    let quiet = (1.0 - chance).max(1e-12);
    chance * (quiet + chance * times).ln() + (1.0 - chance) * quiet.ln()
}

/// The code that is nearest in steps of so many counts from a zero.
pub(super) fn in_coarse_steps(code: i32, zero: i32, step: i32) -> i32 {
    let steps = f64::from(code - zero) / f64::from(step);
    zero + step * steps.round() as i32
}

/// Readings of which each whole block from the first on is made anew.
fn in_blocks(own: &[i32], first: usize, length: usize, of: impl FnMut(&mut [i32])) -> Vec<i32> {
    let mut own = own.to_vec();
    own[first..].chunks_exact_mut(length).for_each(of);
    own
}

/// Readings as an axis would have them.
fn like(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<i32> {
    let (mean, sigma) = mean_and_sigma(stand, axis);
    stand.series(|_| (mean + sigma * draw.normal()).round() as i32)
}

/// Bits of a word of the part that differ from another one.
fn toggled(one: i32, other: i32) -> f64 {
    const WORD: i32 = (1 << 14) - 1;
    f64::from(((one ^ other) & WORD).count_ones())
}

/// While a reading is converted, the word before is shifted out, and each of its bits that toggles against the word before that
/// pulls at the ground. About zero all bits of a negative number toggle.
pub(super) fn pulling(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let words = like(draw, stand, axis);
    let bits = each_pair(&words, &words[1..], toggled);
    let (usual, rms) = (mean(&bits), spread(&bits).sqrt());
    let sign = draw.sign();
    // The size is what a bit pulls, counts.
    remade(
        f64::INFINITY,
        move |stand, size| {
            let sigma = stand.white(axis).sqrt() / LSB;
            Known::Strength(size * rms / sigma * (stand.samples() as f64).sqrt())
        },
        move |counts, draw, size| {
            let own = &counts[axis];
            let words = carry((own[0], own[0]), own, |(before, last), own| {
                let pulled = sign * size * (toggled(last, before) - usual);
                (last, (within_step(own, draw) + pulled).round() as i32)
            });
            each(&words, |(_, word)| word)
        },
    )
}

/// Firmware that sorts a block of readings where it lies, to take its median, and then sends the block: its readings rise.
/// Where it comes too late, the block has been sent already.
pub(super) fn sorted(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let length = 4 + draw.of_many(4);
    let first = draw.of_many(length);
    // Of two readings that are equal, either order is sorted.
    let equal: f64 = law(stand, axis).shares.iter().map(|p| p * p).sum();
    let pairs = (length * (length - 1) / 2) as f64;
    let orders: f64 = (2..=length).map(|k| k as f64).product();
    let times = orders * (-equal * pairs * 2f64.ln()).exp();
    remade(
        1.0,
        move |stand, chance| {
            let blocks = (stand.samples() / length) as f64;
            Known::nats(blocks * nats_of_block(chance, times))
        },
        move |counts, draw, chance| {
            in_blocks(&counts[axis], first, length, |block| {
                if draw.chance(chance) {
                    block.sort_unstable();
                }
            })
        },
    )
}

/// A driver that hides what the link has lost by mirroring the readings before the gap at the last one, as sound is mended.
pub(super) fn mirrored(draw: &mut Draw, stand: &Stand, axis: usize, wanted: f64) -> Shape {
    let nats = nats_of_copy(stand, axis);
    let nats = |length| length as f64 * nats;
    hidden(draw, stand, (axis, wanted), &nats, |own, from, length| {
        for k in 0..length {
            own[from + k] = own[from.saturating_sub(2 + k)];
        }
    })
}

/// A part that calibrates itself at a fixed period, and holds its output for some readings meanwhile.
pub(super) fn held(draw: &mut Draw, stand: &Stand, axis: usize, wanted: f64) -> Shape {
    let (n, length) = (stand.samples(), 4 + draw.of_many(6));
    let nats = nats_of_copy(stand, axis) * length as f64;
    let count = (0.5 * wanted * wanted / nats).ceil();
    let (period, first) = (n as f64 / count, draw.between(0.05, 0.9));
    let change = Change::made(move |counts, _| {
        let mut own = counts[axis].clone();
        for k in 0..count as usize {
            let from = ((first + k as f64) * period) as usize;
            let to = (from + length).min(n);
            let kept = own[from.saturating_sub(1)];
            own[from.min(n)..to].fill(kept);
        }
        own
    });
    Shape::Fixed(Known::nats(count * nats), change)
}

/// A link that saves bits by block floating point: eight readings have one exponent, by the largest of them, and mantissas of
/// three bits and a sign. The firmware has taken the bias off. Only while the link is busy does it do so.
pub(super) fn exponents(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    const BLOCK: usize = 8;
    const LARGEST: i32 = 7;
    let zero = zero_code(draw, stand, axis);
    let step_of = move |block: &[i32]| {
        let most = block.iter().map(|c| (c - zero).abs()).max().unwrap_or(0);
        let mut steps = (0..14).map(|k| 1 << k);
        steps.find(|step| most <= LARGEST * step).unwrap_or(1)
    };
    // How much likelier a block is by its step; one of single counts tells nothing.
    let times: Vec<f64> = like(draw, stand, axis)
        .chunks_exact(BLOCK)
        .map(|block| f64::from(step_of(block)).powi(BLOCK as i32))
        .filter(|times| *times > 1.0)
        .collect();
    remade(
        1.0,
        move |_, chance| Known::nats(times.iter().map(|t| nats_of_block(chance, *t)).sum()),
        move |counts, draw, chance| {
            in_blocks(&counts[axis], 0, BLOCK, |block| {
                let step = step_of(block);
                if draw.chance(chance) {
                    let coarse = |code: &mut i32| *code = in_coarse_steps(*code, zero, step);
                    block.iter_mut().for_each(coarse);
                }
            })
        },
    )
}

/// A logger that packs blocks of eight readings as pictures are packed: a cosine transform, of which the slow half is kept as it
/// is and the fast half in coarse steps.
pub(super) fn packed(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    const BLOCK: usize = 8;
    const FINE: usize = 4;
    let (_, sigma) = mean_and_sigma(stand, axis);
    let step = sigma * draw.between(1.2, 2.2);
    let wave = |k: usize| -> [f64; BLOCK] {
        let at = |i: usize| PI * k as f64 * (i as f64 + 0.5) / BLOCK as f64;
        std::array::from_fn(|i| (2.0 / BLOCK as f64).sqrt() * at(i).cos())
    };
    let waves: Vec<[f64; BLOCK]> = (FINE..BLOCK).map(wave).collect();
    // A coefficient is known to the rounding of the codes, and would be anywhere.
    let rounding = 1.0 / 12.0 * TAU * 1f64.exp();
    let nats = (step / rounding.sqrt()).ln() + 0.5 * (step * step / (12.0 * sigma * sigma)).ln_1p();
    let blocks = (stand.samples() / BLOCK) as f64;
    let known = Known::nats(blocks * (BLOCK - FINE) as f64 * nats);
    let first = draw.of_many(BLOCK);
    let change = Change::made(move |counts, _| {
        in_blocks(&counts[axis], first, BLOCK, |block| {
            let codes = each(block, f64::from);
            let mut unpacked = codes.clone();
            for wave in &waves {
                let held: f64 = each_pair(wave, &codes, |w, c| w * c).iter().sum();
                let moved = step * (held / step).round() - held;
                add_at(&mut unpacked, 0, each(wave, |w| moved * w));
            }
            block.copy_from_slice(&each(&unpacked, |v| v.round() as i32));
        })
    });
    Shape::Fixed(known, change)
}
