//! The real image on a simulated ATmega16, or on a real board: what the tests share.

pub mod calls;
pub mod guarded;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use bench::simavr::{SimavrError, simavr};
use bench::{Run, Scenario, SerialByte, TimedRequest};
use wire::{Command, Decoder, Frame, Health, Hello, LinkCounts, Reply, Request, Sample};

/// Where the image is: `IMU_STAND_IMAGE`, else where `cargo xtask image` puts it.
#[must_use]
pub fn image_path() -> PathBuf {
    std::env::var_os("IMU_STAND_IMAGE").map_or_else(
        || {
            Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("../target/avr/avr-none/firmware/firmware.elf")
        },
        PathBuf::from,
    )
}

/// The image.
///
/// # Panics
/// Without one: a missing image is a failure, never a test that is left out.
#[must_use]
pub fn image() -> Vec<u8> {
    let path = image_path();
    std::fs::read(&path).unwrap_or_else(|error| {
        panic!(
            "{}: {error}: build the image with `cargo xtask image`",
            path.display()
        )
    })
}

/// A scenario of a length, without requests.
#[must_use]
pub fn run(mut scenario: Scenario, seconds: f64) -> Run {
    scenario.seconds = seconds;
    Run {
        scenario,
        seconds,
        requests: Vec::new(),
    }
}

/// A request at `at_s` seconds since power came on.
#[must_use]
pub fn at(at_s: f64, number: u16, command: Command) -> TimedRequest {
    TimedRequest {
        at_us: (at_s * 1e6) as u64,
        request: Request { number, command },
    }
}

/// What a host has heard.
#[derive(Default)]
pub struct Heard {
    decoder: Decoder,
    /// Frames with the time of their last byte, s since power came on.
    pub frames: Vec<(f64, Frame)>,
}

impl Heard {
    /// Takes a byte.
    pub fn push(&mut self, byte: SerialByte) -> ControlFlow<()> {
        if let Some(Ok(frame)) = self.decoder.push(byte.byte) {
            self.frames.push((byte.time_s, frame));
        }
        ControlFlow::Continue(())
    }

    /// The line's own counts.
    #[must_use]
    pub fn link(&self) -> LinkCounts {
        *self.decoder.counts()
    }

    /// Samples with their times.
    pub fn samples(&self) -> impl Iterator<Item = (f64, Sample)> + '_ {
        self.frames.iter().filter_map(|(t, frame)| match frame {
            Frame::Sample(sample) => Some((*t, *sample)),
            _ => None,
        })
    }

    /// Replies with their times.
    pub fn replies(&self) -> impl Iterator<Item = (f64, Reply)> + '_ {
        self.frames.iter().filter_map(|(t, frame)| match frame {
            Frame::Reply(reply) => Some((*t, *reply)),
            _ => None,
        })
    }

    /// Hello frames with their times.
    pub fn hellos(&self) -> impl Iterator<Item = (f64, Hello)> + '_ {
        self.frames.iter().filter_map(|(t, frame)| match frame {
            Frame::Hello(hello) => Some((*t, *hello)),
            _ => None,
        })
    }

    /// Health frames with their times.
    pub fn healths(&self) -> impl Iterator<Item = (f64, Health)> + '_ {
        self.frames.iter().filter_map(|(t, frame)| match frame {
            Frame::Health(health) => Some((*t, *health)),
            _ => None,
        })
    }

    /// The last health frame.
    ///
    /// # Panics
    /// Where there is none.
    #[must_use]
    pub fn last_health(&self) -> Health {
        self.healths().last().expect("a health frame each second").1
    }
}

/// Runs the image and hears it out.
///
/// # Errors
/// An image that cannot be loaded, or one that stops.
pub fn hear(run: &Run) -> Result<Heard, SimavrError> {
    let mut heard = Heard::default();
    simavr(&image(), run, |byte| heard.push(byte))?;
    Ok(heard)
}

/// The seed of a test that draws: fresh, printed, and replayed by `IMU_STAND_SEED`.
///
/// # Panics
/// For a seed that is no number.
#[must_use]
pub fn seed() -> u64 {
    use std::hash::{BuildHasher, Hasher};
    let seed = std::env::var("IMU_STAND_SEED").map_or_else(
        |_| std::hash::RandomState::new().build_hasher().finish(),
        |text| {
            text.parse()
                .unwrap_or_else(|_| panic!("IMU_STAND_SEED is no number: {text}"))
        },
    );
    println!("IMU_STAND_SEED={seed}");
    seed
}

/// A generator of a seed.
#[must_use]
pub fn generator(seed: u64) -> rand_xoshiro::Xoshiro256PlusPlus {
    rand_core::SeedableRng::seed_from_u64(seed)
}
