//! A bias that settles from the start of the record on, in a second or in minutes: one warm-up with its size and its time, graded by
//! rate over draws. `IMU_STAND_SEED` takes other draws.

mod draws;
mod white;

use diagnosis::result::{Diagnosis, Parameter};
use diagnosis::{DiagnoseOptions, diagnose};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

const RUNS: u64 = 24;
/// A share of 0.95 misses this in 3 %.
const LEAST: u64 = 21;
const ROWS: usize = 30_000;
/// Root of twice the likelihood ratio that an exponential has in white noise.
const STRENGTHS: (f64, f64) = (12.0, 200.0);
/// Shortest time constant, s, and the part of the record that the longest is.
const SHORTEST_S: f64 = 0.7;
const LONGEST: f64 = 0.15;
/// Standard errors within which a figure has to be, of one draw in 300 each, and the error of the noise, relative.
const ERRORS: f64 = 3.0;
const NOISE: f64 = 0.04;

fn between(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    Uniform::new(low, high).map_or(low, |u| u.sample(rng))
}

#[derive(Debug)]
struct Settling {
    rate_hz: f64,
    sigma: f64,
    amplitude: f64,
    time_constant: f64,
    walk: f64,
}

impl Settling {
    fn drawn(rng: &mut Xoshiro256PlusPlus) -> Self {
        let pick = |rng: &mut Xoshiro256PlusPlus, of: &[f64]| {
            of[between(rng, 0.0, of.len() as f64) as usize % of.len()]
        };
        let rate_hz = pick(rng, &[20.0, 50.0, 100.0, 200.0]);
        let seconds = ROWS as f64 / rate_hz;
        let sigma = between(rng, -3.5, -1.0).exp2();
        let time_constant = between(rng, SHORTEST_S.ln(), (LONGEST * seconds).ln()).exp();
        let strength = between(rng, STRENGTHS.0.ln(), STRENGTHS.1.ln()).exp();
        let sign = between(rng, -1.0, 1.0).signum();
        Self {
            rate_hz,
            sigma,
            amplitude: sign * strength * sigma * (2.0 / (time_constant * rate_hz)).sqrt(),
            time_constant,
            walk: sigma * pick(rng, &[0.0, 0.0, 3e-4, 1e-3]),
        }
    }

    fn told(&self, rng: &mut Xoshiro256PlusPlus) -> Diagnosis {
        let record = white::gyros(self.rate_hz, |axis| {
            let mut level = 0.0;
            let readings = (0..ROWS).map(|i| {
                let mut own = || -> f64 { StandardNormal.sample(rng) };
                level += self.walk * own();
                let t = i as f64 / self.rate_hz;
                let course = self.amplitude * (-t / self.time_constant).exp();
                level + self.sigma * own() + if axis == 0 { course } else { 0.0 }
            });
            readings.collect()
        });
        let told = diagnose(&record, &DiagnoseOptions::default());
        told.expect("a diagnosis").diagnosis
    }

    fn wrong(&self, d: &Diagnosis) -> Result<(), String> {
        let names: Vec<String> = d
            .findings
            .iter()
            .map(|f| format!("{} on {:?}", f.cause, f.channels))
            .collect();
        let [found] = d.findings.as_slice() else {
            return Err(format!("{names:?} of {self:?}"));
        };
        if found.cause != "warm_up" || found.channels != ["gyro_x"] || !d.unexplained.is_empty() {
            return Err(format!("{names:?}, {:?} of {self:?}", d.unexplained));
        }
        let off = |p: &Parameter, truth: f64| {
            (p.value - truth).abs() > ERRORS * p.std_error.unwrap_or(0.0)
        };
        let (amplitude, time) = (
            &found.parameters["amplitude"],
            &found.parameters["time_constant"],
        );
        if off(amplitude, self.amplitude) || off(time, self.time_constant) {
            return Err(format!("{amplitude:?}, {time:?} of {self:?}"));
        }
        let density = d.extended["gyro_x"]["angle_random_walk"].value;
        let noise = density / (self.sigma / self.rate_hz.sqrt() * 60.0);
        if (noise - 1.0).abs() > NOISE {
            return Err(format!("the noise {noise} times what it is, {self:?}"));
        }
        Ok(())
    }
}

#[test]
fn a_bias_that_settles_in_a_second_or_in_minutes_is_one_warm_up_with_its_size_and_time() {
    let seed = draws::seed(20_261_128);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let told = draws::graded(RUNS, LEAST, |_| {
        let settling = Settling::drawn(&mut rng);
        let d = settling.told(&mut rng);
        settling.wrong(&d)
    });
    assert!(told.is_ok(), "seed {seed}: {}", told.unwrap_err());
}
