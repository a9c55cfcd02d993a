//! Arithmetic without policy: transforms, columns, tails, order statistics, searches for a minimum.
//!
//! Slices in, numbers out: nothing here knows what a record, a channel or an effect is. Units are the caller's.

pub mod column;
pub mod exp_ln;
pub mod least_squares;
pub mod log_product;
pub mod minimise;
pub mod order_statistics;
pub mod series;
pub mod simd;
pub mod tails;
pub mod threads;
pub mod transform;
