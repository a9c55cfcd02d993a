//! Digital filters of other sensors and loggers, hidden at random in white noise: named, and the noise before them told.

mod draws;
mod white;

use std::f64::consts::PI;

use diagnosis::{DiagnoseOptions, diagnose};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

type Rng = Xoshiro256PlusPlus;

const RUNS: u64 = 24;
/// Of filters that are strong, 98 % are to be named alone: fewer of [`RUNS`] than this come once in a thousand.
const LEAST: u64 = 21;
const SAMPLES: usize = 12_000;
/// Samples before the first reading: a filter has forgotten its start.
const BEFORE: usize = 500;

fn between(rng: &mut Rng, low: f64, high: f64) -> f64 {
    Uniform::new(low, high).expect("a range").sample(rng)
}

/// A filter whose gain at rest is 1: coefficients of what goes in, and of what came out before.
struct Filter {
    forward: Vec<f64>,
    back: Vec<f64>,
    /// Readings of a mean, and how often it is taken.
    averages: Option<(usize, usize)>,
}

impl Filter {
    fn mean(of: usize) -> Self {
        Self {
            forward: vec![1.0 / of as f64; of],
            back: vec![],
            averages: Some((of, 1)),
        }
    }

    /// Two means, one behind the other.
    fn window(of: usize) -> Self {
        let one = 1.0 / (of * of) as f64;
        let tap = |i: usize| one * (i + 1).min(2 * of - 1 - i) as f64;
        Self {
            forward: (0..2 * of - 1).map(tap).collect(),
            back: vec![],
            averages: Some((of, 2)),
        }
    }

    /// Butterworth's of second order by the bilinear transform; `corner` over the sample rate.
    fn butterworth(corner: f64) -> Self {
        let w = (PI * corner).tan();
        let norm = 1.0 + 2f64.sqrt() * w + w * w;
        let b = w * w / norm;
        Self {
            forward: vec![b, 2.0 * b, b],
            back: vec![
                2.0 * (w * w - 1.0) / norm,
                (1.0 - 2f64.sqrt() * w + w * w) / norm,
            ],
            averages: None,
        }
    }

    fn drawn(rng: &mut Rng) -> Self {
        let whole = |rng: &mut Rng, low: f64, high: f64| between(rng, low, high + 1.0) as usize;
        match whole(rng, 0.0, 2.0) {
            0 => Self::mean(whole(rng, 2.0, 8.0)),
            1 => Self::window(whole(rng, 2.0, 4.0)),
            _ => Self::butterworth(between(rng, 0.08, 0.3)),
        }
    }

    fn of(&self, given: &[f64]) -> Vec<f64> {
        let mut out: Vec<f64> = vec![];
        for i in 0..given.len() {
            let came = self.forward.iter().zip(given[..=i].iter().rev());
            let went = self.back.iter().zip(out.iter().rev());
            let sum = came.map(|(b, x)| b * x).sum::<f64>();
            out.push(sum - went.map(|(a, y)| a * y).sum::<f64>());
        }
        out
    }
}

#[test]
fn statistical_filters_of_any_kind_are_named_and_the_noise_before_them_is_told() {
    let mut rng = Rng::seed_from_u64(20_261_126);
    let (mut held, mut asked) = (0u64, 0u64);
    let options = DiagnoseOptions {
        replicates: 99,
        ..DiagnoseOptions::default()
    };
    let graded = draws::graded(RUNS, LEAST, |_| {
        let filtered = between(&mut rng, 0.0, 3.0) as usize;
        let sigma = between(&mut rng, 0.02, 0.5);
        let step = sigma * between(&mut rng, 0.05, 0.3);
        let rate_hz = [20.0, 50.0, 100.0][between(&mut rng, 0.0, 3.0) as usize];
        let filter = Filter::drawn(&mut rng);
        let record = white::gyros(rate_hz, |i| {
            let white: Vec<f64> = (0..BEFORE + SAMPLES)
                .map(|_| sigma * Distribution::<f64>::sample(&StandardNormal, &mut rng))
                .collect();
            let all = match i == filtered {
                true => filter.of(&white),
                false => white,
            };
            let values = all[BEFORE..].iter().map(|v| (v / step).round() * step);
            values.collect()
        });
        let made = diagnose(&record, &options).expect("a diagnosis");
        let (d, name) = (&made.diagnosis, record.channels[filtered].name.clone());
        let n = made.extended_model.channels.iter().find(|c| c.name == name);
        let n = &n.expect("the channel").baseline["angle_random_walk"];
        let truth = 60.0 * sigma / rate_hz.sqrt();
        asked += 1;
        let off = (n.value - truth) / n.std_error.expect("an error");
        held += u64::from(off.abs() < 1.96);
        let named: Vec<&str> = d.findings.iter().map(|f| f.cause.as_str()).collect();
        let looks_alike = d.replicates[&name].after.p_value > 0.01;
        let counted = filter.averages.is_none_or(|(readings, stages)| {
            let told = |p: &str| d.findings.first()?.parameters.get(p).map(|p| p.value);
            told("averaged") == Some(readings as f64) && told("stages") == Some(stages as f64)
        });
        let alone = named == ["low_pass"] && d.findings[0].channels == [name.clone()];
        match alone && looks_alike && counted {
            true => Ok(()),
            false => Err(format!(
                "{named:?} | {:?} of {:?} | {:?} | N off by {off:.1}",
                filter.averages,
                d.findings.first().map(|f| &f.parameters),
                d.unexplained
            )),
        }
    });
    eprintln!("noise before the filter within its 95 % interval: {held} of {asked}");
    assert!(graded.is_ok(), "{}", graded.unwrap_err());
    // Of 24 intervals of 95 %, fewer than 18 hold the truth less than once in a thousand; of 8 fewer than 4.
    assert!(held + 3 + asked / 8 >= asked, "{held} of {asked}");
}

/// Readings of 20 Hz: white noise, and an angle's error of standard deviation q differenced, normal or that of a rounding.
fn differenced(normal: bool, sigma: f64, q: f64, rng: &mut Rng) -> Vec<f64> {
    let half_step = 3f64.sqrt() * q;
    let rounding = Uniform::new_inclusive(-half_step, half_step).expect("a range");
    let error = |rng: &mut Rng| -> f64 {
        let z: f64 = StandardNormal.sample(rng);
        if normal { q * z } else { rounding.sample(rng) }
    };
    let mut before = error(rng);
    let mut read = || {
        let z: f64 = StandardNormal.sample(rng);
        let now = error(rng);
        let rate = sigma * z + (now - before) * 20.0;
        before = now;
        (rate / 0.005).round() * 0.005
    };
    (0..12_000).map(|_| read()).collect()
}

#[test]
fn statistical_the_law_of_an_angles_error_is_in_the_model() {
    let mut rng = Rng::seed_from_u64(0x61_6e67_6c65);
    let options = DiagnoseOptions {
        replicates: 99,
        ..DiagnoseOptions::default()
    };
    let graded = draws::graded(12, 10, |draw| {
        let normal = draw % 2 == 0;
        let sigma = between(&mut rng, 0.1, 0.3);
        // The larger part of the variance of the readings.
        let q = sigma / 20.0 * between(&mut rng, 1.0, 3.0);
        let record = white::gyros(20.0, |axis| match axis {
            0 => differenced(normal, sigma, q, &mut rng),
            _ => differenced(true, sigma, 0.0, &mut rng),
        });
        let d = diagnose(&record, &options).expect("a diagnosis").diagnosis;
        let found = d.findings.iter().find(|f| f.cause == "quantization_noise");
        let told = found.is_some_and(|f| f.parameters.contains_key("normal") == normal);
        let after = &d.replicates["gyro_x"].after;
        (told && after.p_value > 0.01)
            .then_some(())
            .ok_or_else(|| format!("normal {normal}, {sigma:.3}, {q:.5}: {found:?} {after:?}"))
    });
    assert!(graded.is_ok(), "{}", graded.unwrap_err());
}
