//! Firmware of the IMU board: the registers. Off the AVR an empty `main`, so that workspace-wide commands pass.
fn main() {}
