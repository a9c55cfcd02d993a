//! Firmware of the IMU board: the registers. Off the AVR an empty `main`, so that workspace-wide commands pass.
#![cfg_attr(target_arch = "avr", no_std, no_main, feature(abi_avr_interrupt))]

#[cfg(target_arch = "avr")]
mod avr;

#[cfg(not(target_arch = "avr"))]
fn main() {}
