//! Readings that change by so much at most: a filter against far readings, a converter that follows.
//!
//! Of any noise, larger changes from one reading to the next are rarer than smaller ones. Where they end in a pile, something
//! holds them back.

use crate::test_level::CheckId;
use std::collections::BTreeMap;

use statrs::distribution::{Binomial, DiscreteCDF};

use super::{Audit, Gyro, LEAST_READINGS};

/// Fewest changes of the largest size.
const LEAST_PILE: usize = 20;
/// Smallest largest change, counts: below it a change has too few sizes.
const LEAST_CHANGE: u32 = 4;

/// Largest sizes that the pile is sought in: a limit that lies between two of them is met by either.
const LARGEST: usize = 3;

/// Changes below which each size has a place of its own among the counts.
const SMALL: usize = 1 << 10;

pub(super) fn audit(gyro: &Gyro<'_>, audit: &mut Audit) {
    let (Some(counts), name) = (gyro.counts, &gyro.channel.name) else {
        return;
    };
    let known = |i: usize| gyro.known(i);
    let mut small = [0; SMALL];
    let mut large: BTreeMap<u32, usize> = BTreeMap::new();
    for i in (1..counts.len()).filter(|i| known(*i) && known(i - 1)) {
        let size = counts[i].abs_diff(counts[i - 1]);
        match small.get_mut(size as usize) {
            Some(times) => *times += 1,
            None => *large.entry(size).or_default() += 1,
        }
    }
    let changes = large.values().chain(&small).sum::<usize>();
    // The largest first.
    let small = (0..SMALL as u32).zip(small).rev().filter(|s| s.1 > 0);
    let sizes: Vec<(u32, usize)> = (large.into_iter().rev().chain(small))
        .take(LARGEST + 1)
        .collect();
    let Some((most, _)) = sizes.first().copied() else {
        return;
    };
    if changes < LEAST_READINGS || most < LEAST_CHANGE {
        return;
    }
    let read = |i: &usize| known(*i);
    let codes = || (0..counts.len()).filter(read).map(|i| counts[i]);
    // From one rail to the other is as far as a reading goes.
    let range = codes().max().zip(codes().min());
    if range.is_none_or(|(high, low)| high.abs_diff(low) <= most) {
        return;
    }
    // Where changes of either size are as likely, half of them are the larger ones; of a falling law, fewer.
    let chance = |pile: usize, before: usize| {
        Binomial::new(0.5, (pile + before) as u64)
            .map_or(1.0, |b| b.sf((pile as u64).saturating_sub(1)))
    };
    let pairs = sizes.iter().zip(sizes.iter().skip(1));
    let rare = pairs.map(|(large, next)| (chance(large.1, next.1), *large, *next));
    let Some((chance, (size, pile), (next, before))) = rare.min_by(|a, b| a.0.total_cmp(&b.0))
    else {
        return;
    };
    let what = format!(
        "readings change by at most {most} counts: {pile} times by {size}, {before} times by {} less",
        size - next
    );
    let chance = (LARGEST as f64 * chance).min(1.0);
    let fails = audit.check(CheckId::Slew, name, pile as f64, chance, what.clone());
    if fails && pile >= LEAST_PILE {
        audit.unexplain(name, what);
    }
}

#[cfg(test)]
mod tests {
    use model::record::{Axis, Channel, Quantity, Record};
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// Readings that change by `limit` at most, or by one more `in_ten` times of ten.
    fn told(limit: i32, in_ten: i32, seed: u64) -> usize {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut code = 0i32;
        let codes: Vec<i32> = (0..12_000)
            .map(|i| {
                let e: f64 = StandardNormal.sample(&mut rng);
                let new = (2.6 * e).round() as i32;
                let most = limit + i32::from(i % 10 < in_ten);
                code += (new - code).clamp(-most, most);
                code
            })
            .collect();
        let lsb = 0.073_26;
        let channel = Channel {
            name: "gyro_x".into(),
            quantity: Quantity::Gyro,
            axis: Some(Axis::X),
            unit: "deg/s".into(),
            values: codes.iter().map(|c| f64::from(*c) * lsb).collect(),
            counts: Some(codes),
            lsb: Some(lsb),
        };
        let record = Record {
            channels: vec![channel],
            ..Record::default()
        };
        let audit = super::super::audit(&record);
        let of_slew = |u: &&crate::test_level::Observation| u.what.contains("change by at most");
        audit.unexplained.iter().filter(of_slew).count()
    }

    #[test]
    fn changes_that_end_in_a_pile_are_told_and_others_are_not() {
        for seed in 0..40 {
            assert_eq!(told(1000, 0, seed), 0, "seed {seed}");
            assert_eq!(told(6, 0, seed), 1, "seed {seed}");
            assert_eq!(told(5, 3, seed), 1, "seed {seed}");
        }
    }
}
