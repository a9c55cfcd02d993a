//! Something is wrong with the stand, or nothing: drawn at random and planted in the bench by physics. The firmware's
//! logic samples it, the frames become a capture file, and the diagnosis gets the file alone.
//!
//! What is hidden goes round through everything that can be wrong (`Hidden::ALL`); size, channel, noise and environment
//! are drawn, once round in a sample. The seed is fresh at each run and printed; `IMU_STAND_SEED` replays it, `IMU_STAND_DRAWS`
//! sets how many draws. Graded by rates.

#[path = "../../diagnosis/tests/draws/mod.rs"]
mod draws;
mod hidden;

use std::hash::{BuildHasher, Hasher};

use hidden::{Draw, Graded, assert_rates, table};
use imu_stand::stand::{Hidden, run_native};

fn number(name: &str) -> Option<u64> {
    std::env::var(name).ok().map(|text| {
        text.parse()
            .unwrap_or_else(|_| panic!("{name} is no number: {text}"))
    })
}

#[test]
fn a_fault_of_the_stand_is_named_from_the_capture_alone() {
    let seed = number("IMU_STAND_SEED")
        .unwrap_or_else(|| std::hash::RandomState::new().build_hasher().finish());
    let runs =
        number("IMU_STAND_DRAWS").unwrap_or_else(|| draws::of(Hidden::ALL.len() as u64 + 1, 50));
    println!("IMU_STAND_SEED={seed} IMU_STAND_DRAWS={runs}");
    let all: Vec<Graded> = (0..runs)
        .map(|number| {
            let draw = Draw::of(seed, number, false);
            let (record, _) = run_native(&draw.plan, |_| {});
            let graded = draw.graded(&record);
            if graded.is_worth_a_line() {
                println!("{}", graded.line(&draw));
            }
            graded
        })
        .collect();
    println!("{}", table(&all));
    assert_rates(&all);
}
