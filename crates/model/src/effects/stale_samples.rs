//! The last sample comes again.

use rand_distr::{Distribution, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::effect::{
    Docs, Effect, Example, Frames, Held, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage,
    View, detail, optional, parameter, value,
};
use crate::simulate::Simulation;

/// The effect.
pub struct StaleSamples;

/// Its id.
pub const ID: &str = "stale_samples";

/// The one instance that the library lists.
pub static EFFECT: StaleSamples = StaleSamples;

impl Effect for StaleSamples {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("count", "1", "frames that repeat the one before"),
            optional(
                "running",
                "1",
                "such frames in a row, on the average; 1 where it is left out",
            ),
            detail(
                "running_by_frames",
                "1",
                "length of the run that such a frame is in, on the average over these frames: running where all are as long; left out, they are",
            ),
            optional(
                "behind",
                "1",
                "how many frames the one that is repeated lies before, where a buffer was sent twice; 1 where it is left out",
            ),
            optional("silent", "1", "1 where the new-data flags do not tell"),
            optional(
                "sensor_rate",
                "Hz",
                "rate at which the sensor renews its readings, below that of the frames; frames then repeat as evenly as the beat of both lays them. Left out, they do at random",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Stale samples",
            physics: "A frame repeats the readings of the frame before: the sensor was read before it had a new sample, as one is all the time that renews its readings more slowly than frames come; or a buffer was sent twice.",
            excitation: "Nothing.",
            test: "Audit: new-data flags, and frames with all gyros equal to the frame before, or runs of them to those some frames before, against their chance.",
            remedy: "Read on the sensor's data-ready signal, or read more slowly, and skip frames whose new-data flag is not set. Where blocks come twice, hand each buffer over once.",
            figure: "The rate around each of them.",
            example: Example::new(Plot::Around, &[("count", 40.0)]).on_all(),
        }
    }

    fn named_first(&self, parameters: &Parameters) -> &'static [&'static str] {
        match parameters.contains_key("behind") {
            true => &["count", "behind"],
            false => &[],
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[Rival {
            cause: "dropped_samples",
            experiment: "the sequence numbers",
        }];
        RIVALS
    }

    fn hypotheses(&self, _view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        Ok(vec![Hypothesis::Audit])
    }

    fn stage(&self) -> Stage {
        Stage::Frames
    }

    fn holds(&self, parameters: &Parameters, frames: Frames) -> Option<Held> {
        let all = frames.samples.max(1) as f64;
        let renewed = value(parameters, "sensor_rate") / frames.rate_hz;
        if renewed > 0.0 && renewed < 1.0 {
            // Each reading is held for as many frames as the beat gives it, which are two numbers in turn.
            let mean = renewed.recip();
            let part = mean.fract();
            return Some(Held {
                gain: mean + part * (1.0 - part) / mean,
                reach: mean as usize,
                every: Some(mean),
            });
        }
        let part = (value(parameters, "count") / all).clamp(0.0, 1.0);
        let runs = Runs::of(parameters);
        // A block is as many frames, each of which comes once more.
        let again = (runs.by_frames / behind(parameters) as f64).max(1.0);
        (part > 0.0).then(|| Held {
            gain: 1.0 + part * (1.0 + again),
            reach: behind(parameters).max(runs.by_frames as usize),
            every: None,
        })
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let silent = value(parameters, "silent") != 0.0;
        let behind = behind(parameters).min(simulation.samples.saturating_sub(1).max(1));
        let repeat = |simulation: &mut Simulation, i: usize| {
            for &axis in channels {
                simulation.counts[axis][i] = simulation.counts[axis][i - behind];
                if !silent {
                    simulation.flags[i] &= !(1 << axis);
                }
            }
        };
        let renewed = value(parameters, "sensor_rate") / simulation.rate_hz;
        if renewed > 0.0 && renewed < 1.0 {
            let phase = Uniform::new(0.0, 1.0).map_or(0.0, |u| u.sample(&mut simulation.rng));
            let reading = |i: usize| (i as f64 * renewed + phase).floor();
            for i in (behind..simulation.samples).filter(|i| reading(*i) == reading(*i - 1)) {
                repeat(simulation, i);
            }
            return;
        }
        let count = simulation.events(value(parameters, "count").round().max(0.0) as usize);
        let count = count.min(simulation.samples.saturating_sub(behind));
        let lengths = Runs::of(parameters).drawn(count, &mut simulation.rng);
        // Each run comes behind another new frame, so that no two of them are one.
        let mut new = simulation.samples.saturating_sub(behind + count);
        let (mut left, mut at) = (lengths.len(), behind);
        let Ok(one) = Uniform::new(0.0, 1.0) else {
            return;
        };
        for run in lengths {
            while left < new && one.sample(&mut simulation.rng) * new as f64 >= left as f64 {
                (at, new) = (at + 1, new - 1);
            }
            if new > 0 {
                (at, new) = (at + 1, new - 1);
            }
            for i in at..(at + run).min(simulation.samples) {
                repeat(simulation, i);
            }
            (at, left) = (at + run, left - 1);
        }
    }
}

/// How many frames before the one lies that a frame repeats.
fn behind(parameters: &Parameters) -> usize {
    let stated = parameters.get("behind").map_or(1.0, |p| p.value);
    (stated.round() as usize).max(1)
}

/// How long stale frames go on: on the average over the runs, and over the frames of them.
#[derive(Clone, Copy)]
struct Runs {
    mean: f64,
    by_frames: f64,
}

impl Runs {
    fn of(parameters: &Parameters) -> Self {
        let get = |name: &str| parameters.get(name).map(|p| p.value);
        let mean = get("running").unwrap_or(1.0).max(1.0);
        // Of whole numbers about a mean, the least spread.
        let part = mean.fract();
        let even = mean + part * (1.0 - part) / mean;
        Self {
            mean,
            by_frames: get("running_by_frames").map_or(even, |q| q.max(even)),
        }
    }

    /// Lengths of runs of `count` frames in all. Where each frame is late by chance alone they are geometric, with a mean over
    /// the frames of 2 mean - 1; below that, so many of them are, and the others as long as the mean; above, so many of them
    /// are single ones, and the others geometric.
    fn drawn(self, count: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<usize> {
        let Ok(one) = Uniform::new(0.0, 1.0) else {
            return vec![];
        };
        let part = self.mean.fract();
        let least = self.mean + part * (1.0 - part) / self.mean;
        let by_chance = 2.0 * self.mean - 1.0;
        let (mut all, mut done, mut owed) = (vec![], 0, 0.0);
        // Mean of those that are geometric, and their part.
        let (long, geometric) = if self.by_frames > by_chance && self.mean > 1.0 {
            let long = 0.5 * self.mean * (self.by_frames - 1.0) / (self.mean - 1.0);
            (long, (self.mean - 1.0) / (long - 1.0))
        } else if by_chance > least {
            let part = (self.by_frames - least) / (by_chance - least);
            (self.mean, part.clamp(0.0, 1.0))
        } else {
            (self.mean, 0.0)
        };
        while done < count {
            let drawn = if one.sample(rng) < geometric {
                let chance: f64 = 1.0 - one.sample(rng);
                1.0 + (chance.ln() / (1.0 - long.recip()).ln()).floor()
            } else if long > self.mean {
                1.0
            } else {
                // As many as make the average right by then.
                owed += self.mean;
                let run = owed.round();
                owed -= run;
                run
            };
            let run = (drawn as usize).clamp(1, count - done);
            done += run;
            all.push(run);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;

    use super::*;
    use crate::file::{EffectModel, ModelFile};
    use crate::parameter::Parameter;

    type Tested = Result<(), Box<dyn std::error::Error>>;

    const RATE_HZ: f64 = 100.0;
    const SECONDS: f64 = 2000.0;

    /// The Allan deviation of gyro x at 1 s, times its root: the N that its angle shows.
    fn shown(
        parameters: &[(&str, f64)],
        pole: f64,
        seed: u64,
    ) -> Result<f64, Box<dyn std::error::Error>> {
        let mut model = ModelFile::paper();
        let named = |(name, v): &(&str, f64)| ((*name).to_owned(), Parameter::exact(*v, "1"));
        for (name, p) in &mut model.channels[0].baseline {
            p.value = f64::from(u8::from(name == "angle_random_walk")) * 60.0;
        }
        let effect = |cause: &str, parameters: &[(&str, f64)]| EffectModel {
            cause: cause.to_owned(),
            channels: vec!["gyro_x".into()],
            parameters: parameters.iter().map(named).collect(),
        };
        let filter = [("lag1_correlation", pole), ("triangular", 0.0)];
        let filter = (pole > 0.0).then(|| effect("low_pass", &filter));
        model.effects = [effect(ID, parameters)].into_iter().chain(filter).collect();
        let record = crate::simulate(&model, SECONDS, RATE_HZ, seed)?;
        let means: Vec<f64> = (record.channels[0].values)
            .chunks_exact(RATE_HZ as usize)
            .map(|c| c.iter().sum::<f64>() / RATE_HZ)
            .collect();
        let square = means.windows(2).map(|w| (w[1] - w[0]).powi(2));
        Ok((square.sum::<f64>() / 2.0 / (means.len() - 1) as f64).sqrt())
    }

    #[test]
    fn the_angle_behind_held_readings_walks_by_the_n_of_the_model() -> Tested {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(31);
        let uniform = Uniform::new(0.0, 1.0)?;
        for seed in 0..16 {
            let mut u = || uniform.sample(&mut rng);
            let pole = if u() < 0.5 { 0.0 } else { 0.7 * u() };
            let rate = ("sensor_rate", RATE_HZ * (0.25 + 0.72 * u()));
            let running = 1.0 + 3.0 * u();
            let all = SECONDS * RATE_HZ;
            let by_chance = [
                ("count", (0.02 + 0.4 * u()) * all),
                ("running", running),
                ("running_by_frames", running * (1.0 + 1.5 * u())),
            ];
            let beats = [("count", all), rate];
            let parameters: &[_] = if seed % 2 == 0 { &beats } else { &by_chance };
            let shown = shown(parameters, pole, seed)?;
            // Of 1999 changes of means the deviation is known to 2 %.
            assert!(
                (shown - 1.0).abs() < 0.08,
                "{parameters:?}, {pole}: {shown}"
            );
        }
        Ok(())
    }

    #[test]
    fn runs_are_as_long_as_they_are_said_to_be() -> Tested {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(32);
        let uniform = Uniform::new(0.0, 1.0)?;
        for _ in 0..30 {
            let mean: f64 = 1.05 + 4.0 * uniform.sample(&mut rng);
            let part = mean.fract();
            let least = mean + part * (1.0 - part) / mean;
            let by_frames = least + 2.0 * mean * uniform.sample(&mut rng);
            let runs = Runs { mean, by_frames }.drawn(400_000, &mut rng);
            let sum = |power| runs.iter().map(|r| (*r as f64).powi(power)).sum::<f64>();
            assert_eq!(sum(1), 400_000.0);
            let told = (sum(1) / runs.len() as f64, sum(2) / sum(1));
            assert!((told.0 / mean - 1.0).abs() < 0.03, "{mean}: {told:?}");
            assert!(
                (told.1 / by_frames - 1.0).abs() < 0.06,
                "{by_frames}: {told:?}"
            );
        }
        Ok(())
    }
}
