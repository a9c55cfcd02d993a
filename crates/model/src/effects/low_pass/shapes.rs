//! Filters of one and two coordinates: a pole, a pole behind a short window, a triangular window.

use super::smooth::cosine_sum;
use crate::effect::{Covariance, Frequencies};

/// Smallest pole that noise of the lag-1 correlation `rho` can have: below it some density would be negative.
pub(super) fn least_pole(rho: f64) -> f64 {
    (2.0 * rho - 1.0).max(0.0)
}

/// The pole at the coordinate `q`, between the smallest one and that of a pole alone.
pub(super) fn pole(rho: f64, q: f64) -> f64 {
    let least = least_pole(rho);
    least + (rho - least) * logistic(q)
}

pub(super) fn logistic(theta: f64) -> f64 {
    1.0 / (1.0 + (-theta).exp())
}

/// One pole: correlation r^|lag|. Coordinate: logit r.
pub(super) struct Pole;

impl Covariance for Pole {
    fn dimensions(&self) -> usize {
        1
    }

    fn filters_white(&self) -> bool {
        true
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        at.one_pole(1.0, logistic(theta[0]))
    }

    fn fixed(&self) -> Vec<(&'static str, f64, &'static str)> {
        vec![("triangular", 0.0, "1")]
    }

    fn bounds(&self, _samples: usize) -> Vec<(f64, f64)> {
        vec![(-7.0, 3.0)]
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        vec![vec![-3.0], vec![0.0]]
    }
}

/// One pole behind a window that is shorter than a sample, as a capacitor on a part that averages: rho pole^(|lag| - 1).
/// Coordinates: logit of the lag-1 correlation, place of the pole between the smallest one and that of a pole alone.
pub(super) struct BehindWindow;

impl BehindWindow {
    /// The density of that lag-1 correlation and pole.
    pub(super) fn of(rho: f64, pole: f64, at: &Frequencies) -> Vec<f64> {
        let pole = pole.max(LEAST_POLE);
        let share = rho / pole;
        let alone = at.one_pole(share, pole).into_iter();
        alone
            .map(|d| (1.0 - share + d).max(LEAST_DENSITY))
            .collect()
    }
}

impl Covariance for BehindWindow {
    fn dimensions(&self) -> usize {
        2
    }

    fn filters_white(&self) -> bool {
        true
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        let rho = logistic(theta[0]);
        Self::of(rho, pole(rho, theta[1]), at)
    }

    fn fixed(&self) -> Vec<(&'static str, f64, &'static str)> {
        vec![("triangular", 0.0, "1")]
    }

    fn bounds(&self, _samples: usize) -> Vec<(f64, f64)> {
        vec![(-7.0, 3.0), (-4.0, 4.0)]
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        vec![vec![-1.0, 1.0], vec![0.5, 2.0]]
    }
}

/// A pole of nothing, by which its share would be infinite; and a density that is none, but for the error of its terms.
const LEAST_POLE: f64 = 1e-6;
const LEAST_DENSITY: f64 = 1e-9;

/// Triangular window (the data sheet's Bartlett filter). Coordinate: logit of the lag-1 correlation.
pub(super) struct Triangle;

/// Density that quantization and the electronics behind the filter leave where the window has none, over the white one.
pub(super) const FLOOR: f64 = 2e-3;

/// Autocorrelation of a triangular window at `u` half-bases: the cubic B-spline, 1 at 0 and 0 from 2 on.
pub(super) fn spline(u: f64) -> f64 {
    if u < 1.0 {
        1.0 - 1.5 * u * u + 0.75 * u * u * u
    } else if u < 2.0 {
        (2.0 - u).powi(3) / 4.0
    } else {
        0.0
    }
}

/// `u` at which the spline has the value `r`.
pub(super) fn inverse_spline(r: f64) -> f64 {
    let (mut low, mut high) = (0.0, 2.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if spline(middle) > r {
            low = middle
        } else {
            high = middle
        }
    }
    0.5 * (low + high)
}

impl Triangle {
    /// The density of that lag-1 correlation, of mean 1.
    pub(super) fn of(rho: f64, at: &Frequencies) -> Vec<f64> {
        let own = Self.density(&[(rho / (1.0 - rho)).ln()], at).into_iter();
        own.map(|d| d / (1.0 + FLOOR)).collect()
    }
}

impl Covariance for Triangle {
    fn dimensions(&self) -> usize {
        1
    }

    fn filters_white(&self) -> bool {
        true
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        let unit = inverse_spline(logistic(theta[0]));
        let taps: Vec<f64> = (1..)
            .map(|l| spline(f64::from(l) * unit))
            .take_while(|r| *r > 0.0)
            .collect();
        at.cosine
            .iter()
            .map(|c| (1.0 + 2.0 * cosine_sum(&taps, *c)).max(0.0) + FLOOR)
            .collect()
    }

    fn fixed(&self) -> Vec<(&'static str, f64, &'static str)> {
        vec![("triangular", 1.0, "1")]
    }

    fn bounds(&self, _samples: usize) -> Vec<(f64, f64)> {
        vec![(-7.0, 3.0)]
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        vec![vec![-3.0], vec![0.0]]
    }
}
