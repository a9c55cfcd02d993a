//! Tests of [`super`].

use std::sync::Arc;

use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::fit::likelihood::Dct;

/// White coefficients behind the filter of a process with a correlation of some 3 of 6000 samples.
fn filtered(seed: u64) -> Filtered {
    let n = 6000;
    let panel = Panel::new(&Dct::new(n), &Arc::new(Bins::new(n)), &vec![0.0; n]);
    let u = crate::fit::white(n, seed);
    let filter: Vec<f64> = (0..n)
        .map(|k| 1.0 / (1.0 + (PI * k as f64 / n as f64 * 3.0).powi(2)))
        .collect();
    Filtered::new(&panel, &u, &filter, None)
}

#[test]
fn moments_of_a_gaussian_process_are_as_far_off_as_their_errors_say() {
    let runs = 400;
    let all: Vec<Filtered> = (0..runs).map(filtered).collect();
    let z: Vec<f64> = all.iter().flat_map(|f| f.moments().map(|m| m.1)).collect();
    let spread = (z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64).sqrt();
    // 800 scores of spread 1: 0.025 of error, and kurtosis is a little skewed.
    assert!((spread - 1.0).abs() < 0.1, "{spread}");
    let far = z.iter().filter(|z| z.abs() > 3.3).count();
    assert!(far <= 5, "{far}");
}

#[test]
fn a_size_that_follows_a_thermometer_is_told_and_one_that_does_not_is_not() {
    let warm = |i: usize| (i as f64 / 450.0).sin() + 0.4;
    let course: Vec<f64> = (0..6000).map(warm).collect();
    let chance_of = |f: &Filtered, c: &[f64]| chi_tail(f.follows(c, 1.0).unwrap().0, 2.0);
    let runs = 400;
    let low = (0..runs).filter(|s| chance_of(&filtered(*s), &course) < 0.01);
    let low = low.count();
    // 4 are expected.
    assert!(low <= 12, "{low}");
    for seed in 0..10 {
        let mut f = filtered(seed);
        f.values.iter_mut().zip(&course).for_each(|(v, c)| *v *= c);
        let (statistic, depth) = f.follows(&course, 1.0).unwrap();
        assert!(chi_tail(statistic, 2.0) < 1e-6 && depth > DEPTH, "{depth}");
    }
    // What rests, and what has two levels, whose square is the same course.
    assert!(filtered(1).follows(&[25.29; 6000], 1.0).unwrap().0 < 1e-6);
    let levels: Vec<f64> = (0..6000)
        .map(|i| if i % 700 < 90 { 0.3 } else { 0.7 })
        .collect();
    assert!(chance_of(&filtered(1), &levels) > 1e-3);
}

#[test]
fn a_process_that_stops_half_way_has_tails() {
    let mut f = filtered(7);
    f.values[3000..].iter_mut().for_each(|v| *v *= 0.3);
    assert!(f.moments()[1].1 > 4.0);
}

/// Two series, the second with a part of a shared one, and the first with what `comes_over` makes of the second.
fn coupled(comes_over: impl Fn(f64, f64) -> f64, shared: f64, seed: u64) -> Outcome {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
    let (a, b): (Vec<f64>, Vec<f64>) = (0..6000)
        .map(|_| {
            let common = shared * draw();
            let (own, other) = (common + draw(), common + draw());
            (own + comes_over(own, other), other)
        })
        .unzip();
    let r = dot(&a, &b) / (dot(&a, &a) * dot(&b, &b)).sqrt();
    straight(&a, &b, -6000.0 * (1.0 - r * r).ln(), 1)
}

#[test]
fn what_two_axes_share_is_straight_and_what_comes_over_on_one_side_is_not() {
    let runs = 300;
    let low = (0..runs).filter(|s| coupled(|_, _| 0.0, 0.5, *s).statistic > 13.28);
    let low = low.count();
    // Chi-square of four degrees is beyond 13.28 once in 100: 3 are expected.
    assert!(low <= 10, "{low}");
    for seed in 0..10 {
        let diode = coupled(|own, other| 0.4 * (other - own - 0.5).max(0.0), 0.0, seed);
        assert!(diode.p_value < 1e-6, "{seed}: {}", diode.p_value);
        let beyond = |_: f64, other: f64| 0.9 * (other - other.clamp(-1.5, 1.5));
        let beyond = coupled(beyond, 0.0, seed);
        assert!(beyond.p_value < 1e-5, "{seed}: {}", beyond.p_value);
    }
}
