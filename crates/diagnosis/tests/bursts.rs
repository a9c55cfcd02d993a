//! Bursts of seconds with pauses of minutes are one record of one process: slopes, N and K with intervals that hold.
//! `IMU_STAND_SEED` draws other records and `IMU_STAND_RUNS` more of them.

mod draws;

use diagnosis::result::{Diagnosed, Finding};
use diagnosis::{DiagnoseOptions, diagnose};
use model::record::{Axis, Channel, Quantity, Record};
use numerics::tails::hits_at_least;
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const RATE: f64 = 50.0;
/// deg/sqrt(h).
const N: f64 = 0.12;
/// deg/s/sqrt(s).
const K: f64 = 1.5e-4;

fn setting(name: &str, otherwise: u64) -> u64 {
    let own = std::env::var(name).ok();
    own.and_then(|s| s.parse().ok()).unwrap_or(otherwise)
}

/// A chamber that cools by some degrees, not evenly, and a gyro that is read for five seconds every five minutes.
fn chamber(slope: f64, seed: u64) -> Record {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let (bursts, length, period) = (25, 250, 305.0);
    let (mut times, mut rate, mut temp) = (vec![], vec![], vec![]);
    let (mut bias, mut last) = (0.4, 0.0);
    for b in 0..bursts {
        for i in 0..length {
            let t = f64::from(b) * period + f64::from(i) / RATE;
            bias += K * (t - last).sqrt() * normal();
            last = t;
            let cool = 16.0 + 8.0 * (-t / 3000.0).exp() + 0.6 * (t / 900.0).sin();
            times.push(t);
            temp.push(cool);
            rate.push(slope * cool + bias + N / 60.0 * RATE.sqrt() * normal());
        }
    }
    let channel = |name: &str, quantity, unit: &str, values| Channel {
        name: name.into(),
        quantity,
        axis: (quantity == Quantity::Gyro).then_some(Axis::X),
        unit: unit.into(),
        values,
        counts: None,
        lsb: None,
    };
    Record {
        channels: vec![
            channel("gyro_x", Quantity::Gyro, "deg/s", rate),
            channel("temp", Quantity::Temp, "degC", temp),
        ],
        host_time_s: Some(times),
        ..Record::default()
    }
}

fn told(slope: f64, seed: u64) -> Diagnosed {
    diagnose(&chamber(slope, seed), &DiagnoseOptions::default()).expect("an answer")
}

/// So many of `runs` hits that a rate of `p` gives fewer with a chance of 1e-3.
fn least(runs: u64, p: f64) -> u64 {
    let fewer = |hits: u64| 1.0 - hits_at_least(hits, runs, p);
    (0..=runs).rev().find(|h| fewer(*h) < 1e-3).unwrap_or(0)
}

#[test]
fn slopes_and_noise_of_bursts_lie_within_their_intervals() {
    let (runs, from) = (
        setting("IMU_STAND_RUNS", draws::of(15, 40)),
        1000 * setting("IMU_STAND_SEED", 3),
    );
    let (mut named, mut hits) = (0, [0u64; 3]);
    for seed in from..from + runs {
        let slope = 0.03;
        let d = told(slope, seed);
        let is_slope = |f: &&Finding| f.cause == "temperature";
        if let Some(found) = d.diagnosis.findings.iter().find(is_slope) {
            named += 1;
            let p = &found.parameters["slope"];
            let within = 1.96 * p.std_error.expect("an error");
            hits[0] += u64::from((p.value - slope).abs() <= within);
        }
        let own = &d.extended_model.channels[0].baseline;
        for (hit, (name, truth)) in hits[1..]
            .iter_mut()
            .zip([("angle_random_walk", N), ("rate_random_walk", K)])
        {
            let p = &own[name];
            // A walk that is not established is given by its largest value.
            let within = 1.96 * p.std_error.unwrap_or(p.value);
            *hit += u64::from((p.value - truth).abs() <= within);
        }
    }
    println!("{runs} runs: named {named}; slope, N, K within: {hits:?}");
    assert!(named >= least(runs, 0.99), "{named} of {runs}");
    for (what, hit) in ["slope", "N", "K"].into_iter().zip(hits) {
        assert!(hit >= least(runs, 0.93), "{what}: {hit} of {runs}");
    }
}

#[test]
fn nothing_is_named_in_bursts_of_a_gyro_that_feels_no_temperature() {
    let (runs, from) = (
        setting("IMU_STAND_RUNS", draws::of(15, 40)),
        500 + 1000 * setting("IMU_STAND_SEED", 3),
    );
    let mut told_of = vec![];
    for seed in from..from + runs {
        let d = told(0.0, seed).diagnosis;
        assert!(
            d.input.notes.iter().any(|n| n.contains("25 bursts")),
            "{:?}",
            d.input.notes
        );
        let causes = d.findings.into_iter().map(|f| f.cause);
        let left = d.unexplained.into_iter().map(|u| u.what);
        let all: Vec<String> = causes.chain(left).collect();
        if !all.is_empty() {
            told_of.push((seed, all));
        }
    }
    println!("{runs} runs without a slope: {told_of:?}");
    // One in 200 is asked; three in 40 come by chance 1e-3 of the time, in 15 5e-5.
    assert!(told_of.len() as u64 <= 2 + runs / 100, "{told_of:#?}");
}
