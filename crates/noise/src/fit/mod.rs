//! N, B, K, Q and R of a record by exact likelihood, with intervals.
//!
//! White noise, random walk and a constant are always in the model. Flicker, quantization noise of the angle and a ramp
//! enter when the likelihood asks for them: white noise alone gets no bias instability. Values are those of the model
//! chosen. Intervals are profile likelihoods of the model that has *every* term, the ramp integrated out: what the
//! record does not establish may be there all the same, and has to be allowed for. The interval of the ramp is averaged
//! over the random walk, because the two hide each other and a plug-in interval is too narrow.
//!
//! ```
//! use noise::fit::{Spectrum, Term, fit};
//! use noise::synthetic::Truth;
//! use rand_core::SeedableRng;
//!
//! let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
//! let truth = Truth { n: 0.05, ..Truth::default() };
//! let readings = truth.record(12_000, 0.05, &mut rng);
//! let fitted = fit(&Spectrum::of(&readings, &[0..12_000], 0.05));
//! let n = fitted.term(Term::White);
//! assert!((n.value.unwrap() - 0.05).abs() < 4.0 * n.std_error.unwrap());
//! // What is not there has an upper limit and no value.
//! assert_eq!(fitted.term(Term::Flicker).value, None);
//! ```

mod band;
mod likelihood;
mod replicate;
mod spectrum;

pub use band::{Described, fit_described};
pub use likelihood::{Maximum, Model, Ramp};
pub use replicate::{Misfit, misfit, replicate};
pub use spectrum::{Bin, Coefficients, Spectrum, Term, model_allan_variance};

use statrs::distribution::{ContinuousCDF, Normal};

use likelihood::{maximize, profile_interval, ramp_given};

/// Half of χ²(1) at 95 %: the fall of the log likelihood at the ends of an interval, nats.
const DROP_95: f64 = 1.920_73;

/// The same at 90 %, of the model chosen: with few misses below the interval of the full model, 5 % above are right.
const DROP_90: f64 = 1.352_77;

/// Likelihood ratio from which the random walk, always in the model, is given as a value: 2.5 % where there is none.
const ESTABLISHES_WALK: f64 = 3.84;

/// Likelihood ratio a further variance needs to enter: chance 1e-4 where there is none, the boundary counted (half the
/// mass of the ratio is at 0).
const ENTER_VARIANCE: f64 = 13.8;

/// The same for the ramp, two-sided.
const ENTER_RAMP: f64 = 15.1;

/// An estimate with its 95 % interval, in IEEE Std 952 letters and the channel's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimated {
    /// `None` where the record does not establish the term.
    pub value: Option<f64>,
    /// Half the interval over 1.96; `None` without a value.
    pub std_error: Option<f64>,
    /// Lower end; 0 without a value.
    pub low: f64,
    /// Upper end; without a value the upper limit (of the magnitude, for the ramp).
    pub high: f64,
}

impl Estimated {
    /// A value with the ends of its 95 % interval.
    fn within(value: f64, low: f64, high: f64) -> Self {
        Self {
            value: Some(value),
            std_error: Some((high - low) / (2.0 * 1.959_964)),
            low,
            high,
        }
    }

    /// A term that is not established, with its upper limit.
    fn limit(high: f64) -> Self {
        Self {
            value: None,
            std_error: None,
            low: 0.0,
            high,
        }
    }
}

/// A fit of the noise terms.
#[derive(Clone, Debug, PartialEq)]
pub struct NoiseFit {
    /// Which terms are in the model.
    pub model: Model,
    /// Its maximum.
    pub maximum: Maximum,
    /// N, B, K, Q in the order of [`Term::ALL`].
    pub terms: [Estimated; 4],
    /// R, U/s.
    pub rate_ramp: Estimated,
    /// Sample interval, s.
    pub tau0: f64,
}

impl NoiseFit {
    /// One of the variance terms.
    #[must_use]
    pub fn term(&self, term: Term) -> Estimated {
        self.terms[term as usize]
    }

    /// Part of white noise in the Allan variance of the fitted model at `m`, 0..1.
    #[must_use]
    pub fn white_share(&self, m: usize) -> f64 {
        let [white, ..] = self.maximum.coefficients;
        (white / m as f64 / self.deviation(m).powi(2)).min(1.0)
    }

    /// The same in the modified Allan variance: N²/2τ, 0.675 of the flicker's Allan variance, 33/40 of the
    /// walk's, 3Q²/mτ² and the whole of the ramp's (NIST SP 1065, table 5, for large m).
    #[must_use]
    pub fn white_share_modified(&self, m: usize) -> f64 {
        let tau = m as f64 * self.tau0;
        let [n, b, k, q] = Term::ALL.map(|t| {
            t.letter(self.maximum.coefficients[t as usize], self.tau0)
                .powi(2)
        });
        let white = if m == 1 { n / tau } else { n / tau / 2.0 };
        let flicker = 0.675 * b * 2.0 * std::f64::consts::LN_2 / std::f64::consts::PI;
        let walk = 33.0 / 40.0 * k * tau / 3.0;
        let ramp = (self.maximum.ramp * tau).powi(2) / 2.0;
        let all = white + flicker + walk + 3.0 * q / (tau * tau * m as f64) + ramp;
        if all > 0.0 { white / all } else { 1.0 }
    }

    /// The same in the Hadamard variance: N²/τ, B²·ln(256/27)/2π, K²τ/6 and 10Q²/3τ²; no ramp.
    #[must_use]
    pub fn white_share_hadamard(&self, m: usize) -> f64 {
        let tau = m as f64 * self.tau0;
        let [n, b, k, q] = Term::ALL.map(|t| {
            t.letter(self.maximum.coefficients[t as usize], self.tau0)
                .powi(2)
        });
        let white = n / tau;
        let flicker = b * (256.0f64 / 27.0).ln() / (2.0 * std::f64::consts::PI);
        let all = white + flicker + k * tau / 6.0 + 10.0 / 3.0 * q / (tau * tau);
        if all > 0.0 { white / all } else { 1.0 }
    }

    /// The same in Theo1 with τ = 0.75·m·τ₀: N²/τ, 1/1.87 of the flicker's Allan variance, 10/27 of the walk's, 11/81·R²τ² and
    /// 4Q²(ln(m/2) + γ)/(0.75 m²τ₀²): the sums of its definition for large m.
    #[must_use]
    pub fn white_share_theo1(&self, m: usize) -> f64 {
        const EULER: f64 = 0.577_216;
        let (mf, tau) = (m as f64, 0.75 * m as f64 * self.tau0);
        let [n, b, k, q] = Term::ALL.map(|t| {
            t.letter(self.maximum.coefficients[t as usize], self.tau0)
                .powi(2)
        });
        let white = n / tau;
        let flicker = b * 2.0 * std::f64::consts::LN_2 / std::f64::consts::PI / 1.87;
        let walk = 10.0 / 27.0 * k * tau / 3.0;
        let ramp = 11.0 / 81.0 * (self.maximum.ramp * tau).powi(2);
        let quantized = 4.0 * q * ((mf / 2.0).ln() + EULER) / (0.75 * (mf * self.tau0).powi(2));
        let all = white + flicker + walk + quantized + ramp;
        if all > 0.0 { white / all } else { 1.0 }
    }

    /// Allan deviation of the fitted model at `m`, U.
    #[must_use]
    pub fn deviation(&self, m: usize) -> f64 {
        model_allan_variance(&self.maximum.coefficients, self.maximum.ramp, self.tau0, m).sqrt()
    }
}

/// Every term at once.
const EVERYTHING: Model = Model {
    terms: [true; 4],
    ramp: Ramp::Restricted,
};

/// Fit the terms to a spectrum: of a record in unit U, N in U·√s, B in U, K in U/√s, Q in U·s, R in U/s.
///
/// Values are those of the chosen model, intervals (95 %) those of the model with all terms, by profile likelihood.
#[must_use]
pub fn fit(spectrum: &Spectrum) -> NoiseFit {
    let (model, maximum) = choose(spectrum);
    let tau0 = spectrum.tau0;
    let without_walk = Model {
        terms: without(model.terms, Term::RandomWalk),
        ..model
    };
    let walk_established = 2.0
        * (maximum.log_likelihood - maximize(spectrum, without_walk, None, None).log_likelihood)
        > ESTABLISHES_WALK;
    let top = maximize(spectrum, EVERYTHING, None, None);
    let terms = Term::ALL.map(|term| {
        let t = term as usize;
        let (low, high) = profile_interval(spectrum, EVERYTHING, t, &top, DROP_95);
        let (low, high) = (term.letter(low, tau0), term.letter(high, tau0));
        let established = match term {
            Term::RandomWalk => walk_established,
            _ => model.terms[t],
        };
        if established {
            // The value is the chosen model's, which the interval of the full one may end at or miss: other terms can only
            // take from this one, so its upper end is where they are nothing. The chosen model's own interval is within.
            let value = term.letter(maximum.coefficients[t], tau0);
            let own = profile_interval(spectrum, model, t, &maximum, DROP_90);
            let low = low.min(term.letter(own.0, tau0));
            let high = high.max(term.letter(own.1, tau0));
            Estimated::within(value, low, high)
        } else {
            Estimated::limit(high)
        }
    });
    let rate_ramp = ramp_interval(
        spectrum,
        model,
        &maximum,
        terms[Term::RandomWalk as usize].high,
    );
    NoiseFit {
        model,
        maximum,
        terms,
        rate_ramp,
        tau0,
    }
}

/// The model that the record asks for, and its maximum.
fn choose(spectrum: &Spectrum) -> (Model, Maximum) {
    let mut model = Model {
        terms: [true, false, true, false],
        ramp: Ramp::Absent,
    };
    let mut maximum = maximize(spectrum, model, None, None);
    loop {
        let mut candidates = vec![];
        for term in [Term::Flicker, Term::Quantization] {
            if !model.terms[term as usize] {
                let terms = with(model.terms, term);
                candidates.push((Model { terms, ..model }, ENTER_VARIANCE));
            }
        }
        if model.ramp == Ramp::Absent {
            let ramp = Ramp::Profiled;
            candidates.push((Model { ramp, ..model }, ENTER_RAMP));
        }
        let best = candidates
            .into_iter()
            .map(|(candidate, threshold)| {
                let found = maximize(spectrum, candidate, None, None);
                let ratio = 2.0 * (found.log_likelihood - maximum.log_likelihood);
                (ratio - threshold, candidate, found)
            })
            .max_by(|a, b| a.0.total_cmp(&b.0));
        match best {
            Some((score, candidate, found)) if score > 0.0 => {
                (model, maximum) = (candidate, found);
                if model.ramp == Ramp::Profiled {
                    model.ramp = Ramp::Restricted;
                    maximum = maximize(spectrum, model, None, Some(&found.coefficients));
                }
            }
            _ => return (model, maximum),
        }
    }
}

fn without(mut terms: [bool; 4], term: Term) -> [bool; 4] {
    terms[term as usize] = false;
    terms
}

fn with(mut terms: [bool; 4], term: Term) -> [bool; 4] {
    terms[term as usize] = true;
    terms
}

/// The ramp averaged over the random walk: normal for each K, K weighted by its restricted likelihood on an even grid.
fn ramp_interval(spectrum: &Spectrum, model: Model, maximum: &Maximum, k_high: f64) -> Estimated {
    const POINTS: usize = 24;
    let walk = Term::RandomWalk as usize;
    let with_ramp = Model {
        ramp: Ramp::Restricted,
        ..model
    };
    let mut start = maximum.coefficients;
    let parts: Vec<(f64, f64, f64)> = (0..POINTS)
        .map(|i| {
            let k = 1.5 * k_high * i as f64 / (POINTS - 1) as f64;
            let q = Term::RandomWalk.coefficient(k, spectrum.tau0);
            start[walk] = q;
            let found = maximize(spectrum, with_ramp, Some((walk, q)), Some(&start));
            start = found.coefficients;
            let (mean, precision) = ramp_given(spectrum, &found.coefficients);
            (found.log_likelihood, mean, precision.sqrt().recip())
        })
        .collect();
    let top = parts.iter().map(|p| p.0).fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = parts.iter().map(|p| (p.0 - top).exp()).collect();
    let total: f64 = weights.iter().sum();
    let standard = Normal::standard();
    let cdf = |x: f64| {
        parts
            .iter()
            .zip(&weights)
            .map(|(p, w)| w * standard.cdf((x - p.1) / p.2))
            .sum::<f64>()
            / total
    };
    let widest = parts
        .iter()
        .map(|p| p.1.abs() + 8.0 * p.2)
        .fold(0.0, f64::max);
    let quantile = |target: f64| {
        let (mut a, mut b) = (-widest, widest);
        for _ in 0..60 {
            let middle = 0.5 * (a + b);
            if cdf(middle) < target {
                a = middle;
            } else {
                b = middle;
            }
        }
        0.5 * (a + b)
    };
    let (low, high) = (quantile(0.025), quantile(0.975));
    if model.ramp != Ramp::Absent && low * high > 0.0 {
        Estimated::within(quantile(0.5), low, high)
    } else {
        Estimated::limit(high.abs().max(low.abs()))
    }
}

#[cfg(test)]
mod tests;
