//! Rows that came and cannot be read: they keep their places, so that a row that was spoilt on disk is no reading that the
//! sensor or the line lost.

use model::record::{Record, flag};

/// Rows without readings between two rows.
struct Gap {
    /// The row after them.
    before: usize,
    rows: usize,
    /// Places from the row before them to the row after.
    places: f64,
}

/// Gives rows that were left out their places again, without readings, as far as the rows about them leave room; how
/// many. `skipped` holds, for each of them in the order of the file, the row that came next.
pub(super) fn keep_places(record: &mut Record, skipped: &[usize]) -> usize {
    let place = places(record);
    let mut sorted = place.clone().unwrap_or_default();
    sorted.sort_unstable_by(f64::total_cmp);
    let room = |at: usize| {
        let (from, to) = match &place {
            Some(place) => (*place.get(at - 1)?, *place.get(at)?),
            None => return Some(f64::INFINITY),
        };
        // Rows out of order have others between them.
        let next = sorted.partition_point(|p| *p <= from);
        (to > from && sorted.get(next) == Some(&to)).then(|| (to - from).round() - 1.0)
    };
    let gaps: Vec<Gap> = (skipped.chunk_by(|a, b| a == b))
        .filter(|same| (1..record.len()).contains(&same[0]))
        .filter_map(|same| {
            let room = room(same[0])?.min(1e9);
            let rows = same.len().min(room as usize);
            let places = if place.is_some() { room + 1.0 } else { 1.0 };
            (rows > 0).then_some(Gap {
                before: same[0],
                rows,
                places,
            })
        })
        .collect();
    let whole =
        |a: u64, b: u64, share: f64| a + ((b.saturating_sub(a)) as f64 * share).round() as u64;
    spread(&mut record.seq, &gaps, whole);
    spread(&mut record.t_ticks, &gaps, whole);
    spread(&mut record.host_time_s, &gaps, |a, b, share| {
        a + (b - a) * share
    });
    // Nothing is known of them, and no bit may say that something is.
    spread(&mut record.flags, &gaps, |_, _, _| flag::IN_ORDER);
    for channel in &mut record.channels {
        fill(&mut channel.values, &gaps, |_, _, _| f64::NAN);
        spread(&mut channel.counts, &gaps, |_, _, _| 0);
    }
    gaps.iter().map(|gap| gap.rows).sum()
}

/// Places of the rows in intervals: by their numbers, else by their times. `None` where nothing counts them, and each row is
/// one.
fn places(record: &Record) -> Option<Vec<f64>> {
    let whole = |counter: &Vec<u64>| counter.iter().map(|v| *v as f64).collect::<Vec<f64>>();
    if let Some(seq) = &record.seq {
        return Some(whole(seq));
    }
    let ticks = record.t_ticks.as_ref().map(whole);
    let times = ticks.or_else(|| record.host_time_s.clone())?;
    let mut steps: Vec<f64> = times.windows(2).map(|t| (t[1] - t[0]).abs()).collect();
    let middle = steps.len() / 2;
    let usual = (!steps.is_empty())
        .then(|| *steps.select_nth_unstable_by(middle, f64::total_cmp).1)
        .filter(|usual| *usual > 0.0)?;
    Some(times.iter().map(|t| t / usual).collect())
}

fn spread<T: Copy>(of: &mut Option<Vec<T>>, gaps: &[Gap], between: impl Fn(T, T, f64) -> T) {
    if let Some(of) = of {
        fill(of, gaps, between);
    }
}

/// Puts what stands `between` two rows, at a share of the way from one to the other, into the gaps.
fn fill<T: Copy>(of: &mut Vec<T>, gaps: &[Gap], between: impl Fn(T, T, f64) -> T) {
    if gaps.is_empty() {
        return;
    }
    let old = std::mem::take(of);
    let mut gaps = gaps.iter().peekable();
    let mut last = None;
    for (row, now) in old.into_iter().enumerate() {
        if let (Some(gap), Some(last)) = (gaps.next_if(|gap| gap.before == row), last) {
            of.extend((1..=gap.rows).map(|k| between(last, now, k as f64 / gap.places)));
        }
        of.push(now);
        last = Some(now);
    }
}
