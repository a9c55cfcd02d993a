//! What each hypothesis offers to a model: its best place, its likelihood ratio, its threshold.

use std::collections::HashMap;
use std::sync::Arc;

use model::effect::{Covariance, Hypothesis, Regression, Shape};

use super::{Candidate, Search, bands};
use crate::fit::channel::{Form, RIVAL_SPAN, State, Term};
use crate::fit::likelihood::{Noise, scoring};
use crate::fit::{scan, threshold};

/// Fewest cycles of a line in the record.
const LEAST_CYCLES: f64 = 3.0;
/// A swing of a line is slow up to here, Hz; faster ones are sought up to this share of the line's own frequency, beyond
/// which side bands are lines like others; and fewest swings in the record.
const SLOW_BEAT_HZ: f64 = 0.6;
const FASTEST_BEAT: f64 = 0.25;
const LEAST_BEATS: f64 = 3.0;
/// Lags at which one is asked for that tells of a mean: beside a random walk that has taken it for slow noise, one of n readings
/// shows at lag n.
const FAR: usize = 64;

/// A candidate that is weighed beside a state.
struct Weighed<'a> {
    candidate: &'a Candidate,
    i: usize,
    state: &'a State,
    /// Random walks that are tried.
    walks: &'a [(Noise, Vec<f64>, f64)],
    /// Columns of the state, and its log likelihood.
    own: Vec<usize>,
    null: f64,
}

impl Weighed<'_> {
    /// A term of the candidate.
    fn term(
        &self,
        form: Form,
        columns: Vec<usize>,
        names: Vec<&'static str>,
        lr: f64,
        threshold: f64,
    ) -> Term {
        Term {
            columns,
            names,
            lr,
            ..Term::new(self.candidate.effect, self.i, form, threshold)
        }
    }
}

impl Candidate {
    /// What a shape with so many columns has to reach. The hypotheses of an effect of which a shape is the whole share its chance.
    pub(crate) fn limit_of_shape(&self, columns: usize) -> f64 {
        let places = match &self.hypothesis {
            Hypothesis::Shaped(s) if s.whole() => self.grid.len() * self.siblings,
            _ => self.grid.len(),
        };
        threshold::shaped(columns, places)
    }
}

impl Search<'_> {
    /// Best term that candidate `i` offers to `state`.
    pub(super) fn weigh(
        &self,
        state: &State,
        walks: &[(Noise, Vec<f64>, f64)],
        i: usize,
    ) -> Option<Term> {
        let candidate = &self.candidates[i];
        let of = Weighed {
            candidate,
            i,
            state,
            walks,
            own: state.columns(),
            null: state.solution.log_likelihood,
        };
        match &candidate.hypothesis {
            Hypothesis::Regression(r) => Some(self.weigh_regression(&of, r)),
            Hypothesis::Shaped(shape) => self.weigh_shaped(&of, shape),
            Hypothesis::Step => self.weigh_step(&of),
            Hypothesis::Line => self.weigh_line(&of),
            Hypothesis::SideBands => self.weigh_side_bands(&of),
            Hypothesis::Covariance(c) if c.is_peak() => {
                let n = self.panel.bins.n;
                self.weigh_peak(state, i, c, threshold::peak(n) / bands::AHEAD)
            }
            Hypothesis::Covariance(c) if c.at_lag(1, 0.0).is_some() => self.weigh_at_lag(&of, c),
            Hypothesis::Covariance(c) => self.weigh_covariance(&of, c),
            _ => None,
        }
    }

    /// What columns offer.
    fn weigh_regression(&self, of: &Weighed<'_>, r: &Regression) -> Term {
        let extended = |t: &&Term| of.candidate.effect.extends() == Some(t.effect.id());
        // A shape that it stands in the place of is no part of it.
        let shaped = |t: &Term| matches!(t.form, Form::Shaped(..));
        let kept = of.state.terms.iter();
        let kept = kept.filter(|t| !(shaped(t) && extended(t)));
        let kept: Vec<usize> = kept.flat_map(|t| t.columns.iter().copied()).collect();
        let columns = [kept, of.candidate.columns.clone()].concat();
        let lr = 2.0 * (self.panel.profile(of.walks, &columns) - of.null);
        let names = r.columns.iter().map(|c| c.parameter).collect();
        // In the place of a narrower term, only the columns beyond it are new.
        let held: usize = of
            .state
            .terms
            .iter()
            .filter(extended)
            .map(|t| t.columns.len())
            .sum();
        let new = r.columns.len().saturating_sub(held).max(1);
        let limit = if of.state.terms.iter().filter(extended).any(shaped) {
            // The coordinate of a shape is a parameter too, and has earned its place.
            0.0
        } else {
            threshold::regression(new, of.candidate.siblings) + of.candidate.handicap
        };
        let mut t = of.term(
            Form::Columns,
            of.candidate.columns.clone(),
            names,
            lr,
            limit,
        );
        t.fixed.clone_from(&r.fixed);
        t.follows.clone_from(&r.follows);
        t.of.clone_from(&of.candidate.of);
        t
    }

    /// What a shape offers at the best point of its grid.
    fn weigh_shaped(&self, of: &Weighed<'_>, shape: &Arc<dyn Shape>) -> Option<Term> {
        // One that is all of its effect stands in the place of the other terms, and has to be worth the parameter.
        let replaced = Self::replaced(of.state, of.candidate.effect.id(), shape.as_ref());
        let of_others = |t: &&Term| !replaced.contains(&t.candidate);
        let others = of.state.terms.iter().filter(of_others);
        let others: Vec<usize> = others.flat_map(|t| t.columns.iter().copied()).collect();
        let (at, columns, lr) = of
            .candidate
            .grid
            .iter()
            .map(|(at, c)| {
                (
                    *at,
                    c,
                    2.0 * (self
                        .panel
                        .profile(of.walks, &[others.clone(), c.clone()].concat())
                        - of.null),
                )
            })
            .max_by(|a, b| a.2.total_cmp(&b.2))?;
        let names: Vec<_> = shape.columns(at).iter().map(|c| c.parameter).collect();
        let limit = of.candidate.limit_of_shape(names.len());
        let earned = of.state.terms.iter().filter(|t| !of_others(t));
        let earned = earned.map(|t| t.threshold).sum::<f64>();
        let limit = if earned > 0.0 {
            limit - earned + RIVAL_SPAN
        } else {
            limit
        };
        // Between the points of the grid it may be much better: what is a rival is weighed at its best.
        let near = earned > 0.0 || lr > limit;
        let lr = if near {
            lr.max(2.0 * (self.between(of.walks, &others, shape.as_ref(), at) - of.null))
        } else {
            lr
        };
        let form = Form::Shaped(Arc::clone(shape), at);
        let mut t = of.term(form, columns.clone(), names, lr, limit);
        t.follows = shape.follows().map(str::to_owned);
        t.of.clone_from(&of.candidate.of);
        Some(t)
    }

    /// Candidates of the terms whose place a shape of `effect` takes.
    pub(super) fn replaced(state: &State, effect: &str, shape: &dyn Shape) -> Vec<usize> {
        let own = |t: &&Term| shape.whole() && t.effect.id() == effect;
        let own = state.terms.iter().filter(own);
        own.map(|t| t.candidate).collect()
    }

    /// What a step offers at its best time.
    fn weigh_step(&self, of: &Weighed<'_>) -> Option<Term> {
        let n = self.panel.bins.n;
        let settled = of.state.noise.settles(&self.panel.bins);
        let margin = (0.5 * self.view.rate_hz).max(4.0).max(settled);
        let noises: Vec<Noise> = of.walks.iter().step_by(2).map(|w| w.0.clone()).collect();
        let curve = scan::steps(&self.panel, &noises, &of.own, of.null);
        let inside: Vec<_> = curve
            .into_iter()
            .filter(|(t, _)| *t >= margin && *t <= n as f64 - margin)
            .collect();
        let (at, lr) = inside.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let weight = |l: f64| ((l - lr) / 2.0).exp();
        let near = |t: f64| (t - at).abs() < 0.1 * n as f64;
        let (mut sum, mut square) = (0.0, 0.0);
        for (t, l) in inside.iter().filter(|(t, _)| near(*t)) {
            sum += weight(*l);
            square += weight(*l) * (t - at).powi(2);
        }
        let error = (square / sum).sqrt().max(0.5);
        Some(of.term(
            Form::Step(at, error),
            vec![],
            vec!["height"],
            lr,
            threshold::step(n),
        ))
    }

    /// What a line offers at its best frequency.
    fn weigh_line(&self, of: &Weighed<'_>) -> Option<Term> {
        let n = self.panel.bins.n;
        let least = (2.0 * LEAST_CYCLES) as usize;
        let (k, lr) = scan::best_line(
            &self.panel,
            &of.state.noise,
            &of.own,
            &of.state.solution,
            least,
        )?;
        let omega = std::f64::consts::PI * k as f64 / n as f64;
        Some(of.term(
            Form::Line(omega),
            vec![],
            vec!["cosine", "sine"],
            lr,
            threshold::line(n),
        ))
    }

    /// What side bands of the first line offer at their best distance.
    fn weigh_side_bands(&self, of: &Weighed<'_>) -> Option<Term> {
        let n = self.panel.bins.n;
        let (carrier, phase) = of.state.carrier()?;
        let lr = scan::beats(
            &self.panel,
            &of.state.noise,
            &of.own,
            &of.state.solution,
            carrier,
            phase,
        );
        let slow = self.slow_beats();
        let bin = std::f64::consts::PI / n as f64;
        let fastest = (FASTEST_BEAT * carrier / bin) as usize;
        let limit = |d: usize| threshold::side_bands(if d <= slow { slow } else { n });
        let margin = |d: usize| lr[d] - limit(d);
        let d = ((2.0 * LEAST_BEATS) as usize..=slow.max(fastest).min(n - 1))
            .filter(|d| carrier > bin * (d + 1) as f64)
            .filter(|d| carrier + bin * (d + 1) as f64 <= std::f64::consts::PI)
            .max_by(|a, b| margin(*a).total_cmp(&margin(*b)))?;
        Some(of.term(
            Form::SideBands(carrier, d as f64 * bin),
            vec![],
            vec!["cosine", "sine", "in_phase", "quadrature"],
            lr[d],
            limit(d),
        ))
    }

    /// What a stationary term offers from the best of its starts.
    fn weigh_covariance(&self, of: &Weighed<'_>, c: &Arc<dyn Covariance>) -> Option<Term> {
        let n = self.panel.bins.n;
        let limit = threshold::covariance(c.dimensions());
        let grid = c.grid();
        let reason = match grid.is_empty() {
            false => {
                let all = self.correlations(of.state, FAR);
                all.map(|r| n as f64 * r * r).fold(0.0, f64::max)
            }
            true if c.dimensions() > scoring::FEW => self.neighbours(of.state, c.dimensions()),
            true => limit,
        };
        if reason < limit {
            return None;
        }
        let beside = |theta: Vec<f64>| {
            let mut noise = of.state.noise.clone();
            noise.terms.push((Arc::clone(c), theta));
            noise
        };
        let starts: Vec<Noise> = if grid.is_empty() {
            c.starts(n).into_iter().map(beside).collect()
        } else {
            let all = grid
                .into_iter()
                .flat_map(|theta| self.panel.walks(&beside(theta)));
            self.panel.likeliest(all, &of.own).into_iter().collect()
        };
        let best = starts
            .into_iter()
            .map(|noise| self.panel.fit(&noise, &of.own))
            .max_by(|a, b| a.1.log_likelihood.total_cmp(&b.1.log_likelihood))?;
        let lr = self.of_read() * 2.0 * (best.1.log_likelihood - of.null);
        let theta = (best.0.terms.last().map(|t| t.1.clone())).filter(|theta| c.claims(theta))?;
        Some(of.term(
            Form::Covariance(Arc::clone(c), theta),
            vec![],
            vec![],
            lr,
            limit,
        ))
    }

    /// What a stationary term that stands at a lag offers at the one where the readings correlate most. Neighbours are those of
    /// the library's.
    fn weigh_at_lag(&self, of: &Weighed<'_>, c: &Arc<dyn Covariance>) -> Option<Term> {
        let n = self.panel.bins.n;
        let limit = threshold::at_lag(FAR - 1) + of.candidate.handicap;
        let all = self.correlations(of.state, FAR).zip(1..).skip(1);
        let (at, lag) = all.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?;
        if n as f64 * at * at < limit {
            return None;
        }
        let (located, theta) = c.at_lag(lag, at)?;
        let mut noise = of.state.noise.clone();
        noise.terms.push((Arc::clone(&located), theta));
        let (noise, solution) = self.panel.fit(&noise, &of.own);
        let theta = noise.terms.last()?.1.clone();
        let lr = self.of_read() * 2.0 * (solution.log_likelihood - of.null);
        Some(of.term(Form::Covariance(located, theta), vec![], vec![], lr, limit))
    }

    /// What the correlations of a state's residual at the first `lags` lags say against white noise, chi-square of as many degrees.
    pub(super) fn neighbours(&self, state: &State, lags: usize) -> f64 {
        let n = self.panel.bins.n as f64;
        self.correlations(state, lags).map(|r| n * r * r).sum()
    }

    /// The correlation at each lag.
    fn correlations(&self, state: &State, lags: usize) -> impl Iterator<Item = f64> {
        let bins = &self.panel.bins;
        let energy = self
            .panel
            .energy_left(&state.columns(), &state.solution.beta);
        let g = state.noise.over(bins);
        let off: Vec<f64> = (energy.iter().zip(&g).zip(bins.counts()))
            .map(|((e, g), m)| e / (g * state.solution.white) - m)
            .collect();
        let n = bins.n as f64;
        let cosines = bins.at.cosine.clone();
        // Cosines of multiples of an angle, by recurrence.
        let mut now = cosines.clone();
        let mut before = vec![1.0; now.len()];
        let mut next = move || {
            let at = off.iter().zip(&now).map(|(o, c)| o * c).sum::<f64>() / n;
            for ((now, before), c) in now.iter_mut().zip(&mut before).zip(&cosines) {
                (*now, *before) = (2.0 * c * *now - *before, *now);
            }
            at
        };
        (0..lags).map(move |_| next())
    }

    /// Fastest slow swing of a line, half cycles in the record.
    pub(crate) fn slow_beats(&self) -> usize {
        (2.0 * SLOW_BEAT_HZ / self.view.rate_hz * self.panel.bins.n as f64) as usize
    }

    /// Highest log likelihood of a shape near the point `at` of its grid.
    fn between(
        &self,
        walks: &[(Noise, Vec<f64>, f64)],
        own: &[usize],
        shape: &dyn Shape,
        at: f64,
    ) -> f64 {
        const STEPS: usize = 6;
        let width = self.panel.width();
        let minus_l = |x: f64| {
            let columns = shape.columns(x.exp()).into_iter().map(|c| c.values);
            let added = self.panel.add_all(columns);
            let l = self.panel.profile(walks, &[own, &added].concat());
            self.panel.truncate(width);
            -l
        };
        let (low, high) = crate::fit::delayed::neighbours(&shape.grid(), at);
        let best = numerics::minimise::golden(&minus_l, low.ln(), high.ln(), STEPS);
        -minus_l(best)
    }

    /// Whether a candidate may still join.
    pub(super) fn open(&self, state: &State, i: usize) -> bool {
        let c = &self.candidates[i];
        match &c.hypothesis {
            Hypothesis::Step => !self.view.moving,
            Hypothesis::Line => !self.view.moving && !self.view.sways(),
            Hypothesis::SideBands => state.terms.iter().all(|t| t.candidate != i),
            Hypothesis::Covariance(of) => {
                !self.view.moving
                    && !self.view.sways()
                    && if of.is_peak() {
                        Self::open_to_bands(state)
                    } else if c.is_nameless() {
                        state.terms.iter().all(|t| t.candidate != i)
                    } else {
                        state.terms.iter().all(|t| t.effect.id() != c.effect.id())
                    }
            }
            Hypothesis::Regression(r) => {
                let other = |t: &Term| r.columns.iter().all(|c| !t.names.contains(&c.parameter));
                !self.view.moving
                    && state.terms.iter().all(|t| {
                        t.effect.id() != c.effect.id() || t.follows != r.follows || other(t)
                    })
            }
            Hypothesis::Shaped(s) => {
                let extended = |t: &Term| s.whole() && t.effect.extends() == Some(c.effect.id());
                let closed = |t: &Term| t.candidate == i || extended(t);
                !self.view.moving && !state.terms.iter().any(closed)
            }
            _ => false,
        }
    }

    /// What every open candidate offers, those that extend a term in its place.
    pub(crate) fn offers(&self, state: &State, allow: &dyn Fn(&Candidate) -> bool) -> Vec<Term> {
        let walks = self.panel.walks(&state.noise);
        (0..self.candidates.len())
            .filter(|i| allow(&self.candidates[*i]) && self.open(state, *i))
            .filter_map(|i| self.offer(state, &walks, i))
            .filter(|t| t.lr.is_finite())
            .collect()
    }

    /// As [`Search::weigh`]; the search comes back to states without processes, term by term, and is told what it was.
    fn offer(&self, state: &State, walks: &[(Noise, Vec<f64>, f64)], i: usize) -> Option<Term> {
        if !state.noise.terms.is_empty() {
            return self.weigh(state, walks, i);
        }
        let terms = state.terms.iter().map(|t| (t.candidate, t.columns.clone()));
        let (data, walk) = (self.panel.revision(), state.noise.log_walk.to_bits());
        let place = (data, walk, terms.collect());
        let known =
            |all: &HashMap<_, HashMap<usize, Option<Term>>>| all.get(&place)?.get(&i).cloned();
        let known = known(&self.offered.borrow());
        known.unwrap_or_else(|| {
            let new = self.weigh(state, walks, i);
            let mut all = self.offered.borrow_mut();
            all.entry(place).or_default().insert(i, new.clone());
            new
        })
    }
}
