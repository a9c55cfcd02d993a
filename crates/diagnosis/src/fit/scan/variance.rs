//! Laws of the variance of unit-variance residuals: a stretch, or what follows a shape.

use model::effect::extremes;

use crate::fit::threshold;

/// Levels that the shape of a variance is divided into.
const LEVELS: usize = 4096;

/// Blocks by which a stretch of another variance is sought among so many readings.
fn blocks_of(readings: usize) -> usize {
    240.min(readings / 8).max(2)
}

/// A stretch of larger (or smaller) variance of unit-variance residuals: (LR, start, end, increase).
#[must_use]
pub fn segment(u: &[f64]) -> (f64, usize, usize, f64) {
    let blocks = blocks_of(u.len());
    let edge = |b: usize| b * u.len() / blocks;
    let mut sums = vec![0.0];
    for b in 0..blocks {
        let s: f64 = u[edge(b)..edge(b + 1)].iter().map(|v| v * v).sum();
        sums.push(sums[b] + s);
    }
    let (n, total) = (u.len() as f64, sums[blocks]);
    let mut best = (0.0, 0, 0, 0.0);
    for i in 0..blocks {
        for j in i + 1..=blocks {
            let inside_n = (edge(j) - edge(i)) as f64;
            let outside_n = n - inside_n;
            if outside_n < n / 50.0 || inside_n < n / 100.0 {
                continue;
            }
            let (inside, outside) = (sums[j] - sums[i], total - (sums[j] - sums[i]));
            let lr = n * (total / n).ln()
                - inside_n * (inside / inside_n).ln()
                - outside_n * (outside / outside_n).ln();
            if lr > best.0 {
                best = (
                    lr,
                    edge(i),
                    edge(j),
                    inside / inside_n / (outside / outside_n) - 1.0,
                );
            }
        }
    }
    best
}

/// Variance over that outside from which on a stretch is loud, or one over that: of noise that is the same throughout the spectrum is
/// known by so many readings; of a short loud part by no more than it has.
pub(crate) const LOUD: f64 = 4.0;

/// Nats that unit-variance residuals gain by a loud, or quiet, stretch; 0 where there is none.
#[must_use]
pub fn of_a_stretch(u: &[f64]) -> f64 {
    let (lr, _, _, increase) = segment(u);
    let ratio = 1.0 + increase;
    if ratio.max(ratio.recip()) < LOUD {
        return 0.0;
    }
    (0.5 * (lr - threshold::segment())).max(0.0)
}

/// Rounds in which the ends of a stretch are settled.
const ROUNDS: usize = 3;

/// A stretch that was found between blocks, start, end and increase, to a reading where these tell its ends better than blocks do: of
/// readings that are many times as loud, those of half a block beside it would be the largest that are left.
#[must_use]
pub fn to_a_reading(u: &[f64], (start, end, increase): (usize, usize, f64)) -> (usize, usize, f64) {
    let block = u.len() as f64 / blocks_of(u.len()) as f64;
    let mean = |part: &mut dyn Iterator<Item = &f64>| {
        let (sum, count) = part.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
        sum / f64::max(count, 1.0)
    };
    let mut told = (start, end, increase);
    for _ in 0..ROUNDS {
        let (first, last) = ends(u, told.0, told.1, told.2);
        let settled = |(at, error): (f64, f64), before: usize| {
            if error < 0.25 * block {
                at.round() as usize
            } else {
                before
            }
        };
        let (start, end) = (settled(first, told.0), settled(last, told.1).min(u.len()));
        if end <= start {
            return told;
        }
        let inside = mean(&mut u[start..end].iter());
        let outside = mean(&mut u[..start].iter().chain(&u[end..]));
        if (start, end) == (told.0, told.1) || outside <= 0.0 {
            return told;
        }
        told = (start, end, inside / outside - 1.0);
    }
    told
}

/// Start and end of a stretch of other variance, in samples, with their standard errors: each one averaged over all
/// samples by its likelihood, the other one and the sizes held.
#[must_use]
pub fn ends(u: &[f64], start: usize, end: usize, increase: f64) -> ((f64, f64), (f64, f64)) {
    let outside: Vec<f64> = u[..start].iter().chain(&u[end..]).map(|v| v * v).collect();
    let variance = outside.iter().sum::<f64>() / outside.len().max(1) as f64;
    let inside = variance * (1.0 + increase);
    // What a sample says for being inside.
    let says: Vec<f64> = u
        .iter()
        .map(|v| 0.5 * ((variance / inside).ln() + v * v * (1.0 / variance - 1.0 / inside)))
        .collect();
    let weigh = |places: std::ops::Range<usize>, logs: &[f64]| {
        let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (mut sum, mut mean, mut square) = (0.0, 0.0, 0.0);
        // Less than that has no weight in any number.
        for (i, l) in places.zip(logs).filter(|(_, l)| **l - top > -746.0) {
            let w = (l - top).exp();
            sum += w;
            mean += w * i as f64;
            square += w * (i * i) as f64;
        }
        mean /= sum;
        // A place between samples cannot be told.
        (mean, (square / sum - mean * mean).max(1.0 / 12.0).sqrt())
    };
    let mut logs: Vec<f64> = says[..end]
        .iter()
        .rev()
        .scan(0.0, |sum, v| {
            *sum += v;
            Some(*sum)
        })
        .collect();
    logs.reverse();
    let first = weigh(0..end, &logs);
    let logs: Vec<f64> = says[start..]
        .iter()
        .scan(0.0, |sum, v| {
            *sum += v;
            Some(*sum)
        })
        .collect();
    let last = weigh(start + 1..u.len() + 1, &logs);
    (first, last)
}

fn top_of(shape: &[f64]) -> f64 {
    extremes(shape)[1].max(1e-9)
}

/// Samples of nearly the same shape have nearly the same variance: their count, and the sums of their shapes and squares,
/// stand for them.
pub(crate) fn levels(u: &[f64], shape: &[f64]) -> Vec<(f64, f64, f64)> {
    let [low, high] = extremes(shape);
    let top = high.max(1e-9);
    let bottom = low.min(top);
    let per_level = (LEVELS - 1) as f64 / (top - bottom).max(f64::MIN_POSITIVE);
    let mut levels = vec![(0.0, 0.0, 0.0); LEVELS];
    // Most shapes stay at a level for a while: its sums are put away when they leave it.
    let mut here = (0, levels[0]);
    for (u, d) in u.iter().zip(shape) {
        let at = ((d - bottom) * per_level) as usize;
        if at != here.0 {
            levels[here.0] = here.1;
            here = (at, levels[at]);
        }
        let (count, sum, squares) = &mut here.1;
        *count += 1.0;
        *sum += d;
        *squares += u * u;
    }
    levels[here.0] = here.1;
    levels.retain(|l| l.0 > 0.0);
    levels
}

/// Likelihood of variance 1 + gamma x shape, its scale profiled: (LR, gamma, standard error).
#[must_use]
pub fn variance_law(u: &[f64], shape: &[f64]) -> (f64, f64, f64) {
    let top = top_of(shape);
    let n = u.len() as f64;
    let levels = levels(u, shape);
    let minus_l = |x: f64| {
        let gamma = (x.exp() - 1.0) / top;
        let (mut scaled, mut logs) = (0.0, 0.0);
        for (count, sum, squares) in &levels {
            let v = 1.0 + gamma * sum / count;
            scaled += squares / v;
            logs += count * v.ln();
        }
        0.5 * (n * (scaled / n).ln() + logs)
    };
    let x = numerics::minimise::golden(&minus_l, -2.0, 3.0, 24);
    let h = 0.02;
    let curvature = (minus_l(x + h) - 2.0 * minus_l(x) + minus_l(x - h)) / (h * h);
    let gamma = (x.exp() - 1.0) / top;
    (
        2.0 * (minus_l(0.0) - minus_l(x)),
        gamma,
        x.exp() / top / curvature.max(1e-12).sqrt(),
    )
}
