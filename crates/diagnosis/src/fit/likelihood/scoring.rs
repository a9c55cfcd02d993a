//! Maximum likelihood by Fisher scoring: for noise of many coordinates, where a simplex takes long and ends early.
//!
//! With e_b the energy of the residual over g in bin b of m_b coefficients and s2 the white variance, both at their best
//! for the noise, the gradient of the profile likelihood by a coordinate is -1/2 sum d ln g_b (m_b - e_b / s2), and the
//! information of two coordinates 1/2 sum m_b d ln g_b d' ln g_b, the deviations taken from their mean. Steps are damped
//! as Levenberg and Marquardt do.

use std::sync::Arc;

use crate::fit::likelihood::{Noise, Panel, Solution, invert, least_walk};

/// Most steps, and the gain that ends them, nats.
const MOST_STEPS: usize = 60;
const ENOUGH: f64 = 1e-5;
/// Step of a numerical derivative.
const STEP: f64 = 1e-4;
/// Damping to begin with, its factors after a step that gained and one that did not, and the largest.
const DAMPING: f64 = 1e-2;
const LOWER: f64 = 0.2;
const RAISE: f64 = 4.0;
const MOST_DAMPING: f64 = 1e8;
/// Longest step along a coordinate, which is a logarithm or a way in widths.
const LONGEST: f64 = 1.5;
/// Largest ln of the random walk's step variance over the white one.
const MOST_WALK: f64 = 6.0;

/// Most coordinates of terms that a simplex finds its way in.
pub(crate) const FEW: usize = 5;

/// Whether it is the better way for a noise: one that has a peak, or many coordinates.
pub(crate) fn serves(noise: &Noise) -> bool {
    let coordinates: usize = noise.terms.iter().map(|(_, theta)| theta.len()).sum();
    coordinates > FEW || !noise.peaks().is_empty()
}

/// A point: coordinates, g over the bins, the fit there.
struct Point {
    x: Vec<f64>,
    g: Vec<f64>,
    solution: Solution,
}

struct Scoring<'a> {
    panel: &'a Panel,
    noise: &'a Noise,
    columns: &'a [usize],
    bounds: Vec<(f64, f64)>,
}

/// The random walk and the coordinates of all terms that fit best, from where `noise` is.
pub(crate) fn fit(panel: &Panel, noise: &Noise, columns: &[usize]) -> (Noise, Solution) {
    let scoring = Scoring::new(panel, noise, columns);
    let mut best = scoring.point(&scoring.start());
    let mut damping = DAMPING;
    'steps: for _ in 0..MOST_STEPS {
        let (gradient, information) = scoring.slopes(&best);
        loop {
            let next = scoring.point(&scoring.moved(&best.x, &gradient, &information, damping));
            let gained = next.solution.log_likelihood - best.solution.log_likelihood;
            if gained > 0.0 {
                best = next;
                damping *= LOWER;
                if gained < ENOUGH {
                    break 'steps;
                }
                break;
            }
            damping *= RAISE;
            if damping > MOST_DAMPING {
                break 'steps;
            }
        }
    }
    (scoring.unpacked(&best.x), best.solution)
}

/// Information of the random walk and the coordinates of all terms, the white variance at its best.
pub(crate) fn information(panel: &Panel, noise: &Noise, columns: &[usize]) -> Vec<Vec<f64>> {
    let scoring = Scoring::new(panel, noise, columns);
    scoring.slopes(&scoring.point(&scoring.start())).1
}

impl<'a> Scoring<'a> {
    fn new(panel: &'a Panel, noise: &'a Noise, columns: &'a [usize]) -> Self {
        let n = panel.bins.n;
        let terms = noise.terms.iter();
        let bounds = [(least_walk(n), MOST_WALK)].into_iter();
        Self {
            panel,
            noise,
            columns,
            bounds: bounds.chain(terms.flat_map(|(c, _)| c.bounds(n))).collect(),
        }
    }

    fn start(&self) -> Vec<f64> {
        let terms = self.noise.terms.iter().flat_map(|(_, theta)| theta);
        [&self.noise.log_walk]
            .into_iter()
            .chain(terms)
            .copied()
            .collect()
    }

    fn unpacked(&self, x: &[f64]) -> Noise {
        let mut rest = &x[1..];
        let terms = self.noise.terms.iter().map(|(term, theta)| {
            let (own, tail) = rest.split_at(theta.len());
            rest = tail;
            (Arc::clone(term), own.to_vec())
        });
        Noise {
            terms: terms.collect(),
            log_walk: x[0],
        }
    }

    fn point(&self, x: &[f64]) -> Point {
        let inside = x.iter().zip(&self.bounds);
        let x: Vec<f64> = inside.map(|(x, b)| x.clamp(b.0, b.1)).collect();
        let g = self.unpacked(&x).over(&self.panel.bins);
        let solution = self.panel.solve(&g, self.columns);
        Point { x, g, solution }
    }

    /// Deviations of ln g by each coordinate.
    fn deviations(&self, at: &Point) -> Vec<Vec<f64>> {
        let bins = &self.panel.bins;
        let noise = self.unpacked(&at.x);
        let walk = Noise::new(noise.log_walk).over(bins);
        let walk = walk.iter().zip(&at.g).map(|(w, g)| (w - 1.0) / g);
        let mut all = vec![walk.collect::<Vec<f64>>()];
        for (term, theta) in &noise.terms {
            if let Some(slopes) = term.slopes(theta, &bins.at) {
                let over = |slope: Vec<f64>| slope.iter().zip(&at.g).map(|(s, g)| s / g).collect();
                all.extend(slopes.into_iter().map(over));
                continue;
            }
            let here = term.density(theta, &bins.at);
            for i in 0..theta.len() {
                let mut moved = theta.clone();
                moved[i] += STEP;
                let there = term.density(&moved, &bins.at);
                let by = there.iter().zip(&here).zip(&at.g);
                all.push(by.map(|((t, h), g)| (t - h) / (STEP * g)).collect());
            }
        }
        all
    }

    /// Gradient and information.
    fn slopes(&self, at: &Point) -> (Vec<f64>, Vec<Vec<f64>>) {
        let counts = self.panel.bins.counts();
        let total: f64 = counts.iter().sum();
        let mut by = self.deviations(at);
        for d in &mut by {
            let mean = counts.iter().zip(&*d).map(|(m, d)| m * d).sum::<f64>() / total;
            d.iter_mut().for_each(|d| *d -= mean);
        }
        let energy = self.panel.energy_left(self.columns, &at.solution.beta);
        let off: Vec<f64> = (energy.iter().zip(&at.g).zip(counts))
            .map(|((e, g), m)| e / (g * at.solution.white) - m)
            .collect();
        let half_sum = |a: &[f64], b: &[f64]| 0.5 * numerics::column::dot(a, b);
        let weighted = |d: &Vec<f64>| d.iter().zip(counts).map(|(d, m)| d * m).collect();
        let weighted: Vec<Vec<f64>> = by.iter().map(weighted).collect();
        let gradient = by.iter().map(|d| half_sum(d, &off)).collect();
        let row = |w: &Vec<f64>| by.iter().map(|d| half_sum(w, d)).collect();
        (gradient, weighted.iter().map(row).collect())
    }

    /// A damped step; a coordinate at a bound that the gradient leads out of stays there.
    fn moved(
        &self,
        x: &[f64],
        gradient: &[f64],
        information: &[Vec<f64>],
        damping: f64,
    ) -> Vec<f64> {
        let free: Vec<usize> = (0..x.len())
            .filter(|i| {
                let (low, high) = self.bounds[*i];
                let out = x[*i] <= low && gradient[*i] < 0.0 || x[*i] >= high && gradient[*i] > 0.0;
                !out
            })
            .collect();
        let row = |i: &usize| {
            let by = free.iter().map(|j| {
                let own = if i == j {
                    damping * (information[*i][*i] + damping)
                } else {
                    0.0
                };
                information[*i][*j] + own
            });
            by.collect()
        };
        let damped: Vec<Vec<f64>> = free.iter().map(row).collect();
        let (inverse, _) = invert(&damped);
        let mut moved = x.to_vec();
        for (row, i) in inverse.iter().zip(&free) {
            let step: f64 = row.iter().zip(&free).map(|(v, j)| v * gradient[*j]).sum();
            moved[*i] += step.clamp(-LONGEST, LONGEST);
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use model::effect::Hypothesis;
    use model::effects::effect;
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::fit::likelihood::{Bins, Dct};

    #[test]
    fn it_climbs_as_high_as_a_simplex() {
        let n = 6000;
        let (dct, bins) = (Dct::new(n), Arc::new(Bins::new(n)));
        let view = model::effect::View {
            channel: "gyro_x",
            axis: None,
            lsb: None,
            white_sigma: 1.0,
            neighbours_sigma: 1.0,
            rate_hz: 20.0,
            samples: n,
            base: None,
            moving: false,
            signals: &[],
        };
        let hypothesis = effect("gauss_markov")
            .unwrap()
            .hypotheses(&view)
            .unwrap()
            .remove(0);
        let Hypothesis::Covariance(process) = hypothesis else {
            panic!()
        };
        for seed in 0..10 {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let mut x = 0.0;
            let y: Vec<f64> = (0..n)
                .map(|_| {
                    let [a, b]: [f64; 2] = [0; 2].map(|_| StandardNormal.sample(&mut rng));
                    x = 0.95 * x + 0.15 * a;
                    x + b
                })
                .collect();
            let panel = Panel::new(&dct, &bins, &y);
            let noise = Noise {
                log_walk: -15.0,
                terms: vec![(Arc::clone(&process), vec![-3.0, 2.0])],
            };
            let simplex = panel.fit(&noise, &[]).1.log_likelihood;
            let scored = fit(&panel, &noise, &[]).1.log_likelihood;
            assert!(scored > simplex - 0.01, "{seed}: {scored} {simplex}");
        }
    }
}
