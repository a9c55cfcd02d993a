//! The fuzz targets' checks over their corpora and over mutations of them, on stable.
//!
//! `IMU_STAND_FUZZ_SECONDS` is how long for each, in place of half a million inputs, and `IMU_STAND_SEED` the seed.

#[path = "common/fuzzing.rs"]
mod fuzzing;

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = format!("{}/../../fuzz/corpus/{target}", env!("CARGO_MANIFEST_DIR"));
    let mut paths: Vec<_> = std::fs::read_dir(&folder)
        .unwrap_or_else(|error| panic!("the corpus {folder} belongs to the repository: {error}"))
        .map(|entry| entry.unwrap().path())
        .collect();
    paths.sort();
    assert!(paths.len() >= 10, "{} files in {folder}", paths.len());
    paths
        .into_iter()
        .map(|path| std::fs::read(path).unwrap())
        .collect()
}

fn mutations(target: &str, check: fn(&[u8])) {
    const COUNT: u64 = 500_000;
    let corpus = corpus(target);
    corpus.iter().for_each(|line| check(line));
    let set = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok());
    let seconds: Option<f64> = set("IMU_STAND_FUZZ_SECONDS");
    let seed = set("IMU_STAND_SEED").unwrap_or(11.0) as u64;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut below = |n: usize| (((rng.next_u64() >> 32) * n as u64) >> 32) as usize;
    let mut line = Vec::new();
    let (begin, mut count) = (std::time::Instant::now(), 0u64);
    while seconds.map_or(count < COUNT, |most| begin.elapsed().as_secs_f64() < most) {
        count += 1;
        line.clear();
        line.extend(&corpus[below(corpus.len())]);
        for _ in 0..=below(4) {
            let at = below(line.len() + 1);
            match below(6) {
                0 => line.insert(at, below(256) as u8),
                1 => line.insert(at, [0x00, 0x01, 0xFE, 0xFF][below(4)]),
                2 => line.truncate(at),
                3 => line.extend(&corpus[below(corpus.len())]),
                _ if at == line.len() => {}
                4 => line[at] ^= 1 << below(8),
                _ => drop(line.drain(at..(at + 1 + below(4)).min(line.len()))),
            }
        }
        line.truncate(1000);
        check(&line);
    }
    println!(
        "{target}: {count} inputs, {:.0} a second; seed {seed}",
        count as f64 / begin.elapsed().as_secs_f64()
    );
}

#[test]
fn any_bytes_into_the_pc() {
    mutations("frames", fuzzing::frames);
}

#[test]
fn any_bytes_into_the_board() {
    mutations("requests", fuzzing::requests);
}
