//! The phase of a tone that was tracked through a record.

use rustfft::num_complex::Complex;

/// The phase of a tone through the record.
#[derive(Clone, Debug)]
pub struct Path {
    /// Amplitude, in the unit of the channel.
    pub amplitude: f64,
    /// Angular frequency by which the blocks were turned back, rad per sample.
    pub omega: f64,
    /// Samples from one block to the next, the first of which lies so far from half a sample before the record.
    pub length: f64,
    /// Phase of each block beside that, rad, and its variance.
    pub phase: Vec<(f64, f64)>,
    /// Whether several channels have a part of the tone, as of what shakes a stand.
    pub shared: bool,
}

impl Path {
    /// Phase at a sample, and its variance.
    pub(crate) fn at(&self, i: f64) -> (f64, f64) {
        let place = (i + 0.5) / self.length - 1.0;
        let block = (place.max(0.0) as usize).min(self.phase.len() - 2);
        let part = place - block as f64;
        let [(a, v), (b, w)] = [self.phase[block], self.phase[block + 1]];
        (
            self.omega * i + a + (b - a) * part,
            v + (w - v) * part.clamp(0.0, 1.0),
        )
    }

    /// The tone over so many samples: its expectation, where the phase is in doubt.
    pub(crate) fn course(&self, n: usize) -> Vec<f64> {
        let at = |i: usize| {
            let (phase, doubt) = self.at(i as f64);
            self.amplitude * (-0.5 * doubt).exp() * phase.cos()
        };
        (0..n).map(at).collect()
    }

    /// The same of size 1, and a quarter of a turn behind: both quadratures.
    pub(crate) fn quadratures(&self, n: usize) -> [Vec<f64>; 2] {
        let each = (0..n).map(|i| {
            let (phase, doubt) = self.at(i as f64);
            let (sin, cos) = phase.sin_cos();
            let size = (-0.5 * doubt).exp();
            (size * cos, size * sin)
        });
        let (cos, sin) = each.unzip();
        [cos, sin]
    }

    /// Mean variance of the phase, rad^2.
    pub(crate) fn doubt(&self) -> f64 {
        self.phase.iter().map(|p| p.1).sum::<f64>() / self.phase.len() as f64
    }

    /// How much of the phase of another tone over the same samples is that of this one, and by how much it is ahead.
    pub(crate) fn goes_with(&self, other: &Self, n: usize) -> Complex<f64> {
        let step = (self.length.min(other.length) as usize).max(1);
        let mut count = 0.0;
        let each = (0..n).step_by(step).map(|i| {
            let ((a, v), (b, w)) = (self.at(i as f64), other.at(i as f64));
            count += 1.0;
            // What is in doubt of either makes them no less alike.
            Complex::from_polar((0.5 * (v + w)).exp(), b - a)
        });
        let sum: Complex<f64> = each.sum();
        let mean = sum / count;
        mean / mean.norm().max(1.0)
    }
}
