//! Shocks: what the final model bears out of the blows that were left out of the readings.

use model::effect::{Effect, Found, Hypothesis};

use crate::attribute::events;
use crate::attribute::withdraw::propagate;
use crate::criticise::shock::{Felt, Fitted, fit};
use crate::ingest::blows::Blow;
use crate::ingest::types::Grid;
use crate::report::findings::experiment;
use crate::result::{Alternative, Finding, Gain, sentence};
use crate::search::searched::Searched;
use crate::test_level::CheckId;

/// The finding of each blow; none of one that the final model does not bear out, by those channels whose noise does not make
/// such readings by itself, neither as a whole nor by a process that is not what its name claims. `failing` tells of a channel and
/// a check.
pub(crate) fn findings(
    searched: &[&Searched<'_>],
    blows: &[Blow],
    grid: &Grid,
    failing: &dyn Fn(&str, CheckId) -> bool,
) -> Vec<Option<Finding>> {
    let mut candidates = searched.iter().flat_map(|s| &s.search.candidates);
    let of = candidates.find(|c| matches!(c.hypothesis, Hypothesis::Blow));
    let Some(of) = of.map(|c| c.effect) else {
        return vec![None; blows.len()];
    };
    let each = blows.iter().map(|blow| {
        let fitted = fit(blow, searched, grid.rate_hz)?;
        let by_noise = |k: usize| {
            let name = searched[k].target.name.as_str();
            events::lawless(&|id| failing(name, id))
        };
        let part = |k: usize| events::is_part_of_more(searched[k], &blow.readings, fitted.lr);
        if fitted.felt.iter().any(|felt| part(felt.channel)) {
            return None;
        }
        let by_process = |felt: &&Felt| {
            let s = searched[felt.channel];
            let name = s.target.name.as_str();
            propagate::is_of_a_process(s, felt.lr, felt.by_processes, &|id| failing(name, id))
        };
        let lawful = fitted.felt.iter().filter(|felt| !by_noise(felt.channel));
        let lawful = lawful.filter(|felt| !by_process(felt));
        let told: f64 = lawful.map(|felt| felt.lr).sum();
        (told >= fitted.least).then(|| finding(of, &fitted, searched, grid))
    });
    each.collect()
}

fn finding(of: &dyn Effect, fitted: &Fitted, searched: &[&Searched<'_>], grid: &Grid) -> Finding {
    let each = fitted.felt.iter().map(|felt| {
        let target = searched[felt.channel].target;
        let parameters = of.describe(&Found {
            unit: target.unit.clone(),
            rate_hz: grid.rate_hz,
            coefficients: std::iter::once(felt.peak).chain(felt.phase).collect(),
            location: fitted.location.clone(),
            ..Found::default()
        });
        (target.name.clone(), parameters)
    });
    let each: Vec<_> = each.collect();
    let channels: Vec<String> = each.iter().map(|(name, _)| name.clone()).collect();
    let parameters = each.first().map(|(_, p)| p.clone()).unwrap_or_default();
    let mut alternatives = vec![];
    if fitted.single {
        // One reading of several channels: knocked together, or read wrongly together.
        alternatives.push(Alternative {
            cause: model::effects::outliers::ID.into(),
            log_odds: 0.0,
        });
    }
    let begin = fitted.location.first().map_or(0.0, |l| l.0);
    let samples = grid.n as f64;
    Finding {
        cause: of.id().into(),
        experiment: experiment(of, &alternatives),
        alternatives,
        gain: Some(Gain {
            delta_bic: Some(fitted.lr - fitted.freedom as f64 * samples.ln()),
            ablation_nats: Some(fitted.lr / 2.0),
            ..Gain::default()
        }),
        what: format!(
            "{}. No error of the sensor",
            sentence(of, &channels.join(", "), &parameters)
        ),
        times_s: vec![begin],
        likelihood_ratio: Some(fitted.lr),
        per_channel: if each.len() > 1 {
            each.into_iter().collect()
        } else {
            Default::default()
        },
        parameters,
        channels,
        ..Finding::default()
    }
}
