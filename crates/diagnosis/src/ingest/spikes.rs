//! Single readings that the noise of a first fit cannot have made.

use std::sync::Arc;

use rand_xoshiro::Xoshiro256PlusPlus;

use crate::fit::likelihood::{Bins, Dct, Noise, Panel};
use crate::ingest::kalman;
use numerics::order_statistics::{median, robust_sigma};
use numerics::tails;

/// Fewest readings that tell how loud it is about them, and how many such stretches a record has at most.
const LEAST_STRETCH: usize = 100;
const MOST_STRETCHES: usize = 240;
/// Spread over that of the channel from which on a stretch is loud: six standard errors of the shortest one.
const LOUD: f64 = 1.5;

/// How loud it is about each reading: the spread there over that of the channel where it is clearly more. Single readings do not
/// move it.
fn loudness(e: &[f64], given: &[f64], least: usize) -> Vec<f64> {
    let length = LEAST_STRETCH.max(least).max(e.len() / MOST_STRETCHES);
    let spread = |range: std::ops::Range<usize>| {
        let known = range.filter(|i| given[*i].is_finite());
        let sizes: Vec<f64> = known.map(|i| e[i].abs()).collect();
        if sizes.len() < LEAST_STRETCH {
            return 1.0;
        }
        median(&sizes) / tails::MEDIAN.sqrt()
    };
    let starts = (0..e.len()).step_by(length);
    let spreads: Vec<f64> = starts
        .map(|i| spread(i..(i + length).min(e.len())))
        .collect();
    // It may begin or end anywhere in the next one.
    let about = |b: usize| {
        let near = &spreads[b.saturating_sub(1)..(b + 2).min(spreads.len())];
        near.iter().copied().fold(0.0, f64::max)
    };
    let all: Vec<f64> = (0..spreads.len())
        .map(about)
        .map(|s| if s > LOUD { s } else { 1.0 })
        .collect();
    (0..e.len()).map(|i| all[i / length]).collect()
}

/// What white noise and a random walk of that density, over `white`, leave of readings, in standard deviations of what is not the work
/// of lines. A line takes a few coefficients, which no noise makes so large; a single reading takes a little of each. A strong line
/// would hide it behind its own swing.
pub(crate) fn without_lines(
    coefficients: &[f64],
    density: &[f64],
    white: f64,
    dct: &Dct,
) -> Vec<f64> {
    let each = coefficients.iter().zip(density);
    let mut c: Vec<f64> = each.map(|(c, g)| c / (white * g).sqrt()).collect();
    let limit = spike_limit(c.len()) * robust_sigma(&c);
    let rest = c.iter().filter(|v| v.abs() <= limit);
    let (count, square) = rest.fold((0.0, 0.0), |(n, sum), v| (n + 1.0, sum + v * v));
    if count < c.len() as f64 && square > 0.0 {
        let sigma = f64::sqrt(square / count);
        let cleared = |v: &mut f64| *v = if v.abs() > limit { 0.0 } else { *v / sigma };
        c.iter_mut().for_each(cleared);
    }
    dct.inverse(&c)
}

/// Take out single samples that the noise cannot have made, and fill their places; largest first, since each one
/// widens the noise that the others are held against. What is loud for longer than `least` readings has no singles for that.
pub(super) fn spikes(
    (given, least): (&[f64], usize),
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
        let e = without_lines(coefficients, &fit.0.everywhere(bins), fit.1, dct);
        let loud = loudness(&e, given, least);
        let beyond = |limit: f64| {
            (0..n)
                .filter(|i| e[*i].abs() > limit * loud[*i] && given[*i].is_finite())
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
    let tail =
        |z: f64| (n as f64 * tails::normal_tail(z)).ln() - crate::test_level::omnibus_level().ln();
    numerics::minimise::golden(&|z| tail(z).abs(), 4.0, 12.0, 40)
}
