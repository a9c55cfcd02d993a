//! Overlapping Allan deviation on the octave grid, in place: seconds and peak memory for a long record.
//!
//! `cargo run --release -p noise --example throughput -- [SAMPLES]`

use std::time::Instant;

use noise::allan::{Phase, TauGrid};

fn main() {
    let samples: usize = std::env::args()
        .nth(1)
        .and_then(|a| a.parse().ok())
        .unwrap_or(100_000_000);
    // A linear congruential sequence: white enough for the time, and made in a moment.
    let mut state = 1_234_567_890u64;
    let y: Vec<f64> = (0..samples)
        .map(|_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        })
        .collect();
    let start = Instant::now();
    let phase = Phase::in_place(y);
    let integrated = start.elapsed();
    let ms = TauGrid::Octave.factors(samples / 2);
    let curve = phase.overlapping_allan(1.0, &ms);
    let seconds = start.elapsed().as_secs_f64();
    println!(
        "{samples} samples, {} octaves: {seconds:.2} s ({:.2} s of it integration), sigma(1) = {:.6}",
        curve.len(),
        integrated.as_secs_f64(),
        curve[0].deviation
    );
    // Peak resident memory, where the system tells it.
    if let Some(line) = std::fs::read_to_string("/proc/self/status")
        .ok()
        .and_then(|s| {
            s.lines()
                .find(|l| l.starts_with("VmHWM"))
                .map(str::to_owned)
        })
    {
        println!(
            "{line}; input {:.0} MiB",
            samples as f64 * 8.0 / f64::from(1 << 20)
        );
    }
}
