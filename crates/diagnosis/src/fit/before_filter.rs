//! How sure the white noise is beside what else a state has, and before a filter.

use crate::fit::channel::State;
use crate::fit::estimate::noise_covariance;
use crate::fit::likelihood::{Noise, Panel};
use numerics::column::dot;

/// Step of a numerical derivative.
const STEP: f64 = 1e-3;
/// Part of what tells the white variance that is left beside the others, below which nothing of it is.
const LEAST_OWN: f64 = 1e-8;

/// Standard error of ln of the white variance of a state, of which each other size and shape is free: of white noise under what
/// covers the spectrum nothing is known.
pub(crate) fn of_white(panel: &Panel, state: &State) -> f64 {
    let (bins, counts) = (&panel.bins, panel.bins.counts());
    let here = state.noise.over(bins);
    let weighted = |relative: &mut dyn Iterator<Item = f64>| -> Vec<f64> {
        let each = counts.iter().zip(relative);
        each.map(|(m, v)| (0.5 * m).sqrt() * v).collect()
    };
    let slope = |moved: &Noise| {
        let there = moved.over(bins);
        let mut all = there.iter().zip(&here).map(|(a, b)| (a / b).ln() / STEP);
        weighted(&mut all)
    };
    let mut others = vec![];
    let mut moved = state.noise.clone();
    moved.log_walk += STEP;
    others.push(slope(&moved));
    for (k, (_, theta)) in state.noise.terms.iter().enumerate() {
        for i in 0..theta.len() {
            let mut moved = state.noise.clone();
            moved.terms[k].1[i] += STEP;
            others.push(slope(&moved));
        }
    }
    let mut white = weighted(&mut here.iter().map(|g| g.recip()));
    let all = dot(&white, &white);
    let mut beside: Vec<Vec<f64>> = vec![];
    for mut own in others {
        let before = dot(&own, &own);
        for other in &beside {
            take(&mut own, other);
        }
        let left = dot(&own, &own);
        if left > LEAST_OWN * before {
            own.iter_mut().for_each(|v| *v /= left.sqrt());
            take(&mut white, &own);
            beside.push(own);
        }
    }
    let known = dot(&white, &white).max(LEAST_OWN * all);
    known.sqrt().recip() * state.wider.first().unwrap_or(&1.0)
}

/// Takes the part along a unit vector out of a vector.
fn take(of: &mut [f64], along: &[f64]) {
    let by = dot(of, along);
    of.iter_mut().zip(along).for_each(|(v, a)| *v -= by * a);
}

/// Half the width of a 95 % interval, in standard errors.
pub(crate) const HALF_WIDTH: f64 = 1.96;

/// Standard error of the root of a size that cannot be negative, out of that of the size: where the interval of that reaches 0, so
/// does its own, and its upper end is the root of the upper end.
pub(crate) fn error_of_root(size: f64, error: f64) -> f64 {
    let root = size.sqrt();
    if HALF_WIDTH * error < size {
        return 0.5 * error / root;
    }
    let upper = (size + HALF_WIDTH * error).sqrt();
    (upper - root).max(root * (1.0 + f64::EPSILON)) / HALF_WIDTH
}

/// The other way: the standard error of a size, out of that of its root.
pub(crate) fn error_of_square(root: f64, error: f64) -> f64 {
    if HALF_WIDTH * error <= 0.5 * root {
        return 2.0 * root * error;
    }
    ((root + HALF_WIDTH * error).powi(2) - root * root) / HALF_WIDTH
}

/// Standard error of ln of the white variance before the filter of a state, which passes the slowest as it is; beside that of the
/// white variance itself, with which it has nothing in common.
pub(crate) fn error(panel: &Panel, state: &State) -> f64 {
    // A frequency at which the shape of the walk is a number, rad per sample.
    const SLOWEST: f64 = 1e-6;
    if state.noise.filter().is_none() {
        return 0.0;
    }
    let (bins, counts) = (&panel.bins, panel.bins.counts());
    // At the best white variance its logarithm goes down by the mean of what ln g goes up.
    let of = |noise: &Noise| -> f64 {
        let slowest = noise.filter().map_or(1.0, |filter| filter.at(SLOWEST));
        let logs = noise
            .over(bins)
            .iter()
            .zip(counts)
            .map(|(g, m)| m * g.ln())
            .sum::<f64>();
        slowest.ln() - logs / counts.iter().sum::<f64>()
    };
    let here = of(&state.noise);
    let mut slopes = vec![];
    let mut moved = state.noise.clone();
    moved.log_walk += STEP;
    slopes.push((of(&moved) - here) / STEP);
    for (k, (_, theta)) in state.noise.terms.iter().enumerate() {
        for i in 0..theta.len() {
            let mut moved = state.noise.clone();
            moved.terms[k].1[i] += STEP;
            slopes.push((of(&moved) - here) / STEP);
        }
    }
    let covariance = noise_covariance(panel, state);
    let variance = slopes.iter().zip(&covariance).map(|(a, row)| {
        let by = row.iter().zip(&slopes).map(|(v, b)| v * b);
        a * by.sum::<f64>()
    });
    variance.sum::<f64>().max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_root_has_the_interval_of_its_square() {
        for (size, error) in [(4.0, 0.1), (1.0, 0.3), (1.0, 2.0), (0.0, 0.5), (1e-9, 1.0)] {
            let root: f64 = f64::sqrt(size);
            let own = error_of_root(size, error);
            let wanted = f64::sqrt(size + HALF_WIDTH * error);
            let reaches = root < HALF_WIDTH * own;
            assert_eq!(reaches, size < HALF_WIDTH * error, "{size} {error}");
            assert!(root + HALF_WIDTH * own > 0.97 * wanted, "{size} {error}");
            let back = error_of_square(root, own);
            assert!(
                (0.99 * error..3.0 * error).contains(&back),
                "{size} {error}: {back}"
            );
        }
    }
}
