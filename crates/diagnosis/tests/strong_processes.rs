//! A process of the sensor, beyond what a bias drifts, on a base that its operator calls static: size, time constant and noise are
//! drawn, and what is told is graded by rate. `IMU_STAND_SEED` takes other draws.

mod draws;

use diagnosis::result::{Diagnosis, Parameter};
use diagnosis::{DiagnoseOptions, diagnose};
use model::ModelFile;
use model::record::{Base, Record};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

const RATE_HZ: f64 = 50.0;
const SECONDS: f64 = 400.0;
/// Draws, and the fewest that are right: the claims that go with a name take one in a hundred.
const DRAWS: u64 = 12;
const FEWEST: u64 = 11;
/// Standard errors that a size may be off: one of 36 is farther once in ten runs of all draws.
const OFF: f64 = 3.0;

fn by_ratio(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    let ln = Uniform::new(low.ln(), high.ln()).expect("a range");
    ln.sample(rng).exp()
}

/// A gyro of that noise, deg/sqrt(h), with a Gauss-Markov process of a size, deg/s, and a correlation time, s.
fn record(rng: &mut Xoshiro256PlusPlus, noise: f64, sigma: f64, time: f64) -> Record {
    let mut record = model::simulate(&ModelFile::paper(), SECONDS, RATE_HZ, 1).expect("a run");
    record.header.base = Some(Base::Static);
    record.channels.retain(|c| c.name == "gyro_x");
    let channel = &mut record.channels[0];
    (channel.lsb, channel.counts) = (None, None);
    let white = noise / 60.0 * RATE_HZ.sqrt();
    let kept = (-1.0 / (RATE_HZ * time)).exp();
    let mut normal = || -> f64 { StandardNormal.sample(rng) };
    let mut slow = sigma * normal();
    for v in &mut channel.values {
        *v = slow + white * normal();
        slow = kept * slow + sigma * (1.0 - kept * kept).sqrt() * normal();
    }
    record
}

/// What is wrong with a value.
fn off(what: &str, p: Option<&Parameter>, planted: f64) -> Result<(), String> {
    let p = p.ok_or(format!("no {what}"))?;
    let error = p.std_error.ok_or(format!("{what} without an error"))?;
    if (p.value - planted).abs() < OFF * error {
        return Ok(());
    }
    Err(format!("{what} {} +- {error} of {planted}", p.value))
}

fn told(record: &Record) -> Diagnosis {
    let options = DiagnoseOptions {
        no_evidence: true,
        ..DiagnoseOptions::default()
    };
    diagnose(record, &options).expect("a diagnosis").diagnosis
}

#[test]
fn a_strong_process_on_a_static_base_is_the_sensors() -> Result<(), String> {
    let seed = draws::seed(20_261_129);
    draws::graded(DRAWS, FEWEST, |draw| {
        let rng = &mut Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_mul(1000) + draw);
        let (noise, sigma) = (by_ratio(rng, 0.5, 1.0), by_ratio(rng, 0.32, 1.0));
        let time = by_ratio(rng, 0.8, 6.0);
        let d = told(&record(rng, noise, sigma, time));
        let planted = format!("{noise:.2} deg/sqrt(h), {sigma:.2} deg/s of {time:.1} s");
        let causes: Vec<&str> = d.findings.iter().map(|f| f.cause.as_str()).collect();
        let [f] = &d.findings[..] else {
            return Err(format!("{planted}: {causes:?}"));
        };
        if f.cause != "gauss_markov" || !d.unexplained.is_empty() {
            return Err(format!("{planted}: {causes:?}"));
        }
        let extended = d.extended.get("gyro_x");
        let white = extended.and_then(|m| m.get("angle_random_walk"));
        let of = |name: &str| f.parameters.get(name);
        off("sigma", of("sigma"), sigma)
            .and_then(|()| off("time", of("correlation_time"), time))
            .and_then(|()| off("noise", white, noise))
            .map_err(|e| format!("{planted}: {e}"))
    })
}
