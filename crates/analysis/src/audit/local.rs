//! The neighbourhood of each reading: what its neighbours predict of it, without it.
//!
//! A mean over 2w neighbours, or a parabola through them where the base moves; of several widths the one that predicts
//! best is taken for the whole channel. A parabola without its centre, over |j| = 1..w, has the value at the centre
//! sum (S4 - S2 j^2) y_j / (S0 S4 - S2^2), S_k = sum j^k. The prediction errs by the noise of the reading and that of
//! its neighbours together, and `sigma` is the robust spread of just that.

/// Half widths of the means, in samples, widest first: where the level stands still, the noise of a narrow mean would
/// be counted twice, in the level and in the spread about it.
const MEANS: &[usize] = &[400, 100, 40, 20, 10];
/// Half width up to which a neighbourhood is narrow.
const NARROW: usize = 20;
/// Half widths of the parabolas.
const PARABOLAS: &[usize] = &[10, 5];
/// Half width of the median that keeps spikes out of the neighbourhoods.
const MEDIAN: usize = 5;
/// Share by which a narrower or more bent neighbourhood has to predict better.
const BETTER: f64 = 0.995;
/// Width of the neighbourhood of the spread, in samples.
const SPREAD: usize = 400;

/// More than the spread of that many readings scatters by itself: 4.5 % standard error, so 3.3 of them.
const CLEARLY: f64 = 1.15;

/// Predictions of one channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Local {
    /// What the neighbours predict.
    pub level: Vec<f64>,
    /// Reading minus prediction; NaN where there is no reading.
    pub residual: Vec<f64>,
    /// Robust standard deviation of the residuals.
    pub sigma: f64,
    /// Whether parabolas predict best: the base moves, and the prediction errs by the motion as well.
    pub bent: bool,
    /// Readings at either end whose prediction leans on one side alone, where the neighbourhood is narrow because the
    /// level moves.
    pub edge: usize,
}

/// Half the width between the 10 % and 90 % points over that of the standard normal.
#[must_use]
pub fn robust_sigma(values: &[f64]) -> f64 {
    width(values, 0.1) / (2.0 * 1.281_552)
}

/// Width between the `share` and `1 - share` points of the finite values; 0 of none.
#[must_use]
pub fn width(values: &[f64], share: f64) -> f64 {
    let mut v: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    if v.is_empty() {
        return 0.0;
    }
    let last = v.len() - 1;
    let mut at = |p: f64| {
        *v.select_nth_unstable_by((p * last as f64).round() as usize, f64::total_cmp)
            .1
    };
    at(1.0 - share) - at(share)
}

/// Median of the finite values; NaN of none.
#[must_use]
pub fn median(values: &[f64]) -> f64 {
    let mut v: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    if v.is_empty() {
        return f64::NAN;
    }
    let middle = v.len() / 2;
    *v.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Lost readings take the last one before them, spikes the median around them.
fn cleaned(y: &[f64]) -> Vec<f64> {
    let mut held = y.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
    let mut clean: Vec<f64> = y
        .iter()
        .map(|v| {
            if v.is_finite() {
                held = *v;
            }
            held
        })
        .collect();
    let medians: Vec<f64> = (0..clean.len())
        .map(|i| {
            let around = &clean[i.saturating_sub(MEDIAN)..(i + MEDIAN + 1).min(clean.len())];
            median(around)
        })
        .collect();
    let far: Vec<f64> = clean.iter().zip(&medians).map(|(c, m)| c - m).collect();
    let limit = 6.0 * robust_sigma(&far);
    for ((c, m), d) in clean.iter_mut().zip(&medians).zip(&far) {
        if limit > 0.0 && d.abs() > limit {
            *c = *m;
        }
    }
    clean
}

/// Mean of the neighbours within `half`, without the reading itself.
fn means(clean: &[f64], half: usize) -> Vec<f64> {
    let n = clean.len();
    let base = median(clean);
    let mut sums = vec![0.0; n + 1];
    for (i, v) in clean.iter().enumerate() {
        sums[i + 1] = sums[i] + v - base;
    }
    (0..n)
        .map(|i| {
            let w = half.min(i.max(n - 1 - i)).max(1);
            let (low, high) = (i.saturating_sub(w), (i + w + 1).min(n));
            let others = (high - low - 1).max(1) as f64;
            base + (sums[high] - sums[low] - (clean[i] - base)) / others
        })
        .collect()
}

fn parabolas(clean: &[f64], half: usize) -> Vec<f64> {
    let n = clean.len();
    let mut level = means(clean, half);
    let w = half as f64;
    let s0 = 2.0 * w;
    let s2: f64 = (1..=half).map(|j| 2.0 * (j * j) as f64).sum();
    let s4: f64 = (1..=half).map(|j| 2.0 * (j * j * j * j) as f64).sum();
    let d = s0 * s4 - s2 * s2;
    let weights: Vec<f64> = (1..=half).map(|j| (s4 - s2 * (j * j) as f64) / d).collect();
    for i in half..n.saturating_sub(half) {
        level[i] = weights
            .iter()
            .enumerate()
            .map(|(j, g)| g * (clean[i - j - 1] + clean[i + j + 1]))
            .sum();
    }
    level
}

impl Local {
    /// Of a channel.
    #[must_use]
    pub fn new(y: &[f64]) -> Self {
        let clean = cleaned(y);
        let of = |level: Vec<f64>| {
            let residual: Vec<f64> = y.iter().zip(&level).map(|(y, l)| y - l).collect();
            let sigma = robust_sigma(&residual);
            Self {
                level,
                residual,
                sigma,
                bent: false,
                edge: 0,
            }
        };
        let all = MEANS
            .iter()
            .map(|w| (*w, false))
            .chain(PARABOLAS.iter().map(|w| (*w, true)));
        let mut best: Option<Self> = None;
        for (half, bent) in all {
            let mut next = of(if bent {
                parabolas(&clean, half)
            } else {
                means(&clean, half)
            });
            next.bent = bent;
            next.edge = if half <= NARROW { half } else { 0 };
            if best.as_ref().is_none_or(|b| next.sigma < BETTER * b.sigma) {
                best = Some(next);
            }
        }
        best.unwrap_or_else(|| of(clean))
    }

    /// Standard deviation of the readings before they were rounded to whole counts.
    #[must_use]
    pub fn unrounded_sigma(&self) -> f64 {
        (self.sigma * self.sigma - 1.0 / 12.0).max(1e-4).sqrt()
    }

    /// The spread around each reading where it is clearly more than that of the whole channel, else that.
    #[must_use]
    pub fn spread(&self) -> Vec<f64> {
        let n = self.residual.len();
        let mut spread = vec![self.sigma; n];
        let mut at = 0;
        let step = SPREAD / 4;
        while at < n {
            let end = (at + step).min(n);
            let (low, high) = (
                (at + step / 2).saturating_sub(SPREAD / 2),
                (at + step / 2 + SPREAD / 2).min(n),
            );
            let s = robust_sigma(&self.residual[low..high]);
            if s > CLEARLY * self.sigma {
                spread[at..end].fill(s);
            }
            at = end;
        }
        spread
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_predicted_exactly() {
        let y: Vec<f64> = (0..100)
            .map(|i| 0.01 * f64::from(i * i) - f64::from(i))
            .collect();
        for half in [5, 10] {
            let level = parabolas(&y, half);
            assert!((10..90).all(|i| (level[i] - y[i]).abs() < 1e-9));
        }
    }

    #[test]
    fn a_reading_does_not_predict_itself() {
        let mut y = vec![0.0; 100];
        y[50] = 1.0;
        assert!(means(&y, 20)[50].abs() < 1e-12);
        assert!(parabolas(&y, 10)[50].abs() < 1e-12);
    }

    #[test]
    fn short_empty_and_lost_channels_are_no_trouble() {
        for y in [
            vec![],
            vec![1.0],
            vec![f64::NAN; 5],
            vec![f64::NAN, 1.0, 2.0],
        ] {
            assert_eq!(Local::new(&y).level.len(), y.len());
        }
    }
}
