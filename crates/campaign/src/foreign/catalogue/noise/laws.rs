//! White noise of another law than the normal one.

use super::super::super::prelude::*;

/// Least and largest share of the variance that leans; below the least the law is normal, as far as can be seen.
const SHARES: (f64, f64) = (0.05, 0.95);

/// d' of `n` readings of a law, by its density, against the normal one.
fn against_normal((count, reach): (i32, f64), law: &dyn Fn(f64) -> f64, n: usize) -> Known {
    let cells = |of: &dyn Fn(f64) -> f64| cells(count, reach, of);
    Known::Strength(of_law(&cells(law), &cells(&normal), n))
}

/// Density, at x, of the sum of a uniform part, `share` of a variance of 1, and a normal rest.
fn with_uniform(share: f64, x: f64) -> f64 {
    let (half, rest) = ((3.0 * share).sqrt(), (1.0 - share).max(1e-6).sqrt());
    (below((x + half) / rest) - below((x - half) / rest)) / (2.0 * half)
}

/// Density, at x, of what has variance 1: a sine of any phase, `share` of the variance, and a normal rest.
fn with_sine(share: f64, x: f64) -> f64 {
    const PHASES: i32 = 96;
    let (size, rest) = ((2.0 * share).sqrt(), (1.0 - share).max(1e-4).sqrt());
    let at = |i: i32| {
        let phase = PI * (f64::from(i) + 0.5) / f64::from(PHASES);
        normal((x - size * phase.cos()) / rest)
    };
    (0..PHASES).map(at).sum::<f64>() / f64::from(PHASES) / rest
}

/// Density, at x, of what has mean 0 and variance 1: an exponential law about its mean, `share` of the variance, and a
/// normal rest (Grushka 1972).
fn leans(share: f64, x: f64) -> f64 {
    let (rate, rest) = (1.0 / share.sqrt(), 1.0 - share);
    let off = rate * rest - 1.0 / rate - x;
    let tail = statrs::function::erf::erfc(off / (2.0 * rest).sqrt());
    0.5 * rate * (rate * (off - 0.5 * rate * rest)).exp() * tail
}

/// d' of noise whose variance is drawn anew for each sample, a share of it exponential, against the normal law of the same
/// variance. At share 1 it is the law of Laplace.
fn of_exponential_variance(share: f64, n: usize) -> f64 {
    const CELLS: i32 = 800;
    const SIZES: usize = 100;
    // Each of equal chance.
    let size = |k| 1.0 - share - share * (1.0 - (k as f64 + 0.5) / SIZES as f64).ln();
    let sizes: Vec<f64> = (0..SIZES).map(size).collect();
    let normal = |x: f64, v: f64| (-0.5 * x * x / v).exp() / (TAU * v).sqrt();
    let cells = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let at = |i: i32| 12.0 * (f64::from(i) + 0.5) / f64::from(CELLS);
        let all: Vec<f64> = (-CELLS..CELLS).map(|i| of(at(i))).collect();
        let sum: f64 = all.iter().sum();
        each(&all, |p| p / sum)
    };
    let mean = mean(&sizes);
    let mixed = cells(&|x| sizes.iter().map(|v| normal(x, v / mean)).sum::<f64>());
    of_law(&mixed, &cells(&|x| normal(x, 1.0)), n)
}

/// Laplace noise, so that the kurtosis shows.
pub(super) fn laplace(draw: &mut Draw, stand: &Stand) -> Shape {
    let noise = stand.series(|_| draw.sign() * draw.exponential() / 2f64.sqrt());
    Shape::Fixed(Known::Strength(f64::NAN), Change::Noise(noise, 1.0))
}

/// An exponential law about its mean, in part.
pub(super) fn skewed(draw: &mut Draw, stand: &Stand) -> Shape {
    let noise = stand.series(|_| draw.exponential() - 1.0);
    Shape::Fixed(Known::Strength(f64::NAN), Change::Noise(noise, 0.7))
}

/// A dither of even law, as converters add it, makes up a part of the noise.
pub(super) fn uniform_part(draw: &mut Draw, stand: &Stand) -> Shape {
    let half = 3f64.sqrt();
    let dither = stand.series(|_| draw.between(-half, half));
    let known = |stand: &Stand, share| {
        against_normal((1200, 6.0), &|x| with_uniform(share, x), stand.samples())
    };
    share(0.999, known, dither)
}

/// A tone far above the samples' rate, from a switched supply or the part's own drive, whose clock is so unsteady that
/// each sample catches it at another phase: no line is left, but values that crowd at its two crests.
pub(super) fn any_phase(draw: &mut Draw, stand: &Stand) -> Shape {
    let tone = stand.series(|_| 2f64.sqrt() * draw.phase().sin());
    let known = |stand: &Stand, share| {
        against_normal((400, 6.0), &|x| with_sine(share, x), stand.samples())
    };
    share(0.98, known, tone)
}

/// White noise on the way to Laplace's law: its tails are heavy, and nothing in time tells.
pub(super) fn double_exponential() -> Shape {
    noise(
        0.999,
        |stand, share| Known::Strength(of_exponential_variance(share, stand.samples())),
        |stand, draw, share| {
            stand.series(|_| (1.0 - share + share * draw.exponential()).sqrt() * draw.normal())
        },
    )
}

/// Sparks at the brushes, each with a tail to the side the current flows: skewed one way while the motor turns forward, the
/// other way backward, and not at rest. Its size stays.
pub(super) fn leaning(draw: &mut Draw, stand: &mut Stand) -> Shape {
    with_rests(draw, stand, DWELL, 0.3);
    let turning = stand.world.duty.iter().filter(|d| **d != 0.0).count();
    let sense = draw.sign();
    let series = each(&stand.world.duty, |d| {
        if d == 0.0 {
            draw.normal()
        } else {
            sense * d.signum() * (draw.exponential() - 1.0)
        }
    });
    sized(
        SHARES.1,
        move |_, share| {
            let share = share.max(SHARES.0);
            against_normal((1200, 8.0), &|x| leans(share, x), turning)
        },
        |_, _, share| Change::Noise(series, share.max(SHARES.0)),
    )
}
