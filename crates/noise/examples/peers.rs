//! Our side of `cargo xtask compare-peers`: `peers write FILE SAMPLES`, `peers run KIND FILE`, `peers crate FILE`.
//!
//! `run` prints `seconds S`, `peak_kib K`, for `oadev` `pass_seconds S` (one plain pass over the readings an octave) and `dev M SIGMA` lines like the script of the other side; `crate` times the
//! Rust crate `allan` and, on the same cluster times, this one.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::time::Instant;

use noise::allan::{Deviation, Estimate, Phase, TauGrid};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["write", path, samples] => write(path, samples.parse()?),
        ["run", kind, path] => run(kind.parse()?, read(path)?),
        ["crate", path] => against_crate(&read(path)?),
        _ => Err("usage: peers write FILE SAMPLES | run KIND FILE | crate FILE".into()),
    }
}

/// White readings (a linear congruential sequence: made in a moment, the same everywhere).
fn write(path: &str, samples: usize) -> Result<(), Box<dyn std::error::Error>> {
    let mut out = BufWriter::with_capacity(1 << 20, File::create(path)?);
    let mut state = 1_234_567_890u64;
    for _ in 0..samples {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        out.write_all(&((state >> 11) as f64 / (1u64 << 53) as f64).to_le_bytes())?;
    }
    Ok(out.flush()?)
}

fn read(path: &str) -> Result<Vec<f64>, Box<dyn std::error::Error>> {
    let file = File::open(path)?;
    let samples = file.metadata()?.len() as usize / 8;
    let mut input = BufReader::with_capacity(1 << 20, file);
    // One point more than readings, so that integration in place needs no second copy.
    let mut out = Vec::with_capacity(samples + 1);
    let mut bytes = [0; 8];
    for _ in 0..samples {
        input.read_exact(&mut bytes)?;
        out.push(f64::from_le_bytes(bytes));
    }
    Ok(out)
}

fn run(kind: Deviation, readings: Vec<f64>) -> Result<(), Box<dyn std::error::Error>> {
    let samples = readings.len();
    if kind == Deviation::Oadev {
        println!("pass_seconds {}", plain_passes(&readings, kind));
    }
    let begun = Instant::now();
    let phase = Phase::in_place(readings);
    let curve = phase.curve(kind, 1.0, &TauGrid::Octave.factors(kind.longest(samples)));
    println!("seconds {}", begun.elapsed().as_secs_f64());
    // Where the system tells the peak of resident memory.
    if let Some(peak) = std::fs::read_to_string("/proc/self/status")
        .ok()
        .and_then(|s| {
            let line = s.lines().find(|l| l.starts_with("VmHWM"))?;
            line.split_whitespace().nth(1).map(str::to_owned)
        })
    {
        println!("peak_kib {peak}");
    }
    for e in curve {
        println!("dev {} {:e}", e.m, e.deviation);
    }
    Ok(())
}

/// Seconds that reading the readings from memory takes, once for every octave: sums of eight at a time, nothing else.
fn plain_passes(readings: &[f64], kind: Deviation) -> f64 {
    let octaves = TauGrid::Octave.factors(kind.longest(readings.len())).len();
    let begun = Instant::now();
    for _ in 0..octaves {
        let mut sums = [0.0f64; 32];
        for part in std::hint::black_box(readings).as_chunks::<32>().0 {
            for (sum, v) in sums.iter_mut().zip(part) {
                *sum += v;
            }
        }
        std::hint::black_box(sums);
    }
    begun.elapsed().as_secs_f64()
}

fn against_crate(readings: &[f64]) -> Result<(), Box<dyn std::error::Error>> {
    let longest = 100_000.min(readings.len() / 3);
    let ms = TauGrid::Decade.factors(longest);
    let begun = Instant::now();
    let ours: Vec<Estimate> =
        Phase::from_values(readings, std::slice::from_ref(&(0..readings.len())))
            .overlapping_allan(1.0, &ms);
    println!("seconds {}", begun.elapsed().as_secs_f64());
    let begun = Instant::now();
    let mut allan = allan::Allan::builder()
        .style(allan::Style::Decade124)
        .max_tau(longest)
        .data_type(allan::DataType::Frequency)
        .build_allan();
    for v in readings {
        allan.record(*v);
    }
    let theirs: Vec<Option<f64>> = ms
        .iter()
        .map(|m| allan.get(*m).and_then(|t| t.deviation()))
        .collect();
    println!("crate_seconds {}", begun.elapsed().as_secs_f64());
    for (e, other) in ours.iter().zip(theirs) {
        if let Some(other) = other {
            println!("dev {} {:e}", e.m, e.deviation);
            println!("crate_dev {} {other:e}", e.m);
        }
    }
    Ok(())
}
