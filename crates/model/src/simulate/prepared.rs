//! A model in a world: what chance has no part in is done, the rest is drawn.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;

use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::unnamed::{Generic, Random, too_correlated};
use super::{
    BANKS, COUNT_LIMIT, STEPLESS_DPS, SimulateError, Simulation, Stretch, axis_of, white_of,
};
use crate::effect::{Effect, Frames, Parameters, Stage, slowest};
use crate::effects::effect;
use crate::excitation::{World, fast};
use crate::file::ModelFile;
use crate::nearest::nearest;
use crate::one_source::is_of_another;
use crate::record::flag;

/// An effect of a model, and the axes that it acts on.
#[derive(Clone)]
struct Acting {
    effect: &'static dyn Effect,
    parameters: Parameters,
    axes: Vec<usize>,
}

impl Acting {
    fn on(&self, run: &mut Simulation) {
        self.effect.simulate(&self.parameters, &self.axes, run);
    }

    /// A number of its own: what is drawn for it does not depend on what else a model holds, nor on the last digits of a fit,
    /// which are another processor's.
    fn stream(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        self.effect.id().hash(&mut hasher);
        for axis in &self.axes {
            (*axis as u64).hash(&mut hasher);
        }
        for (name, p) in &self.parameters {
            (name, format!("{:.2e}", p.value)).hash(&mut hasher);
        }
        hasher.finish()
    }

    /// Whether chance has a part in it: it takes random numbers even for two samples in a world at rest.
    fn draws(&self, rate_hz: f64) -> bool {
        let rng = Xoshiro256PlusPlus::seed_from_u64(0);
        let mut probe = started(World::at_rest(2), rate_hz, rng.clone());
        self.on(&mut probe);
        probe.rng != rng
    }
}

/// A run of a model, without what is random.
#[derive(Clone)]
pub(super) struct Prepared {
    pub run: Simulation,
    /// Axes that the model has.
    pub present: [bool; 3],
    /// Unit per count, where the model states one.
    pub lsb: [Option<f64>; 3],
    /// Unit in which readings come.
    pub steps: [f64; 3],
    /// Random walk from sample to sample, deg/s.
    walk: [f64; 3],
    /// White standard deviation at each sample, deg/s.
    white: [Vec<f64>; 3],
    /// Effects on rate and noise that chance has a part in.
    random: Vec<Acting>,
    /// Effects on what the sensor puts out, and later.
    late: Vec<Acting>,
    /// What has no name.
    unnamed: Generic,
    /// Slow part of the axes that moved, deg/s.
    pub(super) read: [Option<Vec<f64>>; 3],
    /// Whether the motion itself is left out of the readings.
    pub errors_alone: bool,
    /// Seed, where each effect and each axis has random numbers of its own.
    pub apart: Option<u64>,
}

/// Numbers of the random walks and the white noise of the axes among the streams, before those of effects.
const WALKS: u64 = 0;
const WHITES: u64 = 3;
const UNNAMED: u64 = 6;

impl Prepared {
    pub fn new(
        model: &ModelFile,
        world: World,
        read: [Option<Vec<f64>>; 3],
        rate_hz: f64,
        rng: Xoshiro256PlusPlus,
    ) -> Result<Self, SimulateError> {
        let mut run = started(world, rate_hz, rng);
        let names = model.channels.iter().map(|c| c.name.as_str());
        run.of_accelerometers = names.clone().any(|n| BANKS[1].contains(&n));
        let (mut present, mut lsb, mut walk) = ([false; 3], [None; 3], [0.0; 3]);
        for channel in &model.channels {
            let axis = axis_of(channel)?;
            let get = |name: &str| channel.baseline.get(name).map_or(0.0, |p| p.value);
            present[axis] = true;
            lsb[axis] = channel.lsb;
            run.white_sigma[axis] = white_of(&channel.unit, get("angle_random_walk"), rate_hz);
            walk[axis] = get("rate_random_walk") / rate_hz.sqrt();
            run.rate[axis].fill(get("bias"));
        }
        let acting = acting(model, present)?;
        for (axis, lsb) in lsb.iter().enumerate() {
            let here = acting.iter().filter(|a| a.axes.contains(&axis));
            // The noise of a model is that by which an angle grows: before a filter, which makes it smaller,
            // and before what holds readings, which makes it larger.
            let frames = Frames {
                samples: run.span,
                rate_hz,
            };
            let slow = slowest(here.clone().map(|a| (a.effect, &a.parameters)), frames);
            run.white_sigma[axis] /= slow.sqrt();
            let step = here.fold(lsb.unwrap_or(0.0), |step, a| {
                step * a.effect.coarsens(&a.parameters)
            });
            run.rounding[axis] = step * step / 12.0;
        }
        let (mut early, late): (Vec<_>, Vec<_>) = acting
            .into_iter()
            .partition(|a| a.effect.stage() < Stage::Output);
        // What an axis feels of another's oscillation comes after that.
        let of_accelerometers = run.of_accelerometers;
        let behind = |a: &Acting| is_of_another(&a.parameters, of_accelerometers);
        early.sort_by_key(|a| (a.effect.stage(), behind(a)));
        run.felt = early.iter().any(behind).then(Vec::new);
        // What the base does is an input of the run: the same each time, even where it is random.
        let again = |a: &Acting| a.effect.stage() != Stage::World && a.draws(rate_hz);
        let (random, once): (Vec<_>, Vec<_>) = early.into_iter().partition(again);
        for acting in &once {
            acting.on(&mut run);
        }
        too_correlated(model)?;
        let unnamed = Generic::of(model, &mut run)?;
        let steps = lsb.map(|lsb| lsb.unwrap_or(STEPLESS_DPS));
        let mut prepared = Self {
            run,
            present,
            lsb,
            steps,
            walk,
            white: Default::default(),
            random,
            late,
            unnamed,
            read,
            errors_alone: false,
            apart: None,
        };
        prepared.sized();
        Ok(prepared)
    }

    /// What is drawn is as large as the run now says. The noise of a model is that of the readings, of which rounding makes a
    /// part by itself.
    fn sized(&mut self) {
        let run = &self.run;
        self.white = std::array::from_fn(|axis| {
            let (own, rounding) = (run.white_sigma[axis].powi(2), run.rounding[axis]);
            let variance = run.variance[axis].iter();
            variance
                .map(|v| (own * v - rounding).max(0.0).sqrt())
                .collect()
        });
    }

    /// Only these stretches of the run from now on.
    pub fn only(&mut self, stretches: &[Range<usize>]) {
        let run = &mut self.run;
        let pick = |values: &mut Vec<f64>| {
            *values = stretches
                .iter()
                .flat_map(|s| values[s.clone()].iter().copied())
                .collect();
        };
        let columns = run
            .temperature
            .iter_mut()
            .chain([&mut run.supply, &mut run.duty]);
        let columns = columns.chain(&mut run.acc).chain(&mut run.motion);
        let columns = columns.chain(&mut run.rate).chain(&mut run.variance);
        columns
            .chain(&mut self.white)
            .chain(self.read.iter_mut().flatten())
            .for_each(pick);
        let (mut until, mut from) = (0, 0);
        run.stretches = stretches
            .iter()
            .map(|s| {
                let stretch = Stretch {
                    samples: from..from + s.len(),
                    skipped: s.start - until,
                };
                (until, from) = (s.end, from + s.len());
                stretch
            })
            .collect();
        run.samples = from;
        run.flags.truncate(from);
    }

    /// Whether something happens to what the sensor puts out, or later.
    pub fn is_late(&self) -> bool {
        !self.late.is_empty()
    }

    /// Clocks and frames, which only a run that is written has.
    pub fn clocks(&mut self) {
        let run = &mut self.run;
        run.keep = vec![true; run.samples];
        run.device_time = (0..run.samples).map(|i| i as f64 / run.rate_hz).collect();
        run.host_time.clone_from(&run.device_time);
    }

    /// Random numbers of a stream, where there are some of its own.
    fn begin(&mut self, stream: u64) {
        if let Some(seed) = self.apart {
            let mut hasher = DefaultHasher::new();
            (seed, stream).hash(&mut hasher);
            self.run.rng = Xoshiro256PlusPlus::seed_from_u64(hasher.finish());
        }
    }

    /// Whether the variances are drawn too.
    pub fn resized(&self) -> bool {
        let by_effect = |a: &Acting| a.effect.stage() == Stage::Noise;
        self.random.iter().any(by_effect) || self.unnamed.random.iter().any(Random::is_noise)
    }

    /// Draw what is random, up to the counts; on these rates, where the run's are those of a draw before.
    pub fn draw(&mut self, start: Option<&[Vec<f64>; 3]>) {
        let present = self.present;
        self.run.shared.iter_mut().for_each(Vec::clear);
        self.run.felt.iter_mut().for_each(Vec::clear);
        self.run.rotors.clear();
        self.run.own = [1.0; 3];
        for axis in 0..3 {
            let start = start.map(|all| all[axis].as_slice());
            if present[axis] {
                self.begin(WALKS + axis as u64);
                wander(&mut self.run, axis, self.walk[axis], start);
            } else if let Some(start) = start {
                self.run.rate[axis].copy_from_slice(start);
            }
        }
        for k in 0..self.random.len() {
            self.begin(self.random[k].stream());
            self.random[k].on(&mut self.run);
        }
        for (k, term) in self.unnamed.random.clone().iter().enumerate() {
            self.begin(UNNAMED + k as u64);
            term.on(&mut self.run);
        }
        if self.resized() {
            self.sized();
        }
        for axis in (0..3).filter(|a| present[*a]) {
            self.begin(WHITES + axis as u64);
            if self.plain(axis) {
                self.count_at_once(axis);
                continue;
            }
            let mut white = std::mem::take(&mut self.run.white[axis]);
            white.clear();
            let run = &mut self.run;
            let shape = self.unnamed.shapes[axis];
            let each = self.white[axis].iter().map(|sd| {
                let z = run.normal();
                sd * shape.map_or(z, |shape| shape.value(z))
            });
            white.extend(each);
            let shared = run.shared[axis].iter().zip(&run.variance[axis]);
            for (white, (shared, v)) in white.iter_mut().zip(shared) {
                *white += v.sqrt() * shared;
            }
            self.run.white[axis] = white;
        }
        self.stage(Stage::Output);
        self.stage(Stage::Reading);
        for axis in (0..3).filter(|a| present[*a]) {
            if !self.plain(axis) {
                self.count(axis);
            }
        }
        self.stage(Stage::Counts);
    }

    /// What happens to frames.
    pub fn frames(&mut self) {
        self.stage(Stage::Frames);
    }

    fn stage(&mut self, at: Stage) {
        for k in 0..self.late.len() {
            if self.late[k].effect.stage() == at {
                self.begin(self.late[k].stream());
                self.late[k].on(&mut self.run);
            }
        }
    }

    /// Factor by which the motion is in the readings of an axis.
    fn feels(&self, axis: usize) -> f64 {
        match (self.errors_alone, &self.read[axis]) {
            (true, _) => self.run.scale[axis] - 1.0,
            // Where the motion is the one that was read, it is in there.
            (false, Some(_)) => 0.0,
            (false, None) => self.run.scale[axis],
        }
    }

    /// Whether an axis has nothing between its white noise and its counts.
    fn plain(&self, axis: usize) -> bool {
        let late = self.late.iter().any(|a| a.axes.contains(&axis));
        !late && self.read[axis].is_none() && self.run.shared[axis].is_empty()
    }

    /// The counts of a [plain](Self::plain) axis, the white noise drawn as they are made: its columns are gone through once.
    fn count_at_once(&mut self, axis: usize) {
        let scale = self.feels(axis);
        let run = &mut self.run;
        let shape = self.unnamed.shapes[axis];
        let unit = self.steps[axis];
        let mut counts = std::mem::take(&mut run.counts[axis]);
        let rates = std::mem::take(&mut run.rate[axis]);
        counts.clear();
        let each = rates.iter().zip(&run.motion[axis]).zip(&self.white[axis]);
        let rng = &mut run.rng;
        counts.extend(each.map(|((rate, moves), sd)| {
            let z: f64 = StandardNormal.sample(rng);
            let white = sd * shape.map_or(z, |shape| shape.value(z));
            nearest(
                (rate + (scale * moves + white)) / unit,
                -COUNT_LIMIT - 1,
                COUNT_LIMIT,
            )
        }));
        (run.counts[axis], run.rate[axis]) = (counts, rates);
    }

    fn count(&mut self, axis: usize) {
        let scale = self.feels(axis);
        let run = &mut self.run;
        for ((rate, moves), white) in run.rate[axis]
            .iter_mut()
            .zip(&run.motion[axis])
            .zip(&run.white[axis])
        {
            *rate += scale * moves + white;
        }
        if let Some(read) = self.read[axis].as_ref().filter(|_| !self.errors_alone) {
            for stretch in &run.stretches {
                let samples = stretch.samples.clone();
                let own = fast(&run.rate[axis][samples.clone()], run.rate_hz);
                let moved = run.rate[axis][samples.clone()].iter_mut();
                let parts = own.iter().zip(&read[samples]);
                moved
                    .zip(parts)
                    .for_each(|(w, (own, read))| *w = read + own);
            }
        }
        let unit = self.steps[axis];
        if let Some(sensor) = run.sensor_step[axis] {
            let rates = run.rate[axis].iter_mut();
            rates.for_each(|w| *w = unit * sensor.read(*w, unit));
        }
        let counts = run.rate[axis]
            .iter()
            .map(|w| nearest(w / unit, -COUNT_LIMIT - 1, COUNT_LIMIT));
        run.counts[axis].clear();
        run.counts[axis].extend(counts);
    }
}

/// Effects of the model on the axes that it has.
fn acting(model: &ModelFile, present: [bool; 3]) -> Result<Vec<Acting>, SimulateError> {
    let of = |e: &crate::file::EffectModel| {
        let effect = effect(&e.cause).ok_or_else(|| SimulateError::NoEffect {
            cause: e.cause.clone(),
        })?;
        let of = |names: &&[&str; 3]| {
            model
                .channels
                .iter()
                .any(|c| names.contains(&c.name.as_str()))
        };
        let bank = BANKS.iter().find(of).unwrap_or(&BANKS[0]);
        let names = bank.iter().enumerate();
        // A term that tells a tone in detail stands for it.
        let refined = |n: &str| {
            let of_it = |u: &&crate::unnamed::Unnamed| u.refines.as_ref() == Some(&e.cause);
            let mut terms = model.unnamed.iter().filter(of_it);
            terms.any(|u| u.channels.iter().any(|c| c == n))
        };
        let named = |n: &str| {
            let acts = e.channels.is_empty() || e.channels.iter().any(|c| c == n);
            acts && !refined(n)
        };
        Ok(Acting {
            effect,
            parameters: e.parameters.clone(),
            axes: names
                .filter(|(i, n)| present[*i] && named(n))
                .map(|(i, _)| i)
                .collect(),
        })
    };
    model.effects.iter().map(of).collect()
}

/// A run in a world before anything acts.
fn started(world: World, rate_hz: f64, rng: Xoshiro256PlusPlus) -> Simulation {
    let samples = world.duty.len();
    Simulation {
        rate_hz,
        samples,
        span: samples,
        stretches: vec![Stretch {
            samples: 0..samples,
            skipped: 0,
        }],
        rng,
        temperature: world.temperature,
        supply: world.supply,
        duty: world.duty,
        acc: world.acc,
        motion: world.motion,
        scale: [1.0; 3],
        rate: std::array::from_fn(|_| vec![0.0; samples]),
        felt: None,
        rotors: vec![],
        of_accelerometers: false,
        white_sigma: [0.0; 3],
        rounding: [0.0; 3],
        shared: Default::default(),
        own: [1.0; 3],
        variance: std::array::from_fn(|_| vec![1.0; samples]),
        white: Default::default(),
        sensor_step: [None; 3],
        counts: Default::default(),
        flags: vec![flag::IN_ORDER; samples],
        keep: vec![],
        device_time: vec![],
        host_time: vec![],
    }
}

/// Adds a random walk that starts at 0 with the run to the rate; or puts the sum of `start` and it there.
fn wander(run: &mut Simulation, axis: usize, step: f64, start: Option<&[f64]>) {
    let mut level = 0.0;
    for k in 0..run.stretches.len() {
        let Stretch { samples, skipped } = run.stretches[k].clone();
        if skipped > 0 {
            level += step * (skipped as f64).sqrt() * run.normal();
        }
        let mut rates = std::mem::take(&mut run.rate[axis]);
        let mut next = || {
            let now = level;
            level += step * run.normal();
            now
        };
        match start {
            Some(start) => (rates[samples.clone()].iter_mut().zip(&start[samples]))
                .for_each(|(rate, start)| *rate = start + next()),
            None => rates[samples].iter_mut().for_each(|rate| *rate += next()),
        }
        run.rate[axis] = rates;
    }
}
