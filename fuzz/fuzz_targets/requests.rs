//! Any bytes into the board's decoder.
#![no_main]

#[path = "../../crates/wire/tests/common/fuzzing.rs"]
mod fuzzing;

libfuzzer_sys::fuzz_target!(|line: &[u8]| fuzzing::requests(line));
