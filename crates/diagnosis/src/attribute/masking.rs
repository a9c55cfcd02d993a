//! What the audits found, on the grid of the search: single far readings are the ones that either saw, and frames lost
//! without a gap of the numbers get their places.

use std::borrow::Cow;

use model::record::Record;

use crate::audit::{Audit, MOST_TIMES};
use crate::ingest::types::{Grid, Target};
use crate::result::{Check, Finding, Parameter};
use crate::search::searched::Searched;

/// The record with sequence numbers that count the silently lost frames too.
pub(crate) fn renumbered<'a>(record: &'a Record, audit: &Audit) -> Cow<'a, Record> {
    if audit.silently_lost.is_empty() {
        return Cow::Borrowed(record);
    }
    let mut record = record.clone();
    let rows = record.len();
    let mut seq = record
        .seq
        .take()
        .unwrap_or_else(|| (0..rows as u64).collect());
    for (row, lost) in &audit.silently_lost {
        seq[*row..].iter_mut().for_each(|s| *s += lost);
    }
    record.seq = Some(seq);
    Cow::Owned(record)
}

/// The audits' findings, with the far readings that only the whitened residual shows.
pub(crate) fn findings(audit: &Audit, searched: &[Searched<'_>], grid: &Grid) -> Vec<Finding> {
    let mut all = audit.findings.clone();
    // An axis that truly turns changes from sample to sample by more than its noise.
    let turns = |name: &String| {
        searched
            .iter()
            .any(|s| s.target.moving && s.target.name == *name)
    };
    all.retain(|f| f.cause != "outliers" || !f.channels.iter().all(turns));
    for s in searched {
        leave_explained(&mut all, s.target, grid.rate_hz);
    }
    for s in searched {
        let name = &s.target.name;
        let by_counts = ["outliers", "spikes"];
        let told = by_counts.iter().any(|id| audit.is_suppressed(id, name));
        if s.target.spikes.is_empty() || told {
            continue;
        }
        let mut times: Vec<f64> = s
            .target
            .spikes
            .iter()
            .map(|i| *i as f64 / grid.rate_hz)
            .collect();
        let mut count = times.len() as f64;
        let own = |f: &Finding| f.cause == "outliers" && f.channels == [name.as_str()];
        if let Some(i) = all.iter().position(own) {
            let first = all.remove(i);
            count += first.parameters.get("count").map_or(0.0, |p| p.value);
            times.extend(first.times_s);
            times.sort_by(f64::total_cmp);
        }
        all.push(Finding {
            cause: "outliers".into(),
            channels: vec![name.clone()],
            what: format!(
                "{count} single readings of {name} are none that the noise makes, the first at {:.2} s",
                times[0]
            ),
            parameters: [("count".to_owned(), Parameter::exact(count, "1"))].into(),
            times_s: times.into_iter().take(MOST_TIMES).collect(),
            ..Finding::default()
        });
    }
    all
}

/// Takes the readings that what was found explains out of the audit's finding of a channel.
fn leave_explained(all: &mut Vec<Finding>, target: &Target, rate_hz: f64) {
    let own = |f: &Finding| f.cause == "outliers" && f.channels == [target.name.as_str()];
    let Some(i) = all
        .iter()
        .position(own)
        .filter(|_| !target.explained.is_empty())
    else {
        return;
    };
    let at = |t: f64| {
        let mut explained = target.explained.iter();
        explained.any(|i| (*i as f64 / rate_hz - t).abs() < 0.5 / rate_hz)
    };
    let mut left = all.remove(i);
    left.times_s.retain(|t| !at(*t));
    let Some(count) = left.parameters.get_mut("count") else {
        return;
    };
    count.value -= target.explained.len() as f64;
    if let (true, Some(first)) = (count.value > 0.0, left.times_s.first()) {
        let (count, name) = (count.value, &target.name);
        left.what = format!(
            "{count} single readings of {name} are none that the noise makes, the first at {first:.2} s"
        );
        all.insert(i, left);
    }
}

/// Checks of the residual that a fault of the counts explains fail no longer.
pub(crate) fn suppress(checks: &mut [Check], audit: &Audit) {
    for c in checks.iter_mut().filter(|c| c.fails_after) {
        if audit.is_suppressed(&c.id, &c.channel) {
            c.fails_after = false;
        }
    }
}
