//! Processes beside the white noise: modes that noise drives, and humps that move.

use super::super::super::prelude::*;

/// Density of a mode of this pitch and half width, Hz, driven by white noise of variance 1.
fn of_mode((pitch, half_width): (f64, f64), rate_hz: f64, w: f64) -> f64 {
    let (keep, own) = ((-TAU * half_width / rate_hz).exp(), TAU * pitch / rate_hz);
    let pole = |off: f64| 1.0 - 2.0 * keep * off.cos() + keep * keep;
    (keep * own.sin()).powi(2) / (pole(w - own) * pole(w + own))
}

/// A process of this density at size 1 beside the noise.
fn beside(
    axis: usize,
    density: impl Fn(f64) -> f64 + 'static,
    series: impl FnOnce(&Stand, &mut Draw) -> Vec<f64> + 'static,
) -> Shape {
    sized(
        f64::INFINITY,
        move |stand, sigma| Known::beside(stand, axis, |w| sigma * sigma * density(w)),
        move |stand, draw, sigma| Change::Add(each(&series(stand, draw), |v| sigma * v)),
    )
}

/// A damped mode that something random drives: x[i] = first x[i-1] + second x[i-2] + sqrt(drive) e[i], of variance 1.
pub(super) fn resonance(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let f = draw.by_ratio(0.6, 8.0);
    // A mode damped much more has no peak left.
    let half_width = draw.by_ratio(0.03, 0.3).min(f / 4.0);
    let r = (-TAU * half_width / stand.rate_hz).exp();
    let (first, second) = (2.0 * r * (TAU * f / stand.rate_hz).cos(), -r * r);
    // Yule and Walker.
    let drive = (1.0 + second) * ((1.0 - second).powi(2) - first * first) / (1.0 - second);
    let density = move |w: f64| {
        let re = 1.0 - first * w.cos() - second * (2.0 * w).cos();
        let im = first * w.sin() + second * (2.0 * w).sin();
        drive / (re * re + im * im)
    };
    beside(axis, density, move |stand, draw| {
        let (mut now, mut before) = (0.0, 0.0);
        let mut next = || {
            let new = first * now + second * before + drive.sqrt() * draw.normal();
            (now, before) = (new, now);
            new
        };
        for _ in 0..(5.0 * stand.rate_hz / half_width) as usize {
            next();
        }
        stand.series(|_| next())
    })
}

/// Places of the run at which a hump that moves is looked at for its strength.
const PLACES: usize = 12;

/// A hump of noise that moves through the band, of a half width, Hz, and at `at_hz` by sample. Its d' is that of humps that stay
/// at each of `places`, Hz, averaged over the run.
fn moving_hump(
    stand: &Stand,
    axis: usize,
    half_width: f64,
    at_hz: Vec<f64>,
    places: &[f64],
) -> Shape {
    let meter = Meter::new(stand, axis);
    let keep = (-TAU * half_width / stand.rate_hz).exp();
    let places = each(places, |f| {
        let hump = Turning::new(f, half_width, stand.rate_hz);
        each(meter.omega(), |w| hump.density(w))
    });
    let knows = move |_: &Stand, sigma: f64| {
        let of = |place: &Vec<f64>| each(place, |d| sigma * sigma * d);
        Known::Beside(places.iter().map(of).collect())
    };
    sized(f64::INFINITY, knows, move |stand, draw, sigma| {
        let turns = at_hz.iter().map(|f| TAU * f / stand.rate_hz);
        Change::Add(each(&phasor(draw, keep, turns), |re| sigma * re))
    })
}

/// A resonance of the structure, at kilohertz, folded by the sampling: it softens as it warms, some 30 ppm a degree, and
/// what it makes of the molecules' blows wanders through the band with the temperature.
pub(super) fn hump(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let temperature = &stand.world.temperature[axis];
    let from = draw.between(1.5, 8.5);
    let to = loop {
        let to = draw.between(1.0, 9.0);
        if (to - from).abs() > 1.2 {
            break to;
        }
    };
    let half_width = draw.by_ratio(0.08, 0.4);
    let at_hz = each(&within_range(temperature), |t| from + (to - from) * t);
    let place = |i: usize| at_hz[(2 * i + 1) * at_hz.len() / (2 * PLACES)];
    let places: Vec<f64> = (0..PLACES).map(place).collect();
    moving_hump(stand, axis, half_width, at_hz, &places)
}

/// What flows past a body rubs and whistles at a pitch that rises with its speed, never quite the same: a hump of noise that
/// takes the whole run to go through the band.
pub(super) fn running(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (low, high) = (draw.between(1.0, 4.0), draw.between(6.0, 9.3));
    let (from, to) = draw.either((high, low), (low, high));
    let half_width = draw.by_ratio(0.08, 0.5);
    let n = stand.samples() as f64;
    let at_hz = stand.series(|i| from + (to - from) * i as f64 / n);
    let place = |i| from + (to - from) * (i as f64 + 0.5) / PLACES as f64;
    let places: Vec<f64> = (0..PLACES).map(place).collect();
    moving_hump(stand, axis, half_width, at_hz, &places)
}

/// A lightly damped mode of the mount that whatever is random drives.
pub(super) fn mode(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (pitch, quality) = (draw.by_ratio(0.5, 8.5), draw.by_ratio(4.0, 60.0));
    let part = Turning::new(pitch, 0.5 * pitch / quality, stand.rate_hz);
    beside(
        axis,
        move |w| part.density(w),
        move |stand, draw| part.of(draw, stand.samples()),
    )
}

/// A mode of the stand, of second order, that the air of a fan keeps ringing. Its size is the variance of what drives it.
pub(super) fn narrow_band(draw: &mut Draw, axis: usize) -> Shape {
    let mode = (draw.by_ratio(0.8, 8.5), draw.by_ratio(0.05, 0.4));
    sized(
        f64::INFINITY,
        move |stand, variance| {
            let rate_hz = stand.rate_hz;
            Known::beside(stand, axis, |w| variance * of_mode(mode, rate_hz, w))
        },
        move |stand, draw, variance| {
            // It rang before.
            let before = (5.0 / mode.1 * stand.rate_hz) as usize;
            let white = white(draw, before + stand.samples());
            let drive = each(&white, |v| variance.sqrt() * v);
            Change::Add(resonating(&drive, mode, stand.rate_hz).split_off(before))
        },
    )
}

/// Not the rate but its ramp takes a random walk: a spectrum by the fourth power, above corners where both leak, for else it
/// would leave the scale.
pub(super) fn wandering_ramp(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    // Longest time constant, s: what is slower is hidden by a random walk.
    const LONGEST_S: f64 = 4.0;
    let mut samples = || stand.rate_hz * draw.by_ratio(0.8, LONGEST_S);
    let (ramp, rate) = (samples(), samples());
    // Of two poles in series, which are many samples long.
    let drive = 2.0 * (ramp + rate);
    let density = move |w: f64| {
        let pole = |samples: f64| {
            let keep = (-1.0 / samples).exp();
            (1.0 - keep).powi(2) / (1.0 - 2.0 * keep * w.cos() + keep * keep)
        };
        drive * pole(ramp) * pole(rate)
    };
    beside(axis, density, move |stand, draw| {
        // It wandered before.
        let before = (10.0 * ramp.max(rate)) as usize;
        let white = white(draw, before + stand.samples());
        let drive = each(&white, |v| drive.sqrt() * v);
        lagged(&lagged(&drive, ramp, 1.0), rate, 1.0).split_off(before)
    })
}

/// Firmware that adds the rate up to an angle in a short floating-point word and differences it again (24 bits, as compilers
/// for small controllers have them, hold 16 of mantissa): the word's last digit doubles whenever the angle, which a rest of the
/// bias carries away, passes a power of two, and the rounding with it.
pub(super) fn short_float(draw: &mut Draw, axis: usize) -> Shape {
    const PARTS: usize = 16;
    const FINE: usize = 64;
    let end = draw.between(1.0, 2.0);
    // The last digit at a part of the record, over the last one that there is.
    let digit = move |part: f64| (end * part).max(1e-3).log2().floor().exp2();
    let square = |part: usize| {
        let at = |k: usize| (part as f64 + (k as f64 + 0.5) / FINE as f64) / PARTS as f64;
        (0..FINE).map(|k| digit(at(k)).powi(2)).sum::<f64>() / FINE as f64
    };
    let squares: Vec<f64> = (0..PARTS).map(square).collect();
    let mean = squares.iter().sum::<f64>() / PARTS as f64;
    // The size is the variance of the largest rounding over the white noise's; a difference has two.
    noise(
        f64::INFINITY,
        move |stand, size| {
            let (meter, white) = (Meter::new(stand, axis), stand.white(axis));
            let of = |square: f64, w: f64| 1.0 + 2.0 * size * square * (1.0 - w.cos());
            let change = |w| white * (of(mean, w) / (1.0 + 2.0 * size * mean) - 1.0);
            // What the mean spectrum tells, and what its changes tell beside.
            let steady = meter.of_density(&each(meter.omega(), change)).powi(2);
            let moves = |w| {
                let logs: f64 = squares.iter().map(|square| of(*square, w).ln()).sum();
                of(mean, w).ln() - logs / PARTS as f64
            };
            let bins = each_pair(meter.omega(), meter.counts(), |w, m| m * moves(w));
            Known::Strength((steady + bins.iter().sum::<f64>()).sqrt())
        },
        move |stand, draw, size| {
            let n = stand.samples() as f64;
            let scale = (1.0 + 2.0 * size * mean).sqrt();
            let most = (12.0 * size).sqrt();
            let mut before = 0.0;
            stand.series(|i| {
                let rounded = most * digit(i as f64 / n) * draw.between(-0.5, 0.5);
                let x = draw.normal() + rounded - before;
                before = rounded;
                x / scale
            })
        },
    )
}
