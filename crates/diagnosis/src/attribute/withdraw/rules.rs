//! When a name is withdrawn: one table for terms, one for the law of the variance.
//!
//! A row says what it is asked of and what it looks for. Any row that holds withdraws the name; the rows do not know each other.

use model::effect::Peak;

use super::Doubt;
use super::facts::{Facts, LEFT, generic};
use super::of_band::explains;
use crate::features;
use crate::fit::channel::{Form, ID, Term, is_wide};
use crate::search::MOST_ALIKE;
use crate::test_level::{CheckId, DEPARTURE};

/// Likelihood ratio beyond its threshold from which on a term is no makeshift for what is left elsewhere.
const WIDE: f64 = 25.0;
/// Share of what a process explains that the energy of a band which follows something recorded may hold: noise takes up what is
/// off in any shape by a seventh of its size.
const FOLLOWED: f64 = 0.02;

/// A term under the rules, with the coefficients of its columns.
pub(super) struct Seen<'a> {
    pub term: &'a Term,
    pub own: &'a [f64],
}

impl Seen<'_> {
    /// Angular frequency of a line, rad per sample.
    pub(super) fn line(&self) -> Option<f64> {
        match self.term.form {
            Form::Line(omega) | Form::SideBands(omega, _) => Some(omega),
            _ => None,
        }
    }
}

/// When the name of a term is withdrawn.
struct Rule {
    /// For people: why.
    #[cfg_attr(not(test), expect(dead_code, reason = "a row says what it is for"))]
    name: &'static str,
    /// Which terms it is asked of.
    of: fn(&Seen<'_>) -> bool,
    /// Whether it withdraws the name.
    holds: fn(&Facts<'_>, &Seen<'_>) -> bool,
}

fn line(t: &Seen<'_>) -> bool {
    t.line().is_some()
}

fn stationary(t: &Seen<'_>) -> bool {
    t.term.is_covariance()
}

fn process(t: &Seen<'_>) -> bool {
    t.term.is_process()
}

fn filter(t: &Seen<'_>) -> bool {
    t.term.is_filter()
}

fn step(t: &Seen<'_>) -> bool {
    matches!(t.term.form, Form::Step(..))
}

fn in_time(t: &Seen<'_>) -> bool {
    !line(t) && !stationary(t)
}

/// A shape of time or frequency alone.
fn of_no_channel(t: &Seen<'_>) -> bool {
    generic(t.term)
}

const TERMS: &[Rule] = &[
    Rule {
        name: "a line in a crowd of lines is one of a band",
        of: line,
        holds: |f, t| t.line().is_some_and(|omega| f.in_crowd(omega, false)),
    },
    Rule {
        name: "a line at a harmonic of what repeats itself is a part of that",
        of: line,
        holds: |f, t| t.line().is_some_and(|omega| f.harmonic(omega)),
    },
    Rule {
        name: "a line beside a ridge that follows the motor is a part of that",
        of: line,
        holds: |f, _| f.fails(CheckId::Order),
    },
    Rule {
        name: "a tone that is not steady leaves more about its line than one that is",
        of: line,
        holds: |f, t| {
            let about = t.line().map_or(0.0, |omega| f.about_line(omega));
            2.0 * about > LEFT * t.term.lr
        },
    },
    Rule {
        name: "one power law explains as much",
        of: stationary,
        holds: |f, t| {
            let found = f.s.state.power_law;
            found.is_some_and(|p| p.filter || !filter(t))
        },
    },
    Rule {
        name: "noise knows nothing of what was recorded: no ridge, no lean",
        of: stationary,
        holds: |f, _| f.fails(CheckId::Order) || f.fails(CheckId::Leaning),
    },
    Rule {
        name: "noise knows nothing of what was recorded: the energy of no band",
        of: stationary,
        holds: |f, t| f.left.colour * f.shown() > FOLLOWED * t.term.lr,
    },
    Rule {
        name: "a stationary process has no rhythm",
        of: stationary,
        holds: |f, _| f.fails(CheckId::ProcessRhythm),
    },
    Rule {
        name: "a claim of the process fails",
        of: process,
        holds: |f, _| unlike(f),
    },
    Rule {
        name: "what comes again is no noise",
        of: stationary,
        holds: |f, _| f.repeats.is_some(),
    },
    Rule {
        name: "a process of the library is linear and normal",
        of: stationary,
        holds: |f, t| f.bent > LEFT * t.term.lr,
    },
    Rule {
        name: "correlation that is left, nowhere else",
        of: stationary,
        holds: |f, _| f.places.is_empty() && f.fails(CheckId::LjungBox),
    },
    Rule {
        name: "a filter leaves no correlation",
        of: filter,
        holds: |f, _| f.fails(CheckId::LjungBox),
    },
    Rule {
        name: "codes or interpolation make neighbours alike",
        of: filter,
        holds: |f, _| f.fails(CheckId::FineCodes) || f.fails(CheckId::Foretold),
    },
    Rule {
        name: "readings that come twice make neighbours alike",
        of: filter,
        holds: |f, _| f.by_repeats(),
    },
    Rule {
        name: "what tells a process lies where more is left over",
        of: stationary,
        holds: |f, t| f.left_where_it_acts(t.term, t.own, t.term.lr),
    },
    Rule {
        name: "what tells a shape lies where more is left over",
        of: in_time,
        holds: |f, t| f.left_where_it_acts(t.term, t.own, t.term.lr),
    },
    Rule {
        name: "it follows a channel by another law than its name claims",
        of: |_| true,
        holds: |f, t| !f.s.search.sources(t.term).is_empty() && f.breaks_its_law(t.term),
    },
    Rule {
        name: "what has no name follows the same channel beside it",
        of: |_| true,
        holds: |f, t| {
            let Some(signal) = f.s.search.followed(t.term) else {
                return false;
            };
            let beside = |o: &Term| {
                o.effect.id() == ID
                    && o.lr > DEPARTURE * f.explained(t.term)
                    && features::source(o) == Some(signal)
            };
            f.s.state.terms.iter().any(beside)
        },
    },
    Rule {
        name: "a step beside a wander that is not its process is a piece of that",
        of: step,
        holds: |f, _| unlike(f),
    },
    Rule {
        name: "what is left without a place may be anywhere",
        of: of_no_channel,
        holds: |f, _| f.without_place(),
    },
    Rule {
        name: "a weak term may be a makeshift for what is left elsewhere",
        of: of_no_channel,
        holds: |f, t| !f.places.is_empty() && t.term.score() < WIDE,
    },
];

/// Whether a claim of a process fails.
fn unlike(f: &Facts<'_>) -> bool {
    CheckId::OF_PROCESS.into_iter().any(|id| f.fails(id))
}

/// Whether a channel has more bands than separate causes make: they are one structure. Harmonics are one with the lowest of them, and so
/// are the tones of a rotor.
fn crowded(f: &Facts<'_>) -> bool {
    let bands = f.s.state.terms.iter();
    let bands = bands.filter(|t| t.is_band() && !t.is_part());
    let mut bands: Vec<(Peak, &Term)> = bands.filter_map(|t| Some((t.peak()?, t))).collect();
    bands.sort_by(|a, b| a.0.omega.total_cmp(&b.0.omega));
    let mut alone: Vec<(Peak, &Term)> = vec![];
    for (peak, term) in bands {
        let is_one = |(low, of): &(Peak, &Term)| of.turns_with(term) || is_harmonic(&peak, low);
        if !alone.iter().any(is_one) {
            alone.push((peak, term));
        }
    }
    alone.len() > MOST_ALIKE
}

/// Whether a band lies at a multiple of a lower one, as near as their widths tell.
fn is_harmonic(band: &Peak, low: &Peak) -> bool {
    let order = (band.omega / low.omega).round();
    let off = (band.omega - order * low.omega).abs();
    order >= 2.0 && off < order * low.half_width && band.half_width < 0.5 * low.omega
}

/// Why the name of a term is not given, by itself.
pub(super) fn doubt_of(f: &Facts<'_>, t: &Seen<'_>) -> Doubt {
    // What stands at one frequency answers for what is left there, and for its own claims.
    if t.term.is_band() {
        let lr = explains(t.term);
        let falls = CheckId::OF_BAND.into_iter().any(|id| f.fails(id))
            || f.left_where_it_acts(t.term, t.own, lr)
            || t.term.peak().is_some_and(|p| is_wide(&p))
            || crowded(f)
            || f.is_of_another_axis(t.term)
            || f.is_of_a_spectrum(lr);
        return match f.beside_follower(t.term) {
            _ if falls => Doubt::Checks,
            Some((id, share)) => Doubt::Remainder(id, share),
            None => Doubt::No,
        };
    }
    // It has no name that could fall.
    if t.term.lag().is_some() {
        return Doubt::No;
    }
    if t.term.is_any_spectrum() {
        return Doubt::Spectrum;
    }
    if let Some(name) = f.swings_beside(t.term) {
        return Doubt::Beside(name);
    }
    if TERMS.iter().any(|r| (r.of)(t) && (r.holds)(f, t)) {
        return Doubt::Checks;
    }
    if t.line().is_some_and(|omega| f.in_crowd(omega, true)) {
        return Doubt::OneMotion;
    }
    let may_be = of_no_channel(t) && !line(t);
    match may_be.then(|| f.remainder(t.term)).flatten() {
        Some((id, share)) => Doubt::Remainder(id, share),
        None => Doubt::No,
    }
}

/// Tests that withdraw the name of a law of the variance where they fail.
const OF_VARIANCE: [CheckId; 5] = [
    CheckId::VarianceLaw,
    CheckId::ColourFollows,
    CheckId::Order,
    CheckId::Leaning,
    CheckId::Kurtosis,
];

/// Whether the name of a law of the variance is withdrawn, by itself.
pub(super) fn variance_withdrawn(f: &Facts<'_>) -> bool {
    OF_VARIANCE.into_iter().any(|id| f.fails(id))
        || f.without_place()
        || if f.places.is_empty() {
            f.fails(CheckId::LjungBox) || f.fails(CheckId::TimeFrequency)
        } else {
            !f.variance_everywhere()
        }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_rule_has_a_reason_of_its_own() {
        let names: BTreeSet<&str> = TERMS.iter().map(|r| r.name).collect();
        assert_eq!(names.len(), TERMS.len());
    }
}
