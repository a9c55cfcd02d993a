//! What is over within two seconds, or rings down within some, and is far beyond the noise: a knock, before anything is fitted.
//!
//! A knock of a hundred standard deviations holds more energy at the frequencies of a moving base than a base that moves has, and
//! its edges are jumps to readings beside it. Both are asked of what it leaves. Whether it is a shock, the final model tells.

use std::ops::Range;

use model::effects::shock::{LONGEST_RING_S, LONGEST_S, PERIODS};
use numerics::order_statistics::{median, robust_sigma};

use super::spikes::spike_limit;

/// Readings on either side whose median is the level, over those in [`LONGEST_S`].
const BESIDE: f64 = 2.5;
/// Readings that tell of a level.
const TOLD: usize = 400;
/// Longest that it stays beyond the noise, over [`LONGEST_S`]: a ring of that duration and of a thousand standard deviations.
const LONGEST: f64 = 2.0;
/// Part of [`LONGEST_S`] in which nothing is far off after it has ended, and that is left out with it on either side.
const APART: f64 = 0.25;
/// Energy of the first half of a ring over that of the second, at least: by its end it is hardly beyond the noise any more. Of what
/// stays as it is the two are the same.
const FALLS: f64 = 4.0;
/// Fewest far readings of one, and most of them in a record: a machine that knocks has more.
const FEWEST: usize = 3;
const MOST: usize = 4;
/// Time that far readings would fill from which on they are none of a few, over [`LONGEST_S`].
const MOST_SECONDS: f64 = 16.0;

/// Readings far off what is about them, no two next to each other farther apart than asked.
pub(super) struct Stretch {
    pub readings: Range<usize>,
    /// How many of them are far off.
    pub far: usize,
    /// The farthest of them.
    pub peak: f64,
}

/// Stretches of far readings, those of NaN not asked, and the standard deviation of all others. The level is the median of as many
/// readings as `reach` says on either side: what takes less than half of them does not move it. None where more than `most` are far.
pub(super) fn stretches(y: &[f64], reach: usize, apart: usize, most: usize) -> (Vec<Stretch>, f64) {
    let reach = reach.max(1);
    let level = |from: usize, to: usize| {
        let to = to.min(y.len());
        let every = (to - from).div_ceil(TOLD);
        let near = y[from..to].iter().step_by(every).copied();
        let near: Vec<f64> = near.filter(|v| v.is_finite()).collect();
        if near.is_empty() { 0.0 } else { median(&near) }
    };
    let block = reach.div_ceil(2);
    let off: Vec<f64> = (y.chunks(block).enumerate())
        .flat_map(|(b, part)| {
            let middle = b * block + part.len() / 2;
            let level = level(middle.saturating_sub(reach), middle + reach + 1);
            part.iter().map(move |v| v - level)
        })
        .collect();
    let sizes: Vec<f64> = off.iter().copied().filter(|v| v.is_finite()).collect();
    let sigma = robust_sigma(&sizes);
    let far = spike_limit(sizes.len().max(2)) * sigma;
    // Of a block in which the level steps, some lie at the other one: each is asked by what is about it.
    let about = |i: usize| (y[i] - level(i.saturating_sub(reach), i + reach + 1)).abs();
    let suspected: Vec<usize> = (0..off.len()).filter(|i| off[*i].abs() > far).collect();
    let mut all: Vec<Stretch> = vec![];
    if suspected.len() > most {
        return (all, sigma);
    }
    let sizes = suspected.into_iter().map(|i| (i, about(i)));
    for (at, size) in sizes.filter(|s| s.1 > far) {
        match all.last_mut().filter(|last| at - last.readings.end < apart) {
            Some(last) => {
                last.readings.end = at + 1;
                last.far += 1;
                last.peak = last.peak.max(size);
            }
            None => all.push(Stretch {
                readings: at..at + 1,
                far: 1,
                peak: size,
            }),
        }
    }
    // Single far readings are none.
    all.retain(|s| s.far >= FEWEST);
    (all, sigma)
}

/// The readings of brief events; none where there are more than a base at rest feels.
pub(super) fn events(y: &[f64], rate_hz: f64) -> Vec<Range<usize>> {
    let second = (LONGEST_S * rate_hz).max(1.0);
    let apart = (APART * second).ceil() as usize;
    let reach = (BESIDE * second) as usize;
    let (all, _) = stretches(y, reach, apart, (MOST_SECONDS * second) as usize);
    let long = |s: &&Stretch| s.readings.len() as f64 > LONGEST * second;
    let longest = (LONGEST * LONGEST_RING_S * rate_hz) as usize;
    let mut longer = all.iter().filter(long);
    if all.len() > MOST || !longer.all(|s| rings_down(&y[s.readings.clone()], longest)) {
        return vec![];
    }
    let margin =
        |own: &Range<usize>| own.start.saturating_sub(apart)..(own.end + apart).min(y.len());
    all.iter().map(|s| margin(&s.readings)).collect()
}

/// Whether readings that take no longer than asked swing about their level, and less and less.
fn rings_down(y: &[f64], longest: usize) -> bool {
    let known: Vec<f64> = y.iter().copied().filter(|v| v.is_finite()).collect();
    let level = median(&known);
    let crossed = known
        .windows(2)
        .filter(|w| (w[0] > level) != (w[1] > level));
    let energy = |part: &[f64]| part.iter().map(|v| (v - level).powi(2)).sum::<f64>();
    let (first, second) = known.split_at(known.len() / 2);
    let swings = crossed.count() as f64 > 2.0 * PERIODS;
    y.len() <= longest && swings && energy(first) > FALLS * energy(second)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_knock_is_found_and_a_step_a_far_reading_and_a_walk_are_none() {
        let noise = crate::fit::white(12_000, 1);
        let with = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
            noise.iter().enumerate().map(|(i, e)| e + of(i)).collect()
        };
        let knock = |i: usize| match i {
            5000..5010 => 300.0 * (std::f64::consts::PI * (i as f64 - 4999.5) / 10.0).sin(),
            _ => 0.0,
        };
        let ring = |i: usize| {
            let since = i as f64 - 6000.0;
            let course = 100.0 * (-since / 20.0).exp() * (2.0 * since).cos();
            if since < 0.0 { 0.0 } else { course }
        };
        let found = events(&with(&ring), 20.0);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].start < 6000 && found[0].end > 6050, "{found:?}");
        let found = events(&with(&knock), 20.0);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].start < 5000 && found[0].end > 5010 && found[0].len() < 30);
        let step = |i: usize| if i < 7003 { 0.0 } else { 100.0 };
        let far = |i: usize| if i % 1000 == 3 { 50.0 } else { 0.0 };
        let again = |i: usize| if i % 1000 < 5 { 50.0 } else { 0.0 };
        let walk = |i: usize| 200.0 * (i as f64 / 3000.0).sin();
        let long = |i: usize| if (3000..3050).contains(&i) { 40.0 } else { 0.0 };
        let buzz = |i: usize| long(i) * (1.3 * i as f64).sin();
        for other in [
            &step as &dyn Fn(usize) -> f64,
            &far,
            &again,
            &walk,
            &long,
            &buzz,
        ] {
            assert_eq!(events(&with(other), 20.0), vec![]);
        }
    }
}
