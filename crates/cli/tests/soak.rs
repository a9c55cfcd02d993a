//! Long runs, in a short form here; `cargo xtask soak` runs them for days of the board's time and hours of this computer's.
//!
//! `IMU_STAND_SOAK_HOURS`, `IMU_STAND_SOAK_MINUTES` and `IMU_STAND_SEED` set how long and with which seed.
#![cfg(target_os = "linux")]

mod common;
#[path = "../../diagnosis/tests/draws/mod.rs"]
mod draws;

#[path = "soak/host.rs"]
mod host;
#[path = "soak/line.rs"]
mod line;

use host::Soak;
use imu_stand::stand::Board;

fn set(name: &str, or: f64) -> f64 {
    std::env::var(name).map_or(or, |text| {
        text.parse()
            .unwrap_or_else(|_| panic!("{name} is no number: {text}"))
    })
}

fn seed() -> u64 {
    set("IMU_STAND_SEED", 20_261_124.0) as u64
}

/// The firmware's logic: every counter comes round in 6 h, that of the ticks (4.8 h, behind the last reset) too; in 2 h every
/// other one does.
#[test]
fn logic_for_hours_of_the_boards_time_loses_nothing_unnoticed_and_grows_nowhere() {
    host::soak(
        Board::Native,
        &Soak {
            seconds: 3600.0 * set("IMU_STAND_SOAK_HOURS", draws::of(2.0, 6.0)),
            seed: seed(),
            folder: common::folder("soak_logic"),
        },
    );
}

/// A live capture on a bad line, with whatever befalls it.
#[test]
fn a_live_capture_holds_every_frame_that_arrived_through_damage_cables_kills_and_a_full_disk() {
    line::soak(60.0 * set("IMU_STAND_SOAK_MINUTES", 0.75), seed());
}
