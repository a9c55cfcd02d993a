//! The host's clock against the device's: one rate, a jump, a change of the rate, or none of these.
//!
//! A message can be late, not early, so the earliest arrival of each block of the record is taken: y, the host's time less
//! the device's. One line describes it where both clocks are sound. Against that stands a line on either side of a
//! break, wherever it fits best; slopes are medians of those between all pairs (Theil and Sen), which blocks that the host
//! slept through do not bend. Lines that meet at the break are a change of the rate; lines that do not, a jump.
//! What neither describes wanders.

use numerics::order_statistics::median;

/// Blocks in which the earliest arrival is taken.
pub(super) const BLOCKS: usize = 32;
/// Fewest blocks on either side of a break.
const SIDE: usize = 3;
/// Square of the standard errors beyond which a block counts no more: a block may be late as a whole.
const FAR: f64 = 25.0;
/// By how much of such squares a break has to describe the blocks better: that of two blocks that are late as a whole,
/// and ten for its place.
const BETTER: f64 = 60.0;
/// Mean square up to which lines describe the blocks: the earliest of many arrivals scatters to one side alone, so its
/// square is 2 of those of its median size.
const DESCRIBES: f64 = 8.0;
/// Standard errors that two slopes differ by.
const DIFFER: f64 = 6.0;
/// Passes in search of the break.
const PASSES: usize = 3;
/// Resolution of host times, s.
const RESOLUTION_S: f64 = 1e-6;
/// A jump of 1 in the middle of a record of length 1 tilts its line by 1.5.
const TILT_OF_JUMP: f64 = 1.5;
/// Tilt of a part of a line that bends away from it by 1 at most, ends against the middle, over its length.
const TILT_OF_BEND: f64 = 4.0;

/// How the clocks part, other than by one rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Uneven {
    Jump,
    Bend,
    Wanders,
}

/// The host's time as a function of the device's.
#[derive(Clone, Debug)]
pub(super) struct Course {
    /// Seconds that the host's clock gains in one of the device's.
    pub slope: f64,
    pub error: f64,
    /// What it does beside that, and told in words.
    pub uneven: Option<(Uneven, String)>,
    /// What a jump or a change of the rate would make of the rate, over the stated tolerance; 0 where there is none.
    pub told: f64,
}

/// A line through blocks, robust.
#[derive(Clone, Copy, Debug)]
struct Line {
    level: f64,
    slope: f64,
    /// Sum of squares of x about its mean.
    sxx: f64,
}

impl Line {
    fn through(x: &[f64], y: &[f64]) -> Self {
        let mut slopes = vec![];
        for i in 0..x.len() {
            slopes.extend((0..i).map(|j| (y[i] - y[j]) / (x[i] - x[j])));
        }
        let slope = median(&slopes);
        let levels: Vec<f64> = x.iter().zip(y).map(|(x, y)| y - slope * x).collect();
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        Self {
            level: median(&levels),
            slope,
            sxx: x.iter().map(|v| (v - mean).powi(2)).sum(),
        }
    }

    fn at(&self, x: f64) -> f64 {
        self.level + self.slope * x
    }

    fn residuals(&self, x: &[f64], y: &[f64]) -> Vec<f64> {
        x.iter().zip(y).map(|(x, y)| y - self.at(*x)).collect()
    }

    /// Standard error of the slope, where a block scatters by `s`.
    fn error(&self, s: f64) -> f64 {
        // The efficiency of a median of slopes is 0.91 for normal errors.
        1.05 * s / self.sxx.sqrt()
    }
}

fn cost(residuals: &[f64], s: f64) -> f64 {
    residuals.iter().map(|r| (r / s).powi(2).min(FAR)).sum()
}

fn robust(residuals: &[f64]) -> f64 {
    let sizes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
    (1.4826 * median(&sizes)).max(RESOLUTION_S)
}

/// Course of `host` against `device`, s, of a clock that is right to `tolerance`; `None` where there are too few times.
pub(super) fn of(device: &[f64], host: &[f64], tolerance: f64) -> Option<Course> {
    let pairs: Vec<(f64, f64)> = (device.iter().zip(host))
        .filter(|(_, h)| h.is_finite())
        .map(|(d, h)| (*d, h - d))
        .collect();
    if pairs.len() < 4 * BLOCKS {
        return None;
    }
    let size = pairs.len().div_ceil(BLOCKS);
    let blocks: Vec<&[(f64, f64)]> = pairs.chunks(size).collect();
    let rough = rough_slope(&blocks);
    let (x, y) = earliest(&blocks, rough);
    let (slope, error) = line_of(&x, &y);
    if !(slope.is_finite() && error.is_finite()) {
        return None;
    }
    let mut course = Course {
        slope,
        error,
        uneven: None,
        told: 0.0,
    };
    let length = x.last()? - x.first()?;
    let first = (x, y);
    let mut found = broken(&first, &first)?;
    // Across a slope the earliest of a block is its first or last, so again with the slopes of the sides.
    for _ in 0..PASSES {
        let seen = |slope: f64| earliest(&blocks, slope);
        found = broken(&seen(found.before.slope), &seen(found.after.slope))?;
    }
    let (x, y) = (&found.x, &found.y);
    let whole = Line::through(x, y).residuals(x, y);
    let s = robust(&found.rest).min(robust(&whole));
    let (one, two) = (cost(&whole, s), cost(&found.rest, s));
    let n = x.len() as f64;
    if one < two + BETTER || two > DESCRIBES * n {
        if one > DESCRIBES * n {
            let sizes: Vec<f64> = whole.iter().map(|r| r.abs()).collect();
            let far = numerics::order_statistics::quantile(&sizes, 0.9);
            course.wander(far, length, tolerance);
        }
        return Some(course);
    }
    course.part(&found, s, length, tolerance, &pairs);
    Some(course)
}

impl Course {
    /// The clocks part by `far`, and by no line or two: what the line is off by may tilt it.
    fn wander(&mut self, far: f64, length: f64, tolerance: f64) {
        let tilt = TILT_OF_BEND * far / length;
        self.error = self.error.hypot(tilt);
        if tilt > tolerance {
            let what = format!(
                "host and device clock part by {:.1} ms about the line through them, and by neither one jump nor one change of the rate: only a rate beyond {:.0} ppm would show",
                1e3 * far,
                1e6 * (tolerance + 4.0 * self.error)
            );
            self.uneven = Some((Uneven::Wanders, what));
        }
    }

    /// The clocks part at a break, where blocks scatter by `s`: by a change of the rate, or a jump.
    fn part(&mut self, found: &Broken, s: f64, length: f64, tolerance: f64, pairs: &[(f64, f64)]) {
        let Broken {
            k,
            x,
            before,
            after,
            ..
        } = found;
        let (from, to) = (x[k.saturating_sub(3)], x[(k + 2).min(x.len() - 1)]);
        let differ = after.slope - before.slope;
        let errors = [before.error(s), after.error(s)];
        let meet = (before.level - after.level) / differ;
        let other = differ.abs() > tolerance && differ.abs() > DIFFER * errors[0].hypot(errors[1]);
        let middle = 0.5 * (x[k - 1] + x[*k]);
        let height = after.at(middle) - before.at(middle);
        let jump = TILT_OF_JUMP * height.abs() / length / tolerance;
        if other && (jump < 1.0 || (from..=to).contains(&meet)) {
            let ppm = |line: &Line| (1.0 / (1.0 + line.slope) - 1.0) * 1e6;
            self.told = differ.abs() / tolerance;
            let what = format!(
                "the device clock changes its rate against the host's at {meet:.1} s: {:+.1} +- {:.1} ppm before, {:+.1} +- {:.1} ppm after; {:.0} ppm are stated, and no one rate describes it",
                ppm(before),
                1e6 * errors[0],
                ppm(after),
                1e6 * errors[1],
                1e6 * tolerance
            );
            self.uneven = Some((Uneven::Bend, what));
            return;
        }
        // The common slope of both sides.
        let of_slope = errors.map(|e| e.powi(-2));
        self.slope =
            (of_slope[0] * before.slope + of_slope[1] * after.slope) / (of_slope[0] + of_slope[1]);
        self.error =
            (of_slope[0] + of_slope[1])
                .powf(-0.5)
                .hypot(if other { 0.5 * differ } else { 0.0 });
        self.told = jump;
        if self.told > 1.0 {
            let at = place(pairs, from, to, before, after);
            let also = if other {
                format!("; its rate changes there too, by {:+.0} ppm", 1e6 * differ)
            } else {
                String::new()
            };
            let what = format!(
                "the host's clock jumps by {height:+.3} s against the device's at {at:.2} s{also}: a clock that was set, a computer that slept, or a board that stood still without losing a number"
            );
            self.uneven = Some((Uneven::Jump, what));
        }
    }
}

/// Where the arrivals pass from one line to the other: late ones lie above the first, none below the second.
fn place(pairs: &[(f64, f64)], from: f64, to: f64, before: &Line, after: &Line) -> f64 {
    let own: Vec<&(f64, f64)> = (pairs.iter())
        .filter(|p| (from..=to).contains(&p.0))
        .collect();
    let middle = |d: f64| 0.5 * (before.at(d) + after.at(d));
    let up = after.at(to) > before.at(to);
    let found = if up {
        let last = own.iter().rposition(|(d, y)| *y < middle(*d));
        last.map_or(0, |i| i + 1)
    } else {
        let first = own.iter().position(|(d, y)| *y < middle(*d));
        first.unwrap_or(0)
    };
    own.get(found.min(own.len().saturating_sub(1)))
        .map_or(from, |p| p.0)
}

/// Two lines through the blocks.
struct Broken {
    /// Blocks before the break.
    k: usize,
    x: Vec<f64>,
    y: Vec<f64>,
    before: Line,
    after: Line,
    /// Residuals.
    rest: Vec<f64>,
}

/// The break that leaves least, of blocks as they are seen from before it and from after it.
fn broken(left: &(Vec<f64>, Vec<f64>), right: &(Vec<f64>, Vec<f64>)) -> Option<Broken> {
    let all: Vec<Broken> = (SIDE..=left.0.len().checked_sub(SIDE)?)
        .map(|k| {
            let x = [&left.0[..k], &right.0[k..]].concat();
            let y = [&left.1[..k], &right.1[k..]].concat();
            let (before, after) = (
                Line::through(&x[..k], &y[..k]),
                Line::through(&x[k..], &y[k..]),
            );
            let mut rest = before.residuals(&x[..k], &y[..k]);
            rest.extend(after.residuals(&x[k..], &y[k..]));
            Broken {
                k,
                x,
                y,
                before,
                after,
                rest,
            }
        })
        .collect();
    let s = all
        .iter()
        .map(|b| robust(&b.rest))
        .fold(f64::INFINITY, f64::min);
    all.into_iter()
        .min_by(|a, b| cost(&a.rest, s).total_cmp(&cost(&b.rest, s)))
}

/// Slope from block to block, which a jump does not tilt.
fn rough_slope(blocks: &[&[(f64, f64)]]) -> f64 {
    let middles: Vec<(f64, f64)> = (blocks.iter())
        .map(|p| {
            let of =
                |which: fn(&(f64, f64)) -> f64| median(&p.iter().map(which).collect::<Vec<_>>());
            (of(|v| v.0), of(|v| v.1))
        })
        .collect();
    let slopes: Vec<f64> = middles
        .windows(2)
        .map(|w| (w[1].1 - w[0].1) / (w[1].0 - w[0].0))
        .collect();
    median(&slopes)
}

/// Earliest arrival of each block, seen along a slope: device time, and how much later the host's is.
fn earliest(blocks: &[&[(f64, f64)]], slope: f64) -> (Vec<f64>, Vec<f64>) {
    let later = |v: &(f64, f64)| v.1 - slope * v.0;
    let early = |p: &&[(f64, f64)]| {
        let all = p.iter().copied();
        all.min_by(|a, b| later(a).total_cmp(&later(b)))
    };
    blocks.iter().filter_map(early).unzip()
}

/// Least squares line: slope and its standard error.
fn slope(x: &[f64], y: &[f64]) -> (f64, f64) {
    let n = x.len() as f64;
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let sxx: f64 = x.iter().map(|v| (v - mx).powi(2)).sum();
    let sxy: f64 = x.iter().zip(y).map(|(a, b)| (a - mx) * (b - my)).sum();
    let b = sxy / sxx;
    let rss: f64 = x
        .iter()
        .zip(y)
        .map(|(a, v)| (v - my - b * (a - mx)).powi(2))
        .sum();
    (b, (rss / (n - 2.0).max(1.0) / sxx).sqrt())
}

/// Slope of the one line, and its standard error.
fn line_of(x: &[f64], y: &[f64]) -> (f64, f64) {
    let (mut x, mut y) = (x.to_vec(), y.to_vec());
    let mut fit = slope(&x, &y);
    // Blocks that the host slept through.
    for _ in 0..3 {
        let level = median(
            &y.iter()
                .zip(&x)
                .map(|(v, t)| v - fit.0 * t)
                .collect::<Vec<_>>(),
        );
        let r: Vec<f64> = y
            .iter()
            .zip(&x)
            .map(|(v, t)| v - fit.0 * t - level)
            .collect();
        let spread = median(&r.iter().map(|v| v.abs()).collect::<Vec<_>>()) * 1.4826;
        let keep: Vec<bool> = r.iter().map(|v| v.abs() <= 5.0 * spread + 1e-9).collect();
        if keep.iter().all(|k| *k) || keep.iter().filter(|k| **k).count() < BLOCKS / 2 {
            break;
        }
        let mut k = keep.iter();
        x.retain(|_| k.next() == Some(&true));
        let mut k = keep.iter();
        y.retain(|_| k.next() == Some(&true));
        fit = slope(&x, &y);
    }
    fit
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, Exp, Uniform};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    /// Host times of a device that samples at 20 Hz, gained by what `gains` says, messages late by milliseconds.
    fn host(device: &[f64], seed: u64, gains: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let late = Exp::new(1.0 / 0.003).unwrap();
        let mut one = |d: &f64| d + gains(*d) + 0.001 + late.sample(&mut rng);
        device.iter().map(&mut one).collect()
    }

    fn device() -> Vec<f64> {
        (0..12_000).map(|i| f64::from(i) * 0.05).collect()
    }

    fn drawn(seed: u64, low: f64, high: f64) -> f64 {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        Uniform::new(low, high).unwrap().sample(&mut rng)
    }

    /// The number that follows `word`.
    fn told(what: &str, word: &str) -> f64 {
        let rest = what.split(word).nth(1).unwrap();
        rest.split(' ').next().unwrap().parse().unwrap()
    }

    #[test]
    fn a_jump_is_a_jump_and_the_rate_beside_it_is_right() {
        for seed in 0..20 {
            let (at, ppm) = (drawn(seed, 60.0, 540.0), drawn(seed + 100, -40.0, 40.0));
            let sign = if seed % 2 == 0 { 1.0 } else { -1.0 };
            let height = sign * drawn(seed + 200, 0.05, 3.0);
            let d = device();
            let h = host(&d, seed, |t| {
                t * ppm * 1e-6 + if t >= at { height } else { 0.0 }
            });
            let course = of(&d, &h, 50e-6).unwrap();
            let (kind, what) = course.uneven.clone().expect("it jumps");
            assert_eq!(kind, Uneven::Jump, "{what}");
            let told = told(&what, " by ");
            assert!((told - height).abs() < 0.01, "{height} at {at}: {what}");
            assert!((course.slope * 1e6 - ppm).abs() < 5.0, "{ppm}: {course:?}");
        }
    }

    #[test]
    fn a_rate_that_changes_is_two_rates() {
        for seed in 0..20 {
            let (at, ppm) = (drawn(seed, 100.0, 500.0), drawn(seed + 100, -40.0, 40.0));
            let sign = if seed % 2 == 0 { 1.0 } else { -1.0 };
            let more = sign * drawn(seed + 200, 100.0, 800.0);
            let d = device();
            let h = host(&d, seed, |t| 1e-6 * (t * ppm + (t - at).max(0.0) * more));
            let course = of(&d, &h, 50e-6).unwrap();
            let (kind, what) = course.uneven.expect("it changes");
            assert_eq!(kind, Uneven::Bend, "{at} {more}: {what}");
            let told = told(&what, " at ");
            assert!((told - at).abs() < 10.0, "{at}: {what}");
        }
    }

    #[test]
    fn one_rate_is_one_rate_however_late_the_messages_are() {
        for seed in 0..40 {
            let ppm = drawn(seed + 100, -300.0, 300.0);
            let asleep = drawn(seed, 30.0, 570.0);
            let d = device();
            // The host sleeps once for a while and takes all that came at its end.
            let h: Vec<f64> = host(&d, seed, |t| 1e-6 * t * ppm)
                .into_iter()
                .map(|h| {
                    if (asleep..asleep + 25.0).contains(&h) {
                        asleep + 25.0
                    } else {
                        h
                    }
                })
                .collect();
            let course = of(&d, &h, 50e-6).unwrap();
            assert!(course.uneven.is_none(), "{course:?}");
            assert!(
                (course.slope * 1e6 - ppm).abs() < 5.0 * course.error * 1e6 + 0.1,
                "{ppm} {course:?}"
            );
        }
    }

    #[test]
    fn late_messages_do_not_tilt_the_clock() {
        // 100 ppm fast, delays of 1 ms to 0.5 s by turns, longer at the end.
        let device: Vec<f64> = (0..12_000).map(|i| f64::from(i) * 0.05).collect();
        let host: Vec<f64> = device
            .iter()
            .enumerate()
            .map(|(i, d)| {
                let turn = (i * 7919 % 101) as f64 / 101.0;
                d / (1.0 + 100e-6) + 0.001 + turn * (0.01 + 0.5 * d / 600.0)
            })
            .collect();
        let Course {
            slope: gained,
            error,
            ..
        } = of(&device, &host, 50e-6).unwrap();
        let ppm = (1.0 / (1.0 + gained) - 1.0) * 1e6;
        assert!(
            (ppm - 100.0).abs() < 5.0 + 4.0 * error * 1e6,
            "{ppm} +- {}",
            error * 1e6
        );
    }
}
