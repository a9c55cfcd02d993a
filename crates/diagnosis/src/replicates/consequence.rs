//! What a cause does to readings, deviations and angles: the extended model simulated with it and without, by the same random
//! numbers, in the world that the record saw.

use std::collections::BTreeMap;

use model::effect::Stage;
use model::effects::{base_motion, effect};
use model::file::ModelFile;
use model::record::Record;
use model::simulate::Replicas;
use model::unnamed::Unnamed;

use super::world::{Parts, in_steps, record_of};
use crate::ingest::types::Grid;
use crate::report::handover::effects_of;
use crate::report::left_over::{HORIZONS, LEAST_PARTS, octaves};
use crate::result::{Consequence, Finding};

/// Simulations of each model; of a long record fewer tell as much.
const DRAWS: u64 = 8;
const DRAWS_LONG: u64 = 3;
const LONG: usize = 50_000;

/// Mean squares of a channel: of its readings about their mean, of their Allan deviations by octaves, and of the angle over
/// each horizon.
#[derive(Clone, Debug, Default, PartialEq)]
struct Squares {
    variance: f64,
    allan: Vec<f64>,
    angle: Vec<f64>,
}

/// Samples of each horizon that leaves room for some of them in a part.
fn horizons(length: usize, rate_hz: f64) -> Vec<(&'static str, usize)> {
    let samples = |s: f64| (s * rate_hz).round() as usize;
    let all = HORIZONS.iter().map(|(key, s)| (*key, samples(*s)));
    all.filter(|(_, m)| *m > 0 && m * LEAST_PARTS <= length)
        .collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn variance(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64
}

impl Squares {
    fn of(values: &[f64], length: usize, rate_hz: f64) -> Self {
        let (mean, variance) = (mean(values), variance(values));
        let sums: Vec<Vec<f64>> = (values.chunks_exact(length))
            .map(|part| {
                let mut sum = 0.0;
                let rising = part.iter().map(|v| {
                    sum += v - mean;
                    sum
                });
                std::iter::once(0.0).chain(rising).collect()
            })
            .collect();
        let over = |m: usize, of: &dyn Fn(&[f64], usize) -> f64, reach: usize| {
            let each = sums.iter().flat_map(|sum| {
                let last = sum.len().saturating_sub(reach * m);
                (0..last).map(move |i| of(&sum[i..], m).powi(2))
            });
            let (count, square) = each.fold((0usize, 0.0), |(n, s), v| (n + 1, s + v));
            square / count.max(1) as f64
        };
        let second = |x: &[f64], m: usize| (x[2 * m] - 2.0 * x[m] + x[0]) / m as f64;
        let first = |x: &[f64], m: usize| (x[m] - x[0]) / rate_hz;
        Self {
            variance,
            allan: octaves(length).map(|m| 0.5 * over(m, &second, 2)).collect(),
            angle: (horizons(length, rate_hz).iter())
                .map(|(_, m)| over(*m, &first, 1))
                .collect(),
        }
    }

    fn add(&mut self, other: &Self) {
        self.variance += other.variance;
        for (mine, theirs) in [
            (&mut self.allan, &other.allan),
            (&mut self.angle, &other.angle),
        ] {
            mine.resize(theirs.len(), 0.0);
            mine.iter_mut().zip(theirs).for_each(|(a, b)| *a += b);
        }
    }
}

/// Readings of the channels of a model, by draw.
type Drawn = Vec<Vec<Vec<f64>>>;

/// What is simulated.
#[derive(Clone, Copy, PartialEq)]
enum Of {
    /// What is read.
    Readings,
    /// What the sensors add to the motion of the base: a true rate is no error, however large.
    Errors,
}

/// What models make of one world.
struct World<'a> {
    /// The model by which the motion of the base is known.
    whole: &'a ModelFile,
    record: Record,
    grid: &'a Grid,
    parts: Parts,
    seed: u64,
    /// Whether the base moves: else readings are errors.
    moves: bool,
}

impl<'a> World<'a> {
    fn of(whole: &'a ModelFile, grid: &'a Grid, seed: u64) -> Self {
        Self {
            whole,
            record: record_of(grid),
            grid,
            parts: Parts::of(grid.n, grid.rate_hz),
            seed,
            moves: whole.effects.iter().any(|e| e.cause == base_motion::ID),
        }
    }

    fn drawn(&self, model: &ModelFile, of: Of) -> Option<Drawn> {
        let Self { grid, parts, .. } = self;
        let [model, whole] = [model, self.whole].map(|m| in_steps(m, grid));
        let (rate_hz, stretches) = (grid.rate_hz, &parts.stretches);
        let replicas = Replicas::in_the_motion_of(&model, &whole, &self.record, rate_hz, stretches);
        let mut replicas = replicas.ok()?.apart();
        if of == Of::Errors {
            replicas = replicas.errors_alone();
        }
        let draws = if grid.n > LONG { DRAWS_LONG } else { DRAWS };
        let draw = |k: u64| {
            let mut readings = vec![];
            replicas.draw(self.seed.wrapping_add(k), &mut readings);
            readings
        };
        Some((0..draws).map(draw).collect())
    }

    /// The model without what a finding says of it.
    fn without(&self, finding: &Finding) -> Option<ModelFile> {
        let own = effects_of(&[finding]);
        let mut model = self.whole.clone();
        model.effects.retain(|e| !own.contains(e));
        let details = |u: &Unnamed| {
            let its_own = |c| finding.channels.contains(c);
            u.refines.as_ref() == Some(&finding.cause) && u.channels.iter().all(its_own)
        };
        model.unnamed.retain(|u| !details(u));
        (model.effects.len() < self.whole.effects.len()).then_some(model)
    }

    /// What a finding does to the channels that it is on, by what the whole model makes of this world.
    fn consequence(&self, finding: &Finding, stage: Stage, whole: &Whole) -> Option<Consequence> {
        let without = self.without(finding)?;
        // A motion is what it adds to the readings; a fault of the counts depends on where they are.
        let motion = finding.cause == base_motion::ID;
        let of_readings = !self.moves || motion || stage == Stage::Counts;
        let (with, of) = match of_readings {
            true => (&whole.readings, Of::Readings),
            false => (whole.errors(), Of::Errors),
        };
        let rest = self.drawn(&without, if self.moves { Of::Errors } else { of })?;
        let read = (self.moves && of_readings).then(|| self.drawn(&without, of));
        let without = match &read {
            Some(read) => read.as_ref()?,
            None => &rest,
        };
        // What was read of a motion has the noise in it, and no random numbers.
        let replayed = motion && !finding.parameters.contains_key("start");
        let compared = Compared {
            added: !replayed && (stage <= Stage::Rate || self.moves && of_readings),
            with,
            without,
            rest: &rest,
        };
        let of = |name: &String| {
            let place = self.whole.channels.iter().position(|c| c.name == *name)?;
            // A motion is in what is read beside the errors.
            let beside = if motion { 0.0 } else { whole.motion(place) };
            Some(compared.on(place, &self.parts, self.grid.rate_hz, beside))
        };
        let all = finding.channels.iter().filter_map(of);
        all.max_by(|a, b| a.largest_change.total_cmp(&b.largest_change))
    }
}

/// What the whole model makes.
struct Whole {
    readings: Drawn,
    /// Where they are something else.
    errors: Option<Drawn>,
}

impl Whole {
    fn errors(&self) -> &Drawn {
        self.errors.as_ref().unwrap_or(&self.readings)
    }

    /// Variance of a channel that is the motion's, summed over the draws.
    fn motion(&self, place: usize) -> f64 {
        let Some(errors) = &self.errors else {
            return 0.0;
        };
        let all = |of: &Drawn| -> f64 { of.iter().map(|d| variance(&d[place])).sum() };
        (all(&self.readings) - all(errors)).max(0.0)
    }
}

/// States of each finding what it does, as far as the simulation knows, and whether that matters.
pub(crate) fn state(
    findings: &mut [Finding],
    extended: &ModelFile,
    grid: &Grid,
    matters: f64,
    seed: u64,
) {
    let world = World::of(extended, grid, seed);
    let Some(readings) = world.drawn(extended, Of::Readings) else {
        return;
    };
    let errors = (world.moves).then(|| world.drawn(extended, Of::Errors));
    let whole = Whole {
        readings,
        errors: errors.flatten(),
    };
    for finding in findings {
        if let Some(known) = &finding.consequence {
            finding.material = known.largest_change > matters;
            continue;
        }
        let Some(stage) = effect(&finding.cause).map(|e| e.stage()) else {
            continue;
        };
        // Times and places of frames are not those of replicates.
        if stage >= Stage::Frames {
            continue;
        }
        if let Some(c) = world.consequence(finding, stage, &whole) {
            finding.material = c.largest_change > matters;
            finding.consequence = Some(c);
        }
    }
}

/// Readings with a cause and without it, and what their difference is held against.
struct Compared<'a> {
    /// Whether they differ by what is added alone, by the same random numbers.
    added: bool,
    with: &'a Drawn,
    without: &'a Drawn,
    /// The errors without the cause.
    rest: &'a Drawn,
}

impl Compared<'_> {
    /// What a model has more than another on one channel. What is added to the rate is independent of the rest, and told by its own
    /// size; what changes the noise or the counts, by the difference that it makes. Of the variance that is read, `beside` is
    /// neither.
    fn on(&self, place: usize, parts: &Parts, rate_hz: f64, beside: f64) -> Consequence {
        let of = |values: &[f64]| Squares::of(values, parts.length, rate_hz);
        let (mut more, mut less, mut rest) =
            (Squares::default(), Squares::default(), Squares::default());
        for ((a, b), r) in self.with.iter().zip(self.without).zip(self.rest) {
            let (a, b) = (&a[place], &b[place]);
            if self.added {
                let apart: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
                more.add(&of(&apart));
            } else {
                more.add(&of(a));
                less.add(&of(b));
            }
            rest.add(&of(&r[place]));
        }
        if !self.added {
            // Theirs is what they make of the rest.
            more.variance -= less.variance;
            for (a, b) in [
                (&mut more.allan, &less.allan),
                (&mut more.angle, &less.angle),
            ] {
                a.iter_mut().zip(b).for_each(|(a, b)| *a -= b);
            }
        }
        let pairs = more.allan.iter().zip(&rest.allan);
        let pairs = pairs.chain(more.angle.iter().zip(&rest.angle));
        let largest = pairs.map(|(m, r)| change(*m, *r)).fold(0.0, f64::max);
        let draws = self.with.len().max(1) as f64;
        let angles = horizons(parts.length, rate_hz);
        let angles = angles.into_iter().zip(&more.angle);
        Consequence {
            // Of what is larger: the readings with it, or those without what takes something from them.
            share_of_variance: more.variance.abs()
                / (more.variance.max(0.0) + rest.variance + beside),
            angle_rms_deg: angles
                .map(|((key, _), square)| (key.to_owned(), (square.abs() / draws).sqrt()))
                .collect::<BTreeMap<_, _>>(),
            velocity_rms_mps: BTreeMap::new(),
            largest_change: largest,
        }
    }
}

/// Relative change of a root mean square by what there is more.
fn change(more: f64, rest: f64) -> f64 {
    if rest > 0.0 {
        ((1.0 + more / rest).max(0.0).sqrt() - 1.0).abs()
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_of_a_ramp_are_those_of_its_slope() {
        // x = 0.01 i at 20 Hz: the Allan variance at m samples is (0.01 m)^2 / 2.
        let ramp: Vec<f64> = (0..8000).map(|i| 0.01 * f64::from(i)).collect();
        let s = Squares::of(&ramp, 8000, 20.0);
        for (k, allan) in s.allan.iter().enumerate() {
            let m = f64::from(1 << k);
            assert!(
                (allan / (0.5 * (0.01 * m).powi(2)) - 1.0).abs() < 1e-9,
                "{m}"
            );
        }
        // The angle over 100 s of what is left beside the mean: the rate is uniform within +-39 deg/s but for the ends.
        assert_eq!(s.angle.len(), 2);
        let wanted = 100.0 * 0.01 * (8000.0 - 2000.0) / 12f64.sqrt();
        assert!((s.angle[1].sqrt() / wanted - 1.0).abs() < 1e-3);
    }
}
