//! Names that the record does not bear out.
//!
//! Lines, steps, ramps and stationary processes can stand for a part of almost anything. Where a check still fails on
//! the model that holds them, and in the place where they act, they are the library's nearest description of something
//! else: they stay in the model, and the answer tells them as what is unexplained comes closest to.
//!
//! What follows a recorded channel does so by a shape that the library has of it. A shape that is off by a part e of its
//! size leaves e^2 of its likelihood ratio to others: a generic term beside it that holds no more than that, and gives way
//! where the shape may be late or bent, is as likely a remainder of the shape as a cause of its own.

mod facts;
mod of_band;
pub(crate) mod propagate;
mod rules;

use model::effects::effect;

use crate::fit::channel;
use crate::fit::channel::{PowerLawFound, Term};
use crate::result::Finding;
use crate::search::searched::Searched;
use crate::test_level::{CheckId, Observation};

use facts::Facts;
pub(crate) use facts::Left;
use propagate::Kin;
use rules::Seen;

/// Why a name is not given.
#[derive(Clone, Debug, PartialEq)]
enum Doubt {
    No,
    /// A check fails where the term acts.
    Checks,
    /// It is one of several lines that one motion makes; nothing is left beside them.
    OneMotion,
    /// It follows any smooth spectrum, and this one is no filter's.
    Spectrum,
    /// It swings at the frequency of the channel of this name, or is a shape of time beside what does: that follows late.
    Beside(String),
    /// It holds this share of what the effect explains that follows a channel beside it.
    Remainder(&'static str, f64),
}

/// For each term of a channel, whether its name is withdrawn; and for each law of its variance.
fn doubted(facts: &Facts<'_>) -> (Vec<Doubt>, Vec<bool>) {
    let parts = facts.s.state.parts();
    let seen = parts.map(|(term, own)| rules::doubt_of(facts, &Seen { term, own }));
    let mut terms: Vec<Doubt> = seen.collect();
    let variance = rules::variance_withdrawn(facts);
    let kin = Kin { facts, variance };
    kin.fall(&mut terms);
    let laws = facts.s.variance.each.iter();
    let falls = laws.map(|v| variance || kin.variance_falls(v, &terms));
    let falls = falls.collect();
    (terms, falls)
}

/// What the library comes nearest to a channel with.
pub(crate) fn nearest_of(channel: &str, all: &[Finding]) -> Observation {
    let told: Vec<&str> = all.iter().map(|f| f.what.as_str()).collect();
    let what = format!(
        "nearest in the library, though checks fail on it: {}",
        told.join("; ")
    );
    let titles = all.iter().filter_map(|f| effect(&f.cause));
    Observation {
        nearest: titles.map(|e| e.docs().title).collect(),
        ..Observation::of_noise(channel, what)
    }
}

/// The lines that one motion makes on a channel, the largest first.
fn lines_of_one_motion(channel: &str, all: &[Finding]) -> Observation {
    let size = |f: &Finding| f.parameters.get("amplitude").map_or(0.0, |p| p.value);
    let mut all: Vec<&Finding> = all.iter().collect();
    all.sort_by(|a, b| size(b).total_cmp(&size(a)));
    let told: Vec<&str> = all.iter().map(|f| f.what.as_str()).collect();
    let titles = all.iter().filter_map(|f| effect(&f.cause));
    let what = format!("the model has it as {}", told.join("; "));
    Observation {
        nearest: titles.map(|e| e.docs().title).collect(),
        lines: all.iter().map(|f| f.parameters.clone()).collect(),
        ..Observation::of_noise(channel, what)
    }
}

/// Places of the terms of a channel that have no name: those in doubt, parts of such a band, and combinations of channels.
fn fallen(s: &Searched<'_>, doubts: &[Doubt]) -> Vec<usize> {
    let all = || s.state.terms.iter().zip(doubts);
    let falls = |(term, doubt): &(&Term, &Doubt)| {
        !term.is_part() && (**doubt != Doubt::No || term.has_no_name())
    };
    let bands: Vec<f64> = (all().filter(falls))
        .filter_map(|(term, _)| term.cluster.map(|c| c.lr))
        .collect();
    let of_band = |term: &Term| term.cluster.is_some_and(|c| bands.contains(&c.lr));
    let places = all().enumerate();
    places
        .filter(|(_, pair)| falls(pair) || of_band(pair.0))
        .map(|(place, _)| place)
        .collect()
}

/// What a term without a name is.
fn nameless(s: &Searched<'_>, term: &Term) -> String {
    if let Some((lag, correlation)) = term.lag() {
        let seconds = lag as f64 / s.search.view.rate_hz;
        return format!(
            "noise that comes again after {lag} samples, {seconds:.3} s: readings so far apart correlate by {correlation:.3}"
        );
    }
    let of = term.follows.as_deref().unwrap_or_default();
    let lr = term.lr;
    format!("follows the {of}, which no effect of the library does (likelihood ratio {lr:.0})")
}

/// Take the doubted names of a channel out of its findings, given as one for each term and one for each law of the variance that
/// is told; what follows a combination without a name goes the same way.
pub(crate) fn withdraw(
    s: &Searched<'_>,
    of_terms: Vec<Finding>,
    of_variance: Vec<Option<Finding>>,
    failing: &dyn Fn(CheckId) -> bool,
    left: &Left<'_>,
) -> (Vec<Finding>, Vec<Finding>, Vec<Observation>) {
    let (terms, variance) = doubted(&Facts::new(s, failing, left));
    let name = s.target.name.as_str();
    let mut unexplained = vec![];
    let standing = fallen(s, &terms);
    let (mut kept, mut nearest, mut beside, mut lines) = (vec![], vec![], vec![], vec![]);
    for ((finding, doubt), term) in of_terms.into_iter().zip(terms).zip(&s.state.terms) {
        // It is told with the band that it is a part of.
        if term.is_part() {
            continue;
        }
        if term.has_no_name() {
            let seen = Observation::of_noise(name, nameless(s, term));
            unexplained.push(term.of.iter().fold(seen, |seen, of| seen.following(of)));
        } else {
            match doubt {
                Doubt::No => kept.push(finding),
                Doubt::Checks => nearest.push(finding),
                Doubt::OneMotion => lines.push(finding),
                Doubt::Spectrum => {
                    let what =
                        "the noise has a smooth spectrum that no effect of the library makes";
                    unexplained.push(Observation::of_noise(name, what.to_owned()));
                    beside.push(finding);
                }
                Doubt::Beside(of) => {
                    let what = format!(
                        "follows {of}, at whose frequency it swings, late or bent as no effect of the library does: {}",
                        finding.what
                    );
                    unexplained.push(Observation::of_noise(name, what).following(&of));
                    beside.push(finding);
                }
                Doubt::Remainder(of, share) => {
                    let of = if of == channel::ID { "that" } else { of };
                    let what = format!(
                        "beside {of}, with {:.1} % of what it explains, and as likely a part of it that its shape leaves out: {}",
                        100.0 * share,
                        finding.what
                    );
                    unexplained.push(Observation::of_noise(name, what));
                    beside.push(finding);
                }
            }
        }
    }
    for (finding, falls) in of_variance.into_iter().zip(variance) {
        let told = if falls { &mut nearest } else { &mut kept };
        told.extend(finding);
    }
    if let Some(PowerLawFound { exponent, .. }) = s.state.power_law {
        let what = format!(
            "noise whose density falls with the frequency as f^-{exponent:.2} explains this at least as well as the processes of the library, for its freedom, and is none of them"
        );
        unexplained.push(Observation::of_noise(name, what));
    }
    if !nearest.is_empty() {
        unexplained.push(nearest_of(name, &nearest));
    }
    if !lines.is_empty() {
        unexplained.push(lines_of_one_motion(name, &lines));
        nearest.append(&mut lines);
    }
    if let Some(seen) = unexplained.first_mut() {
        seen.terms = standing;
    }
    nearest.extend(beside);
    (kept, nearest, unexplained)
}
