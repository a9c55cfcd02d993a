//! The twelfth set's laws that act on what is read.

use std::f64::consts::TAU;

use super::super::kept_back_fifth::noise::of_edges;
use super::super::kept_back_fourth::codes::{law, of_steps, other_than};
use super::super::kept_back_sixth::codes::{mapped, mean_and_sigma, of_map, refitted};
use super::super::kept_back_tenth::codes::zero_of;
use super::super::{Change, Foreign};
use crate::random::Draw;
use crate::stand::Stand;
use crate::strength::size_for;

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &mut Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    Some(match name {
        "gain of one that cuts toward zero" => {
            let cut = cut(draw, stand, axis);
            let strength = |chance: f64| of_map(stand, axis, chance.min(1.0), &cut);
            let chance = size_for(wanted, &strength).min(1.0);
            mapped(name, axis, chance, strength(chance), cut)
        }
        "axis that reads its neighbour for a while" => neighbour(draw, stand, name, axis, wanted),
        "converter whose line is wavy" => wavy(draw, stand, name, axis, wanted),
        "despiker that takes the median" => despiked(stand, name, axis, wanted),
        _ => return None,
    })
}

/// Multiplications that a reading goes through.
const MULTIPLICATIONS: i32 = 2;

/// A gain of one that a word of fractions cannot hold (Q15 ends at 0x7fff): the product is a little less than the reading
/// and, cut toward zero as integers are divided in C, one short of it, whatever the reading but zero. So are a gain and its
/// correction by two, and the code of zero takes five. Some frames go through it, others as they are.
pub(in super::super) fn cut(
    draw: &mut Draw,
    stand: &Stand,
    axis: usize,
) -> impl Fn(i32) -> i32 + use<> {
    let zero = zero_of(draw, stand, axis).round() as i32;
    move |code| {
        let q15 = |v: i64, _: i32| v * 0x7fff / 0x8000;
        zero + (0..MULTIPLICATIONS).fold(i64::from(code - zero), q15) as i32
    }
}

/// Nats of a reading that is another axis's, for who holds it for one of its own and, knowing, has it to the count.
fn nats_of_copy(stand: &Stand, axis: usize, other: usize) -> f64 {
    let (first, own) = law(stand, axis);
    let (its_first, its) = law(stand, other);
    let of = |(i, q): (usize, &f64)| {
        let code = usize::try_from(its_first + i as i32 - first).ok();
        let p = code.and_then(|c| own.get(c)).copied().unwrap_or(0.0);
        -q * p.max(1e-12).ln()
    };
    its.iter().enumerate().map(of).sum()
}

/// The address of the register that is read for this axis flips to another axis's, until it is written anew: meanwhile both
/// are told as one. The firmware has taken the biases off, so that it does not stand out. Were the two exchanged, a stand at
/// rest would show two steps and a change of the noise, which the library has.
fn neighbour(
    draw: &mut Draw,
    stand: &mut Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let other = other_than(draw, axis);
    stand.bias[other] = stand.bias[axis] + 0.2 * stand.white(axis).sqrt() * draw.between(-1.0, 1.0);
    let nats = nats_of_copy(stand, axis, other);
    let long = (wanted * wanted / (2.0 * nats)).round() as usize;
    let from = draw.of_many(stand.samples().saturating_sub(long));
    let change = move |counts: &[Vec<i32>; 3], _: &mut Draw| {
        let mut own = counts[axis].clone();
        let to = (from + long).min(own.len());
        own[from..to].copy_from_slice(&counts[other][from..to]);
        own
    };
    Foreign {
        name,
        strength: (2.0 * long as f64 * nats).sqrt(),
        change: Change::Made(Box::new(change)),
    }
}

/// Most that the line of a wavy converter leans: at 1 it would turn back, and codes be missing.
const STEEPEST: f64 = 0.9;

/// A folding converter: its line waves about the straight one, once for each fold.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Wave {
    /// Codes of a fold.
    period: f64,
    /// Where it begins, rad.
    first: f64,
}

impl Wave {
    /// Folds of this many sigma of the noise at least, and at most: wider ones are a change of the gain.
    const FOLDS: (f64, f64) = (1.2, 3.0);

    pub(in super::super) fn new(draw: &mut Draw, stand: &Stand, axis: usize) -> Self {
        let (_, sigma) = mean_and_sigma(stand, axis);
        Self {
            period: sigma * draw.by_ratio(Self::FOLDS.0, Self::FOLDS.1),
            first: draw.between(0.0, TAU),
        }
    }

    /// What is read, before it is rounded, of a rate, counts.
    fn of(self, lean: f64, rate: f64) -> f64 {
        let turn = TAU / self.period;
        rate + lean.min(STEEPEST) / turn * (turn * rate + self.first).sin()
    }

    /// Lower edges of the codes from the first on, counts.
    pub(in super::super) fn edges(self, stand: &Stand, axis: usize, lean: f64) -> (i32, Vec<f64>) {
        let (first, even) = law(stand, axis);
        let edge = |i: usize| {
            let read = f64::from(first) + i as f64 - 0.5;
            // No farther off than the wave is high; the line rises.
            let (mut low, mut high) = (read - self.period, read + self.period);
            while high - low > 1e-6 {
                let middle = 0.5 * (low + high);
                if self.of(lean, middle) < read {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            low
        };
        (first, (0..=even.len()).map(edge).collect())
    }
}

fn wavy(draw: &mut Draw, stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let wave = Wave::new(draw, stand, axis);
    let strength = |lean: f64| {
        let (first, edges) = wave.edges(stand, axis, lean);
        of_edges(stand, axis, first, &edges)
    };
    let lean = size_for(wanted, &strength);
    let (first, edges) = wave.edges(stand, axis, lean);
    Foreign {
        name,
        strength: strength(lean),
        change: Change::Edges(first, edges),
    }
}

/// The median of three.
fn median(a: i32, b: i32, c: i32) -> i32 {
    a.max(b).min(a.min(b).max(c))
}

/// A reading between two others: their median where it is further than a gate from that.
fn without_spike(before: i32, own: i32, after: i32, gate: i32) -> i32 {
    let middle = median(before, own, after);
    if (own - middle).abs() > gate {
        middle
    } else {
        own
    }
}

/// Chances of what is given for a reading, known with one neighbour, by the law of the other one; the gate the whole number
/// below, or the one above as often as what is left says.
fn given(even: &[f64], own: usize, neighbour: usize, gate: f64) -> Vec<(usize, f64)> {
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
pub(in super::super) fn steps_of_gate(
    stand: &Stand,
    axis: usize,
    gate: f64,
) -> (i32, Vec<Vec<f64>>, Vec<f64>) {
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
    let shares: Vec<f64> = both.iter().map(|row| row.iter().sum()).collect();
    for (row, share) in both.iter_mut().zip(&shares) {
        row.iter_mut().for_each(|p| *p /= share.max(1e-300));
    }
    (first, both, shares)
}

/// d' of neighbours behind such a gate, mean and variance refitted.
pub(in super::super) fn of_gate(stand: &Stand, axis: usize, gate: f64) -> f64 {
    let (first, steps, shares) = steps_of_gate(stand, axis, gate);
    let other = refitted(first, &shares);
    of_steps(&steps, &shares, &|_, to| other[to], stand.samples())
}

/// The gate, counts, by which a despiker is this strong: the narrower, the stronger.
pub(in super::super) fn gate_for(stand: &Stand, axis: usize, wanted: f64) -> f64 {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let (mut narrow, mut wide) = (0.0, 6.0 * sigma);
    while wide - narrow > 2e-3 * sigma {
        let middle = 0.5 * (narrow + wide);
        if of_gate(stand, axis, middle) > wanted {
            narrow = middle;
        } else {
            wide = middle;
        }
    }
    narrow
}

/// Firmware against spikes: a reading that is further than a gate from the median of itself and its two neighbours is
/// replaced by that. The gate was set for a part with less noise, and takes readings that were no spikes.
fn despiked(stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let gate = gate_for(stand, axis, wanted);
    let change = move |counts: &[Vec<i32>; 3], draw: &mut Draw| {
        let own = &counts[axis];
        let last = own.len() - 1;
        let one = |i: usize| {
            let (before, after) = (own[i.saturating_sub(1)], own[(i + 1).min(last)]);
            let above = i32::from(draw.chance(gate.fract()));
            without_spike(before, own[i], after, gate as i32 + above)
        };
        (0..own.len()).map(one).collect()
    };
    Foreign {
        name,
        strength: of_gate(stand, axis, gate),
        change: Change::Made(Box::new(change)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::stand;
    use super::*;
    use crate::stand::LSB;

    #[test]
    fn a_product_that_is_cut_is_short_toward_zero_and_zero_takes_five() {
        let (mut draw, stand) = stand(40);
        let cut = cut(&mut draw, &stand, 1);
        let zero = (-40..40).find(|c| cut(*c) == *c && cut(c + 1) == *c && cut(c - 1) == *c);
        let zero = zero.expect("a zero near the bias");
        assert!((f64::from(zero) * LSB - stand.bias[1]).abs() < stand.white(1).sqrt());
        for code in zero - 30..=zero + 30 {
            let off = code - zero;
            let short = off.signum() * (off.abs() - MULTIPLICATIONS).max(0);
            assert_eq!(cut(code), zero + short);
        }
    }

    #[test]
    fn a_neighbour_is_read_for_one_stretch_count_for_count() {
        let (mut draw, mut stand) = stand(41);
        let f = neighbour(&mut draw, &mut stand, "", 0, 30.0);
        assert!((f.strength - 30.0).abs() < 0.3, "{}", f.strength);
        let Change::Made(change) = f.change else {
            panic!("it makes no counts")
        };
        let counts = [0, 1, 2].map(|axis| vec![axis; stand.samples()]);
        let read = change(&counts, &mut draw);
        let runs: Vec<&[i32]> = read.chunk_by(|a, b| a == b).collect();
        let others: Vec<usize> = runs.iter().filter(|r| r[0] != 0).map(|r| r.len()).collect();
        assert_eq!(others.len(), 1);
        // An entropy of two to four nats a reading.
        let long = others[0] as f64;
        assert!((450.0 / 4.0..450.0 / 2.0).contains(&long), "{long}");
    }

    #[test]
    fn a_wavy_line_rises_and_is_straight_on_the_whole() {
        let (mut draw, stand) = stand(42);
        let wave = Wave::new(&mut draw, &stand, 0);
        let (first, straight) = wave.edges(&stand, 0, 0.0);
        for (i, e) in straight.iter().enumerate() {
            assert!((e - (f64::from(first) + i as f64 - 0.5)).abs() < 1e-5);
        }
        let (_, edges) = wave.edges(&stand, 0, 0.8);
        assert!(edges.windows(2).all(|w| w[1] > w[0]));
        let most = edges.iter().zip(&straight).map(|(e, s)| (e - s).abs());
        let most = most.fold(0.0, f64::max);
        // As high as the wave is, or a little less between two edges.
        let high = 0.8 * wave.period / TAU;
        assert!(most <= 1.001 * high && most > 0.6 * high, "{most} {high}");
        assert!(of_edges(&stand, 0, first, &straight) < 0.5);
    }

    #[test]
    fn a_despiker_takes_what_is_far_from_the_median_and_nothing_else() {
        assert_eq!(
            [median(1, 5, 3), median(5, 3, 1), median(2, 2, 9)],
            [3, 3, 2]
        );
        assert_eq!(without_spike(0, 9, 1, 5), 1);
        assert_eq!(without_spike(0, 9, 4, 5), 9);
        // A ramp, however steep, has no spike.
        assert_eq!(without_spike(0, 9, 18, 1), 9);
        let (_, stand) = stand(43);
        assert!(of_gate(&stand, 0, 60.0) < 1.0);
    }

    #[test]
    fn steps_behind_a_gate_are_those_that_come() {
        let (mut draw, stand) = stand(44);
        let (_, sigma) = mean_and_sigma(&stand, 0);
        let gate = 0.8 * sigma;
        let (first, steps, shares) = steps_of_gate(&stand, 0, gate);
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-6);
        let mean = stand.bias[0] / LSB;
        let own: Vec<i32> = (0..200_000)
            .map(|_| (mean + sigma * draw.normal()).round() as i32)
            .collect();
        let read: Vec<usize> = own
            .windows(3)
            .map(|w| {
                let above = i32::from(draw.chance(gate.fract()));
                (without_spike(w[0], w[1], w[2], gate as i32 + above) - first) as usize
            })
            .collect();
        let again = read.windows(2).filter(|w| w[0] == w[1]).count() as f64 / read.len() as f64;
        let told: f64 = (0..shares.len()).map(|i| shares[i] * steps[i][i]).sum();
        // Five standard deviations of 200 000 that depend on few others: 0.004.
        assert!((again - told).abs() < 0.004, "{again} {told}");
        let unlike: f64 = shares.iter().map(|p| p * p).sum();
        assert!(told > 1.2 * unlike, "{told} {unlike}");
    }
}
