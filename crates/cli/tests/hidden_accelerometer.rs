//! An error of the MMA7260QT, planted in the bench by physics at a size, on an axis and in a noise that are drawn: the firmware's
//! logic samples the stand, and the diagnosis of all six channels gets the capture file alone. `IMU_STAND_SEED` takes other draws.

use diagnosis::{DiagnoseOptions, diagnose_channels};
use imu_stand::ReadOptions;
use imu_stand::capture::{read_from, write_to};
use imu_stand::stand::planted::{ACCELEROMETERS, GYROS, compare, planted};
use imu_stand::stand::{Hidden, Sizes, plan, run_native};

/// Draws of each kind, and those that are asked to be named and sized: all but one, for an interval of 95 % misses now and then.
const RUNS: u64 = 4;
const LEAST: u64 = 3;

#[test]
fn an_error_of_an_accelerometer_is_named_and_sized_from_the_capture_alone() {
    let seed = std::env::var("IMU_STAND_SEED");
    let seed: u64 = seed.ok().and_then(|s| s.parse().ok()).unwrap_or(41);
    println!("IMU_STAND_SEED={seed}");
    let channels = GYROS.into_iter().chain(ACCELEROMETERS);
    let channels: Vec<String> = channels.map(str::to_owned).collect();
    for hidden in [Hidden::AccTempco, Hidden::AccReference] {
        let right = (0..RUNS).filter(|run| {
            let plan = plan(hidden, Sizes::Visible, 600.0, seed + run);
            let (record, _) = run_native(&plan, |_| {});
            let mut file = Vec::new();
            write_to(&mut file, &record).expect("memory takes it");
            let read = read_from(file.as_slice(), &ReadOptions::default()).expect("a capture");
            let times = record.host_time_s.as_ref();
            let start_s = times.and_then(|t| t.first()).map_or(0.0, |t| *t);
            let found = diagnose_channels(&read.record, &channels, &DiagnoseOptions::default());
            let found = found.expect("600 s are enough").diagnosis;
            let comparison = compare(&planted(&plan.run, start_s), &found);
            let right = comparison.items.iter().all(|item| item.matches);
            if !right {
                println!("{}", comparison.lines().join("\n"));
            }
            right
        });
        let right = right.count() as u64;
        assert!(right >= LEAST, "{hidden:?}: {right} of {RUNS}");
    }
}
