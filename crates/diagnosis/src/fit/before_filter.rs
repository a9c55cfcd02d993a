//! How sure the noise before a filter is.

use crate::fit::channel::State;
use crate::fit::estimate::noise_covariance;
use crate::fit::likelihood::{Noise, Panel};

/// Standard error of ln of the white variance before the filter of a state, which passes the slowest as it is; beside that of the
/// white variance itself, with which it has nothing in common.
pub(crate) fn error(panel: &Panel, state: &State) -> f64 {
    // Step of a numerical derivative, and a frequency at which the shape of the walk is a number, rad per sample.
    const STEP: f64 = 1e-3;
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
