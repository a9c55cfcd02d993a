//! The eighth set's noise.

use std::f64::consts::{PI, TAU};

use super::super::kept_back::shaped;
use super::super::kept_back_fourth::noise::of_density;
use super::super::kept_back_seventh::noise::of_memory;
use super::super::kept_back_third::noise::of_humps;
use super::super::{Change, Foreign};
use crate::random::Draw;
use crate::stand::Stand;
use crate::strength::{Meter, of_variance, size_for};

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    Some(match name {
        "noise that undoes itself" => undoing(draw, stand, name, axis, wanted),
        "noise between two edges" => {
            let band = Band::of(draw, stand.rate_hz);
            of_density(draw, stand, name, axis, wanted, &|w| band.density(w))
        }
        "noise that feeds its own size" => feeding(draw, stand, name, wanted),
        "swing that pushes one way" => pushing(draw, stand, name, wanted),
        "reference renewed every few readings" => renewed(draw, stand, name, wanted),
        "hump of noise that runs through the band" => running(draw, stand, name, axis, wanted),
        _ => return None,
    })
}

/// Noise that is differenced by a fraction of a time (Hosking 1981), the opposite of a long memory: what came is taken
/// back, by a power of time. The order gives the strength.
fn undoing(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let strength = |order: f64| shaped(stand, axis, &|w| of_memory(-order.min(0.9), w) - 1.0);
    let order = size_for(wanted, &strength).min(0.9);
    let all = of_density(draw, stand, name, axis, f64::MAX, &|w| of_memory(-order, w));
    Foreign {
        strength: strength(order),
        ..all
    }
}

/// What a filter of steep sides passes between two edges, rad per sample, of variance 1.
pub(in super::super) struct Band {
    pub(in super::super) low: f64,
    pub(in super::super) high: f64,
}

impl Band {
    fn of(draw: &mut Draw, rate_hz: f64) -> Self {
        let (low, width) = (draw.by_ratio(0.6, 6.5), draw.by_ratio(0.5, 3.0));
        Self {
            low: TAU * low / rate_hz,
            high: TAU * (low + width) / rate_hz,
        }
    }

    /// Density at an angular frequency, rad per sample.
    pub(in super::super) fn density(&self, w: f64) -> f64 {
        if (self.low..self.high).contains(&w) {
            PI / (self.high - self.low)
        } else {
            0.0
        }
    }
}

/// What noise that feeds its own size makes of independent draws: variance[i] = 1 - stays + gain last^2 + (stays - gain)
/// variance[i-1], with the series itself.
pub(in super::super) fn fed(gain: f64, stays: f64, independent: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let gain = gain.min(stays);
    let (mut variance, mut last) = (1.0f64, 1.0f64);
    independent
        .iter()
        .map(|z| {
            variance = 1.0 - stays + gain * last * last + (stays - gain) * variance;
            last = variance.sqrt() * z;
            (variance, last)
        })
        .unzip()
}

/// A large swing makes the next ones larger, and the unrest dies down over some tens of readings (GARCH, Bollerslev 1986).
/// The spectrum stays white.
fn feeding(draw: &mut Draw, stand: &Stand, name: &'static str, wanted: f64) -> Foreign {
    let stays = 1.0 - draw.by_ratio(0.02, 0.1);
    let independent: Vec<f64> = (0..stand.samples()).map(|_| draw.normal()).collect();
    let strength = |gain: f64| of_variance(&fed(gain, stays, &independent).0);
    let gain = size_for(wanted, &strength);
    let (law, series) = fed(gain, stays, &independent);
    // The variance of a run is seldom 1: what it adds to it would be told before its shape.
    let mean = law.iter().sum::<f64>() / law.len() as f64;
    Foreign {
        name,
        strength: strength(gain),
        change: Change::Noise(series.iter().map(|x| x / mean.sqrt()).collect(), 1.0),
    }
}

/// A valve, or a diode, that turns either swing into a push of one sense for the next: x[i] = e[i] + push |x[i-1]|, the
/// threshold autoregression whose law is known, skew-normal with |x| that of half a normal law (Andel, Netuka and Svara
/// 1984). d'^2 = samples x ln(variance).
fn pushing(draw: &mut Draw, stand: &Stand, name: &'static str, wanted: f64) -> Foreign {
    let n = stand.samples();
    let strength = |push: f64| (n as f64 * moments(push.min(0.95)).1.ln()).sqrt();
    let push = size_for(wanted, &strength).min(0.95);
    let ((mean, variance), sign) = (moments(push), draw.sign());
    let mut x = draw.normal();
    for _ in 0..200 {
        x = draw.normal() + push * x.abs();
    }
    let noise = (0..n)
        .map(|_| {
            x = draw.normal() + push * x.abs();
            sign * (x - mean) / variance.sqrt()
        })
        .collect();
    Foreign {
        name,
        strength: strength(push),
        change: Change::Noise(noise, 1.0),
    }
}

/// Mean and variance of that autoregression.
fn moments(push: f64) -> (f64, f64) {
    let square = 1.0 / (1.0 - push * push);
    let mean = push * (2.0 / PI * square).sqrt();
    (mean, square - mean * mean)
}

/// d'^2 over the samples of a reference that stands for `length` readings and has `part` times the variance of the rest.
pub(in super::super) fn of_reference(length: usize, part: f64) -> f64 {
    let m = length as f64;
    part.ln_1p() - (m * part).ln_1p() / m
}

/// Mean density, 1 in the mean, of such readings: a triangle of correlation over the readings that share a reference.
#[cfg(test)]
pub(in super::super) fn density_of_reference(length: usize, part: f64, w: f64) -> f64 {
    let m = length as f64;
    let share = part / (1.0 + part);
    let triangle = |k: usize| 2.0 * (1.0 - k as f64 / m) * (k as f64 * w).cos();
    1.0 + share * (1..length).map(triangle).sum::<f64>()
}

/// A reference is sampled anew, noise and all, every few readings only, and stands for those between.
fn renewed(draw: &mut Draw, stand: &Stand, name: &'static str, wanted: f64) -> Foreign {
    let (n, length) = (stand.samples(), 2 + draw.of_many(5));
    let strength = |part: f64| (n as f64 * of_reference(length, part)).sqrt();
    let part = size_for(wanted, &strength);
    let first = draw.of_many(length);
    let mut reference = part.sqrt() * draw.normal();
    let noise = (0..n)
        .map(|i| {
            if (i + first).is_multiple_of(length) {
                reference = part.sqrt() * draw.normal();
            }
            (reference + draw.normal()) / (1.0 + part).sqrt()
        })
        .collect();
    Foreign {
        name,
        strength: strength(part),
        change: Change::Noise(noise, 1.0),
    }
}

/// Places at which a hump that runs is looked at for its strength.
const PLACES: usize = 12;

/// Where, Hz, a hump that runs evenly from one pitch to another is in each of [`PLACES`] equal parts of the run.
pub(in super::super) fn places(from: f64, to: f64) -> Vec<f64> {
    (0..PLACES)
        .map(|i| from + (to - from) * (i as f64 + 0.5) / PLACES as f64)
        .collect()
}

/// What flows past a body rubs and whistles at a pitch that rises with its speed, never quite the same: a hump of noise that
/// takes the whole run to go through the band. Its d' is that of humps that stay where this one is, averaged over the run.
fn running(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let (mut from, mut to) = (draw.between(1.0, 4.0), draw.between(6.0, 9.3));
    if draw.chance(0.5) {
        std::mem::swap(&mut from, &mut to);
    }
    let keep = (-TAU * draw.by_ratio(0.08, 0.5) / stand.rate_hz).exp();
    let meter = Meter::new(stand, axis);
    let densities: Vec<Vec<f64>> = places(from, to)
        .iter()
        .map(|f| of_humps(&meter, &[*f], keep, stand.rate_hz))
        .collect();
    let strength = |sigma: f64| -> f64 {
        let of = |place: &Vec<f64>| {
            let density: Vec<f64> = place.iter().map(|d| sigma * sigma * d).collect();
            meter.of_density(&density).powi(2)
        };
        (densities.iter().map(of).sum::<f64>() / PLACES as f64).sqrt()
    };
    let sigma = size_for(wanted, &strength);
    let n = stand.samples();
    let (mut re, mut im) = (draw.normal(), draw.normal());
    let drive = (1.0 - keep * keep).sqrt();
    let signal = (0..n)
        .map(|i| {
            let f = from + (to - from) * i as f64 / n as f64;
            let (sin, cos) = (TAU * f / stand.rate_hz).sin_cos();
            (re, im) = (
                keep * (re * cos - im * sin) + drive * draw.normal(),
                keep * (re * sin + im * cos) + drive * draw.normal(),
            );
            sigma * re
        })
        .collect();
    Foreign {
        name,
        strength: strength(sigma),
        change: Change::Add(signal),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stand::Needs;

    fn stand() -> (Draw, Stand) {
        let mut draw = Draw::of(20_261_122, 72, 0);
        let stand = Stand::draw(&mut draw, 3000.0, 20.0, Needs::default());
        (draw, stand)
    }

    fn noise_of(name: &'static str, wanted: f64) -> (Vec<f64>, f64) {
        let (mut draw, stand) = stand();
        let f = one(&mut draw, &stand, name, 0, wanted).expect("a name of this set");
        let Change::Noise(x, _) = f.change else {
            panic!("{name} is no noise")
        };
        (x, f.strength)
    }

    fn at_lag(x: &[f64], lag: usize) -> f64 {
        (lag..x.len()).map(|i| x[i] * x[i - lag]).sum::<f64>() / x.len() as f64
    }

    #[test]
    fn noise_of_the_eighth_set_has_variance_1() {
        for name in [
            "noise that undoes itself",
            "noise between two edges",
            "noise that feeds its own size",
            "swing that pushes one way",
            "reference renewed every few readings",
        ] {
            let (x, strength) = noise_of(name, 50.0);
            let variance = at_lag(&x, 0);
            assert!((variance - 1.0).abs() < 0.06, "{name}: {variance}");
            assert!((strength - 50.0).abs() < 0.1, "{name}: {strength}");
        }
    }

    #[test]
    fn densities_of_the_eighth_set_are_1_in_the_mean() {
        const CELLS: i32 = 100_000;
        let mean_of = |density: &dyn Fn(f64) -> f64| {
            let at = |i: i32| PI * (f64::from(i) + 0.5) / f64::from(CELLS);
            (0..CELLS).map(|i| density(at(i))).sum::<f64>() / f64::from(CELLS)
        };
        let band = Band {
            low: 0.7,
            high: 1.3,
        };
        assert!((mean_of(&|w| band.density(w)) - 1.0).abs() < 1e-3);
        assert!((mean_of(&|w| of_memory(-0.3, w)) - 1.0).abs() < 1e-6);
        assert!((mean_of(&|w| density_of_reference(5, 0.6, w)) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn what_undoes_itself_correlates_by_its_order_at_the_first_lag() {
        let (x, _) = noise_of("noise that undoes itself", 60.0);
        // Hosking 1981: order / (1 - order) at lag 1, of orders below 0; the variance gives the strength.
        let gamma = statrs::function::gamma::gamma;
        let nats = |d: f64| (gamma(1.0 + 2.0 * d) / gamma(1.0 + d).powi(2)).ln();
        let order = (1..900)
            .map(|k| f64::from(k) / 1000.0)
            .min_by(|a, b| {
                let off = |d: f64| (nats(d) * 60_000.0 - 3600.0).abs();
                off(*a).total_cmp(&off(*b))
            })
            .expect("there are orders");
        let (seen, told) = (at_lag(&x, 1), -order / (1.0 + order));
        assert!((seen - told).abs() < 0.03, "{seen} {told} {order}");
    }

    #[test]
    fn what_feeds_its_size_stays_white_and_its_squares_follow_each_other() {
        let (x, _) = noise_of("noise that feeds its own size", 80.0);
        let bound = 8.0 / (x.len() as f64).sqrt();
        let square: Vec<f64> = x.iter().map(|v| v * v - 1.0).collect();
        for lag in [1, 2, 5, 10] {
            assert!(at_lag(&x, lag).abs() < bound);
            assert!(at_lag(&square, lag) > 2.0 * bound, "{lag}");
        }
    }

    #[test]
    fn a_swing_that_pushes_has_the_moments_of_its_law() {
        let mut draw = Draw::of(20_261_122, 73, 0);
        for push in [0.2, 0.5, 0.8] {
            let (mut x, mut sum, mut square) = (0.0f64, 0.0, 0.0);
            const N: i32 = 400_000;
            for _ in 0..N {
                x = draw.normal() + push * x.abs();
                sum += x;
                square += x * x;
            }
            let mean = sum / f64::from(N);
            let variance = square / f64::from(N) - mean * mean;
            let (told_mean, told) = moments(push);
            assert!((mean - told_mean).abs() < 0.02, "{mean} {told_mean}");
            assert!((variance / told - 1.0).abs() < 0.02, "{variance} {told}");
        }
    }

    #[test]
    fn a_reference_is_worth_what_the_determinant_of_a_block_says() {
        // Two readings of correlation r: -ln(1 - r^2) / 2 each.
        let part = 0.6;
        let r: f64 = part / (1.0 + part);
        assert!((of_reference(2, part) + 0.5 * (-r * r).ln_1p()).abs() < 1e-12);
        assert!(of_reference(1, part).abs() < 1e-12);
    }
}
