//! What the name of a tone claims that was tracked or is led, by what its blocks were otherwise than foreseen.

use numerics::column::dot;
use numerics::tails;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::phase::Tracked;
use crate::test_level::{CheckId, Outcome};

/// Relative variance of the size that real tones have beside chance, as the envelope's of a band.
const UNEVEN: f64 = 0.025;
/// Part of the surprises' variance that one frequency, or what neighbours share, may hold.
const TOLERATED: f64 = 0.1;
/// Blocks at either end that are not asked.
const ENDS: usize = 3;
/// Lags of the portmanteau statistic.
const LAGS: usize = 10;

/// What the name claims of a tone that leads itself: the pitch has no rhythm and does not jump, the size is steady, and the pitch knows
/// nothing of its past but what its law says, which `memory` shows.
pub(super) fn claim(seen: &Tracked, memory: &Tracked) -> Outcome {
    let [across, along] = &seen.surprises.each_ref().map(|s| within_ends(s));
    let kurtosis = mean(across, 4) / mean(across, 2).powi(2);
    let jumps = tails::kurtosis_score(kurtosis, across.len() as f64);
    let own = over_noise(seen.at[0].exp(), seen.noise);
    let past = portmanteau(&within_ends(&memory.surprises[0]));
    let chances = [
        ("its size is not steady", unsteady(along, own)),
        ("its pitch jumps", tails::upper_normal(jumps)),
        ("its pitch has a rhythm", rhythm(across)),
        ("its pitch stays otherwise than a process of one time", past),
    ];
    farthest(&chances, along, own)
}

/// The same of one of so many tones that a rotor makes, by its surprises along the phase: that its size is steady. The pitch is the
/// rotor's.
pub(super) fn claim_of_part(along: &[f64], amplitude: f64, noise: f64, among: usize) -> Outcome {
    let (along, own) = (within_ends(along), over_noise(amplitude, noise));
    let chance = (among as f64 * unsteady(&along, own)).min(1.0);
    farthest(&[("its size is not steady", chance)], &along, own)
}

/// Power of a tone over the variance of the noise in either part of a block.
fn over_noise(amplitude: f64, noise: f64) -> f64 {
    amplitude * amplitude / noise
}

fn mean(v: &[f64], power: i32) -> f64 {
    v.iter().map(|v| v.powi(power)).sum::<f64>() / v.len() as f64
}

/// Chance that the size of a tone, of so much power over the noise, moves as much: beside chance, of which the variance of a variance
/// is 2 / n, a real size does; along the phase the noise has the variance 1.
fn unsteady(along: &[f64], over_noise: f64) -> f64 {
    let by_chance = (2.0 / along.len() as f64).sqrt();
    tails::upper_normal((mean(along, 2) - 1.0) / by_chance.hypot(UNEVEN * over_noise))
}

/// The claim by the least of some chances.
fn farthest(chances: &[(&str, f64)], along: &[f64], over_noise: f64) -> Outcome {
    let (what, least) = (chances.iter())
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .copied()
        .unwrap_or(("", 1.0));
    Outcome {
        id: CheckId::BandEnvelope,
        about: vec![],
        statistic: (mean(along, 2) - 1.0) / over_noise,
        p_value: (least * chances.len() as f64).min(1.0),
        what: format!(
            "told as wandering_line, of which the phase was tracked through the record: farthest from the law of such a tone: {what}"
        ),
    }
}

/// What lies beyond the ends of the record is not known, and rings.
fn within_ends(v: &[f64]) -> Vec<f64> {
    v[ENDS..v.len() - ENDS].to_vec()
}

/// Chance that neighbours of a series share as much (Box and Pierce, 1970); 1 where it is no more than is tolerated.
fn portmanteau(series: &[f64]) -> f64 {
    let energy: f64 = series.iter().map(|v| v * v).sum();
    let lag = |k: usize| dot(&series[..series.len() - k], &series[k..]) / energy;
    let shared: f64 = (1..=LAGS).map(|k| lag(k).powi(2)).sum();
    match shared > TOLERATED * TOLERATED {
        true => tails::chi_square(shared * series.len() as f64, LAGS as f64),
        false => 1.0,
    }
}

/// Chance of the strongest frequency of a series that is white (Fisher, 1929); 1 where it holds no more than is tolerated.
fn rhythm(series: &[f64]) -> f64 {
    let mut z: Vec<Complex<f64>> = series.iter().map(|v| Complex::new(*v, 0.0)).collect();
    FftPlanner::new().plan_fft_forward(z.len()).process(&mut z);
    let energies: Vec<f64> = z[1..z.len().div_ceil(2)]
        .iter()
        .map(Complex::norm_sqr)
        .collect();
    let all: f64 = energies.iter().sum();
    let share = energies.iter().copied().fold(0.0, f64::max) / all;
    if share < TOLERATED {
        return 1.0;
    }
    let count = energies.len() as f64;
    (count * (1.0 - share).powf(count - 1.0)).min(1.0)
}
