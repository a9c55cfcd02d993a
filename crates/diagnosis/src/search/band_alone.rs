//! Whether a band is a thing of its own, beside the other bands of its channel.
//!
//! Modes and oscillators know nothing of each other. A tone that hops between two pitches is two bands of which one is there when the
//! other is not; a motion that repeats itself with some jitter has harmonics whose pitches move together, and whose phases are locked:
//! of bands a and b about j and k times one frequency, z_a^k and z_b^j then turn alike, and the mean of z_a^k z_b*^j stands out of
//! its spectrum (the bicoherence of Kim and Powers, 1979, and its next orders).

use std::f64::consts::PI;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::band_source::{Moves, beyond, chance, in_cells};
use crate::test_level::{CheckId, Outcome};

/// Powers at which the phases of two bands may be locked: harmonics up to the third.
const LOCKED: [(i32, i32); 6] = [(2, 1), (1, 2), (3, 1), (1, 3), (3, 2), (2, 3)];
/// Frequencies either side that are the neighbourhood of the mean, without the next ones.
const BESIDE: usize = 24;

/// A product of envelopes over the record in `n` values, turned back by what their places differ by in coefficients.
pub(super) fn between(
    n: usize,
    turns: f64,
    mut product: impl FnMut(usize) -> Complex<f64>,
) -> Vec<Complex<f64>> {
    let back = PI * turns / n as f64;
    (0..n)
        .map(|i| product(i) * Complex::from_polar(1.0, back * i as f64))
        .collect()
}

/// Chance that the mean of a series stands out of its spectrum as well, and the size of its sum.
pub(super) fn stands_out(mut product: Vec<Complex<f64>>) -> (f64, f64) {
    let n = product.len();
    FftPlanner::new().plan_fft_forward(n).process(&mut product);
    let beside = (2..=BESIDE).flat_map(|d| [d, n - d]);
    let count = 2.0 * (BESIDE as f64 - 1.0);
    let mean = beside.map(|d| product[d].norm_sqr()).sum::<f64>() / count;
    // The chance of an exponential value over the mean of `count` others.
    let ratio = product[0].norm_sqr() / mean.max(f64::MIN_POSITIVE);
    ((-count * (ratio / count).ln_1p()).exp(), product[0].norm())
}

/// Chance that the phases of two bands are locked as well at these powers; none where they lie elsewhere.
fn locked(a: &Moves, b: &Moves, (j, k): (i32, i32)) -> Option<f64> {
    let (to_a, to_b) = (f64::from(j), f64::from(k));
    let apart = (to_a * a.middle() - to_b * b.middle()).abs();
    if apart > to_a * a.half + to_b * b.half {
        return None;
    }
    let n = a.envelope.len().max(b.envelope.len());
    let turns = to_a * a.places.start as f64 - to_b * b.places.start as f64;
    let at = |m: &Moves, i: usize| m.envelope[i * m.envelope.len() / n];
    let both = |i| at(a, i).powi(j) * at(b, i).conj().powi(k);
    Some(stands_out(between(n, turns, both)).0)
}

/// Whether the phase of a band is locked to that of one of the others.
pub(super) fn is_locked(own: &Moves, others: &[&Moves]) -> bool {
    let all = others.iter().flat_map(|o| {
        let each = LOCKED.iter();
        each.filter_map(|powers| locked(own, o, *powers))
    });
    let all: Vec<f64> = all.collect();
    let count = all.len() as f64;
    (all.iter()).any(|p| p * count < CheckId::BandAlone.level())
}

/// The claim of a band that is told as `named`: that it is a sine, whose `harmonics` have these chances, and knows nothing of the
/// other bands.
pub(super) fn claim(
    own: &Moves,
    others: &[&Moves],
    harmonics: &[f64],
    named: &str,
) -> Option<Outcome> {
    let cells = own.size.len();
    let planner = &mut FftPlanner::new();
    let harmonics = harmonics.iter();
    let mut all: Vec<(f64, &'static str)> = harmonics.map(|p| (*p, "it has harmonics")).collect();
    // Bands that overlap are one cluster, and asked together.
    for o in others {
        let course = |values: &[f64]| beyond(in_cells(values, cells), &[]);
        let alike = [
            (
                &own.size,
                &o.size,
                "its size goes with that of another band",
            ),
            (
                &own.pitch,
                &o.pitch,
                "its pitch goes with that of another band",
            ),
        ];
        for (series, other, what) in alike {
            all.extend(chance(series, &course(other), planner).map(|(p, _)| (p, what)));
        }
        let phases = LOCKED.iter().filter_map(|powers| locked(own, o, *powers));
        all.extend(phases.map(|p| (p, "its phase is locked to that of another band")));
    }
    let (p, what) = *all.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(Outcome {
        id: CheckId::BandAlone,
        about: vec![],
        statistic: p,
        p_value: (p * all.len() as f64).min(1.0),
        what: format!("told as {named}: {what}"),
    })
}

#[cfg(test)]
pub(super) mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::super::envelope::Band;
    use super::*;
    use crate::fit::likelihood::Dct;

    pub(in super::super) const COUNT: usize = 8192;
    /// Half width of the lower band, coefficients.
    pub(in super::super) const HALF: f64 = 12.0;

    /// A Lorentzian of variance 0.5 among coefficients of noise of this level.
    pub(in super::super) fn band_of(c: &[f64], middle: f64, half: f64, level: f64) -> Moves {
        let reach = 6.0 * half;
        let (from, to) = ((middle - reach) as usize, (middle + reach) as usize);
        let top = 0.5 * COUNT as f64 / (PI * half) / level;
        let density = (from..to).map(|k| top / (1.0 + ((k as f64 - middle) / half).powi(2)));
        let band = Band {
            coefficients: c[from..to].iter().map(|c| c / level.sqrt()).collect(),
            density: density.collect(),
        };
        Moves::of(&band, from).expect("long enough")
    }

    /// A band of a tone whose phase is `times` a wandering one, in a little noise.
    fn band(phase: &[f64], times: f64, rng: &mut Xoshiro256PlusPlus) -> Moves {
        let samples = phase.iter().map(|p| {
            let e: f64 = StandardNormal.sample(rng);
            (times * p).cos() + 0.5 * e
        });
        let c = Dct::new(COUNT).forward(&samples.collect::<Vec<_>>());
        band_of(&c, times * 0.2 * COUNT as f64, times * times * HALF, 0.25)
    }

    fn phase(rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
        let step = (2.0 * PI * HALF / COUNT as f64).sqrt();
        let mut phase = 0.0;
        let next = |_| {
            let e: f64 = StandardNormal.sample(rng);
            phase += 0.2 * PI + step * e;
            phase
        };
        (0..COUNT).map(next).collect()
    }

    #[test]
    fn harmonics_of_one_motion_are_locked_and_two_motions_are_not() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        let (mut low, mut seen) = (0, 0);
        for _ in 0..100 {
            let (one, other) = (phase(&mut rng), phase(&mut rng));
            let first = band(&one, 1.0, &mut rng);
            let own = band(&one, 2.0, &mut rng);
            let foreign = band(&other, 2.0, &mut rng);
            let p = |second: &Moves| claim(&first, &[second], &[], "").expect("asked").p_value;
            seen += usize::from(p(&own) < 1e-2);
            low += usize::from(p(&foreign) < 5e-2);
        }
        // 5 of 100 are expected at 5 %.
        assert!(low <= 11, "{low}");
        assert!(seen > 90, "{seen}");
    }
}
