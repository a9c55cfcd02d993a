//! The image for hours of its own time, as crates/cli/tests/soak.rs has its logic; `cargo xtask soak` runs 24 h of it.
//!
//! `IMU_STAND_SOAK_HOURS` and `IMU_STAND_SEED` set how long and with which seed.
#![cfg(target_os = "linux")]

#[path = "../../crates/cli/tests/soak/host.rs"]
mod host;

use std::path::Path;

use hil_tests::image;
use host::Soak;
use imu_stand::stand::Board;

fn set(name: &str, or: f64) -> f64 {
    std::env::var(name).map_or(or, |text| {
        text.parse()
            .unwrap_or_else(|_| panic!("{name} is no number: {text}"))
    })
}

/// In an hour all counters come round or stop at their end but that of the ticks, which takes 4.8 h.
#[test]
fn the_image_for_hours_of_its_time_loses_nothing_unnoticed_and_grows_nowhere() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("soak_image");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder for the test");
    host::soak(
        Board::Image(image()),
        &Soak {
            seconds: 3600.0 * set("IMU_STAND_SOAK_HOURS", 1.0),
            seed: set("IMU_STAND_SEED", 20_261_124.0) as u64,
            folder,
        },
    );
}
