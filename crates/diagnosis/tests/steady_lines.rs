//! Several steady lines on one axis: those of separate machines are as many causes, each with its size; those that one motion makes
//! have no name, and the answer lists them.

#[path = "draws/mod.rs"]
mod draws;
#[path = "white/mod.rs"]
mod white;

use std::f64::consts::TAU;

use diagnosis::DiagnoseOptions;
use diagnosis::result::Diagnosis;
use model::effect::Parameters;
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

/// White noise of the gyro, deg/s.
const SIGMA: f64 = 0.2;
/// Standard errors that an estimate may lie off: 1 in 1000 by chance.
const FAR: f64 = 3.3;

fn between(low: f64, high: f64, rng: &mut Xoshiro256PlusPlus) -> f64 {
    Uniform::new(low, high).expect("a range").sample(rng)
}

fn by_ratio(low: f64, high: f64, rng: &mut Xoshiro256PlusPlus) -> f64 {
    between(low.ln(), high.ln(), rng).exp()
}

/// A line: Hz, deg/s, phase in rad.
struct Line {
    hz: f64,
    amplitude: f64,
    phase: f64,
}

impl Line {
    fn at(&self, t: f64) -> f64 {
        self.amplitude * (TAU * self.hz * t + self.phase).cos()
    }

    /// Whether these parameters are its own.
    fn is(&self, p: &Parameters) -> bool {
        let near = |name: &str, truth: f64| {
            let found = &p[name];
            (found.value - truth).abs() < FAR * found.std_error.expect("an error")
        };
        near("frequency", self.hz) && near("amplitude", self.amplitude)
    }
}

/// What is told of minutes of a gyro of any rate: white noise, and what `signal` adds at a time, s.
fn told(
    (rate_hz, seconds): (f64, f64),
    signal: impl Fn(f64) -> f64,
    rng: &mut Xoshiro256PlusPlus,
) -> Diagnosis {
    let mut record = white::gyros(rate_hz, |_| {
        let count = (seconds * rate_hz) as usize;
        let of = |i: usize| {
            let white: f64 = StandardNormal.sample(rng);
            SIGMA * white + signal(i as f64 / rate_hz)
        };
        (0..count).map(of).collect()
    });
    record.channels.truncate(1);
    let options = DiagnoseOptions {
        no_evidence: true,
        ..DiagnoseOptions::default()
    };
    let all = diagnosis::diagnose(&record, &options).expect("a diagnosis");
    all.diagnosis
}

fn said(d: &Diagnosis) -> String {
    let found: Vec<&str> = d.findings.iter().map(|f| f.what.as_str()).collect();
    let left: Vec<&str> = d.unexplained.iter().map(|u| u.what.as_str()).collect();
    format!("{found:?} | {left:?}")
}

/// Rate and length of a record.
fn drawn(rng: &mut Xoshiro256PlusPlus) -> (f64, f64) {
    (by_ratio(20.0, 100.0, rng), between(120.0, 400.0, rng))
}

/// Seed of a draw.
fn rng_of(seed: u64, draw: u64) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_mul(1000) + draw)
}

#[test]
fn each_of_several_separate_lines_is_named_with_its_size() {
    let seed = draws::seed(20_261_131);
    let right = draws::graded(20, 18, |draw| {
        let rng = &mut rng_of(seed, draw);
        let (rate_hz, seconds) = drawn(rng);
        let count = between(3.0, 7.0, rng) as usize;
        let mut lines: Vec<Line> = vec![];
        while lines.len() < count {
            let hz = between(0.03, 0.48, rng) * rate_hz;
            // A ratio of the likelihoods of 150 and more: beyond doubt.
            let least = (300.0 / (rate_hz * seconds)).sqrt().max(0.1);
            let line = Line {
                hz,
                amplitude: SIGMA * by_ratio(least, 3.0, rng),
                phase: between(0.0, TAU, rng),
            };
            if lines.iter().all(|l| (l.hz - hz).abs() > 0.01 * rate_hz) {
                lines.push(line);
            }
        }
        let d = told(
            (rate_hz, seconds),
            |t| lines.iter().map(|l| l.at(t)).sum(),
            rng,
        );
        let named = |l: &Line| {
            d.findings
                .iter()
                .any(|f| f.cause == "line" && l.is(&f.parameters))
        };
        let all = lines.iter().all(named) && d.findings.len() == count && d.unexplained.is_empty();
        all.then_some(())
            .ok_or_else(|| format!("{count} at {rate_hz:.0} Hz: {}", said(&d)))
    });
    assert!(right.is_ok(), "seed {seed}: {}", right.unwrap_err());
}

#[test]
fn the_harmonics_of_one_motion_are_listed_with_their_sizes() {
    let seed = draws::seed(20_261_132);
    let right = draws::graded(20, 18, |draw| {
        let rng = &mut rng_of(seed, draw);
        let (rate_hz, seconds) = drawn(rng);
        let hz = between(0.03, 0.15, rng) * rate_hz;
        let harmonic = |k: u32| Line {
            hz: hz * f64::from(k),
            amplitude: SIGMA * by_ratio(0.3, 3.0, rng),
            phase: between(0.0, TAU, rng),
        };
        let lines: Vec<Line> = (1..=3).map(harmonic).collect();
        let d = told(
            (rate_hz, seconds),
            |t| lines.iter().map(|l| l.at(t)).sum(),
            rng,
        );
        let [left] = &d.unexplained[..] else {
            return Err(said(&d));
        };
        let listed = lines.iter().all(|l| left.lines.iter().any(|p| l.is(p)));
        (listed && left.lines.len() == 3 && d.findings.is_empty())
            .then_some(())
            .ok_or_else(|| said(&d))
    });
    assert!(right.is_ok(), "seed {seed}: {}", right.unwrap_err());
}

#[test]
fn side_bands_of_a_pitch_that_sways_are_no_lines_of_their_own() {
    let seed = draws::seed(20_261_133);
    let right = draws::graded(12, 11, |draw| {
        let rng = &mut rng_of(seed, draw);
        let (rate_hz, seconds) = drawn(rng);
        let (hz, sway) = (between(0.1, 0.4, rng) * rate_hz, between(0.2, 1.0, rng));
        let (turns, size) = (between(0.5, 2.0, rng), SIGMA * between(0.3, 2.0, rng));
        let tone = |t: f64| size * (TAU * hz * t + turns * (TAU * sway * t).sin()).cos();
        let d = told((rate_hz, seconds), tone, rng);
        let wrong = d.findings.iter().any(|f| f.cause == "line");
        (!wrong && !d.unexplained.is_empty())
            .then_some(())
            .ok_or_else(|| format!("{hz:.2} Hz, {sway:.2} Hz, {turns:.2}: {}", said(&d)))
    });
    assert!(right.is_ok(), "seed {seed}: {}", right.unwrap_err());
}

/// Single readings that lie farther from the rest than the noise, and no farther than a line swings.
#[test]
fn single_far_readings_beside_strong_lines_are_counted() {
    let seed = draws::seed(20_261_134);
    let right = draws::graded(20, 18, |draw| {
        let rng = &mut rng_of(seed, draw);
        let (rate_hz, seconds) = drawn(rng);
        let line = |_| Line {
            hz: between(0.05, 0.45, rng) * rate_hz,
            amplitude: SIGMA * by_ratio(0.5, 6.0, rng),
            phase: between(0.0, TAU, rng),
        };
        let lines: Vec<Line> = (0..2).map(line).collect();
        let (count, far) = (between(6.0, 30.0, rng).floor(), between(10.0, 30.0, rng));
        let every = (rate_hz * seconds / count) as usize;
        let first = between(0.0, every as f64, rng) as usize;
        let signal = |t: f64| {
            let at = (t * rate_hz).round() as usize + first;
            let wild = match at % every {
                0 if (at / every).is_multiple_of(2) => far * SIGMA,
                0 => -far * SIGMA,
                _ => 0.0,
            };
            wild + lines.iter().map(|l| l.at(t)).sum::<f64>()
        };
        let d = told((rate_hz, seconds), signal, rng);
        let planted =
            (0..(rate_hz * seconds) as usize).filter(|i| (i + first).is_multiple_of(every));
        let planted = planted.count() as f64;
        let counted = |name: &str| {
            let all = d.findings.iter().filter(|f| f.cause == name);
            all.map(|f| f.parameters.get("count").map_or(1.0, |p| p.value))
                .sum::<f64>()
        };
        let all = (counted("outliers") - planted).abs() <= 1.0 && counted("line") == 2.0;
        all.then_some(()).ok_or_else(|| {
            format!(
                "{planted} of {far:.0} sigma at {rate_hz:.0} Hz: {}",
                said(&d)
            )
        })
    });
    assert!(right.is_ok(), "seed {seed}: {}", right.unwrap_err());
}
