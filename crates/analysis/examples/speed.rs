//! How long a diagnosis takes: `cargo run --release -p analysis --example speed -- SECONDS RATE`.

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
    for f in &d.findings {
        println!("  {}", f.what);
    }
    for u in &d.unexplained {
        println!("  {}: {}", u.channel, u.what);
    }
}
