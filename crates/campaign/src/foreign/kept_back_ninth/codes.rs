//! The ninth set's couplings of axes and codes.

use std::f64::consts::TAU;

use super::super::kept_back_fourth::codes::{law, long_run, of_steps, other_than};
use super::super::kept_back_sixth::codes::{coupled_series, refitted, white_of};
use super::super::{Change, Foreign};
use super::resonating;
use crate::random::Draw;
use crate::stand::{LSB, Stand};
use crate::strength::size_for;

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    Some(match name {
        "another axis through a resonance" => resonance(draw, stand, name, axis, wanted),
        "gain that another axis turns" => gain(draw, stand, name, axis, wanted),
        "diode between two axes" => diode(draw, stand, name, axis, wanted),
        "low bits that a latch keeps" => {
            let bits = 1 + draw.of_many(2);
            by_chance(stand, name, axis, wanted, latched(bits))
        }
        "differences sent in few levels" => by_chance(stand, name, axis, wanted, in_levels),
        "code taken for a fault" => {
            let fault = fault_of(draw, stand, axis);
            by_chance(stand, name, axis, wanted, repeated(fault))
        }
        "gaps bridged by straight lines" => bridged(draw, stand, name, axis, wanted),
        _ => return None,
    })
}

/// What an axis has read about its bias, deg/s.
fn about_bias(counts: &[i32], bias: f64) -> Vec<f64> {
    let off = |c: &i32| LSB * f64::from(*c) - bias;
    counts.iter().map(off).collect()
}

/// The element of one axis shakes the frame, and the frame, which has a mode of its own, that of this one: nothing in the
/// same frame, then a ringing.
fn resonance(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let (other, rate_hz) = (other_than(draw, axis), stand.rate_hz);
    let mode = (draw.by_ratio(0.8, 8.5), draw.by_ratio(0.1, 0.6));
    let like = resonating(&white_of(draw, stand, other), mode, rate_hz);
    let bias = stand.bias[other];
    coupled_series(stand, name, axis, wanted, &like, move |counts| {
        resonating(&about_bias(&counts[other], bias), mode, rate_hz)
    })
}

/// Readings of an axis that are made of its own and another's of the same frame, each about its bias, deg/s.
fn of_both(
    stand: &Stand,
    (axis, other): (usize, usize),
    of: impl Fn(f64, f64) -> f64 + 'static,
) -> Change {
    let (own_bias, bias) = (stand.bias[axis], stand.bias[other]);
    let change = move |counts: &[Vec<i32>; 3], draw: &mut Draw| {
        about_bias(&counts[other], bias)
            .iter()
            .zip(&counts[axis])
            .map(|(z, own)| {
                // Within its step the rate is anywhere.
                let rate = LSB * (f64::from(*own) + draw.between(-0.5, 0.5)) - own_bias;
                ((own_bias + of(rate, *z)) / LSB).round() as i32
            })
            .collect()
    };
    Change::Made(Box::new(change))
}

/// d' of `n` readings whose gain is exp(turn z) for a z of the normal law: what is left of the logarithms of the variance.
pub(in super::super) fn of_gain(turn: f64, n: usize) -> f64 {
    turn * (2.0 * n as f64).sqrt()
}

/// An amplifier whose gain is set by a current that another axis carries along: this one is louder while that is on one
/// side, and quieter on the other, by decibels.
fn gain(draw: &mut Draw, stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let (other, sign) = (other_than(draw, axis), draw.sign());
    let turn = wanted / of_gain(1.0, stand.samples());
    let sigma = stand.white(other).sqrt();
    Foreign {
        name,
        strength: of_gain(turn, stand.samples()),
        change: of_both(stand, (axis, other), move |own, z| {
            own * (sign * turn * z / sigma).exp()
        }),
    }
}

/// A diode from another axis's line to this one's.
#[derive(Clone, Copy)]
pub(in super::super) struct Diode {
    /// How far the other has to be beyond this one, deg/s.
    threshold: f64,
    /// Share of what it is beyond that comes over.
    share: f64,
}

impl Diode {
    /// Largest share: at 1 the two lines are one.
    const MOST: f64 = 0.9;

    pub(in super::super) fn of(self, own: f64, other: f64) -> f64 {
        own + self.share * (other - own - self.threshold).max(0.0)
    }

    /// d' of readings of an axis that these of the other do so to, the variance refitted: what the law narrows by, where
    /// it conducts, over what the readings as a whole still spread.
    pub(in super::super) fn strength(self, own: &[f64], other: &[f64], white: f64) -> f64 {
        let n = own.len() as f64;
        let with: Vec<f64> = own
            .iter()
            .zip(other)
            .map(|(w, o)| self.of(*w, *o))
            .collect();
        let variance = |of: &[f64]| {
            let mean = of.iter().sum::<f64>() / n;
            of.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n
        };
        let open = |(w, o): &(&f64, &f64)| *o - *w > self.threshold;
        let conducts = own.iter().zip(other).filter(open).count() as f64;
        // The draws themselves are not exactly of their variance.
        let spread = variance(&with) / variance(own) * white;
        (n * (spread / white).ln() - 2.0 * conducts * (-self.share).ln_1p())
            .max(0.0)
            .sqrt()
    }
}

/// The size of a diode that is `wanted` strong, and the readings it was found on.
pub(in super::super) fn diode_of(
    draw: &mut Draw,
    stand: &Stand,
    (axis, other): (usize, usize),
    wanted: f64,
) -> (Diode, [Vec<f64>; 2]) {
    let white = stand.white(axis);
    let threshold = white.sqrt() * draw.between(0.0, 1.0);
    let own = white_of(draw, stand, axis);
    let of = white_of(draw, stand, other);
    let at = |share: f64| Diode {
        threshold,
        share: share.min(Diode::MOST),
    };
    let share = size_for(wanted, &|share| at(share).strength(&own, &of, white));
    (at(share), [own, of])
}

/// A protection diode between two lines: where another axis is far enough above this one it draws it along. The line that
/// a part of it is counts as true.
fn diode(draw: &mut Draw, stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let other = other_than(draw, axis);
    let (diode, [own, of]) = diode_of(draw, stand, (axis, other), wanted);
    Foreign {
        name,
        strength: diode.strength(&own, &of, stand.white(axis)),
        change: of_both(stand, (axis, other), move |own, z| diode.of(own, z)),
    }
}

/// What is read, by the reading before and the code, counts.
pub(in super::super) type Next = dyn Fn(i32, i32) -> i32;

/// Chances from each code (row) to the next reading's, when with `chance` it is what `next` makes of the reading before
/// and the code.
pub(in super::super) fn steps_of(
    stand: &Stand,
    axis: usize,
    chance: f64,
    next: &Next,
) -> Vec<Vec<f64>> {
    let (first, even) = law(stand, axis);
    let last = even.len() as i32 - 1;
    (0..=last)
        .map(|from| {
            let mut row: Vec<f64> = even.iter().map(|p| (1.0 - chance) * p).collect();
            for (code, p) in (first..).zip(&even) {
                let to = next(first + from, code) - first;
                row[to.clamp(0, last) as usize] += chance * p;
            }
            row
        })
        .collect()
}

/// d' of such readings, mean and variance refitted.
pub(in super::super) fn of_next(stand: &Stand, axis: usize, chance: f64, next: &Next) -> f64 {
    let (first, even) = law(stand, axis);
    let steps = steps_of(stand, axis, chance, next);
    let shares = long_run(&steps, &even);
    let other = refitted(first, &shares);
    of_steps(&steps, &shares, &|_, to| other[to], stand.samples())
}

/// Readings that with some chance are what `next` makes of the reading before and the code.
pub(in super::super) fn by_chance(
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
    next: impl Fn(i32, i32) -> i32 + 'static,
) -> Foreign {
    let strength = |chance: f64| of_next(stand, axis, chance.min(1.0), &next);
    let chance = size_for(wanted, &strength).min(1.0);
    let strength = strength(chance);
    let change = move |counts: &[Vec<i32>; 3], draw: &mut Draw| {
        let own = &counts[axis];
        let mut reading = own[0];
        own.iter()
            .map(|code| {
                reading = if draw.chance(chance) {
                    next(reading, *code)
                } else {
                    *code
                };
                reading
            })
            .collect()
    };
    Foreign {
        name,
        strength,
        change: Change::Made(Box::new(change)),
    }
}

/// A latch for the lowest bits of the word that misses its strobe: they stay as they were, and the others are new.
pub(in super::super) fn latched(bits: usize) -> impl Fn(i32, i32) -> i32 {
    let low = (1 << bits) - 1;
    move |before, code| (code & !low) | (before & low)
}

/// A link that sends a difference where there is no room for a word: 0, or one of the powers of 2, whichever is nearest.
pub(in super::super) fn in_levels(before: i32, code: i32) -> i32 {
    let off = code - before;
    let size = off.unsigned_abs();
    let below = size.checked_ilog2().map_or(0, |power| 1u32 << power);
    let nearest = if 2 * size > 3 * below {
        2 * below
    } else {
        below
    };
    before + off.signum() * nearest as i32
}

/// A driver that takes one code, some part's sign for "no data", for a fault and gives the reading before instead.
pub(in super::super) fn repeated(fault: i32) -> impl Fn(i32, i32) -> i32 {
    move |before, code| if code == fault { before } else { code }
}

/// A code that comes often enough.
pub(in super::super) fn fault_of(draw: &mut Draw, stand: &Stand, axis: usize) -> i32 {
    let sigma = stand.white(axis).sqrt();
    ((stand.bias[axis] + sigma * draw.between(-0.7, 0.7)) / LSB).round() as i32
}

/// Readings of a gap, least and most.
const GAP: (usize, usize) = (4, 10);

/// Nats by which a straight line tells a reading that lies on it from one of the noise: that of the density at the line,
/// for the converter's step, averaged over a gap of this many readings.
pub(in super::super) fn nats_of_gap(length: usize, sigma_counts: f64) -> f64 {
    let square = |k: usize| {
        let part = k as f64 / (length + 1) as f64;
        part.powi(2) + (1.0 - part).powi(2)
    };
    let mean = (1..=length).map(square).sum::<f64>() / length as f64;
    (sigma_counts * TAU.sqrt()).ln() + 0.5 * mean
}

/// A driver that hides what the link has lost: between the last reading before a gap and the first one after it there is a
/// straight line.
fn bridged(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let (n, sigma) = (stand.samples(), stand.white(axis).sqrt() / LSB);
    let mut gaps: Vec<(usize, usize)> = vec![];
    let mut left = 0.5 * wanted * wanted;
    while left > 0.0 {
        let (from, length) = (
            1 + draw.of_many(n - GAP.1 - 2),
            GAP.0 + draw.of_many(GAP.1 + 1 - GAP.0),
        );
        let free = |(f, l): &(usize, usize)| from > f + l || *f > from + length;
        if !gaps.iter().all(free) {
            continue;
        }
        // The last one is as short as it has to be.
        let of = |length: &usize| *length as f64 * nats_of_gap(*length, sigma);
        let off = |length: &usize| (of(length) - left).abs();
        let length = (1..=length)
            .min_by(|a, b| off(a).total_cmp(&off(b)))
            .unwrap_or(length);
        left -= of(&length);
        gaps.push((from, length));
        if left < 0.5 * nats_of_gap(1, sigma) {
            break;
        }
    }
    let strength = (wanted * wanted - 2.0 * left).sqrt();
    let change = move |counts: &[Vec<i32>; 3], _: &mut Draw| {
        let mut own = counts[axis].clone();
        for (from, length) in &gaps {
            let (before, after) = (own[from - 1], own[from + length]);
            for k in 1..=*length {
                let part = k as f64 / (length + 1) as f64;
                let along = f64::from(before) + part * f64::from(after - before);
                own[from + k - 1] = along.round() as i32;
            }
        }
        own
    };
    Foreign {
        name,
        strength,
        change: Change::Made(Box::new(change)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stand::Needs;

    fn stand() -> Stand {
        let draw = &mut Draw::of(20_261_122, 89, 0);
        Stand::draw(draw, 600.0, 20.0, Needs::default())
    }

    #[test]
    fn steps_are_chances_and_no_chance_is_no_effect() {
        let stand = stand();
        let fault = (stand.bias[0] / LSB).round() as i32;
        let nexts: [&Next; 3] = [&latched(2), &in_levels, &repeated(fault)];
        for next in nexts {
            for row in steps_of(&stand, 0, 0.4, next) {
                assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-6);
            }
            assert!(of_next(&stand, 0, 0.0, next) < 1.0);
            assert!(of_next(&stand, 0, 0.9, next) > 25.0);
        }
    }

    #[test]
    fn a_latch_keeps_low_bits_a_difference_is_a_power_of_two_and_a_fault_repeats() {
        assert_eq!(latched(2)(0b0110, 0b1001), 0b1010);
        assert_eq!(latched(1)(-3, 4), 5);
        let sent = |off: i32| in_levels(10, 10 + off) - 10;
        assert_eq!([0, 1, 2, 3, 4, 5, 6, 7].map(sent), [0, 1, 2, 2, 4, 4, 4, 8]);
        assert_eq!(sent(-13), -16);
        assert_eq!((repeated(5)(2, 5), repeated(5)(2, 4)), (2, 4));
    }

    #[test]
    fn a_gain_is_worth_what_its_law_of_variance_says() {
        let draw = &mut Draw::of(20_261_122, 90, 0);
        const N: usize = 100_000;
        let turn = 0.2;
        let law: Vec<f64> = (0..N).map(|_| (2.0 * turn * draw.normal()).exp()).collect();
        let seen = crate::strength::of_variance(&law);
        let told = of_gain(turn, N);
        assert!((seen / told - 1.0).abs() < 0.02, "{seen} {told}");
    }

    #[test]
    fn a_diode_that_always_conducts_is_worth_what_a_line_is() {
        let stand = stand();
        let draw = &mut Draw::of(20_261_122, 91, 0);
        let (own, other) = (white_of(draw, &stand, 0), white_of(draw, &stand, 1));
        let always = Diode {
            threshold: -1e3,
            share: 0.3,
        };
        // Own noise is 0.7 of what it was, and the rest is the other's.
        let part = (0.3f64 / 0.7).powi(2) * stand.white(1) / stand.white(0);
        let told = (own.len() as f64 * part.ln_1p()).sqrt();
        let seen = always.strength(&own, &other, stand.white(0));
        assert!((seen / told - 1.0).abs() < 0.05, "{seen} {told}");
    }

    #[test]
    fn a_bridge_is_straight_and_its_ends_stay() {
        let stand = stand();
        let draw = &mut Draw::of(20_261_122, 92, 0);
        let f = bridged(draw, &stand, "", 0, 25.0);
        assert!((f.strength - 25.0).abs() < 0.1, "{}", f.strength);
        let Change::Made(change) = &f.change else {
            panic!("it makes new counts")
        };
        let old: Vec<i32> = (0..stand.samples() as i32).map(|i| i * i % 23).collect();
        let new = change(&[old.clone(), old.clone(), old.clone()], draw);
        let moved: Vec<usize> = (0..old.len()).filter(|i| old[*i] != new[*i]).collect();
        assert!((60..250).contains(&moved.len()), "{}", moved.len());
        // Where three in a row were moved the middle one lies between, to the rounding.
        for w in moved.windows(3).filter(|w| w[2] == w[0] + 2) {
            let bend = new[w[0]] - 2 * new[w[1]] + new[w[2]];
            assert!(bend.abs() <= 2, "{bend}");
        }
    }
}
