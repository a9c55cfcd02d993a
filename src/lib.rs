//! Firmware of the IMU board: the logic, without registers.
//!
//! `main.rs` gives it the registers of the ATmega16; on the host anything that implements [`Sensors`] and [`Board`]
//! runs the same logic. Nothing in it panics, and every wait has a budget.
//!
//! Two contexts share the work, so that nothing can move the sampling instant:
//! - [`acquire`] runs right after the tick, above everything else: SPI and ADC are its own.
//! - [`Stand`] runs below it: it scales, frames, sends, and answers the PC.
#![cfg_attr(not(test), no_std)]
#![cfg_attr(not(target_arch = "avr"), forbid(unsafe_code))]
#![cfg_attr(target_arch = "avr", deny(unsafe_code), feature(asm_experimental_arch))]

pub mod acquire;
mod attitude;
pub mod bias;
pub mod config;
pub mod correction;
pub mod math;
pub mod motor;
pub mod stand;

pub use acquire::{Done, Job, Raw, Sensors, Task, acquire, configure_all};
pub use stand::{Board, Stand};

/// Length of a tick of the time stamps, ns: 16 MHz / 64 in timer 1.
pub const TICK_NS: u32 = 4_000;
/// Milliseconds that a sensor needs after power-on; the data sheet's start-up time with margin (220 ms, unverified).
pub const SENSOR_START_MS: u16 = 220;
/// Version of this firmware.
pub const VERSION: [u8; 3] = [0, 1, 0];
