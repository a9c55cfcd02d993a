//! Readings that depend on those before or after them.

use super::super::super::prelude::*;

/// Chances from each code (row) to the next reading's.
type Steps = Vec<Vec<f64>>;

/// A word that is read in two bytes, of which the low one is new and the high one still that of the reading before: words of 12
/// or 11 bits that begin with the high byte.
pub(super) fn torn(draw: &mut Draw) -> impl Fn(i32, i32) -> i32 + Copy + use<> {
    let mixed = latched(3 + draw.of_many(2));
    move |before, code| mixed(code, before)
}

/// An output stage whose input pair can steer so much current and no more: small changes come out whole, and large ones
/// the less, by the pair's tanh. So it is in the frames in which something else loads it.
pub(super) fn slewing(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let most = sigma * draw.between(0.3, 1.0);
    by_chance(axis, move |before, code| {
        let change = f64::from(code - before);
        before + (most * (change / most).tanh()).round() as i32
    })
}

/// Firmware that smooths what changes little and lets through what changes by more than a gate; where its time runs short,
/// the reading goes out as it is.
pub(super) fn smoothing(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let (gate, share) = (sigma * draw.between(0.8, 2.0), draw.between(0.1, 0.4));
    by_chance(axis, move |before, code| {
        let change = f64::from(code - before);
        let follows = if change.abs() < gate { share } else { 1.0 };
        before + (follows * change).round() as i32
    })
}

/// A latch for the lowest bits of the word that misses its strobe: they stay as they were, and the others are new.
pub(super) fn latched(bits: usize) -> impl Fn(i32, i32) -> i32 + Copy {
    let low = (1 << bits) - 1;
    move |before, code| (code & !low) | (before & low)
}

/// A link that sends a difference where there is no room for a word: 0, or one of the powers of 2, whichever is nearest.
pub(super) fn in_levels(before: i32, code: i32) -> i32 {
    let off = code - before;
    let size = off.unsigned_abs();
    let below = size.checked_ilog2().map_or(0, |power| 1u32 << power);
    let nearest = below << u32::from(2 * size > 3 * below);
    before + off.signum() * nearest as i32
}

/// A driver that takes one code, some part's sign for "no data", for a fault and gives the reading before instead.
pub(super) fn repeated(fault: i32) -> impl Fn(i32, i32) -> i32 + Copy {
    move |before, code| if code == fault { before } else { code }
}

/// An output that is driven upward and let go downward: where a long cable hangs on it, as it does in some frames, it falls
/// by so much at most, of the noise's sigma, from one reading to the next.
pub(super) fn falling(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let most = (sigma * draw.between(0.2, 0.9)).round().max(1.0) as i32;
    by_chance(axis, move |before, code| code.max(before - most))
}

/// Chances of the next reading when one stands until the input is `holds` counts away from it.
fn steps_beyond(stand: &Stand, axis: usize, even: &Law, holds: f64) -> Steps {
    let (mean, sigma) = mean_and_sigma_read(stand, axis);
    let within = |low: f64, high: f64| {
        let share = below((high - mean) / sigma) - below((low - mean) / sigma);
        share.max(0.0)
    };
    let row = |(place, (from, _)): (usize, (i32, f64))| {
        let (low, high) = (f64::from(from) - holds, f64::from(from) + holds);
        // What of a code's width lies outside of what is held.
        let outside = |(to, _): (i32, f64)| {
            let (begins, ends) = (f64::from(to) - 0.5, f64::from(to) + 0.5);
            within(begins, ends.min(low)) + within(begins.max(high), ends)
        };
        let mut row: Vec<f64> = even.codes().map(outside).collect();
        row[place] += within(low, high);
        row
    };
    even.codes().enumerate().map(row).collect()
}

/// A node that saves its line sends a reading on only when it is a threshold away from the last it sent ("send on delta"),
/// and a comparator with hysteresis does the same: the code that stands is wider than the others, and its neighbours
/// come less often after it.
pub(super) fn threshold(axis: usize) -> Shape {
    remade(
        4.0,
        move |stand, beyond| {
            let even = law(stand, axis);
            let steps = steps_beyond(stand, axis, &even, 0.5 + beyond);
            let law = even.with(long_run(&steps, &even.shares));
            Known::Steps(law, steps, even.shares)
        },
        move |counts, draw, beyond| {
            // The first reading is taken whatever it is.
            let sent = carry(f64::INFINITY, &counts[axis], |last, own| {
                let now = within_step(own, draw);
                let goes = (now - last).abs() >= 0.5 + beyond;
                if goes { now.round() } else { last }
            });
            each(&sent, |code| code as i32)
        },
    )
}

/// Chances of the next reading when it may be at most so many counts away.
fn steps_within(even: &[f64], most: usize) -> Steps {
    let n = even.len();
    let row = |from: usize| {
        let (low, high) = (from.saturating_sub(most), (from + most).min(n - 1));
        let mut row = vec![0.0; n];
        row[low..=high].copy_from_slice(&even[low..=high]);
        row[low] += even[..low].iter().sum::<f64>();
        row[high] += even[high + 1..].iter().sum::<f64>();
        row
    };
    (0..n).map(row).collect()
}

/// A plausibility check, as industry has it for slow sensors: a reading may differ from the last one given by so much at
/// most, and is otherwise moved there. The limit is the largest, in whole counts, of the wanted strength.
pub(super) fn limited(stand: &Stand, axis: usize, wanted: f64) -> Shape {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let even = law(stand, axis);
    let known = |most: i32| Known::steps(&even, steps_within(&even.shares, most as usize));
    let most = (1..=(7.0 * sigma).ceil() as i32)
        .rev()
        .find(|most| known(*most).strength(stand, axis) >= wanted)
        .unwrap_or(1);
    let change = Change::made(move |counts, _| {
        let own = &counts[axis];
        carry(own[0], own, slewed(most))
    });
    Shape::Fixed(known(most), change)
}

/// The next reading of an output that may change by so much.
fn slewed(limit: i32) -> impl Fn(i32, i32) -> i32 {
    move |before, code| code.clamp(before - limit, before + limit)
}

/// The limit of a slew that is so steep, 1/counts: between a count and what is as good as none.
fn limit_of(steep: f64) -> f64 {
    (1.0 / steep).clamp(1.0, 200.0)
}

/// An output stage that gets no further than so much between two readings, and is that much nearer then: the whole number
/// below, or the one above as often as what is left says.
pub(super) fn slew(axis: usize) -> Shape {
    remade(
        f64::INFINITY,
        move |stand, steep| {
            let limit = limit_of(steep);
            let steps = |limit: i32| steps_of(stand, axis, 1.0, &slewed(limit));
            let (low, high) = (steps(limit as i32), steps(limit as i32 + 1));
            let part = limit.fract();
            let mixed = |(low, high): (&Vec<f64>, &Vec<f64>)| {
                each_pair(low, high, |l, h| (1.0 - part) * l + part * h)
            };
            Known::steps(
                &law(stand, axis),
                low.iter().zip(&high).map(mixed).collect(),
            )
        },
        move |counts, draw, steep| {
            let limit = limit_of(steep);
            let own = &counts[axis];
            carry(own[0], own, |before, code| {
                let above = i32::from(draw.chance(limit.fract()));
                slewed(limit as i32 + above)(before, code)
            })
        },
    )
}

/// Chances of the next reading when it follows the rate to within so many counts.
fn steps_with_play(stand: &Stand, axis: usize, even: &Law, play: f64) -> Steps {
    let (mean, sigma) = mean_and_sigma_read(stand, axis);
    let n = even.shares.len();
    // Codes of what is left when the play is taken off, below and above.
    let edges = |off: f64| each(&even_edges(even.first, n), |edge| edge + off);
    let up = shares(&edges(play), mean, sigma);
    let down = shares(&edges(-play), mean, sigma);
    let row = |from: usize| {
        let mut row = [&down[..from], &[0.0], &up[from + 1..]].concat();
        row[from] = 1.0 - row.iter().sum::<f64>();
        row
    };
    (0..n).map(row).collect()
}

/// A tracking converter whose comparator has hysteresis: its code moves only when the rate is further off than that, and
/// then no closer.
pub(super) fn play(axis: usize) -> Shape {
    remade(
        6.0,
        move |stand, play| {
            let even = law(stand, axis);
            Known::steps(&even, steps_with_play(stand, axis, &even, play))
        },
        move |counts, draw, play| {
            let own = &counts[axis];
            carry(own[0], own, |code, c| {
                let rate = within_step(c, draw);
                code.clamp((rate - play).round() as i32, (rate + play).round() as i32)
            })
        },
    )
}

/// What is known of a channel by the chances of each two readings beside each other, codes from the first on.
fn of_neighbours(even: &Law, mut both: Steps) -> Known {
    let shares: Vec<f64> = both.iter().map(|row| row.iter().sum()).collect();
    for (row, share) in both.iter_mut().zip(&shares) {
        row.iter_mut().for_each(|p| *p /= share.max(1e-300));
    }
    Known::steps_of(even.with(shares), both)
}

/// The median of three.
fn median(a: i32, b: i32, c: i32) -> i32 {
    a.max(b).min(a.min(b).max(c))
}

/// A reading between two others: their median where it is further than a gate from that.
fn without_spike(before: i32, own: i32, after: i32, gate: i32) -> i32 {
    let middle = median(before, own, after);
    let is_spike = (own - middle).abs() > gate;
    if is_spike { middle } else { own }
}

/// Chances of what is given for a reading, known with one neighbour, by the law of the other one; the gate the whole number
/// below, or the one above as often as what is left says.
fn given(even: &[f64], own: usize, neighbour: usize, gate: f64) -> Vec<(usize, f64)> {
    let mut chances = vec![0.0; even.len()];
    let (whole, part) = (gate as i32, gate.fract());
    for (gate, share) in [(whole, 1.0 - part), (whole + 1, part)] {
        for (other, p) in even.iter().enumerate() {
            let to = without_spike(other as i32, own as i32, neighbour as i32, gate);
            chances[to as usize] += share * p;
        }
    }
    let some = chances.into_iter().enumerate();
    some.filter(|(_, p)| *p > 0.0).collect()
}

/// What is known of readings behind such a gate, counts.
fn behind_gate(stand: &Stand, axis: usize, gate: f64) -> Known {
    let even = law(stand, axis);
    let n = even.shares.len();
    let of_own = |own| {
        let by = |next| given(&even.shares, own, next, gate);
        (0..n).map(by).collect()
    };
    let by: Vec<Vec<Vec<(usize, f64)>>> = (0..n).map(of_own).collect();
    // Of two readings beside each other, each depends on the one further out, and those two not on each other.
    let mut both = vec![vec![0.0; n]; n];
    for (one, p) in even.shares.iter().enumerate() {
        for (two, q) in even.shares.iter().enumerate() {
            for (to, r) in &by[one][two] {
                for (then, s) in &by[two][one] {
                    both[*to][*then] += p * q * r * s;
                }
            }
        }
    }
    of_neighbours(&even, both)
}

/// Firmware against spikes: a reading that is further than a gate from the median of itself and its two neighbours is
/// replaced by that. The gate was set for a part with less noise, and takes readings that were no spikes. The narrower, the
/// stronger.
pub(super) fn despiked(stand: &Stand, axis: usize, wanted: f64) -> Shape {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let gate = last_of((0.0, 6.0 * sigma), 2e-3 * sigma, |gate| {
        behind_gate(stand, axis, gate).strength(stand, axis) > wanted
    });
    let change = Change::made(move |counts, draw| {
        let own = &counts[axis];
        let last = own.len() - 1;
        let one = |i: usize| {
            let (before, after) = (own[i.saturating_sub(1)], own[(i + 1).min(last)]);
            let above = i32::from(draw.chance(gate.fract()));
            without_spike(before, own[i], after, gate as i32 + above)
        };
        (0..=last).map(one).collect()
    });
    Shape::Fixed(behind_gate(stand, axis, gate), change)
}

/// Bits of the part of a word that is packed apart.
const NIBBLE: usize = 4;

/// What is known of readings some of which have the low nibble of the reading after. What two neighbours have in common is the
/// code of the second.
fn known_of_nibble(stand: &Stand, axis: usize, chance: f64) -> Known {
    let even = law(stand, axis);
    let (first, n) = (even.first, even.shares.len());
    let mixed = latched(NIBBLE);
    // A code beyond those that are followed, which next to none is, counts to the last of them.
    let place = |upper: i32, lower: i32| (mixed(lower, upper) - first).clamp(0, n as i32 - 1);
    let mut nibbles = [0.0; 1 << NIBBLE];
    for (code, p) in even.codes() {
        nibbles[code.rem_euclid(1 << NIBBLE) as usize] += p;
    }
    let mut both = vec![vec![0.0; n]; n];
    for (second, q) in even.codes() {
        let mut then = vec![0.0; n];
        then[(second - first) as usize] += 1.0 - chance;
        for (low, share) in (0..).zip(&nibbles) {
            then[place(second, low) as usize] += chance * share;
        }
        for (own, p) in even.codes() {
            let (whole, torn) = ((own - first) as usize, place(own, second) as usize);
            for (to, r) in then.iter().enumerate().filter(|(_, r)| **r > 0.0) {
                both[whole][to] += p * q * (1.0 - chance) * r;
                both[torn][to] += p * q * chance * r;
            }
        }
    }
    of_neighbours(&even, both)
}

/// Words that are packed by one and a half bytes, of which the byte with the nibbles is read last: where the part has a new
/// reading meanwhile, the low nibble is already that one's.
pub(super) fn nibble(axis: usize) -> Shape {
    let mixed = latched(NIBBLE);
    remade(
        1.0,
        move |stand, chance| known_of_nibble(stand, axis, chance),
        move |counts, draw, chance| {
            let own = &counts[axis];
            let after = [&own[1..], &own[own.len() - 1..]].concat();
            each_pair(own, &after, |own, after| {
                draw.choose(chance, mixed(after, own), own)
            })
        },
    )
}
