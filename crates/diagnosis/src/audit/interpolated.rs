//! Readings that their neighbours foretell: gaps that were bridged by a line, a parabola or a spline, or held.
//!
//! Where a curve of degree k - 1 stands in for readings, their k-th differences are rounding alone. Differences d of a
//! window of L are jointly normal with the covariance C that the record itself shows, whatever its spectrum, so
//! d' C^-1 d over its mean is a ratio of chi-squares, and how small it may be is known. Windows that are too small are
//! counted, none twice, against a Poisson law. What a law that is not normal adds shows as well where every few readings alone
//! are taken, which nothing bridges; an even noise of a code's width is added first, since what is rounded would
//! else be exactly 0 more often than its spread says.

use model::effects;
use rand_core::SeedableRng;
use rand_distr::{Distribution, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::rounding::in_steps;
use super::{Audit, Gyro, LEAST_READINGS};
use crate::test_level::CheckId;
use numerics::tails;

/// Orders of the differences: a line leaves no second one, a cubic no fourth one.
const ORDERS: [usize; 2] = [2, 4];
/// Differences of a window.
const LENGTHS: [usize; 3] = [3, 5, 9];
/// Windows on either side that tell how large differences are there; the smaller one counts, so that a stretch is not held
/// against a louder one beside it.
const ABOUT: usize = 60;
/// Expected windows at which they are counted.
const EXPECTED: [f64; 7] = [3.0, 1.0, 0.3, 0.1, 0.01, 1e-3, 1e-5];
/// Readings apart that are held against those in turn, longer than most windows; and standard errors of what they show.
const APART: [usize; 2] = [7, 11];
const ROOM: f64 = 3.0;
/// Least noise, steps: what is bridged is hardly told from less.
const LEAST_SIGMA: f64 = 1.0;

/// Differences of order `order`, 2 or 4: each from that many readings before it on; NaN where one is lost.
fn differences(y: &[f64], order: usize) -> Vec<f64> {
    let second = |w: &[f64]| (w[2] - w[1]) - (w[1] - w[0]);
    let fourth = |w: &[f64]| second(&[second(&w[..3]), second(&w[1..4]), second(&w[2..5])]);
    if order == 2 {
        y.windows(3).map(second).collect()
    } else {
        y.windows(5).map(fourth).collect()
    }
}

/// The lower triangle whose product with its transpose is `covariance`, of which rows up to the diagonal are given, row by row.
fn cholesky(covariance: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let mut rows: Vec<Vec<f64>> = vec![];
    for (i, given) in covariance.iter().enumerate() {
        let mut row = Vec::with_capacity(i + 1);
        for j in 0..=i {
            let above: &[f64] = if j < i { &rows[j] } else { &row };
            let dot: f64 = row[..j].iter().zip(above).map(|(a, b)| a * b).sum();
            let rest = given[j] - dot;
            row.push(if j < i {
                rest / rows[j][j]
            } else {
                Some(rest.sqrt()).filter(|r| *r > 0.0)?
            });
        }
        rows.push(row);
    }
    Some(rows)
}

/// Covariance of the differences of the longest window over their variance, from windows that are whole. Differences of a high
/// order nearly cancel in some direction: lag by lag, each from other readings where many are lost, it would be anything there.
fn covariance(d: &[f64]) -> Vec<Vec<f64>> {
    const LONGEST: usize = LENGTHS[LENGTHS.len() - 1];
    // Known to some percent in every direction, at no cost in a long record.
    const LEAST: f64 = 1000.0;
    const MOST: usize = 1 << 16;
    let mut sums: Vec<Vec<f64>> = (0..LONGEST).map(|i| vec![0.0; i + 1]).collect();
    let mut whole = 0.0;
    for w in d.windows(LONGEST).step_by(d.len() / MOST + 1) {
        if w.iter().all(|v| v.is_finite()) {
            whole += 1.0;
            for (row, a) in sums.iter_mut().zip(w) {
                row.iter_mut().zip(w).for_each(|(sum, b)| *sum += a * b);
            }
        }
    }
    let variance = sums.iter().enumerate().map(|(i, row)| row[i]).sum::<f64>() / LONGEST as f64;
    if whole < LEAST || variance <= 0.0 {
        return vec![];
    }
    sums.iter_mut().flatten().for_each(|v| *v /= variance);
    sums
}

/// Sum of squares of independent normal values that make up `d`.
fn independent(rows: &[Vec<f64>], d: &[f64], z: &mut Vec<f64>) -> f64 {
    z.clear();
    for (row, d) in rows.iter().zip(d) {
        let known: f64 = row.iter().zip(z.iter()).map(|(r, z)| r * z).sum();
        z.push((d - known) / row[z.len()]);
    }
    z.iter().map(|z| z * z).sum()
}

/// Mean square of differences about each, by the quieter side; 0, so that nothing is small, where neither has enough readings.
fn powers(d: &[f64]) -> Vec<f64> {
    // Sums of a stretch and what lies about it stay at hand.
    const STRETCH: usize = 1 << 12;
    let n = d.len();
    let mean = |low: &[f64; 2], high: &[f64; 2]| {
        let [sum, known] = [high[0] - low[0], high[1] - low[1]];
        if known < (ABOUT / 2) as f64 {
            f64::INFINITY
        } else {
            sum / known
        }
    };
    let mut power = Vec::with_capacity(n);
    let mut sums = vec![];
    for from in (0..n).step_by(STRETCH) {
        let to = (from + STRETCH).min(n);
        // What lies beyond either end is not known.
        let about = from.saturating_sub(ABOUT)..(to + ABOUT).min(n);
        let before = std::iter::repeat_n(&f64::NAN, ABOUT - (from - about.start));
        let behind = std::iter::repeat_n(&f64::NAN, ABOUT - (about.end - to));
        // Of all before each, and how many are known.
        let [mut sum, mut known] = [0.0; 2];
        sums.clear();
        sums.push([sum, known]);
        sums.extend(before.chain(&d[about]).chain(behind).map(|v| {
            let finite = v.is_finite();
            sum += if finite { v * v } else { 0.0 };
            known += f64::from(u8::from(finite));
            [sum, known]
        }));
        let sides = sums.iter().zip(&sums[ABOUT..]).zip(&sums[2 * ABOUT..]);
        power.extend(sides.take(to - from).map(|((low, at), high)| {
            let quieter = mean(low, at).min(mean(at, high));
            if quieter.is_finite() { quieter } else { 0.0 }
        }));
    }
    power
}

/// Differences of one order.
struct Differences {
    order: usize,
    d: Vec<f64>,
    /// Mean square about each.
    power: Vec<f64>,
    /// Covariance of the differences of a window over their variance, rows up to the diagonal; none where few are whole.
    covariance: Vec<Vec<f64>>,
}

impl Differences {
    fn new(y: &[f64], order: usize) -> Self {
        let d = differences(y, order);
        let power = powers(&d);
        let covariance = covariance(&d);
        Self {
            order,
            d,
            power,
            covariance,
        }
    }

    /// Windows of `length` that are too small: first difference, and the chance of each, below `least`.
    fn windows(&self, length: usize, least: f64) -> Vec<(usize, f64)> {
        let Some(rows) = self.covariance.get(..length).and_then(cholesky) else {
            return vec![];
        };
        // Of correlated values so many are independent.
        let alike: f64 = (self.covariance.iter().skip(1))
            .map(|r| 2.0 * r[0] * r[0])
            .sum();
        let Ok(law) = FisherSnedecor::new(length as f64, ABOUT as f64 / (1.0 + alike)) else {
            return vec![];
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if law.cdf(middle) > least {
                high = middle;
            } else {
                low = middle;
            }
        }
        // None of a small window is farther off than the window as a whole.
        let most = high * length as f64;
        let small = |i: usize| self.d[i] * self.d[i] < most * self.power[i];
        let (mut found, mut z) = (vec![], vec![]);
        // From the last of each on, so that one that is not small rules out all windows that it is in; those before `sure` are.
        let (mut first, mut sure) = (0, 0);
        while first + length <= self.d.len() {
            let end = first + length;
            let not = (sure..end).rev().find(|i| !small(*i));
            sure = end;
            if let Some(not) = not {
                first = not + 1;
                continue;
            }
            let ratio = independent(&rows, &self.d[first..end], &mut z)
                / length as f64
                / self.power[first].min(self.power[end - 1]);
            if ratio < high {
                found.push((first, law.cdf(ratio)));
            }
            first += 1;
        }
        found
    }
}

/// How many windows there are whose chance is below that of each number in [`EXPECTED`], none of them twice, by order and
/// length.
fn counts(y: &[f64]) -> Vec<[u64; EXPECTED.len()]> {
    let mut all = vec![];
    for of in ORDERS.map(|order| Differences::new(y, order)) {
        let n = of.d.iter().filter(|d| d.is_finite()).count() as f64;
        for length in LENGTHS {
            let windows = of.windows(length, EXPECTED[0] / n);
            all.push(EXPECTED.map(|expected| {
                let mut free = 0;
                let mut apart = |(first, p): &&(usize, f64)| {
                    let counts = *p < expected / n && *first >= free;
                    if counts {
                        free = first + length + of.order;
                    }
                    counts
                };
                windows.iter().filter(|w| apart(w)).count() as u64
            }));
        }
    }
    all
}

/// Every `apart`-th reading, from the first on, then from the second on, and so on.
fn taken(y: &[f64], apart: usize) -> Vec<f64> {
    let mut all = vec![0.0; y.len()];
    let from = |first: usize| (0..first).map(|f| (y.len() - f).div_ceil(apart)).sum();
    let places: Vec<usize> = (0..apart.min(y.len())).map(from).collect();
    for (i, few) in y.chunks(apart).enumerate() {
        (few.iter().zip(&places)).for_each(|(v, place)| all[place + i] = *v);
    }
    all
}

/// Windows that are too small together, expected and counted.
pub(super) struct Foretold {
    chance: f64,
    expected: f64,
    counted: u64,
    order: usize,
    length: usize,
}

fn foretold(y: &[f64]) -> Option<Foretold> {
    let in_turn = counts(y);
    let others = APART.map(|apart| counts(&taken(y, apart)));
    let looks = (in_turn.len() * EXPECTED.len()) as f64;
    let places = ORDERS.iter().flat_map(|o| LENGTHS.map(|l| (*o, l)));
    let mut all = vec![];
    for (i, (order, length)) in places.enumerate() {
        for (k, expected) in EXPECTED.iter().enumerate() {
            let sum: u64 = others.iter().map(|o| o[i][k]).sum();
            let mean = sum as f64 / APART.len() as f64;
            let by_law = mean + ROOM * (mean / APART.len() as f64).sqrt();
            let (expected, counted) = (expected.max(by_law), in_turn[i][k]);
            all.push(Foretold {
                chance: (looks * tails::at_least(counted, expected)).min(1.0),
                expected,
                counted,
                order,
                length,
            });
        }
    }
    all.into_iter().min_by(|a, b| a.chance.total_cmp(&b.chance))
}

/// What is foretold of a gyro; none where it cannot be said.
pub(super) fn found(g: &Gyro<'_>, audit: &Audit) -> Option<Foretold> {
    let name = g.channel.name.as_str();
    // These make the step wider than it is said to be.
    let wider = [
        effects::coarse_lsb::ID,
        effects::double_rounding::ID,
        effects::stuck_bit::ID,
    ];
    if audit.found(&wider, name) {
        return None;
    }
    let usable = audit.usable.get(name)?;
    let unit = if g.counts.is_some() {
        g.channel.lsb.unwrap_or(1.0)
    } else {
        1.0
    };
    let (y, sigma) = match in_steps(g) {
        Some((steps, step)) => (steps, g.local.sigma * unit / step),
        None => (g.channel.values.clone(), f64::INFINITY),
    };
    if y.len() < LEAST_READINGS || sigma < LEAST_SIGMA {
        return None;
    }
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0x666f_7265);
    let width = if sigma.is_finite() { 0.5 } else { 0.0 };
    let within = Uniform::new_inclusive(-width, width);
    let y: Vec<f64> = (y.iter().zip(usable))
        .map(|(v, usable)| {
            let dither = within.map_or(0.0, |w| w.sample(&mut rng));
            if *usable { v + dither } else { f64::NAN }
        })
        .collect();
    foretold(&y)
}

/// Tells of what is foretold of a gyro.
pub(super) fn audit(g: &Gyro<'_>, found: Option<Foretold>, audit: &mut Audit) {
    let name = g.channel.name.as_str();
    let Some(found) = found else {
        return;
    };
    let what = format!(
        "in {} stretches of {} readings {name} follows a {} closer than its noise lets it, {:.2} are expected",
        found.counted,
        found.length + found.order,
        if found.order == 2 {
            "straight line"
        } else {
            "smooth curve"
        },
        found.expected,
    );
    let fails = audit.check(
        CheckId::Foretold,
        name,
        found.counted as f64,
        found.chance,
        what.clone(),
    );
    if fails {
        audit.unexplain(name, what);
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::StandardNormal;

    use super::*;

    /// Codes of white noise behind a one-pole filter, with a cubic over `readings` at some places, even noise added.
    fn codes(sigma: f64, keep: f64, gaps: usize, readings: usize, seed: u64) -> Vec<f64> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut held = 0.0;
        let mut y: Vec<f64> = (0..6000)
            .map(|_| {
                let z: f64 = StandardNormal.sample(&mut rng);
                held = keep * held + (1.0 - keep * keep).sqrt() * z;
                (sigma * held).round()
            })
            .collect();
        for gap in 0..gaps {
            let from = 50 + gap * 200;
            let (a, b) = (y[from], y[from + readings + 1]);
            for k in 1..=readings {
                let t = k as f64 / (readings + 1) as f64;
                y[from + k] = (a + (b - a) * t * t * (3.0 - 2.0 * t)).round();
            }
        }
        let even = Uniform::new(-0.5, 0.5).unwrap();
        y.iter().map(|v| v + even.sample(&mut rng)).collect()
    }

    #[test]
    fn noise_of_any_colour_foretells_nothing_more_often_than_chance_says() {
        let settings = [(1.2, 0.0), (5.0, 0.0), (5.0, 0.8), (40.0, -0.5)];
        let runs = 40;
        let low: Vec<f64> = (0..runs)
            .flat_map(|seed| settings.map(|(s, keep)| codes(s, keep, 0, 0, seed)))
            .filter_map(|y| foretold(&y).map(|f| f.chance))
            .filter(|p| *p < 0.02)
            .collect();
        // At most 3.2 of 160 are expected; 10 come once in 400 times.
        assert!(low.len() <= 10, "{low:?}");
    }

    #[test]
    fn readings_lost_at_random_foretell_nothing() {
        for seed in 0..40 {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(200 + seed);
            let lost = Uniform::new(0.0, 1.0).unwrap();
            let y: Vec<f64> = [
                codes(5.0, 0.3, 0, 0, seed),
                codes(5.0, 0.3, 0, 0, 500 + seed),
            ]
            .concat()
            .into_iter()
            .map(|v| {
                if lost.sample(&mut rng) < 0.15 {
                    f64::NAN
                } else {
                    v
                }
            })
            .collect();
            let p = foretold(&y).unwrap().chance;
            assert!(p > 1e-3, "{seed}: {p}");
        }
    }

    #[test]
    fn two_levels_foretell_nothing() {
        for seed in 0..10 {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(100 + seed);
            let y: Vec<f64> = (codes(3.0, 0.0, 0, 0, seed).iter())
                .map(|v| {
                    let z: f64 = StandardNormal.sample(&mut rng);
                    if z > 0.8 { v + 20.0 } else { *v }
                })
                .collect();
            let p = foretold(&y).unwrap().chance;
            assert!(p > 1e-3, "{seed}: {p}");
        }
    }

    #[test]
    fn gaps_that_a_curve_bridges_are_told() {
        for seed in 0..10 {
            let found = foretold(&codes(5.0, 0.0, 12, 11, seed)).unwrap();
            assert!(found.chance < 1e-6, "{seed}: {}", found.chance);
        }
    }
}
