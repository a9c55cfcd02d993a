//! What a correction is worth: the angle error of the rates as they were read and as the board corrected them.
//!
//! The angle error over a span is the root mean square, over the windows of that length behind the rest (each begun a tenth
//! of it after the one before), of the integral of rate less true rate. Of the rates as they were read the mean over the rest
//! is taken off first; of corrected ones nothing, as that is the work of the board.

use std::collections::HashMap;

use model::record::Record;
use serde::Serialize;
use wire::{Corrected, correction_state};

use super::noise::Noise;

/// Spans over which angles are judged, s.
pub const SPANS_S: [f64; 3] = [10.0, 100.0, 600.0];
/// Windows begin this many times in each length.
const OVERLAP: usize = 10;
/// Spans that the time behind the rest holds at least: one alone says nothing of an rms.
pub(super) const SPANS_AT_LEAST: f64 = 2.0;
/// Standard deviations that hold an error of the bias 95 times of 100: what is worse by no more is chance. A bias that is off adds
/// its angle to each window's, and so to their root mean square as much at the most (Minkowski).
const NORMAL_95: f64 = 1.96;
/// Pairs of means, side by side, from which on their spread says something.
const SIDE_BY_SIDE: usize = 4;
/// Blocks that the filter knows are counted in 1/256.
const KNOWN_ONE: f64 = 256.0;
/// Share of its rows that a window has readings in, at least.
const READINGS: f64 = 0.9;

/// A record to be judged.
#[derive(Clone, Copy)]
pub struct Stage<'a> {
    /// "at rest", "swaying".
    pub what: &'static str,
    /// With raw and corrected rates.
    pub record: &'a Record,
    /// Its corrected frames.
    pub corrected: &'a [Corrected],
    /// How long the stand rests at its begin, s.
    pub rest_s: f64,
    /// Of x, y, z.
    pub noise: &'a [Noise; 3],
    /// The true rates, where somebody knows them; else there are none.
    pub truth: Option<&'a Record>,
    /// The same history of a stand with nothing wrong, whose board knows its noise: corrected rates.
    pub limit: Option<&'a Record>,
}

/// One axis over one span.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// gyro_x, ...
    pub channel: &'static str,
    /// s.
    pub span_s: f64,
    /// Of the rates as they were read, deg.
    pub before_deg: f64,
    /// Of the corrected ones, deg.
    pub after_deg: f64,
    /// What the model says of the corrected ones, deg.
    pub predicted_deg: f64,
    /// Of the same board on a stand with nothing wrong, deg: a perfect correction, the same noise.
    pub limit_deg: Option<f64>,
    /// Corrected is worse than read, by more than what matters and more than the uncertain bias makes by chance.
    pub worse: bool,
}

/// Shares of the corrected frames in which the board says something, 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct States {
    /// Frames.
    pub frames: usize,
    /// The coefficients are applied.
    pub applied: f64,
    /// The last block at rest was refused: what was read there fits no bias.
    pub refused: f64,
    /// The noise of an axis is far from what was told.
    pub noise_off: f64,
    /// A temperature is outside the range of the correction.
    pub extrapolated: f64,
}

/// What a correction is worth in one record.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Judged {
    /// "at rest", "swaying".
    pub what: &'static str,
    /// Length behind the rest, s.
    pub seconds: f64,
    /// By axis and span.
    pub rows: Vec<Row>,
    /// What the board says.
    pub board: States,
}

/// Judges a record; corrected counts as worse from `matters` on, a relative change.
#[must_use]
pub fn judge(stage: &Stage<'_>, matters: f64) -> Judged {
    let record = stage.record;
    let rate_hz = record.header.rate_hz.unwrap_or(f64::NAN);
    let rest = (stage.rest_s * rate_hz) as usize;
    let behind_s = record.len().saturating_sub(rest) as f64 / rate_hz;
    let mut rows = Vec::new();
    for axis in 0..3 {
        let channel = ["gyro_x", "gyro_y", "gyro_z"][axis];
        let values = |record: &Record, name: &str| {
            let found = record.channel(name);
            found.map_or_else(|| vec![f64::NAN; record.len()], |c| c.values.clone())
        };
        let truth = |at: &Record, values: Vec<f64>| match stage.truth {
            Some(truth) => less(at, values, truth, channel),
            None => values,
        };
        let read = without_rest(truth(record, values(record, channel)), rest);
        let corrected = ["corrected_x", "corrected_y", "corrected_z"][axis];
        let of_board = |record: &Record| truth(record, values(record, corrected));
        let (corrected, limit) = (of_board(record), stage.limit.map(of_board));
        let noise = &stage.noise[axis];
        let bias = bias_variance(noise, stage.corrected, axis, rest, rate_hz);
        // A model that is wrong may be so in its noise, too: it gets no more than the readings themselves show.
        let unsure = variance_of_means(&read, rest).map_or(bias, |shown| bias.min(shown));
        for span_s in SPANS_S {
            let over = |errors: &[f64]| {
                let enough =
                    errors.len().saturating_sub(rest) as f64 >= SPANS_AT_LEAST * span_s * rate_hz;
                enough.then(|| rms(errors, rest, span_s, rate_hz)).flatten()
            };
            let (Some(before_deg), Some(after_deg)) = (over(&read), over(&corrected)) else {
                continue;
            };
            let chance = NORMAL_95 * unsure.sqrt() * span_s;
            rows.push(Row {
                channel,
                span_s,
                before_deg,
                after_deg,
                predicted_deg: noise.angle_deg(bias, record, rest, [span_s, behind_s]),
                limit_deg: limit.as_deref().and_then(over),
                worse: after_deg > (1.0 + matters) * before_deg + chance,
            });
        }
    }
    Judged {
        what: stage.what,
        seconds: behind_s,
        rows,
        board: States::of(stage.corrected),
    }
}

impl States {
    fn of(frames: &[Corrected]) -> Self {
        let share = |bit: u8| {
            let those = frames.iter().filter(|f| f.state & bit != 0).count();
            those as f64 / frames.len().max(1) as f64
        };
        Self {
            frames: frames.len(),
            applied: share(correction_state::APPLIED),
            refused: share(correction_state::REFUSED),
            noise_off: share(correction_state::NOISE_OFF),
            extrapolated: share(correction_state::EXTRAPOLATED),
        }
    }
}

/// Values less those of another record at the same ticks; none where that has none.
fn less(of: &Record, mut values: Vec<f64>, other: &Record, channel: &str) -> Vec<f64> {
    let (Some(own), Some(ticks), Some(theirs)) =
        (&of.t_ticks, &other.t_ticks, other.channel(channel))
    else {
        return vec![f64::NAN; values.len()];
    };
    let at: HashMap<u64, f64> = ticks
        .iter()
        .copied()
        .zip(theirs.values.iter().copied())
        .collect();
    for (value, tick) in values.iter_mut().zip(own) {
        *value -= at.get(tick).copied().unwrap_or(f64::NAN);
    }
    values
}

/// The mean of what there is; none of nothing.
fn mean(values: &[f64]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for value in values.iter().filter(|v| v.is_finite()) {
        sum += value;
        count += 1.0;
    }
    sum / count
}

pub(super) fn without_rest(mut values: Vec<f64>, rest: usize) -> Vec<f64> {
    let bias = mean(&values[..rest.min(values.len())]);
    values.iter_mut().for_each(|v| *v -= bias);
    values
}

/// Begins of the windows of a length behind the rest, in rows; nothing where there is none.
fn windows(rows: usize, rest: usize, length: usize) -> Option<impl Iterator<Item = usize>> {
    let behind = rows.checked_sub(rest)?;
    (length > 0 && behind >= length)
        .then(|| (rest..=rows - length).step_by((length / OVERLAP).max(1)))
}

/// Root mean square of the integrals over the windows, in the unit of `errors` times s.
pub(super) fn rms(errors: &[f64], rest: usize, span_s: f64, rate_hz: f64) -> Option<f64> {
    let length = (span_s * rate_hz).round() as usize;
    let (mut squares, mut count) = (0.0, 0.0);
    for begin in windows(errors.len(), rest, length)? {
        let window = errors.get(begin..begin + length)?;
        let there = window.iter().filter(|v| v.is_finite()).count();
        if there as f64 >= READINGS * length as f64 {
            squares += (mean(window) * span_s).powi(2);
            count += 1.0;
        }
    }
    (count > 0.0).then(|| (squares / count).sqrt())
}

/// Allan variance over so many rows, of windows each begun a tenth after the one before: what the mean over a rest of that length is
/// off as the bias at its end, by what the readings themselves show. Nothing where few of them stand side by side.
fn variance_of_means(values: &[f64], length: usize) -> Option<f64> {
    let step = (length / OVERLAP).max(1);
    let means: Vec<f64> = values
        .windows(length.max(1))
        .step_by(step)
        .map(mean)
        .collect();
    let apart = length / step;
    let (mut squares, mut count) = (0.0, 0usize);
    for (one, next) in means.iter().zip(means.get(apart..)?) {
        let square = (next - one).powi(2);
        if square.is_finite() {
            squares += square;
            count += 1;
        }
    }
    (count >= SIDE_BY_SIDE * OVERLAP).then(|| squares / (2.0 * count as f64))
}

/// Variance of the bias that the filter had at the end of the rest, (deg/s)^2: as it says, else that of a mean over the rest.
fn bias_variance(
    noise: &Noise,
    frames: &[Corrected],
    axis: usize,
    rest: usize,
    rate_hz: f64,
) -> f64 {
    let known = frames.get(rest).map_or(0, |frame| frame.known[axis]);
    if known > 0 && noise.block > 0.0 {
        return noise.block * KNOWN_ONE / f64::from(known);
    }
    noise.of_a_mean(rest as f64 / rate_hz)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_error_grows_with_the_span_and_the_rest_takes_it_off() {
        let errors = vec![0.5; 3000];
        let angle = rms(&errors, 200, 10.0, 20.0);
        assert!((angle.unwrap() - 5.0).abs() < 1e-9);
        assert_eq!(rms(&errors, 200, 150.0, 20.0), None, "no span");
        let left = rms(&without_rest(errors, 200), 200, 10.0, 20.0);
        assert!(left.unwrap() < 1e-9);
    }

    #[test]
    fn what_a_mean_is_off_is_told_by_the_readings_where_there_are_some() {
        // White noise of sigma^2 = 1/3 and a ramp, which a mean over 100 rows follows late.
        let mut state = 1u64;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        let noise: Vec<f64> = (0..40_000).map(|_| uniform()).collect();
        let white = variance_of_means(&noise, 100).expect("enough");
        assert!((white * 300.0 - 1.0).abs() < 0.2, "{white}");
        let ramp: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
        let of_ramp = variance_of_means(&ramp, 100).expect("enough");
        assert!((of_ramp - 0.5).abs() < 1e-9, "{of_ramp}");
        assert_eq!(variance_of_means(&ramp[..500], 100), None);
    }

    #[test]
    fn readings_that_are_missing_count_as_the_others_of_their_window_and_an_empty_one_not() {
        let mut errors = vec![1.0; 1000];
        errors[205] = f64::NAN;
        errors[600..800].fill(f64::NAN);
        assert!((rms(&errors, 200, 10.0, 20.0).unwrap() - 10.0).abs() < 1e-9);
    }
}
