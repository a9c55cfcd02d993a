//! Effects in company: two in a run, two or three on one axis, and one on an axis that has a structure of another kind.
//! The strength of each is that beside the others.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use crate::foreign::words::{phasor, white};
use crate::plant::{
    LARGEST_RMS, STRONG, StrongRow as Row, TURNS_BELOW_HZ, Truth, plant, plant_outliers, strong,
};
use crate::random::Draw;
use crate::series::{each, each_pair};
use crate::stand::{GYROS, Stand};
use crate::strength::Meter;

/// Rows that can stand beside others: those that need a moving base exclude most.
fn rows(keep: impl Fn(&Row) -> bool) -> Vec<&'static Row> {
    STRONG.iter().filter(|r| !r.moves && keep(r)).collect()
}

/// Whether of two effects on one channel one is a part of the other: a parabola holds a line.
fn holds_the_other(truths: &[Truth]) -> bool {
    let both = |one, other| {
        let has = |cause| truths.iter().any(|t| t.cause == cause);
        has(one) && has(other)
    };
    both("temperature", "temperature_quadratic") || both("line", "am_line")
}

/// How strong an effect is beside others on its channel.
fn beside(meter: &Meter, one: &Truth, others: &[&Truth]) -> f64 {
    let signals: Vec<Vec<f64>> = others.iter().filter_map(|t| t.signal.clone()).collect();
    let densities = others.iter().filter_map(|t| t.density.as_deref());
    let among = densities.fold(meter.clone(), |m, d| m.over(d));
    match (&one.signal, &one.density) {
        (Some(signal), _) => {
            let energy = match signals.as_slice() {
                [] => meter.energy(signal),
                others => meter.energy(&among.beyond(signal, others)),
            };
            among.beside_fitted(&|m| m.of_signal(&energy))
        }
        (None, Some(own)) if others.iter().any(|t| t.density.is_some()) => {
            among.beside_fitted(&|m| m.of_density(own))
        }
        _ => one.strength,
    }
}

/// Gives each effect its strength beside those on the same channel.
fn among_each_other(stand: &Stand, truths: &mut [Truth]) {
    let strength = |i: usize| {
        let one = &truths[i];
        let others = truths.iter().enumerate();
        let same = others.filter(|(j, t)| *j != i && t.channel == one.channel);
        let others: Vec<&Truth> = same.map(|(_, t)| t).collect();
        match GYROS.iter().position(|g| *g == one.channel) {
            Some(axis) if !others.is_empty() => beside(&Meter::new(stand, axis), one, &others),
            _ => one.strength,
        }
    };
    let strengths: Vec<f64> = (0..truths.len()).map(strength).collect();
    for (truth, strength) in truths.iter_mut().zip(strengths) {
        truth.strength = strength;
    }
}

fn as_asked(truths: &[Truth]) -> bool {
    let asked = |t: &Truth| t.strength >= strong(t.label).asked_from;
    truths.iter().all(asked)
}

/// A strength that is asked to be named, with some room for what others take off.
fn wanted(draw: &mut Draw, row: &Row) -> f64 {
    draw.by_ratio(1.1 * row.asked_from, 2.2 * row.asked_from)
}

/// Effects that are planted together until each is as strong as asked beside the others; none where some do not go together.
fn together(
    stand: &mut Stand,
    mut some: impl FnMut(&mut Stand) -> Option<Vec<Truth>>,
) -> Vec<Truth> {
    loop {
        let Some(mut truths) = some(stand) else {
            continue;
        };
        among_each_other(stand, &mut truths);
        if as_asked(&truths) {
            return truths;
        }
    }
}

/// Two effects, each as strong as asked beside the other.
pub(crate) fn two(draw: &mut Draw, stand: &mut Stand) -> Vec<Truth> {
    let fit = rows(|_| true);
    together(stand, |stand| {
        let rows = [0, 1].map(|_| draw.one_of(&fit));
        if rows[0].cause == rows[1].cause {
            return None;
        }
        let truths = rows.map(|row| {
            let axis = draw.of_many(3);
            let wanted = wanted(draw, row);
            plant(draw, stand, row.label, axis, wanted)
        });
        let same = truths[0].channel == truths[1].channel;
        (!(same && holds_the_other(&truths))).then_some(truths.into())
    })
}

/// Two or three effects on one axis, each as strong as asked beside the others.
pub(crate) fn on_one_axis(draw: &mut Draw, stand: &mut Stand) -> Vec<Truth> {
    let fit = rows(|r| !r.everywhere);
    let count = 2 + draw.of_many(2);
    together(stand, |stand| {
        let axis = draw.of_many(3);
        let mut one = |_| {
            let row = draw.one_of(&fit);
            let wanted = wanted(draw, row);
            plant(draw, stand, row.label, axis, wanted)
        };
        let truths: Vec<Truth> = (0..count).map(&mut one).collect();
        let twice = (1..count).any(|i| truths[..i].iter().any(|t| t.cause == truths[i].cause));
        (!twice && !holds_the_other(&truths)).then_some(truths)
    })
}

/// What an axis has beside an effect.
struct Structure {
    /// Where the library has it.
    truth: Option<Truth>,
    /// Variance that it adds to the coefficients, by bin.
    density: Option<Vec<f64>>,
    /// Signal that is added to the readings.
    added: Option<Vec<f64>>,
}

impl Structure {
    fn of(truth: Truth) -> Self {
        Self {
            density: truth.density.clone(),
            truth: Some(truth),
            added: None,
        }
    }
}

/// A kind of structure: a row of the tables.
#[derive(Clone, Copy)]
pub struct StructureKind {
    /// Number of its family: all draws hang on it, so it never changes.
    pub id: u16,
    /// The row of the tables.
    pub label: &'static str,
    /// Causes that may be named for it.
    pub allowed: &'static [&'static str],
    how: fn(&mut Draw, &mut Stand, usize) -> Structure,
    /// Rows that are planted beside it, any where empty, and their strength in units of the one asked.
    beside: &'static [&'static str],
    wanted: (f64, f64),
}

const fn structure(
    id: u16,
    label: &'static str,
    allowed: &'static [&'static str],
    how: fn(&mut Draw, &mut Stand, usize) -> Structure,
) -> StructureKind {
    StructureKind {
        id,
        label,
        allowed,
        how,
        beside: &[],
        wanted: (1.1, 2.2),
    }
}

impl StructureKind {
    const fn beside(mut self, rows: &'static [&'static str], wanted: (f64, f64)) -> Self {
        (self.beside, self.wanted) = (rows, wanted);
        self
    }
}

/// The kinds. The last one is what was measured on gyro z of an ADIS16405: a vibration of a third of the variance whose pitch
/// wanders over a fifth of its centre, and beside it what was planted there.
#[rustfmt::skip]
pub const STRUCTURES: [StructureKind; 5] = [
    structure(20, "beside a line", &[], line),
    structure(21, "beside a band", &["narrow_band", "wandering_line"], band),
    structure(22, "beside outliers", &[], outliers),
    structure(23, "beside an echo", &[], echo),
    structure(24, "beside a vibration that wanders", &["narrow_band", "wandering_line"], vibration)
        .beside(&["line", "rate_ramp", "bias_step", "noise_change", "telegraph", "temperature"], (1.3, 1.5)),
];

/// Strengths of a line or a band that an effect is planted beside.
const LOUD: (f64, f64) = (15.0, 40.0);

/// Drawn again where it is a turn of the base to anyone who has the gyro alone, as what moves much below 1 Hz is.
fn line(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Structure {
    loop {
        let wanted = draw.by_ratio(LOUD.0, LOUD.1);
        let truth = plant(draw, stand, "line", axis, wanted);
        let [hz, amplitude] = ["frequency", "amplitude"].map(|name| truth.parameters[name].value);
        if hz > TURNS_BELOW_HZ || amplitude * FRAC_1_SQRT_2 < LARGEST_RMS {
            return Structure::of(truth);
        }
    }
}

fn band(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Structure {
    let wanted = draw.by_ratio(LOUD.0, LOUD.1);
    let label = draw.one_of(&["narrow_band", "wandering_line"]);
    Structure::of(plant(draw, stand, label, axis, wanted))
}

fn outliers(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Structure {
    Structure::of(plant_outliers(draw, stand, axis, (3.0, 40.0), (5.0, 7.5)))
}

/// Noise that comes again after 2 to 40 samples, so strong that the correlation there has a d' of 10 to 20.
fn echo(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Structure {
    let n = stand.samples();
    let lag = draw.by_ratio(2.0, 41.0) as usize;
    let rho = draw.by_ratio(10.0, 20.0) / (n as f64).sqrt();
    // Of white noise of variance s^2 and c times a noise and itself a lag before: rho = c^2 / (s^2 + 2 c^2).
    let square = rho * stand.white(axis) / (1.0 - 2.0 * rho);
    let own = white(draw, n + lag);
    let signal = each_pair(&own, &own[lag..], |a, b| square.sqrt() * (a + b));
    let meter = Meter::new(stand, axis);
    let density = each(meter.omega(), |w| {
        2.0 * square * (1.0 + (w * lag as f64).cos())
    });
    Structure {
        truth: None,
        added: Some(signal),
        density: Some(density),
    }
}

/// A mode that noise drives, whose pitch wanders: 0.35 of the variance, about 0.2 of the sample rate, over half a tenth of that.
fn vibration(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Structure {
    let rate_hz = stand.rate_hz;
    let centre = draw.between(0.15, 0.25) * rate_hz;
    let slow = draw.between(5.0, 20.0);
    let pitch = stand.wander(draw, 0.05 * centre, slow);
    let half_width = 0.02 * centre;
    let keep = (-TAU * half_width / rate_hz).exp();
    let turns = pitch.iter().map(|p| TAU * (centre + p) / rate_hz);
    let rms = (0.35 / 0.65 * stand.white(axis)).sqrt();
    let swings = phasor(draw, keep, turns);
    let signal = each(&swings, |x| rms * x);
    let meter = Meter::new(stand, axis);
    // What it has by bin is its periodogram, smoothed over so many bins that its scatter does not count.
    let density = smoothed(&meter.energy(&signal), meter.counts());
    Structure {
        truth: None,
        added: Some(signal),
        density: Some(density),
    }
}

/// Energy for each coefficient over bins of some hundred coefficients.
fn smoothed(energy: &[f64], count: &[f64]) -> Vec<f64> {
    const OVER: f64 = 100.0;
    let about = |b: usize| {
        let (mut from, mut to, mut sum, mut number) = (b, b + 1, energy[b], count[b]);
        while number < OVER && (from > 0 || to < energy.len()) {
            if from > 0 {
                from -= 1;
                sum += energy[from];
                number += count[from];
            }
            if to < energy.len() {
                sum += energy[to];
                number += count[to];
                to += 1;
            }
        }
        sum / number
    };
    (0..energy.len()).map(about).collect()
}

/// One effect on an axis that has a structure of this kind, as strong as asked beside it: what is true, what is planted first, and
/// the signal that the structure adds.
pub(crate) fn beside_a_structure(
    draw: &mut Draw,
    stand: &mut Stand,
    kind: &StructureKind,
    axis: usize,
) -> (Vec<Truth>, Option<Vec<f64>>) {
    let found = (kind.how)(draw, stand, axis);
    let taken = found.truth.as_ref().map(|t| t.cause);
    let fit = rows(|r| {
        let asked = kind.beside.is_empty() || kind.beside.contains(&r.label);
        let is_it = Some(r.cause) == taken || kind.allowed.contains(&r.cause);
        let swings = taken == Some("line") && r.cause == "am_line";
        asked && !is_it && !r.everywhere && !swings
    });
    loop {
        let row = draw.one_of(&fit);
        let wanted = row.asked_from * draw.by_ratio(kind.wanted.0, kind.wanted.1);
        let mut truth = plant(draw, stand, row.label, axis, wanted);
        truth.strength = beside_structure(&Meter::new(stand, axis), &truth, &found);
        if truth.strength >= row.asked_from {
            let truths = std::iter::once(truth).chain(found.truth);
            return (truths.collect(), found.added);
        }
    }
}

/// How strong an effect is beside a structure, whose density is known.
fn beside_structure(meter: &Meter, one: &Truth, structure: &Structure) -> f64 {
    match (&one.density, &structure.density) {
        (Some(own), Some(other)) => meter.over(other).of_density(own),
        (None, Some(other)) if one.signal.is_some() => {
            let meter = meter.over(other);
            let signal = one.signal.as_deref().unwrap_or(&[]);
            meter.of_signal(&meter.energy(signal))
        }
        _ => match &structure.truth {
            Some(truth) if truth.signal.is_some() => beside(meter, one, &[truth]),
            _ => one.strength,
        },
    }
}
