//! A record's rows in order, before anything looks at them: rows that are there twice, rows out of order, boards that
//! start anew, a header that contradicts the clock. What was done is said in [`Record::notes`].
//!
//! Device time and sequence numbers decide. A row is there twice when both and all readings are the same. Numbers that
//! go back mean rows out of order where they fill places in time that are free, and a board that started anew where the
//! places are taken, or where the host's clock goes on over them.

mod bursts;
mod keys;
mod parts;
mod rate;
mod set_back;

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::hash::{DefaultHasher, Hash, Hasher};

use crate::record::{Record, sentinels};

pub use bursts::{Bursts, end_to_end};
use keys::Keys;
pub use parts::{longest_part, part_of};
pub use rate::by_times;

/// Largest counter that is one.
const LARGEST: u64 = 1 << 53;
/// Latency of host times that a start of the board may seem earlier by, s.
const LATENCY_S: f64 = 0.2;
/// Settings of a host's clock that one record is believed to hold.
const MOST_SETTINGS: usize = 10;
/// Share of the rows beyond which going back cannot be boards that start anew.
const MOST_STARTS: f64 = 0.05;

/// The record with its rows in order, every instant once, and notes of what was wrong with them. Any record: one that is
/// in order is borrowed, and what was put in order stays as it is.
#[must_use]
pub fn in_order(record: &Record) -> Cow<'_, Record> {
    let mut out = Cow::Borrowed(record);
    let keys = Keys::of(record);
    if let Some((keys, notes)) = keys.as_ref().and_then(|k| mended(record, k)) {
        out = Cow::Owned(taken(record, &keys));
        note(&mut out, notes);
    }
    drop_useless(&mut out);
    rate::check(&mut out);
    rate::take_from_times(&mut out);
    let gaps = without_readings(&out);
    note(&mut out, gaps);
    out
}

fn note(record: &mut Cow<'_, Record>, notes: Vec<String>) {
    for note in notes {
        if !record.notes.contains(&note) {
            record.to_mut().notes.push(note);
        }
    }
}

/// What becomes of a row: which one it is in the file, and its new number and time.
struct Place {
    row: usize,
    seq: Option<i64>,
    ticks: Option<i64>,
    /// What is added to its host time, s.
    shift_s: f64,
}

/// The rows in order, or nothing where they are.
fn mended(record: &Record, keys: &Keys) -> Option<(Vec<Place>, Vec<String>)> {
    let rows = keys.len();
    if !(1..rows).any(|i| keys.odd(i - 1, i)) {
        return None;
    }
    let mut notes = vec![];
    let twice = twice(record, keys);
    if let Some(first) = twice.iter().min() {
        notes.push(format!(
            "{} are there twice, {} and readings the same, the first is row {}: counted once",
            rows_are(twice.len()),
            keys.what(),
            first + 1
        ));
    }
    let left: Vec<usize> = (0..rows).filter(|i| !twice.contains(i)).collect();
    let starts = starts(keys, &left);
    let back: Vec<usize> = (1..left.len())
        .filter(|k| !starts.contains(k) && keys.back(left[k - 1], left[*k]))
        .collect();
    if keys.is_host() && !back.is_empty() && !keys.are_times(&left, back.len()) {
        notes.push(format!(
            "the times run back at {} of {rows} rows, and are no times of sampling: the rows are taken as they come",
            back.len()
        ));
        return Some((keys.places(&left), notes));
    }
    if keys.is_host()
        && let Some(places) = set_back(keys, &left, &back, &mut notes)
    {
        return Some((places, notes));
    }
    if let Some(first) = back.first() {
        notes.push(if back.len() + 1 == left.len() {
            "the rows run backwards in time: put in order".to_owned()
        } else {
            format!(
                "the time goes back at {}, first at row {} of the file: the rows are put in order by {}",
                places_are(back.len()),
                left[*first] + 1,
                keys.by()
            )
        });
    }
    let (all, rivals) = joined(keys, &left, &starts, &mut notes);
    if let Some(first) = rivals.iter().min() {
        notes.push(format!(
            "{} of an instant that another row has, with other readings, the first is row {}: left out",
            rows_are(rivals.len()),
            first + 1
        ));
    }
    Some((all, notes))
}

/// Places of the rows that are left, those of each start of the board behind those of the one before; and rows of an instant that
/// another one has.
fn joined(
    keys: &Keys,
    left: &[usize],
    starts: &[usize],
    notes: &mut Vec<String>,
) -> (Vec<Place>, Vec<usize>) {
    let mut all: Vec<Place> = vec![];
    let mut rivals = vec![];
    let ends = starts.iter().copied().chain([left.len()]);
    let mut from = 0;
    for end in ends {
        let mut part: Vec<usize> = left[from..end].to_vec();
        part.sort_by(|a, b| keys.compare(*a, *b));
        let mut last: Option<usize> = None;
        let (mut seq_offset, mut ticks_offset) = (0, 0);
        if let (Some(before), Some(first)) = (all.last(), part.first()) {
            let previous = left[from - 1];
            let gap = keys.instants(previous, left[from]);
            seq_offset = before.seq.unwrap_or(0) + gap.unwrap_or(2) - keys.seq_at(*first);
            ticks_offset =
                before.ticks.unwrap_or(0) + keys.ticks_of(gap.unwrap_or(2)) - keys.ticks_at(*first);
            notes.push(format!(
                "the board started anew before row {} of the file: its numbers and times go on from there, {}",
                left[from] + 1,
                gap.map_or_else(
                    || "after one place left free, because nothing tells how long it was off".into(),
                    |g| format!("{g} sample instants later by the host's clock")
                )
            ));
        }
        for row in part {
            // What rounded times have in common says nothing.
            if keys.seq(row).is_some() && last.is_some_and(|l| keys.compare(l, row).is_eq()) {
                rivals.push(row);
                continue;
            }
            last = Some(row);
            all.push(Place {
                row,
                seq: keys.seq(row).map(|s| s + seq_offset),
                ticks: keys.ticks(row).map(|t| t + ticks_offset),
                shift_s: 0.0,
            });
        }
        from = end;
    }
    (all, rivals)
}

/// The rows as they come, their times going on, where the host's clock was set back at each of the places `back`.
fn set_back(
    keys: &Keys,
    left: &[usize],
    back: &[usize],
    notes: &mut Vec<String>,
) -> Option<Vec<Place>> {
    if back.is_empty() || back.len() > MOST_SETTINGS {
        return None;
    }
    let t: Option<Vec<f64>> = left.iter().map(|row| keys.host(*row)).collect();
    let t = t?;
    let shifts = set_back::shifts(&t, back)?;
    let first = *back.first()?;
    let (size, row) = (t[first - 1] - t[first], left[first] + 1);
    let places = match back.len() {
        1 => format!("by {size:.3} s before row {row} of the file"),
        n => format!("at {n} places, first by {size:.3} s before row {row} of the file"),
    };
    notes.push(format!(
        "the clock of the times was set back {places}: the rows stay in the order of the file, and its times go on from there. Two \
         recordings in one file look the same: if it is that, split it there"
    ));
    let mut places = keys.places(left);
    for (k, place) in places.iter_mut().enumerate() {
        let settings = back.partition_point(|at| *at <= k);
        place.shift_s = settings.checked_sub(1).map_or(0.0, |s| shifts[s]);
    }
    Some(places)
}

fn rows_are(n: usize) -> String {
    match n {
        1 => "1 row".into(),
        n => format!("{n} rows"),
    }
}

fn places_are(n: usize) -> String {
    match n {
        1 => "1 place".into(),
        n => format!("{n} places"),
    }
}

/// All that a row reads, without the time of its arrival.
fn readings(record: &Record, row: usize) -> impl Iterator<Item = u64> + '_ {
    let flags = record.flags.as_ref().and_then(|f| f.get(row));
    let values = record
        .channels
        .iter()
        .filter_map(move |c| c.values.get(row));
    values
        .map(|v| v.to_bits())
        .chain(flags.map(|f| u64::from(*f)))
}

/// Rows that repeat an earlier one.
fn twice(record: &Record, keys: &Keys) -> HashSet<usize> {
    let rows = keys.len();
    let mut of_key: HashMap<(i64, i64, u64), usize> = HashMap::new();
    let mut known = HashSet::new();
    let (mut same, mut other) = (vec![], 0usize);
    for row in 0..rows {
        let mut hasher = DefaultHasher::new();
        readings(record, row).for_each(|v| v.hash(&mut hasher));
        let (a, b) = keys.identity(row);
        let again = !known.insert((a, b));
        let first = *of_key.entry((a, b, hasher.finish())).or_insert(row);
        if first != row && readings(record, first).eq(readings(record, row)) {
            same.push((first, row));
        } else if again {
            other += 1;
        }
    }
    // Where rows of one instant mostly differ, those that do not are alike by chance: times are rounded, or a board
    // started anew.
    let by_chance = same.len() < 9 * other;
    let arrived = |row: usize| keys.host(row).map(f64::to_bits);
    same.into_iter()
        .filter(|(a, b)| {
            !by_chance || (!keys.is_host() && arrived(*a).is_some() && arrived(*a) == arrived(*b))
        })
        .map(|(_, row)| row)
        .collect()
}

/// Where in `left` a board has started anew.
fn starts(keys: &Keys, left: &[usize]) -> Vec<usize> {
    if keys.is_host() {
        return vec![];
    }
    let odd: Vec<usize> = (1..left.len())
        .filter(|k| keys.odd(left[k - 1], left[*k]))
        .collect();
    let mut found = vec![];
    let mut taken: HashSet<i64> = HashSet::new();
    let mut at = 0;
    for (j, k) in odd.iter().enumerate() {
        taken.extend(left[at..*k].iter().map(|row| keys.slot(*row)));
        at = *k;
        let (before, row) = (left[k - 1], left[*k]);
        let end = odd.get(j + 1).copied().unwrap_or(left.len());
        let chain = &left[*k..end];
        let of_others = chain
            .iter()
            .filter(|r| taken.contains(&keys.slot(**r)))
            .count();
        let anew = match keys.gain_s(before, row) {
            _ if keys.clocks_part(before, row) => true,
            _ if !keys.back(before, row) => false,
            Some(gain) if gain > 0.0 && keys.since_start_s(row) <= gain + LATENCY_S => true,
            None if keys.is_at_start(row) && chain.len() > keys::START => true,
            _ => chain.len() > 1 && 2 * of_others > chain.len(),
        };
        if anew {
            found.push(*k);
            taken.clear();
        }
    }
    if found.len() as f64 > 1.0 + MOST_STARTS * left.len() as f64 {
        return vec![];
    }
    found
}

/// The rows of `places`, in that order.
fn taken(record: &Record, places: &[Place]) -> Record {
    fn pick<T: Copy>(from: &[T], places: &[Place]) -> Vec<T> {
        places
            .iter()
            .filter_map(|p| from.get(p.row).copied())
            .collect()
    }
    let least = |of: &dyn Fn(&Place) -> Option<i64>| places.iter().filter_map(of).min();
    let shift = |least: Option<i64>| least.filter(|l| *l < 0).map_or(0, |l| -l);
    let seq_shift = shift(least(&|p| p.seq));
    let ticks_shift = shift(least(&|p| p.ticks));
    let counter = |old: &Option<Vec<u64>>, of: &dyn Fn(&Place) -> Option<i64>, shift: i64| {
        let known: Option<Vec<u64>> = places
            .iter()
            .map(|p| of(p).and_then(|v| u64::try_from(v.saturating_add(shift)).ok()))
            .collect();
        known.or_else(|| old.as_ref().map(|o| pick(o, places)))
    };
    Record {
        header: record.header.clone(),
        seq: counter(&record.seq, &|p| p.seq, seq_shift),
        t_ticks: counter(&record.t_ticks, &|p| p.ticks, ticks_shift),
        host_time_s: record.host_time_s.as_ref().map(|h| {
            (places.iter())
                .filter_map(|p| Some(h.get(p.row)? + p.shift_s))
                .collect()
        }),
        flags: record.flags.as_ref().map(|f| pick(f, places)),
        channels: record
            .channels
            .iter()
            .map(|c| crate::record::Channel {
                values: pick(&c.values, places),
                counts: c.counts.as_ref().map(|c| pick(c, places)),
                ..c.clone()
            })
            .collect(),
        notes: record.notes.clone(),
    }
}

/// Counters that count nothing are none.
fn drop_useless(record: &mut Cow<'_, Record>) {
    let rows = record.len();
    let counts = |c: &[u64]| c.len() == rows && c.iter().all(|v| *v <= LARGEST);
    let rises = |c: &[u64]| counts(c) && c.windows(2).all(|w| w[0] < w[1]);
    if record.seq.as_deref().is_some_and(|s| !rises(s)) {
        let record = record.to_mut();
        record.seq = None;
        let why = "the sequence numbers do not count the rows: they are not used";
        record.notes.push(why.into());
    }
    let goes_on = |t: &[u64]| {
        let t: Vec<i64> = t.iter().map(|v| *v as i64).collect();
        let number: Vec<i64> = (0..t.len() as i64).collect();
        rate::ratio(&t, &number).is_some()
    };
    let useless = |t: &[u64]| !counts(t) || (rows > 1 && !goes_on(t));
    if record.t_ticks.as_deref().is_some_and(useless) {
        let record = record.to_mut();
        record.t_ticks = None;
        let why = "the device's time does not go on with the rows: it is not used";
        record.notes.push(why.into());
    }
}

/// Channels with rows that read nothing.
fn without_readings(record: &Record) -> Vec<String> {
    let mut by_count: Vec<(usize, Vec<&str>)> = vec![];
    for c in &record.channels {
        let none = c.values.iter().filter(|v| !v.is_finite()).count();
        // What was left out of it is told already.
        if none == 0 || sentinels::are_told(record, &c.name, none) {
            continue;
        }
        match by_count.iter_mut().find(|(n, _)| *n == none) {
            Some((_, names)) => names.push(&c.name),
            None => by_count.push((none, vec![&c.name])),
        }
    }
    let rows = record.len();
    let told = |(n, names): (usize, Vec<&str>)| {
        format!(
            "{} of {rows} rows have no reading of {} (empty or NaN): nothing is concluded from them",
            n,
            names.join(", ")
        )
    };
    by_count.into_iter().map(told).collect()
}
