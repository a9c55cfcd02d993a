//! The best estimate of an oscillation from channels that read it in noise.
//!
//! Both quadratures of an oscillation of half width h turn into each other, keep exp(-h) of themselves from a sample to the next, and
//! are driven by white noise. A channel reads one quadrature, so it shows the oscillation at positive frequencies and its image at
//! negative ones: of a slow or a wide one they overlap. The smoother of that process (Kalman's filter forward, Rauch, Tung and
//! Striebel, 1965, back, in the stationary state of both) is the Wiener filter, and knows the image for what it is.

use std::f64::consts::PI;

/// Half widths to either side of an oscillation at which the noise beside it is read, at most, and the part of the way to 0 and to half the
/// sample rate that they are at most: of a Lorentzian a filter of its width has there what is known and taken off, but of a tone, which
/// stays nearer, less.
const BESIDE: f64 = 300.0;
const WAY: f64 = 0.5;
/// Least white noise beside an oscillation, over its variance: its skirts hide less.
const LEAST_NOISE: f64 = 1e-3;

/// A complex filter of one pole, centre and half width in rad per sample: its gain at the centre is 1.
#[derive(Clone, Copy)]
struct Pole {
    pole: [f64; 2],
    into: f64,
}

impl Pole {
    fn new(omega: f64, half_width: f64) -> Self {
        let kept = (-half_width).exp();
        let (sin, cos) = omega.sin_cos();
        Self {
            pole: [kept * cos, kept * sin],
            into: 1.0 - kept,
        }
    }

    /// The next value, of the one before and what comes in.
    fn next(&self, [a, b]: [f64; 2], by: [f64; 2]) -> [f64; 2] {
        let [c, s] = self.pole;
        [
            c * a - s * b + self.into * by[0],
            s * a + c * b + self.into * by[1],
        ]
    }

    /// Mean square of what it passes, and of white noise of variance 1.
    fn passes(&self, values: &[f64], mean: f64) -> [f64; 2] {
        let mut at = [0.0; 2];
        let sum: f64 = (values.iter())
            .map(|v| {
                at = self.next(at, [v - mean, 0.0]);
                at[0] * at[0] + at[1] * at[1]
            })
            .sum();
        let kept = 1.0 - self.into;
        let of_white = self.into * self.into / (1.0 - kept * kept);
        [sum / values.len() as f64, of_white]
    }
}

/// An oscillation that a channel reads.
pub(super) struct Read<'a> {
    values: &'a [f64],
    mean: f64,
    /// Phase by which the one that is sought is ahead of it.
    phase: f64,
    variance: f64,
    /// Its density at its centre over that of the noise there.
    pub(super) height: f64,
}

impl<'a> Read<'a> {
    /// Of a centre and a half width, rad per sample, in readings; none where there is none.
    pub(super) fn new(values: &'a [f64], phase: f64, omega: f64, half_width: f64) -> Option<Self> {
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        // Of an oscillation of the same half width a filter passes half of what lies at positive frequencies, which is half of its
        // variance; away from the centre less by a Lorentzian of twice that half width.
        let at = |centre: f64| Pole::new(centre, half_width).passes(values, mean);
        let [middle, white] = at(omega);
        let beside = WAY * omega.min(PI - omega) / half_width;
        let beside = beside.min(BESIDE);
        let sides = [-beside, beside].map(|off| at(omega + off * half_width)[0]);
        let side = sides[0].min(sides[1]);
        let reaches = (1.0 + (0.5 * beside).powi(2)).recip();
        let variance = 4.0 * (middle - side) / (1.0 - reaches);
        let noise = (side - reaches * middle) / (1.0 - reaches) / white;
        let noise = noise.max(LEAST_NOISE * variance);
        (variance > 0.0).then(|| Self {
            values,
            mean,
            phase,
            variance,
            height: variance / (half_width * noise),
        })
    }
}

/// The best estimate of an oscillation of which either quadrature has the standard deviation 1.
pub(super) struct Estimate {
    /// Both quadratures at each sample.
    pub turning: Vec<[f64; 2]>,
    /// The part of the variance of either that is not known.
    pub unknown: [f64; 2],
    /// How many times as wide as it is what is not known.
    pub wider: f64,
}

type Matrix = [[f64; 2]; 2];

const ONE: Matrix = [[1.0, 0.0], [0.0, 1.0]];

fn sum(a: &Matrix, b: &Matrix, times: f64) -> Matrix {
    [0, 1].map(|i| [0, 1].map(|k| a[i][k] + times * b[i][k]))
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    [0, 1].map(|i| [0, 1].map(|k| a[i][0] * b[0][k] + a[i][1] * b[1][k]))
}

fn transposed(a: &Matrix) -> Matrix {
    [[a[0][0], a[1][0]], [a[0][1], a[1][1]]]
}

fn determinant(a: &Matrix) -> f64 {
    a[0][0] * a[1][1] - a[0][1] * a[1][0]
}

fn inverse(a: &Matrix) -> Matrix {
    let by = determinant(a).recip();
    [[by * a[1][1], -by * a[0][1]], [-by * a[1][0], by * a[0][0]]]
}

fn times(a: &Matrix, [x, y]: [f64; 2]) -> [f64; 2] {
    [a[0][0] * x + a[0][1] * y, a[1][0] * x + a[1][1] * y]
}

/// Doublings that make a stationary state: of a process that forgets in 2^40 samples.
const DOUBLINGS: usize = 40;

/// The stationary smoother of an oscillation.
struct Smoother {
    /// What is expected of the next sample, of what is known of this one with and without what was read there.
    forward: Matrix,
    /// Of what channels read over their noise.
    gain: Matrix,
    /// How much of what the next sample turned out to be otherwise goes for this one, and its own turn.
    back: Matrix,
    turn: Matrix,
    unknown: [f64; 2],
    /// The half width of what is not known.
    half_width: f64,
}

impl Smoother {
    /// Of a centre and a half width, rad per sample, of which channels tell so much at each.
    fn new(omega: f64, half_width: f64, told: &Matrix) -> Self {
        let kept = (-half_width).exp();
        let (sin, cos) = omega.sin_cos();
        let turn = [[kept * cos, -kept * sin], [kept * sin, kept * cos]];
        let driven = 1.0 - kept * kept;
        // The doubling algorithm for Riccati's equation (Anderson, 1978): the covariance of what is expected.
        let mut a = transposed(&turn);
        let mut g = *told;
        let mut expected = [[driven, 0.0], [0.0, driven]];
        for _ in 0..DOUBLINGS {
            let over = inverse(&sum(&ONE, &product(&g, &expected), 1.0));
            let step = product(&over, &a);
            let more = product(&product(&transposed(&a), &expected), &step);
            let told = product(&product(&a, &product(&over, &g)), &transposed(&a));
            (a, g, expected) = (
                product(&a, &step),
                sum(&g, &told, 1.0),
                sum(&expected, &more, 1.0),
            );
        }
        let filtered = product(
            &expected,
            &inverse(&sum(&ONE, &product(told, &expected), 1.0)),
        );
        let keeps = sum(&ONE, &product(&filtered, told), -1.0);
        let forward = product(&keeps, &turn);
        let back = product(&product(&filtered, &transposed(&turn)), &inverse(&expected));
        // Of what is left of the filter each sample takes off what the next one tells.
        let taken = product(&product(&back, &expected), &transposed(&back));
        let (mut by, mut left) = (back, sum(&filtered, &taken, -1.0));
        for _ in 0..DOUBLINGS {
            let more = product(&product(&by, &left), &transposed(&by));
            left = sum(&left, &more, 1.0);
            by = product(&by, &by);
        }
        Self {
            forward,
            gain: filtered,
            back,
            turn,
            unknown: [0, 1].map(|i| left[i][i].clamp(0.0, 1.0)),
            half_width: -0.5 * determinant(&forward).ln(),
        }
    }

    /// The estimate, of what channels read over their noise at each sample.
    fn over(&self, mut read: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
        let mut at = [0.0; 2];
        for v in &mut read {
            let (by_past, by_read) = (times(&self.forward, at), times(&self.gain, *v));
            at = [by_past[0] + by_read[0], by_past[1] + by_read[1]];
            *v = at;
        }
        let mut next = at;
        for v in read.iter_mut().rev().skip(1) {
            let expected = times(&self.turn, *v);
            let more = times(&self.back, [next[0] - expected[0], next[1] - expected[1]]);
            next = [v[0] + more[0], v[1] + more[1]];
            *v = next;
        }
        read
    }
}

/// The oscillation of a centre and a half width, rad per sample, that all of these read.
pub(super) fn read_from(all: &[Read<'_>], omega: f64, half_width: f64) -> Estimate {
    // Its density at its centre is its variance over its half width: each tells by how far it stands above its noise.
    let mut told = [[0.0; 2]; 2];
    let parts: Vec<[f64; 2]> = (all.iter())
        .map(|r| {
            let (sin, cos) = r.phase.sin_cos();
            let over_noise = half_width * r.height;
            let own = [[cos * cos, cos * sin], [cos * sin, sin * sin]];
            told = sum(&told, &own, over_noise);
            let scale = over_noise / r.variance.sqrt();
            [scale * cos, scale * sin]
        })
        .collect();
    let smoother = Smoother::new(omega, half_width, &told);
    let samples = 0..all.first().map_or(0, |r| r.values.len());
    let read = samples.map(|i| {
        let mut sum = [0.0; 2];
        for (r, part) in all.iter().zip(&parts) {
            let v = r.values[i] - r.mean;
            sum = [sum[0] + part[0] * v, sum[1] + part[1] * v];
        }
        sum
    });
    let mut turning = smoother.over(read.collect());
    // What is known of a variance of 1 it has in this record.
    let scale = [0, 1].map(|part| {
        let squares = turning.iter().map(|z| z[part] * z[part]);
        let found = squares.sum::<f64>() / turning.len().max(1) as f64;
        ((1.0 - smoother.unknown[part]) / found.max(f64::MIN_POSITIVE)).sqrt()
    });
    for z in &mut turning {
        *z = [scale[0] * z[0], scale[1] * z[1]];
    }
    Estimate {
        turning,
        unknown: smoother.unknown,
        wider: smoother.half_width / half_width,
    }
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    #[test]
    fn an_oscillation_is_read_from_noise_as_well_as_its_height_lets_it() {
        for (omega, half) in [
            (1.1, 0.005),
            (1.1, 0.05),
            (1.6, 0.1),
            (0.02, 0.0006),
            (0.3, 0.05),
        ] {
            is_read_as_well(omega, half);
        }
    }

    fn is_read_as_well(omega: f64, half: f64) {
        let n = 200_000;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let kept = (-half).exp();
        let (sin, cos) = omega.sin_cos();
        let driven = (1.0 - kept * kept).sqrt();
        let mut z = [normal(), normal()];
        let true_z: Vec<[f64; 2]> = (0..n)
            .map(|_| {
                let turned = [cos * z[0] - sin * z[1], sin * z[0] + cos * z[1]];
                z = turned.map(|v| kept * v + driven * normal());
                z
            })
            .collect();
        for (noise, channels) in [(0.5, 1), (3.0, 1), (3.0, 3)] {
            // Each with a phase of its own.
            let read: Vec<Vec<f64>> = (0..channels)
                .map(|k| {
                    let (sin, cos) = f64::from(k).sin_cos();
                    let of = |z: &[f64; 2]| 0.2 * (cos * z[0] + sin * z[1]);
                    true_z
                        .iter()
                        .map(|z| of(z) + 0.2 * noise * normal())
                        .collect()
                })
                .collect();
            let read = read.iter().enumerate();
            let all = read.map(|(k, v)| Read::new(v, k as f64, omega, half).unwrap());
            let all: Vec<Read<'_>> = all.collect();
            let Estimate {
                turning, unknown, ..
            } = read_from(&all, omega, half);
            let known = 1.0 - 0.5 * (unknown[0] + unknown[1]);
            let product = |a: &[[f64; 2]], b: &[[f64; 2]]| -> f64 {
                let each = a.iter().zip(b).map(|(a, b)| a[0] * b[0] + a[1] * b[1]);
                each.sum::<f64>() / n as f64
            };
            // Of the best estimate m of z both E[m z*] and E|m|^2 are the known part of E|z|^2 = 2.
            let height: f64 = f64::from(channels) / (half * noise * noise);
            let expected = 1.0 - (1.0 + height).sqrt().recip();
            // Where the filter of that height reaches to the image, less is known.
            if omega > 3.0 * half * (1.0 + height).sqrt() {
                assert!(
                    (known - expected).abs() < 0.03,
                    "{omega} {half}: {known} {expected}"
                );
            }
            for of in [product(&turning, &true_z), product(&turning, &turning)] {
                assert!(
                    (0.5 * of - known).abs() < 0.05,
                    "{omega} {half}: {of} {known}"
                );
            }
        }
        let noise: Vec<f64> = (0..n).map(|_| normal()).collect();
        let read = Read::new(&noise, 0.0, omega, half);
        let known = read.map_or(0.0, |r| 1.0 - read_from(&[r], omega, half).unknown[0]);
        assert!(known < 0.2, "{known}");
    }
}
