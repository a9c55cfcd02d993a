//! Narrow bands and wandering lines: how often they are named and how often their intervals hold, how high the likelihood
//! ratio of a peak climbs on white noise, and what is told of a measured record beside a band of its own.
//!
//! `cargo run --release -p diagnosis --example bands -- alone|white|clean|beside|measured [runs] [seed]`; the last two read
//! the measured record of `IMU_STAND_DATA`.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::io::Read as _;

use diagnosis::result::{Diagnosed, Finding};
use diagnosis::{DiagnoseOptions, diagnose};
use model::file::EffectModel;
use model::record::{Axis, Base, Channel, Header, Quantity, Record};
use model::{ModelFile, Parameter};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

const NAMES: [&str; 2] = ["narrow_band", "wandering_line"];

fn uniform(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    Uniform::new(low, high).map_or(low, |u| u.sample(rng))
}

fn options() -> DiagnoseOptions {
    DiagnoseOptions {
        no_evidence: true,
        ..DiagnoseOptions::default()
    }
}

/// One gyro of these values.
fn gyro_z(values: Vec<f64>, rate_hz: f64) -> Record {
    Record {
        header: Header {
            rate_hz: Some(rate_hz),
            base: Some(Base::Static),
            ..Header::default()
        },
        channels: vec![Channel {
            name: "gyro_z".into(),
            quantity: Quantity::Gyro,
            axis: Some(Axis::ALL[2]),
            unit: "deg/s".into(),
            values,
            counts: None,
            lsb: None,
        }],
        ..Record::default()
    }
}

/// d'^2 of a Lorentzian of this variance over the white one, half width and centre in coefficients, of n.
fn strength(variance: f64, half: f64, centre: f64, n: usize) -> f64 {
    let height = variance * n as f64 / (PI * half);
    let of = |k: usize| {
        let s = height / (1.0 + ((k as f64 - centre) / half).powi(2));
        s - s.ln_1p()
    };
    (1..n).map(of).sum()
}

/// A stand of one gyro with a band of strength `wanted`; its parameters as simulated.
fn band(rng: &mut Xoshiro256PlusPlus, name: &str, seconds: f64, rate: f64) -> (ModelFile, f64) {
    let mut model = ModelFile::paper();
    model.channels.truncate(1);
    let n = (seconds * rate) as usize;
    let centre = uniform(rng, (0.02 * rate).ln(), (0.47 * rate).ln()).exp();
    let cells = uniform(rng, 20f64.ln(), (0.1 * centre * PI * seconds).ln().min(6.9)).exp();
    let width = cells / (PI * seconds);
    let wanted = uniform(rng, 8f64.ln(), 40f64.ln()).exp();
    let half = width * seconds;
    let of = |v: f64| strength(v, half, 2.0 * centre * seconds, n);
    let (mut low, mut high) = (1e-6f64, 1e4f64);
    for _ in 0..80 {
        let middle = (low * high).sqrt();
        if of(middle) < wanted * wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    let white = 5.27 / 60.0 * rate.sqrt();
    let rms = low.sqrt() * white;
    let (size, wide) = if name == NAMES[0] {
        (("rms", rms), "bandwidth")
    } else {
        (("amplitude", rms * 2f64.sqrt()), "linewidth")
    };
    let all = [size, ("center_frequency", centre), (wide, width)];
    model.effects.push(EffectModel {
        cause: name.into(),
        channels: vec!["gyro_x".into()],
        parameters: all
            .iter()
            .map(|(k, v)| ((*k).to_owned(), Parameter::exact(*v, "1")))
            .collect(),
    });
    (model, wanted)
}

fn causes(d: &Diagnosed) -> String {
    let all = d.diagnosis.findings.iter();
    let all = all.map(|f| format!("{} {:?}", f.cause, f.channels));
    all.collect::<Vec<_>>().join(", ")
}

fn alone(runs: u64, seed: u64) {
    for (name, other) in [(NAMES[0], NAMES[1]), (NAMES[1], NAMES[0])] {
        let mut held: BTreeMap<String, (u64, u64)> = BTreeMap::new();
        let (mut either, mut right, mut open, mut wrong, mut beside) = (0, 0, 0, 0, 0);
        for run in 0..runs {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed * 1_000_003 + run);
            let (model, wanted) = band(&mut rng, name, 600.0, 20.0);
            let record =
                model::simulate(&model, 600.0, 20.0, seed * 1_000_003 + run).expect("a run");
            let d = diagnose(&record, &options()).expect("a diagnosis");
            let truth = &model.effects[0].parameters;
            let is = |f: &&Finding, of: &str| f.cause == of;
            let found = d.diagnosis.findings.iter().find(|f| is(f, name));
            let taken = d.diagnosis.findings.iter().find(|f| is(f, other));
            either += u64::from(found.is_some() || taken.is_some());
            let lists = |f: &Finding, of: &str| f.alternatives.iter().any(|a| a.cause == of);
            match (found, taken) {
                (Some(f), None) if lists(f, other) => open += 1,
                (Some(_), None) => right += 1,
                (None, Some(f)) if lists(f, name) => open += 1,
                (_, Some(_)) => wrong += 1,
                (None, None) => {}
            }
            let more = d.diagnosis.findings.len() > 1;
            beside += u64::from(more);
            if found.or(taken).is_none() || more || !d.diagnosis.unexplained.is_empty() {
                println!("{name} {run}: d' {wanted:.1} {truth:?}: {}", causes(&d));
                for u in &d.diagnosis.unexplained {
                    println!("    {}", u.what);
                }
            }
            let Some(f) = found else { continue };
            for (k, p) in &f.parameters {
                let error = p.std_error.unwrap_or(f64::NAN);
                let entry = held.entry(k.clone()).or_default();
                entry.1 += 1;
                let z = (p.value - truth[k].value) / error;
                entry.0 += u64::from(z.abs() < 1.96);
                if z.abs() > 3.5 || z.is_nan() {
                    println!(
                        "    {name} {run}: {k} {} +- {error}, true {}",
                        p.value, truth[k].value
                    );
                }
            }
        }
        println!(
            "{name}: one of the two {either} of {runs}, right {right}, open {open}, wrong {wrong}; others beside {beside}"
        );
        println!("  intervals: {held:?}");
    }
}

/// Highest likelihood ratios of a peak on white noise, by length.
fn white(runs: u64, seed: u64) {
    for n in [2000, 12_000, 60_000] {
        let runs = runs * 12_000 / n as u64;
        let mut all: Vec<f64> = (0..runs)
            .map(|run| {
                let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed * 1_000_003 + run);
                let y: Vec<f64> = (0..n).map(|_| StandardNormal.sample(&mut rng)).collect();
                diagnosis::peak_of_white(&y)
            })
            .collect();
        all.sort_by(f64::total_cmp);
        let at = |p: f64| all[((1.0 - p) * runs as f64) as usize];
        // Beyond its 90th percentile an exponential tail: where it falls to the stated chance.
        let from = at(0.1);
        let beyond: Vec<f64> = all
            .iter()
            .filter(|v| **v > from)
            .map(|v| v - from)
            .collect();
        let mean = beyond.iter().sum::<f64>() / beyond.len() as f64;
        let stated = from + mean * (0.1 / diagnosis::threshold::FALSE_ALARM).ln();
        println!(
            "{n}: {runs} runs; median {:.1}, 1 in 10 {from:.1}, 1 in 100 {:.1}, highest {:.1}; tail {mean:.2}, at {:e} {stated:.1}; threshold {:.1}",
            at(0.5),
            at(0.01),
            all[all.len() - 1],
            diagnosis::threshold::FALSE_ALARM,
            diagnosis::threshold::peak(n)
        );
    }
}

fn clean(runs: u64, seed: u64) {
    let (mut bands, mut any) = (0, 0);
    for run in 0..runs {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed * 1_000_003 + run);
        let mut model = ModelFile::paper();
        for c in &mut model.channels {
            let walk = uniform(&mut rng, 3e-4f64.ln(), 7e-3f64.ln()).exp();
            if let Some(p) = c.baseline.get_mut("rate_random_walk") {
                p.value = walk;
            }
        }
        let rate = if run % 4 == 0 { 100.0 } else { 20.0 };
        let seconds = if run % 4 == 0 { 300.0 } else { 600.0 };
        let record = model::simulate(&model, seconds, rate, seed * 1_000_003 + run).expect("a run");
        let d = diagnose(&record, &options()).expect("a diagnosis");
        let own = d
            .diagnosis
            .findings
            .iter()
            .filter(|f| NAMES.contains(&f.cause.as_str()));
        bands += u64::from(own.count() > 0);
        if !d.diagnosis.findings.is_empty() || !d.diagnosis.unexplained.is_empty() {
            any += 1;
            println!("{run}: {} {:?}", causes(&d), d.diagnosis.unexplained);
        }
    }
    println!("{runs} clean captures of three axes: {bands} with a band, {any} with anything");
}

fn measured_values(file: &str, column: &str) -> Vec<f64> {
    let folder = std::env::var_os("IMU_STAND_DATA").expect("IMU_STAND_DATA");
    let bytes = std::fs::File::open(std::path::Path::new(&folder).join(file)).expect("a record");
    let mut text = String::new();
    let mut unpacked = flate2::read::GzDecoder::new(bytes);
    unpacked.read_to_string(&mut text).expect("gzip text");
    let mut lines = text.lines().filter(|l| !l.starts_with('#'));
    let mut names = lines.next().expect("a header").split(',');
    let place = names.position(|n| n == column).expect("the column");
    let value = |l: &str| l.split(',').nth(place).and_then(|v| v.parse().ok());
    lines.map(|l| value(l).unwrap_or(f64::NAN)).collect()
}

/// Standard deviation between two frequencies.
fn rms_in(values: &[f64], rate_hz: f64, from: f64, to: f64) -> f64 {
    let n = values.len();
    let c = diagnosis::likelihood::Dct::new(n).forward(values);
    let k = |hz: f64| (2.0 * hz / rate_hz * n as f64) as usize;
    (c[k(from)..k(to)].iter().map(|c| c * c).sum::<f64>() / n as f64).sqrt()
}

fn told(d: &Diagnosed) {
    for f in &d.diagnosis.findings {
        let others: Vec<_> = f.alternatives.iter().map(|a| &a.cause).collect();
        let lr = f.likelihood_ratio.unwrap_or(f64::NAN);
        println!(
            "    {} (LR {lr:.0}, or {others:?}, {} parts)",
            f.what,
            f.components.len()
        );
    }
    for u in &d.diagnosis.unexplained {
        println!(
            "    unexplained: {}",
            u.what.chars().take(230).collect::<String>()
        );
    }
}

fn measured() {
    let all = measured_values("adis16405_run1_100hz.csv.gz", "gz_dps");
    let parts = [0, 200_000, 500_000, 900_000].map(|at| at..at + 60_000);
    for part in parts.into_iter().chain(std::iter::once(0..all.len())) {
        let values = all[part.clone()].to_vec();
        let record = gyro_z(values.clone(), 100.0);
        let from = std::time::Instant::now();
        let d = diagnose(&record, &options()).expect("a diagnosis");
        let took = from.elapsed().as_secs_f64();
        let again = model::simulate_in_the_world_of(&d.extended_model, &record, 100.0, 1);
        let again = again.map(|r| rms_in(&r.channels[0].values, 100.0, 17.0, 23.0));
        let own = rms_in(&values, 100.0, 17.0, 23.0);
        println!("{part:?}: {own:.4} from 17 to 23 Hz, simulated {again:.4?}; {took:.2} s");
        told(&d);
    }
    let values = measured_values("mpu6050_static_100hz_655s.csv.gz", "gz_dps");
    let d = diagnose(&gyro_z(values, 100.0), &options()).expect("a diagnosis");
    println!("MPU-6050 gz_dps");
    told(&d);
}

/// What is planted beside the band of the measured record, with the size at d' of 1 and what of it is asked.
fn planted(
    kind: &str,
    values: &mut [f64],
    temperature: &[f64],
    rng: &mut Xoshiro256PlusPlus,
    strength: f64,
) -> (&'static str, &'static str, f64) {
    let (n, rate_hz) = (values.len(), 100.0f64);
    // About the record's: white noise of 0.043 deg/s/sqrt(Hz), a random walk of 0.003 deg/s/sqrt(s).
    let (white, walk) = (0.43f64, 0.003f64);
    let (density, seconds) = (white / rate_hz.sqrt(), n as f64 / rate_hz);
    let root = (n as f64).sqrt();
    match kind {
        "line" => {
            // Inside the band it would have to be larger: it stands beside it, or well above.
            let hz = if uniform(rng, 0.0, 1.0) < 0.5 {
                uniform(rng, 1.0, 15.0)
            } else {
                uniform(rng, 26.0, 48.0)
            };
            let size = strength * white * 2f64.sqrt() / root;
            values
                .iter_mut()
                .enumerate()
                .for_each(|(i, v)| *v += size * (2.0 * PI * hz * i as f64 / rate_hz).cos());
            ("line", "amplitude", size)
        }
        "rate_ramp" => {
            let size = strength * walk / seconds.sqrt();
            values
                .iter_mut()
                .enumerate()
                .for_each(|(i, v)| *v += size * i as f64 / rate_hz);
            ("rate_ramp", "slope", size)
        }
        "bias_step" => {
            let at = uniform(rng, 0.2, 0.8) * n as f64;
            let size = strength * (density * walk).sqrt();
            values.iter_mut().skip(at as usize).for_each(|v| *v += size);
            ("bias_step", "height", size)
        }
        "noise_change" => {
            let from = (uniform(rng, 0.1, 0.6) * n as f64) as usize;
            let size = strength * 2f64.sqrt() / (0.3 * 0.7 * n as f64).sqrt();
            let more = white * size.sqrt();
            for v in &mut values[from..from + 3 * n / 10] {
                let e: f64 = StandardNormal.sample(rng);
                *v += more * e;
            }
            ("noise_change", "variance_increase", size)
        }
        "telegraph" => {
            let (half, stay) = (0.012 * strength, 8.0 * rate_hz);
            let mut level = half;
            for v in values.iter_mut() {
                if uniform(rng, 0.0, 1.0) < 1.0 / stay {
                    level = -level;
                }
                *v += level;
            }
            ("telegraph", "half_height", half)
        }
        _ => {
            // A swing of 4000 samples a radian.
            let slow = walk * 4000.0 / rate_hz;
            let size = strength * (2.0 * (density.powi(2) + slow.powi(2)) / seconds).sqrt();
            values
                .iter_mut()
                .zip(temperature)
                .for_each(|(v, t)| *v += size * t);
            ("temperature", "slope", size)
        }
    }
}

fn beside(runs: u64, seed: u64) {
    let all = measured_values("adis16405_run1_100hz.csv.gz", "gz_dps");
    for kind in [
        "line",
        "rate_ramp",
        "bias_step",
        "noise_change",
        "telegraph",
        "temperature",
    ] {
        let (mut named, mut held) = (0, 0);
        for run in 0..runs {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed * 1_000_003 + run);
            let from = uniform(&mut rng, 0.0, 940_000.0) as usize;
            let mut values = all[from..from + 60_000].to_vec();
            let temperature: Vec<f64> = (0..60_000).map(|i| (i as f64 / 4000.0).sin()).collect();
            let (cause, parameter, size) = planted(kind, &mut values, &temperature, &mut rng, 14.0);
            let mut record = gyro_z(values, 100.0);
            record.channels.push(Channel {
                name: "temp".into(),
                quantity: Quantity::Temp,
                axis: None,
                unit: "degC".into(),
                values: temperature.iter().map(|t| 25.0 + t).collect(),
                counts: None,
                lsb: None,
            });
            let d = diagnose(&record, &options()).expect("a diagnosis");
            let found = d.diagnosis.findings.iter().find(|f| f.cause == cause);
            let Some(p) = found.map(|f| &f.parameters[parameter]) else {
                println!("{kind} {run} from {from}: {}", causes(&d));
                told(&d);
                continue;
            };
            named += 1;
            let z = (p.value - size) / p.std_error.unwrap_or(f64::NAN);
            held += u64::from(z.abs() < 1.96);
            if z.abs() > 3.5 {
                println!(
                    "{kind} {run}: {size} found {} +- {:?}",
                    p.value, p.std_error
                );
            }
        }
        println!("{kind}: named {named} of {runs}, interval holds {held}");
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let what = arguments.next().unwrap_or_default();
    let mut number = |or: u64| arguments.next().and_then(|a| a.parse().ok()).unwrap_or(or);
    let (runs, seed) = (number(100), number(1));
    match what.as_str() {
        "alone" => alone(runs, seed),
        "white" => white(runs, seed),
        "clean" => clean(runs, seed),
        "beside" => beside(runs, seed),
        "measured" => measured(),
        _ => println!("alone, white, clean, beside or measured"),
    }
}
