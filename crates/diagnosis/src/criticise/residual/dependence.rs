//! Checks of what a spectrum does not show: readings that depend on earlier ones though they do not correlate with them,
//! and what repeats itself with the samples.

use std::f64::consts::PI;

use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rustfft::num_complex::Complex;

use crate::test_level::{CheckId, MOST, Outcome, RECORD};
use numerics::column::dot;
use numerics::tails::{chi_tail, errors_of_sum};
use numerics::transform::{Dct, RealFft};

/// Lags, either way, of the bicovariance.
const LAGS: usize = 20;

/// Correlation of the whitened residual with its own square earlier and later, over all lags but 0. Linear, and Gaussian
/// or of one law, it has none; what a swing leaves behind that its sign does not tell, and what rises and falls unlike, has
/// (the third-order moments off their diagonal; Hinich 1996 tests the same sums).
pub(crate) fn bicovariance(e: &[f64]) -> Outcome {
    let e = &e[..e.len().min(MOST)];
    let n = e.len() as f64;
    let mean = e.iter().sum::<f64>() / n;
    let power = e.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
    let centred: Vec<f64> = e.iter().map(|v| v - mean).collect();
    let squares: Vec<f64> = centred.iter().map(|v| v * v - power).collect();
    let spread = squares.iter().map(|v| v * v).sum::<f64>() / n;
    let mut worst = (0i64, 0.0f64);
    let mut statistic = 0.0;
    let lags = LAGS.min(e.len() / 2);
    for lag in 1..=lags {
        let of = |a: &[f64], b: &[f64]| -> f64 {
            dot(&a[..a.len() - lag], &b[lag..]) / ((n - lag as f64) * power * spread).sqrt()
        };
        for (z, at) in [
            (of(&squares, &centred), lag as i64),
            (of(&centred, &squares), -(lag as i64)),
        ] {
            statistic += z * z;
            if z.abs() > worst.1.abs() {
                worst = (at, z);
            }
        }
    }
    let order = if worst.0 > 0 { "earlier" } else { "later" };
    Outcome {
        id: CheckId::Bicovariance,
        about: vec![],
        statistic,
        p_value: chi_tail(statistic, 2.0 * lags as f64),
        what: format!(
            "correlation of the whitened residual with its own square over {lags} samples either way; largest {:+.3} with the square {} samples {order}",
            worst.1 / n.sqrt(),
            worst.0.abs()
        ),
    }
}

/// Distances of the pairs of readings that are held against independence, those of pairs that they are held against, and
/// parts of equal count that readings are sorted into.
const LAGS_OF_PAIRS: std::ops::RangeInclusive<usize> = 1..=3;
const LAGS_APART: std::ops::RangeInclusive<usize> = 21..=40;
const PARTS: usize = 10;
/// Normal values of that size, over the step of the converter, hide the steps: exp(-2 pi^2 0.6^2) of the swing is left.
const DITHER: f64 = 0.6;
/// Fewest pairs that a cell of the table is to hold.
const LEAST_PAIRS: usize = 20;
/// Standard deviations of its chi-square at which the chance is 1e-5.
const CERTAIN: f64 = 4.6;

/// Where values are cut into parts of equal count, ascending.
fn edges(mut values: Vec<f64>) -> Vec<f64> {
    let n = values.len();
    let mut all = vec![];
    let mut rest = values.as_mut_slice();
    for k in (1..PARTS).rev() {
        let place = k * n / PARTS;
        if place < rest.len() {
            let (below, edge, _) = rest.select_nth_unstable_by(place, f64::total_cmp);
            all.push(*edge);
            rest = below;
        } else {
            all.extend(all.last().copied());
        }
    }
    all.reverse();
    all
}

/// How many pairs of readings `lag` apart lie in which two parts.
fn pairs(part: &[usize], lag: usize) -> [f64; PARTS * PARTS] {
    let mut table = [0.0; PARTS * PARTS];
    for (a, b) in part.iter().zip(&part[lag..]) {
        table[a * PARTS + b] += 1.0;
    }
    table
}

/// Chi-square of where two readings near each other lie among all parts, over how often two lie there that are farther apart; its
/// degrees of freedom; and what is farthest off: by how much of it, the lag, and how many times as often. Nothing of too few.
fn against_far_pairs(part: &[usize]) -> (f64, f64, (f64, usize, f64)) {
    let (mut statistic, mut freedom) = (0.0, 0.0);
    let mut worst = (0.0, 0, 0.0);
    if part.len() < LEAST_PAIRS * PARTS * PARTS {
        return (statistic, freedom, worst);
    }
    let mut apart = [0.0; PARTS * PARTS];
    for lag in LAGS_APART {
        let all = apart.iter_mut().zip(pairs(part, lag));
        all.for_each(|(sum, pairs)| *sum += pairs);
    }
    let far: f64 = apart.iter().sum();
    // The mean of so many tables is off by a part of what one is.
    let spread = 1.0 + 1.0 / LAGS_APART.count() as f64;
    for lag in LAGS_OF_PAIRS {
        let near = pairs(part, lag);
        let all = (part.len() - lag) as f64;
        freedom += ((PARTS - 1) * (PARTS - 1)) as f64;
        for (seen, apart) in near.iter().zip(apart).filter(|(_, a)| *a > 0.0) {
            let expected = apart * all / far;
            let off = (seen - expected).powi(2) / (expected * spread);
            statistic += off;
            if off > worst.0 {
                worst = (off, lag, seen / expected);
            }
        }
    }
    (statistic, freedom, worst)
}

/// Whether readings near each other are independent, whatever their law: chi-square of where two of them lie among all,
/// over how often two lie there that are farther apart and share no more than a level that drifts. What treats large changes otherwise than small ones leaves its mark here, though nothing correlates.
pub(crate) fn neighbours(e: &[f64], step: f64) -> Outcome {
    let e = &e[..e.len().min(MOST)];
    let spread = (e.iter().map(|v| v * v).sum::<f64>() / e.len().max(1) as f64).sqrt();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0x6e62_7273);
    let e: Vec<f64> = e
        .iter()
        .map(|v| {
            let dither: f64 = StandardNormal.sample(&mut rng);
            v + DITHER * step * spread * dither
        })
        .collect();
    let edges = edges(e.clone());
    let part: Vec<usize> = e
        .iter()
        .map(|v| edges.partition_point(|edge| edge < v))
        .collect();
    let (statistic, freedom, worst) = against_far_pairs(&part);
    // A longer record is told what this one would be, as with the skewness.
    let least = CERTAIN * (2.0 * freedom).sqrt() / RECORD;
    let small = e.len() as f64 > RECORD && (statistic - freedom) / (e.len() as f64) < least;
    Outcome {
        id: CheckId::Neighbours,
        about: vec![],
        statistic,
        p_value: if small || freedom < 1.0 {
            1.0
        } else {
            chi_tail(statistic, freedom)
        },
        what: format!(
            "readings near each other depend on each other otherwise than by correlation: of {} parts that pairs {} samples apart lie in, one holds {:.2} times as many as of pairs far apart",
            PARTS * PARTS,
            worst.1,
            worst.2
        ),
    }
}

/// Longest lag of the products of three readings.
const LAGS_OF_THREE: usize = 10;

/// Products of three readings at different times, over all pairs of lags: what a product of earlier readings leaves behind
/// (the rest of the third-order moments).
pub(crate) fn three_readings(e: &[f64]) -> Outcome {
    let e = &e[..e.len().min(MOST)];
    let mean = e.iter().sum::<f64>() / e.len().max(1) as f64;
    let centred: Vec<f64> = e.iter().map(|v| v - mean).collect();
    let mut worst = (0, 0, 0.0f64);
    let (mut statistic, mut pairs) = (0.0, 0.0);
    let last = LAGS_OF_THREE.min(e.len() / 2);
    for a in 1..last {
        let of_two: Vec<f64> = centred
            .iter()
            .zip(&centred[a..])
            .map(|(x, y)| x * y)
            .collect();
        for b in a + 1..=last {
            // The last of the three, and the two before it.
            let of_three = of_two.iter().zip(&centred[b..]);
            let z = errors_of_sum(of_three.map(|(p, v)| p * v));
            statistic += z * z;
            pairs += 1.0;
            if z.abs() > worst.2.abs() {
                worst = (b - a, b, z);
            }
        }
    }
    Outcome {
        id: CheckId::ThreeReadings,
        about: vec![],
        statistic,
        p_value: if pairs > 0.0 {
            chi_tail(statistic, pairs)
        } else {
            1.0
        },
        what: format!(
            "products of the whitened residual at three times within {LAGS_OF_THREE} samples; a reading with those {} and {} before it stands out most ({:+.3})",
            worst.0,
            worst.1,
            worst.2 / (e.len() as f64).sqrt()
        ),
    }
}

/// Lowest coefficient at which the variance is asked for a rhythm: slower changes are told by its course.
const SLOWEST: usize = 16;

/// Farthest that two readings lie apart whose products are asked for a rhythm, samples, by how many there are at each place;
/// 0: the squares.
const SPANS: [usize; 6] = [0, 2, 4, 8, 16, 32];

/// At every reading, the sum of all products of two that lie evenly about it, or about the middle to the next one, up to
/// `span` samples apart; of span 0 its square. Of white noise the sums are white too.
fn products_about(e: &[f64], span: usize) -> Vec<f64> {
    if span == 0 {
        return e.iter().map(|v| v * v).collect();
    }
    let reach = span / 2;
    (reach..e.len().saturating_sub(reach))
        .map(|m| {
            let before = e[m - reach..m].iter().rev();
            let about: f64 = before.zip(&e[m + 1..]).map(|(a, b)| a * b).sum();
            let before = e[m + 1 - reach..=m].iter().rev();
            let between: f64 = before.zip(&e[m + 1..]).map(|(a, b)| a * b).sum();
            about + between
        })
        .collect()
}

/// Chi-square (two degrees) of the strongest line of a series over the level of the others, its frequency in cycles per
/// sample, and at how many frequencies one was sought. The transform is kept for a series of the same length.
fn strongest_line(series: &[f64], fft: &mut Option<RealFft>) -> Option<(f64, f64, usize)> {
    let n = series.len() / 2 * 2;
    if n < 8 * SLOWEST {
        return None;
    }
    let mean = series[..n].iter().sum::<f64>() / n as f64;
    // Twice the length: of a line between two frequencies of the record no more than a fifth is lost.
    let pair = |j: usize| match series[..n].get(2 * j..2 * j + 2) {
        Some([a, b]) => Complex::new(a - mean, b - mean),
        _ => Complex::default(),
    };
    let mut power = vec![0.0; n + 1];
    let known = fft.take().filter(|f| f.length() == 2 * n);
    let fft = fft.insert(known.unwrap_or_else(|| RealFft::new(2 * n)));
    fft.run(pair, |k, f| power[k] = f.norm_sqr());
    let mut sorted = power[SLOWEST..].to_vec();
    let count = sorted.len();
    let (_, median, _) = sorted.select_nth_unstable_by(count / 2, f64::total_cmp);
    // Median of chi-square with two degrees: the lines themselves do not raise it.
    let level = (*median / (2.0 * std::f64::consts::LN_2)).max(f64::MIN_POSITIVE);
    let lines = power.iter().enumerate().skip(SLOWEST);
    let (at, most) = lines.max_by(|a, b| a.1.total_cmp(b.1))?;
    Some((most / level, 0.5 * at as f64 / n as f64, count))
}

/// The strongest line of the products up to a span.
pub(super) struct Rhythm {
    pub span: usize,
    /// Chi-square, two degrees.
    pub statistic: f64,
    /// Cycles per sample.
    pub at: f64,
    /// At how many frequencies of all spans one was sought.
    pub count: usize,
}

pub(super) fn rhythm(e: &[f64]) -> Option<Rhythm> {
    let mut fft = None;
    let of_span = |span: &usize| {
        // Of a long record as many products of every span.
        let e = &e[..e.len().min(MOST + span)];
        let (statistic, at, count) = strongest_line(&products_about(e, *span), &mut fft)?;
        let count = count * SPANS.len();
        Some(Rhythm {
            span: *span,
            statistic,
            at,
            count,
        })
    };
    let all = SPANS.iter().filter_map(of_span);
    all.max_by(|a, b| a.statistic.total_cmp(&b.statistic))
}

/// Of how many whole samples the period of the rhythm of the variance is, where it is of so many.
pub(crate) fn rhythm_in_samples(e: &[f64]) -> Option<usize> {
    let cycles = rhythm(e)?.at;
    let whole = |m: &usize| (cycles - (cycles * *m as f64).round() / *m as f64).abs();
    (2..=LONGEST_RHYTHM).find(|m| whole(m) * (e.len().min(MOST) as f64) < 1.0)
}

/// A rhythm of the variance, or of how neighbours depend on each other: the strongest line of the squares of the whitened
/// residual, or of its products. What is held, switched or coded by a clock of its own has one.
pub(crate) fn variance_rhythm(e: &[f64], rate_hz: f64) -> Outcome {
    let Some(Rhythm {
        span,
        statistic,
        at,
        count,
    }) = rhythm(e)
    else {
        return Outcome {
            id: CheckId::VarianceRhythm,
            about: vec![],
            statistic: 0.0,
            p_value: 1.0,
            what: "too short for a rhythm of the variance".into(),
        };
    };
    let of = if span == 0 {
        "in the square of the whitened residual".to_owned()
    } else {
        format!("in products of the whitened residual with itself up to {span} samples later")
    };
    Outcome {
        id: CheckId::VarianceRhythm,
        about: vec![],
        statistic,
        p_value: (chi_tail(statistic, 2.0) * count as f64).min(1.0),
        what: format!("lines {of}; {:.4} Hz stands out most", at * rate_hz),
    }
}

/// Longest period of a rhythm that is told as one of whole samples: of longer ones some lie near any frequency.
const LONGEST_RHYTHM: usize = 64;
/// Longest period, samples, and fewest of them in the record.
const LONGEST: usize = 512;
const FEWEST: usize = 8;
/// A period of the sampling with which the residual repeats itself.
pub(crate) struct Repeats {
    /// Samples.
    pub period: usize,
    /// Chi-square of the means of its places, and the chance of a larger one at any period.
    chi_square: f64,
    pub chance: f64,
}

/// Half the width over which energies are taken to be even, coefficients.
const EVEN: usize = 200;

/// Whitened readings, each of their coefficients over the energy about it: a band that is left over repeats nothing.
fn evened(e: &[f64]) -> Vec<f64> {
    let dct = Dct::new(e.len());
    let u = dct.forward(e);
    let mut sums = Vec::with_capacity(u.len() + 1);
    let mut sum = 0.0;
    sums.push(sum);
    for v in &u {
        sum += v * v;
        sums.push(sum);
    }
    let even = |(k, v): (usize, &f64)| {
        let (from, to) = (k.saturating_sub(EVEN).max(1), (k + EVEN).min(u.len()));
        let energy = (sums[to] - sums[from]) / (to - from).max(1) as f64;
        if energy > 0.0 { v / energy.sqrt() } else { 0.0 }
    };
    let even: Vec<f64> = u.iter().enumerate().map(even).collect();
    dct.inverse(&even)
}

/// Chi-square of the means of the places in each period from 2 to `longest` samples, by period; of values whose mean is 0.
fn by_period(e: &[f64], longest: usize) -> Vec<f64> {
    let mut all = vec![0.0; longest + 1];
    let mut sums = vec![0.0; longest];
    for twice in longest / 2 + 1..=longest {
        sums[..twice].fill(0.0);
        for places in e.chunks(twice) {
            sums.iter_mut().zip(places).for_each(|(s, v)| *s += v);
        }
        let mut period = twice;
        loop {
            let (times, more) = (e.len() / period, e.len() % period);
            let energy = |sums: &[f64]| sums.iter().map(|s| s * s).sum::<f64>();
            all[period] = energy(&sums[..more]) / (times + 1) as f64
                + energy(&sums[more..period]) / times as f64;
            if period % 2 == 1 || period < 4 {
                break;
            }
            // Half a period has two places for one.
            period /= 2;
            let (first, second) = sums.split_at_mut(period);
            first.iter_mut().zip(second).for_each(|(a, b)| *a += *b);
        }
    }
    all
}

/// The period at which the means of the places in it are least like those of noise, by the whitened residual.
pub(crate) fn repeats(e: &[f64]) -> Option<Repeats> {
    if e.len() < 2 * EVEN {
        return None;
    }
    let mut e = evened(&e[..e.len().min(MOST)]);
    let longest = LONGEST.min(e.len() / FEWEST);
    let mean = e.iter().sum::<f64>() / e.len().max(1) as f64;
    e.iter_mut().for_each(|v| *v -= mean);
    let periods = (longest - 1) as f64;
    // ln of the gamma function of half the degrees, of even ones and of odd ones.
    let mut log_gammas = [0.0, 0.5 * PI.ln()];
    (by_period(&e, longest).into_iter().enumerate().skip(2))
        .map(|(period, chi_square)| {
            let degrees = period - 1;
            let (half, shape) = (0.5 * chi_square, 0.5 * degrees as f64);
            let log_gamma = &mut log_gammas[degrees % 2];
            // Of two degrees and more the tail is larger than half^(shape - 1) exp(-half) / gamma(shape): where that is
            // enough for one in all periods, as in most, no more is asked.
            let least = (shape - 1.0) * half.ln() - half - *log_gamma;
            *log_gamma += shape.ln();
            let chance = if degrees > 1 && least > -periods.ln() {
                1.0
            } else {
                (chi_tail(chi_square, degrees as f64) * periods).min(1.0)
            };
            Repeats {
                period,
                chi_square,
                chance,
            }
        })
        .min_by(|a, b| {
            // Beyond what a chance can tell apart, the least degrees.
            let by_chance = a.chance.total_cmp(&b.chance);
            by_chance
                .then((b.chi_square / b.period as f64).total_cmp(&(a.chi_square / a.period as f64)))
        })
}

/// What repeats itself every few samples, whatever its shape: each of its harmonics may be too weak for a line.
pub(super) fn period(e: &[f64], rate_hz: f64) -> Outcome {
    let Some(found) = repeats(e) else {
        return Outcome {
            id: CheckId::Period,
            about: vec![],
            statistic: 0.0,
            p_value: 1.0,
            what: "too short to repeat itself".into(),
        };
    };
    Outcome {
        id: CheckId::Period,
        about: vec![],
        statistic: found.chi_square / (found.period as f64 - 1.0),
        p_value: found.chance,
        what: format!(
            "means of the whitened residual by place in periods of up to {LONGEST} samples, over those of noise; {} samples ({:.4} s) stand out most",
            found.period,
            found.period as f64 / rate_hz
        ),
    }
}

#[cfg(test)]
mod tests;
