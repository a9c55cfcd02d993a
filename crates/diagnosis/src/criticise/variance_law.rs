//! Laws of the variance: which one the residual of a channel follows, and what its name claims.

use std::f64::consts::PI;

use model::effect::{Effect, Found, Hypothesis, VarianceLaw};

use statrs::distribution::{ContinuousCDF, Normal};

use crate::fit::channel::{VarianceFound, VarianceLaws, divide, over_mean};
use crate::fit::{scan, threshold};
use crate::search::searched::Searched;
use crate::test_level::{CheckId, DEPARTURE, Outcome};
use numerics::tails::{chi_tail, errors_of_sum};

/// The laws of the variance that pass their thresholds beside each other: the best one, and what the residual divided by it
/// follows by another effect, each estimated anew beside the others.
pub(crate) fn found(s: &Searched<'_>) -> VarianceLaws {
    let mut each: Vec<VarianceFound> = vec![];
    while let Some(next) = best(s, &beside(&s.e, &each, None), &|id| {
        each.iter().all(|v| v.effect.id() != id)
    }) {
        each.push(next);
        if each.len() > 1 {
            anew(s, &mut each);
        }
    }
    VarianceLaws::of(each)
}

/// Rounds in which laws are estimated beside each other: of two that hardly overlap the second one moves by little.
const ROUNDS: usize = 2;

/// Every law estimated beside the others; one that they leave nothing goes.
fn anew(s: &Searched<'_>, each: &mut Vec<VarianceFound>) {
    for _ in 0..ROUNDS {
        let mut i = 0;
        while i < each.len() {
            let own = each[i].effect.id();
            match best(s, &beside(&s.e, each, Some(i)), &|id| id == own) {
                Some(again) => {
                    each[i] = again;
                    i += 1;
                }
                None => {
                    each.remove(i);
                }
            }
        }
    }
}

/// A residual over the square root of all laws but one.
fn beside(e: &[f64], each: &[VarianceFound], but: Option<usize>) -> Vec<f64> {
    let mut e = e.to_vec();
    for (_, v) in each.iter().enumerate().filter(|(i, _)| Some(*i) != but) {
        divide(&mut e, &v.law);
    }
    e
}

/// Variance of the squares of a noise over that of normal values, from which on it has tails of its own.
const TAILED: f64 = 1.1;

/// Whether a residual that a law divides has tails of its own: then a few far readings are likelier louder than they are far.
fn is_tailed(e: &[f64], law: &[f64]) -> bool {
    let squares = || e.iter().zip(law).map(|(e, v)| e * e / v);
    let n = e.len() as f64;
    let mean = squares().sum::<f64>() / n;
    let kurtosis = squares().map(|s| s * s).sum::<f64>() / n / (mean * mean);
    0.5 * (kurtosis - 1.0) > TAILED
}

/// The normal values of the same order (van der Waerden, 1952): a stretch that is louder is so among them, too, and far readings are
/// no farther than normal ones.
fn normal_scores(e: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..e.len()).collect();
    order.sort_unstable_by(|a, b| e[*a].total_cmp(&e[*b]));
    let normal = Normal::standard();
    let mut scores = vec![0.0; e.len()];
    for (rank, i) in order.into_iter().enumerate() {
        scores[i] = normal.inverse_cdf((rank as f64 + 0.5) / e.len() as f64);
    }
    scores
}

/// The best law of the variance of a residual by one of some effects, if one passes its threshold; of a noise with tails, by normal
/// scores as well.
fn best(s: &Searched<'_>, e: &[f64], asked: &dyn Fn(&str) -> bool) -> Option<VarianceFound> {
    let candidates = s.search.candidates.iter();
    let mut scores: Option<Vec<f64>> = None;
    let offers = candidates.filter(|c| asked(c.effect.id())).filter_map(|c| {
        let Hypothesis::Variance(law) = &c.hypothesis else {
            return None;
        };
        let told = offer(s, e, c.effect, law);
        let passes = told.lr > told.threshold
            && (!is_tailed(e, &told.law) || {
                let scores = scores.get_or_insert_with(|| normal_scores(e));
                offer(s, scores, c.effect, law).lr > told.threshold
            });
        passes.then_some(told)
    });
    let mut all: Vec<VarianceFound> = offers.collect();
    let score = |v: &VarianceFound| v.lr - v.threshold;
    all.sort_by(|a, b| score(b).total_cmp(&score(a)));
    let (best, rest) = all.split_first_mut()?;
    for other in rest.iter().filter(|o| o.effect.id() != best.effect.id()) {
        if score(best) - score(other) < crate::fit::channel::RIVAL_SPAN {
            best.alternatives
                .push((other.effect, (score(other) - score(best)) / 2.0));
        }
    }
    Some(all.swap_remove(0))
}

/// What a law of the variance offers to a residual.
fn offer(
    s: &Searched<'_>,
    e: &[f64],
    effect: &'static dyn Effect,
    law: &VarianceLaw,
) -> VarianceFound {
    let rate_hz = s.search.view.rate_hz;
    let mut found = Found {
        unit: s.target.unit.clone(),
        rate_hz,
        ..Found::default()
    };
    let follows = match law {
        VarianceLaw::Shape { follows, .. } => Some(follows.clone()),
        VarianceLaw::Segment => None,
    };
    let (lr, limit, shape) = match law {
        VarianceLaw::Shape { shape, .. } => {
            let (lr, gamma, error) = scan::variance_law(e, shape);
            found.coefficients = vec![(gamma, error)];
            (lr, threshold::variance_law(), shape.to_vec())
        }
        VarianceLaw::Segment => {
            let (lr, start, end, increase) = scan::segment(e);
            let (start, end, increase) = scan::to_a_reading(e, (start, end, increase));
            let (n, inside) = (e.len() as f64, (end - start) as f64);
            let error =
                (1.0 + increase) * (2.0 / inside.max(1.0) + 2.0 / (n - inside).max(1.0)).sqrt();
            found.coefficients = vec![(increase, error)];
            let (first, last) = scan::ends(e, start, end, increase);
            found.location = [first, last]
                .map(|(at, error)| (at / rate_hz, error / rate_hz))
                .to_vec();
            let inside = (0..e.len()).map(|i| f64::from(u8::from(i >= start && i < end)));
            (lr, threshold::segment(), inside.collect())
        }
    };
    let gamma = found.coefficients[0].0;
    let mut law: Vec<f64> = shape.iter().map(|d| 1.0 + gamma * d).collect();
    over_mean(&mut law);
    VarianceFound {
        effect,
        parameters: effect.describe(&found),
        found,
        lr,
        threshold: limit,
        alternatives: vec![],
        law,
        shape,
        follows,
    }
}

/// Nats by which one law of an effect's variance has to be ahead of its others, of which they then have a twentieth of its
/// likelihood; within them the record does not tell which it is, and the effect's own is the first.
const OPEN: f64 = 3.0;

/// A law of the variance that the record does not tell from the one that was taken.
pub(crate) struct Untold {
    /// Of which of the laws that were found.
    pub of: usize,
    /// What it adds, by sample, in units of its coefficient.
    pub shape: Vec<f64>,
}

/// Of the laws of each effect that was found, the one that the residual `e` tells beside the others, and those that it does not
/// tell from it.
pub(crate) fn settle(s: &Searched<'_>, laws: &mut VarianceLaws, e: &[f64]) -> Vec<Untold> {
    let mut untold = vec![];
    for of in 0..laws.each.len() {
        let e = beside(e, &laws.each, Some(of));
        let others = settle_one(s, &mut laws.each[of], &e).into_iter();
        untold.extend(others.map(|shape| Untold { of, shape }));
    }
    untold
}

fn settle_one(s: &Searched<'_>, v: &mut VarianceFound, e: &[f64]) -> Vec<Vec<f64>> {
    let own = s.search.candidates.iter();
    let own = own.filter(|c| c.effect.id() == v.effect.id());
    let laws: Vec<_> = own
        .filter_map(|c| match &c.hypothesis {
            Hypothesis::Variance(VarianceLaw::Shape { shape, fixed, .. }) => {
                Some((scan::variance_law(e, shape), fixed, shape))
            }
            _ => None,
        })
        .collect();
    let best = laws.iter().map(|((lr, ..), ..)| *lr).fold(0.0, f64::max);
    let near: Vec<usize> = (0..laws.len())
        .filter(|i| best - laws[*i].0.0 < 2.0 * OPEN)
        .collect();
    let (taken, fixed) = match near[..] {
        [] => return vec![],
        [told] => (told, laws[told].1.clone()),
        _ => (0, vec![]),
    };
    let ((_, increase, error), _, shape) = &laws[taken];
    v.found.coefficients = vec![(*increase, *error)];
    v.found.fixed = fixed;
    v.shape = shape.to_vec();
    v.parameters = v.effect.describe(&v.found);
    let others = near.into_iter().filter(|i| *i != taken);
    others.map(|i| laws[i].2.to_vec()).collect()
}

/// What the laws of the variance that were found on a channel claim, each claim with its chance.
pub(crate) fn claims(s: &Searched<'_>) -> Vec<Outcome> {
    let Some(law) = s.variance.product() else {
        return vec![];
    };
    let ids: Vec<&str> = s.variance.each.iter().map(|v| v.effect.id()).collect();
    let (named, lr) = (ids.join(" and "), s.variance.lr());
    let either = s.variance.each.iter();
    [
        evenness(&s.e, &named, lr, s.search.view.rate_hz),
        added_white(&s.e, law, &named, lr),
    ]
    .into_iter()
    .chain(either.filter_map(|v| either_sign(s, v)))
    .collect()
}

/// Half cycles of the cosines that a changed variance is held against.
const COSINES: usize = 16;

/// The claim of a law of the variance: divided by it, the squares of the residual `e` are even. They are held against cosines
/// over the record; what swells, fades or follows a history is no stretch with two ends, and no law of the motor.
/// `lr` is its likelihood ratio, of which a twentieth may be left.
fn evenness(e: &[f64], named: &str, lr: f64, rate_hz: f64) -> Outcome {
    let n = e.len() as f64;
    let mean = e.iter().map(|v| v * v).sum::<f64>() / n;
    let squares: Vec<f64> = e.iter().map(|v| v * v - mean).collect();
    let spread = squares.iter().map(|s| s * s).sum::<f64>() / n;
    let score = |k: usize| {
        let step = PI * k as f64 / n;
        let sum: f64 = (squares.iter().enumerate())
            .map(|(i, s)| s * (step * (i as f64 + 0.5)).cos())
            .sum();
        sum / (0.5 * n * spread).sqrt()
    };
    let scores: Vec<f64> = (1..=COSINES).map(score).collect();
    claim_of_variance(&scores, lr, |worst| {
        let over_s = 2.0 * n / rate_hz / (worst + 1) as f64;
        format!(
            "told as {named}: divided by it, the variance still swings, most over {over_s:.0} s"
        )
    })
}

/// A claim of a law of the variance, by scores that are standard normal where it holds; a part [`DEPARTURE`] of its likelihood
/// ratio may be left. `what` tells it by the score that stands out most.
fn claim_of_variance(scores: &[f64], lr: f64, what: impl FnOnce(usize) -> String) -> Outcome {
    let statistic: f64 = scores.iter().map(|z| z * z).sum();
    let worst = (0..scores.len())
        .max_by(|a, b| scores[*a].abs().total_cmp(&scores[*b].abs()))
        .unwrap_or(0);
    Outcome {
        id: CheckId::VarianceLaw,
        about: vec![],
        statistic,
        p_value: if statistic < DEPARTURE * lr {
            1.0
        } else {
            chi_tail(statistic, scores.len() as f64)
        },
        what: what(worst),
    }
}

/// Samples over which what a law of the variance adds is asked whether it is white.
const LAGS_OF_ADDED: usize = 20;

/// The other claim of a law of the variance: what it adds is white. `law` is the variance over its mean, by sample, which `e`
/// was divided by; where more of it is added, a correlation counts for more.
fn added_white(e: &[f64], law: &[f64], named: &str, lr: f64) -> Outcome {
    let least = law.iter().copied().fold(f64::INFINITY, f64::min);
    let added: Vec<f64> = e
        .iter()
        .zip(law)
        .map(|(e, v)| e * (1.0 - least / v))
        .collect();
    let score = |lag: usize| errors_of_sum(added.iter().zip(&added[lag..]).map(|(a, b)| a * b));
    let scores: Vec<f64> = (1..=LAGS_OF_ADDED.min(e.len() / 2)).map(score).collect();
    claim_of_variance(&scores, lr, |worst| {
        let lag = worst + 1;
        format!(
            "told as {named}: what it adds is not white, readings {lag} samples apart correlate most"
        )
    })
}

/// The third claim of a law of the variance, where it follows a channel of both signs: what it adds is as large under either.
fn either_sign(s: &Searched<'_>, found: &VarianceFound) -> Option<Outcome> {
    let channel = found.follows.as_ref()?;
    let follows = &s
        .search
        .view
        .signals
        .iter()
        .find(|c| c.name == *channel)?
        .values;
    let has = |sign: f64| follows.iter().any(|x| sign * x > 0.0);
    if !(has(1.0) && has(-1.0)) {
        return None;
    }
    let (e, n) = (&s.e, s.e.len() as f64);
    let least = found.law.iter().copied().fold(f64::INFINITY, f64::min);
    // What moves ln of the variance where one sign has more of it and the other less.
    let odd: Vec<f64> = (found.law.iter().zip(follows.iter()))
        .map(|(v, x)| (1.0 - least / v) * if *x == 0.0 { 0.0 } else { x.signum() })
        .collect();
    let middle = odd.iter().sum::<f64>() / n;
    let mean = e.iter().map(|v| v * v).sum::<f64>() / n;
    let score = errors_of_sum((e.iter().zip(&odd)).map(|(e, o)| (e * e - mean) * (o - middle)));
    let claim = claim_of_variance(&[score], found.lr, |_| {
        let more = if score > 0.0 { "above" } else { "below" };
        let id = found.effect.id();
        format!("told as {id}: it adds more while {channel} is {more} 0 than at the other sign")
    });
    Some(Outcome {
        about: vec![channel.clone()],
        ..claim
    })
}
