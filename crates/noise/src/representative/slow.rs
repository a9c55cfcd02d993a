//! How well a run knows its slow deviation.

use crate::allan::{Deviation, Phase};
use crate::edf::{NoiseType, edf};
use crate::identify::identify;
use model::record::sampling::Sampling;

/// Samples of a cluster of `tau` s.
pub(super) fn cluster(sampling: &Sampling, tau: f64) -> usize {
    (tau / sampling.tau0).round().max(1.0) as usize
}

/// The noise that dominates at clusters of `tau` s: the middle of what each run says, which from its own few clusters is wrong in
/// one of several. Runs of one stand have one noise, and one that was told another would seem surer of its deviation than the
/// others are.
pub(super) fn noise(phases: &[Phase], samplings: &[Sampling], tau: f64) -> NoiseType {
    let of = |(phase, sampling)| identify(phase, (cluster(sampling, tau) / 4).max(1));
    let mut all: Vec<NoiseType> = phases.iter().zip(samplings).filter_map(of).collect();
    all.sort_by_key(|noise| noise.alpha());
    let middle = all.get(all.len().saturating_sub(1) / 2).copied();
    middle.unwrap_or(NoiseType::WhiteRate)
}

/// Standard error of the logarithm of an overlapping Allan deviation at clusters of `m` samples: its square is as of a chi-square.
pub(super) fn ln_error(noise: NoiseType, m: usize, phase: &Phase) -> f64 {
    let freedom = edf(Deviation::Oadev, noise, m, &phase.run_lengths());
    0.5 * trigamma(0.5 * freedom).sqrt()
}

/// Second derivative of ln Gamma, which is the variance of the logarithm of a chi-square of 2 `x` degrees of freedom: by
/// its recurrence, and Abramowitz, Stegun (1964), eq. (6.4.12), where that has ten digits.
fn trigamma(x: f64) -> f64 {
    const SHIFT: u8 = 10;
    let near: f64 = (0..SHIFT).map(|k| (x + f64::from(k)).powi(-2)).sum();
    let y = x + f64::from(SHIFT);
    near + 1.0 / y + 0.5 / y.powi(2) + 1.0 / (6.0 * y.powi(3)) - 1.0 / (30.0 * y.powi(5))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variance_of_the_logarithm_of_a_chi_square_is_the_known_one() {
        // pi^2 / 6 and pi^2 / 2.
        let pi = std::f64::consts::PI;
        assert!((trigamma(1.0) - pi * pi / 6.0).abs() < 1e-8);
        assert!((trigamma(0.5) - pi * pi / 2.0).abs() < 1e-8);
    }
}
