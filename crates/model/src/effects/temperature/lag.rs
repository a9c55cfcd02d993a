//! A bias that is behind the thermometer, or ahead of it.
//!
//! Heat reaches the die and the thermometer by different ways. Where the die is behind, it follows the reading with one time
//! constant. Where the thermometer is behind, as in a metal can, it does so, and the die has what the thermometer is on its way
//! to: its reading and the lag times the pace of it.

use std::sync::Arc;

use crate::effect::{Column, Shape};

/// Time over which a reading is smoothed before its pace is taken, in parts of the lag and in s: a die is hardly faster than that,
/// and what rounding and noise make of the pace stays within some ten times their size.
const SMOOTHED: [f64; 2] = [1.0 / 12.0, 1.0 / 3.0];
const SMOOTHED_S: f64 = 2.0;

/// A temperature behind a lag, s; ahead by as much where it is below 0.
pub(super) fn behind(values: &[f64], lag: f64, rate_hz: f64) -> Vec<f64> {
    if lag > 0.0 {
        follow(values.iter().copied(), lag * rate_hz)
    } else if lag < 0.0 {
        let [least, most] = SMOOTHED.map(|part| part * -lag);
        ahead(
            values,
            -lag * rate_hz,
            SMOOTHED_S.clamp(least, most) * rate_hz,
        )
    } else {
        values.to_vec()
    }
}

/// What follows values with a time constant of so many samples, and is there already at the first.
fn follow(values: impl Iterator<Item = f64>, samples: f64) -> Vec<f64> {
    let keep = (-1.0 / samples).exp();
    let mut held = None;
    let each = values.map(|v| {
        let before = held.unwrap_or(v);
        let now = v + keep * (before - v);
        held = Some(now);
        now
    });
    each.collect()
}

/// What values that follow with a time constant of so many samples are on their way to, smoothed over `reach` of them either way.
fn ahead(values: &[f64], samples: f64, reach: f64) -> Vec<f64> {
    let mut smooth = follow(values.iter().copied(), reach);
    smooth = follow(smooth.into_iter().rev(), reach);
    smooth.reverse();
    let last = smooth.len().saturating_sub(1);
    let at = |i: usize| {
        let (from, to) = (i.saturating_sub(1), (i + 1).min(last));
        let pace = (smooth[to] - smooth[from]) / (to - from).max(1) as f64;
        smooth[i] + samples * pace
    };
    (0..smooth.len()).map(at).collect()
}

/// About its mean.
pub(super) fn about_mean(mut values: Vec<f64>) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    values.iter_mut().for_each(|v| *v -= mean);
    values
}

/// Lags that are tried first, s, a factor of three apart, and the part of the record that the longest is.
const LAGS_S: [f64; 6] = [1.0, 3.0, 9.0, 27.0, 81.0, 243.0];
const LONGEST: f64 = 0.25;
/// Fewest samples of a lag.
const SHORTEST: f64 = 2.0;

/// The bias behind the thermometer by a lag that is sought, or ahead of it.
#[derive(Clone)]
pub(super) struct Lagging {
    pub(super) temperature: Arc<Vec<f64>>,
    pub(super) channel: String,
    pub(super) rate_hz: f64,
    pub(super) ahead: bool,
}

impl Lagging {
    fn lags(&self) -> impl Iterator<Item = f64> {
        let least = SHORTEST / self.rate_hz;
        let most = LONGEST * self.temperature.len() as f64 / self.rate_hz;
        let all = LAGS_S.into_iter();
        all.filter(move |lag| (least..=most).contains(lag))
    }

    /// Whether there is any that the record could tell.
    pub(super) fn any(&self) -> bool {
        self.lags().count() > 1
    }
}

impl Shape for Lagging {
    fn coordinate(&self) -> (&'static str, &'static str) {
        (super::LAG, "s")
    }

    fn grid(&self) -> Vec<f64> {
        self.lags().collect()
    }

    fn columns(&self, at: f64) -> Vec<Column> {
        let course = behind(&self.temperature, self.told(at), self.rate_hz);
        vec![Column {
            parameter: "slope",
            values: about_mean(course),
        }]
    }

    fn follows(&self) -> Option<&str> {
        Some(&self.channel)
    }

    fn told(&self, at: f64) -> f64 {
        if self.ahead { -at } else { at }
    }

    fn whole(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_thermometer_is_on_its_way_to_is_what_it_is_behind() {
        // A swing of 30 000 samples and a thermometer that is 500 behind.
        let truth: Vec<f64> = (0..60_000)
            .map(|i| (std::f64::consts::TAU * f64::from(i) / 30_000.0).sin())
            .collect();
        let read = behind(&truth, 25.0, 20.0);
        let again = behind(&read, -25.0, 20.0);
        let off = |a: &[f64]| {
            let all = a.iter().zip(&truth).skip(3000).take(54_000);
            all.map(|(a, t)| (a - t).abs()).fold(0.0, f64::max)
        };
        assert!(off(&read) > 0.1, "{}", off(&read));
        assert!(off(&again) < 2e-3, "{}", off(&again));
    }

    #[test]
    fn what_stands_still_is_nowhere_behind() {
        for lag in [-5.0, 0.0, 5.0] {
            let still = behind(&[21.5; 400], lag, 20.0);
            assert!(still.iter().all(|v| (v - 21.5).abs() < 1e-12), "{lag}");
        }
    }
}
