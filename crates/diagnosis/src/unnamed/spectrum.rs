//! The spectrum of what is left of a channel: bumps beside the noise of its causes.
//!
//! The energies of the residual over bins of coefficients are independent multiples of chi-squares. Their mean is a sum of
//! densities: white noise, through the filter where there is one, and random walk, both free in size; the processes that have a
//! name, as they are; and bumps of a fixed list, of which those enter one by one that take up most.

use std::f64::consts::PI;
use std::sync::Arc;

use model::effect::{Covariance, Hypothesis};

use super::bump::{Bump, lorentzian, places};
use crate::fit::channel::{Form, Term};
use crate::fit::likelihood::{Bins, Noise};
use crate::search::searched::Searched;
use numerics::column::dot;

/// Most bumps of a channel.
const MOST: usize = 16;
/// Score, the square of a standard normal value of one sign, that a further bump has to reach: bumps are sought where something is
/// left, and what three standard errors make is in the simulations too.
const LEAST_SCORE: f64 = 9.0;
/// Widths of a bump about the bin that stands out most, over that of the bin.
const WIDTHS_OF_A_BIN: [f64; 3] = [1.0, 3.0, 9.0];
/// Widths of its bands to either side in which a tone is sought, most places there, and least share of its time in one.
const REACH: f64 = 3.0;
const MOST_PITCHES: f64 = 64.0;
const LEAST_SHARE: f64 = 1e-3;
/// Largest part of the white variance that is taken for rounding, and largest correlation before it.
const MOST_ROUNDING: f64 = 0.5;
const MOST_CORRELATED: f64 = 0.999;
/// Variance of a bump over the white one below which it is none.
const LEAST_PART: f64 = 1e-9;
/// Least part of the information on a bump that what is fitted beside it leaves: of less nothing is told.
const LEAST_LEFT: f64 = 0.02;
/// Rounds of the fit while bumps are added, and of the last one.
const ROUNDS: usize = 60;
const LAST_ROUNDS: usize = 600;

/// What describes the noise of a channel better than its causes do.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Spectrum {
    /// What is added.
    pub bumps: Vec<Bump>,
    /// White variance beside it, over that without it.
    pub white: f64,
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
        !matches!(hypothesis, Hypothesis::Covariance(_))
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

/// The sums that a fit runs over.
struct Fit<'a> {
    counts: &'a [f64],
    /// Energy of a coefficient over the white variance.
    power: Vec<f64>,
    /// What has a name and stays.
    named: Vec<f64>,
    /// White noise, random walk, bumps.
    shapes: Vec<Vec<f64>>,
    sizes: Vec<f64>,
}

impl Fit<'_> {
    fn density(&self) -> Vec<f64> {
        let mut sum = self.named.clone();
        for (shape, size) in self.shapes.iter().zip(&self.sizes) {
            let each = sum.iter_mut().zip(shape);
            each.for_each(|(s, v)| *s += size * v);
        }
        sum
    }

    /// Likelihood ratio's derivative by the size of a shape, over its standard deviation beside the sizes that are fitted along with
    /// it: a broad bump is nearly white, and what white noise takes up of it is no information.
    fn score(&self, density: &[f64], shape: &[f64], beside: &[Vec<f64>]) -> f64 {
        let own = self.relative(density, shape);
        let off = self.counts.iter().zip(&self.power).zip(density);
        let up: f64 = (off.zip(&own))
            .map(|(((m, p), s), v)| (0.5 * m).sqrt() * (p / s - 1.0) * v)
            .sum();
        let taken: f64 = beside.iter().map(|b| dot(b, &own).powi(2)).sum();
        let information = dot(&own, &own);
        let left = (information - taken).max(LEAST_LEFT * information);
        up / left.sqrt().max(f64::MIN_POSITIVE)
    }

    /// Bumps about the bin that stands out most of the density: what is narrow stands between the places of any list.
    fn about_the_highest(&self, density: &[f64], bins: &Bins) -> Vec<Bump> {
        let off = self.counts.iter().zip(&self.power).zip(density);
        let scores = off.map(|((m, p), s)| (0.5 * m).sqrt() * (p / s - 1.0));
        let highest = scores.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        let found = highest.filter(|(_, z)| *z > 0.0 && z * z > LEAST_SCORE);
        let of_bin = |k: usize| {
            let width = self.counts[k] * PI / bins.n as f64;
            WIDTHS_OF_A_BIN.map(|by| Bump {
                center: bins.at.omega[k],
                width: by * width,
                variance: 1.0,
            })
        };
        found.map_or(vec![], |(k, _)| of_bin(k).into())
    }

    /// A shape over the density, by the root of the information of each bin.
    fn relative(&self, density: &[f64], shape: &[f64]) -> Vec<f64> {
        let each = self.counts.iter().zip(density).zip(shape);
        each.map(|((m, s), v)| (0.5 * m).sqrt() * v / s).collect()
    }

    /// The directions of the shapes of these places, each without what those before it have.
    fn directions(&self, density: &[f64], places: impl Iterator<Item = usize>) -> Vec<Vec<f64>> {
        let mut all: Vec<Vec<f64>> = vec![];
        for k in places {
            let mut own = self.relative(density, &self.shapes[k]);
            let before = dot(&own, &own);
            for other in &all {
                let by = dot(&own, other);
                own.iter_mut().zip(other).for_each(|(a, b)| *a -= by * b);
            }
            let left = dot(&own, &own);
            if left > LEAST_LEFT * before {
                own.iter_mut().for_each(|a| *a /= left.sqrt());
                all.push(own);
            }
        }
        all
    }

    /// Sizes climb the likelihood and stay positive.
    ///
    /// # Source
    /// Fevotte, Idier (2011), Algorithms for nonnegative matrix factorization with the beta-divergence, Neural Comput. 23:
    /// 2421-2456: multiplicative updates of the Itakura-Saito divergence, exponent 1/2, under which it falls.
    fn climb(&mut self, rounds: usize) {
        for _ in 0..rounds {
            let density = self.density();
            for (shape, size) in self.shapes.iter().zip(&mut self.sizes) {
                let each = self.counts.iter().zip(&self.power).zip(&density).zip(shape);
                let (more, less) = each.fold((0.0, 0.0), |(more, less), (((m, p), s), v)| {
                    let part = m * v / s;
                    (more + part * p / s, less + part)
                });
                if less > 0.0 {
                    *size *= (more / less).sqrt();
                }
            }
        }
    }
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
        fit.climb(LAST_ROUNDS);
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
    fit.climb(ROUNDS);
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
        let Some((k, score)) = best.filter(|b| b.1 > 0.0 && b.1 * b.1 > LEAST_SCORE) else {
            break;
        };
        chosen.push(k);
        bumps.push(Bump {
            center: places[k].0,
            width: places[k].1,
            variance: 1.0,
        });
        fit.shapes.push(shapes[k].clone());
        // As much as its score says, from where it climbs on.
        let peak = shapes[k].iter().zip(&density).map(|(v, s)| v / s);
        let most = peak.fold(0.0, f64::max);
        fit.sizes.push(score.min(1.0) / most.max(f64::MIN_POSITIVE));
        fit.climb(ROUNDS);
    }
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
    fit.climb(LAST_ROUNDS);
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
        walk: fit.sizes[1],
        tones,
        density: fit.density(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_climb_to_those_of_the_power() {
        let shape = |center: f64| -> Vec<f64> {
            (1..400)
                .map(|k| lorentzian(center, 0.1, PI * f64::from(k) / 400.0))
                .collect()
        };
        let shapes = vec![vec![1.0; 399], shape(0.5), shape(2.0)];
        let mut fit = Fit {
            counts: &[10.0; 399],
            power: vec![],
            named: vec![0.2; 399],
            shapes,
            sizes: vec![0.7, 0.3, 0.05],
        };
        fit.power = fit.density();
        fit.sizes = vec![1.0, 0.1, 0.1];
        fit.climb(LAST_ROUNDS);
        for (size, truth) in fit.sizes.iter().zip([0.7, 0.3, 0.05]) {
            assert!((size / truth - 1.0).abs() < 0.01, "{size} {truth}");
        }
        assert!(fit.score(&fit.density(), &shape(1.2), &[]).abs() < 0.1);
    }

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
        fit.climb(LAST_ROUNDS);
        assert!((fit.sizes[0] - 1.0).abs() < 0.02, "{}", fit.sizes[0]);
    }

    #[test]
    fn a_broad_bump_counts_by_what_white_noise_does_not_take_up_of_it() {
        let omega: Vec<f64> = (1..400).map(|k| PI * f64::from(k) / 400.0).collect();
        let broad = Bump {
            center: 2.2,
            width: 0.7 * 2.2,
            variance: 1.0,
        }
        .over(&omega);
        let mut fit = Fit {
            counts: &[150.0; 399],
            power: broad.iter().map(|b| 0.97 + 0.03 * b).collect(),
            named: vec![0.0; 399],
            shapes: vec![vec![1.0; 399]],
            sizes: vec![1.0],
        };
        fit.climb(LAST_ROUNDS);
        let density = fit.density();
        let beside = fit.directions(&density, 0..1);
        // 60 000 coefficients of a relative error of 1.4 each, and an rms excess of 0.03 times that of the bump about its mean.
        let n = omega.len() as f64;
        let mean = broad.iter().sum::<f64>() / n;
        let rms = (broad.iter().map(|b| (b - mean).powi(2)).sum::<f64>() / n).sqrt();
        let wanted = 0.03 * rms * (0.5 * 150.0 * n).sqrt();
        let score = fit.score(&density, &broad, &beside);
        assert!((score / wanted - 1.0).abs() < 0.05, "{score} {wanted}");
        assert!(fit.score(&density, &broad, &[]) < 0.8 * score);
    }
}
