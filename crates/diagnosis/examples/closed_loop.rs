//! Rates of the diagnosis on runs simulated from model files: false alarms on clean ones, causes named in others.
//!
//! `cargo run --release -p diagnosis --example closed_loop -- [clean runs] [runs per cause] [seed]`

use std::collections::BTreeMap;

use diagnosis::{DiagnoseOptions, diagnose};
use model::file::EffectModel;
use model::{ModelFile, Parameter};
use rand_core::SeedableRng;
use rand_distr::{Distribution, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A stand with random noise and a random environment.
fn stand(rng: &mut Xoshiro256PlusPlus) -> ModelFile {
    let mut draw = |low: f64, high: f64| Uniform::new(low, high).map_or(low, |u| u.sample(rng));
    let mut model = ModelFile::paper();
    for c in &mut model.channels {
        let walk = if draw(0.0, 1.0) < 0.15 {
            0.0
        } else {
            draw(3e-4f64.ln(), 7e-3f64.ln()).exp()
        };
        for (name, value) in [
            ("angle_random_walk", draw(3.6, 7.0)),
            ("rate_random_walk", walk),
            ("bias", draw(-1.0, 1.0)),
        ] {
            if let Some(p) = c.baseline.get_mut(name) {
                p.value = value;
            }
        }
    }
    let choose = |p: f64, value: f64, draw: f64| if draw < p { value } else { 0.0 };
    for (key, share, low, high) in [
        ("heater_degc", 0.5, 3.0, 10.0),
        ("self_heating_degc", 0.5, 2.0, 8.0),
        ("drift_degc", 0.3, -3.0, 3.0),
        ("supply_load_v", 0.6, 0.03, 0.06),
        ("motor_duty", 0.7, 0.3, 1.0),
        ("vibration_g", 0.5, 0.05, 0.2),
    ] {
        let value = choose(share, draw(low, high), draw(0.0, 1.0));
        model.excitation.insert(key.into(), value);
    }
    for (key, low, high) in [
        ("heater_period_s", 120.0, 300.0),
        ("self_heating_time_constant_s", 60.0, 240.0),
        ("supply_load_period_s", 31.0, 70.0),
        ("motor_period_s", 40.0, 120.0),
    ] {
        model.excitation.insert(key.into(), draw(low, high));
    }
    model
}

/// Cause, excitation that it needs, and parameters with their ranges: sizes that d' of 8 to 20 asks for.
type Plan = (
    &'static str,
    &'static [(&'static str, f64)],
    &'static [(&'static str, f64, f64)],
);
const PLANS: &[Plan] = &[
    (
        "temperature",
        &[("heater_degc", 6.0)],
        &[("slope", 0.15, 0.3)],
    ),
    (
        "rate_ramp",
        &[
            ("heater_degc", 0.0),
            ("self_heating_degc", 0.0),
            ("drift_degc", 0.0),
        ],
        &[("slope", 0.004, 0.008)],
    ),
    (
        "warm_up",
        &[
            ("heater_degc", 0.0),
            ("self_heating_degc", 0.0),
            ("drift_degc", 0.0),
        ],
        &[("amplitude", 1.0, 2.0), ("time_constant", 20.0, 60.0)],
    ),
    (
        "motor_bias",
        &[("motor_duty", 0.8)],
        &[("at_full_duty", 0.1, 0.2)],
    ),
    (
        "supply_sensitivity",
        &[("supply_load_v", 0.05)],
        &[("slope", 1.6, 3.0)],
    ),
    (
        "line",
        &[],
        &[("frequency", 0.3, 9.5), ("amplitude", 0.05, 0.1)],
    ),
    (
        "bias_step",
        &[],
        &[("time", 100.0, 500.0), ("height", 0.35, 0.6)],
    ),
    (
        "gauss_markov",
        &[],
        &[("sigma", 0.12, 0.2), ("correlation_time", 0.3, 5.0)],
    ),
    ("low_pass", &[], &[("lag1_correlation", 0.08, 0.25)]),
    (
        "g_sensitivity",
        &[("vibration_g", 0.15)],
        &[("acc_x", 0.3, 0.6)],
    ),
    ("flicker", &[], &[("bias_instability", 350.0, 600.0)]),
    (
        "motor_noise",
        &[("motor_duty", 0.9)],
        &[("variance_increase_at_full_duty", 0.6, 1.2)],
    ),
    (
        "noise_change",
        &[],
        &[
            ("start", 100.0, 200.0),
            ("end", 300.0, 450.0),
            ("variance_increase", 0.5, 0.9),
        ],
    ),
    ("common_noise", &[], &[("sigma", 0.12, 0.2)]),
    (
        "temperature_quadratic",
        &[("heater_degc", 9.0)],
        &[("slope", 0.1, 0.2), ("curvature", 0.03, 0.05)],
    ),
    (
        "cross_axis",
        &[("turn_dps", 12.0)],
        &[("from_gyro_z", 0.006, 0.01)],
    ),
    (
        "am_line",
        &[],
        &[
            ("frequency", 1.5, 8.0),
            ("amplitude", 0.1, 0.15),
            ("modulation_frequency", 0.05, 0.4),
            ("depth", 0.7, 1.0),
        ],
    ),
    (
        "telegraph",
        &[],
        &[("half_height", 0.25, 0.35), ("dwell_time", 4.0, 20.0)],
    ),
];

fn main() {
    let argument = |i: usize, default: u64| {
        std::env::args()
            .nth(i)
            .and_then(|a| a.parse().ok())
            .unwrap_or(default)
    };
    let (clean, each, seed) = (argument(1, 50), argument(2, 6), argument(3, 1));
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let begun = std::time::Instant::now();
    let mut alarms = 0;
    let mut by_cause: BTreeMap<String, usize> = BTreeMap::new();
    for run in 0..clean {
        let record =
            model::simulate(&stand(&mut rng), 600.0, 20.0, seed * 1_000_000 + run).expect("a run");
        let d = diagnose(&record, &DiagnoseOptions::default())
            .expect("a diagnosis")
            .diagnosis;
        let told: Vec<String> = d
            .findings
            .iter()
            .map(|f| f.cause.clone())
            .chain(d.unexplained.iter().map(|u| u.what.clone()))
            .collect();
        alarms += u64::from(!told.is_empty());
        for t in told {
            *by_cause.entry(t).or_default() += 1;
        }
    }
    println!(
        "clean: {alarms} of {clean} with an alarm {by_cause:?}, {:.0} ms each",
        begun.elapsed().as_millis() as f64 / clean.max(1) as f64
    );
    for (plan, (cause, excitation, ranges)) in PLANS.iter().enumerate() {
        let begun = std::time::Instant::now();
        let (mut named, mut alone) = (0, 0);
        let mut others: BTreeMap<String, usize> = BTreeMap::new();
        let mut errors = vec![];
        for run in 0..each {
            let mut model = stand(&mut rng);
            model
                .excitation
                .extend(excitation.iter().map(|(k, v)| ((*k).to_owned(), *v)));
            let known = model::effects::effect(cause).expect("an effect");
            let parameters: model::effect::Parameters = ranges
                .iter()
                .map(|(name, low, high)| {
                    let unit = known
                        .parameters()
                        .iter()
                        .find(|p| p.name == *name)
                        .map_or("1", |p| p.unit);
                    (
                        (*name).to_owned(),
                        Parameter::exact(
                            Uniform::new(low, high).expect("a range").sample(&mut rng),
                            unit,
                        ),
                    )
                })
                .collect();
            let channels = if *cause == "common_noise" {
                vec![]
            } else {
                vec!["gyro_y".to_owned()]
            };
            model.effects.push(EffectModel {
                cause: (*cause).into(),
                channels,
                parameters: parameters.clone(),
            });
            let record = model::simulate(
                &model,
                600.0,
                20.0,
                seed * 1_000_000 + 500_000 + plan as u64 * 10_000 + run,
            )
            .expect("a run");
            let d = diagnose(&record, &DiagnoseOptions::default())
                .expect("a diagnosis")
                .diagnosis;
            let hit = d
                .findings
                .iter()
                .find(|f| f.cause == *cause || f.alternatives.iter().any(|a| a.cause == *cause));
            named += u64::from(hit.is_some());
            if let Some(f) = hit.filter(|f| f.cause == *cause) {
                for (name, p) in &f.parameters {
                    if let (Some(truth), Some(e)) = (parameters.get(name), p.std_error) {
                        errors.push((p.value - truth.value) / e);
                    }
                }
            }
            let extra: Vec<String> = d
                .findings
                .iter()
                .filter(|f| {
                    !(f.cause == *cause || f.alternatives.iter().any(|a| a.cause == *cause))
                })
                .map(|f| f.cause.clone())
                .chain(
                    d.unexplained
                        .iter()
                        .map(|u| u.what.split(':').next().unwrap_or("").to_owned()),
                )
                .collect();
            alone += u64::from(hit.is_some() && extra.is_empty());
            for e in extra {
                *others.entry(e).or_default() += 1;
            }
        }
        let covered = errors.iter().filter(|e| f64::abs(**e) < 1.96).count();
        println!(
            "{cause}: named {named} of {each}, alone {alone}, also {others:?}; intervals cover {covered} of {}; {:.0} ms each",
            errors.len(),
            begun.elapsed().as_millis() as f64 / each.max(1) as f64
        );
    }
}
