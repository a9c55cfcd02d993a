//! The physical stand as a witness: parts at register and voltage level, motor, supply, thermal and mechanical world.
//!
//! A [`Stand`] is built from a [`Scenario`] and answers what a board asks of it: an SPI byte, an ADC voltage, a motor
//! command, each at a time in seconds since power came on. The world moves on clocks of its own (the mechanics every
//! millisecond, each gyro at its own 256 samples a second), so the answers depend on the times of the questions only,
//! not on how many were asked: the image in simavr and the firmware's logic on the host meet the same world.
//!
//! The crate knows neither `model` nor `diagnosis`. What it does to the data it does by physics, and they have to find
//! it by statistics.
//!
//! Every random draw comes from the scenario's seed; each part has a stream of its own, so that planting a fault
//! leaves all other noise as it was.

mod adis16250;
mod base;
mod gyro;
mod mma7260qt;
mod motor;
mod native;
mod pose;
mod random;
mod run;
pub mod scenario;
#[cfg(feature = "simavr")]
pub mod simavr;
mod stand;
mod supply;
mod thermal;

pub use adis16250::{Adis16250, Outputs, register, status};
pub use gyro::{GyroChain, Stimulus, bartlett};
pub use mma7260qt::{AccSelect, Mma7260Qt};
pub use motor::Motor;
pub use native::{Instants, Timeline, native, native_live};
pub use pose::Pose;
pub use random::{Stream, standard_normal, uniform};
pub use run::{Ending, Run, SerialByte, TOLD_NONCE, TimedRequest, arming, duty_profile};
pub use scenario::{Fault, Scenario};
pub use stand::{MECHANICAL_STEP_S, Stand};
pub use supply::Supply;
pub use thermal::Thermal;
