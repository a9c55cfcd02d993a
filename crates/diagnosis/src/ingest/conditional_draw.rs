//! Lost readings under any random walk and stationary noise, given the readings that there are.
//!
//! In the DCT-II the coefficients are independent, with the precisions p: that of the readings is P = C' diag(p) C, and the
//! mean of the lost ones given the others solves P_mm m = -P_mo y_o, by conjugate gradients of two transforms a step. A draw
//! is a record of the noise, moved by the mean of what the true one is off from it (Hoffman and Ribak 1991).

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::fit::likelihood::Dct;
use numerics::column::dot;

/// Error of a filled reading over its own spread at which the steps end, and most steps.
const CLOSE: f64 = 1e-3;
const MOST_STEPS: usize = 200;

/// Puts the mean of the lost readings in their places, from the values there on. `precision` is that of every coefficient,
/// 0 of what is free.
pub(crate) fn fill_mean(dct: &Dct, precision: &[f64], y: &mut [f64], lost: &[usize]) {
    if lost.is_empty() {
        return;
    }
    let at_lost = |x: &[f64]| -> Vec<f64> {
        let mut c = dct.forward(x);
        c.iter_mut().zip(precision).for_each(|(c, p)| *c *= p);
        let all = dct.inverse(&c);
        lost.iter().map(|i| all[*i]).collect()
    };
    let enough = CLOSE * CLOSE * lost.len() as f64 * precision.iter().sum::<f64>() / y.len() as f64;
    let mut rest: Vec<f64> = at_lost(y).iter().map(|v| -v).collect();
    let mut way = rest.clone();
    let mut size = dot(&rest, &rest);
    let mut spread = vec![0.0; y.len()];
    for _ in 0..MOST_STEPS {
        if size <= enough {
            break;
        }
        lost.iter().zip(&way).for_each(|(i, w)| spread[*i] = *w);
        let moved = at_lost(&spread);
        let step = size / dot(&way, &moved);
        lost.iter().zip(&way).for_each(|(i, w)| y[*i] += step * w);
        rest.iter_mut()
            .zip(&moved)
            .for_each(|(r, m)| *r -= step * m);
        let next = dot(&rest, &rest);
        way.iter_mut()
            .zip(&rest)
            .for_each(|(w, r)| *w = r + next / size * *w);
        size = next;
    }
}

/// Puts a draw of the lost readings in their places.
pub(crate) fn fill(
    dct: &Dct,
    precision: &[f64],
    y: &mut [f64],
    lost: &[usize],
    rng: &mut Xoshiro256PlusPlus,
) {
    let made: Vec<f64> = precision
        .iter()
        .map(|p| {
            let normal: f64 = StandardNormal.sample(rng);
            if *p > 0.0 { normal / p.sqrt() } else { 0.0 }
        })
        .collect();
    let made = dct.inverse(&made);
    y.iter_mut().zip(&made).for_each(|(y, m)| *y -= m);
    fill_mean(dct, precision, y, lost);
    y.iter_mut().zip(&made).for_each(|(y, m)| *y += m);
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use rand_core::SeedableRng;

    use super::*;
    use crate::fit::likelihood::{Bins, Noise};

    #[test]
    fn under_white_noise_and_a_walk_the_mean_is_that_of_the_kalman_smoother() {
        let n = 500;
        let (white, log_walk) = (0.3, -6.0f64);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut level = 2.0;
        let mut y: Vec<f64> = (0..n)
            .map(|_| {
                let [a, b]: [f64; 2] = [0; 2].map(|_| StandardNormal.sample(&mut rng));
                level += (white * log_walk.exp()).sqrt() * a;
                level + white.sqrt() * b
            })
            .collect();
        let lost: Vec<usize> = (0..n)
            .filter(|i| i % 7 == 3 || (200..260).contains(i) || *i < 5)
            .collect();
        let mut smoothed = y.clone();
        lost.iter().for_each(|i| smoothed[*i] = f64::NAN);
        crate::ingest::kalman::bridge(&mut smoothed, white, white * log_walk.exp());
        lost.iter().for_each(|i| y[*i] = 0.0);
        let bins = Arc::new(Bins::new(n));
        let g = Noise::new(log_walk).everywhere(&bins);
        let precision: Vec<f64> = g.iter().map(|g| 1.0 / (white * g)).collect();
        fill_mean(&Dct::new(n), &precision, &mut y, &lost);
        for i in lost {
            assert!(
                (y[i] - smoothed[i]).abs() < 0.01 * white.sqrt(),
                "{i}: {} {}",
                y[i],
                smoothed[i]
            );
        }
    }

    #[test]
    fn a_draw_has_the_correlation_of_the_noise_across_what_was_lost() {
        let (n, rho) = (40_000, 0.6);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
        let precision: Vec<f64> = (0..n)
            .map(|k| {
                let omega = std::f64::consts::PI * k as f64 / n as f64;
                (1.0 - 2.0 * rho * omega.cos() + rho * rho) / (1.0 - rho * rho)
            })
            .collect();
        let dct = Dct::new(n);
        let mut y = vec![0.0; n];
        fill(&dct, &precision, &mut y, &[], &mut rng);
        y.iter_mut().for_each(|v| *v = 0.0);
        let all: Vec<usize> = (0..n).collect();
        fill(&dct, &precision, &mut y, &all, &mut rng);
        let lost: Vec<usize> = (0..n).filter(|i| i % 4 == 0).collect();
        lost.iter().for_each(|i| y[*i] = 0.0);
        fill(&dct, &precision, &mut y, &lost, &mut rng);
        let square: f64 = lost.iter().map(|i| y[*i] * y[*i]).sum();
        let beside: f64 = lost.iter().map(|i| y[*i] * y[*i + 1]).sum();
        let count = lost.len() as f64;
        // Four standard errors of 10^4 independent values.
        assert!((square / count - 1.0).abs() < 4.0 * (2.0 / count).sqrt());
        assert!((beside / count - rho).abs() < 4.0 * ((1.0 + rho * rho) / count).sqrt());
    }
}
