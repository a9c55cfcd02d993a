//! Frames, CRC and versions of the IMU stand's serial link.
#![no_std]
