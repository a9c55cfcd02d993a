//! Means over a window, taken once or several times one after the other: the moving average of a logger, the triangular (Bartlett)
//! window of the ADIS16250, the decimator of third order of many sensors (E. B. Hogenauer, "An economical class of digital
//! filters for decimation and interpolation", IEEE Trans. ASSP 29, 1981).

use super::drawn::factor;
use super::shapes::logistic;
use super::smooth::{cosine_sum, places};
use crate::effect::{Covariance, Frequencies};

/// What the mean is taken of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Of {
    /// Of what is there between the readings too: the window may have any length.
    Course,
    /// Of whole readings.
    Readings,
}

impl Of {
    /// What the switch `of_readings` says.
    pub(super) fn stated(of_readings: f64) -> Self {
        if of_readings == 1.0 {
            Self::Readings
        } else {
            Self::Course
        }
    }
}

/// Means of one kind. Coordinate: logit of the lag-1 correlation; of readings ln of their number beyond the first, and ln of the
/// density that is left where the mean has none, over the white one: a long mean tells little but for what is behind it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// How often the mean is taken.
    pub times: usize,
    /// Of what.
    pub of: Of,
    /// Variance of the rounding of the readings, over that of the noise between neighbours.
    pub rounding: f64,
}

/// Density that the electronics behind the filter leave where the window has none, over the white one.
pub(super) const FLOOR: f64 = 1e-4;
/// Least and largest ln of it that are sought.
const FLOORS: (f64, f64) = (-16.0, -2.0);
/// Most readings of a mean that is sought.
const MOST: usize = 64;
/// Longest window of any length at which its search starts, quarters of a sample.
const QUARTERS: u32 = 16;
/// Largest logit of the correlation of neighbours by a window that is no number of readings: one mean is over four samples.
const MOST_ALIKE: [f64; 3] = [1.1, 3.0, 3.0];
/// How far from a whole number readings may be estimated.
const WHOLE: f64 = 0.2;

/// A place is as one frequency if the angle over the window changes no more in it, rad.
const NARROW: f64 = 0.02;
/// Nodes and weights of three that give the mean of a polynomial of fifth degree (Gauss and Legendre): zeros of two means have four.
const GAUSS: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 5.0 / 9.0),
    (0.0, 8.0 / 9.0),
    (0.774_596_669_241_483_4, 5.0 / 9.0),
];

impl Window {
    /// Without rounding.
    pub(super) fn exact(times: usize, of: Of) -> Self {
        let rounding = 0.0;
        Self {
            times,
            of,
            rounding,
        }
    }

    /// Taps that draw the noise of a window of so many samples out of white noise, sum of squares 1.
    pub(super) fn taps(self, length: f64) -> Vec<f64> {
        match self.of {
            Of::Course => factor(&self.correlations(length)),
            Of::Readings => self.of_whole(length),
        }
    }

    /// Autocorrelations from lag 1 on of a window over what lies between the readings, too.
    pub(super) fn correlations(self, length: f64) -> Vec<f64> {
        (1..)
            .map(|lag| f64::from(lag) / length)
            .take_while(|u| *u < self.times as f64)
            .map(|u| self.spline(u))
            .collect()
    }

    /// Taps of a mean of whole readings.
    fn of_whole(self, length: f64) -> Vec<f64> {
        let width = length.round().max(1.0) as usize;
        let mut taps = vec![1.0];
        for _ in 0..self.times {
            let mut wider = vec![0.0; taps.len() + width - 1];
            for (i, tap) in taps.iter().enumerate() {
                wider[i..i + width].iter_mut().for_each(|w| *w += tap);
            }
            taps = wider;
        }
        let norm = taps.iter().map(|t| t * t).sum::<f64>().sqrt();
        taps.iter().map(|t| t / norm).collect()
    }

    /// Autocorrelation at `u` lengths: a B-spline of twice as many knots as means, 1 at 0.
    fn spline(self, u: f64) -> f64 {
        let knots = 2 * self.times;
        let at = |u: f64| {
            let mut chosen = 1.0;
            let mut sum = 0.0;
            for k in 0..=knots {
                let beyond = (u + self.times as f64 - k as f64).max(0.0);
                sum += chosen * beyond.powi(knots as i32 - 1);
                chosen *= -((knots - k) as f64) / (k + 1) as f64;
            }
            sum
        };
        if u < self.times as f64 {
            at(u) / at(0.0)
        } else {
            0.0
        }
    }

    /// Density of a mean of readings, which may be broken while it is sought, of any scale.
    fn of_readings(self, length: f64, cosine: f64) -> f64 {
        let half = cosine.clamp(-1.0, 1.0).acos() / 2.0;
        let one = if half > 0.0 {
            (length * half).sin() / half.sin()
        } else {
            length
        };
        one.powi(2 * self.times as i32)
    }

    /// The density of mean 1 at cosines of the frequency.
    fn at(self, length: f64, cosines: &[f64]) -> Vec<f64> {
        match self.of {
            Of::Course => {
                let r = self.correlations(length);
                let of = |c: &f64| (1.0 + 2.0 * cosine_sum(&r, *c)).max(0.0);
                cosines.iter().map(of).collect()
            }
            Of::Readings => {
                let all = places().map(|c| self.of_readings(length, c));
                let mean = all.sum::<f64>() / places().count() as f64;
                let of = |c: &f64| self.of_readings(length, *c) / mean;
                cosines.iter().map(of).collect()
            }
        }
    }

    /// The density, of mean 1, of a window of so many samples, over the places that frequencies stand for: its zeros are narrower
    /// than these.
    pub(super) fn passes(self, length: f64, at: &Frequencies) -> Vec<f64> {
        let widest = at.width.iter().fold(0.0f64, |a, b| a.max(*b));
        if length * widest < NARROW {
            return self.at(length, &at.cosine);
        }
        let mut all = vec![0.0; at.omega.len()];
        for (node, weight) in GAUSS {
            let places = at.omega.iter().zip(&at.width);
            let cosines: Vec<f64> = places
                .map(|(w, width)| (w + 0.5 * width * node).cos())
                .collect();
            let there = self.at(length, &cosines);
            (all.iter_mut().zip(there)).for_each(|(sum, d)| *sum += 0.5 * weight * d);
        }
        all
    }

    /// Correlation of neighbours of a window of so many samples.
    pub(super) fn lag1(self, length: f64) -> f64 {
        match self.of {
            Of::Course => self.spline(1.0 / length),
            Of::Readings => {
                let (mut all, mut lag1) = (0.0, 0.0);
                for c in places() {
                    let density = self.of_readings(length, c);
                    all += density;
                    lag1 += density * c;
                }
                lag1 / all
            }
        }
    }

    /// Frequency, rad per sample, of which half as much passes as of the slowest.
    pub(super) fn half_power(self, length: f64) -> Option<f64> {
        let cosines: Vec<f64> = places().collect();
        let density = self.at(length, &cosines);
        let half = 0.5 * density.first()?;
        let place = density.iter().position(|d| *d < half)?;
        Some(cosines[place].acos())
    }

    /// Length of the window at a coordinate, samples.
    pub(super) fn length(self, theta: f64) -> f64 {
        match self.of {
            Of::Readings => 1.0 + theta.exp(),
            Of::Course => self.of_lag1(logistic(theta)),
        }
    }

    /// Length of the window of a lag-1 correlation, samples.
    pub(super) fn of_lag1(self, rho: f64) -> f64 {
        let (mut low, mut high) = (0.0, self.times as f64);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if self.spline(middle) > rho {
                low = middle;
            } else {
                high = middle;
            }
        }
        2.0 / (low + high)
    }

    /// Density that rounding and the electronics leave where the window has none: rounding is larger over the noise between
    /// neighbours than over all.
    fn floor(self, length: f64) -> f64 {
        self.rounding * (1.0 - self.lag1(length)) + FLOOR
    }

    /// Where a mean of so many readings starts.
    fn start(self, length: f64) -> Vec<f64> {
        vec![self.coordinate(length), self.floor(length).ln()]
    }

    /// Coordinate of a length.
    fn coordinate(self, length: f64) -> f64 {
        match self.of {
            Of::Readings => (length - 1.0).ln(),
            Of::Course => {
                let rho = self.lag1(length);
                (rho / (1.0 - rho)).ln()
            }
        }
    }
}

/// Halvings that leave of an interval what a number in double precision tells apart.
const BISECTIONS: usize = 52;

impl Covariance for Window {
    fn dimensions(&self) -> usize {
        match self.of {
            Of::Course => 1,
            Of::Readings => 2,
        }
    }

    fn filters_white(&self) -> bool {
        true
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        let length = self.length(theta[0]);
        let floor = match theta.get(1) {
            Some(floor) => floor.exp(),
            None => self.floor(length),
        };
        let mut all = self.passes(length, at);
        all.iter_mut().for_each(|d| *d += floor);
        all
    }

    fn fixed(&self) -> Vec<(&'static str, f64, &'static str)> {
        let whole = f64::from(self.of == Of::Readings);
        vec![
            ("times", self.times as f64, "1"),
            ("of_readings", whole, "1"),
        ]
    }

    fn claims(&self, theta: &[f64]) -> bool {
        let length = self.length(theta[0]);
        self.of == Of::Course || (length - length.round()).abs() < WHOLE
    }

    fn bounds(&self, _samples: usize) -> Vec<(f64, f64)> {
        match self.of {
            Of::Course => vec![(-7.0, MOST_ALIKE[self.times - 1])],
            Of::Readings => vec![
                (
                    self.coordinate(2.0 - WHOLE),
                    self.coordinate(MOST as f64 + 1.0),
                ),
                FLOORS,
            ],
        }
    }

    fn starts(&self, _samples: usize) -> Vec<Vec<f64>> {
        match self.of {
            Of::Course => vec![vec![-3.0], vec![0.0]],
            Of::Readings => vec![self.start(2.0)],
        }
    }

    fn grid(&self) -> Vec<Vec<f64>> {
        match self.of {
            // The triangular window is a data sheet's, and weighed as a pole is.
            Of::Course if self.times == 2 => vec![],
            Of::Course => (2..=QUARTERS)
                .map(|quarters| f64::from(quarters) / 4.0)
                .filter(|length| self.lag1(*length) > 0.0)
                .map(|length| vec![self.coordinate(length)])
                .collect(),
            Of::Readings => (2..=MOST).map(|length| self.start(length as f64)).collect(),
        }
    }
}
