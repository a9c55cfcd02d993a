//! A bit that sticks, by the likelihood of the counts.
//!
//! Of a normal reading about the true level, the code takes, in a share f of the samples, the value v at bit b: a code
//! with that value has the chance of its own and f times that of the code that differs in this bit alone, any other
//! 1 - f of its own. What the neighbours tell is not the true level L but M = L + 2^b f (v - P(bit is 1 | L)): L is
//! solved from it. f and sigma are fitted for each b and v.

use statrs::distribution::{ContinuousCDF, Normal};

use super::bits::Square;
use crate::audit::local::Local;
use crate::optimise::golden;

/// Levels told apart in a count: rounding to them costs n / (24 (4 sigma)^2) nats, one in 12 000 readings.
const LEVELS_PER_COUNT: f64 = 4.0;
/// Least and largest spread against the one that was measured: a bit that sticks widens it more than it narrows it.
const SPREADS: (f64, f64) = (0.25, 1.5);
/// Rounds of fitting share and spread in turn.
const ROUNDS: usize = 3;
/// Places of each coordinate that a search begins with, and steps of its refinement.
const PLACES: usize = 5;
const STEPS: usize = 10;

/// Chance of a code, by that of any code under the normal density.
type Chance<'a> = &'a dyn Fn(i32, &dyn Fn(i32) -> f64) -> f64;

/// Counts by their level and code.
pub(super) struct Tally {
    cells: Vec<(f64, Vec<(i32, f64)>)>,
}

/// A fitted bit.
pub(super) struct Stuck {
    pub bit: u32,
    pub value: u8,
    pub fraction: f64,
    /// Standard error of the fraction.
    pub error: f64,
    /// Nats.
    pub log_likelihood: f64,
}

/// Spread (its logarithm) and share, with the log likelihood there.
struct Place {
    ln: f64,
    f: f64,
    l: f64,
}

/// The level that a bit which sticks moves to `seen`: bisection, as the moved level grows with the true one wherever it
/// matters.
fn true_level(seen: f64, square: &Square, bit: u32, value: u8, fraction: f64) -> f64 {
    let weight = f64::from(1u32 << bit);
    let moved = |l: f64| {
        let one = 0.5 * (1.0 - square.at(l));
        l + weight * fraction * (f64::from(value) - one)
    };
    let (mut low, mut high) = (seen - weight, seen + weight);
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        if moved(middle) < seen {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

impl Tally {
    pub(super) fn new(counts: &[i32], local: &Local, known: &[bool]) -> Self {
        let mut cells =
            std::collections::BTreeMap::<i64, std::collections::BTreeMap<i32, f64>>::new();
        for (i, c) in counts.iter().enumerate().filter(|(i, _)| known[*i]) {
            let level = (local.level[i] * LEVELS_PER_COUNT).round() as i64;
            *cells.entry(level).or_default().entry(*c).or_default() += 1.0;
        }
        let cells = cells
            .into_iter()
            .map(|(level, codes)| (level as f64 / LEVELS_PER_COUNT, codes.into_iter().collect()))
            .collect();
        Self { cells }
    }

    /// Sum of the log likelihood over the cells; `level_of` gives the true level, `chance` that of a code from the
    /// chance of any code under the normal density.
    fn sum(&self, sigma: f64, level_of: &dyn Fn(f64) -> f64, chance: Chance<'_>) -> f64 {
        let normal = Normal::standard();
        self.cells
            .iter()
            .map(|(seen, codes)| {
                let level = level_of(*seen);
                let mass = |c: i32| {
                    let z = (f64::from(c) - level) / sigma;
                    normal.cdf(z + 0.5 / sigma) - normal.cdf(z - 0.5 / sigma)
                };
                codes
                    .iter()
                    .map(|(c, times)| times * chance(*c, &mass).max(1e-12).ln())
                    .sum::<f64>()
            })
            .sum()
    }

    /// Log likelihood of sound counts with the best spread near `sigma`.
    pub(super) fn sound(&self, sigma: f64) -> f64 {
        let l = |ln: f64| -self.sum(ln.exp(), &|seen| seen, &|c, mass| mass(c));
        let best = golden(
            &l,
            (sigma * SPREADS.0).ln(),
            (sigma * SPREADS.1).ln(),
            STEPS,
        );
        -l(best)
    }

    fn likelihood(&self, sigma: f64, bit: u32, value: u8, fraction: f64) -> f64 {
        let square = Square::new(sigma, 2.0 * f64::from(1u32 << bit));
        self.sum(
            sigma,
            &|seen| true_level(seen, &square, bit, value, fraction),
            &|c, mass| {
                if (c >> bit) & 1 == i32::from(value) {
                    mass(c) + fraction * mass(c ^ (1 << bit))
                } else {
                    (1.0 - fraction) * mass(c)
                }
            },
        )
    }

    /// The bit below `bits` that describes the counts best; a bit beyond the reach of the noise is not looked at.
    pub(super) fn best(&self, sigma: f64, bits: u32) -> Option<Stuck> {
        const REACH: f64 = 4.0;
        let (low, high) = ((sigma * SPREADS.0).ln(), (sigma * SPREADS.1).ln());
        let places = |from: f64, to: f64| {
            (0..PLACES).map(move |i| from + (to - from) * (i as f64 + 0.5) / PLACES as f64)
        };
        let apart = ((high - low) / PLACES as f64, 1.0 / PLACES as f64);
        let mut best: Option<(u32, u8, Place)> = None;
        for bit in (0..bits).filter(|b| f64::from(1u32 << b) <= REACH * sigma) {
            for value in [0, 1] {
                let l = |ln: f64, f: f64| self.likelihood(ln.exp(), bit, value, f);
                let Some(near) = places(low, high)
                    .flat_map(|ln| places(0.0, 1.0).map(move |f| (ln, f)))
                    .map(|(ln, f)| Place { ln, f, l: l(ln, f) })
                    .max_by(|a, b| a.l.total_cmp(&b.l))
                else {
                    continue;
                };
                // The peaks are narrower than the places are apart: each bit is weighed at its own.
                let near = self.climb(bit, value, near, apart, 1);
                if best.as_ref().is_none_or(|b| near.l > b.2.l) {
                    best = Some((bit, value, near));
                }
            }
        }
        let (bit, value, near) = best?;
        let top = self.climb(bit, value, near, apart, ROUNDS);
        Some(self.stuck(bit, value, &top))
    }

    /// From a place to the peak by it, spread and share in turn.
    fn climb(&self, bit: u32, value: u8, from: Place, apart: (f64, f64), rounds: usize) -> Place {
        let l = |ln: f64, f: f64| -self.likelihood(ln.exp(), bit, value, f.clamp(0.0, 1.0));
        let (mut ln, mut f) = (from.ln, from.f);
        let (mut reach_ln, mut reach_f) = apart;
        for _ in 0..rounds {
            ln = golden(&|ln| l(ln, f), ln - reach_ln, ln + reach_ln, STEPS);
            let (low, high) = ((f - reach_f).max(0.0), (f + reach_f).min(1.0));
            f = golden(&|f| l(ln, f), low, high, STEPS);
            reach_ln *= 0.5;
            reach_f *= 0.7;
        }
        let top = Place {
            ln,
            f,
            l: -l(ln, f),
        };
        if top.l > from.l { top } else { from }
    }

    fn stuck(&self, bit: u32, value: u8, top: &Place) -> Stuck {
        let l = |f: f64| -self.likelihood(top.ln.exp(), bit, value, f);
        let f = top.f;
        let best = -top.l;
        // The curvature along the share, or at an end of it what the slope leaves.
        let h = 0.01;
        let (below, above) = ((f - h).max(0.0), (f + h).min(1.0));
        let bend = (l(below) - best + l(above) - best) / ((above - below) / 2.0).powi(2);
        Stuck {
            bit,
            value,
            fraction: f,
            error: if bend > 0.0 { bend.sqrt().recip() } else { h },
            log_likelihood: -best,
        }
    }
}
