//! Readings that lie between others: a log that was put on even times before it came here.
//!
//! A curve through readings of another rate is a reading where it meets one, and a mean of some between them: the variance goes up
//! and down as the two rates beat, on all gyros alike, while what a sum of neighbours holds does not, since any such curve passes the
//! slow as it is. A noise whose size swings changes both by the same part. Where the times of the readings were uneven nothing beats; but
//! straight pieces between two readings that agree are that reading, so that some of what is written with many digits lies on the
//! step of the converter, and the rest anywhere between.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::f64::consts::{LN_2, PI, TAU};

use super::rounding::in_steps;
use super::{Audit, Gyro, LEAST_READINGS};
use crate::test_level::CheckId;
use numerics::order_statistics::{median, robust_sigma};

/// Readings on either side whose mean is taken off: what drifts is no part of it.
const LEVEL: usize = 50;
/// Readings on either side that are summed.
const SUMMED: usize = 8;
/// Standard deviations beyond which a reading counts as if it lay there.
const FAR: f64 = 5.0;
/// Height of a line over the spectrum about it, in its mean, beyond which it is one: chance makes it so in a long record once in 10^11.
const HEIGHT: f64 = 40.0;
/// Places on either side that tell what the spectrum is there.
const ABOUT: usize = 200;
/// Swings of the variance, relative, that curves between readings make: 0.30 where they are straight, less where they are smooth or
/// the readings are alike.
const SWINGS: std::ops::Range<f64> = 0.02..0.6;
/// Part of the swing that axes may differ by, that the sum of neighbours may have, and its error.
const ALIKE: f64 = 0.3;
const SLOW: f64 = 0.5;
const KNOWN: f64 = 0.25;
/// Error of a correlation by which a rate is told, and how much nearer one rate has to be than another.
const NEAR: f64 = 0.15;
const APART: f64 = 0.05;
/// Most rates that are told.
const MOST_TOLD: usize = 2;
/// Highest multiple of the rate of the frames that the readings may have come at.
const MOST_RATES: usize = 2;

/// What is taken of a gyro.
struct Taken {
    /// Squares about the level over their mean, less 1; and the products with the sum of neighbours in the same unit, less theirs.
    squares: Vec<f64>,
    products: Vec<f64>,
    /// Mean of the products in that unit, and the correlation of neighbours.
    slow: f64,
    alike: f64,
    /// Readings about their level, in standard deviations.
    own: Vec<f64>,
}

/// Sums of `reach` values on either side and the one between; fewer at the ends.
fn sums(y: &[f64], reach: usize) -> Vec<f64> {
    let mut before = vec![0.0; y.len() + 1];
    for (i, v) in y.iter().enumerate() {
        before[i + 1] = before[i] + v;
    }
    let at = |i: usize| before[(i + reach + 1).min(y.len())] - before[i.saturating_sub(reach)];
    (0..y.len()).map(at).collect()
}

fn taken(y: &[f64]) -> Option<Taken> {
    let known: Vec<f64> = y.iter().copied().filter(|v| v.is_finite()).collect();
    if known.len() < LEAST_READINGS.max(10 * LEVEL) || known.len() < y.len() - y.len() / 10 {
        return None;
    }
    let middle = median(&known);
    let filled: Vec<f64> = y
        .iter()
        .map(|v| if v.is_finite() { v - middle } else { 0.0 })
        .collect();
    let (all, count) = (sums(&filled, LEVEL), sums(&vec![1.0; y.len()], LEVEL));
    let level = all.iter().zip(&count).map(|(s, n)| s / n);
    let mut own: Vec<f64> = filled.iter().zip(level).map(|(v, l)| v - l).collect();
    let sigma = robust_sigma(&own);
    if sigma.is_nan() || sigma <= 0.0 {
        return None;
    }
    for v in &mut own {
        *v = (*v / sigma).clamp(-FAR, FAR);
    }
    let n = own.len() as f64;
    let square = own.iter().map(|v| v * v).sum::<f64>() / n;
    own.iter_mut().for_each(|v| *v /= square.sqrt());
    let products: Vec<f64> = own
        .iter()
        .zip(sums(&own, SUMMED))
        .map(|(v, s)| v * s)
        .collect();
    let slow = products.iter().sum::<f64>() / n;
    Some(Taken {
        squares: own.iter().map(|v| v * v - 1.0).collect(),
        products: products.iter().map(|p| p - slow).collect(),
        slow,
        alike: own.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n,
        own,
    })
}

/// Power of each frequency up to half the rate.
fn power(x: &[f64]) -> Vec<f64> {
    let mut z: Vec<Complex<f64>> = x.iter().map(|v| Complex::new(*v, 0.0)).collect();
    FftPlanner::new().plan_fft_forward(z.len()).process(&mut z);
    z[..=z.len() / 2].iter().map(Complex::norm_sqr).collect()
}

/// Amplitude of a series at a frequency, rad per sample.
fn amplitude(x: &[f64], omega: f64) -> Complex<f64> {
    let parts = x.iter().enumerate();
    let sum: Complex<f64> = parts
        .map(|(i, v)| Complex::from_polar(*v, -omega * i as f64))
        .sum();
    sum * (2.0 / x.len() as f64)
}

/// Mean power about a place of a spectrum but for lines.
fn about(power: &[f64], k: usize) -> f64 {
    let from = k.saturating_sub(ABOUT).max(1);
    median(&power[from..(k + ABOUT).min(power.len())]) / LN_2
}

/// The frequency of the highest line, rad per sample, where there is one.
fn line(x: &[f64]) -> Option<f64> {
    let all = power(x);
    // What drifts within the stretch whose mean is taken off is none.
    let first = (x.len() / (10 * LEVEL)).max(10);
    let height = |k: &usize| all[*k] / about(&all, *k);
    let mut places: Vec<usize> = (first..all.len()).collect();
    places.sort_unstable_by(|a, b| all[*b].total_cmp(&all[*a]));
    let highest = places.into_iter().take(ABOUT);
    let k = highest
        .filter(|k| height(k) > HEIGHT)
        .max_by(|a, b| height(a).total_cmp(&height(b)))?;
    let bin = TAU / x.len() as f64;
    let near = (-8..=8).map(|d| bin * (k as f64 + f64::from(d) / 8.0));
    near.max_by(|a, b| amplitude(x, *a).norm().total_cmp(&amplitude(x, *b).norm()))
}

/// What beats: readings a frame, as far as that is told, and the swing of the variance.
struct Beats {
    rates: Vec<f64>,
    swing: f64,
}

/// Correlation of neighbours of straight pieces, and of the smoothest curve, through independent readings of which so many come a frame.
fn correlations(renewed: f64) -> [f64; 2] {
    let of_lines = match renewed {
        t if t < 1.0 => 1.0 - 1.5 * t * t + 0.75 * t * t * t,
        t if t < 2.0 => 0.25 * (2.0 - t).powi(3),
        _ => 0.0,
    };
    [of_lines, (PI * renewed).sin() / (PI * renewed)]
}

/// The rates, readings a frame, that beat with that of the frames at `turns` a frame, and that make neighbours so much alike.
fn rates(turns: f64, alike: f64) -> Vec<f64> {
    let multiples = (0..=MOST_RATES).flat_map(|m| [m as f64 - turns, m as f64 + turns]);
    let off = |renewed: f64| {
        let [a, b] = correlations(renewed);
        (a.min(b) - alike).max(alike - a.max(b)).max(0.0)
    };
    let mut all: Vec<(f64, f64)> = multiples
        .filter(|r| *r > 0.0)
        .map(|r| (r, off(r)))
        .collect();
    all.sort_by(|a, b| a.1.total_cmp(&b.1));
    let least = all.first().map_or(f64::INFINITY, |a| a.1);
    let near = all
        .into_iter()
        .filter(|(_, off)| *off < least + APART && *off < NEAR);
    near.map(|(r, _)| r).take(MOST_TOLD).collect()
}

/// Whether curves between readings make a swing of the variance that all of some gyros have.
fn beats(all: &[Taken]) -> Option<Beats> {
    let n = all.iter().map(|t| t.squares.len()).min()?;
    let sum = |of: &dyn Fn(&Taken) -> &Vec<f64>| -> Vec<f64> {
        (0..n)
            .map(|i| all.iter().map(|t| of(t)[i]).sum::<f64>() / all.len() as f64)
            .collect()
    };
    let squares = sum(&|t| &t.squares);
    let omega = line(&squares)?;
    let swing = amplitude(&squares, omega);
    // On each alike.
    let error = |power: f64| 2.0 * power.sqrt() / n as f64;
    let place = (omega * n as f64 / TAU).round() as usize;
    let own = all.iter().all(|t| {
        let error = error(about(&power(&t.squares[..n]), place));
        (amplitude(&t.squares[..n], omega) - swing).norm() < (ALIKE * swing.norm()).max(5.0 * error)
    });
    // None of the slow.
    let slow = all.iter().map(|t| t.slow).sum::<f64>() / all.len() as f64;
    let products = sum(&|t| &t.products);
    let error = error(about(&power(&products), place)) / slow;
    let of_slow = amplitude(&products, omega).norm() / slow;
    // None of what tones make.
    let tone = |t: &Taken| {
        let highest = power(&t.own[..n]).into_iter().skip(1).fold(0.0, f64::max);
        2.0 * highest / (n * n) as f64
    };
    let tones = all.iter().map(tone).fold(0.0, f64::max);
    let holds = own
        && SWINGS.contains(&swing.norm())
        && slow > 0.0
        && error < KNOWN * swing.norm()
        && of_slow < SLOW * swing.norm()
        && tones < KNOWN * swing.norm();
    let alike = all.iter().map(|t| t.alike).sum::<f64>() / all.len() as f64;
    holds.then(|| Beats {
        rates: rates(omega / TAU, alike),
        swing: swing.norm(),
    })
}

/// Fewest values that come so often, steps of the writing that they have to lie apart, and the part of them on even places.
const FEWEST: usize = 8;
const WIDE: f64 = 20.0;
const EVEN: f64 = 0.9;
/// How often a value comes that is no chance, beside ten times as often as the densest.
const OFTEN: f64 = 6.0;
/// Parts of the readings on such values that are neither chance nor the converter's step alone.
const ON_STEPS: std::ops::Range<f64> = 0.002..0.8;

/// Readings on a step of the converter among others.
struct OnSteps {
    part: f64,
    /// In the unit of the readings.
    step: f64,
}

fn on_steps(g: &Gyro<'_>) -> Option<OnSteps> {
    let (y, fine) = in_steps(g)?;
    let mut all: Vec<i64> = y
        .iter()
        .filter(|v| v.is_finite())
        .map(|v| v.round() as i64)
        .collect();
    let sigma = robust_sigma(&y);
    if all.len() < LEAST_READINGS || sigma < 10.0 * WIDE {
        return None;
    }
    let n = all.len() as f64;
    all.sort_unstable();
    let least = OFTEN + 10.0 * 0.4 * n / sigma;
    let often = all
        .chunk_by(|a, b| a == b)
        .filter(|c| c.len() as f64 > least);
    let often: Vec<(f64, f64)> = often.map(|c| (c[0] as f64, c.len() as f64)).collect();
    if often.len() < FEWEST {
        return None;
    }
    let gaps: Vec<f64> = often.windows(2).map(|w| w[1].0 - w[0].0).collect();
    let (mut step, zero) = (median(&gaps), often[often.len() / 2].0);
    if step < WIDE {
        return None;
    }
    // A line through their places, from the middle on outwards.
    for _ in 0..4 {
        let places = often
            .iter()
            .map(|(v, _)| (((v - zero) / step).round(), v - zero));
        let [top, bottom] = places.fold([0.0; 2], |s, (k, v)| [s[0] + k * v, s[1] + k * k]);
        step = top / bottom;
    }
    let near = |v: f64| ((v - zero) / step - ((v - zero) / step).round()).abs() * step < 1.6;
    let even = often.iter().filter(|(v, _)| near(*v)).count() as f64;
    let part = all.iter().filter(|v| near(**v as f64)).count() as f64 / n - 3.0 / step;
    let holds = even >= EVEN * often.len() as f64 && ON_STEPS.contains(&part);
    holds.then_some(OnSteps {
        part,
        step: step * fine,
    })
}

/// What to do about it.
const ADVICE: &str = "diagnose the log as it was before it was put on these times, by its own ones";

fn told(
    names: &str,
    rate_hz: f64,
    beats: Option<&Beats>,
    on: Option<&OnSteps>,
    unit: &str,
) -> String {
    let mut seen = vec![];
    if let Some(Beats { rates, swing }) = beats {
        let hz: Vec<String> = rates
            .iter()
            .map(|r| format!("{:.2}", r * rate_hz))
            .collect();
        let of = match hz.as_slice() {
            [] => "of another rate".to_owned(),
            some => format!("that came evenly at {} Hz", some.join(" or ")),
        };
        seen.push(format!(
            "lie between others {of}: their variance swings by {:.0} % as the rates beat, and what their sums hold does not",
            100.0 * swing
        ));
    } else {
        seen.push("lie between others of other times".to_owned());
    }
    if let Some(OnSteps { part, step }) = on {
        seen.push(format!(
            "{:.1} % are on a step of {step:.4} {unit} that the sensor may have, the rest anywhere between",
            100.0 * part
        ));
    }
    format!("readings of {names} {}; {ADVICE}", seen.join("; "))
}

/// Tells of readings that lie between others, once for all gyros; whether they do.
pub(super) fn audit(gyros: &[Gyro<'_>], rate_hz: f64, audit: &mut Audit) -> bool {
    let all: Vec<Taken> = gyros
        .iter()
        .filter_map(|g| taken(&g.channel.values))
        .collect();
    let beats = if all.len() == gyros.len() && all.len() > 1 {
        beats(&all)
    } else {
        None
    };
    let on: Vec<Option<OnSteps>> = gyros.iter().map(on_steps).collect();
    let each = !on.is_empty() && on.iter().all(Option::is_some);
    let on = on.into_iter().flatten().next().filter(|_| each);
    let names: Vec<String> = gyros.iter().map(|g| g.channel.name.clone()).collect();
    let unit = gyros.first().map_or("", |g| g.channel.unit.as_str());
    let seen = beats.is_some() || on.is_some();
    let what = match seen {
        true => told(
            &names.join(", "),
            rate_hz,
            beats.as_ref(),
            on.as_ref(),
            unit,
        ),
        false => "no readings lie between others of another rate".to_owned(),
    };
    let swing = beats.as_ref().map_or(0.0, |b| b.swing);
    let part = on.as_ref().map_or(0.0, |o| o.part);
    if audit.limit(
        CheckId::Resampled,
        "record",
        swing.max(part),
        0.0,
        what.clone(),
    ) {
        audit.unexplain("record", what);
        audit.between = names;
    }
    seen
}
