//! Any bytes into the PC's decoder.
#![no_main]

#[path = "../../crates/wire/tests/common/fuzzing.rs"]
mod fuzzing;

libfuzzer_sys::fuzz_target!(|line: &[u8]| fuzzing::frames(line));
