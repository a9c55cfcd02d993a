//! Replicates of a fitted model in the DCT-II domain, and whether the record looks like one of them.

use rand_core::Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};

use super::NoiseFit;
use super::likelihood::maximize;
use super::spectrum::{Coefficients, Spectrum};

/// Another record of the same model: every bin drawn anew, in place.
pub fn replicate(spectrum: &mut Spectrum, c: &Coefficients, ramp: f64, rng: &mut impl Rng) {
    for bin in &mut spectrum.bins {
        let variance = Spectrum::variance(bin, c);
        // The noise along the ramp's own direction, and the rest.
        let along: f64 = Distribution::<f64>::sample(&StandardNormal, rng) * variance.sqrt();
        let rest = if bin.count > 1.0 {
            ChiSquared::new(bin.count - 1.0).map_or(0.0, |d| d.sample(rng)) * variance
        } else {
            0.0
        };
        let cross = along * bin.rr.sqrt();
        bin.cr = ramp * bin.rr + cross;
        bin.cc = along * along + rest + 2.0 * ramp * cross + ramp * ramp * bin.rr;
    }
}

/// How far the Allan curve of a record lies from that of its fitted model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misfit {
    /// sup |z| of ln σ(τ) over the cluster times.
    pub sup_z: f64,
    /// Share of refitted replicates with as large a value, counting the record as one of them.
    pub p_value: f64,
    /// Averaging factor where it is largest.
    pub worst_m: usize,
    /// σ observed over σ expected there.
    pub ratio: f64,
}

/// Mean and standard deviation over replicates (rows) of each of `columns` figures.
fn moments(replicates: &[Vec<f64>], columns: usize) -> Vec<(f64, f64)> {
    let n = replicates.len() as f64;
    (0..columns)
        .map(|i| {
            let mean = replicates.iter().map(|r| r[i]).sum::<f64>() / n;
            let variance = replicates
                .iter()
                .map(|r| (r[i] - mean).powi(2))
                .sum::<f64>()
                / (n - 1.0).max(1.0);
            (mean, variance.sqrt().max(1e-12))
        })
        .collect()
}

/// Misfit of `fit` at the averaging factors `ms` (samples), against `count` replicates that are fitted like the record itself;
/// `None` without a factor or a replicate.
#[must_use]
pub fn misfit(
    spectrum: &Spectrum,
    fit: &NoiseFit,
    ms: &[usize],
    count: usize,
    rng: &mut impl Rng,
) -> Option<Misfit> {
    if ms.is_empty() || count == 0 {
        return None;
    }
    let weights: Vec<Vec<f64>> = ms.iter().map(|m| spectrum.allan_weights(*m)).collect();
    let logs = |s: &Spectrum, c: &Coefficients, ramp: f64| -> Vec<f64> {
        weights
            .iter()
            .map(|w| {
                let (mut seen, mut expected) = (0.0, 0.0);
                for (bin, weight) in s.bins.iter().zip(w) {
                    seen += weight * bin.cc;
                    expected +=
                        weight * (bin.count * Spectrum::variance(bin, c) + ramp * ramp * bin.rr);
                }
                0.5 * (seen / expected).ln()
            })
            .collect()
    };
    let (c, ramp) = (fit.maximum.coefficients, fit.maximum.ramp);
    let observed = logs(spectrum, &c, ramp);
    let mut copy = spectrum.clone();
    let replicates: Vec<Vec<f64>> = (0..count)
        .map(|_| {
            replicate(&mut copy, &c, ramp, rng);
            let found = maximize(&copy, fit.model, None, Some(&c));
            logs(&copy, &found.coefficients, found.ramp)
        })
        .collect();
    let n = count as f64;
    let moments = moments(&replicates, ms.len());
    let sup = |v: &[f64]| {
        v.iter()
            .zip(&moments)
            .map(|(x, (mean, sd))| ((x - mean) / sd).abs())
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap_or((0, 0.0))
    };
    let (worst, sup_z) = sup(&observed);
    let as_large = replicates.iter().filter(|r| sup(r).1 >= sup_z).count();
    Some(Misfit {
        sup_z,
        p_value: (as_large + 1) as f64 / (n + 1.0),
        worst_m: ms[worst],
        ratio: observed[worst].exp(),
    })
}
