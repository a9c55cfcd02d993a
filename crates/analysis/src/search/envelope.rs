//! Whether a narrow band is one tone of steady size whose pitch wanders, or noise behind a resonance, or a tone that
//! comes and goes.
//!
//! Of a tone A cos(phase) whose phase alone wanders, the square of the envelope is A^2 all the time; of a Gaussian
//! process it is exponential. The mean of its square over the square of its mean is 1 of the one and 2 of the other; a
//! tone that is there for a share q of the time has 1 / q, one that swings by a depth m
//! (1 + 3 m^2 + 3/8 m^4) / (1 + m^2 / 2)^2.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// Largest ratio of a tone whose size is steady: it swings by 0.42 of itself at most. Of Gaussian bands with some 40
/// independent values in the record at most 4 of 100 come below it (a test holds that).
pub(super) const STEADY: f64 = 1.3;

/// Values of the envelope for each coefficient of the band.
const OVERSAMPLED: usize = 4;

/// Mean square of the squared envelope over its squared mean, what white noise of variance 1 in every coefficient adds
/// taken off; `band` holds neighbouring DCT-II coefficients. NaN where no more than the noise is there.
pub(super) fn swing(band: &[f64]) -> f64 {
    let count = band.len();
    let energy: f64 = band.iter().map(|c| c * c).sum();
    let signal = 1.0 - count as f64 / energy;
    if count < 2 || signal <= 0.0 {
        return f64::NAN;
    }
    // Coefficient k turns by k pi over the record, which is half of what the transform spans.
    let length = (2 * OVERSAMPLED * count).next_power_of_two();
    let mut z = vec![Complex::default(); length];
    z.iter_mut().zip(band).for_each(|(z, c)| z.re = *c);
    FftPlanner::new().plan_fft_inverse(length).process(&mut z);
    let record = &z[..length / 2];
    let mean = |k| {
        let all = record.iter().map(|z| z.norm_sqr().powi(k));
        all.sum::<f64>() / record.len() as f64
    };
    let noise = 1.0 - signal;
    let ratio = mean(2) / mean(1).powi(2);
    (ratio - 4.0 * signal * noise - 2.0 * noise * noise) / (signal * signal)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::numerics::transform::Dct;

    const N: usize = 12_000;

    /// The band from coefficient 1800 to 2200 of what `of` makes of a sample's number and a normal value.
    fn band(seed: u64, noise: f64, mut of: impl FnMut(usize, f64) -> f64) -> Vec<f64> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let y: Vec<f64> = (0..N).map(|i| of(i, normal()) + noise * normal()).collect();
        let c = Dct::new(N).forward(&y);
        c[1800..2200].iter().map(|c| c / noise).collect()
    }

    #[test]
    fn a_tone_whose_phase_wanders_is_steady_and_one_that_stops_is_not() {
        for seed in 0..20 {
            let mut phase = 0.0;
            let steady = band(seed, 1.0, |_, e| {
                phase += TAU / 12.0 + 0.01 * e;
                0.7 * phase.cos()
            });
            assert!((swing(&steady) - 1.0).abs() < 0.15, "{}", swing(&steady));
            let mut phase = 0.0;
            let half = band(seed, 1.0, |i, e| {
                phase += TAU / 12.0 + 0.01 * e;
                if i < N / 2 { phase.cos() } else { 0.0 }
            });
            assert!((swing(&half) - 2.0).abs() < 0.4, "{}", swing(&half));
        }
    }

    #[test]
    fn of_a_mode_that_noise_drives_few_are_taken_for_steady() {
        let runs = 300;
        // Half a width of the resonance of 1/300 per sample: some 40 independent values in the record.
        let decay: f64 = 1.0 / 300.0;
        let (a, b) = (
            2.0 * (-decay).exp() * (TAU / 12.0).cos(),
            (-2.0 * decay).exp(),
        );
        let steady = (0..runs)
            .filter(|seed| {
                let (mut x, mut before) = (0.0, 0.0);
                let mode = band(*seed, 1.0, |_, e| {
                    (x, before) = (a * x - b * before + 0.06 * e, x);
                    x
                });
                swing(&mode) < STEADY
            })
            .count();
        assert!(steady <= 12, "{steady} of {runs}");
    }

    #[test]
    fn noise_alone_has_no_envelope() {
        assert!(swing(&[0.5; 10]).is_nan());
    }
}
