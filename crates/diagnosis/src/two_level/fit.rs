//! Block means that lie about two levels: white noise, a random walk of the level, switches at random ([`crate::two_level::filter_bank`]).

use rand_distr::{Distribution, Exp1, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

pub(crate) use crate::two_level::filter_bank::Coordinates;
use crate::two_level::filter_bank::{ABREAST, Levels, filter};
use numerics::minimise::side_by_side;

/// Levels of the two-level process.
const TWO: Levels<2> = Levels {
    at: [1.0, -1.0],
    mixed: false,
};
/// The same where a block in which they switch is known to be mixed: it lies at neither.
const TWO_OF_BLOCKS: Levels<2> = Levels { mixed: true, ..TWO };
/// Levels that stand for any: five of a normal distribution.
const MANY_OF_BLOCKS: Levels<5> = Levels {
    at: [-1.5, -0.7, 0.0, 0.7, 1.5],
    mixed: true,
};

/// Block means, coordinates and the number of the level of the first mean.
type From<'a> = (&'a [f64], Coordinates, usize);

/// Log likelihood of block means under white noise + random walk + two levels, the mean taken out.
#[must_use]
pub fn two_level(y: &[f64], x: &Coordinates) -> f64 {
    from_any(&[(y, *x)], &TWO)[0]
}

/// The same of several, all of one length.
pub(crate) fn two_levels(of: &[(&[f64], Coordinates)]) -> Vec<f64> {
    from_any(of, &TWO)
}

/// The same of several, all of one length, for jumps between any of `levels`, all equally likely, from a given one.
fn likelihoods<const K: usize>(of: &[From<'_>], levels: &Levels<K>) -> Vec<f64> {
    of.chunks(ABREAST)
        .flat_map(|few| {
            // Places that are left hold the last one again.
            let all: [From<'_>; ABREAST] = std::array::from_fn(|l| few[l.min(few.len() - 1)]);
            let first = all.map(|(_, _, first)| first);
            let each = filter(
                all.map(|(y, ..)| y),
                &all.map(|(_, x, _)| x),
                &first,
                levels,
                |_| {},
            );
            each.into_iter().take(few.len())
        })
        .collect()
}

/// The same from every level.
fn from_each<const K: usize>(of: &[(&[f64], Coordinates)], levels: &Levels<K>) -> Vec<[f64; K]> {
    let all: Vec<From<'_>> = of
        .iter()
        .flat_map(|(y, x)| (0..K).map(|first| (*y, *x, first)))
        .collect();
    let logs = likelihoods(&all, levels);
    let (of_each, _) = logs.as_chunks::<K>();
    of_each.to_vec()
}

/// The same from any level, all equally likely.
fn from_any<const K: usize>(of: &[(&[f64], Coordinates)], levels: &Levels<K>) -> Vec<f64> {
    let sum = |logs: [f64; K]| {
        let top = logs.into_iter().fold(f64::NEG_INFINITY, f64::max);
        top + logs.map(|l| (l - top).exp()).iter().sum::<f64>().ln()
    };
    from_each(of, levels).into_iter().map(sum).collect()
}

/// The level that block means most probably begin on.
fn first_level<const K: usize>(y: &[f64], x: &Coordinates, levels: &Levels<K>) -> usize {
    let logs = from_each(&[(y, *x)], levels)[0];
    let best = (0..K).max_by(|a, b| logs[*a].total_cmp(&logs[*b]));
    best.unwrap_or(0)
}

/// Chances of the upper level after each block: from the blocks before it and itself, and from those behind it and itself.
fn chances(y: &[f64], x: &Coordinates) -> [Vec<f64>; 2] {
    let back: Vec<f64> = y.iter().rev().copied().collect();
    let first = [y, &back].map(|y| first_level(y, x, &TWO));
    let (mut before, mut after) = (vec![], vec![]);
    filter(
        [y, &back, y, &back],
        &[*x; ABREAST],
        &[first[0], first[1], first[0], first[1]],
        &TWO,
        |upper| {
            before.push(upper[0]);
            after.push(upper[1]);
        },
    );
    [before, after]
}

/// The most probable mean level of each block, from the blocks before it, itself, and those behind it. A filter learns by the
/// first switch what the levels are, so a block is weighed by the one that comes from the other end.
pub(crate) fn path(y: &[f64], x: &Coordinates) -> Vec<f64> {
    let half = (x[2] + 0.5 * x[0]).exp();
    let [before, mut after] = chances(y, x);
    after.reverse();
    let switch = switch_of(x);
    // From the neighbour in a direction; of none nothing is known.
    let from = |upper: Option<&f64>| {
        upper.map_or(0.5, |upper| upper * (1.0 - switch) + (1.0 - upper) * switch)
    };
    (0..y.len())
        .map(|t| {
            let (known, itself) = if t < y.len() / 2 {
                (from(t.checked_sub(1).and_then(|t| before.get(t))), after[t])
            } else {
                (from(after.get(t + 1)), before[t])
            };
            let upper = known * itself;
            let lower = (1.0 - known) * (1.0 - itself);
            half * (upper - lower) / (upper + lower).max(f64::MIN_POSITIVE)
        })
        .collect()
}

/// Coordinates of blocks of another length, `part` times as long: white noise falls with the length, a walk grows.
pub(crate) fn of_blocks(x: &Coordinates, part: f64) -> Coordinates {
    let ln = part.ln();
    [x[0] - ln, x[1] + 2.0 * ln, x[2] + 0.5 * ln, x[3] - ln]
}

/// Chance that two levels have switched from block to block.
fn switch_of(x: &Coordinates) -> f64 {
    0.5 * (1.0 - (-2.0 * (-x[3]).exp()).exp())
}

/// Whether each block lies on the upper level: from a filter's last block back, the more probable one before the next. A
/// filter learns by the first switch which level it started from, so each half is decoded by the one that comes from the other
/// end.
pub(crate) fn decoded(y: &[f64], x: &Coordinates) -> Vec<bool> {
    let switch = switch_of(x);
    let back = |upper: Vec<f64>| {
        let next = upper.into_iter().rev().scan(None, move |next, u| {
            let upper = match next {
                None => u > 0.5,
                Some(true) => u > switch,
                Some(false) => u > 1.0 - switch,
            };
            *next = Some(upper);
            *next
        });
        next.take(y.len().div_ceil(2)).collect::<Vec<bool>>()
    };
    let [before, after] = chances(y, x);
    let (mut first, second) = (back(after), back(before));
    first.extend(second.into_iter().take(y.len() / 2).rev());
    first
}

/// Block means of two levels as they were fitted.
pub(crate) fn replicate(m: usize, x: &Coordinates, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let [log_white, log_walk, log_half, log_dwell] = *x;
    let sigma = (0.5 * log_white).exp();
    let (walk, half) = (sigma * (0.5 * log_walk).exp(), sigma * log_half.exp());
    let wait = |rng: &mut _| log_dwell.exp() * Distribution::<f64>::sample(&Exp1, rng);
    let (mut level, mut drift, mut left) = (half, 0.0, wait(rng));
    let mut y: Vec<f64> = (0..m)
        .map(|_| {
            // A block in which the level switches reads the mean.
            let (mut rest, mut mean) = (1.0, 0.0);
            while left < rest {
                mean += level * left;
                rest -= left;
                level = -level;
                left = wait(rng);
            }
            mean += level * rest;
            left -= rest;
            let e: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(rng));
            drift += walk * e[0];
            mean + drift + sigma * e[1]
        })
        .collect();
    let middle = y.iter().sum::<f64>() / m as f64;
    y.iter_mut().for_each(|v| *v -= middle);
    y
}

/// The coordinates within their bounds on `m` blocks.
fn inside(x: &[f64], m: usize) -> Coordinates {
    [
        x[0],
        x[1].clamp(-25.0, 2.0),
        x[2].clamp(-6.0, 6.0),
        x[3].clamp(0.7, (m as f64 / 3.0).ln()),
    ]
}

/// Coordinates within their bounds on `m` blocks, and how far outside they were.
fn clamped(x: &[f64], m: usize) -> (Coordinates, f64) {
    let clamped = inside(x, m);
    let outside = x.iter().zip(&clamped).map(|(a, b)| (a - b).powi(2)).sum();
    (clamped, outside)
}

/// Highest log likelihoods over `levels`, of which the one of the number `first` comes first, and their places, from several
/// starts.
fn highest<const K: usize>(
    y: &[f64],
    starts: &[Coordinates],
    (first, levels): (usize, &Levels<K>),
    steps: usize,
) -> Vec<(f64, Coordinates)> {
    let objective = |all: &[Vec<f64>]| {
        let (at, outside): (Vec<From<'_>>, Vec<f64>) = (all.iter())
            .map(|x| clamped(x, y.len()))
            .map(|(x, outside)| ((y, x, first), outside))
            .unzip();
        let l = likelihoods(&at, levels);
        outside.iter().zip(l).map(|(o, l)| o - l).collect()
    };
    let best = side_by_side(&objective, starts, &[0.1, 2.0, 0.3, 0.7], steps);
    let inside = |(least, x): (f64, Vec<f64>)| (-least, inside(&x, y.len()));
    best.into_iter().map(inside).collect()
}

/// The same from one start.
fn highest_from<const K: usize>(
    y: &[f64],
    start: &Coordinates,
    levels: &Levels<K>,
    steps: usize,
) -> (f64, Coordinates) {
    let first = first_level(y, start, levels);
    let (_, x) = highest(y, &[*start], (first, levels), steps)[0];
    (from_any(&[(y, x)], levels)[0], x)
}

/// Highest log likelihood of two levels, and its place; `starts` are shares of the `excess` over the white variance that
/// the levels make, and dwell times in blocks.
pub(crate) fn fitted(
    y: &[f64],
    white: f64,
    excess: f64,
    starts: &[(f64, f64)],
    steps: usize,
) -> (f64, Coordinates) {
    let from = |(share, dwell): &(f64, f64)| {
        let log_half = 0.5 * (share * excess / white).ln();
        [white.ln(), -12.0, log_half, dwell.ln()]
    };
    let starts: Vec<Coordinates> = starts.iter().map(from).collect();
    let all = [0, 1].map(|first| highest(y, &starts, (first, &TWO), steps));
    let best = all.into_iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0));
    // A simplex that has shrunk too early goes on from where it is.
    best.map(|(_, x)| highest_from(y, &x, &TWO, steps))
        .unwrap_or((f64::NEG_INFINITY, [0.0; 4]))
}

/// The two levels fitted again, from where they were.
pub(crate) fn again(y: &[f64], x: &Coordinates) -> (f64, Coordinates) {
    highest_from(y, x, &TWO, 160)
}

/// Coefficient of a column beside the two levels, and the nats that it gains.
pub(crate) fn with_column(y: &[f64], x: &Coordinates, column: &[f64]) -> (f64, f64) {
    let without = highest_from(y, x, &TWO, 60);
    let less = |coefficient: f64| -> Vec<f64> {
        let parts = y.iter().zip(column);
        parts.map(|(v, c)| v - coefficient * c).collect()
    };
    // What the coefficient is in doubt by at least: the levels' own height.
    let half = (x[2] + 0.5 * x[0]).exp();
    let objective = |all: &[Vec<f64>]| {
        let rests: Vec<Vec<f64>> = all.iter().map(|p| less(p[4] * half)).collect();
        let (x, outside): (Vec<Coordinates>, Vec<f64>) =
            all.iter().map(|p| clamped(p, y.len())).unzip();
        let at: Vec<_> = rests.iter().map(Vec::as_slice).zip(x).collect();
        let l = from_any(&at, &TWO);
        outside.iter().zip(l).map(|(o, l)| o - l).collect()
    };
    let [a, b, c, d] = without.1;
    let starts = [-3.0, 3.0].map(|start| [a, b, c, d, start]);
    let mut best = (0.0, without.0);
    for (least, at) in side_by_side(&objective, &starts, &[0.1, 2.0, 0.3, 0.7, 1.0], 240) {
        if -least > best.1 {
            best = (at[4] * half, -least);
        }
    }
    (best.0, best.1 - without.0)
}

/// Nats that many levels are ahead of two on means of blocks, from where the two are at their best. Either side knows what it
/// makes of a block in which a level changes: to two levels that did not, it would be a level of its own.
pub(crate) fn many_ahead(y: &[f64], two: &Coordinates) -> f64 {
    highest_from(y, two, &MANY_OF_BLOCKS, 60).0 - highest_from(y, two, &TWO_OF_BLOCKS, 60).0
}

/// Coordinates of two levels on means of blocks, with their covariance. A block of a `single` reading may have been read at one
/// time or over its whole length, whichever it shows.
pub(crate) fn coordinates(
    y: &[f64],
    x: &Coordinates,
    single: bool,
) -> (Coordinates, Vec<Vec<f64>>) {
    let mixed = highest_from(y, x, &TWO_OF_BLOCKS, 160);
    if single {
        let at_once = highest_from(y, x, &TWO, 160);
        if at_once.0 > mixed.0 {
            return (at_once.1, covariance_of(y, &at_once.1, &TWO));
        }
    }
    (mixed.1, covariance_of(y, &mixed.1, &TWO_OF_BLOCKS))
}

/// Covariance of the coordinates at a highest point of the two levels' likelihood: the inverse of its curvature, all
/// coordinates free. One that the data do not bend, such as a random walk of nearly nothing, is held.
fn covariance_of(y: &[f64], x: &Coordinates, levels: &Levels<2>) -> Vec<Vec<f64>> {
    const H: f64 = 0.06;
    let at = |moves: &[&[(usize, f64)]]| {
        let moved = moves.iter().map(|moves| {
            let mut at = *x;
            for (i, by) in *moves {
                at[*i] += by * H;
            }
            (y, at)
        });
        from_any(&moved.collect::<Vec<_>>(), levels)
    };
    let second = |i: usize, j: usize| {
        if i == j {
            let l = at(&[&[(i, 1.0)], &[], &[(i, -1.0)]]);
            return (l[0] - 2.0 * l[1] + l[2]) / (H * H);
        }
        let corners =
            [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(a, b)| [(i, a), (j, b)]);
        let l = at(&corners.each_ref().map(|c| &c[..]));
        (l[0] - l[1] - l[2] + l[3]) / (4.0 * H * H)
    };
    let count = x.len();
    let bend: Vec<Vec<f64>> = (0..count)
        .map(|i| (0..=i).map(|j| second(j, i)).collect())
        .collect();
    let bends = |i: usize| bend[i][i] < -0.05;
    let information: Vec<Vec<f64>> = (0..count)
        .map(|i| {
            (0..count)
                .map(|j| match (i == j, bends(i) && bends(j)) {
                    (_, true) => -bend[i.max(j)][i.min(j)],
                    (true, false) => 1e12,
                    (false, false) => 0.0,
                })
                .collect()
        })
        .collect();
    crate::fit::likelihood::invert(&information).0
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;

    use super::*;

    #[test]
    fn dwell_times_of_levels_that_are_plain_to_see_are_found() {
        let (m, seeds) = (3000, 12);
        for (half, dwell) in [(0.9f64, 90.0f64), (1.9, 95.0), (3.0, 30.0)] {
            let truth = [0.0, -14.0, half.ln(), dwell.ln()];
            let mut mean = 0.0;
            for seed in 0..seeds {
                let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
                let y = replicate(m, &truth, &mut rng);
                let (l, x) = fitted(
                    &y,
                    1.0,
                    half * half,
                    &[(1.0, 15.0), (0.8, 60.0), (0.6, 200.0)],
                    160,
                );
                let at_truth = two_level(&y, &truth);
                assert!(
                    l > at_truth - 0.5 && l < at_truth + 20.0,
                    "{half} {dwell}: {l} {at_truth}"
                );
                mean += (x[3] - dwell.ln()) / seeds as f64;
            }
            // Some 30 switches a record: 0.05 in the mean.
            eprintln!("{half} {dwell}: {mean}");
            assert!(mean.abs() < 0.2, "{half} {dwell}: {mean}");
        }
    }
}
