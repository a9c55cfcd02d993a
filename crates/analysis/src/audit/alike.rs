//! Readings of one gyro that are those of another: a word of the bus that is read twice, an axis that is wired as two.
//!
//! The differences of two gyros in one frame, in counts, have a smooth distribution whatever noise they share; copies add to
//! the difference 0 alone. What is expected there is the parabola through the differences beside it.

use std::collections::BTreeMap;

use model::record::Record;

use super::{Audit, FALSE_ALARM, Gyro, LEAST_READINGS, tails};
use crate::audit::local::robust_sigma;
use crate::result::Unexplained;

/// Spread of the differences, counts, below which their distribution is not smooth.
const LEAST_SPREAD: f64 = 2.0;
/// Room that the curve gets, relative: copies that matter are more.
const ROOM: f64 = 0.15;

/// Share of the frames from which on one gyro is the other.
const MOST: f64 = 0.5;

pub(super) fn audit(record: &Record, gyros: &[Gyro<'_>], audit: &mut Audit) {
    let rows = record.len();
    if rows < LEAST_READINGS {
        return;
    }
    for (i, a) in gyros.iter().enumerate() {
        for b in &gyros[i + 1..] {
            pair(a, b, audit);
        }
    }
}

/// Share of the frames in which two gyros that know nothing of each other read the same.
fn by_chance(x: &[i32], y: &[i32], rows: &[usize]) -> f64 {
    let shares = |of: &[i32]| {
        let mut all: BTreeMap<i32, f64> = BTreeMap::new();
        for i in rows {
            *all.entry(of[*i]).or_default() += 1.0 / rows.len() as f64;
        }
        all
    };
    let of_y = shares(y);
    let both = shares(x).into_iter();
    both.map(|(code, share)| share * of_y.get(&code).copied().unwrap_or(0.0))
        .sum()
}

fn pair(a: &Gyro<'_>, b: &Gyro<'_>, audit: &mut Audit) {
    let (Some(x), Some(y)) = (a.counts.as_ref(), b.counts.as_ref()) else {
        return;
    };
    if a.channel.lsb != b.channel.lsb {
        return;
    }
    let usable = |g: &Gyro<'_>| {
        audit
            .usable
            .get(&g.channel.name)
            .cloned()
            .unwrap_or_default()
    };
    let (of_a, of_b) = (usable(a), usable(b));
    let known = |i: &usize| {
        a.known(*i) && b.known(*i) && of_a.get(*i) == Some(&true) && of_b.get(*i) == Some(&true)
    };
    let rows: Vec<usize> = (0..x.len().min(y.len())).filter(known).collect();
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
    let expected = ((4.0 * one - two) / 6.0).max(0.0);
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
    if audit.check("equal_readings", second, same, chance, what.clone()) && chance < FALSE_ALARM {
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
        audit.unexplained.push(Unexplained {
            channel: second.clone(),
            what,
        });
    }
}
