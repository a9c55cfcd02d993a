//! Bumps: Lorentzians that an unnamed spectrum is laid out in.

use std::f64::consts::PI;

use model::effect::Peak;

use crate::fit::likelihood::Bins;

/// Bumps in an octave, and their full widths over their centres.
const AN_OCTAVE: i32 = 6;
const WIDTHS: [f64; 3] = [0.08, 0.25, 0.7];
/// Points over which the mean of a bump in a bin is taken.
const POINTS: i32 = 5;
/// Fewest coefficients below the centre of a bump, and in the width of a process at frequency zero.
const LEAST_COEFFICIENTS: f64 = 12.0;

/// One bump: centre and full width at half power, rad per sample, and its variance over the white one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bump {
    pub center: f64,
    pub width: f64,
    pub variance: f64,
}

/// Density of a bump of variance 1 as it is sampled.
pub(super) fn lorentzian(center: f64, width: f64, omega: f64) -> f64 {
    let kept = (-0.5 * width).exp();
    let about = |w: f64| (1.0 - kept * kept) / (1.0 - 2.0 * kept * w.cos() + kept * kept);
    0.5 * (about(omega - center) + about(omega + center))
}

/// Centres and widths that are tried in a record of `n` samples.
pub(super) fn places(n: usize) -> Vec<(f64, f64)> {
    let spacing = PI / n as f64;
    let mut all = vec![];
    let mut width = LEAST_COEFFICIENTS * spacing;
    while width < PI {
        all.push((0.0, width));
        width *= 2.0;
    }
    let ratio = 2f64.powf(f64::from(AN_OCTAVE).recip());
    let mut center = LEAST_COEFFICIENTS * spacing;
    while center < PI {
        let wide = |by: &f64| (center, center * by);
        let widths = WIDTHS.iter().map(wide);
        all.extend(widths.filter(|(_, w)| *w >= 0.25 * LEAST_COEFFICIENTS * spacing));
        center *= ratio;
    }
    all
}

impl Bump {
    /// Its density at angular frequencies.
    pub(super) fn over(&self, omega: &[f64]) -> Vec<f64> {
        let at = |w: &f64| self.variance * lorentzian(self.center, self.width, *w);
        omega.iter().map(at).collect()
    }

    /// The means in bins of a length, of a bump no wider than some of them.
    pub(super) fn in_bins(&self, bins: &Bins) -> Vec<f64> {
        let coefficient = PI / bins.n as f64;
        let mean = |(w, count): (&f64, &f64)| {
            let point = |k: i32| (f64::from(2 * k + 1) / f64::from(POINTS) - 1.0) * 0.5 * count;
            let at = |k: i32| lorentzian(self.center, self.width, w + coefficient * point(k));
            self.variance * (0..POINTS).map(at).sum::<f64>() / f64::from(POINTS)
        };
        bins.at.omega.iter().zip(bins.counts()).map(mean).collect()
    }
}

impl From<Peak> for Bump {
    fn from(p: Peak) -> Self {
        Self {
            center: p.omega,
            width: 2.0 * p.half_width,
            variance: p.variance,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bump_has_the_variance_that_it_states() {
        let steps = 100_000;
        for (center, width) in [(0.0, 0.01), (0.3, 0.02), (2.0, 1.4)] {
            let all = (0..steps).map(|k| {
                let omega = PI * (f64::from(k) + 0.5) / f64::from(steps);
                lorentzian(center, width, omega)
            });
            let mean = all.sum::<f64>() / f64::from(steps);
            assert!((mean - 1.0).abs() < 1e-6, "{center} {width}: {mean}");
        }
    }
}
