//! A rotor that runs free beside the sensor, drawn at random: its pitch wanders, it shakes three gyros and three accelerometers, each
//! by a gain and a phase of its own, and twice per turn as well. Pitch and harmonic are wandering lines of all gyros, however weak one of
//! them is on an axis, and the model holds the record.

mod draws;
mod white;

use std::f64::consts::{PI, TAU};

use diagnosis::result::Finding;
use diagnosis::{DiagnoseOptions, diagnose};
use model::file::ModelFile;
use model::record::{Axis, Channel, Quantity, Record};
use model::simulate;
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

type Rng = Xoshiro256PlusPlus;

const RUNS: u64 = 12;
/// A share of 0.95 misses this in 2 %. All draws of each test's own seed reached it, of gyros alone those of 20261301 too, which nothing was
/// made on (2026-11-29).
const LEAST: u64 = 10;
const SECONDS: f64 = 600.0;
const ACC_NOISE: f64 = 3e-3;

fn between(rng: &mut Rng, low: f64, high: f64) -> f64 {
    Uniform::new(low, high).expect("a range").sample(rng)
}

fn normal(rng: &mut Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// The phase of a rotor of a mean pitch at each sample, rad: departures of `rms` Hz that last for `time` seconds.
fn turned(pitch: f64, rms: f64, time: f64, rate_hz: f64, rng: &mut Rng) -> Vec<f64> {
    let keep = (-1.0 / (rate_hz * time)).exp();
    let (mut off, mut phase) = (rms * normal(rng), between(rng, -PI, PI));
    let next = |_| {
        off = keep * off + rms * (1.0 - keep * keep).sqrt() * normal(rng);
        phase += TAU * (pitch + off) / rate_hz;
        phase
    };
    (0..(SECONDS * rate_hz) as usize).map(next).collect()
}

/// Noise of a level and a standard deviation, of which a filter of one pole keeps a part from one reading to the next.
#[derive(Clone, Copy)]
struct Noise {
    level: f64,
    sigma: f64,
    kept: f64,
}

/// What an axis reads of it in noise, whose standard deviation is the unit of the sizes: at the pitch and at twice that.
fn read(phases: &[f64], sizes: [f64; 2], noise: Noise, rng: &mut Rng) -> Vec<f64> {
    let gains = sizes.map(|s| s * between(rng, 0.3, 1.0));
    let ahead = [0; 2].map(|_| between(rng, -PI, PI));
    let mut last = normal(rng);
    let one = |p: &f64| {
        let tone = |k: usize| gains[k] * ((k + 1) as f64 * p + ahead[k]).cos();
        last = noise.kept * last + (1.0 - noise.kept * noise.kept).sqrt() * normal(rng);
        noise.level + noise.sigma * (tone(0) + tone(1) + last)
    };
    phases.iter().map(one).collect()
}

/// Beside what a rotor is drawn.
#[derive(Clone, Copy, PartialEq)]
enum Beside {
    /// White noise, three accelerometers that read it too.
    Accelerometers,
    /// The same, the gyros' noise held back by a filter.
    Filter,
    /// White noise of three gyros alone.
    Nothing,
}

/// The pitch, what was drawn in words, and the record.
fn drawn(rng: &mut Rng, beside: Beside) -> (f64, String, Record) {
    let rate_hz = [50.0, 100.0][between(rng, 0.0, 2.0) as usize];
    // Twice the pitch stays below half the rate.
    let pitch = rate_hz * between(rng, 0.06, 0.22);
    let rms = between(rng, 0.02f64.ln(), 0.1f64.ln()).exp();
    let time = between(rng, 3.0, 30.0);
    let phases = turned(pitch, rms, time, rate_hz, rng);
    let sizes = [between(rng, 0.4, 1.5), between(rng, 0.2, 0.6)];
    let kept = match beside {
        Beside::Filter => between(rng, 0.3, 0.8),
        _ => 0.0,
    };
    let mut record = white::gyros(rate_hz, |_| {
        let (sigma, level) = (between(rng, 0.04, 0.12), between(rng, -1.0, 1.0));
        read(&phases, sizes, Noise { level, sigma, kept }, rng)
    });
    let still = Noise {
        level: 0.3,
        sigma: ACC_NOISE,
        kept: 0.0,
    };
    let accelerometer = |axis: &Axis| Channel {
        name: format!("acc_{}", ["x", "y", "z"][axis.index()]),
        quantity: Quantity::Acc,
        axis: Some(*axis),
        unit: "g".into(),
        lsb: None,
        counts: None,
        values: read(&phases, sizes.map(|s| 2.0 * s), still, rng),
    };
    if beside != Beside::Nothing {
        let channels: Vec<Channel> = Axis::ALL.iter().map(accelerometer).collect();
        record.channels.extend(channels);
    }
    let told = format!(
        "{rate_hz} Hz, {pitch:.3} Hz, {rms:.3} Hz over {time:.1} s, {sizes:.2?}, filter {kept:.2}"
    );
    (pitch, told, record)
}

/// Whether a wandering line alone is told of a record on all gyros, beside a filter where there is one, and held: what is wrong else.
fn told_alone(record: &Record, pitch: f64, beside: Beside) -> Result<ModelFile, String> {
    let options = DiagnoseOptions {
        replicates: 99,
        ..DiagnoseOptions::default()
    };
    let diagnosed = diagnose(record, &options).expect("a diagnosis");
    let d = diagnosed.diagnosis;
    // The stronger of its two tones stands for it.
    let at_pitch = d.findings.iter().any(|f| {
        let others = f.harmonics.iter().flat_map(|tone| tone.values());
        let mut centers = std::iter::once(&f.parameters)
            .chain(others)
            .filter_map(|p| Some(p.get("center_frequency")?.value));
        f.channels.len() == 3
            && f.harmonics.len() == 1
            && centers.any(|c| (c - pitch).abs() < 0.01 * pitch)
    });
    // What one pole leaves of white noise is a Gauss-Markov process.
    let of_filter =
        |cause: &str| beside == Beside::Filter && ["low_pass", "gauss_markov"].contains(&cause);
    let is_there = |cause: &str| cause == "wandering_line" || of_filter(cause);
    // Its tones are one entry.
    let tones = |f: &&Finding| f.cause == "wandering_line";
    let alone = d.findings.iter().all(|f| is_there(&f.cause))
        && d.findings.iter().filter(tones).count() == 1;
    let left = d.unexplained.iter().any(|u| u.material);
    let holds = d.replicates.values().all(|r| r.after.p_value > 0.01);
    if at_pitch && alone && !left && holds {
        return Ok(diagnosed.extended_model);
    }
    let found = d.findings.iter().map(|f| (&f.cause, &f.channels));
    let fail = d.checks.iter().filter(|c| c.fails_after);
    let fail = fail.map(|c| (&c.channel, &c.what));
    let strays = d.replicates.values().map(|r| r.after.strays());
    Err(format!(
        "{:?}; {:?}; {:?}; {:?}",
        found.collect::<Vec<_>>(),
        d.unexplained.iter().map(|u| &u.what).collect::<Vec<_>>(),
        strays.collect::<Vec<_>>(),
        fail.collect::<Vec<_>>(),
    ))
}

/// Grades draws by what is told of each, and of gyros alone also of what its model simulates: a simulation without accelerometers has
/// nothing else that says how harmonics are locked.
fn graded(seed: u64, least: u64, beside: Beside) {
    let mut rng = Rng::seed_from_u64(draws::seed(seed));
    let graded = draws::graded(RUNS, least, |draw| {
        let (pitch, drawn, record) = drawn(&mut rng, beside);
        let again = |model: ModelFile| {
            let simulated = simulate(&model, SECONDS, model.rate_hz, draw);
            let simulated = simulated.expect("what is handed over simulates");
            told_alone(&simulated, pitch, beside).map_err(|what| format!("simulated: {what}"))
        };
        let told = told_alone(&record, pitch, beside);
        let told = match beside {
            Beside::Nothing => told.and_then(again),
            _ => told,
        };
        told.map(drop).map_err(|what| format!("{drawn}: {what}"))
    });
    assert!(graded.is_ok(), "{}", graded.unwrap_err());
}

#[test]
fn statistical_a_rotor_is_told_on_all_axes_that_it_shakes() {
    graded(20_261_201, LEAST, Beside::Accelerometers);
}

#[test]
fn statistical_a_rotor_is_told_beside_a_filter_of_the_noise() {
    graded(20_261_202, LEAST, Beside::Filter);
}

#[test]
fn statistical_a_rotor_is_told_by_gyros_alone_and_of_its_simulation() {
    graded(20_261_203, LEAST, Beside::Nothing);
}
