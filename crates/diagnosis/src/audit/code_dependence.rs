//! Codes that know of other codes: low bits that are kept, sent as differences in few sizes, or left over from another axis.
//!
//! Of a reading x and a later one, or one of another axis, y, let y be normal with the spread s when x is known. Then
//! E exp(i (a x + b y)) = 0, but for exp(-(b s)^2 / 2), whatever x is, and so for x: where b s or a s is large enough, two
//! codes have nothing in common that is as fine as that. What follows the other one more coarsely, as filters, walks and
//! motion do, shows at low a and b alone. So it is of the sum of two others and a third, whose parity a packer may keep. The sums over a record at a, b = 2 pi k / [`CODES`] are one Fourier transform of how
//! often which two residues come together. A latch that keeps bits, differences with a set of sizes, a word torn between
//! two readings and bits that stayed in a shift register show there, without any of them being known.

use model::effects;
use std::f64::consts::PI;

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use super::rounding::in_steps;
use super::{Audit, Gyro, LEAST_READINGS};
use crate::test_level::{CheckId, MOST, RECORD, audit_level};
use numerics::tails;

/// Residues of a code that are told apart.
const CODES: usize = 32;
/// b s from which on nothing is left: exp(-8) of all readings.
const NOTHING_LEFT: f64 = 4.0;
/// Frames between two readings of one axis that are held against each other.
const LAGS: [usize; 2] = [1, 2];
/// Residuals beyond this many of their spreads are no noise.
const FAR: f64 = 5.0;

/// Codes of an axis, and what their neighbours leave of them.
struct Codes<'a> {
    name: &'a str,
    codes: Vec<usize>,
    /// Residuals, steps; NaN where there is none or it is far.
    residual: Vec<f64>,
    usable: Vec<bool>,
    /// Whether readings that come again were told: equal codes say nothing.
    repeats: bool,
}

impl<'a> Codes<'a> {
    fn of(g: &'a Gyro<'_>, audit: &Audit) -> Option<Self> {
        let name = g.channel.name.as_str();
        // What these do to a code depends on the level, and that is the same next time.
        if audit.found(
            &[
                effects::coarse_lsb::ID,
                effects::double_rounding::ID,
                effects::stuck_bit::ID,
                effects::saturation::ID,
            ],
            name,
        ) {
            return None;
        }
        let (steps, step) = in_steps(g)?;
        let of_a_code = if g.counts.is_some() { 1.0 } else { step };
        let far = FAR * g.local.sigma.max(of_a_code);
        let near = |r: &f64| {
            if r.abs() < far {
                r / of_a_code
            } else {
                f64::NAN
            }
        };
        let usable = audit.usable.get(name)?.iter();
        Some(Self {
            name,
            codes: (steps.iter())
                .map(|v| (v.round() as i64).rem_euclid(CODES as i64) as usize)
                .collect(),
            residual: g.local.residual.iter().map(near).collect(),
            usable: usable
                .zip(&steps)
                .map(|(u, v)| *u && v.is_finite())
                .collect(),
            repeats: audit.found(&[effects::stale_samples::ID], name),
        })
    }
}

impl<'a> Codes<'a> {
    /// The sums with those of another axis.
    fn with(&self, other: &Self) -> Self {
        let pairs = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + b).collect();
        let usable = self.usable.iter().zip(&other.usable);
        let codes = self.codes.iter().zip(&other.codes);
        Self {
            name: self.name,
            codes: codes.map(|(a, b)| (a + b) % CODES).collect(),
            residual: pairs(&self.residual, &other.residual),
            usable: usable.map(|(a, b)| *a && *b).collect(),
            repeats: false,
        }
    }
}

/// What two readings have in common.
struct Common {
    statistic: f64,
    chance: f64,
    /// Periods of the two codes at which most of it lies, counts.
    periods: [f64; 2],
}

/// Parts of a record that may be quieter than others, and fewest readings of one: its spread is known to 4 %.
const PARTS: usize = 20;
const LEAST_PART: usize = 300;
/// Part of the whole spread below which a part of the record is quieter.
const QUIETER: f64 = 0.8;

/// Squares of two residuals, their product, and how many there are.
type Squares = [f64; 4];

/// The spreads of each of two residuals when the other one is known.
fn spreads([xx, yy, xy, n]: &Squares) -> [f64; 2] {
    let rest = (1.0 - xy * xy / (xx * yy)).max(0.0);
    [xx, yy].map(|s| (rest * s / n - 1.0 / 12.0).max(0.0).sqrt())
}

/// Of parts of a record the whole, or the quietest where that is quieter: of two noises the smaller one leaves more of a code.
fn quietest(parts: Vec<Squares>) -> Squares {
    let mut whole = [0.0; 4];
    for part in &parts {
        whole.iter_mut().zip(part).for_each(|(sum, v)| *sum += v);
    }
    let mean = |of: &Squares| (of[0] + of[1]) / of[3];
    let full = parts
        .into_iter()
        .filter(|p| p[3] >= 0.5 * LEAST_PART as f64);
    let least = full.min_by(|a, b| mean(a).total_cmp(&mean(b)));
    let quieter = least.filter(|p| mean(p) < QUIETER * QUIETER * mean(&whole));
    quieter.unwrap_or(whole)
}

/// How often which residues come together, and the spreads of the one when the other is known.
struct Table {
    times: Vec<f64>,
    spreads: [f64; 2],
}

impl Table {
    /// Of readings, and those `lag` rows later.
    fn new(first: &Codes<'_>, second: &Codes<'_>, lag: usize) -> Self {
        let mut times = vec![0.0; CODES * CODES];
        let count = first.codes.len().min(MOST);
        let part = (count / PARTS).max(LEAST_PART);
        let mut sums = vec![[0.0; 4]; count / part + 1];
        for i in lag..count {
            let j = i - lag;
            if !(first.usable[j] && second.usable[i]) {
                continue;
            }
            times[first.codes[j] * CODES + second.codes[i]] += 1.0;
            let (x, y) = (first.residual[j], second.residual[i]);
            if x.is_finite() && y.is_finite() {
                let own = [x * x, y * y, x * y, 1.0];
                let all = sums[i / part].iter_mut().zip(own);
                all.for_each(|(sum, v)| *sum += v);
            }
        }
        Self {
            times,
            spreads: spreads(&quietest(sums)),
        }
    }

    /// Fourier sums over all pairs of residues.
    fn sums(&self, fft: &dyn Fft<f64>) -> Vec<Complex<f64>> {
        let mut rows: Vec<Complex<f64>> = self.times.iter().map(|t| Complex::from(*t)).collect();
        fft.process(&mut rows);
        let mut turned = rows.clone();
        for (i, v) in rows.iter().enumerate() {
            turned[i % CODES * CODES + i / CODES] = *v;
        }
        fft.process(&mut turned);
        // Row: turns of the second; column: of the first.
        turned
    }

    /// What is not as two codes that differ by more than their steps; `distinct` where equal ones are not counted.
    fn common(&self, fft: &dyn Fft<f64>, distinct: bool) -> Option<Common> {
        let n: f64 = self.times.iter().sum();
        if n < LEAST_READINGS as f64 {
            return None;
        }
        let sums = self.sums(fft);
        let at = |a: usize, b: usize| sums[b % CODES * CODES + a % CODES];
        let turn = |k: usize| 2.0 * PI * k.min(CODES - k) as f64 / CODES as f64;
        let fine = |a: usize, b: usize| {
            turn(a) * self.spreads[0] > NOTHING_LEFT || turn(b) * self.spreads[1] > NOTHING_LEFT
        };
        // Of a sum and its conjugate, one.
        let half = |a: usize, b: usize| a < CODES / 2 || a == CODES / 2 && b <= CODES / 2;
        let places = (1..=CODES / 2).flat_map(|a| (1..CODES).map(move |b| (a, b)));
        let (mut all, mut count, mut worst) = (0.0, 0.0, (0.0, 1, 1));
        for (a, b) in places.filter(|(a, b)| fine(*a, *b) && half(*a, *b)) {
            if distinct && (a + b) % CODES == 0 {
                continue;
            }
            // Two that know nothing of each other have the product; E |sum|^2 is n beside it.
            let off = (at(a, b) - at(a, 0) * at(0, b) / n).norm_sqr() / n;
            // A sum at twice the turns shares out n unevenly between sine and cosine.
            let uneven = 1.0 + at(2 * a, 2 * b).norm() / n;
            let score = 2.0 * off / uneven;
            (all, count) = (all + 2.0 * off, count + 1.0);
            if score > worst.0 {
                worst = (score, a, b);
            }
        }
        if count == 0.0 {
            return None;
        }
        // A long record is told what one of ten minutes would be: no converter's steps are all the same.
        let as_short = (RECORD / n).min(1.0);
        let (statistic, a, b) = worst;
        let of_one = count * (-0.5 * statistic * as_short).exp();
        // Sums near each other hang together where few of the residues are taken, by the sum of the squared shares.
        let shares: f64 = self.times.iter().map(|t| (t / n).powi(2)).sum();
        let together = ((CODES * CODES) as f64 * (shares - 1.0 / n)).max(1.0);
        let sum = 2.0 * count + (all - 2.0 * count) * as_short;
        let of_all = tails::chi_square(sum.max(0.0) / together, 2.0 * count / together);
        let period = |k: usize| CODES as f64 / k.min(CODES - k) as f64;
        Some(Common {
            statistic,
            chance: (2.0 * of_one.min(of_all)).min(1.0),
            periods: [period(a), period(b)],
        })
    }
}

pub(super) fn audit<'a>(gyros: &'a [Gyro<'a>], audit: &mut Audit) {
    let all: Vec<Codes<'a>> = gyros.iter().filter_map(|g| Codes::of(g, audit)).collect();
    let fft = FftPlanner::new().plan_fft_forward(CODES);
    for (i, own) in all.iter().enumerate() {
        // What is common, the other channel, and in words.
        let mut found: Vec<(Common, Option<&str>, String)> = vec![];
        let mut ask = |first: &Codes<'a>, lag: usize, distinct: bool, of: String| {
            let table = Table::new(first, own, lag);
            let other = Some(first.name).filter(|name| *name != own.name);
            found.extend(table.common(fft.as_ref(), distinct).map(|c| (c, other, of)));
        };
        for lag in LAGS {
            ask(own, lag, own.repeats, format!("its own {lag} before"));
        }
        for (j, other) in all.iter().enumerate().filter(|(j, _)| *j != i) {
            if j < i {
                ask(
                    other,
                    0,
                    false,
                    format!("that of {} in its frame", other.name),
                );
            }
            ask(
                other,
                1,
                false,
                format!("that of {} in the frame before", other.name),
            );
        }
        let mut others = all.iter().enumerate().filter(|(j, _)| *j != i);
        if let (Some((_, a)), Some((_, b))) = (others.next(), others.next()) {
            let of = format!("the sum of those of {} and {}", a.name, b.name);
            ask(&a.with(b), 0, false, of);
        }
        let looks = found.len() as f64;
        let most = found
            .into_iter()
            .min_by(|a, b| a.0.chance.total_cmp(&b.0.chance));
        let Some((common, other, of)) = most else {
            continue;
        };
        let [first, second] = common.periods;
        let [shorter, longer] = [second, first].map(|p| format!("{p:.1}"));
        let periods = if shorter == longer {
            format!("a period of {shorter}")
        } else {
            format!("periods of {shorter} and {longer}")
        };
        let what = format!(
            "codes of {} follow {of} in what is finer than their noise, most at {periods} counts",
            own.name
        );
        let chance = (looks * common.chance).min(1.0);
        let id = CheckId::FineCodes;
        let fails = audit.check(id, own.name, common.statistic, chance, what.clone());
        audit.about(other.as_slice());
        if fails && chance < audit_level() {
            audit.unexplain(own.name, what);
        }
    }
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    /// Codes of noise that keeps a part of itself, changed by what was read before and the code, one in `every`.
    fn codes(
        keep: f64,
        every: usize,
        change: impl Fn(i32, i32) -> i32,
        seed: u64,
    ) -> Codes<'static> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let (mut held, mut before) = (0.0, 0);
        let codes: Vec<i32> = (0..6000)
            .map(|i| {
                let z: f64 = StandardNormal.sample(&mut rng);
                held = keep * held + 4.0 * (1.0 - keep * keep).sqrt() * z;
                let code = held.round() as i32;
                before = if i % every == 0 {
                    change(before, code)
                } else {
                    code
                };
                before
            })
            .collect();
        Codes {
            name: "gyro_x",
            residual: codes.iter().map(|c| f64::from(*c)).collect(),
            usable: vec![true; codes.len()],
            codes: (codes.iter())
                .map(|c| c.rem_euclid(CODES as i32) as usize)
                .collect(),
            repeats: false,
        }
    }

    fn chance(of: &Codes<'_>) -> f64 {
        let fft = FftPlanner::new().plan_fft_forward(CODES);
        let common = Table::new(of, of, 1).common(fft.as_ref(), false);
        common.map_or(1.0, |c| c.chance)
    }

    #[test]
    fn codes_of_noise_with_a_memory_have_nothing_fine_in_common() {
        let settings = [0.0, 0.5, 0.9, -0.7];
        let all = (0..60).flat_map(|seed| settings.map(|k| chance(&codes(k, 1, |_, c| c, seed))));
        let low: Vec<f64> = all.filter(|p| *p < 0.02).collect();
        // 4.8 of 240 are expected; 14 come once in 2000 times.
        assert!(low.len() < 14, "{low:?}");
    }

    /// The chance of what a third axis has in common with the sum of two, of which it keeps the parity in some frames.
    fn chance_of_three(kept: usize, seed: u64) -> f64 {
        let [a, b, mut c] = [0, 1, 2].map(|k| codes(0.0, 1, |_, c| c, 3 * seed + k));
        for i in (0..c.codes.len()).filter(|i| i % 10 < kept) {
            c.codes[i] = (c.codes[i] + (a.codes[i] + b.codes[i] + c.codes[i]) % 2) % CODES;
        }
        let fft = FftPlanner::new().plan_fft_forward(CODES);
        let common = Table::new(&a.with(&b), &c, 0).common(fft.as_ref(), false);
        common.map_or(1.0, |c| c.chance)
    }

    #[test]
    fn a_sum_of_three_words_that_is_kept_even_shows() {
        let low = (0..100).filter(|seed| chance_of_three(0, *seed) < 0.02);
        let low = low.count();
        // 2 are expected; 9 come once in 4000 times.
        assert!(low < 9, "{low}");
        for seed in 0..10 {
            let chance = chance_of_three(3, seed);
            assert!(chance < 1e-6, "{seed}: {chance}");
        }
    }

    #[test]
    fn what_is_kept_sent_in_few_sizes_or_torn_shows() {
        let latch = |before: i32, code: i32| code & !1 | before & 1;
        let few = |before: i32, code: i32| before + (code - before) / 3 * 3;
        let torn = |before: i32, code: i32| before & !7 | code & 7;
        let kept = |seed| chance(&codes(0.0, 4, latch, seed));
        for seed in 0..10 {
            let of = [
                kept(seed),
                chance(&codes(0.0, 4, few, seed)),
                chance(&codes(0.0, 3, torn, seed)),
            ];
            assert!(of.iter().all(|p| *p < 1e-6), "{seed}: {of:?}");
        }
    }
}
