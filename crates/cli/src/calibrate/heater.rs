//! A heater cycle: the board is warmed and cooled again at rest. The bias of each gyro over its own thermometer.

use std::collections::BTreeMap;

use model::Parameter;
use model::file::EffectModel;
use numerics::least_squares::fit;
use wire::Frame;

use super::blocks::{Block, Blocks, moved, white};
use super::{Identified, Outcome, SequenceError, Told};
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
        refused,
        ..Outcome::of(&SEQUENCES[2], c.rate_hz, c.gyro_lsb_dps)
    };
    // One middle for all: that of the temperatures that the correction is for.
    let [lowest, highest] = range(points.iter().flat_map(|p| p.temp));
    out.temperatures = Some([lowest, highest]);
    for (k, axis) in AXES.iter().enumerate() {
        let Some(found) = course(axis, &points, k, variance[k], (lowest + highest) / 2.0)? else {
            continue;
        };
        out.baseline[k] = Some((
            found.bias.clone(),
            Parameter::exact((variance[k] * length).sqrt() * 60.0, "deg/sqrt(h)"),
        ));
        found.add_to(&mut out, format!("gyro_{axis}"));
    }
    Ok(out)
}

fn range(of: impl Iterator<Item = f64>) -> [f64; 2] {
    of.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| {
        [l.min(v), h.max(v)]
    })
}

/// How the bias of a gyro goes with its temperature.
struct Course {
    /// At the reference.
    bias: Parameter,
    /// Name and size: a slope, and a curvature where there is one.
    sizes: Vec<(&'static str, Parameter)>,
    /// Temperatures between which it was seen, and that from which a parabola counts, degC.
    seen: [f64; 2],
    reference: f64,
    /// Correlation of the temperature with time.
    with_time: f64,
}

/// The course of gyro `k` over points of a white variance; none where it cannot be fitted.
fn course(
    axis: &str,
    points: &[Point],
    k: usize,
    variance: f64,
    reference: f64,
) -> Result<Option<Course>, SequenceError> {
    let temp: Vec<f64> = points.iter().map(|p| p.temp[k]).collect();
    let [low, high] = range(temp.iter().copied());
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
    let t: Vec<f64> = points.iter().map(|p| p.t).collect();
    let y: Vec<f64> = points.iter().map(|p| p.gyro[k]).collect();
    let noise: Vec<f64> = points.iter().map(|p| variance / p.count).collect();
    let along: Vec<f64> = temp.iter().map(|t| t - reference).collect();
    let square: Vec<f64> = along.iter().map(|a| a * a).collect();
    let ones = vec![1.0; y.len()];
    let bent = fit(&y, &t, &noise, &[ones.clone(), along.clone(), square]);
    // A curvature that its interval does not tell from none is none: it would bend beyond what was measured.
    let bent = bent.filter(|f| f.values[2].abs() > 1.96 * f.errors[2]);
    let Some(found) = bent.or_else(|| fit(&y, &t, &noise, &[ones, along])) else {
        return Ok(None);
    };
    let named = [("slope", "deg/s/degC"), ("curvature", "deg/s/degC^2")].into_iter();
    let sizes = named.zip(found.values.iter().zip(&found.errors).skip(1));
    Ok(Some(Course {
        bias: Parameter::estimated(found.values[0], found.errors[0], "deg/s"),
        sizes: sizes
            .map(|((name, unit), (value, error))| {
                (name, Parameter::estimated(*value, *error, unit))
            })
            .collect(),
        seen: [low, high],
        reference,
        with_time: correlation(&temp, &t),
    }))
}

impl Course {
    fn add_to(self, out: &mut Outcome, channel: String) {
        let [low, high] = self.seen;
        let identified = self.sizes.iter().map(|(name, size)| Identified {
            channel: channel.clone(),
            what: format!("temperature, {name} ({low:.1} to {high:.1} degC)"),
            size: size.clone(),
        });
        out.identified.extend(identified);
        if self.with_time.abs() > 0.9 {
            out.not_identified.push(format!(
                "{channel}: its temperature went with time (correlation {:.2}): a bias that drifts looks alike; let it cool as far as it warmed",
                self.with_time
            ));
        }
        let is_bent = self.sizes.len() > 1;
        let sizes = self.sizes.into_iter();
        let mut parameters: BTreeMap<String, Parameter> =
            sizes.map(|(name, size)| (name.to_owned(), size)).collect();
        let cause = if is_bent {
            let reference = Parameter::exact(self.reference, "degC");
            parameters.insert("reference".to_owned(), reference);
            "temperature_quadratic"
        } else {
            "temperature"
        };
        out.effects.push(EffectModel {
            cause: cause.to_owned(),
            channels: vec![channel],
            parameters,
        });
    }
}
