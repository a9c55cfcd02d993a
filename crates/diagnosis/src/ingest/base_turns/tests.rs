//! Tests of [`super`].

use super::*;
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const RATE_HZ: f64 = 20.0;
const SIGMA: f64 = 0.5;

fn noise(n: usize, seed: u64) -> Vec<f64> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut next = || -> f64 { StandardNormal.sample(&mut rng) };
    (0..n).map(|_| SIGMA * next()).collect()
}

/// Adds what a place between 0 and 1 of a stretch has, s.
fn add(y: &mut [f64], from: f64, length: f64, rate: impl Fn(f64) -> f64) {
    for (i, v) in y.iter_mut().enumerate() {
        let x = (i as f64 / RATE_HZ - from) / length;
        if (0.0..1.0).contains(&x) {
            *v += rate(x);
        }
    }
}

#[test]
fn a_turn_there_and_back_or_once_is_found_where_it_was() {
    for (length, peak) in [(2.5, 3.5), (6.0, 2.2), (20.0, 1.6), (3.0, 15.0)] {
        for order in [1.0, 2.0] {
            let mut y = noise(12_000, 7);
            add(&mut y, 300.0, length, |x| peak * (order * PI * x).sin());
            let found = excursions(&y, RATE_HZ);
            assert_eq!(found.len(), 1, "{length} s, {peak} deg/s: {found:?}");
            let e = &found[0];
            let (start, end) = (
                e.samples.start as f64 / RATE_HZ,
                e.samples.end as f64 / RATE_HZ,
            );
            let near = 3.0 * e.end_error / RATE_HZ;
            assert!(
                (start - 300.0).abs() < near && (end - 300.0 - length).abs() < near,
                "{e:?}"
            );
            assert!((e.peak.0 - peak).abs() < 4.0 * e.peak.1, "{peak}: {e:?}");
        }
    }
}

#[test]
fn jumps_that_jump_back_steps_and_decays_are_none() {
    type Shape = fn(f64) -> f64;
    let shapes: [(&str, f64, Shape); 5] = [
        ("a jump there and back", 8.0, |_| 2.0),
        ("two jumps", 6.0, |x| if x < 0.5 { 2.0 } else { -2.0 }),
        ("a step", 300.0, |_| 3.0),
        ("a jump that decays", 30.0, |x| 3.0 * (-6.0 * x).exp()),
        ("a spike", 0.05, |_| 15.0),
    ];
    for (what, length, rate) in shapes {
        for seed in 0..20 {
            let mut y = noise(12_000, seed);
            add(&mut y, 300.0, length, rate);
            let found = excursions(&y, RATE_HZ);
            assert!(found.is_empty(), "{what}, {seed}: {found:?}");
        }
    }
}

/// Of any spectrum that a bias may have, at the largest rms: what it does once it does always.
#[test]
fn a_bias_that_wanders_does_not_stand_out() {
    for (seed, memory_s) in [0.3, 1.0, 3.0, 10.0, 40.0].into_iter().enumerate() {
        let mut y = noise(60_000, seed as u64);
        let keep = (-1.0f64 / (memory_s * RATE_HZ)).exp();
        let drive = noise(60_000, 100 + seed as u64);
        let mut x = 0.0;
        for (v, e) in y.iter_mut().zip(drive) {
            x = keep * x + (1.0 - keep * keep).sqrt() * 0.3 / SIGMA * e;
            *v += x;
        }
        assert_eq!(excursions(&y, RATE_HZ), vec![], "{memory_s} s");
    }
}

#[test]
fn the_largest_of_many_is_the_gyros_own() {
    for seed in 0..10 {
        let mut y = noise(12_000, seed);
        for (place, peak) in [0.9, 1.5, 1.0, 0.9, 1.4, 1.1, 0.9, 1.0]
            .into_iter()
            .enumerate()
        {
            add(&mut y, 40.0 + 65.0 * place as f64, 10.0, |x| {
                peak * (PI * x).sin()
            });
        }
        assert_eq!(excursions(&y, RATE_HZ), vec![]);
    }
}

#[test]
fn a_base_that_sways_is_not_turned_now_and_then() {
    let mut y = noise(12_000, 3);
    for place in 0..20 {
        add(&mut y, 20.0 + 28.0 * f64::from(place), 8.0, |x| {
            4.0 * (2.0 * PI * x).sin()
        });
    }
    assert_eq!(excursions(&y, RATE_HZ), vec![]);
}

#[test]
fn short_and_slow_records_are_no_trouble() {
    for n in [0, 1, 31, 600] {
        for rate_hz in [0.1, 1.0, 20.0, 8000.0] {
            assert_eq!(excursions(&noise(n, 1), rate_hz), vec![]);
        }
    }
}
