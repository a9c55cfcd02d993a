//! The simulated stand as a source of captures: a scenario of the bench, the firmware on it (its image in a simulated
//! ATmega16, or its logic on the host), and the frames.

use std::ops::ControlFlow;

use bench::{Run, Scenario, SerialByte, Timeline, duty_profile, native_live};
use model::file::ModelFile;
use model::record::Record;
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wire::{Decoder, Frame, LinkCounts};

use crate::RecordBuilder;
use crate::capture::Calibration;

mod fitted;
mod hidden;
mod history;
mod line;
pub mod planted;

pub use fitted::{Carried, FittedError};
pub use hidden::{Hidden, Sizes};
pub use history::{another_history, course, without_defects, without_errors};
pub use line::Simulated;

/// What plays the board.
#[derive(Clone)]
pub enum Board {
    /// The firmware's logic on the host.
    Native,
    /// Its image, an ELF file's bytes, on a simulated ATmega16.
    #[cfg(feature = "simavr")]
    Image(Vec<u8>),
}

/// Why a board stops before its time: its image does not load, or has stopped.
#[cfg(feature = "simavr")]
pub type Stopped = bench::simavr::SimavrError;
/// Why a board stops before its time: what runs on the host never does.
#[cfg(not(feature = "simavr"))]
pub type Stopped = std::convert::Infallible;

impl Board {
    /// Plays a run, which `listen` may send bytes to each simulated millisecond, until it is over or `receive` breaks off.
    ///
    /// # Errors
    /// [`Stopped`].
    pub fn live(
        &self,
        run: &Run,
        listen: impl FnMut(f64) -> Vec<u8>,
        receive: impl FnMut(SerialByte) -> ControlFlow<()>,
    ) -> Result<(), Stopped> {
        match self {
            Board::Native => {
                native_live(run, &Timeline::default(), listen, receive);
            }
            #[cfg(feature = "simavr")]
            Board::Image(image) => {
                bench::simavr::simavr_live(image, run, listen, receive)?;
            }
        }
        Ok(())
    }
}

/// A run of the simulated stand.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What the bench runs.
    pub run: Run,
    /// What was hidden, in words.
    pub hidden: String,
    /// The gyro it was hidden in, 0, 1, 2; `None` where nothing was, or where it is in all.
    pub channel: Option<usize>,
}

/// What a run is drawn from. One number for all three gives the same run as ever; apart, one stand can be recorded again and
/// again, or the same fault be planted in many.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seeds {
    /// Parts and surroundings: noise and turn-on bias of each gyro, room, heater, supply, floor.
    pub stand: u64,
    /// What is hidden, where and how large, and the course of the motor.
    pub fault: u64,
    /// Every reading's noise and all that comes at random while the run lasts.
    pub noise: u64,
}

impl From<u64> for Seeds {
    fn from(seed: u64) -> Self {
        Self {
            stand: seed,
            fault: seed,
            noise: seed,
        }
    }
}

impl Seeds {
    /// A stream beside the bench's own.
    fn beside(self) -> Xoshiro256PlusPlus {
        Xoshiro256PlusPlus::seed_from_u64(self.fault ^ 0x9e37_79b9_7f4a_7c15)
    }

    /// A sound stand of that length.
    fn sound(self, seconds: f64) -> Scenario {
        let mut scenario = Scenario::lively(self.stand);
        // Its parts are drawn; from here on the seed is that of what happens to them.
        scenario.seed = self.noise;
        scenario.seconds = seconds;
        scenario
    }
}

/// Plans a run: a sound stand in a lively environment, the motor spinning free in steps (the belt is off, so the table
/// stays at rest), and one thing wrong.
#[must_use]
pub fn plan(hidden: Hidden, sizes: Sizes, seconds: f64, seeds: impl Into<Seeds>) -> Plan {
    let seeds = seeds.into();
    let rng = &mut seeds.beside();
    let mut scenario = seeds.sound(seconds);
    let channel = hidden::plant(hidden, sizes, &mut scenario, rng);
    let run = driven(scenario, rng);
    let what: Vec<String> = (planted::planted(&run, 0.0).into_iter())
        .map(|planted| planted.what)
        .collect();
    let hidden = if what.is_empty() {
        "nothing".to_owned()
    } else {
        what.join("; ")
    };
    Plan {
        run,
        hidden,
        channel,
    }
}

/// Plans a run in the same lively environment, on parts that have the errors of a model file, with a list of what of it
/// the stand has.
///
/// # Errors
/// [`FittedError`] where the model is not of this stand's gyros.
pub fn plan_fitted(
    model: &ModelFile,
    seconds: f64,
    seeds: impl Into<Seeds>,
) -> Result<(Plan, Carried), FittedError> {
    let seeds = seeds.into();
    let rng = &mut seeds.beside();
    let mut scenario = seeds.sound(seconds);
    let carried = fitted::onto(model, &mut scenario)?;
    let plan = Plan {
        run: driven(scenario, rng),
        hidden: carried.over.join(", "),
        channel: None,
    };
    Ok((plan, carried))
}

/// The run of a scenario, the motor spinning free in steps.
fn driven(scenario: Scenario, rng: &mut Xoshiro256PlusPlus) -> Run {
    let seconds = scenario.seconds;
    let requests = duty_profile(&history::steps(rng, 10.0, seconds), seconds);
    Run {
        scenario,
        seconds,
        requests,
    }
}

/// What a host makes of a run's bytes.
pub struct Receiver<F> {
    decoder: Decoder,
    builder: RecordBuilder,
    progress: F,
}

impl<F: FnMut(f64)> Receiver<F> {
    /// `progress` is told the time of each sample, s.
    pub fn new(progress: F) -> Self {
        Receiver {
            decoder: Decoder::new(),
            builder: RecordBuilder::new(Calibration::default()),
            progress,
        }
    }

    /// Takes a byte; it always wants another.
    pub fn push(&mut self, received: SerialByte) -> ControlFlow<()> {
        match self.decoder.push(received.byte) {
            Some(Ok(Frame::Sample(sample))) => {
                self.builder.push(&sample, received.time_s);
                (self.progress)(received.time_s);
            }
            Some(Ok(Frame::Corrected(corrected))) => self.builder.corrected(&corrected),
            Some(Ok(Frame::Hello(hello))) => self.builder.hello(&hello),
            _ => {}
        }
        ControlFlow::Continue(())
    }

    /// The record, and what the line did to its frames.
    pub fn finish(self) -> (Record, LinkCounts) {
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

/// As [`run_image`], and the traces of the board's pins within a span of the run, s, as a value change dump.
///
/// # Errors
/// As [`run_image`].
#[cfg(feature = "simavr")]
pub fn run_image_traced(
    plan: &Plan,
    image: &[u8],
    span: [f64; 2],
    progress: impl FnMut(f64),
) -> Result<(Record, LinkCounts, String), bench::simavr::SimavrError> {
    let mut receiver = Receiver::new(progress);
    let vcd = bench::simavr::simavr_traced(image, &plan.run, span, |byte| receiver.push(byte))?;
    let (record, counts) = receiver.finish();
    Ok((record, counts, vcd.text()))
}
