//! The DCT likelihood against the Kalman filter, an independent witness.

use std::sync::Arc;

use diagnosis::kalman;
use diagnosis::likelihood::{Bins, Dct, Noise, Panel};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

fn walk(n: usize, white: f64, step: f64, seed: u64) -> Vec<f64> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut level = 0.0;
    (0..n)
        .map(|_| {
            level += step.sqrt() * normal();
            level + white.sqrt() * normal()
        })
        .collect()
}

#[test]
fn ref_dct_and_kalman_agree_within_a_hundredth_of_a_nat() {
    let n = 12_000;
    for (seed, ratio) in [(1, 1e-6), (2, 1e-5), (3, 1e-4)] {
        let y = walk(n, 28.7, 28.7 * ratio, seed);
        let panel = Panel::new(&Dct::new(n), &Arc::new(Bins::new(n)), &y);
        // The constant between the two does not depend on the random walk: differences are compared.
        let dct = |lambda: f64| {
            let s = panel.solve(&Noise::new(lambda.ln()).over(&panel.bins), &[]);
            (s.log_likelihood, s.white)
        };
        let exact = |lambda: f64, white: f64| kalman::log_likelihood(&y, white, white * lambda);
        let offset = |lambda: f64| {
            let (l, white) = dct(lambda);
            l - exact(lambda, white)
        };
        let spread = (offset(ratio) - offset(ratio * 3.0))
            .abs()
            .max((offset(ratio) - offset(ratio / 3.0)).abs());
        assert!(spread < 0.01, "{spread} nats at ratio {ratio}");
    }
}

#[test]
fn a_quarter_of_the_samples_lost_costs_no_bias_of_the_noise() {
    let n = 12_000;
    let mut ratios = vec![];
    for seed in 0..8 {
        let mut y = walk(n, 1.0, 2e-5, 100 + seed);
        for (i, v) in y.iter_mut().enumerate() {
            if (i / 40) % 4 == 1 {
                *v = f64::NAN;
            }
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        kalman::fill(&mut y, 1.0, 2e-5, &mut rng);
        let panel = Panel::new(&Dct::new(n), &Arc::new(Bins::new(n)), &y);
        let (noise, s) = panel.fit(&Noise::new(-12.0), &[]);
        ratios.push((noise.log_walk.exp() / 2e-5, s.white));
    }
    let mean_log = ratios.iter().map(|r| r.0.ln()).sum::<f64>() / 8.0;
    let white = ratios.iter().map(|r| r.1).sum::<f64>() / 8.0;
    // Standard error of ln lambda is about 0.5 in one run of this size.
    assert!(mean_log.abs() < 4.0 * 0.5 / 8f64.sqrt(), "{ratios:?}");
    assert!(
        (white - 1.0).abs() < 4.0 * (2.0f64 / n as f64 / 8.0).sqrt(),
        "{white}"
    );
}

#[test]
fn two_levels_without_height_are_the_gaussian_model() {
    let n = 3000;
    let y = walk(n, 1.0, 1e-4, 5);
    let panel = Panel::new(&Dct::new(n), &Arc::new(Bins::new(n)), &y);
    let s = panel.solve(&Noise::new(1e-4f64.ln()).over(&panel.bins), &[]);
    let count = (n - 1) as f64;
    let gaussian = s.log_likelihood - 0.5 * count * (1.0 + std::f64::consts::TAU.ln());
    let both = diagnosis::compare::two_level(&y, &[s.white.ln(), 1e-4f64.ln(), -20.0, 3.0]);
    assert!((both - gaussian).abs() < 0.05, "{both} {gaussian}");
}
