//! Readings that change by so much at most: a filter against far readings, a converter that follows.
//!
//! Of any noise, larger changes from one reading to the next are rarer than smaller ones. Where they end in a pile, something
//! holds them back.

use statrs::distribution::{Binomial, DiscreteCDF};

use super::{Audit, Gyro, LEAST_READINGS};

/// Fewest changes of the largest size.
const LEAST_PILE: usize = 20;
/// Smallest largest change, counts: below it a change has too few sizes.
const LEAST_CHANGE: u32 = 4;

pub(super) fn audit(gyro: &Gyro<'_>, audit: &mut Audit) {
    let (Some(counts), name) = (gyro.counts, &gyro.channel.name) else {
        return;
    };
    let known = |i: usize| gyro.known(i);
    let changes: Vec<u32> = (1..counts.len())
        .filter(|i| known(*i) && known(i - 1))
        .map(|i| counts[i].abs_diff(counts[i - 1]))
        .collect();
    let Some(most) = changes.iter().copied().max() else {
        return;
    };
    if changes.len() < LEAST_READINGS || most < LEAST_CHANGE {
        return;
    }
    let times = |size: u32| changes.iter().filter(|c| **c == size).count();
    let next = changes.iter().copied().filter(|c| *c < most).max();
    let read = |i: &usize| known(*i);
    let codes = || (0..counts.len()).filter(read).map(|i| counts[i]);
    // From one rail to the other is as far as a reading goes.
    let range = codes().max().zip(codes().min());
    if range.is_none_or(|(high, low)| high.abs_diff(low) <= most) {
        return;
    }
    let (pile, before) = (times(most), next.map_or(0, times));
    // Where changes of either size are as likely, half of them are the larger ones; of a falling law, fewer.
    let chance = Binomial::new(0.5, (pile + before) as u64)
        .map_or(1.0, |b| b.sf((pile as u64).saturating_sub(1)));
    let what = format!(
        "readings change by at most {most} counts: {pile} times by that, {before} times by {} less",
        next.map_or(most, |n| most - n)
    );
    let fails = audit.check("slew", name, pile as f64, chance, what.clone());
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

    fn told(limit: i32, seed: u64) -> usize {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut code = 0i32;
        let codes: Vec<i32> = (0..12_000)
            .map(|_| {
                let e: f64 = StandardNormal.sample(&mut rng);
                let new = (2.6 * e).round() as i32;
                code += (new - code).clamp(-limit, limit);
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
        let of_slew = |u: &&crate::result::Unexplained| u.what.contains("change by at most");
        audit.unexplained.iter().filter(of_slew).count()
    }

    #[test]
    fn changes_that_end_in_a_pile_are_told_and_others_are_not() {
        for seed in 0..40 {
            assert_eq!(told(1000, seed), 0, "seed {seed}");
            assert_eq!(told(6, seed), 1, "seed {seed}");
        }
    }
}
