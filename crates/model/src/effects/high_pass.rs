//! A filter takes the slow part of the readings.

use std::f64::consts::TAU;

use crate::effect::{
    Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    parameter, value,
};
use crate::simulate::Simulation;

/// The effect.
pub struct HighPass;

/// Its id.
pub const ID: &str = "high_pass";

/// The one instance that the library lists.
pub static EFFECT: HighPass = HighPass;

/// A high-pass filter of one pole p, y_k = p y_(k-1) + (1 + p) / 2 (x_k - x_(k-1)) from rest, and the way back. It passes the
/// fastest as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter {
    pole: f64,
}

impl Filter {
    /// The filter of a time constant, samples.
    #[must_use]
    pub fn of(time_constant: f64) -> Self {
        let pole = (-1.0 / time_constant).exp();
        Self { pole }
    }

    /// What it makes of values, at rest at `level` before them.
    pub fn pass(self, values: &mut [f64], level: f64) {
        let gain = 0.5 * (1.0 + self.pole);
        let (mut before, mut out) = (level, 0.0);
        for v in values {
            out = self.pole * out + gain * (*v - before);
            before = std::mem::replace(v, out);
        }
    }

    /// What it was given, of what it made.
    pub fn undo(self, values: &mut [f64]) {
        let gain = 0.5 * (1.0 + self.pole);
        let (mut before, mut given) = (0.0, 0.0);
        for v in values {
            given += (*v - self.pole * before) / gain;
            before = std::mem::replace(v, given);
        }
    }
}

impl Effect for HighPass {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[parameter(
            "corner_frequency",
            "Hz",
            "frequency of which half the power passes",
        )];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "High-pass filter",
            physics: "The readings have passed a filter of one pole that takes the slow part: the high-pass filter of a sensor, coupling by a capacitor, or a logger that subtracts a running mean. The bias dies away from the start of the record, and neither a slow rotation nor the drift of the bias is in the readings any longer.",
            excitation: "Nothing; thirty time constants or more.",
            test: "Where the slowest frequencies hold less than those above them, the readings are put back before a filter of one pole, and searched as they are and as they were: the likelihoods of both compare, as the filter is known. Noise, bias and causes are then those before the filter.",
            remedy: "Switch the filter off, or take its output for what it is: do not integrate it for longer than its time constant.",
            figure: "Spectrum of the rate with the model before and after: what the filter takes away.",
            example: Example::new(Plot::Spectrum, &[("corner_frequency", 0.3)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "quantization_noise",
                experiment: "turn the table by a known angle and hold it: behind this filter the rate comes back to zero while the table still turns",
            },
            Rival {
                cause: "warm_up",
                experiment: "a second start: what a filter makes of the bias dies away in the same time, however warm the part is",
            },
        ];
        RIVALS
    }

    /// It is undone before the search.
    fn hypotheses(&self, _view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        Ok(vec![Hypothesis::Audit])
    }

    fn takes(&self) -> Option<&'static str> {
        Some("the bias and whatever turns more slowly than the corner")
    }

    fn stage(&self) -> Stage {
        Stage::Output
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let corner = value(parameters, "corner_frequency");
        if corner <= 0.0 {
            return;
        }
        let filter = Filter::of(simulation.rate_hz / (TAU * corner));
        for &axis in channels {
            for stretch in simulation.stretches.clone() {
                let at = stretch.samples;
                filter.pass(&mut simulation.white[axis][at.clone()], 0.0);
                // The motion is added later: here comes what the filter makes of it, less what is added.
                let scale = simulation.scale[axis];
                let moves: Vec<f64> = (simulation.motion[axis][at.clone()].iter())
                    .map(|m| scale * m)
                    .collect();
                let rates = &mut simulation.rate[axis][at];
                rates.iter_mut().zip(&moves).for_each(|(r, m)| *r += m);
                // A stretch that begins later finds it at rest.
                let level = if stretch.skipped > 0 { rates[0] } else { 0.0 };
                filter.pass(rates, level);
                rates.iter_mut().zip(&moves).for_each(|(r, m)| *r -= m);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_dies_away_in_the_time_constant_and_comes_back() {
        let filter = Filter::of(20.0);
        let step = vec![2.0; 100];
        let mut through = step.clone();
        filter.pass(&mut through, 0.0);
        let gain = 0.5 * (1.0 + (-0.05f64).exp());
        assert!((through[0] - 2.0 * gain).abs() < 1e-12);
        assert!((through[20] / through[0] - (-1f64).exp()).abs() < 1e-12);
        filter.undo(&mut through);
        let off = through.iter().zip(&step).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-10);
    }

    #[test]
    fn half_the_power_passes_at_the_corner_and_all_of_the_fastest() {
        let (rate, corner) = (100.0, 1.5);
        let filter = Filter::of(rate / (TAU * corner));
        let power = |hz: f64| {
            let mut tone: Vec<f64> = (0..20_000)
                .map(|i| (TAU * hz * f64::from(i) / rate).sin())
                .collect();
            filter.pass(&mut tone, 0.0);
            let late = &tone[10_000..];
            2.0 * late.iter().map(|v| v * v).sum::<f64>() / late.len() as f64
        };
        assert!((power(corner) - 0.5).abs() < 0.01, "{}", power(corner));
        assert!((power(49.0) - 1.0).abs() < 0.01, "{}", power(49.0));
    }
}
