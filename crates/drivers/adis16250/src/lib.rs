//! Driver for the ADIS16250/ADIS16255 yaw rate gyroscope.
#![no_std]
