//! One estimate of everything on a channel whose white variance follows laws: white noise at their zero, random walk,
//! processes, regressors and the laws themselves, in one likelihood.
//!
//! y_t = x_t'b + m_t + sum_j z_jt + e_t with a flat-start random walk m, first-order processes z_j and white noise e of variance
//! s2 (1 + gamma d_t), of several laws their product. Lost readings are missing. The likelihood is exact ([`filter`]); where the
//! white noise went through a filter, data and columns are divided by its square root in the DCT domain first, which is exact but
//! for the noise within a filter's memory of a change of the variance. Without a law the DCT-II likelihood of [`crate::fit::likelihood`] is the same one,
//! and its fit is the joint estimate already.

mod climb;
mod filter;

use model::effect::Found;
use model::record::rows::Bursts;

use crate::fit::before_filter;
use crate::fit::channel::{Form, Joint, Levels, State, Term, VarianceFound};
use crate::fit::estimate;
use crate::fit::likelihood::{Bins, Noise, least_walk};
use crate::search::searched::Searched;

use climb::{Peak, climb};
use filter::{Point, Series};

/// Random walks that coefficients are averaged over, as [`crate::fit::estimate::mixture`] does.
const WALKS: u32 = 20;
/// Largest ln(1 + gamma) of a law.
const MOST_LAW: f64 = 9.0;

/// The joint estimate of a channel under white noise whose variance follows `laws`, or none; no estimate where a process of the
/// channel, a band among them, is no sum of first-order ones. Of `bursts` that were laid end to end the walk goes on between
/// them.
pub(crate) fn estimate(
    s: &Searched<'_>,
    laws: &[VarianceFound],
    bursts: Option<&Bursts>,
) -> Option<Joint> {
    let spans = bursts.map(|b| b.spans(s.search.panel.bins.n));
    let model = Model::of(s, laws, spans.as_deref())?;
    let start = model.start(&s.state, laws);
    let value = |x: &[f64]| {
        let (normal, log_det) = model.series.through(&model.point(x));
        let solution = normal.solved(model.series.free(), log_det);
        (solution.log_likelihood, solution.white.ln())
    };
    let peak = climb(&value, &start, &model.steps(), &model.bounds());
    let (mut levels, coordinates) = model.told(&peak);
    // The walk of a channel is that of bursts end to end, until its model is told.
    levels.log_walk += bursts.map_or(0.0, |b| (b.period_s / b.length_s).ln());
    let found = model.found(s, &peak, levels.white, &coordinates);
    let first = peak.x.len() - laws.len();
    let told = laws.iter().enumerate().map(|(k, v)| {
        let (i, top) = (first + k, filter::top(&v.shape));
        let ratio = peak.x[i].exp();
        ((ratio - 1.0) / top, ratio / top * peak.error(i))
    });
    let laws = told.collect();
    let innovations = model.series.innovations(&model.point(&peak.x));
    Some(Joint {
        levels,
        laws,
        found,
        innovations,
    })
}

/// A channel as the filter sees it.
struct Model<'a> {
    series: Series<'a>,
    /// Processes that are added, with their coordinates.
    processes: Vec<&'a Term>,
    samples: usize,
    /// Density at zero frequency of the filter that the white noise goes through: what is slow is divided by it.
    slow: f64,
}

impl<'a> Model<'a> {
    fn of(
        s: &'a Searched<'_>,
        laws: &'a [VarianceFound],
        spans: Option<&'a [f64]>,
    ) -> Option<Self> {
        let (panel, state) = (&s.search.panel, &s.state);
        let samples = panel.bins.n;
        let known = |t: &&Term| match &t.form {
            Form::Covariance(c, theta) => c.poles(theta, samples).is_some(),
            _ => false,
        };
        let processes: Vec<&Term> = state.terms.iter().filter(|t| t.is_process()).collect();
        // A band is no sum of first-order processes.
        if state.terms.iter().any(Term::is_band) || !processes.iter().all(known) {
            return None;
        }
        let density = state
            .noise
            .filter()
            .map(|only| only.everywhere(&panel.bins));
        let slow = density.as_ref().and_then(|h| h.get(1)).copied();
        let numbers: Vec<usize> = std::iter::once(0).chain(state.columns()).collect();
        let columns = panel.dct.inverse_all(numbers.iter().map(|c| {
            let mut c = panel.column(*c).to_vec();
            if let Some(h) = &density {
                c.iter_mut().zip(h).for_each(|(c, h)| *c /= h.sqrt());
            }
            c
        }));
        Some(Self {
            series: Series::new(
                samples,
                columns,
                laws.iter().map(|v| v.shape.as_slice()),
                &s.target.lost,
                spans,
            ),
            processes,
            samples,
            slow: slow.unwrap_or(1.0),
        })
    }

    /// Coordinates: ln of the walk, those of the processes, ln(1 + gamma) at the top of each law.
    fn start(&self, state: &State, laws: &[VarianceFound]) -> Vec<f64> {
        // The search's are over the mean white variance.
        let over = mean_under(&laws.iter().collect::<Vec<_>>()).ln();
        let top = |v: &VarianceFound| 1.0 + v.gamma() * filter::top(&v.shape);
        let tops = laws.iter().map(|v| top(v).max(1e-3).ln());
        let mut x = vec![state.noise.log_walk + over - self.slow.ln()];
        for theta in self.processes.iter().map(|t| coordinates(t)) {
            x.push(theta[0] + over - self.slow.ln());
            x.extend(&theta[1..]);
        }
        x.extend(tops);
        let bounds = self.bounds();
        x.iter()
            .zip(bounds)
            .map(|(v, b)| v.clamp(b.0, b.1))
            .collect()
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        let n = self.samples;
        let all = self.processes.iter().flat_map(|t| match &t.form {
            Form::Covariance(c, _) => c.bounds(n),
            _ => vec![],
        });
        let walk = std::iter::once((least_walk(n), 6.0));
        let laws = (0..self.series.laws()).map(|_| (-MOST_LAW, MOST_LAW));
        walk.chain(all).chain(laws).collect()
    }

    fn steps(&self) -> Vec<f64> {
        let mut steps = vec![0.1; self.bounds().len()];
        let first = steps.len() - self.series.laws();
        steps[first..].fill(0.02);
        steps
    }

    fn point(&self, x: &[f64]) -> Point {
        let mut rest = &x[1..];
        let mut poles = vec![];
        for t in &self.processes {
            let Form::Covariance(c, theta) = &t.form else {
                continue;
            };
            let (own, tail) = rest.split_at(theta.len());
            rest = tail;
            poles.extend(c.poles(own, self.samples).unwrap_or_default());
        }
        Point {
            log_walk: x[0],
            poles,
            laws: rest.iter().map(|v| v.exp() - 1.0).collect(),
        }
    }

    /// The noise at the peak, and the coordinates of the processes with their errors.
    fn told(&self, peak: &Peak) -> (Levels, Vec<(f64, f64)>) {
        let slow = self.slow.ln();
        let levels = Levels {
            white: peak.log_scale.exp(),
            white_error: peak.scale_error(self.series.free(), None),
            log_walk: peak.x[0] + slow,
            walk_error: 0.5 * peak.scale_error(self.series.free(), Some(0)),
        };
        let mut at = 1;
        let mut all = vec![];
        for theta in self.processes.iter().map(|t| coordinates(t)) {
            // A size over the white variance is told as a size.
            all.push((
                peak.x[at] + slow,
                peak.scale_error(self.series.free(), Some(at)),
            ));
            all.extend((at + 1..at + theta.len()).map(|i| (peak.x[i], peak.error(i))));
            at += theta.len();
        }
        (levels, all)
    }

    /// Coefficients of the columns with standard errors, averaged over the random walk (flat in its size, restricted likelihood).
    fn coefficients(&self, peak: &Peak) -> Vec<(f64, f64)> {
        let count = self.series.columns();
        if count == 0 {
            return vec![];
        }
        let low = least_walk(self.samples);
        let high = (peak.x[0] + 4.0).max(low + 14.0);
        let step = (high - low) / f64::from(WALKS);
        let all = (0..=WALKS).map(|i| {
            let mut x = peak.x.clone();
            x[0] = low + step * f64::from(i);
            let (normal, log_det) = self.series.through(&self.point(&x));
            let n = self.series.free();
            let s = normal.solved(n, log_det);
            let free = n - count as f64;
            let l = -0.5 * (free * s.rss.ln() + log_det + s.log_det_normal) + 0.5 * x[0];
            (l, s)
        });
        estimate::averaged(&estimate::normalised(all.collect()), count)
    }

    /// What was found for each term. A shape's coordinate, and with it its columns', is the search's.
    fn found(
        &self,
        s: &Searched<'_>,
        peak: &Peak,
        white: f64,
        coordinates: &[(f64, f64)],
    ) -> Vec<Found> {
        let beta = self.coefficients(peak);
        let (mut column, mut coordinate) = (0, 0);
        let each = s.state.terms.iter().zip(&s.found).map(|(t, before)| {
            let mut found = before.clone();
            let own = &beta[column..column + t.columns.len()];
            column += t.columns.len();
            match &t.form {
                Form::Covariance(_, theta) if t.is_process() => {
                    found.white_sigma = white.sqrt();
                    if t.stated.is_none() {
                        found.coefficients =
                            coordinates[coordinate..coordinate + theta.len()].to_vec();
                    }
                    coordinate += theta.len();
                }
                Form::Covariance(..) | Form::Shaped(..) => {}
                _ if t.stated.is_none() => found.coefficients = own.to_vec(),
                _ => {}
            }
            found
        });
        each.collect()
    }
}

fn coordinates(t: &Term) -> &[f64] {
    match &t.form {
        Form::Covariance(_, theta) => theta,
        _ => &[],
    }
}

/// The noise of a state whose white variance is the same throughout.
pub(crate) fn levels_of(s: &Searched<'_>, state: &State) -> Levels {
    let errors = estimate::noise_errors(&s.search.panel, state);
    let error = errors.first().copied().unwrap_or(f64::NAN);
    let wider = state.wider.first().unwrap_or(&1.0);
    let (scale, walk) = beside_walk(&s.search.panel.bins, state, error);
    let plain = state.noise.terms.is_empty();
    // What is before a filter has an error of its own beside this one.
    let white_error = match plain || state.noise.filter().is_some() {
        true => scale * wider,
        false => before_filter::of_white(&s.search.panel, state),
    };
    Levels {
        white: state.solution.white,
        white_error,
        log_walk: state.noise.log_walk,
        walk_error: 0.5 * if plain { walk } else { error },
    }
}

/// Standard errors of ln N^2 and ln K^2 of white noise and a random walk, by that of the logarithm of their ratio q. At a known q
/// either has 2 / n; with q the white level falls by the share r of the walk in the density, in the mean over the spectrum, and
/// the walk's rises by what is left. A walk that makes most of the spectrum has q by the information n var(r) / 2: the likelihood of
/// what it hides is flat on one side.
fn beside_walk(bins: &Bins, state: &State, error: f64) -> (f64, f64) {
    let n = bins.n as f64;
    let walk = state.noise.log_walk.exp();
    let white = Noise {
        log_walk: f64::NEG_INFINITY,
        ..state.noise.clone()
    };
    let all = state.noise.over(bins);
    let still = white.over(bins);
    let share = |(all, still): (&f64, &f64)| 1.0 - still / all;
    let mean_of = |of: &dyn Fn(f64) -> f64| {
        let shares = all.iter().zip(&still).map(share);
        let sum: f64 = shares.zip(bins.counts()).map(|(r, m)| m * of(r)).sum();
        sum / bins.counts().iter().sum::<f64>()
    };
    let mean = mean_of(&|r| r);
    let variance = mean_of(&|r| (r - mean) * (r - mean));
    let ratio = if walk > 0.0 && mean > 0.5 {
        (2.0 / (n * variance)).sqrt()
    } else {
        error
    };
    let at_known = (2.0 / n).sqrt();
    // Of a walk too small to have an error the white level knows nothing.
    let of_white = if ratio.is_finite() { mean * ratio } else { 0.0 };
    (
        at_known.hypot(of_white),
        at_known.hypot((1.0 - mean) * ratio),
    )
}

/// Mean of the white variance over that at the zero of its laws.
fn mean_under(laws: &[&VarianceFound]) -> f64 {
    let count = laws.first().map_or(0, |v| v.shape.len());
    if count == 0 {
        return 1.0;
    }
    let at = |i: usize| -> f64 {
        let factors = laws.iter().map(|v| 1.0 + v.gamma() * v.shape[i]);
        factors.product()
    };
    let sum: f64 = (0..count).map(at).sum();
    (sum / count as f64).max(f64::MIN_POSITIVE)
}

/// The noise at the zero of laws where no joint estimate can be made: that of the state, whose white variance is the mean.
pub(crate) fn levels_under(s: &Searched<'_>, laws: &[&VarianceFound]) -> Levels {
    let mean = mean_under(laws);
    let all = levels_of(s, &s.state);
    Levels {
        white: all.white / mean,
        log_walk: all.log_walk + mean.ln(),
        ..all
    }
}
