//! Whether a narrow band is a tone of steady size whose phase wanders, or noise behind a resonance.
//!
//! Of a tone A cos(phase) whose phase alone wanders, the square of the envelope is A^2 all the time; of a Gaussian
//! process it is exponential. The mean of its square over the square of its mean is 1 of the one and 2 of the other, of
//! many independent values without other noise. What it is of as many as there are, beside the noise that there is, is
//! simulated for both, and the nearer one gives the name. Whether the band is what that name says, all that `law` asks of its
//! envelope tells.

pub(crate) mod law;

use std::f64::consts::PI;
use std::sync::Arc;

use model::effect::{Covariance, Frequencies, Peak};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use crate::fit::likelihood::{Dct, invert};
use crate::test_level::{CheckId, Outcome};
use law::{Law, Portrait};

/// Nats within which the name stays open.
pub(super) const OPEN: f64 = 3.0;
/// Half widths either side of a band that belong to it: 0.9 of its energy.
pub(crate) const REACH: f64 = 6.0;
/// Simulations of either kind, and the most coefficients of one.
const RUNS: usize = 96;
const MOST: usize = 2048;
/// Chance below which fresh simulations are counted, and how many.
const COUNTED: f64 = 0.05;
const FRESH: usize = 200;
/// Values of the envelope for each coefficient of the band.
const OVERSAMPLED: usize = 4;
/// Part of its mean by which the ratio of a real band is off as a rule, beside chance: a size that swings by a fifth, or tails
/// a little heavier, is no other cause.
const TOLERATED: f64 = 0.1;

/// The complex envelope of neighbouring DCT-II coefficients, in as many values over the record as show it, turning by the
/// first of them.
pub(super) fn envelope_of(band: &[f64], planner: &mut FftPlanner<f64>) -> Vec<Complex<f64>> {
    // Coefficient k turns by k pi over the record, which is half of what the transform spans.
    let length = (2 * OVERSAMPLED * band.len()).next_power_of_two();
    let mut z = vec![Complex::default(); length];
    z.iter_mut().zip(band).for_each(|(z, c)| z.re = *c);
    planner.plan_fft_inverse(length).process(&mut z);
    z.truncate(length / 2);
    z
}

/// A band as it is seen: neighbouring coefficients over the noise beside it, and its density there over that.
pub(super) struct Band {
    pub coefficients: Vec<f64>,
    pub density: Vec<f64>,
}

/// What an envelope says.
pub(super) struct Seen {
    /// ln of how much likelier it is of a steady tone than of noise.
    pub odds: f64,
    portrait: Portrait,
    /// Second moments of the squared envelope that a steady tone gives, and noise.
    seconds: [f64; 2],
    /// Chance that the likelier of them makes an envelope that is as far off, and what is farthest.
    chance: (f64, &'static str),
}

/// Coefficients less what the noise beside the band has of them.
pub(super) fn kept(coefficients: &[f64], density: &[f64]) -> Vec<f64> {
    let both = coefficients.iter().zip(density);
    both.map(|(c, d)| c * d / (1.0 + d)).collect()
}

fn normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
    StandardNormal.sample(rng)
}

/// A tone of variance 1 whose phase wanders: its coefficients, the band in their middle and `half` of them wide either side of
/// it at half power.
fn tone(dct: &Dct, count: usize, half: f64, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let step = (2.0 * PI * half / count as f64).sqrt();
    let mut phase = Uniform::new(-PI, PI).map_or(0.0, |u| u.sample(rng));
    let samples = (0..count).map(|_| {
        phase += 0.5 * PI + step * normal(rng);
        2f64.sqrt() * phase.cos()
    });
    dct.forward(&samples.collect::<Vec<_>>())
}

fn portrait(coefficients: &[f64], density: &[f64], planner: &mut FftPlanner<f64>) -> Portrait {
    let z = envelope_of(&kept(coefficients, density), planner);
    Portrait::of(&z, planner)
}

/// Simulations of the envelope of a band, by a steady tone and by noise, with its noise and of its shape.
struct Simulations {
    /// How much farther what they give scatters than what is of the record.
    fewer: f64,
    /// The density of the band over the noise, at as many coefficients as are simulated.
    density: Vec<f64>,
    /// The same of a tone, whose band lies in the middle of the transform of that length; its half width and its size.
    lorentzian: Vec<f64>,
    from: usize,
    length: usize,
    half: f64,
    size: f64,
    dct: Dct,
    rng: Xoshiro256PlusPlus,
    planner: FftPlanner<f64>,
}

impl Simulations {
    /// Of a band of this height and half width over the noise.
    fn new(band: &Band, (top, half): (f64, f64), seed: u64) -> Self {
        // A shorter record has fewer values of the same kind: an envelope is as many values as a power of two, which have to lie
        // as close there.
        let stride = band.density.len().div_ceil(MOST).next_power_of_two();
        let half = half / stride as f64;
        let reach = ((2.0 * REACH * half) as usize).clamp(8, 2 * MOST);
        let length = (2 * reach).next_power_of_two();
        let from = length / 2 - reach / 2;
        let lorentzian = (from..from + reach)
            .map(|k| top / (1.0 + ((k as f64 - 0.5 * length as f64) / half).powi(2)));
        Self {
            fewer: (stride as f64).sqrt(),
            density: band.density.iter().copied().step_by(stride).collect(),
            lorentzian: lorentzian.collect(),
            from,
            length,
            half,
            size: (top * PI * half / length as f64).sqrt(),
            dct: Dct::new(length),
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
            planner: FftPlanner::new(),
        }
    }

    fn steady(&mut self) -> Portrait {
        let c = tone(&self.dct, self.length, self.half, &mut self.rng);
        let of_band = &c[self.from..self.from + self.lorentzian.len()];
        let own: Vec<f64> = (of_band.iter())
            .map(|c| self.size * c + normal(&mut self.rng))
            .collect();
        portrait(&own, &self.lorentzian, &mut self.planner)
    }

    fn noise(&mut self) -> Portrait {
        let own: Vec<f64> = (self.density.iter())
            .map(|d| (1.0 + d).sqrt() * normal(&mut self.rng))
            .collect();
        portrait(&own, &self.density, &mut self.planner)
    }

    /// As many of the one or the other.
    fn draw(&mut self, count: usize, noise: bool) -> Vec<Portrait> {
        let one = |_| if noise { self.noise() } else { self.steady() };
        (0..count).map(one).collect()
    }

    /// Chance that a law makes an envelope that is as far off as one that was seen, and what is farthest. Few values have heavier
    /// tails than the law of a largest one: where that finds little chance, fresh simulations are counted (Barnard, 1963).
    fn chance(&mut self, seen: &Portrait, law: &Law, noise: bool) -> (f64, &'static str) {
        let (p, off) = law.chance(seen, self.fewer);
        if p > COUNTED {
            return (p, off);
        }
        let score = law.score(seen, self.fewer, 1.0);
        let fresh = self.draw(FRESH, noise);
        let beyond = (fresh.iter())
            .filter(|r| law.score(r, self.fewer, self.fewer) >= score)
            .count();
        let share = (beyond + 1) as f64 / (FRESH + 1) as f64;
        (if beyond > 0 { share } else { p.min(share) }, off)
    }
}

impl Seen {
    /// What the envelope of a band is like; `None` where no more than the noise is there.
    pub(super) fn new(band: &Band, seed: u64) -> Option<Self> {
        let top = band.density.iter().copied().fold(0.0, f64::max);
        if band.density.len() < 4 || top <= 0.0 {
            return None;
        }
        // Of a Lorentzian the sum over all coefficients is pi times its half width and its height; what lies within the
        // reach is 2 / pi atan(REACH) of it.
        let half = band.density.iter().sum::<f64>() / (2.0 * REACH.atan() * top);
        let mut simulations = Simulations::new(band, (top, half), seed);
        let noise = simulations.draw(RUNS, true);
        let steady = simulations.draw(RUNS, false);
        let fewer = simulations.fewer;
        let laws = [Law::of(&steady, fewer, false), Law::of(&noise, fewer, true)];
        let portrait = portrait(&band.coefficients, &band.density, &mut simulations.planner);
        let likely = |(mean, spread): (f64, f64)| {
            let spread = spread.hypot(TOLERATED);
            -0.5 * ((portrait.size[0] - mean) / spread).powi(2) - spread.ln()
        };
        let mut odds = likely(laws[0].second) - likely(laws[1].second);
        if !odds.is_finite() {
            return None;
        }
        let mut of = |k: usize| simulations.chance(&portrait, &laws[k], k == 1);
        let nearer = usize::from(odds <= 0.0);
        let mut chance = of(nearer);
        let level = CheckId::BandEnvelope.level();
        // Where one moment leaves the name open, all of the envelope tells.
        if odds.abs() < OPEN && chance.0 < level {
            let other = of(1 - nearer);
            if other.0 >= level {
                (odds, chance) = (-odds, other);
            }
        }
        Some(Self {
            odds,
            seconds: [0, 1].map(|k: usize| laws[k].second.0.exp()),
            portrait,
            chance,
        })
    }

    /// What the name claims of the envelope.
    pub(super) fn claim(&self, named: &str) -> Outcome {
        let (p_value, off) = self.chance;
        let [second, _, geometric] = self.portrait.size.map(f64::exp);
        let [steady, noise] = self.seconds;
        Outcome {
            id: CheckId::BandEnvelope,
            about: vec![],
            statistic: second,
            p_value,
            what: format!(
                "told as {named}: the mean square of its squared envelope over its squared mean is {second:.2}; of a steady tone it would be {steady:.2}, of noise {noise:.2}; its geometric over its arithmetic mean {geometric:.2}; farthest from the simulations of its law: {off}"
            ),
        }
    }
}

/// Coefficients of a simulated tone, and half its width in them; its runs.
const LENGTH: usize = 1024;
const HALF_WIDTH: f64 = 12.0;
const TONES: usize = 200;

/// How much wider the errors of variance, centre and width are of a tone whose phase wanders than those of Gaussian noise of
/// its density: with the information I of the noise and the variance J of its gradient of such a tone, the variance is
/// I^-1 J I^-1 (White, 1982). `level` is the other noise at the band, over the white one; `mode` its density, and `at` its
/// coordinates.
pub(super) fn wider(mode: &Arc<dyn Covariance>, peak: &Peak, level: f64) -> Vec<f64> {
    const STEP: f64 = 1e-4;
    let half_width = PI * HALF_WIDTH / LENGTH as f64;
    // Both have the same height over the other noise: variance over width.
    let here = Peak {
        omega: 0.5 * PI,
        half_width,
        variance: peak.variance / peak.half_width * half_width / level,
    };
    let Some((mode, theta)) = mode.about(&here) else {
        return vec![];
    };
    let omega: Vec<f64> = (0..LENGTH).map(|k| PI * k as f64 / LENGTH as f64).collect();
    let at = Frequencies::at(omega);
    let density: Vec<f64> = mode.density(&theta, &at).iter().map(|d| 1.0 + d).collect();
    let deviation = |i: usize| -> Vec<f64> {
        let mut moved = theta.clone();
        moved[i] += STEP;
        let there = mode.density(&moved, &at);
        there
            .iter()
            .zip(&density)
            .map(|(t, d)| ((1.0 + t) / d).ln() / STEP)
            .collect()
    };
    let by: Vec<Vec<f64>> = (0..theta.len()).map(deviation).collect();
    let half_sum = |a: &[f64], b: &[f64]| 0.5 * numerics::column::dot(a, b);
    let information: Vec<Vec<f64>> = by
        .iter()
        .map(|a| by.iter().map(|b| half_sum(a, b)).collect())
        .collect();
    let (inverse, _) = invert(&information);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0x746f_6e65);
    let dct = Dct::new(LENGTH);
    let size = here.variance.sqrt();
    let steps: Vec<Vec<f64>> = (0..TONES)
        .map(|_| {
            let c = tone(&dct, LENGTH, HALF_WIDTH, &mut rng);
            let energies = c
                .iter()
                .zip(&density)
                .map(|(c, d)| (size * c + normal(&mut rng)).powi(2) / d);
            let energies: Vec<f64> = energies.collect();
            let gradient: Vec<f64> = by.iter().map(|d| half_sum(d, &energies)).collect();
            inverse
                .iter()
                .map(|row| row.iter().zip(&gradient).map(|(v, g)| v * g).sum())
                .collect()
        })
        .collect();
    (0..theta.len())
        .map(|i| {
            let mean = steps.iter().map(|s| s[i]).sum::<f64>() / TONES as f64;
            let variance =
                steps.iter().map(|s| (s[i] - mean).powi(2)).sum::<f64>() / (TONES - 1) as f64;
            (variance / inverse[i][i]).sqrt()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNT: usize = 12_000;
    /// Half width of the band, coefficients, and the variance of the noise beside it.
    const HALF: f64 = 60.0;
    const LEVEL: f64 = 0.25;

    /// A signal of mean square 1/2 in a little noise, as the band that a Lorentzian of that half width says.
    fn band_of(signal: &[f64], half: f64, rng: &mut Xoshiro256PlusPlus) -> Band {
        let samples = signal.iter().map(|s| s + LEVEL.sqrt() * normal(rng));
        let c = Dct::new(COUNT).forward(&samples.collect::<Vec<_>>());
        let middle = 0.4 * COUNT as f64;
        let (from, to) = (middle - REACH * half, middle + REACH * half);
        let top = 0.5 * COUNT as f64 / (PI * half) / LEVEL;
        let places = || from as usize..to as usize;
        Band {
            coefficients: places().map(|k| c[k] / LEVEL.sqrt()).collect(),
            density: (places())
                .map(|k| top / (1.0 + ((k as f64 - middle) / half).powi(2)))
                .collect(),
        }
    }

    /// A tone whose phase makes these steps.
    fn band(rng: &mut Xoshiro256PlusPlus, step: fn(&mut Xoshiro256PlusPlus) -> f64) -> Band {
        let mut phase = 0.0;
        let samples = (0..COUNT).map(|_| {
            phase += 0.4 * PI + step(rng);
            phase.cos()
        });
        let samples: Vec<f64> = samples.collect();
        band_of(&samples, HALF, rng)
    }

    /// A phase that walks: its variance grows by twice the half width, rad per sample.
    fn walks(rng: &mut Xoshiro256PlusPlus) -> f64 {
        (2.0 * PI * HALF / COUNT as f64).sqrt() * normal(rng)
    }

    /// The same spectrum by half turns at random.
    fn turns_over(rng: &mut Xoshiro256PlusPlus) -> f64 {
        let chance = 0.5 * PI * HALF / COUNT as f64;
        let turns = Uniform::new(0.0, 1.0).is_ok_and(|u| u.sample(rng) < chance);
        if turns { PI } else { 0.0 }
    }

    #[test]
    fn a_phase_that_walks_has_its_name_and_one_that_turns_over_has_none() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(23);
        let mut fails = |step| {
            let of = (0..20).filter(|seed| {
                let seen = Seen::new(&band(&mut rng, step), *seed).expect("a band");
                seen.claim("").p_value < CheckId::BandEnvelope.level()
            });
            of.count()
        };
        let (walking, turning) = (fails(walks), fails(turns_over));
        // 0.2 of 20 are expected by chance.
        assert!(walking <= 2, "{walking}");
        assert!(turning >= 18, "{turning}");
    }

    /// Half width of what stays for some time, coefficients.
    const SLOW: f64 = 8.0;

    /// A mode that noise drives.
    fn driven(rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
        let keep = (-PI * SLOW / COUNT as f64).exp();
        let drive = (0.5 * (1.0 - keep * keep)).sqrt();
        let mut z = Complex::new(normal(rng), normal(rng)) * 0.5f64.sqrt();
        let next = |i| {
            z = z * keep + Complex::new(normal(rng), normal(rng)) * drive;
            (z * Complex::from_polar(1.0, 0.4 * PI * i as f64)).re
        };
        (0..COUNT).map(next).collect()
    }

    /// A mode that is struck at random, with the same memory.
    fn struck(rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
        let rate = PI * SLOW / COUNT as f64;
        let keep = (-rate).exp();
        let mut z = Complex::new(0.0, 0.0);
        let chance = Uniform::new(0.0, 1.0).expect("a range");
        let next = |i| {
            z *= keep;
            // Once in three of its memories, with a mean square of 2 rate.
            if chance.sample(rng) < rate / 3.0 {
                z += Complex::new(normal(rng), normal(rng)) * 3f64.sqrt();
            }
            (z * Complex::from_polar(1.0, 0.4 * PI * i as f64)).re
        };
        (0..COUNT).map(next).collect()
    }

    #[test]
    fn a_mode_that_noise_drives_has_its_name_and_one_that_is_struck_has_none() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(29);
        let mut fails = |of: fn(&mut Xoshiro256PlusPlus) -> Vec<f64>| {
            let of = (0..40).filter(|seed| {
                let signal = of(&mut rng);
                let band = band_of(&signal, SLOW, &mut rng);
                let seen = Seen::new(&band, *seed).expect("a band");
                seen.claim("").p_value < CheckId::BandEnvelope.level()
            });
            of.count()
        };
        let (driven, struck) = (fails(driven), fails(struck));
        // 0.4 of 40 are expected by chance.
        assert!(driven <= 3, "{driven}");
        assert!(struck >= 36, "{struck}");
    }
}
