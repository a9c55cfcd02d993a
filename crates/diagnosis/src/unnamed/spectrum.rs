//! The spectrum of what is left of a channel: bumps beside the noise of its causes.
//!
//! The energies of the residual over bins of coefficients are independent multiples of chi-squares. Their mean is a sum of
//! densities: white noise, through the filter where there is one, and random walk, both free in size; the processes that have a
//! name, as they are; and bumps of a fixed list, of which those enter one by one that take up most.

use std::f64::consts::PI;
use std::sync::Arc;

use model::effect::{Covariance, Hypothesis};

use super::bump::{Bump, lorentzian, places};
use super::sizes::{Fit, LEAST_SCORE};
use crate::fit::channel::{Form, Term};
use crate::fit::likelihood::{Bins, Noise};
use crate::search::searched::Searched;

/// Most bumps of a channel.
const MOST: usize = 16;
/// Widths of its bands to either side in which a tone is sought, most places there, and least share of its time in one.
const REACH: f64 = 3.0;
const MOST_PITCHES: f64 = 64.0;
const LEAST_SHARE: f64 = 1e-3;
/// Largest part of the white variance that is taken for rounding, and largest correlation before it.
const MOST_ROUNDING: f64 = 0.5;
const MOST_CORRELATED: f64 = 0.999;
/// Variance of a bump over the white one below which it is none.
const LEAST_PART: f64 = 1e-9;
/// Rounds of the fit of the places that a tone visits.
const ROUNDS: usize = 600;

/// What describes the noise of a channel better than its causes do.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Spectrum {
    /// What is added.
    pub bumps: Vec<Bump>,
    /// White variance beside it, over that without it.
    pub white: f64,
    /// Standard error of that, of all that was fitted along with it.
    pub white_error: f64,
    /// Variance of a step of the random walk beside it, over that without it.
    pub walk: f64,
    /// Tones whose band has the shape of several, and these.
    pub tones: Vec<(&'static str, Vec<Bump>)>,
    /// Density over the bins, over the white variance of the causes' model.
    pub density: Vec<f64>,
}

/// Bands of a channel that overlap and that a model has as one.
pub(super) struct AsOne {
    /// The effect.
    pub id: &'static str,
    parts: Vec<Bump>,
    /// Density of them in the model over the bins, over the white variance.
    density: Vec<f64>,
}

/// Tones of a channel that a model has as one Lorentzian, and of which at least so many bands were found. A tone that wanders
/// by few cells of the spectrum has not that shape, whose far tails then decide on its size.
pub(super) fn as_one(s: &Searched<'_>, least: usize) -> Vec<AsOne> {
    let terms = &s.state.terms;
    let tone = |t: &&Term| {
        let hypothesis = &s.search.candidates[t.candidate].hypothesis;
        // One whose phase was tracked has the shape that its law says.
        t.path.is_none() && !matches!(hypothesis, Hypothesis::Covariance(_))
    };
    let first = |t: &&Term| t.cluster.is_some_and(|c| c.place == 0);
    let all = terms.iter().filter(first).filter(tone).map(|t| {
        let number = t.cluster.map(|c| c.number);
        let own = terms
            .iter()
            .filter(|o| o.cluster.map(|c| c.number) == number);
        let bins = &s.search.panel.bins;
        let mut one = AsOne {
            id: t.effect.id(),
            parts: vec![],
            density: vec![0.0; bins.at.omega.len()],
        };
        for part in own {
            one.parts.extend(part.peak().map(Bump::from));
            if let Form::Covariance(process, theta) = &part.form {
                let each = one.density.iter_mut().zip(process.density(theta, &bins.at));
                each.for_each(|(sum, d)| *sum += d);
            }
        }
        one
    });
    all.filter(|one| one.parts.len() >= least).collect()
}

/// The pitches that a tone visits: a comb over its band, which has the shape of any band and no tails of its own.
fn pitches(parts: &[Bump]) -> Vec<Bump> {
    let edge = |side: f64, p: &Bump| (p.center + side * REACH * p.width).clamp(0.0, PI);
    let low = parts.iter().map(|p| edge(-1.0, p)).fold(PI, f64::min);
    let high = parts.iter().map(|p| edge(1.0, p)).fold(0.0, f64::max);
    let finest = parts.iter().map(|p| p.width).fold(PI, f64::min);
    let count = ((high - low) / (0.5 * finest))
        .ceil()
        .clamp(1.0, MOST_PITCHES);
    let apart = (high - low) / count;
    let variance: f64 = parts.iter().map(|p| p.variance).sum();
    let center = |k: usize| low + (k as f64 + 0.5) * apart;
    (0..count as usize)
        .map(|k| Bump {
            center: center(k),
            width: apart,
            variance: variance / count,
        })
        .collect()
}

/// Density of the white noise through the filters that it goes through, over the bins: a part `rounding` of its variance comes
/// behind them, and what is filtered has the larger correlation that gives the readings theirs.
fn filtered(noise: &Noise, bins: &Bins, rounding: f64) -> Vec<f64> {
    let filters = noise.terms.iter().filter(|t| t.0.filters_white());
    let before = |(filter, theta): &(Arc<dyn Covariance>, Vec<f64>)| {
        let mut theta = theta.clone();
        if let Some(first) = theta.first_mut().filter(|_| rounding > 0.0) {
            // Its coordinate is the logit of the correlation of neighbours.
            let correlation = 1.0 / (1.0 + (-*first).exp());
            let own = (correlation / (1.0 - rounding)).min(MOST_CORRELATED);
            *first = (own / (1.0 - own)).ln();
        }
        (Arc::clone(filter), theta)
    };
    let still = Noise {
        log_walk: f64::NEG_INFINITY,
        terms: filters.map(before).collect(),
    };
    if still.terms.is_empty() {
        return still.over(bins);
    }
    let all = still.over(bins).into_iter();
    all.map(|g| (1.0 - rounding) * g + rounding).collect()
}

/// The pitches that each tone visits for a share of its time, in the fit. What the others of its comb took up is not the tone's:
/// they leave the fit before noise is sought there.
fn visited(fit: &mut Fit<'_>, merged: &[AsOne], omega: &[f64]) -> Vec<Vec<Bump>> {
    let fixed = fit.shapes.len();
    let mut combs: Vec<Vec<Bump>> = merged.iter().map(|m| pitches(&m.parts)).collect();
    let put = |fit: &mut Fit<'_>, combs: &[Vec<Bump>]| {
        fit.shapes.truncate(fixed);
        fit.shapes
            .extend(combs.iter().flatten().map(|b| b.over(omega)));
        fit.sizes.resize(fixed, 1.0);
        fit.sizes.resize(fit.shapes.len(), 1.0);
    };
    put(fit, &combs);
    if fit.shapes.len() > fixed {
        fit.climb(ROUNDS);
        let mut sizes = fit.sizes[fixed..].iter();
        for comb in &mut combs {
            for (bump, size) in comb.iter_mut().zip(&mut sizes) {
                bump.variance *= size;
            }
            let in_all: f64 = comb.iter().map(|b| b.variance).sum();
            comb.retain(|b| b.variance > LEAST_SHARE * in_all);
        }
        put(fit, &combs);
    }
    combs
}

/// The fit of a channel before anything is added: what its causes have stays, without the bands that are `merged`; white noise,
/// filtered, and random walk are free in size.
fn begun<'a>(s: &'a Searched<'_>, merged: &[AsOne]) -> Fit<'a> {
    let bins = &s.search.panel.bins;
    let noise = &s.state.noise;
    let counts = bins.counts();
    let model = noise.over(bins);
    let energy = bins.products(&s.u, &s.u);
    let power = energy.iter().zip(counts).zip(&model);
    let rounding = s.target.step.powi(2) / 12.0 / s.state.solution.white;
    let white = filtered(noise, bins, 0.0);
    let lambda = noise.log_walk.exp();
    let walk: Vec<f64> = (bins.at.omega.iter())
        .map(|w| lambda / (4.0 * (0.5 * w).sin().powi(2)))
        .collect();
    let mut named: Vec<f64> = (model.iter().zip(&white).zip(&walk))
        .map(|((g, w), k)| g - w - k)
        .collect();
    // As the model has them: what another shape left of their tails would be in the fit, and in no simulation.
    for part in merged {
        let each = named.iter_mut().zip(&part.density);
        each.for_each(|(n, v)| *n -= v);
    }
    let shapes = vec![filtered(noise, bins, rounding.min(MOST_ROUNDING)), walk];
    Fit {
        counts,
        power: power.map(|((e, m), g)| e / m * g).collect(),
        named: named.into_iter().map(|n| n.max(0.0)).collect(),
        sizes: vec![1.0; shapes.len()],
        shapes,
    }
}

/// Adds one bump after another to a fit, the one that takes up most, until none takes up enough. It has `fixed` shapes of
/// noise, then those of the bumps that there are, which no score is held against.
fn add_bumps(fit: &mut Fit<'_>, bumps: &mut Vec<Bump>, bins: &Bins, fixed: usize) {
    let of_tones = bumps.len();
    let mut places = places(bins.n);
    let mut shapes: Vec<Vec<f64>> = (places.iter())
        .map(|(center, width)| {
            let at = |w: &f64| lorentzian(*center, *width, *w);
            bins.at.omega.iter().map(at).collect()
        })
        .collect();
    let mut chosen: Vec<usize> = vec![];
    fit.settle();
    while chosen.len() < MOST {
        let density = fit.density();
        for bump in fit.about_the_highest(&density, bins) {
            places.push((bump.center, bump.width));
            shapes.push(bump.in_bins(bins));
        }
        let free = (0..places.len()).filter(|k| !chosen.contains(k));
        let others = (0..fixed).chain(fixed + of_tones..fit.shapes.len());
        let beside = fit.directions(&density, others);
        let best = free
            .map(|k| (k, fit.score(&density, &shapes[k], &beside)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((k, _)) = best.filter(|b| b.1 > 0.0 && b.1 * b.1 > LEAST_SCORE) else {
            break;
        };
        chosen.push(k);
        bumps.push(Bump {
            center: places[k].0,
            width: places[k].1,
            variance: 1.0,
        });
        fit.shapes.push(shapes[k].clone());
        fit.sizes.push(0.0);
        fit.settle();
    }
    // What was added for what those after it make the better, and what is white together, goes again.
    let stay = fit.prune(fixed + of_tones, LEAST_SCORE);
    let mut own = bumps.split_off(of_tones).into_iter().enumerate();
    bumps.extend(
        stay.iter()
            .filter_map(|k| own.find(|(j, _)| j == k).map(|(_, b)| b)),
    );
}

/// The spectrum of a channel, none where its causes' model describes it. Bands that are one in the model are told by their parts.
pub(super) fn spectrum(s: &Searched<'_>, merged: &[AsOne]) -> Option<Spectrum> {
    let bins = &s.search.panel.bins;
    let mut fit = begun(s, merged);
    let fixed = fit.shapes.len();
    let combs = visited(&mut fit, merged, &bins.at.omega);
    let mut bumps = combs.concat();
    let of_tones = bumps.len();
    add_bumps(&mut fit, &mut bumps, bins, fixed);
    if bumps.is_empty() {
        return None;
    }
    for (bump, size) in bumps.iter_mut().zip(&fit.sizes[fixed..]) {
        bump.variance *= size;
    }
    let white = fit.sizes[0];
    let is_there = |b: &Bump| b.variance > LEAST_PART * white;
    let mut of_tones = bumps.drain(..of_tones);
    let tones = (merged.iter().zip(&combs))
        .map(|(m, comb)| {
            let own = of_tones.by_ref().take(comb.len());
            (m.id, own.filter(is_there).collect())
        })
        .collect();
    drop(of_tones);
    bumps.retain(is_there);
    Some(Spectrum {
        bumps,
        white,
        white_error: fit.error(0),
        walk: fit.sizes[1],
        tones,
        density: fit.density(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_narrow_leaves_the_white_noise_as_it_is() {
        let bins = Bins::new(20_000);
        let count = bins.at.omega.len();
        let mut power = vec![1.0; count];
        // Between two places of the list, as strong as a line of 0.4 of the white deviation and more.
        for (place, energy) in [(2, 40.0), (3, 3e4)] {
            power[place * count / 5] = energy;
        }
        let mut fit = Fit {
            counts: bins.counts(),
            power,
            named: vec![0.0; count],
            shapes: vec![vec![1.0; count]],
            sizes: vec![1.0],
        };
        let mut bumps = vec![];
        add_bumps(&mut fit, &mut bumps, &bins, 1);
        assert!((fit.sizes[0] - 1.0).abs() < 0.02, "{}", fit.sizes[0]);
    }
}
