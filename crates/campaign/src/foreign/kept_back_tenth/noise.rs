//! The tenth set's noise.

use std::f64::consts::TAU;

use super::super::kept_back::shaped;
use super::super::kept_back_ninth::resonating;
use super::super::{Change, Foreign};
use super::{DWELL, programme};
use crate::random::Draw;
use crate::stand::{Stand, lagged};
use crate::strength::{Meter, of_variance, size_for};

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &mut Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    Some(match name {
        "quantisation of an angle that is differenced" => {
            quantised(draw, stand, name, axis, wanted)
        }
        "brushes that spark when the command changes" => {
            let shape = sparks(draw, stand);
            by_law(name, &shape, wanted)
        }
        "noise by the magnitude of the table's rate" => {
            let shape = squared_rate(draw, stand);
            by_law(name, &shape, wanted)
        }
        "lower rate filled up by straight lines" => filled(draw, stand, name, wanted),
        "narrow band that a fan drives" => narrow_band(draw, stand, name, axis, wanted),
        _ => return None,
    })
}

/// Most of the noise that may be of another kind.
const MOST: f64 = 0.95;

/// What the share of a differenced angle's noise changes in the density of the white noise.
pub(in super::super) fn by_difference(share: f64, w: f64) -> f64 {
    -share.min(MOST) * w.cos()
}

/// A part that counts its angle in coarse steps, evenly spread within them: the rate is the difference of two counts
/// (quantisation noise of IEEE Std 952).
fn quantised(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let strength = |share: f64| shaped(stand, axis, &|w| by_difference(share, w));
    let share = size_for(wanted, &strength).min(MOST);
    // Of variance 1/2 each.
    let reach = 1.5f64.sqrt();
    let mut before = draw.between(-reach, reach);
    let noise = (0..stand.samples())
        .map(|_| {
            let now = draw.between(-reach, reach);
            now - std::mem::replace(&mut before, now)
        })
        .collect();
    Foreign {
        name,
        strength: strength(share),
        change: Change::Noise(noise, share),
    }
}

/// Noise whose variance is 1 at rest, and more by a shape.
pub(in super::super) fn by_law(name: &'static str, shape: &[f64], wanted: f64) -> Foreign {
    let law = |size: f64| -> Vec<f64> { shape.iter().map(|s| 1.0 + size * s).collect() };
    let size = size_for(wanted, &|size| of_variance(&law(size)));
    let law = law(size);
    Foreign {
        name,
        strength: of_variance(&law),
        change: Change::Scale(law.iter().map(|v| v.sqrt()).collect()),
    }
}

/// Brushes that spark while the current changes: each change of the command by its size, then dying away.
pub(in super::super) fn sparks(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, (3.0, 15.0));
    let keep = (-1.0 / (draw.by_ratio(0.4, 2.0) * stand.rate_hz)).exp();
    let (mut last, mut spark) = (stand.world.duty[0], 0.0f64);
    let duty = stand.world.duty.iter();
    duty.map(|d| {
        spark = keep * spark + (d - std::mem::replace(&mut last, *d)).abs();
        spark
    })
    .collect()
}

/// A scale factor that is noisy: the noise grows with the rate. The table is heavy, and follows its motor late.
pub(in super::super) fn squared_rate(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = lagged(&stand.world.duty, draw.by_ratio(3.0, 12.0), stand.rate_hz);
    rate.iter().map(|r| r * r).collect()
}

/// Where a reading lies among the samples of a part that gives `ratio` of them for each reading: the one before it, and
/// how far it is on the way to the next.
fn between(ratio: f64, reading: usize) -> (usize, f64) {
    let at = ratio * reading as f64;
    (at as usize, at.fract())
}

/// Covariance of readings `apart` from each other, that of the samples being 1.
fn covariance(ratio: f64, reading: usize, apart: usize) -> f64 {
    let ((from, u), (to, v)) = (between(ratio, reading), between(ratio, reading + apart));
    match to - from {
        0 => (1.0 - u) * (1.0 - v) + u * v,
        1 => u * (1.0 - v),
        _ => 0.0,
    }
}

/// Mean covariance of `n` readings with those `apart` from them.
pub(in super::super) fn mean_covariance(ratio: f64, n: usize, apart: usize) -> f64 {
    (0..n).map(|i| covariance(ratio, i, apart)).sum::<f64>() / n as f64
}

/// Readings beyond which two have no sample in common, for ratios from [`RATIO`].0 on.
const FAR: usize = 4;
/// Samples of the part for each reading.
const RATIO: (f64, f64) = (0.5, 0.95);

/// d' of `n` readings of which `share` of the variance is filled up so, the variance refitted: the determinant of their
/// covariance, by Cholesky's factors of a band.
pub(in super::super) fn of_filled(ratio: f64, share: f64, n: usize) -> f64 {
    let share = share.min(MOST);
    let mean = mean_covariance(ratio, n, 0);
    let mut logs = 0.0;
    // Rows of the factor, the last ones: [k] is the element k before the diagonal.
    let mut rows: Vec<[f64; FAR]> = Vec::with_capacity(n);
    for i in 0..n {
        let mut row = [0.0; FAR];
        for apart in (0..FAR.min(i + 1)).rev() {
            let own = share / mean * covariance(ratio, i - apart, apart);
            let white = if apart == 0 { 1.0 - share } else { 0.0 };
            let known: f64 = (apart + 1..FAR.min(i + 1))
                .map(|k| {
                    let other = if apart == 0 { &row } else { &rows[i - apart] };
                    row[k] * other[k - apart]
                })
                .sum();
            let left = own + white - known;
            row[apart] = if apart == 0 {
                left.max(1e-12).sqrt()
            } else {
                left / rows[i - apart][0]
            };
        }
        logs += 2.0 * row[0].ln();
        rows.push(row);
    }
    (-logs).max(0.0).sqrt()
}

/// Straight lines between samples, at `n` readings.
fn filled_up(ratio: f64, samples: &[f64], n: usize) -> Vec<f64> {
    (0..n)
        .map(|i| {
            let (before, part) = between(ratio, i);
            (1.0 - part) * samples[before] + part * samples[before + 1]
        })
        .collect()
}

/// A part of a lower rate whose output is drawn as straight lines between its samples, and converted once more at the
/// stand's rate: what the second conversion adds is white.
fn filled(draw: &mut Draw, stand: &Stand, name: &'static str, wanted: f64) -> Foreign {
    let n = stand.samples();
    let ratio = draw.between(RATIO.0, RATIO.1);
    let strength = |share: f64| of_filled(ratio, share, n);
    let share = size_for(wanted, &strength).min(MOST);
    let size = 1.0 / mean_covariance(ratio, n, 0).sqrt();
    let samples: Vec<f64> = (0..n + 2).map(|_| size * draw.normal()).collect();
    let noise = filled_up(ratio, &samples, n);
    Foreign {
        name,
        strength: strength(share),
        change: Change::Noise(noise, share),
    }
}

/// Density of a mode of this pitch and half width, Hz, driven by white noise of variance 1.
pub(in super::super) fn of_mode((pitch, half_width): (f64, f64), rate_hz: f64, w: f64) -> f64 {
    let (keep, own) = ((-TAU * half_width / rate_hz).exp(), TAU * pitch / rate_hz);
    let pole = |off: f64| 1.0 - 2.0 * keep * off.cos() + keep * keep;
    (keep * own.sin()).powi(2) / (pole(w - own) * pole(w + own))
}

/// A mode of the stand, of second order, that the air of a fan keeps ringing.
fn narrow_band(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let mode = (draw.by_ratio(0.8, 8.5), draw.by_ratio(0.05, 0.4));
    let meter = Meter::new(stand, axis);
    let density: Vec<f64> = meter
        .omega()
        .iter()
        .map(|w| of_mode(mode, stand.rate_hz, *w))
        .collect();
    let strength = |variance: f64| {
        let all: Vec<f64> = density.iter().map(|d| variance * d).collect();
        meter.of_density(&all)
    };
    let variance = size_for(wanted, &strength);
    // It rang before.
    let before = (5.0 / mode.1 * stand.rate_hz) as usize;
    let drive: Vec<f64> = (0..before + stand.samples())
        .map(|_| variance.sqrt() * draw.normal())
        .collect();
    Foreign {
        name,
        strength: strength(variance),
        change: Change::Add(resonating(&drive, mode, stand.rate_hz).split_off(before)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stand::Needs;

    fn noise_of(name: &'static str) -> (Vec<f64>, Foreign, Stand) {
        let draw = &mut Draw::of(20_261_122, 109, 0);
        let mut stand = Stand::draw(draw, 3000.0, 20.0, Needs::default());
        let f = one(draw, &mut stand, name, 0, 30.0).expect("a name of this set");
        assert!((f.strength - 30.0).abs() < 0.1, "{name}: {}", f.strength);
        let series = match &f.change {
            Change::Noise(x, _) | Change::Add(x) | Change::Scale(x) => x.clone(),
            _ => vec![],
        };
        (series, f, stand)
    }

    /// Mean product of samples `apart`.
    fn product(x: &[f64], apart: usize) -> f64 {
        let all = x.iter().zip(&x[apart..]);
        all.map(|(a, b)| a * b).sum::<f64>() / (x.len() - apart) as f64
    }

    #[test]
    fn an_angle_that_is_differenced_takes_back_half_of_what_it_gave() {
        let (x, ..) = noise_of("quantisation of an angle that is differenced");
        // 60 000 samples: 0.004 each.
        for (apart, told) in [(0, 1.0), (1, -0.5), (2, 0.0)] {
            let seen = product(&x, apart);
            assert!((seen - told).abs() < 0.02, "{apart}: {seen}");
        }
        // Even within its step: no difference is larger than it.
        assert!(x.iter().all(|v| v.abs() <= 6.0f64.sqrt()));
    }

    #[test]
    fn sparks_die_away_and_a_noisy_scale_factor_is_quiet_at_rest() {
        let (factor, _, stand) = noise_of("brushes that spark when the command changes");
        let duty = &stand.world.duty;
        for (i, pair) in factor.windows(2).enumerate() {
            assert!(duty[i + 1] != duty[i] || pair[1] <= pair[0]);
        }
        assert_eq!(factor[0], 1.0);
        let (factor, ..) = noise_of("noise by the magnitude of the table's rate");
        let least = factor.iter().copied().fold(f64::INFINITY, f64::min);
        assert!((1.0..1.05).contains(&least), "{least}");
    }

    #[test]
    fn readings_between_samples_have_the_covariance_that_is_reckoned_with() {
        let draw = &mut Draw::of(20_261_122, 110, 0);
        let stand = Stand::draw(draw, 3000.0, 20.0, Needs::default());
        for _ in 0..3 {
            let ratio = draw.between(RATIO.0, RATIO.1);
            let n = stand.samples();
            let samples: Vec<f64> = (0..n + 2).map(|_| draw.normal()).collect();
            let x = filled_up(ratio, &samples, n);
            for apart in 0..=FAR {
                let told = mean_covariance(ratio, n, apart);
                let seen = product(&x, apart);
                assert!((seen - told).abs() < 0.02, "{ratio} {apart}: {seen} {told}");
                assert!(apart < FAR || told == 0.0);
            }
        }
    }

    #[test]
    fn a_small_share_is_worth_half_the_squares_of_what_it_correlates() {
        let (ratio, share, n) = (0.7, 0.04, 5000);
        let mean = mean_covariance(ratio, n, 0);
        let mut squares = 0.0;
        for i in 0..n {
            squares += 0.5 * (share * (covariance(ratio, i, 0) / mean - 1.0)).powi(2);
            let far = (1..FAR).map(|k| (share * covariance(ratio, i, k) / mean).powi(2));
            squares += far.sum::<f64>();
        }
        let seen = of_filled(ratio, share, n).powi(2);
        assert!((seen / squares - 1.0).abs() < 0.1, "{seen} {squares}");
        assert_eq!(of_filled(ratio, 0.0, n), 0.0);
    }

    #[test]
    fn a_narrow_band_has_the_energy_of_its_density() {
        let (x, _, stand) = noise_of("narrow band that a fan drives");
        let drive = {
            let draw = &mut Draw::of(20_261_122, 111, 0);
            let drive: Vec<f64> = (0..200_000).map(|_| draw.normal()).collect();
            drive
        };
        let mode = (2.3, 0.4);
        let y = resonating(&drive, mode, stand.rate_hz);
        const BINS: i32 = 20_000;
        let at = |i: i32| std::f64::consts::PI * (f64::from(i) + 0.5) / f64::from(BINS);
        let told = (0..BINS)
            .map(|i| of_mode(mode, stand.rate_hz, at(i)))
            .sum::<f64>();
        let seen = product(&y, 0) / (told / f64::from(BINS));
        // About 2 x 0.4 Hz x 10 000 s x pi / 2 that are independent: 0.01.
        assert!((seen - 1.0).abs() < 0.05, "{seen}");
        assert!(product(&x, 0) < stand.white(0));
    }
}
