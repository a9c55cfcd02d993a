//! Readings that depend on those before or after them.

use super::super::super::prelude::*;

/// Largest play, counts.
pub(super) const MOST_PLAY: f64 = 6.0;

/// Bits of the word that its low byte holds: words of 12 or 11 bits that begin with the high byte.
pub(super) const LOW_BITS: (usize, usize) = (3, 4);

/// Most and least that the output may change by from one reading to the next, counts.
pub(super) const LIMITS: (f64, f64) = (200.0, 1.0);

/// Bits of the part of a word that is packed apart.
pub(super) const NIBBLE: i32 = 4;

/// Chances from each code (row) to the next reading's, when it follows the rate to within so many counts.
pub(super) fn steps_with_play(stand: &Stand, axis: usize, play: f64) -> Vec<Vec<f64>> {
    let (mean, sigma) = (stand.bias[axis] / LSB, stand.white(axis).sqrt() / LSB);
    let (first, even) = law(stand, axis);
    // Codes of what is left when the play is taken off, below and above.
    let edges = |off: f64| each(&even_edges(first, even.len()), |edge| edge + off);
    let up = shares(&edges(play), mean, sigma);
    let down = shares(&edges(-play), mean, sigma);
    (0..even.len())
        .map(|from| {
            let to = |to: usize| match to.cmp(&from) {
                std::cmp::Ordering::Less => down[to],
                std::cmp::Ordering::Equal => 0.0,
                std::cmp::Ordering::Greater => up[to],
            };
            let mut row: Vec<f64> = (0..even.len()).map(to).collect();
            row[from] = 1.0 - row.iter().sum::<f64>();
            row
        })
        .collect()
}

/// What a code becomes when the rate is `at`, counts, and the code may stay `play` behind it.
pub(super) fn followed(code: i32, at: f64, play: f64) -> i32 {
    let (low, high) = ((at - play).round() as i32, (at + play).round() as i32);
    code.clamp(low, high)
}

/// A word that is read in two bytes, of which the low one is new and the high one still that of the reading before.
pub(super) fn torn(draw: &mut Draw) -> impl Fn(i32, i32) -> i32 + use<> {
    let mixed = latched(LOW_BITS.0 + draw.of_many(LOW_BITS.1 + 1 - LOW_BITS.0));
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
        if change.abs() < gate {
            before + (share * change).round() as i32
        } else {
            code
        }
    })
}

/// Chances from each code (row) to the next reading's, when one stands until the input is `holds` counts away from it.
pub(super) fn steps_beyond(stand: &Stand, axis: usize, holds: f64) -> Vec<Vec<f64>> {
    let (bias, sigma) = (stand.bias[axis] / LSB, stand.white(axis).sqrt() / LSB);
    let (first, even) = law(stand, axis);
    let within = |low: f64, high: f64| {
        if high > low {
            shares(&[low, high], bias, sigma)[0]
        } else {
            0.0
        }
    };
    (0..even.len())
        .map(|from| {
            let stands = f64::from(first) + from as f64;
            let mut row: Vec<f64> = (0..even.len())
                .map(|to| {
                    // What of the code's width lies outside of what is held.
                    let (low, high) = (to as f64 - 0.5, to as f64 + 0.5);
                    let (low, high) = (f64::from(first) + low, f64::from(first) + high);
                    within(low, high.min(stands - holds)) + within(low.max(stands + holds), high)
                })
                .collect();
            row[from] += within(stands - holds, stands + holds);
            row
        })
        .collect()
}

/// A latch for the lowest bits of the word that misses its strobe: they stay as they were, and the others are new.
pub(super) fn latched(bits: usize) -> impl Fn(i32, i32) -> i32 {
    let low = (1 << bits) - 1;
    move |before, code| (code & !low) | (before & low)
}

/// A link that sends a difference where there is no room for a word: 0, or one of the powers of 2, whichever is nearest.
pub(super) fn in_levels(before: i32, code: i32) -> i32 {
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
pub(super) fn repeated(fault: i32) -> impl Fn(i32, i32) -> i32 {
    move |before, code| if code == fault { before } else { code }
}

/// A code that comes often enough.
pub(super) fn fault_of(draw: &mut Draw, stand: &Stand, axis: usize) -> i32 {
    let sigma = stand.white(axis).sqrt();
    ((stand.bias[axis] + sigma * draw.between(-0.7, 0.7)) / LSB).round() as i32
}

/// Chances from each code (row) to the next reading's, when it may be at most so many counts away.
pub(super) fn steps_within(even: &[f64], most: usize) -> Vec<Vec<f64>> {
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

/// The next reading of an output that may change by so much.
pub(super) fn slewed(limit: i32) -> impl Fn(i32, i32) -> i32 {
    move |before, code| before + (code - before).clamp(-limit, limit)
}

/// Chances from each code to the next, where the limit is the whole number below, or the one above as often as what is left
/// says.
pub(super) fn steps_of_limit(stand: &Stand, axis: usize, limit: f64) -> Vec<Vec<f64>> {
    let low = steps_of(stand, axis, 1.0, &slewed(limit as i32));
    let high = steps_of(stand, axis, 1.0, &slewed(limit as i32 + 1));
    let part = limit.fract();
    let rows = low.iter().zip(&high);
    rows.map(|(l, h)| each_pair(l, h, |l, h| (1.0 - part) * l + part * h))
        .collect()
}

/// The limit of a slew that is so steep, 1/counts.
pub(super) fn limit_of(steep: f64) -> f64 {
    (1.0 / steep).clamp(LIMITS.1, LIMITS.0)
}

/// The upper bits of one code and the lowest of another.
pub(super) fn mixed(upper: i32, lower: i32) -> i32 {
    let low = (1 << NIBBLE) - 1;
    (upper & !low) | (lower & low)
}

/// What is known of a channel by the chances of each two readings beside each other, codes from the first on.
fn of_neighbours(first: i32, mut both: Vec<Vec<f64>>) -> Known {
    let shares: Vec<f64> = both.iter().map(|row| row.iter().sum()).collect();
    for (row, share) in both.iter_mut().zip(&shares) {
        row.iter_mut().for_each(|p| *p /= share.max(1e-300));
    }
    Known::steps_of(first, both, shares)
}

/// Chances from each reading (row) to the next where some have the low nibble of the reading after: the first code, the
/// steps, and the share of each code. What two neighbours have in common is the code of the second.
pub(super) fn steps_of_nibble(stand: &Stand, axis: usize, chance: f64) -> Known {
    let (first, even) = law(stand, axis);
    let n = even.len();
    let last = n as i32 - 1;
    // A code beyond those that are followed, which next to none is, counts to the last of them.
    let place =
        |upper: usize, lower: i32| (mixed(first + upper as i32, lower) - first).clamp(0, last);
    let mut nibbles = [0.0; 1 << NIBBLE];
    for (i, p) in even.iter().enumerate() {
        nibbles[(first + i as i32).rem_euclid(1 << NIBBLE) as usize] += p;
    }
    let mut both = vec![vec![0.0; n]; n];
    for (second, q) in even.iter().enumerate() {
        let mut then = vec![0.0; n];
        then[second] += 1.0 - chance;
        for (low, share) in nibbles.iter().enumerate() {
            then[place(second, low as i32) as usize] += chance * share;
        }
        for (own, p) in even.iter().enumerate() {
            let torn = place(own, first + second as i32) as usize;
            for (to, r) in then.iter().enumerate().filter(|(_, r)| **r > 0.0) {
                both[own][to] += p * q * (1.0 - chance) * r;
                both[torn][to] += p * q * chance * r;
            }
        }
    }
    of_neighbours(first, both)
}

/// An output that is driven upward and let go downward: where a long cable hangs on it, as it does in some frames, it falls
/// by so much at most, of the noise's sigma, from one reading to the next.
pub(super) fn falling(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let most = (sigma * draw.between(0.2, 0.9)).round().max(1.0) as i32;
    by_chance(axis, move |before, code| code.max(before - most))
}

/// The median of three.
pub(super) fn median(a: i32, b: i32, c: i32) -> i32 {
    a.max(b).min(a.min(b).max(c))
}

/// A reading between two others: their median where it is further than a gate from that.
pub(super) fn without_spike(before: i32, own: i32, after: i32, gate: i32) -> i32 {
    let middle = median(before, own, after);
    if (own - middle).abs() > gate {
        middle
    } else {
        own
    }
}

/// Chances of what is given for a reading, known with one neighbour, by the law of the other one; the gate the whole number
/// below, or the one above as often as what is left says.
pub(super) fn given(even: &[f64], own: usize, neighbour: usize, gate: f64) -> Vec<(usize, f64)> {
    let mut chances = vec![0.0; even.len()];
    for (whole, part) in [
        (gate as i32, 1.0 - gate.fract()),
        (gate as i32 + 1, gate.fract()),
    ] {
        for (other, p) in even.iter().enumerate() {
            let to = without_spike(other as i32, own as i32, neighbour as i32, whole);
            chances[to as usize] += part * p;
        }
    }
    let some = chances.into_iter().enumerate();
    some.filter(|(_, p)| *p > 0.0).collect()
}

/// Chances from each reading (row) to the next behind such a gate, counts, and the first code with the share of each.
pub(super) fn steps_of_gate(stand: &Stand, axis: usize, gate: f64) -> Known {
    let (first, even) = law(stand, axis);
    let n = even.len();
    // Of two readings beside each other, each depends on the one further out, and those two not on each other.
    let mut both = vec![vec![0.0; n]; n];
    let by: Vec<Vec<Vec<(usize, f64)>>> = (0..n)
        .map(|own| (0..n).map(|next| given(&even, own, next, gate)).collect())
        .collect();
    for (one, p) in even.iter().enumerate() {
        for (two, q) in even.iter().enumerate() {
            for (to, r) in &by[one][two] {
                for (then, s) in &by[two][one] {
                    both[*to][*then] += p * q * r * s;
                }
            }
        }
    }
    of_neighbours(first, both)
}

/// The gate, counts, by which a despiker is this strong: the narrower, the stronger.
pub(super) fn gate_for(stand: &Stand, axis: usize, wanted: f64) -> f64 {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let (mut narrow, mut wide) = (0.0, 6.0 * sigma);
    while wide - narrow > 2e-3 * sigma {
        let middle = 0.5 * (narrow + wide);
        if steps_of_gate(stand, axis, middle).strength(stand, axis) > wanted {
            narrow = middle;
        } else {
            wide = middle;
        }
    }
    narrow
}

/// A node that saves its line sends a reading on only when it is a threshold away from the last it sent ("send on delta"),
/// and a comparator with hysteresis does the same: the code that stands is wider than the others, and its neighbours
/// come less often after it.
pub(super) fn threshold(axis: usize) -> Shape {
    remade(
        4.0,
        move |stand, beyond| {
            let (first, even) = law(stand, axis);
            let steps = steps_beyond(stand, axis, 0.5 + beyond.min(4.0));
            Known::Steps {
                first,
                shares: long_run(&steps, &even),
                steps,
                held: even,
            }
        },
        move |counts, draw, beyond| {
            // The first reading is taken whatever it is.
            let mut last = f64::INFINITY;
            each(&counts[axis], |own| {
                let now = within_step(own, draw);
                if (now - last).abs() >= 0.5 + beyond {
                    last = now.round();
                }
                last as i32
            })
        },
    )
}

/// A plausibility check, as industry has it for slow sensors: a reading may differ from the last one given by so much at
/// most, and is otherwise moved there. The limit is the largest, in whole counts, of the wanted strength.
pub(super) fn limited(stand: &Stand, axis: usize, wanted: f64) -> Shape {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let (first, even) = law(stand, axis);
    let known = |most: usize| Known::steps(first, steps_within(&even, most), &even);
    let most = (1..=(7.0 * sigma).ceil() as usize)
        .rev()
        .find(|most| known(*most).strength(stand, axis) >= wanted)
        .unwrap_or(1);
    let at_most = most as i32;
    let change = Change::made(move |counts, _| {
        let mut last = counts[axis][0];
        each(&counts[axis], |c| {
            last = (c).clamp(last - at_most, last + at_most);
            last
        })
    });
    Shape::Fixed(known(most), change)
}

/// A tracking converter whose comparator has hysteresis: its code moves only when the rate is further off than that, and
/// then no closer.
pub(super) fn play(axis: usize) -> Shape {
    remade(
        MOST_PLAY,
        move |stand, play| {
            let (first, even) = law(stand, axis);
            Known::steps(
                first,
                steps_with_play(stand, axis, play.min(MOST_PLAY)),
                &even,
            )
        },
        move |counts, draw, play| {
            let own = &counts[axis];
            let mut code = own[0];
            each(own, |c| {
                code = followed(code, within_step(c, draw), play);
                code
            })
        },
    )
}

/// An output stage that gets no further than so much between two readings, and is that much nearer then.
pub(super) fn slew(axis: usize) -> Shape {
    remade(
        f64::INFINITY,
        move |stand, steep| {
            let (first, even) = law(stand, axis);
            Known::steps(first, steps_of_limit(stand, axis, limit_of(steep)), &even)
        },
        move |counts, draw, steep| {
            let limit = limit_of(steep);
            let mut reading = counts[axis][0];
            each(&counts[axis], |code| {
                let above = i32::from(draw.chance(limit.fract()));
                reading = slewed(limit as i32 + above)(reading, code);
                reading
            })
        },
    )
}

/// Firmware against spikes: a reading that is further than a gate from the median of itself and its two neighbours is
/// replaced by that. The gate was set for a part with less noise, and takes readings that were no spikes.
pub(super) fn despiked(stand: &Stand, axis: usize, wanted: f64) -> Shape {
    let gate = gate_for(stand, axis, wanted);
    let change = Change::made(move |counts, draw| {
        let own = &counts[axis];
        let last = own.len() - 1;
        let one = |i: usize| {
            let (before, after) = (own[i.saturating_sub(1)], own[(i + 1).min(last)]);
            let above = i32::from(draw.chance(gate.fract()));
            without_spike(before, own[i], after, gate as i32 + above)
        };
        (0..own.len()).map(one).collect()
    });
    Shape::Fixed(steps_of_gate(stand, axis, gate), change)
}

/// Words that are packed by one and a half bytes, of which the byte with the nibbles is read last: where the part has a new
/// reading meanwhile, the low nibble is already that one's.
pub(super) fn nibble(axis: usize) -> Shape {
    remade(
        1.0,
        move |stand, chance| steps_of_nibble(stand, axis, chance.min(1.0)),
        move |counts, draw, chance| {
            let own = &counts[axis];
            let one = |i: usize| {
                if draw.chance(chance) {
                    mixed(own[i], own[(i + 1).min(own.len() - 1)])
                } else {
                    own[i]
                }
            };
            (0..own.len()).map(one).collect()
        },
    )
}
