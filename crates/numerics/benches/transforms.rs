//! The cosine transform of a record, and that of the library `rustdct`, by turns in one run:
//! `cargo bench -p numerics --bench transforms`. Lengths: 600 s at 20 Hz, the same less five readings, 24 h at 20 Hz.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use numerics::transform::Dct;
use rustdct::DctPlanner;

/// Readings of a slow swing and of what looks like noise.
fn record(samples: usize) -> Vec<f64> {
    let noise = |k: usize| (k * 7919 % 1013) as f64 / 1013.0;
    (0..samples)
        .map(|k| (k as f64 * 0.37).sin() + noise(k))
        .collect()
}

fn transforms(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("cosine transform");
    group.sample_size(10);
    for samples in [12_000, 11_995, 1_728_000] {
        let x = record(samples);
        let own = Dct::new(samples);
        group.bench_with_input(BenchmarkId::new("own", samples), &x, |b, x| {
            b.iter(|| black_box(own.forward(x)));
        });
        group.bench_with_input(BenchmarkId::new("own, a column", samples), &x, |b, x| {
            b.iter(|| black_box(own.columns([x])));
        });
        let library = DctPlanner::<f64>::new().plan_dct2(samples);
        let mut scratch = vec![0.0; library.get_scratch_len()];
        group.bench_with_input(BenchmarkId::new("rustdct", samples), &x, |b, x| {
            b.iter(|| {
                let mut y = x.clone();
                library.process_dct2_with_scratch(&mut y, &mut scratch);
                black_box(y)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, transforms);
criterion_main!(benches);
