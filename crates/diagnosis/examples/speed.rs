//! How long a diagnosis takes and how much memory: `cargo run --release -p diagnosis --example speed -- SECONDS RATE EFFECTS`,
//! the effects planted on gyro_x, of "temperature", "bias_step", "line", "lines" (eight harmonics), "gauss_markov",
//! "telegraph"; none for a sound stand. Processor time counts on a machine that does other things.

use std::sync::Arc;
use std::time::Instant;

use diagnosis::likelihood::{Bins, Dct, Noise, Panel};
use diagnosis::{DiagnoseOptions, diagnose};
use model::file::EffectModel;
use model::{ModelFile, Parameter};

/// User and system time of the process, s, where the system tells.
fn processor_time() -> f64 {
    /// Linux counts them in hundredths of a second.
    const TICK_S: f64 = 0.01;
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = text.rsplit(')').next().unwrap_or_default();
    let ticks = fields.split_whitespace().skip(11).take(2);
    ticks.filter_map(|t| t.parse::<f64>().ok()).sum::<f64>() * TICK_S
}

/// A line of /proc/self/status in MB, where the system tells.
fn memory(key: &str) -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kb = text.lines().find_map(|l| l.strip_prefix(key));
    kb.and_then(|l| l.split_whitespace().nth(1))
        .and_then(|v| v.parse::<f64>().ok())
        .map_or(f64::NAN, |kb| kb * 1.024e-3)
}

fn planted(what: &str, rate_hz: f64) -> Vec<EffectModel> {
    let effect = |cause: &str, values: &[(&str, f64)]| EffectModel {
        cause: cause.to_owned(),
        channels: vec!["gyro_x".to_owned()],
        parameters: values
            .iter()
            .map(|(k, v)| ((*k).to_owned(), Parameter::exact(*v, "")))
            .collect(),
    };
    let line = |hz: f64, amplitude: f64| {
        let values = [("frequency", hz), ("amplitude", amplitude), ("phase", 0.3)];
        effect("line", &values)
    };
    match what {
        "temperature" => vec![effect(what, &[("slope", 0.05)])],
        "bias_step" => vec![effect(what, &[("time", 1000.0), ("height", 0.5)])],
        "line" => vec![line(0.1234 * rate_hz, 0.05)],
        "lines" => (1..=8)
            .map(|h| line(0.0517 * rate_hz * f64::from(h), 0.2 / f64::from(h)))
            .collect(),
        "gauss_markov" => vec![effect(what, &[("sigma", 0.1), ("correlation_time", 2.0)])],
        "telegraph" => vec![effect(what, &[("half_height", 0.15), ("dwell_time", 20.0)])],
        other => {
            eprintln!("error: no effect {other:?} here; see the head of the example");
            std::process::exit(2);
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, default: f64| -> f64 {
        arguments
            .get(i)
            .and_then(|a| a.parse().ok())
            .unwrap_or(default)
    };
    let (seconds, rate) = (number(0, 600.0), number(1, 20.0));
    let mut model = ModelFile::paper();
    model.excitation.extend([
        ("heater_degc".to_owned(), 6.0),
        ("motor_duty".to_owned(), 0.8),
        ("vibration_g".to_owned(), 0.1),
    ]);
    model.effects = arguments
        .iter()
        .skip(2)
        .flat_map(|what| planted(what, rate))
        .collect();
    let record = model::simulate(&model, seconds, rate, 1).expect("a run");
    // From here on the peak counts.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    let (held, cpu, begun) = (memory("VmRSS"), processor_time(), Instant::now());
    let d = diagnose(&record, &DiagnoseOptions::default())
        .expect("a diagnosis")
        .diagnosis;
    println!(
        "{seconds} s at {rate} Hz, {} rows, 3 axes: {:.2} s wall, {:.2} s processor; {:.0} MB at the peak, {held:.0} MB before; {} findings, {} unexplained",
        record.len(),
        begun.elapsed().as_secs_f64(),
        processor_time() - cpu,
        memory("VmHWM"),
        d.findings.len(),
        d.unexplained.len()
    );
    for f in &d.findings {
        println!("  {}", f.what);
    }
    for u in &d.unexplained {
        println!("  {}: {}", u.channel, u.what);
    }
    let y: Vec<f64> = record.channels[0]
        .values
        .iter()
        .copied()
        .cycle()
        .take(1_000_000)
        .collect();
    let (dct, bins) = (Dct::new(y.len()), Arc::new(Bins::new(y.len())));
    let mut fastest = f64::INFINITY;
    for _ in 0..5 {
        let begun = Instant::now();
        let panel = Panel::new(&dct, &bins, &y);
        let fit = panel.fit(&Noise::new(-12.0), &[]);
        fastest = fastest.min(begun.elapsed().as_secs_f64());
        assert!(fit.1.white > 0.0);
    }
    println!(
        "baseline fit of 1e6 samples, transform included: {:.1} ms, fastest of 5",
        1e3 * fastest
    );
}
