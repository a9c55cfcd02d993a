//! Something is wrong with the stand, or nothing: drawn at random and planted by physics. The image in the simulated
//! ATmega16 samples it, and the diagnosis gets the capture file alone.
//!
//! A run of the tests draws three from everything that can be wrong (`IMU_STAND_ALL_DRAWS`: five). With `IMU_STAND_LONG` set it goes four times round all
//! of it; `IMU_STAND_IMAGE_DRAWS` sets how many, `IMU_STAND_SEED` replays a run. Each has to lead to the same words as
//! the same draw through the firmware's logic on the host, asked at the same instants; what is named is graded by rates.

#[path = "../../crates/diagnosis/tests/draws/mod.rs"]
mod draws;
#[path = "../../crates/cli/tests/hidden/mod.rs"]
mod hidden;

use std::sync::atomic::{AtomicU64, Ordering};

use bench::native;
use bench::simavr::simavr_timed;
use hidden::{Draw, Graded, assert_rates, diagnosed, table, words};
use hil_tests::{image, seed};
use imu_stand::stand::{Hidden, Receiver};

/// From as many on they go round.
const ROUND: u64 = Hidden::ALL.len() as u64 + 1;

fn through_the_image(draw: &Draw, image: &[u8]) -> Graded {
    let (mut through, mut host) = (Receiver::new(|_| {}), Receiver::new(|_| {}));
    let run = &draw.plan.run;
    let timeline = simavr_timed(image, run, |byte| through.push(byte)).expect("it runs");
    let (record, link) = through.finish();
    let arrived = match draw.hidden {
        Hidden::LossyLine => 11_800,
        _ => {
            assert_eq!(link.rejected(), 0, "every frame arrives in order");
            11_940
        }
    };
    // A crystal that is 0.3 % fast makes 12 036 of 600 s.
    assert!(
        (arrived..=12_036).contains(&record.len()),
        "{}",
        record.len()
    );
    let graded = draw.graded(&record);
    native(run, &timeline, |byte| host.push(byte));
    let on_host = words(&diagnosed(&host.finish().0, draw.seed));
    let mark = if graded.is_worth_a_line() { "! " } else { "" };
    println!("{mark}{}", graded.line(draw));
    assert_eq!(
        graded.said, on_host,
        "the image, then the same draw on the host"
    );
    graded
}

#[test]
fn what_is_hidden_in_the_stand_is_named_through_the_image() {
    let usual = match std::env::var_os("IMU_STAND_LONG") {
        Some(_) => 4 * ROUND,
        None => draws::of(3, 5),
    };
    let runs: u64 = std::env::var("IMU_STAND_IMAGE_DRAWS").map_or(usual, |text| {
        text.parse().expect("IMU_STAND_IMAGE_DRAWS is a number")
    });
    let (seed, image, next) = (seed(), image(), AtomicU64::new(0));
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let all: Vec<Graded> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|_| {
                scope.spawn(|| {
                    let mut own = vec![];
                    loop {
                        let number = next.fetch_add(1, Ordering::Relaxed);
                        if number >= runs {
                            return own;
                        }
                        let draw = Draw::of(seed, number, runs < ROUND);
                        own.push(through_the_image(&draw, &image));
                    }
                })
            })
            .collect();
        (workers.into_iter())
            .flat_map(|worker| worker.join().expect("every draw runs"))
            .collect()
    });
    println!("{}", table(&all));
    assert_rates(&all);
}
