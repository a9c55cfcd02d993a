//! Readings of one gyro that are those of another: a word of the bus that is read twice, an axis that is wired as two.
//!
//! The differences of two gyros in one frame, in counts, have a smooth distribution whatever noise they share; copies add to
//! the difference 0 alone. What is expected there is the parabola through the differences beside it. A stretch of copies is too
//! few of them to show so, but is a run of equal readings that is longer than chance makes any.

use model::record::Record;

use super::{Audit, Gyro, LEAST_READINGS};
use crate::test_level::{CheckId, Observation, audit_level};
use numerics::order_statistics::robust_sigma;
use numerics::tails;

/// Spread of the differences, counts, below which their distribution is not smooth.
const LEAST_SPREAD: f64 = 2.0;
/// Room that the curve gets, relative: copies that matter are more.
const ROOM: f64 = 0.15;

/// Share of the frames from which on one gyro is the other.
const MOST: f64 = 0.5;

/// Readings of a run below which it is not looked at.
const LEAST_RUN: usize = 10;
/// Longest runs that are weighed by more than the chance of a reading on its own.
const MOST_RUNS: usize = 3;
/// Rows that one gyro may lie behind another whose readings it holds.
const BEHIND: [(usize, usize); 3] = [(0, 0), (1, 0), (0, 1)];
/// What is new in a reading spreads this many times less than the narrowest of the differences, at most.
const NARROWER: f64 = 2.0;
/// Readings on either side of a run that tell whose it is, and the odds at which they do.
const ABOUT: usize = 400;
const ODDS: f64 = 1000.0;

pub(super) fn audit(record: &Record, gyros: &[Gyro<'_>], at: &[f64], audit: &mut Audit) {
    let rows = record.len();
    if rows < LEAST_READINGS {
        return;
    }
    for (i, a) in gyros.iter().enumerate() {
        for b in &gyros[i + 1..] {
            stretch(a, b, at, audit);
            pair(a, b, audit);
        }
    }
}

/// Share of the frames in which two gyros that know nothing of each other read the same.
fn by_chance(x: &[i32], y: &[i32], rows: &[usize]) -> f64 {
    let sorted = |of: &[i32]| {
        let mut all: Vec<i32> = rows.iter().map(|i| of[*i]).collect();
        all.sort_unstable();
        all
    };
    let (x, y) = (sorted(x), sorted(y));
    let mut of_y = y.chunk_by(|a, b| a == b).peekable();
    let pairs = x.chunk_by(|a, b| a == b).map(|of_x| {
        while of_y.next_if(|own| own[0] < of_x[0]).is_some() {}
        let own = of_y.next_if(|own| own[0] == of_x[0]);
        own.map_or(0.0, |own| of_x.len() as f64 * own.len() as f64)
    });
    pairs.sum::<f64>() / (rows.len() as f64).powi(2)
}

/// Counts of two gyros of one step, and the rows in which both are known.
fn counts<'a>(
    a: &'a Gyro<'_>,
    b: &'a Gyro<'_>,
    audit: &Audit,
) -> Option<(&'a [i32], &'a [i32], Vec<usize>)> {
    let (x, y) = (a.counts?, b.counts?);
    if a.channel.lsb != b.channel.lsb {
        return None;
    }
    let usable = |g: &'a Gyro<'_>| {
        let own = audit.usable.get(&g.channel.name).map(Vec::as_slice);
        let known = g.channel.values.iter().map(|v| v.is_finite());
        known
            .zip(own.unwrap_or_default())
            .map(|(known, own)| known && *own)
    };
    let both = usable(a).zip(usable(b)).enumerate();
    let rows = both.filter(|(_, (a, b))| *a && *b).map(|(i, _)| i);
    Some((x, y, rows.collect()))
}

/// How many of some numbers the most frequent of them is.
fn most_alike(all: &[Vec<i32>]) -> usize {
    let numbers = || all.iter().flatten().copied();
    let (Some(low), Some(high)) = (numbers().min(), numbers().max()) else {
        return 0;
    };
    let places = (i64::from(high) - i64::from(low)) as usize + 1;
    // What is spread wider than there are numbers is better sorted.
    if places > numbers().count() {
        let mut sorted: Vec<i32> = numbers().collect();
        sorted.sort_unstable();
        return sorted
            .chunk_by(|a, b| a == b)
            .map(<[i32]>::len)
            .max()
            .unwrap_or(0);
    }
    let mut counts = vec![0; places];
    numbers().for_each(|v| counts[(v - low) as usize] += 1);
    counts.into_iter().max().unwrap_or(0)
}

/// Largest share that one number has of those of some stretches, of their first or of their second differences: no reading
/// is known from those before with a larger chance, but for [`NARROWER`].
fn largest_share(stretches: &[&[i32]]) -> f64 {
    let mut stretches: Vec<Vec<i32>> = stretches.iter().map(|s| s.to_vec()).collect();
    let mut largest = 0.0f64;
    for _ in 0..3 {
        let count: usize = stretches.iter().map(Vec::len).sum();
        largest = largest.max(most_alike(&stretches) as f64 / count.max(1) as f64);
        for s in &mut stretches {
            *s = s.windows(2).map(|w| w[1].wrapping_sub(w[0])).collect();
        }
    }
    largest
}

/// A run of readings that two gyros have in common.
struct Run {
    first: usize,
    length: usize,
    /// Natural logarithm of the chance of a run as long from here on.
    ln_chance: f64,
}

/// The run that is least likely of two gyros that know nothing of each other's noise. Whatever the one reads, the other, its
/// past known, reads the same with no larger chance than that of what is likeliest: so large is it at most over the whole, in
/// the run, where both may be held, at a rail or quiet, and in the difference elsewhere, which what they share leaves alone.
fn longest(x: &[i32], y: &[i32]) -> Option<Run> {
    let d: Vec<i32> = x.iter().zip(y).map(|(x, y)| x - y).collect();
    let (mut first, mut runs) = (0, vec![]);
    for part in d.chunk_by(|a, b| (*a == 0) == (*b == 0)) {
        // Where most is the same there is no elsewhere.
        if part[0] == 0 && part.len() >= LEAST_RUN && 2 * part.len() < d.len() {
            runs.push((part.len(), first));
        }
        first += part.len();
    }
    runs.sort_unstable_by(|a, b| b.cmp(a));
    let most = runs.first()?.0;
    let ln_chance = |length: usize, share: f64| length as f64 * (NARROWER * share).min(1.0).ln();
    let own = largest_share(&[x]).max(largest_share(&[y]));
    if ln_chance(most, own) > (audit_level() / d.len() as f64).ln() {
        return None;
    }
    let weighed = runs.into_iter().take(MOST_RUNS).map(|(length, first)| {
        let end = first + length;
        let inside = largest_share(&[&x[first..end]]);
        let elsewhere = largest_share(&[&d[..first], &d[end..]]);
        Run {
            first,
            length,
            ln_chance: ln_chance(length, own.max(inside).max(elsewhere)),
        }
    });
    weighed.min_by(|a, b| a.ln_chance.total_cmp(&b.ln_chance))
}

/// Logarithm of the likelihood of readings of a run, normal as those about it.
fn likeness(x: &[i32], run: &Run) -> f64 {
    let end = run.first + run.length;
    let before = &x[run.first.saturating_sub(ABOUT)..run.first];
    let about: Vec<f64> = (before.iter().chain(x[end..].iter().take(ABOUT)))
        .map(|v| f64::from(*v))
        .collect();
    let n = about.len() as f64;
    let mean = about.iter().sum::<f64>() / n;
    // Rounding adds its own, so that a constant has a spread as well.
    let variance = about.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n + 1.0 / 12.0;
    let of = |v: &i32| -0.5 * ((f64::from(*v) - mean).powi(2) / variance + variance.ln());
    x[run.first..end].iter().map(of).sum()
}

/// The stretch that it is least likely for two gyros to read alike by chance, with how late each is in it, frames. `of` gives the
/// readings of one from a row on.
fn least_by_chance(
    a: &dyn Fn(usize) -> Vec<i32>,
    b: &dyn Fn(usize) -> Vec<i32>,
) -> Option<(Run, [usize; 2])> {
    let mut found: Option<(Run, [usize; 2])> = None;
    for (late_a, late_b) in BEHIND {
        // The shorter one ends where the other does: rows are paired from the first on.
        let run = longest(&a(late_a), &b(late_b));
        if let Some(run) = run
            && found.as_ref().is_none_or(|f| run.ln_chance < f.0.ln_chance)
        {
            found = Some((run, [late_a, late_b]));
        }
    }
    found
}

/// A stretch over which one gyro holds the readings of the other.
fn stretch(a: &Gyro<'_>, b: &Gyro<'_>, at: &[f64], audit: &mut Audit) {
    let Some((x, y, rows)) = counts(a, b, audit).filter(|c| c.2.len() >= LEAST_READINGS) else {
        return;
    };
    let of =
        |all: &[i32], late: usize| -> Vec<i32> { rows[late..].iter().map(|i| all[*i]).collect() };
    let Some((run, [late_a, late_b])) = least_by_chance(&|late| of(x, late), &|late| of(y, late))
    else {
        return;
    };
    let rows_of = |late: usize| rows[run.first + late..][..run.length].to_vec();
    let (of_a, of_b) = (rows_of(late_a), rows_of(late_b));
    // What both read is like what its own gyro reads about it.
    let for_a = likeness(&of(x, late_a), &run) - likeness(&of(y, late_b), &run);
    let (first, second) = (a.channel.name.as_str(), b.channel.name.as_str());
    let holder = match late_a.cmp(&late_b) {
        std::cmp::Ordering::Greater => Some((first, second, &of_a)),
        std::cmp::Ordering::Less => Some((second, first, &of_b)),
        std::cmp::Ordering::Equal if for_a > ODDS.ln() => Some((second, first, &of_b)),
        std::cmp::Ordering::Equal if for_a < -ODDS.ln() => Some((first, second, &of_a)),
        std::cmp::Ordering::Equal => None,
    };
    let (name, from_to) = holder.map_or((second, &of_b), |h| (h.0, h.2));
    let seconds = |i: Option<&usize>| i.and_then(|i| at.get(*i)).copied().unwrap_or(0.0);
    let when = format!(
        "from {:.2} to {:.2} s, {} readings, count for count",
        seconds(from_to.first()),
        seconds(from_to.last()),
        run.length
    );
    let late = if late_a == late_b {
        ""
    } else {
        " a frame late"
    };
    let what = match holder {
        Some((holder, source, _)) => {
            format!("{holder} holds the readings of {source}{late} {when}")
        }
        None => format!("{first} and {second} read the same {when}: one holds the other's"),
    };
    let looks = (BEHIND.len() * rows.len()) as f64;
    let chance = (looks * run.ln_chance.exp()).min(1.0);
    let length = run.length as f64;
    let fails = audit.check(CheckId::CopiedStretch, name, length, chance, what.clone());
    audit.about(&[first, second]);
    if fails {
        audit.unexplain(name, what);
        // Where it is not known which is the copy, neither is.
        for (own, held) in [(first, &of_a), (second, &of_b)] {
            if holder.is_none_or(|h| h.0 == own) {
                held.iter().for_each(|i| audit.mask(own, *i));
            }
        }
    }
}

fn pair(a: &Gyro<'_>, b: &Gyro<'_>, audit: &mut Audit) {
    let Some((x, y, rows)) = counts(a, b, audit) else {
        return;
    };
    let d: Vec<f64> = rows.iter().map(|i| f64::from(x[*i] - y[*i])).collect();
    if d.len() < LEAST_READINGS {
        return;
    }
    let times = |k: i32| d.iter().filter(|v| **v == f64::from(k)).count() as f64;
    let same = times(0);
    // Two that hardly leave one code agree without being copies: nearer to all frames than to those of chance.
    let whole = same > MOST * d.len() as f64 && {
        let chance = by_chance(x, y, &rows);
        chance < MOST && same > 0.5 * (1.0 + chance) * d.len() as f64
    };
    if !whole && robust_sigma(&d) < LEAST_SPREAD {
        return;
    }
    let (one, two) = (times(1) + times(-1), times(2) + times(-2));
    // Codes that both leave out, and codes that are wider on both, make more agree.
    let alone = by_chance(x, y, &rows) * d.len() as f64;
    let expected = ((4.0 * one - two) / 6.0).max(alone);
    // Errors of the four neighbours.
    let error = (16.0 * one + two).sqrt() / 6.0;
    let chance = tails::at_least(same as u64, expected * (1.0 + ROOM) + 3.0 * error + 1.0);
    let (first, second) = (&a.channel.name, &b.channel.name);
    let what = if whole {
        format!("{second} reads the same as {first}: one of them is not what its name says")
    } else {
        format!(
            "{same} frames hold one reading as {first} and as {second}, {expected:.0} are expected: one holds the other's"
        )
    };
    let fails = audit.check(CheckId::EqualReadings, second, same, chance, what.clone());
    audit.about(&[first, second]);
    if fails && chance < audit_level() {
        let copies: Vec<usize> = rows
            .into_iter()
            .zip(&d)
            .filter(|(_, d)| **d == 0.0)
            .map(|r| r.0)
            .collect();
        // Which of them is one by chance cannot be told where those are the many; a copy of all leaves nothing to look at.
        if !whole && same > 2.0 * expected {
            for row in copies {
                audit.mask(second, row);
            }
        }
        let seen = Observation::of_readings(second, what).following(first);
        audit
            .unexplained
            .push(seen.by(CheckId::EqualReadings, chance));
    }
}
