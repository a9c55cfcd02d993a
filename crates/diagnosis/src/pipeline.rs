//! What the simulation of a sensor gets wrong, and why: the order of the steps. Each takes values and gives values.
//!
//! | step | takes | gives |
//! |---|---|---|
//! | [`prepared`] | a record | its grid, what the audits saw in counts and frames, where it may have been knocked |
//! | [`channel::searched`] | a channel of the grid | its model, residual and checks |
//! | [`tested`] | all channels | checks of one by the others, what axes share |
//! | [`name_channel`] | a channel, its checks | findings, and names withdrawn |
//! | [`concluded`] | all of that | the lists of the diagnosis |

mod at_rest;
mod banks;
mod between;
mod channel;
mod concluded;
mod far_readings;
mod handed_over;
mod high_passed;
mod prepared;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

use model::record::Record;

use crate::attribute::{events, masking, merge, withdraw};
use crate::audit::Audit;
use crate::criticise::common_noise::{Late, Shared, common};
use crate::criticise::cross_axis::couplings;
use crate::criticise::one_source::{self, OneSource};
use crate::fit::channel::VarianceFound;
use crate::ingest::types::Grid;
use crate::replicates;
use crate::report::entries::{Ranked, entries, rank};
use crate::report::findings::{motion_findings, scale_finding, term_findings, variance_finding};
use crate::report::{detection_limits, figures, gain, handover, shocks};
use crate::result::{
    Check, DIAGNOSIS_FORMAT, DetectionLimit, Diagnosed, Diagnosis, Finding, NotTested, Unexplained,
    Verdict,
};
use crate::search::searched::Searched;
use crate::test_level::{CheckId, Observation, all_worded, on_two_threads, worded};
pub use banks::diagnose_channels;
use concluded::{Told, concluded};
use handed_over::{AsRead, HandedOver};
use model::record::AnalysisError;
use model::record::rows::Bursts;
use prepared::{Prepared, prepared};

/// Options of [`diagnose`].
#[derive(Clone, Debug, PartialEq)]
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
    /// Relative change of an angle or a deviation from which on a cause, or what has no name, is material.
    pub matters: f64,
}

/// Change that matters where nobody says: 5 %, which takes 100 independent readings of a deviation to see at all.
pub const MATTERS: f64 = 0.05;

impl Default for DiagnoseOptions {
    fn default() -> Self {
        Self {
            seed: 0,
            file: String::new(),
            hash: None,
            no_evidence: false,
            replicates: 0,
            matters: MATTERS,
        }
    }
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

fn diagnosed(mut of: Prepared, options: &DiagnoseOptions) -> Diagnosed {
    let at_rest = at_rest::believed(&mut of.grid);
    far_readings::settle(&mut of.grid, &of.audited, &of.singles, &of.blows);
    let between = std::mem::take(&mut of.audited.between);
    let mut searched = channel::all_searched(&of.grid, !between.is_empty());
    of.grid.dct.forget();
    let tested = tested(&mut searched, &of.audited, &of.grid);
    let shocks = match held(&searched, &tested, &of) {
        Ok(shocks) => shocks,
        Err(borne_out) => {
            drop(searched);
            of.audited.between = between;
            return diagnosed(of.with_those(&borne_out), options);
        }
    };
    let named = name_all(&mut searched, &tested, &of, shocks, options.seed);
    let Prepared {
        ref grid,
        mut audited,
        sticking: mended,
        dead,
        ref as_read,
        mut input,
        ..
    } = of;
    input.notes.append(&mut audited.notes);
    input.file.clone_from(&options.file);
    let mut told = concluded(&searched, tested, audited, dead, named);
    between::without_names(&mut told, &between);
    at_rest::with_motion(&mut told.findings, &at_rest);
    gain::complete(&mut told.findings, &searched, grid, &mended);
    let as_read = as_read.as_ref().map(|grid| AsRead {
        grid,
        searched: channel::all_searched(grid, !between.is_empty()),
    });
    let mut models = handed_over::handed_over(
        &searched,
        grid,
        &told,
        &mended,
        as_read.as_ref(),
        options,
        !between.is_empty(),
    );
    let is_told = |o: &Observation| between::tells(o, &between);
    told.unexplained.retain(|o| !is_told(o));
    models.held.unexplained.retain(|o| !is_told(o));
    models.taken_up.retain(|o| !is_told(o));
    let strays = !models.held.unexplained.is_empty();
    let mut unexplained = ranked_entries(&mut told, &mut models, &searched, grid, options);
    if let Some(bursts) = &grid.bursts {
        bursts.part(&mut models.baseline_model);
        bursts.part(&mut models.extended_model);
        as_they_passed(&mut told.findings, &mut unexplained, bursts);
    }
    // Without replicates nothing says that what is left does not matter.
    let unnamed = (unexplained.iter()).any(|u| u.material || options.replicates == 0);
    Diagnosed {
        diagnosis: Diagnosis {
            format: DIAGNOSIS_FORMAT.into(),
            baseline: handover::parameters_of(&models.baseline_model),
            extended: handover::parameters_of(&models.extended_model),
            detection_limits: detection_limits::of_not_found(told.limits, &told.findings),
            verdict: match (strays || unnamed, told.findings.is_empty()) {
                (true, _) => Verdict::Unexplained,
                (false, true) => Verdict::Adequate,
                (false, false) => Verdict::Extended,
            },
            replicates: models.replicates,
            input,
            checks: told.checks,
            findings: told.findings,
            unexplained,
            not_tested: told.not_tested,
        },
        baseline_model: models.baseline_model,
        extended_model: models.extended_model,
        evidence: match options.no_evidence {
            true => vec![],
            false => on_two_threads(&mut searched, |s| figures::of_channel(s, grid)).concat(),
        },
    }
}

/// What is named: of the counts, the far readings, the shocks, and then channel by channel.
fn name_all(
    searched: &mut [Searched<'_>],
    tested: &Tested,
    of: &Prepared,
    shocks: Vec<Finding>,
    seed: u64,
) -> Named {
    let (grid, audited) = (&of.grid, &of.audited);
    let knocked: Vec<Range<usize>> = of.blows.iter().map(|b| b.readings.clone()).collect();
    let far = masking::findings(audited, searched, grid);
    let findings = [all_worded(of.sticking.clone()), all_worded(far)].concat();
    let mut findings = merge::turning(findings, &knocked, grid);
    findings.extend(all_worded(shocks));
    let first = Named {
        findings,
        limits: audited.limits.clone(),
        ..Named::default()
    };
    let mut of_terms = on_two_threads(&mut *searched, |s| term_findings(s, grid, seed));
    let searched = &*searched;
    one_source::state(&mut of_terms, searched, &tested.sources, grid.rate_hz);
    let name = |named, (s, of_terms)| {
        name_channel(
            named,
            s,
            all_worded(of_terms),
            searched,
            tested,
            audited,
            grid,
        )
    };
    searched.iter().zip(of_terms).fold(first, name)
}

/// What has no name, by place; causes and entries get their ranks. What the replicates say of the models is told with the rest.
fn ranked_entries(
    told: &mut Told,
    models: &mut HandedOver,
    searched: &[Searched<'_>],
    grid: &Grid,
    options: &DiagnoseOptions,
) -> Vec<Unexplained> {
    let matters = options.matters;
    for f in &mut told.findings {
        f.material = true;
    }
    if options.replicates > 0 {
        let (model, seed) = (&models.extended_model, options.seed);
        replicates::consequence::state(&mut told.findings, model, grid, matters, seed);
    }
    told.checks.append(&mut models.held.checks);
    let mut left = std::mem::take(&mut told.unexplained);
    left.append(&mut models.held.unexplained);
    left.append(&mut models.taken_up);
    let terms = &models.extended_model.unnamed;
    let mut unexplained = entries(left, searched, grid, terms, matters);
    ranked(&mut told.findings, &mut unexplained);
    unexplained
}

/// The shocks, where the final model bears out each of the blows that were left out of the readings.
///
/// # Errors
/// Which of them it does.
fn held(
    searched: &[Searched<'_>],
    tested: &Tested,
    of: &Prepared,
) -> Result<Vec<Finding>, Vec<bool>> {
    let all: Vec<&Searched<'_>> = searched.iter().collect();
    let failing = |channel: &str, id: CheckId| {
        let mut checks = tested.checks.iter();
        checks.any(|c| c.channel == channel && c.id == id && c.fails_after)
    };
    let shocks = shocks::findings(&all, &of.blows, &of.grid, &failing);
    if shocks.iter().all(Option::is_some) {
        return Ok(shocks.into_iter().flatten().collect());
    }
    Err(shocks.iter().map(Option::is_some).collect())
}

/// Times of what was found in bursts laid end to end.
fn as_they_passed(findings: &mut [Finding], unexplained: &mut [Unexplained], bursts: &Bursts) {
    let of = |t: &mut f64| *t = bursts.time(*t);
    findings
        .iter_mut()
        .flat_map(|f| &mut f.times_s)
        .for_each(of);
    for entry in unexplained {
        entry.times_s.iter_mut().for_each(of);
        entry.span_s.iter_mut().flatten().for_each(of);
    }
}

/// Gives causes and entries their places, and puts them in that order.
fn ranked(findings: &mut [Finding], unexplained: &mut [Unexplained]) {
    let causes = findings.iter_mut().map(|f| f as &mut dyn Ranked);
    let entries = unexplained.iter_mut().map(|u| u as &mut dyn Ranked);
    rank(causes.chain(entries).collect());
    findings.sort_by_key(|f| f.rank);
    unexplained.sort_by_key(|u| u.rank);
}

/// The checks of all channels, those that a fault of the counts explains put right.
struct Tested {
    /// Of channels alone, and of one by the others.
    checks: Vec<Check>,
    /// What the axes share.
    shared: Shared,
    /// Bands that several of them feel.
    sources: Vec<OneSource>,
}

fn tested(searched: &mut [Searched<'_>], audited: &Audit, grid: &Grid) -> Tested {
    let own = searched.iter_mut();
    let mut checks: Vec<Check> = own.flat_map(|s| std::mem::take(&mut s.checks)).collect();
    masking::suppress(&mut checks, audited);
    let sources = one_source::found(searched);
    let whole = one_source::taken_apart(searched, &sources);
    let mut shared = common(searched, grid);
    shared.checks = all_worded(shared.checks);
    one_source::put_back(searched, whole);
    let alone = one_source::alone(searched, &sources);
    checks.extend(all_worded(couplings(searched, &alone, grid)));
    Tested {
        checks,
        shared,
        sources,
    }
}

/// What is named so far.
#[derive(Default)]
struct Named {
    /// Causes.
    findings: Vec<Finding>,
    /// What stands in the model for what has no name.
    nearest: Vec<Finding>,
    /// Names that were withdrawn.
    withdrawn: Vec<Observation>,
    /// Smallest sizes that would have been found.
    limits: Vec<DetectionLimit>,
    /// What could not be asked.
    not_tested: Vec<NotTested>,
}

/// Adds what is named on a channel: motion, then its terms, `of_terms`, and the law of the variance that the checks bear out. Names that
/// stand already may fall by what is found here.
fn name_channel(
    mut named: Named,
    s: &Searched<'_>,
    of_terms: Vec<Finding>,
    searched: &[Searched<'_>],
    tested: &Tested,
    audited: &Audit,
    grid: &Grid,
) -> Named {
    let all = tested.checks.iter().chain(&audited.checks);
    let fails: Vec<&Check> = all
        .filter(|c| c.channel == s.target.name && c.fails_after)
        .collect();
    let failing = |id: CheckId| fails.iter().any(|c| c.id == id);
    let (moved, unmoved) = motion_findings(s, grid, &failing);
    named.findings.extend(all_worded(moved));
    named.withdrawn.extend(all_worded(unmoved));
    let of_law = |v: &VarianceFound| {
        let told = !by_counts(s, v, audited);
        told.then(|| worded(variance_finding(s, v)))
    };
    let variance = s.variance.each.iter().map(of_law).collect();
    let left = left_on(s, searched, &fails, &tested.shared);
    let (kept, nearest, told) = withdraw::withdraw(s, of_terms, variance, &failing, &left);
    let findings = &mut named.findings;
    let stale = withdraw::propagate::stale(s, findings, &failing);
    let outliers = events::hold_outliers(s, &kept, findings, &failing);
    findings.extend(kept);
    named.nearest.extend(nearest);
    named
        .withdrawn
        .extend([stale, outliers, told].into_iter().flatten());
    match scale_finding(s, grid) {
        Ok(scaled) => {
            named.findings.extend(scaled.finding);
            named.limits.extend(scaled.limit);
        }
        Err((cause, why)) => named.not_tested.push(NotTested {
            cause: cause.into(),
            why: format!("{}: {why}", s.target.name),
        }),
    }
    named
}

/// What the failing checks leave on a channel.
fn left_on<'a>(
    s: &Searched<'_>,
    searched: &'a [Searched<'_>],
    fails: &[&Check],
    shared: &Shared,
) -> withdraw::Left<'a> {
    // What an axis takes from another one later has a spectrum, and is no process of its own.
    let late: Vec<&Late> = (shared.late.iter())
        .filter(|l| l.second == s.target.name)
        .collect();
    let first = |o: &&Searched<'_>| late.iter().any(|l| l.first == o.target.name);
    let mut colours = fails.iter().filter(|c| c.id == CheckId::ColourFollows);
    withdraw::Left {
        late: late.iter().map(|l| l.chi_square).sum(),
        before: (searched.iter().filter(first))
            .map(|o| o.u.as_slice())
            .collect(),
        colour: colours.next().map_or(0.0, |c| c.statistic),
        about: channels_of(fails),
    }
}

/// The recorded channels that failing checks are about, with the chi-square (of two degrees of freedom) that has the chance of the
/// check that tells most; of a plain limit it is infinite.
fn channels_of(fails: &[&Check]) -> BTreeMap<String, f64> {
    let mut all = BTreeMap::<String, f64>::new();
    for check in fails {
        let chi_square = check.p_value.map_or(f64::INFINITY, |p| -2.0 * p.ln());
        for name in &check.about {
            let most = all.entry(name.clone()).or_default();
            *most = most.max(chi_square);
        }
    }
    all
}

/// Whether counts explain a law of the variance: a bit that sticks makes a noise of its own, which depends on the level.
fn by_counts(s: &Searched<'_>, v: &VarianceFound, audited: &Audit) -> bool {
    let more = v.parameters.get("variance_increase");
    let ratio = more.map(|p| 1.0 + p.value);
    audited.explains_variance(&s.target.name, v.lr, v.threshold, ratio)
}

#[cfg(test)]
mod tests {
    use model::docs::example;
    use model::effects::effect;

    use super::*;
    use crate::test_level::rewording;

    /// Everything but texts.
    fn decided(d: Diagnosis) -> Diagnosis {
        let none = String::new;
        let mut d = d;
        d.checks.iter_mut().for_each(|c| c.what = none());
        d.findings.iter_mut().for_each(|f| f.what = none());
        d.unexplained.iter_mut().for_each(|u| u.what = none());
        d.not_tested.iter_mut().for_each(|n| n.why = none());
        d.input.notes = vec![];
        d
    }

    #[test]
    fn no_verdict_hangs_on_the_wording_of_a_message() {
        // Followers of channels, a process, noise by a channel, a fault of the counts: what the rules compare channels of.
        let causes = [
            "temperature",
            "motor_noise",
            "motor_bias",
            "g_sensitivity",
            "gauss_markov",
            "coarse_lsb",
            "common_noise",
            "telegraph",
        ];
        for cause in causes {
            let model = example(effect(cause).unwrap(), true);
            let record = model::simulate(&model, 120.0, 20.0, 3).unwrap();
            let told = || {
                diagnose(&record, &DiagnoseOptions::default())
                    .unwrap()
                    .diagnosis
            };
            let reworded = rewording::during(told);
            let plain = told();
            let texts = |d: &Diagnosis| -> Vec<String> {
                d.checks.iter().map(|c| c.what.clone()).collect()
            };
            assert_ne!(
                texts(&plain),
                texts(&reworded),
                "{cause}: no text was replaced"
            );
            assert_eq!(decided(plain), decided(reworded), "{cause}");
        }
    }
}
