//! The neighbourhood of each reading: what its neighbours predict of it, without it.
//!
//! A mean over 2w neighbours, or a parabola through them where the base moves; of several widths the one that predicts
//! best is taken for the whole channel. A parabola without its centre, over |j| = 1..w, has the value at the centre
//! sum (S4 - S2 j^2) y_j / (S0 S4 - S2^2), S_k = sum j^k. The prediction errs by the noise of the reading and that of
//! its neighbours together, and `sigma` is the robust spread of just that.

use numerics::order_statistics::{TENTH, holds_most, median, robust_sigma};
use std::ops::Range;

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
#[derive(Clone, Debug, Default, PartialEq)]
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

/// Medians of each value and its neighbours within [`MEDIAN`], fewer at the ends, kept sorted as the window moves.
fn medians(values: &[f64]) -> Vec<f64> {
    let mut window = [0.0; 2 * MEDIAN + 2];
    let mut count = 0;
    let place = |window: &[f64], v: f64| {
        window
            .iter()
            .take_while(|w| w.total_cmp(&v).is_lt())
            .count()
    };
    let enter = |window: &mut [f64; 2 * MEDIAN + 2], count: &mut usize, v: f64| {
        let at = place(&window[..*count], v);
        window.copy_within(at..*count, at + 1);
        window[at] = v;
        *count += 1;
    };
    for v in values.iter().take(MEDIAN) {
        enter(&mut window, &mut count, *v);
    }
    (0..values.len())
        .map(|i| {
            if let Some(v) = values.get(i + MEDIAN) {
                enter(&mut window, &mut count, *v);
            }
            if let Some(old) = i.checked_sub(MEDIAN + 1) {
                let at = place(&window[..count], values[old]);
                window.copy_within(at + 1..count, at);
                count -= 1;
            }
            window[count / 2]
        })
        .collect()
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
    let medians = medians(&clean);
    let far: Vec<f64> = clean.iter().zip(&medians).map(|(c, m)| c - m).collect();
    let limit = 6.0 * robust_sigma(&far);
    for ((c, m), d) in clean.iter_mut().zip(&medians).zip(&far) {
        if limit > 0.0 && d.abs() > limit {
            *c = *m;
        }
    }
    clean
}

/// Cumulated sums of the readings about a level in their midst.
struct Sums {
    base: f64,
    sums: Vec<f64>,
}

impl Sums {
    fn new(clean: &[f64]) -> Self {
        let base = median(clean);
        let mut sums = Vec::with_capacity(clean.len() + 1);
        let mut sum = 0.0;
        sums.push(sum);
        sums.extend(clean.iter().map(|v| {
            sum += v - base;
            sum
        }));
        Self { base, sums }
    }
}

/// Mean of the neighbours within `half` of each reading of a part, without the reading itself.
fn means(clean: &[f64], of: &Sums, half: usize, part: Range<usize>) -> Vec<f64> {
    let n = clean.len();
    let Sums { base, sums } = of;
    let leaning = |i: usize| {
        let w = half.min(i.max(n - 1 - i)).max(1);
        let (low, high) = (i.saturating_sub(w), (i + w + 1).min(n));
        let others = (high - low - 1).max(1) as f64;
        base + (sums[high] - sums[low] - (clean[i] - base)) / others
    };
    // In the midst all neighbourhoods are whole, and nothing depends on the place.
    let midst =
        half.clamp(part.start, part.end)..n.saturating_sub(half).clamp(part.start, part.end);
    if midst.is_empty() {
        return part.map(leaning).collect();
    }
    let others = (2 * half).max(1) as f64;
    let above = &sums[midst.start + half + 1..];
    let sides = above.iter().zip(&sums[midst.start - half..]);
    let mean = |((high, low), v): ((&f64, &f64), &f64)| base + (high - low - (v - base)) / others;
    let mut level = Vec::with_capacity(part.len());
    level.extend((part.start..midst.start).map(leaning));
    level.extend(sides.zip(&clean[midst.clone()]).map(mean));
    level.extend((midst.end..part.end).map(leaning));
    level
}

fn parabolas(clean: &[f64], of: &Sums, half: usize, part: Range<usize>) -> Vec<f64> {
    let n = clean.len();
    let mut level = means(clean, of, half, part.clone());
    let w = half as f64;
    let s0 = 2.0 * w;
    let s2: f64 = (1..=half).map(|j| 2.0 * (j * j) as f64).sum();
    let s4: f64 = (1..=half).map(|j| 2.0 * (j * j * j * j) as f64).sum();
    let d = s0 * s4 - s2 * s2;
    let weights: Vec<f64> = (1..=half).map(|j| (s4 - s2 * (j * j) as f64) / d).collect();
    // Weight by weight over a stretch, so that several places are summed at once.
    const STRETCH: usize = 512;
    let midst = half.max(part.start)..n.saturating_sub(half).min(part.end);
    for from in midst.clone().step_by(STRETCH) {
        let to = (from + STRETCH).min(midst.end);
        let sums = &mut level[from - part.start..to - part.start];
        sums.fill(0.0);
        for (j, g) in (1..).zip(&weights) {
            let beside = clean[from - j..].iter().zip(&clean[from + j..]);
            (sums.iter_mut().zip(beside)).for_each(|(s, (a, b))| *s += g * (a + b));
        }
    }
    level
}

/// Readings beyond which some of them tell which neighbourhoods predict best, and one of how many they are.
const MANY: usize = 1 << 18;
const ONE_OF: usize = 8;
/// Readings that lie side by side where not all are asked.
const SIDE_BY_SIDE: usize = 1 << 12;

/// Parts of `n` readings that tell which neighbourhoods predict best: the whole, or some all over it.
fn telling(n: usize) -> Vec<Range<usize>> {
    let (every, side_by_side) = if n > MANY {
        (ONE_OF * SIDE_BY_SIDE, SIDE_BY_SIDE)
    } else {
        (n.max(1), n)
    };
    let part = |from: usize| from..(from + side_by_side).min(n);
    (0..n).step_by(every).map(part).collect()
}

/// Neighbourhoods of one width.
#[derive(Clone, Copy)]
struct Neighbours {
    half: usize,
    bent: bool,
}

impl Neighbours {
    /// In the order in which they are tried.
    fn all() -> impl Iterator<Item = Self> {
        let of = |half: &usize, bent| Self { half: *half, bent };
        let means = MEANS.iter().map(move |w| of(w, false));
        means.chain(PARABOLAS.iter().map(move |w| of(w, true)))
    }

    /// What they predict of a part.
    fn level(self, clean: &[f64], sums: &Sums, part: Range<usize>) -> Vec<f64> {
        if self.bent {
            parabolas(clean, sums, self.half, part)
        } else {
            means(clean, sums, self.half, part)
        }
    }
}

impl Local {
    /// Of a channel.
    #[must_use]
    pub fn new(y: &[f64]) -> Self {
        Self::by(y, &robust_sigma)
    }

    /// Of a channel with few codes, whose quantiles are codes: what predicts best does so by the mean square.
    #[must_use]
    pub fn by_squares(y: &[f64]) -> Self {
        const FAR: f64 = 6.0;
        Self::by(y, &|r| {
            let near = r.iter().filter(|v| v.abs() < FAR);
            let (sum, n) = near.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
            (sum / f64::max(n, 1.0)).sqrt()
        })
    }

    fn by(y: &[f64], spread: &dyn Fn(&[f64]) -> f64) -> Self {
        let clean = cleaned(y);
        let sums = Sums::new(&clean);
        let of = |neighbours: Neighbours, parts: &[Range<usize>]| {
            let Neighbours { half, bent } = neighbours;
            let (mut level, mut residual) = (vec![], vec![]);
            for part in parts {
                let there = neighbours.level(&clean, &sums, part.clone());
                residual.extend(y[part.clone()].iter().zip(&there).map(|(y, l)| y - l));
                level.extend(there);
            }
            let sigma = spread(&residual);
            let edge = if half <= NARROW { half } else { 0 };
            Self {
                level,
                residual,
                sigma,
                bent,
                edge,
            }
        };
        let parts = telling(y.len());
        let mut best: Option<(Neighbours, Self)> = None;
        for neighbours in Neighbours::all() {
            let told = of(neighbours, &parts);
            if (best.as_ref()).is_none_or(|(_, b)| told.sigma < BETTER * b.sigma) {
                best = Some((neighbours, told));
            }
        }
        match best {
            Some((_, told)) if told.level.len() == y.len() => told,
            Some((neighbours, _)) => of(neighbours, std::slice::from_ref(&(0..y.len()))),
            None => Self::default(),
        }
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
        // Where no more lies beyond it than beyond the points of the spread, the spread is clearly no more.
        let near = (1.0 - 1e-9) * CLEARLY * self.sigma * TENTH;
        while at < n {
            let end = (at + step).min(n);
            let (low, high) = (
                (at + step / 2).saturating_sub(SPREAD / 2),
                (at + step / 2 + SPREAD / 2).min(n),
            );
            let there = &self.residual[low..high];
            if !holds_most(there, near) {
                let s = robust_sigma(there);
                if s > CLEARLY * self.sigma {
                    spread[at..end].fill(s);
                }
            }
            at = end;
        }
        spread
    }
}

/// Levels that readings are predicted at, with how many each stands for: what is asked of the level alone, and changes
/// little over a count, need not be asked of every reading.
pub struct Levels(Vec<(f64, f64)>);

/// Levels that a count is divided into. A sum over readings of f(level) errs by f''/12 of the square of that.
const BY_COUNT: f64 = 256.0;

impl Levels {
    /// Of the readings of which `known` holds, in counts; each between two levels in proportion.
    #[must_use]
    pub fn new(level: &[f64], known: &[bool]) -> Self {
        let own = || {
            level
                .iter()
                .zip(known)
                .filter(|(_, k)| **k)
                .map(|(l, _)| *l)
        };
        let (low, high) = own().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), l| {
            (a.min(l), b.max(l))
        });
        let places = (high - low) * BY_COUNT;
        if !(places >= 0.0 && places < 0.25 * level.len() as f64) {
            return Self(own().map(|l| (l, 1.0)).collect());
        }
        let mut weights = vec![0.0; places as usize + 2];
        for l in own() {
            let x = (l - low) * BY_COUNT;
            let (at, share) = (x as usize, x.fract());
            weights[at] += 1.0 - share;
            weights[at + 1] += share;
        }
        let at = |i: usize| low + i as f64 / BY_COUNT;
        let used = weights.iter().enumerate().filter(|(_, w)| **w > 0.0);
        Self(used.map(|(i, w)| (at(i), *w)).collect())
    }

    /// Each level with its number of readings.
    pub fn iter(&self) -> impl Iterator<Item = (f64, f64)> {
        self.0.iter().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moving_median_is_the_median_of_each_window() {
        let y: Vec<f64> = (0..200).map(|i| f64::from((i * 37) % 23)).collect();
        for (i, m) in medians(&y).into_iter().enumerate() {
            let around = &y[i.saturating_sub(MEDIAN)..(i + MEDIAN + 1).min(y.len())];
            assert_eq!(m, median(around), "{i}");
        }
        assert_eq!(medians(&y[..3]), [37.0 % 23.0; 3].map(|_| median(&y[..3])));
    }

    #[test]
    fn levels_stand_for_their_readings() {
        let level: Vec<f64> = (0..5000)
            .map(|i| 3.0 + (f64::from(i) * 0.01).sin())
            .collect();
        let mut known = vec![true; 5000];
        known[7] = false;
        let levels = Levels::new(&level, &known);
        assert!(levels.iter().count() < 1000);
        let own = level.iter().enumerate().filter(|(i, _)| *i != 7);
        let direct: f64 = own.map(|(_, l)| l.cos()).sum();
        let binned: f64 = levels.iter().map(|(l, w)| w * l.cos()).sum();
        assert!((direct - binned).abs() < 0.02, "{direct} {binned}");
    }

    #[test]
    fn a_parabola_is_predicted_exactly() {
        let y: Vec<f64> = (0..100)
            .map(|i| 0.01 * f64::from(i * i) - f64::from(i))
            .collect();
        for half in [5, 10] {
            let level = parabolas(&y, &Sums::new(&y), half, 0..y.len());
            assert!((10..90).all(|i| (level[i] - y[i]).abs() < 1e-9));
        }
    }

    #[test]
    fn an_eighth_of_a_long_channel_chooses_neighbourhoods_that_predict_as_well_as_any() {
        let n = MANY + 12_345;
        // White noise about a wave of four lengths: each is followed best by other neighbourhoods.
        for length in [40.0, 150.0, 600.0, 1e5] {
            let mut state = 5u32;
            let y: Vec<f64> = (0..n)
                .map(|i| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    f64::from(state >> 8) / f64::from(1u32 << 24) + (i as f64 / length).sin()
                })
                .collect();
            let sums = Sums::new(&y);
            let least = Neighbours::all()
                .map(|n| {
                    let level = n.level(&y, &sums, 0..y.len());
                    let residual = y.iter().zip(&level).map(|(y, l)| y - l);
                    robust_sigma(&residual.collect::<Vec<f64>>())
                })
                .fold(f64::INFINITY, f64::min);
            let local = Local::new(&y);
            assert_eq!(local.level.len(), n);
            assert!(
                local.sigma < 1.01 * least,
                "{length}: {} {least}",
                local.sigma
            );
        }
    }

    #[test]
    fn a_reading_does_not_predict_itself() {
        let mut y = vec![0.0; 100];
        y[50] = 1.0;
        assert!(means(&y, &Sums::new(&y), 20, 0..y.len())[50].abs() < 1e-12);
        assert!(parabolas(&y, &Sums::new(&y), 10, 0..y.len())[50].abs() < 1e-12);
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
