//! Noise whose readings depend on each other where a spectrum does not show it, or not all of it.

use super::super::super::prelude::*;

/// Most of the noise that may be of another kind.
pub(super) const MOST: f64 = 0.95;

/// Readings beyond which two have no sample in common, for ratios from [`RATIO`].0 on.
const FAR: usize = 4;

/// Samples of the part for each reading.
const RATIO: (f64, f64) = (0.5, 0.95);

/// Mean and variance of that autoregression.
fn moments(push: f64) -> (f64, f64) {
    let square = 1.0 / (1.0 - push * push);
    let mean = push * (2.0 / PI * square).sqrt();
    (mean, square - mean * mean)
}

/// d'^2 over the samples of a reference that stands for `length` readings and has `part` times the variance of the rest.
fn of_reference(length: usize, part: f64) -> f64 {
    let m = length as f64;
    part.ln_1p() - (m * part).ln_1p() / m
}

/// Mean over the places of a reading between two samples, and over frequency, of the logarithm of what interpolation
/// leaves of white noise, when it has variance 1 in the mean and `share` of the noise.
fn mean_log(share: f64) -> f64 {
    const PLACES: usize = 60;
    const TONES: usize = 120;
    let at = |i: usize, of: usize| (i as f64 + 0.5) / of as f64;
    let mut sum = 0.0;
    for f in (0..PLACES).map(|i| at(i, PLACES)) {
        for w in (0..TONES).map(|i| PI * at(i, TONES)) {
            let power = 1.0 - 2.0 * f * (1.0 - f) * (1.0 - w.cos());
            sum += (1.5 * share * power + 1.0 - share).ln();
        }
    }
    sum / (PLACES * TONES) as f64
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
fn mean_covariance(ratio: f64, n: usize, apart: usize) -> f64 {
    (0..n).map(|i| covariance(ratio, i, apart)).sum::<f64>() / n as f64
}

/// d' of `n` readings of which `share` of the variance is filled up so, the variance refitted: the determinant of their
/// covariance, by Cholesky's factors of a band.
fn of_filled(ratio: f64, share: f64, n: usize) -> f64 {
    let mean = mean_covariance(ratio, n, 0);
    let mut logs = 0.0;
    // Rows of the factor, the last ones: [k] is the element k before the diagonal.
    let mut rows: Vec<[f64; FAR]> = Vec::with_capacity(n);
    for i in 0..n {
        let mut row = [0.0; FAR];
        for apart in (0..FAR.min(i + 1)).rev() {
            let own = share / mean * covariance(ratio, i - apart, apart);
            let white = if apart == 0 { 1.0 - share } else { 0.0 };
            let other = if apart == 0 { &row } else { &rows[i - apart] };
            let known = (apart + 1..FAR.min(i + 1)).map(|k| row[k] * other[k - apart]);
            let left = own + white - known.sum::<f64>();
            row[apart] = match apart {
                0 => left.max(1e-12).sqrt(),
                _ => left / other[0],
            };
        }
        logs += 2.0 * row[0].ln();
        rows.push(row);
    }
    (-logs).max(0.0).sqrt()
}

/// Straight lines between samples, at `n` readings.
fn filled_up(ratio: f64, samples: &[f64], n: usize) -> Vec<f64> {
    let at = |i: usize| {
        let (before, part) = between(ratio, i);
        (1.0 - part) * samples[before] + part * samples[before + 1]
    };
    (0..n).map(at).collect()
}

/// Thermal tail of an amplifier: the heat of a swing, its square, unbalances the input when the next reading is taken.
/// x[i] = e[i] + tail (e[i-1]^2 - 1), of variance 1 + 2 tail^2, is white: e and its square do not correlate.
pub(super) fn square_behind() -> Shape {
    let variance = |_: &Stand, tail: f64| 1.0 + 2.0 * tail * tail;
    predicted(f64::INFINITY, variance, |stand, draw, tail| {
        let tail = tail * draw.sign();
        let white = white(draw, stand.samples() + 1);
        each_pair(&white, &white[1..], |before, e| {
            e + tail * (before * before - 1.0)
        })
    })
}

/// A part with a clock of its own, brought to the board's by drawing a straight line between its two last samples. As the
/// clocks move past each other, a reading is now one sample and now the mean of two: white of variance 1 here, smoothed and
/// of half the variance there, and back within seconds.
pub(super) fn interpolated(draw: &mut Draw, stand: &Stand) -> Shape {
    // The part's samples are a little further apart: none is left out.
    let pace = 1.0 - draw.by_ratio(0.003, 0.03);
    let first = draw.between(0.0, 1.0);
    let white = white(draw, stand.samples() + 2);
    let series = stand.series(|i| {
        let place = first + pace * i as f64;
        let (k, f) = (place as usize, place.fract());
        1.5f64.sqrt() * ((1.0 - f) * white[k] + f * white[k + 1])
    });
    let known = |stand: &Stand, share| Known::by_reading(stand, -mean_log(share));
    share(0.999, known, series)
}

/// A capacitor that holds a sample keeps some of the one before, and a second one is switched against it; what they differ
/// by moves with the temperature, and was trimmed away in the middle of its range: neighbours correlate in the cold and
/// anticorrelate in the heat, or the other way. The whole has variance 1 + the mean of what is kept squared.
pub(super) fn trimmed(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let off = about_mean(&stand.world.temperature[axis]);
    let (low, high) = extremes(&off);
    let most = high.max(-low).max(1e-9);
    let (kept, sign) = (each(&off, |t| t / most), draw.sign());
    let square = mean_square(&kept);
    let variance = move |_: &Stand, size: f64| 1.0 + size * size * square;
    predicted(0.98, variance, move |stand, draw, size| {
        let white = white(draw, stand.samples() + 1);
        stand.series(|i| white[i + 1] + sign * size * kept[i] * white[i])
    })
}

/// A mixer whose two inputs still hold the last two swings gives out their product: white, without skew, and only three
/// readings together tell.
pub(super) fn product() -> Shape {
    let variance = |_: &Stand, share: f64| 1.0 + share * share;
    predicted(f64::INFINITY, variance, |stand, draw, share| {
        let sign = draw.sign();
        let (mut one, mut two) = (draw.normal(), draw.normal());
        stand.series(|_| {
            let e = draw.normal();
            let x = e + sign * share * one * two;
            (two, one) = (one, e);
            x
        })
    })
}

/// Firmware with a filter that is slow for small changes and fast for large ones, which it takes for motion: of a change d it
/// follows d (1 - share / (1 + (d / large)^2)).
pub(super) fn adaptive(draw: &mut Draw, stand: &Stand) -> Shape {
    let white = white(draw, stand.samples());
    let large = draw.between(0.4, 0.8);
    bent(white, 0.97, move |share, white| {
        let (mut y, mut logs) = (0.0, 0.0);
        let all = each(white, |x| {
            let d = x - y;
            let near = 1.0 / (1.0 + (d / large).powi(2));
            y += d * (1.0 - share * near);
            logs += log_slope(share, near);
            y
        });
        (all, logs)
    })
}

/// Logarithm of the slope of d (1 - share near), near = 1 / (1 + (d / large)^2): of d near it is
/// near - 2 d^2 / large^2 near^2 = 2 near^2 - near.
fn log_slope(share: f64, near: f64) -> f64 {
    (1.0 - share * (2.0 * near * near - near)).ln()
}

/// White noise that a share of something bends, up to `most`: `of` gives the series with the sum of the logarithms of its slope,
/// and its variance is made 1 again. Given the readings before, the next has the law of white noise through a bent line:
/// d'^2 = samples x (ln variance - 2 mean ln slope), the random walk left out.
fn bent(
    white: Vec<f64>,
    most: f64,
    of: impl Fn(f64, &[f64]) -> (Vec<f64>, f64) + Copy + 'static,
) -> Shape {
    let known = white.clone();
    noise(
        most,
        move |stand, share| {
            let (y, logs) = of(share, &known);
            let logs = logs / known.len() as f64;
            let widens = mean_square(&y) / mean_square(&known);
            Known::by_reading(stand, widens.ln() - 2.0 * logs)
        },
        move |_, _, share| {
            let (y, _) = of(share, &white);
            let scale = mean_square(&y).sqrt();
            each(&y, |v| v / scale)
        },
    )
}

/// Firmware that smooths while the motor runs, against its hum, and not while it rests: each reading then is drawn to the
/// one before. Below a half, what is left is predicted from the past with variance (1 - f)^2.
pub(super) fn switched(draw: &mut Draw, stand: &mut Stand) -> Shape {
    with_rests(draw, stand, (4.0, 20.0), 0.2);
    let runs = each(&stand.world.duty, |d| d != 0.0);
    let share = mean(&each(&runs, one_if));
    noise(
        0.5,
        move |stand, f| {
            let left = (1.0 - f).powi(2) + f * f;
            let nats = (1.0 - share + share * left).ln() - 2.0 * share * (1.0 - f).ln();
            Known::by_reading(stand, nats)
        },
        move |stand, draw, f| {
            let white = white(draw, stand.samples() + 1);
            stand.series(|i| {
                let f = if runs[i] { f } else { 0.0 };
                (1.0 - f) * white[i + 1] + f * white[i]
            })
        },
    )
}

/// Firmware that takes its zero anew from each block of a few readings, and most of it off the readings of the next: the
/// steps of this zero come back as noise, and who knows the blocks knows the zero.
pub(super) fn blocks(draw: &mut Draw) -> Shape {
    let length = 4 + draw.of_many(4);
    let variance = move |_: &Stand, share: f64| 1.0 + share * share / length as f64;
    predicted(f64::INFINITY, variance, move |stand, draw, share| {
        let first = draw.of_many(length);
        let white = white(draw, stand.samples() + 2 * length);
        stand.series(|i| {
            let (here, block) = (i + first + length, (i + first) / length * length);
            white[here] - share * mean(&white[block..block + length])
        })
    })
}

/// Neighbours that correlate now and anticorrelate then, turn by turn, while the variance stays: over the whole periods of
/// the record the noise is white. d'^2 = - samples x mean ln(1 - c^2).
pub(super) fn turning_colour(draw: &mut Draw, stand: &Stand) -> Shape {
    let n = stand.samples() as f64;
    let periods = draw.by_ratio(2.0, 40.0).round();
    let first = draw.phase();
    let shape = stand.series(|i| (first + TAU * periods * i as f64 / n).sin());
    let known = shape.clone();
    noise(
        0.98,
        move |_, size| {
            let nats = |s: &f64| -(-(size * s).powi(2)).ln_1p();
            Known::Strength(known.iter().map(nats).sum::<f64>().sqrt())
        },
        move |_, draw, size| {
            carry(draw.normal(), &shape, |x, s| {
                let c = size * s;
                c * x + (1.0 - c * c).sqrt() * draw.normal()
            })
        },
    )
}

/// A valve, or a diode, that turns either swing into a push of one sense for the next: x[i] = e[i] + push |x[i-1]|, the
/// threshold autoregression whose law is known, skew-normal with |x| that of half a normal law (Andel, Netuka and Svara
/// 1984).
pub(super) fn pushing() -> Shape {
    let variance = |_: &Stand, push: f64| moments(push).1;
    predicted(0.95, variance, |stand, draw, push| {
        let (mean, sign) = (moments(push).0, draw.sign());
        let mut x = draw.normal();
        for _ in 0..200 {
            x = draw.normal() + push * x.abs();
        }
        stand.series(|_| {
            x = draw.normal() + push * x.abs();
            sign * (x - mean)
        })
    })
}

/// A reference is sampled anew, noise and all, every few readings only, and stands for those between.
pub(super) fn renewed(draw: &mut Draw) -> Shape {
    let length = 2 + draw.of_many(5);
    noise(
        f64::INFINITY,
        move |stand, part| Known::by_reading(stand, of_reference(length, part)),
        move |stand, draw, part| {
            let first = draw.of_many(length);
            let mut reference = part.sqrt() * draw.normal();
            stand.series(|i| {
                if (i + first).is_multiple_of(length) {
                    reference = part.sqrt() * draw.normal();
                }
                (reference + draw.normal()) / (1.0 + part).sqrt()
            })
        },
    )
}

/// A part of a lower rate whose output is drawn as straight lines between its samples, and converted once more at the
/// stand's rate: what the second conversion adds is white.
pub(super) fn filled(draw: &mut Draw, stand: &Stand) -> Shape {
    let n = stand.samples();
    let ratio = draw.between(RATIO.0, RATIO.1);
    let size = 1.0 / mean_covariance(ratio, n, 0).sqrt();
    let samples = each(&white(draw, n + 2), |v| size * v);
    let known = move |_: &Stand, share: f64| Known::Strength(of_filled(ratio, share, n));
    share(MOST, known, filled_up(ratio, &samples, n))
}

/// A denoiser by Haar's wavelet of two readings: their mean stays, and their difference d shrinks to
/// d (1 - share / (1 + (d / large)^2)), small ones the most. Neighbours of one pair come to correlate, those of two do not.
pub(super) fn shrunk(draw: &mut Draw, stand: &Stand) -> Shape {
    let white = white(draw, stand.samples());
    let (large, first) = (draw.between(0.5, 1.2), draw.of_many(2));
    bent(white, MOST, move |share, white| {
        let (mut all, mut logs) = (white.to_vec(), 0.0);
        for pair in all[first..].chunks_exact_mut(2) {
            let (mean, d) = (0.5 * (pair[0] + pair[1]), (pair[1] - pair[0]) / 2f64.sqrt());
            let near = 1.0 / (1.0 + (d / large).powi(2));
            logs += log_slope(share, near);
            let half = d * (1.0 - share * near) / 2f64.sqrt();
            (pair[0], pair[1]) = (mean - half, mean + half);
        }
        (all, logs)
    })
}

/// A modulator whose integrators a large swing overloads: what was beyond comes out over the readings that follow, to either
/// side in turn and less each time.
pub(super) fn overloaded(draw: &mut Draw) -> Shape {
    let (beyond, keep) = (draw.between(1.3, 1.9), draw.between(0.3, 0.75));
    // Mean square of what a normal law has beyond, and of its sum over the readings after.
    let square = 2.0 * ((1.0 + beyond * beyond) * below(-beyond) - beyond * normal(beyond));
    let rings = square / (1.0 - keep * keep);
    let variance = move |_: &Stand, size: f64| 1.0 + size * size * rings;
    predicted(f64::INFINITY, variance, move |stand, draw, size| {
        let mut left = 0.0;
        stand.series(|_| {
            let e = draw.normal();
            let x = e + size * left;
            left = e - e.clamp(-beyond, beyond) - keep * left;
            x
        })
    })
}
