//! A record before the search: audited, on its grid, and without the readings in which the base may have been knocked.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

use model::effects::shock::LONGEST_S;
use model::record::rows;
use model::record::{AnalysisError, Base, Record};
use model::record::{fills, sentinels};

use super::high_passed;
use crate::attribute::masking;
use crate::audit::{Audit, audit, sign_bit};
use crate::ingest::blows::{Blow, blows};
use crate::ingest::dead;
use crate::ingest::grid::{lay_out, places_of_rows, with_knocks};
use crate::ingest::lattice;
use crate::ingest::types::{Grid, Target};
use crate::result::{Finding, Input};
use crate::test_level::{Observation, all_worded};

/// What the search needs of a record, and what was seen of it before.
pub(super) struct Prepared {
    pub grid: Grid,
    pub audited: Audit,
    /// Places of single far readings that the audit of counts set aside, by channel.
    pub singles: BTreeMap<String, Vec<usize>>,
    pub sticking: Vec<Finding>,
    pub dead: Vec<Observation>,
    pub input: Input,
    /// The record as it was read, where a filter was undone.
    pub as_read: Option<Grid>,
    /// Where the base may have been knocked: those readings are lost on the grid.
    pub blows: Vec<Blow>,
    /// What the grid was laid out of, where there are blows.
    again: Option<Again>,
}

/// A record and the seed of its grid.
struct Again {
    record: Record,
    seed: u64,
}

pub(super) fn prepared(record: Cow<'_, Record>, seed: u64) -> Result<Prepared, AnalysisError> {
    let record = sentinels::left_out(fills::left_out(record));
    let record = &*rows::in_order(&record);
    let (record, bursts) = match rows::end_to_end(record) {
        Some((joined, bursts)) => (Cow::Owned(joined), Some(bursts)),
        None => (rows::longest_part(record), None),
    };
    let record = &*record;
    let (alive, dead) = dead::left_out(record)?;
    let counted = lattice::counted(&alive);
    let (mended, mut sticking) = sign_bit::mend(&counted);
    let record = &*mended;
    let mut audited = audited_of(record, &sticking);
    let filters = match bursts {
        Some(_) => vec![],
        None => {
            let record = masking::renumbered(record, &audited);
            high_passed::found(&record, &|name| audited.masked(name), seed)
        }
    };
    if !filters.is_empty() {
        audited = audited_of(&high_passed::settled(record, &filters), &sticking);
    }
    let record = &*masking::renumbered(record, &audited);
    let as_read = match filters.as_slice() {
        [] => None,
        _ => Some(lay_out(record, &|name| audited.masked(name), seed)?),
    };
    let record = &*high_passed::undone(record, &filters, &|name| audited.masked(name));
    sticking.extend(high_passed::findings(record, &filters));
    let mut grid = lay_out(record, &|name| audited.masked(name), seed)?;
    let places = places_of_rows(record);
    let of_rows = |rows: &Vec<usize>| rows.iter().map(|r| places[*r]).collect();
    let singles = (audited.singles.iter()).map(|(name, rows)| (name.clone(), of_rows(rows)));
    let singles = singles.collect();
    // What breaks off and begins anew at each burst is no blow.
    let knocked = |grid: &Grid| match bursts {
        Some(_) => vec![],
        None => knocked(grid, &singles),
    };
    let mut blows = knocked(&grid);
    let near = (LONGEST_S * grid.rate_hz) as usize;
    let is_one = |at: &usize| {
        let own = |b: &Blow| b.readings.start.saturating_sub(near)..b.readings.end + near;
        blows.iter().any(|b| own(b).contains(at))
    };
    let mut left_out = grid.targets.iter().flat_map(|t| &t.knocks);
    if left_out.any(|at| !is_one(at)) {
        grid = with_knocks(record, &|name| audited.masked(name), seed)?;
        blows = knocked(&grid);
    }
    grid.bursts = bursts;
    let input = Input {
        file: String::new(),
        seconds: grid.seconds(),
        rate_hz: grid.rate_hz,
        samples: record.len(),
        channels: record.channels.iter().map(|c| c.name.clone()).collect(),
        notes: record.notes.clone(),
    };
    let mut prepared = Prepared {
        grid,
        audited,
        singles,
        sticking,
        dead,
        input,
        as_read,
        blows: vec![],
        again: None,
    };
    if !blows.is_empty() {
        let record = record.clone();
        prepared.again = Some(Again { record, seed });
        prepared.leave_out(blows);
    }
    Ok(prepared)
}

/// What the audits say of a record of which `mended` was put right.
fn audited_of(record: &Record, mended: &[Finding]) -> Audit {
    let mut audited = audit(record);
    audited.findings = all_worded(audited.findings);
    audited.checks = all_worded(audited.checks);
    audited.unexplained = all_worded(audited.unexplained);
    audited.not_tested = all_worded(audited.not_tested);
    // Put right by the sign, but for the readings that lay beyond the bit.
    for f in mended {
        audited.put_right(f);
    }
    audited
}

/// Where a base at rest may have been knocked.
fn knocked(grid: &Grid, singles: &BTreeMap<String, Vec<usize>>) -> Vec<Blow> {
    if matches!(grid.base, Some(Base::Moving | Base::Turntable)) {
        return vec![];
    }
    // Single far readings may be pieces of a blow; what else is not believed was never measured.
    let read = |target: &Target| {
        let mut y = target.y.to_vec();
        let of_counts = singles.get(&target.name);
        let single = |at: &usize| of_counts.is_some_and(|s| s.contains(at));
        let back = (target.aside.iter()).filter(|(at, _)| single(at) || target.spikes.contains(at));
        back.for_each(|(at, v)| y[*at] = *v);
        y
    };
    let targets: Vec<&Target> = grid.targets.iter().collect();
    blows(&targets, &read, (&grid.dct, &grid.bins), grid.rate_hz)
}

impl Prepared {
    /// The same with only those blows left out that were `borne_out`.
    pub fn with_those(mut self, borne_out: &[bool]) -> Self {
        let mut keep = borne_out.iter();
        let mut blows = std::mem::take(&mut self.blows);
        blows.retain(|_| keep.next().is_some_and(|k| *k));
        self.leave_out(blows);
        self
    }

    /// Lays the record out without the readings of blows, where there are enough others.
    fn leave_out(&mut self, blows: Vec<Blow>) {
        let Some(Again { record, seed }) = &self.again else {
            return;
        };
        let places = places_of_rows(record);
        let of = |r: &Range<usize>| -> Vec<usize> {
            (0..places.len())
                .filter(|i| r.contains(&places[*i]))
                .collect()
        };
        let knocked: Vec<usize> = blows.iter().flat_map(|b| of(&b.readings)).collect();
        let masked = |name: &str| {
            let mut rows = [self.audited.masked(name), knocked.clone()].concat();
            rows.sort_unstable();
            rows.dedup();
            rows
        };
        if let Ok(grid) = with_knocks(record, &masked, *seed) {
            (self.grid, self.blows) = (grid, blows);
        }
    }
}
