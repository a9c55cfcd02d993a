//! Level and power of the test among replicates, and its time.
//!
//! `cargo run --release -p diagnosis --example replicates -- level|power|speed [records] [seed] [name of a row]`
//!
//! Runs are simulated from random stands as in `closed_loop`, 600 s at 20 Hz, and held against models that are the true one,
//! or that differ from it in one thing.

use std::time::Instant;

use diagnosis::replicates::{LEVEL, REPLICATES, judge_record};
use diagnosis::{DiagnoseOptions, diagnose};
use model::file::EffectModel;
use model::record::Record;
use model::{ModelFile, Parameter};
use rand_core::SeedableRng;
use rand_distr::{Distribution, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

/// A stand with random noise in a world where everything acts a little.
fn stand(rng: &mut Xoshiro256PlusPlus) -> ModelFile {
    let mut draw = |low: f64, high: f64| Uniform::new(low, high).map_or(low, |u| u.sample(rng));
    let mut model = ModelFile::paper();
    for c in &mut model.channels {
        let values = [
            ("angle_random_walk", draw(3.6, 7.0)),
            ("rate_random_walk", draw(3e-4f64.ln(), 7e-3f64.ln()).exp()),
            ("bias", draw(-1.0, 1.0)),
        ];
        for (name, value) in values {
            if let Some(p) = c.baseline.get_mut(name) {
                p.value = value;
            }
        }
    }
    let world = [
        ("heater_degc", draw(3.0, 10.0)),
        ("heater_period_s", draw(120.0, 300.0)),
        ("supply_load_v", draw(0.03, 0.06)),
        ("supply_load_period_s", draw(31.0, 70.0)),
        ("motor_duty", draw(0.5, 1.0)),
        ("motor_period_s", draw(40.0, 120.0)),
        ("vibration_g", draw(0.05, 0.2)),
    ];
    model.excitation = world.map(|(k, v)| (k.to_owned(), v)).into();
    model
}

fn scaled(model: &ModelFile, parameter: &str, factor: f64) -> ModelFile {
    let mut model = model.clone();
    for c in &mut model.channels {
        if let Some(p) = c.baseline.get_mut(parameter) {
            p.value *= factor;
        }
    }
    model
}

fn with(model: &ModelFile, cause: &str, parameters: &[(&str, f64, &str)]) -> ModelFile {
    let mut model = model.clone();
    model.effects = vec![EffectModel {
        cause: cause.into(),
        channels: vec![],
        parameters: (parameters.iter())
            .map(|(name, value, unit)| ((*name).to_owned(), Parameter::exact(*value, unit)))
            .collect(),
    }];
    model
}

/// Chances of the channels of a record among the replicates of two models.
fn chances(
    record: &Record,
    models: [&ModelFile; 2],
    seed: u64,
) -> Fallible<Vec<[(f64, String); 2]>> {
    let all = judge_record(record, models, REPLICATES, seed)?;
    let pair = |r: diagnosis::result::Replicated| {
        [r.before, r.after].map(|a| (a.p_value, a.worst.statistic))
    };
    Ok(all.into_values().map(pair).collect())
}

/// Share of channels and of records at or below the level: true parameters, and those fitted on the same record.
fn level(records: u64, seed: u64) -> Fallible<()> {
    let (mut of_true, mut of_fitted, mut channels) = ([0, 0], [0, 0], 0);
    for k in 0..records {
        let model = stand(&mut Xoshiro256PlusPlus::seed_from_u64(seed + k));
        let record = model::simulate(&model, 600.0, 20.0, seed + k)?;
        let fitted = diagnose(&record, &DiagnoseOptions::default())?.baseline_model;
        let all = chances(&record, [&model, &fitted], seed + k)?;
        channels += all.len();
        for (which, count) in [&mut of_true, &mut of_fitted].into_iter().enumerate() {
            let beyond = all.iter().filter(|c| c[which].0 <= LEVEL).count();
            count[0] += beyond;
            count[1] += usize::from(beyond > 0);
            for c in all.iter().filter(|c| c[which].0 <= LEVEL) {
                println!("  {} {which}: {:.3} {}", seed + k, c[which].0, c[which].1);
            }
        }
    }
    println!(
        "true parameters: {} of {channels} channels, {} of {records} records",
        of_true[0], of_true[1]
    );
    println!(
        "fitted on it:    {} of {channels} channels, {} of {records} records",
        of_fitted[0], of_fitted[1]
    );
    Ok(())
}

/// What is left out or wrong, and whether that is in the truth or in the model.
fn wrongs(model: &ModelFile) -> Vec<(&'static str, ModelFile, ModelFile)> {
    let truth = |name, cause: &str, parameters: &[(&str, f64, &str)]| {
        (name, with(model, cause, parameters), model.clone())
    };
    let walk = scaled(model, "rate_random_walk", 0.0);
    let mut walking = model.clone();
    for c in &mut walking.channels {
        if let Some(p) = c.baseline.get_mut("rate_random_walk") {
            p.value = 0.004;
        }
    }
    // Sizes of d' about 10: ten times what one sample's noise over the square root of the samples that tell.
    vec![
        (
            "N 4 % too low",
            model.clone(),
            scaled(model, "angle_random_walk", 0.96),
        ),
        (
            "N 4 % too high",
            model.clone(),
            scaled(model, "angle_random_walk", 1.04),
        ),
        ("K 0.004 left out", walking, walk),
        truth(
            "temperature",
            "temperature",
            &[("slope", 0.25, "deg/s/degC")],
        ),
        truth("supply", "supply_sensitivity", &[("slope", 2.5, "deg/s/V")]),
        truth(
            "motor_bias",
            "motor_bias",
            &[("at_full_duty", 0.12, "deg/s")],
        ),
        truth(
            "g_sensitivity",
            "g_sensitivity",
            &[("acc_x", 0.4, "deg/s/g")],
        ),
        truth(
            "line",
            "line",
            &[("frequency", 3.3, "Hz"), ("amplitude", 0.05, "deg/s")],
        ),
        truth(
            "bias_step",
            "bias_step",
            &[("time", 310.0, "s"), ("height", 0.4, "deg/s")],
        ),
        truth("rate_ramp", "rate_ramp", &[("slope", 0.005, "deg/s^2")]),
        truth(
            "gauss_markov",
            "gauss_markov",
            &[("sigma", 0.12, "deg/s"), ("correlation_time", 1.0, "s")],
        ),
        truth(
            "flicker",
            "flicker",
            &[("bias_instability", 400.0, "deg/h")],
        ),
        truth("low_pass", "low_pass", &[("lag1_correlation", 0.1, "1")]),
        truth(
            "motor_noise",
            "motor_noise",
            &[("variance_increase_at_full_duty", 0.8, "1")],
        ),
        truth(
            "noise_change",
            "noise_change",
            &[
                ("start", 150.0, "s"),
                ("end", 350.0, "s"),
                ("variance_increase", 0.4, "1"),
            ],
        ),
        truth("common_noise", "common_noise", &[("sigma", 0.15, "deg/s")]),
        truth(
            "telegraph",
            "telegraph",
            &[("half_height", 0.12, "deg/s"), ("dwell_time", 10.0, "s")],
        ),
        truth("outliers", "outliers", &[("count", 3.0, "1")]),
        truth(
            "stuck_bit",
            "stuck_bit",
            &[
                ("bit", 1.0, "1"),
                ("value", 1.0, "1"),
                ("fraction", 0.1, "1"),
            ],
        ),
        truth(
            "stale_samples",
            "stale_samples",
            &[("count", 120.0, "1"), ("silent", 1.0, "1")],
        ),
    ]
}

/// Share of records that the replicates of a wrong model do not hold, in any channel. Where the noise that a term adds would
/// be seen in N, a diagnosis would have put it there: the model has the N of the record's white part all the same.
fn power(records: u64, seed: u64, only: Option<&String>) -> Fallible<()> {
    let names: Vec<_> = wrongs(&ModelFile::paper())
        .into_iter()
        .map(|w| w.0)
        .collect();
    for (which, name) in names.iter().enumerate() {
        if only.is_some_and(|only| only != name) {
            continue;
        }
        let (mut wrong, mut fitted) = ([0, 0], [0, 0]);
        let mut channels = 0;
        let mut seen = std::collections::BTreeMap::<String, usize>::new();
        for k in 0..records {
            let stand = stand(&mut Xoshiro256PlusPlus::seed_from_u64(seed + k));
            let (_, truth, model) = wrongs(&stand).swap_remove(which);
            let record = model::simulate(&truth, 600.0, 20.0, seed + k)?;
            let baseline = diagnose(&record, &DiagnoseOptions::default())?.baseline_model;
            let all = chances(&record, [&model, &baseline], seed + k)?;
            channels += all.len();
            for (i, count) in [&mut wrong, &mut fitted].into_iter().enumerate() {
                let beyond = all.iter().filter(|c| c[i].0 <= LEVEL).count();
                count[0] += beyond;
                count[1] += usize::from(beyond > 0);
            }
            for c in all.iter().filter(|c| c[0].0 <= LEVEL) {
                *seen.entry(c[0].1.clone()).or_default() += 1;
            }
        }
        let most = seen.iter().max_by_key(|s| s.1).map_or("-", |s| s.0);
        println!(
            "{name:<20} left out {:>3} of {channels} channels {:>3} of {records} records; best baseline {:>3} and {:>3}; {most}",
            wrong[0], wrong[1], fitted[0], fitted[1]
        );
    }
    Ok(())
}

/// Time of the test alone, both models.
fn speed() -> Fallible<()> {
    for (seconds, rate) in [(600.0, 20.0), (600.0, 100.0), (86_400.0, 20.0)] {
        let model = with(
            &ModelFile::paper(),
            "temperature",
            &[("slope", 0.2, "deg/s/degC")],
        );
        let record = model::simulate(&model, seconds, rate, 1)?;
        let start = Instant::now();
        judge_record(&record, [&ModelFile::paper(), &model], REPLICATES, 0)?;
        println!(
            "{seconds} s at {rate} Hz: {:.2} s",
            start.elapsed().as_secs_f64()
        );
    }
    Ok(())
}

fn main() -> Fallible<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, default: u64| {
        arguments
            .get(k)
            .and_then(|a| a.parse().ok())
            .unwrap_or(default)
    };
    match arguments.first().map(String::as_str) {
        Some("level") => level(number(1, 200), number(2, 1)),
        Some("power") => power(number(1, 20), number(2, 1), arguments.get(3)),
        Some("speed") => speed(),
        _ => Err("level, power or speed".into()),
    }
}
