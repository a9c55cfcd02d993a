//! Names that the record does not bear out.
//!
//! Lines, steps, ramps and stationary processes can stand for a part of almost anything. Where a check still fails on
//! the model that holds them, and in the place where they act, they are the library's nearest description of something
//! else: they stay in the model, and the answer tells them as what is unexplained comes closest to.
//!
//! What follows a recorded channel does so by a shape that the library has of it. A shape that is off by a part e of its
//! size leaves e^2 of its likelihood ratio to others: a generic term beside it that holds no more than that, and gives way
//! where the shape may be late or bent, is as likely a remainder of the shape as a cause of its own.

use model::effect::Signal;
use model::record::Quantity;

pub(crate) mod propagate;

use crate::audit::repeats;
use crate::criticise::follower_shape;
use crate::criticise::residual::{self, Place};
use crate::fit::channel;
use crate::fit::channel::{Form, PowerLawFound, Term};
use crate::result::{Finding, Unexplained};
use crate::search::searched::Searched;
use crate::test_level::{OMNIBUS_LEVEL, Outcome};
use crate::{features, test_level};
use std::f64::consts::PI;

use propagate::Kin;

/// Share of a term's energy in bands that fail, from which on the failure is the term's.
const SHARE: f64 = 0.25;

/// Share of it in a place, from which on the term is touched by what is left there.
const TOUCHED: f64 = 0.05;
/// Part of what a term explains that may be left over where it acts: it is off by a fifth of its size, and no makeshift.
const LEFT: f64 = 0.05;

/// Likelihood ratio beyond its threshold from which on a term is no makeshift for what is left elsewhere.
const WIDE: f64 = 25.0;
/// Share of its likelihood ratio that a law of the variance keeps, by coefficient, where nothing is left over.
const HOLDS: f64 = 0.6;

/// Share of what a shape explains that it may leave to others: it is off by a seventh of its size.
const REMAINDER: f64 = 0.02;
/// The same for a combination of channels that stands for a cause without a name: off by half.
const REMAINDER_BEYOND: f64 = 0.25;
/// The same of what may have gone to a process: noise takes up what is off in any shape, a step or a line does in few.
const REMAINDER_PROCESS: f64 = 0.25;
/// The same where a shape is known not to hold: what is off may be as large as what it explains.
const REMAINDER_UNLAWFUL: f64 = 1.0;

/// Share of the energy of a slow channel from which on a line at its place swings as the channel does: a line elsewhere
/// meets so much of it at a handful of thousands of frequencies.
const SWINGS: f64 = 0.02;
/// Half cycles in the record by which they may lie apart.
const SAME_SWING: f64 = 1.5;

/// Standard errors beyond which readings come again more often than by chance, and within which a correlation is none.
const COMES_AGAIN: f64 = 5.0;
const NO_FILTER: f64 = 3.3;

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

/// Why a name is not given.
#[derive(Clone, Debug, PartialEq)]
enum Doubt {
    No,
    /// A check fails where the term acts.
    Checks,
    /// It swings at the frequency of the channel of this name, or is a shape of time beside what does: that follows late.
    Beside(String),
    /// It holds this share of what the effect explains that follows a channel beside it.
    Remainder(&'static str, f64),
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
fn generic(t: &Term) -> bool {
    t.follows.is_none()
}

/// Chi-square by which a channel is not of linear, normal noise. A stationary process of the library is nothing else; far
/// readings beside it make heavy tails, but no light ones.
fn bent(s: &Searched<'_>, failing: &dyn Fn(&str) -> bool) -> f64 {
    let (e, rate_hz) = (&s.e, s.search.view.rate_hz);
    let n = e.len() as f64;
    // Variances of skewness and kurtosis of n normal values.
    let skewness = || n / 6.0 * residual::skewness_of(e).powi(2);
    let lightness = || n / 24.0 * residual::excess_kurtosis(e).min(0.0).powi(2);
    let all: [(&str, &dyn Fn() -> f64); 8] = [
        ("slew", &|| f64::INFINITY),
        ("repeated_readings", &|| f64::INFINITY),
        ("skewness", &skewness),
        ("kurtosis", &lightness),
        ("bicovariance", &|| residual::bicovariance(e).statistic),
        ("three_readings", &|| residual::three_readings(e).statistic),
        ("neighbours", &|| {
            residual::neighbours(e, s.step()).statistic
        }),
        ("variance_rhythm", &|| {
            residual::variance_rhythm(e, rate_hz).statistic
        }),
    ];
    let failed = all.iter().filter(|(id, _)| failing(id));
    failed.map(|(_, chi_square)| chi_square()).sum()
}

/// The recorded temperature, supply or motor command that swings at the frequency of a line.
fn swings_as(s: &Searched<'_>, t: &Term) -> Option<String> {
    let (Form::Line(omega) | Form::SideBands(omega, _)) = t.form else {
        return None;
    };
    let panel = &s.search.panel;
    let at = omega * panel.bins.n as f64 / PI;
    let (from, to) = (
        (at - SAME_SWING).ceil() as usize,
        (at + SAME_SWING) as usize,
    );
    let slow = [Quantity::Temp, Quantity::Supply, Quantity::Pwm];
    let mut signals = s
        .search
        .view
        .signals
        .iter()
        .filter(|o| slow.contains(&o.quantity));
    let swings = |o: &&Signal| {
        let c = panel.dct.forward(&o.smooth);
        let energy = |c: &[f64]| c.iter().map(|c| c * c).sum::<f64>();
        energy(&c[from.max(1)..(to + 1).min(c.len())]) > SWINGS * energy(&c[1..])
    };
    signals.find(swings).map(|o| o.name.clone())
}

/// For each term of a channel, whether the checks doubt it; and whether they doubt the law of its variance.
fn doubted(s: &Searched<'_>, failing: &dyn Fn(&str) -> bool, left: &Left) -> (Vec<Doubt>, bool) {
    let panel = &s.search.panel;
    let g = s.state.noise.over(&panel.bins);
    let n = panel.bins.n as f64;
    let ones = vec![1.0; panel.bins.n];
    // Everything that is left and has a place in frequency.
    let unsteady = residual::unsteady(&s.e);
    let crowds = s.state.notes.iter().filter_map(|note| note.at);
    let crowds: Vec<Place> = crowds
        .map(|(from, to)| Place {
            from: from / PI,
            to: to / PI,
            nats: f64::INFINITY,
            lacks: false,
        })
        .collect();
    let mut places: Vec<Place> = residual::failing_bands(&s.u).collect();
    places.extend(&unsteady);
    // A level that was taken off takes some of the noise with it.
    places.retain(|p| !(p.lacks && s.state.level.is_some()));
    places.extend(&crowds);
    let in_place = |p: &Place, omega: f64| omega / PI >= p.from && omega / PI < p.to;
    let within = |places: &[Place], omega: f64| places.iter().any(|p| in_place(p, omega));
    let omega = &panel.bins.at.omega;
    let counts = panel.bins.products(&ones, &ones);
    // Whether a good part of what tells a term lies where more is left over than it leaves by being off a little. Of what
    // is left in a place it answers for its part of the coefficients.
    let share = |information: &[f64], lr: f64| {
        let all: f64 = information.iter().sum();
        let of = |inside: &dyn Fn(f64) -> bool| -> (f64, f64) {
            let bins = information.iter().zip(omega).zip(&counts);
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
            && of(&|w| within(&places, w)).0 > SHARE * all
            && places.iter().map(left).sum::<f64>() > LEFT * lr
    };
    let crowd = s.state.notes.iter().any(|note| note.at.is_none());
    let correlated = failing("ljung_box");
    let repeats = residual::repeats(&s.e).filter(|r| r.chance < OMNIBUS_LEVEL);
    // A harmonic of what repeats itself, to a coefficient.
    let harmonic = |omega: f64| {
        let tooth = |r: &residual::Repeats| omega * r.period as f64 / (2.0 * PI);
        let apart = |r| (tooth(r) - tooth(r).round()).abs() * 2.0 * n / r.period as f64;
        repeats.as_ref().is_some_and(|r| apart(r) < 1.0)
    };
    let miscoded = failing("fine_codes") || failing("foretold");
    let followed_by_noise = test_level::IDS.iter().any(|id| failing(id));
    // Of a longer record what is left counts by what one of that length would show.
    let shown = (test_level::RECORD / n).min(1.0);
    // Where the energy of a band follows what moves, a process may still hold that makes far more than that.
    let knows = |t: &Term| {
        failing(test_level::ORDER)
            || failing(test_level::LEANING)
            || left.colour * shown > REMAINDER * t.lr
    };
    let unlike = test_level::CLAIMS.iter().any(|c| failing(c));
    // Beside a wander that is not the process it was told as, a step is as likely a piece of that.
    let unlike_step = |t: &Term| unlike && matches!(t.form, Form::Step(..));
    let by_power_law = |filter: bool| s.state.power_law.is_some_and(|p| p.filter || !filter);
    let bent = (left.late + bent(s, failing)) * shown;
    // What is left without a place may be anywhere; what has one leaves a strong term elsewhere alone.
    let misplaced = |t: &Term| !places.is_empty() && t.score() < WIDE;
    let followed = followers(s, &g);
    let unlawful_of = |id: &str, (of, o): &(&'static str, Outcome)| {
        *of == id && o.p_value < test_level::CLAIM_LEVEL
    };
    let remainder = |t: &Term| {
        let most = if t.is_covariance() {
            REMAINDER_PROCESS
        } else {
            REMAINDER
        };
        followed
            .iter()
            .filter(|f| f.0 != t.effect.id())
            .map(|(id, all)| (*id, t.lr / all))
            .filter(|(id, share)| {
                if *id == channel::ID {
                    *share < REMAINDER_BEYOND
                } else if s.laws.iter().any(|l| unlawful_of(id, l)) {
                    *share < REMAINDER_UNLAWFUL
                } else {
                    *share < most && !follower_shape::holds_beside(&s.search, &s.state, t, id)
                }
            })
            .min_by(|a, b| a.1.total_cmp(&b.1))
    };
    // What follows a channel by another law than its name claims, as the claim itself or a term without a name says.
    let unlawful = |t: &Term| {
        let id = t.effect.id();
        let failed = |l: &(&'static str, Outcome)| unlawful_of(id, l);
        let signal = s.search.followed(t);
        let beside = |o: &Term| {
            o.effect.id() == channel::ID
                && o.lr > test_level::DEPARTURE * t.lr
                && features::source(&s.search.view, o) == signal
        };
        signal.is_some() && (s.laws.iter().any(failed) || s.state.terms.iter().any(beside))
    };
    let swing = s.state.terms.iter().find_map(|t| swings_as(s, t));
    // What follows late begins with a transient, too.
    let beside_swing = |t: &Term| match t.form {
        Form::Shaped(..) | Form::Columns | Form::Step(..) if generic(t) => swing.clone(),
        _ => swings_as(s, t),
    };
    let mut terms: Vec<Doubt> = s
        .state
        .parts()
        .map(|(t, own)| {
            let line = match t.form {
                Form::Line(omega) | Form::SideBands(omega, _) => Some(omega),
                _ => None,
            };
            let there = if let Some(omega) = line {
                let at = omega * n / PI;
                let about = unsteady.iter().filter(|p| in_place(p, omega));
                let about = about.map(|p| p.nats).fold(0.0, f64::max);
                let beside = if correlated || !places.is_empty() {
                    residual::stands_out(&s.u, at)
                } else {
                    0.0
                };
                within(&crowds, omega)
                    || harmonic(omega)
                    || failing(test_level::ORDER)
                    || 2.0 * about.max(beside) > LEFT * t.lr
            } else if let Form::Covariance(process, theta) = &t.form {
                let own = process.density(theta, &panel.bins.at);
                let information = own.iter().zip(&g).zip(&counts);
                let information = information.map(|((d, g), m)| m * (d / g).powi(2));
                // What stands at one frequency answers for what is left there, and for its own claims.
                if process.is_peak() {
                    let lr = t.cluster.map_or(t.lr, |c| c.lr);
                    return if test_level::BAND_CLAIMS.iter().any(|c| failing(c))
                        || share(&information.collect::<Vec<_>>(), lr)
                    {
                        Doubt::Checks
                    } else {
                        Doubt::No
                    };
                }
                let filter = process.filters_white();
                by_power_law(filter)
                    || knows(t)
                    || failing(test_level::STATIONARY_CLAIM)
                    || unlike && !filter
                    || repeats.is_some()
                    || bent > LEFT * t.lr
                    || correlated && (places.is_empty() || filter)
                    || filter && (miscoded || by_repeats(s))
                    || share(&information.collect::<Vec<_>>(), t.lr)
            } else {
                let mut sum = vec![0.0; panel.bins.n];
                panel.add_columns(&mut sum, 0, &t.columns, own);
                let energy = panel.bins.products(&sum, &sum);
                let energy = energy.iter().zip(&g).map(|(e, g)| e / g);
                share(&energy.collect::<Vec<_>>(), t.lr)
            };
            if let Some(name) = beside_swing(t) {
                Doubt::Beside(name)
            } else if there
                || unlawful(t)
                || unlike_step(t)
                || generic(t) && (crowd || misplaced(t))
            {
                Doubt::Checks
            } else if let Some((id, share)) = remainder(t).filter(|_| generic(t) && line.is_none())
            {
                Doubt::Remainder(id, share)
            } else {
                Doubt::No
            }
        })
        .collect();
    let mut variance = failing("variance_in_time")
        || failing(test_level::VARIANCE_CLAIM)
        || followed_by_noise
        || failing("kurtosis")
        || crowd
        || if places.is_empty() {
            correlated || failing("time_frequency")
        } else {
            !everywhere(s, &|k| within(&places, k as f64 * PI / n))
        };
    let kin = Kin {
        s,
        g: &g,
        counts: &counts,
        said: &left.said,
        variance: (failing(test_level::VARIANCE_CLAIM), variance),
        felt: failing("variance_follows"),
        bent,
        again: repeats.is_some(),
    };
    kin.fall(&mut terms);
    variance |= kin.variance_falls(&terms);
    (terms, variance)
}

/// Whether the law of the variance holds in the coefficients beside those that something left over fills: a noise that
/// changes does so at all frequencies, and what comes and goes brings its squares with it.
fn everywhere(s: &Searched<'_>, filled: &dyn Fn(usize) -> bool) -> bool {
    let Some(v) = &s.variance else { return true };
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
    let scaled: f64 = e.iter().zip(&v.law).map(|(e, v)| e * e / v).sum();
    let logs: f64 = v.law.iter().map(|v| v.ln()).sum();
    // A share of the coefficients holds that share of what all of them tell.
    let lr = kept / n * (n * (energy / scaled).ln() - logs);
    lr > HOLDS * kept / n * v.lr
}

/// What is left on a channel.
pub(crate) struct Left {
    /// Chi-square of what it takes from others later.
    pub late: f64,
    /// The same of the energies that follow something recorded, where they do.
    pub colour: f64,
    /// What the checks say that fail.
    pub said: Vec<String>,
}

/// What the library comes nearest to a channel with.
pub(crate) fn nearest_of(channel: &str, what: &str) -> Unexplained {
    Unexplained {
        channel: channel.into(),
        what: format!("nearest in the library, though checks fail on it: {what}"),
    }
}

/// Take the doubted names of a channel out of its findings, given as one for each term and then the rest; what follows a
/// combination without a name goes the same way.
pub(crate) fn withdraw(
    s: &Searched<'_>,
    of_terms: Vec<Finding>,
    of_variance: Option<Finding>,
    failing: &dyn Fn(&str) -> bool,
    left: &Left,
) -> (Vec<Finding>, Vec<Finding>, Vec<Unexplained>) {
    let (terms, variance) = doubted(s, failing, left);
    let name = s.target.name.as_str();
    let mut unexplained = vec![];
    let (mut kept, mut nearest, mut beside) = (vec![], vec![], vec![]);
    for ((finding, doubt), term) in of_terms.into_iter().zip(terms).zip(&s.state.terms) {
        // It is told with the band that it is a part of.
        if term.is_part() {
            continue;
        }
        if term.effect.id() == channel::ID {
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
                Doubt::Beside(of) => {
                    unexplained.push(Unexplained {
                        channel: name.into(),
                        what: format!(
                            "follows {of}, at whose frequency it swings, late or bent as no effect of the library does: {}",
                            finding.what
                        ),
                    });
                    beside.push(finding);
                }
                Doubt::Remainder(of, share) => {
                    let of = if of == channel::ID { "that" } else { of };
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
    if let Some(PowerLawFound { exponent, .. }) = s.state.power_law {
        unexplained.push(Unexplained {
            channel: name.into(),
            what: format!(
                "noise whose density falls with the frequency as f^-{exponent:.2} explains this at least as well as the processes of the library, for its freedom, and is none of them"
            ),
        });
    }
    if !nearest.is_empty() {
        let told: Vec<&str> = nearest.iter().map(|f| f.what.as_str()).collect();
        unexplained.push(nearest_of(name, &told.join("; ")));
    }
    nearest.extend(beside);
    (kept, nearest, unexplained)
}
