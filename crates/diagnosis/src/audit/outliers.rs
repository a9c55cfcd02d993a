//! Single readings that the noise cannot have made.
//!
//! Residual against the neighbourhood over its local spread, beyond the distance that one of n normal samples reaches
//! with the chance of a false alarm. It does not need to know the noise; the whitened residual of the search sees a
//! little farther where the base is at rest.

use super::local::Local;
use super::{Audit, Gyro, counted};
use crate::result::Finding;
use crate::test_level::{CheckId, audit_level};
use model::effects;
use numerics::order_statistics::robust_sigma;
use numerics::tails;
use numerics::tails::ONE_SIDED;

/// Two farther than this apart are single ones.
const ALONE: usize = 2;

/// Where the base moves the prediction errs by the motion too, in its bends more than elsewhere.
const MOVING: f64 = 1.3;

/// Noise within so many steps shows its quantiles by whole steps: two of them may be one step apart and the noise be 1.8 times
/// as wide as that says.
const COARSE: f64 = 3.0;
/// Least noise, steps: less than that rounding alone leaves.
const LEAST_SIGMA: f64 = 0.3;

/// Standard deviation of the residuals. Of readings in coarse steps each is spread evenly over its step, so that a quantile
/// lies within one; by that it is as wide as noise and rounding together.
fn sigma(local: &Local, step: f64) -> f64 {
    // Multiples of it lie evenly within a step.
    const GOLDEN: f64 = 0.618_033_988_749_895;
    if local.sigma > COARSE * step {
        return local.sigma;
    }
    let within = |i: usize| step * ((i as f64 * GOLDEN).fract() - 0.5);
    let even = local.residual.iter().enumerate();
    let even: Vec<f64> = even.map(|(i, r)| r + within(i)).collect();
    robust_sigma(&even).max(LEAST_SIGMA * step)
}

/// Residuals against the neighbourhood beyond half a step, in sigma; 0 next to the ends, where there is none.
fn deviations(local: &Local, sigma: f64, step: f64) -> Vec<f64> {
    let n = local.residual.len();
    let inside = |i: usize| i >= local.edge && i + local.edge < n;
    // Where the noise is within a count, a residual of one or two counts is rounding.
    let all = local.residual.iter().zip(local.spread()).enumerate();
    all.map(|(i, (r, s))| {
        let z = (r.abs() - 0.5 * step).max(0.0) / s.max(sigma);
        if inside(i) { z } else { 0.0 }
    })
    .collect()
}

/// Places beyond the limit that have no other one beside them.
fn single(z: &[f64], limit: f64) -> Vec<usize> {
    let far: Vec<usize> = (0..z.len()).filter(|i| z[*i] > limit).collect();
    let near = |a: Option<&usize>, b: usize| a.is_some_and(|a| a.abs_diff(b) <= ALONE);
    (0..far.len())
        .filter(|i| !near(far.get(i.wrapping_sub(1)), far[*i]) && !near(far.get(i + 1), far[*i]))
        .map(|i| far[i])
        .collect()
}

pub(super) fn audit(g: &Gyro<'_>, at: &[f64], audit: &mut Audit) {
    let name = g.channel.name.as_str();
    let (local, step) = match (&g.of_readings, g.counts) {
        (None, Some(_)) => (&g.local, 1.0),
        (apart, _) => (
            apart.as_ref().unwrap_or(&g.local),
            g.channel.lsb.unwrap_or(0.0),
        ),
    };
    // A bit that is missing moves a reading by half of what its lack makes a step of.
    let step = step * audit.steps.get(name).copied().unwrap_or(1.0);
    let n = local.residual.len();
    if n < super::LEAST_READINGS || local.sigma <= 0.0 {
        return;
    }
    let sigma = sigma(local, step);
    let limit = tails::farthest(n, audit_level()) * if local.bent { MOVING } else { 1.0 };
    let unit = g
        .of_readings
        .as_ref()
        .map_or_else(|| g.channel.lsb.unwrap_or(1.0), |_| 1.0);
    let farthest = (limit + ONE_SIDED) * sigma + 0.5 * step;
    let least = unit * farthest;
    audit.smallest(effects::outliers::ID, name, "size", least, &g.channel.unit);
    let z = deviations(local, sigma, step);
    let single = single(&z, limit);
    let finite = z.iter().copied().filter(|v| v.is_finite());
    let most = finite.fold(0.0, f64::max);
    let chance = if local.bent && most < limit {
        1.0
    } else {
        (n as f64 * tails::two_sided(most)).min(1.0)
    };
    let what = format!(
        "{} readings of {name} lie more than {limit:.1} sigma from their neighbours, the farthest {most:.1}",
        single.len()
    );
    let fails = audit.check(CheckId::Outliers, name, most, chance, what.clone());
    // A base that is knocked, or noise with heavy tails, makes runs and crowds, no single readings.
    if !fails || single.is_empty() || audit.is_suppressed(effects::outliers::ID, name) {
        return;
    }
    let mut times: Vec<f64> = single.iter().map(|i| at[*i]).collect();
    single.iter().for_each(|i| audit.mask(name, *i));
    audit.singles.insert(name.to_owned(), single);
    let own = |f: &Finding| f.cause == effects::outliers::ID && f.channels == [name];
    let wild = audit.findings.iter().position(own);
    let mut what = what;
    if let Some(wild) = wild.map(|i| audit.findings.remove(i)) {
        times.extend(wild.times_s);
        times.sort_by(f64::total_cmp);
        what = format!("{what}; {}", wild.what);
    }
    let count = times.len() as f64;
    let names = vec![name.to_owned()];
    let finding = counted(effects::outliers::ID, names, count, None, &times, what);
    audit.findings.push(finding);
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    #[test]
    fn noise_in_coarse_steps_is_as_wide_as_it_is_wherever_its_level_lies() {
        let (n, step) = (20_000, 1.0);
        let mut narrow = 0;
        for wide in [0.6, 0.7, 0.9, 1.5, 2.5] {
            for level in [-0.5, -0.4, -0.3, -0.1, 0.0, 0.2, 0.35] {
                let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
                let codes: Vec<f64> = (0..n)
                    .map(|_| {
                        let z: f64 = StandardNormal.sample(&mut rng);
                        (level + wide * z).round()
                    })
                    .collect();
                let local = Local::new(&codes);
                let told = sigma(&local, step);
                // Noise is no longer even within a step of twice its width.
                let all = 1.25 * f64::hypot(wide, (1.0f64 / 12.0).sqrt());
                assert!(told > 0.97 * wide && told < all, "{wide} {level}: {told}");
                narrow += usize::from(local.sigma < 0.8 * wide);
            }
        }
        assert!(narrow > 2, "quantiles that are codes: {narrow}");
    }
}
