//! A random walk from a hundredth of the white variance a reading to ten thousand times as much, as an oscillator's frequency or a gyro
//! that is read seldom has it: no cause is told, and the intervals of N and K hold. `IMU_STAND_SEED` takes other draws.

mod draws;
mod white;

use diagnosis::result::Parameter;
use diagnosis::{DiagnoseOptions, diagnose};
use noise::synthetic::Truth;
use rand_core::SeedableRng;
use rand_distr::{Distribution, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

const RUNS: u64 = 24;
/// A share of 0.95 misses this in 3 %.
const LEAST: u64 = 21;
const ROWS: usize = 6000;
/// Variance of a step of the walk over the white one: decades.
const RATIO: (f64, f64) = (-2.0, 4.0);
/// Standard errors within which a figure of three axes has to be, of one draw in 60 each.
const ERRORS: f64 = 3.0;
/// Standard error of K over that of a walk alone, 1 / (2 n)^1/2, that is allowed where the walk is the larger.
const WIDEST: f64 = 3.0;

#[test]
fn a_walk_that_makes_most_of_the_noise_is_no_cause_and_has_its_intervals() {
    let seed = draws::seed(20_261_130);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let told = draws::graded(RUNS, LEAST, |_| {
        let decades = Uniform::new(RATIO.0, RATIO.1).expect("a range");
        let ratio = 10f64.powf(decades.sample(&mut rng));
        let rate_hz = 20.0;
        let k = 0.01;
        // K^2 / rate is the variance of a step, N^2 rate that of a reading.
        let n = k / rate_hz / ratio.sqrt();
        let truth = Truth {
            n,
            k,
            ..Truth::default()
        };
        let record = white::gyros(rate_hz, |_| truth.record(ROWS, rate_hz.recip(), &mut rng));
        let told = diagnose(&record, &DiagnoseOptions::default());
        let d = told.expect("a diagnosis").diagnosis;
        if !(d.findings.is_empty() && d.unexplained.is_empty()) {
            return Err(format!(
                "{:?}, {:?} of {truth:?}",
                d.findings, d.unexplained
            ));
        }
        for (axis, told) in &d.extended {
            let off = |p: &Parameter, truth: f64| {
                (p.value - truth).abs() > ERRORS * p.std_error.unwrap_or(0.0)
            };
            let (found_n, found_k) = (&told["angle_random_walk"], &told["rate_random_walk"]);
            let wide = ratio > 1.0
                && found_k.std_error.unwrap_or(f64::INFINITY)
                    > WIDEST * k / (2.0 * ROWS as f64).sqrt();
            if off(found_n, 60.0 * n) || off(found_k, k) || wide {
                return Err(format!("{axis}: {found_n:?}, {found_k:?} of {truth:?}"));
            }
        }
        Ok(())
    });
    assert!(told.is_ok(), "seed {seed}: {}", told.unwrap_err());
}
