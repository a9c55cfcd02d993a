//! Noise of another spectrum, in place of the white noise.

use diagnosis::likelihood::Dct;

use super::super::super::prelude::*;

/// Density of fractionally integrated noise of that order, 1 in the mean (Granger and Joyeux 1980).
fn of_memory(order: f64, w: f64) -> f64 {
    // Mean of |2 sin(w/2)|^(-2 order).
    let gamma = statrs::function::gamma::gamma;
    let mean = gamma(1.0 - 2.0 * order) / gamma(1.0 - order).powi(2);
    (2.0 * (0.5 * w).sin().abs()).powf(-2.0 * order) / mean
}

/// A filter that takes one band out of white noise and leaves the rest.
struct Notch {
    turn: f64,
    zeros: f64,
    poles: f64,
}

impl Notch {
    /// Amplitude that is left in the middle of the hole, about.
    const LEFT: f64 = 0.12;

    /// By frequency and half width, Hz.
    fn new(f: f64, half_width: f64, rate_hz: f64) -> Self {
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
    fn variance(&self) -> f64 {
        let length = (40.0 / (1.0 - self.poles)).ceil().clamp(100.0, 200_000.0) as usize;
        let pulse = (0..length).map(|i| one_if(i == 0));
        self.of(pulse).iter().map(|y| y * y).sum()
    }
}

/// What a capacitor of this corner, Hz, leaves of the power at an angular frequency, rad per sample.
fn passed(corner_hz: f64, rate_hz: f64, w: f64) -> f64 {
    let keep = (-TAU * corner_hz / rate_hz).exp();
    keep * keep * (2.0 - 2.0 * w.cos()) / (1.0 + keep * keep - 2.0 * keep * w.cos())
}

/// What is left of a series about a level behind a capacitor that had settled at it.
fn behind_capacitor(series: &[f64], level: f64, corner_hz: f64, rate_hz: f64) -> Vec<f64> {
    let from_level = [&[level], series].concat();
    let slow = lagged(&from_level, 1.0 / (TAU * corner_hz), rate_hz);
    each_pair(series, &slow[1..], |v, s| v - s)
}

/// Noise of a density, of mean 1, at an angular frequency, rad per sample: so many samples.
fn coloured(draw: &mut Draw, n: usize, density: &dyn Fn(f64) -> f64) -> Vec<f64> {
    let coefficient = |k| density(PI * k as f64 / n as f64).sqrt() * draw.normal();
    let coefficients: Vec<f64> = (0..n).map(coefficient).collect();
    Dct::new(n).inverse(&coefficients)
}

/// Noise of which a share has another density, of variance 1, at an angular frequency.
fn of_density(
    draw: &mut Draw,
    stand: &Stand,
    axis: usize,
    density: impl Fn(f64) -> f64 + 'static,
) -> Shape {
    let series = coloured(draw, stand.samples(), &density);
    let known =
        move |stand: &Stand, share| Known::shaped(stand, axis, |w| share * (density(w) - 1.0));
    share(1.0, known, series)
}

/// A rate that the part works out from angles: the noise of each angle enters two rates, once with either sign. This is
/// the Q of IEEE Std 952.
pub(super) fn differenced(axis: usize) -> Shape {
    noise(
        1.0,
        move |stand, share| Known::shaped(stand, axis, |w| -share * w.cos()),
        |stand, draw, share| {
            let mut before = draw.normal();
            stand.series(|_| {
                let angle = draw.normal();
                let rate = (angle - before) / 2f64.sqrt();
                before = angle;
                share.sqrt() * rate + (1.0 - share).sqrt() * draw.normal()
            })
        },
    )
}

/// A part that counts angle in whole steps and gives their differences for the rate: what each rounding leaves enters two
/// readings, once with either sign, even in its law (the Q of IEEE Std 952). At most `most` of the noise.
pub(super) fn rounded(draw: &mut Draw, stand: &Stand, axis: usize, most: f64) -> Shape {
    // Of variance 1/2 each.
    let half = 1.5f64.sqrt();
    let mut before = draw.between(-half, half);
    let series = stand.series(|_| {
        let now = draw.between(-half, half);
        now - std::mem::replace(&mut before, now)
    });
    let known = move |stand: &Stand, share: f64| Known::shaped(stand, axis, |w| -share * w.cos());
    share(most, known, series)
}

/// A share of the reading some samples ago comes again: a buffer or a capacitor that is not emptied.
pub(super) fn echo(draw: &mut Draw, axis: usize) -> Shape {
    let (after, sign) = (3 + draw.of_many(23), draw.sign());
    noise(
        1.0,
        move |stand, share| {
            let (g, after) = (sign * share, after as f64);
            Known::shaped(stand, axis, |w| 2.0 * g / (1.0 + g * g) * (after * w).cos())
        },
        move |stand, draw, share| {
            let all = stand.samples() + after;
            let white = white(draw, all);
            each_pair(&white[after..], &white, |own, echo| {
                (own + sign * share * echo) / (1.0 + share * share).sqrt()
            })
        },
    )
}

/// The output comes back into the input after a while, and again, and again.
pub(super) fn reverberation(draw: &mut Draw, axis: usize) -> Shape {
    let (after, sign) = (3 + draw.of_many(38), draw.sign());
    noise(
        0.95,
        move |stand, share| {
            let (share, after) = (sign * share, after as f64);
            let square = share * share;
            let of = |w: f64| (1.0 - square) / (1.0 + square - 2.0 * share * (after * w).cos());
            Known::shaped(stand, axis, |w| of(w) - 1.0)
        },
        move |stand, draw, share| {
            let share = sign * share;
            let drive = (1.0 - share * share).sqrt();
            let mut noise = white(draw, after);
            for i in after..after + stand.samples() {
                noise.push(share * noise[i - after] + drive * draw.normal());
            }
            noise.split_off(after)
        },
    )
}

/// A part that suppresses the fold of its own drive, or of the mains, by a narrow filter takes its noise out with it. The
/// filter's first response is 1 and its zeros lie inside the circle, so that the mean logarithm of its gain is 0 (Szegoe).
pub(super) fn hole(draw: &mut Draw) -> Shape {
    let f = draw.between(1.5, 8.5);
    let of = move |stand: &Stand, half_width: f64| {
        Notch::new(f, half_width.clamp(1e-3, 1.2), stand.rate_hz)
    };
    let variance = move |stand: &Stand, half_width| of(stand, half_width).variance();
    predicted(f64::INFINITY, variance, move |stand, draw, half_width| {
        // As long again until it has settled.
        let white = white(draw, 2 * stand.samples()).into_iter();
        of(stand, half_width).of(white).split_off(stand.samples())
    })
}

/// A part whose own noise is cut by a filter of high order (Butterworth 1930), as sigma-delta converters have it, and a stage
/// behind that is white: the spectrum has a shoulder, falls by the 2 x order-th power of the frequency, and then a floor.
pub(super) fn edge(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    const CELLS: i32 = 4096;
    let edge = TAU * draw.between(1.5, 7.5) / stand.rate_hz;
    let order = 4 + draw.of_many(5) as i32;
    let passes = move |w: f64| 1.0 / (1.0 + (w / edge).powi(2 * order));
    let at = |i: i32| passes(PI * (f64::from(i) + 0.5) / f64::from(CELLS));
    let mean = (0..CELLS).map(at).sum::<f64>() / f64::from(CELLS);
    of_density(draw, stand, axis, move |w| passes(w) / mean)
}

/// A gyro that is balanced by force: what the loop, of first order, can follow it takes out of its own noise, and of what is
/// faster |jw / (jw + edge)|^2 stays. A stage behind the loop adds white noise that no loop sees.
pub(super) fn held_down(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let edge = TAU * draw.by_ratio(0.7, 3.0) / stand.rate_hz;
    // Mean of w^2 / (w^2 + edge^2) over 0..pi.
    let mean = 1.0 - edge / PI * (PI / edge).atan();
    of_density(draw, stand, axis, move |w| {
        w * w / (w * w + edge * edge) / mean
    })
}

/// What a filter of steep sides passes between two edges.
pub(super) fn band(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (low, width) = (draw.by_ratio(0.6, 6.5), draw.by_ratio(0.5, 3.0));
    let [low, high] = [low, low + width].map(|hz| TAU * hz / stand.rate_hz);
    let passes = PI / (high - low);
    of_density(draw, stand, axis, move |w| {
        passes * one_if((low..high).contains(&w))
    })
}

/// Noise that forgets by a power of time, between white and flicker. Its strength is that of its order, a little above 25
/// in 600 s.
pub(super) fn long_memory(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    // With less a random walk hides all but little of it, with more it is flicker noise.
    let order = draw.between(0.28, 0.32);
    // What is lowest in the record is half a cycle long.
    let least = PI / stand.samples() as f64;
    let series = coloured(draw, stand.samples(), &|w| of_memory(order, w.max(least)));
    Shape::Fixed(
        Known::shaped(stand, axis, |w| of_memory(order, w) - 1.0),
        Change::Noise(series, 1.0),
    )
}

/// Noise that is differenced by a fraction of a time (Hosking 1981), the opposite of a long memory: what came is taken
/// back, by a power of time. The order gives the strength.
pub(super) fn undoing(axis: usize) -> Shape {
    noise(
        0.9,
        move |stand, order| Known::shaped(stand, axis, |w| of_memory(-order, w) - 1.0),
        |stand, draw, order| coloured(draw, stand.samples(), &|w| of_memory(-order, w)),
    )
}

/// A capacitor in the signal's way, as for a part that is to feel shaking alone: what is slower than its corner does not
/// pass, be it noise or rate. The converter adds the level that it rests at.
pub(super) fn behind_corner(stand: &Stand, axis: usize) -> Shape {
    let (level, rate_hz) = (stand.bias[axis] / LSB, stand.rate_hz);
    // White noise and random walk both pass it.
    let knows = move |stand: &Stand, corner: f64| {
        Known::beside(stand, axis, |w| {
            let own = stand.white(axis) + stand.step(axis) / (2.0 - 2.0 * w.cos());
            own * (passed(corner, rate_hz, w) - 1.0)
        })
    };
    sized(f64::INFINITY, knows, move |_, _, corner| {
        Change::made(move |counts, draw| {
            let rate = each(&counts[axis], |c| within_step(c, draw));
            each(&behind_capacitor(&rate, level, corner, rate_hz), |v| {
                (level + v).round() as i32
            })
        })
    })
}
