//! Single readings that the noise of a first fit cannot have made.

use std::sync::Arc;

use rand_xoshiro::Xoshiro256PlusPlus;

use crate::fit::likelihood::{Bins, Dct, Noise, Panel};
use crate::ingest::kalman;

/// Take out single samples that the noise cannot have made, and fill their places; largest first, since each one
/// widens the noise that the others are held against.
pub(super) fn spikes(
    given: &[f64],
    y: &mut Vec<f64>,
    coefficients: &mut Arc<Vec<f64>>,
    fit: &mut (Noise, f64),
    dct: &Dct,
    bins: &Arc<Bins>,
    rng: &mut Xoshiro256PlusPlus,
) -> Vec<usize> {
    const PASSES: usize = 8;
    let n = y.len();
    let mut found: Vec<usize> = vec![];
    for _ in 0..PASSES {
        let g = fit.0.everywhere(bins);
        let c: Vec<f64> = coefficients
            .iter()
            .zip(&g)
            .map(|(c, g)| c / (fit.1 * g).sqrt())
            .collect();
        let e = dct.inverse(&c);
        let beyond = |limit: f64| {
            (0..n)
                .filter(|i| e[*i].abs() > limit && given[*i].is_finite())
                .collect::<Vec<_>>()
        };
        let fresh: Vec<usize> = beyond(spike_limit(n))
            .into_iter()
            .filter(|i| !found.contains(i))
            .collect();
        if fresh.is_empty() {
            break;
        }
        found.extend(fresh);
        let mut rest = given.to_vec();
        for i in &found {
            rest[*i] = f64::NAN;
        }
        kalman::fill(&mut rest, fit.1, fit.1 * fit.0.log_walk.exp(), rng);
        let panel = Panel::new(dct, bins, &rest);
        let (noise, solution) = panel.fit(&Noise::new(-12.0), &[]);
        *fit = (noise, solution.white);
        (*y, *coefficients) = (rest, panel.column(0));
    }
    found.sort_unstable();
    found
}

/// Distance in sigma that one of `n` samples reaches once in 10^5 records.
pub(crate) fn spike_limit(n: usize) -> f64 {
    let tail = |z: f64| {
        (n as f64 * numerics::tails::normal_tail(z)).ln() - crate::test_level::omnibus_level().ln()
    };
    numerics::minimise::golden(&|z| tail(z).abs(), 4.0, 12.0, 40)
}
