//! The program `imu-stand`.
fn main() {}
