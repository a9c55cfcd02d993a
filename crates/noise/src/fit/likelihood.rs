//! Exact likelihood of the variance terms in the DCT-II domain, its maximum and its profiles.

// Indices here name a term or a place in the reflected record, in several arrays at once.
#![allow(clippy::needless_range_loop)]

use super::spectrum::{Bin, Coefficients, Spectrum};

/// How a rate ramp enters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ramp {
    /// Not at all.
    Absent,
    /// At its best value: for likelihood ratios against [`Ramp::Absent`].
    Profiled,
    /// Integrated out (restricted likelihood): a ramp that was fitted takes a degree of freedom from the slow noise, which
    /// would read too small otherwise. The constant is out in the same way, as coefficient 0.
    Restricted,
}

/// Which terms may be above zero, and whether a ramp is part of the mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Model {
    /// Of [`super::Term::ALL`].
    pub terms: [bool; 4],
    /// Whether a rate ramp is fitted, and how.
    pub ramp: Ramp,
}

/// A point of highest likelihood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Maximum {
    /// Variances of the terms.
    pub coefficients: Coefficients,
    /// Ramp, U/s; 0 where the model has none.
    pub ramp: f64,
    /// Log likelihood, nats, up to a constant of the record.
    pub log_likelihood: f64,
}

/// Best ramp for given variances, and its precision.
pub fn ramp_given(spectrum: &Spectrum, c: &Coefficients) -> (f64, f64) {
    let (mut a, mut b) = (0.0, 0.0);
    for bin in &spectrum.bins {
        let v = Spectrum::variance(bin, c);
        a += bin.cr / v;
        b += bin.rr / v;
    }
    (a / b, b)
}

#[inline]
fn residual(bin: &Bin, ramp: f64) -> f64 {
    (bin.cc - 2.0 * ramp * bin.cr + ramp * ramp * bin.rr).max(0.0)
}

/// Log likelihood, with the ramp at its best where there is one.
fn evaluate(spectrum: &Spectrum, model: Model, c: &Coefficients) -> (f64, f64) {
    let (ramp, mut sum) = match model.ramp {
        Ramp::Absent => (0.0, 0.0),
        Ramp::Profiled => (ramp_given(spectrum, c).0, 0.0),
        Ramp::Restricted => {
            let (ramp, precision) = ramp_given(spectrum, c);
            (ramp, precision.ln())
        }
    };
    for bin in &spectrum.bins {
        let v = Spectrum::variance(bin, c);
        sum += bin.count * v.ln() + residual(bin, ramp) / v;
    }
    (-0.5 * sum, ramp)
}

/// Highest likelihood of `model`, with the coefficient `fixed.0` held at `fixed.1`.
///
/// Fisher scoring with projection on non-negative variances and halving of steps that do not climb; started from
/// `start` and, without one, from a white and several low-frequency guesses.
pub fn maximize(
    spectrum: &Spectrum,
    model: Model,
    fixed: Option<(usize, f64)>,
    start: Option<&Coefficients>,
) -> Maximum {
    let mut starts: Vec<Coefficients> = Vec::new();
    if let Some(start) = start {
        starts.push(*start);
    } else {
        // White from the upper half of the frequencies, each other term from what lies above it at its own end.
        let half = 0.48 * spectrum.bins.last().map_or(0.0, |b| b.w);
        let upper: Vec<&Bin> = spectrum.bins.iter().filter(|b| b.w > half).collect();
        let white = ratio(upper.iter().map(|b| b.cc), upper.iter().map(|b| b.count));
        let low: Vec<&Bin> = spectrum.bins.iter().take(8).collect();
        let middle: Vec<&Bin> = spectrum.bins.iter().filter(|b| b.w < 0.05).collect();
        for bins in [&low, &middle] {
            let mut guess = [white, 0.0, 0.0, 0.0];
            let excess = ratio(bins.iter().map(|b| b.cc), bins.iter().map(|b| b.count)) - white;
            for t in 1..3 {
                let shape = ratio(
                    bins.iter().map(|b| b.shape[t] * b.count),
                    bins.iter().map(|b| b.count),
                );
                guess[t] = (excess / shape).max(1e-3 * white / shape);
            }
            guess[3] = 0.05 * white;
            starts.push(guess);
        }
        starts.push([white, 0.0, 0.0, 0.0]);
    }
    starts
        .into_iter()
        .map(|mut c| {
            for t in 0..4 {
                if !model.terms[t] {
                    c[t] = 0.0;
                }
            }
            if let Some((t, value)) = fixed {
                c[t] = value;
            }
            climb(spectrum, model, fixed.map(|f| f.0), c)
        })
        .max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))
        .unwrap_or(Maximum {
            coefficients: [0.0; 4],
            ramp: 0.0,
            log_likelihood: f64::NEG_INFINITY,
        })
}

fn ratio(a: impl Iterator<Item = f64>, b: impl Iterator<Item = f64>) -> f64 {
    a.sum::<f64>() / b.sum::<f64>().max(f64::MIN_POSITIVE)
}

/// Most steps of a climb.
const STEPS: usize = 60;
/// Most halvings of a step that gains nothing.
const HALVINGS: usize = 30;
/// A step that gains less ends a climb, nats.
const LEAST_GAIN: f64 = 1e-9;

fn climb(spectrum: &Spectrum, model: Model, fixed: Option<usize>, mut c: Coefficients) -> Maximum {
    let (mut best, mut ramp) = evaluate(spectrum, model, &c);
    for _ in 0..STEPS {
        let (gradient, fisher) = slope(spectrum, model, &c, ramp);
        let free =
            |t: &usize| model.terms[*t] && fixed != Some(*t) && (c[*t] > 0.0 || gradient[*t] > 0.0);
        let Some((step, active)) =
            feasible_step(&fisher, &gradient, &c, (0..4).filter(free).collect())
        else {
            break;
        };
        let mut scale = 1.0;
        let mut gained = None;
        for _ in 0..HALVINGS {
            let mut trial = c;
            for &t in &active {
                trial[t] = (c[t] + scale * step[t]).max(0.0);
            }
            if trial.iter().sum::<f64>() > 0.0 {
                let (value, r) = evaluate(spectrum, model, &trial);
                if value.is_finite() && value >= best {
                    gained = Some((value - best, trial, r));
                    break;
                }
            }
            scale *= 0.5;
        }
        let Some((gain, trial, r)) = gained else {
            break;
        };
        best += gain;
        c = trial;
        ramp = r;
        if gain < LEAST_GAIN {
            break;
        }
    }
    Maximum {
        coefficients: c,
        ramp,
        log_likelihood: best,
    }
}

/// Gradient and Fisher information (upper triangle) of the log likelihood by the coefficients of the terms.
fn slope(
    spectrum: &Spectrum,
    model: Model,
    c: &Coefficients,
    ramp: f64,
) -> ([f64; 4], [[f64; 4]; 4]) {
    let mut gradient = [0.0; 4];
    let mut fisher = [[0.0; 4]; 4];
    // What the ramp's precision adds to the slope of the restricted likelihood.
    let mut leverage = [0.0; 4];
    let mut precision = 0.0;
    for bin in &spectrum.bins {
        let v = Spectrum::variance(bin, c);
        let inverse = 1.0 / v;
        let part = bin.rr * inverse;
        precision += part;
        let pull = 0.5 * (residual(bin, ramp) * inverse - bin.count) * inverse;
        let weight = 0.5 * bin.count * inverse * inverse;
        for i in 0..4 {
            gradient[i] += bin.shape[i] * pull;
            leverage[i] += 0.5 * bin.shape[i] * part * inverse;
            for j in i..4 {
                fisher[i][j] += bin.shape[i] * bin.shape[j] * weight;
            }
        }
    }
    if model.ramp == Ramp::Restricted {
        for (g, l) in gradient.iter_mut().zip(leverage) {
            *g += l / precision;
        }
    }
    (gradient, fisher)
}

/// Fisher step, with the terms that take it: one whose step would go below zero stops at zero, and the others step without
/// it.
fn feasible_step(
    fisher: &[[f64; 4]; 4],
    gradient: &[f64; 4],
    c: &Coefficients,
    mut active: Vec<usize>,
) -> Option<([f64; 4], Vec<usize>)> {
    while !active.is_empty() {
        let step = solve(fisher, gradient, &active)?;
        match active.iter().position(|t| c[*t] <= 0.0 && step[*t] <= 0.0) {
            Some(p) => {
                active.remove(p);
            }
            None => return Some((step, active)),
        }
    }
    None
}

/// Fisher step of the active terms, by Cholesky with the columns scaled to unit diagonal.
fn solve(fisher: &[[f64; 4]; 4], gradient: &[f64; 4], active: &[usize]) -> Option<[f64; 4]> {
    let n = active.len();
    let at = |i: usize, j: usize| fisher[active[i].min(active[j])][active[i].max(active[j])];
    let scale: Vec<f64> = (0..n).map(|i| at(i, i).sqrt()).collect();
    if scale.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return None;
    }
    let mut l = [[0.0; 4]; 4];
    for i in 0..n {
        for j in 0..=i {
            let mut sum = at(i, j) / (scale[i] * scale[j]);
            for k in 0..j {
                sum -= l[i][k] * l[j][k];
            }
            l[i][j] = if i == j {
                (sum + 1e-12).max(1e-14).sqrt()
            } else {
                sum / l[j][j]
            };
        }
    }
    let mut y = [0.0; 4];
    for i in 0..n {
        let mut sum = gradient[active[i]] / scale[i];
        for k in 0..i {
            sum -= l[i][k] * y[k];
        }
        y[i] = sum / l[i][i];
    }
    let mut out = [0.0; 4];
    for i in (0..n).rev() {
        let mut sum = y[i];
        for k in i + 1..n {
            sum -= l[k][i] * y[k];
        }
        y[i] = sum / l[i][i];
        out[active[i]] = y[i] / scale[i];
    }
    Some(out)
}

/// Interval of one coefficient by profile likelihood: where it falls by `drop` nats below `maximum`.
///
/// The lower end is 0 where the likelihood at 0 is within `drop`.
pub fn profile_interval(
    spectrum: &Spectrum,
    model: Model,
    term: usize,
    maximum: &Maximum,
    drop: f64,
) -> (f64, f64) {
    let level = maximum.log_likelihood - drop;
    let mut warm = maximum.coefficients;
    let mut below = |value: f64| {
        let mut start = warm;
        start[term] = value;
        let found = maximize(spectrum, model, Some((term, value)), Some(&start));
        // A start at the old optimum can be stuck at a zero that is right no more: try afresh.
        let found = if found.log_likelihood < level {
            let fresh = maximize(spectrum, model, Some((term, value)), None);
            if fresh.log_likelihood > found.log_likelihood {
                fresh
            } else {
                found
            }
        } else {
            found
        };
        warm = found.coefficients;
        found.log_likelihood - level
    };
    let peak = maximum.coefficients[term];
    let low = if peak <= 0.0 || (term != 0 && below(0.0) >= 0.0) {
        0.0
    } else {
        lower_end(&mut below, peak)
    };
    // Where the term is strongest, a thousandth of all there is.
    let Some(strongest) = spectrum
        .bins
        .iter()
        .max_by(|a, b| a.shape[term].total_cmp(&b.shape[term]))
    else {
        // Without a coefficient nothing is known of any term.
        return (0.0, f64::INFINITY);
    };
    let shape_scale = strongest.shape[term];
    let there = Spectrum::variance(strongest, &maximum.coefficients);
    let first = if peak > 0.0 {
        peak * 1.1
    } else {
        1e-3 * there / shape_scale
    };
    (low, upper_end(&mut below, peak, first))
}

/// Where the profile falls through its level below the peak.
fn lower_end(below: &mut impl FnMut(f64) -> f64, peak: f64) -> f64 {
    let mut inside = peak;
    let mut outside = peak * 0.9;
    while below(outside) > 0.0 && outside > peak * 1e-9 {
        inside = outside;
        outside *= 0.7;
    }
    bisect(below, inside, outside)
}

/// Where it does above the peak, looked for from `first` on in growing steps.
fn upper_end(below: &mut impl FnMut(f64) -> f64, peak: f64, first: f64) -> f64 {
    let (mut inside, mut outside) = (peak, first);
    for _ in 0..80 {
        if below(outside) <= 0.0 {
            break;
        }
        inside = outside;
        outside = (outside + (outside - peak)).max(outside * 1.2);
    }
    bisect(below, inside, outside)
}

fn bisect(below: &mut impl FnMut(f64) -> f64, mut inside: f64, mut outside: f64) -> f64 {
    for _ in 0..18 {
        let middle = 0.5 * (inside + outside);
        if below(middle) > 0.0 {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    0.5 * (inside + outside)
}
