//! White noise is what a spectrum has at every frequency: what has no name stands above it, and where what has no name covers it,
//! its interval says so.

mod draws;
mod white;

use std::f64::consts::TAU;

use diagnosis::result::Diagnosis;
use diagnosis::{DiagnoseOptions, diagnose};
use rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;
use white::gyros;

const RATE_HZ: f64 = 100.0;
const SAMPLES: usize = 60_000;

fn between(low: f64, high: f64, rng: &mut impl Rng) -> f64 {
    Uniform::new(low, high).expect("a range").sample(rng)
}

/// Draws and grades so many runs, of which at least so many have to be right.
fn graded_over(
    (runs, least): (u64, u64),
    what: &str,
    mut right: impl FnMut(u64, &mut Xoshiro256PlusPlus) -> Result<(), String>,
) {
    let seed = std::env::var("IMU_STAND_SEED").ok();
    let seed = seed.and_then(|s| s.parse().ok()).unwrap_or(0xf100);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let told = draws::graded(runs, least, |run| right(run, &mut rng));
    assert!(told.is_ok(), "{what}: {}", told.unwrap_err());
}

/// White noise of this deviation by the sample.
fn noise(sigma: impl Fn(usize) -> f64, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let one = |i| sigma(i) * Distribution::<f64>::sample(&StandardNormal, rng);
    (0..SAMPLES).map(one).collect()
}

/// What is told of readings of one axis, beside two of plain noise.
fn told(x: &[f64], seed: u64) -> Diagnosis {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let record = gyros(RATE_HZ, |axis| match axis {
        0 => x.to_vec(),
        _ => noise(|_| 0.08, &mut rng),
    });
    let options = DiagnoseOptions {
        replicates: 99,
        ..DiagnoseOptions::default()
    };
    diagnose(&record, &options).expect("a diagnosis").diagnosis
}

/// N of the axis, and its standard error.
fn n_of(d: &Diagnosis) -> (f64, f64) {
    let p = &d.extended["gyro_x"]["angle_random_walk"];
    (p.value, p.std_error.unwrap_or(f64::NAN))
}

/// Of the first eight draws 6 were right: of one the period was not said, and of one N was that of the louder part, 16 % high, which is
/// where the nearest law of the library ends.
#[test]
fn noise_whose_size_swings_keeps_its_n_and_its_period_is_said() {
    graded_over((8, 5), "a swing", |run, rng| {
        let (depth, period) = (between(0.15, 0.4, rng), between(25.0, 90.0, rng));
        let sigma = between(0.03, 0.2, rng);
        let swing = |i: usize| 1.0 + depth * (TAU * i as f64 / RATE_HZ / period).sin();
        let x = noise(|i| sigma * swing(i), rng);
        let d = told(&x, 100 + run);
        // In deg/sqrt(h); the readings have it to 0.3 %.
        let rms = (x.iter().map(|v| v * v).sum::<f64>() / SAMPLES as f64).sqrt();
        let truth = rms * 60.0 / RATE_HZ.sqrt();
        let (n, error) = n_of(&d);
        let near = (n / truth - 1.0).abs() < 0.03 && error < 0.02 * truth;
        let said = d.unexplained.iter().find_map(|u| {
            let rest = u.what.split_once("swings with a period of ")?.1;
            rest.split_once(' ')?.0.parse::<f64>().ok()
        });
        let named = d.findings.iter().any(|f| f.channels == ["gyro_x"]);
        let right = said.is_some_and(|s| (s / period - 1.0).abs() < 0.05);
        (near && (right || named)).then_some(()).ok_or_else(|| {
            let all: Vec<_> = d.unexplained.iter().map(|u| &u.what).collect();
            format!("{depth} {period}: N {n} +- {error} of {truth}, {all:?}")
        })
    });
}

#[test]
fn angles_that_are_counted_leave_no_n_that_is_surely_too_small() {
    graded_over((8, 7), "counted angles", |run, rng| {
        // White noise, deg/sqrt(h), and the step of an angle that takes some of its increments.
        let n = 10f64.powf(between(-2.0, -0.5, rng));
        let step = between(0.001, 0.004, rng);
        let mut angle = 0.0;
        let drive = noise(|_| n / 60.0 / RATE_HZ.sqrt(), rng);
        let rate = between(0.05, 0.3, rng);
        let mut before = 0.0;
        let x: Vec<f64> = (drive.iter())
            .map(|d| {
                angle += rate / RATE_HZ + d;
                let read = (angle / step).round() * step;
                let by = (read - before) * RATE_HZ;
                before = read;
                by
            })
            .collect();
        let d = told(&x, 200 + run);
        let (found, error) = n_of(&d);
        let most = d.unexplained.iter().filter_map(|u| u.share_of_variance);
        let whole = most.fold(0.0, f64::max) <= 1.0 + 1e-9;
        // What the program calls known has to be there: its interval, and half of that of the noise itself.
        let upper = found + 1.96 * error;
        let holds = upper > 0.5 * n;
        (whole && holds)
            .then_some(())
            .ok_or_else(|| format!("N {n}, step {step}, rate {rate}: {found} +- {error}"))
    });
}
