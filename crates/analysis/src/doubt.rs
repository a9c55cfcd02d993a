//! Names that the record does not bear out.
//!
//! Lines, steps, ramps and stationary processes can stand for a part of almost anything. Where a check still fails on
//! the model that holds them, and in the place where they act, they are the library's nearest description of something
//! else: they stay in the model, and the answer tells them as what is unexplained comes closest to.
//!
//! What follows a recorded channel does so by a shape that the library has of it. A shape that is off by a part e of its
//! size leaves e^2 of its likelihood ratio to others: a generic term beside it that holds no more than that is as likely
//! a remainder of the shape as a cause of its own.

use crate::beyond;
use crate::checks::{self, LEAST_CHANCE};
use crate::diagnosis::Searched;
use crate::result::{Finding, Unexplained};
use crate::search::{Form, Term};

/// Share of a term's energy in bands that fail, from which on the failure is the term's.
const SHARE: f64 = 0.25;

/// Share of what a shape explains that it may leave to others: it is off by a seventh of its size.
const REMAINDER: f64 = 0.02;
/// The same for a combination of channels that stands for a cause without a name: off by half.
const REMAINDER_BEYOND: f64 = 0.25;

/// Why a name is not given.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Doubt {
    No,
    /// A check fails where the term acts.
    Checks,
    /// It holds this share of what the effect explains that follows a channel beside it.
    Remainder(&'static str, f64),
}

/// What the terms of each effect that follow a recorded channel explain together: chi-square of their joint signal.
fn followers(s: &Searched<'_>, g: &[f64]) -> Vec<(&'static str, f64)> {
    let panel = &s.search.panel;
    let mut signals: Vec<(&'static str, Vec<f64>)> = vec![];
    let mut at = 0;
    for t in &s.state.terms {
        let own = &s.state.solution.beta[at..at + t.columns.len()];
        at += t.columns.len();
        let id = t.effect.id();
        let shaped = matches!(t.form, Form::Shaped(..)) && signals.iter().any(|x| x.0 == id);
        if t.follows.is_none() && !shaped {
            continue;
        }
        let place = signals.iter().position(|x| x.0 == id).unwrap_or_else(|| {
            signals.push((id, vec![0.0; panel.bins.n]));
            signals.len() - 1
        });
        for (c, b) in t.columns.iter().zip(own) {
            let column = panel.column(*c);
            let signal = signals[place].1.iter_mut();
            signal.zip(column.iter()).for_each(|(s, x)| *s += b * x);
        }
    }
    signals
        .into_iter()
        .map(|(id, signal)| {
            let energy = panel.bins.products(&signal, &signal);
            let sum: f64 = energy.iter().zip(g).map(|(e, g)| e / g).sum();
            (id, sum / s.state.solution.white)
        })
        .collect()
}

/// Whether a term is a shape of time or frequency alone, which follows no recorded channel.
fn generic(t: &Term) -> bool {
    t.follows.is_none()
}

/// For each term of a channel, whether the checks doubt it; and whether they doubt the law of its variance.
fn doubted(s: &Searched<'_>, failing: &dyn Fn(&str) -> bool) -> (Vec<Doubt>, bool) {
    let panel = &s.search.panel;
    let g = s.state.noise.over(&panel.bins);
    let n = panel.bins.n as f64;
    let fails: Vec<(f64, f64)> = checks::all_bands(&s.u)
        .into_iter()
        .filter(|b| b.chance < LEAST_CHANCE)
        .map(|b| (b.from as f64, b.to as f64))
        .collect();
    let inside: Vec<bool> = panel
        .bins
        .at
        .omega
        .iter()
        .map(|w| {
            let k = w * n / std::f64::consts::PI;
            fails.iter().any(|(from, to)| k >= *from && k < *to)
        })
        .collect();
    let share = |energy: &[f64]| {
        let all: f64 = energy.iter().zip(&g).map(|(e, g)| e / g).sum();
        let hit: f64 = energy
            .iter()
            .zip(&g)
            .zip(&inside)
            .filter(|(_, i)| **i)
            .map(|((e, g), _)| e / g)
            .sum();
        all > 0.0 && hit > SHARE * all
    };
    let crowd = !s.state.notes.is_empty();
    let correlated = failing("ljung_box");
    let unsteady = checks::unsteady(&s.e);
    let wanders = |omega: f64| {
        let at = omega / std::f64::consts::PI;
        unsteady.iter().any(|(from, to)| at >= *from && at < *to)
    };
    let followed = followers(s, &g);
    let remainder = |t: &Term| {
        followed
            .iter()
            .filter(|f| f.0 != t.effect.id())
            .map(|(id, all)| (*id, t.lr / all))
            .filter(|(id, share)| {
                let most = if *id == beyond::ID {
                    REMAINDER_BEYOND
                } else {
                    REMAINDER
                };
                *share < most
            })
            .min_by(|a, b| a.1.total_cmp(&b.1))
    };
    let mut at = 0;
    let terms = s
        .state
        .terms
        .iter()
        .map(|t| {
            let own = &s.state.solution.beta[at..at + t.columns.len()];
            at += t.columns.len();
            let in_band = if t.columns.is_empty() {
                !fails.is_empty()
            } else {
                let mut sum = vec![0.0; panel.bins.n];
                for (c, b) in t.columns.iter().zip(own) {
                    sum.iter_mut()
                        .zip(panel.column(*c).iter())
                        .for_each(|(s, x)| *s += b * x);
                }
                share(&panel.bins.products(&sum, &sum))
            };
            let elsewhere = match &t.form {
                Form::Covariance(..) => correlated || !unsteady.is_empty(),
                Form::Line(omega) | Form::SideBands(omega, _) => wanders(*omega),
                _ => false,
            };
            let line = matches!(t.form, Form::Line(_) | Form::SideBands(..));
            if line && s.state.wandering {
                Doubt::No
            } else if in_band || generic(t) && (crowd || elsewhere) {
                Doubt::Checks
            } else if let Some((id, share)) = remainder(t).filter(|_| generic(t) && !line) {
                Doubt::Remainder(id, share)
            } else {
                Doubt::No
            }
        })
        .collect();
    // What is left over in the mean or the spectrum comes and goes, and its squares with it.
    let variance = failing("variance_in_time")
        || failing("kurtosis")
        || correlated
        || failing("time_frequency")
        || crowd;
    (terms, variance)
}

/// Take the doubted names of a channel out of its findings, given as one for each term and then the rest; what follows a
/// combination without a name goes the same way.
pub(crate) fn withdraw(
    s: &Searched<'_>,
    of_terms: Vec<Finding>,
    of_variance: Option<Finding>,
    failing: &dyn Fn(&str) -> bool,
) -> (Vec<Finding>, Vec<Finding>, Vec<Unexplained>) {
    let (terms, variance) = doubted(s, failing);
    let name = s.target.name.as_str();
    let mut unexplained = vec![];
    let (mut kept, mut nearest, mut beside) = (vec![], vec![], vec![]);
    for ((finding, doubt), term) in of_terms.into_iter().zip(terms).zip(&s.state.terms) {
        if term.effect.id() == beyond::ID {
            unexplained.push(Unexplained {
                channel: name.into(),
                what: format!(
                    "follows the {}, which no effect of the library does (likelihood ratio {:.0})",
                    term.follows.as_deref().unwrap_or_default(),
                    term.lr
                ),
            });
        } else {
            match doubt {
                Doubt::No => kept.push(finding),
                Doubt::Checks => nearest.push(finding),
                Doubt::Remainder(of, share) => {
                    let of = if of == beyond::ID { "that" } else { of };
                    unexplained.push(Unexplained {
                        channel: name.into(),
                        what: format!(
                            "beside {of}, with {:.1} % of what it explains, and as likely a part of it that its shape leaves out: {}",
                            100.0 * share,
                            finding.what
                        ),
                    });
                    beside.push(finding);
                }
            }
        }
    }
    match of_variance {
        Some(finding) if variance => nearest.push(finding),
        other => kept.extend(other),
    }
    if !nearest.is_empty() {
        let told: Vec<&str> = nearest.iter().map(|f| f.what.as_str()).collect();
        unexplained.push(Unexplained {
            channel: name.into(),
            what: format!(
                "nearest in the library, though checks fail on it: {}",
                told.join("; ")
            ),
        });
    }
    nearest.extend(beside);
    (kept, nearest, unexplained)
}
