//! A level that settles from the first reading on: after power-up, a change of range, a turn before the record.
//!
//! Where it begins dozens of standard deviations off, its first readings are too far off to be believed as noise, and move as a base
//! does. A times exp(-i / readings) with what is left of it less than any of that is taken off before either is asked.

use numerics::minimise::golden;

/// Least size at the first reading, standard deviations: what single readings need to be too far off.
const FAR: f64 = 5.0;
/// Shortest time constant, readings, and the part of the record that the longest is.
const SHORTEST: f64 = 4.0;
const LONGEST: f64 = 1.0 / 16.0;
/// Time constants of readings that are fitted.
const FITTED: f64 = 8.0;
/// Part of the squares about the mean that the course makes, and time constants after which it is told by what is left whether it ends.
const MADE: f64 = 0.5;
const FIRST: f64 = 3.0;
/// Most that is left then, over the white noise: a swing leaves more.
const SWINGS: f64 = 2.0;
/// Standard errors of a variance by which what is left before may be more: a step and a ramp leave more.
const ERRORS: f64 = 4.0;

/// One of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Settling {
    amplitude: f64,
    /// Time constant, readings.
    readings: f64,
}

/// A fit of one time constant.
struct Fit {
    amplitude: f64,
    /// Squares that are left of the first time constants and of the rest, and of both about the mean.
    left: [f64; 2],
    about_mean: f64,
    counts: [f64; 2],
}

/// A straight line on exp(-i / readings) through those of `y` that are finite, up to so many readings.
fn fit(y: &[f64], readings: f64, end: usize) -> Option<Fit> {
    let all = || {
        let known = y[..end].iter().enumerate().filter(|(_, v)| v.is_finite());
        known.map(|(i, v)| (i as f64, (-(i as f64) / readings).exp(), *v))
    };
    let n = all().count() as f64;
    let mean = |of: &dyn Fn((f64, f64, f64)) -> f64| all().map(of).sum::<f64>() / n;
    let (x, m) = (mean(&|a| a.1), mean(&|a| a.2));
    let (sxx, sxy) = all().fold([0.0; 2].into(), |(xx, xy): (f64, f64), (_, e, v)| {
        (xx + (e - x).powi(2), xy + (e - x) * (v - m))
    });
    let amplitude = sxy / sxx;
    let (mut left, mut counts, mut about_mean) = ([0.0; 2], [0.0; 2], 0.0);
    for (i, e, v) in all() {
        let part = usize::from(i >= FIRST * readings);
        left[part] += (v - m - amplitude * (e - x)).powi(2);
        counts[part] += 1.0;
        about_mean += (v - m).powi(2);
    }
    let enough = counts.iter().all(|c| *c >= SHORTEST) && sxx > 0.0;
    enough.then_some(Fit {
        amplitude,
        left,
        about_mean,
        counts,
    })
}

impl Settling {
    /// That of readings with white noise of `sigma`, NaN where there is none, the levels of which jump nowhere before `end`.
    pub(super) fn of(y: &[f64], sigma: f64, end: usize) -> Option<Self> {
        let longest = LONGEST * y.len() as f64;
        let end_of = |readings: f64| ((FITTED * readings) as usize).min(end);
        let offs = std::iter::successors(Some(SHORTEST), |r| Some(2.0 * r));
        // What part of the squares over its own span it makes.
        let made = |readings: f64| {
            let f = fit(y, readings, end_of(readings))?;
            Some((1.0 - (f.left[0] + f.left[1]) / f.about_mean, f))
        };
        let all = offs.take_while(|r| *r <= longest).filter_map(|r| {
            let (made, f) = made(r)?;
            (f.amplitude.abs() > FAR * sigma).then_some((r, made))
        });
        let (near, _) = all.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let end = end_of(2.0 * near);
        let squares =
            |r: f64| fit(y, r.exp(), end).map_or(f64::INFINITY, |f| f.left[0] + f.left[1]);
        let readings = golden(&squares, (0.5 * near).ln(), (2.0 * near).ln(), 25).exp();
        let f = fit(y, readings, end_of(readings))?;
        let [first, rest] = [0, 1].map(|i| f.left[i] / f.counts[i]);
        let holds = f.amplitude.abs() > FAR * sigma
            && f.left[0] + f.left[1] < (1.0 - MADE) * f.about_mean
            && rest < SWINGS * sigma * sigma
            && first < (1.0 + ERRORS * (2.0 / f.counts[0]).sqrt()) * rest.max(sigma * sigma);
        holds.then_some(Self {
            amplitude: f.amplitude,
            readings,
        })
    }

    /// Adds it to readings from the first on, `sign` times.
    pub(super) fn add(self, y: &mut [f64], sign: f64) {
        // Of what is left of it after so many time constants nothing is seen.
        const GONE: f64 = 40.0;
        for (i, v) in y
            .iter_mut()
            .enumerate()
            .take((GONE * self.readings) as usize)
        {
            *v += sign * self.amplitude * (-(i as f64) / self.readings).exp();
        }
    }
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    const ROWS: usize = 20_000;

    /// White noise of 1 about a course.
    fn about(seed: u64, course: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut noise = || -> f64 { StandardNormal.sample(&mut rng) };
        (0..ROWS).map(|i| course(i as f64) + noise()).collect()
    }

    #[test]
    fn one_of_ten_to_a_thousand_sigma_is_taken_off_to_less_than_half_a_sigma() {
        for (seed, (size, readings)) in
            [(10.0, 40.0), (-30.0, 6.0), (100.0, 300.0), (-1000.0, 25.0)]
                .into_iter()
                .enumerate()
        {
            let course = |i: f64| size * (-i / readings).exp();
            let y = about(seed as u64, course);
            let found = Settling::of(&y, 1.0, ROWS).expect("settles");
            let mut left: Vec<f64> = (0..ROWS).map(|i| course(i as f64)).collect();
            found.add(&mut left, -1.0);
            let most = left.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            assert!(most < 2.0, "{size} {readings}: {most} of {found:?}");
            let rms = (left.iter().map(|v| v * v).sum::<f64>() / readings).sqrt();
            assert!(rms < 0.6, "{size} {readings}: {rms} of {found:?}");
        }
    }

    #[test]
    fn a_step_a_swing_a_ramp_and_noise_settle_nowhere() {
        let courses: [&dyn Fn(f64) -> f64; 5] = [
            &|_| 0.0,
            &|i| if i < 60.0 { 20.0 } else { 0.0 },
            &|i| 20.0 * (i / 300.0).cos(),
            &|i| 0.01 * i,
            &|i| 20.0 * (-0.5 * ((i - 200.0) / 50.0).powi(2)).exp(),
        ];
        for (seed, course) in courses.into_iter().enumerate() {
            let y = about(10 + seed as u64, course);
            assert_eq!(Settling::of(&y, 1.0, ROWS), None, "course {seed}");
        }
    }
}
