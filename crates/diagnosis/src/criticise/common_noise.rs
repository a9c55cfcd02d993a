//! What the axes share: correlation of their whitened residuals.

use std::collections::{BTreeMap, BTreeSet};

use model::effect::{Effect, Found, Hypothesis, Parameters};

use crate::criticise::process;
use crate::fit::{prequential, threshold};
use crate::ingest::types::Grid;
use crate::result::{Check, Consequence, DetectionLimit, Finding, Gain, limit, sentence};
use crate::search::searched::Searched;
use crate::test_level;
use crate::test_level::{CheckId, Observation, omnibus_level};
use numerics::column::{dot, dots_behind};
use numerics::tails;
use numerics::tails::ONE_SIDED;

/// Correlation in sigma that each pair has to show before a source is said to be that of all axes.
const LEAST_OF_ALL: f64 = 0.5;

/// What the axes share.
pub(crate) struct Shared {
    pub checks: Vec<Check>,
    pub finding: Option<Finding>,
    pub left: Vec<Observation>,
    /// Smallest source that would have been found, by channel.
    pub limits: Vec<DetectionLimit>,
    /// Channels that follow another one some samples later, and the chi-square of that.
    pub late: Vec<(String, f64)>,
}

/// Standard error of the mean covariance of some pairs of axes that share a source of variance `shared`: estimates of
/// two pairs with an axis in common hang together by its variance and the source.
fn error_of_mean(pairs: &[&Pair<'_>], shared: f64, samples: f64) -> f64 {
    let variance = |s: &Searched<'_>| s.state.solution.white;
    let same = |a: &Searched<'_>, b: &Searched<'_>| a.target.name == b.target.name;
    // Of jointly normal values, cov(ab, cd) = E[ac] E[bd] + E[ad] E[bc].
    let product = |a, b| if same(a, b) { variance(a) } else { shared };
    let mut sum = 0.0;
    for (a, b, ..) in pairs {
        for (c, d, ..) in pairs {
            sum += product(a, c) * product(b, d) + product(a, d) * product(b, c);
        }
    }
    (sum / samples).sqrt() / pairs.len() as f64
}

/// Whether pairs may share one source: their covariances are alike (chi-square of what they scatter by).
fn alike(pairs: &[&Pair<'_>], samples: f64) -> bool {
    if pairs.len() < 2 {
        return true;
    }
    let sigma = |s: &Searched<'_>| s.state.solution.white.sqrt();
    // Of a covariance c of two of standard deviations a and b: error^2 = (a^2 b^2 + c^2) / n.
    let each = pairs.iter().map(|p| {
        let size = sigma(p.0) * sigma(p.1);
        (p.2 * size, size * ((1.0 + p.2 * p.2) / samples).sqrt())
    });
    let each: Vec<(f64, f64)> = each.collect();
    let weights = each.iter().map(|(_, error)| error.powi(-2)).sum::<f64>();
    let mean = each.iter().map(|(c, e)| c / (e * e)).sum::<f64>() / weights;
    let statistic = each
        .iter()
        .map(|(c, e)| ((c - mean) / e).powi(2))
        .sum::<f64>();
    tails::chi_tail(statistic, (pairs.len() - 1) as f64) > test_level::CLAIM_LEVEL
}

/// Two axes, the correlation of their residuals, its chance and its score.
type Pair<'a> = (&'a Searched<'a>, &'a Searched<'a>, f64, f64, f64);

/// Correlation of the whitened residuals, axis by axis.
pub(crate) fn common<'a>(searched: &'a [Searched<'a>], grid: &Grid) -> Shared {
    let mut shared = Shared {
        checks: vec![],
        finding: None,
        left: vec![],
        limits: vec![],
        late: vec![],
    };
    let mut pairs: Vec<Pair<'_>> = vec![];
    let first = grid.n / 50;
    let read = searched.iter().map(|s| s.told().1).fold(1.0, f64::min);
    let free = read * (grid.n - first) as f64;
    for (i, a) in searched.iter().enumerate() {
        for b in &searched[i + 1..] {
            if a.target.moving || b.target.moving {
                continue;
            }
            let (x, y) = (&a.told().0[first..], &b.told().0[first..]);
            let (ab, aa, bb) = (dot(x, y), dot(x, x), dot(y, y));
            let r = ab / (aa * bb).sqrt();
            let z = r.clamp(-0.999_999, 0.999_999).atanh() * (free - 3.0).sqrt();
            let p = tails::normal_tail(z);
            pairs.push((a, b, r, p, z));
        }
    }
    // A source that all axes share shows in all pairs: their sum tells it from d' 1.7 times smaller on than any one pair.
    let joint = pairs.iter().map(|p| p.4).sum::<f64>() / (pairs.len().max(1) as f64).sqrt();
    let together = pairs.len() > 1
        && tails::normal_tail(joint) < 2.0 * threshold::false_alarm()
        && joint > 0.0
        && pairs.iter().all(|p| p.4 > LEAST_OF_ALL);
    let mut fails: Vec<&Pair<'_>> = pairs
        .iter()
        .filter(|p| together || p.3 < omnibus_level())
        .collect();
    if !alike(&fails, free) {
        fails.retain(|p| p.3 < omnibus_level());
    }
    let effect_of = |asked: fn(&Hypothesis) -> bool| {
        let mut all = searched.iter().flat_map(|s| &s.search.candidates);
        all.find(|c| asked(&c.hypothesis)).map(|c| c.effect)
    };
    let of = effect_of(|h| matches!(h, Hypothesis::Common));
    if let Some(of) = of.filter(|_| !pairs.is_empty()) {
        shared.limits = smallest(&pairs, of, free);
    }
    // A shared source correlates positively; where more than one pair shows it, all of its pairs are counted.
    let positive = !fails.is_empty() && fails.iter().all(|p| p.2 > 0.0) && alike(&fails, free);
    let mut straight = true;
    for (a, b, r, ..) in &fails {
        let samples = (grid.n - first) as f64;
        let claim = process::straight(&a.e, &b.e, -samples * (1.0 - r * r).ln(), fails.len());
        let channel = format!("{}, {}", a.target.name, b.target.name);
        let doubted = claim.p_value < test_level::CLAIM_LEVEL;
        straight &= !doubted;
        shared.checks.push(Check {
            id: claim.id.into(),
            about: vec![],
            channel,
            statistic: claim.statistic,
            p_value: Some(claim.p_value),
            threshold: test_level::CLAIM_LEVEL,
            fails_before: false,
            fails_after: doubted,
            what: claim.what.clone(),
        });
        if doubted {
            let what = format!("with {}, {}", b.target.name, claim.what);
            let seen = Observation::of_coupling(&a.target.name, what, *r);
            shared.left.push(seen.by(claim.id, claim.p_value));
        }
    }
    if let (Some(of), true) = (of, positive && straight) {
        let names: Vec<String> = searched
            .iter()
            .map(|s| s.target.name.clone())
            .filter(|n| {
                fails
                    .iter()
                    .any(|p| p.0.target.name == *n || p.1.target.name == *n)
            })
            .collect();
        let sigma = |s: &Searched<'_>| s.state.solution.white.sqrt();
        let shares: Vec<f64> = fails
            .iter()
            .map(|p| p.2 * sigma(p.0) * sigma(p.1))
            .collect();
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        let error = error_of_mean(&fails, mean, free);
        let found = Found {
            unit: searched[0].target.unit.clone(),
            coefficients: vec![(mean.sqrt(), error / (2.0 * mean.sqrt()))],
            ..Found::default()
        };
        let parameters = of.describe(&found);
        let of_all: Vec<&[f64]> = searched
            .iter()
            .filter(|s| names.contains(&s.target.name))
            .map(|s| s.e.as_slice())
            .collect();
        let (nats, std_error) = prequential::of_correlation(&of_all);
        let ratio = fails
            .iter()
            .map(|p| -(read * grid.n as f64) * (1.0 - p.2 * p.2).ln())
            .sum::<f64>();
        shared.finding = Some(Finding {
            cause: of.id().into(),
            what: sentence(of.docs().title, &names.join(", "), &parameters),
            channels: names,
            parameters,
            likelihood_ratio: Some(ratio),
            confirmed_on_held_out_data: Some(nats > 0.0),
            gain: Some(Gain {
                held_out_log_score_nats: Some(nats),
                std_error: Some(std_error),
                // One size for all of them.
                delta_bic: Some(ratio - (grid.n as f64).ln()),
                ablation_nats: Some(0.5 * ratio),
                ..Gain::default()
            }),
            ..Finding::default()
        });
    }
    if shared.finding.is_none() && straight {
        let of = effect_of(|h| matches!(h, Hypothesis::Correlation));
        let failing: Vec<&Pair<'_>> = pairs.iter().filter(|p| p.3 < omnibus_level()).collect();
        shared.finding = of.and_then(|of| correlated(&failing, of, free));
    }
    for (a, b, r, p, _) in &pairs {
        let fails = *p < omnibus_level();
        let explained = shared.finding.is_some();
        shared.checks.push(Check {
            id: CheckId::CrossCorrelation.into(),
            about: vec![],
            channel: format!("{}, {}", a.target.name, b.target.name),
            statistic: *r,
            p_value: Some(*p),
            threshold: omnibus_level(),
            fails_before: fails,
            fails_after: fails && !explained,
            what: "correlation of the whitened residuals of two axes".into(),
        });
        if fails && !explained {
            let other = &b.target.name;
            let what = format!("correlates with {other} ({r:.3}) sample by sample");
            let seen = Observation::of_coupling(&a.target.name, what, *r);
            let seen = seen.by(CheckId::CrossCorrelation, *p);
            shared.left.push(seen.following(other));
        }
    }
    for (i, a) in searched.iter().enumerate() {
        for b in &searched[i + 1..] {
            let still = !(a.target.moving || b.target.moving || a.search.view.sways());
            if still {
                late(a, b, &mut shared);
            }
        }
    }
    shared
}

/// Noise that some pairs of axes share, each its part: stated on the later axis of each pair.
fn correlated(pairs: &[&Pair<'_>], of: &dyn Effect, free: f64) -> Option<Finding> {
    let named = |other: &str| {
        let with = |name: &&&str| name.strip_prefix("with_") == Some(other);
        of.parameters().iter().map(|p| &p.name).find(with).copied()
    };
    let mut per_channel: BTreeMap<String, Parameters> = BTreeMap::new();
    for (a, b, r, ..) in pairs {
        let found = Found {
            names: vec![named(&a.target.name)?],
            coefficients: vec![(*r, (1.0 - r * r) / free.sqrt())],
            ..Found::default()
        };
        let own = per_channel.entry(b.target.name.clone()).or_default();
        own.extend(of.describe(&found));
    }
    let (first, parameters) = per_channel.first_key_value()?;
    let all = pairs
        .iter()
        .flat_map(|p| [&p.0.target.name, &p.1.target.name]);
    let channels: BTreeSet<&String> = all.collect();
    let log = |p: &&Pair<'_>| -free * (1.0 - p.2 * p.2).ln();
    let ratio = pairs.iter().map(log).sum::<f64>();
    let largest = pairs.iter().map(|p| p.2.abs()).fold(0.0, f64::max);
    let mut axes: Vec<(&str, &[f64])> = vec![];
    for s in pairs.iter().flat_map(|p| [p.0, p.1]) {
        if axes.iter().all(|a| a.0 != s.target.name) {
            axes.push((&s.target.name, &s.e));
        }
    }
    let axes: Vec<&[f64]> = axes.into_iter().map(|a| a.1).collect();
    let (nats, std_error) = prequential::of_correlation(&axes);
    Some(Finding {
        cause: of.id().into(),
        what: sentence(of.docs().title, first, parameters),
        channels: channels.into_iter().cloned().collect(),
        parameters: parameters.clone(),
        per_channel,
        likelihood_ratio: Some(ratio),
        consequence: Some(Consequence::of_correlation(largest)),
        confirmed_on_held_out_data: Some(nats > 0.0),
        gain: Some(Gain {
            held_out_log_score_nats: Some(nats),
            std_error: Some(std_error),
            delta_bic: Some(ratio - pairs.len() as f64 * free.ln()),
            ablation_nats: Some(0.5 * ratio),
            ..Gain::default()
        }),
        ..Finding::default()
    })
}

/// The size from which on a source that all axes share is found 95 times in 100.
fn smallest(pairs: &[Pair<'_>], of: &dyn Effect, samples: f64) -> Vec<DetectionLimit> {
    // z of each pair by the variance of the source.
    let z = |p: &Pair<'_>| (samples / (p.0.state.solution.white * p.1.state.solution.white)).sqrt();
    let count = pairs.len() as f64;
    let joint = pairs.iter().map(z).sum::<f64>() / count.sqrt();
    let weakest = pairs.iter().map(z).fold(f64::INFINITY, f64::min);
    let reach = |chance: f64| numerics::tails::farthest(1, chance) + ONE_SIDED;
    let variance = if pairs.len() > 1 {
        (reach(2.0 * threshold::false_alarm()) / joint).max((LEAST_OF_ALL + ONE_SIDED) / weakest)
    } else {
        reach(omnibus_level()) / joint
    };
    let mut names: Vec<&str> = vec![];
    for s in pairs.iter().flat_map(|p| [p.0, p.1]) {
        if !names.contains(&s.target.name.as_str()) {
            names.push(&s.target.name);
        }
    }
    let found = Found {
        unit: pairs[0].0.target.unit.clone(),
        coefficients: vec![(variance.sqrt(), f64::NAN)],
        ..Found::default()
    };
    let described = of.describe(&found);
    let each = names.iter();
    each.filter_map(|name| limit(of.id(), name, &described, "sigma", &[]))
        .collect()
}

/// Samples by which one axis may follow another.
const LATE: usize = 20;

/// Correlation of the residuals of two axes, one of them some samples later.
fn late(a: &Searched<'_>, b: &Searched<'_>, shared: &mut Shared) {
    let power = |e: &[f64]| dot(e, e) / e.len() as f64;
    let scale = (power(&a.e) * power(&b.e)).sqrt();
    // An axis, the one that follows it, the samples, z.
    let mut worst = (a, b, 0, 0.0f64);
    let mut statistic = 0.0;
    let lags = LATE.min(a.e.len() / 2);
    let sums = [(a, b), (b, a)].map(|(first, second)| dots_behind(&first.e, &second.e, lags));
    for lag in 1..=lags {
        for ((first, second), sums) in [(a, b), (b, a)].into_iter().zip(&sums) {
            let sum = sums[lag - 1];
            let z = sum / (scale * ((first.e.len() - lag) as f64).sqrt());
            statistic += z * z;
            if z.abs() > worst.3.abs() {
                worst = (first, second, lag, z);
            }
        }
    }
    let p = tails::chi_tail(statistic, 2.0 * LATE as f64);
    let (first, second, lag, z) = worst;
    let r = z / (a.e.len() as f64).sqrt();
    let what = format!(
        "follows {} by {lag} samples ({r:+.3} of its residual)",
        first.target.name
    );
    let fails = p < omnibus_level();
    shared.checks.push(Check {
        id: CheckId::CrossCorrelationLate.into(), about: vec![],
        channel: format!("{}, {}", a.target.name, b.target.name),
        statistic,
        p_value: Some(p),
        threshold: omnibus_level(),
        fails_before: fails,
        fails_after: fails,
        what: format!("correlation of the whitened residuals of two axes over {LATE} samples either way: {} {what}", second.target.name),
    });
    if fails {
        shared.late.push((second.target.name.clone(), statistic));
        let seen = Observation::of_coupling(&second.target.name, what, r);
        let seen = seen.by(CheckId::CrossCorrelationLate, p);
        shared.left.push(seen.following(&first.target.name));
    }
}
