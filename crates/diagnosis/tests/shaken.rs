//! A stand that shakes, drawn at random: a mode that noise drives or a tone whose pitch wanders, felt by two or three gyros each by a gain and
//! a phase of its own, and by accelerometers or none. It is one cause on the axes that feel it, and the model shares it.

mod draws;
mod white;

use std::f64::consts::{PI, SQRT_2, TAU};

use diagnosis::{DiagnoseOptions, diagnose};
use model::record::{Axis, Channel, Quantity, Record};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

type Rng = Xoshiro256PlusPlus;

const RUNS: u64 = 24;
/// Of single effects 98 % are to be named: fewer of [`RUNS`] than this come once in 600 times. Of this seed and two others (31, 47) 70 of 72
/// are right (2026-11-27).
const LEAST: u64 = 21;
const SECONDS: f64 = 600.0;
/// Step of the readings, deg/s and g.
const GYRO_STEP: f64 = 1.0 / 131.0;
const ACC_STEP: f64 = 1.0 / 16384.0;
const ACC_NOISE: f64 = 3e-3;

fn between(rng: &mut Rng, low: f64, high: f64) -> f64 {
    Uniform::new(low, high).expect("a range").sample(rng)
}

fn normal(rng: &mut Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// What shakes: both quadratures, of standard deviation 1.
fn source(mode: bool, omega: f64, half_width: f64, samples: usize, rng: &mut Rng) -> Vec<[f64; 2]> {
    if mode {
        let kept = (-half_width).exp();
        let driven = (1.0 - kept * kept).sqrt();
        let (sin, cos) = omega.sin_cos();
        let mut z = [normal(rng), normal(rng)];
        let next = |_| {
            let turned = [cos * z[0] - sin * z[1], sin * z[0] + cos * z[1]];
            z = turned.map(|v| kept * v + driven * normal(rng));
            z
        };
        return (0..samples).map(next).collect();
    }
    let mut phase = between(rng, -PI, PI);
    let next = |_| {
        phase += omega + (2.0 * half_width).sqrt() * normal(rng);
        [SQRT_2 * phase.cos(), SQRT_2 * phase.sin()]
    };
    (0..samples).map(next).collect()
}

/// The part of an axis.
fn felt(z: &[[f64; 2]], size: f64, phase: f64) -> Vec<f64> {
    let (sin, cos) = phase.sin_cos();
    z.iter().map(|[a, b]| size * (cos * a - sin * b)).collect()
}

/// `IMU_STAND_SEED` draws other records.
fn seed() -> u64 {
    let own = std::env::var("IMU_STAND_SEED").ok();
    own.and_then(|s| s.parse().ok()).unwrap_or(20_261_129)
}

/// What was planted.
struct Planted {
    cause: &'static str,
    /// Standard deviation by axis, deg/s; 0 where it feels nothing.
    sizes: [f64; 3],
    told: String,
}

fn drawn(rng: &mut Rng) -> (Planted, Record) {
    let rate_hz = [20.0, 50.0, 100.0][between(rng, 0.0, 3.0) as usize];
    let samples = (SECONDS * rate_hz) as usize;
    let mode = between(rng, 0.0, 1.0) < 0.5;
    let with_acc = between(rng, 0.0, 1.0) < 0.5;
    let center = rate_hz * between(rng, 0.12, 0.45);
    let width = match mode {
        true => (center * between(rng, 0.004, 0.03)).max(20.0 / SECONDS),
        false => rate_hz * between(rng, 0.001, 0.005),
    };
    let [omega, half] = [TAU * center, PI * width].map(|w| w / rate_hz);
    let z = source(mode, omega, half, samples, rng);
    let without = between(rng, 0.0, 6.0) as usize;
    let mut sizes = [0.0; 3];
    let record = white::gyros(rate_hz, |axis| {
        let sigma = between(rng, 0.04, 0.12);
        sizes[axis] = if axis == without {
            0.0
        } else {
            sigma * between(rng, 0.4, 1.0)
        };
        let part = felt(&z, sizes[axis], between(rng, -PI, PI));
        let bias = between(rng, -1.0, 1.0);
        let read = part.iter().map(|p| {
            let rate = bias + p + sigma * normal(rng);
            (rate / GYRO_STEP).round() * GYRO_STEP
        });
        read.collect()
    });
    let mut record = record;
    let accelerometer = |(k, axis): (usize, &Axis)| {
        let size = ACC_NOISE * between(rng, 0.5, 2.0);
        let part = felt(&z, size, between(rng, -PI, PI));
        let level = if k == 2 { 1.0 } else { 0.0 };
        let read = part.iter().map(|p| {
            let a = level + p + ACC_NOISE * normal(rng);
            (a / ACC_STEP).round() * ACC_STEP
        });
        Channel {
            name: format!("acc_{}", ["x", "y", "z"][k]),
            quantity: Quantity::Acc,
            axis: Some(*axis),
            unit: "g".into(),
            lsb: None,
            counts: None,
            values: read.collect(),
        }
    };
    if with_acc {
        record
            .channels
            .extend(Axis::ALL.iter().enumerate().map(accelerometer));
    }
    let cause = if mode {
        "narrow_band"
    } else {
        "wandering_line"
    };
    let told =
        format!("{cause} {rate_hz} Hz, {center:.3} Hz, {width:.4} Hz, {sizes:.4?}, acc {with_acc}");
    let planted = Planted { cause, sizes, told };
    (planted, record)
}

#[test]
fn statistical_what_shakes_several_axes_is_one_cause_of_them() {
    let mut rng = Rng::seed_from_u64(seed());
    let options = DiagnoseOptions {
        replicates: 99,
        ..DiagnoseOptions::default()
    };
    let graded = draws::graded(RUNS, LEAST, |_| {
        let (planted, record) = drawn(&mut rng);
        let d = diagnose(&record, &options).expect("a diagnosis").diagnosis;
        let names: Vec<String> = (planted.sizes.iter().zip(["gyro_x", "gyro_y", "gyro_z"]))
            .filter(|(size, _)| **size > 0.0)
            .map(|(_, name)| name.to_owned())
            .collect();
        let size = |name: &str| {
            let p = d.findings.first()?.per_channel.get(name)?;
            // Of a tone its amplitude.
            let rms = p.get("rms").map(|p| (p.value, p.std_error));
            let tone = p
                .get("amplitude")
                .map(|p| (p.value / SQRT_2, p.std_error.map(|e| e / SQRT_2)));
            rms.or(tone)
        };
        let near = |(name, planted): (&String, &f64)| {
            size(name).is_some_and(|(v, e)| (v - planted).abs() < 4.0 * e.unwrap_or(0.0))
        };
        let felt = planted.sizes.iter().filter(|s| **s > 0.0);
        let sized = names.iter().zip(felt).all(near);
        let one = d.findings.len() == 1
            && d.findings[0].cause == planted.cause
            && d.findings[0].channels == names;
        let left = d.unexplained.iter().any(|u| u.material);
        let holds = d.replicates.values().all(|r| r.after.p_value > 0.01);
        if one && sized && !left && holds {
            return Ok(());
        }
        let found = d.findings.iter().map(|f| (&f.cause, &f.channels));
        Err(format!(
            "{}: {:?} {:?} sized {sized}, holds {holds}; {:?}",
            planted.told,
            found.collect::<Vec<_>>(),
            d.unexplained
                .iter()
                .map(|u| (&u.what, u.material))
                .collect::<Vec<_>>(),
            d.replicates
                .values()
                .map(|r| (r.after.p_value, r.after.strays()))
                .collect::<Vec<_>>(),
        ))
    });
    assert!(graded.is_ok(), "{}", graded.unwrap_err());
}
