//! A sensor that renews its readings more slowly than frames come: the frames that repeat lie as evenly as the beat of both rates lays
//! them, and those that are late by chance lie anywhere.

use model::Parameter;

/// Fewest repeats or new readings that tell.
const FEWEST: usize = 10;
/// Share of the distances that have to be a whole number next to their mean, or within a part of it where clocks drift. Of distances by
/// chance, which are geometric, 0.38 are at most.
const EVEN: f64 = 0.8;
const DRIFT: f64 = 0.1;

/// The rate at which the sensor renews its readings, Hz, where rows lie so: those that are `repeated`, in order, of which `expected` do
/// by chance; rows are read `at` these times, s.
pub(in crate::audit) fn sensor_rate(
    repeated: &[usize],
    expected: f64,
    at: &[f64],
) -> Option<Parameter> {
    let (rows, span) = (at.len(), at.last()? - at.first()?);
    let rate_hz = (rows as f64 - 1.0) / span;
    let count = repeated.len() as f64 - expected;
    let all = rows as f64;
    // Of many repeats the new readings are the few.
    let new: Vec<usize>;
    let (few, share) = if count > 0.5 * all {
        let is_new = |i: &usize| repeated.binary_search(i).is_err();
        new = (0..rows).filter(is_new).collect();
        (new.as_slice(), 1.0 - count / all)
    } else {
        (repeated, count / all)
    };
    if few.len() < FEWEST || share <= 0.0 || !rate_hz.is_finite() {
        return None;
    }
    let mean = share.recip();
    let near = |w: &&[usize]| ((w[1] - w[0]) as f64 - mean).abs() < (DRIFT * mean).max(1.0);
    let even = few.windows(2).filter(near).count() as f64 / (few.len() - 1) as f64;
    // The last of them lies within a frame of its place.
    let error = rate_hz / all;
    (even >= EVEN).then(|| Parameter::estimated(rate_hz * (1.0 - count / all), error, "Hz"))
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
            let told = sensor_rate(&beats, 0.0, &at).unwrap();
            assert!(
                (told.value - 100.0 * renewed).abs() < 0.02,
                "{renewed}: {told:?}"
            );
            let late = |_: &usize| uniform.sample(&mut rng) > renewed;
            let by_chance: Vec<usize> = (1..20_000).filter(late).collect();
            assert_eq!(sensor_rate(&by_chance, 0.0, &at), None, "{renewed}");
        }
    }
}
