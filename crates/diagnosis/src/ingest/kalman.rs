//! The local-level Kalman filter with missing samples: the independent witness of the DCT likelihood, and the source of
//! values for lost samples that the likelihood cannot tell from real ones.

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Exact log likelihood of white noise of variance `white` plus a flat-start random walk of step variance `step`;
/// NaN is a missing sample.
#[must_use]
pub fn log_likelihood(y: &[f64], white: f64, step: f64) -> f64 {
    let mut state: Option<(f64, f64)> = None;
    let mut sum = 0.0;
    for v in y {
        if let Some((_, p)) = &mut state {
            *p += step;
        }
        if !v.is_finite() {
            continue;
        }
        state = Some(match state {
            None => (*v, white),
            Some((m, p)) => {
                let s = p + white;
                let nu = v - m;
                sum -= 0.5 * ((std::f64::consts::TAU * s).ln() + nu * nu / s);
                (m + p / s * nu, p * white / s)
            }
        });
    }
    sum
}

/// Smoothed level given all samples (Rauch, Tung and Striebel).
fn smooth(y: &[f64], white: f64, step: f64) -> Vec<f64> {
    let first = y.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
    let (mut m, mut p) = (first, 1e6 * (white + step));
    let mut filtered = Vec::with_capacity(y.len());
    for v in y {
        p += step;
        if v.is_finite() {
            let gain = p / (p + white);
            m += gain * (v - m);
            p *= 1.0 - gain;
        }
        filtered.push((m, p));
    }
    let mut level: Vec<f64> = filtered.iter().map(|f| f.0).collect();
    for i in (0..y.len().saturating_sub(1)).rev() {
        let (m, p) = filtered[i];
        if p + step > 0.0 {
            level[i] = m + p / (p + step) * (level[i + 1] - m);
        }
    }
    level
}

/// Fill missing samples with the level that all others tell, without noise: what moves is what was read.
pub fn bridge(y: &mut [f64], white: f64, step: f64) {
    if y.iter().all(|v| v.is_finite()) {
        return;
    }
    let level = smooth(y, white, step);
    for (v, l) in y.iter_mut().zip(level) {
        if !v.is_finite() {
            *v = l;
        }
    }
}

/// Fill missing samples with a draw from their distribution given all others (Durbin and Koopman).
pub fn fill(y: &mut [f64], white: f64, step: f64, rng: &mut Xoshiro256PlusPlus) {
    if y.iter().all(|v| v.is_finite()) {
        return;
    }
    let mut normal = || -> f64 { StandardNormal.sample(rng) };
    let mut level = 0.0;
    let made: Vec<f64> = y
        .iter()
        .map(|_| {
            level += step.sqrt() * normal();
            level + white.sqrt() * normal()
        })
        .collect();
    let difference: Vec<f64> = y.iter().zip(&made).map(|(v, m)| v - m).collect();
    let correction = smooth(&difference, white, step);
    for ((v, m), c) in y.iter_mut().zip(made).zip(correction) {
        if !v.is_finite() {
            *v = m + c;
        }
    }
}

/// Readings before a lost one that tell all of its level that noise does not hide.
const MEMORY: usize = 1 << 14;

/// As [`fill`], where all from `end` on are missing: if they are the only ones, by the last readings alone.
pub fn fill_to(end: usize, y: &mut [f64], white: f64, step: f64, rng: &mut Xoshiro256PlusPlus) {
    let from = match y[..end].iter().all(|v| v.is_finite()) {
        true => end.saturating_sub(MEMORY),
        false => 0,
    };
    fill(&mut y[from..], white, step, rng);
}
