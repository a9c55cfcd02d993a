//! Firmware of the IMU board: the registers. Off the AVR an empty `main`, so that workspace-wide commands pass.
#![cfg_attr(
    target_arch = "avr",
    no_std,
    no_main,
    feature(abi_avr_interrupt, asm_experimental_arch)
)]

#[cfg(target_arch = "avr")]
mod avr;

// cargo links again where the script changes: it knows it by this.
#[cfg(target_arch = "avr")]
const _: &str = include_str!("../memory.x");

#[cfg(not(target_arch = "avr"))]
fn main() {}
