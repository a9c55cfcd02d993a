//! What an axis takes from the others, from its own past and from blows otherwise than in proportion, and steps beside
//! telegraph noise: hidden at random in simulated runs, graded by rate.

mod draws;

use std::f64::consts::TAU;

use diagnosis::result::{Diagnosis, Evidence, Finding};
use diagnosis::{DiagnoseOptions, diagnose};
use model::file::EffectModel;
use model::record::{Quantity, Record};
use model::{ModelFile, Parameter};
use rand_core::SeedableRng;
use rand_distr::{Distribution, Exp1, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

const RUNS: u64 = 8;
const LEAST: u64 = 7;
const LSB: f64 = 0.07326;
/// Time of a surge, s.
const SURGE_S: f64 = 0.19;

type Rng = Xoshiro256PlusPlus;

fn between(rng: &mut Rng, low: f64, high: f64) -> f64 {
    Uniform::new(low, high).expect("a range").sample(rng)
}

fn rates(record: &Record, name: &str) -> Vec<f64> {
    let c = record.channels.iter().find(|c| c.name == name);
    let values = &c.expect("a channel").values;
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|v| v - mean).collect()
}

/// Adds to gyro_x, in whole counts.
fn add(record: &mut Record, of: impl Fn(usize) -> f64) {
    let c = record.channels.iter_mut().find(|c| c.name == "gyro_x");
    let c = c.expect("a channel");
    let counts = c.counts.as_mut().expect("counts");
    for (i, (v, count)) in c.values.iter_mut().zip(counts).enumerate() {
        let more = (of(i) / LSB).round();
        *count += more as i32;
        *v += more * LSB;
    }
}

/// The same of what is less than a count: up as often as its part of a count says.
fn add_dithered(record: &mut Record, rng: &mut Rng, of: impl Fn(usize) -> f64) {
    let n = record.channels.first().map_or(0, |c| c.values.len());
    let within: Vec<f64> = (0..n).map(|_| between(rng, -0.5, 0.5)).collect();
    add(record, |i| of(i) + LSB * within[i]);
}

fn told(record: &Record) -> Diagnosis {
    diagnose(record, &DiagnoseOptions::default())
        .expect("a diagnosis")
        .diagnosis
}

/// Runs of `seconds`, each with what `plant` adds; `right` grades the answer.
fn graded(
    seconds: f64,
    seed: u64,
    plant: impl Fn(&mut Record, &mut Rng),
    right: impl Fn(&Diagnosis) -> bool,
) {
    graded_of(&ModelFile::paper(), seconds, seed, plant, right);
}

/// The same of another model.
fn graded_of(
    model: &ModelFile,
    seconds: f64,
    seed: u64,
    plant: impl Fn(&mut Record, &mut Rng),
    right: impl Fn(&Diagnosis) -> bool,
) {
    let mut rng = Rng::seed_from_u64(seed);
    let graded = draws::graded(RUNS, LEAST, |run| {
        let mut record = model::simulate(model, seconds, 20.0, seed + run).expect("a run");
        plant(&mut record, &mut rng);
        let d = told(&record);
        match right(&d) {
            true => Ok(()),
            false => Err(format!("{:?} | {:?}", d.findings, d.unexplained)),
        }
    });
    assert!(graded.is_ok(), "{}", graded.unwrap_err());
}

/// Whether nothing is named and what is said of gyro_x holds `words`. Of two axes that follow each other by an alternating
/// sign, or three by their product, none is the first: the others are told as well.
fn tells(d: &Diagnosis, words: &str) -> bool {
    let mut of_x = d.unexplained.iter().filter(|u| u.channel == "gyro_x");
    d.findings.is_empty() && of_x.any(|u| u.says(words))
}

#[test]
fn another_axis_whose_sign_alternates_is_told() {
    let plant = |r: &mut Record, rng: &mut Rng| {
        let (y, share) = (rates(r, "gyro_y"), between(rng, 0.2, 0.5));
        add(r, |i| share * if i % 2 == 0 { y[i] } else { -y[i] });
    };
    graded(600.0, 6100, plant, |d| {
        tells(d, "gyro_y with its sign alternating")
    });
}

/// The motor command behind a lag of `seconds`, over its largest.
fn duty_behind(record: &Record, seconds: f64) -> Vec<f64> {
    let pwm = record.channels.iter().find(|c| c.name == "pwm");
    let values = &pwm.expect("a command").values;
    let most = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let keep = (-1.0 / (20.0 * seconds)).exp();
    let mut level = 0.0;
    let behind = values.iter().map(|v| {
        level = keep * level + (1.0 - keep) * v / most;
        level
    });
    behind.collect()
}

/// Runs in which the motor command moves the bias at once, by `at_once` deg/s, and slowly by one of `late`.
fn by_motor(seed: u64, at_once: f64, late: (f64, f64), right: impl Fn(&Diagnosis) -> bool) {
    let plant = |r: &mut Record, rng: &mut Rng| {
        let (tau, size) = (between(rng, 10.0, 40.0), between(rng, late.0, late.1));
        let (now, late) = (duty_behind(r, 1e-3), duty_behind(r, tau));
        add(r, |i| at_once * now[i] + size * late[i]);
    };
    let mut model = ModelFile::paper();
    model.excitation.insert("motor_duty".to_owned(), 0.8);
    graded_of(&model, 1200.0, seed, plant, right);
}

#[test]
fn what_the_motor_does_at_once_keeps_its_name_beside_a_small_part_that_comes_late() {
    // A part of 0.1 to 0.15 of the size is 1 to 2 % of what the whole tells: at 1 deg/s enough to be seen by itself.
    by_motor(6600, 1.0, (0.1, 0.15), |d| {
        let named =
            |f: &diagnosis::result::Finding| f.cause == "motor_bias" && f.channels == ["gyro_x"];
        d.findings.iter().any(named)
    });
}

#[test]
fn a_surge_has_its_time_beside_what_was_found_after_it() {
    let mut model = ModelFile::paper();
    model.excitation.insert("motor_duty".to_owned(), 0.8);
    model.excitation.insert("drift_degc".to_owned(), 4.0);
    let planted = [
        ("at_full_duty", 1.1),
        ("surge_at_full_duty", 2.7),
        ("surge_time", 0.19),
    ];
    let of = |cause: &str, parameters: &[(&str, f64)]| EffectModel {
        cause: cause.into(),
        channels: vec!["gyro_x".into()],
        parameters: parameters
            .iter()
            .map(|(name, value)| ((*name).to_owned(), Parameter::exact(*value, "deg/s")))
            .collect(),
    };
    model.effects.push(of("motor_bias", &planted));
    model.effects.push(of("temperature", &[("slope", -0.08)]));
    for p in model
        .effects
        .iter_mut()
        .flat_map(|e| e.parameters.iter_mut())
    {
        p.1.unit = match p.0.as_str() {
            "surge_time" => "s".into(),
            "slope" => "deg/s/degC".into(),
            _ => "deg/s".into(),
        };
    }
    // The reading is of an instant, not of a sample's length as the shape has it: within 20 %. Its time is known to 4 %.
    let right = |d: &Diagnosis| {
        let found = d.findings.iter().find(|f| f.cause == "motor_bias");
        let time = found.and_then(|f| f.parameters.get("surge_time"));
        time.is_some_and(|p| {
            let error = p.std_error.unwrap_or(0.0);
            (p.value / SURGE_S - 1.0).abs() < 0.2 && error > 0.01 * p.value
        })
    };
    graded_of(&model, 1200.0, 6800, |_, _| {}, right);
}

/// What a motor's current adds behind a sensor's window of so many samples: a steady part and a surge that falls in `time` samples,
/// each of full duty, in steps of a twentieth of a sample, between which the command rises as the board's ramp does.
fn through_a_window(duty: &[f64], steady: f64, surge: f64, time: f64, window: f64) -> Vec<f64> {
    const STEPS: usize = 20;
    let keep = (-1.0 / (time * STEPS as f64)).exp();
    let mut speed = duty.first().copied().unwrap_or(0.0);
    let pairs = duty.windows(2);
    let fine = pairs.flat_map(|w| (0..STEPS).map(|k| w[0] + (w[1] - w[0]) * k as f64 / 20.0));
    let current: Vec<f64> = fine
        .map(|d| {
            speed = d + (speed - d) * keep;
            steady * d + surge * (d - speed)
        })
        .collect();
    let length = ((window * STEPS as f64) as usize).max(1);
    let read = |i: usize| {
        let from = (i * STEPS).saturating_sub(length - 1);
        let seen = &current[from..(i * STEPS + 1).min(current.len())];
        seen.iter().sum::<f64>() / seen.len() as f64
    };
    (0..duty.len()).map(read).collect()
}

/// The delay is half the window. Without it as an unknown, and with the first readings after a step taken for glitches, the
/// surges of the stand were 17 % small.
#[test]
fn the_surge_behind_a_sensors_window_has_its_size_and_its_time() {
    let (mut hits, mut of) = (0, 0);
    let mut rng = Rng::seed_from_u64(6900);
    let mut model = ModelFile::paper();
    model.excitation.insert("motor_duty".to_owned(), 0.8);
    for run in 0..draws::of(12, 40) {
        let mut record = model::simulate(&model, 600.0, 20.0, 6900 + run).expect("a run");
        let duty = record.channels.iter().find(|c| c.name == "pwm");
        let duty: Vec<f64> = (duty.expect("a command").values.iter())
            .map(|v| v / model::record::FULL_DUTY)
            .collect();
        let (steady, surge) = (between(&mut rng, 0.4, 1.0), between(&mut rng, 2.0, 4.0));
        let (time, window) = (between(&mut rng, 0.12, 0.4), between(&mut rng, 0.0, 1.6));
        let shift = through_a_window(&duty, steady, surge, time * 20.0, window);
        add(&mut record, |i| shift[i]);
        let d = told(&record);
        let found = d.findings.iter().find(|f| f.cause == "motor_bias");
        for (name, planted) in [("surge_at_full_duty", surge), ("surge_time", time)] {
            let p = found.and_then(|f| f.parameters.get(name));
            let far = p.map(|p| (p.value - planted).abs() / p.std_error.unwrap_or(0.0));
            println!("{name}: {planted:.3} {p:?} window {window:.2}");
            of += 1;
            hits += u64::from(far.is_some_and(|far| far < 1.96));
        }
    }
    // A rate of 95 % has so few in one of a thousand tests.
    let chance = 1.0 - numerics::tails::hits_at_least(hits + 1, of, 0.95);
    assert!(chance > 1e-3, "{hits} of {of}");
}

#[test]
fn a_response_that_is_late_as_a_whole_is_no_motor_bias() {
    by_motor(6700, 0.0, (0.6, 0.9), |d| {
        d.findings.iter().all(|f| f.cause != "motor_bias") && !d.unexplained.is_empty()
    });
}

#[test]
fn the_product_of_two_other_axes_is_told() {
    let plant = |r: &mut Record, rng: &mut Rng| {
        let (y, z) = (rates(r, "gyro_y"), rates(r, "gyro_z"));
        let share = between(rng, 1.0, 2.5);
        add(r, |i| share * y[i] * z[i]);
    };
    graded(600.0, 6200, plant, |d| {
        tells(d, "the product of gyro_y and gyro_z")
    });
}

#[test]
fn a_product_of_earlier_readings_is_told() {
    let plant = |r: &mut Record, rng: &mut Rng| {
        let (x, share) = (rates(r, "gyro_x"), between(rng, 0.5, 1.5));
        add(r, |i| {
            if i < 2 {
                0.0
            } else {
                share * x[i - 1] * x[i - 2]
            }
        });
    };
    graded(600.0, 6300, plant, |d| tells(d, "three_readings"));
}

#[test]
fn a_noise_that_beats_is_told_with_its_rhythm() {
    let plant = |r: &mut Record, rng: &mut Rng| {
        let (hz, depth) = (between(rng, 0.5, 8.0), between(rng, 0.4, 0.8));
        let extra: Vec<f64> = (0..r.len()).map(|_| StandardNormal.sample(rng)).collect();
        add(r, |i| {
            let swing = 1.0 + (std::f64::consts::TAU * hz * i as f64 / 20.0).sin();
            0.3 * depth * swing * extra[i]
        });
    };
    graded(600.0, 6400, plant, |d| tells(d, "variance_rhythm"));
}

/// Sets what the thermometer reads, in its counts, and returns it from -1 to 1 over its swing.
fn warmed(record: &mut Record, rng: &mut Rng) -> Vec<f64> {
    let (cycles, swing) = (between(rng, 2.5, 6.0), between(rng, 3.0, 8.0));
    let phase = between(rng, 0.0, TAU);
    let temp = record
        .channels
        .iter_mut()
        .find(|c| c.quantity == Quantity::Temp);
    let temp = temp.expect("a thermometer");
    let (lsb, n) = (temp.lsb.expect("counts"), temp.values.len() as f64);
    let level: Vec<f64> = (0..temp.values.len())
        .map(|i| (TAU * cycles * i as f64 / n + phase).sin())
        .collect();
    temp.counts = None;
    temp.values = (level.iter())
        .map(|u| ((30.0 + swing * u) / lsb).round() * lsb)
        .collect();
    level
}

/// A law of the temperature of which the third degree is the largest part, on a stand of 1200 s, and what it adds.
fn by_a_cubic(seed: u64, rng: &mut Rng) -> (Record, Vec<f64>) {
    let mut record = model::simulate(&ModelFile::paper(), 1200.0, 20.0, seed).expect("a run");
    let level = warmed(&mut record, rng);
    let size = between(rng, 0.15, 0.4);
    let [straight, bent] = [between(rng, -0.3, 0.3), between(rng, -0.3, 0.3)];
    let law = |u: &f64| size * (straight * u + bent * u * u + (4.0 * u * u - 3.0) * u);
    let law: Vec<f64> = level.iter().map(law).collect();
    add_dithered(&mut record, rng, |i| law[i]);
    (record, law)
}

#[test]
fn a_cubic_law_of_the_temperature_is_told_and_is_no_line() {
    let mut rng = Rng::seed_from_u64(90);
    let graded = draws::graded(RUNS, LEAST, |run| {
        let d = told(&by_a_cubic(90 + run, &mut rng).0);
        // The straight or the bent part of it is true.
        let part = |f: &Finding| f.cause.starts_with("temperature");
        let mut left = d.unexplained.iter();
        match d.findings.iter().all(part) && left.any(|u| u.says("follows temp")) {
            true => Ok(()),
            false => Err(format!("{:?} | {:?}", d.findings, d.unexplained)),
        }
    });
    assert!(graded.is_ok(), "{}", graded.unwrap_err());
}

#[test]
fn what_follows_the_temperature_is_drawn_with_all_that_follows_it() {
    let mut rng = Rng::seed_from_u64(91);
    let (mut drawn, mut wrong) = (0, vec![]);
    for run in 0..RUNS {
        let (record, law) = by_a_cubic(191 + run, &mut rng);
        let all = diagnose(&record, &DiagnoseOptions::default()).expect("a diagnosis");
        let mut figures = all.evidence.iter();
        let Some(figure) = figures.find(|e| e.cause == Evidence::WITHOUT_A_NAME) else {
            continue;
        };
        drawn += 1;
        let model = &figure.series[1];
        let truth = |t: &f64| law[(t * 20.0) as usize];
        let truth: Vec<f64> = model.x.iter().map(truth).collect();
        let product = |a: &[f64], b: &[f64]| -> f64 {
            let [ma, mb] = [a, b].map(|v| v.iter().sum::<f64>() / v.len() as f64);
            a.iter().zip(b).map(|(a, b)| (a - ma) * (b - mb)).sum()
        };
        let alike = product(&truth, &model.y)
            / (product(&truth, &truth) * product(&model.y, &model.y)).sqrt();
        if alike < 0.9 {
            wrong.push((run, alike));
        }
    }
    // A line takes the place of the law now and then, and has a figure of its own.
    assert!(2 * drawn >= RUNS && wrong.is_empty(), "{drawn}: {wrong:?}");
}

#[test]
fn a_step_and_telegraph_noise_are_both_named() {
    let plant = |r: &mut Record, rng: &mut Rng| {
        let half = between(rng, 0.15, 0.3);
        let dwell = between(rng, 8.0, 30.0) * 20.0;
        let height = half * between(rng, 3.0, 5.0);
        let at = (between(rng, 0.2, 0.8) * r.len() as f64) as usize;
        let mut left = 0.0;
        let mut level = half;
        let levels: Vec<f64> = (0..r.len())
            .map(|_| {
                if left <= 0.0 {
                    let wait: f64 = Exp1.sample(rng);
                    left = dwell * wait;
                    level = -level;
                }
                left -= 1.0;
                level
            })
            .collect();
        add(r, |i| levels[i] + if i >= at { height } else { 0.0 });
    };
    graded(1800.0, 6500, plant, |d| {
        let causes = d.findings.iter().map(|f| f.cause.as_str());
        let causes: std::collections::BTreeSet<&str> = causes.collect();
        causes == ["bias_step", "telegraph"].into() && d.unexplained.is_empty()
    });
}
