//! The scale factor of a gyro held against the tilt that the accelerometers see while the base sways.

use model::effect::Signal;
use model::record::{Axis, Quantity};

use crate::fit::likelihood::Dct;
use crate::fit::prequential;
use crate::ingest::types::{Grid, Target};

/// Band in which a sway is sought, Hz.
const BAND_HZ: (f64, f64) = (0.02, 2.0);
/// Least correlation of tilt rate and rate in the band of the sway.
const LEAST_CORRELATION: f64 = 0.9;

/// Standard gravity, m/s^2.
const STANDARD_GRAVITY: f64 = 9.80665;
/// The largest zero of an accelerometer that is taken for one, g: what the MMA7260QT's data sheet allows, 0.165 V at 0.8 V/g.
const LARGEST_ZERO_G: f64 = 0.206;
/// The largest error of its sensitivity there, 60 mV/g of 800.
const LARGEST_SENSITIVITY_ERROR: f64 = 0.075;
/// Part of what the upright one reads beside 1 g that is its zero and not its sensitivity: by the variances of the two.
const OF_THE_ZERO: f64 = LARGEST_ZERO_G * LARGEST_ZERO_G
    / (LARGEST_ZERO_G * LARGEST_ZERO_G + LARGEST_SENSITIVITY_ERROR * LARGEST_SENSITIVITY_ERROR);

/// Scale over the stated one, minus 1, with its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// True scale over the stated one, minus 1.
    pub relative: f64,
    /// Standard error.
    pub std_error: f64,
    /// What knowing it gains on the part of the record that it was not taken from, nats, with the standard error.
    pub gain: (f64, f64),
}

/// Regress the tilt rate on the rate, in a band around the sway.
///
/// # Errors
/// Why the record does not allow it.
pub fn against_tilt(grid: &Grid, target: &Target) -> Result<Scale, String> {
    let n = grid.n;
    let level = Level::of(grid, target)?;
    let beside = level.beside_gravity();
    let tilt_rate = level.tilt_rate(n, grid.rate_hz, OF_THE_ZERO * beside);
    // The rate is averaged with the same weights as the central difference of the tilt (trapezoids).
    let y = &target.y;
    let rate: Vec<f64> = (0..n)
        .map(|i| (y[i.saturating_sub(1)] + 2.0 * y[i] + y[(i + 1).min(n - 1)]) / 4.0)
        .collect();
    let dct = Dct::new(n);
    let (t, w) = (dct.forward(&tilt_rate), dct.forward(&rate));
    let k_of = |hz: f64| ((2.0 * hz / grid.rate_hz * n as f64) as usize).clamp(1, n - 1);
    let (low, high) = (k_of(BAND_HZ.0), k_of(BAND_HZ.1));
    let Some(peak) = (low..high).max_by(|a, b| w[*a].abs().total_cmp(&w[*b].abs())) else {
        return Err("the record is too short for a sway".into());
    };
    let band = (peak / 2).max(low)..(2 * peak).min(high);
    let (mut tw, mut ww, mut tt) = (0.0, 0.0, 0.0);
    for k in band.clone() {
        tw += t[k] * w[k];
        ww += w[k] * w[k];
        tt += t[k] * t[k];
    }
    let correlation = tw / (ww * tt).sqrt();
    if !correlation.is_finite() || correlation.abs() < LEAST_CORRELATION {
        return Err(format!(
            "tilt and rate correlate by {:.2} only: sway the base slowly by some degrees about a horizontal axis",
            correlation.abs()
        ));
    }
    // The white noise of the rate, which the weights let through at these low frequencies, does not tilt.
    let signal = ww - target.white * band.len() as f64;
    let slope = tw / signal;
    let rest = (tt - tw * tw / ww).max(0.0) / band.len().max(2) as f64;
    // Of the zero or of the sensitivity: which it is tells by how much the tilt is too large.
    let either = (OF_THE_ZERO * (1.0 - OF_THE_ZERO)).sqrt() * beside / STANDARD_GRAVITY;
    let error = (rest / signal).sqrt().hypot(slope * either);
    let in_band = |c: &[f64]| {
        let mut kept = vec![0.0; n];
        kept[band.clone()].copy_from_slice(&c[band.clone()]);
        dct.inverse(&kept)
    };
    let gain = held_out(&in_band(&t), &in_band(&w), rest, slope.signum());
    // The rate carries the scale: tilt rate = rate / (1 + relative).
    Ok(Scale {
        relative: 1.0 / slope.abs() - 1.0,
        std_error: error / (slope * slope),
        gain,
    })
}

/// The accelerometers that tell how an axis tilts.
struct Level<'a> {
    /// Along the axis that it tilts.
    side: &'a Signal,
    /// Along the vertical.
    up: &'a Signal,
    /// Along the axis itself.
    across: Option<&'a Signal>,
    /// Whether it is the second of the level axes, about which the base pitches.
    pitches: bool,
}

impl<'a> Level<'a> {
    fn of(grid: &'a Grid, target: &Target) -> Result<Self, String> {
        let Some(own) = target.axis else {
            return Err("the gyro has no axis".into());
        };
        let acc = |axis| {
            grid.signals
                .iter()
                .find(|s| s.quantity == Quantity::Acc && s.axis == Some(axis))
        };
        // Up is the axis that carries most of gravity, whichever way it points.
        let mean = |s: &Signal| s.values.iter().sum::<f64>() / s.values.len().max(1) as f64;
        let axes = [Axis::X, Axis::Y, Axis::Z];
        let weight = |a: &Axis| acc(*a).map_or(0.0, |s| mean(s).abs());
        let upright = axes
            .into_iter()
            .max_by(|a, b| weight(a).total_cmp(&weight(b)));
        let upright = upright.unwrap_or(Axis::Z);
        if upright == own {
            return Err(
                "a turn about the vertical tilts no accelerometer: sway about a horizontal axis"
                    .into(),
            );
        }
        // About x the component along y tilts, about y the one along x.
        let level: Vec<Axis> = axes.into_iter().filter(|a| *a != upright).collect();
        let pitches = own == level[1];
        let (Some(side), Some(up)) = (acc(level[usize::from(!pitches)]), acc(upright)) else {
            return Err(
                "the accelerometers along the vertical and across the axis are needed".into(),
            );
        };
        Ok(Self {
            side,
            up,
            across: acc(own),
            pitches,
        })
    }

    /// What the upright accelerometer reads beside what the others leave it of 1 g, in its unit.
    fn beside_gravity(&self) -> f64 {
        beside_gravity(self.up, [Some(self.side), self.across])
    }

    /// How fast the axis tilts, deg/s: the central difference. `zero` is that of the upright accelerometer.
    fn tilt_rate(&self, n: usize, rate_hz: f64, zero: f64) -> Vec<f64> {
        let up: Vec<f64> = self.up.values.iter().map(|a| a - zero).collect();
        let sign = up.iter().sum::<f64>().signum();
        // The roll is atan(y / z). The pitch is that of x against both others, and its rate about the body's y is smaller
        // by the cosine of the roll.
        let other = |i: usize| {
            let across = self.across.filter(|_| self.pitches);
            across.map_or(0.0, |a| a.values[i])
        };
        let tilt: Vec<f64> = (0..n)
            .map(|i| {
                let vertical = up[i].hypot(other(i)).copysign(sign * up[i]);
                self.side.values[i].atan2(vertical).to_degrees()
            })
            .collect();
        let leaning = |i: usize| (other(i).atan2(sign * up[i])).cos();
        (0..n)
            .map(|i| {
                let change = tilt[(i + 1).min(n - 1)] - tilt[i.saturating_sub(1)];
                change * leaning(i).abs() * rate_hz / 2.0
            })
            .collect()
    }
}

/// What the upright accelerometer reads beside the part of 1 g that the other axes leave it, in the mean over the record: its zero,
/// which would pass for a scale factor of the tilt, or a part of its sensitivity. None where the unit is not m/s^2, or where more is wrong than a zero.
fn beside_gravity(up: &Signal, level: [Option<&Signal>; 2]) -> f64 {
    if up.unit != "m/s^2" {
        return 0.0;
    }
    let square = |i: usize| -> f64 {
        level
            .into_iter()
            .flatten()
            .map(|s| s.values[i].powi(2))
            .sum()
    };
    let n = up.values.len();
    let beside: f64 = (0..n)
        .map(|i| {
            let left = (STANDARD_GRAVITY.powi(2) - square(i)).max(0.0).sqrt();
            up.values[i] - left.copysign(up.values[i])
        })
        .sum();
    let zero = beside / n.max(1) as f64;
    if zero.abs() < LARGEST_ZERO_G * STANDARD_GRAVITY {
        zero
    } else {
        0.0
    }
}

/// What it gains to know the slope of the tilt rate over the rate, both in the band of the sway, on the part that is held out:
/// marginal likelihoods under a flat slope, less those under the slope `stated`; `rest` is the mean energy of a coefficient
/// beside it.
fn held_out(tilt: &[f64], rate: &[f64], rest: f64, stated: f64) -> (f64, f64) {
    let known = |upto: usize| {
        let pairs = tilt[..upto].iter().zip(&rate[..upto]);
        let (tw, ww) = pairs.fold((0.0, 0.0), |(tw, ww), (t, w)| (tw + t * w, ww + w * w));
        let lr = (tw / ww - stated).powi(2) * ww / rest;
        (0.5 * lr - 0.5 * f64::ln(ww), lr, ww)
    };
    let n = tilt.len();
    let from = prequential::held_from(n);
    let (before, all) = (known(from), known(n));
    let held = 1.0 - before.2 / all.2;
    (
        all.0 - before.0,
        (held * (all.1 - 1.0).max(0.0) + held).sqrt(),
    )
}
