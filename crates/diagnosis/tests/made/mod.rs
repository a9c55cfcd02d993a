//! Records made of counts, frames and times, and what an audit says of them. Seeds are fixed; `IMU_STAND_SEED` takes another.

use diagnosis::audit::Audit;
use model::record::{Axis, Channel, Header, Quantity, Record};
use rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, Exp, Normal, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Step of the readings, deg/s.
const LSB: f64 = 0.07326;
/// Tick of the board, s.
pub const TICK_S: f64 = 4e-6;

/// A generator of its own for each test.
pub fn rng(offset: u64) -> Xoshiro256PlusPlus {
    let seed = std::env::var("IMU_STAND_SEED")
        .ok()
        .and_then(|s| s.parse().ok())
        .unwrap_or(2009u64);
    println!("seed {seed}");
    Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_mul(1000) + offset)
}

/// What is not the noise of the paper.
#[derive(Clone, Copy)]
pub struct World {
    /// Noise in counts.
    pub sigma: f64,
    /// Sway of the base, counts, and its frequency, Hz.
    pub sway: (f64, f64),
    /// Line, counts.
    pub line: f64,
    /// Walk per sample, counts.
    pub walk: f64,
    /// Drift over the run, counts.
    pub drift: f64,
    pub samples: usize,
}

/// The noise of the paper.
pub const PLAIN: World = World {
    sigma: 5.4,
    sway: (0.0, 0.1),
    line: 0.0,
    walk: 0.01,
    drift: 0.0,
    samples: 12_000,
};

impl World {
    /// White noise of so many counts, and nothing else.
    pub fn white(sigma: f64) -> Self {
        Self {
            sigma,
            walk: 0.0,
            ..PLAIN
        }
    }
}

/// A record of three gyros at 20 Hz.
pub fn record(world: World, rng: &mut Xoshiro256PlusPlus) -> Record {
    let n = world.samples;
    let channels = Axis::ALL
        .iter()
        .map(|axis| {
            let mut level = f64::from(rng.next_u32() % 1000) / 37.0;
            let counts: Vec<i32> = (0..n)
                .map(|i| {
                    let t = i as f64 / 20.0;
                    let e: f64 = StandardNormal.sample(rng);
                    let w: f64 = StandardNormal.sample(rng);
                    level += world.walk * w + world.drift / n as f64;
                    let sway = world.sway.0 * (std::f64::consts::TAU * world.sway.1 * t).sin();
                    let line = world.line * (std::f64::consts::TAU * 8.3 * t).sin();
                    (level + sway + line + world.sigma * e).round() as i32
                })
                .collect();
            Channel {
                name: format!("gyro_{}", ["x", "y", "z"][axis.index()]),
                quantity: Quantity::Gyro,
                axis: Some(*axis),
                unit: "deg/s".into(),
                values: counts.iter().map(|c| f64::from(*c) * LSB).collect(),
                counts: Some(counts),
                lsb: Some(LSB),
            }
        })
        .collect();
    let jitter = Normal::new(0.0, 20e-6).unwrap();
    let late = Exp::new(1.0 / 0.003).unwrap();
    let device: Vec<f64> = (0..n)
        .map(|i| 0.05 * i as f64 + 0.01 + jitter.sample(rng))
        .collect();
    Record {
        header: Header {
            rate_hz: Some(20.0),
            tick_s: Some(TICK_S),
            tick_tolerance_ppm: Some(100.0),
            ..Header::default()
        },
        seq: Some((0..n as u64).collect()),
        t_ticks: Some(device.iter().map(|d| (d / TICK_S).round() as u64).collect()),
        host_time_s: Some(
            device
                .iter()
                .map(|d| d + 0.001 + late.sample(rng))
                .collect(),
        ),
        flags: Some(vec![7; n]),
        channels,
        notes: vec![],
    }
}

/// Counts of one gyro, each changed by its number and all of them.
pub fn alter(record: &mut Record, axis: usize, change: impl Fn(usize, &[i32]) -> i32) {
    let c = &mut record.channels[axis];
    let mut counts = c.counts.clone().unwrap();
    for i in 0..counts.len() {
        counts[i] = change(i, &counts);
    }
    c.values = counts.iter().map(|c| f64::from(*c) * LSB).collect();
    c.counts = Some(counts);
}

/// The causes that an audit names, with their channels.
pub fn causes(a: &Audit) -> Vec<String> {
    a.findings
        .iter()
        .map(|f| format!("{} {}", f.cause, f.channels.join(",")))
        .collect()
}

/// A parameter of the first of them.
pub fn parameter(a: &Audit, name: &str) -> f64 {
    a.findings[0].parameters[name].value
}
