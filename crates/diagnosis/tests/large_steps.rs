//! Bias steps of any size: a gyro of another board whose level steps once or twice, drawn, and what is told of it, graded by rate.
//! The larger a step, the plainer it is; nothing that is asked before the search may lose it. `IMU_STAND_SEED` takes other draws.

mod draws;
mod white;

use diagnosis::result::Diagnosis;
use diagnosis::{DiagnoseOptions, diagnose};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

const RUNS: u64 = 24;
/// One step, and one of a pair, may be found beside something else that chance made.
const LEAST: u64 = 22;

fn between(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    Uniform::new(low, high).map_or(low, |u| u.sample(rng))
}

/// A record with what was planted.
struct Planted {
    rate_hz: f64,
    sigma: f64,
    /// Of the readings with their rounding.
    noise: f64,
    /// Time, s, and height, deg/s.
    steps: Vec<(f64, f64)>,
    readings: Vec<f64>,
}

/// `sizes` in standard deviations; rounded or not, at a reading or between two, where a reading is a mean over the time before it;
/// beside a random walk or not.
fn planted(rng: &mut Xoshiro256PlusPlus, sizes: (f64, f64), count: usize) -> Planted {
    let pick = |rng: &mut Xoshiro256PlusPlus, of: &[f64]| {
        of[between(rng, 0.0, of.len() as f64) as usize % of.len()]
    };
    let rate_hz = pick(rng, &[20.0, 50.0, 100.0, 200.0]);
    let n = 20_000;
    let seconds = n as f64 / rate_hz;
    let sigma = between(rng, -2.5, -0.8).exp2();
    let lsb = sigma * pick(rng, &[0.0, 0.05, 0.3, 1.0]);
    let walk = sigma * pick(rng, &[0.0, 0.0, 1e-3, 3e-3]);
    let size = between(rng, sizes.0.ln(), sizes.1.ln()).exp() * sigma;
    let back = between(rng, -1.0, 1.0);
    let steps: Vec<(f64, f64)> = (0..count)
        .map(|i| {
            let part = (0.15 + 0.4 * i as f64, 0.5 + 0.4 * i as f64);
            let height = if i == 0 { size } else { size * back.signum() };
            (seconds * between(rng, part.0, part.1), height)
        })
        .collect();
    let averaged = between(rng, 0.0, 1.0) < 0.5;
    let mut level = 0.0;
    let readings = (0..n).map(|i| {
        let (white, step): (f64, f64) = (StandardNormal.sample(rng), StandardNormal.sample(rng));
        level += walk * step;
        let after = |t: f64| {
            let past = i as f64 - t * rate_hz;
            if averaged {
                (past + 1.0).clamp(0.0, 1.0)
            } else {
                f64::from(u8::from(past >= 0.0))
            }
        };
        let stepped: f64 = steps.iter().map(|(t, h)| h * after(*t)).sum();
        let v = level + stepped + sigma * white;
        if lsb > 0.0 {
            (v / lsb).round() * lsb
        } else {
            v
        }
    });
    let readings = readings.collect();
    Planted {
        rate_hz,
        sigma,
        noise: (sigma * sigma + lsb * lsb / 12.0).sqrt(),
        steps,
        readings,
    }
}

fn told(p: &Planted, rng: &mut Xoshiro256PlusPlus) -> Diagnosis {
    let record = white::gyros(p.rate_hz, |axis| {
        let mut own = || -> f64 { StandardNormal.sample(rng) };
        match axis {
            0 => p.readings.clone(),
            _ => (0..p.readings.len()).map(|_| p.sigma * own()).collect(),
        }
    });
    diagnose(&record, &DiagnoseOptions::default())
        .expect("a diagnosis")
        .diagnosis
}

/// What is wrong with an answer.
fn wrong(p: &Planted, d: &Diagnosis) -> Result<(), String> {
    let of_x = d.findings.iter().filter(|f| f.channels == ["gyro_x"]);
    let mut found: Vec<(f64, f64)> = vec![];
    for f in of_x {
        if f.cause != "bias_step" {
            return Err(format!("{} beside {:?}", f.cause, p.steps));
        }
        found.push((f.parameters["time"].value, f.parameters["height"].value));
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let alike = |(a, b): (&(f64, f64), &(f64, f64))| {
        let near = if b.1.abs() > 12.0 * p.sigma {
            2.0
        } else {
            12.0
        };
        (a.0 - b.0).abs() * p.rate_hz < near && (a.1 - b.1).abs() < (0.03 * b.1.abs()).max(p.sigma)
    };
    let unnamed = d.unexplained.iter().any(|u| u.channel == "gyro_x");
    let density = d.extended["gyro_x"]["angle_random_walk"].value;
    let noise = density / (p.noise / p.rate_hz.sqrt() * 60.0);
    if found.len() != p.steps.len() || !found.iter().zip(&p.steps).all(alike) || unnamed {
        return Err(format!(
            "{found:?} of {:?}, sigma {}; {:?}",
            p.steps, p.sigma, d.unexplained
        ));
    }
    if (noise - 1.0).abs() > 0.04 {
        return Err(format!("the noise {noise} times what it is, {:?}", p.steps));
    }
    Ok(())
}

fn graded(of: u64, sizes: (f64, f64), count: usize) {
    let seed = draws::seed(20_261_128);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_mul(1000) + of);
    let told = draws::graded(RUNS, LEAST, |_| {
        let p = planted(&mut rng, sizes, count);
        let d = told(&p, &mut rng);
        wrong(&p, &d)
    });
    assert!(told.is_ok(), "seed {seed}: {}", told.unwrap_err());
}

#[test]
fn a_step_of_three_to_a_thousand_sigma_is_named_alone_with_its_height_and_time() {
    graded(1, (3.0, 1000.0), 1);
}

#[test]
fn a_step_of_fifteen_sigma_and_more_is_no_ramp_of_readings_set_aside() {
    graded(2, (15.0, 1000.0), 1);
}

#[test]
fn two_steps_of_any_size_are_two() {
    graded(3, (5.0, 1000.0), 2);
}
