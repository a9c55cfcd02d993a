//! Two levels far apart, and noise that grows by much: a gyro of another board, drawn, and what is told of it, graded by rate.
//! The larger either is, the plainer it is; nothing that is asked before the search may lose it. `IMU_STAND_SEED` takes other draws.

mod draws;
mod white;

use diagnosis::result::{Diagnosis, Finding};
use diagnosis::{DiagnoseOptions, diagnose};
use rand_core::SeedableRng;
use rand_distr::{Distribution, Exp1, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

const SECONDS: f64 = 600.0;
const RUNS: u64 = 20;
/// An engine that is right in 9 of 10 draws fails this in 4 % of the seeds, one that is right in 6 of 10 passes it in 5 %.
const LEAST: u64 = 16;
/// Fewer switches are steps.
const LEAST_SWITCHES: usize = 6;

fn between(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    Uniform::new(low, high).map_or(low, |u| u.sample(rng))
}

fn log_between(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    between(rng, low.ln(), high.ln()).exp()
}

/// A sensor: white noise, rounding, a random walk or none.
#[derive(Debug)]
struct Sensor {
    rate_hz: f64,
    sigma: f64,
    lsb: f64,
    walk: f64,
}

impl Sensor {
    fn drawn(rng: &mut Xoshiro256PlusPlus) -> Self {
        let pick = |rng: &mut Xoshiro256PlusPlus, of: &[f64]| {
            of[between(rng, 0.0, of.len() as f64) as usize % of.len()]
        };
        let rate_hz = pick(rng, &[20.0, 50.0, 100.0, 200.0]);
        let sigma = between(rng, -4.5, -0.8).exp2();
        Self {
            rate_hz,
            sigma,
            lsb: sigma * pick(rng, &[0.0, 0.05, 0.3, 1.0]),
            walk: sigma * pick(rng, &[0.0, 0.0, 1e-3, 3e-3]),
        }
    }

    fn count(&self) -> usize {
        (SECONDS * self.rate_hz) as usize
    }

    /// Readings of a level, and of noise some times as large as its own.
    fn readings(
        &self,
        rng: &mut Xoshiro256PlusPlus,
        level: &dyn Fn(usize) -> f64,
        times: &dyn Fn(usize) -> f64,
    ) -> Vec<f64> {
        let mut walked = 0.0;
        let each = (0..self.count()).map(|i| {
            let (white, step): (f64, f64) =
                (StandardNormal.sample(rng), StandardNormal.sample(rng));
            walked += self.walk * step;
            let v = walked + level(i) + self.sigma * times(i) * white;
            match self.lsb {
                lsb if lsb > 0.0 => (v / lsb).round() * lsb,
                _ => v,
            }
        });
        each.collect()
    }

    /// Part by which a noise may be off that was read for so long: a fiftieth, and three and a half standard errors.
    fn doubt(&self, seconds: f64) -> f64 {
        0.02 + 3.5 / (2.0 * seconds * self.rate_hz).sqrt()
    }

    /// Density of noise some times as large as its own, with its rounding.
    fn density(&self, times: f64) -> f64 {
        let variance = (self.sigma * times).powi(2) + self.lsb * self.lsb / 12.0;
        (variance / self.rate_hz).sqrt() * 60.0
    }

    fn told(&self, readings: &[f64], rng: &mut Xoshiro256PlusPlus) -> Diagnosis {
        let record = white::gyros(self.rate_hz, |axis| match axis {
            0 => readings.to_vec(),
            _ => self.readings(rng, &|_| 0.0, &|_| 1.0),
        });
        diagnose(&record, &DiagnoseOptions::default())
            .expect("a diagnosis")
            .diagnosis
    }

    /// The only finding on the axis, where it is `cause` and nothing else is told of it, and the noise is what it is.
    fn only<'a>(&self, d: &'a Diagnosis, cause: &str) -> Result<&'a Finding, String> {
        let of_x = |channels: &[String]| channels.iter().any(|c| c == "gyro_x");
        let found: Vec<&Finding> = (d.findings.iter()).filter(|f| of_x(&f.channels)).collect();
        let causes: Vec<&str> = found.iter().map(|f| f.cause.as_str()).collect();
        let left: Vec<&String> = (d.unexplained.iter())
            .filter(|u| u.channel == "gyro_x")
            .map(|u| &u.what)
            .collect();
        match found.as_slice() {
            [only] if only.cause == cause && left.is_empty() => Ok(*only),
            _ => Err(format!("{causes:?}, {left:?}")),
        }
    }

    /// Whether the white noise told is `times` its own, by so many seconds of it.
    fn noise(&self, d: &Diagnosis, times: f64, seconds: f64) -> Result<(), String> {
        let density = &d.extended["gyro_x"]["angle_random_walk"];
        let ratio = density.value / self.density(times);
        if (ratio - 1.0).abs() > self.doubt(seconds) {
            return Err(format!("the noise is {ratio:.3} times what it is"));
        }
        Ok(())
    }
}

fn level_draw(rng: &mut Xoshiro256PlusPlus) -> Result<(), String> {
    let sensor = Sensor::drawn(rng);
    let size = log_between(rng, 12.0, 300.0);
    let dwell = log_between(rng, 2.0, 60.0);
    let half = 0.5 * size * sensor.sigma;
    // When it switches, samples.
    let switches = loop {
        let mut at = 0.0;
        let waits = std::iter::from_fn(|| {
            at += dwell * sensor.rate_hz * Distribution::<f64>::sample(&Exp1, rng);
            (at < sensor.count() as f64).then_some(at)
        });
        let all: Vec<f64> = waits.collect();
        if all.len() >= LEAST_SWITCHES {
            break all;
        }
    };
    let upper = |i: usize| {
        switches
            .partition_point(|s| *s <= i as f64)
            .is_multiple_of(2)
    };
    let level = |i: usize| if upper(i) { half } else { -half };
    let y = sensor.readings(rng, &level, &|_| 1.0);
    let d = sensor.told(&y, rng);
    let seen = SECONDS / switches.len() as f64;
    let about = format!(
        "{size:.0} sigma, {} switches, {seen:.2} s; {sensor:?}",
        switches.len()
    );
    let judged = || -> Result<(), String> {
        let f = sensor.only(&d, "telegraph")?;
        let (h, t) = (&f.parameters["half_height"], &f.parameters["dwell_time"]);
        let off = (t.value / seen).ln() * (switches.len() as f64).sqrt();
        let told = format!("half height {} times, dwell {}", h.value / half, t.value);
        if (h.value / half - 1.0).abs() > 0.02 || off.abs() > 2.0 {
            return Err(told);
        }
        sensor.noise(&d, 1.0, SECONDS)
    };
    let judged = judged().map_err(|e| format!("{e}; {about}"));
    eprintln!("{judged:?} {about}");
    judged
}

fn noise_draw(rng: &mut Xoshiro256PlusPlus) -> Result<(), String> {
    let sensor = Sensor::drawn(rng);
    let factor = log_between(rng, 4.0, 50.0);
    let start = SECONDS * between(rng, 0.1, 0.8);
    let end = match between(rng, 0.0, 1.0) < 0.5 {
        true => SECONDS,
        false => between(rng, start + 0.05 * SECONDS, 0.98 * SECONDS),
    };
    let at = |i: usize| i as f64 / sensor.rate_hz;
    let loud = |i: usize| {
        if (start..end).contains(&at(i)) {
            factor
        } else {
            1.0
        }
    };
    let y = sensor.readings(rng, &|_| 0.0, &loud);
    let d = sensor.told(&y, rng);
    let about = format!("times {factor:.1} from {start:.2} to {end:.2} s; {sensor:?}");
    let judged = || -> Result<(), String> {
        let f = sensor.only(&d, "noise_change")?;
        let of = |name: &str| f.parameters[name].value;
        let ratio = (1.0 + of("variance_increase")).sqrt();
        let near = |a: f64, b: f64| (a - b).abs() < 5.0 / sensor.rate_hz;
        // Of a record that ends loud, either part is a stretch.
        let (as_loud, as_quiet) = (
            near(of("start"), start) && near(of("end"), end),
            near(of("start"), 0.0) && near(of("end"), start) && end == SECONDS,
        );
        let (long, rest) = (end - start, SECONDS - (end - start));
        let doubt = sensor.doubt(long.min(rest));
        let truth = sensor.density(factor) / sensor.density(1.0);
        let (truth, outside) = if as_quiet {
            (truth.recip(), (factor, long))
        } else {
            (truth, (1.0, rest))
        };
        if !(as_loud || as_quiet) || (ratio / truth - 1.0).abs() > doubt {
            let told = format!("{ratio} times from {} to {}", of("start"), of("end"));
            return Err(told);
        }
        sensor.noise(&d, outside.0, outside.1)
    };
    let judged = judged().map_err(|e| format!("{e}; {about}"));
    eprintln!("{judged:?} {about}");
    judged
}

fn graded(of: u64, draw: impl Fn(&mut Xoshiro256PlusPlus) -> Result<(), String>) {
    let seed = draws::seed(20_261_128);
    let told = draws::graded(RUNS, LEAST, |i| {
        // Of its own, whatever a diagnosis asks for.
        let own = seed.wrapping_mul(1000) + 100 * of + i;
        draw(&mut Xoshiro256PlusPlus::seed_from_u64(own))
    });
    assert!(told.is_ok(), "seed {seed}: {}", told.unwrap_err());
}

#[test]
fn two_levels_far_apart_are_telegraph_noise_alone_with_their_height_and_dwell_time() {
    graded(1, level_draw);
}

#[test]
fn noise_that_grows_by_much_is_a_noise_change_alone_with_its_size_and_its_ends() {
    graded(2, noise_draw);
}
