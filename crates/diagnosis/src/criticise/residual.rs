//! Omnibus checks of whitened residuals: they show that something is left, the search says what.

use statrs::distribution::{ContinuousCDF, Gamma};

use crate::fit::about_line::nats;
use crate::test_level::{CheckId, Outcome, RECORD, omnibus_level};
use numerics::column::{dot, sum_of};
use numerics::tails::{chi_tail, kurtosis_score, normal_tail};

mod dependence;
mod swing;

pub(crate) use dependence::{
    Repeats, bicovariance, neighbours, repeats, rhythm_in_samples, three_readings, variance_rhythm,
};
pub(crate) use swing::swing;

/// Lags of the Ljung-Box statistic.
const LAGS: usize = 20;
/// Bands.
const BANDS: usize = 19;

/// All checks of one channel, whose readings come in steps of `step` standard deviations of the residual (0: none known).
#[must_use]
pub fn all(u: &[f64], e: &[f64], rate_hz: f64, step: f64) -> Vec<Outcome> {
    vec![
        ljung_box(e),
        bands(u, rate_hz),
        tiles(e, rate_hz),
        kurtosis(e, rate_hz, step),
        skewness(e),
        dependence::bicovariance(e),
        dependence::three_readings(e),
        dependence::neighbours(e, step),
        dependence::variance_rhythm(e, rate_hz),
        dependence::period(e, rate_hz),
    ]
}

pub(crate) fn ljung_box(e: &[f64]) -> Outcome {
    let n = e.len() as f64;
    let total = dot(e, e);
    let mut worst = (0, 0.0f64);
    let statistic = (1..=LAGS)
        .map(|lag| {
            let r = dot(&e[..e.len().saturating_sub(lag)], &e[lag..]) / total;
            if r.abs() > worst.1.abs() {
                worst = (lag, r);
            }
            n * (n + 2.0) * r * r / (n - lag as f64)
        })
        .sum();
    Outcome {
        id: CheckId::LjungBox,
        about: vec![],
        statistic,
        p_value: chi_tail(statistic, LAGS as f64),
        what: format!(
            "correlation of the whitened residual over {LAGS} samples; largest {:.3} at lag {}",
            worst.1, worst.0
        ),
    }
}

/// A band of the whitened coefficients: its first one and its end, energy over the model's, chance times the bands.
pub(crate) struct Band {
    pub from: usize,
    pub to: usize,
    pub energy: f64,
    pub chance: f64,
}

/// All bands of a record.
pub(crate) fn all_bands(u: &[f64]) -> Vec<Band> {
    let n = u.len();
    let edge = |b: usize| (20f64 * (n as f64 / 20.0).powf(b as f64 / BANDS as f64)) as usize;
    (0..BANDS)
        .map(|b| (if b == 0 { 1 } else { edge(b) }, edge(b + 1).min(n)))
        .filter(|(from, to)| to > from)
        .map(|(from, to)| {
            let degrees = (to - from) as f64;
            let sum: f64 = u[from..to].iter().map(|v| v * v).sum();
            let upper = chi_tail(sum, degrees);
            Band {
                from,
                to,
                energy: sum / degrees,
                chance: (2.0 * upper.min(1.0 - upper) * BANDS as f64).min(1.0),
            }
        })
        .collect()
}

/// Somewhere in frequency where energy is left over or lacks: shares of half the sample rate, and how far a model that
/// knows the energies there is ahead, nats.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    pub from: f64,
    pub to: f64,
    pub nats: f64,
    /// Whether energy lacks.
    pub lacks: bool,
}

fn bands(u: &[f64], rate_hz: f64) -> Outcome {
    let hz = |k: usize| k as f64 / u.len() as f64 * rate_hz / 2.0;
    // Where no band stands out, the one farthest from the model is told.
    let worst = all_bands(u).into_iter().min_by(|a, b| {
        let off = |x: &Band| -(x.energy.max(1e-12).ln() * (x.to - x.from) as f64).abs();
        (a.chance, off(a))
            .partial_cmp(&(b.chance, off(b)))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    let Some(worst) = worst else {
        return Outcome {
            id: CheckId::BandEnergy,
            about: vec![],
            statistic: 1.0,
            p_value: 1.0,
            what: "too short for bands".into(),
        };
    };
    Outcome {
        id: CheckId::BandEnergy,
        about: vec![],
        statistic: worst.energy,
        p_value: worst.chance,
        what: format!(
            "energy of the whitened residual over the model's in {BANDS} bands; {:.3} from {:.4} to {:.4} Hz stands out most",
            worst.energy,
            hz(worst.from),
            hz(worst.to)
        ),
    }
}

/// Segments of the record, coefficients in a tile, and most tiles of a segment.
const SEGMENTS: [usize; 2] = [10, 60];
const TILE: usize = 50;
const MOST_TILES: usize = 24;

/// Squared deviations of the energies in tiles of time and frequency, each over its variance.
struct Tiles {
    /// Samples of a segment.
    length: usize,
    /// By segment, by tile of it: squared deviation, energy over the model's.
    of: Vec<Vec<(f64, f64)>>,
}

impl Tiles {
    fn new(e: &[f64], segments: usize) -> Option<Self> {
        let length = e.len() / segments;
        if length < TILE {
            return None;
        }
        let dct = crate::fit::likelihood::Dct::new(length);
        let count = (length / TILE).clamp(1, MOST_TILES);
        let of = (0..segments)
            .map(|s| {
                let c = dct.forward(&e[s * length..(s + 1) * length]);
                (0..count)
                    .map(|t| {
                        let part = &c[t * length / count..(t + 1) * length / count];
                        let degrees = part.len() as f64;
                        let energy: f64 = part.iter().map(|v| v * v).sum();
                        (
                            (energy - degrees).powi(2) / (2.0 * degrees),
                            energy / degrees,
                        )
                    })
                    .collect()
            })
            .collect();
        Some(Self { length, of })
    }

    fn count(&self) -> usize {
        self.of.first().map_or(1, Vec::len)
    }

    /// Chance of a larger sum of the squared deviations of `tiles` tiles: a gamma distribution of its mean and variance.
    fn chance(&self, sum: f64, tiles: usize) -> f64 {
        let tiles = tiles as f64;
        let variance = tiles * (2.0 + 12.0 * self.count() as f64 / self.length as f64);
        Gamma::new(tiles * tiles / variance, tiles / variance).map_or(1.0, |g| g.sf(sum))
    }
}

/// Bands that fail.
pub(crate) fn failing_bands(u: &[f64]) -> impl Iterator<Item = Place> {
    let n = u.len() as f64;
    let fails = all_bands(u)
        .into_iter()
        .filter(|b| b.chance < omnibus_level());
    fails.map(move |b| Place {
        from: b.from as f64 / n,
        to: b.to as f64 / n,
        nats: nats(b.energy, (b.to - b.from) as f64),
        lacks: b.energy < 1.0,
    })
}

/// Frequencies at which the energy comes and goes.
pub(crate) fn unsteady(e: &[f64]) -> Vec<Place> {
    let mut all = vec![];
    for tiles in SEGMENTS.iter().filter_map(|s| Tiles::new(e, *s)) {
        let count = tiles.count();
        let size = tiles.length as f64 / count as f64;
        for t in 0..count {
            let sum: f64 = tiles.of.iter().map(|s| s[t].0).sum();
            if tiles.chance(sum, tiles.of.len()) * (count as f64) < omnibus_level() {
                // Half a nat for each energy that is known is what noise gains too.
                let gained = tiles.of.iter().map(|s| nats(s[t].1, size) - 0.5);
                all.push(Place {
                    from: t as f64 / count as f64,
                    to: (t + 1) as f64 / count as f64,
                    nats: gained.sum::<f64>().max(0.0),
                    lacks: tiles.of.iter().map(|s| s[t].1 - 1.0).sum::<f64>() < 0.0,
                });
            }
        }
    }
    all
}

/// Energies in tiles of time and frequency: a tone that wanders, rings or comes and goes fills some of them more than
/// others, though each band and each stretch of time may have its share.
fn tiles(e: &[f64], rate_hz: f64) -> Outcome {
    let mut worst: Option<Outcome> = None;
    for tiles in SEGMENTS.iter().filter_map(|s| Tiles::new(e, *s)) {
        let (segments, count) = (tiles.of.len(), tiles.count());
        let sum: f64 = tiles.of.iter().flatten().map(|t| t.0).sum();
        let p = (tiles.chance(sum, segments * count) * SEGMENTS.len() as f64).min(1.0);
        if worst.as_ref().is_some_and(|w| w.p_value <= p) {
            continue;
        }
        let most = (0..segments)
            .flat_map(|s| (0..count).map(move |t| (s, t)))
            .max_by(|a, b| tiles.of[a.0][a.1].0.total_cmp(&tiles.of[b.0][b.1].0))
            .unwrap_or((0, 0));
        let (seconds, hz) = (tiles.length as f64 / rate_hz, 0.5 * rate_hz / count as f64);
        worst = Some(Outcome {
            id: CheckId::TimeFrequency,
            about: vec![],
            statistic: sum / (segments * count) as f64,
            p_value: p,
            what: format!(
                "energy of the whitened residual over the model's in {} tiles of {seconds:.1} s and {hz:.2} Hz; {:.2} from {:.1} to {:.1} s, {:.2} to {:.2} Hz stands out most",
                segments * count,
                tiles.of[most.0][most.1].1,
                most.0 as f64 * seconds,
                (most.0 + 1) as f64 * seconds,
                most.1 as f64 * hz,
                (most.1 + 1) as f64 * hz
            ),
        });
    }
    worst.unwrap_or_else(|| Outcome {
        id: CheckId::TimeFrequency,
        about: vec![],
        statistic: 1.0,
        p_value: 1.0,
        what: "too short for tiles".into(),
    })
}

/// Kurtosis about 0, less the 3 of a normal distribution.
pub(crate) fn excess_kurtosis(e: &[f64]) -> f64 {
    let n = e.len() as f64;
    let m2 = dot(e, e) / n;
    sum_of(e, |v| v.powi(4)) / n / (m2 * m2) - 3.0
}

/// Excess kurtosis of a uniform distribution.
const UNIFORM: f64 = -1.2;

/// Where rounding to the `step`, in standard deviations of `e`, makes a part of the variance, it makes the tails lighter by the
/// square of that part.
fn kurtosis(e: &[f64], rate_hz: f64, step: f64) -> Outcome {
    let n = e.len() as f64;
    let excess = excess_kurtosis(e);
    let rounding = (step * step / 12.0).min(1.0);
    let beyond = excess - excess.clamp(UNIFORM * rounding * rounding, 0.0);
    let far = (0..e.len())
        .max_by(|a, b| e[*a].abs().total_cmp(&e[*b].abs()))
        .unwrap_or(0);
    let z = kurtosis_score(beyond + 3.0, n);
    Outcome {
        id: CheckId::Kurtosis,
        about: vec![],
        statistic: excess,
        p_value: normal_tail(z),
        what: format!(
            "excess kurtosis {excess:+.3} of the whitened residual: {}; farthest sample {:.1} sigma at {:.2} s",
            if excess < 0.0 {
                "tails too light"
            } else {
                "tails too heavy"
            },
            e[far].abs(),
            far as f64 / rate_hz
        ),
    }
}

/// Skewness of `n` values as a standard normal score. D'Agostino (1970): a function of the sinh^-1 kind makes the heavy-tailed
/// statistic normal.
fn skewness_score(skewness: f64, n: f64) -> f64 {
    let y = skewness * ((n + 1.0) * (n + 3.0) / (6.0 * (n - 2.0))).sqrt();
    let b2 = 3.0 * (n * n + 27.0 * n - 70.0) * (n + 1.0) * (n + 3.0)
        / ((n - 2.0) * (n + 5.0) * (n + 7.0) * (n + 9.0));
    let w2 = (2.0 * (b2 - 1.0)).sqrt() - 1.0;
    let alpha = (2.0 / (w2 - 1.0)).sqrt();
    (y / alpha).asinh() / (0.5 * w2.ln()).sqrt()
}

/// Skewness below which a longer record than [`RECORD`] is not told: that one would not show it (4.4 of its (6 / n)^1/2).
const LEAST_SKEWNESS: f64 = 0.1;

/// Third moment about the mean over the third power of the spread.
pub(crate) fn skewness_of(e: &[f64]) -> f64 {
    let n = e.len() as f64;
    let mean = sum_of(e, |v| v) / n;
    let moment = |k: i32| sum_of(e, |v| (v - mean).powi(k)) / n;
    moment(3) / moment(2).powf(1.5)
}

fn skewness(e: &[f64]) -> Outcome {
    let n = e.len() as f64;
    let skewness = skewness_of(e);
    Outcome {
        id: CheckId::Skewness,
        about: vec![],
        statistic: skewness,
        p_value: if n > RECORD && skewness.abs() < LEAST_SKEWNESS {
            1.0
        } else {
            normal_tail(skewness_score(skewness, n))
        },
        what: format!(
            "skewness {skewness:+.3} of the whitened residual: it reaches farther {} than {}",
            if skewness > 0.0 { "up" } else { "down" },
            if skewness > 0.0 { "down" } else { "up" },
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::white;

    #[test]
    fn skewness_of_white_noise_fails_as_often_as_its_chance_says_and_shows_two_gains() {
        let runs = 2000;
        let low = (0..runs)
            .filter(|s| skewness(&white(1000, *s)).p_value < 0.01)
            .count();
        // 20 +- 4.4 are expected.
        assert!((6..=36).contains(&low), "{low}");
        let two_gains: Vec<f64> = white(6000, 9)
            .iter()
            .map(|v| if *v > 0.0 { 1.15 * v } else { *v })
            .collect();
        let found = skewness(&two_gains);
        assert!(found.p_value < 1e-5, "{}", found.p_value);
        assert!(found.what.contains("farther up"), "{}", found.what);
    }

    #[test]
    fn tiles_of_white_noise_fail_as_often_as_their_chance_says() {
        let runs = 600;
        let below = |p: f64| {
            (0..runs)
                .filter(|s| tiles(&white(3000, *s), 20.0).p_value < p)
                .count()
        };
        // Two scales that hardly depend on each other: 1 in 100, with five sigma of room; half that would be suspicious.
        assert!(below(0.01) <= 18, "{}", below(0.01));
        let half = below(0.5);
        assert!(half > 150 && half < 400, "{half}");
    }

    #[test]
    fn a_chirp_that_no_band_shows_fills_tiles() {
        let n = 12_000;
        let mut e = white(n, 7);
        for (i, v) in e.iter_mut().enumerate() {
            let t = i as f64 / 20.0;
            *v += 0.33 * (std::f64::consts::TAU * (1.0 + 6.0 * t / 1200.0) * t).sin();
        }
        assert!(tiles(&e, 20.0).p_value < 1e-8);
    }
}
