//! The figure of what is known sample by sample: of two levels the record in means, and the level on which each most probably lies;
//! of a tone that was tracked its frequency.

use std::f64::consts::TAU;

use crate::fit::channel::{Path, Term};
use crate::result::{Evidence, Series, SeriesStyle};
use crate::search::searched::Searched;
use crate::two_level::fit::{of_blocks, path};

/// Dwell times that the figure shows: some more and it is a band of colour.
const SHOWN: f64 = 24.0;
/// Half heights over the standard deviation of a mean, where the dwell time leaves that many readings for it.
const PLAIN: f64 = 4.0;
/// Means of a dwell time, at least: fewer hide short stays.
const OF_A_DWELL: f64 = 8.0;
/// Dwell times over which the middle of the two levels may wander.
const SLOW: f64 = 10.0;

/// What is drawn.
pub(super) struct Drawn {
    series: Vec<Series>,
    caption: String,
    /// Of another quantity than the rate.
    y_label: Option<&'static str>,
}

impl Drawn {
    /// Puts it into a figure.
    pub(super) fn onto(self, figure: &mut Evidence) {
        (figure.series, figure.caption) = (self.series, self.caption);
        if let Some(label) = self.y_label {
            figure.y_label = label.into();
        }
    }
}

/// Frequencies of a tone that its figure shows, about.
const PITCHES: usize = 400;

/// The frequency of a tone over time.
fn pitch(path: &Path, rate_hz: f64) -> Drawn {
    let step = path.phase.len().div_ceil(PITCHES).max(2);
    let block_s = path.length / rate_hz;
    let steps = path.phase.windows(step + 1).step_by(step);
    let turned = steps.map(|w| (w[step].0 - w[0].0) / (step as f64 * path.length));
    let y: Vec<f64> = turned.map(|t| (path.omega + t) * rate_hz / TAU).collect();
    let middle = |i: usize| (((i as f64 + 0.5) * step as f64) + 1.0) * block_s;
    let series = Series {
        label: "frequency".into(),
        style: SeriesStyle::Line,
        x: (0..y.len()).map(middle).collect(),
        y,
    };
    Drawn {
        series: vec![series],
        caption: format!(
            "Frequency of the tone over time, from its phase over {} s each: it wanders, and comes back.",
            (step as f64 * block_s * 100.0).round() / 100.0
        ),
        y_label: Some("frequency, Hz"),
    }
}

/// The figure of a term that two levels stand for; `seen` are the readings without the other terms. None of another term, and of a
/// record too short for it.
pub(super) fn of(s: &Searched<'_>, term: &Term, seen: &[f64], rate_hz: f64) -> Option<Drawn> {
    if let Some(path) = &term.path {
        return Some(pitch(path, rate_hz));
    }
    let [(half, _), (dwell_s, _)] = term.stated.as_deref()? else {
        return None;
    };
    let white = s.state.solution.white;
    let dwell = dwell_s * rate_hz;
    let quiet = PLAIN * PLAIN * white / (half * half);
    let length = quiet.min(dwell / OF_A_DWELL).max(1.0) as usize;
    let of_samples = [
        white.ln(),
        s.state.noise.log_walk,
        (half / white.sqrt()).ln(),
        dwell.ln(),
    ];
    let count = (seen.len() / length).min((SHOWN * dwell / length as f64).ceil() as usize);
    if count < 4 {
        return None;
    }
    let mean = |b: &[f64]| b.iter().sum::<f64>() / b.len() as f64;
    let means: Vec<f64> = seen.chunks_exact(length).map(mean).collect();
    let levels = path(&means, &of_blocks(&of_samples, length as f64));
    let between: Vec<f64> = means.iter().zip(&levels).map(|(y, l)| y - l).collect();
    let middle = running(&between, (SLOW * dwell / length as f64) as usize);
    let block_s = length as f64 / rate_hz;
    let times: Vec<f64> = (0..count).map(|b| (b as f64 + 0.5) * block_s).collect();
    let level = levels.iter().zip(&middle).map(|(l, m)| l + m);
    let part = if count < means.len() {
        format!(", the first {:.0} s of the record", count as f64 * block_s)
    } else {
        String::new()
    };
    let line = |label: &str, style, y| Series {
        label: label.into(),
        style,
        x: times.clone(),
        y,
    };
    Some(Drawn {
        y_label: None,
        series: vec![
            line(
                "measured, other terms taken out",
                SeriesStyle::Points,
                means[..count].to_vec(),
            ),
            line(
                "most probable level",
                SeriesStyle::Line,
                level.take(count).collect(),
            ),
        ],
        caption: format!(
            "Rate in means of {} s{part}, and the level that it most probably lies on: it stays near one of two values and jumps between them.",
            (block_s * 1e3).round() / 1e3
        ),
    })
}

/// Means over `width` values about each, or over all where there are fewer.
fn running(values: &[f64], width: usize) -> Vec<f64> {
    let n = values.len();
    let width = width.clamp(1, n);
    let mut sum = Vec::with_capacity(n + 1);
    sum.push(0.0);
    sum.extend(values.iter().scan(0.0, |all, v| {
        *all += v;
        Some(*all)
    }));
    (0..n)
        .map(|i| {
            let from = i.saturating_sub(width / 2).min(n - width);
            (sum[from + width] - sum[from]) / width as f64
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::running;

    #[test]
    fn a_running_mean_follows_a_slope_inside_and_is_the_mean_of_few() {
        let slope: Vec<f64> = (0..20).map(f64::from).collect();
        let means = running(&slope, 5);
        assert_eq!((means[0], means[10], means[19]), (2.0, 10.0, 17.0));
        assert_eq!(running(&[1.0, 2.0, 6.0], 10), [3.0; 3]);
    }
}
