//! Golden: what the first case of each family plants, by a digest. It says "unchanged", not "correct": a campaign can be
//! compared with an earlier one only where both draw the same. A change that is meant renews the file by
//! `IMU_STAND_RENEW=1 cargo test -p campaign --test draws`.

use std::collections::HashMap;
use std::fmt::Write as _;

use campaign::{Family, Size, case, cases, in_parallel, threads};

/// Seed of the cases.
const SEED: u64 = 17;
/// Where their digests are, with the row of the tables.
const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/draws.txt");

/// The digest of the first case of each family, in the order of their numbers.
fn digests() -> Vec<(Family, u64)> {
    let all: Vec<Family> = cases(Size::even(1), None).iter().map(|c| c.0).collect();
    let mut found = in_parallel(&all, threads(), |family| {
        Some((*family, case::digest(SEED, *family, 0)))
    });
    found.sort_by_key(|(f, _)| f.number());
    found
}

#[test]
fn golden_the_first_case_of_each_family_is_drawn_as_before() {
    let new = digests();
    if std::env::var_os("IMU_STAND_RENEW").is_some() {
        let mut text = String::new();
        for (family, digest) in &new {
            let _ = writeln!(text, "{digest:016x} {}", family.label());
        }
        std::fs::write(PATH, text).expect("the file can be written");
        return;
    }
    let old: HashMap<&str, &str> = include_str!("draws.txt")
        .lines()
        .filter_map(|line| line.split_once(' '))
        .map(|(digest, label)| (label, digest))
        .collect();
    let changed: Vec<&str> = new
        .iter()
        .filter(|(f, digest)| old.get(f.label()) != Some(&format!("{digest:016x}").as_str()))
        .map(|(f, _)| f.label())
        .collect();
    assert!(changed.is_empty(), "drawn otherwise: {changed:?}");
    assert_eq!(new.len(), old.len(), "families that are gone");
}

#[test]
fn two_cases_of_a_family_and_two_seeds_differ() {
    let family = Family::Clean;
    let first = case::digest(SEED, family, 0);
    assert_ne!(first, case::digest(SEED, family, 1));
    assert_ne!(first, case::digest(SEED + 1, family, 0));
    assert_eq!(first, case::digest(SEED, family, 0));
}
