//! The three demands on the diagnosis: 600 s and 24 h of three axes at 20 Hz, and a baseline fit of 1e6 samples.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use diagnosis::likelihood::{Bins, Dct, Noise, Panel};
use diagnosis::{DiagnoseOptions, diagnose};
use model::ModelFile;
use model::record::Record;

const RATE_HZ: f64 = 20.0;

fn record(seconds: f64) -> Record {
    let mut model = ModelFile::paper();
    model.excitation.extend([
        ("heater_degc".to_owned(), 6.0),
        ("motor_duty".to_owned(), 0.8),
        ("vibration_g".to_owned(), 0.1),
    ]);
    model::simulate(&model, seconds, RATE_HZ, 1).expect("a run")
}

fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("diagnosis, three axes at 20 Hz");
    group.sample_size(10);
    for (name, seconds) in [("600 s", 600.0), ("24 h", 86_400.0)] {
        let run = record(seconds);
        group.measurement_time(Duration::from_secs(if seconds > 1e3 { 60 } else { 5 }));
        group.bench_function(name, |b| {
            b.iter(|| diagnose(black_box(&run), &DiagnoseOptions::default()).expect("a diagnosis"));
        });
    }
    group.finish();
    let y: Vec<f64> = record(50_000.0).channels.swap_remove(0).values;
    c.bench_function("baseline fit of 1e6 samples", |b| {
        let (dct, bins) = (Dct::new(y.len()), Arc::new(Bins::new(y.len())));
        b.iter(|| Panel::new(&dct, &bins, black_box(&y)).fit(&Noise::new(-12.0), &[]));
    });
}

criterion_group!(benches, bench);
criterion_main!(benches);
