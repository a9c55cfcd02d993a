//! High-pass filters of sensors and loggers, hidden at random: named, sized, and what is behind them is told.

mod draws;
mod white;

use std::f64::consts::TAU;

use diagnosis::{DiagnoseOptions, diagnose};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

type Rng = Xoshiro256PlusPlus;

const RUNS: u64 = 24;
/// Of filters that are strong, 98 % are to be named alone: fewer of [`RUNS`] than this come once in a thousand.
const LEAST: u64 = 21;
const SAMPLES: usize = 12_000;
/// Coefficients of the transform below the corner: the fewest of which enough are missing.
const BELOW: f64 = 30.0;

fn between(rng: &mut Rng, low: f64, high: f64) -> f64 {
    Uniform::new(low, high).expect("a range").sample(rng)
}

/// What goes through, as loggers write it.
#[derive(Clone, Copy, Debug)]
enum Logger {
    /// The recursion of a resistor and a capacitor, from the first reading on or at rest with it.
    Capacitor { settled: bool },
    /// Each reading less a running mean that forgets exponentially.
    RunningMean,
}

impl Logger {
    fn drawn(rng: &mut Rng) -> Self {
        match between(rng, 0.0, 3.0) as usize {
            0 => Self::Capacitor { settled: false },
            1 => Self::Capacitor { settled: true },
            _ => Self::RunningMean,
        }
    }

    fn writes(self, given: &[f64], pole: f64) -> Vec<f64> {
        let (mut before, mut out, mut mean) = (given[0], 0.0, 0.0);
        let each = given.iter().enumerate().map(|(i, x)| match self {
            Self::Capacitor { settled } => {
                out = if i == 0 && !settled {
                    *x
                } else {
                    pole * (out + x - before)
                };
                before = *x;
                out
            }
            Self::RunningMean => {
                mean = pole * mean + (1.0 - pole) * x;
                x - mean
            }
        });
        each.collect()
    }
}

/// What is hidden on one axis before the filter.
#[derive(Clone, Copy, Debug)]
enum Beside {
    Nothing,
    Step,
    Line,
}

#[test]
fn statistical_a_high_pass_filter_is_named_with_its_corner_and_what_is_before_it() {
    let mut rng = Rng::seed_from_u64(20_261_127);
    let (mut covered, mut asked) = (0u64, 0u64);
    let options = DiagnoseOptions {
        replicates: 99,
        ..DiagnoseOptions::default()
    };
    let graded = draws::graded(RUNS, LEAST, |_| {
        let rate_hz = [20.0, 50.0, 100.0, 200.0][between(&mut rng, 0.0, 4.0) as usize];
        let (low, high) = (BELOW / SAMPLES as f64 * 0.5, 0.04);
        let corner = rate_hz * low * (high / low).powf(between(&mut rng, 0.0, 1.0));
        let pole = (-TAU * corner / rate_hz).exp();
        let logger = Logger::drawn(&mut rng);
        let beside =
            [Beside::Nothing, Beside::Step, Beside::Line][between(&mut rng, 0.0, 3.0) as usize];
        let axis = between(&mut rng, 0.0, 3.0) as usize;
        // One converter for all axes.
        let step = between(&mut rng, 0.001, 0.01);
        let record = white::gyros(rate_hz, |i| {
            let sigma = between(&mut rng, 0.02, 0.15);
            // A walk as gyros have it, deg/s/sqrt(s), which leaves the filter something to take.
            let most = 0.3 * TAU * corner * sigma / rate_hz.sqrt();
            let walk = between(&mut rng, 0.0, 0.005).min(most) / rate_hz.sqrt();
            let mut level = between(&mut rng, -1.0, 1.0);
            let at = between(&mut rng, 0.3, 0.8) * SAMPLES as f64;
            // Twelve times its error behind the filter; what is larger may be a turn of the base.
            let jump = (12.0 * sigma * (2.0 * (1.0 - pole)).sqrt()).min(0.5);
            let omega = between(&mut rng, 0.5, 2.5);
            let line = sigma * 12.0 * (2.0 / SAMPLES as f64).sqrt();
            let given: Vec<f64> = (0..SAMPLES)
                .map(|k| {
                    let [w, z] =
                        [(); 2].map(|()| Distribution::<f64>::sample(&StandardNormal, &mut rng));
                    level += walk * w;
                    let more = match beside {
                        _ if i != axis => 0.0,
                        Beside::Nothing => 0.0,
                        Beside::Step => jump * f64::from(u8::from(k as f64 > at)),
                        Beside::Line => line * (omega * k as f64).sin(),
                    };
                    level + sigma * z + more
                })
                .collect();
            let written = logger.writes(&given, pole).into_iter();
            written.map(|v| (v / step).round() * step).collect()
        });
        let d = diagnose(&record, &options).expect("a diagnosis").diagnosis;
        let named: Vec<String> = (d.findings.iter())
            .map(|f| format!("{} {}", f.cause, f.channels.concat()))
            .collect();
        let mut wanted = vec!["high_pass gyro_xgyro_ygyro_z".to_owned()];
        wanted.extend(match beside {
            Beside::Nothing => None,
            Beside::Step => Some(format!("bias_step gyro_{}", ["x", "y", "z"][axis])),
            Beside::Line => Some(format!("line gyro_{}", ["x", "y", "z"][axis])),
        });
        let said = || {
            (d.unexplained.iter().map(|u| &u.what))
                .chain(d.findings.iter().map(|f| &f.what))
                .collect::<Vec<_>>()
        };
        let mut sorted = named.clone();
        sorted.sort();
        wanted.sort();
        asked += 1;
        let told = d.findings.iter().find(|f| f.cause == "high_pass");
        let told = told.and_then(|f| f.parameters.get("corner_frequency"));
        let off = told.map(|p| (p.value - corner) / p.std_error.expect("an error"));
        covered += u64::from(off.is_some_and(|o| o.abs() < 1.96));
        let alike = d.replicates.values().all(|r| r.after.p_value > 0.003);
        let missed = d.replicates.values().any(|r| r.before.p_value <= 0.05);
        match sorted == wanted && alike && missed {
            true => Ok(()),
            false => Err(format!(
                "{named:?} | {alike} {missed} | {corner:.4} Hz of {rate_hz}, off by {off:.1?} | {logger:?} {beside:?} {axis} | {:?}",
                said()
            )),
        }
    });
    eprintln!("corner within its 95 % interval: {covered} of {asked}");
    assert!(graded.is_ok(), "{}", graded.unwrap_err());
    // Of 24 intervals of 95 %, fewer than 18 hold the truth less than once in a thousand; of 8 fewer than 4.
    assert!(covered + 3 + asked / 8 >= asked, "{covered} of {asked}");
}
