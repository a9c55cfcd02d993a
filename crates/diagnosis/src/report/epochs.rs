//! What follows the changes of a command, laid over each other: superposed epochs (Chree, 1912).
//!
//! A surge of a quarter of a second is over before a block of the figure in time has ended. Of epochs that begin with the changes d
//! of the command, the mean response at a lag is sum d y / sum d^2 times the largest change: noise and whatever else the rate does
//! falls with the number of changes.

use crate::result::{Series, SeriesStyle};
use model::effect::Signal;

/// Before a change, s, and the longest behind it.
const BEFORE_S: f64 = 1.0;
const LONGEST_S: f64 = 60.0;
/// Smallest change that begins an epoch, over the largest.
const LEAST_CHANGE: f64 = 0.05;
/// Readings for each change that a command has at least: another one has no epochs.
const SELDOM: usize = 16;
/// Of the largest response what is left at the end of a figure, and how much later that is.
const FADED: f64 = 0.05;
const LATER: f64 = 2.0;
/// Shortest figure behind a change, readings.
const SHORTEST: usize = 20;

/// What is drawn.
pub(super) struct Drawn {
    pub x_label: String,
    pub caption: String,
    pub series: Vec<Series>,
}

/// The readings `seen`, and what a model makes of them, by the time since a change of the command; `None` where that never rests.
pub(super) fn of(command: &Signal, rate_hz: f64, seen: &[f64], fitted: &[f64]) -> Option<Drawn> {
    let steps = command.values.windows(2).enumerate();
    let steps: Vec<(usize, f64)> = steps.map(|(i, w)| (i + 1, w[1] - w[0])).collect();
    let largest = steps.iter().fold(0.0f64, |m, (_, d)| m.max(d.abs()));
    let begins = |(_, d): &&(usize, f64)| d.abs() > LEAST_CHANGE * largest;
    let epochs: Vec<(usize, f64)> = steps.iter().filter(begins).copied().collect();
    if epochs.is_empty() || epochs.len() > seen.len() / SELDOM {
        return None;
    }
    let [before, longest] = [BEFORE_S, LONGEST_S].map(|s| (s * rate_hz) as i64);
    let response = |of: &[f64], lag: i64| {
        let (mut sum, mut energy) = (0.0, 0.0);
        for (at, change) in &epochs {
            let place = usize::try_from(*at as i64 + lag).ok();
            if let Some(value) = place.and_then(|place| of.get(place)) {
                sum += change * value;
                energy += change * change;
            }
        }
        if energy > 0.0 {
            largest * sum / energy
        } else {
            0.0
        }
    };
    let modelled: Vec<f64> = (-before..longest)
        .map(|lag| response(fitted, lag))
        .collect();
    let top = modelled.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let behind = modelled.iter().skip(before as usize);
    let faded = behind.take_while(|v| v.abs() > FADED * top).count();
    let shown = ((LATER * faded as f64) as usize).max(SHORTEST) + before as usize;
    let shown = shown.min(modelled.len());
    let lags = (-before..longest).take(shown);
    let x: Vec<f64> = lags.clone().map(|lag| lag as f64 / rate_hz).collect();
    let y: Vec<f64> = lags.map(|lag| response(seen, lag)).collect();
    let series = |label: &str, style: SeriesStyle, y: Vec<f64>| Series {
        label: label.into(),
        style,
        x: x.clone(),
        y,
    };
    let [name, count] = [command.name.clone(), epochs.len().to_string()];
    Some(Drawn {
        x_label: format!("time since a change of {name}, s"),
        caption: format!(
            "What follows a change of {name}: mean of {count} of them by their sizes, for the largest, the other terms taken out."
        ),
        series: vec![
            series("measured, other terms taken out", SeriesStyle::Points, y),
            series("model", SeriesStyle::Line, modelled[..shown].to_vec()),
        ],
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use model::record::Quantity;

    use super::*;

    #[test]
    fn a_surge_that_is_over_before_the_next_change_is_drawn_with_its_size_and_its_time() {
        let rate_hz = 20.0;
        let level = |i: usize| f64::from(u8::from(i / 200 % 2 == 1));
        let values: Vec<f64> = (0..4000).map(level).collect();
        let mut left = 0.0;
        let surge: Vec<f64> = (0..4000)
            .map(|i| {
                let change = if i > 0 { level(i) - level(i - 1) } else { 0.0 };
                left = 0.8 * left + change;
                0.5 * left
            })
            .collect();
        let command = Signal {
            name: "pwm".into(),
            quantity: Quantity::Pwm,
            axis: None,
            unit: "1".into(),
            smooth: Arc::new(values.clone()),
            values: Arc::new(values),
            lsb: None,
            moving: false,
        };
        let drawn = of(&command, rate_hz, &surge, &surge).expect("ten changes");
        let [seen, model] = &drawn.series[..] else {
            panic!("two series")
        };
        assert_eq!(seen.x[20], 0.0);
        assert!((seen.y[20] - 0.5).abs() < 1e-9, "{}", seen.y[20]);
        assert!((seen.y[24] - 0.5 * 0.8f64.powi(4)).abs() < 1e-9);
        assert_eq!(model.y, seen.y);
        // Faded to a twentieth within 14 readings, and twice that is shown.
        assert_eq!(seen.x.len(), 20 + 28);
        // A command that never rests has no epochs.
        let busy = Signal {
            values: Arc::new((0..4000).map(|i| f64::from(i % 7)).collect()),
            ..command
        };
        assert!(of(&busy, rate_hz, &surge, &surge).is_none());
    }
}
