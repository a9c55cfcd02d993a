//! Accelerometers of the paper's stand, diagnosed beside its gyros: what is planted in one is drawn, and what is told of it is
//! graded by rate. `IMU_STAND_SEED` takes other draws.

mod rates;

use std::f64::consts::TAU;

use diagnosis::result::{Diagnosis, Finding};
use diagnosis::{DiagnoseOptions, diagnose_channels};
use model::ModelFile;
use model::record::{Channel, Record};
use rand_xoshiro::Xoshiro256PlusPlus;
use rates::{GYROS, RATE_HZ, asked, between, draws, rng, said};

const ACCELEROMETERS: [&str; 3] = ["acc_x", "acc_y", "acc_z"];
/// Seed of the draws.
const OWN_SEED: u64 = 20_261_124;
const SECONDS: f64 = 600.0;
/// Noise of a reading, m/s^2: 4.7 mV at 800 mV/g, and a twelfth of a squared count of 4 mg.
const SIGMA: f64 = 0.0588;

/// Ten minutes of the stand at rest, whose heater is on now and then.
fn stand(rng: &mut Xoshiro256PlusPlus) -> Record {
    let mut model = ModelFile::paper();
    let excitation = [
        ("heater_degc", 10.0),
        ("heater_period_s", 200.0),
        ("supply_load_v", 0.2),
    ];
    for (key, value) in excitation {
        model.excitation.insert(key.to_owned(), value);
    }
    let seed = between(rng, 0.0, 1e9) as u64;
    model::simulate(&model, SECONDS, RATE_HZ, seed).expect("a run")
}

/// Adds a signal to an accelerometer. It is far below a count, and the noise before the converter, which would carry it over
/// the next one now and then, is rounded already: chance does in its place.
fn add(record: &mut Record, name: &str, of: impl Fn(usize) -> f64, rng: &mut Xoshiro256PlusPlus) {
    let own = |c: &&mut Channel| c.name == name;
    let channel = record.channels.iter_mut().find(own).expect("a channel");
    let lsb = channel.lsb.expect("counts");
    let counts = channel.counts.as_mut().expect("counts");
    for (i, (v, c)) in channel.values.iter_mut().zip(counts).enumerate() {
        let more = (of(i) / lsb + between(rng, 0.0, 1.0)).floor() as i32;
        *c += more;
        *v += f64::from(more) * lsb;
    }
}

fn told(record: &Record, replicates: usize) -> Diagnosis {
    let channels = [GYROS, ACCELEROMETERS].concat();
    let channels: Vec<String> = channels.iter().map(|c| (*c).to_owned()).collect();
    let options = DiagnoseOptions {
        no_evidence: true,
        replicates,
        ..DiagnoseOptions::default()
    };
    diagnose_channels(record, &channels, &options)
        .expect("a diagnosis")
        .diagnosis
}

/// What is planted: the cause, its parameter, and the size.
type Planted = (&'static str, &'static str, f64);

/// Plants one of the kinds that a signal makes, at a d' of 9 to 20 where a random walk hides none of it.
fn plant(kind: u64, record: &mut Record, name: &str, rng: &mut Xoshiro256PlusPlus) -> Planted {
    // Half of a step a random walk hides that is fitted again.
    let hidden = if kind == 2 { 2.5 } else { 1.0 };
    let wanted = hidden * between(rng, 9.0, 20.0);
    let n = (SECONDS * RATE_HZ) as usize;
    let (cause, parameter, shape): (_, _, Vec<f64>) = match kind {
        0 => {
            let axis = &name[4..];
            let temperature = record.channel(&format!("temp_{axis}")).expect("recorded");
            ("temperature", "slope", temperature.values.clone())
        }
        1 => {
            let hz = between(rng, 0.3, 9.0);
            let wave = (0..n).map(|i| (TAU * hz * i as f64 / RATE_HZ).sin());
            ("line", "amplitude", wave.collect())
        }
        2 => {
            let at = (between(rng, 0.2, 0.8) * n as f64) as usize;
            let step = (0..n).map(|i| f64::from(u8::from(i >= at)));
            ("bias_step", "height", step.collect())
        }
        _ => {
            let supply = record.channel("supply").expect("recorded");
            ("supply_sensitivity", "slope", supply.values.clone())
        }
    };
    let mean = shape.iter().sum::<f64>() / n as f64;
    let energy: f64 = shape.iter().map(|v| (v - mean).powi(2)).sum();
    let size = wanted * SIGMA / energy.sqrt();
    add(record, name, |i| size * (shape[i] - mean), rng);
    (cause, parameter, size)
}

#[test]
fn what_is_planted_in_an_accelerometer_is_named_and_sized() {
    let runs = draws::of(16, 40);
    let rng = &mut rng(OWN_SEED, 1);
    let (mut named, mut alone, mut inside) = (0, 0, 0);
    for run in 0..runs {
        let mut record = stand(rng);
        let name = ACCELEROMETERS[between(rng, 0.0, 3.0) as usize];
        let (cause, parameter, size) = plant(run % 4, &mut record, name, rng);
        let d = told(&record, 0);
        let own = |f: &&Finding| f.cause == cause && f.channels == [name];
        let found = d.findings.iter().find(own);
        named += u64::from(found.is_some());
        alone += u64::from(found.is_some() && d.findings.len() == 1 && d.unexplained.is_empty());
        if d.findings.len() != 1 || found.is_none() || !d.unexplained.is_empty() {
            println!("{cause} of {size} on {name}: {}", said(&d));
        }
        let Some(p) = found.and_then(|f| f.parameters.get(parameter)) else {
            continue;
        };
        assert!(p.unit.starts_with("m/s^2"), "{}", p.unit);
        let error = p.std_error.expect("an error");
        let off = (p.value - size) / error;
        inside += u64::from(off.abs() < 1.96);
        if off.abs() >= 1.96 {
            println!(
                "{cause} on {name}: {:.6} +- {error:.6}, planted {size:.6}",
                p.value
            );
        }
    }
    asked("named", named, runs, 0.98);
    asked("alone", alone, runs, 0.98);
    asked("sizes within their intervals", inside, named, 0.93);
}

#[test]
fn faults_of_the_counts_of_an_accelerometer_are_named() {
    const RUNS: u64 = 8;
    let rng = &mut rng(OWN_SEED, 4);
    for (cause, fault) in [
        (
            "saturation",
            (|c, middle| c.min(middle + 1)) as fn(i32, i32) -> i32,
        ),
        ("stuck_bit", |c, _| c | 1 << 1),
    ] {
        let named = (0..RUNS).filter(|_| {
            let mut record = stand(rng);
            let name = ACCELEROMETERS[between(rng, 0.0, 3.0) as usize];
            let own = |c: &&mut Channel| c.name == name;
            let channel = record.channels.iter_mut().find(own).expect("a channel");
            let (lsb, counts) = (channel.lsb, channel.counts.as_mut());
            let (lsb, counts) = (lsb.expect("counts"), counts.expect("counts"));
            let middle = counts.iter().sum::<i32>() / counts.len() as i32;
            for (v, c) in channel.values.iter_mut().zip(counts) {
                let read = fault(*c, middle);
                *v += f64::from(read - *c) * lsb;
                *c = read;
            }
            let d = told(&record, 0);
            let named = |f: &Finding| f.cause == cause && f.channels == [name];
            let right = d.findings.iter().any(named);
            if !right {
                println!("{cause} on {name}: {}", said(&d));
            }
            right
        });
        asked(cause, named.count() as u64, RUNS, 0.95);
    }
}

#[test]
fn accelerometers_at_rest_are_silent_and_held_by_their_replicates() {
    const RUNS: u64 = 12;
    let rng = &mut rng(OWN_SEED, 2);
    let (mut silent, mut held) = (0, 0);
    for _ in 0..RUNS {
        let d = told(&stand(rng), 99);
        let quiet = d.findings.is_empty() && d.unexplained.is_empty();
        silent += u64::from(quiet);
        if !quiet {
            println!("{}", said(&d));
        }
        for name in ACCELEROMETERS {
            let walk = &d.baseline[name]["angle_random_walk"];
            assert_eq!(walk.unit, "m/s^2*sqrt(s)");
            // 4.7 mV at 800 mV/g and the rounding, at 20 Hz.
            assert!(
                (walk.value * RATE_HZ.sqrt() / SIGMA - 1.0).abs() < 0.05,
                "{}",
                walk.value
            );
            held += u64::from(d.replicates[name].after.holds());
        }
    }
    asked("silent", silent, RUNS, 0.995);
    asked("held by replicates", held, 3 * RUNS, 0.9);
}

#[test]
fn a_name_that_is_no_sensor_is_refused_and_one_kind_alone_is_diagnosed() {
    let record = stand(&mut rng(OWN_SEED, 3));
    let of = |names: &[&str]| {
        let names: Vec<String> = names.iter().map(|n| (*n).to_owned()).collect();
        diagnose_channels(&record, &names, &DiagnoseOptions::default())
    };
    let error = of(&["gyro_x", "supply"]).expect_err("supply is no sensor");
    assert!(error.to_string().contains("supply"), "{error}");
    let names = |of: &[&str]| -> Vec<String> { of.iter().map(|n| (*n).to_owned()).collect() };
    let one = of(&["acc_z"]).expect("a diagnosis").diagnosis;
    assert_eq!(
        one.baseline.keys().cloned().collect::<Vec<_>>(),
        names(&["acc_z"])
    );
    let two = of(&["gyro_y", "acc_x"]).expect("a diagnosis").diagnosis;
    assert_eq!(
        two.baseline.keys().cloned().collect::<Vec<_>>(),
        names(&["acc_x", "gyro_y"])
    );
}

#[test]
fn what_an_acceleration_costs_is_told_as_a_velocity() {
    let mut rng = rng(OWN_SEED, 4);
    let mut record = stand(&mut rng);
    let n = (SECONDS * RATE_HZ) as usize;
    // 0.1 m/s^2 for half of the time, at a period of 60 s: from the middle of one half to that of the next 3 m/s come together.
    let loaded = |i: usize| (i as f64 / RATE_HZ) % 60.0 < 30.0;
    let supply = record.channels.iter_mut().find(|c| c.name == "supply");
    let supply = supply.expect("recorded");
    supply.counts = None;
    supply.values = (0..n).map(|i| if loaded(i) { 4.8 } else { 5.0 }).collect();
    let of = |i: usize| if loaded(i) { 0.05 } else { -0.05 };
    add(&mut record, "acc_y", of, &mut rng);
    let d = told(&record, 19);
    let found = d.findings.iter().find(|f| f.cause == "supply_sensitivity");
    let found = found.unwrap_or_else(|| panic!("{}", said(&d)));
    assert_eq!(found.channels, ["acc_y"]);
    let does = found.consequence.as_ref().expect("replicates tell it");
    assert!(does.angle_rms_deg.is_empty());
    // Over 10 s 0.5 m/s, less where the load switches in between; a whole number of periods and 40 s make as much as 40 s do.
    let over = |seconds: f64| -> f64 {
        let m = (seconds * RATE_HZ) as usize;
        let sums = (0..n - m).map(|i| (i..i + m).map(of).sum::<f64>() / RATE_HZ);
        (sums.map(|v| v * v).sum::<f64>() / (n - m) as f64).sqrt()
    };
    for (key, seconds) in [("10s", 10.0), ("100s", 100.0)] {
        let ratio = does.velocity_rms_mps[key] / over(seconds);
        // The slope is known to a hundredth.
        assert!((ratio - 1.0).abs() < 0.05, "{key}: {ratio}");
    }
    let entries = d
        .unexplained
        .iter()
        .filter(|u| u.channel.starts_with("acc"));
    let angles = entries.filter_map(|u| u.consequence.as_ref());
    assert!(angles.map(|c| &c.angle_rms_deg).all(|a| a.is_empty()));
}
