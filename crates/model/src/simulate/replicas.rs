//! One model again and again in one world.

use std::ops::Range;

use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::prepared::Prepared;
use super::{SimulateError, world_of};
use crate::effect::Stage;
use crate::effects::effect;
use crate::excitation::slow;
use crate::file::{EffectModel, ModelFile};
use crate::record::Record;

/// Counts that the largest reading of a record without a step is to take, far below the noise of any gyro.
const FINE: f64 = 1e9;

/// Replicates of a model in the world that a record saw: what chance has no part in is simulated once.
#[derive(Clone)]
pub struct Replicas {
    prepared: Prepared,
    rate: [Vec<f64>; 3],
    /// Where a draw changes it.
    variance: Option<[Vec<f64>; 3]>,
    /// Axis of each channel of the model.
    axes: Vec<usize>,
}

impl Replicas {
    /// For the model, in the world of the record, whose rows are `rate_hz` apart and none missing. Only the readings of
    /// `stretches`, ranges of rows in order, are simulated; all of them where it is empty.
    ///
    /// # Errors
    /// As [`super::simulate`].
    pub fn new(
        model: &ModelFile,
        record: &Record,
        rate_hz: f64,
        stretches: &[Range<usize>],
    ) -> Result<Self, SimulateError> {
        Self::in_the_motion_of(model, model, record, rate_hz, stretches)
    }

    /// The same of a model that lacks something of `whole`, by which the motion of the base is known from what was read: where it
    /// lacks the error of a scale, it reads that motion by another one.
    ///
    /// # Errors
    /// As [`super::simulate`].
    pub fn in_the_motion_of(
        model: &ModelFile,
        whole: &ModelFile,
        record: &Record,
        rate_hz: f64,
        stretches: &[Range<usize>],
    ) -> Result<Self, SimulateError> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
        // A draw has a seed of its own: where these numbers go on to is told by an effect on the world alone.
        let on_the_world = |e: &EffectModel| effect(&e.cause).map(|e| e.stage());
        let go_on = (model.effects.iter()).any(|e| on_the_world(e) == Some(Stage::World));
        let rng_of_world = go_on.then_some(&mut rng);
        let (model, world, read) = world_of(model, whole, record, rate_hz, rng_of_world)?;
        let mut prepared = Prepared::new(&model, world, read, rate_hz, rng)?;
        let axes = model
            .channels
            .iter()
            .map(super::axis_of)
            .collect::<Result<Vec<_>, _>>()?;
        for (channel, axis) in model.channels.iter().zip(&axes) {
            let readings = record.channel(&channel.name).map(|c| c.values.as_slice());
            let [low, high] = crate::effect::extremes(readings.unwrap_or_default());
            let step = &mut prepared.steps[*axis];
            let largest = low.abs().max(high.abs());
            if channel.lsb.is_none() && largest.is_finite() {
                *step = step.max(largest / FINE);
            }
        }
        if !stretches.is_empty() {
            prepared.only(stretches);
        }
        // Which nothing else looks at.
        if prepared.is_late() {
            prepared.clocks();
        }
        let rate = prepared.run.rate.clone();
        let variance = (prepared.resized()).then(|| prepared.run.variance.clone());
        Ok(Self {
            prepared,
            rate,
            variance,
            axes,
        })
    }

    /// From now on each effect and each axis has random numbers of its own: replicates of two models by one seed differ
    /// by what the models differ in.
    #[must_use]
    pub fn apart(mut self) -> Self {
        self.prepared.apart = Some(0);
        self
    }

    /// From now on readings lack the motion of the base itself: they are what the sensors add to it, which may be made of it.
    #[must_use]
    pub fn errors_alone(mut self) -> Self {
        self.prepared.errors_alone = true;
        self
    }

    /// Whether the slow part of a channel of the model, by its place, is the record's own: its base moved.
    #[must_use]
    pub fn replays(&self, channel: usize) -> bool {
        let axis = self.axes.get(channel);
        axis.is_some_and(|axis| self.prepared.read[*axis].is_some())
    }

    /// Takes the slow part off readings, one stretch of them: what is left of a replayed channel is what is new in it.
    pub fn without_replayed(&self, readings: &mut [f64]) {
        let replayed = slow(readings, self.prepared.run.rate_hz);
        readings.iter_mut().zip(replayed).for_each(|(v, s)| *v -= s);
    }

    /// Simulates once more, and puts the readings of each channel of the model into `readings`, in its order.
    pub fn draw(&mut self, seed: u64, readings: &mut Vec<Vec<f64>>) {
        if let Some(apart) = &mut self.prepared.apart {
            *apart = seed;
        }
        let run = &mut self.prepared.run;
        run.rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        for (variance, start) in run.variance.iter_mut().zip(self.variance.iter().flatten()) {
            variance.copy_from_slice(start);
        }
        self.prepared.draw(Some(&self.rate));
        // A frame that repeats the one before does so to its counts; those that are lost are in the record's own places.
        self.prepared.frames();
        readings.resize_with(self.axes.len(), Vec::new);
        for (out, axis) in readings.iter_mut().zip(&self.axes) {
            let step = self.prepared.steps[*axis];
            out.clear();
            out.extend(
                self.prepared.run.counts[*axis]
                    .iter()
                    .map(|c| f64::from(*c) * step),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::Parameter;

    type Tested = Result<(), Box<dyn std::error::Error>>;

    type Planted<'a> = (&'a str, &'a [(&'a str, f64, &'a str)]);

    /// The paper's stand without noise but that of the baseline parameter given, and effects.
    fn stand(noise: &[(&str, f64)], effects: &[Planted<'_>]) -> ModelFile {
        let mut model = ModelFile::paper();
        for channel in &mut model.channels {
            for (name, p) in &mut channel.baseline {
                p.value = noise.iter().find(|n| n.0 == name).map_or(0.0, |n| n.1);
            }
        }
        let effect = |(cause, parameters): &(&str, &[(&str, f64, &str)])| EffectModel {
            cause: (*cause).to_owned(),
            channels: vec!["gyro_x".into()],
            parameters: (parameters.iter())
                .map(|(name, value, unit)| ((*name).to_owned(), Parameter::exact(*value, unit)))
                .collect(),
        };
        model.effects = effects.iter().map(effect).collect();
        model
    }

    #[test]
    fn without_noise_every_replica_and_every_stretch_is_the_simulated_run() -> Tested {
        let step: &[_] = &[("time", 50.0, "s"), ("height", 3.0, "deg/s")];
        let line: &[_] = &[("frequency", 0.3, "Hz"), ("amplitude", 2.0, "deg/s")];
        let warm: &[_] = &[("amplitude", 5.0, "deg/s"), ("time_constant", 30.0, "s")];
        let model = stand(
            &[("bias", 1.0)],
            &[("bias_step", step), ("line", line), ("warm_up", warm)],
        );
        let record = crate::simulate(&model, 100.0, 20.0, 1)?;
        let run = &record.channels[0].values;
        let (mut whole, mut parts) = (vec![], vec![]);
        Replicas::new(&model, &record, 20.0, &[])?.draw(2, &mut whole);
        let stretches = [100..400, 1200..1500];
        Replicas::new(&model, &record, 20.0, &stretches)?.draw(3, &mut parts);
        let near = |a: &f64, b: &f64| (a - b).abs() < 1e-9;
        assert!(run.iter().zip(&whole[0]).all(|(a, b)| near(a, b)));
        let picked = stretches.iter().flat_map(|s| &run[s.clone()]);
        assert_eq!(parts[0].len(), 600);
        assert!(picked.zip(&parts[0]).all(|(a, b)| near(a, b)));
        Ok(())
    }

    #[test]
    fn a_seed_makes_one_replica_whatever_was_drawn_before() -> Tested {
        let noise: &[_] = &[("sigma", 0.5, "deg/s"), ("correlation_time", 2.0, "s")];
        let model = stand(&[("angle_random_walk", 5.0)], &[("gauss_markov", noise)]);
        let record = crate::simulate(&model, 100.0, 20.0, 1)?;
        let mut replicas = Replicas::new(&model, &record, 20.0, &[])?;
        let (mut first, mut other, mut again) = (vec![], vec![], vec![]);
        replicas.draw(5, &mut first);
        replicas.draw(6, &mut other);
        replicas.draw(5, &mut again);
        assert_eq!(first, again);
        assert_ne!(first, other);
        Ok(())
    }

    #[test]
    fn replicas_apart_differ_by_what_their_models_differ_in() -> Tested {
        let noise: &[_] = &[("sigma", 0.5, "deg/s"), ("correlation_time", 2.0, "s")];
        let hum: &[_] = &[("bias_instability", 300.0, "deg/h")];
        let white: &[_] = &[("angle_random_walk", 5.0), ("rate_random_walk", 0.01)];
        let mut drawn = vec![];
        for effects in [
            &[("flicker", hum), ("gauss_markov", noise)][..],
            &[("flicker", hum)],
            &[],
        ] {
            let model = stand(white, effects);
            let record = crate::simulate(&stand(white, &[]), 100.0, 20.0, 1)?;
            let mut readings = vec![];
            Replicas::new(&model, &record, 20.0, &[])?
                .apart()
                .draw(5, &mut readings);
            drawn.push(readings[0].clone());
        }
        let apart = |a: &[f64], b: &[f64]| -> f64 {
            let square = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            (square / a.len() as f64).sqrt()
        };
        // 100 s are 50 correlation times: the size of the process to 10 %, three times that allowed, rounding included.
        let process = apart(&drawn[0], &drawn[1]);
        assert!((process - 0.5).abs() < 0.15, "{process}");
        let hum = apart(&drawn[1], &drawn[2]);
        assert!(hum > 0.02 && hum < 0.4, "{hum}");
        Ok(())
    }

    #[test]
    fn repeated_samples_are_repeated_in_replicas() -> Tested {
        let model = stand(
            &[("angle_random_walk", 5.0)],
            &[(
                "stale_samples",
                &[("count", 300.0, "1"), ("silent", 1.0, "1")],
            )],
        );
        let record = crate::simulate(&model, 100.0, 20.0, 1)?;
        let mut readings = vec![];
        Replicas::new(&model, &record, 20.0, &[])?.draw(5, &mut readings);
        let equal = |x: &[f64]| x.windows(2).filter(|w| w[0] == w[1]).count();
        // By chance 1 / (2 sqrt(pi) sigma) of 2000 at 5.1 counts, 110 +- 10; 300 of 2000 places besides, few of them twice.
        assert!(equal(&readings[1]) < 170, "{}", equal(&readings[1]));
        assert!(equal(&readings[0]) > 300, "{}", equal(&readings[0]));
        Ok(())
    }

    #[test]
    fn far_readings_come_behind_a_filter_wherever_a_model_lists_it() -> Tested {
        let far: &[_] = &[("count", 20.0, "1"), ("size", 500.0, "deg/s")];
        let filter: &[_] = &[("lag1_correlation", 0.5, "1")];
        let model = stand(
            &[("angle_random_walk", 5.0)],
            &[("outliers", far), ("low_pass", filter)],
        );
        let record = crate::simulate(&model, 100.0, 20.0, 1)?;
        let read = &record.channels[0].values;
        let far: Vec<usize> = (1..read.len() - 1)
            .filter(|i| read[*i].abs() > 100.0)
            .collect();
        // Of 20 readings two may fall on one of 2000.
        assert!(far.len() > 15, "{far:?}");
        let apart = far.windows(2).filter(|w| w[1] > w[0] + 1).count();
        assert!(apart + 3 > far.len(), "{far:?}");
        Ok(())
    }

    #[test]
    fn a_random_walk_wanders_on_between_stretches() -> Tested {
        let k = 0.02;
        let model = stand(&[("rate_random_walk", k)], &[]);
        let record = crate::simulate(&model, 100.0, 20.0, 1)?;
        let mut replicas = Replicas::new(&model, &record, 20.0, &[0..10, 1990..2000])?;
        let mut readings = vec![];
        let mut square = 0.0;
        for seed in 0..400 {
            replicas.draw(seed, &mut readings);
            square += readings.iter().map(|r| (r[10] - r[0]).powi(2)).sum::<f64>();
        }
        // 99.5 s later; 1200 squares of a normal value are known to 4 %, and 5 of that are allowed. The step is 0.07.
        let ratio = square / 1200.0 / (k * k * 99.5 + 0.07326f64.powi(2) / 6.0);
        assert!((ratio - 1.0).abs() < 0.2, "{ratio}");
        Ok(())
    }
}
