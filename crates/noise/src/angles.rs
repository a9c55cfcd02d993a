//! What the integrated rates of a record say: the angle of each gyro beside its prediction, and the attitude of all three.

use std::collections::BTreeMap;
use std::ops::Range;

use model::record::{Axis, Channel, Quantity, Record};
use serde::{Deserialize, Serialize};

use crate::attitude::{angle_between, angle_growth, integrate, predicted_sigma};
use crate::fit::NoiseFit;
use crate::units::{Scale, Units};
use model::record::sampling::Sampling;

/// Part of the longest run whose mean is taken for the bias.
const CALIBRATION: f64 = 0.1;
/// Points reported.
const POINTS: usize = 20;
/// Samples below which nothing is integrated.
const NEEDED: usize = 40;

/// A channel integrated over its longest run without a gap, the mean of its first tenth taken out as the bias.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Angle {
    /// Unit of `angle`, `expected` and `sigma`.
    pub unit: String,
    /// Length over which the bias was taken, s.
    pub calibration_s: f64,
    /// The integral at instants after it.
    pub points: Vec<Integrated>,
}

/// The integral at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Integrated {
    /// Since the end of the calibration, s.
    pub t_s: f64,
    /// Measured.
    pub angle: f64,
    /// Expected of the fitted rate ramp; 0 without one.
    pub expected: f64,
    /// Standard deviation that the fitted noise predicts, the error of the bias counted.
    pub sigma: f64,
}

/// The attitude of three gyros, integrated as a quaternion over the longest run that all have, from the end of a tenth of
/// it that gives the biases.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attitude {
    /// Length over which the biases were taken, s.
    pub calibration_s: f64,
    /// At instants after it.
    pub points: Vec<Orientation>,
}

/// The attitude at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Orientation {
    /// Since the end of the calibration, s.
    pub t_s: f64,
    /// From body axes then to body axes at the start: w, x, y, z.
    pub quaternion: [f64; 4],
    /// Angle from the start, deg.
    pub angle_deg: f64,
    /// Standard deviations of the rotation about x, y and z that the fitted noise predicts of a stand at rest, the error of
    /// the biases counted, deg: those of the integrated angles. Absent beyond [`PREDICTED_TO_DEG`], where the axes mix, and where a
    /// gyro has no fit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_deg: Option<[f64; 3]>,
    /// Angle from the start that they predict, rms, that of fitted rate ramps with them, deg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_deg: Option<f64>,
}

/// Angle up to which the rotations that noise makes about the axes add like numbers, deg: most of the drift is the error of
/// the biases, a rotation about one axis. Over 3000 simulated stands the rms angle is 1.012, 1.011 and 1.009 (+- 0.008) times
/// what is predicted at 20, 40 and 60 deg, and 0.946 +- 0.006 times at 120 deg, where it comes round
/// (`cargo test -p noise rotations_of_noise -- --nocapture`).
pub const PREDICTED_TO_DEG: f64 = 60.0;

pub(crate) fn angle(
    channel: &Channel,
    runs: &[Range<usize>],
    fit: &NoiseFit,
    scale: &Scale,
) -> Option<Angle> {
    let longest = runs.iter().map(ExactSizeIterator::len).max()?;
    if longest < NEEDED {
        return None;
    }
    let calibration_s = CALIBRATION * longest as f64 * fit.tau0;
    let points = angle_growth(&channel.values, runs, fit, calibration_s, POINTS)
        .into_iter()
        .map(|p| Integrated {
            t_s: p.t_s,
            angle: p.angle * scale.factor,
            expected: p.expected * scale.factor,
            sigma: p.sigma * scale.factor,
        })
        .collect();
    Some(Angle {
        unit: scale.unit.clone(),
        calibration_s,
        points,
    })
}

/// The three gyros of a record, each with what takes its readings to rad/s; none where one is missing or has another unit.
fn gyros(record: &Record) -> Option<[(&Channel, f64); 3]> {
    let gyro = |axis: Axis| -> Option<(&Channel, f64)> {
        let channel = record
            .channels
            .iter()
            .find(|c| c.quantity == Quantity::Gyro && c.axis == Some(axis))?;
        let reading = Units::of(channel.quantity, &channel.unit).reading;
        (reading.unit == "deg/s").then_some((channel, reading.factor.to_radians()))
    };
    Some([gyro(Axis::X)?, gyro(Axis::Y)?, gyro(Axis::Z)?])
}

/// What the fit of a gyro predicts of its angle at a time after the calibration, deg: standard deviation and mean.
fn predicted_deg(fit: &NoiseFit, to_deg: f64, calibration_s: f64, t_s: f64) -> (f64, f64) {
    let mean = fit.maximum.ramp * t_s * (t_s + calibration_s) / 2.0;
    (
        predicted_sigma(fit, calibration_s, t_s) * to_deg,
        mean * to_deg,
    )
}

/// The attitude at an instant, with what is predicted about each axis (standard deviation and mean, deg) where that holds.
fn orientation(
    t_s: f64,
    quaternion: [f64; 4],
    angle_deg: f64,
    axes: Option<[(f64, f64); 3]>,
) -> Orientation {
    let squares = |a: [(f64, f64); 3]| a.iter().map(|(s, e)| s * s + e * e).sum::<f64>();
    let predicted_deg = axes.map(|a| squares(a).sqrt());
    let holds = predicted_deg.is_some_and(|p| p.max(angle_deg) <= PREDICTED_TO_DEG);
    Orientation {
        t_s,
        quaternion,
        angle_deg,
        sigma_deg: axes.filter(|_| holds).map(|a| a.map(|(sigma, _)| sigma)),
        predicted_deg: predicted_deg.filter(|_| holds),
    }
}

pub(crate) fn attitude(
    record: &Record,
    sampling: &Sampling,
    fits: &BTreeMap<String, NoiseFit>,
) -> Option<Attitude> {
    let gyros = gyros(record)?;
    // A reading missing on one axis interrupts all.
    let together: Vec<f64> = (0..record.len())
        .map(|i| gyros.iter().map(|(c, _)| c.values[i]).sum())
        .collect();
    let run = sampling
        .runs_of(&together)
        .into_iter()
        .max_by_key(ExactSizeIterator::len)
        .filter(|r| r.len() >= NEEDED)?;
    let calibration = (CALIBRATION * run.len() as f64).round() as usize;
    let (still, rest) = (
        run.start..run.start + calibration,
        run.start + calibration..run.end,
    );
    let bias = gyros.map(|(c, _)| c.values[still.clone()].iter().sum::<f64>() / calibration as f64);
    let rates: Vec<[f64; 3]> = rest
        .map(|i| {
            std::array::from_fn(|axis| {
                let (channel, to_si) = gyros[axis];
                (channel.values[i] - bias[axis]) * to_si
            })
        })
        .collect();
    let fits = gyros.map(|(c, to_si)| fits.get(&c.name).map(|fit| (fit, to_si.to_degrees())));
    let calibration_s = calibration as f64 * sampling.tau0;
    let predicted = |t_s: f64| -> Option<[(f64, f64); 3]> {
        let mut out = [(0.0, 0.0); 3];
        for (axis, fit) in out.iter_mut().zip(fits) {
            let (fit, to_deg) = fit?;
            *axis = predicted_deg(fit, to_deg, calibration_s, t_s);
        }
        Some(out)
    };
    let start = [1.0, 0.0, 0.0, 0.0];
    let path = integrate(&rates, sampling.tau0, start);
    let mut next = 1;
    let mut points = Vec::new();
    for (i, quaternion) in path {
        if i > 0 && i * POINTS >= next * (rates.len() - 1) {
            next = i * POINTS / (rates.len() - 1) + 1;
            let t_s = i as f64 * sampling.tau0;
            let angle_deg = angle_between(start, quaternion).to_degrees();
            points.push(orientation(t_s, quaternion, angle_deg, predicted(t_s)));
        }
    }
    Some(Attitude {
        calibration_s,
        points,
    })
}
