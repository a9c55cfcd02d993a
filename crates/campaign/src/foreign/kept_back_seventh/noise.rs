//! The seventh set's noise, its coupling of axes and its codes.

use std::f64::consts::{PI, TAU};

use super::super::kept_back::{of_law, shaped, variance};
use super::super::kept_back_fifth::noise::of_edges;
use super::super::kept_back_fourth::codes::energy_of;
use super::super::kept_back_fourth::noise::of_density;
use super::super::{Change, Foreign};
use crate::random::Draw;
use crate::stand::{LSB, Stand, wander};
use crate::strength::{Meter, size_for};

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    let n = stand.samples();
    Some(match name {
        "mode that noise drives" => mode(draw, stand, name, axis, wanted),
        "reverberation of the noise" => reverberation(draw, stand, name, axis, wanted),
        "angle that is rounded" => rounded(draw, stand, name, axis, wanted),
        "noise that swells and ebbs" => {
            let swell = TAU / (draw.by_ratio(5.0, 150.0) * stand.rate_hz);
            let first = draw.between(0.0, TAU);
            variance(name, wanted, &|size| {
                let law = |i| (size * (first + swell * f64::from(i)).sin()).exp();
                (0..n as u32).map(law).collect()
            })
        }
        "noise of random size" => {
            let tau = draw.by_ratio(0.5, 30.0);
            let log_size = wander(draw, n, stand.rate_hz, 1.0, tau);
            variance(name, wanted, &|size| {
                log_size.iter().map(|x| (size * x).exp()).collect()
            })
        }
        "noise of a double-exponential law" => double_exponential(draw, n, name, wanted),
        "colour that turns" => turning_colour(draw, stand, name, wanted),
        "long memory" => long_memory(draw, stand, name, axis),
        "tail of another axis" => tail(draw, stand, name, axis, wanted),
        "dead band at zero" => dead_band(draw, stand, name, axis, wanted),
        _ => return None,
    })
}

/// A swing whose phasor turns at a pitch and forgets itself as a Gauss-Markov process does: r^k cos(w k), variance 1.
pub(in super::super) struct Turning {
    keep: f64,
    turn: f64,
}

impl Turning {
    /// By pitch and half width, Hz.
    pub(in super::super) fn new(pitch: f64, half_width: f64, rate_hz: f64) -> Self {
        Self {
            keep: (-TAU * half_width / rate_hz).exp(),
            turn: TAU * pitch / rate_hz,
        }
    }

    /// Its density at an angular frequency, rad per sample; 1 in the mean.
    pub(in super::super) fn density(&self, w: f64) -> f64 {
        let r = self.keep;
        let side = |w: f64| (1.0 - r * r) / (1.0 + r * r - 2.0 * r * w.cos());
        0.5 * (side(w - self.turn) + side(w + self.turn))
    }

    /// A stretch of it, from any state on.
    pub(in super::super) fn of(&self, draw: &mut Draw, n: usize) -> Vec<f64> {
        let drive = (1.0 - self.keep * self.keep).sqrt();
        let (sin, cos) = self.turn.sin_cos();
        let (mut a, mut b) = (draw.normal(), draw.normal());
        (0..n)
            .map(|_| {
                (a, b) = (
                    self.keep * (cos * a - sin * b) + drive * draw.normal(),
                    self.keep * (sin * a + cos * b) + drive * draw.normal(),
                );
                a
            })
            .collect()
    }
}

/// A lightly damped mode of the mount that whatever is random drives.
fn mode(draw: &mut Draw, stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let (pitch, quality) = (draw.by_ratio(0.5, 8.5), draw.by_ratio(4.0, 60.0));
    let part = Turning::new(pitch, 0.5 * pitch / quality, stand.rate_hz);
    let meter = Meter::new(stand, axis);
    let shape: Vec<f64> = meter.omega().iter().map(|w| part.density(*w)).collect();
    let strength = |sigma: f64| {
        let density: Vec<f64> = shape.iter().map(|d| sigma * sigma * d).collect();
        meter.of_density(&density)
    };
    let sigma = size_for(wanted, &strength);
    let signal = part.of(draw, stand.samples());
    Foreign {
        name,
        strength: strength(sigma),
        change: Change::Add(signal.iter().map(|v| sigma * v).collect()),
    }
}

/// Density of noise of variance 1 of which a share comes back from its own output so many samples ago.
pub(in super::super) fn of_return(share: f64, after: usize, w: f64) -> f64 {
    let square = share * share;
    (1.0 - square) / (1.0 + square - 2.0 * share * (after as f64 * w).cos())
}

/// The output comes back into the input after a while, and again, and again.
fn reverberation(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let (after, sign) = (3 + draw.of_many(38), draw.sign());
    let strength = |share: f64| {
        let by = |w: f64| of_return(sign * share.min(0.95), after, w) - 1.0;
        shaped(stand, axis, &by)
    };
    let share = sign * size_for(wanted, &strength).min(0.95);
    let drive = (1.0 - share * share).sqrt();
    let mut noise: Vec<f64> = (0..after).map(|_| draw.normal()).collect();
    for i in after..after + stand.samples() {
        noise.push(share * noise[i - after] + drive * draw.normal());
    }
    Foreign {
        name,
        strength: strength(share.abs()),
        change: Change::Noise(noise.split_off(after), 1.0),
    }
}

/// A part that counts angle in whole steps and gives their differences for the rate: what each rounding leaves enters two
/// readings, once with either sign, even in its law (the Q of IEEE Std 952).
fn rounded(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let strength = |share: f64| shaped(stand, axis, &|w| -share.min(1.0) * w.cos());
    let share = size_for(wanted, &strength).min(1.0);
    let half = 1.5f64.sqrt();
    let mut before = draw.between(-half, half);
    let noise = (0..stand.samples())
        .map(|_| {
            let rest = draw.between(-half, half);
            let rate = rest - before;
            before = rest;
            rate
        })
        .collect();
    Foreign {
        name,
        strength: strength(share),
        change: Change::Noise(noise, share),
    }
}

/// d' of noise whose variance is drawn anew for each sample, a share of it exponential, against the normal law of the same
/// variance. At share 1 it is the law of Laplace.
pub(in super::super) fn of_exponential_variance(share: f64, n: usize) -> f64 {
    const CELLS: i32 = 800;
    const SIZES: usize = 100;
    // Each of equal chance.
    let sizes: Vec<f64> = (0..SIZES)
        .map(|k| 1.0 - share - share * (1.0 - (k as f64 + 0.5) / SIZES as f64).ln())
        .collect();
    let normal = |x: f64, v: f64| (-0.5 * x * x / v).exp() / (TAU * v).sqrt();
    let cells = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let at = |i: i32| 12.0 * (f64::from(i) + 0.5) / f64::from(CELLS);
        let all: Vec<f64> = (-CELLS..CELLS).map(|i| of(at(i))).collect();
        let sum: f64 = all.iter().sum();
        all.iter().map(|p| p / sum).collect()
    };
    let mean = sizes.iter().sum::<f64>() / SIZES as f64;
    let mixed = cells(&|x| sizes.iter().map(|v| normal(x, v / mean)).sum::<f64>());
    of_law(&mixed, &cells(&|x| normal(x, 1.0)), n)
}

/// White noise on the way to Laplace's law: its tails are heavy, and nothing in time tells.
fn double_exponential(draw: &mut Draw, n: usize, name: &'static str, wanted: f64) -> Foreign {
    let strength = |share: f64| of_exponential_variance(share.min(0.999), n);
    let share = size_for(wanted, &strength).min(0.999);
    let noise = (0..n)
        .map(|_| (1.0 - share + share * draw.exponential()).sqrt() * draw.normal())
        .collect();
    Foreign {
        name,
        strength: strength(share),
        change: Change::Noise(noise, 1.0),
    }
}

/// Neighbours that correlate now and anticorrelate then, turn by turn, while the variance stays: over the whole periods of
/// the record the noise is white. d'^2 = - samples x mean ln(1 - c^2).
fn turning_colour(draw: &mut Draw, stand: &Stand, name: &'static str, wanted: f64) -> Foreign {
    let n = stand.samples();
    let periods = draw.by_ratio(2.0, 40.0).round();
    let first = draw.between(0.0, TAU);
    let shape: Vec<f64> = (0..n)
        .map(|i| (first + TAU * periods * i as f64 / n as f64).sin())
        .collect();
    let strength = |size: f64| {
        let size = size.min(0.98);
        let nats = |s: &f64| -(-(size * s).powi(2)).ln_1p();
        shape.iter().map(nats).sum::<f64>().sqrt()
    };
    let size = size_for(wanted, &strength).min(0.98);
    let mut x = draw.normal();
    let noise = shape
        .iter()
        .map(|s| {
            let c = size * s;
            x = c * x + (1.0 - c * c).sqrt() * draw.normal();
            x
        })
        .collect();
    Foreign {
        name,
        strength: strength(size),
        change: Change::Noise(noise, 1.0),
    }
}

/// Density of fractionally integrated noise of that order, 1 in the mean (Granger and Joyeux 1980).
pub(in super::super) fn of_memory(order: f64, w: f64) -> f64 {
    // Mean of |2 sin(w/2)|^(-2 order).
    let gamma = statrs::function::gamma::gamma;
    let mean = gamma(1.0 - 2.0 * order) / gamma(1.0 - order).powi(2);
    (2.0 * (0.5 * w).sin().abs()).powf(-2.0 * order) / mean
}

/// Orders of the memory: with less a random walk hides all but little of it, with more it is flicker noise.
pub(in super::super) const ORDERS: (f64, f64) = (0.28, 0.32);

/// Noise that forgets by a power of time, between white and flicker. Its strength is that of its order, a little above 25
/// in 600 s.
fn long_memory(draw: &mut Draw, stand: &Stand, name: &'static str, axis: usize) -> Foreign {
    let order = draw.between(ORDERS.0, ORDERS.1);
    // What is lowest in the record is half a cycle long.
    let least = PI / stand.samples() as f64;
    // All of the noise is of this density.
    let all = of_density(draw, stand, name, axis, f64::MAX, &|w| {
        of_memory(order, w.max(least))
    });
    Foreign {
        strength: shaped(stand, axis, &|w| of_memory(order, w) - 1.0),
        ..all
    }
}

/// A line between the axes that is driven by one and discharges into the other: nothing in the same frame, then a tail.
fn tail(draw: &mut Draw, stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let other = (axis + 1 + draw.of_many(2)) % 3;
    let (keep, sign) = (draw.between(0.2, 0.85), draw.sign());
    let meter = Meter::new(stand, axis);
    // Of its own noise, not of what the other axis's bias does.
    let energy: Vec<f64> = meter
        .omega()
        .iter()
        .zip(energy_of(stand, other))
        .map(|(w, e)| e * of_tail(keep, *w))
        .collect();
    let (share, strength) = meter.sized(&energy, wanted);
    let making = move |counts: &[Vec<i32>; 3], draw: &mut Draw| {
        let from = &counts[other];
        let mean = from.iter().map(|c| f64::from(*c)).sum::<f64>() / from.len() as f64;
        let mut held = 0.0;
        counts[axis]
            .iter()
            .zip(from)
            .map(|(own, from)| {
                // Within its step the rate is anywhere.
                let new = f64::from(*own) + draw.between(-0.5, 0.5) + sign * share * held;
                held = keep * held + f64::from(*from) - mean;
                new.round() as i32
            })
            .collect()
    };
    Foreign {
        name,
        strength,
        change: Change::Made(Box::new(making)),
    }
}

/// What a tail does to a spectrum.
fn of_tail(keep: f64, w: f64) -> f64 {
    1.0 / (1.0 + keep * keep - 2.0 * keep * w.cos())
}

/// Lower edges, counts, of even codes about a middle, of which all rates within `band` read the middle.
pub(in super::super) fn edges(middle: i32, reach: i32, band: f64) -> (i32, Vec<f64>) {
    let first = middle - reach;
    let edge = |code: i32| {
        let off = f64::from(code - middle);
        let even = off - 0.5;
        f64::from(middle)
            + if off <= 0.0 {
                even.min(-band)
            } else {
                even.max(band)
            }
    };
    (first, (first..=first + 2 * reach).map(edge).collect())
}

/// A threshold against drift: rates that are small, the bias taken off, read zero, and the others are left as they are.
fn dead_band(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let (bias, sigma) = (stand.bias[axis] / LSB, stand.white(axis).sqrt() / LSB);
    let middle = (bias + sigma * draw.between(-0.5, 0.5)).round() as i32;
    let reach = (10.0 * sigma).ceil() as i32;
    let at = |wider: f64| edges(middle, reach, 0.5 + wider.min(3.0 * sigma));
    let strength = |wider: f64| {
        let (first, edges) = at(wider);
        of_edges(stand, axis, first, &edges)
    };
    let wider = size_for(wanted, &strength);
    let (first, edges) = at(wider);
    Foreign {
        name,
        strength: of_edges(stand, axis, first, &edges),
        change: Change::Edges(first, edges),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stand::Needs;

    fn stand() -> (Draw, Stand) {
        let mut draw = Draw::of(20_261_121, 61, 0);
        let stand = Stand::draw(&mut draw, 3000.0, 20.0, Needs::default());
        (draw, stand)
    }

    fn mean_of(density: &dyn Fn(f64) -> f64) -> f64 {
        const CELLS: i32 = 200_000;
        let at = |i: i32| PI * (f64::from(i) + 0.5) / f64::from(CELLS);
        (0..CELLS).map(|i| density(at(i))).sum::<f64>() / f64::from(CELLS)
    }

    #[test]
    fn densities_of_the_seventh_set_are_1_in_the_mean() {
        let mode = Turning::new(2.3, 0.05, 20.0);
        assert!((mean_of(&|w| mode.density(w)) - 1.0).abs() < 1e-6);
        assert!((mean_of(&|w| of_return(-0.4, 7, w)) - 1.0).abs() < 1e-6);
        let memory = mean_of(&|w| of_memory(0.2, w));
        assert!((memory - 1.0).abs() < 1e-2, "{memory}");
    }

    #[test]
    fn noise_of_the_seventh_set_has_variance_1() {
        let (mut draw, stand) = stand();
        for name in [
            "reverberation of the noise",
            "angle that is rounded",
            "noise of a double-exponential law",
            "colour that turns",
            "long memory",
        ] {
            let f = one(&mut draw, &stand, name, 0, 50.0).expect("a name of this set");
            let Change::Noise(x, _) = &f.change else {
                panic!("{name} is no noise")
            };
            let mean = x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64;
            assert!((mean - 1.0).abs() < 0.05, "{name}: {mean}");
        }
    }

    #[test]
    fn a_mode_correlates_as_its_phasor_turns() {
        let (mut draw, _) = stand();
        let part = Turning::new(3.0, 0.2, 20.0);
        let x = part.of(&mut draw, 200_000);
        let n = x.len() as f64;
        for lag in [0, 1, 3, 7] {
            let seen = (lag..x.len()).map(|i| x[i] * x[i - lag]).sum::<f64>() / n;
            let told = part.keep.powi(lag as i32) * (part.turn * lag as f64).cos();
            assert!((seen - told).abs() < 0.03, "{lag}: {seen} {told}");
        }
    }

    #[test]
    fn the_law_of_laplace_is_as_far_from_normal_as_its_entropy_says() {
        // Entropies at variance 1: 1 + ln(2) / 2 and ln(2 pi e) / 2.
        let nats = 0.5 * (TAU * 1f64.exp()).ln() - 1.0 - 0.5 * 2f64.ln();
        let found = of_exponential_variance(0.999, 12_000).powi(2) / 24_000.0;
        assert!((found / nats - 1.0).abs() < 0.05, "{found} {nats}");
        assert!(of_exponential_variance(0.0, 12_000) < 1e-3);
    }

    #[test]
    fn a_band_takes_its_codes_and_no_others() {
        let (first, even) = edges(3, 5, 0.5);
        assert_eq!(first, -2);
        assert!(
            even.iter()
                .enumerate()
                .all(|(i, e)| (e - (f64::from(first) + i as f64 - 0.5)).abs() < 1e-12)
        );
        let (_, wide) = edges(3, 5, 1.7);
        // Codes 2 and 4 never come; 1 and 5 lose a part.
        assert_eq!(&wide[3..=7], [0.5, 1.3, 1.3, 4.7, 4.7]);
        assert_eq!(wide[8], 5.5);
    }
}
