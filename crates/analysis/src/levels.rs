//! Block means that lie about two levels: white noise, a random walk of the level, switches at random. A bank of Kalman
//! filters, one for each level, merged by moments; and how the answer is held against replicates of either side.

use rand_core::SeedableRng;
use rand_distr::{Distribution, Exp1, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::likelihood::{Bins, Dct, Noise};
use crate::logs::LogProduct;

/// ln of variance, ln of random-walk step over it, ln of half height over the white sigma, ln of dwell in blocks.
pub(crate) type Coordinates = [f64; 4];

/// Levels of the two-level process, in half heights.
const TWO: [f64; 2] = [1.0, -1.0];
/// Levels that stand for any: five of a normal distribution.
const MANY: [f64; 5] = [-1.5, -0.7, 0.0, 0.7, 1.5];

/// Log likelihood of block means under white noise + random walk + two levels, the mean taken out.
#[must_use]
pub fn two_level(y: &[f64], x: &Coordinates) -> f64 {
    levels_likelihood(y, x, &TWO)
}

/// The same for jumps between any of `levels`, all equally likely.
fn levels_likelihood<const K: usize>(y: &[f64], x: &Coordinates, levels: &[f64; K]) -> f64 {
    filter(y.iter(), x, levels, |_| {})
}

/// The most probable mean level of each block, from the blocks before it, itself, and those behind it.
pub(crate) fn path(y: &[f64], x: &Coordinates) -> Vec<f64> {
    let half = (x[2] + 0.5 * x[0]).exp();
    let (mut before, mut after) = (vec![], vec![]);
    filter(y.iter(), x, &TWO, |upper| before.push(upper));
    filter(y.iter().rev(), x, &TWO, |upper| after.push(upper));
    after.reverse();
    let switch = switch_of(x);
    let known = |upper: f64| upper * (1.0 - switch) + (1.0 - upper) * switch;
    (0..y.len())
        .map(|t| {
            let from_before = if t > 0 { known(before[t - 1]) } else { 0.5 };
            let upper = from_before * after[t];
            let lower = (1.0 - from_before) * (1.0 - after[t]);
            half * (upper - lower) / (upper + lower).max(f64::MIN_POSITIVE)
        })
        .collect()
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
    let (mut before, mut after) = (vec![], vec![]);
    filter(y.iter(), x, &TWO, |upper| before.push(upper));
    filter(y.iter().rev(), x, &TWO, |upper| after.push(upper));
    let (mut first, second) = (back(after), back(before));
    first.extend(second.into_iter().take(y.len() / 2).rev());
    first
}

/// The least of some exponents, and exp(least - exponent) of each.
#[inline]
fn below_least<const K: usize>(exponents: [f64; K]) -> (f64, [f64; K]) {
    // Of two, one is 1: half the exponentials of what most of the time goes into.
    if let [a, b] = exponents[..] {
        let mut falls = [1.0; K];
        falls[usize::from(b > a)] = (-(a - b).abs()).exp();
        return (a.min(b), falls);
    }
    let least = exponents.iter().copied().fold(f64::INFINITY, f64::min);
    (least, exponents.map(|x| (least - x).exp()))
}

/// The filter behind the likelihood; `seen` is told the chance of the first level after each block.
fn filter<'a, const K: usize>(
    y: impl ExactSizeIterator<Item = &'a f64>,
    x: &Coordinates,
    levels: &[f64; K],
    mut seen: impl FnMut(f64),
) -> f64 {
    let count = y.len();
    let white = x[0].exp();
    let walk = white * x[1].exp();
    let half = x[2].exp() * white.sqrt();
    let others = (K - 1) as f64;
    // Two levels keep their share of 1/2 for ever, many theirs of 1/K.
    let share = K as f64 / others;
    let switch = (1.0 - (-share * (-x[3]).exp()).exp()) / share;
    let start = 1e4 * white + half * half;
    // State by level: weight, mean and variance of the slow level.
    let mut states = [((K as f64).recip(), 0.0, start); K];
    let mut sum = -0.5 * count as f64 * std::f64::consts::TAU.ln();
    let mut product = LogProduct::new();
    for (t, v) in y.enumerate() {
        // Prediction by level: weight times 1/sqrt(s), mean, 1/s, gain, variance after the reading.
        let predicted = states.map(|(w, m, p)| {
            let p = p + if t > 0 { walk } else { 0.0 };
            let inverse = 1.0 / (p + white);
            (
                w * inverse.sqrt(),
                m,
                inverse,
                p * inverse,
                p * white * inverse,
            )
        });
        // State by level after it, with what it is off at best.
        let mut merged = [(0.0, 0.0, 0.0, 0.0); K];
        for (j, (level, merged)) in levels.iter().zip(&mut merged).enumerate() {
            let off = predicted.map(|(_, m, ..)| v - m - half * level);
            let exponents: [f64; K] =
                std::array::from_fn(|i| 0.5 * off[i] * off[i] * predicted[i].2);
            let (least, falls) = below_least(exponents);
            let mut parts = [(0.0, 0.0, 0.0); K];
            let (mut all, mut mean) = (0.0, 0.0);
            for (i, (nu, (w, m, _, gain, after))) in off.iter().zip(&predicted).enumerate() {
                let moved = if i == j {
                    1.0 - switch
                } else {
                    switch / others
                };
                let weight = w * moved * falls[i];
                let at = m + gain * nu;
                parts[i] = (weight, at, *after);
                all += weight;
                mean += weight * at;
            }
            mean /= all;
            let variance = parts
                .iter()
                .map(|(w, at, after)| w * (after + (at - mean).powi(2)))
                .sum::<f64>()
                / all;
            *merged = (all, mean, variance, least);
        }
        let (least, falls) = below_least(merged.map(|m| m.3));
        let weights: [f64; K] = std::array::from_fn(|j| merged[j].0 * falls[j]);
        let total: f64 = weights.iter().sum();
        product.multiply(total);
        sum -= least;
        states = std::array::from_fn(|j| (weights[j] / total, merged[j].1, merged[j].2));
        seen(states[0].0);
    }
    // The diffuse start integrates the mean out. Its prior density is put back, and the factor of sqrt(count) by which
    // that integral differs from the density of the coefficients k >= 1 of the orthonormal DCT.
    sum + product.ln() + 0.5 * (std::f64::consts::TAU * start * count as f64).ln()
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

/// Highest log likelihood over `levels`, and its place, from a start.
fn highest<const K: usize>(
    y: &[f64],
    start: &Coordinates,
    levels: &[f64; K],
    steps: usize,
) -> (f64, Coordinates) {
    let objective = |x: &[f64]| {
        let clamped = inside(x, y.len());
        let outside: f64 = x.iter().zip(&clamped).map(|(a, b)| (a - b).powi(2)).sum();
        outside - levels_likelihood(y, &clamped, levels)
    };
    let best = crate::optimise::nelder_mead(&objective, start, &[0.1, 2.0, 0.3, 0.7], steps);
    (-objective(&best), inside(&best, y.len()))
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
        highest(y, &[white.ln(), -12.0, log_half, dwell.ln()], &TWO, steps)
    };
    let all = starts.iter().map(from);
    let best = all.max_by(|a, b| a.0.total_cmp(&b.0));
    // A simplex that has shrunk too early goes on from where it is.
    best.map(|(_, x)| highest(y, &x, &TWO, steps))
        .unwrap_or((f64::NEG_INFINITY, [0.0; 4]))
}

/// The two levels fitted again, from where they were.
pub(crate) fn again(y: &[f64], x: &Coordinates) -> (f64, Coordinates) {
    highest(y, x, &TWO, 160)
}

/// Coefficient of a column beside the two levels, and the nats that it gains.
pub(crate) fn with_column(y: &[f64], x: &Coordinates, column: &[f64]) -> (f64, f64) {
    let without = highest(y, x, &TWO, 60);
    let less = |coefficient: f64| -> Vec<f64> {
        let parts = y.iter().zip(column);
        parts.map(|(v, c)| v - coefficient * c).collect()
    };
    // What the coefficient is in doubt by at least: the levels' own height.
    let half = (x[2] + 0.5 * x[0]).exp();
    let mut best = (0.0, without.0);
    for start in [-3.0, 3.0] {
        let objective = |p: &[f64]| {
            let clamped = inside(p, y.len());
            let outside: f64 = p.iter().zip(&clamped).map(|(a, b)| (a - b).powi(2)).sum();
            outside - levels_likelihood(&less(p[4] * half), &clamped, &TWO)
        };
        let [a, b, c, d] = without.1;
        let at = crate::optimise::nelder_mead(
            &objective,
            &[a, b, c, d, start],
            &[0.1, 2.0, 0.3, 0.7, 1.0],
            240,
        );
        let l = -objective(&at);
        if l > best.1 {
            best = (at[4] * half, l);
        }
    }
    (best.0, best.1 - without.0)
}

/// Nats that many levels are ahead of two, from where the two are at their best.
pub(crate) fn many_ahead(y: &[f64], two: &Coordinates) -> f64 {
    highest(y, two, &MANY, 60).0 - two_level(y, two)
}

/// Covariance of the coordinates at a highest point of `l`: the inverse of its curvature, all coordinates free. One that
/// the data do not bend, such as a random walk of nearly nothing, is held.
pub(crate) fn covariance_of(l: &dyn Fn(&Coordinates) -> f64, x: &Coordinates) -> Vec<Vec<f64>> {
    const H: f64 = 0.06;
    let at = |moves: &[(usize, f64)]| {
        let mut y = *x;
        for (i, by) in moves {
            y[*i] += by * H;
        }
        l(&y)
    };
    let middle = l(x);
    let second = |i: usize, j: usize| {
        if i == j {
            return (at(&[(i, 1.0)]) - 2.0 * middle + at(&[(i, -1.0)])) / (H * H);
        }
        (at(&[(i, 1.0), (j, 1.0)]) - at(&[(i, 1.0), (j, -1.0)]) - at(&[(i, -1.0), (j, 1.0)])
            + at(&[(i, -1.0), (j, -1.0)]))
            / (4.0 * H * H)
    };
    let count = x.len();
    let bends: Vec<bool> = (0..count).map(|i| second(i, i) < -0.05).collect();
    let information: Vec<Vec<f64>> = (0..count)
        .map(|i| {
            (0..count)
                .map(|j| match (i == j, bends[i] && bends[j]) {
                    (_, true) => -second(i.min(j), i.max(j)),
                    (true, false) => 1e12,
                    (false, false) => 0.0,
                })
                .collect()
        })
        .collect();
    crate::likelihood::invert(&information).0
}

/// Replicates of one side of a contest.
const REPLICATES: usize = 40;
/// Coordinates that both sides have: white noise, random walk, size and time of the one, and of the other.
const FITTED: f64 = 8.0;

/// One side of a contest.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Side {
    Gaussian,
    TwoLevels,
}

/// Both sides of a contest, fitted to the same block means.
pub(crate) struct Sides<'a> {
    pub dct: &'a Dct,
    pub bins: &'a Bins,
    /// The Gaussian one: noise and its white variance.
    pub noise: Noise,
    pub white: f64,
    pub two: Coordinates,
}

impl Sides<'_> {
    /// Nats that the two levels are ahead on block means, both as they were fitted.
    fn ahead(&self, y: &[f64], g: &[f64]) -> f64 {
        let gaussian: f64 = self.dct.forward(y)[1..]
            .iter()
            .zip(&g[1..])
            .map(|(c, g)| {
                let v = self.white * g;
                -0.5 * (c * c / v + (std::f64::consts::TAU * v).ln())
            })
            .sum();
        two_level(y, &self.two) - gaussian
    }

    /// Block means of the Gaussian side.
    fn gaussian(&self, g: &[f64], rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
        let mut c: Vec<f64> = g
            .iter()
            .map(|g| {
                let e: f64 = StandardNormal.sample(rng);
                e * (self.white * g).sqrt()
            })
            .collect();
        c[0] = 0.0;
        self.dct.inverse(&c)
    }

    /// Cox's test of separate families: standard errors between `ahead`, the nats by which two levels are better, and
    /// what it is where `truth` holds. Replicates are weighed with both sides as they were fitted; what the fits add is
    /// half a chi-square of the fitted coordinates.
    pub fn cox(&self, ahead: f64, truth: Side) -> f64 {
        let g = self.noise.everywhere(self.bins);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(0x7477_6f20_7369_6465);
        let all: Vec<f64> = (0..REPLICATES)
            .map(|_| {
                let y = match truth {
                    Side::Gaussian => self.gaussian(&g, &mut rng),
                    Side::TwoLevels => replicate(g.len(), &self.two, &mut rng),
                };
                self.ahead(&y, &g)
            })
            .collect();
        let n = all.len() as f64;
        let mean = all.iter().sum::<f64>() / n;
        let variance = all.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (ahead - mean) / (variance + 0.5 * FITTED).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use model::effect::{Covariance, Frequencies};

    use super::*;

    /// A process of variance exp(theta0) and correlation of exp(theta1) blocks.
    struct OnePole;

    impl Covariance for OnePole {
        fn dimensions(&self) -> usize {
            2
        }

        fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
            at.one_pole(theta[0].exp(), (-(-theta[1]).exp()).exp())
        }

        fn bounds(&self, _: usize) -> Vec<(f64, f64)> {
            vec![(-16.0, 6.0), (0.0, 8.0)]
        }

        fn starts(&self, _: usize) -> Vec<Vec<f64>> {
            vec![vec![0.0, 3.0]]
        }
    }

    #[test]
    fn replicates_tell_two_levels_from_a_gaussian_process_of_their_spectrum() {
        let m = 2000;
        let (dct, bins) = (Dct::new(m), Bins::new(m));
        // Two levels of 1 sigma that stay 40 blocks have this spectrum.
        let sides = Sides {
            dct: &dct,
            bins: &bins,
            noise: Noise {
                log_walk: f64::NEG_INFINITY,
                terms: vec![(Arc::new(OnePole), vec![0.0, 20f64.ln()])],
            },
            white: 1.0,
            two: [0.0, -25.0, 0.0, 40f64.ln()],
        };
        let g = sides.noise.everywhere(&bins);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        let scores = |y: &[f64]| {
            let ahead = sides.ahead(y, &g);
            [Side::Gaussian, Side::TwoLevels].map(|s| sides.cox(ahead, s))
        };
        // What holds stays within a few errors; what does not lies, on average, where its claim fails.
        let (runs, fails) = (5, 3.3);
        let (mut as_two, mut as_gaussian) = (0.0, 0.0);
        for _ in 0..runs {
            let [gaussian, two] = scores(&sides.gaussian(&g, &mut rng));
            assert!(gaussian.abs() < 3.5, "{gaussian}");
            as_two += two / f64::from(runs);
            let [gaussian, two] = scores(&replicate(m, &sides.two, &mut rng));
            assert!(two.abs() < 3.5, "{two}");
            as_gaussian += gaussian / f64::from(runs);
        }
        assert!(
            as_two < -fails && as_gaussian > fails,
            "{as_two} {as_gaussian}"
        );
    }
}
