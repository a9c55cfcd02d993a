//! What the axes share: correlation of their whitened residuals.

use std::collections::{BTreeMap, BTreeSet};

use model::effect::{Effect, Found, Hypothesis, Parameters};
use model::effects::{common_noise, correlated_noise};

use crate::criticise::process;
use crate::fit::{prequential, threshold};
use crate::ingest::types::Grid;
use crate::result::{
    Alternative, Check, Consequence, DetectionLimit, Finding, Gain, limit, sentence,
};
use crate::search::searched::Searched;
use crate::test_level;
use crate::test_level::{CheckId, Observation, omnibus_level};
use numerics::column::{dot, dots_behind};
use numerics::tails;
use numerics::tails::ONE_SIDED;

/// Correlation in sigma that each pair has to show before a source is said to be that of all axes.
const LEAST_OF_ALL: f64 = 0.5;

/// An axis that follows another one some samples later.
pub(crate) struct Late {
    pub first: String,
    pub second: String,
    /// Of the correlation of their residuals.
    pub chi_square: f64,
}

/// What the axes share.
#[derive(Default)]
pub(crate) struct Shared {
    pub checks: Vec<Check>,
    pub finding: Option<Finding>,
    pub left: Vec<Observation>,
    /// Smallest source that would have been found, by channel.
    pub limits: Vec<DetectionLimit>,
    /// Channels that follow another one some samples later.
    pub late: Vec<Late>,
}

/// Standard error of the mean covariance of some pairs of axes that share a source of variance `shared`: estimates of
/// two pairs with an axis in common hang together by its variance and the source.
fn error_of_mean(pairs: &[Pair<'_>], shared: f64, samples: f64) -> f64 {
    let variance = |s: &Searched<'_>| s.state.solution.white;
    let same = |a: &Searched<'_>, b: &Searched<'_>| a.target.name == b.target.name;
    // Of jointly normal values, cov(ab, cd) = E[ac] E[bd] + E[ad] E[bc].
    let product = |a, b| if same(a, b) { variance(a) } else { shared };
    let mut sum = 0.0;
    let axes = || pairs.iter().map(|p| (p.first, p.second));
    for (a, b) in axes() {
        for (c, d) in axes() {
            sum += product(a, c) * product(b, d) + product(a, d) * product(b, c);
        }
    }
    (sum / samples).sqrt() / pairs.len() as f64
}

/// Two axes and what their whitened residuals share.
struct Pair<'a> {
    first: &'a Searched<'a>,
    second: &'a Searched<'a>,
    /// Correlation of the residuals.
    correlation: f64,
    /// The same by its standard error, and the chance of more.
    z: f64,
    p_value: f64,
}

impl Pair<'_> {
    /// Covariance of the white noises, (unit of the channels)^2.
    fn covariance(&self) -> f64 {
        let sigma = |s: &Searched<'_>| s.state.solution.white.sqrt();
        self.correlation * sigma(self.first) * sigma(self.second)
    }

    fn names(&self) -> [&String; 2] {
        [&self.first.target.name, &self.second.target.name]
    }

    fn fails(&self) -> bool {
        self.p_value < omnibus_level()
    }
}

/// How axes share their noise.
enum Sharing<'a, 'p> {
    /// One source, the same on every axis that is compared: all pairs have one covariance.
    Common(&'p [Pair<'a>]),
    /// Pairs with correlations of their own.
    Correlated(Vec<&'p Pair<'a>>),
}

/// Pairs of axes that do not move, by samples from `first` on that tell as much as `free` independent ones.
fn pairs_of<'a>(searched: &'a [Searched<'a>], first: usize, free: f64) -> Vec<Pair<'a>> {
    let mut pairs = vec![];
    for (i, a) in searched.iter().enumerate() {
        for b in &searched[i + 1..] {
            if a.target.moving || b.target.moving {
                continue;
            }
            let (x, y) = (&a.told().0[first..], &b.told().0[first..]);
            let correlation = dot(x, y) / (dot(x, x) * dot(y, y)).sqrt();
            let z = correlation.clamp(-0.999_999, 0.999_999).atanh() * (free - 3.0).sqrt();
            pairs.push(Pair {
                first: a,
                second: b,
                correlation,
                z,
                p_value: tails::normal_tail(z),
            });
        }
    }
    pairs
}

/// Whether pairs may have one covariance: chi-square of what theirs scatter by.
fn alike(pairs: &[Pair<'_>], samples: f64) -> bool {
    // Of a covariance c of two of standard deviations a and b: error^2 = (a^2 b^2 + c^2) / n.
    let error = |p: &Pair<'_>| {
        let white = |s: &Searched<'_>| s.state.solution.white;
        (white(p.first) * white(p.second) * (1.0 + p.correlation.powi(2)) / samples).sqrt()
    };
    let each: Vec<(f64, f64)> = pairs.iter().map(|p| (p.covariance(), error(p))).collect();
    let weights = each.iter().map(|(_, error)| error.powi(-2)).sum::<f64>();
    let mean = each.iter().map(|(c, e)| c / (e * e)).sum::<f64>() / weights;
    let scatter = each.iter().map(|(c, e)| ((c - mean) / e).powi(2));
    let statistic = scatter.sum::<f64>();
    pairs.len() < 2
        || tails::chi_tail(statistic, (pairs.len() - 1) as f64) > test_level::CLAIM_LEVEL
}

/// How the pairs share, `None` where they do not. A source that all axes share shows in all pairs: their sum tells it from
/// d' 1.7 times smaller on than any one pair.
fn sharing<'a, 'p>(pairs: &'p [Pair<'a>], free: f64) -> Option<Sharing<'a, 'p>> {
    let failing: Vec<&Pair<'a>> = pairs.iter().filter(|p| p.fails()).collect();
    let joint = pairs.iter().map(|p| p.z).sum::<f64>() / (pairs.len().max(1) as f64).sqrt();
    let together = pairs.len() > 1
        && tails::normal_tail(joint) < 2.0 * threshold::false_alarm()
        && pairs.iter().all(|p| p.z > LEAST_OF_ALL);
    if (together || !failing.is_empty()) && joint > 0.0 && alike(pairs, free) {
        return Some(Sharing::Common(pairs));
    }
    (!failing.is_empty()).then_some(Sharing::Correlated(failing))
}

/// Correlation of the whitened residuals, axis by axis.
pub(crate) fn common<'a>(searched: &'a [Searched<'a>], grid: &Grid) -> Shared {
    let first = grid.n / 50;
    let read = searched.iter().map(|s| s.told().1).fold(1.0, f64::min);
    let free = read * (grid.n - first) as f64;
    let pairs = pairs_of(searched, first, free);
    let effect_of = |asked: fn(&Hypothesis) -> bool| {
        let mut all = searched.iter().flat_map(|s| &s.search.candidates);
        all.find(|c| asked(&c.hypothesis)).map(|c| c.effect)
    };
    let one_source = effect_of(|h| matches!(h, Hypothesis::Common));
    let by_pair = effect_of(|h| matches!(h, Hypothesis::Correlation));
    let mut shared = Shared::default();
    if let Some(of) = one_source.filter(|_| !pairs.is_empty()) {
        shared.limits = smallest(&pairs, of, free);
    }
    let sharing = sharing(&pairs, free);
    let told: Vec<&Pair<'_>> = match &sharing {
        Some(Sharing::Common(all)) => all.iter().collect(),
        Some(Sharing::Correlated(some)) => some.clone(),
        None => vec![],
    };
    let mut straight = true;
    for p in &told {
        straight &= in_a_straight_line(p, told.len(), (grid.n - first) as f64, &mut shared);
    }
    if straight {
        shared.finding = match sharing {
            Some(Sharing::Common(all)) => one_source.map(|of| one(all, of, free, read, grid)),
            Some(Sharing::Correlated(some)) => by_pair.and_then(|of| correlated(&some, of, free)),
            None => None,
        };
    }
    pairs.iter().for_each(|p| correlation_check(p, &mut shared));
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

/// Whether one axis follows the other in a straight line, as those that share a source do, by a check of its own.
fn in_a_straight_line(p: &Pair<'_>, pairs: usize, samples: f64, shared: &mut Shared) -> bool {
    let [name, other] = p.names();
    let ratio = -samples * (1.0 - p.correlation * p.correlation).ln();
    let claim = process::straight(&p.first.e, &p.second.e, ratio, pairs);
    let doubted = claim.p_value < test_level::CLAIM_LEVEL;
    shared.checks.push(Check {
        id: claim.id.into(),
        about: vec![],
        channel: format!("{name}, {other}"),
        statistic: claim.statistic,
        p_value: Some(claim.p_value),
        threshold: test_level::CLAIM_LEVEL,
        fails_before: false,
        fails_after: doubted,
        what: claim.what.clone(),
    });
    if doubted {
        let what = format!("with {other}, {}", claim.what);
        let seen = Observation::of_coupling(name, what, p.correlation);
        shared.left.push(seen.by(claim.id, claim.p_value));
    }
    !doubted
}

/// The check of a pair, and what is left of it where nothing is named.
fn correlation_check(p: &Pair<'_>, shared: &mut Shared) {
    let [name, other] = p.names();
    let left = p.fails() && shared.finding.is_none();
    shared.checks.push(Check {
        id: CheckId::CrossCorrelation.into(),
        about: vec![],
        channel: format!("{name}, {other}"),
        statistic: p.correlation,
        p_value: Some(p.p_value),
        threshold: omnibus_level(),
        fails_before: p.fails(),
        fails_after: left,
        what: "correlation of the whitened residuals of two axes".into(),
    });
    if left {
        let r = p.correlation;
        let what = format!("correlates with {other} ({r:.3}) sample by sample");
        let seen = Observation::of_coupling(name, what, r);
        let seen = seen.by(CheckId::CrossCorrelation, p.p_value);
        shared.left.push(seen.following(other));
    }
}

/// What a finding says where two axes alone share, with no third one that could tell: one source and a correlation are then
/// the same thing.
fn or(mut finding: Finding, of: &dyn Effect, other: &'static str) -> Finding {
    finding.alternatives = vec![Alternative {
        cause: other.into(),
        log_odds: 0.0,
    }];
    let stated = of.rivals().iter().find(|r| r.cause == other);
    finding.experiment = stated.map(|r| r.experiment.to_owned());
    finding
}

/// One source of all axes.
fn one(pairs: &[Pair<'_>], of: &dyn Effect, free: f64, read: f64, grid: &Grid) -> Finding {
    let mean = pairs.iter().map(Pair::covariance).sum::<f64>() / pairs.len() as f64;
    let error = error_of_mean(pairs, mean, free);
    let found = Found {
        unit: pairs[0].first.target.unit.clone(),
        coefficients: vec![(mean.sqrt(), error / (2.0 * mean.sqrt()))],
        ..Found::default()
    };
    let parameters = of.describe(&found);
    let axes = axes_of(pairs);
    let names: Vec<String> = axes.iter().map(|s| s.target.name.clone()).collect();
    let residuals: Vec<&[f64]> = axes.iter().map(|s| s.e.as_slice()).collect();
    let (nats, std_error) = prequential::of_correlation(&residuals);
    let log = |p: &Pair<'_>| -(read * grid.n as f64) * (1.0 - p.correlation * p.correlation).ln();
    let ratio = pairs.iter().map(log).sum::<f64>();
    let finding = Finding {
        cause: of.id().into(),
        what: sentence(of, &names.join(", "), &parameters),
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
    };
    if pairs.len() == 1 {
        return or(finding, of, correlated_noise::ID);
    }
    finding
}

/// The axes of some pairs, each once, in order.
fn axes_of<'a, 'p>(pairs: impl IntoIterator<Item = &'p Pair<'a>>) -> Vec<&'a Searched<'a>>
where
    'a: 'p,
{
    let mut axes: Vec<&Searched<'_>> = vec![];
    for s in pairs.into_iter().flat_map(|p| [p.first, p.second]) {
        if axes.iter().all(|a| a.target.name != s.target.name) {
            axes.push(s);
        }
    }
    axes
}

/// Noise that some pairs of axes share, each its part: stated on the later axis of each pair.
fn correlated(pairs: &[&Pair<'_>], of: &dyn Effect, free: f64) -> Option<Finding> {
    let named = |other: &str| {
        let with = |name: &&&str| name.strip_prefix("with_") == Some(other);
        of.parameters().iter().map(|p| &p.name).find(with).copied()
    };
    let mut per_channel: BTreeMap<String, Parameters> = BTreeMap::new();
    for p in pairs {
        let ([name, other], r) = (p.names(), p.correlation);
        let found = Found {
            names: vec![named(name)?],
            coefficients: vec![(r, (1.0 - r * r) / free.sqrt())],
            ..Found::default()
        };
        let own = per_channel.entry(other.clone()).or_default();
        own.extend(of.describe(&found));
    }
    let (first, parameters) = per_channel.first_key_value()?;
    let log = |p: &&Pair<'_>| -free * (1.0 - p.correlation * p.correlation).ln();
    let ratio = pairs.iter().map(log).sum::<f64>();
    let sizes = pairs.iter().map(|p| p.correlation.abs());
    let largest = sizes.fold(0.0, f64::max);
    let axes = axes_of(pairs.iter().copied());
    let residuals: Vec<&[f64]> = axes.iter().map(|s| s.e.as_slice()).collect();
    let (nats, std_error) = prequential::of_correlation(&residuals);
    let channels: BTreeSet<String> = axes.iter().map(|s| s.target.name.clone()).collect();
    let finding = Finding {
        cause: of.id().into(),
        what: sentence(of, first, parameters),
        channels: channels.into_iter().collect(),
        parameters: parameters.clone(),
        per_channel: per_channel.clone(),
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
    };
    let open = pairs.len() == 1 && pairs[0].correlation > 0.0;
    Some(if open {
        or(finding, of, common_noise::ID)
    } else {
        finding
    })
}

/// The size from which on a source that all axes share is found 95 times in 100.
fn smallest(pairs: &[Pair<'_>], of: &dyn Effect, samples: f64) -> Vec<DetectionLimit> {
    // z of each pair by the variance of the source.
    let z = |p: &Pair<'_>| {
        (samples / (p.first.state.solution.white * p.second.state.solution.white)).sqrt()
    };
    let count = pairs.len() as f64;
    let joint = pairs.iter().map(z).sum::<f64>() / count.sqrt();
    let weakest = pairs.iter().map(z).fold(f64::INFINITY, f64::min);
    let reach = |chance: f64| numerics::tails::farthest(1, chance) + ONE_SIDED;
    let variance = if pairs.len() > 1 {
        (reach(2.0 * threshold::false_alarm()) / joint).max((LEAST_OF_ALL + ONE_SIDED) / weakest)
    } else {
        reach(omnibus_level()) / joint
    };
    let found = Found {
        unit: pairs[0].first.target.unit.clone(),
        coefficients: vec![(variance.sqrt(), f64::NAN)],
        ..Found::default()
    };
    let described = of.describe(&found);
    let each = axes_of(pairs).into_iter();
    each.filter_map(|s| limit(of.id(), &s.target.name, &described, "sigma", &[]))
        .collect()
}

/// Samples by which one axis may follow another.
const LATE: usize = 20;

/// Correlations of two residuals as standard normal scores, the second 1, 2 and so on samples later.
fn scores_behind(first: &[f64], second: &[f64]) -> Vec<f64> {
    let power = |e: &[f64]| dot(e, e) / e.len() as f64;
    let scale = (power(first) * power(second)).sqrt();
    let sums = dots_behind(first, second, LATE.min(first.len() / 2));
    let each = (1..).zip(sums);
    each.map(|(lag, sum)| sum / (scale * ((first.len() - lag) as f64).sqrt()))
        .collect()
}

/// Correlation of the residuals of two axes, one of them some samples later.
fn late(a: &Searched<'_>, b: &Searched<'_>, shared: &mut Shared) {
    // An axis, the one that follows it, the samples, z.
    let mut worst = (a, b, 0, 0.0f64);
    let mut statistic = 0.0;
    for (first, second) in [(a, b), (b, a)] {
        for (lag, z) in (1..).zip(scores_behind(&first.e, &second.e)) {
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
        shared.late.push(Late {
            first: first.target.name.clone(),
            second: second.target.name.clone(),
            chi_square: statistic,
        });
        let seen = Observation::of_coupling(&second.target.name, what, r);
        let seen = seen.by(CheckId::CrossCorrelationLate, p);
        shared.left.push(seen.following(&first.target.name));
    }
}
