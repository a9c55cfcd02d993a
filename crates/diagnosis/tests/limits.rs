//! Detection limits hold: a cause of the size that a clean run says it would have found is planted in another run of the
//! same stand, and found about 95 times in 100.
//!
//! `LIMIT_RUNS=40 cargo test --release -p diagnosis --test limits -- --nocapture` prints the shares by cause.

mod draws;

use std::collections::BTreeMap;

use diagnosis::result::{DetectionLimit, Diagnosis};
use diagnosis::{DiagnoseOptions, diagnose};
use model::file::EffectModel;
use model::record::Record;
use model::{ModelFile, Parameter};
use rand_core::SeedableRng;
use rand_distr::{Distribution, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;
use statrs::distribution::{Binomial, DiscreteCDF};

/// Runs in which each limit is tried, of a sample and all of them; `LIMIT_RUNS` says otherwise. Two runs try some fifty limits:
/// they pass an engine that finds 9 in 10 but once in 10 000 times, and one that finds half of them never.
const RUNS: [u64; 2] = [2, 6];
const CHANNELS: [&str; 3] = ["gyro_x", "gyro_y", "gyro_z"];

fn between(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    Uniform::new(low, high).expect("a range").sample(rng)
}

/// A stand with noise and excitation drawn at random.
fn stand(rng: &mut Xoshiro256PlusPlus) -> ModelFile {
    let mut model = ModelFile::paper();
    for c in &mut model.channels {
        let k = c.baseline.get_mut("rate_random_walk").expect("K");
        k.value = 1e-3 * (10.0f64).powf(between(rng, -0.5, 0.6));
        let n = c.baseline.get_mut("angle_random_walk").expect("N");
        n.value *= between(rng, 0.7, 1.4);
    }
    let world = [
        ("heater_degc", between(rng, 3.0, 8.0)),
        ("heater_period_s", between(rng, 150.0, 300.0)),
        ("supply_load_v", between(rng, 0.03, 0.06)),
        ("motor_duty", between(rng, 0.5, 1.0)),
        ("vibration_g", between(rng, 0.05, 0.2)),
    ];
    model
        .excitation
        .extend(world.map(|(k, v)| (k.to_owned(), v)));
    model
}

fn told(model: &ModelFile, seed: u64) -> Diagnosis {
    let record = model::simulate(model, 600.0, 20.0, seed).expect("a run");
    let told = diagnose(&record, &DiagnoseOptions::default());
    told.expect("a diagnosis").diagnosis
}

/// The effect at its limit; `None` where the limit is no size of a simulation.
fn planted(limit: &DetectionLimit) -> Option<EffectModel> {
    let exact = |value: f64, unit: &str| Parameter::exact(value, unit);
    // What a model file needs beside.
    let beside: &[(&str, f64, &str)] = match limit.parameter.as_str() {
        "curvature" => &[("slope", 0.0, "deg/s/degC")],
        "while_turning" | "surge_at_full_duty" => &[("at_full_duty", 0.0, "deg/s")],
        "fraction" => &[("bit", 0.0, "1"), ("value", 1.0, "1")],
        "size" => &[("count", 1.0, "1")],
        "amplitude" if limit.cause == "am_line" => &[("modulation_frequency", 0.1, "Hz")],
        "count" if limit.cause == "stale_samples" => &[("silent", 1.0, "1")],
        // Rails are given by their codes; a sway is no effect of one channel; every record has the limit of the last.
        "clipped" | "peak" | "missing_bits" => return None,
        _ => &[],
    };
    let mut parameters: BTreeMap<String, Parameter> = limit.at.clone();
    parameters.extend(
        beside
            .iter()
            .map(|(n, v, u)| ((*n).to_owned(), exact(*v, u))),
    );
    parameters.insert(limit.parameter.clone(), exact(limit.value, &limit.unit));
    let shared = ["common_noise", "stale_samples"].contains(&limit.cause.as_str());
    Some(EffectModel {
        cause: limit.cause.clone(),
        channels: if shared || limit.channel == "record" {
            vec![]
        } else {
            vec![limit.channel.clone()]
        },
        parameters,
    })
}

#[test]
fn a_cause_at_its_limit_is_found() {
    let runs = std::env::var("LIMIT_RUNS").map_or(draws::of(RUNS[0], RUNS[1]), |v| {
        v.parse().expect("a number of runs")
    });
    let first = std::env::var("LIMIT_SEED").map_or(7000, |v| v.parse().expect("a seed"));
    let mut shares: BTreeMap<(String, String), (u64, u64)> = BTreeMap::new();
    for run in 0..runs {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(first + run);
        let model = stand(&mut rng);
        let channel = CHANNELS[between(&mut rng, 0.0, 3.0) as usize];
        let clean = told(&model, first + run);
        let own = clean
            .detection_limits
            .iter()
            .filter(|l| [channel, "record"].contains(&l.channel.as_str()));
        for limit in own {
            let Some(effect) = planted(limit) else {
                continue;
            };
            let mut with = model.clone();
            with.effects.push(effect);
            let d = told(&with, first + run + 100_000);
            let (tried, found) = shares
                .entry((limit.cause.clone(), limit.parameter.clone()))
                .or_default();
            *tried += 1;
            *found += u64::from(d.findings.iter().any(|f| f.cause == limit.cause));
        }
    }
    let (mut tried, mut found) = (0, 0);
    for ((cause, parameter), share) in &shares {
        println!("{cause} {parameter}: {} of {}", share.1, share.0);
        tried += share.0;
        found += share.1;
    }
    println!("{found} of {tried}");
    // The chance of so few at 90 in 100.
    let chance = Binomial::new(0.9, tried).expect("a law").cdf(found);
    assert!(
        shares.len() > 20 && chance > 1e-4,
        "{found} of {tried}: {shares:?}"
    );
}

/// Where the supply goes with the temperature, what one of them explains the other would too: neither has a size beside it.
#[test]
fn a_cause_that_another_spans_has_no_limit() {
    let mut model = ModelFile::paper();
    let world = [("heater_degc", 6.0), ("heater_period_s", 200.0)];
    let world = world.map(|(k, v)| (k.to_owned(), v));
    model.excitation.extend(world);
    let mut record = model::simulate(&model, 600.0, 20.0, 5).expect("a run");
    let of = |record: &Record, name: &str| {
        let mut all = record.channels.iter();
        all.position(|c| c.name == name).expect("a channel")
    };
    let warm = record.channels[of(&record, "temp_x")].values.clone();
    let supply = of(&record, "supply");
    record.channels[supply].counts = None;
    record.channels[supply].values = warm.iter().map(|t| 5.0 + 0.02 * (t - warm[0])).collect();
    let gyro = of(&record, "gyro_x");
    record.channels[gyro].counts = None;
    let rates = record.channels[gyro].values.iter_mut().zip(&warm);
    rates.for_each(|(y, t)| *y += 0.3 * (t - warm[0]));
    let d = diagnose(&record, &DiagnoseOptions::default());
    let d = d.expect("a diagnosis").diagnosis;
    let either = ["temperature", "supply_sensitivity"];
    let here = |channel: &str| channel == "gyro_x";
    let mut found = d.findings.iter().filter(|f| here(&f.channels[0]));
    assert!(
        found.any(|f| either.contains(&f.cause.as_str())),
        "{:?}",
        d.findings
    );
    let limits: Vec<&DetectionLimit> = (d.detection_limits.iter())
        .filter(|l| here(&l.channel) && either.contains(&l.cause.as_str()))
        .collect();
    assert!(limits.is_empty(), "{limits:?}");
}
