//! Readings end at a rail: the tail that should lie beyond the extreme readings is missing, and lies on them.
//!
//! Under N(L, sigma^2) about what the neighbours predict, the number of readings beyond the largest one has an
//! expectation E that is exponential(1) where nothing is clipped, and e readings are expected on the largest code.
//! Clipped ones pile up there: n against e. Both are asked for, so that noise with light tails (a strong line, two
//! levels), which also ends early, is not taken for a rail.

use model::Parameter;
use model::effects;
use statrs::distribution::{ContinuousCDF, Normal};

use super::bits::Shape;
use super::{Audit, Gyro};
use crate::audit::local::Levels;
use crate::result::Finding;
use crate::test_level::{CheckId, audit_level};
use numerics::tails;

/// Chance of the pile on the last code that light tails may have.
const PILE: f64 = 1e-2;

/// Share of the variance by which rails, that let more or less of it pass as the level moves, make it swing enough to be
/// seen.
const SWINGS: f64 = 0.05;
/// Share of the readings on either side that such a swing leaves out.
const RARE: f64 = 0.02;

/// Variance that rails leave of a normal reading about a level, over its own.
fn left_by([low, high]: [f64; 2], level: f64, sigma: f64) -> f64 {
    let normal = Normal::standard();
    let (a, b) = ((low - level) / sigma, (high - level) / sigma);
    let (below, above) = (normal.cdf(a), normal.sf(b));
    // Mean and mean square of max(a, min(z, b)).
    let at = |x: f64, p: f64| if p > 0.0 { x * p } else { 0.0 };
    let density = |x: f64| (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt();
    let edge = |x: f64| if x.is_finite() { x * density(x) } else { 0.0 };
    let mean = at(a, below) + at(b, above) + density(a) - density(b);
    let inside = 1.0 - below - above;
    let square = at(a * a, below) + at(b * b, above) + inside + edge(a) - edge(b);
    (square - mean * mean).max(0.0)
}

/// Width between the rare ends of values with weights.
fn swing(values: impl Iterator<Item = (f64, f64)>) -> f64 {
    let mut all: Vec<(f64, f64)> = values.collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let weight: f64 = all.iter().map(|v| v.1).sum();
    let at = |share: f64| {
        let mut sum = 0.0;
        let reached = |v: &&(f64, f64)| {
            sum += v.1;
            sum >= share * weight
        };
        all.iter().find(reached).map_or(f64::NAN, |v| v.0)
    };
    at(1.0 - RARE) - at(RARE)
}

/// Readings that have to be missing beyond one of both ends: the chance of so many is exp(-them).
fn least_beyond() -> f64 {
    (2.0 / audit_level()).ln()
}

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
    fn clips(&self) -> bool {
        self.beyond > least_beyond() && tails::at_least(self.pile, self.expected) < PILE
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

/// Both ends of the counts of a gyro.
struct Ends {
    low: End,
    high: End,
}

impl Ends {
    /// What is expected and seen at both.
    fn words(&self, name: &str) -> String {
        let Self { low, high } = self;
        format!(
            "{:.0} readings of {name} are missing above {} counts and {:.0} below {}; {} and {} lie on these codes, where {:.1} and {:.1} are expected",
            high.beyond,
            high.code,
            low.beyond,
            -low.code,
            high.pile,
            low.pile,
            high.expected,
            low.expected
        )
    }

    /// The finding: the rails that were reached, and the readings clipped.
    fn finding(&self, name: &str, what: String) -> Finding {
        let Self { low, high } = self;
        let clips = [
            (low.clips(), "low", -low.code, low),
            (high.clips(), "high", high.code, high),
        ];
        let mut finding = Finding {
            cause: effects::saturation::ID.into(),
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
        // A rail that was not reached is not known: absent, not 0.
        let unknown = match (low.clips(), high.clips()) {
            (true, false) => "; the upper rail was not reached, so it is not known",
            (false, true) => "; the lower rail was not reached, so it is not known",
            _ => "",
        };
        finding.what.push_str(unknown);
        finding
    }

    /// The rails, counts; infinite where one was not reached.
    fn rails(&self) -> [f64; 2] {
        let rail = |e: &End, sign: i32| e.clips().then(|| f64::from(sign * e.code));
        [
            rail(&self.low, -1).unwrap_or(f64::NEG_INFINITY),
            rail(&self.high, 1).unwrap_or(f64::INFINITY),
        ]
    }
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
    let ends = Ends { low, high };
    let both = ends.low.beyond + ends.high.beyond;
    let chance = (1.0 + both) * (-both).exp();
    let piled = ends.low.clips() || ends.high.clips();
    let least = least_beyond().ceil();
    audit.smallest(effects::saturation::ID, name, "clipped", least, "1");
    let what = ends.words(name);
    let chance = if piled {
        chance.min(audit_level() / 2.0)
    } else {
        1.0
    };
    audit.check(CheckId::MissingTail, name, both, chance, what.clone());
    if piled {
        audit.findings.push(ends.finding(name, what));
        let rails = ends.rails();
        let kept = levels.iter().map(|(l, n)| (left_by(rails, l, sigma), n));
        at_fault(name, swing(kept) > SWINGS, audit);
    }
}

/// What rails explain of a channel; and where what they leave of the noise `swings` with the level, that too.
fn at_fault(name: &str, swings: bool, audit: &mut Audit) {
    let mut explained = vec![
        effects::stuck_bit::ID,
        effects::stale_samples::ID,
        CheckId::Kurtosis.as_str(),
        CheckId::Skewness.as_str(),
        CheckId::ColourFollows.as_str(),
        CheckId::Leaning.as_str(),
    ];
    audit.suppress(&explained, name, effects::saturation::ID);
    if swings {
        // The noise that is left depends on the level, so it changes with it, and the level itself is bent.
        audit.converter_at_fault(name, effects::saturation::ID);
        explained = vec![
            effects::outliers::ID,
            CheckId::ProcessLaw.as_str(),
            CheckId::ProcessLevels.as_str(),
        ];
        audit.suppress(&explained, name, effects::saturation::ID);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::white;

    #[test]
    fn rails_leave_the_variance_that_is_measured() {
        let z = white(200_000, 11);
        for (rails, level, sigma) in [
            ([-20.0, -2.0], -8.0, 5.0),
            ([f64::NEG_INFINITY, 3.0], 1.0, 4.0),
            ([-9.0, f64::INFINITY], -2.0, 6.0),
            ([f64::NEG_INFINITY, f64::INFINITY], 4.0, 2.0),
        ] {
            let y: Vec<f64> = z
                .iter()
                .map(|z| (level + sigma * z).clamp(rails[0], rails[1]))
                .collect();
            let mean = y.iter().sum::<f64>() / y.len() as f64;
            let own = y.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / y.len() as f64;
            let law = left_by(rails, level, sigma) * sigma * sigma;
            // 0.3 % standard error of a variance.
            assert!((own / law - 1.0).abs() < 0.015, "{rails:?}: {own} {law}");
        }
    }
}
