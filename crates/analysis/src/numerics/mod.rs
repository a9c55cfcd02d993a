//! Arithmetic without policy: transforms, columns, tails, small searches.

pub mod column;
pub mod exp_ln;
pub mod log_product;
pub mod minimise;
pub mod order_statistics;
pub mod series;
pub mod simd;
pub mod tails;
pub mod transform;
