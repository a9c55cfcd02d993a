//! Clocks: how evenly the board samples, and how fast its clock runs against the host's.

use model::Parameter;
use model::effects;
use model::record::Record;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::drift::{self, Uneven};
use super::{Audit, Gyro};
use crate::result::Finding;
use crate::test_level::{CheckId, audit_level};
use numerics::order_statistics::{median, width};
use numerics::tails;
use numerics::tails::ONE_SIDED;

/// Jitter of a sound board, rounding to ticks included, is about 36 us; beyond this it is a fault.
const JITTER_LIMIT_S: f64 = 70e-6;
/// Share of the intervals on either side that the jitter leaves out.
const SHARE: f64 = 0.01;
/// Quantile of the standard normal at `SHARE`.
const QUANTILE: f64 = 2.326_348;
/// Least length for a slope, s.
const LEAST_SECONDS: f64 = 30.0;

pub(super) fn audit(record: &Record, gyros: &[Gyro<'_>], at: &[f64], audit: &mut Audit) {
    let rows = at.len();
    let ticks = record.t_ticks.as_ref().filter(|t| t.len() == rows);
    let (Some(ticks), Some(tick_s)) = (ticks, record.header.tick_s) else {
        let why = "the record holds no device time (t_ticks, and tick_s in its header)";
        audit.untested(effects::timestamp_jitter::ID, why);
        audit.untested(effects::clock_rate::ID, why);
        return;
    };
    if rows < super::LEAST_READINGS {
        return;
    }
    let names: Vec<String> = gyros.iter().map(|g| g.channel.name.clone()).collect();
    let device: Vec<f64> = ticks
        .iter()
        .map(|t| t.saturating_sub(ticks[0]) as f64 * tick_s)
        .collect();
    jitter(record, &device, tick_s, &names, audit);
    rate(record, &device, &names, audit);
}

fn jitter(record: &Record, device: &[f64], tick_s: f64, names: &[String], audit: &mut Audit) {
    let seq = record.seq.as_ref().filter(|s| s.len() == device.len());
    let single: Vec<f64> = (1..device.len())
        .filter(|i| seq.is_none_or(|s| s[*i] == s[*i - 1] + 1))
        .map(|i| device[i] - device[i - 1])
        .collect();
    let period = median(&single);
    // Lost frames are another matter: their numbers tell of them, or else a step that is off by half.
    let single: Vec<f64> = single
        .into_iter()
        .filter(|d| seq.is_some() || (d - period).abs() < 0.5 * period)
        .collect();
    if single.len() < 100 {
        return;
    }
    // The difference of two instants has twice the variance of one.
    let spread = width(&single, SHARE) / (2.0 * QUANTILE) / 2f64.sqrt();
    let sigma = (spread * spread - tick_s * tick_s / 12.0).max(0.0).sqrt();
    let limit = JITTER_LIMIT_S.max(tick_s);
    let what = format!(
        "instants of sampling scatter by {:.0} us rms, with ticks of {:.1} us; {:.0} us is the limit",
        1e6 * sigma,
        1e6 * tick_s,
        1e6 * limit
    );
    let relative = (1.5 / single.len() as f64).sqrt();
    let seen = limit * (1.0 + ONE_SIDED * relative);
    audit.smallest(effects::timestamp_jitter::ID, "record", "sigma", seen, "s");
    if audit.limit(
        CheckId::TimestampJitter,
        "record",
        sigma,
        limit,
        what.clone(),
    ) {
        let sigma = ("sigma", Parameter::estimated(sigma, sigma * relative, "s"));
        audit
            .findings
            .push(of_clock(effects::timestamp_jitter::ID, names, sigma, what));
    }
}

/// The course of the device clock against the host's, and the tolerance that the header states, ppm.
///
/// # Errors
/// Why the record does not tell it.
fn course(record: &Record, device: &[f64]) -> Result<(drift::Course, f64), &'static str> {
    let host = record.host_time_s.as_ref();
    let host = host
        .filter(|h| h.len() == device.len())
        .ok_or("the record holds no host time (host_time_s)")?;
    let tolerance = record.header.tick_tolerance_ppm.ok_or(
        "the header does not state the tolerance of the device clock (tick_tolerance_ppm)",
    )?;
    if device.last().copied().unwrap_or(0.0) < LEAST_SECONDS {
        return Err("the record is shorter than 30 s");
    }
    let course = drift::of(device, host, tolerance * 1e-6).ok_or("too few host times")?;
    Ok((course, tolerance))
}

fn rate(record: &Record, device: &[f64], names: &[String], audit: &mut Audit) {
    let (course, tolerance) = match course(record, device) {
        Ok(known) => known,
        Err(why) => return audit.untested(effects::clock_rate::ID, why),
    };
    if let Some((kind, what)) = &course.uneven {
        if *kind == Uneven::Wanders {
            audit.untested(effects::clock_rate::ID, what);
        } else {
            audit.limit(
                CheckId::ClockCourse,
                "record",
                course.told,
                1.0,
                what.clone(),
            );
            audit.unexplain("record", what.clone());
        }
        // Two rates are not one.
        if *kind == Uneven::Bend {
            return;
        }
    }
    let (gained, error) = (course.slope, course.error);
    // host = device / (1 + ppm)
    let ppm = (1.0 / (1.0 + gained) - 1.0) * 1e6;
    let error = error * 1e6;
    let beyond = (ppm.abs() - tolerance) / error.max(1e-6);
    let what = format!(
        "the device clock runs {ppm:+.1} +- {error:.1} ppm against the host's; {tolerance:.0} ppm are stated"
    );
    // The scatter of the block minima is estimated from some thirty of them.
    let law = StudentsT::new(0.0, 1.0, drift::BLOCKS as f64 - 2.0).ok();
    let chance = if beyond.is_nan() || beyond <= 0.0 {
        1.0
    } else if beyond.is_infinite() {
        0.0
    } else {
        law.map_or_else(|| tails::upper_normal(beyond), |t| t.sf(beyond))
    };
    if let Some(law) = law {
        // The scatter itself is known to 1.17 / sqrt(blocks) of it, here and in the run that would show the fault.
        let scatter = 1.17 * (2.0 / drift::BLOCKS as f64).sqrt();
        let limit = law.inverse_cdf(1.0 - audit_level());
        let reach = limit * (1.0 + ONE_SIDED * scatter) + ONE_SIDED;
        let seen = tolerance + reach * error;
        audit.smallest(effects::clock_rate::ID, "record", "ppm", seen, "ppm");
    }
    if audit.check(CheckId::ClockRate, "record", ppm, chance, what.clone()) {
        let ppm = ("ppm", Parameter::estimated(ppm, error, "ppm"));
        audit
            .findings
            .push(of_clock(effects::clock_rate::ID, names, ppm, what));
    }
}

/// A fault of the clock, which all channels have.
fn of_clock(
    cause: &str,
    names: &[String],
    (key, value): (&str, Parameter),
    what: String,
) -> Finding {
    Finding {
        cause: cause.into(),
        channels: names.to_vec(),
        parameters: [(key.to_owned(), value)].into(),
        what,
        ..Finding::default()
    }
}
