//! Two levels against a Gaussian process.

pub mod compare;
pub mod filter_bank;
pub mod fit;
mod of_blocks;
#[cfg(test)]
mod one_pole;
mod sides;
