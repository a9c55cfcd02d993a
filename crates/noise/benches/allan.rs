//! Overlapping and modified Allan deviations against the crate `allan`, same run, same readings, same cluster times.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use noise::allan::{Deviation, Gapped, Phase, Streaming, TauGrid, deviation};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const N: usize = 1_000_000;

fn readings() -> Vec<f64> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    (0..N).map(|_| StandardNormal.sample(&mut rng)).collect()
}

fn bench(c: &mut Criterion) {
    let y = readings();
    let whole = 0..N;
    let mut group = c.benchmark_group("oadev, 1e6 readings, 1-2-4 decades to 1e5");
    group
        .throughput(Throughput::Elements(N as u64))
        .sample_size(10);
    let ms = TauGrid::Decade.factors(100_000);
    group.bench_function(BenchmarkId::from_parameter("imu-stand"), |b| {
        b.iter(|| {
            Phase::from_values(black_box(&y), std::slice::from_ref(&whole))
                .overlapping_allan(1.0, &ms)
        });
    });
    group.bench_function(BenchmarkId::from_parameter("crate allan"), |b| {
        b.iter(|| {
            let mut allan = allan::Allan::builder()
                .style(allan::Style::Decade124)
                .max_tau(100_000)
                .data_type(allan::DataType::Frequency)
                .build_allan();
            for v in black_box(&y) {
                allan.record(*v);
            }
            ms.iter()
                .filter_map(|m| allan.get(*m).and_then(|t| t.deviation()))
                .collect::<Vec<_>>()
        });
    });
    group.finish();

    let mut group = c.benchmark_group("octaves, 1e6 readings");
    group
        .throughput(Throughput::Elements(N as u64))
        .sample_size(10);
    let ms = TauGrid::Octave.factors(N / 3);
    group.bench_function("oadev", |b| {
        b.iter(|| {
            Phase::from_values(black_box(&y), std::slice::from_ref(&whole))
                .overlapping_allan(1.0, &ms)
        });
    });
    let phase = Phase::from_values(&y, std::slice::from_ref(&whole));
    for kind in [Deviation::Mdev, Deviation::Ohdev, Deviation::Totdev] {
        group.bench_function(kind.name(), |b| {
            b.iter(|| {
                ms.iter()
                    .filter_map(|m| deviation(black_box(&phase), kind, 1.0, *m))
                    .count()
            });
        });
    }
    group.bench_function("oadev, streaming to 2^16", |b| {
        b.iter(|| {
            let mut stream = Streaming::<f64>::new(1.0, 1.0, 16);
            for v in black_box(&y) {
                stream.push(*v);
            }
            stream.estimates()
        });
    });
    group.finish();

    // Where peers need the square of the readings.
    let few = 5000;
    let short = Phase::from_values(&y, std::slice::from_ref(&(0..few)));
    let mut group = c.benchmark_group("octaves, 5e3 readings");
    group
        .throughput(Throughput::Elements(few as u64))
        .sample_size(10);
    for kind in [Deviation::Mtotdev, Deviation::Theo1] {
        let ms = TauGrid::Octave.factors(kind.longest(few));
        group.bench_function(kind.name(), |b| {
            b.iter(|| black_box(&short).curve(kind, 1.0, &ms));
        });
    }
    group.finish();

    // Every fiftieth reading lost.
    let runs: Vec<_> = (0..N / 50).map(|i| i * 49..(i + 1) * 49).collect();
    let slots: Vec<u64> = (0..N as u64 / 50 * 49).map(|i| i + i / 49).collect();
    let gapped = Gapped::new(&y, &runs, &slots);
    let ms = TauGrid::Octave.factors(N / 3);
    let mut group = c.benchmark_group("octaves, 1e6 slots, 2 % empty");
    group
        .throughput(Throughput::Elements(N as u64))
        .sample_size(10);
    group.bench_function("oadev", |b| {
        b.iter(|| {
            ms.iter()
                .filter_map(|m| black_box(&gapped).overlapping_allan(1.0, *m, 1.0))
                .count()
        });
    });
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
