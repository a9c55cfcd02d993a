//! Readings of a curve through others: how much neighbours have in common goes up and down as the two rates beat.
//!
//! A reading at t is the sum of x_a h(t - a) over readings x that came at whole numbers a, with the autocovariance r_j; h is the curve
//! through a single 1. What readings m apart, which are r m of the others, have in common is then periodic in t, with the
//! coefficients, for k = 0, 1, 2 (Gardner, Napolitano and Paura 2006, Cyclostationarity: half a century of research, for the general case),
//!
//! B_k(m) = sum over j of r_j b_k(r m - j),  b_k(u) = integral over v of h(v) h(v + u) exp(-2 pi i k v).
//!
//! All of them hang on a rate r, a phase and the few r_j that the record shows where nothing beats (k = 0), so that little is free. A noise
//! whose size swings has at each lag the same part of what it has there on the mean.

use numerics::order_statistics::median;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::f64::consts::{LN_2, TAU};

/// Lags: of readings from 0 to less than so many apart.
const LAGS: usize = 6;
/// Multiples of the beat.
const MULTIPLES: usize = 2;
/// Autocovariances of the readings that came, from 0 on.
const OF_THOSE: usize = 3;
/// Most readings that are taken: more of them tell more, and need clocks that keep the phase for longer.
const MOST: usize = 1 << 17;
/// Height of the beat over the spectrum about it, in its mean, summed over the first lags: chance makes it so in 2^17 places once in 10^9.
const HEIGHT: f64 = 40.0;
const FIRST_LAGS: usize = 3;
/// Bins in a row that tell what the spectrum is there.
const ABOUT: usize = 400;
/// Error of what readings have in common at rest, in the mean square: what the level takes of it that is a mean over 101 readings.
const STILL: f64 = 0.01;
/// Part of what beats that the curve has to make, and by how much, in squares over their errors, better than a noise whose size swings,
/// where it does not make all that is seen.
const MADE: f64 = 0.9;
const BETTER: f64 = 30.0;
/// Squares over their errors, for each that is free, up to which all that is seen is made.
const ALL: f64 = 2.0;
/// Squares over their errors by which another rate is out: exp(-10) in likelihood.
const OUT: f64 = 20.0;
/// Highest multiple of the rate of the frames about which the readings may have come.
const MOST_RATES: usize = 2;

/// A curve between readings.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Curve {
    /// Straight pieces.
    Lines,
    /// Cubics whose slope at a reading is that between its neighbours (Catmull and Rom 1974).
    Slopes,
    /// The cubic spline (Schoenberg 1973, the cardinal one).
    Spline,
}

impl Curve {
    const ALL: [Self; 3] = [Self::Lines, Self::Slopes, Self::Spline];
    /// Readings on either side from which on it is 0, to 3e-4.
    const FAR: i32 = 6;

    fn through_one(self, v: f64) -> f64 {
        let u = v.abs();
        match self {
            Self::Lines => (1.0 - u).max(0.0),
            Self::Slopes if u < 1.0 => (1.5 * u - 2.5) * u * u + 1.0,
            Self::Slopes if u < 2.0 => ((2.5 - 0.5 * u) * u - 4.0) * u + 2.0,
            Self::Slopes => 0.0,
            Self::Spline => {
                // Its coefficients on B-splines: sqrt(3) z^|k| with z = sqrt(3) - 2.
                let z = 3f64.sqrt() - 2.0;
                let b = |u: f64| match u.abs() {
                    u if u < 1.0 => 2.0 / 3.0 - u * u + 0.5 * u * u * u,
                    u if u < 2.0 => (2.0 - u).powi(3) / 6.0,
                    _ => 0.0,
                };
                let near = (u.round() as i32 - 2)..=(u.round() as i32 + 2);
                near.map(|k| 3f64.sqrt() * z.powi(k.abs()) * b(u - f64::from(k)))
                    .sum()
            }
        }
    }

    /// b_0, b_1 and b_2 at `u`.
    fn in_common(self, u: f64) -> [Complex<f64>; MULTIPLES + 1] {
        const PARTS: i32 = 24;
        let mut sums = [Complex::default(); MULTIPLES + 1];
        for i in -Self::FAR * PARTS..=Self::FAR * PARTS {
            let v = f64::from(i) / f64::from(PARTS);
            let product = self.through_one(v) * self.through_one(v + u) / f64::from(PARTS);
            if product != 0.0 {
                for (k, sum) in sums.iter_mut().enumerate() {
                    *sum += Complex::from_polar(product, -TAU * k as f64 * v);
                }
            }
        }
        sums
    }
}

/// What is seen at a beat: for each lag what readings have in common on the mean, and at each multiple of the beat with its error.
struct Seen {
    /// Beats a frame.
    turns: f64,
    still: [f64; LAGS],
    beating: [[Complex<f64>; LAGS]; MULTIPLES],
    errors: [[f64; LAGS]; MULTIPLES],
}

/// What is told of the curve.
pub struct Beats {
    /// Readings that came in the time of one that is written; more than one where they cannot be told apart.
    pub rates: Vec<f64>,
    /// Swing of the variance, relative.
    pub swing: f64,
}

impl Beats {
    /// Readings that came at least in the time of one that is written, at most 1.
    pub fn least(&self) -> f64 {
        self.rates.iter().copied().fold(1.0, f64::min)
    }
}

/// Power of each frequency up to half the rate.
pub fn power(x: &[f64]) -> Vec<f64> {
    let mut z: Vec<Complex<f64>> = x.iter().map(|v| Complex::new(*v, 0.0)).collect();
    FftPlanner::new().plan_fft_forward(z.len()).process(&mut z);
    z[..=z.len() / 2].iter().map(Complex::norm_sqr).collect()
}

fn coefficient(x: &[f64], turns: f64) -> Complex<f64> {
    let parts = x.iter().enumerate();
    let sum: Complex<f64> = parts
        .map(|(i, v)| Complex::from_polar(*v, -TAU * (turns * i as f64).fract()))
        .sum();
    sum / x.len() as f64
}

/// Mean power in each stretch of so many bins, but for lines.
fn means(power: &[f64]) -> Vec<f64> {
    let all = power.chunks(ABOUT).map(|c| median(c) / LN_2);
    all.collect()
}

/// What several gyros show together, each in standard deviations, about its level: products of readings so many apart.
fn products(all: &[&[f64]], lag: usize) -> Vec<f64> {
    let n = all.iter().map(|x| x.len()).min().unwrap_or(0).min(MOST);
    let of = |i: usize| all.iter().map(|x| x[i] * x[i + lag]).sum::<f64>() / all.len() as f64;
    (0..n.saturating_sub(LAGS)).map(of).collect()
}

/// The beat and what is seen there, if one stands out.
fn seen(all: &[&[f64]], first: f64) -> Option<Seen> {
    let mut series: Vec<Vec<f64>> = (0..LAGS).map(|lag| products(all, lag)).collect();
    let n = series[0].len();
    let still = std::array::from_fn(|lag| series[lag].iter().sum::<f64>() / n as f64);
    for (x, mean) in series.iter_mut().zip(still) {
        x.iter_mut().for_each(|v| *v -= mean);
    }
    let powers: Vec<Vec<f64>> = series.iter().map(|x| power(x)).collect();
    let about: Vec<Vec<f64>> = powers.iter().map(|p| means(p)).collect();
    let height = |k: usize| {
        (0..FIRST_LAGS)
            .map(|lag| powers[lag][k] / about[lag][k / ABOUT])
            .sum::<f64>()
    };
    let places = (first * n as f64).ceil() as usize..n / 2 - (first * n as f64) as usize;
    let place = places.max_by(|a, b| height(*a).total_cmp(&height(*b)))?;
    if height(place) < HEIGHT {
        return None;
    }
    let near = (-8..=8).map(|d| (place as f64 + f64::from(d) / 8.0) / n as f64);
    let strength = |turns: f64| {
        (0..FIRST_LAGS)
            .map(|lag| coefficient(&series[lag], turns).norm_sqr())
            .sum::<f64>()
    };
    let turns = near.max_by(|a, b| strength(*a).total_cmp(&strength(*b)))?;
    let mut beating = [[Complex::default(); LAGS]; MULTIPLES];
    let mut errors = [[0.0; LAGS]; MULTIPLES];
    for k in 0..MULTIPLES {
        let turns = turns * (k + 1) as f64;
        let folded = (turns - turns.round()).abs();
        let bin = ((folded * n as f64) as usize / ABOUT).min(about[0].len() - 1);
        for lag in 0..LAGS {
            beating[k][lag] = coefficient(&series[lag], turns);
            // Of its real and its imaginary part.
            errors[k][lag] = (0.5 * about[lag][bin]).sqrt() / n as f64;
        }
    }
    Some(Seen {
        turns,
        still,
        beating,
        errors,
    })
}

/// Squares that are left of `y` beside `columns`, which are changed.
fn left(mut y: Vec<f64>, mut columns: Vec<Vec<f64>>) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    for i in 0..columns.len() {
        let own = columns[i].clone();
        let square = dot(&own, &own);
        if square > 0.0 {
            for other in columns[i + 1..].iter_mut().chain([&mut y]) {
                let part = dot(&own, other) / square;
                other.iter_mut().zip(&own).for_each(|(v, o)| *v -= part * o);
            }
        }
    }
    dot(&y, &y)
}

impl Seen {
    /// What is seen over its errors: at rest, then the beats, turned back by `phase`, or their mirror image.
    fn values(&self, phase: f64, mirrored: bool) -> Vec<f64> {
        let mut all: Vec<f64> = self.still.iter().map(|v| v / STILL).collect();
        for k in 0..MULTIPLES {
            let turn = Complex::from_polar(1.0, -phase * (k + 1) as f64);
            for (v, e) in self.beating[k].iter().zip(&self.errors[k]) {
                let v = turn * if mirrored { v.conj() } else { *v } / e;
                all.extend([v.re, v.im]);
            }
        }
        all
    }

    /// What each autocovariance of the readings that came makes, over the errors.
    fn columns(&self, curve: Curve, rate: f64) -> Vec<Vec<f64>> {
        let of = |j: usize| {
            let at = |lag: usize| {
                let u = rate * lag as f64;
                let (a, b) = (curve.in_common(u - j as f64), curve.in_common(u + j as f64));
                let both = |k: usize| if j == 0 { a[k] } else { a[k] + b[k] };
                std::array::from_fn::<_, { MULTIPLES + 1 }, _>(both)
            };
            let all: Vec<_> = (0..LAGS).map(at).collect();
            let mut column: Vec<f64> = all.iter().map(|b| b[0].re / STILL).collect();
            for k in 0..MULTIPLES {
                for (b, e) in all.iter().zip(&self.errors[k]) {
                    column.extend([b[k + 1].re / e, b[k + 1].im / e]);
                }
            }
            column
        };
        (0..OF_THOSE).map(of).collect()
    }

    /// Squares that are left beside a curve through readings of a rate, at the best phase.
    fn left_of(&self, curve: Curve, rate: f64, mirrored: bool) -> f64 {
        const PHASES: i32 = 64;
        let columns = self.columns(curve, rate);
        let left = |phase: f64| left(self.values(phase, mirrored), columns.clone());
        let step = TAU / f64::from(PHASES);
        let best = (0..PHASES)
            .map(|i| step * f64::from(i))
            .min_by(|a, b| left(*a).total_cmp(&left(*b)))
            .unwrap_or(0.0);
        left(numerics::minimise::golden(
            &left,
            best - step,
            best + step,
            20,
        ))
    }

    /// Squares of what beats.
    fn beats(&self) -> f64 {
        self.values(0.0, false)[LAGS..].iter().map(|v| v * v).sum()
    }

    /// Squares that are left beside a noise whose size swings.
    fn left_of_swing(&self) -> f64 {
        let mut columns = vec![];
        for (k, imaginary) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let mut column = vec![0.0; LAGS + 2 * LAGS * MULTIPLES];
            for lag in 0..LAGS {
                column[LAGS + 2 * (k * LAGS + lag) + imaginary] =
                    self.still[lag] / self.errors[k][lag];
            }
            columns.push(column);
        }
        let mut values = self.values(0.0, false);
        values[..LAGS].fill(0.0);
        left(values, columns)
    }

    fn told(&self) -> Option<Beats> {
        let mut all = vec![];
        for m in 0..=MOST_RATES {
            for mirrored in [false, true] {
                let rate = m as f64 + if mirrored { -self.turns } else { self.turns };
                if rate > 0.0 {
                    let least = Curve::ALL
                        .map(|curve| self.left_of(curve, rate, mirrored))
                        .into_iter()
                        .fold(f64::INFINITY, f64::min);
                    all.push((rate, least));
                }
            }
        }
        all.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (_, least) = *all.first()?;
        let free = (LAGS + 2 * LAGS * MULTIPLES - OF_THOSE - 1) as f64;
        let swinging = self.left_of_swing();
        let made = least < (1.0 - MADE) * self.beats();
        let holds = made && (least < ALL * free || swinging - least > BETTER);
        holds.then(|| Beats {
            rates: all
                .iter()
                .filter(|(_, left)| *left < least + OUT)
                .map(|(rate, _)| *rate)
                .collect(),
            swing: 2.0 * self.beating[0][0].norm() / self.still[0],
        })
    }
}

/// Whether readings of some gyros, about their level, lie on a curve between others; `first`, cycles a frame, from which on what beats
/// is no drift.
pub fn beats(all: &[&[f64]], first: f64) -> Option<Beats> {
    seen(all, first)?.told()
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal, Uniform};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    const ROWS: usize = 20_000;
    const FIRST: f64 = 0.002;

    /// Independent readings, from one moment to the next as `of` makes them, in standard deviations.
    fn made(
        rng: &mut Xoshiro256PlusPlus,
        count: usize,
        mut of: impl FnMut(usize, f64) -> f64,
    ) -> Vec<f64> {
        let mut all: Vec<f64> = (0..count)
            .map(|i| of(i, StandardNormal.sample(rng)))
            .collect();
        let square = all.iter().map(|v| v * v).sum::<f64>() / count as f64;
        all.iter_mut().for_each(|v| *v /= square.sqrt());
        all
    }

    #[test]
    fn one_axis_on_a_curve_tells_the_rate_of_any_curve() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        for curve in Curve::ALL {
            for came in [0.37, 0.81, 1.31] {
                let x = made(&mut rng, (ROWS as f64 * came) as usize + 20, |_, own| own);
                let at = |i: usize| {
                    let t = 8.0 + came * i as f64;
                    let near = t as usize - 6..=t as usize + 7;
                    near.map(|a| x[a] * curve.through_one(t - a as f64)).sum()
                };
                let y: Vec<f64> = (0..ROWS).map(at).collect();
                let square = y.iter().map(|v| v * v).sum::<f64>() / ROWS as f64;
                let y: Vec<f64> = y.iter().map(|v| v / square.sqrt()).collect();
                let told = beats(&[&y], FIRST).expect("a beat");
                assert_eq!(told.rates.len(), 1, "{curve:?} {came}: {:?}", told.rates);
                assert!((told.rates[0] - came).abs() < 1e-4, "{:?}", told.rates);
            }
        }
    }

    #[test]
    fn a_noise_whose_size_swings_and_a_steady_one_lie_on_no_curve() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        let within = |rng: &mut _, low, high| Uniform::new(low, high).expect("a range").sample(rng);
        for draw in 0..40 {
            let turns: f64 = within(&mut rng, 0.003, 0.49);
            let swing = if draw % 4 == 0 {
                0.0
            } else {
                within(&mut rng, 0.02, 0.9)
            };
            let alike = if draw % 2 == 0 {
                0.0
            } else {
                within(&mut rng, -0.5, 0.9)
            };
            let mut last = 0.0;
            let y = made(&mut rng, ROWS, |i, own| {
                last = alike * last + own;
                last * (1.0 + swing * (TAU * turns * i as f64).cos())
            });
            let told = beats(&[&y], FIRST);
            assert!(
                told.is_none(),
                "swing {swing} at {turns}, neighbours {alike}: {:?}",
                told.map(|t| t.rates)
            );
        }
    }
}
