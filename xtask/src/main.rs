//! Toolchain, image, tests, flashing.
fn main() {}
