//! The sixth set's noise.

use std::f64::consts::PI;

use super::super::kept_back::variance;
use super::super::kept_back_fourth::about_mean;
use super::super::{Change, Foreign, extremes};
use super::{in_steps, shocks};
use crate::random::Draw;
use crate::stand::{Stand, held};
use crate::strength::size_for;

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &mut Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    Some(match name {
        "amplifier blocked after a shock" => {
            let blocked = blocked(draw, stand);
            variance(name, wanted, &|size| {
                blocked.iter().map(|b| 1.0 / (1.0 + size * b)).collect()
            })
        }
        "mean over as many looks as fit" => {
            let looks = looks(draw, stand.samples());
            variance(name, wanted, &|share| {
                let of = |l: &f64| 1.0 - share.min(1.0) * (1.0 - 1.0 / l);
                looks.iter().map(of).collect()
            })
        }
        "interpolation between two clocks" => interpolated(draw, stand, name, wanted),
        "memory that is trimmed at one temperature" => memory(draw, stand, name, axis, wanted),
        "product of the last two swings" => product(draw, stand, name, wanted),
        "filter that lets large changes through" => adaptive(draw, stand, name, wanted),
        "filter that is switched in while the motor runs" => switched(draw, stand, name, wanted),
        "zero taken anew from each block" => blocks(draw, stand, name, wanted),
        _ => return None,
    })
}

/// Where an amplifier that a shock has driven to its stop does not answer: 1 for a while after each shock, by sample.
fn blocked(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let lasts = draw.by_ratio(0.4, 1.5) * stand.rate_hz;
    let mut all = vec![0.0; stand.samples()];
    for (at, hard) in shocks(draw, stand) {
        // The harder the shock, the longer.
        let length = (lasts * hard.abs()).ceil() as usize;
        all.iter_mut()
            .skip(at + 1)
            .take(length)
            .for_each(|b| *b = 1.0);
    }
    all
}

/// A reading is the mean of as many looks at the part as fit before it has to go out: one to four, by where the clock of
/// the looks stands, which is no multiple of the readings'.
fn looks(draw: &mut Draw, n: usize) -> Vec<f64> {
    let (mut place, pace) = (draw.between(0.0, 1.0), draw.between(0.1, 0.9));
    (0..n)
        .map(|_| {
            place = (place + pace).fract();
            1.0 + (4.0 * place).floor()
        })
        .collect()
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

/// A part with a clock of its own, brought to the board's by drawing a straight line between its two last samples. As the
/// clocks move past each other, a reading is now one sample and now the mean of two: white of variance 1 here, smoothed and
/// of half the variance there, and back within seconds.
fn interpolated(draw: &mut Draw, stand: &Stand, name: &'static str, wanted: f64) -> Foreign {
    let n = stand.samples();
    let strength = |share: f64| (-(n as f64) * mean_log(share.min(0.999))).max(0.0).sqrt();
    let share = size_for(wanted, &strength).min(0.999);
    // The part's samples are a little further apart: none is left out.
    let pace = 1.0 - draw.by_ratio(0.003, 0.03);
    let first = draw.between(0.0, 1.0);
    let white: Vec<f64> = (0..n + 2).map(|_| draw.normal()).collect();
    let noise = (0..n)
        .map(|i| {
            let place = first + pace * i as f64;
            let (k, f) = (place as usize, place.fract());
            1.5f64.sqrt() * ((1.0 - f) * white[k] + f * white[k + 1])
        })
        .collect();
    Foreign {
        name,
        strength: strength(share),
        change: Change::Noise(noise, share),
    }
}

/// A capacitor that holds a sample keeps some of the one before, and a second one is switched against it; what they differ
/// by moves with the temperature, and was trimmed away in the middle of its range: neighbours correlate in the cold and
/// anticorrelate in the heat, or the other way. Predicted, the noise has variance 1; as a whole 1 + the mean of what is
/// kept squared.
fn memory(draw: &mut Draw, stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let n = stand.samples();
    let off = about_mean(&stand.world.temperature[axis]);
    let (low, high) = extremes(&off);
    let most = high.max(-low).max(1e-9);
    let (kept, sign): (Vec<f64>, f64) = (off.iter().map(|t| t / most).collect(), draw.sign());
    let square = kept.iter().map(|c| c * c).sum::<f64>() / n as f64;
    let strength = |size: f64| (n as f64 * (size * size * square).ln_1p()).sqrt();
    let size = size_for(wanted, &strength).min(0.98);
    let scale = (1.0 + size * size * square).sqrt();
    let mut before = draw.normal();
    let noise = kept
        .iter()
        .map(|c| {
            let e = draw.normal();
            let x = e + sign * size * c * before;
            before = e;
            x / scale
        })
        .collect();
    Foreign {
        name,
        strength: strength(size),
        change: Change::Noise(noise, 1.0),
    }
}

/// A mixer whose two inputs still hold the last two swings gives out their product: white, without skew, and only three
/// readings together tell. Who knows the law predicts it down to variance 1, d'^2 = samples x ln(1 + share^2).
fn product(draw: &mut Draw, stand: &Stand, name: &'static str, wanted: f64) -> Foreign {
    let n = stand.samples();
    let strength = |share: f64| (n as f64 * (share * share).ln_1p()).sqrt();
    let share = size_for(wanted, &strength);
    let (scale, sign) = ((1.0 + share * share).sqrt(), draw.sign());
    let (mut one, mut two) = (draw.normal(), draw.normal());
    let noise = (0..n)
        .map(|_| {
            let e = draw.normal();
            let x = e + sign * share * one * two;
            (two, one) = (one, e);
            x / scale
        })
        .collect();
    Foreign {
        name,
        strength: strength(share),
        change: Change::Noise(noise, 1.0),
    }
}

/// A filter that is slow for small changes and fast for large ones, which it takes for motion: of a change d it follows
/// d (1 - share / (1 + (d / large)^2)).
pub(in super::super) struct Adaptive {
    pub(in super::super) share: f64,
    pub(in super::super) large: f64,
}

impl Adaptive {
    /// What it makes of a series from 0 on, with the mean logarithm of its slope, which is what it gains.
    pub(in super::super) fn of(&self, series: &[f64]) -> (Vec<f64>, f64) {
        let (mut y, mut logs) = (0.0, 0.0);
        let all = series
            .iter()
            .map(|x| {
                let d = x - y;
                let near = 1.0 / (1.0 + (d / self.large).powi(2));
                y += d * (1.0 - self.share * near);
                // Of d near: near - 2 d^2 / large^2 near^2 = 2 near^2 - near.
                logs += (1.0 - self.share * (2.0 * near * near - near)).ln();
                y
            })
            .collect();
        (all, logs / series.len() as f64)
    }
}

/// Firmware with such a filter. Given its last output, its next has the law of white noise through a bent line: d'^2 =
/// samples x (ln variance - 2 mean ln slope), the random walk left out.
fn adaptive(draw: &mut Draw, stand: &Stand, name: &'static str, wanted: f64) -> Foreign {
    let n = stand.samples();
    let white: Vec<f64> = (0..n).map(|_| draw.normal()).collect();
    let large = draw.between(0.4, 0.8);
    let of = |share: f64| {
        let share = share.min(0.97);
        Adaptive { share, large }.of(&white)
    };
    let square = |y: &[f64]| y.iter().map(|v| v * v).sum::<f64>() / n as f64;
    let input = square(&white);
    let strength = |share: f64| {
        let (y, logs) = of(share);
        let nats = (square(&y) / input).ln() - 2.0 * logs;
        (n as f64 * nats).max(0.0).sqrt()
    };
    let share = size_for(wanted, &strength).min(0.97);
    let (y, _) = of(share);
    let scale = square(&y).sqrt();
    Foreign {
        name,
        strength: strength(share),
        change: Change::Noise(y.iter().map(|v| v / scale).collect(), 1.0),
    }
}

/// Firmware that smooths while the motor runs, against its hum, and not while it rests: each reading then is drawn to the
/// one before.
fn switched(draw: &mut Draw, stand: &mut Stand, name: &'static str, wanted: f64) -> Foreign {
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    let mut on = draw.chance(0.5);
    stand.world.duty = held(draw, n, rate_hz, (4.0, 20.0), |d| {
        on = !on;
        f64::from(u8::from(on)) * in_steps(d.sign() * d.between(0.2, 1.0))
    });
    let runs: Vec<bool> = stand.world.duty.iter().map(|d| *d != 0.0).collect();
    let share = runs.iter().filter(|r| **r).count() as f64 / n as f64;
    let left = |f: f64| (1.0 - f).powi(2) + f * f;
    // Below a half, what is left is predicted from the past with variance (1 - f)^2.
    let strength = |f: f64| {
        let f = f.min(0.5);
        let nats = (1.0 - share + share * left(f)).ln() - 2.0 * share * (1.0 - f).ln();
        (n as f64 * nats).max(0.0).sqrt()
    };
    let f = size_for(wanted, &strength).min(0.5);
    let mut before = draw.normal();
    let noise = runs
        .iter()
        .map(|runs| {
            let e = draw.normal();
            let x = if *runs { (1.0 - f) * e + f * before } else { e };
            before = e;
            x
        })
        .collect();
    Foreign {
        name,
        strength: strength(f),
        change: Change::Noise(noise, 1.0),
    }
}

/// Mean autocorrelation, from lag 0 on, of white noise of which a share of the mean of the block before is taken off,
/// blocks of so many samples.
#[cfg(test)]
pub(in super::super) fn of_blocks(length: usize, share: f64) -> Vec<f64> {
    let n = length as f64;
    let at = |lag: usize| {
        // Pairs that far apart, the later one's zero made of the earlier one, and both with one zero.
        let taken = lag.min(length) - lag.saturating_sub(length).min(length);
        let same = length.saturating_sub(lag);
        let zeros = share * share / n * same as f64 / n;
        f64::from(u8::from(lag == 0)) + zeros - share / n * taken as f64 / n
    };
    (0..2 * length).map(at).collect()
}

/// Firmware that takes its zero anew from each block of a few readings, and most of it off the readings of the next: the
/// steps of this zero come back as noise, and who knows the blocks knows the zero. d'^2 = samples x ln(1 + share^2 /
/// length).
fn blocks(draw: &mut Draw, stand: &Stand, name: &'static str, wanted: f64) -> Foreign {
    let (n, length) = (stand.samples(), 4 + draw.of_many(4));
    let strength = |share: f64| (n as f64 * (share * share / length as f64).ln_1p()).sqrt();
    let share = size_for(wanted, &strength);
    let scale = (1.0 + share * share / length as f64).sqrt();
    let first = draw.of_many(length);
    let white: Vec<f64> = (0..n + 2 * length).map(|_| draw.normal()).collect();
    let noise = (0..n)
        .map(|i| {
            let (here, block) = (i + first + length, (i + first) / length * length);
            let zero = white[block..block + length].iter().sum::<f64>() / length as f64;
            (white[here] - share * zero) / scale
        })
        .collect();
    Foreign {
        name,
        strength: strength(share),
        change: Change::Noise(noise, 1.0),
    }
}

/// Density of [`of_blocks`], of mean 1, at an angular frequency.
#[cfg(test)]
pub(in super::super) fn density_of_blocks(length: usize, share: f64, w: f64) -> f64 {
    let r = of_blocks(length, share);
    let sum: f64 = r[1..]
        .iter()
        .enumerate()
        .map(|(k, r)| 2.0 * r * ((k + 1) as f64 * w).cos())
        .sum();
    1.0 + sum / r[0]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::stand::Needs;

    fn stand() -> (Draw, Stand) {
        let mut draw = Draw::of(20_261_121, 43, 0);
        let stand = Stand::draw(&mut draw, 3000.0, 20.0, Needs::default());
        (draw, stand)
    }

    fn noise_of(f: &Foreign) -> &[f64] {
        let Change::Noise(x, _) = &f.change else {
            panic!("{} is no noise", f.name)
        };
        x
    }

    #[test]
    fn noise_of_the_sixth_set_has_variance_1() {
        let (mut draw, mut stand) = stand();
        for name in [
            "interpolation between two clocks",
            "memory that is trimmed at one temperature",
            "product of the last two swings",
            "filter that lets large changes through",
            "zero taken anew from each block",
        ] {
            let f = one(&mut draw, &mut stand, name, 0, 50.0).expect("a name of this set");
            let x = noise_of(&f);
            let mean = x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64;
            assert!((mean - 1.0).abs() < 0.05, "{name}: {mean}");
        }
    }

    #[test]
    fn a_zero_taken_from_blocks_correlates_as_its_sum_says() {
        let (mut draw, stand) = stand();
        let f = blocks(&mut draw, &stand, "zero taken anew from each block", 60.0);
        let x = noise_of(&f);
        let n = x.len() as f64;
        // What length and share were drawn follows from the strength for each length: one of them fits all lags.
        let fits = (4..8).any(|length| {
            let share = (length as f64 * ((3600.0 / n).exp() - 1.0)).sqrt();
            let r = of_blocks(length, share);
            (1..16).all(|lag| {
                let seen = (lag..x.len()).map(|i| x[i] * x[i - lag]).sum::<f64>() / n;
                let told = r.get(lag).copied().unwrap_or(0.0) / r[0];
                (seen - told).abs() < 5.0 / n.sqrt()
            })
        });
        assert!(fits);
        let cells = 2000;
        let mean: f64 = (0..cells)
            .map(|i| density_of_blocks(5, 0.8, PI * (f64::from(i) + 0.5) / f64::from(cells)))
            .sum();
        assert!((mean / f64::from(cells) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn interpolation_by_whole_samples_is_none_and_its_gain_is_that_of_its_places() {
        assert!(mean_log(0.0).abs() < 1e-12);
        // Szegoe: the mean of ln of (1 - f)^2 + f^2 + 2 f (1 - f) cos is 2 ln max(f, 1 - f).
        let whole = 1.5f64.ln() + 2.0 * (2f64.ln() - 1.0);
        assert!((mean_log(1.0) - whole).abs() < 2e-2, "{}", mean_log(1.0));
    }

    #[test]
    fn a_filter_of_no_share_changes_nothing() {
        let series: Vec<f64> = (0..50).map(|i| (TAU * f64::from(i) / 7.0).sin()).collect();
        let (share, large) = (0.0, 0.5);
        let (y, logs) = Adaptive { share, large }.of(&series);
        assert!(logs.abs() < 1e-12);
        assert!(y.iter().zip(&series).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}
