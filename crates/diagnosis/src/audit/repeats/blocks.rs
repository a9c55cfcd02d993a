//! Blocks of frames that come again: a buffer that was sent twice.
//!
//! A run of frames that are those `lag` frames before, on all gyros, is held against the chance that a frame is: how often
//! readings agree that lie far apart, or just as far as these, the more so where those before them agree as well; or, within
//! the run, with each other, as of gyros that stand still for a while. The largest of these is taken.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use model::record::Record;
use model::{Parameter, effects};

use super::super::{Audit, Gyro, counted};
use crate::test_level::{CheckId, audit_level};

/// Part of the level of its check that this look may spend: runs that matter are far beyond it, and the other has the rest.
const SPENT: f64 = 0.01;
/// Longest window that runs are looked for with.
const LONGEST_WINDOW: usize = 200;
/// Distances at which the chance of agreement is counted, and readings compared for that at most, by axis.
const DISTANCES: usize = 32;
const COMPARED: usize = 4_000_000;
/// Agreements in turn up to which the next one is counted, and the least count of them that tells its chance.
const IN_TURN: usize = 4;
const LEAST: f64 = 50.0;
/// Distances of runs that are weighed, the longest runs first.
const WEIGHED: usize = 50;
/// Sum of 1 / lag^2: shorter distances get more of the level.
const LAGS: f64 = 1.645;
/// Share of all frames from which on they are no repeats, but what the record is.
const MOST: f64 = 0.5;

/// Frames `rows` that are those `lag` before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    first: usize,
    length: usize,
    lag: usize,
}

impl Run {
    fn rows(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.length
    }
}

/// Readings as numbers that are equal where those are.
struct Codes {
    axes: Vec<Vec<u64>>,
    /// Of the whole frame; of one that lacks a reading there is no other.
    frames: Vec<u64>,
}

impl Codes {
    fn of(gyros: &[&Gyro<'_>], rows: usize) -> Self {
        let code = |g: &Gyro<'_>, i: usize| match g.counts {
            Some(c) => u64::from(c[i] as u32),
            None => (g.channel.values[i] + 0.0).to_bits(),
        };
        let axes: Vec<Vec<u64>> = gyros
            .iter()
            .map(|g| (0..rows).map(|i| code(g, i)).collect())
            .collect();
        let frame = |i: usize| {
            let mut hasher = DefaultHasher::new();
            if gyros.iter().all(|g| g.known(i)) {
                axes.iter().for_each(|a| a[i].hash(&mut hasher));
            } else {
                (i, "lacks a reading").hash(&mut hasher);
            }
            hasher.finish()
        };
        let frames = (0..rows).map(frame).collect();
        Self { axes, frames }
    }

    /// Largest share of frames that are those some frames before, outside of `but`; of an axis that tells none it is `unknown`.
    fn share(&self, distances: &[usize], but: &[Run], unknown: f64) -> f64 {
        let product: f64 = (self.axes.iter())
            .map(|axis| agreement(axis, distances, but).unwrap_or(unknown))
            .product();
        product.max(agreement(&self.frames, distances, but).unwrap_or(0.0))
    }

    /// Chance that two frames of a run are one.
    fn within(&self, run: &Run) -> f64 {
        let pairs = (run.length * (run.length - 1) / 2) as f64;
        let alike = |of: &[u64]| {
            let mut sorted = of[run.rows()].to_vec();
            sorted.sort_unstable();
            let same = sorted.chunk_by(|a, b| a == b).map(<[u64]>::len);
            let same = same.map(|n| (n * (n - 1) / 2) as f64).sum::<f64>();
            ((same + 2.0 * same.sqrt()) / pairs).min(1.0)
        };
        let product: f64 = self.axes.iter().map(|a| alike(a)).product();
        product.max(alike(&self.frames))
    }

    /// Runs of at least `window` frames that are those before, each at the smallest distance at which it begins so.
    fn runs(&self, window: usize) -> Vec<Run> {
        let windows = self.frames.windows(window).enumerate();
        let mut places: Vec<(u64, usize)> = windows
            .map(|(i, w)| {
                let mut hasher = DefaultHasher::new();
                w.hash(&mut hasher);
                (hasher.finish(), i)
            })
            .collect();
        places.sort_unstable();
        let mut before = vec![None; places.len()];
        for pair in places.windows(2).filter(|p| p[0].0 == p[1].0) {
            before[pair[1].1] = Some(pair[0].1);
        }
        let (mut runs, mut i) = (vec![], 0);
        while i < before.len() {
            let Some(source) = before[i] else {
                i += 1;
                continue;
            };
            let pairs = self.frames[source..].iter().zip(&self.frames[i..]);
            let length = pairs.take_while(|(a, b)| a == b).count();
            // Windows whose numbers alone are the same have no run.
            if length >= window {
                runs.push(Run {
                    first: i,
                    length,
                    lag: i - source,
                });
            }
            i += length.max(1);
        }
        runs
    }
}

/// Largest share of readings that agree with those some readings before, of all and of those that follow on so many that do;
/// a bound of what is counted. `None` where there are too few.
fn agreement(codes: &[u64], distances: &[usize], but: &[Run]) -> Option<f64> {
    let mut in_turn = [0.0f64; IN_TURN + 2];
    for &lag in distances {
        let mut now = 0;
        let mut left = but.iter().filter(|r| r.lag == lag).peekable();
        for i in lag..codes.len() {
            while left.next_if(|r| r.rows().end <= i).is_some() {}
            if left.peek().is_some_and(|r| r.rows().contains(&i)) {
                now = 0;
                continue;
            }
            in_turn[0] += 1.0;
            now = if codes[i] == codes[i - lag] {
                now + 1
            } else {
                0
            };
            // Of a run of four: one of one, of two, of three and of four.
            (in_turn.iter_mut().skip(1).take(now)).for_each(|n| *n += 1.0);
        }
    }
    let shares = in_turn.windows(2).filter(|w| w[0] >= LEAST);
    let bound = shares.map(|w| (w[1] + 2.0 * w[1].sqrt() + 2.0) / w[0]);
    bound.reduce(f64::max).map(|share| share.min(1.0))
}

/// Distances that lie between 20 readings and a quarter of them all, evenly by their logarithms.
fn distances(rows: usize) -> Vec<usize> {
    let count = (COMPARED / rows).clamp(8, DISTANCES);
    let (least, most) = (20.0f64, (rows as f64 / 4.0).max(21.0));
    let part = |k: usize| (k as f64 + 0.5) / count as f64;
    (0..count)
        .map(|k| (least * (most / least).powf(part(k))) as usize)
        .collect()
}

/// Runs of frames that chance does not make, in order, with the natural logarithm of the chance of the least likely.
fn found(codes: &Codes) -> Option<(Vec<Run>, f64)> {
    let rows = codes.frames.len();
    let n = rows as f64;
    let level = (SPENT * audit_level()).ln();
    let anywhere = codes.share(&distances(rows), &[], 1.0);
    // The shortest run at the shortest distance that would be told.
    let window = ((level - (4.0 * LAGS * n).ln()) / anywhere.ln()).ceil();
    if anywhere >= 1.0 || window > LONGEST_WINDOW as f64 || window >= n {
        return None;
    }
    let mut runs = codes.runs((window as usize).max(2));
    runs.retain(|r| r.lag > 1);
    runs.sort_by_key(|r| std::cmp::Reverse(r.length));
    let mut at_lag: BTreeMap<usize, f64> = BTreeMap::new();
    let mut weighed: Vec<(Run, f64)> = vec![];
    for run in &runs {
        let looks = (LAGS * n).ln() + 2.0 * (run.lag as f64).ln();
        let ln_chance = |share: f64| run.length as f64 * share.max(f64::MIN_POSITIVE).ln();
        let share = anywhere.max(codes.within(run));
        if ln_chance(share) + looks > level && !at_lag.contains_key(&run.lag) {
            continue;
        }
        if at_lag.len() >= WEIGHED && !at_lag.contains_key(&run.lag) {
            continue;
        }
        let here = *at_lag.entry(run.lag).or_insert_with(|| {
            let mut but: Vec<Run> = runs.iter().copied().filter(|r| r.lag == run.lag).collect();
            but.sort_by_key(|r| r.first);
            codes.share(&[run.lag], &but, 0.0)
        });
        weighed.push((*run, ln_chance(share.max(here)) + n.ln()));
    }
    // Where one block came again, the others at that distance have no look at others to pay for.
    let of_lag = |r: &Run| 2.0 * (r.lag as f64).ln() + LAGS.ln();
    let alone: Vec<usize> = (weighed.iter())
        .filter(|(r, ln)| ln + of_lag(r) < level)
        .map(|(r, _)| r.lag)
        .collect();
    let least = weighed.iter().map(|(r, ln)| ln + of_lag(r));
    let least = least.fold(0.0, f64::min);
    let taken = weighed.into_iter();
    let taken = taken.filter(|(r, ln)| *ln < level && alone.contains(&r.lag));
    let mut taken: Vec<Run> = taken.map(|(r, _)| r).collect();
    taken.sort_by_key(|r| r.first);
    let frames: usize = taken.iter().map(|r| r.length).sum();
    (!taken.is_empty() && (frames as f64) < MOST * n).then_some((taken, least - SPENT.ln()))
}

/// `least` to `most` of something, or the one number.
fn from_to(all: impl Iterator<Item = usize> + Clone) -> String {
    match (all.clone().min(), all.max()) {
        (Some(least), Some(most)) if least != most => format!("{least} to {most}"),
        (least, _) => least.unwrap_or(0).to_string(),
    }
}

/// What was seen, for a person.
fn told(runs: &[Run], at: &[f64]) -> String {
    let frames: usize = runs.iter().map(|r| r.length).sum();
    let lengths = from_to(runs.iter().map(|r| r.length));
    let lags = from_to(runs.iter().map(|r| r.lag));
    let first = runs.first().map_or(0.0, |r| at[r.first]);
    match runs.len() {
        1 => format!(
            "{frames} frames in turn repeat, reading for reading, those {lags} frames before, at {first:.2} s: a buffer that was sent twice"
        ),
        blocks => format!(
            "{frames} frames in {blocks} blocks of {lengths} repeat, reading for reading, those {lags} frames before, the first at {first:.2} s: buffers that were sent twice"
        ),
    }
}

/// Blocks of frames that come again; `gyros` are those that vary.
pub(super) fn audit(record: &Record, gyros: &[&Gyro<'_>], at: &[f64], audit: &mut Audit) {
    let Some((mut runs, ln_chance)) = found(&Codes::of(gyros, at.len())) else {
        return;
    };
    let names: Vec<String> = gyros.iter().map(|g| g.channel.name.clone()).collect();
    let new = |i: usize| {
        names
            .iter()
            .any(|n| audit.usable.get(n).is_some_and(|u| u[i]))
    };
    runs.retain(|r| r.rows().any(new));
    if runs.is_empty() {
        return;
    }
    let rows: Vec<usize> = runs.iter().flat_map(Run::rows).collect();
    let (count, what) = (rows.len() as f64, told(&runs, at));
    let chance = ln_chance.exp().min(1.0);
    if !audit.check(
        CheckId::RepeatedFrames,
        "record",
        count,
        chance,
        what.clone(),
    ) {
        return;
    }
    for name in &names {
        rows.iter().for_each(|i| audit.mask(name, *i));
    }
    let times: Vec<f64> = rows.iter().map(|i| at[*i]).collect();
    let mut finding = counted(effects::stale_samples::ID, names, count, None, &times, what);
    let mut lags: Vec<usize> = runs.iter().map(|r| r.lag).collect();
    lags.sort_unstable();
    let of_block = [
        ("running", count / runs.len() as f64),
        ("behind", lags[lags.len() / 2] as f64),
    ];
    let of_block = of_block.map(|(name, value)| (name.to_owned(), Parameter::exact(value, "1")));
    finding.parameters.extend(of_block);
    if record.flags.is_some() {
        finding.what.push_str("; the new-data flags do not tell");
    }
    audit.findings.push(finding);
}
