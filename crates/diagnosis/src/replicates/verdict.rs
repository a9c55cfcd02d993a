//! What the replicates say to the verdict.

use std::collections::BTreeMap;

use crate::result::{Check, LEVEL, Replicated};
use crate::test_level::Observation;

/// Id of the check, and of the entry where the replicates do not hold the record.
const ID: &str = "replicates";

/// What follows from the record among its replicates.
pub(crate) struct Held {
    pub checks: Vec<Check>,
    pub unexplained: Vec<Observation>,
}

/// The checks, and what is unexplained by a model of that verdict.
///
/// `adequate` says that nothing was found and nothing is left. An extended model has to hold the record in every channel. Of a baseline to which nothing was found the
/// whole search has said that it describes the record, at a level of alarms far below that of the replicates: it falls
/// only where none of `count` replicates strays as far as the record.
pub(crate) fn held(all: &BTreeMap<String, Replicated>, adequate: bool, count: usize) -> Held {
    let least = 1.0 / (count + 1) as f64;
    let limit = if adequate { least.min(LEVEL) } else { LEVEL };
    let check = |(name, r): (&String, &Replicated)| Check {
        id: ID.into(),
        about: vec![],
        channel: name.clone(),
        statistic: r.before.p_value,
        p_value: Some(r.after.p_value),
        threshold: LEVEL,
        fails_before: !r.before.holds(),
        fails_after: !r.after.holds(),
        what: format!(
            "chance that a record of the model strays as far from its replicates, {} before and {} after; farthest after: {}",
            chance(r.before.p_value, count),
            chance(r.after.p_value, count),
            r.after.strays()
        ),
    };
    let entry = |(name, r): (&String, &Replicated)| {
        let worse = if r.before.holds() && !adequate {
            "; the baseline model alone holds it: the extended one is worse here"
        } else {
            ""
        };
        let what = format!(
            "the replicates of the model do not hold the record (chance {}): {}{worse}",
            chance(r.after.p_value, count),
            r.after.strays()
        );
        match &r.after.worst.with {
            Some(other) => {
                Observation::of_coupling(name, what, r.after.worst.value).following(other)
            }
            None => Observation::of_noise(name, what),
        }
    };
    Held {
        checks: all.iter().map(check).collect(),
        unexplained: (all.iter().filter(|(_, r)| r.after.p_value <= limit + 1e-9))
            .map(entry)
            .collect(),
    }
}

/// What replicates of the model without further terms strayed by, on channels where they hold with them.
pub(crate) fn taken_up(
    without: &BTreeMap<String, Replicated>,
    strayed: Vec<Observation>,
    held: &Held,
    count: usize,
) -> Vec<Observation> {
    let still = |o: &Observation| held.unexplained.iter().any(|h| h.channel == o.channel);
    let told = |o: Observation| {
        let among = without.get(&o.channel).map(|r| &r.after);
        let what = among.map(|r| {
            format!(
                "simulations of the model without the unnamed term differ (chance {}): {}",
                chance(r.p_value, count),
                r.strays()
            )
        });
        Observation {
            what: what.unwrap_or_default(),
            ..o
        }
    };
    strayed
        .into_iter()
        .filter(|o| !still(o))
        .map(told)
        .collect()
}

/// A chance that replicates tell, of which the smallest is that none strays as far.
fn chance(p: f64, count: usize) -> String {
    let least = 1.0 / (count + 1) as f64;
    if p <= least * 1.001 {
        format!("at most {least:.3}")
    } else {
        format!("{p:.3}")
    }
}
