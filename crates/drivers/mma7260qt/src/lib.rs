//! Driver for the MMA7260QT three-axis analog accelerometer.
#![no_std]
