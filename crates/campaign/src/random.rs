//! Draws by range, from a generator whose stream belongs to one case.

use std::f64::consts::TAU;

use rand_core::SeedableRng;
use rand_distr::{Distribution, Exp1, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A stream of draws.
pub struct Draw(pub Xoshiro256PlusPlus);

impl Draw {
    /// The stream of case `index` of a family under a seed: neighbouring cases and families share nothing.
    #[must_use]
    pub fn of(seed: u64, family: u64, index: u64) -> Self {
        let mixed = seed
            ^ family.wrapping_mul(0x9e37_79b9_7f4a_7c15)
            ^ index
                .wrapping_add(1)
                .wrapping_mul(0xd1b5_4a32_d192_ed03)
                .rotate_left(17);
        Self(Xoshiro256PlusPlus::seed_from_u64(mixed))
    }

    /// Even in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        Uniform::new(low, high).map_or(low, |u| u.sample(&mut self.0))
    }

    /// The same, of either sign.
    pub fn signed(&mut self, low: f64, high: f64) -> f64 {
        self.sign() * self.between(low, high)
    }

    /// Even in the logarithm.
    pub fn by_ratio(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    /// Even over a turn, rad.
    pub fn phase(&mut self) -> f64 {
        self.between(0.0, TAU)
    }

    /// True with that chance.
    pub fn chance(&mut self, p: f64) -> bool {
        self.between(0.0, 1.0) < p
    }

    /// The one with that chance, else the other.
    pub fn choose<A>(&mut self, p: f64, one: A, other: A) -> A {
        if self.chance(p) { one } else { other }
    }

    /// The one or the other, as often.
    pub fn either<A>(&mut self, one: A, other: A) -> A {
        self.choose(0.5, one, other)
    }

    /// 0 with that chance, else what is drawn.
    pub fn zero_or(&mut self, p: f64, of: impl FnOnce(&mut Self) -> f64) -> f64 {
        if self.chance(p) { 0.0 } else { of(self) }
    }

    /// 1 or -1.
    pub fn sign(&mut self) -> f64 {
        self.either(1.0, -1.0)
    }

    /// One of 0..count.
    pub fn of_many(&mut self, count: usize) -> usize {
        ((self.between(0.0, count as f64)) as usize).min(count.saturating_sub(1))
    }

    /// One of several.
    pub fn one_of<A: Copy>(&mut self, all: &[A]) -> A {
        all[self.of_many(all.len())]
    }

    /// Standard normal.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// Exponential of mean 1.
    pub fn exponential(&mut self) -> f64 {
        Exp1.sample(&mut self.0)
    }

    /// A seed for a generator elsewhere.
    pub fn seed(&mut self) -> u64 {
        (self.between(0.0, 4_294_967_296.0) as u64) << 20 | self.between(0.0, 1_048_576.0) as u64
    }
}
