//! What a likelihood ratio has to reach, by the kind of hypothesis: a false one 65 times in a million clean channels.
//!
//! The tails are those of chi-square widened for the random walk that is refitted under each hypothesis, and, for
//! scans, for the number of independent places. `cargo run --release -p diagnosis --example closed_loop -- 1500 0`
//! counts what that makes of whole clean captures of three axes.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::test_level::part_of;

/// Chance of a false alarm of one hypothesis on one clean channel.
/// The sum of all is the promise of `test_level`.
pub const FALSE_ALARM: f64 = 6.5e-5;
/// [`FALSE_ALARM`], shared with the other bank of a record.
pub(crate) fn false_alarm() -> f64 {
    part_of(FALSE_ALARM)
}

/// Refitting the random walk widens the null distribution of slow regressors by this factor.
pub(crate) const WIDENED: f64 = 1.12;

fn quantile(degrees: usize, places: f64) -> f64 {
    tail(degrees, false_alarm() / places)
}

/// Where the tail of chi-square falls below a chance.
pub(crate) fn tail(degrees: usize, chance: f64) -> f64 {
    let p = chance.max(1e-300);
    // inverse of the survival function: for small p the inverse cdf of 1 - p is accurate to 1e-4 here.
    ChiSquared::new(degrees as f64).map_or(f64::INFINITY, |c| c.inverse_cdf(1.0 - p))
}

/// A regression on `columns` columns, one of `siblings` that the effect offers.
#[must_use]
pub fn regression(columns: usize, siblings: usize) -> f64 {
    WIDENED * quantile(columns, siblings as f64)
}

/// A shape with one coordinate on a grid of so many places, two steps of which are one independent of the others; as many as
/// the exponentials of a short record have, at least.
#[must_use]
pub fn shaped(columns: usize, grid: usize) -> f64 {
    WIDENED * quantile(columns, 0.5 * grid.max(5) as f64)
}

/// A step anywhere in `n` samples: measured 27.7 at a chance of 1e-4 for 12 000 samples; doubling the length adds as
/// many places near the ends as in the whole middle, which is why it grows with the double logarithm.
#[must_use]
pub fn step(n: usize) -> f64 {
    let grown = (n as f64).ln().ln() / 12_000f64.ln().ln();
    1.08 * quantile(1, 220.0 * grown)
}

/// A line at any of `n` half-cycle frequencies.
#[must_use]
pub fn line(n: usize) -> f64 {
    quantile(2, 3.0 * n as f64)
}

/// A swing of a line with any of `places` frequencies, two unknowns each. It is sought only where a line is certain, so
/// that its chance is one for each line, not for each channel; slow and fast swings have half of it each.
#[must_use]
pub fn side_bands(places: usize) -> f64 {
    const BY_LINE: f64 = 0.5e-3;
    2.0 * (2.0 * places.max(1) as f64 / BY_LINE).ln()
}

/// A stationary term with `dimensions` coordinates, one of which is a size that cannot be negative.
#[must_use]
pub fn covariance(dimensions: usize) -> f64 {
    quantile(dimensions, 1.0)
}

/// A stationary term with one size, of either sign, at any of `lags` lags.
#[must_use]
pub fn at_lag(lags: usize) -> f64 {
    quantile(1, lags as f64)
}

/// Part of the false alarms of a hypothesis that one has which is asked once in a thousand channels.
pub(crate) const SELDOM: f64 = 0.1;

/// A filter with one coordinate that is undone, and the random walk of what was before it: asked where the slowest frequencies
/// hold too little.
#[must_use]
pub fn undone_filter() -> f64 {
    quantile(2, 1.0 / SELDOM)
}

/// A peak of any width at any place of the spectrum of `n` samples. Its size is the root Z of the likelihood ratio, a field
/// over centre and width whose maxima above z number A z exp(-z^2 / 2) / (2 pi)^(3/2) (Adler, 1981): a Lorentzian of half
/// width h has the metric 1 / (8 h^2) there, and h from 1.5 coefficients on A = n / (8^(1/2) 1.5). For z about 6 that is
/// n / 11 places of two degrees; `cargo run --release -p diagnosis --example bands -- white` counts them.
#[must_use]
pub fn peak(n: usize) -> f64 {
    quantile(2, n as f64 / 10.0)
}

/// A law of the variance with one size: no random walk is refitted under it.
#[must_use]
pub fn variance_law() -> f64 {
    quantile(1, 1.0)
}

/// A stretch of other variance: any of about 28 000 pairs of ends, strongly overlapping.
#[must_use]
pub fn segment() -> f64 {
    quantile(1, 2000.0)
}

/// Two levels where the search found nothing but a random walk, whose room they take: size, dwell time and the walk.
#[must_use]
pub fn two_level() -> f64 {
    WIDENED * quantile(3, 1.0)
}
