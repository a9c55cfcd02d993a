//! Single readings that the noise cannot have made.
//!
//! Residual against the neighbourhood over its local spread, beyond the distance that one of n normal samples reaches
//! with the chance of a false alarm. It does not need to know the noise; the whitened residual of the search sees a
//! little farther where the base is at rest.

use super::{Audit, FALSE_ALARM, Gyro, counted, tails};

/// Two farther than this apart are single ones.
const ALONE: usize = 2;

/// Where the base moves the prediction errs by the motion too, in its bends more than elsewhere.
const MOVING: f64 = 1.3;

pub(super) fn audit(g: &Gyro<'_>, at: &[f64], audit: &mut Audit) {
    let name = g.channel.name.as_str();
    let n = g.local.residual.len();
    if n < super::LEAST_READINGS || g.local.sigma <= 0.0 {
        return;
    }
    let step = g.channel.lsb.unwrap_or(0.0);
    let limit = tails::farthest(n, FALSE_ALARM) * if g.local.bent { MOVING } else { 1.0 };
    // Where the noise is within a count, a residual of one or two counts is rounding.
    let z: Vec<f64> = g
        .local
        .residual
        .iter()
        .zip(g.local.spread())
        .map(|(r, s)| ((r.abs() - 0.5 * step).max(0.0)) / s.max(0.3 * step))
        .enumerate()
        .map(|(i, z)| {
            let inside = i >= g.local.edge && i + g.local.edge < n;
            if inside { z } else { 0.0 }
        })
        .collect();
    let far: Vec<usize> = (0..n).filter(|i| z[*i] > limit).collect();
    let single: Vec<usize> = far
        .iter()
        .copied()
        .filter(|i| !far.iter().any(|j| j != i && j.abs_diff(*i) <= ALONE))
        .collect();
    let most = z
        .iter()
        .copied()
        .filter(|v| v.is_finite())
        .fold(0.0, f64::max);
    let chance = if g.local.bent && most < limit {
        1.0
    } else {
        (n as f64 * tails::two_sided(most)).min(1.0)
    };
    let what = format!(
        "{} readings of {name} lie more than {limit:.1} sigma from their neighbours, the farthest {most:.1}",
        single.len()
    );
    let fails = audit.check("outliers", name, most, chance, what.clone());
    // A base that is knocked, or noise with heavy tails, makes runs and crowds, no single readings.
    if !fails || single.is_empty() || audit.is_suppressed("outliers", name) {
        return;
    }
    let times: Vec<f64> = single.iter().map(|i| at[*i]).collect();
    single.iter().for_each(|i| audit.mask(name, *i));
    audit.findings.push(counted(
        "outliers",
        vec![name.to_owned()],
        single.len() as f64,
        None,
        &times,
        what,
    ));
}
