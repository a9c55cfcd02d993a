//! Findings out of what was estimated: one for each cause, with its rivals, its experiment and its gain.

use std::collections::BTreeMap;

use model::effect::{Effect, Found, Hypothesis, Parameters};
use model::effects::effect;
use model::record::Base;
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::attribute::events;
use crate::criticise::{residual, scale};
use crate::fit::channel::{Form, Term, VarianceFound, undo};
use crate::fit::{estimate, prequential, threshold};
use crate::ingest::types::Grid;
use crate::report::{detection_limits, figures};
use crate::result;
use crate::result::{Alternative, DetectionLimit, Finding, Gain, Parameter, sentence};
use crate::search::searched::Searched;
use crate::test_level::{CheckId, Observation};
use numerics::transform::Dct;

pub(crate) fn experiment(of: &dyn Effect, alternatives: &[Alternative]) -> Option<String> {
    let first = alternatives.first()?;
    let stated = of
        .rivals()
        .iter()
        .find(|r| r.cause == first.cause)
        .map(|r| r.experiment);
    let back = effect(&first.cause)
        .and_then(|e| e.rivals().iter().find(|r| r.cause == of.id()))
        .map(|r| r.experiment);
    Some(
        stated
            .or(back)
            .unwrap_or("a record ten times longer, each excitation switched on its own")
            .to_owned(),
    )
}

pub(crate) fn alternatives(all: &[(&'static dyn Effect, f64)]) -> Vec<Alternative> {
    all.iter()
        .map(|(e, odds)| Alternative {
            cause: e.id().into(),
            log_odds: *odds,
        })
        .collect()
}

/// The terms that are one band with this one, of which it is the first; none where it is no band, or not the first.
fn overlapping(s: &Searched<'_>, term: &Term) -> Vec<usize> {
    let Some(own) = term.cluster.filter(|c| c.place == 0) else {
        return vec![];
    };
    let terms = s.state.terms.iter().enumerate();
    let of_it = terms.filter(|(_, t)| t.cluster.is_some_and(|c| c.number == own.number));
    of_it.map(|(i, _)| i).collect()
}

/// The parameters of a term, and of the bands that it is one with.
fn parameters_of(
    s: &Searched<'_>,
    term: &Term,
    found: &Found,
    parts: &[usize],
    rate_hz: f64,
) -> Parameters {
    let mut parameters = if parts.len() > 1 {
        let (panel, unit) = (&s.search.panel, &s.target.unit);
        let all = estimate::of_bands(panel, &s.state, parts, unit, rate_hz);
        term.effect.describe(&all)
    } else {
        term.effect.describe(found)
    };
    if is_normal_after_all(s, term) {
        let specs = term.effect.parameters().iter();
        let own = specs.filter(|p| p.name == NORMAL);
        parameters.extend(own.map(|p| (p.name.into(), Parameter::exact(1.0, p.unit))));
    }
    parameters
}

pub(crate) fn term_findings(s: &Searched<'_>, grid: &Grid, seed: u64) -> Vec<Finding> {
    if s.state.terms.is_empty() {
        return vec![];
    }
    let values: Vec<Vec<Vec<f64>>> = s
        .state
        .terms
        .iter()
        .map(|t| {
            t.columns
                .iter()
                .map(|c| s.search.panel.dct.inverse(&s.search.panel.column(*c)))
                .collect()
        })
        .collect();
    let scores = prequential::scores(&s.target.y, grid.rate_hz, &s.state, &values);
    let misfit = figures::allan_misfit(s, seed);
    let n = (grid.n as f64).ln();
    // A base that is no turntable turns a little about the other axes too.
    let motion = s.search.candidates.iter();
    let motion = motion
        .filter(|_| s.search.view.sways())
        .find(|c| matches!(c.hypothesis, Hypothesis::Motion));
    let turning = |name: &str| grid.targets.iter().any(|t| t.moving && t.name == name);
    s.state
        .terms
        .iter()
        .zip(&s.found)
        .zip(scores)
        .map(|((term, found), score)| {
            let parts = overlapping(s, term);
            let parameters = parameters_of(s, term, found, &parts, grid.rate_hz);
            let gaussian = &s.search.candidates[term.candidate].hypothesis;
            // One tone is no sum of several.
            let parted = parts.len() > 1 && matches!(gaussian, Hypothesis::Covariance(_));
            let components = parts.iter().filter(|_| parted);
            let components = components
                .map(|i| term.effect.describe(&s.found[*i]))
                .collect();
            let lr = term.cluster.map_or(term.lr, |c| c.lr);
            let mut alternatives = alternatives(&term.alternatives);
            if let Some(motion) = motion.filter(|_| term.follows.as_deref().is_some_and(turning)) {
                alternatives.push(Alternative {
                    cause: motion.effect.id().into(),
                    log_odds: 0.0,
                });
            }
            let size = (found.coefficients.len() + found.location.len()) as f64;
            let effective = effective(s, term, found);
            let told = if effective { EFFECTIVE } else { "" };
            let what = sentence(term.effect, &s.target.name, &parameters);
            Finding {
                cause: term.effect.id().into(),
                channels: vec![s.target.name.clone()],
                experiment: experiment(term.effect, &alternatives),
                alternatives,
                gain: Some(Gain {
                    held_out_log_score_nats: Some(score.nats),
                    std_error: Some(score.std_error),
                    delta_bic: Some(lr - size * n),
                    allan_misfit_before: Some(misfit[0]),
                    allan_misfit_after: Some(misfit[1]),
                    // The filter behind the angles knows the random walk alone: a stationary term leaves it as it is.
                    angle_rms_deg: score
                        .angle
                        .iter()
                        .map(|(k, [before, after])| {
                            let same = matches!(term.form, Form::Covariance(..));
                            let after = if same { before } else { after };
                            ((*k).to_owned(), [*before, *after])
                        })
                        .collect(),
                    ablation_nats: Some(lr / 2.0),
                    ..Gain::default()
                }),
                what: what + told,
                effective,
                parameters,
                components,
                likelihood_ratio: Some(lr),
                confirmed_on_held_out_data: Some(score.nats > 0.0),
                ..Finding::default()
            }
        })
        .collect()
}

/// The parameter of an effect by which its values are normal where its name says another law.
const NORMAL: &str = "normal";
/// Readings about whose mean the law of a process is looked at: few enough for what is slow to have no part.
const ABOUT: usize = 8;

/// Whether a process that its name gives a law of lighter or heavier tails is nearer to a normal one by the kurtosis of the readings.
fn is_normal_after_all(s: &Searched<'_>, term: &Term) -> bool {
    let Form::Covariance(process, theta) = &term.form else {
        return false;
    };
    let of_law = process.excess_kurtosis();
    if of_law == 0.0 {
        return false;
    }
    let bins = &s.search.panel.bins;
    let counts = bins.counts();
    let mean = |density: &[f64]| {
        let each = density.iter().zip(counts).map(|(d, m)| d * m);
        each.sum::<f64>() / counts.iter().sum::<f64>()
    };
    let own = mean(&process.density(theta, &bins.at));
    // The slowest is no part of what scatters about a local mean.
    let others = s.state.noise_beside_processes();
    let white = others.at(std::f64::consts::FRAC_PI_2);
    let share = own / (own + white);
    let about = |near: &[f64]| {
        let level = near.iter().sum::<f64>() / near.len() as f64;
        near.iter().map(|v| v - level).collect::<Vec<f64>>()
    };
    let off: Vec<f64> = s.target.y.chunks_exact(ABOUT).flat_map(about).collect();
    let excess = residual::excess_kurtosis(&off);
    (excess / (share * share) / of_law) < 0.5
}

/// What is said of a value that holds for one excitation alone.
const EFFECTIVE: &str = "; effective for this excitation: what is fast goes through the gyro's filter, and is read at another instant";

/// Whether a delay of a sample between a sensor and the channel that a term follows could make a coefficient wrong by more
/// than half of its interval: by 1 minus the correlation of neighbouring readings of the channel.
fn effective(s: &Searched<'_>, term: &Term, found: &Found) -> bool {
    let follows = term.follows.as_deref().filter(|_| term.effect.felt_late());
    let Some(follows) = follows else { return false };
    let own = s
        .search
        .view
        .signals
        .iter()
        .filter(|c| follows.contains(&c.name));
    let lost = own.map(|c| 1.0 - neighbours(&c.values)).fold(0.0, f64::max);
    let far = |(value, error): &(f64, f64)| lost * value.abs() > 1.96 * error;
    found.coefficients.iter().any(far)
}

/// Correlation of neighbouring values.
fn neighbours(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let all: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    let pairs = values.windows(2).map(|w| (w[0] - mean) * (w[1] - mean));
    if all > 0.0 {
        pairs.sum::<f64>() / all
    } else {
        1.0
    }
}

/// What is told of a law of the variance of a channel, whose gain is that beside the others.
pub(crate) fn variance_finding(s: &Searched<'_>, v: &VarianceFound) -> Finding {
    let alternatives = alternatives(&v.alternatives);
    let mut undivided = s.e.clone();
    undo(&mut undivided, &v.law);
    let (nats, std_error) = prequential::of_variance(&undivided, &v.law);
    let parameters = v.parameters.clone();
    Finding {
        cause: v.effect.id().into(),
        channels: vec![s.target.name.clone()],
        experiment: experiment(v.effect, &alternatives),
        alternatives,
        confirmed_on_held_out_data: Some(nats > 0.0),
        gain: Some(Gain {
            held_out_log_score_nats: Some(nats),
            std_error: Some(std_error),
            delta_bic: Some(v.lr - (v.parameters.len() as f64) * (s.target.y.len() as f64).ln()),
            ablation_nats: Some(v.lr / 2.0),
            ..Gain::default()
        }),
        what: sentence(v.effect, &s.target.name, &parameters),
        parameters,
        likelihood_ratio: Some(v.lr),
        ..Finding::default()
    }
}

/// Coefficients over which the energy of a motion is averaged, and the energy over the noise's from which on it is there.
const EVEN: usize = 16;
const THERE: f64 = 4.0;
/// Fastest motion of a base, Hz.
const FASTEST_HZ: f64 = 3.0;
/// Copies of a motion with other noise.
const COPIES: usize = 12;

/// Largest rate about the mean, and its standard error, of a motion in white noise: the motion is what stands out at low
/// frequencies; what the noise that is left with it adds to the largest of many crests shows where noise is added again.
pub(super) fn peak_rate(dct: &Dct, y: &[f64], white: f64, rate_hz: f64) -> (f64, f64) {
    let mut c = dct.forward(y);
    c[0] = 0.0;
    let fastest = (2.0 * FASTEST_HZ / rate_hz * c.len() as f64) as usize;
    let fastest = fastest.clamp(1, c.len());
    let energy = |part: &[f64]| part.iter().map(|v| v * v).sum::<f64>() / part.len() as f64;
    let there = c[..fastest]
        .chunks(EVEN)
        .rposition(|part| energy(part) > THERE * white);
    let kept = ((there.map_or(0, |i| i + 1) + 1) * EVEN).min(c.len());
    c[kept..].fill(0.0);
    let largest = |c: &[f64]| dct.inverse(c).iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let peak = largest(&c);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0x6d6f_7469_6f6e);
    let copies: Vec<f64> = (0..COPIES)
        .map(|_| {
            let with = c.iter().enumerate().map(|(k, v)| {
                if k == 0 || k >= kept {
                    return 0.0;
                }
                let e: f64 = StandardNormal.sample(&mut rng);
                v + e * white.sqrt()
            });
            largest(&with.collect::<Vec<f64>>())
        })
        .collect();
    let mean = copies.iter().sum::<f64>() / COPIES as f64;
    let spread = copies.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (COPIES - 1) as f64;
    // Of crests alike, the largest is raised by a multiple of the noise: twice its variance raises it by 2^1/2 times as much.
    let raised = (mean - peak) / (std::f64::consts::SQRT_2 - 1.0);
    (peak - raised, spread.sqrt().hypot(0.5 * raised))
}

/// What the base did, and what is no turn of it after all.
pub(crate) fn motion_findings(
    s: &Searched<'_>,
    grid: &Grid,
    failing: &dyn Fn(CheckId) -> bool,
) -> (Vec<Finding>, Vec<Observation>) {
    let candidates = &mut s.search.candidates.iter();
    let of = candidates.find(|c| matches!(c.hypothesis, Hypothesis::Motion));
    let Some(of) = of.map(|c| c.effect) else {
        return (vec![], vec![]);
    };
    let name = &s.target.name;
    let finding = |peak: (f64, f64), location: Vec<(f64, f64)>, what: String| Finding {
        cause: of.id().into(),
        channels: vec![name.clone()],
        what: format!("The base {what}. No error of the sensor"),
        parameters: of.describe(&Found {
            unit: s.target.unit.clone(),
            coefficients: vec![peak],
            location,
            ..Found::default()
        }),
        ..Finding::default()
    };
    let (mut all, mut told) = (vec![], vec![]);
    for e in &s.target.excursions {
        let [from, to] = [e.samples.start, e.samples.end].map(|i| i as f64 / grid.rate_hz);
        let seen = format!(
            "from {from:.1} to {to:.1} s, by up to {:.2} deg/s",
            e.peak.0
        );
        let Some(why) = events::no_turn(s, e, failing) else {
            let what = format!("turns about {name} {seen}, and is back at rest");
            let ends = [from, to].map(|t| (t, e.end_error / grid.rate_hz));
            all.push(finding(e.peak, ends.to_vec(), what));
            continue;
        };
        let what = format!("goes out and comes back {seen}: no turn of the base, for {why}");
        told.push(Observation::of_noise(name, what));
    }
    if s.target.moving && grid.base != Some(Base::Turntable) {
        let peak = peak_rate(&grid.dct, &s.target.y, s.target.white, grid.rate_hz);
        let rms = s.target.motion_rms;
        let what = format!("moves about {name}: {rms:.2} deg/s rms between 0.02 and 0.6 Hz");
        all.push(finding(peak, vec![], what));
    }
    (all, told)
}

/// What a scale held against the tilt is found to be: wrong, or right to this limit.
#[derive(Default)]
pub(crate) struct Scaled {
    pub finding: Option<Finding>,
    pub limit: Option<DetectionLimit>,
}

/// Rms angle error of a turn by a scale that is off by each of `off`, with the white noise: before and after.
fn turned(s: &Searched<'_>, grid: &Grid, off: [f64; 2]) -> BTreeMap<String, [f64; 2]> {
    let y = &s.target.y;
    let from = prequential::held_from(y.len());
    let each = prequential::windows(y.len(), grid.rate_hz).into_iter();
    each.map(|(key, length)| {
        let turns = y[from..].chunks_exact(length);
        let angle = |part: &[f64]| part.iter().sum::<f64>() / grid.rate_hz;
        let count = turns.len().max(1) as f64;
        let square = turns.map(|part| angle(part).powi(2)).sum::<f64>() / count;
        let noise = s.target.white * length as f64 / grid.rate_hz.powi(2);
        let error = |off: f64| (off * off * square + noise).sqrt();
        (key.to_owned(), off.map(error))
    })
    .collect()
}

/// The scale factor, where the base sways and the accelerometers see it; or why not.
pub(crate) fn scale_finding(
    s: &Searched<'_>,
    grid: &Grid,
) -> Result<Scaled, (&'static str, String)> {
    let of = s
        .search
        .candidates
        .iter()
        .find(|c| matches!(c.hypothesis, Hypothesis::Scale))
        .map(|c| c.effect);
    let Some(of) = of else {
        return Ok(Scaled::default());
    };
    let found = scale::against_tilt(grid, s.target).map_err(|why| (of.id(), why))?;
    let describe = |relative: f64| {
        of.describe(&Found {
            unit: s.target.unit.clone(),
            names: vec!["relative"],
            coefficients: vec![(relative, found.std_error)],
            ..Found::default()
        })
    };
    let lr = (found.relative / found.std_error).powi(2);
    let least = threshold::regression(1, 1);
    if lr < least {
        let smallest = describe(detection_limits::strength_for(least) * found.std_error);
        return Ok(Scaled {
            limit: result::limit(of.id(), &s.target.name, &smallest, "relative", &[]),
            finding: None,
        });
    }
    let parameters = describe(found.relative);
    let finding = Finding {
        cause: of.id().into(),
        channels: vec![s.target.name.clone()],
        what: format!(
            "{}. The scale of the accelerometers is taken as right",
            sentence(of, &s.target.name, &parameters)
        ),
        parameters,
        likelihood_ratio: Some(lr),
        gain: Some(Gain {
            held_out_log_score_nats: Some(found.gain.0),
            std_error: Some(found.gain.1),
            delta_bic: Some(lr - (grid.n as f64).ln()),
            ablation_nats: Some(lr / 2.0),
            angle_rms_deg: turned(s, grid, [found.relative, found.std_error]),
            ..Gain::default()
        }),
        confirmed_on_held_out_data: Some(found.gain.0 > 0.0),
        ..Finding::default()
    };
    Ok(Scaled {
        finding: Some(finding),
        limit: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_rate_of_a_motion_is_that_without_its_noise() {
        let (n, runs, sigma) = (12_000, 40, 0.2);
        let dct = Dct::new(n);
        let mut inside = 0;
        let mut sum = 0.0;
        for seed in 0..runs {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let sway = |i: usize| {
                let t = i as f64 / 20.0;
                3.0 * (0.7 * t).sin() + 0.5 * (1.9 * t + 0.3).sin()
            };
            let truth = (0..n).map(|i| sway(i).abs()).fold(0.0, f64::max);
            let y: Vec<f64> = (0..n)
                .map(|i| {
                    let e: f64 = StandardNormal.sample(&mut rng);
                    sway(i) + sigma * e
                })
                .collect();
            let (peak, error) = peak_rate(&dct, &y, sigma * sigma, 20.0);
            inside += usize::from((peak - truth).abs() < 1.96 * error);
            sum += (peak - truth) / f64::from(runs as u32);
        }
        // Without the correction each would be high by some 0.05.
        assert!(inside >= 34, "{inside} of {runs}");
        assert!(sum.abs() < 0.03, "{sum}");
    }
}
