//! Whether a band is the first harmonic of what repeats itself in another shape than a sine.
//!
//! A mode and an oscillator swing as a sine; a relaxation oscillation, a pulse or a saw-tooth has harmonics, whose phases are locked
//! to that of the first. Its envelope to the power k is a template of the k-th harmonic, wherever that lies and if it has a band of
//! its own or is far below the noise: the mean of the template times the conjugate envelope there stands out of its spectrum (the
//! bicoherence of Kim and Powers, 1979, and its next order). What lies beyond half the sampling rate is folded.

use std::ops::{Range, RangeInclusive};

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::band_alone::{between, stands_out};
use super::band_source::Moves;
use super::envelope::envelope_of;

/// Harmonics that are asked for.
pub(super) const ORDERS: RangeInclusive<usize> = 2..=3;
/// Amplitude of a harmonic over that of the first, up to which a swing counts as a sine.
const TOLERATED: f64 = 0.1;

/// Where a harmonic lies among the coefficients.
pub(super) struct Place {
    order: usize,
    pub(super) places: Range<usize>,
    /// Whether it is folded back, and the coefficients that it turns by beside those of its place.
    folded: bool,
    beside: usize,
}

impl Place {
    /// Of a band among `n` coefficients; `None` where less of it is there than the band is wide.
    pub(super) fn of(own: &Moves, order: usize, n: usize) -> Option<Self> {
        let middle = order * (own.places.start + own.places.end) / 2;
        let turns = (middle + n) / (2 * n) * 2 * n;
        let at = middle.abs_diff(turns);
        let reach = order * own.places.len() / 2;
        let places = at.saturating_sub(reach).max(1)..(at + reach).min(n);
        (places.len() >= own.places.len()).then_some(Self {
            order,
            places,
            folded: middle < turns,
            beside: turns,
        })
    }

    /// Chance that the phase of what is there is locked to that of the band as well; 1 where it is a small part of it.
    /// `coefficients` are over the noise, which is `level` of that at the band.
    pub(super) fn chance(&self, own: &Moves, coefficients: &[f64], level: f64) -> f64 {
        let there = envelope_of(coefficients, &mut FftPlanner::new());
        let n = own.envelope.len().max(there.len());
        let at = |z: &[Complex<f64>], i: usize| z[i * z.len() / n];
        let start = self.places.start as f64;
        let start = if self.folded { -start } else { start };
        let first = self.order as f64 * own.places.start as f64;
        let turns = first - start - self.beside as f64;
        let (mut template, mut size) = (0.0, 0.0);
        let product = between(n, turns, |i| {
            let own = at(&own.envelope, i);
            let power = own.powi(self.order as i32);
            template += power.norm_sqr();
            size += own.norm_sqr();
            let there = at(&there, i);
            power * if self.folded { there } else { there.conj() }
        });
        let (p, mean) = stands_out(product);
        let amplitude = (level / (template * size).max(f64::MIN_POSITIVE)).sqrt() * mean;
        if amplitude > TOLERATED { p } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::super::band_alone::tests::{COUNT, HALF, band_of};
    use super::*;
    use crate::fit::likelihood::Dct;

    /// Of this many draws of a wandering phase, those in which a swing of this shape has a harmonic by the chance; the second
    /// harmonic of a pitch of more than a quarter of the sampling rate is folded.
    fn found(pitch: f64, shape: fn(f64) -> f64, chance: f64) -> usize {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
        let step = (2.0 * PI * HALF / COUNT as f64).sqrt();
        let one = |_: &usize| {
            let mut phase = 0.0;
            let samples = (0..COUNT).map(|_| {
                let [walks, noise]: [f64; 2] = [0; 2].map(|_| StandardNormal.sample(&mut rng));
                phase += pitch * PI + step * walks;
                shape(phase) + noise
            });
            let c = Dct::new(COUNT).forward(&samples.collect::<Vec<_>>());
            let own = band_of(&c, pitch * COUNT as f64, HALF, 1.0);
            let p = |order| {
                let place = Place::of(&own, order, COUNT).expect("in the spectrum");
                place.chance(&own, &c[place.places.clone()], 1.0)
            };
            ORDERS.map(p).fold(1.0, f64::min) < chance
        };
        (0..50).filter(one).count()
    }

    #[test]
    fn pulses_and_saw_teeth_have_harmonics_and_a_sine_has_none() {
        let sine = |phase: f64| phase.cos();
        let saw = |phase: f64| (phase / PI).rem_euclid(2.0) - 1.0;
        for pitch in [0.13, 0.29, 0.61, 0.83] {
            // 5 of 50 would be 5 % of each of two.
            assert!(found(pitch, sine, 0.05) <= 10, "a sine at {pitch}");
            assert!(found(pitch, saw, 1e-3) >= 45, "a saw-tooth at {pitch}");
        }
    }
}
