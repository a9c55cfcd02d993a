//! Jumps between two levels so far apart that each reading tells on which of them it lies.
//!
//! A level is followed reading by reading: a course as slow as the noise lets it be seen, and half the distance above or below it.
//! A stay may be as short as a reading, which no jump between two stretches shows. What reads neither level, but on the way
//! from one to the other, is left out; where more than a few readings lie elsewhere, there are no two levels.

use numerics::order_statistics::median;
use numerics::series::white_by_differences;

use super::{AT_LEVEL, Jump, ON_THE_WAY};

/// Least distance, standard deviations of the noise: half of it is as far as a reading may be off its level.
const APART: f64 = 2.0 * AT_LEVEL;
/// Changes from one reading to another that no noise makes: 5.7 of its standard deviations.
const PLAIN: f64 = 8.0;
/// Fewest switches: a level that goes and comes back is two steps.
const FEWEST: usize = 3;
/// Least mean stay, readings.
const LEAST_STAY: usize = 4;
/// Least median stay on either level, readings: single readings that are far off are no level. Of stays of a mean of four, half are
/// as long.
const LEAST_MEDIAN_STAY: f64 = 3.0;
/// Readings over which the course is followed.
const MEMORY: f64 = 32.0;
/// Part of the readings that may lie elsewhere.
const ELSEWHERE: f64 = 0.005;
/// Rounds in which the distance is settled.
const ROUNDS: usize = 3;

/// Two levels.
#[derive(Clone, Debug)]
pub(crate) struct TwoLevels {
    /// How far they are apart.
    pub(crate) distance: f64,
    /// Whether each place lies on the upper one.
    pub(crate) upper: Vec<bool>,
    /// First places of stays but the first one.
    pub(super) switches: Vec<usize>,
    /// Places of readings on the way.
    pub(super) on_the_way: Vec<usize>,
}

impl TwoLevels {
    /// Those of readings in steps of `step`, NaN where there is none.
    pub(crate) fn of(y: &[f64], step: f64) -> Option<Self> {
        let (places, known): (Vec<usize>, Vec<f64>) = (y.iter().copied().enumerate())
            .filter(|(_, v)| v.is_finite())
            .unzip();
        let sigma = white_by_differences(&known).sqrt().max(0.5 * step);
        let changes = changes(&known, PLAIN * sigma);
        if sigma <= 0.0 || changes.len() < FEWEST || changes.len() * LEAST_STAY > known.len() {
            return None;
        }
        let sizes: Vec<f64> = changes.iter().map(|c| c.1.abs()).collect();
        // A long stay is longer than a reading.
        let mut distance = median(&sizes);
        let mut followed = Followed::default();
        for _ in 0..ROUNDS {
            followed = Followed::new(&known, &changes, distance, sigma)?;
            distance = followed.distance(&known)?;
        }
        if distance < APART * sigma || followed.are_single(known.len()) {
            return None;
        }
        let mut upper = vec![false; y.len()];
        let mut from = 0;
        for (stay, up) in followed.stays(known.len()) {
            let end = places.get(stay.end).copied().unwrap_or(y.len());
            upper[from..end].fill(up);
            from = end;
        }
        Some(Self {
            distance,
            upper,
            switches: followed.switches.iter().map(|k| places[*k]).collect(),
            on_the_way: followed.on_the_way.iter().map(|k| places[*k]).collect(),
        })
    }

    /// How often they switch.
    pub(crate) fn switches(&self) -> usize {
        self.switches.len()
    }

    /// The level about the middle of both, half the distance being `half`.
    pub(crate) fn level(&self, half: f64) -> Vec<f64> {
        let of = |up: &bool| if *up { half } else { -half };
        self.upper.iter().map(of).collect()
    }

    /// The places before and after each switch, some of them twice.
    pub(crate) fn beside_switches(&self) -> impl Iterator<Item = usize> {
        let both = |at: &usize| [at.saturating_sub(1), *at];
        self.switches.iter().flat_map(both)
    }

    /// The same about the course of `y`, in which a reading beside a switch may be a mean over both levels.
    pub(crate) fn level_of(&self, y: &[f64], half: f64) -> Vec<f64> {
        let mut level = self.level(half);
        let at_one: Vec<f64> = y.iter().zip(&level).map(|(y, level)| y - level).collect();
        for k in self.beside_switches() {
            // One of the two readings is on its level.
            let near = [k.wrapping_sub(2), k + 2].map(|i| at_one.get(i).copied());
            let near = near.into_iter().flatten().filter(|v| v.is_finite());
            let (sum, count) = near.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
            let read = y[k] - sum / count;
            if read.abs() < half {
                level[k] = read;
            }
        }
        level
    }

    pub(super) fn jumps(&self) -> Vec<Jump> {
        let jump = |at: &usize| Jump {
            at: *at,
            height: if self.upper[*at] {
                self.distance
            } else {
                -self.distance
            },
        };
        self.switches.iter().map(jump).collect()
    }
}

/// Changes of more than `least` within a few readings: the first reading after each, and the change.
fn changes(known: &[f64], least: f64) -> Vec<(usize, f64)> {
    let mut all: Vec<(usize, f64)> = vec![];
    let mut k = 1;
    while k < known.len() {
        let by = known[k] - known[k - 1];
        if by.abs() < 0.5 * least {
            k += 1;
            continue;
        }
        // What goes on the same way is one change.
        let on = |k: &usize| {
            let next = known[*k] - known[*k - 1];
            next.abs() > 0.5 * least && next.signum() == by.signum()
        };
        let last = (k..known.len().min(k + ON_THE_WAY + 1))
            .take_while(on)
            .last();
        let last = last.unwrap_or(k);
        let whole = known[last] - known[k - 1];
        if whole.abs() > least {
            all.push((last, whole));
        }
        k = last + 1;
    }
    all
}

/// Readings followed from level to level.
#[derive(Default)]
struct Followed {
    /// Whether the first one lies on the upper level.
    first: bool,
    /// First readings of stays but the first one.
    switches: Vec<usize>,
    on_the_way: Vec<usize>,
    /// Readings that lie at neither level.
    away: Vec<usize>,
}

impl Followed {
    /// None where they lie elsewhere.
    fn new(known: &[f64], changes: &[(usize, f64)], distance: f64, sigma: f64) -> Option<Self> {
        let (until, by) = *changes.first()?;
        let first = by < 0.0;
        let mut found = Self {
            first,
            ..Self::default()
        };
        let side = |up: bool| if up { 0.5 * distance } else { -0.5 * distance };
        let begin = &known[..until.clamp(1, MEMORY as usize)];
        let mut course = median(begin) - side(first);
        let (mut seen, mut elsewhere, mut away) = (begin.len() as f64, 0, vec![]);
        let mut up = first;
        for (k, v) in known.iter().enumerate() {
            let off = |up: bool| v - course - side(up);
            // The course is known as well as some readings tell it.
            let limit = AT_LEVEL * sigma * (1.0 + seen.recip()).sqrt();
            let at = [up, !up].into_iter().find(|up| off(*up).abs() < limit);
            let Some(at) = at else {
                away.push(k);
                found.away.push(k);
                continue;
            };
            let on_the_way = at != up && away.len() <= ON_THE_WAY;
            match on_the_way {
                true => found.on_the_way.extend(&away),
                false => elsewhere += away.len(),
            }
            away.clear();
            if at != up {
                found.switches.push(k);
                up = at;
            }
            seen = (seen + 1.0).min(MEMORY);
            course += off(up) / seen;
        }
        elsewhere += away.len();
        let plain = elsewhere as f64 <= ELSEWHERE * known.len() as f64;
        (plain && found.switches.len() >= FEWEST).then_some(found)
    }

    /// The stays in their order, each with whether it is on the upper level.
    fn stays(&self, count: usize) -> impl Iterator<Item = (std::ops::Range<usize>, bool)> {
        let starts = std::iter::once(0).chain(self.switches.iter().copied());
        let ends = self.switches.iter().copied().chain([count]);
        let up = (0..).map(|i: usize| self.first == i.is_multiple_of(2));
        starts.zip(ends).map(|(a, b)| a..b).zip(up)
    }

    /// Whether the stays on one of the levels are single readings.
    fn are_single(&self, count: usize) -> bool {
        [false, true].into_iter().any(|level| {
            let own = self.stays(count).filter(|(_, up)| *up == level);
            let lengths: Vec<f64> = own.map(|(stay, _)| stay.len() as f64).collect();
            median(&lengths) < LEAST_MEDIAN_STAY
        })
    }

    /// How far the levels are apart, by the readings on either side of each switch.
    fn distance(&self, known: &[f64]) -> Option<f64> {
        let mut left = vec![false; known.len()];
        self.away.iter().for_each(|k| left[*k] = true);
        let middle = |part: std::ops::Range<usize>| {
            let all = part.filter(|k| !left[*k]).map(|k| known[k]);
            let all: Vec<f64> = all.collect();
            let count = all.len() as f64;
            (!all.is_empty()).then(|| (all.iter().sum::<f64>() / count, count))
        };
        let stays: Vec<_> = self.stays(known.len()).collect();
        let (mut sum, mut weight) = (0.0, 0.0);
        for pair in stays.windows(2) {
            let (before, after) = (&pair[0].0, &pair[1].0);
            let reach = MEMORY as usize;
            let last = before.end.saturating_sub(reach).max(before.start)..before.end;
            let next = after.start..after.end.min(after.start + reach);
            let (Some(a), Some(b)) = (middle(last), middle(next)) else {
                continue;
            };
            let up = if pair[1].1 { 1.0 } else { -1.0 };
            let own = a.1 * b.1 / (a.1 + b.1);
            sum += own * up * (b.0 - a.0);
            weight += own;
        }
        (weight > 0.0).then(|| sum / weight)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// White noise, and two levels that are so far apart and change where `stays` end.
    fn readings(distance: f64, stays: &[usize], seed: u64) -> Vec<f64> {
        let all = stays.iter().enumerate();
        let levels = all.flat_map(|(i, stay)| vec![distance * (i % 2) as f64; *stay]);
        let levels: Vec<f64> = levels.collect();
        let noise = crate::fit::white(levels.len(), seed);
        levels.iter().zip(noise).map(|(l, e)| l + e).collect()
    }

    #[test]
    fn levels_are_told_reading_by_reading_however_short_a_stay() {
        let stays = [500, 300, 1, 40, 2, 700, 30, 1, 900, 5, 400, 100];
        for (seed, distance) in [(1, 12.0), (2, 40.0), (3, 1000.0)] {
            let mut y = readings(distance, &stays, seed);
            // A random walk, and a hole.
            y.iter_mut()
                .enumerate()
                .for_each(|(i, v)| *v += 2e-3 * i as f64);
            y[1000..1020].fill(f64::NAN);
            let two = TwoLevels::of(&y, 0.0).expect("two levels");
            assert!((two.distance - distance).abs() < 1.0, "{}", two.distance);
            let ends: Vec<usize> = stays
                .iter()
                .scan(0, |sum, s| {
                    *sum += s;
                    Some(*sum)
                })
                .collect();
            assert_eq!(two.switches, ends[..ends.len() - 1]);
            assert!(two.on_the_way.is_empty());
        }
    }

    #[test]
    fn readings_on_the_way_are_told() {
        let mut y = readings(60.0, &[500, 500, 500, 500, 500], 4);
        y[499] = 20.0;
        y[999] = 30.0;
        let two = TwoLevels::of(&y, 0.0).expect("two levels");
        assert_eq!(two.on_the_way, [499, 999]);
    }

    #[test]
    fn a_reading_in_which_they_switch_is_at_what_it_reads_between_them() {
        let mut y = readings(14.0, &[500, 500, 500, 500, 500], 9);
        // Half way, and the last one of its stay; beyond its level.
        (y[499], y[1000]) = (7.0, -3.0);
        let two = TwoLevels::of(&y, 0.0).expect("two levels");
        let level = two.level_of(&y, 7.0);
        assert!(level[499].abs() < 2.5, "{}", level[499]);
        assert_eq!((level[1000], level[700], level[250]), (-7.0, 7.0, -7.0));
    }

    #[test]
    fn single_readings_far_off_are_no_level() {
        let stays = [900, 1, 1500, 1, 300, 2, 2000, 1, 700];
        for seed in 0..10 {
            assert!(TwoLevels::of(&readings(20.0, &stays, seed), 0.0).is_none());
        }
    }

    #[test]
    fn three_levels_a_staircase_two_steps_and_noise_are_no_two_levels() {
        let mut three = readings(40.0, &[300; 12], 5);
        three[900..1500].iter_mut().for_each(|v| *v += 40.0);
        let mut stairs = readings(0.0, &[300; 12], 6);
        (stairs.iter_mut().enumerate()).for_each(|(i, v)| *v += 40.0 * (i / 300) as f64);
        let steps = readings(40.0, &[1000, 1000, 1000], 7);
        let noise = readings(0.0, &[5000], 8);
        for y in [three, stairs, steps, noise] {
            assert!(TwoLevels::of(&y, 0.0).is_none());
        }
    }
}
