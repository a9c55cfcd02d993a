//! The lists of a diagnosis out of what was named, what checks leave and what the audits saw.

use std::f64::consts::PI;

use super::{Named, Tested};
use crate::attribute::{merge, withdraw};
use crate::audit::Audit;
use crate::criticise::common_noise::Shared;
use crate::fit::channel::Note;
use crate::report::handover;
use crate::report::untested::not_tested;
use crate::result::{Check, DetectionLimit, Finding, NotTested};
use crate::search::searched::Searched;
use crate::test_level::{CheckId, Observation};

/// The lists of a diagnosis.
pub(super) struct Told {
    pub checks: Vec<Check>,
    pub findings: Vec<Finding>,
    pub nearest: Vec<Finding>,
    pub unexplained: Vec<Observation>,
    pub limits: Vec<DetectionLimit>,
    pub not_tested: Vec<NotTested>,
}

pub(super) fn concluded(
    searched: &[Searched<'_>],
    tested: Tested,
    audited: Audit,
    dead: Vec<Observation>,
    named: Named,
) -> Told {
    let Tested {
        mut checks, shared, ..
    } = tested;
    let Named {
        mut findings,
        mut nearest,
        withdrawn,
        mut limits,
        not_tested: unasked,
    } = named;
    let mut unexplained = left_over(&checks, &shared);
    for s in searched {
        unexplained.extend(s.state.notes.iter().map(|n| noted(s, n)));
        unexplained.extend(astray(s));
    }
    unexplained.extend(dead);
    unexplained.extend(withdrawn);
    checks.extend(shared.checks);
    checks.extend(audited.checks);
    unexplained.extend(audited.unexplained);
    let not_normal = audited.not_normal.into_iter();
    unexplained.extend(not_normal.filter(|u| !bent(&u.channel, searched, &checks)));
    if let Some(finding) = shared.finding {
        if withdraw::propagate::shared_falls(&finding, &checks) {
            let channel = finding.channels[0].clone();
            nearest.push(finding);
            unexplained.push(withdraw::nearest_of(
                &channel,
                &nearest[nearest.len() - 1..],
            ));
        } else {
            findings.push(finding);
        }
    }
    limits.extend(searched.iter().flat_map(|s| s.limits.iter().cloned()));
    limits.extend(shared.limits);
    // What the audit could not ask a channel for has no smallest size there.
    let asked = |l: &DetectionLimit| {
        let mut not = audited.not_asked.iter();
        !not.any(|(channel, cause)| *channel == l.channel && *cause == l.cause)
    };
    limits.retain(asked);
    let mut not_tested = not_tested(searched);
    not_tested.extend(unasked);
    not_tested.extend(audited.not_tested);
    handover::size_outliers(&mut findings, searched);
    Told {
        checks,
        findings: merge::complete(merge::repeated(merge::rotors(merge::joined(merge::loud(
            merge::blows(findings),
        ))))),
        nearest: merge::complete(nearest),
        unexplained,
        limits,
        not_tested,
    }
}

/// Whether what was found on a channel may have bent the distribution of its counts; then the residual decides.
fn bent(name: &str, searched: &[Searched<'_>], checks: &[Check]) -> bool {
    let found =
        |s: &Searched<'_>| !s.state.terms.is_empty() || !s.variance.is_empty() || s.target.moving;
    let tails = |c: &Check| c.id == CheckId::Kurtosis && c.channel == name && c.fails_after;
    let mut own = searched.iter().filter(|s| s.target.name == name);
    own.any(found) && !checks.iter().any(tails)
}

/// What the search noted of a channel.
fn noted(s: &Searched<'_>, note: &Note) -> Observation {
    let ends = (note.at.iter()).fold((PI, 0.0f64), |(low, high), (from, to)| {
        (low.min(*from), high.max(*to))
    });
    Observation {
        place: (!note.at.is_empty()).then_some([ends.0 / PI, ends.1 / PI]),
        structure: true,
        ..Observation::of_noise(&s.target.name, note.what.clone())
    }
}

/// An axis that moves on a table that turns another one.
fn astray(s: &Searched<'_>) -> Option<Observation> {
    s.target.astray.then(|| {
        let what = format!(
            "moves by {:.2} deg/s rms and does not follow the axis that the table turns: it was searched for no cause; where the stand was shaken or tilted, say `base: moving`",
            s.target.motion_rms
        );
        Observation::of_readings(&s.target.name, what)
    })
}

fn left_over(checks: &[Check], shared: &Shared) -> Vec<Observation> {
    let failing = checks.iter().filter(|c| c.fails_after);
    failing
        .map(|c| Observation {
            check: CheckId::of(&c.id).map(|id| (id, c.p_value.unwrap_or(0.0))),
            follows: c.about.clone(),
            ..Observation::of_noise(&c.channel, format!("{}: {}", c.id, c.what))
        })
        .chain(shared.left.iter().cloned())
        .collect()
}
