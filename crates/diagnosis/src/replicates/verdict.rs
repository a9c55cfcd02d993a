//! What the replicates say to the verdict.

use std::collections::BTreeMap;

use crate::result::{Check, LEVEL, Replicated};
use crate::test_level::Observation;

/// By how many times as many replicates a channel on which nothing was found has to stray from all: with as many as the others, one
/// record of a true model in so many would, on each channel.
pub(crate) const MORE: usize = 4;

/// Id of the check, and of the entry where the replicates do not hold the record.
const ID: &str = "replicates";

/// What follows from the record among its replicates.
pub(crate) struct Held {
    pub checks: Vec<Check>,
    pub unexplained: Vec<Observation>,
}

/// Largest chance at which a channel is out of its replicates, of which there are `count`. Where something was found on it, or is
/// left, the model has to hold the record. Of a baseline to which nothing was found the whole search has said that it describes
/// the channel, at a level of alarms far below that of the replicates: it falls only where none of them strays as far.
pub(crate) fn limit(is_plain: bool, count: usize) -> f64 {
    let least = 1.0 / (count + 1) as f64;
    (if is_plain { least.min(LEVEL) } else { LEVEL }) + 1e-9
}

/// The checks, and what is unexplained by a model; `is_plain` says of which channels nothing was found and nothing is left.
pub(crate) fn held(
    all: &BTreeMap<String, Replicated>,
    is_plain: &dyn Fn(&str) -> bool,
    count: usize,
) -> Held {
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
        let worse = if r.before.holds() && !is_plain(name) {
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
        unexplained: (all.iter())
            .filter(|(name, r)| {
                let plain = is_plain(name);
                r.after.p_value <= limit(plain, if plain { MORE * count } else { count })
            })
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
                "{} without the unnamed term (chance {})",
                r.strays(),
                chance(r.p_value, count)
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
