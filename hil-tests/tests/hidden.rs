//! Something is hidden in the stand by physics, the image in the simulated ATmega16 samples it, and the diagnosis gets
//! the capture file alone. Drawn fresh at each run; `IMU_STAND_SEED` replays a run, `IMU_STAND_IMAGE_DRAWS` sets how many.
//!
//! Many draws are graded through the firmware's logic on the host (crates/cli/tests/hidden_effect.rs). Here a few go
//! through the image: each has to lead to the same words as the same draw on the
//! host, asked at the same instants, and what was hidden has to be
//! named at a rate that an engine of 90 % would miss once in a thousand runs.

use std::ops::ControlFlow;

use analysis::DiagnoseOptions;
use analysis::result::Diagnosis;
use bench::simavr::simavr_timed;
use bench::{SerialByte, native};
use hil_tests::{generator, image, seed};
use imu_stand::ReadOptions;
use imu_stand::RecordBuilder;
use imu_stand::capture::Calibration;
use imu_stand::capture::{read_from, write_to};
use imu_stand::stand::{Hidden, plan};
use model::record::Record;
use wire::{Decoder, Frame, LinkCounts};

const NAMED: f64 = 0.90;
const CHANCE: f64 = 1e-3;

const FAULTS: [(Hidden, &[&str]); 7] = [
    (Hidden::None, &[]),
    (Hidden::Tempco, &["temperature"]),
    (Hidden::MotorCoupling, &["motor_bias"]),
    (Hidden::SupplyCoupling, &["supply_sensitivity"]),
    (Hidden::Vibration, &["line"]),
    (Hidden::Knock, &["bias_step"]),
    (Hidden::Stall, &["stale_samples"]),
];

/// P(X <= k) of a binomial.
fn at_most(k: usize, n: usize, p: f64) -> f64 {
    let mut term = (1.0 - p).powi(n as i32);
    let mut sum = term;
    for i in 0..k {
        term *= (n - i) as f64 / (i + 1) as f64 * p / (1.0 - p);
        sum += term;
    }
    sum.min(1.0)
}

/// Makes a record of a board's bytes.
struct Receiver {
    decoder: Decoder,
    builder: RecordBuilder,
}

impl Receiver {
    fn new() -> Self {
        Receiver {
            decoder: Decoder::new(),
            builder: RecordBuilder::new(Calibration::default()),
        }
    }

    fn push(&mut self, received: SerialByte) -> ControlFlow<()> {
        match self.decoder.push(received.byte) {
            Some(Ok(Frame::Sample(sample))) => self.builder.push(&sample, received.time_s),
            Some(Ok(Frame::Hello(hello))) => self.builder.hello(&hello),
            _ => {}
        }
        ControlFlow::Continue(())
    }

    fn finish(self) -> (Record, LinkCounts) {
        (self.builder.build(), *self.decoder.counts())
    }
}

/// What the diagnosis says of the capture file of a record.
fn diagnosed(record: &Record, seed: u64) -> Diagnosis {
    let mut file = Vec::new();
    write_to(&mut file, record).expect("memory takes it");
    let read = read_from(file.as_slice(), &ReadOptions::default()).expect("it is a capture");
    let options = DiagnoseOptions {
        seed,
        file: "hidden.csv".into(),
        hash: None,
    };
    analysis::diagnose(&read.record, &options)
        .expect("600 s are enough")
        .diagnosis
}

fn words(diagnosis: &Diagnosis) -> Vec<String> {
    (diagnosis.findings.iter())
        .map(|f| format!("{} on {}", f.cause, f.channels.join("+")))
        .collect()
}

/// Draws, runs, diagnoses; whether what was hidden has been named.
fn is_named(draw: u64, seed: u64, image: &[u8]) -> bool {
    let own = seed.wrapping_add(0x9e37_79b9_7f4a_7c15u64.wrapping_mul(draw + 1));
    let which = (bench::uniform(&mut generator(!own), 0.0, 7.0) as usize).min(6);
    let (hidden, causes) = FAULTS[which];
    let plan = plan(hidden, 600.0, own);
    let (mut through, mut host) = (Receiver::new(), Receiver::new());
    let timeline = simavr_timed(image, &plan.run, |byte| through.push(byte)).expect("it runs");
    let (record, link) = through.finish();
    assert_eq!(link.rejected(), 0, "every frame arrives in order");
    assert!(
        (11_980..=12_000).contains(&record.len()),
        "{}",
        record.len()
    );
    let found = diagnosed(&record, own);
    native(&plan.run, &timeline, |byte| host.push(byte));
    let on_host = diagnosed(&host.finish().0, own);
    println!(
        "draw {draw}: hidden {}; said {}",
        plan.hidden,
        words(&found).join(", ")
    );
    assert_eq!(
        words(&found),
        words(&on_host),
        "the image, then the same draw on the host"
    );
    let channel = plan
        .channel
        .map(|axis| ["gyro_x", "gyro_y", "gyro_z"][axis]);
    let is_it = |finding: &analysis::result::Finding| {
        channel.is_some_and(|channel| finding.channels.iter().any(|c| c == channel))
            && std::iter::once(finding.cause.as_str())
                .chain(
                    finding
                        .alternatives
                        .iter()
                        .map(|rival| rival.cause.as_str()),
                )
                .any(|name| causes.contains(&name))
    };
    match causes {
        [] => found.findings.is_empty(),
        _ => found.findings.iter().any(is_it),
    }
}

#[test]
fn what_is_hidden_in_the_stand_is_named_through_the_image() {
    let draws: u64 = std::env::var("IMU_STAND_IMAGE_DRAWS").map_or(4, |text| {
        text.parse().expect("IMU_STAND_IMAGE_DRAWS is a number")
    });
    let seed = seed();
    let image = image();
    let workers = 2;
    let named: usize = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..workers)
            .map(|worker| {
                let image = &image;
                scope.spawn(move || {
                    (worker..draws)
                        .step_by(workers as usize)
                        .filter(|&draw| is_named(draw, seed, image))
                        .count()
                })
            })
            .collect();
        (workers.into_iter())
            .map(|worker| worker.join().expect("every draw runs"))
            .sum()
    });
    println!("named {named} of {draws}");
    assert!(
        at_most(named, draws as usize, NAMED) > CHANCE,
        "named {named} of {draws}"
    );
}
