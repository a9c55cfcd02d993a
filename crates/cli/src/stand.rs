//! The simulated stand as a source of captures: a scenario of the bench, the firmware on it (its image in a simulated
//! ATmega16, or its logic on the host), and the frames.

use std::ops::ControlFlow;

use bench::scenario::StallFlags;
use bench::{Fault, Run, Scenario, SerialByte, Timeline, duty_profile, uniform};
use model::record::Record;
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wire::{Decoder, Frame, LinkCounts};

use crate::RecordBuilder;
use crate::capture::Calibration;

/// What plays the board.
pub enum Board {
    /// The firmware's logic on the host.
    Native,
    /// Its image, an ELF file's bytes, on a simulated ATmega16.
    #[cfg(feature = "simavr")]
    Image(Vec<u8>),
}

/// What can be wrong with the simulated stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Hidden {
    /// One of those below, drawn from the seed.
    Random,
    /// Nothing.
    None,
    /// A gyro's bias follows its temperature.
    Tempco,
    /// The motor's current couples into a gyro.
    MotorCoupling,
    /// A gyro follows a supply that sags.
    SupplyCoupling,
    /// A machine shakes the base.
    Vibration,
    /// The mount is knocked.
    Knock,
    /// A gyro repeats its samples.
    Stall,
}

/// A run of the simulated stand.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What the bench runs.
    pub run: Run,
    /// What was hidden, in words.
    pub hidden: String,
    /// The gyro it was hidden in, 0, 1, 2; `None` where nothing was.
    pub channel: Option<usize>,
}

/// Plans a run: a sound stand in a lively environment, the motor spinning free in steps (the belt is off, so the table
/// stays at rest), and one thing wrong. Sizes are drawn from ranges that a 600-s run can show.
#[must_use]
pub fn plan(hidden: Hidden, seconds: f64, seed: u64) -> Plan {
    // A stream beside the bench's own, which is seeded by `seed` too.
    let rng = &mut Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x9e37_79b9_7f4a_7c15);
    let mut scenario = Scenario::lively(seed);
    scenario.seconds = seconds;
    let hidden = if hidden == Hidden::Random {
        const ALL: [Hidden; 6] = [
            Hidden::Tempco,
            Hidden::MotorCoupling,
            Hidden::SupplyCoupling,
            Hidden::Vibration,
            Hidden::Knock,
            Hidden::Stall,
        ];
        ALL[(uniform(rng, 0.0, 6.0) as usize).min(5)]
    } else {
        hidden
    };
    let gyro = (uniform(rng, 0.0, 3.0) as usize).min(2);
    let sign = if uniform(rng, 0.0, 1.0) < 0.5 {
        -1.0
    } else {
        1.0
    };
    let fault = match hidden {
        Hidden::None | Hidden::Random => None,
        Hidden::Tempco => {
            // A slope needs a swing: the heater cycles.
            scenario.thermal.heater_c = uniform(rng, 8.0, 15.0);
            scenario.thermal.heater_period_s = uniform(rng, 100.0, 250.0);
            let dps_per_c = sign * uniform(rng, 0.06, 0.15);
            Some(Fault::Tempco {
                gyro,
                dps_per_c,
                dps_per_c2: 0.0,
            })
        }
        Hidden::MotorCoupling => Some(Fault::MotorCoupling {
            gyro,
            dps_per_amp: sign * uniform(rng, 0.6, 2.0),
        }),
        Hidden::SupplyCoupling => Some(Fault::SupplyCoupling {
            gyro,
            dps_per_volt: sign * uniform(rng, 2.0, 5.0),
        }),
        Hidden::Vibration => Some(Fault::Vibration {
            axis: gyro,
            frequency_hz: uniform(rng, 0.8, 9.0),
            amplitude_dps: uniform(rng, 0.06, 0.2),
            linear_g: uniform(rng, 0.0, 0.05),
        }),
        Hidden::Knock => Some(Fault::Knock {
            gyro,
            time_s: seconds * uniform(rng, 0.25, 0.75),
            step_dps: sign * uniform(rng, 0.3, 0.8),
            tilt_deg: uniform(rng, 0.0, 1.0),
        }),
        Hidden::Stall => Some(Fault::Stall {
            gyro,
            count: 15 + uniform(rng, 0.0, 25.0) as usize,
            length_s: uniform(rng, 0.1, 0.4),
            flags: StallFlags::NewDataClear,
        }),
    };
    let words = fault
        .as_ref()
        .map_or_else(|| "nothing".to_owned(), |fault| format!("{fault:?}"));
    let channel = fault.as_ref().map(|_| gyro);
    scenario.faults.extend(fault);
    let mut steps = vec![];
    let mut at = 10.0;
    while at < seconds - 5.0 {
        steps.push((at, uniform(rng, -255.0, 256.0) as i16));
        at += uniform(rng, 8.0, 30.0);
    }
    let requests = duty_profile(&steps, seconds);
    Plan {
        run: Run {
            scenario,
            seconds,
            requests,
        },
        hidden: words,
        channel,
    }
}

/// What a host makes of a run's bytes.
struct Receiver<F> {
    decoder: Decoder,
    builder: RecordBuilder,
    progress: F,
}

impl<F: FnMut(f64)> Receiver<F> {
    fn new(progress: F) -> Self {
        Receiver {
            decoder: Decoder::new(),
            builder: RecordBuilder::new(Calibration::default()),
            progress,
        }
    }

    fn push(&mut self, received: SerialByte) -> ControlFlow<()> {
        match self.decoder.push(received.byte) {
            Some(Ok(Frame::Sample(sample))) => {
                self.builder.push(&sample, received.time_s);
                (self.progress)(received.time_s);
            }
            Some(Ok(Frame::Hello(hello))) => self.builder.hello(&hello),
            _ => {}
        }
        ControlFlow::Continue(())
    }

    fn finish(self) -> (Record, LinkCounts) {
        (self.builder.build(), *self.decoder.counts())
    }
}

/// Runs the firmware's logic on the planned stand; `progress` is told the time, s.
pub fn run_native(plan: &Plan, progress: impl FnMut(f64)) -> (Record, LinkCounts) {
    let mut receiver = Receiver::new(progress);
    bench::native(&plan.run, &Timeline::default(), |byte| receiver.push(byte));
    receiver.finish()
}

/// Runs an image of the firmware (an ELF file's bytes) on a simulated ATmega16 on the planned stand; `progress` is told
/// the time, s.
///
/// # Errors
/// [`SimavrError`](bench::simavr::SimavrError) for what is no image of an ATmega16, and for an image that stops.
#[cfg(feature = "simavr")]
pub fn run_image(
    plan: &Plan,
    image: &[u8],
    progress: impl FnMut(f64),
) -> Result<(Record, LinkCounts), bench::simavr::SimavrError> {
    let mut receiver = Receiver::new(progress);
    bench::simavr::simavr(image, &plan.run, |byte| receiver.push(byte))?;
    Ok(receiver.finish())
}
