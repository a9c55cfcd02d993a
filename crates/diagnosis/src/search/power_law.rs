//! One power law against the stationary processes of an answer.
//!
//! A bias that comes back has a shoulder in its spectrum, flicker noise a slope of -1. A noise whose density falls as
//! w^-gamma with another gamma, as fractional noise and the sum of many relaxations do, has neither: over the decades
//! of a record a shoulder and a slope together come so near it that no check of the spectrum sees what is off. Where
//! one power law explains as much with less freedom, or clearly more with as much, their names are no answer.

use std::sync::Arc;

use model::effect::{Covariance, Frequencies, Hypothesis};

use crate::fit::channel::{Form, PowerLawFound, State, Term};
use crate::search::Search;

/// Exponents from next to white to next to a random walk, which the noise has anyway.
const EXPONENTS: (f64, f64) = (0.05, 1.95);
/// That of flicker noise, and nats by which another one has to be better than it, and than what has no more freedom:
/// within them the answer stays open, and what has a name goes first.
const FLICKER: f64 = 1.0;
const OPEN: f64 = 3.0;

/// Density a (2 sin(w/2))^-gamma over the white one. Coordinates: ln a, gamma.
struct PowerLaw {
    /// Least and largest gamma.
    exponents: (f64, f64),
}

impl Covariance for PowerLaw {
    fn dimensions(&self) -> usize {
        2
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        let of = |w: &f64| (theta[0] - theta[1] * (2.0 * (0.5 * w).sin()).ln()).exp();
        at.omega.iter().map(of).collect()
    }

    fn bounds(&self, _samples: usize) -> Vec<(f64, f64)> {
        vec![(-18.0, 6.0), self.exponents]
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        vec![vec![0.0, 0.5], vec![-4.5, 1.0], vec![-6.0, 1.4]]
    }
}

/// The one power law that explains a state as well as its processes do, each coordinate that they have
/// beyond its two paid for by half the logarithm of the record's length (BIC), and clearly better than flicker noise in its
/// place.
pub(crate) fn instead(search: &Search<'_>, state: &State) -> Option<PowerLawFound> {
    let processes = || {
        state.terms.iter().filter_map(|t| match &t.form {
            Form::Covariance(c, theta) if !c.is_peak() && c.lag(theta).is_none() => Some((t, c)),
            _ => None,
        })
    };
    let coordinates = |filter: bool| -> usize {
        let held = processes().filter(|(_, c)| filter || !c.filters_white());
        held.map(|(_, c)| c.dimensions()).sum()
    };
    let two_level = |t: &Term| {
        let hypothesis = &search.candidates[t.candidate].hypothesis;
        matches!(hypothesis, Hypothesis::TwoLevel)
    };
    const COORDINATES: usize = 2;
    // Flicker noise alone is a power law itself, whose slope its own claim asks for; two levels have their contest.
    let none = !processes().any(|(_, c)| !c.filters_white());
    if none || processes().any(|(t, _)| two_level(t)) {
        return None;
    }
    let n = search.panel.bins.n;
    let columns = state.columns();
    let fitted = |filter: bool, exponents: (f64, f64)| {
        let law: Arc<dyn Covariance> = Arc::new(PowerLaw { exponents });
        let mut kept = state.noise.clone();
        kept.terms.retain(|(c, theta)| {
            c.is_peak() || c.lag(theta).is_some() || !filter && c.filters_white()
        });
        let fits = law.starts(n).into_iter().map(|theta| {
            let mut noise = kept.clone();
            noise.terms.push((Arc::clone(&law), theta));
            search.panel.fit(&noise, &columns)
        });
        let (noise, best) =
            fits.max_by(|a, b| a.1.log_likelihood.total_cmp(&b.1.log_likelihood))?;
        let exponent = noise.terms.last().map(|(_, theta)| theta[1])?;
        Some((best.log_likelihood, exponent))
    };
    let by = |filter: bool| {
        if coordinates(filter) < COORDINATES {
            return None;
        }
        let paid = 0.5 * (coordinates(filter) - COORDINATES) as f64 * (n as f64).ln();
        let (best, exponent) = fitted(filter, EXPONENTS)?;
        // Of as much freedom as the named ones it has to be clearly better; less freedom is paid for already.
        let asked = if paid > 0.0 { 0.0 } else { OPEN };
        if best - state.solution.log_likelihood + paid < asked {
            return None;
        }
        let (flicker, _) = fitted(filter, (FLICKER, FLICKER))?;
        (best - flicker > OPEN).then_some((best + paid, PowerLawFound { exponent, filter }))
    };
    let filtered = coordinates(true) > coordinates(false);
    let sides = [Some(false), Some(true).filter(|_| filtered)];
    let found = sides.into_iter().flatten().filter_map(by);
    found
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, found)| found)
}
