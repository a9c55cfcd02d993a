//! Any bytes as `npy`: what is checked is in crates/cli/tests/fuzz/targets.rs.
#![no_main]

#[path = "../../crates/cli/tests/fuzz/targets.rs"]
mod targets;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| targets::check("npy", bytes));
