//! The image in the simulated ATmega16 and its logic on the host say the same in the same world, byte for byte.
//!
//! Masked are the two fields of the health frame that tell of the processor itself: how long a tick's work took, and how
//! deep the stack went. The instants at which the parts are asked within a tick are the image's own, measured in the run:
//! serial interrupts move those behind the first round by some cycles, and what a part says changes in between.

use std::ops::ControlFlow;

use bench::scenario::StallFlags;
use bench::simavr::simavr_timed;
use bench::{Fault, Run, Scenario, Timeline, duty_profile, native};
use hil_tests::{Heard, at, image, run};
use wire::{Axis, Command, Frame, Request, Sensor};

/// The frames as bytes again, without what tells of the processor.
fn masked(heard: &Heard) -> Vec<(Frame, Vec<u8>)> {
    heard
        .frames
        .iter()
        .map(|(_, frame)| {
            let mut frame = *frame;
            if let Frame::Health(health) = &mut frame {
                (health.tick_busy_max, health.stack_free) = (0, 0);
            }
            let mut bytes = [0; 256];
            let len = wire::encode(&frame, &mut bytes).expect("a frame fits");
            (frame, bytes[..len].to_vec())
        })
        .collect()
}

/// Moves each request by less than a millisecond, so that its last byte arrives half way between two milliseconds of the
/// board: which of two comes first that arrive within the main loop's latency is no question of its logic.
fn between_milliseconds(run: &mut Run) {
    let mut short = run.clone();
    short.seconds = 0.5;
    short.requests.clear();
    let start = simavr_timed(&image(), &short, |_| ControlFlow::Continue(()))
        .expect("it runs")
        .start as f64
        / 16.0;
    for timed in &mut run.requests {
        let line = Request::FRAME_LEN as f64 * 260.0;
        let phase = (timed.at_us as f64 + line - start).rem_euclid(1000.0);
        timed.at_us += (1500.0 - phase).rem_euclid(1000.0) as u64;
    }
}

fn both(run: &Run) -> (Heard, Heard, Heard) {
    let (mut own, mut host, mut rough) = <(Heard, Heard, Heard)>::default();
    let timeline = simavr_timed(&image(), run, |byte| own.push(byte)).expect("it runs");
    native(run, &timeline, |byte| host.push(byte));
    let constant = Timeline {
        recorded: Vec::new(),
        ..timeline
    };
    native(run, &constant, |byte| rough.push(byte));
    (own, host, rough)
}

/// Requests end half a millisecond away from the board's millisecond: what happens within the same few microseconds is
/// done in the order in which a turn of the main loop finds it, which no host could know.
fn apart(run: &Run) -> Run {
    let alone = Run {
        seconds: 1.0,
        requests: Vec::new(),
        ..run.clone()
    };
    let start = simavr_timed(&image(), &alone, |_| ControlFlow::Continue(()))
        .expect("it runs")
        .start;
    let mut run = run.clone();
    for request in &mut run.requests {
        // Cycles of 1/16 us; the board's first speed is UBRR = 25.
        let line = wire::Request::FRAME_LEN as u64 * 10 * 16 * 26;
        let end = request.at_us * 16 + line;
        let late = (end + 16_000 - start % 16_000) % 16_000;
        request.at_us += (16_000 + 8_000 - late) % 16_000 / 16;
    }
    run
}

/// Compares the two; what the image said.
fn compare(run: &Run) -> Heard {
    let (own, host, rough) = both(&apart(run));
    assert_eq!(own.link().rejected(), 0);
    let heard = own;
    let (own, host, rough) = (masked(&heard), masked(&host), masked(&rough));
    for (n, (a, b)) in own.iter().zip(&host).enumerate() {
        assert_eq!(a.0, b.0, "frame {n} of the image, then of the host");
        assert_eq!(a.1, b.1);
    }
    assert!(
        own.len().abs_diff(host.len()) <= 1,
        "{} and {} frames",
        own.len(),
        host.len()
    );
    let other = own.iter().zip(&rough).filter(|(a, b)| a.1 != b.1).count();
    println!(
        "{} frames, all bytes the same; with the first tick's instants in every tick {other} differ",
        own.len()
    );
    heard
}

#[test]
fn a_lively_stand_with_the_motor_driven() {
    let mut run = run(Scenario::lively(3), 200.0);
    run.requests = duty_profile(&[(2.0, 150), (20.0, -200), (40.0, 60), (150.0, 255)], 190.0);
    between_milliseconds(&mut run);
    compare(&run);
}

#[test]
fn a_stand_with_one_of_each_fault() {
    let scenario = Scenario::lively(4)
        .with(Fault::Tempco {
            gyro: 0,
            dps_per_c: 0.1,
            dps_per_c2: 0.0,
        })
        .with(Fault::Vibration {
            axis: 1,
            frequency_hz: 3.3,
            amplitude_dps: 0.2,
            linear_g: 0.02,
        })
        .with(Fault::Stall {
            gyro: 2,
            count: 5,
            length_s: 0.3,
            flags: StallFlags::NewDataClear,
        })
        .with(Fault::DeadSpi {
            gyro: 1,
            start_s: 20.0,
            end_s: 22.0,
            level: false,
        })
        .with(Fault::DeadSpi {
            gyro: 0,
            start_s: 30.0,
            end_s: 31.0,
            level: true,
        })
        .with(Fault::Glitches {
            gyro: 0,
            count: 9,
            height_dps: 40.0,
        });
    compare(&run(scenario, 60.0));
}

#[test]
fn a_host_that_asks_for_everything() {
    let mut run = run(Scenario::lively(5), 60.0);
    let asked = [
        Command::Ping,
        Command::BiasNull { samples: 50 },
        Command::Arm { nonce: 0 },
        Command::ReadRegister {
            gyro: Axis::Y,
            address: 0x38,
        },
        Command::WriteRegister {
            gyro: Axis::Z,
            address: 0x36,
            value: 1,
        },
        Command::SetAccRange { range: 2 },
        Command::SetGyro {
            range: 2,
            filter: 4,
        },
        Command::SetBias {
            axis: Axis::X,
            value: 12_345,
        },
        Command::SetScale {
            axis: Axis::Z,
            value: 1_200_000,
        },
        Command::Counters,
        Command::StoreConfig,
        Command::MotorDuty { duty: 10 },
        Command::SelfTest {
            sensor: Sensor::GyroX,
        },
        Command::DefaultConfig,
        Command::LoadConfig,
        Command::SetRate {
            period_ticks: 5_000,
            periods_per_sample: 1,
        },
        Command::SetRate {
            period_ticks: 50_000,
            periods_per_sample: 2,
        },
        Command::SetRate {
            period_ticks: 12_500,
            periods_per_sample: 1,
        },
        Command::ClearCounters,
    ];
    run.requests = (0..)
        .zip(asked)
        .map(|(n, command)| at(2.0 + 3.1 * f64::from(n), n, command))
        .collect();
    between_milliseconds(&mut run);
    compare(&run);
}

/// With a correction in use the image and its logic on the host correct alike, while the stand rests and while it is turned.
#[test]
fn a_board_that_corrects() {
    let mut run = run(Scenario::lively(6), 120.0);
    let correction = wire::correction::Correction {
        number: 0x1234,
        block_shift: 4,
        sens_avg: 0x0402,
        temp_range: [-60, 60],
        bias: [0.3, -0.2, 0.05],
        temperature: [0.004, -0.002, 0.0],
        temperature_squared: [1e-5, 0.0, -2e-5],
        motor: [1e-3, 0.0, -5e-4],
        motor_magnitude: [0.0, 2e-3, 0.0],
        motor_turning: [0.2, 0.0, -0.03],
        supply: [1e-4, 0.0, -2e-4],
        acc: [[1e-4, 0.0, -1e-4]; 3],
        matrix: [[0.01, -0.02, 0.03], [0.0, 0.004, 0.0], [-0.01, 0.0, 0.002]],
        noise: [0.01; 3],
        walk: [1e-6; 3],
        ..wire::correction::Correction::default()
    };
    let numbers = correction.numbers().expect("they fit");
    let rows = (0..).zip(numbers.chunks_exact(3)).map(|(row, three)| {
        let values = [three[0], three[1], three[2]];
        Command::SetCorrection { row, values }
    });
    let seal = Command::SetCorrection {
        row: wire::correction::ROWS as u8,
        values: wire::correction::crc_row(&numbers),
    };
    let get = |row| Command::GetCorrection { other: false, row };
    run.requests = (0u16..)
        .zip(rows.chain([seal, get(0), get(17)]))
        .map(|(n, command)| at(2.0 + 0.3 * f64::from(n), 1000 + n, command))
        .collect();
    run.requests
        .extend(duty_profile(&[(30.0, 150), (50.0, -200), (70.0, 0)], 80.0));
    between_milliseconds(&mut run);
    let own = compare(&run);
    let corrected = own.frames.iter().filter_map(|(_, frame)| match frame {
        Frame::Corrected(corrected) => Some(*corrected),
        _ => None,
    });
    // From the CRC on, one for each sample.
    let corrected: Vec<_> = corrected.collect();
    assert!(corrected.len() > 2200, "{}", corrected.len());
    assert!(corrected.iter().all(|c| c.correction == 0x1234));
    let applied = wire::correction_state::APPLIED | wire::correction_state::FILTERED;
    assert_eq!(corrected[2000].state & applied, applied);
}
