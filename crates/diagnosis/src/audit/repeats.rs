//! Repeats that no flag tells: frames with every gyro reading as in the frame before.
//!
//! Differences of neighbours d have a smooth distribution; repeats add to d = 0 alone. The expected share at 0 is that of
//! the curve ln p(d) = a - c d^2 through its neighbours d = +-1 .. +-K, K below the spread of d, whatever the base does
//! and however alike neighbours are. Where the noise is below a count, pairs farther apart tell the share instead. Three
//! gyros agree with the product of theirs: (1 / (2 sqrt(pi) sigma))^3 for white noise of sigma counts.

use std::f64::consts::SQRT_2;

use model::record::Record;

use super::{Audit, Gyro, LEAST_READINGS, counted};
use crate::fit::likelihood::invert;
use crate::test_level::{AUDIT_LEVEL, CheckId};
use numerics::order_statistics::robust_sigma;
use numerics::series::smallest_step;
use numerics::tails;
use numerics::tails::{ONE_SIDED, chi_tail};

/// Distances of the pairs that tell the chance of agreement.
const LAGS: std::ops::RangeInclusive<usize> = 20..=25;
/// Readings that change by one step, of those that do so when they lie far apart, below which a reading is held until it
/// is some steps away, and the standard errors that it has to lie below that.
const HELD: f64 = 0.85;
const CERTAIN: f64 = 5.0;
/// Excess over the expected share, relative, that a single gyro has to show: the share itself is that well known.
const EXCESS: f64 = 0.1;

/// Share of agreeing pairs `lag` apart of one gyro.
fn share(values: &[f64], lag: usize, step: f64) -> f64 {
    // Without a branch, so that several are counted at once.
    let (mut same, mut all) = (0u64, 0u64);
    for (a, b) in values.iter().zip(&values[lag.min(values.len())..]) {
        let known = a.is_finite() & b.is_finite();
        all += u64::from(known);
        same += u64::from(known & equal(*a, *b, step));
    }
    if all > 0 {
        same as f64 / all as f64
    } else {
        0.0
    }
}

/// Readings that are one step from that `lag` before.
fn one_step(values: &[f64], lag: usize, step: f64) -> f64 {
    let pairs = values.iter().zip(&values[lag.min(values.len())..]);
    let one = pairs.filter(|(a, b)| ((*b - *a).abs() / step - 1.0).abs() < 0.5);
    one.count() as f64
}

/// How often a reading that is held until it is some steps away changes by one, and how often it would; `None` where it
/// repeats for another reason. Of `rows` readings, `excess` repeat.
fn held(values: &[f64], step: f64, rows: usize, excess: f64) -> Option<(f64, f64)> {
    if step <= 0.0 {
        return None;
    }
    let far = LAGS.map(|l| one_step(values, l, step)).sum::<f64>() / LAGS.count() as f64;
    let expected = far * (1.0 - excess / rows as f64);
    let near = one_step(values, 1, step);
    (HELD * expected - near > CERTAIN * expected.sqrt()).then_some((near, expected))
}

/// Readings on either side whose mean a reading is held against, beside its neighbours and what those are held with.
const BESIDE: std::ops::RangeInclusive<usize> = 3..=8;
/// Standard errors.
const FAR: f64 = 4.0;
/// Standard errors of two findings together at which readings that repeat are none that are held at any time: 1e-4.
const NOT_HELD: f64 = 3.72;
/// Repeats of repeats beyond those of chance, over all beyond chance: where a fault holds readings for three frames and more
/// they are half and more of them.
const IN_RUNS: f64 = 0.4;

/// How far readings that repeat lie from those about.
struct Near {
    /// Over what those do that a lost conversion makes repeat, variances.
    part: f64,
    /// Standard errors below that.
    z: f64,
    /// Whether nearness alone is what is seen.
    alone: bool,
}

/// How far a reading lies from those about that it is not held with.
fn off(values: &[f64], i: usize) -> Option<f64> {
    let mut sum = 0.0;
    for k in BESIDE {
        sum += values.get(i.checked_sub(k + 1)?)? + values.get(i + k)?;
    }
    let off = values[i] - sum / (2 * BESIDE.count()) as f64;
    off.is_finite().then_some(off)
}

/// How far, in units of variance, readings that repeat lie from those about, over what those do that a lost conversion makes
/// repeat: these lie anywhere. Two readings that agree by what they are lie near their common mean, and the more so where
/// a play or a filter makes them agree. Of `own`, the readings that repeat, `expected` do so by chance.
fn near(values: &[f64], own: &[usize], expected: f64) -> Option<Near> {
    let off = |i: usize| off(values, i).map(|o| o * o);
    let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
    let any: Vec<f64> = (0..values.len()).filter_map(off).collect();
    let here: Vec<f64> = own.iter().filter_map(|i| off(*i)).collect();
    if (here.len() as f64) < LEAST_READINGS as f64 {
        return None;
    }
    // A reading that is held for several frames is what those about are held with: it repeats repeats.
    let repeats = own.len() as f64;
    let again = own.windows(2).filter(|w| w[1] == w[0] + 1).count() as f64;
    if again - repeats * repeats / values.len() as f64 > IN_RUNS * (repeats - expected) {
        return None;
    }
    let variance = mean(&any);
    // Two that agree are as far off as the mean of two that correlate so.
    let pairs = values.windows(2).map(|w| (w[1] - w[0]).powi(2));
    let pairs: Vec<f64> = pairs.filter(|d| d.is_finite()).collect();
    let alike = (1.0 - 0.25 * mean(&pairs) / variance).max(0.0);
    let share = (expected / own.len() as f64).min(1.0);
    // By chance and by a fault; by chance and by nearness.
    let (lost, near) = (share * alike + 1.0 - share, alike);
    let seen = mean(&here) / variance;
    let error = seen * (2.0 / here.len() as f64).sqrt();
    Some(Near {
        part: seen / lost,
        z: (lost - seen) / error,
        alone: lost - seen > FAR * error && lost - seen > 0.5 * (lost - near),
    })
}

/// Standard errors by which readings that repeat, `own`, go with those before and after both more than such do that a lost
/// conversion makes repeat. That holds a reading whatever comes next, which goes with it as any two readings do that are one
/// and two apart; so do, where neighbours are jointly normal, two that agree by chance: with v = y1 = y2,
/// E v^2 = (1 + r1) / 2 and E v y0 = (r1 + r2) / (1 + r1) E v^2. A median holds a reading that lies between others, and one
/// far out only beside one farther out. Of `own`, `expected` repeat by chance.
fn beside(values: &[f64], own: &[usize], expected: f64) -> Option<f64> {
    let offs: Vec<Option<f64>> = (0..values.len()).map(|i| off(values, i)).collect();
    let at = |i: usize| offs.get(i).copied().flatten();
    let apart = |lag: usize| {
        let pairs = offs.iter().zip(offs.iter().skip(lag));
        let all: Vec<f64> = pairs.filter_map(|(a, b)| Some((*a)? * (*b)?)).collect();
        mean_with_error(&all).0
    };
    let next = |i: usize| own.binary_search(&i).is_ok();
    let alone = own.iter().filter(|i| !next(**i - 1) && !next(**i + 1));
    let here = alone.filter_map(|i| {
        let about = at(i.checked_sub(2)?)? + at(i + 1)?;
        Some(0.25 * (at(i - 1)? + at(*i)?) * about)
    });
    let here: Vec<f64> = here.collect();
    if here.len() < LEAST_READINGS {
        return None;
    }
    let (seen, error) = mean_with_error(&here);
    // Readings that are held make neighbours alike by their share.
    let holds = (own.len() as f64 - expected) / values.len() as f64;
    let lost = 0.5 * (apart(1) - holds * apart(0) + apart(2));
    Some((seen - lost) / error)
}

/// Mean of independent values, and its standard error.
fn mean_with_error(all: &[f64]) -> (f64, f64) {
    let n = all.len() as f64;
    let mean = all.iter().sum::<f64>() / n;
    let squares = all.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    (mean, squares.sqrt() / n)
}

fn differences(values: &[f64], lag: usize) -> Vec<f64> {
    values.windows(lag + 1).map(|w| w[lag] - w[0]).collect()
}

/// Beyond this many standard deviations a difference is no matter of noise.
const WILD: f64 = 5.0;

/// Standard deviation of differences, wild ones left out.
fn spread(d: &[f64], step: f64) -> f64 {
    let limit = WILD * robust_sigma(d).max(step);
    let near = d.iter().filter(|v| v.abs() < limit);
    let (sum, count) = near.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}

/// Share of differences 0 that the others predict, with its relative error; `None` where the noise is below a step.
fn bridged(d: &[f64], step: f64) -> Option<(f64, f64)> {
    let finite = d.iter().filter(|v| v.is_finite()).count() as f64;
    let spread = robust_sigma(d) / step;
    if spread < 1.5 {
        return None;
    }
    let reach = ((0.7 * spread) as usize).clamp(2, 400);
    let mut tally = vec![0.0f64; reach + 1];
    for v in d.iter().filter(|v| v.is_finite()) {
        let k = (v / step).round().abs();
        if k >= 1.0 && k <= reach as f64 {
            tally[k as usize] += 0.5;
        }
    }
    let reach = reach as f64;
    let square = |k: f64| [1.0, (k / reach).powi(2), 0.0];
    let peaked = |k: f64| [1.0, (k / reach).powi(2), k / reach];
    let plain = poisson(&tally, square, 2)?;
    // Differences of no normal law, as of readings that are smoothed while little happens, are peaked beside 0 as well.
    let fit = if plain.chance < NORMAL {
        poisson(&tally, peaked, 3)?
    } else {
        plain
    };
    // Each bin is the mean of two, and neighbours share a reading.
    let error = (1.5 * 0.5 * fit.variance).sqrt();
    let p = fit.first.exp() / finite;
    (p.is_finite() && error.is_finite()).then_some((p, error))
}

/// Chance of the tallies below which the differences have no normal law.
const NORMAL: f64 = 1e-3;

/// A Poisson regression.
struct Fitted {
    /// Logarithm of what is expected at 0, and its variance.
    first: f64,
    variance: f64,
    /// Chance of tallies as far off.
    chance: f64,
}

/// Logarithms of the tallies from 1 on as a sum of the first `count` of `terms`, of which the first is 1 and the others
/// are 0 at 0; by Newton's method from the mean.
fn poisson(tally: &[f64], terms: impl Fn(f64) -> [f64; 3], count: usize) -> Option<Fitted> {
    let bins = tally.len() - 1;
    let total: f64 = tally[1..].iter().sum();
    let mut x = [(total / bins as f64).ln(), 0.0, 0.0];
    let mean = |x: &[f64; 3], t: &[f64; 3]| -> f64 {
        let ln: f64 = x.iter().zip(t).map(|(x, t)| x * t).sum();
        ln.exp()
    };
    let mut variance = f64::NAN;
    for _ in 0..30 {
        let mut g = vec![0.0; count];
        let mut h = vec![vec![0.0; count]; count];
        for (k, y) in tally.iter().enumerate().skip(1) {
            let t = terms(k as f64);
            let m = mean(&x, &t);
            for i in 0..count {
                g[i] += (y - m) * t[i];
                (0..count).for_each(|j| h[i][j] += m * t[i] * t[j]);
            }
        }
        let (inverse, _) = invert(&h);
        let step: Vec<f64> = inverse
            .iter()
            .map(|row| row.iter().zip(&g).map(|(a, b)| a * b).sum())
            .collect();
        x.iter_mut().zip(&step).for_each(|(x, s)| *x += s);
        variance = inverse[0][0];
        if step[0].abs() < 1e-10 {
            break;
        }
    }
    // Each bin is the mean of two, and neighbours share a reading, as above.
    let off = tally.iter().enumerate().skip(1).map(|(k, y)| {
        let m = mean(&x, &terms(k as f64));
        (y - m).powi(2) / (0.75 * m)
    });
    let freedom = bins.saturating_sub(count) as f64;
    Some(Fitted {
        first: x[0],
        variance,
        chance: chi_tail(off.sum(), freedom.max(1.0)),
    })
    .filter(|_| bins > count)
}

/// Chance that a reading agrees with the one before, without a fault, and the relative error of that. Readings that
/// agree as often when they lie far apart share a code, not a moment.
pub(crate) fn agreement(values: &[f64], step: f64) -> (f64, f64) {
    let d = differences(values, 1);
    let far: f64 = LAGS.map(|l| share(values, l, step)).sum::<f64>() / LAGS.count() as f64;
    match bridged(&d, step) {
        Some((p, error)) if p >= far => (p, error),
        Some((_, error)) => (far, error.max(0.02)),
        None => {
            // Quantiles of a few steps are steps: by mean squares, which add what rounding does to both.
            let near = spread(&d, step);
            let wide = spread(&differences(values, *LAGS.start()), step);
            let raised = if near > 0.0 {
                (wide / near).max(1.0)
            } else {
                1.0
            };
            ((far * raised).min(1.0), 0.02)
        }
    }
}

/// Correlation of neighbours, by how much less they differ than readings far apart.
pub(crate) fn correlation(values: &[f64]) -> f64 {
    let square = |lag: usize| {
        let d = differences(values, lag);
        d.iter().map(|d| d * d).sum::<f64>() / d.len().max(1) as f64
    };
    1.0 - square(1) / square(*LAGS.start())
}

/// Whether two readings are the same.
pub(crate) fn equal(a: f64, b: f64, step: f64) -> bool {
    (a - b).abs() <= 0.5 * step
}

pub(super) fn audit(record: &Record, gyros: &[Gyro<'_>], at: &[f64], audit: &mut Audit) {
    let rows = at.len();
    if gyros.is_empty() || rows < LEAST_READINGS.max(4 * LAGS.end()) {
        return;
    }
    let varies = |g: &Gyro<'_>| {
        let mut known = g.channel.values.iter().filter(|v| v.is_finite());
        let first = known.next();
        known.any(|v| Some(v) != first)
    };
    let gyros: Vec<&Gyro<'_>> = gyros.iter().filter(|g| varies(g)).collect();
    let columns: Vec<&[f64]> = gyros.iter().map(|g| g.channel.values.as_slice()).collect();
    if columns.is_empty() {
        return;
    }
    // With missing bits the step is theirs.
    let step = |g: &Gyro<'_>| {
        let bits = audit
            .findings
            .iter()
            .find(|f| f.cause == "coarse_lsb" && f.channels[0] == g.channel.name)
            .and_then(|f| f.parameters.get("missing_bits"))
            .map_or(0.0, |p| p.value);
        let lsb = g.channel.lsb.filter(|_| g.counts.is_some());
        lsb.map_or_else(|| smallest_step(&g.channel.values), |l| l * bits.exp2())
    };
    let steps: Vec<f64> = gyros.iter().map(|g| step(g)).collect();
    let flagged = |i: usize| {
        gyros
            .iter()
            .any(|g| !audit.usable.get(&g.channel.name).is_some_and(|u| u[i]) && g.known(i))
    };
    let same = |lag: usize, i: usize| {
        let mut all = columns.iter().zip(&steps);
        all.all(|(c, s)| equal(c[i], c[i - lag], *s))
    };
    let repeated: Vec<usize> = (1..rows).filter(|i| same(1, *i) && !flagged(*i)).collect();
    let chances: Vec<(f64, f64)> = columns
        .iter()
        .zip(&steps)
        .map(|(c, s)| agreement(c, *s))
        .collect();
    let product: f64 = chances.iter().map(|p| p.0).product::<f64>() * rows as f64;
    let together: f64 = LAGS
        .map(|l| (l..rows).filter(|i| same(l, *i)).count() as f64)
        .sum::<f64>()
        / LAGS.count() as f64;
    // Often equal readings share their level, which a product of means does not see.
    let expected = if chances.iter().all(|p| p.0 < 0.15) {
        product
    } else {
        product.max(1.3 * together + 3.0)
    };
    let observed = repeated.len() as u64;
    let doubt = chances.iter().map(|p| p.1 * p.1).sum::<f64>().sqrt();
    // A single gyro repeats by chance so often that the doubt of its share decides; that is the test below.
    let chance = if columns.len() > 1 {
        tails::at_least(observed, expected * (1.0 + 3.0 * doubt))
    } else {
        1.0
    };
    let names: Vec<String> = gyros.iter().map(|g| g.channel.name.clone()).collect();
    if columns.len() > 1 {
        let mean = expected * (1.0 + 3.0 * doubt);
        let mut counts = mean as u64..rows as u64;
        if let Some(enough) = counts.find(|k| tails::at_least(*k, mean) < AUDIT_LEVEL) {
            let by_chance = (expected - ONE_SIDED * expected.sqrt()).max(0.0);
            let planted = (enough as f64 - by_chance).ceil();
            for name in &names {
                audit.smallest("stale_samples", name, "count", planted, "1");
            }
        }
    }
    let what = format!(
        "{observed} frames repeat all of {} from the frame before, {expected:.2} are expected",
        names.join(", ")
    );
    if audit.check(
        CheckId::RepeatedFrames,
        "record",
        observed as f64,
        chance,
        what.clone(),
    ) {
        let times: Vec<f64> = repeated.iter().map(|i| at[*i]).collect();
        let count = (observed as f64 - expected).round().max(1.0);
        for name in &names {
            repeated.iter().for_each(|i| audit.mask(name, *i));
        }
        let mut finding = counted(
            "stale_samples",
            names,
            count,
            Some(expected.sqrt()),
            &times,
            what,
        );
        let runs = super::running(&repeated, expected, rows);
        finding.parameters.insert("running".into(), runs);
        if record.flags.is_some() {
            finding.what.push_str("; the new-data flags do not tell");
        }
        audit.findings.push(finding);
        return;
    }
    for (((g, values), (p, known)), step) in gyros.iter().zip(&columns).zip(&chances).zip(&steps) {
        let name = g.channel.name.as_str();
        let rest = audit.usable.get(name).cloned().unwrap_or_default();
        let own: Vec<usize> = (1..rows)
            .filter(|i| {
                equal(values[*i], values[*i - 1], *step) && rest.get(*i).copied().unwrap_or(false)
            })
            .collect();
        let expected = p * rows as f64;
        let error = (expected * (1.0 - p) * 1.2 + (known * expected).powi(2)).sqrt();
        let z = (own.len() as f64 - expected) / error.max(1.0);
        let chance = if expected < 30.0 {
            tails::at_least(own.len() as u64, expected * (1.0 + 3.0 * known))
        } else {
            tails::upper_normal(z)
        };
        let what = format!(
            "{} readings of {name} repeat the one before, {expected:.1} are expected",
            own.len()
        );
        let excess = own.len() as f64 - expected;
        if columns.len() == 1 {
            let reach = tails::farthest(1, 2.0 * AUDIT_LEVEL) + ONE_SIDED;
            let planted = (reach * error.max(1.0)).max(EXCESS * expected).ceil();
            audit.smallest("stale_samples", name, "count", planted, "1");
        }
        let told = audit.is_suppressed("stale_samples", name);
        let relative = excess > EXCESS * expected;
        if audit.check(
            CheckId::RepeatedReadings,
            name,
            z,
            if relative && !told { chance } else { 1.0 },
            what.clone(),
        ) && chance < AUDIT_LEVEL
        {
            if let Some((near, far)) = held(values, *step, rows, excess) {
                audit.unexplain(name, format!("{what}; and it changes by one step {near:.0} times, where {far:.0} are expected: a reading is held until the next one is some steps away"));
                continue;
            }
            if let Some(near) = near(values, &own, expected) {
                let part = near.part;
                let least = format!(
                    "where they do, the readings lie {part:.2} times as far from those about as such do that are held at any time"
                );
                if near.alone {
                    audit.unexplain(name, format!("{what}; {least}: it repeats where two in turn lie near each other, as behind a play or a filter"));
                    continue;
                }
                let beside = beside(values, &own, expected);
                if let Some(z) = beside.filter(|z| z + near.z > NOT_HELD * SQRT_2) {
                    audit.unexplain(name, format!("{what}; {least}, and go with those beside them by {z:.1} standard errors more: it repeats readings that lie between others, as a median does"));
                    continue;
                }
            }
            // Which of them is a repeat by chance cannot be told where those are the many, but of a reading that comes
            // three times and more.
            let held = |i: &&usize| {
                let next = |j: usize| own.binary_search(&j).is_ok();
                excess > expected || next(**i + 1) || next(i.saturating_sub(1))
            };
            own.iter().filter(held).for_each(|i| audit.mask(name, *i));
            let times: Vec<f64> = own.iter().map(|i| at[*i]).collect();
            let times = if excess > expected { times } else { vec![] };
            let names = vec![name.to_owned()];
            let count = excess.round();
            let mut finding = counted("stale_samples", names, count, Some(error), &times, what);
            let runs = super::running(&own, expected, rows);
            finding.parameters.insert("running".into(), runs);
            audit.findings.push(finding);
        }
    }
}
