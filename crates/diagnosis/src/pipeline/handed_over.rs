//! The models that are handed over: the baseline, and the extended one with what has no name, held against the record.

use std::collections::{BTreeMap, BTreeSet};

use model::effects::high_pass;
use model::file::{EffectModel, FittedOn, ModelFile};

use super::{DiagnoseOptions, Told};
use crate::ingest::types::Grid;
use crate::replicates::{Held, Judge, held, taken_up};
use crate::report::handover;
use crate::result::{Finding, Replicated};
use crate::search::searched::Searched;
use crate::test_level::Observation;
use crate::unnamed::{self, Fitted, Wanted};

/// Models, and the record among their replicates.
pub(super) struct HandedOver {
    pub baseline_model: ModelFile,
    pub extended_model: ModelFile,
    pub replicates: BTreeMap<String, Replicated>,
    /// What the replicates say of the extended model.
    pub held: Held,
    /// What they said before terms without a name took it up.
    pub taken_up: Vec<Observation>,
}

/// Times that terms are sought for what the replicates of the model before have shown: each shows what the one before hid.
const ROUNDS: usize = 3;

/// What the models are fitted on.
fn fitted_on(grid: &Grid, options: &DiagnoseOptions) -> FittedOn {
    FittedOn {
        file: options.file.clone(),
        hash: options.hash.clone(),
        seconds: grid.seconds(),
    }
}

/// Whether a finding is what an effect of a model says.
fn is_of(f: &Finding, e: &EffectModel) -> bool {
    f.cause == e.cause && f.channels == e.channels
}

/// Channels as they were read, where a filter was undone before the search.
pub(super) struct AsRead<'a> {
    pub grid: &'a Grid,
    pub searched: Vec<Searched<'a>>,
}

/// Terms without a name are sought where the search left something; and again, where the replicates of that model do not hold
/// the record. Faults that were `mended` before the search are in the model, and not in what was fitted and is compared; a filter
/// that was undone is in the model that is compared with the record `as_read`.
pub(super) fn handed_over(
    searched: &[Searched<'_>],
    grid: &Grid,
    told: &Told,
    mended: &[Finding],
    as_read: Option<&AsRead<'_>>,
    options: &DiagnoseOptions,
    between: bool,
) -> HandedOver {
    let count = options.replicates;
    let causes: Vec<&Finding> = told.findings.iter().chain(&told.nearest).collect();
    let nearest: Vec<&Finding> = told.nearest.iter().collect();
    let (read, its) = as_read.map_or((grid, searched), |r| (r.grid, r.searched.as_slice()));
    let baseline_model = handover::baseline_model(its, read, fitted_on(grid, options));
    let is_mended = |e: &EffectModel| mended.iter().any(|f| is_of(f, e));
    let extended = |by: &Fitted| {
        let on = fitted_on(grid, options);
        let mut model = handover::extended_model(searched, grid, &causes, by, &is_mended, on);
        // Readings are counted behind a filter.
        for (channel, s) in model.channels.iter_mut().zip(its) {
            channel.lsb = s.target.lsb;
        }
        model
    };
    let mut wanted = Wanted::of(&told.unexplained);
    let mut fitted = unnamed::fit(searched, grid, &wanted, &causes, &nearest);
    let mut extended_model = extended(&fitted);
    let found = told.findings.iter().flat_map(|f| &f.channels);
    let found: BTreeSet<&String> = found
        .chain(told.unexplained.iter().map(|o| &o.channel))
        .collect();
    let is_plain = |name: &str| !found.iter().any(|f| *f == name);
    let judge = match count {
        0 => None,
        count => Judge::new(read, &baseline_model, count, options.seed).ok(),
    };
    let among = |model: &ModelFile| {
        let mut compared = model.clone();
        let undone = |e: &EffectModel| as_read.is_some() && e.cause == high_pass::ID;
        compared.effects.retain(|e| undone(e) || !is_mended(e));
        let all = judge
            .as_ref()
            .map(|j| j.of(&compared, &is_plain).unwrap_or_default());
        all.unwrap_or_default()
    };
    let mut replicates = among(&extended_model);
    let mut said = held(&replicates, &is_plain, count);
    let (first, strayed) = (replicates.clone(), said.unexplained.clone());
    // What strays the more for a round may be what it had hidden, which the next takes up: the best of them is handed over.
    let mut strays = said.unexplained.clone();
    // What strays of readings that lie between others is that they do, and no term takes it up.
    for _ in 0..if between { 0 } else { ROUNDS } {
        strays.iter().for_each(|o| wanted.add(o));
        let again = unnamed::fit(searched, grid, &wanted, &causes, &nearest);
        if again == fitted {
            break;
        }
        let model = extended(&again);
        let all = among(&model);
        let now = held(&all, &is_plain, count);
        strays.clone_from(&now.unexplained);
        if now.unexplained.len() <= said.unexplained.len() {
            (extended_model, replicates, said) = (model, all, now);
        }
        fitted = again;
    }
    let taken_up = taken_up(&first, strayed, &said, count);
    HandedOver {
        baseline_model,
        extended_model,
        replicates,
        held: said,
        taken_up,
    }
}
