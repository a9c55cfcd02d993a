//! Mounts that are knocked and ring on for seconds: size, duration, frequency and axes are drawn, and what is told is graded by rate.
//! What is as loud for as long and does not ring is no long shock. `IMU_STAND_SEED` takes other draws.

mod rates;

use std::f64::consts::{PI, TAU};

use diagnosis::result::Finding;
use model::ModelFile;
use model::record::Record;
use rand_xoshiro::Xoshiro256PlusPlus;
use rates::{
    GYRO_SIGMA as SIGMA, GYROS, RATE_HZ, add, asked, between, by_ratio, draws, rng, said, told,
};

/// Seed of the draws.
const OWN_SEED: u64 = 20_261_130;
const SECONDS: f64 = 400.0;

fn stand(rng: &mut Xoshiro256PlusPlus) -> Record {
    let seed = between(rng, 0.0, 1e9) as u64;
    model::simulate(&ModelFile::paper(), SECONDS, RATE_HZ, seed).expect("a run")
}

#[test]
fn a_ring_of_seconds_is_named_alone_and_its_values_hold() {
    let runs = draws::of(12, 60);
    let rng = &mut rng(OWN_SEED, 1);
    let (mut alone, mut inside, mut values) = (0, 0, 0);
    for _ in 0..runs {
        let mut record = stand(rng);
        let duration = by_ratio(rng, 1.2, 4.5);
        let hz = by_ratio(rng, 2.7, 9.0);
        let (at, phase) = (between(rng, 0.1, 0.9) * SECONDS, between(rng, 0.0, TAU));
        let ring = |t: f64| {
            let since = t - at;
            let course = (-3.0 * since / duration).exp() * (TAU * hz * since + phase).cos();
            if since < 0.0 { 0.0 } else { course }
        };
        let axes = between(rng, 1.0, 3.99) as usize;
        let first = GYROS[0];
        let mut peak = 0.0;
        for axis in &GYROS[..axes] {
            let size = SIGMA * by_ratio(rng, 20.0, 200.0);
            add(&mut record, axis, |t| size * ring(t));
            if *axis == first {
                let all = (0..(SECONDS * RATE_HZ) as usize).map(|i| ring(i as f64 / RATE_HZ));
                peak = size * all.fold(0.0f64, |most, v| most.max(v.abs()));
            }
        }
        let d = told(&record);
        let planted = format!("{duration:.2} s, {hz:.1} Hz at {at:.1} s, {peak:.1} deg/s");
        let [f] = &d.findings[..] else {
            println!("{planted}: {}", said(&d));
            continue;
        };
        if f.cause != "shock" || f.channels.len() != axes || !d.unexplained.is_empty() {
            println!("{planted}: {}", said(&d));
            continue;
        }
        alone += 1;
        let of_first = f.per_channel.get(first).unwrap_or(&f.parameters);
        for (name, p, wanted) in [
            ("time", &f.parameters, at),
            ("duration", &f.parameters, duration),
            ("frequency", &f.parameters, hz),
            ("peak", of_first, peak),
        ] {
            let p = &p[name];
            let error = p.std_error.expect("an error");
            values += 1;
            inside += u64::from((p.value - wanted).abs() < 1.96 * error);
            if (p.value - wanted).abs() >= 1.96 * error {
                println!("{planted}: {name} {} +- {error}", p.value);
            }
        }
    }
    // Where what rings passes for jumps at first, it is not left out, and not found.
    asked("alone", alone, runs, 0.8);
    asked("values within their intervals", inside, values, 0.93);
}

#[test]
fn a_tone_and_a_hand_of_seconds_are_no_long_shocks() {
    let runs = draws::of(4, 12);
    let rng = &mut rng(OWN_SEED, 2);
    let (mut none, mut all) = (0, 0);
    for _ in 0..runs {
        let (at, lasts) = (between(rng, 0.1, 0.9) * SECONDS, between(rng, 1.5, 5.0));
        let (size, phase) = (SIGMA * by_ratio(rng, 20.0, 200.0), between(rng, 0.0, TAU));
        let (hz, slow) = (by_ratio(rng, 2.7, 9.0), between(rng, 0.4, 1.5));
        let part = |t: f64| Some((t - at) / lasts).filter(|p| (0.0..1.0).contains(p));
        let tone = |t: f64| part(t).map_or(0.0, |_| size * (TAU * hz * t + phase).cos());
        // By 20 readings a second a small one of these is a ring as well: the two differ by a fiftieth of their energy.
        let falls = |t: f64| part(t).map_or(0.0, |p| 3.0 * (1.0 - p) * tone(t));
        let hand = |t: f64| part(t).map_or(0.0, |p| size * (PI * p).sin() * (TAU * slow * t).sin());
        let kinds: [(&str, &dyn Fn(f64) -> f64); 3] = [
            ("a tone", &tone),
            ("a tone that falls", &falls),
            ("a hand", &hand),
        ];
        for (what, of) in kinds {
            let mut record = stand(rng);
            add(&mut record, GYROS[0], of);
            let d = told(&record);
            all += 1;
            // The first of a tone may be told as a short one.
            let is_long = |f: &&Finding| f.cause == "shock" && f.parameters["duration"].value > 1.0;
            let shocks = d.findings.iter().filter(is_long).count();
            none += u64::from(shocks == 0);
            if shocks > 0 {
                println!("{what} of {lasts:.2} s, {size:.1} deg/s: {}", said(&d));
            }
        }
    }
    asked("no long shock", none, all, 0.99);
}
