//! How long a diagnosis takes, and a baseline fit: `cargo run --release -p analysis --example speed -- SECONDS RATE`.
//! Processor time of one core counts; on a machine that does other things, hold `time` beside it.

use std::rc::Rc;

use analysis::likelihood::{Bins, Dct, Noise, Panel};
use analysis::{DiagnoseOptions, diagnose};
use model::ModelFile;

fn main() {
    let argument = |i: usize, default: f64| {
        std::env::args()
            .nth(i)
            .and_then(|a| a.parse().ok())
            .unwrap_or(default)
    };
    let (seconds, rate) = (argument(1, 600.0), argument(2, 20.0));
    let mut model = ModelFile::paper();
    model.excitation.extend([
        ("heater_degc".to_owned(), 6.0),
        ("motor_duty".to_owned(), 0.8),
        ("vibration_g".to_owned(), 0.1),
    ]);
    let record = model::simulate(&model, seconds, rate, 1).expect("a run");
    let begun = std::time::Instant::now();
    let d = diagnose(&record, &DiagnoseOptions::default())
        .expect("a diagnosis")
        .diagnosis;
    println!(
        "{seconds} s at {rate} Hz, {} rows, 3 axes: {:.3} s; {} findings, {} unexplained",
        record.len(),
        begun.elapsed().as_secs_f64(),
        d.findings.len(),
        d.unexplained.len()
    );
    let y: Vec<f64> = record.channels[0]
        .values
        .iter()
        .copied()
        .cycle()
        .take(1_000_000)
        .collect();
    let (dct, bins) = (Dct::new(y.len()), Rc::new(Bins::new(y.len())));
    let mut fastest = f64::INFINITY;
    for _ in 0..5 {
        let begun = std::time::Instant::now();
        let panel = Panel::new(&dct, &bins, &y);
        let fit = panel.fit(&Noise::new(-12.0), &[]);
        fastest = fastest.min(begun.elapsed().as_secs_f64());
        assert!(fit.1.white > 0.0);
    }
    println!(
        "baseline fit of 1e6 samples, transform included: {:.1} ms, fastest of 5",
        1e3 * fastest
    );
    for f in &d.findings {
        println!("  {}", f.what);
    }
    for u in &d.unexplained {
        println!("  {}: {}", u.channel, u.what);
    }
}
