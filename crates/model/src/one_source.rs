//! One source that several axes feel: a stand that shakes turns about all of them.
//!
//! An oscillation on an axis is the real part of A z(t), z a complex envelope that turns at its centre. What another axis has of the same
//! source is the real part of B (r exp(i p) z(t) + sqrt(1 - r^2) z'(t)) with a z' of its own: r is the coherence of the two, p the
//! phase by which it is ahead. What a gyro has of the oscillation of an accelerometer follows what that read: of an oscillation of
//! half width h in white noise, k times as high as that, the best estimate is a Lorentzian filter of half width h sqrt(1 + k) either
//! way in time (Wiener), where its image at negative frequencies is far away.

mod by_phase;
mod reading;

use std::f64::consts::TAU;

use crate::effect::{ParameterSpec, Parameters, optional};
use crate::effects::correlated_noise::WITH;
use crate::parameter::Parameter;
use crate::simulate::Simulation;
use by_phase::ByPhase;
pub use by_phase::Wander;
use reading::{Read, read_from};

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

/// The oscillation of a centre and a half width, rad per sample, that channels read, each with the phase by which the oscillation is
/// ahead of it: the best estimate of it, as a simulation makes it, of which the oscillation itself has the standard deviation 1. Of a
/// tone of which it is known how it wanders, by its phase. None where none of them reads one.
#[must_use]
pub fn read(
    channels: &[(&[f64], f64)],
    omega: f64,
    half_width: f64,
    wander: Option<Wander>,
) -> Option<Vec<f64>> {
    if let Some(told) = wander.and_then(|w| ByPhase::new(channels, w)) {
        let samples = channels.first().map_or(0, |c| c.0.len());
        return Some(told.expected(samples).iter().map(|z| z[0]).collect());
    }
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
    /// What of either quadrature of the other's is not known, by size, and how many times as wide that is: of an oscillation in noise
    /// the error of its best estimate, a Lorentzian again.
    unread: Option<([f64; 2], f64)>,
    /// z of the other at each sample, turned by the phase and times the coherence.
    shared: Vec<[f64; 2]>,
}

impl Split {
    /// Whether nothing of it is another's.
    pub(crate) fn is_own(&self) -> bool {
        self.shared.is_empty()
    }

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
        if let Some(([part, other], wider)) = split.unread {
            let mut own = turning.iter_mut();
            let unit = (part * size).max(f64::MIN_POSITIVE);
            self.add_mode(axis, part * size, center, wider * width, |z| {
                if let Some(own) = own.next() {
                    *own = [own[0] + part * z[0] / unit, own[1] + other * z[1] / unit];
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
        &mut self,
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
        if let Some(split) = self.split_by_phase(omega, &read, parameters) {
            return split;
        }
        let read = read.iter().filter_map(|(k, r, phase)| {
            Some((*r, Read::new(&self.acc[k % 3], *phase, omega, 0.5 * width)?))
        });
        let (coherences, read): (Vec<f64>, Vec<Read<'_>>) = read.unzip();
        if !read.is_empty() {
            let height: f64 = read.iter().map(|r| r.height).sum();
            let parts = coherences.iter().zip(&read).map(|(c, r)| c * r.height);
            let coherence = parts.sum::<f64>() / height;
            let of = read_from(&read, omega, 0.5 * width);
            let unread = of.unknown.map(|part| coherence * part.sqrt());
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

    /// What a tone of an angular frequency has of that of accelerometers, each with its coherence and phase, where it is known how it
    /// wanders and they tell its phase.
    fn split_by_phase(
        &mut self,
        omega: f64,
        read: &[(usize, f64, f64)],
        parameters: &Parameters,
    ) -> Option<Split> {
        let value = |name: &str| parameters.get(name).map(|p| p.value);
        let wander = Wander {
            omega,
            rms: TAU * value("pitch_rms")? / self.rate_hz,
            time: value("pitch_time")? * self.rate_hz,
        };
        let channels = read
            .iter()
            .map(|(k, _, phase)| (self.acc[k % 3].as_slice(), *phase));
        let told = ByPhase::new(&channels.collect::<Vec<_>>(), wander)?;
        let turning = told.drawn(self.samples, || self.normal());
        let coherence = read.iter().map(|r| r.1).sum::<f64>() / read.len() as f64;
        Some(Split::new(coherence, 0.0, &turning))
    }
}
