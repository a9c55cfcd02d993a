//! Estimates with honest errors: coefficients averaged over the random walk, noise parameters from the curvature.

use std::sync::Arc;

use model::effect::{Found, Peak, Shape};

use crate::fit::channel::{Form, State, Term};
use crate::fit::delayed::{self, Beside};
use crate::fit::likelihood::scoring;
use crate::fit::likelihood::{Noise, Panel, Solution, invert, least_walk};

/// Standard deviation of an instant between two readings, in their distance.
const BETWEEN: f64 = 0.288_675_134_594_812_9;
/// Points of the random walk that coefficients are averaged over.
const WALKS: u32 = 28;

/// Random walks with the logarithms of their posterior weights (flat in the random walk's size, restricted likelihood).
fn weighted(panel: &Panel, noise: &Noise, columns: &[usize]) -> Vec<(f64, Solution)> {
    let n = (panel.bins.n - 1) as f64;
    let high = (noise.log_walk + 4.0).max(least_walk(panel.bins.n) + 14.0);
    let low = least_walk(panel.bins.n);
    let step = (high - low) / f64::from(WALKS);
    let with = noise.with_walks(&panel.bins);
    (0..=WALKS)
        .map(|i| {
            let log_walk = low + step * f64::from(i);
            let s = panel.solve(&with(log_walk), columns);
            let free = n - columns.len() as f64;
            let restricted =
                -0.5 * (free * s.rss.ln() + s.log_det_noise + s.log_det_normal) + 0.5 * log_walk;
            (restricted, s)
        })
        .collect()
}

/// Random walks with their posterior weights.
#[must_use]
pub fn mixture(panel: &Panel, noise: &Noise, columns: &[usize]) -> Vec<(f64, Solution)> {
    normalised(weighted(panel, noise, columns))
}

/// Weights out of their logarithms.
pub(crate) fn normalised<T>(points: Vec<(f64, T)>) -> Vec<(f64, T)> {
    let top = points.iter().map(|p| p.0).fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = points.iter().map(|p| (p.0 - top).exp()).sum();
    points
        .into_iter()
        .map(|(r, s)| ((r - top).exp() / sum, s))
        .collect()
}

/// Coefficients of all columns with standard errors, averaged over the random walk.
#[must_use]
pub fn coefficients(panel: &Panel, state: &State) -> Vec<(f64, f64)> {
    let columns = state.columns();
    let noise = state.noise_beside_level();
    let mixed = || averaged(&mixture(panel, &noise, &columns), columns.len());
    match &state.level {
        Some(level) => panel.without(level, mixed),
        None => mixed(),
    }
}

/// The first `count` coefficients of a mixture with standard errors.
pub(crate) fn averaged(mixed: &[(f64, Solution)], count: usize) -> Vec<(f64, f64)> {
    (0..count)
        .map(|i| {
            let mean: f64 = mixed.iter().map(|(w, s)| w * s.beta[i]).sum();
            let variance: f64 = mixed
                .iter()
                .map(|(w, s)| w * (s.white * s.inverse[i][i] + (s.beta[i] - mean).powi(2)))
                .sum();
            (mean, variance.sqrt())
        })
        .collect()
}

/// Standard errors of the coordinates of the noise shape (random walk first).
#[must_use]
pub fn noise_errors(panel: &Panel, state: &State) -> Vec<f64> {
    let covariance = noise_covariance(panel, state);
    (0..covariance.len())
        .map(|i| {
            if covariance[i][i] > 0.0 {
                covariance[i][i].sqrt() * state.wider.get(i + 1).unwrap_or(&1.0)
            } else {
                f64::NAN
            }
        })
        .collect()
}

/// Covariance of the coordinates of the noise shape (random walk first): by the information of a noise that has peaks or
/// many coordinates, by the curvature of the likelihood of any other.
pub(super) fn noise_covariance(panel: &Panel, state: &State) -> Vec<Vec<f64>> {
    let columns = state.columns();
    if scoring::serves(&state.noise) {
        return invert(&scoring::information(panel, &state.noise, &columns)).0;
    }
    let mut x = vec![state.noise.log_walk];
    x.extend(state.noise.terms.iter().flat_map(|t| t.1.iter().copied()));
    let at = |x: &[f64]| {
        let mut rest = &x[1..];
        let terms = state
            .noise
            .terms
            .iter()
            .map(|(c, theta)| {
                let (own, tail) = rest.split_at(theta.len());
                rest = tail;
                (c.clone(), own.to_vec())
            })
            .collect();
        let noise = Noise {
            log_walk: x[0],
            terms,
        };
        panel
            .solve(&noise.over(&panel.bins), &columns)
            .log_likelihood
    };
    let h = 0.1;
    let m = x.len();
    let shifted = |i: usize, a: f64, j: usize, b: f64| {
        let mut y = x.clone();
        y[i] += a * h;
        y[j] += b * h;
        at(&y)
    };
    let second = |i: usize, j: usize| {
        (shifted(i, 1.0, j, 1.0) - shifted(i, 1.0, j, -1.0) - shifted(i, -1.0, j, 1.0)
            + shifted(i, -1.0, j, -1.0))
            / (4.0 * h * h)
    };
    let information: Vec<Vec<f64>> = (0..m)
        .map(|i| (0..m).map(|j| -second(i.min(j), i.max(j))).collect())
        .collect();
    invert(&information).0
}

/// Places between the outermost at which the density of overlapping bands is asked for its width, and how far beyond them in
/// half widths.
const PLACES: usize = 2000;
const BEYOND: f64 = 2.0;

/// Of Lorentzian bands together: ln of the variance over the white one, mean frequency by variance, ln of half the width
/// between the outermost places of half the largest density; rad per sample.
fn together(peaks: &[Peak]) -> [f64; 3] {
    let variance: f64 = peaks.iter().map(|p| p.variance).sum();
    let omega = peaks.iter().map(|p| p.variance * p.omega).sum::<f64>() / variance;
    let reach = |by: f64| peaks.iter().map(move |p| p.omega + by * p.half_width);
    let low = reach(-BEYOND).fold(f64::INFINITY, f64::min);
    let high = reach(BEYOND).fold(f64::NEG_INFINITY, f64::max);
    let step = (high - low) / PLACES as f64;
    let density = |w: f64| -> f64 {
        let of =
            |p: &Peak| p.variance / p.half_width / (1.0 + ((w - p.omega) / p.half_width).powi(2));
        peaks.iter().map(of).sum()
    };
    let all: Vec<f64> = (0..=PLACES)
        .map(|i| density(low + step * i as f64))
        .collect();
    let half = 0.5 * all.iter().copied().fold(0.0, f64::max);
    // Between the two places about a crossing it lies by their densities.
    let first = all.iter().position(|d| *d >= half).unwrap_or(0).max(1);
    let last = all
        .iter()
        .rposition(|d| *d >= half)
        .unwrap_or(PLACES)
        .min(PLACES - 1);
    let within = |a: usize, b: usize| (half - all[a]) / (all[b] - all[a]);
    let from = first as f64 - 1.0 + within(first - 1, first);
    let to = last as f64 + within(last, last + 1);
    [variance.ln(), omega, (0.5 * step * (to - from)).ln()]
}

/// Bands that overlap as one: terms `members` of a state together, as [`model::effect::Covariance::described`] gives one.
pub(crate) fn of_bands(
    panel: &Panel,
    state: &State,
    members: &[usize],
    unit: &str,
    rate_hz: f64,
) -> Found {
    const STEP: f64 = 1e-2;
    let covariance = noise_covariance(panel, state);
    let (mut places, mut bands, mut at) = (vec![], vec![], 1);
    for (i, t) in state.terms.iter().enumerate() {
        if let Form::Covariance(c, theta) = &t.form {
            if members.contains(&i) {
                places.extend(at..at + theta.len());
                bands.push((c, theta.clone()));
            }
            at += theta.len();
        }
    }
    let of = |moved: Option<(usize, f64)>| {
        let mut rest = 0;
        let peaks = bands.iter().filter_map(|(c, theta)| {
            let mut theta = theta.clone();
            if let Some((i, by)) = moved
                && let Some(x) = i.checked_sub(rest).and_then(|i| theta.get_mut(i))
            {
                *x += by;
            }
            rest += theta.len();
            c.peak(&theta)
        });
        together(&peaks.collect::<Vec<_>>())
    };
    let slopes: Vec<[f64; 3]> = (0..places.len())
        .map(|i| {
            let (up, down) = (of(Some((i, STEP))), of(Some((i, -STEP))));
            std::array::from_fn(|k| (up[k] - down[k]) / (2.0 * STEP))
        })
        .collect();
    let error = |k: usize| {
        let sum = places.iter().zip(&slopes).map(|(i, a)| {
            let row = places.iter().zip(&slopes);
            a[k] * row.map(|(j, b)| covariance[*i][*j] * b[k]).sum::<f64>()
        });
        sum.sum::<f64>().max(0.0).sqrt()
    };
    let values = of(None);
    Found {
        unit: unit.to_owned(),
        rate_hz,
        white_sigma: state.solution.white.sqrt(),
        coefficients: (0..3).map(|k| (values[k], error(k))).collect(),
        ..Found::default()
    }
}

/// How far the coordinates of a term of the noise scatter over its variants, each as likely as the record makes it: a shape that
/// the record does not tell is part of their error. Nothing of a term without variants.
fn over_variants(panel: &Panel, state: &State, place: usize) -> Vec<f64> {
    let Some((own, theta)) = state.noise.terms.get(place) else {
        return vec![];
    };
    let mut weight = 1.0;
    let mut squares = vec![0.0; theta.len()];
    for variant in own.variants() {
        let mut noise = state.noise.clone();
        noise.terms[place].0 = variant;
        let (noise, solution) = panel.fit(&noise, &state.columns());
        let w = (solution.log_likelihood - state.solution.log_likelihood).exp();
        if !w.is_finite() {
            continue;
        }
        weight += w;
        let off = noise.terms[place].1.iter().zip(theta);
        let sums = squares.iter_mut().zip(off);
        sums.for_each(|(sum, (v, own))| *sum += w * (v - own).powi(2));
    }
    squares.iter().map(|s| (s / weight).sqrt()).collect()
}

/// Where a term of columns lies, each with its standard error: an instant, s, or frequencies, Hz. Of a line its columns tell the
/// amplitude.
fn located(
    panel: &Panel,
    state: &State,
    form: &Form,
    own: &[(f64, f64)],
    rate_hz: f64,
) -> Vec<(f64, f64)> {
    let n = panel.bins.n as f64;
    let amplitude = |first: usize| {
        own[first]
            .0
            .hypot(own.get(first + 1).map_or(0.0, |sine| sine.0))
    };
    // Cramer-Rao bound of a frequency, rad per sample: 24 s^2 / (A^2 n^3).
    let frequency = |omega: f64, amplitude: f64| {
        let variance = 24.0 * state.solution.white * state.noise.at(omega) / n.powi(3);
        let hz = rate_hz / std::f64::consts::TAU;
        (omega * hz, variance.sqrt() / amplitude * hz)
    };
    match form {
        // It came at any instant between two readings.
        Form::Step(at, error) => vec![((at - 0.5) / rate_hz, error.hypot(BETWEEN) / rate_hz)],
        Form::Line(omega) => vec![frequency(*omega, amplitude(0))],
        Form::SideBands(carrier, distance) => {
            // Two side bands of half its size tell the frequency of the swing.
            let (_, error) = frequency(*carrier, amplitude(2) / 2f64.sqrt());
            let swing = distance * rate_hz / std::f64::consts::TAU;
            vec![frequency(*carrier, amplitude(0)), (swing, error)]
        }
        Form::Columns | Form::Shaped(..) | Form::Covariance(..) => vec![],
    }
}

/// What was found for each term of a state.
#[must_use]
pub fn found(panel: &Panel, state: &State, unit: &str, rate_hz: f64) -> Vec<Found> {
    let beta = coefficients(panel, state);
    let errors = noise_errors(panel, state);
    let (mut column, mut coordinate, mut place) = (0, 1, 0);
    let of = |t: &Term| {
        let own = &beta[column..column + t.columns.len()];
        column += t.columns.len();
        let mut found = Found {
            unit: unit.to_owned(),
            rate_hz,
            white_sigma: state.solution.white.sqrt(),
            names: t.names.clone(),
            coefficients: own.to_vec(),
            fixed: t.fixed.clone(),
            location: located(panel, state, &t.form, own, rate_hz),
        };
        if let Form::Shaped(shape, at) = &t.form {
            (found.location, found.coefficients) = shaped(panel, state, t, shape, *at);
            let coordinate = found.location.iter_mut().take(1);
            coordinate.for_each(|(value, _)| *value = shape.told(*value));
            // A delay is told in seconds.
            let late = found.location.iter_mut().skip(1);
            late.for_each(|(delay, error)| (*delay, *error) = (*delay / rate_hz, *error / rate_hz));
        }
        if let Form::Covariance(c, theta) = &t.form {
            found.fixed.extend(c.fixed());
            let wider = t.wider.iter().copied().chain(std::iter::repeat(1.0));
            let own = theta.iter().zip(&errors[coordinate..]).zip(wider);
            let mut own: Vec<(f64, f64)> = own.map(|((v, e), by)| (*v, e * by)).collect();
            if t.wider.is_empty() {
                let scatter = over_variants(panel, state, place);
                let both = own.iter_mut().zip(scatter);
                both.for_each(|((_, error), by)| *error = error.hypot(by));
            }
            found.coefficients = c.described(&own);
            coordinate += theta.len();
            place += 1;
        }
        if let Some(stated) = &t.stated {
            found.coefficients.clone_from(stated);
        }
        found
    };
    state.terms.iter().map(of).collect()
}

/// Values of a shape's coordinate to either side that it is averaged over, and how far they reach in its logarithm: so many
/// standard errors at a known random walk, within limits, of which the lower is what the search leaves open.
const SHAPES: i32 = 12;
const REACH_ERRORS: f64 = 10.0;
const REACH: [f64; 2] = [0.06, 1.2];
/// Step over which the curvature of the likelihood is told, in the logarithm.
const CURVED_OVER: f64 = 0.03;

/// Delays to either side that a shape is averaged over, how far they reach in standard errors, and that in samples.
const DELAYS: i32 = 3;
const DELAY_ERRORS: f64 = 2.5;
const DELAY_REACH: [f64; 2] = [1e-4, 1.0];
/// A fit of a shape: the logarithm of its coordinate, its delay, the logarithm of the weight, and the solution.
struct Weighed {
    x: f64,
    delay: f64,
    weight: f64,
    solution: Solution,
}

/// A shape beside the other terms of its model.
struct Placed<'a> {
    panel: &'a Panel,
    noise: &'a Noise,
    density: Vec<f64>,
    others: Vec<&'a Term>,
    effect: &'static str,
}

impl Placed<'_> {
    /// Fits over the coordinate, flat in it, and the random walk.
    fn over_coordinate(&self, shape: Arc<dyn Shape>, at: f64) -> Vec<Weighed> {
        let grid = shape.grid();
        let (low, high) = (grid[0].ln(), grid[grid.len() - 1].ln());
        let width = self.panel.width();
        let delay = shape.delay();
        let beside = Beside::new(self.panel, &self.others, self.effect, shape);
        // Its best place by all that stands beside it now: a grid about another one would end before it.
        let (best, here) = beside.best(self.panel, &self.density, at);
        let [below, above] = [-1.0, 1.0].map(|k| {
            let x = best + k * CURVED_OVER;
            beside.likelihood(self.panel, &self.density, x)
        });
        let information = (2.0 * here - below - above) / CURVED_OVER.powi(2);
        let reach = if information > 0.0 {
            (REACH_ERRORS / information.sqrt()).clamp(REACH[0], REACH[1])
        } else {
            REACH[1]
        };
        let mut all = vec![];
        for i in -SHAPES..=SHAPES {
            let x = best + reach * f64::from(i) / f64::from(SHAPES);
            if x < low - 0.7 || x > high + 0.7 {
                continue;
            }
            let fits = |columns: &[usize]| weighted(self.panel, self.noise, columns);
            let fits = beside.with(self.panel, x.exp(), fits);
            // So many of a step in x as the step is wide, and of x as its exponential grows.
            let prior = reach.ln() + x + delayed::prior(delay);
            all.extend(fits.into_iter().map(|(weight, solution)| Weighed {
                x,
                delay,
                weight: weight + prior,
                solution,
            }));
        }
        self.panel.truncate(width);
        all
    }

    /// The shape at delays about the most likely one, with a coordinate near its best for each; itself where it is never late.
    fn delays(&self, shape: &Arc<dyn Shape>, at: f64) -> Vec<(Arc<dyn Shape>, f64)> {
        let (least, most) = shape.delays();
        if most <= least {
            return vec![(Arc::clone(shape), at)];
        }
        let of = Arc::clone(shape);
        let top = delayed::climb(self.panel, &self.density, &self.others, self.effect, of, at);
        let [[_, both], [_, variance]] = top.covariance;
        let reach = (DELAY_ERRORS * variance.sqrt()).clamp(DELAY_REACH[0], DELAY_REACH[1]);
        (-DELAYS..=DELAYS)
            .map(|i| reach * f64::from(i) / f64::from(DELAYS))
            .map(|off| (top.shape.delay() + off, top.x + both / variance * off))
            .filter(|(delay, _)| (least..=most).contains(delay))
            .filter_map(|(delay, x)| Some((shape.later(delay)?, x.exp())))
            .collect()
    }
}

/// Where a shape lies and what its columns are, each number with its standard error: its coordinate and, where it may have one,
/// its delay; the coefficients.
type Told = (Vec<(f64, f64)>, Vec<(f64, f64)>);

/// A shape's coordinate, its delay where it may have one, and the coefficients of its columns, averaged over the coordinate, the
/// delay (by [`delayed::prior`]) and the random walk: where a slow shape and a slow walk take each other's part, or a time and a
/// delay, errors at fixed values of either are too small. The coordinate is flat in itself: Jeffreys' prior of the size and the
/// time of an exponential is in proportion to the size alone.
fn shaped(panel: &Panel, state: &State, term: &Term, shape: &Arc<dyn Shape>, at: f64) -> Told {
    let others = state.terms.iter().filter(|t| t.columns != term.columns);
    let placed = Placed {
        panel,
        noise: &state.noise,
        density: state.noise.over(&panel.bins),
        others: others.collect(),
        effect: term.effect.id(),
    };
    let each = placed.delays(shape, at).into_iter();
    let each = each.flat_map(|(shape, at)| placed.over_coordinate(shape, at));
    let all: Vec<_> = each.collect();
    over_shapes(&all, term.columns.len(), shape.delays())
}

/// A coordinate, a delay where it is not always the same, and so many coefficients, each with its standard error, averaged over
/// fits.
fn over_shapes(all: &[Weighed], columns: usize, delays: (f64, f64)) -> Told {
    let top = (all.iter().map(|p| p.weight)).fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = all.iter().map(|p| (p.weight - top).exp()).collect();
    let sum: f64 = weights.iter().sum();
    let mean_of = |f: &dyn Fn(&Weighed) -> f64| -> f64 {
        let each = all.iter().zip(&weights);
        each.map(|(p, w)| w * f(p)).sum::<f64>() / sum
    };
    let told = |f: &dyn Fn(&Weighed) -> f64| {
        let mean = mean_of(f);
        (mean, mean_of(&|p| (f(p) - mean).powi(2)).sqrt())
    };
    let mut location = vec![told(&|p| p.x.exp())];
    if delays.1 > delays.0 {
        location.push(told(&|p| p.delay));
    }
    let coefficients = (0..columns)
        .map(|c| {
            let mean = mean_of(&|p| p.solution.beta[c]);
            let variance = mean_of(&|p| {
                let s = &p.solution;
                s.white * s.inverse[c][c] + (s.beta[c] - mean).powi(2)
            });
            (mean, variance.sqrt())
        })
        .collect();
    (location, coefficients)
}
