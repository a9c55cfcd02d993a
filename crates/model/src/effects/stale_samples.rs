//! The last sample comes again.

use rand_distr::{Distribution, Uniform};

use crate::effect::{
    Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    optional, parameter, value,
};
use crate::simulate::Simulation;

/// The effect.
pub struct StaleSamples;

/// Its id.
pub const ID: &str = "stale_samples";

/// The one instance that the library lists.
pub static EFFECT: StaleSamples = StaleSamples;

/// Draws of a place for a run of stale frames, for each frame of a record.
const DRAWN: usize = 8;

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

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let silent = value(parameters, "silent") != 0.0;
        let behind = parameters.get("behind").map_or(1.0, |p| p.value);
        let behind =
            (behind.round() as usize).clamp(1, simulation.samples.saturating_sub(1).max(1));
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
        let Ok(at) = Uniform::new(behind, simulation.samples.max(behind + 1)) else {
            return;
        };
        let running = parameters.get("running").map_or(1.0, |p| p.value).max(1.0);
        let mut stale = vec![false; simulation.samples];
        // Of many some fall on others: drawn anew, so often that all find a place.
        let (mut done, mut drawn) = (0.0, 0);
        while done < count as f64 && drawn < DRAWN * simulation.samples {
            drawn += 1;
            let first = at.sample(&mut simulation.rng).min(simulation.samples - 1);
            // As many as make the average right by then.
            let frames = ((done / running).floor() + 1.0) * running - done;
            let frames = (frames.round() as usize).clamp(1, count - done as usize);
            let run = first..(first + frames).min(simulation.samples);
            if stale[run.clone()].iter().any(|s| *s) {
                continue;
            }
            for i in run {
                stale[i] = true;
                repeat(simulation, i);
            }
            done += frames as f64;
        }
    }
}
