//! Logs that were put on even times by a curve between their readings: what is told of them, graded by rate. The readings that
//! came are white noise with a random walk, evenly at another rate, drawn. `IMU_STAND_SEED` takes other draws.

mod draws;
mod white;

use diagnosis::result::Diagnosis;
use diagnosis::{DiagnoseOptions, diagnose};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

const RUNS: u64 = 24;
/// A share of 0.92 misses this in 4 %.
const LEAST: u64 = 20;
/// Fewest readings that came for one that was written. With fewer the noise is so far from a linear process that steps or a warm-up of some
/// readings were told beside the entry, in seven logs of seeds 1, 2 and 20261128, which is why they are not asked here.
const FEWEST_CAME: f64 = 0.45;
/// Readings of a record.
const ROWS: usize = 20_000;
/// About two readings for one that is written, where their neighbours have nothing in common, rates as far above as below look alike.
const AMBIGUOUS: f64 = 0.45;
/// How near a rate has to be to the one that is told, relative.
const NEAR: f64 = 0.01;

fn between(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    Uniform::new(low, high).map_or(low, |u| u.sample(rng))
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Curve {
    Lines,
    /// A cubic through two readings with the slopes that their neighbours give.
    Cubic,
}

impl Curve {
    /// The value at a part of the way from the second to the third of four readings.
    fn at(self, y: [f64; 4], part: f64) -> f64 {
        let [a, b, c, d] = y;
        match self {
            Self::Lines => b + part * (c - b),
            Self::Cubic => {
                let (first, second) = (0.5 * (c - a), 0.5 * (d - b));
                let bent = 2.0 * (b - c) + first + second;
                let curved = 3.0 * (c - b) - 2.0 * first - second;
                ((bent * part + curved) * part + first) * part + b
            }
        }
    }
}

#[derive(Debug)]
struct Log {
    rate_hz: f64,
    /// Readings that came in the time of one that was written.
    came: f64,
    sigma: f64,
    /// Step of the readings that came.
    lsb: f64,
    curve: Curve,
}

impl Log {
    fn drawn(rng: &mut Xoshiro256PlusPlus) -> Self {
        let pick = |rng: &mut Xoshiro256PlusPlus, of: &[f64]| {
            of[between(rng, 0.0, of.len() as f64) as usize % of.len()]
        };
        let sigma = between(rng, -2.5, -0.8).exp2();
        // At a whole or a half number nothing beats: such a log is one of fewer readings, or of every second.
        let came = loop {
            let came = between(rng, FEWEST_CAME.ln(), 2.4f64.ln()).exp();
            if (2.0 * came - (2.0 * came).round()).abs() > 0.04 {
                break came;
            }
        };
        Self {
            rate_hz: pick(rng, &[20.0, 50.0, 100.0, 200.0]),
            came,
            sigma,
            lsb: sigma * pick(rng, &[0.0, 0.05, 0.3, 1.0]),
            curve: if between(rng, 0.0, 1.0) < 0.5 {
                Curve::Lines
            } else {
                Curve::Cubic
            },
        }
    }

    fn readings(&self, rng: &mut Xoshiro256PlusPlus, start: f64) -> Vec<f64> {
        let mut level = 0.0;
        let count = (ROWS as f64 * self.came) as usize + 8;
        let came = (0..count).map(|_| {
            let mut own = || -> f64 { StandardNormal.sample(rng) };
            level += 1e-3 * self.sigma * own();
            let v = level + self.sigma * own();
            if self.lsb > 0.0 {
                (v / self.lsb).round() * self.lsb
            } else {
                v
            }
        });
        let came: Vec<f64> = came.collect();
        let written = (0..ROWS).map(|i| {
            let at = 1.0 + start + i as f64 * self.came;
            let k = at as usize;
            let four = [came[k - 1], came[k], came[k + 1], came[k + 2]];
            self.curve.at(four, at - k as f64)
        });
        written.collect()
    }
}

fn told(log: &Log, rng: &mut Xoshiro256PlusPlus) -> Diagnosis {
    let start = between(rng, 0.0, 1.0);
    let record = white::gyros(log.rate_hz, |_| log.readings(rng, start));
    diagnose(&record, &DiagnoseOptions::default())
        .expect("a diagnosis")
        .diagnosis
}

/// Rates that a sentence names, Hz.
fn rates(what: &str) -> Vec<f64> {
    let Some((_, after)) = what.split_once("evenly at ") else {
        return vec![];
    };
    let (list, _) = after.split_once(" Hz").unwrap_or((after, ""));
    list.split(" or ").filter_map(|r| r.parse().ok()).collect()
}

/// What is wrong with an answer.
fn wrong(log: &Log, d: &Diagnosis) -> Result<(), String> {
    let (of, all): (Vec<_>, Vec<_>) = d
        .unexplained
        .iter()
        .partition(|u| u.checks.iter().any(|c| c == "resampled"));
    let names: Vec<&str> = d.findings.iter().map(|f| f.cause.as_str()).collect();
    let others: Vec<&str> = all.iter().map(|u| u.what.as_str()).collect();
    let [entry] = of.as_slice() else {
        return Err(format!(
            "{} entries; {names:?} {others:?} of {log:?}",
            of.len()
        ));
    };
    let rates = rates(&entry.what);
    let true_hz = log.came * log.rate_hz;
    if !names.is_empty() || !others.is_empty() {
        return Err(format!("{names:?} {others:?} beside it, of {log:?}"));
    }
    let near = rates.iter().any(|r| (r / true_hz - 1.0).abs() < NEAR);
    if !near
        || rates.len()
            > if (log.came - 2.0).abs() < AMBIGUOUS {
                2
            } else {
                1
            }
    {
        return Err(format!("{rates:?} Hz told, {true_hz} true, of {log:?}"));
    }
    Ok(())
}

#[test]
fn a_log_that_was_put_on_even_times_is_one_entry_with_the_rate_at_which_its_readings_came() {
    let seed = draws::seed(20_261_128);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let told = draws::graded(RUNS, LEAST, |_| {
        let log = Log::drawn(&mut rng);
        let d = told(&log, &mut rng);
        wrong(&log, &d)
    });
    assert!(told.is_ok(), "seed {seed}: {}", told.unwrap_err());
}
