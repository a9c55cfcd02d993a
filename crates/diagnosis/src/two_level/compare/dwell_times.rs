//! Whether two levels switch at random: a charge trap or a loose contact forgets how long it has stayed, so that its dwell
//! times are exponential. A thermostat, a relay or a load with a duty cycle switches after much the same time again and
//! again; it has two levels too, and is no telegraph noise.

use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

use crate::test_level::{CLAIM_LEVEL, CheckId, Outcome};
use crate::two_level::fit::{Coordinates, decoded, replicate};

/// Replicates that say what short stays, which decoding loses, make of the score: its mean to 0.07 and its spread to 5 %.
const REPLICATES: usize = 200;

/// Dwell times on the upper and on the lower level, in blocks; those that the record cuts are left out.
fn dwells(upper: &[bool]) -> [Vec<f64>; 2] {
    let mut all = [vec![], vec![]];
    let mut stays = upper.chunk_by(|a, b| a == b);
    stays.next();
    stays.next_back();
    for stay in stays {
        all[usize::from(!stay[0])].push(stay.len() as f64);
    }
    all
}

fn mean(of: &[f64], f: impl Fn(f64) -> f64) -> f64 {
    of.iter().map(|v| f(*v)).sum::<f64>() / of.len() as f64
}

/// Standard normal score of how alike dwell times are, where they are exponential with a mean of each level's own: low
/// where they are too much alike. `None` where no level has two.
///
/// Bartlett's statistic 2k (ln mean d - mean ln d) of the k dwell times of a level, over 1 + (k + 1) / 6k, is chi-square of
/// k - 1 degrees of freedom, those of the levels add up. M. S. Bartlett, Proc. R. Soc. A 160 (1937) 268; for k values of
/// two degrees of freedom each, which exponential ones are.
fn score(dwells: &[Vec<f64>; 2]) -> Option<f64> {
    let (mut statistic, mut degrees) = (0.0, 0.0);
    for d in dwells.iter().filter(|d| d.len() > 1) {
        let k = d.len() as f64;
        let spread = 2.0 * k * (mean(d, |v| v).ln() - mean(d, f64::ln));
        statistic += spread.max(0.0) / (1.0 + (k + 1.0) / (6.0 * k));
        degrees += k - 1.0;
    }
    let chance = ChiSquared::new(degrees).ok()?.cdf(statistic);
    Some(Normal::standard().inverse_cdf(chance.clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON)))
}

/// The claim of telegraph noise: two levels `x`, fitted to the block means `y` of `block_s` seconds each, switch at random.
pub(super) fn at_random(y: &[f64], x: &Coordinates, block_s: f64) -> Option<Outcome> {
    let found = dwells(&decoded(y, x));
    let mut z = score(&found)?;
    let chance = |z: f64| Normal::standard().cdf(z);
    // Stays too short to be seen join their neighbours, which makes random ones more alike than they are: only a conviction
    // has to be held against that.
    if chance(z) < CLAIM_LEVEL {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(0x6477_656c_6c73);
        let scores: Vec<f64> = (0..REPLICATES)
            .filter_map(|_| score(&dwells(&decoded(&replicate(y.len(), x, &mut rng), x))))
            .collect();
        let middle = mean(&scores, |z| z);
        z = (z - middle) / mean(&scores, |z| (z - middle).powi(2)).sqrt();
    }
    Some(claim(z, &found, block_s))
}

/// The same of levels that every place tells, whether it lies on the `upper` one, each of `place_s` seconds: no stay is too short.
pub(super) fn of_stays(upper: &[bool], place_s: f64) -> Option<Outcome> {
    let found = dwells(upper);
    score(&found).map(|z| claim(z, &found, place_s))
}

fn claim(z: f64, found: &[Vec<f64>; 2], block_s: f64) -> Outcome {
    let seconds = |d: &[f64]| match d.len() {
        0 => "none".to_owned(),
        count => format!("{count} of {:.1} s", mean(d, |v| v) * block_s),
    };
    Outcome {
        id: CheckId::ProcessDwells,
        about: vec![],
        statistic: z,
        p_value: Normal::standard().cdf(z),
        what: format!(
            "told as telegraph: it switches more regularly than at random, stays above ({}) and below ({}) are each much alike",
            seconds(&found[0]),
            seconds(&found[1])
        ),
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, Exp1, StandardNormal};

    use super::*;

    #[test]
    fn dwell_times_are_counted_between_switches_and_not_at_the_ends() {
        let upper = [1, 1, 0, 0, 0, 1, 0, 0, 1].map(|u| u > 0);
        assert_eq!(dwells(&upper), [vec![1.0], vec![3.0, 2.0]]);
        assert_eq!(dwells(&[true; 5]), [vec![], vec![]]);
        assert_eq!(score(&dwells(&upper[..4])), None);
    }

    /// 20 000 draws for each count: the share below a tail's point is within 4 standard errors of the tail, and 5 % of it.
    #[test]
    fn the_score_of_few_exponential_times_has_the_tail_of_a_normal_one() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let runs = 20_000;
        for counts in [[2, 2], [3, 2], [4, 3], [10, 9]] {
            let scores: Vec<f64> = (0..runs)
                .filter_map(|_| {
                    // Means of their own.
                    let of = |k: usize, mean: f64, rng: &mut _| -> Vec<f64> {
                        let drawn = (0..k).map(|_| mean * Distribution::<f64>::sample(&Exp1, rng));
                        drawn.collect()
                    };
                    score(&[of(counts[0], 30.0, &mut rng), of(counts[1], 4.0, &mut rng)])
                })
                .collect();
            for tail in [0.5, 0.05, 0.005] {
                let at = Normal::standard().inverse_cdf(tail);
                let below = scores.iter().filter(|z| **z < at).count() as f64 / f64::from(runs);
                let error = (tail / f64::from(runs)).sqrt();
                let room = 4.0 * error + 0.05 * tail;
                assert!(
                    (below - tail).abs() < room,
                    "{counts:?}: {below} below {tail}"
                );
            }
        }
    }

    #[test]
    fn three_times_each_alike_to_a_tenth_convict() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        let worst = (0..200)
            .filter_map(|_| {
                let mut of = |mean: f64| -> Vec<f64> {
                    let alike = |e: f64| mean * (1.0 + 0.05 * e);
                    (0..3)
                        .map(|_| alike(StandardNormal.sample(&mut rng)))
                        .collect()
                };
                score(&[of(60.0), of(20.0)])
            })
            .fold(f64::NEG_INFINITY, f64::max);
        assert!(worst < -3.09, "{worst}");
    }
}
