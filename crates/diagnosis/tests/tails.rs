//! White noise with the tails of Student's law: no cause is told, no reading is left out of N, and the simulations of the model have the
//! tails, too; graded by rate over draws. `IMU_STAND_SEED` takes other draws.

mod draws;
mod white;

use diagnosis::{DiagnoseOptions, diagnose};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, StudentT, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

const RUNS: u64 = 24;
/// A share of 0.95 misses this in 3 %.
const LEAST: u64 = 21;
const ROWS: usize = 12_000;
/// Degrees of freedom: with 4 and fewer the law has no fourth moment, by which a model tells its tails; of more the tails are hardly
/// seen.
const DEGREES: (f64, f64) = (4.0, 8.0);
/// Distance of N from the standard deviation of the readings, in parts of it: three errors of a normal noise are 2 %, and its spectrum may
/// take as much.
const CLOSE: f64 = 0.04;
/// Chance at or below which the replicates of a model do not hold the record.
const HELD: f64 = 0.01;

#[test]
fn tails_are_the_noise_and_not_left_out() {
    let seed = draws::seed(20_261_131);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let told = draws::graded(RUNS, LEAST, |_| {
        let degrees = Uniform::new(DEGREES.0, DEGREES.1).expect("a range");
        let degrees = degrees.sample(&mut rng);
        let law = StudentT::new(degrees).expect("a law");
        let rate_hz = 20.0;
        let mut deviation = 0.0;
        let record = white::gyros(rate_hz, |axis| {
            let mut drawn = || match axis {
                0 => law.sample(&mut rng),
                _ => StandardNormal.sample(&mut rng),
            };
            let values: Vec<f64> = (0..ROWS).map(|_| drawn()).collect();
            if axis == 0 {
                let square: f64 = values.iter().map(|v| v * v).sum();
                deviation = (square / ROWS as f64).sqrt();
            }
            values
        });
        let options = DiagnoseOptions {
            replicates: 199,
            ..DiagnoseOptions::default()
        };
        let told = diagnose(&record, &options);
        let d = told.expect("a diagnosis").diagnosis;
        if !d.findings.is_empty() {
            return Err(format!("{degrees:.2}: {:?}", d.findings));
        }
        // N in deg/sqrt(h) of a white noise of this deviation.
        let n = d.extended["gyro_x"]["angle_random_walk"].value;
        let part = n / (60.0 * deviation / rate_hz.sqrt());
        let after = &d.replicates["gyro_x"].after;
        if (part - 1.0).abs() > CLOSE || after.p_value <= HELD {
            return Err(format!("{degrees:.2}: N {part:.3} of it, {after:?}"));
        }
        Ok(())
    });
    assert!(told.is_ok(), "seed {seed}: {}", told.unwrap_err());
}
