//! One source that several axes feel: a stand that shakes turns about all of them.
//!
//! An oscillation on an axis is the real part of A z(t), z a complex envelope that turns at its centre. What another axis has of the same
//! source is the real part of B (r exp(i p) z(t) + sqrt(1 - r^2) z'(t)) with a z' of its own: r is the coherence of the two, p the
//! phase by which it is ahead. What a gyro has of the oscillation of an accelerometer follows what that read: of an oscillation of
//! half width h in white noise, k times as high as that, the best estimate is a Lorentzian filter of half width h sqrt(1 + k) either
//! way in time (Wiener).

use std::f64::consts::{PI, TAU};

use crate::effect::{ParameterSpec, Parameters, optional};
use crate::effects::correlated_noise::WITH;
use crate::parameter::Parameter;
use crate::simulate::Simulation;

/// Phases by the axis that they are counted from.
const PHASE: [&str; 6] = [
    "phase_to_gyro_x",
    "phase_to_gyro_y",
    "phase_to_gyro_z",
    "phase_to_acc_x",
    "phase_to_acc_y",
    "phase_to_acc_z",
];

const fn coherence(axis: usize) -> ParameterSpec {
    optional(
        WITH[axis],
        "1",
        "coherence with the same oscillation of the axis in the name, 0 to 1: its own is what is left",
    )
}

const fn phase(axis: usize) -> ParameterSpec {
    optional(
        PHASE[axis],
        "rad",
        "phase by which it is ahead of that of the axis in the name",
    )
}

/// The parameters that say what an oscillation has in common with that of another axis.
const PARAMETERS: [ParameterSpec; 12] = [
    coherence(0),
    coherence(1),
    coherence(2),
    coherence(3),
    coherence(4),
    coherence(5),
    phase(0),
    phase(1),
    phase(2),
    phase(3),
    phase(4),
    phase(5),
];

/// The `N` parameters of an oscillation, and those: `M` in all.
pub(crate) const fn with_shared<const N: usize, const M: usize>(
    own: [ParameterSpec; N],
) -> [ParameterSpec; M] {
    let mut all = [PARAMETERS[0]; M];
    let mut i = 0;
    while i < M {
        all[i] = if i < N { own[i] } else { PARAMETERS[i - N] };
        i += 1;
    }
    all
}

/// The axes whose oscillation this one says it is in part, and the coherence.
pub fn others(parameters: &Parameters) -> impl Iterator<Item = (&'static str, f64)> {
    stated(parameters)
        .map(|(k, coherence, _)| (PHASE[k].trim_start_matches("phase_to_"), coherence))
}

/// The same by the places of their names, and the phases.
fn stated(parameters: &Parameters) -> impl Iterator<Item = (usize, f64, f64)> {
    let value = |name: &str| parameters.get(name).map(|p| p.value);
    let names = WITH.iter().zip(PHASE).enumerate();
    names.filter_map(move |(k, (with, phase))| {
        Some((k, value(with)?.clamp(0.0, 1.0), value(phase)?))
    })
}

/// What says that an oscillation is, to a coherence and ahead by a phase, that of the axis of this name; none where no parameter
/// is called after that.
#[must_use]
pub fn of_axis(name: &str, coherence: (f64, f64), phase: (f64, f64)) -> Option<Parameters> {
    let called = |names: &[&'static str; 6], prefix: &str| {
        let mut names = names.iter();
        names
            .find(|n| n.strip_prefix(prefix) == Some(name))
            .copied()
    };
    let (with, behind) = (called(&WITH, "with_")?, called(&PHASE, "phase_to_")?);
    let both = [
        (with, Parameter::estimated(coherence.0, coherence.1, "1")),
        (behind, Parameter::estimated(phase.0, phase.1, "rad")),
    ];
    Some(both.map(|(name, p)| (name.to_owned(), p)).into())
}

/// Whether an oscillation is in part that of another axis of its kind; of gyros the accelerometers are none.
pub(crate) fn is_of_another(parameters: &Parameters, of_accelerometers: bool) -> bool {
    stated(parameters).any(|(k, ..)| of_accelerometers || k < 3)
}

/// Whether oscillations of two axes, of which one says that it is the other's, have one place: their centres lie within the wider of
/// them.
pub(crate) fn is_one(a: &Parameters, b: &Parameters, width: &str) -> bool {
    let value = |p: &Parameters, name: &str| p.get(name).map_or(f64::NAN, |p| p.value);
    let apart = (value(a, "center_frequency") - value(b, "center_frequency")).abs();
    let another = |p: &Parameters| is_of_another(p, true);
    (another(a) || another(b)) && apart <= value(a, width).max(value(b, width))
}

/// An oscillation of an axis in a run.
#[derive(Clone, Debug)]
pub struct Felt {
    axis: usize,
    center_hz: f64,
    /// Both quadratures of z at each sample.
    turning: Vec<[f64; 2]>,
}

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
struct Read<'a> {
    values: &'a [f64],
    mean: f64,
    /// Phase by which the one that is sought is ahead of it.
    phase: f64,
    variance: f64,
    /// Its density at its centre over that of the noise there.
    height: f64,
}

impl<'a> Read<'a> {
    /// Of a centre and a half width, rad per sample, in readings; none where there is none.
    fn new(values: &'a [f64], phase: f64, omega: f64, half_width: f64) -> Option<Self> {
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

/// The best estimate of an oscillation of the standard deviation 1.
struct Estimate {
    /// Both quadratures at each sample.
    turning: Vec<[f64; 2]>,
    /// The part of its variance that is known.
    known: f64,
    /// How many times as wide as it is what is not known.
    wider: f64,
}

/// The oscillation of a centre and a half width, rad per sample, that all of these read.
fn read_from(all: &[Read<'_>], omega: f64, half_width: f64) -> Estimate {
    let height: f64 = all.iter().map(|r| r.height).sum();
    // In noise of density 1 an oscillation of a pole q has S = c / (1 + q^2 - 2 q cos). S / (S + 1), which is the filter and the density of
    // what is not known, is of a pole p; the means of both are c / (1 - q^2) and (c p / q) / (1 - p^2).
    let q = (-half_width).exp();
    let c = height * (1.0 - q).powi(2);
    let off = 0.5 * (c + (1.0 - q).powi(2)) / q;
    let p = 1.0 + off - (off * (2.0 + off)).sqrt();
    let unknown = p / q * (1.0 - q * q) / (1.0 - p * p);
    let pole = Pole::new(omega, -p.ln());
    let back = Pole {
        pole: [pole.pole[0], -pole.pole[1]],
        ..pole
    };
    // Each over its size, by how far it stands above its noise.
    let parts: Vec<[f64; 2]> = (all.iter())
        .map(|r| {
            let scale = 2.0 * r.height / (1.0 + height) / r.variance.sqrt();
            [scale * r.phase.cos(), scale * r.phase.sin()]
        })
        .collect();
    let mut at = [0.0; 2];
    let mut turning: Vec<[f64; 2]> = (0..all.first().map_or(0, |r| r.values.len()))
        .map(|i| {
            let mut sum = [0.0; 2];
            for (r, part) in all.iter().zip(&parts) {
                let v = r.values[i] - r.mean;
                sum = [sum[0] + part[0] * v, sum[1] + part[1] * v];
            }
            at = pole.next(at, sum);
            at
        })
        .collect();
    at = [0.0; 2];
    for z in turning.iter_mut().rev() {
        at = back.next(at, *z);
        *z = at;
    }
    // What is known of a variance of 1 it has in this record, in either quadrature: what a wide filter has of the negative frequencies
    // adds to one and takes from the other.
    let scale = [0, 1].map(|part| {
        let squares = turning.iter().map(|z| z[part] * z[part]);
        let found = squares.sum::<f64>() / turning.len().max(1) as f64;
        ((1.0 - unknown) / found.max(f64::MIN_POSITIVE)).sqrt()
    });
    for z in &mut turning {
        *z = [scale[0] * z[0], scale[1] * z[1]];
    }
    Estimate {
        turning,
        known: 1.0 - unknown,
        wider: -p.ln() / half_width,
    }
}

/// The oscillation of a centre and a half width, rad per sample, that channels read, each with the phase by which the oscillation is
/// ahead of it: the best estimate of it, as a simulation makes it, of which the oscillation itself has the standard deviation 1. None
/// where none of them reads one.
#[must_use]
pub fn read(channels: &[(&[f64], f64)], omega: f64, half_width: f64) -> Option<Vec<f64>> {
    let all = channels.iter();
    let all = all.filter_map(|(values, phase)| Read::new(values, *phase, omega, half_width));
    let all: Vec<Read<'_>> = all.collect();
    (!all.is_empty()).then(|| {
        let read = read_from(&all, omega, half_width);
        read.turning.iter().map(|z| z[0]).collect()
    })
}

/// What an oscillation has of that of another axis.
pub(crate) struct Split {
    /// The part that is its own, by size.
    pub own: f64,
    /// What of the other's is not known, by size, and how many times as wide that is: of an oscillation in noise the error of its best
    /// estimate, a Lorentzian again.
    unread: Option<(f64, f64)>,
    /// z of the other at each sample, turned by the phase and times the coherence.
    shared: Vec<[f64; 2]>,
}

impl Split {
    fn new(coherence: f64, phase: f64, turning: &[[f64; 2]]) -> Self {
        let (sin, cos) = phase.sin_cos();
        let turned =
            |[a, b]: &[f64; 2]| [cos * a - sin * b, sin * a + cos * b].map(|v| coherence * v);
        Self {
            own: (1.0 - coherence * coherence).sqrt(),
            unread: None,
            shared: turning.iter().map(turned).collect(),
        }
    }
}

impl Simulation {
    /// Whether an oscillation of these parameters is kept for others that feel it: some do, and it is not another's itself.
    pub(crate) fn keeps(&self, parameters: &Parameters) -> bool {
        self.felt.is_some() && !is_of_another(parameters, self.of_accelerometers)
    }

    /// Adds to the rate of an axis what an oscillation of a size, centre and full width in Hz, has of another. Its own quadratures over
    /// its size, in `turning`, become those of the whole and are kept for others that feel it where it [`Simulation::keeps`] any.
    pub(crate) fn add_shared(
        &mut self,
        axis: usize,
        [size, center, width]: [f64; 3],
        split: &Split,
        mut turning: Vec<[f64; 2]>,
    ) {
        if let Some((part, wider)) = split.unread {
            let mut own = turning.iter_mut();
            let unit = size.max(f64::MIN_POSITIVE);
            self.add_mode(axis, part * size, center, wider * width, |z| {
                if let Some(own) = own.next() {
                    *own = [own[0] + z[0] / unit, own[1] + z[1] / unit];
                }
            });
        }
        for (rate, [z, _]) in self.rate[axis].iter_mut().zip(&split.shared) {
            *rate += size * z;
        }
        for (z, shared) in turning.iter_mut().zip(&split.shared) {
            *z = [z[0] + shared[0], z[1] + shared[1]];
        }
        if let Some(felt) = self.felt.as_mut().filter(|_| !turning.is_empty()) {
            felt.push(Felt {
                axis,
                center_hz: center,
                turning,
            });
        }
    }

    /// What an oscillation of an axis, centre and full width in Hz, has in common with that of another one, the nearest to its
    /// centre; all of it is its own where it says nothing of another, or that has none.
    pub(crate) fn split(
        &self,
        axis: usize,
        [center_hz, width_hz]: [f64; 2],
        parameters: &Parameters,
    ) -> Split {
        let (axes, read): (Vec<_>, Vec<_>) =
            stated(parameters).partition(|(k, ..)| *k < 3 || self.of_accelerometers);
        for (k, r, phase) in axes {
            let away = |f: &&Felt| (f.center_hz - center_hz).abs();
            let kept = self.felt.iter().flatten();
            let own = kept.filter(|f| f.axis == k % 3 && f.axis != axis);
            if let Some(felt) = own.min_by(|a, b| away(a).total_cmp(&away(b))) {
                return Split::new(r, phase, &felt.turning);
            }
        }
        let [omega, width] = [center_hz, width_hz].map(|f| TAU * f / self.rate_hz);
        let read = read.iter().filter_map(|(k, r, phase)| {
            Some((*r, Read::new(&self.acc[k % 3], *phase, omega, 0.5 * width)?))
        });
        let (coherences, read): (Vec<f64>, Vec<Read<'_>>) = read.unzip();
        if !read.is_empty() {
            let height: f64 = read.iter().map(|r| r.height).sum();
            let parts = coherences.iter().zip(&read).map(|(c, r)| c * r.height);
            let coherence = parts.sum::<f64>() / height;
            let of = read_from(&read, omega, 0.5 * width);
            let unread = coherence * (1.0 - of.known).sqrt();
            return Split {
                unread: Some((unread, of.wider)),
                ..Split::new(coherence, 0.0, &of.turning)
            };
        }
        Split {
            own: 1.0,
            unread: None,
            shared: vec![],
        }
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
        for (omega, half) in [(1.1, 0.005), (1.1, 0.05), (1.6, 0.1), (0.02, 0.0006)] {
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
            let Estimate { turning, known, .. } = read_from(&all.collect::<Vec<_>>(), omega, half);
            let product = |a: &[[f64; 2]], b: &[[f64; 2]]| -> f64 {
                let each = a.iter().zip(b).map(|(a, b)| a[0] * b[0] + a[1] * b[1]);
                each.sum::<f64>() / n as f64
            };
            // Of the best estimate m of z both E[m z*] and E|m|^2 are the known part of E|z|^2 = 2.
            let height: f64 = f64::from(channels) / (half * noise * noise);
            let expected = 1.0 - (1.0 + height).sqrt().recip();
            assert!(
                (known - expected).abs() < 0.03,
                "{omega} {half}: {known} {expected}"
            );
            for of in [product(&turning, &true_z), product(&turning, &turning)] {
                assert!(
                    (0.5 * of - expected).abs() < 0.05,
                    "{omega} {half}: {of} {expected}"
                );
            }
        }
        let noise: Vec<f64> = (0..n).map(|_| normal()).collect();
        let read = Read::new(&noise, 0.0, omega, half);
        let known = read.map_or(0.0, |r| read_from(&[r], omega, half).known);
        assert!(known < 0.2, "{known}");
    }
}
