//! Codes that are read as others.

use super::super::super::prelude::*;
use super::edges::zero_code;

/// A code whose lowest bit is the parity of the others. Frames of one kind spend their lowest bit so, against errors of the
/// line, and come by chance among the others.
pub(super) fn with_parity(code: i32) -> i32 {
    let others = code & !1;
    others | (others.count_ones() & 1) as i32
}

/// A decimating filter whose register has no bit to spare: what is beyond its range comes out at the other end. So it is in
/// the frames that are taken at the larger of two gains.
pub(super) fn wrapped(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let zero = zero_code(draw, stand, axis);
    let half = (sigma * draw.between(0.8, 1.6)).round().max(2.0) as i32;
    map(axis, move |code| {
        zero - half + (code - zero + half).rem_euclid(2 * half)
    })
}

/// Words kept as numbers of half precision, eleven bits of mantissa: beyond a power of two, which lies near the reading at
/// rest, only every second has a number of its own, and one between two goes to that whose mantissa is even. Some frames are
/// kept so.
pub(super) fn halved(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let zero = zero_code(draw, stand, axis);
    // Of a part that is mounted upside down, it is the readings below.
    let up = draw.sign() as i32;
    map(axis, move |code| {
        let off = up * (code - zero);
        let even = 2 * (0.5 * f64::from(off)).round_ties_even() as i32;
        zero + up * if off > 0 { even } else { off }
    })
}

/// A gain of one that a word of fractions cannot hold (Q15 ends at 0x7fff): the product is a little less than the reading
/// and, cut toward zero as integers are divided in C, one short of it, whatever the reading but zero. So are a gain and its
/// correction by two, and the code of zero takes five. Some frames go through it, others as they are.
pub(super) fn cut(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let zero = zero_code(draw, stand, axis);
    let multiplied = |v: i64| v * 0x7fff / 0x8000;
    map(axis, move |code| {
        zero + multiplied(multiplied(i64::from(code - zero))) as i32
    })
}

/// One of some maps, of those that are as strong as wanted if all readings go through them, or the last of them.
fn strong_enough<A: Copy>(
    draw: &mut Draw,
    (stand, axis, wanted): (&Stand, usize, f64),
    maps: &[A],
    read: impl Fn(A, i32) -> i32,
) -> A {
    let is_strong = |of: &A| {
        let known = Known::map(stand, axis, 1.0, |code| read(*of, code));
        known.strength(stand, axis) >= wanted
    };
    let enough: Vec<A> = maps.iter().copied().filter(is_strong).collect();
    match enough.as_slice() {
        [] => maps[maps.len() - 1],
        some => draw.one_of(some),
    }
}

/// A code with two of its bits exchanged.
fn with_exchanged((one, other): (u32, u32), code: i32) -> i32 {
    let differ = ((code >> one) ^ (code >> other)) & 1;
    code ^ (differ << one | differ << other)
}

/// The bus is read bit by bit in software, and an interrupt that falls between two bits lets each be taken for the other:
/// the word has as many ones as before, at the wrong places.
pub(super) fn exchanged(draw: &mut Draw, stand: &Stand, axis: usize, wanted: f64) -> Shape {
    // Some, where the noise reaches over few codes, are not enough whatever their chance.
    const PAIRS: [(u32, u32); 5] = [(0, 2), (1, 2), (0, 3), (1, 3), (2, 3)];
    let pair = strong_enough(draw, (stand, axis, wanted), &PAIRS, with_exchanged);
    map(axis, move |code| with_exchanged(pair, code))
}

/// What is read again of a code whose rate is printed in a unit, of a deg/s, with so many digits.
fn read_again((unit, digits): (f64, i32), code: i32) -> i32 {
    let rate = LSB * unit * f64::from(code);
    if code == 0 {
        return 0;
    }
    let place = 10f64.powi(rate.abs().log10().floor() as i32 + 1 - digits);
    ((rate / place).round() * place / unit / LSB).round() as i32
}

/// Lines printed with few digits, and read again: the last one is more than a count, and less than the noise, at the rates of a
/// stand at rest.
pub(super) fn printed(draw: &mut Draw, stand: &Stand, axis: usize, wanted: f64) -> Shape {
    // By deg/s, gon/s, minutes of arc a second, and deg/h.
    const FORMS: [(f64, i32); 5] = [(1.0, 2), (10.0 / 9.0, 2), (60.0, 2), (60.0, 1), (3600.0, 1)];
    let form = strong_enough(draw, (stand, axis, wanted), &FORMS, read_again);
    map(axis, move |code| read_again(form, code))
}

/// A rate printed by its whole and its hundredths, as "%d.%d" does: the zero of hundredths below ten is missing, and 1.05
/// is read again as 1.5. Some lines are printed so.
pub(super) fn without_zero(code: i32) -> i32 {
    const HUNDREDTHS: i32 = 100;
    let hundredths = (f64::from(HUNDREDTHS) * LSB * f64::from(code)).round() as i32;
    let part = hundredths.abs() % HUNDREDTHS;
    if !(1..10).contains(&part) {
        return code;
    }
    // What has one digit counts tenths.
    let read = hundredths.abs() - part + 10 * part;
    let rate = f64::from(hundredths.signum() * read) / f64::from(HUNDREDTHS);
    (rate / LSB).round() as i32
}

/// The law of the codes when those further than a gate from the middle code are put between two others.
fn law_of_gate(stand: &Stand, axis: usize, gate: i32) -> Law {
    let (mean, sigma) = mean_and_sigma(stand, axis);
    let even = law(stand, axis);
    let middle = mean.round() as i32;
    let edges = even_edges(even.first, even.shares.len());
    // The mean of two readings.
    let halves = shares(&edges, mean, sigma / 2f64.sqrt());
    let is_far = |code: i32| (code - middle).abs() > gate;
    let far = even.codes().filter(|(code, _)| is_far(*code));
    let out: f64 = far.map(|(_, p)| p).sum();
    let stays = |(code, p)| if is_far(code) { 0.0 } else { p };
    let within: Vec<f64> = even.codes().map(stays).collect();
    even.with(each_pair(&within, &halves, |p, half| p + out * half))
}

/// A gate against disturbances that was set too narrow: a reading beyond it is taken out, and the mean of the one before
/// and the one after put in its place. There is no rail on which readings would crowd: they are gone. Its strength is that
/// of its codes alone, the gate the widest, in whole counts, that has the wanted one, or the one that has most.
pub(super) fn gated(stand: &Stand, axis: usize, wanted: f64) -> Shape {
    let (mean, sigma) = mean_and_sigma(stand, axis);
    let known = |gate: i32| Known::codes(law_of_gate(stand, axis, gate));
    let strength = |gate: i32| known(gate).strength(stand, axis);
    // Within a sigma few readings are left that were not made of others.
    let gates = || (sigma.ceil() as i32..=(5.0 * sigma).ceil() as i32).rev();
    let strongest = gates().max_by(|a, b| strength(*a).total_cmp(&strength(*b)));
    let gate = gates()
        .find(|gate| strength(*gate) >= wanted)
        .or(strongest)
        .unwrap_or(1);
    let middle = mean.round() as i32;
    let change = Change::made(move |counts, _| {
        let own = &counts[axis];
        let last = own.len() - 1;
        let given = |i: usize| {
            if (own[i] - middle).abs() <= gate {
                return own[i];
            }
            let (before, after) = (own[i.saturating_sub(1)], own[(i + 1).min(last)]);
            // Half counts upward and downward in turn.
            (before + after + (i % 2) as i32).div_euclid(2)
        };
        (0..=last).map(given).collect()
    });
    Shape::Fixed(known(gate), change)
}
