//! A base that is at rest but for seconds: somebody leans on the bench, lifts the stand, turns it and turns it back.
//!
//! Such a turn holds little of the rms of a long record. What tells it from what a gyro does by itself: it goes out and
//! comes back to where it was within [`LONGEST_S`], smoothly, and by more than [`LEAST_PEAK`]; it is the only thing that
//! happens there; and it stands out of the record, in which little else does. Its shape is taken as the first [`SHAPES`]
//! terms of a sine series between its two ends, rest on either side: once or there and back, lopsided or not.
//!
//! A jump that jumps back - of two levels, of a supply, of a bit that sticks - is as large and as short, and is told by its
//! edges: steps of as many parameters describe it better than the series does.

use std::f64::consts::PI;
use std::ops::Range;

use crate::fit::threshold;
use crate::test_level::omnibus_level;
use numerics::column::dot;
use numerics::series::white_by_differences;
use numerics::wide;

/// Shortest and longest turn, s: a blow rings for less; what takes longer is drift to a gyro that warms up.
const SHORTEST_S: f64 = 0.8;
pub(super) const LONGEST_S: f64 = 30.0;
/// Least peak, deg/s, of what no bias of this class of part does: four times the rms that one may wander by. Its sensitivity
/// to acceleration, 0.2 deg/s/g, would need six g.
pub(super) const LEAST_PEAK: f64 = 4.0 * MOTION_RMS;
/// Terms of the series, and the median of chi-square of as many degrees.
const SHAPES: usize = 3;
const MEDIAN: f64 = 2.366;
/// Part of a peak by which the series is off where it is no sine: half a sine between ends a third too far apart.
const OFF: f64 = 0.03;
/// Levels of the steps that it is held against: with their edges one parameter more than the series and its two ends has.
const LEVELS: usize = 4;
const MOST_LEVELS: usize = 8;
/// Likelihood ratio by which the series has to be the better description: one jump in a thousand would be.
const ODDS: f64 = 1e3;
/// Part of what happens there beyond white noise that is the turn.
const SHARE: f64 = 0.75;
/// Part of its peak by which the level after it may differ from that before.
const RETURNS: f64 = 0.25;
/// Part of the record up to which a base is turned now and then; beyond it moves.
pub(super) const SELDOM: f64 = 0.1;
/// Stretches that stand out for other reasons beside a turn, at most: a step or a hole, not one of many.
const BESIDE: usize = 3;
/// Blocks of a turn, and of the rest on either side of it, when it is looked for.
const BLOCKS: usize = 16;
const REST: usize = BLOCKS / 2;
const WINDOW: usize = BLOCKS + 2 * REST;
/// Points on which the ends are sought, at most.
const POINTS: usize = 8 * WINDOW;
/// Step at which the search for the ends ends, points.
const FINEST: f64 = 0.25;
/// Places that are looked at closely, at most.
const MOST: usize = 64;

/// One of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Excursion {
    /// Its samples.
    pub samples: Range<usize>,
    /// Largest rate, in the unit of the readings, and its standard error.
    pub peak: (f64, f64),
    /// How well its ends are known, samples.
    pub end_error: f64,
}

impl Excursion {
    /// Its samples, and an eighth of them on either side, of `n`.
    #[must_use]
    pub fn with_margin(&self, n: usize) -> Range<usize> {
        let margin = self.samples.len() / 8 + 1;
        self.samples.start.saturating_sub(margin)..(self.samples.end + margin).min(n)
    }
}

/// A place where something happens.
struct Place {
    /// First sample of its window, samples of a block, and energy of the series in it.
    at: usize,
    block: usize,
    energy: f64,
}

impl Place {
    fn inside(&self) -> Range<usize> {
        self.at + REST * self.block..self.at + (REST + BLOCKS) * self.block
    }
}

/// The turns in readings in deg/s, in their order. None where they are more than a base at rest has, and none
/// where much else stands out: then they are the largest of what the gyro does by itself.
#[must_use]
pub fn excursions(y: &[f64], rate_hz: f64) -> Vec<Excursion> {
    let white = white_by_differences(y);
    let mut found: Vec<Excursion> = vec![];
    let mut seen: Vec<Range<usize>> = vec![];
    let (places, limit) = places(y, white, rate_hz);
    for place in places {
        if seen.len() == MOST {
            break;
        }
        let inside = place.inside();
        let middle = inside.start.midpoint(inside.end);
        if seen.iter().any(|s| s.contains(&middle)) {
            continue;
        }
        let excursion = closely(y, &place, white, limit);
        let apart = |e: &Excursion| found.iter().all(|o| !overlap(&o.samples, &e.samples));
        seen.push(excursion.as_ref().map_or(inside, |e| e.samples.clone()));
        found.extend(excursion.filter(apart));
    }
    found.retain(|e| e.peak.0 >= LEAST_PEAK);
    let all: usize = found.iter().map(|e| e.with_margin(y.len()).len()).sum();
    if beside(seen, &found) > BESIDE || all as f64 > SELDOM * y.len() as f64 {
        return vec![];
    }
    found.sort_by_key(|e| e.samples.start);
    found
}

/// How many stretches stand out beside those found, what overlaps taken as one.
fn beside(mut seen: Vec<Range<usize>>, found: &[Excursion]) -> usize {
    // A turn stands out in the rest beside it too.
    let reach = |e: &Excursion| {
        let rest = e.samples.len();
        e.samples.start.saturating_sub(rest)..e.samples.end + rest
    };
    seen.retain(|s| !found.iter().any(|e| overlap(&reach(e), s)));
    seen.sort_by_key(|s| s.start);
    let mut end = 0;
    let apart = seen.iter().filter(|s| {
        let first = s.start >= end;
        end = end.max(s.end);
        first
    });
    apart.count()
}

/// The largest rate that readings have in the shape of a turn between two samples.
#[must_use]
pub fn largest_rate(y: &[f64], samples: &Range<usize>) -> f64 {
    let rest = samples.len() / 2;
    let window = samples.start.saturating_sub(rest)..(samples.end + rest).min(y.len());
    let by = window.len().div_ceil(POINTS).max(1);
    let at = |i: usize| (i - window.start) as f64 / by as f64;
    let points = means(&y[window.clone()], by);
    Fit::new(&points, at(samples.start), at(samples.end)).peak.0
}

/// Whether two stretches have a sample in common.
pub(crate) fn overlap(a: &Range<usize>, b: &Range<usize>) -> bool {
    a.start < b.end && b.start < a.end
}

/// Where the series stands out, largest energy first, and the ratio to its usual energy from which on it does: the
/// usual energy of each length is taken from its median, so that a bias that wanders does not stand out of itself.
fn places(y: &[f64], white: f64, rate_hz: f64) -> (Vec<Place>, f64) {
    let basis = basis(WINDOW, REST as f64, (REST + BLOCKS) as f64);
    let blocks = lengths(rate_hz);
    let looks: usize = blocks.iter().map(|b| y.len() / b).sum();
    let limit = threshold::tail(SHAPES, omnibus_level() / looks.max(1) as f64);
    // A rate of a third of the least peak, all the time of a turn.
    let least = BLOCKS as f64 * (LEAST_PEAK / 3.0).powi(2);
    let mut places = vec![];
    for block in blocks {
        let means = means(y, block);
        if !largest_reach(&means, least, &basis[1..]) {
            continue;
        }
        let energies: Vec<f64> = (means.windows(WINDOW).map(|w| energy(w, &basis[1..]))).collect();
        let mut sorted = energies.clone();
        let middle = sorted.len() / 2;
        let usual = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1 / MEDIAN;
        let usual = usual.max(white / block as f64);
        let found = energies.iter().enumerate();
        let found = found.filter(|(_, e)| **e > (limit * usual).max(least));
        places.extend(found.map(|(i, e)| Place {
            at: i * block,
            block,
            energy: e * block as f64,
        }));
    }
    places.sort_by(|a, b| b.energy.total_cmp(&a.energy));
    (places, limit)
}

/// Energy of the series in a window.
#[inline(always)]
fn energy(window: &[f64], basis: &[Vec<f64>]) -> f64 {
    basis.iter().map(|b| dot(b, window).powi(2)).sum()
}

wide! {
    /// Whether the energy of the series is more than `least` in any window.
    fn largest_reach[](means: &[f64], least: f64, basis: &[Vec<f64>]) -> bool = any_reaches
}

/// The energy is asked only where the sum of squares, of which it is a part, is.
#[inline(always)]
fn any_reaches(means: &[f64], least: f64, basis: &[Vec<f64>]) -> bool {
    let level = means.iter().sum::<f64>() / means.len().max(1) as f64;
    let square = |v: f64| (v - level) * (v - level);
    let mut sum = 0.0;
    for (i, w) in means.windows(WINDOW).enumerate() {
        // Anew now and then: what is added and taken off again leaves its rounding.
        sum = if i % WINDOW == 0 {
            w.iter().map(|v| square(*v)).sum()
        } else {
            sum + square(w[WINDOW - 1]) - square(means[i - 1])
        };
        if sum > 0.99 * least && energy(w, basis) > least {
            return true;
        }
    }
    false
}

/// Samples of a block for each length that is looked for, 2^1/2 apart.
fn lengths(rate_hz: f64) -> Vec<usize> {
    let block = |seconds: f64| (seconds * rate_hz / BLOCKS as f64) as usize;
    let mut all = vec![block(SHORTEST_S).max(1)];
    while let Some(last) = all.last() {
        let next = ((*last as f64 * 2f64.sqrt()).round() as usize).max(last + 1);
        if next > block(LONGEST_S) {
            break;
        }
        all.push(next);
    }
    all
}

/// A place looked at closely: its ends fitted, and whether something goes out and comes back there, however far.
fn closely(y: &[f64], place: &Place, white: f64, limit: f64) -> Option<Excursion> {
    let by = (WINDOW * place.block).div_ceil(POINTS);
    let end = (place.at + WINDOW * place.block).min(y.len());
    let points = means(&y[place.at..end], by);
    let (n, white) = (points.len(), white / by as f64);
    let mean = points.iter().sum::<f64>() / n as f64;
    let total: f64 = points.iter().map(|v| (v - mean).powi(2)).sum();
    let whole = n as f64 / WINDOW as f64;
    let (start, end) = ends(&points, whole);
    let fit = Fit::new(&points, start, end);
    // What is left has the freedom of the points less the level, the series and its ends.
    let left = fit.left / (n as f64 - (SHAPES + 3) as f64).max(1.0);
    let left = left.max(white);
    let explained = total - fit.left;
    let level = |part: &[f64]| part.iter().sum::<f64>() / part.len().max(1) as f64;
    let before = level(&points[..start as usize]);
    let after = level(&points[(end.ceil() as usize).min(n - 1)..]);
    let is_one = explained > limit * left
        && explained >= SHARE * (total - n as f64 * white)
        && (after - before).abs() <= RETURNS * fit.peak.0
        && steps(&points, left) - fit.left > 2.0 * ODDS.ln() * left;
    let sample = |at: f64| place.at + (at * by as f64).round() as usize;
    is_one.then(|| Excursion {
        samples: sample(start)..sample(end).min(y.len()),
        peak: (
            fit.peak.0,
            (fit.peak.1 * left.sqrt()).hypot(OFF * fit.peak.0),
        ),
        // The series is free to run on a little where a turn has ended.
        end_error: by as f64 * end_error(&points, start, end, left).hypot((end - start) / 8.0),
    })
}

/// The two ends, in points, between which the series fits best; rest of an eighth of the window on either side is kept.
fn ends(points: &[f64], whole: f64) -> (f64, f64) {
    let n = points.len() as f64;
    let rest = REST as f64 / 2.0 * whole;
    let left = |(a, b): (f64, f64)| Fit::new(points, a, b).left;
    let shortest = BLOCKS as f64 / 2.0 * whole;
    let allowed = |(a, b): (f64, f64)| a >= rest && b <= n - rest && b - a >= shortest;
    let mut best = (REST as f64 * whole, (REST + BLOCKS) as f64 * whole);
    let mut least = left(best);
    let mut step = rest;
    while step >= FINEST {
        let (a, b) = best;
        let near = [
            (a - step, b),
            (a + step, b),
            (a, b - step),
            (a, b + step),
            (a - step, b - step),
            (a + step, b + step),
        ];
        let next = near
            .into_iter()
            .filter(|e| allowed(*e))
            .map(|e| (e, left(e)));
        match next.min_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((at, smaller)) if smaller < least => (best, least) = (at, smaller),
            _ => step /= 2.0,
        }
    }
    best
}

/// Standard error of the worse of two ends, points: by the bend of what is left as it moves.
fn end_error(points: &[f64], start: f64, end: f64, variance: f64) -> f64 {
    let left = |a: f64, b: f64| Fit::new(points, a, b).left;
    let here = 2.0 * left(start, end);
    let bends = [
        left(start - 1.0, end) + left(start + 1.0, end) - here,
        left(start, end - 1.0) + left(start, end + 1.0) - here,
    ];
    let bend = bends[0].min(bends[1]).max(f64::MIN_POSITIVE);
    (2.0 * variance / bend).sqrt().min(0.5 * (end - start))
}

/// A level and the series between two ends, fitted.
struct Fit {
    /// Sum of the squares that it leaves.
    left: f64,
    /// Largest rate from the level, and its error for a noise of 1.
    peak: (f64, f64),
}

impl Fit {
    fn new(points: &[f64], start: f64, end: f64) -> Self {
        let basis = basis(points.len(), start, end);
        let sizes: Vec<f64> = basis.iter().map(|b| dot(b, points)).collect();
        let energy: f64 = sizes.iter().map(|s| s * s).sum();
        let all: f64 = points.iter().map(|v| v * v).sum();
        // At rest the series is what centring has made of it, the same before and after.
        let at = |i: usize| {
            basis[1..]
                .iter()
                .zip(&sizes[1..])
                .map(|(b, s)| b[i] * s)
                .sum::<f64>()
        };
        let level = at(0);
        let error = |i: usize| {
            basis[1..]
                .iter()
                .map(|b| (b[i] - b[0]).powi(2))
                .sum::<f64>()
        };
        let rates = (0..points.len()).map(|i| ((at(i) - level).abs(), i));
        let (peak, i) = rates.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, 0));
        Fit {
            left: (all - energy).max(f64::MIN_POSITIVE),
            peak: (peak, error(i).sqrt()),
        }
    }
}

/// A constant and the sines between two ends of `n` points, orthonormal.
fn basis(n: usize, start: f64, end: f64) -> Vec<Vec<f64>> {
    let constant = vec![1.0; n];
    let sine = |order: usize| {
        let place = |i: usize| (i as f64 + 0.5 - start) / (end - start);
        let value = |x: f64| {
            if (0.0..1.0).contains(&x) {
                (PI * order as f64 * x).sin()
            } else {
                0.0
            }
        };
        (0..n).map(|i| value(place(i))).collect::<Vec<f64>>()
    };
    let mut basis: Vec<Vec<f64>> = vec![];
    for mut column in std::iter::once(constant).chain((1..=SHAPES).map(sine)) {
        for b in &basis {
            let share = dot(&column, b);
            column.iter_mut().zip(b).for_each(|(c, b)| *c -= share * b);
        }
        let length = dot(&column, &column).sqrt().max(f64::MIN_POSITIVE);
        column.iter_mut().for_each(|c| *c /= length);
        basis.push(column);
    }
    basis
}

/// Least sum of squares about levels, their edges wherever they fit best: of [`LEVELS`], or of more that are worth it by
/// Schwarz's criterion, each with its edge.
fn steps(points: &[f64], variance: f64) -> f64 {
    let n = points.len();
    let mut sums = vec![(0.0, 0.0)];
    for v in points {
        let (sum, squares) = sums[sums.len() - 1];
        sums.push((sum + v, squares + v * v));
    }
    let about = |from: usize, to: usize| {
        let (sum, squares) = (sums[to].0 - sums[from].0, sums[to].1 - sums[from].1);
        squares - sum * sum / (to - from) as f64
    };
    let price = 2.0 * variance * (n as f64).ln();
    // Of the first so many points, by one level, by two, and so on.
    let mut best: Vec<f64> = (1..=n).map(|to| about(0, to)).collect();
    let mut least = f64::INFINITY;
    for levels in 2..=MOST_LEVELS {
        best = (1..=n)
            .map(|to| {
                (1..to)
                    .map(|from| best[from - 1] + about(from, to))
                    .fold(best[to - 1], f64::min)
            })
            .collect();
        let left = best.last().copied().unwrap_or(0.0);
        least = least.min(
            left + if levels > LEVELS {
                2.0 * ODDS.ln() * variance + price * (levels - LEVELS) as f64
            } else {
                0.0
            },
        );
    }
    least
}

fn means(y: &[f64], by: usize) -> Vec<f64> {
    let mean = |part: &[f64]| part.iter().sum::<f64>() / by as f64;
    y.chunks_exact(by).map(mean).collect()
}

/// Rate between [`MOTION_BAND_HZ`] beyond what a bias can wander, deg/s rms.
pub(crate) const MOTION_RMS: f64 = 0.3;

#[cfg(test)]
mod tests;
