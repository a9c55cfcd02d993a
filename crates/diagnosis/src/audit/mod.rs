//! Audits of frames and counts: what is wrong with a record before anybody fits a model to it.
//!
//! Each audit takes the record alone. It needs no fit, so it also works where the base moves or the noise is not what
//! the model says: every reading is held against its own neighbourhood ([`local`]). Chances are those of one channel
//! and one audit; [`AUDIT_LEVEL`] is what each may spend.

mod bits;
mod cells;
mod code_dependence;
mod codes;
mod constant_run;
mod drift;
mod duplicated;
mod frames;
mod gross_outliers;
mod interpolated;
pub mod local;
mod outliers;
mod rate_limit;
pub(crate) mod repeats;
mod resampled;
mod rounded_twice;
mod rounding;
mod runs;
mod saturation;
pub mod sign_bit;
mod stuck;
mod timing;

use std::collections::BTreeMap;

use model::effects;
use model::record::{Channel, Quantity, Record};

use crate::ingest::jumps::TwoLevels;
use crate::result::{Check, DetectionLimit, Finding, NotTested, Parameter};
use crate::test_level::{CheckId, Observation, audit_level, on_two_threads};
use local::Local;

/// Steps of a converter that lacks a bit, over the noise, up to which the variance of readings is the same at any level: to
/// 5e-4 at this width, by the first harmonic of a rounded normal variable.
const WIDE: f64 = 1.5;
/// Least readings of a channel that an audit of its distribution takes.
pub const LEAST_READINGS: usize = 200;
/// Most times that a finding lists.
pub const MOST_TIMES: usize = 1000;

/// A check that a fault of frames or counts makes fail: no news, and no second cause.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Suppression {
    /// Cause or check id that says nothing new on this channel.
    pub id: String,
    /// The channel.
    pub channel: String,
    /// The cause that explains it.
    pub by: String,
}

/// What the audits say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Audit {
    /// Faults found.
    pub findings: Vec<Finding>,
    /// By gyro: whether a row's reading may be used.
    pub usable: BTreeMap<String, Vec<bool>>,
    /// What not to say a second time.
    pub suppressed: Vec<Suppression>,
    /// One per audit and channel that could be made.
    pub checks: Vec<Check>,
    /// Audits that could not be made.
    pub not_tested: Vec<NotTested>,
    /// Causes that one channel could not be asked for: channel, cause.
    pub not_asked: Vec<(String, String)>,
    /// What is wrong and has no name in the library.
    pub unexplained: Vec<Observation>,
    /// Channels whose counts are not normal about their level; a noise that changes makes them so as well.
    pub not_normal: Vec<Observation>,
    /// Rows before which frames were lost without a gap of the sequence numbers, and how many.
    pub silently_lost: Vec<(usize, u64)>,
    /// Smallest faults that would have been found.
    pub limits: Vec<DetectionLimit>,
    /// What a reader has to know of the readings, and is no fault.
    pub notes: Vec<String>,
    /// Rows of single readings that the noise cannot have made, by channel.
    pub singles: BTreeMap<String, Vec<usize>>,
    /// Channels whose readings lie between others of another rate.
    pub between: Vec<String>,
    /// Steps, counts, of channels whose converter lacks a bit.
    steps: BTreeMap<String, f64>,
    /// Channels whose noise is hardly larger than their step.
    rounded: BTreeMap<String, rounding::Rounded>,
}

impl Audit {
    /// Whether `id` on `channel` is explained by another fault.
    #[must_use]
    pub fn is_suppressed(&self, id: &str, channel: &str) -> bool {
        self.suppressed
            .iter()
            .any(|s| s.id == id && s.channel == channel)
    }

    /// Whether counts explain a law of the variance: its likelihood ratio, the one that it has to pass on normal noise,
    /// and, where it is one, the ratio of the variances.
    #[must_use]
    pub fn explains_variance(
        &self,
        channel: &str,
        lr: f64,
        threshold: f64,
        ratio: Option<f64>,
    ) -> bool {
        let by_fault = |s: &Suppression| {
            s.id == "time_frequency" && s.channel == channel && s.by != rounding::STEP
        };
        let rounded = self.rounded.get(channel);
        self.suppressed.iter().any(by_fault)
            || rounded.is_some_and(|r| r.explains_variance(lr, threshold, ratio))
    }

    /// A fault of the converter was found on `channel`: what it adds depends on the level, and is neither normal nor the
    /// same throughout, so checks of the noise say nothing new.
    fn converter_at_fault(&mut self, channel: &str, by: &str) {
        self.suppress(
            &[
                "kurtosis",
                "skewness",
                "time_frequency",
                "bicovariance",
                "three_readings",
                "neighbours",
                "variance_rhythm",
                CheckId::ColourFollows.as_str(),
                CheckId::Leaning.as_str(),
            ],
            channel,
            by,
        );
    }

    /// A converter of `channel` that lacks a bit was found, so that it steps by `step` counts where the noise has `sigma`. Law
    /// and independence of the readings are no longer the noise's; beyond some width its size is not, either.
    fn lacks_a_bit(&mut self, channel: &str, by: &str, step: f64, sigma: f64) {
        self.steps.insert(channel.into(), step);
        if step <= WIDE * sigma {
            let ids = [
                "kurtosis",
                "skewness",
                "bicovariance",
                "three_readings",
                "neighbours",
                CheckId::Leaning.as_str(),
            ];
            self.suppress(&ids, channel, by);
            return;
        }
        self.converter_at_fault(channel, by);
        self.suppress(&["spikes"], channel, by);
        for cause in [effects::noise_change::ID, effects::motor_noise::ID] {
            let why = format!(
                "with the bit that is missing it steps by {:.1} sigma, so the size of its noise hangs on the level: mend the converter first",
                step / sigma
            );
            self.untested_on(channel, cause, &why);
        }
    }

    /// A bit above the readings of `channel` was put right by the sign ([`sign_bit`]): readings that lay beyond it fold over
    /// at its edges, and no rail is there.
    pub fn put_right(&mut self, found: &Finding) {
        let Some(bit) = found.parameters.get("bit") else {
            return;
        };
        let edges = [-bit.value.exp2(), bit.value.exp2() - 1.0];
        for channel in &found.channels {
            self.converter_at_fault(channel, &found.cause);
            self.suppress(&[effects::outliers::ID], channel, &found.cause);
            self.findings.retain(|f| {
                let rail = |name: &str| f.parameters.get(name).map(|p| p.value);
                let folded = [rail("low"), rail("high")].into_iter().flatten();
                f.cause != effects::saturation::ID
                    || f.channels != [channel.as_str()]
                    || !folded.clone().all(|r| edges.contains(&r))
            });
        }
    }

    /// Rows of a channel that are not to be used.
    #[must_use]
    pub fn masked(&self, channel: &str) -> Vec<usize> {
        self.usable
            .get(channel)
            .map_or(vec![], |u| (0..u.len()).filter(|i| !u[*i]).collect())
    }

    /// Whether one of some causes was found on a channel.
    fn found(&self, causes: &[&str], channel: &str) -> bool {
        let here = |f: &Finding| f.channels.iter().any(|c| c == channel);
        let mut all = self.findings.iter();
        all.any(|f| causes.contains(&f.cause.as_str()) && here(f))
    }

    fn mask(&mut self, channel: &str, row: usize) {
        if let Some(u) = self.usable.get_mut(channel).and_then(|u| u.get_mut(row)) {
            *u = false;
        }
    }

    fn suppress(&mut self, ids: &[&str], channel: &str, by: &str) {
        self.suppressed.extend(ids.iter().map(|id| Suppression {
            id: (*id).into(),
            channel: channel.into(),
            by: by.into(),
        }));
    }

    fn check(
        &mut self,
        id: CheckId,
        channel: &str,
        statistic: f64,
        p_value: f64,
        what: String,
    ) -> bool {
        let fails = p_value < audit_level();
        self.checks.push(Check {
            id: id.into(),
            about: vec![],
            channel: channel.into(),
            statistic,
            p_value: Some(p_value),
            threshold: audit_level(),
            fails_before: fails,
            fails_after: false,
            what,
        });
        fails
    }

    /// The last check is about other channels, too.
    fn about(&mut self, channels: &[&str]) {
        if let Some(check) = self.checks.last_mut() {
            check.about = channels.iter().map(|c| (*c).to_owned()).collect();
        }
    }

    /// What the last check has found has no name in the library.
    fn unexplain(&mut self, channel: &str, what: String) {
        let mut seen = Observation::of_codes(channel, what);
        if let Some(check) = self.checks.last_mut() {
            check.fails_after = true;
            seen.check = CheckId::of(&check.id).zip(check.p_value.or(Some(0.0)));
        }
        self.unexplained.push(seen);
    }

    /// A check against a plain limit.
    fn limit(
        &mut self,
        id: CheckId,
        channel: &str,
        statistic: f64,
        limit: f64,
        what: String,
    ) -> bool {
        let fails = statistic > limit;
        self.checks.push(Check {
            id: id.into(),
            about: vec![],
            channel: channel.into(),
            statistic,
            p_value: None,
            threshold: limit,
            fails_before: fails,
            fails_after: false,
            what,
        });
        fails
    }

    /// The smallest size of a fault on a channel that would have been found.
    fn smallest(&mut self, cause: &str, channel: &str, parameter: &str, size: f64, unit: &str) {
        self.limits.push(DetectionLimit {
            cause: cause.into(),
            channel: channel.into(),
            parameter: parameter.into(),
            value: size,
            unit: unit.into(),
            ..DetectionLimit::default()
        });
    }

    /// An audit that one channel does not allow.
    fn untested_on(&mut self, channel: &str, cause: &str, why: &str) {
        self.not_asked.push((channel.to_owned(), cause.to_owned()));
        self.untested(cause, &format!("{channel}: {why}"));
    }

    fn untested(&mut self, cause: &str, why: &str) {
        let entry = NotTested {
            cause: cause.into(),
            why: why.into(),
        };
        if !self.not_tested.contains(&entry) {
            self.not_tested.push(entry);
        }
    }
}

/// A gyro, its neighbourhoods known.
struct Gyro<'a> {
    channel: &'a Channel,
    /// Counts, where the record has them.
    counts: Option<&'a [i32]>,
    /// Neighbourhoods of the counts, else of the readings.
    local: Local,
    /// Neighbourhoods of the readings, where they are no scaled counts.
    of_readings: Option<Local>,
}

impl<'a> Gyro<'a> {
    fn of(channel: &'a Channel) -> Self {
        let rows = channel.values.len();
        let counts = channel.counts.as_deref().filter(|c| c.len() == rows);
        let local = match counts {
            None => about_levels(&channel.values, channel.lsb),
            Some(c) => {
                let known = |v: &f64, c: i32| {
                    if v.is_finite() {
                        f64::from(c)
                    } else {
                        f64::NAN
                    }
                };
                let both = channel.values.iter().zip(c);
                let both: Vec<f64> = both.map(|(v, c)| known(v, *c)).collect();
                about_levels(&both, Some(1.0))
            }
        };
        let apart = counts.is_some_and(|c| !scaled(&channel.values, c));
        Self {
            channel,
            counts,
            local,
            of_readings: apart.then(|| about_levels(&channel.values, channel.lsb)),
        }
    }

    fn known(&self, row: usize) -> bool {
        self.channel.values[row].is_finite()
    }
}

/// Neighbourhoods of readings in such steps, each at its level where there are two: a short stay is no reading far off, beside a
/// switch the neighbours tell of another level, and a reading that is a mean over both is none far off either.
fn about_levels(y: &[f64], step: Option<f64>) -> Local {
    let Some(two) = TwoLevels::of(y, step.unwrap_or(0.0)) else {
        return Local::new(y);
    };
    let levels = two.level_of(y, 0.5 * two.distance);
    let at_one: Vec<f64> = y.iter().zip(&levels).map(|(y, level)| y - level).collect();
    let mut local = Local::new(&at_one);
    let each = local.level.iter_mut().zip(&levels);
    each.for_each(|(there, level)| *there += level);
    local
}

/// Times of the rows, s from the first.
fn times(record: &Record, rows: usize) -> Vec<f64> {
    let ticks = record.t_ticks.as_ref().zip(record.header.tick_s);
    if let Some((t, tick)) = ticks.filter(|(t, _)| t.len() == rows && rows > 0) {
        return t
            .iter()
            .map(|v| (v.saturating_sub(t[0])) as f64 * tick)
            .collect();
    }
    let rate = crate::ingest::grid::rate_of(record).unwrap_or(1.0);
    match record.seq.as_ref().filter(|s| s.len() == rows && rows > 0) {
        Some(s) => s
            .iter()
            .map(|v| v.saturating_sub(s[0]) as f64 / rate)
            .collect(),
        None => (0..rows).map(|i| i as f64 / rate).collect(),
    }
}

fn counted(
    cause: &str,
    channels: Vec<String>,
    count: f64,
    error: Option<f64>,
    rows: &[f64],
    what: String,
) -> Finding {
    let mut count = Parameter::exact(count, "1");
    count.std_error = error;
    Finding {
        cause: cause.into(),
        channels,
        parameters: [("count".to_owned(), count)].into(),
        times_s: rows.iter().copied().take(MOST_TIMES).collect(),
        what,
        ..Finding::default()
    }
}

/// Whether readings are counts times a unit, an offset added.
fn scaled(values: &[f64], counts: &[i32]) -> bool {
    let mut known = values.iter().zip(counts).filter(|(v, _)| v.is_finite());
    let Some((v0, c0)) = known.next() else {
        return true;
    };
    // Two counts that lie close together give a unit with few digits; the farthest ones are as good as it gets.
    let Some((v1, c1)) = known.clone().max_by_key(|(_, c)| c.abs_diff(*c0)) else {
        return true;
    };
    if c1 == c0 {
        return known.all(|(v, _)| v == v0);
    }
    let unit = (v1 - v0) / (f64::from(*c1) - f64::from(*c0));
    known.all(|(v, c)| (v - v0 - unit * (f64::from(*c) - f64::from(*c0))).abs() < 1e-6 * unit.abs())
}

/// Audit a record. Any record: what cannot be audited is listed in [`Audit::not_tested`].
#[must_use]
pub fn audit(record: &Record) -> Audit {
    let rows = record.len();
    let mut audit = Audit::default();
    let whole = record;
    let beats = resampled::beats(record);
    let came = beats.as_ref().map_or(1.0, resampled::Beats::least);
    let (record, still) = constant_run::set_aside(record, came);
    let (record, wild) = gross_outliers::set_aside(record);
    let record = record.as_ref();
    let known = record
        .all(Quantity::Gyro)
        .filter(|c| c.values.len() == rows);
    let gyros: Vec<Gyro<'_>> = on_two_threads(known.collect::<Vec<_>>(), Gyro::of);
    for g in &gyros {
        audit.usable.insert(
            g.channel.name.clone(),
            (0..rows).map(|i| g.known(i)).collect(),
        );
    }
    let at = times(record, rows);
    constant_run::audit(&still, &at, &mut audit);
    gross_outliers::audit(&wild, whole, &at, &mut audit);
    frames::audit(record, &gyros, &at, &mut audit);
    timing::audit(record, &gyros, &at, &mut audit);
    for g in &gyros {
        if (0..rows).filter(|i| g.known(*i)).count() < LEAST_READINGS {
            continue;
        }
        rate_limit::audit(g, &mut audit);
        let shape = bits::audit(g, &mut audit);
        saturation::audit(g, shape, &mut audit);
        rounding::audit(g, &mut audit);
    }
    if gyros.iter().any(|g| g.counts.is_none()) {
        for cause in [
            effects::coarse_lsb::ID,
            effects::stuck_bit::ID,
            effects::saturation::ID,
        ] {
            audit.untested(cause, "the record holds no counts, and its readings are no multiples of one step: record what the converter delivers, before any scaling, offset or averaging");
        }
    }
    // A curve between readings makes some that repeat, that their neighbours foretell, and that share their last digits.
    let rate_hz = crate::ingest::grid::rate_of(record).unwrap_or(1.0);
    if resampled::audit(&gyros, rate_hz, beats.as_ref(), &mut audit) {
        for g in &gyros {
            outliers::audit(g, &at, &mut audit);
        }
        return audit;
    }
    repeats::audit(record, &gyros, &at, &mut audit);
    duplicated::audit(record, &gyros, &at, &mut audit);
    code_dependence::audit(&gyros, &mut audit);
    let foretold = on_two_threads(&gyros, |g| interpolated::found(g, &audit));
    for (g, foretold) in gyros.iter().zip(foretold) {
        interpolated::audit(g, foretold, &mut audit);
        outliers::audit(g, &at, &mut audit);
    }
    audit
}
