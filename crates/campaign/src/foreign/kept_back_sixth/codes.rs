//! The sixth set's codes and couplings of axes.

use super::super::kept_back::{of_law, shares};
use super::super::kept_back_fifth::noise::of_edges;
use super::super::kept_back_fourth::codes::{law, long_run, of_steps};
use super::super::{Change, Foreign};
use crate::random::Draw;
use crate::stand::{LSB, Stand};
use crate::strength::{Meter, size_for};

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    Some(match name {
        "gain that differs with the sense" => two_gains(draw, stand, name, axis, wanted),
        "step that grows with the reading" => growing_steps(draw, stand, name, axis, wanted),
        "two lines of the word exchanged" => exchanged(draw, stand, name, axis, wanted),
        "lowest bit that carries the parity" => {
            let strength = |chance: f64| of_map(stand, axis, chance.min(1.0), &with_parity);
            let chance = size_for(wanted, &strength).min(1.0);
            mapped(name, axis, chance, strength(chance), with_parity)
        }
        "far readings put between their neighbours" => between(stand, name, axis, wanted),
        "reading that may change by so much at most" => limited(stand, name, axis, wanted),
        "toggling line of another axis's word" => toggling(draw, stand, name, axis, wanted),
        "another axis, its sign alternating" => alternating(draw, stand, name, axis, wanted),
        "product of the two other axes" => product(draw, stand, name, axis, wanted),
        _ => return None,
    })
}

pub(in super::super) fn mean_and_sigma(stand: &Stand, axis: usize) -> (f64, f64) {
    (stand.bias[axis] / LSB, stand.white(axis).sqrt() / LSB)
}

/// Lower edges, counts, of codes about a middle, above which the rate counts `exp(log_ratio / 2)` times, below it the
/// inverse.
fn of_two_gains(middle: f64, reach: i32, log_ratio: f64) -> (i32, Vec<f64>) {
    let gain = (0.5 * log_ratio).exp();
    let first = middle.round() as i32 - reach;
    let edge = |code: i32| {
        let off = f64::from(code) - 0.5 - middle;
        middle + if off > 0.0 { off / gain } else { off * gain }
    };
    (first, (first..=first + 2 * reach).map(edge).collect())
}

/// A push-pull read-out of two electrodes, of which one has the smaller gain: the reading has a kink where the sense of
/// the rate changes, near the middle of the noise.
fn two_gains(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let (mean, sigma) = mean_and_sigma(stand, axis);
    let (middle, sign) = (mean + sigma * draw.between(-0.3, 0.3), draw.sign());
    let reach = (20.0 * sigma).ceil() as i32;
    let at = |log_ratio: f64| of_two_gains(middle, reach, sign * log_ratio.min(1.6));
    let strength = |log_ratio: f64| {
        let (first, edges) = at(log_ratio);
        of_edges(stand, axis, first, &edges)
    };
    let log_ratio = size_for(wanted, &strength);
    let (first, edges) = at(log_ratio);
    Foreign {
        name,
        strength: of_edges(stand, axis, first, &edges),
        change: Change::Edges(first, edges),
    }
}

/// Lower edges, counts, of codes about a middle when every other is missing beyond a limit, and three of four beyond twice
/// as much.
fn of_growing(middle: i32, limit: i32, reach: i32) -> (i32, Vec<f64>) {
    let mut codes = vec![0];
    let mut last = 0;
    while last < reach {
        last += match last {
            l if l < limit => 1,
            l if l < 2 * limit => 2,
            _ => 4,
        };
        codes.push(last);
        codes.insert(0, -last);
    }
    let first = codes[0];
    let edges = (first..=last)
        .map(|code| {
            // A code that is missing begins where the next one does that is not.
            let next = codes.partition_point(|c| *c < code);
            let below = if next == 0 {
                f64::from(codes[0]) - 1.0
            } else {
                f64::from(codes[next - 1])
            };
            f64::from(middle) + 0.5 * (below + f64::from(codes[next]))
        })
        .collect();
    (middle + first, edges)
}

/// A word of few bits that is a number times a power of two, the bias taken off before: small readings are told to the
/// count, larger ones by twos and by fours. The limit is the largest that makes it as strong as wanted.
fn growing_steps(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let (mean, sigma) = mean_and_sigma(stand, axis);
    let middle = (mean + sigma * draw.between(-0.5, 0.5)).round() as i32;
    let reach = (8.0 * sigma).ceil() as i32;
    let strength = |limit: i32| {
        let (first, edges) = of_growing(middle, limit, reach);
        of_edges(stand, axis, first, &edges)
    };
    let limit = (1..reach)
        .rev()
        .find(|limit| strength(*limit) >= wanted)
        .unwrap_or(1);
    let (first, edges) = of_growing(middle, limit, reach);
    Foreign {
        name,
        strength: strength(limit),
        change: Change::Edges(first, edges),
    }
}

/// Shares of the codes when some are read as others, with a chance: the first code, and the shares.
pub(in super::super) fn law_of_map(
    stand: &Stand,
    axis: usize,
    chance: f64,
    map: &dyn Fn(i32) -> i32,
) -> (i32, Vec<f64>) {
    let (first, even) = law(stand, axis);
    let mut read: Vec<f64> = even.iter().map(|p| (1.0 - chance) * p).collect();
    for (i, p) in even.iter().enumerate() {
        let code = map(first + i as i32) - first;
        // What is read as something beyond the codes that are followed is next to nothing.
        if let Some(share) = usize::try_from(code).ok().and_then(|c| read.get_mut(c)) {
            *share += chance * p;
        }
    }
    (first, read)
}

/// Shares that a normal law of their own mean and variance gives the same codes.
pub(in super::super) fn refitted(first: i32, read: &[f64]) -> Vec<f64> {
    let codes = || {
        read.iter()
            .enumerate()
            .map(|(i, p)| (f64::from(first) + i as f64, p))
    };
    let mean: f64 = codes().map(|(c, p)| c * p).sum();
    let square: f64 = codes().map(|(c, p)| (c - mean).powi(2) * p).sum();
    let edges: Vec<f64> = (0..=read.len())
        .map(|i| f64::from(first) + i as f64 - 0.5)
        .collect();
    shares(&edges, mean, (square - 1.0 / 12.0).max(1e-3).sqrt())
}

/// d' of codes that are read as others, mean and variance refitted.
pub(in super::super) fn of_map(
    stand: &Stand,
    axis: usize,
    chance: f64,
    map: &dyn Fn(i32) -> i32,
) -> f64 {
    let (first, read) = law_of_map(stand, axis, chance, map);
    of_law(&read, &refitted(first, &read), stand.samples())
}

/// The effect of such a reading.
pub(in super::super) fn mapped(
    name: &'static str,
    axis: usize,
    chance: f64,
    strength: f64,
    map: impl Fn(i32) -> i32 + 'static,
) -> Foreign {
    let change = move |counts: &[Vec<i32>; 3], draw: &mut Draw| {
        let read = |c: &i32| if draw.chance(chance) { map(*c) } else { *c };
        counts[axis].iter().map(read).collect()
    };
    Foreign {
        name,
        strength,
        change: Change::Made(Box::new(change)),
    }
}

/// A code with two of its bits exchanged.
pub(in super::super) fn with_exchanged(code: i32, (one, other): (u32, u32)) -> i32 {
    let differ = ((code >> one) ^ (code >> other)) & 1;
    code ^ (differ << one | differ << other)
}

/// The bus is read bit by bit in software, and an interrupt that falls between two bits lets each be taken for the other:
/// the word has as many ones as before, at the wrong places.
fn exchanged(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    const PAIRS: [(u32, u32); 5] = [(0, 2), (1, 2), (0, 3), (1, 3), (2, 3)];
    let strength = |chance: f64, pair: (u32, u32)| {
        of_map(stand, axis, chance.min(1.0), &|c| with_exchanged(c, pair))
    };
    // Some pairs, where the noise reaches over few codes, are not enough whatever their chance.
    let enough: Vec<_> = PAIRS
        .into_iter()
        .filter(|p| strength(1.0, *p) >= wanted)
        .collect();
    let pair = match enough.len() {
        0 => (2, 3),
        k => enough[draw.of_many(k)],
    };
    let chance = size_for(wanted, &|x| strength(x, pair)).min(1.0);
    mapped(name, axis, chance, strength(chance, pair), move |c| {
        with_exchanged(c, pair)
    })
}

/// A code whose lowest bit is the parity of the others. Frames of one kind spend their lowest bit so, against errors of the
/// line, and come by chance among the others.
pub(in super::super) fn with_parity(code: i32) -> i32 {
    let others = code & !1;
    others | (others.count_ones() & 1) as i32
}

/// Shares of the codes when those further than a gate from the middle code are put between two others.
pub(in super::super) fn law_of_gate(stand: &Stand, axis: usize, gate: i32) -> (i32, Vec<f64>) {
    let (mean, sigma) = mean_and_sigma(stand, axis);
    let (first, even) = law(stand, axis);
    let middle = mean.round() as i32;
    let edges: Vec<f64> = (0..=even.len())
        .map(|i| f64::from(first) + i as f64 - 0.5)
        .collect();
    // The mean of two readings.
    let halves = shares(&edges, mean, sigma / 2f64.sqrt());
    let far = |i: usize| (first + i as i32 - middle).abs() > gate;
    let out: f64 = (0..even.len()).filter(|i| far(*i)).map(|i| even[i]).sum();
    let law = (0..even.len())
        .map(|i| if far(i) { 0.0 } else { even[i] } + out * halves[i])
        .collect();
    (first, law)
}

/// A gate against disturbances that was set too narrow: a reading beyond it is taken out, and the mean of the one before
/// and the one after put in its place. There is no rail on which readings would crowd: they are gone. Its strength is that
/// of its codes alone, the gate the widest, in whole counts, that has the wanted one, or the one that has most.
fn between(stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let (mean, sigma) = mean_and_sigma(stand, axis);
    let strength = |gate: i32| {
        let (first, law) = law_of_gate(stand, axis, gate);
        of_law(&law, &refitted(first, &law), stand.samples())
    };
    // Within a sigma few readings are left that were not made of others.
    let gates = || (sigma.ceil() as i32..=(5.0 * sigma).ceil() as i32).rev();
    let strongest = gates().max_by(|a, b| strength(*a).total_cmp(&strength(*b)));
    let gate = gates()
        .find(|gate| strength(*gate) >= wanted)
        .or(strongest)
        .unwrap_or(1);
    let middle = mean.round() as i32;
    let change = move |counts: &[Vec<i32>; 3], _: &mut Draw| {
        let own = &counts[axis];
        let last = own.len() - 1;
        (0..own.len())
            .map(|i| {
                if (own[i] - middle).abs() <= gate {
                    return own[i];
                }
                let (before, after) = (own[i.saturating_sub(1)], own[(i + 1).min(last)]);
                // Half counts upward and downward in turn.
                (before + after + (i % 2) as i32).div_euclid(2)
            })
            .collect()
    };
    Foreign {
        name,
        strength: strength(gate),
        change: Change::Made(Box::new(change)),
    }
}

/// Chances from each code (row) to the next reading's, when it may be at most so many counts away.
pub(in super::super) fn steps_within(even: &[f64], most: usize) -> Vec<Vec<f64>> {
    let n = even.len();
    (0..n)
        .map(|from| {
            let (low, high) = (from.saturating_sub(most), (from + most).min(n - 1));
            let mut row = vec![0.0; n];
            row[low..=high].copy_from_slice(&even[low..=high]);
            row[low] += even[..low].iter().sum::<f64>();
            row[high] += even[high + 1..].iter().sum::<f64>();
            row
        })
        .collect()
}

/// d' of readings that may change by so many counts at most, mean and variance refitted.
pub(in super::super) fn of_limit(stand: &Stand, axis: usize, most: usize) -> f64 {
    let (first, even) = law(stand, axis);
    let steps = steps_within(&even, most);
    let long = long_run(&steps, &even);
    let other = refitted(first, &long);
    of_steps(&steps, &long, &|_, to| other[to], stand.samples())
}

/// A plausibility check, as industry has it for slow sensors: a reading may differ from the last one given by so much at
/// most, and is otherwise moved there. The limit is the largest, in whole counts, of the wanted strength.
fn limited(stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let widest = (7.0 * sigma).ceil() as usize;
    let most = (1..=widest)
        .rev()
        .find(|most| of_limit(stand, axis, *most) >= wanted)
        .unwrap_or(1);
    let counts_at_most = most as i32;
    let change = move |counts: &[Vec<i32>; 3], _: &mut Draw| {
        let mut last = counts[axis][0];
        let next = |c: &i32| {
            last = (*c).clamp(last - counts_at_most, last + counts_at_most);
            last
        };
        counts[axis].iter().map(next).collect()
    };
    Foreign {
        name,
        strength: of_limit(stand, axis, most),
        change: Change::Made(Box::new(change)),
    }
}

/// White readings of an axis about its bias, deg/s.
pub(in super::super) fn white_of(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    let sigma = stand.white(axis).sqrt();
    (0..stand.samples())
        .map(|_| sigma * draw.normal())
        .collect()
}

/// What the frames of other axes add to this one, a signal of this kind giving the strength; the converter rounds again.
pub(in super::super) fn coupled(
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
    like: &[f64],
    of: impl Fn(&[Vec<i32>; 3], usize) -> f64 + 'static,
) -> Foreign {
    coupled_series(stand, name, axis, wanted, like, move |counts| {
        (0..counts[axis].len()).map(|i| of(counts, i)).collect()
    })
}

/// The same of what the whole run of the other axes adds, deg/s.
pub(in super::super) fn coupled_series(
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
    like: &[f64],
    of: impl Fn(&[Vec<i32>; 3]) -> Vec<f64> + 'static,
) -> Foreign {
    let meter = Meter::new(stand, axis);
    let (size, strength) = meter.sized(&meter.energy(like), wanted);
    let change = move |counts: &[Vec<i32>; 3], draw: &mut Draw| {
        counts[axis]
            .iter()
            .zip(of(counts))
            .map(|(own, added)| {
                let rate = f64::from(*own) + draw.between(-0.5, 0.5);
                (rate + size * added / LSB).round() as i32
            })
            .collect()
    };
    Foreign {
        name,
        strength,
        change: Change::Made(Box::new(change)),
    }
}

/// While this axis is converted, the word of another is shifted out, and the line of one of its two lowest bits reaches the
/// input: more where the bit is 1. The bit is as good as independent of the number.
fn toggling(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let (other, bit, sign) = (
        (axis + 1 + draw.of_many(2)) % 3,
        draw.of_many(2),
        draw.sign(),
    );
    let like: Vec<f64> = (0..stand.samples()).map(|_| 0.5 * draw.sign()).collect();
    coupled(stand, name, axis, wanted, &like, move |counts, i| {
        sign * (f64::from(counts[other][i] >> bit & 1) - 0.5)
    })
}

/// A multiplexer that is chopped: what leaks from the axis before comes with one sign in one frame and with the other in
/// the next.
fn alternating(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let (other, first) = ((axis + 1 + draw.of_many(2)) % 3, draw.of_many(2));
    let like = white_of(draw, stand, other);
    let middle = stand.bias[other];
    coupled(stand, name, axis, wanted, &like, move |counts, i| {
        let sign = if (i + first) % 2 == 0 { 1.0 } else { -1.0 };
        sign * (LSB * f64::from(counts[other][i]) - middle)
    })
}

/// Anisoinertia (IEEE Std 528), or an amplifier that is bent and shared: the product of what the two other axes read.
fn product(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let (one, other, sign) = ((axis + 1) % 3, (axis + 2) % 3, draw.sign());
    let (a, b) = (white_of(draw, stand, one), white_of(draw, stand, other));
    let like: Vec<f64> = a.iter().zip(b).map(|(a, b)| a * b).collect();
    let (first, second) = (stand.bias[one], stand.bias[other]);
    coupled(stand, name, axis, wanted, &like, move |counts, i| {
        let about = |k: usize, middle: f64| LSB * f64::from(counts[k][i]) - middle;
        sign * about(one, first) * about(other, second)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stand::Needs;

    fn stand() -> Stand {
        let draw = &mut Draw::of(20_261_121, 44, 0);
        Stand::draw(draw, 600.0, 20.0, Needs::default())
    }

    #[test]
    fn equal_gains_are_no_effect_and_unequal_ones_keep_the_middle() {
        let stand = stand();
        let (first, edges) = of_two_gains(0.3, 60, 0.0);
        for (i, e) in edges.iter().enumerate() {
            assert!((e - (f64::from(first) + i as f64 - 0.5)).abs() < 1e-9);
        }
        let (first, edges) = of_two_gains(0.0, 60, 2.0 * 2f64.ln());
        let at = |x: f64| first + edges.partition_point(|e| *e <= x) as i32 - 1;
        assert_eq!((at(10.0), at(-10.0), at(0.0)), (20, -5, 0));
        let middle = stand.bias[0] / LSB;
        let (first, edges) = of_two_gains(middle, 90, 1.0);
        assert!(of_edges(&stand, 0, first, &edges) > 25.0);
    }

    #[test]
    fn steps_grow_by_powers_of_two_beyond_the_limit() {
        let (first, edges) = of_growing(100, 4, 20);
        let at = |x: f64| first + edges.partition_point(|e| *e <= x) as i32 - 1 - 100;
        let read: Vec<i32> = (-14..=14).map(|c| at(100.1 + f64::from(c))).collect();
        let all = [0, 1, 2, 3, 4, 6, 8, 12, 16, 20];
        for (c, r) in (-14..=14).zip(&read) {
            let x = f64::from(c) + 0.1;
            let off = |k: f64| (x - k).abs();
            let best = all
                .iter()
                .flat_map(|k| [f64::from(*k), -f64::from(*k)])
                .map(off)
                .fold(f64::INFINITY, f64::min);
            assert!((off(f64::from(*r)) - best).abs() < 1e-9, "{c}: {r}");
        }
        assert!(read.windows(2).all(|w| w[0] <= w[1]) && read.contains(&-12));
    }

    #[test]
    fn exchanged_bits_come_back_and_parity_is_even() {
        for code in -40..40 {
            for pair in [(0, 2), (1, 3)] {
                let read = with_exchanged(code, pair);
                assert_eq!(with_exchanged(read, pair), code);
                assert_eq!(read.count_ones(), code.count_ones());
            }
            let read = with_parity(code);
            assert!(read >> 1 == code >> 1 && read.count_ones().is_multiple_of(2));
        }
        assert_eq!(with_exchanged(0b0100, (0, 2)), 0b0001);
    }

    #[test]
    fn chances_of_a_limited_change_sum_to_one_and_a_wide_limit_is_none() {
        let stand = stand();
        let (_, even) = law(&stand, 0);
        for most in [1, 5, 12] {
            for row in steps_within(&even, most) {
                assert!((row.iter().sum::<f64>() - even.iter().sum::<f64>()).abs() < 1e-9);
            }
        }
        assert!(of_limit(&stand, 0, even.len()) < 0.5);
        let (first, law) = law_of_gate(&stand, 0, even.len() as i32);
        assert!(of_law(&law, &refitted(first, &law), stand.samples()) < 0.5);
    }
}
