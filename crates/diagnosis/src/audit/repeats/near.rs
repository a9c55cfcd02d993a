//! Readings that repeat because they lie near those about them: behind a play, a filter or a median.

use super::LEAST_READINGS;

/// Readings on either side whose mean a reading is held against, beside its neighbours and what those are held with.
const BESIDE: std::ops::RangeInclusive<usize> = 3..=8;
/// Standard errors.
const FAR: f64 = 4.0;
/// Standard errors of two findings together at which readings that repeat are none that are held at any time: 1e-4.
pub(super) const NOT_HELD: f64 = 3.72;
/// Repeats of repeats beyond those of chance, over all beyond chance: where a fault holds readings for three frames and more
/// they are half and more of them.
const IN_RUNS: f64 = 0.4;

/// How far readings that repeat lie from those about.
pub(super) struct Near {
    /// Over what those do that a lost conversion makes repeat, variances.
    pub(super) part: f64,
    /// Standard errors below that.
    pub(super) z: f64,
    /// Whether nearness alone is what is seen.
    pub(super) alone: bool,
}

/// How far a reading lies from those about that it is not held with.
fn off(values: &[f64], i: usize) -> Option<f64> {
    let mut sum = 0.0;
    for k in BESIDE {
        sum += values.get(i.checked_sub(k + 1)?)? + values.get(i + k)?;
    }
    let off = values[i] - sum / (2 * BESIDE.count()) as f64;
    off.is_finite().then_some(off)
}

/// How far, in units of variance, readings that repeat lie from those about, over what those do that a lost conversion makes
/// repeat: these lie anywhere. Two readings that agree by what they are lie near their common mean, and the more so where
/// a play or a filter makes them agree. Of `own`, the readings that repeat, `expected` do so by chance.
pub(super) fn near(values: &[f64], own: &[usize], expected: f64) -> Option<Near> {
    let off = |i: usize| off(values, i).map(|o| o * o);
    let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
    let any: Vec<f64> = (0..values.len()).filter_map(off).collect();
    let here: Vec<f64> = own.iter().filter_map(|i| off(*i)).collect();
    if (here.len() as f64) < LEAST_READINGS as f64 {
        return None;
    }
    // A reading that is held for several frames is what those about are held with: it repeats repeats.
    let repeats = own.len() as f64;
    let again = own.windows(2).filter(|w| w[1] == w[0] + 1).count() as f64;
    if again - repeats * repeats / values.len() as f64 > IN_RUNS * (repeats - expected) {
        return None;
    }
    let variance = mean(&any);
    // Two that agree are as far off as the mean of two that correlate so.
    let pairs = values.windows(2).map(|w| (w[1] - w[0]).powi(2));
    let pairs: Vec<f64> = pairs.filter(|d| d.is_finite()).collect();
    let alike = (1.0 - 0.25 * mean(&pairs) / variance).max(0.0);
    let share = (expected / own.len() as f64).min(1.0);
    // By chance and by a fault; by chance and by nearness.
    let (lost, near) = (share * alike + 1.0 - share, alike);
    let seen = mean(&here) / variance;
    let error = seen * (2.0 / here.len() as f64).sqrt();
    Some(Near {
        part: seen / lost,
        z: (lost - seen) / error,
        alone: lost - seen > FAR * error && lost - seen > 0.5 * (lost - near),
    })
}

/// Standard errors by which readings that repeat, `own`, go with those before and after both more than such do that a lost
/// conversion makes repeat. That holds a reading whatever comes next, which goes with it as any two readings do that are one
/// and two apart; so do, where neighbours are jointly normal, two that agree by chance: with v = y1 = y2,
/// E v^2 = (1 + r1) / 2 and E v y0 = (r1 + r2) / (1 + r1) E v^2. A median holds a reading that lies between others, and one
/// far out only beside one farther out. Of `own`, `expected` repeat by chance.
pub(super) fn beside(values: &[f64], own: &[usize], expected: f64) -> Option<f64> {
    let offs: Vec<Option<f64>> = (0..values.len()).map(|i| off(values, i)).collect();
    let at = |i: usize| offs.get(i).copied().flatten();
    let apart = |lag: usize| {
        let pairs = offs.iter().zip(offs.iter().skip(lag));
        let all: Vec<f64> = pairs.filter_map(|(a, b)| Some((*a)? * (*b)?)).collect();
        mean_with_error(&all).0
    };
    let next = |i: usize| own.binary_search(&i).is_ok();
    let alone = own.iter().filter(|i| !next(**i - 1) && !next(**i + 1));
    let here = alone.filter_map(|i| {
        let about = at(i.checked_sub(2)?)? + at(i + 1)?;
        Some(0.25 * (at(i - 1)? + at(*i)?) * about)
    });
    let here: Vec<f64> = here.collect();
    if here.len() < LEAST_READINGS {
        return None;
    }
    let (seen, error) = mean_with_error(&here);
    // Readings that are held make neighbours alike by their share.
    let holds = (own.len() as f64 - expected) / values.len() as f64;
    let lost = 0.5 * (apart(1) - holds * apart(0) + apart(2));
    Some((seen - lost) / error)
}

/// Mean of independent values, and its standard error.
fn mean_with_error(all: &[f64]) -> (f64, f64) {
    let n = all.len() as f64;
    let mean = all.iter().sum::<f64>() / n;
    let squares = all.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    (mean, squares.sqrt() / n)
}
