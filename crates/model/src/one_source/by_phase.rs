//! A tone whose pitch wanders, read from channels by its phase.
//!
//! Its size stays, so that a filter of its line's width, which knows of none, leaves more in doubt than the phase does.

use std::f64::consts::{SQRT_2, TAU};

use crate::tone::{Law, Reading, Step, drawn, follow, smoothed};

/// Phase that a usual departure of the pitch turns over a block, rad: of the size it takes its square over 24.
const TURN: f64 = 0.3;
/// Fewest periods of the tone in a block, whose image at negative frequencies is then a twentieth of it, and fewest blocks.
const PERIODS: f64 = 4.0;
const BLOCKS: usize = 48;
/// Most samples of a correlation time in a block, as a part of it.
const OF_TIME: f64 = 0.25;
/// Variance of the phase, rad^2, from which on it is not told.
const DOUBT: f64 = 0.2;
/// How often size and noise are told by the phase that they tell.
const PASSES: usize = 2;

/// How a tone wanders: mean frequency and standard deviation of it, rad per sample, and its correlation time, samples.
#[derive(Clone, Copy, Debug)]
pub struct Wander {
    /// Mean frequency.
    pub omega: f64,
    /// Standard deviation of it.
    pub rms: f64,
    /// Correlation time.
    pub time: f64,
}

/// Blocks of a channel, its amplitude, and the variance of its noise in either part of a block.
struct Heard {
    blocks: Vec<[f64; 2]>,
    square: f64,
    amplitude: f64,
    noise: f64,
}

impl Heard {
    /// Of readings turned by a phase; none where no tone stands out of them.
    fn new(values: &[f64], phase: f64, omega: f64, length: usize) -> Option<Self> {
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        let scale = 2.0 / length as f64;
        let blocks = values.chunks_exact(length).enumerate().map(|(k, block)| {
            let (mut re, mut im) = (0.0, 0.0);
            let (step_sin, step_cos) = omega.sin_cos();
            let (mut sin, mut cos) = (omega * (k * length) as f64 - phase).sin_cos();
            for v in block {
                re += (v - mean) * cos;
                im -= (v - mean) * sin;
                (sin, cos) = (
                    sin * step_cos + cos * step_sin,
                    cos * step_cos - sin * step_sin,
                );
            }
            [scale * re, scale * im]
        });
        let blocks: Vec<[f64; 2]> = blocks.collect();
        let count = blocks.len() as f64;
        let squares = || blocks.iter().map(|[a, b]| a * a + b * b);
        let square = squares().sum::<f64>() / count;
        let fourth = squares().map(|s| s * s).sum::<f64>() / count;
        // A^2 + 2 s^2 and A^4 + 8 A^2 s^2 + 8 s^4.
        let amplitude = (2.0 * square * square - fourth).max(0.0).sqrt().sqrt();
        let found = Self {
            blocks,
            square,
            amplitude,
            noise: 0.0,
        };
        (amplitude > 0.0).then(|| found.of_size(amplitude))
    }

    fn of_size(mut self, amplitude: f64) -> Self {
        self.amplitude = amplitude;
        let rest = 0.5 * (self.square - amplitude * amplitude);
        self.noise = rest.max(f64::EPSILON * self.square);
        self
    }

    /// The size of its tone by the phase in each block.
    fn size_by(&self, phases: &[(f64, f64)]) -> f64 {
        let each = self
            .blocks
            .iter()
            .zip(phases)
            .map(|([re, im], (phase, doubt))| {
                let (sin, cos) = phase.sin_cos();
                (0.5 * doubt).exp() * (cos * re + sin * im)
            });
        each.sum::<f64>() / self.blocks.len() as f64
    }
}

/// What channels tell of the phase of a tone.
pub(super) struct ByPhase {
    omega: f64,
    length: usize,
    law: Law,
    steps: Vec<Step>,
    phases: Vec<(f64, f64)>,
}

impl ByPhase {
    /// Of channels, each with the phase by which the tone is ahead of it; none where they do not tell it.
    pub(super) fn new(channels: &[(&[f64], f64)], of: Wander) -> Option<Self> {
        let samples = channels.first()?.0.len();
        let most = (TURN / of.rms)
            .min(OF_TIME * of.time)
            .min(samples as f64 / BLOCKS as f64);
        let periods = (most * of.omega / TAU).floor();
        // Whole periods, of which neither the image nor a harmonic leaves anything.
        let length = (periods * TAU / of.omega).round() as usize;
        let are_some = periods.is_finite() && periods >= PERIODS && length > 0;
        if !are_some || samples / length < BLOCKS {
            return None;
        }
        let heard = channels.iter();
        let heard = heard.filter_map(|(v, phase)| Heard::new(v, *phase, of.omega, length));
        let mut heard: Vec<Heard> = heard.collect();
        if heard.is_empty() {
            return None;
        }
        let block = length as f64;
        let law = Law::new(1.0, of.rms * block, of.time / block, 0.0);
        let mut told = (vec![], vec![]);
        for pass in 0..PASSES {
            if pass > 0 {
                let again = heard.into_iter().map(|h| {
                    let size = h.size_by(&told.1);
                    h.of_size(size)
                });
                heard = again.filter(|h| h.amplitude > 0.0).collect();
            }
            told = Self::told(&heard, &law);
        }
        let (steps, phases) = told;
        let doubt = phases.iter().map(|p| p.1).sum::<f64>() / phases.len().max(1) as f64;
        (doubt < DOUBT).then_some(Self {
            omega: of.omega,
            length,
            law,
            steps,
            phases,
        })
    }

    /// The phase by channels that are heard together, each by what it has of the tone over its noise.
    fn told(heard: &[Heard], law: &Law) -> (Vec<Step>, Vec<(f64, f64)>) {
        let weight: f64 = heard
            .iter()
            .map(|h| h.amplitude * h.amplitude / h.noise)
            .sum();
        let blocks = heard.iter().map(|h| h.blocks.len()).min().unwrap_or(0);
        let one = |k: usize| {
            let part = |c: usize| -> f64 {
                let parts = heard.iter().map(|h| h.amplitude / h.noise * h.blocks[k][c]);
                parts.sum::<f64>() / weight
            };
            [part(0), part(1)]
        };
        let blocks: Vec<[f64; 2]> = (0..blocks).map(one).collect();
        let mut steps = Vec::with_capacity(blocks.len());
        let reading = Reading::of_tone(&blocks, weight.recip());
        follow(&[reading], law, |s| steps.push(*s));
        let phases = smoothed(&steps, law);
        (steps, phases)
    }

    /// Both quadratures at each of so many samples, of phases and what is in doubt of them by block.
    fn turning(&self, samples: usize, phases: &[(f64, f64)]) -> Vec<[f64; 2]> {
        let last = phases.len() - 1;
        let of = |i: usize| {
            let place = ((i as f64 + 0.5) / self.length as f64 - 0.5).clamp(0.0, last as f64);
            let block = (place as usize).min(last.saturating_sub(1));
            let part = place - block as f64;
            let [(a, v), (b, w)] = [phases[block], phases[(block + 1).min(last)]];
            let (sin, cos) = (self.omega * i as f64 + a + part * (b - a)).sin_cos();
            let size = SQRT_2 * (-0.5 * (v + part * (w - v))).exp();
            [size * cos, size * sin]
        };
        (0..samples).map(of).collect()
    }

    /// The tone as it is expected, of which each quadrature has the standard deviation 1.
    pub(super) fn expected(&self, samples: usize) -> Vec<[f64; 2]> {
        self.turning(samples, &self.phases)
    }

    /// A tone that what is told leaves possible, in the same way, of standard `normal` values.
    pub(super) fn drawn(&self, samples: usize, normal: impl FnMut() -> f64) -> Vec<[f64; 2]> {
        let phases = drawn(&self.steps, &self.law, normal);
        let phases: Vec<(f64, f64)> = phases.into_iter().map(|p| (p, 0.0)).collect();
        self.turning(samples, &phases)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_1_SQRT_2;

    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    #[test]
    fn the_phase_of_a_rotor_is_read_as_well_as_it_says() {
        let (samples, of) = (
            60_000,
            Wander {
                omega: 1.3,
                rms: 0.004,
                time: 1000.0,
            },
        );
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let keep = (-1.0 / of.time).exp();
        let (mut off, mut phase) = (of.rms * normal(), 0.7);
        let phases: Vec<f64> = (0..samples)
            .map(|_| {
                off = keep * off + of.rms * (1.0 - keep * keep).sqrt() * normal();
                phase += of.omega + off;
                phase
            })
            .collect();
        // Two channels, behind the tone by a turn each.
        let read = [(0.5, 0.4), (1.2, -2.0)].map(|(size, behind)| {
            let of = |p: &f64| size * (p - behind).cos() + normal() + 0.3;
            (phases.iter().map(of).collect::<Vec<f64>>(), behind)
        });
        let channels: Vec<(&[f64], f64)> = read.iter().map(|(v, b)| (v.as_slice(), *b)).collect();
        let told = ByPhase::new(&channels, of).expect("a tone");
        let expected = told.expected(samples);
        let mean = |z: &[[f64; 2]]| {
            let each = z
                .iter()
                .zip(&phases)
                .map(|(z, p)| FRAC_1_SQRT_2 * (z[0] * p.cos() + z[1] * p.sin()));
            each.sum::<f64>() / samples as f64
        };
        let doubt = told.phases.iter().map(|p| p.1).sum::<f64>() / told.phases.len() as f64;
        assert!(doubt < 0.05, "{doubt}");
        // E cos(error) = exp(-v/2), of a draw exp(-v), both times the size told.
        let (of_mean, of_draw) = (mean(&expected), mean(&told.drawn(samples, &mut normal)));
        assert!((of_mean - (-doubt).exp()).abs() < 0.01, "{of_mean} {doubt}");
        assert!((of_draw - (-doubt).exp()).abs() < 0.01, "{of_draw} {doubt}");
        let noise: Vec<f64> = (0..samples).map(|_| normal()).collect();
        assert!(ByPhase::new(&[(&noise, 0.0)], of).is_none(), "of noise");
    }
}
