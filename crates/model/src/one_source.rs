//! One source that several axes feel: a stand that shakes turns about all of them.
//!
//! An oscillation on an axis is the real part of A z(t), z a complex envelope that turns at its centre. What another axis has of the same
//! source is the real part of B (r exp(i p) z(t) + sqrt(1 - r^2) z'(t)) with a z' of its own: r is the coherence of the two, p the
//! phase by which it is ahead.

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
pub(crate) const PARAMETERS: [ParameterSpec; 12] = [
    coherence(0),
    phase(0),
    coherence(1),
    phase(1),
    coherence(2),
    phase(2),
    coherence(3),
    phase(3),
    coherence(4),
    phase(4),
    coherence(5),
    phase(5),
];

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

/// Whether an oscillation is in part that of another axis.
pub(crate) fn is_of_another(parameters: &Parameters) -> bool {
    PHASE.iter().any(|name| parameters.contains_key(*name))
}

/// Whether oscillations of two axes, of which one says that it is the other's, have one place: their centres lie within the wider of
/// them.
pub(crate) fn is_one(a: &Parameters, b: &Parameters, width: &str) -> bool {
    let value = |p: &Parameters, name: &str| p.get(name).map_or(f64::NAN, |p| p.value);
    let apart = (value(a, "center_frequency") - value(b, "center_frequency")).abs();
    (is_of_another(a) || is_of_another(b)) && apart <= value(a, width).max(value(b, width))
}

/// An oscillation of an axis in a run.
#[derive(Clone, Debug)]
pub struct Felt {
    axis: usize,
    center_hz: f64,
    /// Both quadratures of z at each sample.
    turning: Vec<[f64; 2]>,
}

/// The part of an oscillation that is its own, by size, and what it has of that of another axis.
pub(crate) struct Split {
    /// Part of its size that is its own.
    pub own: f64,
    /// z of the other at each sample, turned by the phase and times the coherence.
    shared: Vec<f64>,
}

impl Split {
    /// Adds the part that is another axis', of a size.
    pub(crate) fn add(&self, size: f64, rates: &mut [f64]) {
        for (rate, z) in rates.iter_mut().zip(&self.shared) {
            *rate += size * z;
        }
    }
}

impl Simulation {
    /// Keeps an oscillation of an axis for others that feel the same.
    pub(crate) fn keep_felt(&mut self, axis: usize, center_hz: f64, turning: Vec<[f64; 2]>) {
        self.felt.push(Felt {
            axis,
            center_hz,
            turning,
        });
    }

    /// What an oscillation of an axis has in common with that of another one, the nearest to its centre; all of it is its own where
    /// it says nothing of another, or that has none.
    pub(crate) fn split(&self, axis: usize, center_hz: f64, parameters: &Parameters) -> Split {
        let value = |name: &str| parameters.get(name).map(|p| p.value);
        let names = WITH.iter().zip(PHASE).enumerate();
        let mut of = names.filter_map(|(k, (with, phase))| {
            let away = |f: &&Felt| (f.center_hz - center_hz).abs();
            let own = self
                .felt
                .iter()
                .filter(|f| f.axis == k % 3 && f.axis != axis);
            let felt = own.min_by(|a, b| away(a).total_cmp(&away(b)))?;
            Some((value(with)?.clamp(0.0, 1.0), value(phase)?, felt))
        });
        let Some((r, phase, felt)) = of.next() else {
            return Split {
                own: 1.0,
                shared: vec![],
            };
        };
        let (sin, cos) = phase.sin_cos();
        let turned = felt.turning.iter().map(|[a, b]| r * (cos * a - sin * b));
        Split {
            own: (1.0 - r * r).sqrt(),
            shared: turned.collect(),
        }
    }
}
