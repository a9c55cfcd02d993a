//! A gyro whose bias is behind the thermometer by a thermal time constant, or ahead of one that is itself behind: one entry with
//! its slope and its lag, graded by rate over draws. `IMU_STAND_SEED` takes other draws.

mod draws;
mod white;

use diagnosis::result::{Diagnosis, Parameter};
use diagnosis::{DiagnoseOptions, diagnose};
use model::record::{Channel, Quantity, Record};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

const RUNS: u64 = 24;
/// A share of 0.89 (64 of 72 draws of three other seeds) misses this in 2 %.
const LEAST: u64 = 18;
const ROWS: usize = 24_000;
/// Root of twice the likelihood ratio in white noise: of the whole response, and the least of what the lag changes of it.
const STRENGTHS: (f64, f64) = (40.0, 250.0);
const LEAST_OF_LAG: f64 = 12.0;
/// Shortest lag, s, and the part of the record that the longest is.
const SHORTEST_S: f64 = 3.0;
const LONGEST: f64 = 0.08;
/// Standard errors within which a figure has to be.
const ERRORS: f64 = 3.0;
/// Steps of the thermometer, degC, and its noise over them.
const STEPS: [f64; 4] = [0.125, 0.0625, 0.03125, 0.01];
const NOISES: [f64; 3] = [0.0, 0.4, 1.0];

fn between(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    Uniform::new(low, high).map_or(low, |u| u.sample(rng))
}

fn by_ratio(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    between(rng, low.ln(), high.ln()).exp()
}

fn pick<T: Copy>(rng: &mut Xoshiro256PlusPlus, of: &[T]) -> T {
    of[between(rng, 0.0, of.len() as f64) as usize % of.len()]
}

fn normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
    StandardNormal.sample(rng)
}

/// Values behind a filter of one time constant, in samples, which is settled at the first of them.
fn behind(values: &[f64], samples: f64) -> Vec<f64> {
    let gain = 1.0 - (-1.0 / samples).exp();
    let mut held = values[0];
    let each = values.iter().map(|v| {
        held += gain * (v - held);
        held
    });
    each.collect()
}

fn about_mean(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|v| v - mean).collect()
}

fn size(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Course {
    Oven,
    Day,
    Steps,
    Wander,
}

const COURSES: [Course; 4] = [Course::Oven, Course::Day, Course::Steps, Course::Wander];

impl Course {
    /// A temperature about 0 that swings by 1 or so.
    fn drawn(self, rng: &mut Xoshiro256PlusPlus, rate_hz: f64) -> Vec<f64> {
        let seconds = ROWS as f64 / rate_hz;
        let phase = between(rng, 0.0, 1.0);
        let shape: Vec<f64> = match self {
            Self::Oven => {
                let (cycles, duty) = (between(rng, 1.5, 5.0), between(rng, 0.3, 0.7));
                let on = |i: usize| {
                    f64::from(u8::from(
                        (cycles * i as f64 / ROWS as f64 + phase).fract() < duty,
                    ))
                };
                let plate = between(rng, 0.05, 0.25) * seconds / cycles;
                behind(&(0..ROWS).map(on).collect::<Vec<_>>(), plate * rate_hz)
            }
            Self::Day => {
                let cycles = between(rng, 1.0, 4.0);
                let angle = |i: usize| cycles * i as f64 / ROWS as f64 + phase;
                (0..ROWS)
                    .map(|i| 0.5 * (std::f64::consts::TAU * angle(i)).sin())
                    .collect()
            }
            Self::Steps => {
                let mut level = 0.0;
                let often = between(rng, 4.0, 10.0) / ROWS as f64;
                let each = (0..ROWS).map(|_| {
                    if between(rng, 0.0, 1.0) < often {
                        level = between(rng, -0.5, 0.5);
                    }
                    level
                });
                let all: Vec<f64> = each.collect();
                behind(&all, between(rng, 3.0, 12.0) * rate_hz)
            }
            Self::Wander => {
                let mut level = 0.0;
                let each = (0..ROWS).map(|_| {
                    level += normal(rng) / (ROWS as f64).sqrt();
                    level
                });
                let all: Vec<f64> = each.collect();
                behind(&all, between(rng, 3.0, 15.0) * rate_hz)
            }
        };
        about_mean(&shape)
    }
}

/// A bias that follows a temperature, late or early.
#[derive(Debug)]
#[expect(dead_code, reason = "a draw that fails tells all that it was")]
struct Lagging {
    rate_hz: f64,
    sigma: f64,
    walk: f64,
    course: Course,
    swing: f64,
    step: f64,
    noise: f64,
    axis: usize,
    slope: f64,
    /// Below 0 the thermometer is behind.
    lag: f64,
    of_lag: f64,
}

struct Draw {
    of: Lagging,
    felt: Vec<f64>,
    read: Vec<f64>,
}

impl Draw {
    /// One that shows its lag.
    fn drawn(rng: &mut Xoshiro256PlusPlus) -> Self {
        loop {
            let one = Self::any(rng);
            if one.of.of_lag > LEAST_OF_LAG {
                return one;
            }
        }
    }

    fn any(rng: &mut Xoshiro256PlusPlus) -> Self {
        let rate_hz = pick(rng, &[20.0, 40.0]);
        let seconds = ROWS as f64 / rate_hz;
        let course = pick(rng, &COURSES);
        let swing = between(rng, 3.0, 15.0);
        let there = course.drawn(rng, rate_hz);
        let there: Vec<f64> = there.iter().map(|t| swing * t).collect();
        let time = by_ratio(rng, SHORTEST_S, LONGEST * seconds);
        let late = behind(&there, time * rate_hz);
        let is_late = between(rng, 0.0, 1.0) < 0.5;
        let (felt, read) = if is_late {
            (late, there)
        } else {
            (there, late)
        };
        let (step, noise) = (pick(rng, &STEPS), pick(rng, &NOISES));
        let rounded = |t: &f64| 25.0 + ((t + noise * step * normal(rng)) / step).round() * step;
        let read: Vec<f64> = read.iter().map(rounded).collect();
        let sigma = between(rng, -4.0, -1.0).exp2();
        let felt = about_mean(&felt);
        let strength = by_ratio(rng, STRENGTHS.0, STRENGTHS.1);
        let seen = about_mean(&read);
        let along: f64 = felt.iter().zip(&seen).map(|(f, s)| f * s).sum();
        let likeness = along / (size(&felt) * size(&seen));
        let of = Lagging {
            rate_hz,
            sigma,
            walk: sigma * pick(rng, &[0.0, 0.0, 1e-4, 3e-4]),
            course,
            swing,
            step,
            noise,
            axis: pick(rng, &[0, 1, 2]),
            slope: pick(rng, &[-1.0, 1.0]) * strength * sigma / size(&felt),
            lag: if is_late { time } else { -time },
            of_lag: strength * (1.0 - likeness * likeness).max(0.0).sqrt(),
        };
        Self { of, felt, read }
    }

    fn record(&self, rng: &mut Xoshiro256PlusPlus) -> Record {
        let of = &self.of;
        let mut record = white::gyros(of.rate_hz, |axis| {
            let mut level = 0.0;
            let readings = self.felt.iter().map(|t| {
                level += of.walk * normal(rng);
                let follows = if axis == of.axis { of.slope * t } else { 0.0 };
                level + of.sigma * normal(rng) + follows
            });
            readings.collect()
        });
        record.channels.push(Channel {
            name: "temp".into(),
            quantity: Quantity::Temp,
            axis: None,
            unit: "degC".into(),
            lsb: None,
            counts: None,
            values: self.read.clone(),
        });
        record
    }
}

impl Lagging {
    fn wrong(&self, d: &Diagnosis) -> Result<(), String> {
        let told = |f: &diagnosis::result::Finding| {
            format!("{} on {:?} {:?}", f.cause, f.channels, f.parameters)
        };
        let names: Vec<String> = d.findings.iter().map(told).collect();
        let own = ["gyro_x", "gyro_y", "gyro_z"][self.axis];
        let [found] = d.findings.as_slice() else {
            return Err(format!("{names:?}, {:?} of {self:?}", d.unexplained));
        };
        if found.cause != "temperature" || found.channels != [own] || !d.unexplained.is_empty() {
            return Err(format!("{names:?}, {:?} of {self:?}", d.unexplained));
        }
        let off = |p: &Parameter, truth: f64| {
            (p.value - truth).abs() > ERRORS * p.std_error.unwrap_or(0.0)
        };
        let lag = found.parameters.get("lag");
        if off(&found.parameters["slope"], self.slope) || lag.is_none_or(|l| off(l, self.lag)) {
            return Err(format!("{names:?} of {self:?}"));
        }
        Ok(())
    }
}

#[test]
fn a_bias_behind_or_ahead_of_its_thermometer_is_one_entry_with_its_slope_and_its_lag() {
    let seed = draws::seed(20_261_129);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let told = draws::graded(RUNS, LEAST, |_| {
        let drawn = Draw::drawn(&mut rng);
        let record = drawn.record(&mut rng);
        let told = diagnose(&record, &DiagnoseOptions::default());
        drawn.of.wrong(&told.expect("a diagnosis").diagnosis)
    });
    assert!(told.is_ok(), "seed {seed}: {}", told.unwrap_err());
}
