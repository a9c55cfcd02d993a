//! What the known step of the converter makes of normal noise that is hardly larger than it.
//!
//! Normal noise of less than a step, rounded, is not normal, and its variance depends on where between two codes the
//! level lies: about a code most readings are that code, about the middle between two they are either. Mean, variance and
//! fourth moment of the codes follow from the level and the spread before rounding; the level from the mean of the codes
//! nearby, the spread from the variance about it. So the tails, and the variance that comes and goes with the level, are known
//! without a model of the record.

use model::effects;
use model::record::Channel;
use statrs::distribution::{ContinuousCDF, Normal};

use super::{Audit, Gyro, LEAST_READINGS};
use crate::audit::local::{Levels, Local};
use crate::test_level::CheckId;
use numerics::series::smallest_step;

/// What explains the checks that rounding makes fail.
pub(super) const STEP: &str = "the step of the converter";
/// Noise, steps, from which on rounding leaves nothing: at 0.8 steps the excess is below 1e-3.
const COARSE: f64 = 1.0;
/// Noise, steps, below which the step is told.
const TOLD: f64 = 0.5;
/// Noise, steps, below which what varies slowly is lost between two codes.
const LOST: f64 = 0.4;
/// Median change of readings, steps, from which on no noise is coarse: that of white noise of 1.1 sigma is 1.
const WELL_ABOVE: f64 = 1.75;
/// Standard errors within which the kurtosis is the one that rounding makes.
const AGREES: f64 = 5.0;
/// What the level, known to what its neighbours tell, leaves of it, as a share.
const OF_LEVEL: f64 = 0.15;
/// Swing of the variance with the level, as a share, that a long record shows.
const SWINGS: f64 = 0.05;
/// Least noise that is told apart, steps.
const LEAST: f64 = 0.05;
/// Levels between two codes.
const PLACES: usize = 64;

/// Rounded normal noise of one channel.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rounded {
    /// Spread before rounding, steps.
    sigma: f64,
    /// Largest fourth moment over the square of the variance, about the levels of the record.
    kurtosis: f64,
    /// Variances about the levels of the record, over their mean: the least and the largest.
    variances: [f64; 2],
    /// Whether the readings have these tails and no others.
    explains_tails: bool,
}

/// Mean from the code, variance and fourth moment about it, of rounded readings with levels from one half-step to the next.
struct Table(Vec<[f64; 3]>);

impl Table {
    fn new(sigma: f64) -> Self {
        let normal = Normal::standard();
        let far = (6.0 * sigma + 1.0).ceil() as i64;
        let of = |level: f64| {
            let codes = -far..=far;
            let p: Vec<(f64, f64)> = codes
                .map(|c| {
                    let c = c as f64;
                    let at = |edge: f64| normal.cdf((edge - level) / sigma);
                    (c, at(c + 0.5) - at(c - 0.5))
                })
                .collect();
            let mean: f64 = p.iter().map(|(c, p)| p * c).sum();
            let moment = |k: i32| p.iter().map(|(c, p)| p * (c - mean).powi(k)).sum::<f64>();
            [mean, moment(2), moment(4)]
        };
        Self(
            (0..=PLACES)
                .map(|i| of(i as f64 / PLACES as f64 - 0.5))
                .collect(),
        )
    }

    /// Variance and fourth moment where the codes have that mean.
    fn at(&self, mean: f64) -> [f64; 2] {
        let m = mean - mean.round();
        let above = self.0.partition_point(|t| t[0] < m).clamp(1, PLACES);
        let (a, b) = (&self.0[above - 1], &self.0[above]);
        let share = ((m - a[0]) / (b[0] - a[0]).max(1e-12)).clamp(0.0, 1.0);
        [1, 2].map(|k| a[k] + share * (b[k] - a[k]))
    }

    /// Mean variance and fourth moment over levels.
    fn over(&self, levels: &Levels) -> [f64; 2] {
        let (mut sum, mut all) = ([0.0; 2], 0.0);
        for (level, readings) in levels.iter() {
            let [second, fourth] = self.at(level);
            sum[0] += readings * second;
            sum[1] += readings * fourth;
            all += readings;
        }
        sum.map(|s| s / all)
    }
}

/// Median change from reading to reading, steps.
fn changes(y: &[f64]) -> f64 {
    let pairs = y.windows(2).map(|w| (w[1] - w[0]).abs());
    let mut all: Vec<f64> = pairs.filter(|d| d.is_finite()).collect();
    let middle = all.len() / 2;
    if all.is_empty() {
        return 0.0;
    }
    *all.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Of readings in steps; `None` where their noise is well above a step.
fn of(y: &[f64]) -> Option<Rounded> {
    if changes(y) >= WELL_ABOVE {
        return None;
    }
    // By mean squares: quantiles of a few codes are codes, whatever the level.
    let local = Local::by_squares(y);
    let known: Vec<bool> = y.iter().map(|v| v.is_finite()).collect();
    let near = |r: &&f64| r.is_finite() && r.abs() < FAR;
    let own: Vec<f64> = local.residual.iter().filter(near).copied().collect();
    let n = own.len() as f64;
    let mean_of = |k: i32| own.iter().map(|r| r.powi(k)).sum::<f64>() / n;
    let (second, fourth) = (mean_of(2), mean_of(4));
    let wide = second > COARSE * COARSE + 1.0 / 12.0;
    if own.len() < LEAST_READINGS || second <= 0.0 || wide || local.bent {
        return None;
    }
    let levels = Levels::new(&local.level, &known);
    let (mut low, mut high) = (LEAST, 1.5 * COARSE);
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        if Table::new(middle).over(&levels)[0] < second {
            low = middle;
        } else {
            high = middle;
        }
    }
    let sigma = 0.5 * (low + high);
    let table = Table::new(sigma);
    let [s, f] = table.over(&levels);
    let (seen, made) = (fourth / (second * second), f / (s * s));
    // The variance of a sample's fourth moment grows with the eighth.
    let error = (24.0 / n).sqrt() * (made / 3.0).max(1.0).powi(2);
    let (mut least, mut largest, mut tails) = (f64::INFINITY, 0.0f64, 0.0f64);
    for (level, _) in levels.iter() {
        let [second, fourth] = table.at(level);
        (least, largest) = (least.min(second / s), largest.max(second / s));
        tails = tails.max(fourth / (second * second));
    }
    Some(Rounded {
        sigma,
        kurtosis: tails,
        variances: [least, largest],
        explains_tails: (seen - made).abs() < AGREES * error + OF_LEVEL * (made - 3.0).abs(),
    })
}

/// Steps beyond which a reading is no matter of rounding: single far ones are told by themselves.
const FAR: f64 = 6.0;

impl Rounded {
    /// Whether a law of the variance with the likelihood ratio `lr`, that would have to pass `threshold` on normal
    /// noise, and that makes it `ratio` times what it is, is rounding. The likelihood ratio of a variance grows with the
    /// kurtosis less 1, which is 2 of normal noise.
    pub(super) fn explains_variance(&self, lr: f64, threshold: f64, ratio: Option<f64>) -> bool {
        let [least, largest] = self.variances;
        let by_level =
            ratio.is_some_and(|r| r > least / largest - SWINGS && r < largest / least + SWINGS);
        self.sigma < LOST || by_level || lr * 2.0 / (self.kurtosis - 1.0).max(2.0) < threshold
    }
}

/// Readings of a channel in steps, and the step.
pub(super) fn in_steps(g: &Gyro<'_>) -> Option<(Vec<f64>, f64)> {
    let Channel { values, lsb, .. } = g.channel;
    let step = match (g.counts, lsb) {
        (Some(_), Some(lsb)) => *lsb,
        _ => smallest_step(values),
    };
    let first = values.iter().copied().find(|v| v.is_finite())?;
    (step > 0.0).then(|| {
        let steps = values.iter().map(|v| (v - first) / step);
        (steps.collect(), step)
    })
}

/// What rounding explains of a channel.
fn explained(rounded: &Rounded, name: &str, audit: &mut Audit) {
    let mut explain = |ids: &[&str]| audit.suppress(ids, name, STEP);
    if rounded.explains_tails {
        explain(&["kurtosis", "skewness", CheckId::Leaning.as_str()]);
    }
    let [least, largest] = rounded.variances;
    if largest - least > SWINGS {
        explain(&[
            "time_frequency",
            "bicovariance",
            "three_readings",
            "neighbours",
            "variance_rhythm",
            "variance_follows",
            CheckId::ColourFollows.as_str(),
            CheckId::VarianceLaw.as_str(),
        ]);
    }
    if rounded.sigma < LOST {
        explain(&["ljung_box", "band_energy", CheckId::VarianceLaw.as_str()]);
    }
    if rounded.sigma < TOLD {
        // The far readings of a residual are single codes.
        explain(&["spikes"]);
    }
}

/// Tell of a step that is coarse, and what it explains.
pub(super) fn audit(g: &Gyro<'_>, audit: &mut Audit) {
    let name = g.channel.name.as_str();
    let coarse = |f: &crate::result::Finding| {
        let of_codes = [
            effects::coarse_lsb::ID,
            effects::double_rounding::ID,
            effects::stuck_bit::ID,
        ];
        of_codes.contains(&f.cause.as_str()) && f.channels == [name]
    };
    if audit.findings.iter().any(coarse) {
        return;
    }
    let Some((y, step)) = in_steps(g) else {
        return;
    };
    let Some(rounded) = of(&y) else {
        return;
    };
    explained(&rounded, name, audit);
    if rounded.sigma < TOLD {
        let lost = if rounded.sigma < LOST {
            audit.untested_on(
                name,
                effects::noise_change::ID,
                &format!("the noise is below {LOST} steps, so its size hangs on the level: choose a finer range"),
            );
            ", and what changes by less than a step is lost or bent"
        } else {
            ""
        };
        audit.notes.push(format!(
            "the step of {name}, {step:.4} {}, is {:.1} sigma of its noise: rounding shapes its tails and its variance{lost}; these are taken for no cause. Choose a finer range, or average in the sensor with more digits",
            g.channel.unit,
            1.0 / rounded.sigma
        ));
    }
    audit.rounded.insert(name.to_owned(), rounded);
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    fn rounded(sigma: f64, far: f64, seed: u64) -> Option<Rounded> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let place: f64 = StandardNormal.sample(&mut rng);
        let mut level = 7.3 + place;
        let y: Vec<f64> = (0..12_000)
            .map(|i| {
                let z: f64 = StandardNormal.sample(&mut rng);
                let w: f64 = StandardNormal.sample(&mut rng);
                level += 0.003 * w;
                let tail = if i % 100 == 0 { far } else { 1.0 };
                (level + sigma * tail * z).round()
            })
            .collect();
        of(&y)
    }

    #[test]
    fn rounding_explains_its_own_tails_and_no_others() {
        for seed in 0..10 {
            for sigma in [0.3, 0.35, 0.42, 0.49, 0.6, 0.7] {
                let own = rounded(sigma, 1.0, seed).expect("it is coarse");
                assert!(own.explains_tails, "{sigma} {seed}: {own:?}");
                assert!((own.sigma / sigma - 1.0).abs() < 0.08, "{sigma}: {own:?}");
                let other = rounded(sigma, 8.0, seed).expect("it is coarse");
                assert!(!other.explains_tails, "{sigma} {seed}: {other:?}");
            }
            assert_eq!(rounded(2.0, 1.0, seed), None);
        }
    }

    #[test]
    fn a_variance_that_the_level_makes_is_no_law() {
        let own = rounded(1.05 * LOST, 1.0, 1).expect("it is coarse");
        assert!(own.sigma > LOST, "{own:?}");
        assert!(own.explains_variance(500.0, 30.0, Some(1.0)));
        assert!(own.explains_variance(31.0, 30.0, Some(9.0)));
        assert!(!own.explains_variance(500.0, 30.0, Some(9.0)));
    }
}
