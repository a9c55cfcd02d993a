//! Means of whole readings, taken once or several times one after the other: the moving average of a logger, its triangular window,
//! the decimator of third order of many sensors (E. B. Hogenauer, "An economical class of digital filters for decimation and
//! interpolation", IEEE Trans. ASSP 29, 1981).

use super::smooth::places;
use crate::effect::{Covariance, Frequencies};

/// A mean that is taken so often. Coordinates: ln of the readings beyond the first, and ln of the density that is left where the
/// mean has none, over the white one: a long mean tells little but for what is behind it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mean {
    /// Means one after the other.
    pub stages: usize,
    /// Variance of the rounding of the readings, over that of the noise between neighbours.
    pub rounding: f64,
}

/// Most readings that are sought.
const MOST: usize = 64;
/// How far from a whole number they may be estimated.
const WHOLE: f64 = 0.2;
/// Density that the electronics behind the filter leave where the mean has none, over the white one, where the search starts.
const FLOOR: f64 = 1e-4;
/// Least and largest ln of it.
const FLOORS: (f64, f64) = (-16.0, -2.0);
/// A place is as one frequency if the angle over the mean changes no more in it, rad.
const NARROW: f64 = 0.02;
/// Nodes and weights of three that give the mean of a polynomial of fifth degree (Gauss and Legendre): zeros of two means have four.
const GAUSS: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 5.0 / 9.0),
    (0.0, 8.0 / 9.0),
    (0.774_596_669_241_483_4, 5.0 / 9.0),
];

impl Mean {
    /// One that is taken so often of readings that are not rounded.
    pub(super) fn taken(stages: usize) -> Self {
        let rounding = 0.0;
        Self { stages, rounding }
    }

    /// Taps of a mean of so many readings, sum of squares 1.
    pub(super) fn taps(self, readings: usize) -> Vec<f64> {
        let mut taps = vec![1.0];
        for _ in 0..self.stages {
            let mut wider = vec![0.0; taps.len() + readings - 1];
            for (i, tap) in taps.iter().enumerate() {
                wider[i..i + readings].iter_mut().for_each(|w| *w += tap);
            }
            taps = wider;
        }
        let norm = taps.iter().map(|t| t * t).sum::<f64>().sqrt();
        taps.iter().map(|t| t / norm).collect()
    }

    /// Density at the cosine of a frequency, of any scale; a number of readings may be broken while it is sought.
    fn at(self, readings: f64, cosine: f64) -> f64 {
        let half = cosine.clamp(-1.0, 1.0).acos() / 2.0;
        let one = if half > 0.0 {
            (readings * half).sin() / half.sin()
        } else {
            readings
        };
        one.powi(2 * self.stages as i32)
    }

    /// Mean of the density over all frequencies.
    fn level(self, readings: f64) -> f64 {
        let all = places().map(|c| self.at(readings, c));
        all.sum::<f64>() / places().count() as f64
    }

    /// The density, of mean 1, over the places that frequencies stand for: its zeros are narrower than these.
    pub(super) fn passes(self, readings: f64, at: &Frequencies) -> Vec<f64> {
        let level = self.level(readings);
        let of = |c: f64| self.at(readings, c) / level;
        let widest = at.width.iter().fold(0.0f64, |a, b| a.max(*b));
        if readings * widest < NARROW {
            return at.cosine.iter().map(|c| of(*c)).collect();
        }
        let places = at.omega.iter().zip(&at.width);
        let over = |(omega, width): (&f64, &f64)| {
            let there =
                |(node, weight): (f64, f64)| 0.5 * weight * of((omega + 0.5 * width * node).cos());
            GAUSS.into_iter().map(there).sum()
        };
        places.map(over).collect()
    }

    /// Correlation of neighbours.
    pub(super) fn lag1(self, readings: f64) -> f64 {
        let all = places().map(|c| self.at(readings, c) * c);
        all.sum::<f64>() / places().count() as f64 / self.level(readings)
    }

    /// Frequency, rad per sample, of which half as much passes as of the slowest.
    pub(super) fn half_power(self, readings: f64) -> Option<f64> {
        let half = 0.5 * self.at(readings, 1.0);
        let place = places().find(|c| self.at(readings, *c) < half);
        place.map(f64::acos)
    }

    /// Readings at a coordinate.
    pub(super) fn readings(theta: f64) -> f64 {
        1.0 + theta.exp()
    }

    fn coordinate(readings: f64) -> f64 {
        (readings - 1.0).ln()
    }

    /// Where a mean of so many readings starts: over all of the noise rounding is smaller than over that between neighbours, by as
    /// many readings where the mean is taken once.
    fn start(self, readings: f64) -> Vec<f64> {
        let floor = self.rounding / readings + FLOOR;
        vec![Self::coordinate(readings), floor.ln()]
    }
}

impl Covariance for Mean {
    fn dimensions(&self) -> usize {
        2
    }

    fn filters_white(&self) -> bool {
        true
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        let mut all = self.passes(Self::readings(theta[0]), at);
        all.iter_mut().for_each(|d| *d += theta[1].exp());
        all
    }

    fn fixed(&self) -> Vec<(&'static str, f64, &'static str)> {
        vec![("stages", self.stages as f64, "1")]
    }

    fn claims(&self, theta: &[f64]) -> bool {
        let readings = Self::readings(theta[0]);
        (readings - readings.round()).abs() < WHOLE
    }

    fn bounds(&self, _samples: usize) -> Vec<(f64, f64)> {
        let least = Self::coordinate(2.0 - WHOLE);
        vec![(least, Self::coordinate(MOST as f64 + 1.0)), FLOORS]
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        vec![self.start(2.0)]
    }

    fn grid(&self) -> Vec<Vec<f64>> {
        (2..=MOST).map(|n| self.start(n as f64)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_density_is_that_of_its_taps() {
        let at = Frequencies::at((0..40).map(|i| f64::from(i) * 0.08).collect());
        for (stages, readings) in [(1, 2), (1, 7), (2, 3), (3, 4)] {
            let (mean, taps) = (Mean::taken(stages), Mean::taken(stages).taps(readings));
            let density = mean.passes(readings as f64, &at);
            for (w, d) in at.omega.iter().zip(density) {
                let part = |f: fn(f64) -> f64| -> f64 {
                    let each = taps.iter().enumerate();
                    each.map(|(i, t)| t * f(i as f64 * w)).sum()
                };
                let wanted = part(f64::cos).powi(2) + part(f64::sin).powi(2);
                assert!(
                    (d - wanted).abs() < 1e-9,
                    "{stages} {readings} {w}: {d} {wanted}"
                );
            }
            let neighbours: f64 = taps.windows(2).map(|t| t[0] * t[1]).sum();
            assert!((mean.lag1(readings as f64) - neighbours).abs() < 1e-9);
        }
    }

    #[test]
    fn over_a_place_it_is_the_mean_of_the_place() {
        let (mean, width) = (Mean::taken(2), 0.03);
        for omega in [0.3, 2.0 * std::f64::consts::PI / 8.0, 3.0] {
            let wide = Frequencies {
                width: vec![width],
                ..Frequencies::at(vec![omega])
            };
            let many = (0..1000).map(|i| omega + width * ((f64::from(i) + 0.5) / 1000.0 - 0.5));
            let there = mean.passes(8.0, &Frequencies::at(many.collect()));
            let wanted = there.iter().sum::<f64>() / 1000.0;
            let found = mean.passes(8.0, &wide)[0];
            assert!(
                (found - wanted).abs() < 1e-3 * wanted,
                "{omega}: {found} {wanted}"
            );
        }
    }
}
