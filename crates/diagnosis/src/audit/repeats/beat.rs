//! A sensor that renews its readings more slowly than frames come: the frames that repeat lie as evenly as the beat of both rates lays
//! them, and those that are late by chance lie anywhere.

use std::f64::consts::TAU;

use model::Parameter;

/// Fewest repeats or new readings that tell.
const FEWEST: usize = 10;
/// Share of the distances that have to be a whole number next to their mean, or within a part of it where clocks drift. Of distances by
/// chance, which are geometric, 0.38 are at most.
const EVEN: f64 = 0.8;
const DRIFT: f64 = 0.1;

/// Frames that are looked at first, steps a cycle of the beat over what is looked at, and cycles about the place found so far.
const FIRST: usize = 4096;
const STEPS: f64 = 8.0;
const ABOUT: f64 = 1.0;

/// Which rows of a record are of the kind that is rarer, those that repeat the one before or the new ones.
struct Few {
    rows: Vec<usize>,
    /// Whether they are the new ones.
    new: bool,
}

impl Few {
    fn of(repeated: &[usize], late: f64, all: usize) -> Self {
        let new = late > 0.5 * all as f64;
        let is_new = |i: &usize| repeated.binary_search(i).is_err();
        let rows = match new {
            true => (0..all).filter(is_new).collect(),
            false => repeated.to_vec(),
        };
        Self { rows, new }
    }

    /// Whether they lie so far apart as a beat lays so large a share.
    fn lie_evenly(&self, share: f64) -> bool {
        let mean = share.recip();
        let near = |w: &&[usize]| ((w[1] - w[0]) as f64 - mean).abs() < (DRIFT * mean).max(1.0);
        let even = self.rows.windows(2).filter(near).count() as f64;
        self.rows.len() >= FEWEST && even >= EVEN * (self.rows.len() - 1) as f64
    }

    /// Their share of `all` rows by the beat that they keep, `slack` about one that is known so far: what chance puts among them or
    /// takes from them keeps none.
    fn share(&self, known: f64, slack: f64, all: usize) -> f64 {
        let (mut best, mut slack, mut length) = (known, slack, FIRST.min(all));
        loop {
            let until = self.rows.partition_point(|i| *i < length);
            let along = |share: f64| {
                let turns = self.rows[..until].iter().map(|i| TAU * share * *i as f64);
                let sum = turns.fold([0.0; 2], |s, t| [s[0] + t.cos(), s[1] + t.sin()]);
                sum[0].hypot(sum[1])
            };
            let step = (STEPS * length as f64).recip();
            let most = ((slack + ABOUT / length as f64) / step).ceil();
            let places = (0..=2 * most as usize).map(|k| best + (k as f64 - most) * step);
            let places = places.map(|share| (share, along(share)));
            best = places
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .map_or(best, |p| p.0);
            if length == all {
                return best;
            }
            (slack, length) = (0.0, (2 * length).min(all));
        }
    }
}

/// Whether rows that are `repeated`, in order, lie as a beat lays them, whatever of them chance adds.
pub(super) fn lie_evenly(repeated: &[usize], all: usize) -> bool {
    let late = repeated.len() as f64;
    let few = Few::of(repeated, late, all);
    few.lie_evenly(few.rows.len() as f64 / all as f64)
}

/// The rate at which the sensor renews its readings, Hz, where rows lie so: those that are `repeated`, in order, of which `late` are not
/// by chance; rows are read `at` these times, s.
pub(in crate::audit) fn sensor_rate(
    repeated: &[usize],
    late: f64,
    at: &[f64],
) -> Option<Parameter> {
    let (rows, span) = (at.len(), at.last()? - at.first()?);
    let rate_hz = (rows as f64 - 1.0) / span;
    let all = rows as f64;
    let few = Few::of(repeated, late, rows);
    let share = if few.new {
        1.0 - late / all
    } else {
        late / all
    };
    if share <= 0.0 || !rate_hz.is_finite() || !few.lie_evenly(share) {
        return None;
    }
    let share = few.share(share, (repeated.len() as f64 - late).abs() / all, rows);
    let renewed = if few.new { share } else { 1.0 - share };
    // The last of them lies within a frame of its place.
    let error = rate_hz / all;
    Some(Parameter::estimated(rate_hz * renewed, error, "Hz"))
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, Uniform};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    /// Frames that repeat the one before where a sensor renews so many readings a frame.
    fn repeats(renewed: f64, rows: usize) -> Vec<usize> {
        let reading = |i: usize| (i as f64 * renewed + 0.3).floor();
        (1..rows)
            .filter(|i| reading(*i) == reading(*i - 1))
            .collect()
    }

    #[test]
    fn the_rate_of_a_slower_sensor_is_told_and_of_repeats_by_chance_none() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        let at: Vec<f64> = (0..20_000).map(|i| f64::from(i) / 100.0).collect();
        let uniform = Uniform::new(0.0, 1.0).unwrap();
        for renewed in [0.13, 0.4, 0.55, 0.727, 0.953, 0.998] {
            let beats = repeats(renewed, 20_000);
            let told = sensor_rate(&beats, beats.len() as f64, &at).unwrap();
            assert!(
                (told.value - 100.0 * renewed).abs() < 0.02,
                "{renewed}: {told:?}"
            );
            let late = |_: &usize| uniform.sample(&mut rng) > renewed;
            let by_chance: Vec<usize> = (1..20_000).filter(late).collect();
            let late = by_chance.len() as f64;
            assert_eq!(sensor_rate(&by_chance, late, &at), None, "{renewed}");
        }
    }
    #[test]
    fn repeats_by_chance_beside_a_beat_do_not_move_the_rate() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let at: Vec<f64> = (0..20_000).map(|i| f64::from(i) / 100.0).collect();
        let uniform = Uniform::new(0.0, 1.0).unwrap();
        for _ in 0..20 {
            let (renewed, chance) = (
                0.25 + 0.7 * uniform.sample(&mut rng),
                0.03 * uniform.sample(&mut rng),
            );
            let beats = repeats(renewed, 20_000);
            let late = beats.len() as f64;
            let seen: Vec<usize> = (1..20_000)
                .filter(|i| beats.binary_search(i).is_ok() || uniform.sample(&mut rng) < chance)
                .collect();
            assert!(
                lie_evenly(&seen, 20_000) || chance > 0.05 * (1.0 - renewed),
                "{renewed}, {chance}"
            );
            let Some(told) = sensor_rate(&seen, late, &at) else {
                continue;
            };
            assert!(
                (told.value - 100.0 * renewed).abs() < 0.02,
                "{renewed}, {chance}: {told:?}"
            );
        }
    }
}
