//! Records of known noise, for campaigns and tests: each term made in the time domain by its definition, apart from the
//! code that estimates it.

use rand_core::Rng;
use rand_distr::{Distribution, StandardNormal};

use numerics::transform::Dct;

/// The noise of a record in IEEE Std 952 letters, unit U. What is 0 is absent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Truth {
    /// N, U·√s.
    pub n: f64,
    /// B, U.
    pub b: f64,
    /// K, U/√s.
    pub k: f64,
    /// Q, U·s.
    pub q: f64,
    /// R, U/s.
    pub r: f64,
}

/// Length over which flicker is made, in parts of the record: it has the slow part that a longer life would have given.
const FLICKER_LIFE: usize = 6;

impl Truth {
    /// `samples` readings every `tau0` s.
    ///
    /// White noise, random walk, ramp and angle quantization (the difference of white angles) sample by sample; flicker
    /// from its spectral density B²/(2πf), two-sided, over six times the length, of which a part away from the ends is
    /// taken.
    pub fn record(&self, samples: usize, tau0: f64, rng: &mut impl Rng) -> Vec<f64> {
        let mut gauss = || -> f64 { StandardNormal.sample(rng) };
        let mut y = if self.b > 0.0 {
            let long = FLICKER_LIFE * samples;
            let c: Vec<f64> = (0..long)
                .map(|i| {
                    let w = std::f64::consts::PI * i as f64 / long as f64;
                    if i == 0 {
                        0.0
                    } else {
                        self.b / w.sqrt() * gauss()
                    }
                })
                .collect();
            let start = samples * (FLICKER_LIFE - 1) / 2;
            Dct::new(long).inverse(&c)[start..start + samples].to_vec()
        } else {
            vec![0.0; samples]
        };
        let mut bias = 0.0;
        let mut angle = self.q * gauss();
        for (i, v) in y.iter_mut().enumerate() {
            bias += self.k * tau0.sqrt() * gauss();
            *v += bias + self.n / tau0.sqrt() * gauss() + self.r * i as f64 * tau0;
            if self.q > 0.0 {
                let next = self.q * gauss();
                *v += (next - angle) / tau0;
                angle = next;
            }
        }
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::allan::{Deviation, Phase, deviation};
    use rand_core::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn each_term_has_the_allan_deviation_of_its_letter() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(41);
        let (samples, tau0) = (200_000, 0.1);
        for (truth, m, expected) in [
            (
                Truth {
                    n: 0.3,
                    ..Truth::default()
                },
                40,
                0.3 / 2.0,
            ),
            (
                Truth {
                    b: 0.3,
                    ..Truth::default()
                },
                200,
                0.664 * 0.3,
            ),
            // K √(τ/3) at τ = 4 s.
            (
                Truth {
                    k: 0.3,
                    ..Truth::default()
                },
                40,
                0.3 * (4.0f64 / 3.0).sqrt(),
            ),
            (
                Truth {
                    q: 0.3,
                    ..Truth::default()
                },
                40,
                3f64.sqrt() * 0.3 / 4.0,
            ),
            (
                Truth {
                    r: 0.3,
                    ..Truth::default()
                },
                40,
                0.3 * 4.0 / 2f64.sqrt(),
            ),
        ] {
            let y = truth.record(samples, tau0, &mut rng);
            let phase = Phase::from_values(&y, std::slice::from_ref(&(0..samples)));
            let got = deviation(&phase, Deviation::Oadev, tau0, m)
                .unwrap()
                .deviation;
            assert!(
                (got / expected - 1.0).abs() < 0.05,
                "{truth:?}: {got} {expected}"
            );
        }
    }
}
