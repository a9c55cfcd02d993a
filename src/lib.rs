//! Firmware of the IMU board: the logic, without registers.
#![cfg_attr(not(test), no_std)]
