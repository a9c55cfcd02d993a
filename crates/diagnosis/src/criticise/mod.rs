//! Tests of what the model of a channel leaves, and of what each name claims.

pub mod common_noise;
pub mod cross_axis;
pub mod follower_shape;
pub(crate) mod mixing;
pub(crate) mod one_source;
pub mod process;
pub mod random_walk;
pub mod residual;
pub mod scale;
pub(crate) mod shock;
pub mod short_time;
pub(crate) mod step_time;
pub mod variance_law;
