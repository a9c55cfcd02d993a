//! What the simulation of a sensor gets wrong, and why.

use std::collections::BTreeMap;
use std::rc::Rc;

use model::effect::{Effect, Found, Hypothesis, Parameters, VarianceLaw, View};
use model::effects::{EFFECTS, effect};
use model::file::{ChannelModel, EffectModel, FittedOn, ModelFile};
use model::record::Record;

use crate::checks::{self, LEAST_CHANCE};
use crate::error::AnalysisError;
use crate::estimate;
use crate::gain;
use crate::grid::{Grid, Target, lay_out};
use crate::likelihood::Panel;
use crate::result::{
    Alternative, Check, DIAGNOSIS_FORMAT, DetectionLimit, Diagnosed, Diagnosis, Finding, Gain,
    Input, NotTested, Parameter, Unexplained, Verdict,
};
use crate::search::{Search, State};
use crate::{evidence, scan, threshold};

/// Options of [`diagnose`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DiagnoseOptions {
    /// Seed of whatever is random (fill of lost samples, replicates).
    pub seed: u64,
    /// Name of the file, for the report.
    pub file: String,
    /// Digest of the file, for the model file.
    pub hash: Option<String>,
}

/// One gyro, searched.
pub(crate) struct Searched<'a> {
    pub target: &'a Target,
    pub search: Search<'a>,
    pub baseline: State,
    pub state: State,
    pub found: Vec<Found>,
    /// Whitened residual in time, before and after.
    pub e: [Vec<f64>; 2],
    u: [Vec<f64>; 2],
    variance: Option<VarianceFound>,
}

/// A law of the variance that was found.
pub(crate) struct VarianceFound {
    effect: &'static dyn Effect,
    parameters: Parameters,
    lr: f64,
    threshold: f64,
    alternatives: Vec<(&'static dyn Effect, f64)>,
    /// Variance over its mean, by sample.
    pub law: Vec<f64>,
}

/// Diagnose a record.
///
/// # Errors
/// [`AnalysisError::Inconclusive`] when the record is too short, [`AnalysisError::NoChannel`] when it holds no gyro,
/// [`AnalysisError::NoRate`] when its sample rate is unknown, [`AnalysisError::Constant`] when a gyro never changes.
pub fn diagnose(record: &Record, options: &DiagnoseOptions) -> Result<Diagnosed, AnalysisError> {
    let grid = lay_out(record, &|_| vec![], options.seed)?;
    let searched: Vec<Searched<'_>> = grid.targets.iter().map(|t| search(&grid, t)).collect();
    let mut findings = vec![];
    for s in &searched {
        findings.extend(motion_finding(s, &grid));
        findings.extend(term_findings(s, &grid, options.seed));
        findings.extend(variance_finding(s));
    }
    let shared = common(&searched, &grid);
    let mut checks: Vec<Check> = searched.iter().flat_map(channel_checks).collect();
    let unexplained = left_over(&checks, &shared);
    checks.extend(shared.checks);
    findings.extend(shared.finding);
    let findings = joined(findings);
    let not_tested = not_tested(&searched);
    let verdict = match (unexplained.is_empty(), findings.is_empty()) {
        (false, _) => Verdict::Unexplained,
        (true, true) => Verdict::Adequate,
        (true, false) => Verdict::Extended,
    };
    let baseline: BTreeMap<_, _> = searched
        .iter()
        .map(|s| (s.target.name.clone(), baseline_of(s, &s.baseline, &grid)))
        .collect();
    let model = |of: &dyn Fn(&Searched<'_>) -> Parameters, effects| ModelFile {
        stand: "fitted".into(),
        rate_hz: grid.rate_hz,
        fitted_on: Some(FittedOn {
            file: options.file.clone(),
            hash: options.hash.clone(),
            seconds: grid.n as f64 / grid.rate_hz,
        }),
        excitation: BTreeMap::new(),
        channels: searched
            .iter()
            .map(|s| ChannelModel {
                name: s.target.name.clone(),
                unit: s.target.unit.clone(),
                lsb: s.target.lsb,
                baseline: of(s),
            })
            .collect(),
        effects,
    };
    let diagnosed = Diagnosed {
        baseline_model: model(&|s| baseline_of(s, &s.baseline, &grid), vec![]),
        extended_model: model(&|s| baseline_of(s, &s.state, &grid), effects_of(&findings)),
        evidence: searched
            .iter()
            .flat_map(|s| evidence::of_channel(s, &grid))
            .collect(),
        diagnosis: Diagnosis {
            format: DIAGNOSIS_FORMAT.into(),
            input: Input {
                file: options.file.clone(),
                seconds: grid.n as f64 / grid.rate_hz,
                rate_hz: grid.rate_hz,
                samples: record.len(),
                channels: record.channels.iter().map(|c| c.name.clone()).collect(),
            },
            baseline,
            checks,
            detection_limits: searched.iter().flat_map(|s| limits(s, &findings)).collect(),
            findings,
            unexplained,
            not_tested,
            verdict,
        },
    };
    Ok(diagnosed)
}

fn search<'a>(grid: &'a Grid, target: &'a Target) -> Searched<'a> {
    let panel = Panel::new(&grid.dct, &Rc::clone(&grid.bins), &target.y);
    let view = View {
        channel: &target.name,
        axis: target.axis,
        lsb: target.lsb,
        white_sigma: target.white.sqrt(),
        rate_hz: grid.rate_hz,
        samples: grid.n,
        base: grid.base,
        moving: target.moving,
        signals: &grid.signals,
    };
    let search = Search::new(panel, view);
    let (baseline, state) = search.run(&target.noise);
    let found = estimate::found(&search.panel, &state, &target.unit, grid.rate_hz);
    let (u0, e0) = checks::whitened(&search.panel, &baseline);
    let (u1, e1) = checks::whitened(&search.panel, &state);
    let mut s = Searched {
        target,
        search,
        baseline,
        state,
        found,
        e: [e0, e1],
        u: [u0, u1],
        variance: None,
    };
    if !target.moving {
        s.variance = variance(&s);
    }
    if let Some(v) = &s.variance {
        s.e[1]
            .iter_mut()
            .zip(&v.law)
            .for_each(|(e, v)| *e /= v.sqrt());
    }
    s
}

/// The best law of the variance, if one passes its threshold.
fn variance(s: &Searched<'_>) -> Option<VarianceFound> {
    let e = &s.e[1];
    let mut all: Vec<VarianceFound> = s
        .search
        .candidates
        .iter()
        .filter_map(|c| {
            let Hypothesis::Variance(law) = &c.hypothesis else {
                return None;
            };
            let rate_hz = s.search.view.rate_hz;
            let mut found = Found {
                unit: s.target.unit.clone(),
                rate_hz,
                ..Found::default()
            };
            let (lr, limit, law) = match law {
                VarianceLaw::Shape { shape, .. } => {
                    let (lr, gamma, error) = scan::variance_law(e, shape);
                    found.coefficients = vec![(gamma, error)];
                    (
                        lr,
                        threshold::regression(1, 2),
                        shape.iter().map(|d| 1.0 + gamma * d).collect::<Vec<f64>>(),
                    )
                }
                VarianceLaw::Segment => {
                    let (lr, start, end, increase) = scan::segment(e);
                    let (n, inside) = (e.len() as f64, (end - start) as f64);
                    let error = (1.0 + increase)
                        * (2.0 / inside.max(1.0) + 2.0 / (n - inside).max(1.0)).sqrt();
                    found.coefficients = vec![(increase, error)];
                    let block = n / 240.0 / rate_hz;
                    found.location = vec![
                        (start as f64 / rate_hz, block),
                        (end as f64 / rate_hz, block),
                    ];
                    let law = (0..e.len())
                        .map(|i| {
                            if i >= start && i < end {
                                1.0 + increase
                            } else {
                                1.0
                            }
                        })
                        .collect();
                    (lr, threshold::segment(), law)
                }
            };
            Some(VarianceFound {
                effect: c.effect,
                parameters: c.effect.describe(&found),
                lr,
                threshold: limit,
                alternatives: vec![],
                law,
            })
        })
        .filter(|v| v.lr > v.threshold)
        .collect();
    let score = |v: &VarianceFound| v.lr - v.threshold;
    all.sort_by(|a, b| score(b).total_cmp(&score(a)));
    let (best, rest) = all.split_first_mut()?;
    for other in rest.iter().filter(|o| o.effect.id() != best.effect.id()) {
        if score(best) - score(other) < crate::search::RIVAL_SPAN {
            best.alternatives
                .push((other.effect, (score(other) - score(best)) / 2.0));
        }
    }
    let mean = best.law.iter().sum::<f64>() / best.law.len() as f64;
    best.law.iter_mut().for_each(|v| *v /= mean);
    Some(all.swap_remove(0))
}

fn experiment(of: &dyn Effect, alternatives: &[Alternative]) -> Option<String> {
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

fn alternatives(all: &[(&'static dyn Effect, f64)]) -> Vec<Alternative> {
    all.iter()
        .map(|(e, odds)| Alternative {
            cause: e.id().into(),
            log_odds: *odds,
        })
        .collect()
}

fn sentence(title: &str, channel: &str, parameters: &Parameters) -> String {
    let values: Vec<String> = parameters
        .iter()
        .map(|(name, p)| match p.std_error {
            Some(e) => format!("{name} {:.4} +- {e:.4} {}", p.value, p.unit),
            None => format!("{name} {:.4} {}", p.value, p.unit),
        })
        .collect();
    format!("{title} on {channel}: {}", values.join(", "))
}

fn term_findings(s: &Searched<'_>, grid: &Grid, seed: u64) -> Vec<Finding> {
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
    let scores = gain::scores(&s.target.y, grid.rate_hz, &s.state, &values);
    let misfit = evidence::allan_misfit(s, grid.rate_hz, seed);
    let n = (grid.n as f64).ln();
    s.state
        .terms
        .iter()
        .zip(&s.found)
        .zip(scores)
        .map(|((term, found), score)| {
            let parameters = term.effect.describe(found);
            let alternatives = alternatives(&term.alternatives);
            let size = (found.coefficients.len() + found.location.len()) as f64;
            Finding {
                cause: term.effect.id().into(),
                channels: vec![s.target.name.clone()],
                experiment: experiment(term.effect, &alternatives),
                alternatives,
                gain: Some(Gain {
                    held_out_log_score_nats: Some(score.nats),
                    std_error: Some(score.std_error),
                    delta_bic: Some(term.lr - size * n),
                    allan_misfit_before: Some(misfit[0]),
                    allan_misfit_after: Some(misfit[1]),
                    angle_rms_deg: score
                        .angle
                        .iter()
                        .map(|(k, v)| ((*k).to_owned(), *v))
                        .collect(),
                    ablation_nats: Some(term.lr / 2.0),
                }),
                what: sentence(term.effect.docs().title, &s.target.name, &parameters),
                parameters,
                likelihood_ratio: Some(term.lr),
                confirmed_on_held_out_data: Some(score.nats > 0.0),
                ..Finding::default()
            }
        })
        .collect()
}

fn variance_finding(s: &Searched<'_>) -> Option<Finding> {
    let v = s.variance.as_ref()?;
    let alternatives = alternatives(&v.alternatives);
    Some(Finding {
        cause: v.effect.id().into(),
        channels: vec![s.target.name.clone()],
        experiment: experiment(v.effect, &alternatives),
        alternatives,
        gain: Some(Gain {
            delta_bic: Some(v.lr - (v.parameters.len() as f64) * (s.target.y.len() as f64).ln()),
            ablation_nats: Some(v.lr / 2.0),
            ..Gain::default()
        }),
        what: sentence(v.effect.docs().title, &s.target.name, &v.parameters),
        parameters: v.parameters.clone(),
        likelihood_ratio: Some(v.lr),
        ..Finding::default()
    })
}

fn motion_finding(s: &Searched<'_>, grid: &Grid) -> Option<Finding> {
    if !s.target.moving || grid.base == Some(model::record::Base::Turntable) {
        return None;
    }
    let of = s
        .search
        .candidates
        .iter()
        .find(|c| matches!(c.hypothesis, Hypothesis::Motion))?
        .effect;
    // The rate in blocks of 0.4 s: short enough for the band of base motion, long enough to average the noise.
    let block = ((0.4 * grid.rate_hz).round() as usize).max(1);
    let y = &s.target.y;
    let mean = y.iter().sum::<f64>() / y.len() as f64;
    let peak = y
        .chunks_exact(block)
        .map(|c| (c.iter().sum::<f64>() / block as f64 - mean).abs())
        .fold(0.0, f64::max);
    let error = (s.target.white / block as f64).sqrt();
    let found = Found {
        unit: s.target.unit.clone(),
        coefficients: vec![(peak, error)],
        ..Found::default()
    };
    let parameters = of.describe(&found);
    Some(Finding {
        cause: of.id().into(),
        channels: vec![s.target.name.clone()],
        what: format!(
            "The base moves about {}: {:.2} deg/s rms between 0.02 and 0.6 Hz. No error of the sensor",
            s.target.name, s.target.motion_rms
        ),
        parameters,
        ..Finding::default()
    })
}

/// What the axes share.
struct Shared {
    checks: Vec<Check>,
    finding: Option<Finding>,
    left: Vec<Unexplained>,
}

/// Correlation of the whitened residuals, axis by axis.
fn common(searched: &[Searched<'_>], grid: &Grid) -> Shared {
    let mut shared = Shared {
        checks: vec![],
        finding: None,
        left: vec![],
    };
    let mut pairs = vec![];
    let first = grid.n / 50;
    for (i, a) in searched.iter().enumerate() {
        for b in &searched[i + 1..] {
            if a.target.moving || b.target.moving {
                continue;
            }
            let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
            for (x, y) in a.u[1][first..].iter().zip(&b.u[1][first..]) {
                ab += x * y;
                aa += x * x;
                bb += y * y;
            }
            let r = ab / (aa * bb).sqrt();
            let z = r.clamp(-0.999_999, 0.999_999).atanh() * ((grid.n - first) as f64 - 3.0).sqrt();
            let p = checks::normal_tail(z);
            pairs.push((a, b, r, p));
        }
    }
    let fails: Vec<_> = pairs.iter().filter(|p| p.3 < LEAST_CHANCE).collect();
    let of = searched
        .iter()
        .flat_map(|s| &s.search.candidates)
        .find(|c| matches!(c.hypothesis, Hypothesis::Common))
        .map(|c| c.effect);
    // A shared source correlates positively; where more than one pair shows it, all of its pairs are counted.
    let positive = !fails.is_empty() && fails.iter().all(|p| p.2 > 0.0);
    if let (Some(of), true) = (of, positive) {
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
        let product =
            fails.iter().map(|p| sigma(p.0) * sigma(p.1)).sum::<f64>() / shares.len() as f64;
        let error = product / ((grid.n * shares.len()) as f64).sqrt();
        let found = Found {
            unit: searched[0].target.unit.clone(),
            coefficients: vec![(mean.sqrt(), error / (2.0 * mean.sqrt()))],
            ..Found::default()
        };
        let parameters = of.describe(&found);
        shared.finding = Some(Finding {
            cause: of.id().into(),
            what: sentence(of.docs().title, &names.join(", "), &parameters),
            channels: names,
            parameters,
            likelihood_ratio: Some(
                fails
                    .iter()
                    .map(|p| -(grid.n as f64) * (1.0 - p.2 * p.2).ln())
                    .sum(),
            ),
            ..Finding::default()
        });
    }
    for (a, b, r, p) in &pairs {
        let fails = *p < LEAST_CHANCE;
        let explained = shared.finding.is_some();
        shared.checks.push(Check {
            id: "cross_correlation".into(),
            channel: format!("{}, {}", a.target.name, b.target.name),
            statistic: *r,
            p_value: Some(*p),
            threshold: LEAST_CHANCE,
            fails_before: fails,
            fails_after: fails && !explained,
            what: "correlation of the whitened residuals of two axes".into(),
        });
        if fails && !explained {
            shared.left.push(Unexplained {
                channel: a.target.name.clone(),
                what: format!(
                    "correlates with {} ({r:.3}) sample by sample",
                    b.target.name
                ),
            });
        }
    }
    shared
}

fn channel_checks(s: &Searched<'_>) -> Vec<Check> {
    let rate_hz = s.search.view.rate_hz;
    let before = checks::all(&s.u[0], &s.e[0], rate_hz);
    let after = checks::all(&s.u[1], &s.e[1], rate_hz);
    before
        .into_iter()
        .zip(after)
        .map(|(b, a)| Check {
            id: b.id.into(),
            channel: s.target.name.clone(),
            statistic: b.statistic,
            p_value: Some(b.p_value),
            threshold: LEAST_CHANCE,
            fails_before: b.p_value < LEAST_CHANCE,
            // A base that moves is told as an input; what it leaves in the residual is no riddle.
            fails_after: a.p_value < LEAST_CHANCE && !s.target.moving,
            what: if a.p_value < LEAST_CHANCE {
                a.what
            } else {
                b.what
            },
        })
        .collect()
}

fn left_over(checks: &[Check], shared: &Shared) -> Vec<Unexplained> {
    let failing = checks.iter().filter(|c| c.fails_after);
    failing
        .map(|c| Unexplained {
            channel: c.channel.clone(),
            what: format!("{}: {}", c.id, c.what),
        })
        .chain(shared.left.iter().cloned())
        .collect()
}

/// One finding for one event on several channels, and for one cause on one channel by several terms.
fn joined(findings: Vec<Finding>) -> Vec<Finding> {
    let mut all: Vec<Finding> = vec![];
    for f in findings {
        let same_channel = all.iter_mut().find(|o| {
            o.cause == f.cause
                && o.channels == f.channels
                && f.parameters.keys().all(|k| !o.parameters.contains_key(k))
        });
        if let Some(other) = same_channel {
            other.parameters.extend(f.parameters);
            other.likelihood_ratio =
                Some(other.likelihood_ratio.unwrap_or(0.0) + f.likelihood_ratio.unwrap_or(0.0));
            other.what = format!("{}; {}", other.what, f.what);
            continue;
        }
        let event = effect(&f.cause).and_then(|e| {
            all.iter_mut().find(|o| {
                o.cause == f.cause
                    && !o.channels.contains(&f.channels[0])
                    && e.same_event(&o.parameters, &f.parameters)
            })
        });
        if let Some(other) = event {
            if other.per_channel.is_empty() {
                other
                    .per_channel
                    .insert(other.channels[0].clone(), other.parameters.clone());
            }
            other
                .per_channel
                .insert(f.channels[0].clone(), f.parameters);
            other.channels.extend(f.channels);
            other.likelihood_ratio =
                Some(other.likelihood_ratio.unwrap_or(0.0) + f.likelihood_ratio.unwrap_or(0.0));
            if let (Some(a), Some(b)) = (&mut other.gain, f.gain) {
                a.held_out_log_score_nats = a
                    .held_out_log_score_nats
                    .zip(b.held_out_log_score_nats)
                    .map(|(x, y)| x + y);
                a.std_error = a.std_error.zip(b.std_error).map(|(x, y)| x.hypot(y));
                a.delta_bic = a.delta_bic.zip(b.delta_bic).map(|(x, y)| x + y);
            }
            other.what = format!("{}; {}", other.what, f.what);
            continue;
        }
        all.push(f);
    }
    all
}

fn not_tested(searched: &[Searched<'_>]) -> Vec<NotTested> {
    let mut all: Vec<(NotTested, Vec<&str>)> = vec![];
    for s in searched {
        let mut own: Vec<(&'static str, String)> = s.search.not_tested.clone();
        if s.target.moving {
            let why = "the base moves about this axis: record it at rest";
            let slow = |h: &Hypothesis| {
                matches!(
                    h,
                    Hypothesis::Regression(_)
                        | Hypothesis::Shaped(_)
                        | Hypothesis::Step
                        | Hypothesis::Line
                        | Hypothesis::Covariance(_)
                        | Hypothesis::Variance(_)
                        | Hypothesis::TwoLevel
                )
            };
            for c in s.search.candidates.iter().filter(|c| slow(&c.hypothesis)) {
                if own.iter().all(|o| o.0 != c.effect.id()) {
                    own.push((c.effect.id(), why.to_owned()));
                }
            }
        }
        for (cause, why) in own {
            match all
                .iter_mut()
                .find(|(n, _)| n.cause == cause && n.why == why)
            {
                Some((_, channels)) => channels.push(&s.target.name),
                None => all.push((
                    NotTested {
                        cause: cause.into(),
                        why,
                    },
                    vec![&s.target.name],
                )),
            }
        }
    }
    let order = |id: &str| EFFECTS.iter().position(|e| e.id() == id);
    all.sort_by_key(|(n, _)| order(&n.cause));
    all.into_iter()
        .map(|(mut n, channels)| {
            if channels.len() < searched.len() {
                n.why = format!("{}: {}", channels.join(", "), n.why);
            }
            n
        })
        .collect()
}

fn baseline_of(s: &Searched<'_>, state: &State, grid: &Grid) -> Parameters {
    let (unit, rate) = (s.target.unit.as_str(), grid.rate_hz);
    let white = state.solution.white.sqrt();
    let n = grid.n as f64;
    let mean = s.target.y.iter().sum::<f64>() / n;
    let errors = estimate::noise_errors(&s.search.panel, state);
    let walk = white * (state.noise.log_walk / 2.0).exp() * rate.sqrt();
    let walk_error = walk * errors.first().copied().unwrap_or(f64::NAN) / 2.0;
    let in_degrees = unit == "deg/s";
    let (density, density_unit) = if in_degrees {
        (60.0 / rate.sqrt(), "deg/sqrt(h)".to_owned())
    } else {
        (1.0 / rate.sqrt(), format!("{unit}*sqrt(s)"))
    };
    let mut all = Parameters::new();
    all.insert(
        "bias".into(),
        Parameter::estimated(
            mean,
            (white * white / n + walk * walk * n / rate / 3.0).sqrt(),
            unit,
        ),
    );
    all.insert(
        "angle_random_walk".into(),
        Parameter::estimated(
            white * density,
            white * density / (2.0 * n).sqrt(),
            &density_unit,
        ),
    );
    all.insert(
        "rate_random_walk".into(),
        Parameter::estimated(walk, walk_error, &format!("{unit}/sqrt(s)")),
    );
    all
}

fn effects_of(findings: &[Finding]) -> Vec<EffectModel> {
    let mut all = vec![];
    for f in findings {
        let Some(e) = effect(&f.cause) else { continue };
        let known = |p: &Parameters| -> Parameters {
            p.iter()
                .filter(|(k, _)| e.parameters().iter().any(|s| s.name == *k))
                .map(|(k, v)| (k.clone(), v.clone()))
                .collect()
        };
        if f.per_channel.is_empty() {
            all.push(EffectModel {
                cause: f.cause.clone(),
                channels: f.channels.clone(),
                parameters: known(&f.parameters),
            });
        }
        for (channel, p) in &f.per_channel {
            all.push(EffectModel {
                cause: f.cause.clone(),
                channels: vec![channel.clone()],
                parameters: known(p),
            });
        }
    }
    all
}

/// Smallest size of each regression that was looked for and not found: at d' = 6.3 of its own standard error with the
/// random walk averaged, which the search names 95 times in 100.
fn limits(s: &Searched<'_>, findings: &[Finding]) -> Vec<DetectionLimit> {
    const D_PRIME: f64 = 6.3;
    if s.target.moving {
        return vec![];
    }
    let own = s.state.columns();
    let g = s.state.noise.over(&s.search.panel.bins);
    let mut all = vec![];
    for c in &s.search.candidates {
        let id = c.effect.id();
        if findings
            .iter()
            .any(|f| f.cause == id && f.channels.contains(&s.target.name))
        {
            continue;
        }
        let (Hypothesis::Regression(r), [column, ..]) = (&c.hypothesis, c.columns()) else {
            continue;
        };
        if r.columns.len() > 1 {
            continue;
        }
        let solution = s
            .search
            .panel
            .solve(&g, &[own.clone(), vec![*column]].concat());
        let Some(variance) = solution.inverse.last().and_then(|row| row.last()) else {
            continue;
        };
        let name = r.columns[0].parameter;
        let spec = c
            .effect
            .parameters()
            .iter()
            .find(|p| p.name == name)
            .map_or("1", |p| p.unit);
        let unit = if s.target.unit == "deg/s" {
            spec.to_owned()
        } else {
            model::effect::unit_on(spec, &s.target.unit)
        };
        all.push(DetectionLimit {
            cause: id.into(),
            channel: s.target.name.clone(),
            parameter: name.into(),
            value: D_PRIME * (solution.white * variance).sqrt(),
            unit,
        });
    }
    all
}
