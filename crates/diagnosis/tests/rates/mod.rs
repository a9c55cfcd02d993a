//! What tests that plant in simulated runs of the paper's stand, and grade by rate, have in common.
#![allow(dead_code)]

#[path = "../draws/mod.rs"]
pub mod draws;

use diagnosis::result::Diagnosis;
use diagnosis::{DiagnoseOptions, diagnose};
use model::record::{Channel, Record};
use rand_core::SeedableRng;
use rand_distr::{Distribution, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

pub const GYROS: [&str; 3] = ["gyro_x", "gyro_y", "gyro_z"];
pub const RATE_HZ: f64 = 20.0;
/// Noise of a reading of the paper's gyro, deg/s: 5.27 deg/sqrt(h) at 20 Hz.
pub const GYRO_SIGMA: f64 = 0.393;

/// The generator of one of the tests of a file, which has that seed where `IMU_STAND_SEED` gives no other.
pub fn rng(own: u64, of: u64) -> Xoshiro256PlusPlus {
    let seed = draws::seed(own);
    println!("seed {seed}");
    Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_mul(1000) + of)
}

pub fn between(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    Uniform::new(low, high).map_or(low, |u| u.sample(rng))
}

pub fn by_ratio(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    between(rng, low.ln(), high.ln()).exp()
}

/// Adds a signal by time, s, to a channel, and rounds to its counts as the converter does.
pub fn add(record: &mut Record, name: &str, of: impl Fn(f64) -> f64) {
    let own = |c: &&mut Channel| c.name == name;
    let channel = record.channels.iter_mut().find(own).expect("a channel");
    let lsb = channel.lsb.expect("counts");
    let counts = channel.counts.as_mut().expect("counts");
    for (i, (v, c)) in channel.values.iter_mut().zip(counts).enumerate() {
        *c += (of(i as f64 / RATE_HZ) / lsb).round() as i32;
        *v = f64::from(*c) * lsb;
    }
}

/// What is told of a record.
pub fn told(record: &Record) -> Diagnosis {
    let options = DiagnoseOptions {
        no_evidence: true,
        ..DiagnoseOptions::default()
    };
    diagnose(record, &options).expect("a diagnosis").diagnosis
}

/// An answer in short.
pub fn said(d: &Diagnosis) -> String {
    let found = d.findings.iter().map(|f| {
        let time = f.parameters.get("time").map(|p| p.value);
        format!("{} on {:?} {time:?}", f.cause, f.channels)
    });
    let left = d.unexplained.iter();
    let left = left.map(|u| format!("unexplained {}: {}", u.channel, u.what));
    found.chain(left).collect::<Vec<_>>().join("; ")
}

/// At most this chance that a rate as asked gives so few hits.
pub fn asked(what: &str, hits: u64, of: u64, rate: f64) {
    println!("{what}: {hits} of {of}");
    let chance = 1.0 - numerics::tails::hits_at_least(hits + 1, of, rate);
    assert!(chance > 1e-3, "{what}: {hits} of {of}, less than {rate}");
}
