//! What the simulation of a sensor gets wrong, and why.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::rc::Rc;

use model::effect::{Hypothesis, Parameters, View};
use model::effects::{EFFECTS, effect};
use model::file::{ChannelModel, EffectModel, FittedOn, ModelFile};
use model::record::Record;

use crate::attribute::{events, masking, withdraw};
use crate::audit::{Audit, audit, sign_bit};
use crate::criticise::common_noise::{Shared, common};
use crate::criticise::cross_axis::couplings;
use crate::criticise::{follower_shape, process, random_walk, residual, short_time, variance_law};
use crate::fit::channel::{Note, State};
use crate::fit::likelihood::{Bins, Panel};
use crate::fit::{channel, estimate};
use crate::ingest::dead;
use crate::ingest::grid::{Grid, Target, lay_out};
use crate::records::error::AnalysisError;
use crate::records::rows;
use crate::replicates;
use crate::report::findings::{
    blows, complete, joined, loud, motion_findings, scale_finding, term_findings, turning,
    variance_finding,
};
use crate::report::{detection_limits, figures};
use crate::result::{
    Check, DIAGNOSIS_FORMAT, Diagnosed, Diagnosis, Finding, Input, NotTested, Parameter,
    Unexplained, Verdict,
};
use crate::search::searched::Searched;
use crate::search::{Search, bands, impute};
use crate::test_level;
use crate::test_level::OMNIBUS_LEVEL;
use crate::two_level::compare;

/// Options of [`diagnose`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DiagnoseOptions {
    /// Seed of whatever is random (fill of lost samples, replicates).
    pub seed: u64,
    /// Name of the file, for the report.
    pub file: String,
    /// Digest of the file, for the model file.
    pub hash: Option<String>,
    /// Whether [`Diagnosed::evidence`], which a report alone shows, is left out.
    pub no_evidence: bool,
    /// Replicates of the model before and after that the record is held against; 0 for none. Where there are some, a
    /// model is extended only if they hold the record ([`crate::replicates`]).
    pub replicates: usize,
}

/// Diagnose a record.
///
/// # Errors
/// [`AnalysisError::Inconclusive`] when the record is too short, [`AnalysisError::NoChannel`] when it holds no gyro,
/// [`AnalysisError::NoRate`] when its sample rate is unknown, [`AnalysisError::Constant`] when a gyro never changes,
/// [`AnalysisError::NeverNew`] when no gyro's readings are flagged as new.
pub fn diagnose(record: &Record, options: &DiagnoseOptions) -> Result<Diagnosed, AnalysisError> {
    Ok(diagnosed(
        prepared(Cow::Borrowed(record), options.seed)?,
        options,
    ))
}

/// As [`diagnose`], of a record that nobody needs any longer: the search has its memory.
///
/// # Errors
/// Those of [`diagnose`].
pub fn diagnose_owned(
    record: Record,
    options: &DiagnoseOptions,
) -> Result<Diagnosed, AnalysisError> {
    Ok(diagnosed(
        prepared(Cow::Owned(record), options.seed)?,
        options,
    ))
}

/// What the search needs of a record, and what was seen of it before.
struct Prepared {
    grid: Grid,
    audited: Audit,
    sticking: Vec<Finding>,
    dead: Vec<Unexplained>,
    samples: usize,
    channels: Vec<String>,
    notes: Vec<String>,
}

fn prepared(record: Cow<'_, Record>, seed: u64) -> Result<Prepared, AnalysisError> {
    let record = &*rows::in_order(&record);
    let record = &*rows::longest_part(record);
    let (alive, dead) = dead::left_out(record)?;
    let (mended, sticking) = sign_bit::mend(&alive);
    let record = &*mended;
    let mut audited = audit(record);
    // Put right by the sign, but for the readings that lay beyond the bit.
    for f in &sticking {
        audited.put_right(f);
    }
    let record = &*masking::renumbered(record, &audited);
    let grid = lay_out(record, &|name| audited.masked(name), seed)?;
    Ok(Prepared {
        grid,
        audited,
        sticking,
        dead,
        samples: record.len(),
        channels: record.channels.iter().map(|c| c.name.clone()).collect(),
        notes: record.notes.clone(),
    })
}

fn diagnosed(of: Prepared, options: &DiagnoseOptions) -> Diagnosed {
    let Prepared {
        grid,
        mut audited,
        sticking,
        dead,
        samples,
        channels,
        notes,
    } = of;
    let mut searched: Vec<Searched<'_>> = grid.targets.iter().map(|t| search(&grid, t)).collect();
    grid.dct.forget();
    let mut findings = sticking;
    findings.extend(masking::findings(&audited, &searched, &grid));
    let mut findings = turning(findings, &grid);
    let mut scale_not_tested = vec![];
    let mut smallest = std::mem::take(&mut audited.limits);
    let mut checks: Vec<Check> = searched
        .iter_mut()
        .flat_map(|s| std::mem::take(&mut s.checks))
        .collect();
    masking::suppress(&mut checks, &audited);
    let shared = common(&searched, &grid);
    checks.extend(couplings(&searched, &grid));
    let mut nearest = vec![];
    let mut doubts = vec![];
    for s in &searched {
        let fails = || {
            let all = checks.iter().chain(&audited.checks);
            all.filter(|c| c.channel == s.target.name && c.fails_after)
        };
        let failing = |id: &str| fails().any(|c| c.id == id);
        let (moved, told) = motion_findings(s, &grid, &failing);
        findings.extend(moved);
        doubts.extend(told);
        let of_terms = term_findings(s, &grid, options.seed);
        // What an axis takes from another one later has a spectrum, and is no process of its own.
        let late = shared.late.iter().filter(|l| l.0 == s.target.name);
        let mut colours = fails().filter(|c| c.id == test_level::COLOUR);
        let left = withdraw::Left {
            late: late.map(|l| l.1).sum(),
            colour: colours.next().map_or(0.0, |c| c.statistic),
            said: fails().map(|c| c.what.clone()).collect(),
        };
        // A bit that sticks makes a noise of its own, which depends on the level.
        let by_counts = s.variance.as_ref().is_some_and(|v| {
            let more = v.parameters.get("variance_increase");
            let ratio = more.map(|p| 1.0 + p.value);
            audited.explains_variance(&s.target.name, v.lr, v.threshold, ratio)
        });
        let variance = variance_finding(s).filter(|_| !by_counts);
        let (kept, doubted, told) = withdraw::withdraw(s, of_terms, variance, &failing, &left);
        doubts.extend(withdraw::propagate::stale(s, &mut findings, &failing));
        doubts.extend(events::hold_outliers(s, &kept, &mut findings, &failing));
        findings.extend(kept);
        nearest.extend(doubted);
        doubts.extend(told);
        match scale_finding(s, &grid) {
            Ok(scaled) => {
                findings.extend(scaled.finding);
                smallest.extend(scaled.limit);
            }
            Err((cause, why)) => scale_not_tested.push(NotTested {
                cause: cause.into(),
                why: format!("{}: {why}", s.target.name),
            }),
        }
    }
    let notes = [notes, std::mem::take(&mut audited.notes)].concat();
    let mut unexplained = left_over(&checks, &shared);
    for s in &searched {
        let note = |note: &Note| Unexplained {
            channel: s.target.name.clone(),
            what: note.what.clone(),
        };
        unexplained.extend(s.state.notes.iter().map(note));
        unexplained.extend(astray(s));
    }
    unexplained.extend(dead);
    unexplained.extend(doubts);
    checks.extend(shared.checks);
    checks.extend(audited.checks);
    unexplained.extend(audited.unexplained);
    // What was found on the channel may have bent the distribution; then the residual decides.
    let bent = |name: &str| {
        let found = |s: &&Searched<'_>| {
            !s.state.terms.is_empty() || s.variance.is_some() || s.target.moving
        };
        let tails = |c: &Check| c.id == "kurtosis" && c.channel == name && c.fails_after;
        let mut own = searched.iter().filter(|s| s.target.name == name);
        own.any(|s| found(&s)) && !checks.iter().any(tails)
    };
    unexplained.extend(audited.not_normal.into_iter().filter(|u| !bent(&u.channel)));
    if let Some(finding) = shared.finding {
        if withdraw::propagate::shared_falls(&finding, &checks) {
            unexplained.push(withdraw::nearest_of(&finding.channels[0], &finding.what));
            nearest.push(finding);
        } else {
            findings.push(finding);
        }
    }
    smallest.extend(searched.iter().flat_map(|s| s.limits.iter().cloned()));
    smallest.extend(shared.limits);
    // What the audit could not ask a channel for has no smallest size there.
    smallest.retain(|l| {
        let here = format!("{}: ", l.channel);
        let of = |n: &NotTested| n.cause == l.cause && n.why.starts_with(&here);
        !audited.not_tested.iter().any(of)
    });
    let findings = complete(joined(loud(blows(findings))));
    let mut not_tested = not_tested(&searched);
    not_tested.extend(scale_not_tested);
    not_tested.extend(audited.not_tested);
    let mut verdict = match (unexplained.is_empty(), findings.is_empty()) {
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
    let baseline_model = model(&|s| baseline_of(s, &s.baseline, &grid), vec![]);
    let extended_model = model(
        &|s| baseline_of(s, &s.state, &grid),
        effects_of(findings.iter().chain(&nearest)),
    );
    let replicates = match options.replicates {
        0 => BTreeMap::new(),
        count => replicates::judge(&grid, &baseline_model, &extended_model, count, options.seed)
            .unwrap_or_default(),
    };
    let held = replicates::held(&replicates, verdict, options.replicates);
    if !held.unexplained.is_empty() {
        verdict = Verdict::Unexplained;
    }
    checks.extend(held.checks);
    unexplained.extend(held.unexplained);
    Diagnosed {
        baseline_model,
        extended_model,
        evidence: (searched.iter().filter(|_| !options.no_evidence))
            .flat_map(|s| figures::of_channel(s, &grid))
            .collect(),
        diagnosis: Diagnosis {
            format: DIAGNOSIS_FORMAT.into(),
            input: Input {
                file: options.file.clone(),
                seconds: grid.n as f64 / grid.rate_hz,
                rate_hz: grid.rate_hz,
                samples,
                channels,
                notes,
            },
            baseline,
            checks,
            detection_limits: detection_limits::of_not_found(smallest, &findings),
            findings,
            unexplained,
            not_tested,
            replicates,
            verdict,
        },
    }
}

/// An axis that moves on a table that turns another one.
fn astray(s: &Searched<'_>) -> Option<Unexplained> {
    s.target.astray.then(|| Unexplained {
        channel: s.target.name.clone(),
        what: format!(
            "moves by {:.2} deg/s rms and does not follow the axis that the table turns: it was searched for no cause; where the stand was shaken or tilted, say `base: moving`",
            s.target.motion_rms
        ),
    })
}

fn search<'a>(grid: &'a Grid, target: &'a Target) -> Searched<'a> {
    let coefficients = &target.coefficients;
    let bins = match bands::peaks(coefficients, &target.noise, target.white, &grid.bins) {
        none if none.is_empty() => Rc::clone(&grid.bins),
        peaks => Rc::new(Bins::about(grid.n, &peaks)),
    };
    let panel = Panel::of(&grid.dct, &bins, Rc::clone(coefficients));
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
    let mut search = Search::new(panel, view);
    search.read = 1.0 - target.lost.len() as f64 / grid.n as f64;
    let baseline = search.baseline(&target.noise);
    let mut plain = channel::whitened(&search.panel, &baseline);
    let plain_checks = |(u, e): &(Vec<f64>, Vec<f64>)| {
        let step = target.step / baseline.solution.white.sqrt();
        residual::all(u, e, grid.rate_hz, step)
    };
    let mut before = plain_checks(&plain);
    let ascended = search.ascend(baseline.clone());
    let mut state = search.conclude(compare::hold(&search, ascended));
    let refilled = impute::again(&search, &state, target);
    if let Some(refilled) = refilled.clone() {
        state = refilled;
        if state.terms.is_empty() {
            plain = channel::whitened(&search.panel, &state);
            before = plain_checks(&plain);
        }
    }
    let told = refilled.map(|s| impute::told(&search, &s, &target.lost));
    let found = estimate::found(&search.panel, &state, &target.unit, grid.rate_hz);
    let (u, e) = if state.terms.is_empty() {
        plain
    } else {
        drop(plain);
        channel::whitened(&search.panel, &state)
    };
    let mut s = Searched {
        target,
        search,
        baseline,
        state,
        found,
        e,
        u,
        told,
        checks: vec![],
        variance: None,
        limits: vec![],
        laws: vec![],
    };
    s.limits = detection_limits::of_channel(&s);
    s.laws = follower_shape::of_followers(&s.search, &s.state);
    s.search.panel.release(&s.state.columns());
    grid.dct.keep_no_more();
    if !target.moving {
        s.variance = variance_law::best(&s);
    }
    if let Some(v) = &s.variance {
        s.e.iter_mut().zip(&v.law).for_each(|(e, v)| *e /= v.sqrt());
    }
    s.checks = channel_checks(&s, before);
    s
}

fn channel_checks(s: &Searched<'_>, before: Vec<test_level::Outcome>) -> Vec<Check> {
    let after = if s.state.terms.is_empty() && s.variance.is_none() {
        before.clone()
    } else {
        residual::all(&s.u, &s.e, s.search.view.rate_hz, s.step())
    };
    // Before a process was named nothing was claimed of it.
    let claims = process::of_processes(&s.search, &s.state);
    let mut rhythms = after.iter().filter(|c| c.id == test_level::RHYTHM);
    let stationary = rhythms.next().and_then(|r| process::stationary(s, r));
    let claims = claims.into_iter().chain(stationary);
    let laws = s.laws.iter().map(|(_, outcome)| outcome.clone());
    let laws = laws.chain(variance_law::claims(s));
    let claims = claims.chain(laws).map(|c| Check {
        id: c.id.into(),
        channel: s.target.name.clone(),
        statistic: c.statistic,
        p_value: Some(c.p_value),
        threshold: test_level::CLAIM_LEVEL,
        fails_before: false,
        fails_after: c.p_value < test_level::CLAIM_LEVEL,
        what: c.what,
    });
    before
        .into_iter()
        .zip(after)
        .map(|(b, a)| Check {
            id: b.id.into(),
            channel: s.target.name.clone(),
            statistic: b.statistic,
            p_value: Some(b.p_value),
            threshold: OMNIBUS_LEVEL,
            fails_before: b.p_value < OMNIBUS_LEVEL,
            // A base that moves is told as an input; what it leaves in the residual is no riddle.
            fails_after: a.p_value < OMNIBUS_LEVEL && !s.target.moving && !s.search.view.sways(),
            what: if a.p_value < OMNIBUS_LEVEL {
                a.what
            } else {
                b.what
            },
        })
        .chain(claims)
        .chain(short_time::checks(s))
        .chain(random_walk::check(s))
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

fn not_tested(searched: &[Searched<'_>]) -> Vec<NotTested> {
    let mut all: Vec<(NotTested, Vec<&str>)> = vec![];
    let sways = searched.iter().any(|s| s.search.view.sways());
    for s in searched {
        let mut own: Vec<(&'static str, String)> = s.search.not_tested.clone();
        let in_library = |id: &str| id != channel::ID;
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
                        | Hypothesis::WanderingTone
                )
            };
            for c in s.search.candidates.iter().filter(|c| slow(&c.hypothesis)) {
                if in_library(c.effect.id()) && own.iter().all(|o| o.0 != c.effect.id()) {
                    own.push((c.effect.id(), why.to_owned()));
                }
            }
        }
        if sways && !s.target.moving {
            let why = "the base sways, and turns a little about this axis too: record it at rest";
            let unsafe_here = |h: &Hypothesis| {
                matches!(
                    h,
                    Hypothesis::Line | Hypothesis::WanderingTone | Hypothesis::Covariance(_)
                )
            };
            for c in s
                .search
                .candidates
                .iter()
                .filter(|c| unsafe_here(&c.hypothesis))
            {
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
            white * density / (2.0 * n).sqrt() * state.wider.first().unwrap_or(&1.0),
            &density_unit,
        ),
    );
    all.insert(
        "rate_random_walk".into(),
        Parameter::estimated(walk, walk_error, &format!("{unit}/sqrt(s)")),
    );
    all
}

/// The effects of the extended model: the causes, and what stands for the unexplained in it.
fn effects_of<'a>(findings: impl Iterator<Item = &'a Finding>) -> Vec<EffectModel> {
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
            let whole = f.components.is_empty().then_some(&f.parameters);
            all.extend(whole.into_iter().chain(&f.components).map(|p| EffectModel {
                cause: f.cause.clone(),
                channels: f.channels.clone(),
                parameters: known(p),
            }));
        }
        // What is the same to the last digit on several channels is one event on all of them.
        let first = all.len();
        for (channel, p) in &f.per_channel {
            let parameters = known(p);
            match all[first..].iter_mut().find(|e| e.parameters == parameters) {
                Some(same) => same.channels.push(channel.clone()),
                None => all.push(EffectModel {
                    cause: f.cause.clone(),
                    channels: vec![channel.clone()],
                    parameters,
                }),
            }
        }
    }
    all
}
