//! Readings end at a rail: the tail that should lie beyond the extreme readings is missing, and lies on them.
//!
//! Under N(L, sigma^2) about what the neighbours predict, the number of readings beyond the largest one has an
//! expectation E that is exponential(1) where nothing is clipped, and e readings are expected on the largest code.
//! Clipped ones pile up there: n against e. Both are asked for, so that noise with light tails (a strong line, two
//! levels), which also ends early, is not taken for a rail.

use model::Parameter;
use statrs::distribution::{ContinuousCDF, Normal};

use super::bits::Shape;
use super::{Audit, FALSE_ALARM, Gyro, tails};
use crate::audit::local::Levels;
use crate::result::Finding;

/// Chance of the pile on the last code that light tails may have.
const PILE: f64 = 1e-2;

/// One end.
struct End {
    code: i32,
    /// Expected beyond the code.
    beyond: f64,
    /// Readings on the code.
    pile: u64,
    /// Expected on the code.
    expected: f64,
}

impl End {
    fn chance(&self) -> f64 {
        (-self.beyond).exp()
    }

    fn clips(&self) -> bool {
        self.chance() < FALSE_ALARM / 2.0 && tails::at_least(self.pile, self.expected) < PILE
    }
}

/// The upper end of counts with predictions `levels`.
fn end(
    counts: impl Iterator<Item = i32> + Clone,
    levels: impl Iterator<Item = (f64, f64)>,
    sigma: f64,
) -> Option<End> {
    let code = counts.clone().max()?;
    let normal = Normal::standard();
    let above = |edge: f64, level: f64| normal.sf((edge - level) / sigma);
    let edge = f64::from(code);
    let (mut beyond, mut reached) = (0.0, 0.0);
    for (level, readings) in levels {
        beyond += readings * above(edge + 0.5, level);
        reached += readings * above(edge - 0.5, level);
    }
    Some(End {
        code,
        beyond,
        pile: counts.filter(|c| *c == code).count() as u64,
        expected: reached - beyond,
    })
}

pub(super) fn audit(g: &Gyro<'_>, shape: Shape, audit: &mut Audit) {
    let Some(counts) = g.counts else {
        return;
    };
    let local = &g.local;
    let name = g.channel.name.as_str();
    // A coarse step leaves empty codes beyond the last one and piles on it, a bit that sticks does at its edges, and
    // what has holes inside its range does not end at a rail: those findings stand.
    if local.sigma <= 0.0 || shape == Shape::Other {
        return;
    }
    let known: Vec<bool> = (0..counts.len()).map(|i| g.known(i)).collect();
    let seen = counts
        .iter()
        .zip(&known)
        .filter(|(_, k)| **k)
        .map(|(c, _)| *c);
    let levels = Levels::new(&local.level, &known);
    let sigma = local.unrounded_sigma();
    let high = end(seen.clone(), levels.iter(), sigma);
    let low = end(seen.map(|c| -c), levels.iter().map(|(l, w)| (-l, w)), sigma);
    let (Some(low), Some(high)) = (low, high) else {
        return;
    };
    let both = low.beyond + high.beyond;
    let chance = (1.0 + both) * (-both).exp();
    let piled = low.clips() || high.clips();
    let what = format!(
        "{:.0} readings of {name} are missing above {} counts and {:.0} below {}; {} and {} lie on these codes, where {:.1} and {:.1} are expected",
        high.beyond,
        high.code,
        low.beyond,
        -low.code,
        high.pile,
        low.pile,
        high.expected,
        low.expected
    );
    audit.check(
        "missing_tail",
        name,
        both,
        if piled {
            chance.min(FALSE_ALARM / 2.0)
        } else {
            1.0
        },
        what.clone(),
    );
    if !piled {
        return;
    }
    let clips = [
        (low.clips(), "low", -low.code, &low),
        (high.clips(), "high", high.code, &high),
    ];
    let mut finding = Finding {
        cause: "saturation".into(),
        channels: vec![name.into()],
        what,
        ..Finding::default()
    };
    let mut clipped = 0.0;
    for (_, key, code, end) in clips.into_iter().filter(|c| c.0) {
        finding
            .parameters
            .insert(key.into(), Parameter::exact(f64::from(code), "counts"));
        clipped += (end.pile as f64 - end.expected).max(0.0);
    }
    let error = (low.pile + high.pile) as f64;
    finding.parameters.insert(
        "clipped".into(),
        Parameter::estimated(clipped.round(), error.sqrt(), "1"),
    );
    audit.findings.push(finding);
    audit.suppress(
        &["stuck_bit", "stale_samples", "kurtosis", "skewness"],
        name,
        "saturation",
    );
}
