//! What a record cannot show, and what to record for it.

use model::effect::Hypothesis;
use model::effects::EFFECTS;

use crate::fit::channel;
use crate::result::NotTested;
use crate::search::searched::Searched;

/// A reason, and the hypotheses that it keeps from being tested.
type Untested = (&'static str, fn(&Hypothesis) -> bool);

/// What of the library a channel was not asked for, beyond what its search could not lay out, and why.
fn by_motion(s: &Searched<'_>) -> Option<Untested> {
    if s.target.moving {
        let slow = |h: &Hypothesis| {
            matches!(
                h,
                Hypothesis::Regression(_)
                    | Hypothesis::Shaped(_)
                    | Hypothesis::Step
                    | Hypothesis::Line
                    | Hypothesis::Covariance(_)
                    | Hypothesis::Variance(_)
                    | Hypothesis::TwoLevel
                    | Hypothesis::WanderingTone
            )
        };
        return Some(("the base moves about this axis: record it at rest", slow));
    }
    let unsafe_here = |h: &Hypothesis| {
        matches!(
            h,
            Hypothesis::Line | Hypothesis::WanderingTone | Hypothesis::Covariance(_)
        )
    };
    let why = "the base sways, and turns a little about this axis too: record it at rest";
    s.search.view.sways().then_some((why, unsafe_here))
}

/// Causes that a channel was not asked for, with the reason.
fn of_channel(s: &Searched<'_>) -> Vec<(&'static str, String)> {
    let mut own = s.search.not_tested.clone();
    let Some((why, asked)) = by_motion(s) else {
        return own;
    };
    for c in s.search.candidates.iter().filter(|c| asked(&c.hypothesis)) {
        let id = c.effect.id();
        if id != channel::ID && own.iter().all(|o| o.0 != id) {
            own.push((id, why.to_owned()));
        }
    }
    own
}

/// Causes that channels were not asked for, in the order of the library; those that all share are told once.
pub(crate) fn not_tested(searched: &[Searched<'_>]) -> Vec<NotTested> {
    let mut all: Vec<(NotTested, Vec<&str>)> = vec![];
    for s in searched {
        for (cause, why) in of_channel(s) {
            let same = |n: &NotTested| n.cause == cause && n.why == why;
            match all.iter_mut().find(|(n, _)| same(n)) {
                Some((_, channels)) => channels.push(&s.target.name),
                None => {
                    let cause = cause.into();
                    all.push((NotTested { cause, why }, vec![&s.target.name]));
                }
            }
        }
    }
    let order = |id: &str| EFFECTS.iter().position(|e| e.id() == id);
    all.sort_by_key(|(n, _)| order(&n.cause));
    all.into_iter()
        .map(|(mut n, channels)| {
            if channels.len() < searched.len() {
                n.why = format!("{}: {}", channels.join(", "), n.why);
            }
            n
        })
        .collect()
}
