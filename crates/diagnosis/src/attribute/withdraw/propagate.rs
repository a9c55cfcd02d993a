//! Names that fall with another.
//!
//! What a check shows to be no effect of the library is one thing with one cause, whatever the search made of it. A term
//! beside it that follows the same recorded channel, or acts where the fallen one makes the noise and is no larger, is as likely
//! a side of that thing as a cause of its own: the strokes of a bearing have a mean that follows the motor as well as a size,
//! and a draught that comes and goes leaves a line in the band of the process that it was told as.

use std::collections::BTreeSet;

use super::facts::{Facts, LEFT, REMAINDER, REMAINDER_PROCESS, TOUCHED, generic};
use super::{Doubt, nearest_of};
use crate::criticise::residual;
use crate::fit::channel::{Form, Term, VarianceFound, is_wide};
use crate::result::{Check, Finding};
use crate::search::searched::Searched;
use crate::test_level::{CheckId, DEPARTURE, Observation};

/// Share of the noise where a term acts that a fallen process makes, from which on the term may be a piece of it.
const MADE: f64 = 0.25;
/// Likelihood ratio of a term over that of the process, from which on it is none.
const LARGER: f64 = 2.0;

/// How withdrawals spread from one name to others.
pub(super) struct Kin<'a> {
    pub facts: &'a Facts<'a>,
    /// Whether the names of the laws of the variance fall by themselves.
    pub variance: bool,
}

impl Kin<'_> {
    /// Densities of the processes that have fallen, with what each explains.
    fn fallen(&self, doubts: &[Doubt]) -> Vec<(Vec<f64>, f64)> {
        let at = &self.facts.s.search.panel.bins.at;
        let terms = self.facts.s.state.terms.iter().zip(doubts);
        terms
            .filter(|(_, d)| **d != Doubt::No)
            .filter_map(|(t, _)| match &t.form {
                Form::Covariance(process, theta) if !process.filters_white() => {
                    Some((process.density(theta, at), t.lr))
                }
                _ => None,
            })
            .collect()
    }

    /// Whether a term acts where a fallen process makes the noise, and is no larger.
    fn in_its_band(&self, t: &Term, own: &[f64], fallen: &[(Vec<f64>, f64)]) -> bool {
        let large: Vec<_> = fallen.iter().filter(|f| LARGER * f.1 > t.lr).collect();
        if large.is_empty() {
            return false;
        }
        let mut large = large.iter();
        large.any(|(density, _)| self.makes(density, t, own) > MADE)
    }

    /// Share of the noise that a process of this density makes where a term acts.
    fn makes(&self, density: &[f64], t: &Term, own: &[f64]) -> f64 {
        let information = self.facts.information(t, own);
        let all: f64 = information.iter().sum();
        let shares = density.iter().zip(&self.facts.g).map(|(d, g)| d / g);
        let held: f64 = information.iter().zip(shares).map(|(i, s)| i * s).sum();
        if all > 0.0 { held / all } else { 0.0 }
    }

    /// Whether a process shares its place with a peak that is no narrow one: the two are the pieces of one spectrum of another
    /// shape, of an echo or an edge.
    fn with_a_hump(&self, t: &Term, own: &[f64]) -> bool {
        if !t.is_covariance() {
            return false;
        }
        let at = &self.facts.s.search.panel.bins.at;
        let wide = |o: &&Term| o.peak().is_some_and(|p| is_wide(&p));
        let mut humps = self.facts.s.state.terms.iter().filter(wide);
        humps.any(|o| {
            let Form::Covariance(process, theta) = &o.form else {
                return false;
            };
            self.makes(&process.density(theta, at), t, own) > TOUCHED
        })
    }

    /// Whether noise explains less than what follows a recorded channel beside it by no law of the library, or no more than what
    /// the shape of a fallen process leaves where it acts.
    fn beside_larger(&self, t: &Term, own: &[f64], doubts: &[Doubt]) -> bool {
        if !t.is_covariance() {
            return false;
        }
        let acts = self.acts(t, own);
        let mut terms = self.facts.s.state.parts().zip(doubts);
        terms.any(|((o, of_other), d)| {
            let follows = o.is_combination() || *d != Doubt::No && !generic(o);
            let process = *d != Doubt::No && o.is_covariance() && !o.is_filter();
            follows && o.lr > t.lr
                || process && REMAINDER_PROCESS * self.explains_there(o, of_other, &acts) > t.lr
        })
    }

    /// How much a term acts in each bin, 1 where it does most.
    fn acts(&self, t: &Term, own: &[f64]) -> Vec<f64> {
        let information = self.facts.information(t, own);
        let each = information.iter().zip(&self.facts.counts);
        let mut acts: Vec<f64> = each.map(|(i, m)| i / m).collect();
        let most = acts.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        acts.iter_mut().for_each(|a| *a /= most);
        acts
    }

    /// What a process explains; of a band, which has a place, the part where a term acts.
    fn explains_there(&self, o: &Term, own: &[f64], acts: &[f64]) -> f64 {
        if !o.is_band() {
            return o.lr;
        }
        let information = self.facts.information(o, own);
        let all: f64 = information.iter().sum();
        let there: f64 = information.iter().zip(acts).map(|(i, a)| i * a).sum();
        let lr = o.cluster.map_or(o.lr, |c| c.lr);
        if all > 0.0 { lr * there / all } else { 0.0 }
    }

    /// Whether what is left over, or has fallen, follows the recorded channel that a term does, and is more than the effect of the
    /// term leaves by being off a little.
    fn of_its_source(&self, t: &Term, doubts: &[Doubt]) -> bool {
        let explained = self.facts.explained(t);
        let laws = self.facts.s.variance.each.iter();
        let by_variance = laws
            .filter(|v| self.variance && v.lr > DEPARTURE * explained)
            .filter_map(|v| v.follows.as_ref());
        let terms = self.facts.s.state.terms.iter().zip(doubts);
        let by_terms = terms.filter(|(o, d)| **d != Doubt::No || o.is_combination());
        let by_checks = self.facts.left.about.iter();
        let others: BTreeSet<&String> = by_terms
            .filter(|(o, _)| o.effect.id() != t.effect.id() && o.lr > DEPARTURE * explained)
            .flat_map(|(o, _)| self.facts.s.search.sources(o))
            .chain(by_variance)
            .chain(
                by_checks
                    .filter(|c| *c.1 > REMAINDER * explained)
                    .map(|c| c.0),
            )
            .collect();
        self.facts
            .s
            .search
            .sources(t)
            .iter()
            .any(|c| others.contains(c))
    }

    /// Doubt what is of a kind with what has fallen.
    pub(super) fn fall(&self, doubts: &mut [Doubt]) {
        let fallen = self.fallen(doubts);
        let falls: Vec<bool> = (self.facts.s.state.parts().zip(&*doubts))
            .map(|((t, own), doubt)| {
                let line = match t.form {
                    Form::Line(omega) | Form::SideBands(omega, _) => Some(omega),
                    _ => None,
                };
                let of_kind = self.in_its_band(t, own, &fallen)
                    || self.of_its_source(t, doubts)
                    || self.beside_larger(t, own, doubts)
                    || self.with_a_hump(t, own)
                    || line.is_some() && self.facts.repeats.is_some()
                    || t.is_filter() && self.facts.fails(CheckId::VarianceLaw);
                *doubt == Doubt::No && !t.is_band() && t.lag().is_none() && of_kind
            })
            .collect();
        for (doubt, falls) in doubts.iter_mut().zip(falls) {
            if falls {
                *doubt = Doubt::Checks;
            }
        }
    }

    /// Whether the name of a law of the variance falls beside what is left.
    pub(super) fn variance_falls(&self, v: &VarianceFound, doubts: &[Doubt]) -> bool {
        let source = v.follows.as_ref();
        let by_term = |(t, doubt): (&Term, &Doubt)| {
            let follows = |s: &String| self.facts.s.search.sources(t).contains(s);
            t.is_combination() && t.lr > v.lr || *doubt != Doubt::No && source.is_some_and(follows)
        };
        self.facts.fails(CheckId::VarianceFollows)
            || self.facts.bent > LEFT * v.lr
            || source.is_some_and(|s| self.facts.left.about.contains_key(s))
            || self.facts.s.state.terms.iter().zip(doubts).any(by_term)
    }
}

/// Whether a blow of that likelihood ratio may be the largest piece of a process of the channel that is not what its name claims:
/// `made` is the share of the noise that the processes make where it acts.
pub(crate) fn is_of_a_process(
    s: &Searched<'_>,
    lr: f64,
    made: f64,
    failing: &dyn Fn(CheckId) -> bool,
) -> bool {
    let unlike = |t: &Term| {
        let claims: &[CheckId] = if t.is_band() {
            &CheckId::OF_BAND
        } else {
            &CheckId::OF_PROCESS
        };
        (t.is_band() || t.is_process()) && claims.iter().any(|id| failing(*id))
    };
    let larger = |t: &Term| LARGER * t.cluster.map_or(t.lr, |c| c.lr) > lr;
    made > MADE && s.state.terms.iter().any(|t| unlike(t) && larger(t))
}

/// Whether noise that axes share is a side of what one of them takes from another in a way of its own.
pub(crate) fn shared_falls(finding: &Finding, checks: &[Check]) -> bool {
    let channels = &finding.channels;
    let takes = |c: &Check| {
        let mut others = channels.iter().filter(|o| **o != c.channel);
        c.fails_after
            && (c.id == CheckId::Couplings || c.id == CheckId::Foretold)
            && channels.contains(&c.channel)
            && others.any(|o| c.about.contains(o))
    };
    // What is left on all of them may be one thing that all of them hold.
    let left = |channel: &String| {
        let mut own = checks.iter().filter(|c| c.channel == *channel);
        own.any(|c| c.fails_after)
    };
    let each = !finding.per_channel.is_empty();
    checks.iter().any(takes) || each && channels.iter().all(left)
}

/// Take the name of stale readings from a channel whose tails are too light: readings that come twice leave their law as it
/// is, what takes one between others cuts it.
pub(crate) fn stale(
    s: &Searched<'_>,
    findings: &mut Vec<Finding>,
    failing: &dyn Fn(CheckId) -> bool,
) -> Vec<Observation> {
    if !failing(CheckId::Kurtosis) || residual::excess_kurtosis(&s.e) > 0.0 {
        return vec![];
    }
    let name = s.target.name.as_str();
    let own = |f: &mut Finding| f.cause == "stale_samples" && f.channels == [name];
    let fallen = findings.extract_if(.., own);
    fallen.map(|f| nearest_of(name, &[f])).collect()
}
