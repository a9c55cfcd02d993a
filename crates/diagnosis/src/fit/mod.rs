//! The likelihood of a channel, its terms, and what a term has to reach.

pub(crate) mod about_line;
pub(crate) mod before_filter;
pub mod bins;
pub mod channel;
pub(crate) mod delayed;
pub mod estimate;
pub mod likelihood;
pub mod prequential;
pub mod scan;
pub mod score_test;
pub mod threshold;

/// White noise of variance 1.
#[cfg(test)]
pub(crate) fn white(n: usize, seed: u64) -> Vec<f64> {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
    (0..n).map(|_| StandardNormal.sample(&mut rng)).collect()
}
