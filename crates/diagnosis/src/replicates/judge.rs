//! Both models of a diagnosis held against their record.

use std::collections::BTreeMap;
use std::ops::Range;
use std::panic::resume_unwind;
use std::thread;

use model::file::{ChannelModel, ModelFile};
use model::record::Record;
use model::simulate::{Replicas, SimulateError};

use super::envelope::Table;
use super::statistics::{Battery, Subject};
use super::verdict::{MORE, limit};
use super::world::{Measured, Parts, bridge, in_steps, measured, record_of};

use crate::ingest::grid::lay_out;
use crate::ingest::types::Grid;
use crate::result::{Among, Replicated};
use model::record::AnalysisError;

/// A record on its grid, ready to be held against models.
struct Judged<'a> {
    grid: &'a Grid,
    record: Record,
    compared: Compared,
}

/// What of a record is compared with replicates, and how.
struct Compared {
    parts: Parts,
    measured: Vec<Measured>,
    battery: Battery,
}

impl<'a> Judged<'a> {
    /// With the baseline, by whose noise spectra are whitened.
    pub fn new(grid: &'a Grid, baseline: &ModelFile) -> Self {
        let parts = Parts::of(grid.n, grid.rate_hz);
        let record = record_of(grid);
        let subjects: Vec<Subject> = (grid.targets.iter())
            .map(|t| Subject {
                name: t.name.clone(),
                unit: t.unit.clone(),
                step: t.step,
                counted: t.lsb.is_some(),
                walk: walk_over_white(
                    baseline.channels.iter().find(|c| c.name == t.name),
                    grid.rate_hz,
                ),
            })
            .collect();
        let compared = Compared {
            battery: Battery::new(&subjects, &record, grid.rate_hz, &parts),
            measured: grid.targets.iter().map(|t| measured(t, &parts)).collect(),
            parts,
        };
        Self {
            grid,
            record,
            compared,
        }
    }

    /// The channels of the record among `count` replicates of a model that has the same ones, in their order.
    ///
    /// # Errors
    /// Those of the simulation.
    pub fn among(
        &self,
        model: &ModelFile,
        count: usize,
        seed: u64,
    ) -> Result<Vec<Among>, SimulateError> {
        let model = in_steps(model, self.grid);
        let Compared { parts, battery, .. } = &self.compared;
        let rate_hz = self.grid.rate_hz;
        let replicas = Replicas::new(&model, &self.record, rate_hz, &parts.stretches)?;
        let mut rows = self.compared.rows(&replicas, count as u64, seed);
        for (k, own) in battery.channels.iter().enumerate() {
            let slow = |i: &usize| battery.statistics[*i].slow;
            for i in own.clone().filter(|_| replicas.replays(k)).filter(slow) {
                // No number tells nothing.
                rows.iter_mut().for_each(|row| row[i] = f64::NAN);
            }
        }
        let table = Table {
            rows,
            channels: battery.channels.clone(),
        };
        Ok(table.among(&battery.statistics))
    }
}

impl Compared {
    /// Statistics of the record, and of so many replicates in the order of their numbers, each of which has a seed of its own:
    /// the second half is drawn beside the first where there is a thread for it.
    fn rows(&self, replicas: &Replicas, count: u64, seed: u64) -> Vec<Vec<f64>> {
        let half = count.div_ceil(2);
        let second = || self.drawn(replicas.clone(), half..count, seed);
        thread::scope(|threads| {
            let beside = thread::Builder::new().spawn_scoped(threads, second);
            let mut readings: Vec<Vec<f64>> =
                self.measured.iter().map(|m| m.values.clone()).collect();
            self.without_replayed(replicas, &mut readings);
            let mut rows = vec![self.battery.of(&readings, &mut self.battery.work())];
            rows.extend(self.drawn(replicas.clone(), 0..half, seed));
            rows.extend(match beside {
                Ok(thread) => (thread.join()).unwrap_or_else(|panic| resume_unwind(panic)),
                // A browser has none.
                Err(_) => second(),
            });
            rows
        })
    }

    /// Statistics of the replicates of these numbers.
    fn drawn(&self, mut replicas: Replicas, numbers: Range<u64>, seed: u64) -> Vec<Vec<f64>> {
        let (mut work, mut readings) = (self.battery.work(), vec![]);
        let row = |k| {
            replicas.draw(seed.wrapping_add(k), &mut readings);
            for (values, measured) in readings.iter_mut().zip(&self.measured) {
                bridge(values, &measured.lost);
            }
            self.without_replayed(&replicas, &mut readings);
            self.battery.of(&readings, &mut work)
        };
        numbers.map(row).collect()
    }

    /// A motion that is replayed is no property of the model: its channel is compared in what is faster.
    fn without_replayed(&self, replicas: &Replicas, readings: &mut [Vec<f64>]) {
        for (k, values) in readings.iter_mut().enumerate() {
            if replicas.replays(k) {
                let parts = values.chunks_mut(self.parts.length);
                parts.for_each(|part| replicas.without_replayed(part));
            }
        }
    }
}

/// Variance of a step of the random walk over that of the white noise of a sample.
fn walk_over_white(channel: Option<&ChannelModel>, rate_hz: f64) -> f64 {
    let Some(channel) = channel else { return 0.0 };
    let value = |name: &str| channel.baseline.get(name).map_or(0.0, |p| p.value);
    // deg/sqrt(h), or the channel's unit by the root of a hertz.
    let hours = if channel.unit == "deg/s" { 60.0 } else { 1.0 };
    let (walk, white) = (
        value("rate_random_walk") / rate_hz.sqrt(),
        value("angle_random_walk") / hours * rate_hz.sqrt(),
    );
    if white > 0.0 {
        (walk / white).powi(2)
    } else {
        0.0
    }
}

/// A record among `count` replicates of its baseline, to be held against models that extend it.
pub(crate) struct Judge<'a> {
    judged: Judged<'a>,
    baseline: &'a ModelFile,
    before: Vec<Among>,
    count: usize,
    seed: u64,
}

impl<'a> Judge<'a> {
    /// With the baseline.
    ///
    /// # Errors
    /// Those of the simulation: a channel that it does not know.
    pub fn new(
        grid: &'a Grid,
        baseline: &'a ModelFile,
        count: usize,
        seed: u64,
    ) -> Result<Self, SimulateError> {
        let judged = Judged::new(grid, baseline);
        let before = judged.among(baseline, count, seed)?;
        Ok(Self {
            judged,
            baseline,
            before,
            count,
            seed,
        })
    }

    /// The record among replicates of the baseline and of the extended model, by channel. A channel that `is_plain`, on which
    /// nothing was found, and that strays from all of them, is told by [`MORE`] times as many.
    ///
    /// # Errors
    /// Those of the simulation.
    pub fn of(
        &self,
        extended: &ModelFile,
        is_plain: &dyn Fn(&str) -> bool,
    ) -> Result<BTreeMap<String, Replicated>, SimulateError> {
        let same = self.baseline.channels == extended.channels
            && extended.effects.is_empty()
            && extended.unnamed.is_empty();
        let after = if same {
            self.before.clone()
        } else {
            self.judged.among(extended, self.count, self.seed)?
        };
        let names = || self.judged.grid.targets.iter().map(|t| t.name.clone());
        let strays = |name: &str, r: &Among| is_plain(name) && r.p_value <= limit(true, self.count);
        let after = if names().zip(&after).any(|(name, r)| strays(&name, r)) {
            let others = self.seed.wrapping_add(self.count as u64);
            let more = self.judged.among(extended, MORE * self.count, others)?;
            let all = names().zip(after).zip(more);
            all.map(|((name, few), more)| if strays(&name, &few) { more } else { few })
                .collect()
        } else {
            after
        };
        let both = self.before.iter().cloned().zip(after);
        Ok(names()
            .zip(both)
            .map(|(name, (before, after))| (name, Replicated { before, after }))
            .collect())
    }
}

/// Holds a record against `count` replicates of a baseline and of an extended model, by channel; of none where one is not known to
/// the simulation.
///
/// # Errors
/// Those of the grid: a record too short, without a rate or a gyro.
pub fn judge_record(
    record: &Record,
    models: [&ModelFile; 2],
    count: usize,
    seed: u64,
) -> Result<BTreeMap<String, Replicated>, AnalysisError> {
    let grid = lay_out(record, &|_| vec![], seed)?;
    let [baseline, extended] = models;
    let judged = Judge::new(&grid, baseline, count, seed).and_then(|j| j.of(extended, &|_| false));
    Ok(judged.unwrap_or_default())
}
