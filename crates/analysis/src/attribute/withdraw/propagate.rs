//! Names that fall with another.
//!
//! What a check shows to be no effect of the library is one thing with one cause, whatever the search made of it. A term
//! beside it that follows the same recorded channel, or acts where the fallen one makes the noise and is no larger, is as likely
//! a side of that thing as a cause of its own: the strokes of a bearing have a mean that follows the motor as well as a size,
//! and a draught that comes and goes leaves a line in the band of the process that it was told as.

use model::effect::Signal;

use super::{Doubt, LEFT, generic, nearest_of};
use crate::criticise::residual;
use crate::fit::channel;
use crate::fit::channel::{Form, Term};
use crate::result::{Check, Finding, Unexplained};
use crate::search::searched::Searched;

/// Share of the noise where a term acts that a fallen process makes, from which on the term may be a piece of it.
const MADE: f64 = 0.25;
/// Likelihood ratio of a term over that of the process, from which on it is none.
const LARGER: f64 = 2.0;

/// What the doubts spread by.
pub(super) struct Kin<'a> {
    pub s: &'a Searched<'a>,
    /// Density of all noise over the white one.
    pub g: &'a [f64],
    /// Coefficients by bin.
    pub counts: &'a [f64],
    /// What the failing checks of the channel say.
    pub said: &'a [String],
    /// Whether a claim of the law of the variance fails, and whether its name falls.
    pub variance: (bool, bool),
    /// Whether the variance follows an acceleration.
    pub felt: bool,
    /// Chi-square by which the channel is not of linear, normal noise.
    pub bent: f64,
    /// Whether something comes again and again that is left over.
    pub again: bool,
}

impl Kin<'_> {
    /// Recorded channels that `what` speaks of.
    fn signals<'b>(&'b self, what: &'b str) -> impl Iterator<Item = &'b Signal> {
        let all = self.s.search.view.signals.iter();
        all.filter(move |c| what.contains(&c.name))
    }

    /// Densities of the processes that have fallen, with what each explains.
    fn fallen(&self, doubts: &[Doubt]) -> Vec<(Vec<f64>, f64)> {
        let at = &self.s.search.panel.bins.at;
        let terms = self.s.state.terms.iter().zip(doubts);
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

    /// What tells a term, by bin.
    fn information(&self, t: &Term, own: &[f64]) -> Vec<f64> {
        let panel = &self.s.search.panel;
        if let Form::Covariance(process, theta) = &t.form {
            let own = process.density(theta, &panel.bins.at);
            let by_bin = own.iter().zip(self.g).zip(self.counts);
            return by_bin.map(|((d, g), m)| m * (d / g).powi(2)).collect();
        }
        let mut sum = vec![0.0; panel.bins.n];
        panel.add_columns(&mut sum, 0, &t.columns, own);
        let energy = panel.bins.products(&sum, &sum);
        energy.iter().zip(self.g).map(|(e, g)| e / g).collect()
    }

    /// Whether a term acts where a fallen process makes the noise, and is no larger.
    fn in_its_band(&self, t: &Term, own: &[f64], fallen: &[(Vec<f64>, f64)]) -> bool {
        let large: Vec<_> = fallen.iter().filter(|f| LARGER * f.1 > t.lr).collect();
        if large.is_empty() {
            return false;
        }
        let information = self.information(t, own);
        let all: f64 = information.iter().sum();
        large.iter().any(|(density, _)| {
            let shares = density.iter().zip(self.g).map(|(d, g)| d / g);
            let held: f64 = information.iter().zip(shares).map(|(i, s)| i * s).sum();
            all > 0.0 && held > MADE * all
        })
    }

    /// Whether a process explains less than what follows a recorded channel beside it by no law of the library.
    fn beside_larger(&self, t: &Term, doubts: &[Doubt]) -> bool {
        let mut terms = self.s.state.terms.iter().zip(doubts);
        let larger = |(o, d): (&Term, &Doubt)| {
            let follows = o.effect.id() == channel::ID || *d != Doubt::No && !generic(o);
            follows && o.lr > t.lr
        };
        t.is_covariance() && terms.any(larger)
    }

    /// Whether what is left over, or has fallen, follows the recorded channel that a term does.
    fn of_its_source(&self, t: &Term, doubts: &[Doubt]) -> bool {
        let Some(followed) = self.s.search.followed(t) else {
            return false;
        };
        let by_variance = self.s.variance.as_ref().filter(|_| self.variance.1);
        let by_variance = by_variance.and_then(|v| v.follows.as_deref());
        let terms = self.s.state.terms.iter().zip(doubts);
        let by_terms = terms.filter(|(o, d)| **d != Doubt::No || o.effect.id() == channel::ID);
        let others: Vec<&str> = by_terms
            .filter(|(o, _)| o.effect.id() != t.effect.id())
            .filter_map(|(o, _)| self.s.search.followed(o))
            .chain(by_variance)
            .chain(self.said.iter().map(String::as_str))
            .collect();
        let mut own = self.signals(followed);
        own.any(|c| others.iter().any(|o| o.contains(&c.name)))
    }

    /// Doubt what is of a kind with what has fallen.
    pub(super) fn fall(&self, doubts: &mut [Doubt]) {
        let fallen = self.fallen(doubts);
        let falls: Vec<bool> = (self.s.state.parts().zip(&*doubts))
            .map(|((t, own), doubt)| {
                let line = match t.form {
                    Form::Line(omega) | Form::SideBands(omega, _) => Some(omega),
                    _ => None,
                };
                let of_kind = self.in_its_band(t, own, &fallen)
                    || self.of_its_source(t, doubts)
                    || self.beside_larger(t, doubts)
                    || line.is_some() && self.again
                    || t.is_filter() && self.variance.0;
                *doubt == Doubt::No && !t.is_band() && of_kind
            })
            .collect();
        for (doubt, falls) in doubts.iter_mut().zip(falls) {
            if falls {
                *doubt = Doubt::Checks;
            }
        }
    }

    /// Whether the name of a law of the variance falls beside what is left.
    pub(super) fn variance_falls(&self, doubts: &[Doubt]) -> bool {
        let Some(v) = &self.s.variance else {
            return false;
        };
        let of_source = |o: &str| v.follows.as_deref().is_some_and(|s| o.contains(s));
        let by_term = |(t, doubt): (&Term, &Doubt)| {
            let followed = self.s.search.followed(t);
            t.effect.id() == channel::ID && t.lr > v.lr
                || *doubt != Doubt::No && followed.is_some_and(of_source)
        };
        self.felt
            || self.bent > LEFT * v.lr
            || self.said.iter().any(|w| of_source(w))
            || self.s.state.terms.iter().zip(doubts).any(by_term)
    }
}

/// Whether noise that axes share is a side of what one of them takes from another in a way of its own.
pub(crate) fn shared_falls(finding: &Finding, checks: &[Check]) -> bool {
    let channels = &finding.channels;
    let takes = |c: &Check| {
        let ids = ["couplings", "foretold"];
        let others = channels.iter().filter(|o| **o != c.channel);
        c.fails_after
            && ids.contains(&c.id.as_str())
            && channels.contains(&c.channel)
            && others.into_iter().any(|o| c.what.contains(o))
    };
    checks.iter().any(takes)
}

/// Take the name of stale readings from a channel whose tails are too light: readings that come twice leave their law as it
/// is, what takes one between others cuts it.
pub(crate) fn stale(
    s: &Searched<'_>,
    findings: &mut Vec<Finding>,
    failing: &dyn Fn(&str) -> bool,
) -> Vec<Unexplained> {
    if !failing("kurtosis") || residual::excess_kurtosis(&s.e) > 0.0 {
        return vec![];
    }
    let name = s.target.name.as_str();
    let own = |f: &mut Finding| f.cause == "stale_samples" && f.channels == [name];
    let fallen = findings.extract_if(.., own);
    fallen.map(|f| nearest_of(name, &f.what)).collect()
}
