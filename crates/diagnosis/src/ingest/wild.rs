//! Wild readings that are no farther off than the noise reaches now and then, but too many.
//!
//! The limit for a single reading is one that noise passes once in 10^5 records. Of forty readings six standard deviations off
//! half stay below it, and make tails of what is left. How far off they have to be is told by all of them together: so far
//! that a fiftieth of them at most is noise (Benjamini and Hochberg, 1995, J. R. Stat. Soc. B 57: 289-300). Whether they are
//! wild readings in normal noise, or the tails of another one, is told by likelihood: a normal law beside a group of its
//! own, away from it, against Student's law and against a mixture of two normal laws.

use std::sync::Arc;

use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use statrs::function::gamma::ln_gamma;

use crate::fit::likelihood::{Noise, Panel};
use crate::ingest::spikes::without_lines;
use crate::ingest::types::Grid;
use crate::ingest::{fill, kalman};
use crate::test_level::OMNIBUS_LEVEL;
use numerics::tails;

/// Share of the readings set aside that may be noise.
const NOISE: f64 = 0.02;
/// Nats by which wild readings in normal noise have to be ahead of a noise with tails: one for each parameter more.
const AHEAD: f64 = 2.0;
/// Least distance, standard deviations, that is asked.
const LEAST: f64 = 3.5;
/// Width of a cell of the histogram, standard deviations, and where it ends.
const CELL: f64 = 0.05;
const END: f64 = 40.0;
/// Degrees of freedom of Student's laws that are tried.
const DEGREES: [f64; 10] = [2.0, 3.0, 4.0, 5.0, 7.0, 10.0, 15.0, 25.0, 50.0, 100.0];
/// Rounds of a fit.
const ROUNDS: usize = 30;

/// The distance from which on readings are too many to be noise, where there are such: `far` are the sizes beyond [`LEAST`]
/// of `n` readings, the largest first.
fn limit(far: &[f64], n: usize) -> Option<f64> {
    let expected = |z: f64| n as f64 * tails::two_sided(z);
    let tried = far.len().max(1) as f64;
    let (mut certain, mut last) = (false, None);
    for (i, z) in far.iter().enumerate() {
        let count = i + 1;
        certain |= tried * tails::at_least(count as u64, expected(*z)) < OMNIBUS_LEVEL;
        if expected(*z) <= NOISE * count as f64 {
            last = Some(*z);
        }
    }
    last.filter(|_| certain)
}

/// Sizes beyond [`LEAST`], the largest first.
fn far(sizes: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all: Vec<f64> = sizes.map(f64::abs).filter(|z| *z > LEAST).collect();
    all.sort_by(|a, b| b.total_cmp(a));
    all
}

/// Cells of a histogram of sizes: middle, count.
fn histogram(sizes: impl Iterator<Item = f64>) -> Vec<(f64, f64)> {
    let mut counts = vec![0.0; (END / CELL) as usize + 1];
    for z in sizes {
        let cell = (z.abs().min(END) / CELL) as usize;
        counts[cell] += 1.0;
    }
    let cells = counts.into_iter().enumerate();
    cells
        .filter(|(_, count)| *count > 0.0)
        .map(|(i, count)| ((i as f64 + 0.5) * CELL, count))
        .collect()
}

/// ln of the normal density of this variance, but for ln (2 pi) / 2.
fn normal(x: f64, variance: f64) -> f64 {
    -0.5 * (variance.ln() + x * x / variance)
}

fn sum(cells: &[(f64, f64)], of: impl Fn(f64) -> f64) -> f64 {
    cells.iter().map(|(x, count)| count * of(*x)).sum()
}

/// Log likelihood of a normal law of which those beyond `limit` are none: they have a law about a middle of their own.
fn with_wild(cells: &[(f64, f64)], limit: f64) -> f64 {
    let (wild, tame): (Vec<_>, Vec<_>) = cells.iter().copied().partition(|c| c.0 >= limit);
    let count = |part: &[(f64, f64)]| sum(part, |_| 1.0);
    let (few, most) = (count(&wild), count(&tame));
    if few == 0.0 || most == 0.0 {
        return f64::NEG_INFINITY;
    }
    let variance = sum(&tame, |x| x * x) / most;
    let middle = sum(&wild, |x| x) / few;
    // Each has the noise on it.
    let spread = (sum(&wild, |x| (x - middle).powi(2)) / few).max(variance);
    let share = few / (few + most);
    // Half of them lie on either side.
    let own = |x: f64| share.ln() - 2f64.ln() + normal(x - middle, spread);
    sum(&tame, |x| (1.0 - share).ln() + normal(x, variance)) + sum(&wild, own)
}

/// The same of a mixture of two normal laws.
fn of_mixture(cells: &[(f64, f64)]) -> f64 {
    let all = sum(cells, |_| 1.0);
    let variance = sum(cells, |x| x * x) / all;
    let (mut share, mut near, mut wide) = (0.05f64, 0.8 * variance, 4.0 * variance);
    let mut likelihood = f64::NEG_INFINITY;
    for _ in 0..ROUNDS {
        let both = |x: f64| {
            let a = (1.0 - share).ln() + normal(x, near);
            let b = share.ln() + normal(x, wide);
            let top = a.max(b);
            let mixed = top + ((a - top).exp() + (b - top).exp()).ln();
            (mixed, (b - mixed).exp())
        };
        likelihood = sum(cells, |x| both(x).0);
        let outer = sum(cells, |x| both(x).1);
        let square = sum(cells, |x| x * x * both(x).1);
        let total = sum(cells, |x| x * x);
        if outer < 1e-9 || all - outer < 1e-9 {
            break;
        }
        (share, near, wide) = (
            outer / all,
            (total - square) / (all - outer),
            square / outer,
        );
    }
    likelihood
}

/// The same of Student's law with these degrees of freedom.
fn of_student(cells: &[(f64, f64)], degrees: f64) -> f64 {
    let all = sum(cells, |_| 1.0);
    let mut scale = 1.0;
    for _ in 0..ROUNDS {
        let weighed = |x: f64| x * x * (degrees + 1.0) / (degrees + x * x / scale);
        scale = sum(cells, weighed) / all;
    }
    let constant =
        ln_gamma(0.5 * (degrees + 1.0)) - ln_gamma(0.5 * degrees) - 0.5 * (0.5 * degrees).ln();
    let density = |x: f64| {
        constant
            - 0.5 * f64::ln(scale)
            - 0.5 * (degrees + 1.0) * (x * x / (degrees * scale)).ln_1p()
    };
    sum(cells, density)
}

/// The same of the best of Student's laws.
fn of_any_student(cells: &[(f64, f64)]) -> f64 {
    let all = DEGREES.iter().map(|d| of_student(cells, *d));
    all.fold(f64::NEG_INFINITY, f64::max)
}

/// Whether readings beyond `limit` are wild ones in normal noise.
fn stand_apart(cells: &[(f64, f64)], limit: f64) -> bool {
    let rival = of_any_student(cells).max(of_mixture(cells));
    with_wild(cells, limit) > rival + AHEAD
}

/// Whether readings beyond `limit` are the tails of the noise that all of them have: `sizes` in standard deviations.
pub(crate) fn are_tails(sizes: impl Iterator<Item = f64>, limit: f64) -> bool {
    let cells = histogram(sizes);
    of_any_student(&cells) > with_wild(&cells, limit).max(of_mixture(&cells)) + AHEAD
}

/// Distance from which on readings are wild in normal noise, where there are some nearer than a single one would have to be.
/// `e` are whitened residuals but at the places that are `known` to be wild, whose sizes stand there.
pub(crate) fn found(e: &[f64], known: &[f64], single: f64) -> Option<f64> {
    let sizes = || e.iter().chain(known).copied();
    let limit = limit(&far(sizes()), e.len()).filter(|l| *l < single)?;
    let nearer = e.iter().any(|z| z.abs() >= limit && z.abs() <= single);
    (nearer && stand_apart(&histogram(sizes()), limit)).then_some(limit)
}

/// Whether there may be some on a channel, by what white noise and a random walk leave of it.
pub(crate) fn suspected(grid: &Grid, channel: usize) -> bool {
    let target = &grid.targets[channel];
    let g = target.noise.everywhere(&grid.bins);
    let e = without_lines(&target.coefficients, &g, target.white, &grid.dct);
    let own = far(e.iter().copied());
    limit(&own, grid.n).is_some()
}

/// Sets readings of a channel aside as wild, from a distance of `limit` on, and fills their places.
pub(crate) fn set_aside(grid: &mut Grid, channel: usize, places: &[usize], limit: f64) {
    let target = &mut grid.targets[channel];
    let y = (*target.y).clone();
    target.aside.extend(places.iter().map(|i| (*i, y[*i])));
    target.spikes.extend_from_slice(places);
    target.spikes.sort_unstable();
    target.lost.extend_from_slice(places);
    target.wild_from = Some(limit);
    filled_again(grid, channel, y);
}

/// Gives back readings of a channel that were set aside, and are explained by what was found.
pub(crate) fn give_back(grid: &mut Grid, channel: usize, places: &[usize]) {
    let target = &mut grid.targets[channel];
    let mut y = (*target.y).clone();
    let back = |i: &usize| places.contains(i);
    for (at, read) in target.aside.extract_if(.., |a| back(&a.0)) {
        y[at] = read;
        if !target.spikes.contains(&at) {
            target.explained.push(at);
        }
    }
    target.spikes.retain(|i| !back(i));
    target.lost.retain(|i| !back(i));
    filled_again(grid, channel, y);
}

/// The readings of a channel, the lost ones among them filled anew, and its noise as it is first fitted.
fn filled_again(grid: &mut Grid, channel: usize, mut y: Vec<f64>) {
    let (dct, bins) = (&grid.dct, &grid.bins);
    let target = &mut grid.targets[channel];
    target.lost.iter().for_each(|i| y[*i] = f64::NAN);
    let mut y = target.jumps.levelled(&y);
    let (noise, white) =
        (target.jumps.fit.as_ref()).map_or((&target.noise, target.white), |f| (&f.0, f.1));
    let step = white * noise.log_walk.exp();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(target.lost.len() as u64 ^ 0x7769_6c64);
    kalman::fill(&mut y, white, step, &mut rng);
    let panel = Panel::new(dct, bins, &y);
    let (noise, solution) = panel.fit(&Noise::new(-12.0), &[]);
    let mut fit = (noise, solution.white);
    target.coefficients = fill::first(&target.name, panel, &mut y, &target.lost, &mut fit);
    if !target.jumps.is_empty() {
        target.coefficients = target.jumps.put_back(&mut y, &mut fit, (dct, bins));
    }
    (target.noise, target.white) = fit;
    target.y = Arc::new(y);
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StudentT};

    use super::*;

    /// What a single reading of 12 000 has to pass.
    const SINGLE: f64 = 6.1;

    fn noise(seed: u64) -> Vec<f64> {
        crate::fit::white(12_000, seed)
    }

    #[test]
    fn wild_readings_of_five_and_a_half_sigma_are_told_where_they_are_many() {
        for (seed, count) in [(1, 6), (2, 12), (3, 40)] {
            let mut e = noise(seed);
            for k in 0..count {
                e[100 + 277 * k] += if k % 2 == 0 { 5.5 } else { -5.5 };
            }
            let limit = found(&e, &[], SINGLE).expect("they are told");
            let told = e.iter().filter(|z| z.abs() >= limit).count();
            assert!(told + 2 >= count && told <= count + 2, "{told} of {count}");
        }
    }

    #[test]
    fn tails_are_no_wild_readings_and_normal_noise_has_none() {
        for degrees in [3.0, 5.0, 8.0] {
            let law = StudentT::new(degrees).expect("degrees");
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
            let e: Vec<f64> = (0..12_000).map(|_| law.sample(&mut rng)).collect();
            let white = (e.iter().map(|z| z * z).sum::<f64>() / 12_000.0).sqrt();
            let e: Vec<f64> = e.iter().map(|z| z / white).collect();
            assert_eq!(found(&e, &[], SINGLE), None, "{degrees}");
        }
        assert!((10..40).all(|seed| found(&noise(seed), &[], SINGLE).is_none()));
    }
}
