//! A heater cycle: the board is warmed and cooled again at rest. The bias of each gyro over its own thermometer.

use std::collections::BTreeMap;

use model::Parameter;
use model::file::EffectModel;
use wire::Frame;

use super::blocks::{Block, Blocks, moved, white};
use super::{Identified, Outcome, SequenceError, Told, fit};
use crate::RecordBuilder;
use crate::capture::Calibration;
use crate::link::Link;
use crate::plan::SEQUENCES;

/// How the sequence is run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heater {
    /// How long in all, s: the heater is on for the first half.
    pub seconds: f64,
}

const AXES: [&str; 3] = ["x", "y", "z"];
/// What every thermometer has to move by, degC: a slope of 0.02 deg/s/degC is then as large as what a bias walks in 20 minutes.
const LEAST_C: f64 = 3.0;
/// Points that are fitted, at the most: blocks are joined until there are so few.
const POINTS: usize = 120;

/// Means of several blocks.
struct Point {
    t: f64,
    gyro: [f64; 3],
    temp: [f64; 3],
    count: f64,
}

/// Runs it.
///
/// # Errors
/// [`SequenceError`].
pub fn heater(
    link: &mut Link,
    how: Heater,
    tell: &mut dyn FnMut(Told),
) -> Result<Outcome, SequenceError> {
    let mut builder = RecordBuilder::new(Calibration::default());
    builder.hello(&link.ask_hello()?);
    let c = builder.calibration().clone();
    let mut blocks = Blocks::new(c.clone());
    tell(Told::Do(
        "switch the heater on, and leave the stand alone".to_owned(),
    ));
    let (from, mut cools) = (link.now().as_secs_f64(), false);
    let (mut runs, mut refused): (Vec<Vec<Block>>, Vec<String>) = (vec![Vec::new()], Vec::new());
    loop {
        link.read()?;
        let now = link.now().as_secs_f64();
        if now - from > how.seconds {
            break;
        }
        if !cools && now - from > how.seconds / 2.0 {
            cools = true;
            tell(Told::Do("switch the heater off".to_owned()));
        }
        while let Some(frame) = link.next() {
            let Frame::Sample(sample) = frame else {
                continue;
            };
            let Some(block) = blocks.push(&sample, now) else {
                continue;
            };
            let run = runs.last_mut().and_then(|run| run.last());
            if let Some(why) = run.and_then(|before| moved(before, &block, &c)) {
                let why = format!("at {:.0} s: {why}", now - from);
                tell(Told::Refused(why.clone()));
                refused.push(why);
                // The block that moved is left out; another run begins.
                runs.push(Vec::new());
                continue;
            }
            if let Some(run) = runs.last_mut() {
                run.push(block);
            }
        }
    }
    runs.retain(|run| run.len() > 1);
    outcome(&runs, &c, refused)
}

fn points(runs: &[Vec<Block>]) -> Vec<Point> {
    let all: usize = runs.iter().map(Vec::len).sum();
    let join = all.div_ceil(POINTS).max(1);
    let chunks = runs.iter().flat_map(|run| run.chunks(join));
    chunks
        .map(|chunk| {
            let n = chunk.len() as f64;
            let mean = |of: &dyn Fn(&Block) -> f64| chunk.iter().map(of).sum::<f64>() / n;
            Point {
                t: mean(&|b| b.t),
                gyro: [0, 1, 2].map(|k| mean(&|b| b.gyro[k])),
                temp: [0, 1, 2].map(|k| mean(&|b| b.temp[k])),
                count: n,
            }
        })
        .collect()
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let mean = |x: &[f64]| x.iter().sum::<f64>() / n;
    let (ma, mb) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(usize) -> f64| (0..a.len()).map(f).sum::<f64>();
    let both = sum(&|k| (a[k] - ma) * (b[k] - mb));
    both / (sum(&|k| (a[k] - ma).powi(2)) * sum(&|k| (b[k] - mb).powi(2))).sqrt()
}

fn outcome(
    runs: &[Vec<Block>],
    c: &Calibration,
    refused: Vec<String>,
) -> Result<Outcome, SequenceError> {
    let points = points(runs);
    let slices: Vec<&[Block]> = runs.iter().map(|run| &run[..]).collect();
    let variance = white(&slices);
    let length = slices.first().map_or(1.0, |run| run[1].t - run[0].t);
    let mut out = Outcome {
        sequence: "heater",
        identified: Vec::new(),
        not_identified: SEQUENCES[2]
            .cannot
            .iter()
            .map(|c| (*c).to_owned())
            .collect(),
        refused,
        effects: Vec::new(),
        baseline: [None, None, None],
        temperatures: None,
        rate_hz: c.rate_hz,
        lsb_dps: c.gyro_lsb_dps,
    };
    let t: Vec<f64> = points.iter().map(|p| p.t).collect();
    // One middle for all: that of the temperatures that the correction is for.
    let all = points.iter().flat_map(|p| p.temp);
    let [lowest, highest] = all.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| {
        [l.min(v), h.max(v)]
    });
    let reference = (lowest + highest) / 2.0;
    out.temperatures = Some([lowest, highest]);
    for (k, axis) in AXES.iter().enumerate() {
        let temp: Vec<f64> = points.iter().map(|p| p.temp[k]).collect();
        let low = temp.iter().copied().fold(f64::INFINITY, f64::min);
        let high = temp.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // Without a point there is no range either.
        let moved = (high - low).max(0.0);
        if moved < LEAST_C {
            return Err(SequenceError::NotDone {
                what: format!(
                    "the thermometer of gyro {axis} moved by {moved:.1} degC; {LEAST_C:.0} are needed"
                ),
                help: "a stronger heater, or longer: `--seconds 1800`".to_owned(),
            });
        }
        let y: Vec<f64> = points.iter().map(|p| p.gyro[k]).collect();
        let noise: Vec<f64> = points.iter().map(|p| variance[k] / p.count).collect();
        let along: Vec<f64> = temp.iter().map(|t| t - reference).collect();
        let square: Vec<f64> = along.iter().map(|a| a * a).collect();
        let ones = vec![1.0; y.len()];
        let bent = fit(&y, &t, &noise, &[ones.clone(), along.clone(), square]);
        // A curvature that its interval does not tell from none is none: it would bend beyond what was measured.
        let bent = bent.filter(|f| f.values[2].abs() > 1.96 * f.errors[2]);
        let is_bent = bent.is_some();
        let Some(found) = bent.or_else(|| fit(&y, &t, &noise, &[ones, along])) else {
            continue;
        };
        let mut parameters = BTreeMap::new();
        let channel = format!("gyro_{axis}");
        for (name, at, unit) in [("slope", 1, "deg/s/degC"), ("curvature", 2, "deg/s/degC^2")] {
            if let (Some(value), Some(error)) = (found.values.get(at), found.errors.get(at)) {
                let size = Parameter::estimated(*value, *error, unit);
                out.identified.push(Identified {
                    channel: channel.clone(),
                    what: format!("temperature, {name} ({low:.1} to {high:.1} degC)"),
                    size: size.clone(),
                });
                parameters.insert(name.to_owned(), size);
            }
        }
        let with_time = correlation(&temp, &t);
        if with_time.abs() > 0.9 {
            out.not_identified.push(format!(
                "gyro_{axis}: its temperature went with time (correlation {with_time:.2}): a bias that drifts looks alike; let it cool as far as it warmed"
            ));
        }
        if is_bent {
            parameters.insert("reference".to_owned(), Parameter::exact(reference, "degC"));
        }
        let cause = if is_bent {
            "temperature_quadratic"
        } else {
            "temperature"
        };
        out.effects.push(EffectModel {
            cause: cause.to_owned(),
            channels: vec![channel],
            parameters,
        });
        out.baseline[k] = Some((
            Parameter::estimated(found.values[0], found.errors[0], "deg/s"),
            Parameter::exact((variance[k] * length).sqrt() * 60.0, "deg/sqrt(h)"),
        ));
    }
    Ok(out)
}
