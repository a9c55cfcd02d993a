//! What a cause does to readings, deviations and angles: the extended model simulated with it and without, by the same random
//! numbers, in the world that the record saw.

use std::collections::BTreeMap;

use model::effect::Stage;
use model::effects::effect;
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

impl Squares {
    fn of(values: &[f64], length: usize, rate_hz: f64) -> Self {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
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
fn drawn(
    model: &ModelFile,
    record: &Record,
    grid: &Grid,
    parts: &Parts,
    seed: u64,
) -> Option<Vec<Vec<Vec<f64>>>> {
    let model = in_steps(model, grid);
    let replicas = Replicas::new(&model, record, grid.rate_hz, &parts.stretches);
    let mut replicas = replicas.ok()?.apart();
    let draws = if grid.n > LONG { DRAWS_LONG } else { DRAWS };
    let draw = |k: u64| {
        let mut readings = vec![];
        replicas.draw(seed.wrapping_add(k), &mut readings);
        readings
    };
    Some((0..draws).map(draw).collect())
}

/// States of each finding what it does, as far as the simulation knows, and whether that matters.
pub(crate) fn state(
    findings: &mut [Finding],
    extended: &ModelFile,
    grid: &Grid,
    matters: f64,
    seed: u64,
) {
    let (record, parts) = (record_of(grid), Parts::of(grid.n, grid.rate_hz));
    let Some(with) = drawn(extended, &record, grid, &parts, seed) else {
        return;
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
        let own = effects_of(&[finding]);
        let mut model = extended.clone();
        model.effects.retain(|e| !own.contains(e));
        let details = |u: &Unnamed| {
            let its_own = |c| finding.channels.contains(c);
            u.refines.as_ref() == Some(&finding.cause) && u.channels.iter().all(its_own)
        };
        model.unnamed.retain(|u| !details(u));
        if model.effects.len() == extended.effects.len() {
            continue;
        }
        let Some(without) = drawn(&model, &record, grid, &parts, seed) else {
            continue;
        };
        let of = |name: &String| {
            let place = extended.channels.iter().position(|c| c.name == *name)?;
            Some(compare(&with, &without, place, &parts, grid.rate_hz, stage))
        };
        let all = finding.channels.iter().filter_map(of);
        let most = all.max_by(|a, b| a.largest_change.total_cmp(&b.largest_change));
        if let Some(c) = most {
            finding.material = c.largest_change > matters;
            finding.consequence = Some(c);
        }
    }
}

/// What a model has more than another on one channel. What is added to the rate is independent of the rest, and told by its own
/// size; what changes the noise or the counts, by the difference that it makes.
fn compare(
    with: &[Vec<Vec<f64>>],
    without: &[Vec<Vec<f64>>],
    place: usize,
    parts: &Parts,
    rate_hz: f64,
    stage: Stage,
) -> Consequence {
    let (mut more, mut rest) = (Squares::default(), Squares::default());
    let added = stage <= Stage::Rate;
    for (a, b) in with.iter().zip(without) {
        let (a, b) = (&a[place], &b[place]);
        let own = if added {
            let apart: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
            Squares::of(&apart, parts.length, rate_hz)
        } else {
            Squares::of(a, parts.length, rate_hz)
        };
        more.add(&own);
        rest.add(&Squares::of(b, parts.length, rate_hz));
    }
    if !added {
        // Theirs is what they make of the rest.
        more.variance -= rest.variance;
        for (a, b) in [
            (&mut more.allan, &rest.allan),
            (&mut more.angle, &rest.angle),
        ] {
            a.iter_mut().zip(b).for_each(|(a, b)| *a -= b);
        }
    }
    let change = |more: f64, rest: f64| {
        if rest > 0.0 {
            ((1.0 + more / rest).max(0.0).sqrt() - 1.0).abs()
        } else {
            0.0
        }
    };
    let pairs = more.allan.iter().zip(&rest.allan);
    let pairs = pairs.chain(more.angle.iter().zip(&rest.angle));
    let largest = pairs.map(|(m, r)| change(*m, *r)).fold(0.0, f64::max);
    let draws = with.len().max(1) as f64;
    let angles = horizons(parts.length, rate_hz);
    let angles = angles.into_iter().zip(&more.angle);
    Consequence {
        // Of what is larger: the readings with it, or those without what takes something from them.
        share_of_variance: more.variance.abs() / (more.variance.max(0.0) + rest.variance),
        angle_rms_deg: angles
            .map(|((key, _), square)| (key.to_owned(), (square.abs() / draws).sqrt()))
            .collect::<BTreeMap<_, _>>(),
        velocity_rms_mps: BTreeMap::new(),
        largest_change: largest,
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
