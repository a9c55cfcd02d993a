//! The third set's noise and codes.

use std::f64::consts::TAU;

use super::super::kept_back::{of_law, shares, variance};
use super::super::{Change, Foreign, extremes};
use crate::random::Draw;
use crate::stand::{LSB, Stand};
use crate::strength::{Meter, of_variance, size_for};

/// One of them; `None` for a name of another set.
pub(super) fn one(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    Some(match name {
        "noise with a hole in its spectrum" => hole(draw, stand, name, wanted),
        "noise that remembers its last size" => remembering(draw, stand, name, wanted),
        "swing that leaves its square behind" => square_behind(draw, stand, name, wanted),
        "noise while the temperature moves" => {
            let pace = pace(draw, stand, axis);
            variance(name, wanted, &|size| {
                pace.iter().map(|p| 1.0 + size * p).collect()
            })
        }
        "hump of noise that moves with temperature" => hump(draw, stand, name, axis, wanted),
        "two codes of the part in one" => two_in_one(draw, stand, name, axis),
        _ => return None,
    })
}

/// A filter that takes one band out of white noise and leaves the rest.
pub(in super::super) struct Notch {
    turn: f64,
    zeros: f64,
    poles: f64,
}

impl Notch {
    /// Amplitude that is left in the middle of the hole, about.
    const LEFT: f64 = 0.12;

    /// By frequency and half width, Hz.
    pub(in super::super) fn new(f: f64, half_width: f64, rate_hz: f64) -> Self {
        let radius = |half_width: f64| (-TAU * half_width / rate_hz).exp();
        Self {
            turn: TAU * f / rate_hz,
            zeros: radius(Self::LEFT * half_width),
            poles: radius(half_width),
        }
    }

    /// What it makes of a series.
    fn of(&self, series: impl Iterator<Item = f64>) -> Vec<f64> {
        let (cos, z, p) = (self.turn.cos(), self.zeros, self.poles);
        let (mut x1, mut x2, mut y1, mut y2) = (0.0, 0.0, 0.0, 0.0);
        series
            .map(|x| {
                let y = x - 2.0 * z * cos * x1 + z * z * x2 + 2.0 * p * cos * y1 - p * p * y2;
                (x2, x1, y2, y1) = (x1, x, y1, y);
                y
            })
            .collect()
    }

    /// Variance that it gives to white noise of variance 1: the sum of its squared response to a pulse.
    pub(in super::super) fn variance(&self) -> f64 {
        let length = (40.0 / (1.0 - self.poles)).ceil().clamp(100.0, 200_000.0) as usize;
        let pulse = (0..length).map(|i| f64::from(u8::from(i == 0)));
        self.of(pulse).iter().map(|y| y * y).sum()
    }

    /// Its squared gain at an angular frequency, rad per sample.
    #[cfg(test)]
    pub(in super::super) fn gain(&self, w: f64) -> f64 {
        let away = |r: f64, from: f64| 1.0 - 2.0 * r * (w - from).cos() + r * r;
        let both = |r: f64| away(r, self.turn) * away(r, -self.turn);
        both(self.zeros) / both(self.poles)
    }
}

/// A part that suppresses the fold of its own drive, or of the mains, by a narrow filter takes its noise out with it. The
/// filter's first response is 1 and its zeros lie inside the circle, so that the mean logarithm of its gain is 0 (Szegoe)
/// and d'^2 = samples x ln(variance of what it passes).
fn hole(draw: &mut Draw, stand: &Stand, name: &'static str, wanted: f64) -> Foreign {
    let f = draw.between(1.5, 8.5);
    let n = stand.samples();
    let of = |half_width: f64| Notch::new(f, half_width.clamp(1e-3, 1.2), stand.rate_hz);
    let strength = |half_width: f64| (n as f64 * of(half_width).variance().ln()).sqrt();
    let half_width = size_for(wanted, &strength);
    let (notch, settle) = (of(half_width), n);
    let white: Vec<f64> = (0..n + settle).map(|_| draw.normal()).collect();
    let size = notch.variance().sqrt();
    Foreign {
        name,
        strength: strength(half_width),
        change: Change::Noise(
            notch
                .of(white.into_iter())
                .into_iter()
                .skip(settle)
                .map(|y| y / size)
                .collect(),
            1.0,
        ),
    }
}

/// What noise with a memory of its own size makes of independent draws: variance 1 - share + share x last^2, with the
/// series itself.
pub(in super::super) fn remembered(share: f64, independent: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let share = share.min(0.95);
    let mut last = 1.0;
    independent
        .iter()
        .map(|z| {
            let variance = 1.0 - share + share * last * last;
            last = variance.sqrt() * z;
            (variance, last)
        })
        .unzip()
}

/// A gain control that is pumped by what it has just passed: the variance of a reading goes with the square of the one
/// before (Engle 1982). The spectrum stays white.
fn remembering(draw: &mut Draw, stand: &Stand, name: &'static str, wanted: f64) -> Foreign {
    let independent: Vec<f64> = (0..stand.samples()).map(|_| draw.normal()).collect();
    let strength = |share: f64| of_variance(&remembered(share, &independent).0);
    let share = size_for(wanted, &strength);
    Foreign {
        name,
        strength: strength(share),
        change: Change::Noise(remembered(share, &independent).1, 1.0),
    }
}

/// Thermal tail of an amplifier: the heat of a swing, its square, unbalances the input when the next reading is taken.
/// x[i] = e[i] + tail (e[i-1]^2 - 1), of variance 1 + 2 tail^2, is white: e and its square do not correlate. Who knows the
/// law predicts it down to variance 1, d'^2 = samples x ln(1 + 2 tail^2).
fn square_behind(draw: &mut Draw, stand: &Stand, name: &'static str, wanted: f64) -> Foreign {
    let n = stand.samples();
    let strength = |tail: f64| (n as f64 * (2.0 * tail * tail).ln_1p()).sqrt();
    let tail = size_for(wanted, &strength);
    let (size, tail) = ((1.0 + 2.0 * tail * tail).sqrt(), tail * draw.sign());
    let mut before = draw.normal();
    let noise = (0..n)
        .map(|_| {
            let e = draw.normal();
            let x = e + tail * (before * before - 1.0);
            before = e;
            x / size
        })
        .collect();
    Foreign {
        name,
        strength: strength(tail.abs()),
        change: Change::Noise(noise, 1.0),
    }
}

/// How fast the temperature moves either way, the fastest 1: while parts of unlike expansion rub along each other they
/// crackle, too fast and too small to tell one jerk from another, and are quiet once it has settled.
fn pace(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    let temperature = &stand.world.temperature[axis];
    let (n, half) = (
        stand.samples(),
        (draw.between(1.0, 4.0) * stand.rate_hz) as usize,
    );
    let pace: Vec<f64> = (0..n)
        .map(|i| (temperature[(i + half).min(n - 1)] - temperature[i.saturating_sub(half)]).abs())
        .collect();
    let fastest = extremes(&pace).1.max(1e-9);
    pace.iter().map(|p| p / fastest).collect()
}

/// Density of a hump about a frequency, of variance 1, at an angular frequency: the real part of a circle that turns, fades
/// and is driven at random.
pub(in super::super) fn of_hump(turn: f64, keep: f64, w: f64) -> f64 {
    let side = |from: f64| 1.0 / (1.0 - 2.0 * keep * (w - from).cos() + keep * keep);
    0.5 * (1.0 - keep * keep) * (side(turn) + side(-turn))
}

/// Mean density of a hump that is at each of these frequencies, Hz, for the same time.
pub(in super::super) fn of_humps(
    meter: &Meter,
    at_hz: &[f64],
    keep: f64,
    rate_hz: f64,
) -> Vec<f64> {
    let mean = |w: &f64| {
        let sum: f64 = at_hz
            .iter()
            .map(|f| of_hump(TAU * f / rate_hz, keep, *w))
            .sum();
        sum / at_hz.len() as f64
    };
    meter.omega().iter().map(mean).collect()
}

/// A resonance of the structure, at kilohertz, folded by the sampling: it softens as it warms, some 30 ppm a degree, and
/// what it makes of the molecules' blows wanders through the band with the temperature. Its d' is that of humps that stay
/// where this one is, averaged over the run.
fn hump(draw: &mut Draw, stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let temperature = &stand.world.temperature[axis];
    let (low, high) = extremes(temperature);
    let from = draw.between(1.5, 8.5);
    let to = loop {
        let to = draw.between(1.0, 9.0);
        if (to - from).abs() > 1.2 {
            break to;
        }
    };
    let keep = (-TAU * draw.by_ratio(0.08, 0.4) / stand.rate_hz).exp();
    let at_hz: Vec<f64> = temperature
        .iter()
        .map(|t| from + (to - from) * (t - low) / (high - low).max(1e-9))
        .collect();
    let meter = Meter::new(stand, axis);
    const PLACES: usize = 12;
    let places: Vec<Vec<f64>> = (0..PLACES)
        .map(|i| {
            let f = at_hz[(2 * i + 1) * at_hz.len() / (2 * PLACES)];
            of_humps(&meter, &[f], keep, stand.rate_hz)
        })
        .collect();
    let strength = |sigma: f64| -> f64 {
        let of = |place: &Vec<f64>| {
            let density: Vec<f64> = place.iter().map(|d| sigma * sigma * d).collect();
            meter.of_density(&density).powi(2)
        };
        (places.iter().map(of).sum::<f64>() / PLACES as f64).sqrt()
    };
    let sigma = size_for(wanted, &strength);
    let (mut re, mut im) = (draw.normal(), draw.normal());
    let drive = (1.0 - keep * keep).sqrt();
    let signal = at_hz
        .iter()
        .map(|f| {
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

/// Sigma either way of the bias within which the codes are followed.
const REACH: f64 = 7.0;

/// Lower edges of the readings, counts, when codes `fine` counts apart, the first of them `offset` counts off, are rounded
/// to whole counts; with the first reading.
pub(in super::super) fn edges_of(fine: f64, offset: f64, from: i32, to: i32) -> Vec<f64> {
    // The lowest code that rounds to a reading begins half a code below itself.
    (from..=to)
        .map(|reading| {
            let lowest = ((f64::from(reading) - 0.5 - offset) / fine).ceil();
            (lowest - 0.5) * fine + offset
        })
        .collect()
}

/// A gain below 1 in fixed point, by which the firmware brings the part to its nominal scale: now and then two codes of the
/// part become one reading, which then comes twice as often as its neighbours. Its strength is what the gain makes it.
fn two_in_one(draw: &mut Draw, stand: &Stand, name: &'static str, axis: usize) -> Foreign {
    // Below that, every other reading would be double: a bit that sticks at times does the same.
    let (gain, offset) = (draw.between(0.72, 0.91), draw.between(-0.5, 0.5));
    let (bias, sigma) = (stand.bias[axis] / LSB, stand.white(axis).sqrt() / LSB);
    let first = (bias - REACH * sigma).floor() as i32;
    let last = (bias + REACH * sigma).ceil() as i32;
    let edges = edges_of(gain, offset, first, last);
    let even: Vec<f64> = (first..=last).map(|c| f64::from(c) - 0.5).collect();
    let strength = of_law(
        &shares(&edges, bias, sigma),
        &shares(&even, bias, sigma),
        stand.samples(),
    );
    Foreign {
        name,
        strength,
        change: Change::Edges(first, edges),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_notch_leaves_white_noise_the_variance_that_its_gain_says() {
        for (f, half_width) in [(1.7, 0.05), (5.0, 0.3), (8.3, 1.0)] {
            let notch = Notch::new(f, half_width, 20.0);
            const CELLS: usize = 200_000;
            let at = |i: usize| std::f64::consts::PI * (i as f64 + 0.5) / CELLS as f64;
            let mean = |of: &dyn Fn(f64) -> f64| {
                (0..CELLS).map(|i| of(notch.gain(at(i)))).sum::<f64>() / CELLS as f64
            };
            assert!((mean(&|g| g) / notch.variance() - 1.0).abs() < 1e-6);
            // Szegoe: what makes d' a matter of the variance alone.
            assert!(mean(&f64::ln).abs() < 1e-6);
            assert!(notch.gain(TAU * f / 20.0) < 0.03);
        }
    }

    #[test]
    fn a_hump_has_variance_1() {
        for (turn, keep) in [(0.4, 0.9), (1.6, 0.97), (2.7, 0.85)] {
            const CELLS: usize = 100_000;
            let at = |i: usize| std::f64::consts::PI * (i as f64 + 0.5) / CELLS as f64;
            let mean = (0..CELLS).map(|i| of_hump(turn, keep, at(i))).sum::<f64>() / CELLS as f64;
            assert!((mean - 1.0).abs() < 1e-6, "{mean}");
        }
    }

    #[test]
    fn a_gain_of_four_fifths_doubles_every_fourth_reading() {
        let edges = edges_of(0.8, 0.0, -20, 20);
        let widths: Vec<f64> = edges.windows(2).map(|w| w[1] - w[0]).collect();
        let double = |w: &&f64| (**w - 1.6).abs() < 1e-9;
        assert!(widths.iter().all(|w| double(&w) || (w - 0.8).abs() < 1e-9));
        assert_eq!(widths.iter().filter(double).count(), widths.len() / 4);
        for (i, e) in edges.iter().enumerate() {
            // Just above an edge the part reads a code that rounds to this reading, just below to the one before.
            let reading = |x: f64| ((x / 0.8).round() * 0.8).round() as i32;
            assert_eq!(reading(e + 1e-6), i as i32 - 20);
            assert_eq!(reading(e - 1e-6), i as i32 - 21);
        }
    }

    #[test]
    fn a_memory_of_size_or_a_square_left_behind_keeps_the_spectrum_white() {
        let draw = &mut Draw::of(20_261_121, 13, 0);
        let stand = Stand::draw(draw, 3000.0, 20.0, crate::stand::Needs::default());
        for name in [
            "noise that remembers its last size",
            "swing that leaves its square behind",
        ] {
            let f = one(draw, &stand, name, 0, 60.0).expect("a name of this set");
            let Change::Noise(x, _) = &f.change else {
                panic!("{name} is not noise")
            };
            let n = x.len() as f64;
            let of = |lag: usize, a: &dyn Fn(f64) -> f64| {
                (lag..x.len()).map(|i| x[i] * a(x[i - lag])).sum::<f64>() / n
            };
            assert!((of(0, &|v| v) - 1.0).abs() < 0.05, "{name}");
            for lag in 1..=20 {
                // Five sigma of white noise; heavy tails make lag 1 a little wider.
                let r = of(lag, &|v| v);
                assert!(r.abs() < 6.0 / n.sqrt(), "{name}: {r} at lag {lag}");
            }
            // What they do leave.
            let seen = match name {
                "noise that remembers its last size" => {
                    (1..x.len())
                        .map(|i| (x[i] * x[i] - 1.0) * (x[i - 1] * x[i - 1] - 1.0))
                        .sum::<f64>()
                        / n
                        / 2.0
                }
                _ => of(1, &|v| v * v - 1.0).abs() / 2f64.sqrt(),
            };
            assert!(seen > 20.0 / n.sqrt(), "{name}: {seen}");
        }
    }
}
