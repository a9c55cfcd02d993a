//! How many draws a test makes that grades by rate: a sample of them, or all where `IMU_STAND_ALL_DRAWS` is set, as `cargo xtask
//! test --all-draws` sets it before a release. Shared by path with the tests of other packages.
//!
//! A sample weakens no bound. Where all draws of a test ask for so many right ones, the sample passes at once if its draws are
//! all right, and goes on to all of them if one is not, which then has the word. So it fails an engine that keeps its promise
//! no oftener than all draws do. One that is right in a share p of the draws passes by the sample with p^n, n the draws of it:
//! in 6 % with four draws and p = 1/2, in 1 % with p = 1/3; a larger p is seen by all draws.
#![allow(dead_code)]

/// Least draws of a sample.
const LEAST_SAMPLE: u64 = 4;

/// Whether all draws are asked for.
pub fn all() -> bool {
    std::env::var_os("IMU_STAND_ALL_DRAWS").is_some()
}

/// The seed of the draws of a test: its own, or that of `IMU_STAND_SEED`.
pub fn seed(own: u64) -> u64 {
    let asked = std::env::var("IMU_STAND_SEED").ok();
    asked.and_then(|s| s.parse().ok()).unwrap_or(own)
}

/// One of two numbers: of a sample, and where all draws are asked for.
pub fn of<T>(sample: T, every: T) -> T {
    if all() { every } else { sample }
}

/// Makes the draws of a test by `right`, which says what is wrong with one; at least `least` of `draws` have to be right.
/// What is wrong, with the count, where they are not.
pub fn graded(
    draws: u64,
    least: u64,
    right: impl FnMut(u64) -> Result<(), String>,
) -> Result<(), String> {
    graded_from(of(LEAST_SAMPLE.max(draws / 3), draws), draws, least, right)
}

fn graded_from(
    sample: u64,
    draws: u64,
    least: u64,
    mut right: impl FnMut(u64) -> Result<(), String>,
) -> Result<(), String> {
    let mut misses = vec![];
    for draw in 0..draws {
        if draw == sample && misses.is_empty() {
            return Ok(());
        }
        misses.extend(right(draw).err());
    }
    let hits = draws - misses.len() as u64;
    if hits >= least {
        return Ok(());
    }
    Err(format!("{hits} of {draws}; {misses:#?}"))
}
