//! Clocks: how evenly the board samples, and how fast its clock runs against the host's.

use model::Parameter;
use model::record::Record;

use super::{Audit, Gyro, tails};
use crate::audit::local::{median, width};
use crate::result::Finding;

/// Jitter of a sound board, rounding to ticks included, is about 36 us; beyond this it is a fault.
const JITTER_LIMIT_S: f64 = 70e-6;
/// Share of the intervals on either side that the jitter leaves out.
const SHARE: f64 = 0.01;
/// Quantile of the standard normal at `SHARE`.
const QUANTILE: f64 = 2.326_348;
/// Blocks in which the earliest arrival is taken.
const BLOCKS: usize = 32;
/// Least length for a slope, s.
const LEAST_SECONDS: f64 = 30.0;

pub(super) fn audit(record: &Record, gyros: &[Gyro<'_>], at: &[f64], audit: &mut Audit) {
    let rows = at.len();
    let ticks = record.t_ticks.as_ref().filter(|t| t.len() == rows);
    let (Some(ticks), Some(tick_s)) = (ticks, record.header.tick_s) else {
        let why = "the record holds no device time (t_ticks, and tick_s in its header)";
        audit.untested("timestamp_jitter", why);
        audit.untested("clock_rate", why);
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
    // Lost frames are another matter.
    let single: Vec<f64> = single
        .into_iter()
        .filter(|d| (d - period).abs() < 0.5 * period)
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
    if audit.limit("timestamp_jitter", "record", sigma, limit, what.clone()) {
        let error = sigma * (1.5 / single.len() as f64).sqrt();
        audit.findings.push(Finding {
            cause: "timestamp_jitter".into(),
            channels: names.to_vec(),
            parameters: [("sigma".to_owned(), Parameter::estimated(sigma, error, "s"))].into(),
            what,
            ..Finding::default()
        });
    }
}

/// Least squares line: slope and its standard error.
fn slope(x: &[f64], y: &[f64]) -> (f64, f64) {
    let n = x.len() as f64;
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let sxx: f64 = x.iter().map(|v| (v - mx).powi(2)).sum();
    let sxy: f64 = x.iter().zip(y).map(|(a, b)| (a - mx) * (b - my)).sum();
    let b = sxy / sxx;
    let rss: f64 = x
        .iter()
        .zip(y)
        .map(|(a, v)| (v - my - b * (a - mx)).powi(2))
        .sum();
    (b, (rss / (n - 2.0).max(1.0) / sxx).sqrt())
}

/// Slope of host time against device time by the earliest arrival of each block: a message can be late, not early.
fn host_slope(device: &[f64], host: &[f64]) -> Option<(f64, f64)> {
    let n = device.len();
    let late: Vec<f64> = host.iter().zip(device).map(|(h, d)| h - d).collect();
    let pairs: Vec<(f64, f64)> = (0..n)
        .filter(|i| late[*i].is_finite())
        .map(|i| (device[i], late[i]))
        .collect();
    if pairs.len() < 4 * BLOCKS {
        return None;
    }
    // Rough slope first, so that the earliest of a block is not simply its last.
    let half = pairs.len() / 2;
    let middle = |p: &[(f64, f64)]| {
        (
            median(&p.iter().map(|v| v.0).collect::<Vec<_>>()),
            median(&p.iter().map(|v| v.1).collect::<Vec<_>>()),
        )
    };
    let (a, b) = (middle(&pairs[..half]), middle(&pairs[half..]));
    let rough = (b.1 - a.1) / (b.0 - a.0);
    let size = pairs.len().div_ceil(BLOCKS);
    let (x, y): (Vec<f64>, Vec<f64>) = pairs
        .chunks(size)
        .filter_map(|c| {
            c.iter()
                .map(|(d, l)| (*d, l - rough * d))
                .min_by(|p, q| p.1.total_cmp(&q.1))
        })
        .unzip();
    let (mut x, mut y) = (x, y);
    let mut fit = slope(&x, &y);
    // Blocks that the host slept through.
    for _ in 0..3 {
        let level = median(
            &y.iter()
                .zip(&x)
                .map(|(v, t)| v - fit.0 * t)
                .collect::<Vec<_>>(),
        );
        let r: Vec<f64> = y
            .iter()
            .zip(&x)
            .map(|(v, t)| v - fit.0 * t - level)
            .collect();
        let spread = median(&r.iter().map(|v| v.abs()).collect::<Vec<_>>()) * 1.4826;
        let keep: Vec<bool> = r.iter().map(|v| v.abs() <= 5.0 * spread + 1e-9).collect();
        if keep.iter().all(|k| *k) || keep.iter().filter(|k| **k).count() < BLOCKS / 2 {
            break;
        }
        let mut k = keep.iter();
        x.retain(|_| k.next() == Some(&true));
        let mut k = keep.iter();
        y.retain(|_| k.next() == Some(&true));
        fit = slope(&x, &y);
    }
    Some((rough + fit.0, fit.1))
}

fn rate(record: &Record, device: &[f64], names: &[String], audit: &mut Audit) {
    let host = record
        .host_time_s
        .as_ref()
        .filter(|h| h.len() == device.len());
    let Some(host) = host else {
        audit.untested("clock_rate", "the record holds no host time (host_time_s)");
        return;
    };
    let Some(tolerance) = record.header.tick_tolerance_ppm else {
        audit.untested(
            "clock_rate",
            "the header does not state the tolerance of the device clock (tick_tolerance_ppm)",
        );
        return;
    };
    if device.last().copied().unwrap_or(0.0) < LEAST_SECONDS {
        audit.untested("clock_rate", "the record is shorter than 30 s");
        return;
    }
    let slope =
        host_slope(device, host).filter(|(gained, error)| gained.is_finite() && error.is_finite());
    let Some((gained, error)) = slope else {
        audit.untested("clock_rate", "too few host times");
        return;
    };
    // host = device / (1 + ppm)
    let ppm = (1.0 / (1.0 + gained) - 1.0) * 1e6;
    let error = error * 1e6;
    let beyond = (ppm.abs() - tolerance) / error.max(1e-6);
    let what = format!(
        "the device clock runs {ppm:+.1} +- {error:.1} ppm against the host's; {tolerance:.0} ppm are stated"
    );
    // The scatter of the block minima is estimated from some thirty of them.
    let chance = if beyond.is_nan() || beyond <= 0.0 {
        1.0
    } else if beyond.is_infinite() {
        0.0
    } else {
        statrs::distribution::StudentsT::new(0.0, 1.0, BLOCKS as f64 - 2.0).map_or_else(
            |_| tails::upper_normal(beyond),
            |t| statrs::distribution::ContinuousCDF::sf(&t, beyond),
        )
    };
    if audit.check("clock_rate", "record", ppm, chance, what.clone()) {
        audit.findings.push(Finding {
            cause: "clock_rate".into(),
            channels: names.to_vec(),
            parameters: [("ppm".to_owned(), Parameter::estimated(ppm, error, "ppm"))].into(),
            what,
            ..Finding::default()
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_messages_do_not_tilt_the_clock() {
        // 100 ppm fast, delays of 1 ms to 0.5 s by turns, longer at the end.
        let device: Vec<f64> = (0..12_000).map(|i| f64::from(i) * 0.05).collect();
        let host: Vec<f64> = device
            .iter()
            .enumerate()
            .map(|(i, d)| {
                let turn = (i * 7919 % 101) as f64 / 101.0;
                d / (1.0 + 100e-6) + 0.001 + turn * (0.01 + 0.5 * d / 600.0)
            })
            .collect();
        let (gained, error) = host_slope(&device, &host).unwrap();
        let ppm = (1.0 / (1.0 + gained) - 1.0) * 1e6;
        assert!(
            (ppm - 100.0).abs() < 5.0 + 4.0 * error * 1e6,
            "{ppm} +- {}",
            error * 1e6
        );
    }
}
