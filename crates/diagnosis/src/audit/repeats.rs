//! Repeats that no flag tells: frames with every gyro reading as in the frame before, and blocks of them ([`blocks`]).
//!
//! Differences of neighbours d have a smooth distribution; repeats add to d = 0 alone. The expected share at 0 is that of
//! the curve ln p(d) = a - c d^2 through its neighbours d = +-1 .. +-K, K below the spread of d, whatever the base does
//! and however alike neighbours are. Where the noise is below a count, pairs farther apart tell the share instead. Three
//! gyros agree with the product of theirs: (1 / (2 sqrt(pi) sigma))^3 for white noise of sigma counts.

pub(super) mod beat;
mod blocks;
mod near;

use std::f64::consts::SQRT_2;

use model::effects;
use model::record::Record;

use super::runs::Runs;
use super::{Audit, Gyro, LEAST_READINGS, counted};
use crate::fit::likelihood::invert;
use crate::test_level::{CheckId, audit_level};
use near::{NOT_HELD, beside, near};
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

/// Gyros that vary, with the step of each and the chance that a reading agrees with the one before.
struct Readings<'a> {
    gyros: Vec<&'a Gyro<'a>>,
    columns: Vec<&'a [f64]>,
    steps: Vec<f64>,
    /// Chance of agreement without a fault, and its relative error.
    chances: Vec<(f64, f64)>,
    rows: usize,
}

impl<'a> Readings<'a> {
    fn new(gyros: &'a [Gyro<'a>], rows: usize, audit: &Audit) -> Self {
        let varies = |g: &&Gyro<'_>| {
            let mut known = g.channel.values.iter().filter(|v| v.is_finite());
            let first = known.next();
            known.any(|v| Some(v) != first)
        };
        // With missing bits the step is theirs.
        let step = |g: &Gyro<'_>| {
            let coarse = (audit.findings.iter())
                .find(|f| f.cause == effects::coarse_lsb::ID && f.channels[0] == g.channel.name)
                .map_or(1, |f| effects::coarse_lsb::step(&f.parameters));
            let lsb = g.channel.lsb.filter(|_| g.counts.is_some());
            lsb.map_or_else(
                || smallest_step(&g.channel.values),
                |l| l * f64::from(coarse),
            )
        };
        let gyros: Vec<&Gyro<'_>> = gyros.iter().filter(varies).collect();
        let columns: Vec<&[f64]> = gyros.iter().map(|g| g.channel.values.as_slice()).collect();
        let steps: Vec<f64> = gyros.iter().map(|g| step(g)).collect();
        let chances = columns.iter().zip(&steps).map(|(c, s)| agreement(c, *s));
        Self {
            chances: chances.collect(),
            gyros,
            columns,
            steps,
            rows,
        }
    }

    /// Whether all readings of a row are those `lag` before.
    fn same(&self, lag: usize, i: usize) -> bool {
        let mut all = self.columns.iter().zip(&self.steps);
        all.all(|(c, s)| equal(c[i], c[i - lag], *s))
    }

    /// Rows that repeat the one before, and no flag tells.
    fn repeated(&self, audit: &Audit) -> Vec<usize> {
        let flagged = |i: usize| {
            self.gyros
                .iter()
                .any(|g| !audit.usable.get(&g.channel.name).is_some_and(|u| u[i]) && g.known(i))
        };
        (1..self.rows)
            .filter(|i| self.same(1, *i) && !flagged(*i))
            .collect()
    }

    /// Rows that repeat the one before by chance.
    fn expected(&self) -> f64 {
        let product: f64 = self.chances.iter().map(|p| p.0).product::<f64>() * self.rows as f64;
        let together: f64 = LAGS
            .map(|l| (l..self.rows).filter(|i| self.same(l, *i)).count() as f64)
            .sum::<f64>()
            / LAGS.count() as f64;
        // Often equal readings share their level, which a product of means does not see.
        if self.chances.iter().all(|p| p.0 < 0.15) {
            product
        } else {
            product.max(1.3 * together + 3.0)
        }
    }

    /// The same; where the repeats keep a beat, as readings have it that are not held: those that are make neighbours as alike as a
    /// filter would.
    fn expected_beside(&self, repeated: &[usize]) -> f64 {
        if !beat::lie_evenly(repeated, self.rows) {
            return self.expected();
        }
        let new = |i: &usize| repeated.binary_search(i).is_err();
        let new = |column: &&[f64]| (0..self.rows).filter(new).map(|i| column[i]).collect();
        let columns: Vec<Vec<f64>> = self.columns.iter().map(new).collect();
        let own = columns.iter().zip(&self.steps);
        let chances = own.map(|(c, s)| agreement(c, *s).0);
        self.expected()
            .min(chances.product::<f64>() * self.rows as f64)
    }

    /// Whether gyros repeat as often beyond chance in frames that do not repeat as a whole: each by itself, then, and no frame.
    fn each_by_itself(&self) -> bool {
        let whole: Vec<bool> = (1..self.rows).map(|i| self.same(1, i)).collect();
        let others = whole.iter().filter(|w| !**w).count() as f64;
        let all = self.columns.iter().zip(&self.steps).zip(&self.chances);
        let beyond = all.filter(|((column, step), (p, known))| {
            let own = (1..self.rows)
                .filter(|i| !whole[i - 1] && equal(column[*i], column[*i - 1], **step));
            let expected = p * others;
            let error = (expected + (known * expected).powi(2)).sqrt();
            own.count() as f64 > (1.0 + EXCESS) * expected + CERTAIN * error
        });
        beyond.count() > 1
    }

    /// Whether whole frames repeat.
    fn frames(&self, record: &Record, at: &[f64], audit: &mut Audit) -> bool {
        let repeated = self.repeated(audit);
        let expected = self.expected_beside(&repeated);
        let observed = repeated.len() as u64;
        let doubt = self.chances.iter().map(|p| p.1 * p.1).sum::<f64>().sqrt();
        let mean = expected * (1.0 + 3.0 * doubt);
        // A single gyro repeats by chance so often that the error of its share decides; that is the test of each.
        let several = self.columns.len() > 1;
        let chance = if several {
            tails::at_least(observed, mean)
        } else {
            1.0
        };
        let names: Vec<String> = self.gyros.iter().map(|g| g.channel.name.clone()).collect();
        if several {
            let mut counts = mean as u64..self.rows as u64;
            if let Some(enough) = counts.find(|k| tails::at_least(*k, mean) < audit_level()) {
                let by_chance = (expected - ONE_SIDED * expected.sqrt()).max(0.0);
                let planted = (enough as f64 - by_chance).ceil();
                for name in &names {
                    audit.smallest(effects::stale_samples::ID, name, "count", planted, "1");
                }
            }
        }
        let what = format!(
            "{observed} frames repeat all of {} from the frame before, {expected:.2} are expected",
            names.join(", ")
        );
        let (id, seen) = (CheckId::RepeatedFrames, observed as f64);
        let chance = if chance < audit_level() && self.each_by_itself() {
            1.0
        } else {
            chance
        };
        if !audit.check(id, "record", seen, chance, what.clone()) {
            return false;
        }
        let times: Vec<f64> = repeated.iter().map(|i| at[*i]).collect();
        for name in &names {
            repeated.iter().for_each(|i| audit.mask(name, *i));
        }
        let error = Some(expected.sqrt());
        let cause = effects::stale_samples::ID;
        let runs = Runs::new(&repeated, expected, self.rows);
        let mut finding = counted(cause, names, runs.stalled().round(), error, &times, what);
        finding.parameters.extend(runs.how_long());
        let rate = beat::sensor_rate(&repeated, runs.stalled(), at);
        (finding.parameters).extend(rate.map(|rate| ("sensor_rate".into(), rate)));
        if record.flags.is_some() {
            finding.what.push_str("; the new-data flags do not tell");
        }
        audit.findings.push(finding);
        true
    }

    /// Repeats of one gyro; whether there are some that are none of a frame.
    fn one(&self, g: usize, at: &[f64], audit: &mut Audit) -> bool {
        let (values, step, (p, known)) = (self.columns[g], self.steps[g], self.chances[g]);
        let name = self.gyros[g].channel.name.as_str();
        let rest = audit.usable.get(name).cloned().unwrap_or_default();
        let own: Vec<usize> = (1..self.rows)
            .filter(|i| {
                equal(values[*i], values[*i - 1], step) && rest.get(*i).copied().unwrap_or(false)
            })
            .collect();
        let expected = p * self.rows as f64;
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
        let cause = effects::stale_samples::ID;
        if self.columns.len() == 1 {
            let reach = tails::farthest(1, 2.0 * audit_level()) + ONE_SIDED;
            let planted = (reach * error.max(1.0)).max(EXCESS * expected).ceil();
            audit.smallest(cause, name, "count", planted, "1");
        }
        let suppressed = audit.is_suppressed(cause, name);
        let relative = excess > EXCESS * expected;
        let weighed = if relative && !suppressed { chance } else { 1.0 };
        let fails = audit.check(CheckId::RepeatedReadings, name, z, weighed, what.clone());
        if !fails || chance >= audit_level() {
            return false;
        }
        if let Some(why) = self.no_repeats(values, step, &own, expected) {
            audit.unexplain(name, format!("{what}; {why}"));
            return true;
        }
        // Which of them is a repeat by chance cannot be told, but of a run that is longer than chance makes it.
        let times = own.iter().filter(|_| excess > expected).map(|i| at[*i]);
        let times: Vec<f64> = times.collect();
        let names = vec![name.to_owned()];
        let runs = Runs::new(&own, expected, self.rows);
        runs.beyond_chance().for_each(|i| audit.mask(name, i));
        let error = Some(error / (1.0 - p).max(0.1));
        let mut finding = counted(cause, names, runs.stalled().round(), error, &times, what);
        finding.parameters.extend(runs.how_long());
        audit.findings.push(finding);
        false
    }

    /// Why equal readings are no repeats of a frame.
    fn no_repeats(
        &self,
        values: &[f64],
        step: f64,
        own: &[usize],
        expected: f64,
    ) -> Option<String> {
        let excess = own.len() as f64 - expected;
        if let Some((near, far)) = held(values, step, self.rows, excess) {
            return Some(format!(
                "and it changes by one step {near:.0} times, where {far:.0} are expected: a reading is held until the next one is some steps away"
            ));
        }
        let near = near(values, own, expected)?;
        let least = format!(
            "where they do, the readings lie {:.2} times as far from those about as such do that are held at any time",
            near.part
        );
        if near.alone {
            return Some(format!(
                "{least}: it repeats where two in turn lie near each other, as behind a play or a filter"
            ));
        }
        let z = beside(values, own, expected).filter(|z| z + near.z > NOT_HELD * SQRT_2)?;
        Some(format!(
            "{least}, and go with those beside them by {z:.1} standard errors more: it repeats readings that lie between others, as a median does"
        ))
    }
}

pub(super) fn audit(record: &Record, gyros: &[Gyro<'_>], at: &[f64], audit: &mut Audit) {
    let rows = at.len();
    if gyros.is_empty() || rows < LEAST_READINGS.max(4 * LAGS.end()) {
        return;
    }
    let readings = Readings::new(gyros, rows, audit);
    if readings.columns.is_empty() {
        return;
    }
    blocks::audit(record, &readings.gyros, at, audit);
    if readings.frames(record, at, audit) {
        return;
    }
    let known = audit.findings.len();
    let none_of_frames = (0..readings.gyros.len()).filter(|g| readings.one(*g, at, audit));
    // What makes readings of one axis come again without a frame that repeats does so on the others.
    if none_of_frames.count() > 0 {
        for finding in audit.findings.split_off(known) {
            let what = format!(
                "{}; other axes repeat what is none of a frame",
                finding.what
            );
            audit.unexplain(&finding.channels[0], what);
        }
    }
}
