//! How large what is left of a channel is, where it lies, and what it does: a generic spectrum and a generic course of the
//! variance in the place of a name.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use crate::fit::channel::Form;
use crate::ingest::types::Grid;
use crate::result::Consequence;
use crate::search::searched::Searched;

/// Horizons of the angle error, s, with their keys.
pub(crate) const HORIZONS: [(&str, f64); 2] = [("10s", 10.0), ("100s", 100.0)];
/// Parts of a record that a horizon, or an averaging time, has to leave room for.
pub(crate) const LEAST_PARTS: usize = 4;
/// Bands of equal width; the lowest is halved again and again, down to so many coefficients.
const BANDS: usize = 24;
const LEAST_COEFFICIENTS: f64 = 10.0;
/// Stretches of time, each of so many samples at least.
const STRETCHES: usize = 30;
const LEAST_SAMPLES: usize = 100;
/// Standard errors beyond which the energy of a band or a stretch is not the model's: of some thirty, one in 500 by chance.
const FAR: f64 = 4.0;
/// Share of a power that may lie below, or above, the place that is stated for it.
const BESIDE: f64 = 0.05;
/// Share of the band below which what lies in a place is told from what surrounds it.
const NARROW: f64 = 0.5;
/// Share of the band, or of the record, from which on a place is none.
const EVERYWHERE: f64 = 0.8;

/// What is left of a channel.
pub(super) struct Left {
    /// Its size, unit of the channel.
    pub rms: Option<f64>,
    /// Over the variance of the readings.
    pub share_of_variance: Option<f64>,
    /// Where it lies in frequency, Hz.
    pub band_hz: Option<[f64; 2]>,
    /// Where it lies in time, s.
    pub span_s: Option<[f64; 2]>,
    /// What it does.
    pub consequence: Consequence,
    /// Largest relative change of a deviation within a stretch of time.
    pub local_change: f64,
}

/// Power of the readings by frequency.
struct Power {
    /// Angular frequency of each bin, rad per sample.
    omega: Vec<f64>,
    /// Power of the model in it, squared unit of the channel.
    model: Vec<f64>,
    /// What the record has beyond that, where it is clearly another.
    excess: Vec<f64>,
    /// Lowest and highest share of half the sample rate where it is.
    at: Option<[f64; 2]>,
}

/// Lower ends of the bands, as shares of half the sample rate, rising.
fn band_edges(n: usize) -> Vec<f64> {
    let mut low = 1.0 / BANDS as f64;
    let mut edges: Vec<f64> = (1..BANDS).map(|b| b as f64 / BANDS as f64).collect();
    while 0.5 * low * n as f64 >= LEAST_COEFFICIENTS {
        low *= 0.5;
        edges.insert(0, low);
    }
    edges.insert(0, 0.0);
    edges
}

impl Power {
    fn of(s: &Searched<'_>, terms: &[usize]) -> Self {
        let bins = &s.search.panel.bins;
        let n = bins.n as f64;
        let ones = vec![1.0; bins.n];
        let counts = bins.products(&ones, &ones);
        let energy = bins.products(&s.u, &s.u);
        let density = s.state.noise.over(bins);
        let white = s.state.solution.white;
        let by_bin = density.iter().zip(&counts);
        let mut model: Vec<f64> = by_bin.map(|(g, m)| white * g * m / n).collect();
        let edges = band_edges(bins.n);
        let band = |w: f64| edges.partition_point(|e| *e <= w / PI) - 1;
        let mut sums = vec![(0.0, 0.0); edges.len()];
        for ((w, m), e) in bins.at.omega.iter().zip(&counts).zip(&energy) {
            let sum = &mut sums[band(*w)];
            *sum = (sum.0 + m, sum.1 + e);
        }
        let off = |(count, energy): &(f64, f64)| {
            let off = energy / count - 1.0;
            let clear = *count > 0.0 && off.abs() > FAR * (2.0 / count).sqrt();
            if clear { off } else { 0.0 }
        };
        let off: Vec<f64> = sums.iter().map(off).collect();
        let each = model.iter().zip(&bins.at.omega);
        let mut excess: Vec<f64> = each.map(|(p, w)| p * off[band(*w)]).collect();
        // What follows one channel in two ways may nearly cancel: together they are as large as they are.
        let mut together = vec![0.0; bins.n];
        for (place, (term, own)) in s.state.parts().enumerate() {
            if !terms.contains(&place) {
                continue;
            }
            if let Form::Covariance(process, theta) = &term.form {
                let density = process.density(theta, &bins.at);
                // A filter has the white noise in the place of which it stands; a spectrum of no kind stands out of its floor.
                let instead = match process.filters_white() {
                    true if term.is_any_spectrum() => median(&density, &counts),
                    filters => f64::from(u8::from(filters)),
                };
                for (((m, x), d), count) in
                    model.iter_mut().zip(&mut excess).zip(density).zip(&counts)
                {
                    let power = white * (d - instead) * count / n;
                    (*m, *x) = (*m - power, *x + power);
                }
            } else {
                (s.search.panel).add_columns(&mut together, 0, &term.columns, own);
            }
        }
        together[0] = 0.0;
        let energy = bins.products(&together, &together);
        excess.iter_mut().zip(energy).for_each(|(x, e)| *x += e / n);
        let above = above_floor(&excess, &counts);
        let at = place(&above, &bins.at.omega);
        let mut power = Self {
            excess,
            omega: bins.at.omega.clone(),
            model,
            at,
        };
        if at.is_some_and(|[low, high]| high - low < NARROW) {
            power.keep(&above);
        }
        power
    }

    /// Keeps of the excess what lies in its place above the floor; the tails of the nearest cause, which took white noise for
    /// it, are the model's again.
    fn keep(&mut self, above: &[f64]) {
        let [low, high] = self.at.unwrap_or([0.0, 1.0]);
        let inside = |w: f64| (low..=high).contains(&(w / PI));
        let each = self.excess.iter_mut().zip(&mut self.model).zip(above);
        for (((x, m), above), w) in each.zip(&self.omega) {
            let kept = if inside(*w) { above.copysign(*x) } else { 0.0 };
            *m += *x - kept;
            *x = kept;
        }
    }

    /// Terms that nearly cancel, as a line and a band about it, have more than the readings together: what is left is no more
    /// than these.
    fn within(&mut self, variance: f64) {
        let beyond: f64 = self.excess.iter().map(|x| x.abs()).sum();
        if beyond > variance {
            let part = variance / beyond;
            self.excess.iter_mut().for_each(|x| *x *= part);
        }
    }

    /// Mean square of the model, and of the model with what is beyond it, through a filter of that gain.
    fn through(&self, gain: impl Fn(f64) -> f64) -> [f64; 2] {
        let each = self.omega.iter().zip(&self.model).zip(&self.excess);
        each.fold([0.0; 2], |[model, record], ((w, m), x)| {
            let gain = gain(*w);
            [model + gain * m, record + gain * (m + x)]
        })
    }
}

/// Power above the median density: the nearest cause has tails over all frequencies, which are no place.
fn above_floor(power: &[f64], counts: &[f64]) -> Vec<f64> {
    let density = |(p, m): (&f64, &f64)| if *m > 0.0 { p.abs() / m } else { 0.0 };
    let densities: Vec<f64> = power.iter().zip(counts).map(density).collect();
    let floor = median(&densities, counts);
    let above = power.iter().zip(counts);
    above.map(|(p, m)| (p.abs() - floor * m).max(0.0)).collect()
}

/// Median of a density over coefficients.
fn median(density: &[f64], counts: &[f64]) -> f64 {
    let mut all: Vec<(&f64, &f64)> = density.iter().zip(counts).collect();
    all.sort_by(|a, b| a.0.total_cmp(b.0));
    let half = 0.5 * counts.iter().sum::<f64>();
    let mut sum = 0.0;
    let median = all.iter().find(|(_, m)| {
        sum += *m;
        sum >= half
    });
    median.map_or(0.0, |m| *m.0)
}

/// Lowest and highest share of half the sample rate between which nine tenths of a power lie, none where there is none.
fn place(power: &[f64], omega: &[f64]) -> Option<[f64; 2]> {
    let all: f64 = power.iter().map(|x| x.abs()).sum();
    let mut sum = 0.0;
    let within = power.iter().zip(omega).filter(|(x, _)| {
        let before = sum;
        sum += x.abs();
        sum > BESIDE * all && before < (1.0 - BESIDE) * all
    });
    let mut inside = within.map(|(_, w)| w / PI);
    let first = inside.next().filter(|_| all > 0.0)?;
    Some([first, inside.last().unwrap_or(first)])
}

/// Squared gain of a sum over `m` samples, times `dt`: the angle that they make.
fn angle_gain(w: f64, m: f64, dt: f64) -> f64 {
    (dt * (0.5 * w * m).sin() / (0.5 * w).sin()).powi(2)
}

/// Squared gain of the Allan deviation at `m` samples.
fn allan_gain(w: f64, m: f64) -> f64 {
    2.0 * (0.5 * w * m).sin().powi(4) / (m * (0.5 * w).sin()).powi(2)
}

/// Relative change of a root mean square.
fn change([before, after]: [f64; 2]) -> f64 {
    if before > 0.0 {
        ((after.max(0.0) / before).sqrt() - 1.0).abs()
    } else {
        0.0
    }
}

/// Averaging times of an Allan curve by octaves, in samples, with room for some of them in `n`.
pub(crate) fn octaves(n: usize) -> impl Iterator<Item = usize> {
    (0..usize::BITS)
        .map(|k| 1 << k)
        .take_while(move |m| m * LEAST_PARTS <= n)
}

/// What is left of a channel under its model.
///
/// `terms` are places of its terms that stand for it: they are a part of what is left.
pub(super) fn left_over(s: &Searched<'_>, grid: &Grid, terms: &[usize]) -> Left {
    let mut power = Power::of(s, terms);
    let (n, rate_hz) = (grid.n, grid.rate_hz);
    let mean = s.target.y.iter().sum::<f64>() / n as f64;
    let variance = s.target.y.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n as f64;
    power.within(variance);
    let beyond: f64 = power.excess.iter().map(|x| x.abs()).sum();
    let share = if variance > 0.0 {
        beyond / variance
    } else {
        0.0
    };
    let deviations = octaves(n).map(|m| change(power.through(|w| allan_gain(w, m as f64))));
    let mut largest_change = deviations.fold(0.0, f64::max);
    let mut angles = BTreeMap::new();
    for (key, seconds) in HORIZONS {
        let m = (seconds * rate_hz).round();
        if m * LEAST_PARTS as f64 > n as f64 {
            continue;
        }
        let both = power.through(|w| angle_gain(w, m, 1.0 / rate_hz));
        largest_change = largest_change.max(change(both));
        angles.insert(key.to_owned(), (both[1] - both[0]).abs().sqrt());
    }
    let (span_s, local_change) = in_time(&s.e, rate_hz);
    let band = power.at.filter(|[low, high]| high - low < EVERYWHERE);
    Left {
        rms: (beyond > 0.0).then(|| beyond.sqrt()),
        share_of_variance: (beyond > 0.0).then_some(share),
        band_hz: band.map(|b| b.map(|share| 0.5 * rate_hz * share)),
        span_s,
        consequence: Consequence {
            share_of_variance: share,
            angle_rms_deg: angles,
            velocity_rms_mps: BTreeMap::new(),
            largest_change,
        },
        local_change,
    }
}

/// Where the size of a whitened residual is clearly another, s, and by how much its deviation is there, relative.
fn in_time(e: &[f64], rate_hz: f64) -> (Option<[f64; 2]>, f64) {
    let length = (e.len() / STRETCHES).max(LEAST_SAMPLES);
    let power = |part: &[f64]| part.iter().map(|v| v * v).sum::<f64>() / part.len() as f64;
    let mean = power(e);
    let fourth = e.iter().map(|v| v.powi(4)).sum::<f64>() / e.len() as f64;
    // Of what is not normal the square scatters by its own fourth moment.
    let error = ((fourth / (mean * mean) - 1.0).max(0.0) / length as f64).sqrt();
    let parts = e.chunks_exact(length).map(power).enumerate();
    let off: Vec<(usize, f64)> = parts
        .map(|(j, p)| (j, p / mean))
        .filter(|(_, p)| (p - 1.0).abs() > FAR * error)
        .collect();
    let largest = off.iter().map(|(_, p)| (p.sqrt() - 1.0).abs());
    let largest = largest.fold(0.0, f64::max);
    let seconds = |j: usize| (j * length) as f64 / rate_hz;
    let span = match (off.first(), off.last()) {
        (Some(first), Some(last)) => Some([seconds(first.0), seconds(last.0 + 1)]),
        _ => None,
    };
    let all = e.len() as f64 / rate_hz;
    (
        span.filter(|[from, to]| to - from < EVERYWHERE * all),
        largest,
    )
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    fn white(n: usize) -> Vec<f64> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        (0..n).map(|_| StandardNormal.sample(&mut rng)).collect()
    }

    #[test]
    fn gains_of_white_noise_are_its_allan_variance_and_its_angle() {
        let steps = 200_000;
        let omega = (0..steps).map(|k| PI * (f64::from(k) + 0.5) / f64::from(steps));
        let mean =
            |gain: &dyn Fn(f64) -> f64| omega.clone().map(gain).sum::<f64>() / f64::from(steps);
        for m in [1.0, 4.0, 64.0] {
            assert!((mean(&|w| allan_gain(w, m)) * m - 1.0).abs() < 1e-3, "{m}");
            let angle = mean(&|w| angle_gain(w, m, 0.05));
            assert!((angle / (m * 0.05 * 0.05) - 1.0).abs() < 1e-3, "{m}");
        }
    }

    #[test]
    fn a_loud_stretch_is_found_with_its_size_and_steady_noise_has_none() {
        let mut e = white(12_000);
        let (span, change) = in_time(&e, 20.0);
        assert_eq!((span, change), (None, 0.0));
        e[4000..6000].iter_mut().for_each(|v| *v *= 1.6);
        let (span, change) = in_time(&e, 20.0);
        assert_eq!(span, Some([200.0, 300.0]));
        // The mean square of all is 1 + 0.26, over which 1.6 is 1.43.
        assert!((change - 0.43).abs() < 0.08, "{change}");
    }

    #[test]
    fn bands_cover_everything_and_are_finest_where_drifts_are() {
        let edges = band_edges(12_000);
        assert_eq!(edges[0], 0.0);
        assert!(edges.windows(2).all(|e| e[0] < e[1]));
        assert!(edges[1] * 12_000.0 < 2.0 * LEAST_COEFFICIENTS);
        assert_eq!(edges.last(), Some(&(23.0 / 24.0)));
    }
}
