//! The modified total deviation and Theo1 at long cluster times: the same sums as in `total`, from products at each lag.
//!
//! Both are sums of squares of a few points each, over all windows w and all places i in them. Multiplied out, a product
//! of two points that move the same way has one lag for all i and needs a running sum; one of points that move against
//! each other has another lag for every i, and all of these come out of one Fourier transform
//! ([`Correlator::symmetric`]). Windows are taken in blocks, each freed from its own straight line, which neither
//! deviation sees: so the products stay as small as what they leave.

use super::PhasePoint;
use super::correlate::{Correlator, remove_line};

/// Averaging factors from which transforms are faster than the sums as they stand.
pub(super) const MODIFIED_TOTAL_FROM: usize = 96;
/// The same for Theo1.
pub(super) const THEO1_FROM: usize = 256;
/// Windows in a block, in units of m.
const BLOCK: usize = 6;

/// The points of the windows `start..end`, each `length` long, from their own middle and straight line.
fn block<T: PhasePoint>(x: &[T], start: usize, end: usize, length: usize) -> Vec<f64> {
    let points = &x[start..end + length - 1];
    let middle = points[points.len() / 2];
    let mut out: Vec<f64> = points.iter().map(|v| (*v - middle).to_f64()).collect();
    remove_line(&mut out);
    out
}

/// First windows of the blocks and what ends them, none much shorter than the others.
fn blocks(windows: usize, m: usize) -> impl Iterator<Item = (usize, usize)> {
    let count = windows.div_ceil(BLOCK * m).max(1);
    (0..count).map(move |k| (k * windows / count, (k + 1) * windows / count))
}

/// As [`super::total::theo1`].
pub(super) fn theo1<T: PhasePoint>(x: &[T], m: usize, correlator: &mut Correlator) -> (f64, usize) {
    let windows = x.len() - m;
    let half = m / 2;
    let mut total = 0.0;
    for (start, end) in blocks(windows, m) {
        let w = end - start;
        let x = block(x, start, end, m + 1);
        let squares = running(x.iter().map(|v| v * v));
        let square = |i: usize| squares[i + w] - squares[i];
        // Σ x[i]·x[i + k], Σ x[i + m]·x[i + m − k] and Σ x[i + k]·x[i + m − k] over the windows.
        let first = correlator.lags(&x[..w], &x, 0, m + 1);
        let last = correlator.lags(&x, &x[m..], -(m as isize), m + 1);
        let middle = correlator.symmetric(&x, w, m);
        let ends = square(0) + square(m) + 2.0 * first[m];
        for k in 1..=half {
            // δ = m/2 − k: the inner points are k and m − k.
            let sum = ends + square(k) + square(m - k) + 2.0 * middle[k]
                - 2.0 * (first[k] + first[m - k] + last[m - k] + last[k]);
            total += sum / k as f64;
        }
    }
    (total.max(0.0), windows)
}

/// Sums before each place, and that of all.
fn running(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sum = 0.0;
    let mut out = vec![0.0];
    out.extend(values.map(|v| {
        sum += v;
        sum
    }));
    out
}

/// A point of an inner sum: `factor`·q[`from` ± i].
#[derive(Clone, Copy)]
struct Point {
    factor: f64,
    from: usize,
    up: bool,
}

impl Point {
    fn at(self, i: usize) -> usize {
        if self.up {
            self.from + i
        } else {
            self.from - i
        }
    }
}

/// Inner sums z that differ by i alone: their points, `factor`·q at one end of the window, and how often they count.
struct Branch {
    points: [Point; 4],
    factor: f64,
    end: usize,
    weights: Vec<f64>,
}

impl Branch {
    /// The four kinds of inner sums of a window: see [`super::total::modified_total`].
    fn all(m: usize) -> [Self; 4] {
        let up = |factor, from| Point {
            factor,
            from,
            up: true,
        };
        let down = |factor, from| Point {
            factor,
            from,
            up: false,
        };
        let mut twice = vec![2.0; m];
        twice[0] = 1.0;
        let once = vec![1.0; m + 1];
        let length = 3 * m;
        [
            Self {
                points: [
                    up(1.0, 0),
                    down(1.0, length),
                    down(3.0, m),
                    down(-3.0, 2 * m),
                ],
                factor: -2.0,
                end: 0,
                weights: twice.clone(),
            },
            Self {
                points: [up(-1.0, 0), down(-1.0, length), up(3.0, m), up(-3.0, 2 * m)],
                factor: 2.0,
                end: length,
                weights: twice,
            },
            Self {
                points: [up(1.0, m), down(1.0, 2 * m), up(-3.0, 0), down(-3.0, m)],
                factor: 4.0,
                end: 0,
                weights: once.clone(),
            },
            Self {
                points: [
                    up(-1.0, m),
                    down(-1.0, 2 * m),
                    up(3.0, 2 * m),
                    down(3.0, length),
                ],
                factor: -4.0,
                end: length,
                weights: once,
            },
        ]
    }

    /// Adds `scale[i]`·zᵢ to a row of factors of q.
    fn add_to(&self, row: &mut [f64], scale: impl Fn(usize) -> f64) {
        for (i, weight) in self.weights.iter().enumerate() {
            let scale = weight * scale(i);
            for point in self.points {
                row[point.at(i)] += scale * point.factor;
            }
            row[self.end] += scale * self.factor;
        }
    }

    /// zᵢ of a window.
    fn inner(&self, q: &[f64], i: usize) -> f64 {
        self.points
            .iter()
            .map(|p| p.factor * q[p.at(i)])
            .sum::<f64>()
            + self.factor * q[self.end]
    }
}

/// Σ_w q[w + α]·q[w + β] over the windows of a block, for all α and β that the inner sums meet.
struct Products {
    m: usize,
    windows: usize,
    /// At the lags 0, m, 2m and 3m, running.
    same: [Vec<f64>; 4],
    /// By α + β = m, 2m, ... 5m, from the first point that is met on.
    against: [Vec<f64>; 5],
}

impl Products {
    fn new(q: &[f64], windows: usize, m: usize, correlator: &mut Correlator) -> Self {
        Self {
            m,
            windows,
            same: [0, m, 2 * m, 3 * m]
                .map(|lag| running(q.iter().zip(&q[lag..]).map(|(a, b)| a * b))),
            against: [(0, m), (0, 2 * m), (0, 3 * m), (m, 2 * m), (2 * m, m)]
                .map(|(from, s)| correlator.symmetric(&q[from..], windows, s)),
        }
    }

    /// Of two points that move the same way, at i.
    fn same_way(&self, p: Point, r: Point) -> impl Fn(usize) -> f64 {
        let sums = &self.same[p.from.abs_diff(r.from) / self.m];
        let windows = self.windows;
        move |i| {
            let low = p.at(i).min(r.at(i));
            sums[low + windows] - sums[low]
        }
    }

    /// Of two that move against each other.
    fn against(&self, p: Point, r: Point) -> impl Fn(usize) -> f64 {
        let kind = (p.from + r.from) / self.m - 1;
        let sums = &self.against[kind];
        let first = kind.saturating_sub(2) * self.m;
        move |i| sums[p.at(i).min(r.at(i)) - first]
    }
}

/// As [`super::total::modified_total`].
pub(super) fn modified_total<T: PhasePoint>(
    x: &[T],
    m: usize,
    correlator: &mut Correlator,
) -> (f64, usize) {
    let length = 3 * m;
    let half = length / 2;
    let windows = x.len() + 1 - length;
    let branches = Branch::all(m);
    // The inner sums of 0, 1, 2, ... and what takes the window's q to their product with its own inner sums.
    let ramp: Vec<f64> = (0..=length)
        .map(|i| (i * i.saturating_sub(1) / 2) as f64)
        .collect();
    let mut along = vec![0.0; length + 1];
    let mut unit_squares = 0.0;
    for branch in &branches {
        branch.add_to(&mut along, |i| branch.inner(&ramp, i));
        unit_squares += branch
            .weights
            .iter()
            .enumerate()
            .map(|(i, w)| w * branch.inner(&ramp, i).powi(2))
            .sum::<f64>();
    }
    let ends = [0, length].map(|end| (end, of_end(&branches, end, length)));
    let mut total = 0.0;
    for (start, end) in blocks(windows, m) {
        let w = end - start;
        let x = block(x, start, end, length);
        let mut q = running(x.into_iter());
        let mean = q.iter().sum::<f64>() / q.len() as f64;
        q.iter_mut().for_each(|v| *v -= mean);
        let products = Products::new(&q, w, m, correlator);
        total += branches.iter().map(|b| squares(b, &products)).sum::<f64>();
        for (end, row) in &ends {
            let with_end = correlator.lags(row, &q, 0, w);
            total += 2.0
                * with_end
                    .iter()
                    .zip(&q[*end..])
                    .map(|(a, b)| a * b)
                    .sum::<f64>();
        }
        let with_unit = correlator.lags(&along, &q, 0, w);
        for (start, with_unit) in with_unit.into_iter().enumerate() {
            let q = &q[start..=start + length];
            let (low, high) = (q[half] - q[0], q[length] - q[length - half]);
            let slope = (high - low) / (half as f64 * (length - half) as f64);
            total += slope * (slope * unit_squares - 2.0 * with_unit);
        }
    }
    (total.max(0.0) / (6 * m) as f64, windows)
}

/// What multiplies the point at an end of a window: with the others through their sum, and with itself.
fn of_end(branches: &[Branch], end: usize, length: usize) -> Vec<f64> {
    let mut row = vec![0.0; length + 1];
    for branch in branches.iter().filter(|b| b.end == end) {
        branch.add_to(&mut row, |_| branch.factor);
        row[end] -= 0.5 * branch.factor.powi(2) * branch.weights.iter().sum::<f64>();
    }
    row
}

/// Σ_w Σᵢ (weight of i)·(zᵢ without the end point)².
fn squares(branch: &Branch, products: &Products) -> f64 {
    let mut sum = 0.0;
    for (k, p) in branch.points.iter().enumerate() {
        for r in &branch.points[k..] {
            let factor = p.factor
                * r.factor
                * if p.from == r.from && p.up == r.up {
                    1.0
                } else {
                    2.0
                };
            let weights = || branch.weights.iter().enumerate();
            sum += factor
                * if p.up == r.up {
                    let product = products.same_way(*p, *r);
                    weights().map(|(i, w)| w * product(i)).sum::<f64>()
                } else {
                    let product = products.against(*p, *r);
                    weights().map(|(i, w)| w * product(i)).sum::<f64>()
                };
        }
    }
    sum
}
