//! What is known of a channel when its names are weighed: which tests failed, what is left where, what follows what.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use model::effect::Signal;

use crate::audit::repeats;
use crate::criticise::follower_shape;
use crate::criticise::residual::{self, Place, Repeats};
use crate::fit::about_line;
use crate::fit::channel::{Form, ID, Term};
use crate::ingest::motion::drives;
use crate::search::searched::Searched;
use crate::test_level::{CheckId, Outcome, RECORD, omnibus_level};

/// Share of a term's energy in bands that fail, from which on the failure is the term's.
const SHARE: f64 = 0.25;
/// Share of it in a place, from which on the term is touched by what is left there.
pub(super) const TOUCHED: f64 = 0.05;
/// Part of what a term explains that may be left over where it acts: it is off by a fifth of its size, and no makeshift.
pub(super) const LEFT: f64 = 0.05;
/// Share of its likelihood ratio that a law of the variance keeps, by coefficient, where nothing is left over.
const HOLDS: f64 = 0.6;
/// Share of what a shape explains that it may leave to others: it is off by a seventh of its size.
pub(super) const REMAINDER: f64 = 0.02;
/// The same for a combination of channels that stands for a cause without a name: off by half.
const REMAINDER_BEYOND: f64 = 0.25;
/// The same of what may have gone to a process: noise takes up what is off in any shape, a step or a line does in few.
pub(super) const REMAINDER_PROCESS: f64 = 0.25;
/// The same where a shape is known not to hold: what is off may be as large as what it explains.
const REMAINDER_UNLAWFUL: f64 = 1.0;
/// Share of the energy of a slow channel from which on a line at its place swings as the channel does: a line elsewhere
/// meets so much of it at a handful of thousands of frequencies.
const SWINGS: f64 = 0.02;
/// The same of a channel that swings at a half or a third of a line's place: most of what it does, since the square and the cube of
/// a sum of swings hold those of each at small part.
const SWINGS_MOSTLY: f64 = 0.5;
/// Multiples of its frequency that a law of the second and the third degree makes.
const POWERS: [f64; 2] = [2.0, 3.0];
/// Half cycles in the record by which they may lie apart.
const SAME_SWING: f64 = 1.5;
/// Standard errors beyond which readings come again more often than by chance, and within which a correlation is none.
const COMES_AGAIN: f64 = 5.0;
const NO_FILTER: f64 = 3.3;

/// What is left on a channel.
#[derive(Clone, Debug, Default)]
pub(crate) struct Left<'a> {
    /// Chi-square of what it takes from others later.
    pub late: f64,
    /// Whitened coefficients of those others.
    pub before: Vec<&'a [f64]>,
    /// The same of the energies that follow something recorded, where they do.
    pub colour: f64,
    /// Recorded channels that the checks are about that fail, with the chi-square of the one that tells most.
    pub about: BTreeMap<String, f64>,
}

/// The facts of a channel.
pub(super) struct Facts<'a> {
    pub s: &'a Searched<'a>,
    /// Whether a test fails on the channel.
    pub failing: &'a dyn Fn(CheckId) -> bool,
    pub left: &'a Left<'a>,
    /// Density of all noise over the white one, by bin.
    pub g: Vec<f64>,
    /// Coefficients by bin.
    pub counts: Vec<f64>,
    /// Everything that is left and has a place in frequency.
    pub places: Vec<Place>,
    /// Crowds of lines: those of which something is left, and those that the terms hold.
    crowds: [Vec<Place>; 2],
    /// Where the energy comes and goes.
    unsteady: Vec<Place>,
    /// What comes again and again.
    pub repeats: Option<Repeats>,
    /// Chi-square by which the channel is not of linear, normal noise, as a record of ten minutes would show it.
    pub bent: f64,
    /// What the effects that follow a recorded channel explain.
    pub(super) followed: Vec<(&'static str, f64)>,
    /// A recorded channel at whose frequency a line of the model swings.
    swing: Option<String>,
}

/// Whether an angular frequency, rad per sample, lies in a place.
fn in_place(p: &Place, omega: f64) -> bool {
    omega / PI >= p.from && omega / PI < p.to
}

/// Whether the claim of the law of an effect fails.
fn unlawful_of(id: &str, (of, o): &(&'static str, Outcome)) -> bool {
    *of == id && o.p_value < o.id.level()
}

impl<'a> Facts<'a> {
    /// Gathers them.
    pub(super) fn new(
        s: &'a Searched<'a>,
        failing: &'a dyn Fn(CheckId) -> bool,
        left: &'a Left<'a>,
    ) -> Self {
        let panel = &s.search.panel;
        let g = s.state.noise.over(&panel.bins);
        let ones = vec![1.0; panel.bins.n];
        let unsteady = residual::unsteady(&s.e);
        let crowd = |(from, to): &(f64, f64)| Place {
            from: from / PI,
            to: to / PI,
            nats: f64::INFINITY,
            lacks: false,
        };
        let of = |held: bool| {
            let notes = s.state.notes.iter().filter(move |note| note.held == held);
            notes.flat_map(|note| &note.at).map(crowd)
        };
        let mut places: Vec<Place> = residual::failing_bands(&s.u).collect();
        places.extend(&unsteady);
        // A level that was taken off takes some of the noise with it.
        places.retain(|p| !(p.lacks && s.state.level.is_some()));
        places.extend(of(false));
        let mut facts = Self {
            s,
            failing,
            left,
            counts: panel.bins.products(&ones, &ones),
            places,
            crowds: [false, true].map(|held| of(held).collect()),
            unsteady,
            repeats: residual::repeats(&s.e).filter(|r| r.chance < omnibus_level()),
            bent: 0.0,
            followed: followers(s, &g),
            swing: s.state.terms.iter().find_map(|t| swings_as(s, t)),
            g,
        };
        facts.bent = (left.late + bent(s, failing)) * facts.shown();
        facts
    }

    /// Whether a test fails on the channel.
    pub(super) fn fails(&self, id: CheckId) -> bool {
        (self.failing)(id)
    }

    /// Of a longer record what is left counts by what one of ten minutes would show.
    pub(super) fn shown(&self) -> f64 {
        (RECORD / self.s.search.panel.bins.n as f64).min(1.0)
    }

    /// Whether something is left that has no place in frequency.
    pub(super) fn without_place(&self) -> bool {
        self.s.state.notes.iter().any(|note| note.at.is_empty())
    }

    /// Whether something is left at an angular frequency.
    fn within(&self, omega: f64) -> bool {
        self.places.iter().any(|p| in_place(p, omega))
    }

    /// Whether a line lies in a crowd of others that the terms of the model hold, or leave something of.
    pub(super) fn in_crowd(&self, omega: f64, held: bool) -> bool {
        self.crowds[usize::from(held)]
            .iter()
            .any(|p| in_place(p, omega))
    }

    /// Whether a line is a harmonic of what repeats itself, in its mean or in its variance, to a coefficient.
    pub(super) fn harmonic(&self, omega: f64) -> bool {
        let n = self.s.search.panel.bins.n as f64;
        let of_mean = self.repeats.as_ref().map(|r| r.period);
        let of_variance = || {
            let swings = self.fails(CheckId::VarianceRhythm);
            swings.then(|| residual::rhythm_in_samples(&self.s.e))?
        };
        let periods = of_mean.into_iter().chain(of_variance());
        periods.into_iter().any(|period| {
            let tooth = omega * period as f64 / (2.0 * PI);
            (tooth - tooth.round()).abs() * 2.0 * n / (period as f64) < 1.0
        })
    }

    /// What is left where a line is, or beside it, nats.
    pub(super) fn about_line(&self, omega: f64) -> f64 {
        let at = omega * self.s.search.panel.bins.n as f64 / PI;
        let about = self.unsteady.iter().filter(|p| in_place(p, omega));
        let about = about.map(|p| p.nats).fold(0.0, f64::max);
        let asked = self.fails(CheckId::LjungBox) || !self.places.is_empty();
        if asked {
            about.max(about_line::stands_out(&self.s.u, at))
        } else {
            about
        }
    }

    /// What tells a term, by bin; `own` are the coefficients of its columns.
    pub(super) fn information(&self, t: &Term, own: &[f64]) -> Vec<f64> {
        let panel = &self.s.search.panel;
        if let Form::Covariance(process, theta) = &t.form {
            let own = process.density(theta, &panel.bins.at);
            let by_bin = own.iter().zip(&self.g).zip(&self.counts);
            return by_bin.map(|((d, g), m)| m * (d / g).powi(2)).collect();
        }
        let mut sum = vec![0.0; panel.bins.n];
        panel.add_columns(&mut sum, 0, &t.columns, own);
        let energy = panel.bins.products(&sum, &sum);
        energy.iter().zip(&self.g).map(|(e, g)| e / g).collect()
    }

    /// Whether a good part of what tells a term lies where more is left over than it leaves by being off a little. Of what
    /// is left in a place it answers for its part of the coefficients.
    pub(super) fn left_where_it_acts(&self, t: &Term, own: &[f64], lr: f64) -> bool {
        let panel = &self.s.search.panel;
        let information = self.information(t, own);
        let (n, omega) = (panel.bins.n as f64, &panel.bins.at.omega);
        let all: f64 = information.iter().sum();
        let of = |inside: &dyn Fn(f64) -> bool| -> (f64, f64) {
            let bins = information.iter().zip(omega).zip(&self.counts);
            let hit = bins.filter(|((_, w), _)| inside(**w));
            hit.fold((0.0, 0.0), |(sum, square), ((i, _), m)| {
                (sum + i, square + i * i / m)
            })
        };
        let left = |p: &Place| {
            let (held, square) = of(&|w| in_place(p, w));
            let coefficients = (p.to - p.from) * n;
            if held > TOUCHED * all {
                2.0 * p.nats * (held * held / square / coefficients).min(1.0)
            } else {
                0.0
            }
        };
        all > 0.0
            && of(&|w| self.within(w)).0 > SHARE * all
            && self.places.iter().map(left).sum::<f64>() > LEFT * lr
    }

    /// The effect that follows a channel beside a term, and the share of what it explains that the term holds, where that is
    /// so small that it may be what its shape leaves out.
    pub(super) fn remainder(&self, t: &Term) -> Option<(&'static str, f64)> {
        let s = self.s;
        let most = if t.is_covariance() {
            REMAINDER_PROCESS
        } else {
            REMAINDER
        };
        let others = self.followed.iter().filter(|f| f.0 != t.effect.id());
        others
            .map(|(id, all)| (*id, t.lr / all))
            .filter(|(id, share)| {
                if *id == ID {
                    *share < REMAINDER_BEYOND
                } else if s.laws.iter().any(|l| unlawful_of(id, l)) {
                    *share < REMAINDER_UNLAWFUL
                } else {
                    *share < most && !follower_shape::holds_beside(&s.search, &s.state, t, id)
                }
            })
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Whether the claim of the law of the effect of a term fails.
    pub(super) fn breaks_its_law(&self, t: &Term) -> bool {
        self.s.laws.iter().any(|l| unlawful_of(t.effect.id(), l))
    }

    /// What the effect of a term explains where nothing else follows the recorded channels that the term does: beside another
    /// follower either may stand for what both make together, or cancel it.
    pub(super) fn explained(&self, t: &Term) -> f64 {
        let (search, terms) = (&self.s.search, &self.s.state.terms);
        let sources = search.sources(t);
        let of_effect = |o: &Term| o.effect.id() == t.effect.id();
        let follows = |o: &Term| search.sources(o).iter().any(|c| sources.contains(c));
        let fitted = |kept: &dyn Fn(&Term) -> bool| {
            let kept = terms.iter().filter(|o| kept(o));
            let columns: Vec<usize> = kept.flat_map(|o| o.columns.iter().copied()).collect();
            search.panel.solve(&self.g, &columns).log_likelihood
        };
        let without = fitted(&|o| !follows(o));
        2.0 * (fitted(&|o| of_effect(o) || !follows(o)) - without)
    }

    /// The recorded channel that a term swings as; what follows late begins with a transient, too.
    pub(super) fn swings_beside(&self, t: &Term) -> Option<String> {
        match t.form {
            Form::Shaped(..) | Form::Columns | Form::Step(..) if generic(t) => self.swing.clone(),
            _ => swings_as(self.s, t),
        }
    }

    /// Whether a band that explains so much may be what a spectrum of no kind beside it is off by.
    pub(super) fn is_of_a_spectrum(&self, lr: f64) -> bool {
        let mut terms = self.s.state.terms.iter();
        terms.any(|o| o.is_any_spectrum() && REMAINDER_PROCESS * o.lr > lr)
    }

    /// Whether readings that are those before make neighbours correlate.
    pub(super) fn by_repeats(&self) -> bool {
        by_repeats(self.s)
    }

    /// Whether the law of the variance holds beside the coefficients that something left over fills.
    pub(super) fn variance_everywhere(&self) -> bool {
        let n = self.s.search.panel.bins.n as f64;
        everywhere(self.s, &|k| self.within(k as f64 * PI / n))
    }
}

/// Whether readings that are those before, more than there are by chance, make neighbours correlate: a share of them does by
/// that share, and what is left is not told from nothing.
fn by_repeats(s: &Searched<'_>) -> bool {
    let (y, step) = (&s.target.y, s.target.step);
    let n = y.len() as f64;
    let same = y.windows(2).filter(|w| repeats::equal(w[1], w[0], step));
    let (by_chance, relative) = repeats::agreement(y, step);
    let more = same.count() as f64 / n - by_chance;
    let error = (by_chance / n).sqrt().hypot(by_chance * relative);
    more > COMES_AGAIN * error && repeats::correlation(y) - more < NO_FILTER / n.sqrt()
}

/// What the terms of each effect that follow a recorded channel explain together: chi-square of their joint signal.
fn followers(s: &Searched<'_>, g: &[f64]) -> Vec<(&'static str, f64)> {
    let panel = &s.search.panel;
    let mut signals: Vec<(&'static str, Vec<f64>)> = vec![];
    for (t, own) in s.state.parts() {
        let id = t.effect.id();
        if s.search.followed(t).is_none() {
            continue;
        }
        let place = signals.iter().position(|x| x.0 == id).unwrap_or_else(|| {
            signals.push((id, vec![0.0; panel.bins.n]));
            signals.len() - 1
        });
        panel.add_columns(&mut signals[place].1, 0, &t.columns, own);
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
pub(super) fn generic(t: &Term) -> bool {
    t.follows.is_none()
}

/// Chi-square by which a channel is not of linear, normal noise. A stationary process of the library is nothing else; far
/// readings beside it make heavy tails, but no light ones.
fn bent(s: &Searched<'_>, failing: &dyn Fn(CheckId) -> bool) -> f64 {
    let (e, rate_hz) = (&s.e, s.search.view.rate_hz);
    let n = e.len() as f64;
    // Variances of skewness and kurtosis of n normal values.
    let skewness = || n / 6.0 * residual::skewness_of(e).powi(2);
    let lightness = || n / 24.0 * residual::excess_kurtosis(e).min(0.0).powi(2);
    let all: [(CheckId, &dyn Fn() -> f64); 8] = [
        (CheckId::Slew, &|| f64::INFINITY),
        (CheckId::RepeatedReadings, &|| f64::INFINITY),
        (CheckId::Skewness, &skewness),
        (CheckId::Kurtosis, &lightness),
        (CheckId::Bicovariance, &|| {
            residual::bicovariance(e).statistic
        }),
        (CheckId::ThreeReadings, &|| {
            residual::three_readings(e).statistic
        }),
        (CheckId::Neighbours, &|| {
            residual::neighbours(e, s.step()).statistic
        }),
        (CheckId::VarianceRhythm, &|| {
            residual::variance_rhythm(e, rate_hz).statistic
        }),
    ];
    let failed = all.iter().filter(|(id, _)| failing(*id));
    failed.map(|(_, chi_square)| chi_square()).sum()
}

/// The recorded temperature, supply or motor command that swings at the frequency of a line, or at a half or a third of it: by a
/// law with a bend or an S it swings as fast as the line.
fn swings_as(s: &Searched<'_>, t: &Term) -> Option<String> {
    let (Form::Line(omega) | Form::SideBands(omega, _)) = t.form else {
        return None;
    };
    let panel = &s.search.panel;
    let at = omega * panel.bins.n as f64 / PI;
    let mut signals = s.search.view.signals.iter().filter(|o| drives(o.quantity));
    let swings = |o: &&Signal| {
        let c = panel.dct.forward(&o.smooth);
        let energy = |c: &[f64]| c.iter().map(|c| c * c).sum::<f64>();
        let all = energy(&c[1..]);
        let about = |at: f64| {
            let (from, to) = (
                (at - SAME_SWING).ceil() as usize,
                (at + SAME_SWING) as usize,
            );
            energy(&c[from.max(1)..(to + 1).min(c.len())])
        };
        let bent = |power: f64| about(at / power) > SWINGS_MOSTLY * all;
        about(at) > SWINGS * all || POWERS.into_iter().any(bent)
    };
    signals.find(swings).map(|o| o.name.clone())
}

/// Whether the laws of the variance hold in the coefficients beside those that something left over fills: a noise that
/// changes does so at all frequencies, and what comes and goes brings its squares with it.
fn everywhere(s: &Searched<'_>, filled: &dyn Fn(usize) -> bool) -> bool {
    let Some(law) = s.variance.product() else {
        return true;
    };
    let mut kept = 0.0;
    let u: Vec<f64> = (s.u.iter().enumerate())
        .map(|(k, u)| {
            let clear = f64::from(u8::from(!filled(k)));
            kept += clear;
            clear * u
        })
        .collect();
    let e = s.search.panel.dct.inverse(&u);
    let n = e.len() as f64;
    let energy: f64 = e.iter().map(|e| e * e).sum();
    let scaled: f64 = e.iter().zip(law).map(|(e, v)| e * e / v).sum();
    let logs: f64 = law.iter().map(|v| v.ln()).sum();
    // A share of the coefficients holds that share of what all of them tell.
    let lr = kept / n * (n * (energy / scaled).ln() - logs);
    lr > HOLDS * kept / n * s.variance.lr()
}
