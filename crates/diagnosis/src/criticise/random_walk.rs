//! Whether what is slow in a record is a random walk, or a few smooth cycles that the walk was fitted to.
//!
//! A heater that switches, or a room that is cooled and warms up again, moves a bias two or three times up and down in a
//! record. Where no thermometer tells of it, and there are too few cycles for a line, the random walk takes it: K is too
//! large, and faster than the cycles there is less than such a walk would make. So two walks are held against one: one up
//! to a coefficient m of the DCT-II, a smaller one beyond it, at every m of a few cycles. In that domain the coefficients of
//! a true random walk of any size beside white noise are independent, which makes the likelihood ratio exact.

use model::record::Quantity;

use crate::fit::likelihood::{Noise, least_walk};
use crate::fit::scan::residual;
use crate::result::Check;
use crate::search::searched::Searched;
use crate::test_level::{CheckId, omnibus_level};
use numerics::log_product::LogProduct;
use numerics::minimise::golden;
use numerics::tails::chi_tail;

/// Last half cycles of the slow part that are tried: from one cycle and a half on, fewer are a trend, to eight.
const LAST: std::ops::RangeInclusive<usize> = 3..=16;
/// Steps of the search for a walk.
const STEPS: usize = 30;
/// Range of a walk about another one, in ln of its step variance.
const WIDE: f64 = 12.0;

/// Bins of the residual under walks of any size: energy, coefficients, all noise but the walk, and the walk's shape.
struct Bin {
    energy: f64,
    count: f64,
    rest: f64,
    walk: f64,
}

impl Bin {
    fn shape(&self, log_walk: f64) -> f64 {
        self.rest + log_walk.exp() * self.walk
    }
}

/// What bins say of one walk, whatever the white variance.
struct Under {
    /// Sum of ln of the shape over the coefficients.
    logs: f64,
    /// Sum of the energies over the shape.
    energy: f64,
    count: f64,
}

impl Under {
    fn new(bins: &[Bin], log_walk: f64) -> Self {
        let walk = log_walk.exp();
        let [mut logs, mut energy, mut count] = [0.0; 3];
        for same in bins.chunk_by(|a, b| a.count == b.count) {
            let mut product = LogProduct::default();
            for b in same {
                let shape = b.rest + walk * b.walk;
                energy += b.energy / shape;
                product.multiply(shape);
            }
            logs += same[0].count * product.ln();
            count += same[0].count * same.len() as f64;
        }
        Self {
            logs,
            energy,
            count,
        }
    }

    /// The white variance that fits best.
    fn white(&self) -> f64 {
        self.energy / self.count
    }

    /// -2 ln L under a white variance.
    fn at(&self, white: f64) -> f64 {
        self.logs + self.count * white.ln() + self.energy / white
    }
}

/// The walk that fits best, from a coarse row of them.
fn best(low: f64, high: f64, f: &dyn Fn(f64) -> f64) -> f64 {
    const ROW: u32 = 10;
    let step = (high - low) / f64::from(ROW);
    let row = (0..=ROW).map(|i| low + step * f64::from(i));
    let row = row.map(|x| (f(x), x));
    let first = row.min_by(|a, b| a.0.total_cmp(&b.0));
    let (least, first) = first.unwrap_or((f64::INFINITY, low));
    let x = golden(f, (first - step).max(low), (first + step).min(high), STEPS);
    if f(x) < least { x } else { first }
}

/// Two walks against one: likelihood ratio, the last coefficient of the slow one, ln of the other one's step variance over
/// the white variance, which is the last.
fn two_walks(bins: &[Bin], samples: usize, start: f64) -> Option<(f64, usize, f64, f64)> {
    let low = least_walk(samples);
    let (from, to) = ((start - WIDE).max(low), (start + WIDE).min(6.0));
    // The walk, the white variance and -2 ln L.
    let free = |bins: &[Bin]| {
        let with = |x: f64| {
            let under = Under::new(bins, x);
            let white = under.white();
            (x, white, under.at(white))
        };
        with(best(from, to, &|x| with(x).2))
    };
    let (_, _, null) = free(bins);
    LAST.filter(|m| 4 * m < bins.len())
        .map(|m| {
            let (slow, fast) = bins.split_at(m);
            let (walk, white, of_fast) = free(fast);
            let of_slow = |x: f64| Under::new(slow, x).at(white);
            let larger = best(walk, walk + WIDE, &of_slow);
            let lr = null - of_slow(larger) - of_fast;
            (lr, m, walk, white)
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))
}

/// Chance that a true random walk gives a likelihood ratio, at the most telling of all places: one-sided.
fn chance(lr: f64) -> f64 {
    let places = LAST.count() as f64;
    (0.5 * places * chi_tail(lr.max(0.0), 1.0)).min(1.0)
}

/// Whether the slow part of what a channel's model leaves is a random walk.
pub(crate) fn check(s: &Searched<'_>) -> Option<Check> {
    let (search, state, target) = (&s.search, &s.state, s.target);
    if target.moving || search.view.sways() {
        return None;
    }
    let unit = &target.unit;
    let bins = &search.panel.bins;
    let r = residual(&search.panel, &state.columns(), &state.solution);
    let mut noise = state.noise.clone();
    noise.log_walk = f64::NEG_INFINITY;
    let rest = noise.over(bins);
    let walk = Noise::new(0.0).over(bins);
    let bins: Vec<Bin> = (bins.products(&r, &r).into_iter())
        .zip(bins.counts())
        .zip(rest.into_iter().zip(walk))
        .map(|((energy, count), (rest, walk))| Bin {
            energy,
            count: *count,
            rest,
            // Beside white noise of 1.
            walk: walk - 1.0,
        })
        .collect();
    let (lr, last, walk, white) = two_walks(&bins, search.panel.bins.n, state.noise.log_walk)?;
    let (n, rate_hz) = (search.panel.bins.n as f64, search.view.rate_hz);
    let excess: f64 = (bins[..last].iter())
        .map(|b| b.energy - white * b.shape(walk))
        .sum();
    let swing = (excess.max(0.0) / n).sqrt();
    let edge = last as f64 * rate_hz / (2.0 * n);
    let small = (white * walk.exp() * rate_hz).sqrt();
    let recorded = |q| search.view.signals.iter().any(|s| s.quantity == q);
    let cause = if recorded(Quantity::Temp) {
        ""
    } else {
        "; no temperature was recorded, and one that goes up and down moves a bias like that"
    };
    let p_value = chance(lr);
    let fails = p_value < omnibus_level();
    Some(Check {
        id: CheckId::SlowCycles.into(),
        about: vec![],
        channel: target.name.clone(),
        statistic: lr,
        p_value: Some(p_value),
        threshold: omnibus_level(),
        fails_before: fails,
        fails_after: fails,
        what: format!(
            "below {edge:.4} Hz it swings by {swing:.3} {unit} rms over all {:.0} s in few smooth cycles, steeper than a random walk: what is faster shows one of {small:.4} {unit}/sqrt(s), and the fitted one is theirs{cause}",
            n / rate_hz
        ),
    })
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::fit::likelihood::{Bins, Dct};
    use crate::test_level::OMNIBUS_LEVEL;

    /// Energies of one record of white noise of 1, a walk and a `signal` of these coefficients.
    fn record(log_walk: f64, signal: &[f64], rng: &mut Xoshiro256PlusPlus) -> Vec<Bin> {
        let bins = Bins::new(signal.len());
        let walk = Noise::new(0.0).over(&bins);
        let mut rest = signal[1..].iter();
        bins.counts()
            .iter()
            .copied()
            .zip(walk)
            .map(|(count, walk)| {
                let mut bin = Bin {
                    energy: 0.0,
                    count,
                    rest: 1.0,
                    walk: walk - 1.0,
                };
                let spread = bin.shape(log_walk).sqrt();
                for c in rest.by_ref().take(count as usize) {
                    let e: f64 = StandardNormal.sample(rng);
                    bin.energy += (spread * e + c).powi(2);
                }
                bin
            })
            .collect()
    }

    const N: usize = 12_000;

    #[test]
    fn a_random_walk_of_any_size_is_one_as_often_as_is_stated() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        const RUNS: usize = 400;
        for log_walk in [-20.0, -15.0, -12.0, -9.0, -5.0] {
            let mut run = || two_walks(&record(log_walk, &[0.0; N], &mut rng), N, log_walk);
            let low = (0..RUNS)
                .filter_map(|_| run())
                .filter(|found| chance(found.0) < 0.01)
                .count();
            // 4 are expected at most; more than 12 once in 3000 times.
            assert!(low <= 12, "ln walk {log_walk}: {low} of {RUNS} below 1 %");
        }
    }

    #[test]
    fn a_few_cycles_are_no_random_walk() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(12);
        for swing in [2.0, 4.0] {
            // Two cycles and a bit, with the third harmonic of what switches and is smoothed.
            let cycles: Vec<f64> = (0..N)
                .map(|i| {
                    let turn = 2.3 * std::f64::consts::TAU * i as f64 / N as f64 + 1.0;
                    swing * (turn.sin() + (3.0 * turn).sin() / 9.0)
                })
                .collect();
            let bins = record(-18.0, &Dct::new(N).forward(&cycles), &mut rng);
            let (lr, last, ..) = two_walks(&bins, N, -9.0).expect("bins");
            assert!(chance(lr) < OMNIBUS_LEVEL, "{swing}: {lr} up to {last}");
        }
    }
}
